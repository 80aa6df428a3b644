"""Every query against brute force."""

import numpy as np
import pytest

import ropewalk
from meshes import degenerate_mesh, grid_mesh, random_mesh, rays
from oracle import Oracle

MESHES = [random_mesh, degenerate_mesh, grid_mesh]
SCALES = [1e-6, 1.0, 1e6]
COUNT, RAYS = 120, 3000


def case(make, scale, seed=0, **ranges):
    """A scene, rays of which brute force is sure, and brute force."""
    rng = np.random.default_rng([MESHES.index(make), int(np.log10(scale)) + 9, seed])
    vertices, faces = make(rng, COUNT, scale)
    origins, directions = rays(rng, RAYS, scale)
    triangles = vertices[faces]
    sure = Oracle(triangles, origins, directions).sure
    assert sure.mean() > 0.7, "the oracle leaves too much open"
    origins, directions = origins[sure], directions[sure]
    oracle = Oracle(triangles, origins, directions, **ranges)
    assert oracle.hit.sum() > 500
    return ropewalk.Scene(vertices, faces, preset="best"), origins, directions, oracle


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("make", MESHES)
def test_closest_hit(make, scale):
    scene, origins, directions, oracle = case(make, scale)
    t, prim = oracle.closest()
    hits = scene.closest_hit(origins, directions)
    np.testing.assert_array_equal(hits.t, t)
    np.testing.assert_array_equal(hits.prim_id, prim)
    np.testing.assert_array_equal(hits.geom_id, np.where(prim < 0, -1, 0))
    np.testing.assert_array_equal(hits.hit, prim >= 0)
    np.testing.assert_array_equal(scene.occluded(origins, directions), prim >= 0)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("make", MESHES)
def test_all_first_and_count(make, scale):
    scene, origins, directions, oracle = case(make, scale)
    for k in (None, 0, 1, 3):
        expected = oracle.lists(k)
        if k is None:
            found = scene.all_hits(origins, directions)
        else:
            found = scene.first_hits(origins, directions, k)
        lengths = [len(row) for row in expected]
        np.testing.assert_array_equal(found.counts, lengths)
        np.testing.assert_array_equal(found.offsets, np.concatenate([[0], np.cumsum(lengths)]))
        np.testing.assert_array_equal(found.t, [t for row in expected for t, _ in row])
        np.testing.assert_array_equal(found.prim_id, [p for row in expected for _, p in row])
        np.testing.assert_array_equal(found.ray_id, np.repeat(np.arange(len(lengths)), lengths))
        assert (found.geom_id == 0).all()
    np.testing.assert_array_equal(scene.count_hits(origins, directions), oracle.hit.sum(axis=1))


@pytest.mark.parametrize("make", MESHES)
def test_ranges(make):
    rng = np.random.default_rng(5)
    scene, origins, directions, _ = case(make, 1.0)
    triangles = np.float32([scene_triangle for scene_triangle in triangles_of(scene)])
    t, _ = Oracle(triangles, origins, directions).closest()
    # Ranges that end at a hit, before it and behind it.
    t_max = np.where(rng.random(len(t)) < 0.5, t, np.nextafter(t, np.float32(0)))
    oracle = Oracle(triangles, origins, directions, t_max=t_max[:, None])
    hits = scene.closest_hit(origins, directions, t_max=t_max)
    np.testing.assert_array_equal(hits.t, oracle.closest()[0])
    t_min = np.where(np.isfinite(t), np.nextafter(t, np.float32(np.inf)), 0)
    oracle = Oracle(triangles, origins, directions, t_min=t_min[:, None])
    hits = scene.closest_hit(origins, directions, t_min=t_min)
    np.testing.assert_array_equal(hits.t, oracle.closest()[0])
    np.testing.assert_array_equal(hits.prim_id, oracle.closest()[1])
    np.testing.assert_array_equal(
        scene.count_hits(origins, directions, t_min, t_max), 0 * t_min.astype(int)
    )


def triangles_of(scene):
    """The triangles of a scene, from its pickle."""
    numbers = scene.__reduce__()[1][3]
    return numbers.reshape(-1, 3, 3)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("make", MESHES)
def test_surface(make, scale):
    scene, origins, directions, oracle = case(make, scale)
    triangles = triangles_of(scene)
    hits = scene.closest_hit(origins, directions)
    rows = np.flatnonzero(hits.hit)
    prim = hits.prim_id[rows]
    np.testing.assert_array_equal(hits.uv[rows], oracle.uv[rows, prim])
    assert np.isnan(hits.uv[~hits.hit]).all()
    assert np.isnan(hits.normal[~hits.hit]).all()
    assert np.isnan(hits.position[~hits.hit]).all()
    tri = triangles[prim].astype(np.float64)
    normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(hits.normal[rows], normal, atol=1e-6)
    u, v = oracle.uv[rows, prim].astype(np.float64).T[:, :, None]
    expected = (1 - u - v) * tri[:, 0] + u * tri[:, 1] + v * tri[:, 2]
    np.testing.assert_allclose(hits.position[rows], expected, rtol=0, atol=1e-6 * scale)
    # The same of all hits, whose first are those.
    lists = scene.all_hits(origins, directions)
    first = lists.offsets[:-1][hits.hit]
    np.testing.assert_array_equal(lists.uv[first], hits.uv[rows])
    np.testing.assert_array_equal(lists.normal[first], hits.normal[rows])
    np.testing.assert_array_equal(lists.position[first], hits.position[rows])
    assert not np.isnan(lists.position).any()


