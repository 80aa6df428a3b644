"""Spheres, cones and cylinders against brute force in float64."""

import pickle
import warnings

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh, rays
from oracle import Oracle

SCALES = [1e-6, 1.0, 1e6]
#: A ray this close to a tangent or a rim, as a share of the distances that enter, is left undecided.
UNSURE = 1e-9


def spheres(rng, count, scale):
    centers = (scale * rng.uniform(-0.5, 0.5, (count, 3))).astype(np.float32)
    return centers, (scale * rng.uniform(0.01, 0.2, count)).astype(np.float32)


def cones(rng, count, scale):
    """Base, apex, their radii: frustums, cylinders, and tips at either end."""
    base = (scale * rng.uniform(-0.5, 0.5, (count, 3))).astype(np.float32)
    apex = (base + scale * rng.normal(0, 0.2, (count, 3))).astype(np.float32)
    radii = (scale * rng.uniform(0.01, 0.15, (2, count))).astype(np.float32)
    radii[1, ::4] = radii[0, ::4]
    radii[1, 1::4] = 0
    radii[0, 2::4] = 0
    return base, apex, *radii


def first_in_range(t, sure, t_min, t_max):
    """The smallest of some parameters that is in the range once rounded; NaN is none."""
    with np.errstate(all="ignore"):
        t = np.sort(t.astype(np.float32), axis=0)
    t = np.where((t >= np.float32(t_min)) & (t <= np.float32(t_max)), t, np.inf)
    return t.min(axis=0), sure.all(axis=1)


def of_spheres(centers, radii, origins, directions, t_min=0.0, t_max=np.inf):
    """First parameters, a row a ray, and whether all of a row are beyond doubt.

    With p the point of the ray nearest to the centre, the half chord is sqrt(r^2 - |p|^2) long.
    """
    o, d = (np.asarray(x, np.float32).astype(np.float64)[:, None] for x in (origins, directions))
    c, r = np.float32(centers).astype(np.float64)[None], np.float32(radii).astype(np.float64)[None]
    square = (d * d).sum(axis=2)
    middle = ((c - o) * d).sum(axis=2) / square
    across = np.linalg.norm((c - o) - middle[..., None] * d, axis=2)
    with np.errstate(invalid="ignore"):
        half = np.sqrt((r - across) * (r + across) / square)
    sure = np.abs(across - r) > UNSURE * (np.linalg.norm(c - o, axis=2) + r)
    return first_in_range(np.stack([middle - half, middle + half]), sure, t_min, t_max)


def of_cones(base, apex, radius, tip, origins, directions, t_min=0.0, t_max=np.inf):
    """The same for cones: points of the ray at distance radius(s) from the axis, at shares s of it in 0 to 1."""
    o, d = (np.asarray(x, np.float32).astype(np.float64)[:, None] for x in (origins, directions))
    a, b = (np.float32(x).astype(np.float64)[None] for x in (base, apex))
    r, end = (np.float32(x).astype(np.float64)[None] for x in (radius, tip))
    axis = b - a
    length = (axis * axis).sum(axis=2)
    # From the point of the ray that is nearest to the middle of the axis.
    middle = 0.5 * (a + b)
    shift = ((middle - o) * d).sum(axis=2) / (d * d).sum(axis=2)
    p = o + shift[..., None] * d - a
    s0, s1 = (p * axis).sum(axis=2) / length, (d * axis).sum(axis=2) / length
    p0, p1 = p - s0[..., None] * axis, d - s1[..., None] * axis
    r0, r1 = r + s0 * (end - r), s1 * (end - r)
    qa, qb, qc = (p1 * p1).sum(2) - r1 * r1, (p0 * p1).sum(2) - r0 * r1, (p0 * p0).sum(2) - r0 * r0
    square = qb * qb - qa * qc
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(square)
        q = -(qb + np.where(qb < 0, -root, root))
        tau = np.stack([q / qa, qc / q])
        share = s0 + tau * s1
        inside = (share >= 0) & (share <= 1)
        near = (np.abs(share) < UNSURE) | (np.abs(share - 1) < UNSURE)
    sure = np.abs(square) > UNSURE * (qb * qb + np.abs(qa * qc))
    sure &= ~near.any(axis=0)
    sure &= np.abs(qa) > UNSURE * (p1 * p1).sum(axis=2)
    return first_in_range(np.where(inside, shift + tau, np.nan), sure, t_min, t_max)


def compare(t, expected, scale):
    """The same rays hit, at parameters that differ by rounding alone."""
    np.testing.assert_array_equal(np.isfinite(t), np.isfinite(expected))
    found = np.isfinite(t)
    np.testing.assert_allclose(t[found], expected[found], rtol=3e-7, atol=0)


KINDS = {"spheres": (spheres, of_spheres, ropewalk.Spheres), "cones": (cones, of_cones, ropewalk.Cones)}


