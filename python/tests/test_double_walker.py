"""Particles in scenes of double precision."""

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh
from test_walker import box

PLACES = [(1.0, 0.0), (1e-6, 0.0), (1e6, 3e5), (1e-3, 1e7)]


def double(vertices, faces, place=(1.0, 0.0)):
    scale, offset = place
    return ropewalk.Scene(np.float64(vertices) * scale + offset, faces, precision="double")


@pytest.mark.parametrize("place", PLACES)
def test_a_closed_box_is_left_as_often_as_entered(place):
    scale, offset = place
    scene = double(*box(-2.0, 2.0), place)
    assert scene.precision == "double"
    draw = np.random.default_rng(1)
    n, walls = 300, np.array([-2, 2]) * scale + offset
    walker = ropewalk.Walker(scene, np.full((n, 3), -5.0 * scale + offset))
    inside = np.zeros(n, int)
    for _ in range(20):
        # Ends on integers: many lie in faces, on edges and in corners.
        ends = draw.integers(-4, 5, (n, 3)) * scale + offset
        go = ends - walker.positions
        ends = walker.positions + go
        events = walker.advance(go)
        assert walker.positions.dtype == events.t.dtype == np.float64
        np.testing.assert_array_equal(walker.positions, ends)
        np.add.at(inside, events.particle_id, np.where(events.entering, 1, -1))
        assert ((inside == 0) | (inside == 1)).all()
        clear = (np.abs(ends - offset) - 2 * scale != 0).all(axis=1) & ~np.isin(ends, walls).any(axis=1)
        within = ((walls[0] < ends) & (ends < walls[1])).all(axis=1)
        assert (inside[clear] == within[clear]).all() and clear.any()


def test_numbers_of_single_precision_give_the_events_of_single_precision():
    vertices, faces = random_mesh(np.random.default_rng(2), 400, 2.0)
    one, two = (ropewalk.Scene(vertices, faces, precision=k) for k in ("single", "double"))
    draw = np.random.default_rng(2)
    n, steps = 6000, 5
    # Steps of 2^-8 and lengths of 1/4, so that ends are the same in both.
    start = draw.integers(-256, 257, (n, 3)) / 256
    directions = draw.integers(-200, 201, (n * steps, 3)) / 256
    rows = np.arange(n + 1) * steps
    for stop in (False, True):
        for threads in (1, 2, 3):
            found = []
            for scene in (one, two):
                walker = ropewalk.Walker(scene, start, threads=threads)
                found.append((walker.run(rows, directions, 0.25, stop=stop), walker))
            (single, s), (events, d) = found
            assert len(events) > 100 and (s.stopped == d.stopped).all()
            for name in ("offsets", "segment", "prim_id", "geom_id", "entering", "walked"):
                np.testing.assert_array_equal(getattr(events, name), getattr(single, name))
            np.testing.assert_allclose(events.t, single.t, rtol=0, atol=1e-7)
            np.testing.assert_allclose(d.positions, s.positions, rtol=0, atol=1e-6)
            if threads == 1:
                first = events
            np.testing.assert_array_equal(events.t, first.t)


def test_detail_below_float32():
    """Walls a thousandth apart at ten million."""
    wall = np.array([[1e7, 1e7, 5e6], [1e7 + 1e3, 1e7, 5e6], [1e7, 1e7 + 1e3, 5e6]])
    meshes = [(wall, [[0, 1, 2]]), (wall + [0, 0, 1e-3], [[0, 1, 2]])]
    scene = ropewalk.Scene.from_meshes(meshes, masks=[1, 2], precision="double")
    assert scene.precision == "double"
    middle = [[1e7 + 10, 1e7 + 10, 5e6 + 5e-4]]
    walker = ropewalk.Walker(scene, middle)
    events = walker.run([0, 3], [[0, 0, 1], [0, 0, -1], [0, 0, 1]], [4e-4, 8e-4, 1])
    assert events.segment.tolist() == [2] and events.geom_id.tolist() == [1] and events.prim_id.tolist() == [0]
    assert abs(events.t[0] - 9e-4) < 1e-8 and walker.positions.dtype == np.float64
    for options, geom in (
        ({}, [1]), ({"masks": 1}, []), ({"masks": 2}, [1]), ({"skip": (0, 1)}, []), ({"faces": "front"}, []),
        ({"faces": "back"}, [1]),
    ):  # fmt: skip
        walker = ropewalk.Walker(scene, middle)
        assert walker.advance([0, 0, 1], stop=True, **options).geom_id.tolist() == geom
        assert walker.stopped.tolist() == [bool(geom)]
    # From the face that was hit, without a second event for it.
    hits = scene.closest_hit(middle, [[0, 0, 1]])
    walker = ropewalk.Walker(scene, hits.position)
    assert len(walker.advance([0, 0, 1e-4], skip=hits)) == 0
    assert walker.advance([0, 0, -1]).geom_id.tolist() in ([1, 0], [0])
    walker.positions = middle
    assert walker.cell.tolist() == scene.locate(middle).tolist()


def test_bad_input_is_refused():
    scene = double(*box(-1.0, 1.0))
    walker = ropewalk.Walker(scene, [[0, 0, 0], [5, 5, 5]])
    with pytest.warns(ropewalk.InvalidRayWarning, match="4 segments.*1e100"):
        bad = [[np.nan, 0, 0], [1, 0, 0], [1e99, 0, 0], [1, 0, 0], [0, 0, 1]]
        events = walker.run([0, 5, 5], bad, [1, -1, 1e3, np.inf, 3])
    assert list(events.entering) == [False] and (walker.positions[0] == [0, 0, 3]).all()
    placed = ropewalk.Scene.from_instances([(scene, np.eye(4))])
    walker = ropewalk.Walker(placed, [[0, 0, 0]])
    with pytest.raises(ropewalk.ArgumentError, match="instances"):
        walker.advance([1, 0, 0])
    assert walker.cell.tolist() == [-1]