@pytest.mark.parametrize("make", MESHES)
def test_masks(make):
    rng = np.random.default_rng(7)
    _, origins, directions, oracle = case(make, 1.0)
    triangles = triangles_of(case(make, 1.0)[0])
    sizes = [1, 50, 0, COUNT - 51]
    starts = np.cumsum([0, *sizes])
    meshes = [
        (triangles[a:b].reshape(-1, 3), np.arange(3 * (b - a)).reshape(-1, 3))
        for a, b in zip(starts, starts[1:])
    ]
    geometry = np.repeat(np.arange(4), sizes)
    for masks in ([1, 2, 4, 2], [0, 0xFFFF_FFFF, 1, 1 << 31]):
        scene = ropewalk.Scene.from_meshes(meshes, masks=masks)
        np.testing.assert_array_equal(scene.masks, masks)
        per_ray = rng.integers(0, 2**32, len(origins), dtype=np.uint32) & 0x8000_0003
        for bits in (per_ray, 2, None):
            every = np.full(len(origins), 0xFFFF_FFFF if bits is None else bits, np.uint32)
            allowed = (every[:, None] & np.uint32(masks)[geometry][None]) != 0
            expected = Oracle(triangles, origins, directions).only(allowed)
            t, prim = expected.closest()
            hits = scene.closest_hit(origins, directions, masks=bits)
            np.testing.assert_array_equal(hits.t, t)
            geom = np.where(prim < 0, -1, geometry[prim])
            np.testing.assert_array_equal(hits.geom_id, geom)
            np.testing.assert_array_equal(hits.prim_id, np.where(prim < 0, -1, prim - starts[geom]))
            np.testing.assert_array_equal(scene.occluded(origins, directions, masks=bits), prim >= 0)
            counts = scene.count_hits(origins, directions, masks=bits)
            np.testing.assert_array_equal(counts, expected.hit.sum(axis=1))
            lists = scene.all_hits(origins, directions, masks=bits)
            np.testing.assert_array_equal(lists.counts, counts)
            rows = [p for row in expected.lists() for _, p in row]
            np.testing.assert_array_equal(lists.geom_id, geometry[rows])
            np.testing.assert_array_equal(lists.prim_id, rows - starts[geometry[rows]])
    assert oracle.hit.any()


@pytest.mark.parametrize("make", MESHES)
def test_skip(make):
    scene, origins, directions, oracle = case(make, 1.0)
    first = scene.closest_hit(origins, directions)
    allowed = np.arange(COUNT)[None] != first.prim_id[:, None]
    t, prim = oracle.only(allowed).closest()
    for skip in (first, first.prim_id, (first.prim_id, first.geom_id), first.prim_id.tolist()):
        hits = scene.closest_hit(origins, directions, skip=skip)
        np.testing.assert_array_equal(hits.t, t)
        np.testing.assert_array_equal(hits.prim_id, prim)
    np.testing.assert_array_equal(scene.occluded(origins, directions, skip=first), prim >= 0)
    counts = scene.count_hits(origins, directions, skip=first)
    np.testing.assert_array_equal(counts, oracle.hit.sum(axis=1))
    np.testing.assert_array_equal(
        scene.all_hits(origins, directions, skip=first, masks=1).counts, counts
    )


@pytest.mark.parametrize("make", MESHES)
@pytest.mark.parametrize("faces", ["front", "back"])
def test_sides(make, faces):
    scene, origins, directions, oracle = case(make, 1.0, seed=3)
    rng = np.random.default_rng([MESHES.index(make), 9, 3])
    corners, indices = make(rng, COUNT, 1.0)
    a, b, c = np.moveaxis(corners[indices].astype(float), 1, 0)
    towards = directions.astype(float) @ np.cross(b - a, c - a).T
    oracle.only(towards < 0 if faces == "front" else towards > 0)
    t, prim = oracle.closest()
    hits = scene.closest_hit(origins, directions, faces=faces)
    np.testing.assert_array_equal(hits.t, t)
    np.testing.assert_array_equal(hits.prim_id, prim)
    np.testing.assert_array_equal(scene.occluded(origins, directions, faces=faces), prim >= 0)
    np.testing.assert_array_equal(scene.count_hits(origins, directions, faces=faces), oracle.hit.sum(1))
    found = scene.all_hits(origins, directions, faces=faces)
    np.testing.assert_array_equal(found.t, [t for row in oracle.lists() for t, _ in row])
    towards = np.einsum("ij,ij->i", found.normal, directions[found.ray_id])
    assert (towards < 1e-6 if faces == "front" else towards > -1e-6).all()
    one = scene.closest_hit(origins[0], directions[0], faces=faces)
    assert one.t == t[0]