def case(kind, scale, seed=0, **ranges):
    make, brute, made = KINDS[kind]
    rng = np.random.default_rng([int(np.log10(scale)) + 9, seed])
    numbers = make(rng, 90, scale)
    origins, directions = rays(rng, 4000, scale)
    t, sure = brute(*numbers, origins, directions, **ranges)
    assert sure.mean() > 0.8, "the oracle leaves too much open"
    scene = ropewalk.Scene.from_meshes([made(*numbers)], preset="best")
    return scene, origins[sure], directions[sure], t[sure]


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("kind", KINDS)
def test_every_query(kind, scale):
    scene, origins, directions, t = case(kind, scale)
    hits = scene.closest_hit(origins, directions)
    assert hits.hit.sum() > 500 and (~hits.hit).sum() > 500
    compare(hits.t, t.min(axis=1), scale)
    prim = t.argmin(axis=1)
    ties = np.sort(t, axis=1)
    clear = hits.hit & (ties[:, 1] > ties[:, 0] * (1 + 1e-6))
    assert clear.sum() > 500
    np.testing.assert_array_equal(hits.prim_id[clear], prim[clear])
    np.testing.assert_array_equal(scene.occluded(origins, directions), hits.hit)
    counts = np.isfinite(t).sum(axis=1)
    np.testing.assert_array_equal(scene.count_hits(origins, directions), counts)
    lists = scene.all_hits(origins, directions)
    np.testing.assert_array_equal(lists.counts, counts)
    np.testing.assert_allclose(lists.t, ties[np.isfinite(ties)], rtol=3e-7)
    rows = np.stack([lists.ray_id, lists.prim_id])
    assert len(np.unique(rows, axis=1).T) == len(lists), "a primitive twice on a ray"
    for k in (1, 2):
        some = scene.first_hits(origins, directions, k)
        np.testing.assert_array_equal(some.counts, np.minimum(counts, k))
        np.testing.assert_array_equal(some.t[some.offsets[:-1][hits.hit]], hits.t[hits.hit])
    # Without what is hit first.
    without = t.copy()
    without[np.arange(len(t)), hits.prim_id] = np.where(hits.hit, np.inf, without[np.arange(len(t)), -1])
    compare(scene.closest_hit(origins, directions, skip=hits).t, without.min(axis=1), scale)


@pytest.mark.parametrize("kind", KINDS)
def test_ranges(kind):
    for t_min, t_max in ((0.02, 0.3), (-1.0, 0.1)):
        scene, origins, directions, t = case(kind, 1.0, seed=1, t_min=t_min, t_max=t_max)
        assert np.isfinite(t).any()
        compare(scene.closest_hit(origins, directions, t_min, t_max).t, t.min(axis=1), 1.0)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("kind", KINDS)
def test_surface(kind, scale):
    scene, origins, directions, _ = case(kind, scale, seed=2)
    hits = scene.closest_hit(origins, directions)
    on, prim = hits.position[hits.hit].astype(np.float64), hits.prim_id[hits.hit]
    normal = hits.normal[hits.hit].astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)
    assert (hits.uv[hits.hit] == 0).all()
    rng = np.random.default_rng([int(np.log10(scale)) + 9, 2])
    if kind == "spheres":
        centers, radii = spheres(rng, 90, scale)
        out = on - centers[prim]
        np.testing.assert_allclose(np.linalg.norm(out, axis=1), radii[prim], atol=2e-6 * scale)
        assert (np.einsum("ij,ij->i", out, normal) > 0.99 * radii[prim]).all()
    else:
        base, apex, radius, tip = (x[prim].astype(np.float64) for x in cones(rng, 90, scale))
        axis = apex - base
        share = np.einsum("ij,ij->i", on - base, axis) / (axis * axis).sum(axis=1)
        out = on - base - share[:, None] * axis
        np.testing.assert_allclose(np.linalg.norm(out, axis=1), radius + share * (tip - radius), atol=3e-6 * scale)
        slant = apex - base + (tip - radius)[:, None] * out / np.linalg.norm(out, axis=1, keepdims=True)
        across = np.einsum("ij,ij->i", slant, normal) / np.linalg.norm(slant, axis=1)
        away = np.linalg.norm(out, axis=1) > 1e-2 * scale
        assert np.abs(across[away]).max() < 1e-3
        assert (np.einsum("ij,ij->i", out, normal)[away] > 0).all()


