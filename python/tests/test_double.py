"""Scenes in float64 against brute force in float64."""

import copy
import pickle

import numpy as np
import pytest

import ropewalk
from meshes import degenerate_mesh, grid_mesh, random_mesh, rays
from oracle import Oracle

MESHES = [random_mesh, degenerate_mesh, grid_mesh]
PLACES = [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (10.0, 1e7), (1.0, -3e7), (1e60, 0.0)]
COUNT, RAYS = 120, 2000


def case(make, scale, offset):
    """A scene, rays of which brute force is sure, and brute force."""
    rng = np.random.default_rng([MESHES.index(make), PLACES.index((scale, offset))])
    vertices, faces = make(rng, COUNT, 1.0)
    flat = np.float64(vertices) * (1 / 3 if make is random_mesh else 1)
    vertices = flat * scale + offset
    origins, directions = rays(rng, RAYS, 1.0)
    origins, directions = np.float64(origins) / 3 * scale + offset, np.float64(directions) / 7
    oracle = Oracle(vertices[faces], origins, directions, dtype=np.float64)
    sure = oracle.sure
    assert sure.mean() > 0.6, "the oracle leaves too much open"
    origins, directions = origins[sure], directions[sure]
    oracle = Oracle(vertices[faces], origins, directions, dtype=np.float64)
    scene = ropewalk.Scene(vertices, faces, precision="double")
    assert scene.precision == "double"
    return scene, origins, directions, oracle


@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("make", MESHES)
def test_every_query(make, scale, offset):
    scene, origins, directions, oracle = case(make, scale, offset)
    t, prim = oracle.closest()
    assert (prim >= 0).sum() > 200
    hits = scene.closest_hit(origins, directions)
    assert (hits.t.dtype, hits.uv.dtype, hits.normal.dtype, hits.position.dtype) == (np.float64,) * 4
    np.testing.assert_array_equal(hits.t, t)
    np.testing.assert_array_equal(hits.prim_id, prim)
    np.testing.assert_array_equal(hits.geom_id, np.where(prim < 0, -1, 0))
    np.testing.assert_array_equal(scene.occluded(origins, directions), prim >= 0)
    np.testing.assert_array_equal(scene.count_hits(origins, directions), oracle.hit.sum(axis=1))
    for k in (None, 0, 1, 3):
        rows = oracle.lists(k)
        found = (
            scene.all_hits(origins, directions)
            if k is None
            else scene.first_hits(origins, directions, k)
        )
        assert found.t.dtype == np.float64
        np.testing.assert_array_equal(found.counts, [len(row) for row in rows])
        np.testing.assert_array_equal(found.t, [t for row in rows for t, _ in row])
        np.testing.assert_array_equal(found.prim_id, [p for row in rows for _, p in row])
    hit = hits.hit
    close = origins[hit] + hits.t[hit, None] * directions[hit]
    np.testing.assert_allclose(hits.position[hit], close, atol=1e-9 * (scale + abs(offset)), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(hits.normal[hit], axis=1), 1.0)
    assert np.isnan(hits.position[~hit]).all()


def test_the_choice_is_automatic():
    vertices, faces = np.eye(3) / 3 + 1e6, [[0, 1, 2]]
    assert ropewalk.Scene(vertices, faces).precision == "double"
    assert ropewalk.Scene(vertices.astype(np.float32), faces).precision == "single"
    assert ropewalk.Scene(np.eye(3) / 3, faces).precision == "single"
    assert ropewalk.Scene(np.eye(3, dtype=int) + 2**27, faces).precision == "double"
    assert ropewalk.Scene(np.eye(3), faces, precision="double").precision == "double"
    assert ropewalk.Scene(np.eye(3) * 1e39, faces).precision == "double"
    meshes = [(np.eye(3), faces), (vertices, faces)]
    assert ropewalk.Scene.from_meshes(meshes).precision == "double"
    assert ropewalk.Scene(vertices, np.empty((0, 3), int)).precision == "single"
    assert ropewalk.Scene(vertices, faces).bounds.dtype == np.float64