def test_meshes_number_their_own_primitives():
    rng = np.random.default_rng(3)
    a, b, c = random_mesh(rng, 70, 1.0), random_mesh(rng, 1, 1.0), random_mesh(rng, 40, 1.0)
    scene = ropewalk.Scene.from_meshes([a, b, ([], []), c])
    np.testing.assert_array_equal(scene.mesh_sizes, [70, 1, 0, 40])
    assert len(scene) == 111
    triangles = np.concatenate([v[f] for v, f in (a, b, c)])
    whole = ropewalk.Scene(triangles.reshape(-1, 3), np.arange(333).reshape(-1, 3))
    origins, directions = rays(rng, 5000, 1.0)
    one, many = whole.all_hits(origins, directions), scene.all_hits(origins, directions)
    np.testing.assert_array_equal(one.t, many.t)
    starts = np.array([0, 70, 71, 71])
    np.testing.assert_array_equal(one.prim_id, starts[many.geom_id] + many.prim_id)
    assert set(np.unique(many.geom_id)) == {0, 1, 3}
    np.testing.assert_array_equal(one.position, many.position)
    # Skipping across meshes.
    first = scene.closest_hit(origins, directions)
    second = scene.first_hits(origins, directions, 2)
    skipped = scene.closest_hit(origins, directions, skip=first)
    expected = [second.t[i + 1] if j - i > 1 else np.inf
                for i, j in zip(second.offsets, second.offsets[1:])]
    np.testing.assert_array_equal(skipped.t, np.float32(expected))


@pytest.mark.parametrize("preset", ["fast", "balanced", "best", "compact"])
def test_threads_and_presets_change_no_answer(preset):
    rng = np.random.default_rng(11)
    vertices, faces = random_mesh(rng, 3000, 1.0)
    origins, directions = rays(rng, 40_000, 1.0)
    reference = ropewalk.Scene(vertices, faces, threads=1)
    one = reference.closest_hit(origins, directions, threads=1)
    lists = reference.all_hits(origins, directions, threads=1)
    scene = ropewalk.Scene(vertices, faces, preset=preset)
    for threads in (0, 1, 2, 3, 7):
        hits = scene.closest_hit(origins, directions, threads=threads)
        np.testing.assert_array_equal(hits.t, one.t)
        np.testing.assert_array_equal(hits.prim_id, one.prim_id)
        np.testing.assert_array_equal(hits.uv, one.uv)
        found = scene.all_hits(origins, directions, threads=threads)
        for name in ("offsets", "t", "prim_id", "geom_id", "ray_id", "uv"):
            np.testing.assert_array_equal(getattr(found, name), getattr(lists, name))
        np.testing.assert_array_equal(
            scene.count_hits(origins, directions, threads=threads), lists.counts
        )
        np.testing.assert_array_equal(
            scene.occluded(origins, directions, threads=threads), one.hit
        )


def test_a_batch_is_its_rays_one_by_one():
    rng = np.random.default_rng(13)
    scene = ropewalk.Scene(*random_mesh(rng, 200, 1.0))
    origins, directions = rays(rng, 300, 1.0)
    hits = scene.closest_hit(origins, directions)
    for i in range(len(origins)):
        one = scene.closest_hit(origins[i], directions[i])
        assert one.t == hits.t[i] and one.prim_id == hits.prim_id[i]
        np.testing.assert_array_equal(one.uv, hits.uv[i])
        assert scene.occluded(origins[i], directions[i]) == hits.hit[i]


def test_closed_mesh_leaks_no_ray():
    """Rays from inside a box at its vertices, edges and faces: each leaves it."""
    corners = np.float32([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    scene = ropewalk.Scene(corners * 0.9 + 0.1, faces)
    rng = np.random.default_rng(17)
    targets = rng.integers(0, 3, (200_000, 3)) / 2 * 0.9 + 0.1
    targets = targets[(np.abs(targets - 0.55) > 0.4).any(axis=1)]
    origins = rng.uniform(0.3, 0.8, targets.shape)
    assert scene.occluded(origins, targets - origins).all()


def test_shapes_of_a_loaded_scene():
    scene = ropewalk.load("spd:rings:1")
    rng = np.random.default_rng(19)
    low, high = scene.bounds
    origins = rng.uniform(low, high, (20_000, 3))
    directions = rng.normal(size=(20_000, 3))
    hits = scene.closest_hit(origins, directions)
    assert hits.hit.sum() > 1000
    on_ray = origins.astype(np.float32) + hits.t[:, None] * directions.astype(np.float32)
    size = np.linalg.norm(high - low)
    np.testing.assert_allclose(
        hits.position[hits.hit], on_ray[hits.hit], rtol=0, atol=1e-5 * size
    )
    np.testing.assert_allclose(np.linalg.norm(hits.normal[hits.hit], axis=1), 1, atol=1e-6)
    lists = scene.all_hits(origins, directions)
    np.testing.assert_array_equal(lists.counts, scene.count_hits(origins, directions))
    np.testing.assert_array_equal(lists.t[lists.offsets[:-1][hits.hit]], hits.t[hits.hit])