def test_meshes_of_all_kinds(tmp_path):
    rng = np.random.default_rng(3)
    flat = random_mesh(rng, 60, 1.0)
    balls, sticks = spheres(rng, 40, 1.0), cones(rng, 30, 1.0)
    meshes = [ropewalk.Spheres(*balls), flat, ropewalk.Cones(*sticks), ropewalk.Spheres([], 1)]
    scene = ropewalk.Scene.from_meshes(meshes, masks=[1, 2, 4, 8])
    assert scene.mesh_sizes.tolist() == [40, 60, 30, 0] and len(scene) == 130
    assert scene.precision == "single" and scene.report.primitives == 130
    origins, directions = rays(rng, 4000, 1.0)
    ball, sure = of_spheres(*balls, origins, directions)
    stick, also = of_cones(*sticks, origins, directions)
    oracle = Oracle(flat[0][flat[1]], origins, directions)
    t = np.concatenate([ball, oracle.t, stick], axis=1)
    geom = np.repeat([0, 1, 2], [40, 60, 30])
    sure &= also & oracle.sure
    origins, directions, t = origins[sure], directions[sure], t[sure]
    path = tmp_path / "mixed.rope"
    scene.save(path)
    for one in (scene, ropewalk.Scene.open(path, verify=True), pickle.loads(pickle.dumps(scene))):
        for mask in (7, 1, 2, 4, 5):
            masked = np.where(mask >> geom & 1, t, np.inf)
            hits = one.closest_hit(origins, directions, masks=mask)
            compare(hits.t, masked.min(axis=1), 1.0)
            ties = np.sort(masked, axis=1)
            clear = hits.hit & (ties[:, 1] > ties[:, 0] * (1 + 1e-6))
            prim = masked.argmin(axis=1)[clear]
            np.testing.assert_array_equal(hits.geom_id[clear], geom[prim])
            starts = np.array([0, 40, 100])
            np.testing.assert_array_equal(hits.prim_id[clear], prim - starts[geom[prim]])
            counts = one.count_hits(origins, directions, masks=mask)
            np.testing.assert_array_equal(counts, np.isfinite(masked).sum(axis=1))
    for threads in (1, 2, 3):
        same = scene.closest_hit(origins, directions, threads=threads)
        np.testing.assert_array_equal(same.t, scene.closest_hit(origins, directions).t)


def test_what_such_scenes_refuse():
    scene = ropewalk.Scene.from_meshes([ropewalk.Spheres([[0, 0, 0]], 1)])
    with pytest.raises(ropewalk.ArgumentError, match="scene"):
        scene.closest_point([0, 0, 0])
    with pytest.raises(ropewalk.ArgumentError, match="both"):
        scene.closest_hit([0, 0, 3], [0, 0, -1], faces="front")
    walker = ropewalk.Walker(scene, [[0, 0, 0]])
    with pytest.raises(ropewalk.ArgumentError, match="Walker"):
        walker.advance([[0, 0, 1]])
    assert (scene.closest_hit([0, 0, 3], [0, 0, -1]).cell == -1).all()


def test_double_precision_and_rounding():
    balls = ropewalk.Spheres([[1e7, 0, 0]], 0.1)
    with pytest.raises(ropewalk.ArgumentError, match="move the scene") as caught:
        ropewalk.Scene.from_meshes([balls], precision="double")
    assert caught.value.argument == "precision"
    far = ropewalk.Spheres([[1e7 + 0.3, 0, 0]], 0.1)
    with pytest.warns(ropewalk.PrecisionWarning, match=r"meshes\[0\].*move the scene"):
        scene = ropewalk.Scene.from_meshes([far])
    assert scene.precision == "single"
    triangle = np.array([[1e7, 0, 0], [1e7 + 0.1, 0, 0], [1e7, 1, 0]])
    with pytest.warns(ropewalk.PrecisionWarning, match=r"meshes\[1\]\.vertices.*move the scene"):
        ropewalk.Scene.from_meshes([balls, (triangle, [[0, 1, 2]])])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ropewalk.Scene.from_meshes([ropewalk.Spheres([[1, 2, 3.3]], 1), ropewalk.Spheres([], [])])


def test_what_they_are():
    given = np.float64([[1, 2, 3], [4, 5, 6]])
    balls = ropewalk.Spheres(given, [1, 2])
    given[:] = 0
    np.testing.assert_array_equal(balls.centers, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_array_equal(balls.radii, [1, 2])
    assert len(balls) == 2 and repr(balls) == "<ropewalk.Spheres: 2 spheres>"
    assert not balls.centers.flags.writeable and not balls.radii.flags.writeable
    sticks = ropewalk.Cylinders(balls.centers, balls.centers + 1, 0.5)
    assert repr(sticks) == "<ropewalk.Cylinders: 2 cylinders>" and isinstance(sticks, ropewalk.Cones)
    np.testing.assert_array_equal(sticks.base_radius, sticks.apex_radius)
    np.testing.assert_array_equal(sticks.apex - sticks.base, np.ones((2, 3)))
    assert repr(pickle.loads(pickle.dumps(sticks))) == repr(sticks)
    assert ropewalk.Scene.from_meshes([ropewalk.Cones([[1, 1, 1]], [[1, 1, 1]], 1, 2)]).report.degenerate == 1