def test_detail_of_a_thousandth_at_ten_million():
    wall = np.array([[0, 0, 0], [1000, 0, 0], [0, 1000, 0]], float)
    vertices = np.concatenate([wall + [1e7, 1e7, 5e6 + i * 1e-3] for i in (2, 0, 1)])
    scene = ropewalk.Scene(vertices, np.arange(9).reshape(3, 3))
    hits = scene.all_hits([1e7 + 10, 1e7 + 10, 0.0], [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(hits.t, vertices[[3, 6, 0], 2])
    np.testing.assert_array_equal(hits.prim_id, [1, 2, 0])


def test_meshes_masks_and_skip():
    a = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) / 3 + 1e7
    b = a + [0, 0, 0.1]
    scene = ropewalk.Scene.from_meshes([(a, [[0, 1, 2]]), (b, [[0, 1, 2], [0, 2, 1]])], masks=[1, 2])
    o, d = a.mean(axis=0) + [0, 0, 5], [0.0, 0.0, -1.0]
    lists = scene.all_hits(o, d)
    assert list(zip(lists.geom_id, lists.prim_id)) == [(1, 0), (1, 1), (0, 0)]
    assert scene.closest_hit(o, d, masks=1).geom_id == 0
    assert scene.closest_hit(o, d, masks=2).geom_id == 1
    assert scene.count_hits(o, d, masks=4) == 0
    first = scene.closest_hit(o, d)
    assert scene.closest_hit(o, d, skip=first).prim_id == 1
    again = scene.closest_hit(first.position, d, skip=(1, 1))
    assert (again.geom_id, again.prim_id) == (1, 0)


def test_sides():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) / 3 + 1e7
    scene = ropewalk.Scene(vertices, [[0, 1, 2], [0, 2, 1]])
    o, d = vertices.mean(axis=0) + [0, 0, 2], [0, 0, -1]
    assert scene.all_hits(o, d, faces="front").prim_id.tolist() == [0]
    assert scene.all_hits(o, d, faces="back").prim_id.tolist() == [1]
    assert scene.closest_hit(o, d, faces="back").prim_id == 1
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    placed = ropewalk.Scene.from_instances([(scene, mirror)])
    for faces in ("front", "back"):
        hits = placed.all_hits(o, d, faces=faces)
        assert (np.sign(hits.normal @ d) == (-1 if faces == "front" else 1)).all() and len(hits) == 1


def test_the_memory_limit():
    vertices = np.random.default_rng(1).uniform(0, 1, (3000, 3)) + 1e7
    faces = np.arange(3000).reshape(1000, 3)
    with pytest.raises(ropewalk.OutOfMemoryError, match="memory_limit"):
        ropewalk.Scene(vertices, faces, memory_limit=200_000)
    assert ropewalk.Scene(vertices, faces, memory_limit=2_000_000).precision == "double"


def test_threads_and_pickles_change_nothing():
    scene, origins, directions, _ = case(random_mesh, 10.0, 1e7)
    origins, directions = np.tile(origins, (4, 1)), np.tile(directions, (4, 1))
    one, two = (scene.all_hits(origins, directions, threads=n) for n in (1, 2))
    other = pickle.loads(pickle.dumps(scene))
    assert other.precision == "double" and copy.deepcopy(scene) is scene
    three = other.all_hits(origins, directions)
    for found in (two, three):
        for name in ("offsets", "t", "prim_id", "geom_id"):
            np.testing.assert_array_equal(getattr(found, name), getattr(one, name))
    kept = pickle.loads(pickle.dumps(scene.closest_hit(origins, directions)))
    assert kept.position.dtype == np.float64


def test_bad_input():
    faces = [[0, 1, 2]]
    for bad in (np.nan, np.inf, 1e101):
        vertices = np.eye(3) / 3
        vertices[1, 2] = bad
        with pytest.raises(ropewalk.ArgumentError, match=r"vertices\[1\] is .* finite"):
            ropewalk.Scene(vertices, faces, precision="double")
        with pytest.raises(ropewalk.ArgumentError, match=r"meshes\[1\].vertices\[1\] is .* finite"):
            ropewalk.Scene.from_meshes([(np.eye(3), faces), (vertices, faces)], precision="double")
    with pytest.raises(ropewalk.ArgumentError, match="precision: expected 'auto'"):
        ropewalk.Scene(np.eye(3), faces, precision="half")
    scene = ropewalk.Scene(np.eye(3) / 3, faces, precision="double")
    with pytest.warns(ropewalk.InvalidRayWarning, match="1 rays"):
        assert not scene.closest_hit([0, 0, np.nan], [1, 1, 1]).hit
    with pytest.raises(ropewalk.InvalidRayError, match="zero in float64"):
        scene.closest_hit([0, 0, 0], [0, 0, 0], strict=True)
    # Below float32, not below float64.
    assert scene.closest_hit([0, 0, 0], [1e-60, 1e-60, 1e-60]).hit


def test_degenerate_faces_are_judged_in_float64():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0.5, 1e-12, 0]])
    scene = ropewalk.Scene(vertices, [[0, 1, 2], [0, 1, 3]], precision="double")
    assert scene.precision == "double" and scene.report.degenerate == 1
    assert scene.closest_hit([0.5, 5e-13, 1], [0, 0, -1]).prim_id == 1
