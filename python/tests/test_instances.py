"""Instances against the same triangles in a scene of their own."""

import pickle

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh


def objects(seed=0):
    rng = np.random.default_rng(seed)
    made = []
    for count in (40, 7):
        vertices, faces = random_mesh(rng, count, 1.0)
        made.append((np.float64(vertices) / 3, faces))
    return rng, made


def matrices(rng, count, offset=0.0):
    """Rotations and mirrors about axes with scales that are powers of two, so that nothing is rounded."""
    made = np.zeros((count, 4, 4))
    for matrix in made:
        axes = rng.permutation(3)
        matrix[np.arange(3), axes] = rng.choice([-1, 1], 3) * 2.0 ** rng.integers(-1, 2, 3)
        matrix[:3, 3] = rng.integers(-3, 4, 3) / 4 + offset
        matrix[3, 3] = 1
    return made


@pytest.mark.parametrize("offset", [0.0, 2.0**20])
def test_instances_equal_moved_meshes(offset):
    rng, meshes = objects()
    scenes = [ropewalk.Scene(*mesh, precision="double") for mesh in meshes]
    places = matrices(rng, 10, offset)
    which = [i % 2 for i in range(10)]
    scene = ropewalk.Scene.from_instances((scenes[k], m) for k, m in zip(which, places))
    moved = [
        (meshes[k][0] @ m[:3, :3].T + m[:3, 3], meshes[k][1]) for k, m in zip(which, places)
    ]
    same = ropewalk.Scene.from_meshes(moved, precision="double")
    origins = rng.uniform(-2, 2, (20_000, 3)) + offset
    directions = rng.uniform(-0.8, 0.8, (20_000, 3)) + offset - origins
    close = {"rtol": 1e-9, "atol": 1e-9 * (1 + offset)}
    a, b = scene.closest_hit(origins, directions), same.closest_hit(origins, directions)
    assert a.hit.mean() > 0.1
    np.testing.assert_array_equal(a.prim_id, b.prim_id)
    np.testing.assert_array_equal(a.geom_id, b.geom_id)
    np.testing.assert_allclose(a.t, b.t, **close)
    for name in ("uv", "position"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), **close)
    # Mirrors turn faces inside out; normals follow the surface.
    np.testing.assert_allclose(np.abs((a.normal * b.normal).sum(axis=-1)[a.hit]), 1.0)
    np.testing.assert_array_equal(scene.occluded(origins, directions), b.hit)
    np.testing.assert_array_equal(
        scene.count_hits(origins, directions), same.count_hits(origins, directions)
    )
    for k in (1, 3, None):
        if k is None:
            a, b = scene.all_hits(origins, directions), same.all_hits(origins, directions)
        else:
            a, b = (s.first_hits(origins, directions, k) for s in (scene, same))
        np.testing.assert_array_equal(a.offsets, b.offsets)
        np.testing.assert_array_equal(a.prim_id, b.prim_id)
        np.testing.assert_array_equal(a.geom_id, b.geom_id)
        np.testing.assert_allclose(a.t, b.t, **close)
    one = scene.all_hits(origins, directions, threads=1)
    np.testing.assert_array_equal(one.t, a.t)
    first = scene.closest_hit(origins, directions)
    rest = scene.first_hits(origins, directions, 1, skip=first)
    second = scene.first_hits(origins, directions, 2)
    np.testing.assert_array_equal(rest.counts[first.hit], second.counts[first.hit] - 1)
    other = pickle.loads(pickle.dumps(scene))
    np.testing.assert_array_equal(other.closest_hit(origins, directions).t, first.t)


def test_masks_and_report():
    triangle = ropewalk.Scene(np.eye(3), [[0, 1, 2]], precision="double")
    up = np.eye(4)
    up[2, 3] = 1
    scene = ropewalk.Scene.from_instances([(triangle, None), (triangle, up)], masks=[1, 2])
    o, d = [0.2, 0.2, -1], [0, 0, 1]
    assert scene.count_hits(o, d) == 2
    assert scene.closest_hit(o, d, masks=2).geom_id == 1
    assert not scene.occluded(o, d, masks=4)
    report = scene.report
    assert (report.meshes, report.primitives) == (2, 2)
    assert report.tree_bytes > triangle.report.tree_bytes
    assert len(scene) == 2 and scene.mesh_sizes.tolist() == [1, 1]
    np.testing.assert_allclose(scene.bounds, [[0, 0, 0], [1, 1, 2]], atol=1e-9)
    assert "2 meshes" in repr(scene)


def test_without_instances():
    scene = ropewalk.Scene.from_instances([])
    assert not scene.closest_hit([0, 0, 0], [1, 0, 0]).hit
    assert len(scene) == 0 and np.isnan(scene.bounds).all()
    assert not pickle.loads(pickle.dumps(scene)).occluded([0, 0, 0], [1, 0, 0])


def test_bad_instances():
    triangle = ropewalk.Scene(np.eye(3), [[0, 1, 2]], precision="double")
    make = ropewalk.Scene.from_instances
    cases = [
        (3, ropewalk.ArgumentTypeError, "instances: expected pairs"),
        ([triangle], ropewalk.ArgumentTypeError, r"instances\[0\]: expected a pair"),
        ([(triangle, None), (1, 2)], ropewalk.ArgumentTypeError, r"instances\[1\]: expected a pair"),
        ([(triangle, np.eye(3))], ropewalk.ArgumentError, r"shape \(3, 4\) or \(4, 4\), found \(3, 3\)"),
        ([(triangle, np.zeros((4, 4)))], ropewalk.ArgumentError, "last row"),
        ([(triangle, np.zeros((3, 4)))], ropewalk.ArgumentError, r"instances\[0\]: matrix: .* inverse"),
        ([(triangle, np.full((3, 4), np.nan))], ropewalk.ArgumentError, "row 0, column 0 is NaN"),
        ([(make([(triangle, None)]), None)], ropewalk.ArgumentError, "scene of meshes, found instances"),
        (
            [(ropewalk.Scene(np.eye(3), [[0, 1, 2]]), None)],
            ropewalk.ArgumentError,
            "precision='double'",
        ),
    ]
    for instances, error, text in cases:
        with pytest.raises(error, match=text):
            make(instances)
    with pytest.raises(ropewalk.ArgumentError, match="2 masks, one an instance"):
        make([(triangle, None)] * 2, masks=[1])
