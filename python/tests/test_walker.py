"""Particles, and queries that start from cells."""

import warnings

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh, rays

BOX_FACES = [
    [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
    [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
]  # fmt: skip


def box(low, high):
    corners = [[(low, high)[i >> a & 1] for a in range(3)] for i in range(8)]
    return np.array(corners, np.float32), np.array(BOX_FACES)


def test_a_closed_box_is_left_as_often_as_entered():
    scene = ropewalk.Scene(*box(-2.0, 2.0))
    draw = np.random.default_rng(1)
    n, steps = 300, 20
    walker = ropewalk.Walker(scene, np.full((n, 3), -5.0))
    inside = np.zeros(n, int)
    for _ in range(steps):
        # Ends on integers: many lie in faces, on edges and in corners.
        ends = draw.integers(-4, 5, (n, 3)).astype(np.float32)
        events = walker.advance(ends - walker.positions)
        assert (walker.positions == ends).all()
        np.add.at(inside, events.particle_id, np.where(events.entering, 1, -1))
        assert ((inside == 0) | (inside == 1)).all()
        clear = (np.abs(ends) != 2).all(axis=1)
        assert (inside[clear] == (np.abs(ends[clear]) < 2).all(axis=1)).all()


def test_lists_are_steps_and_threads_change_nothing():
    scene = ropewalk.Scene(*random_mesh(np.random.default_rng(2), 400, 2.0))
    draw = np.random.default_rng(2)
    n, steps = 3000, 6
    start = draw.uniform(-1, 1, (n, 3))
    directions = draw.normal(size=(n, steps, 3)).astype(np.float32)
    lengths = draw.exponential(0.2, (n, steps)).astype(np.float32)
    one = ropewalk.Walker(scene, start, threads=1)
    single = [one.advance(directions[:, s], lengths[:, s]) for s in range(steps)]
    rows = np.arange(n + 1) * steps
    for threads in (1, 2, 3):
        walker = ropewalk.Walker(scene, start, threads=threads)
        events = walker.run(rows, directions.reshape(-1, 3), lengths.reshape(-1))
        assert (walker.positions == one.positions).all()
        assert len(events) == sum(len(e) for e in single) > 100
        for s, step in enumerate(single):
            of = events.segment == s
            for name in ("particle_id", "t", "prim_id", "geom_id", "entering"):
                assert (getattr(events, name)[of] == getattr(step, name)).all()
        assert (events.walked == steps).all() and (np.diff(events.offsets) == events.counts).all()


def test_particles_stop_at_the_closest_hit():
    scene = ropewalk.Scene(*random_mesh(np.random.default_rng(3), 400, 2.0))
    draw = np.random.default_rng(3)
    start, direction = draw.uniform(-1, 1, (2000, 3)), draw.normal(size=(2000, 3))
    start, direction = start.astype(np.float32), direction.astype(np.float32)
    walker = ropewalk.Walker(scene, start)
    events = walker.advance(direction, 0.5, stop=True)
    hits = scene.closest_hit(start, direction, t_max=0.5)
    assert (events.counts == hits.hit).mean() > 0.999
    both = hits.hit & (events.counts == 1)
    t = np.full(2000, np.nan)
    t[events.particle_id] = events.t
    assert np.allclose(t[both], hits.t[both], rtol=1e-4, atol=1e-5)
    assert (walker.stopped == (events.counts == 1)).all()
    # Through the face without a second event for it.
    on = np.full(2000, -1)
    on[events.particle_id] = events.prim_id
    behind = walker.advance(direction, 1e-3)
    assert not (behind.prim_id == on[behind.particle_id]).any()


def test_masks_and_faces_leave_out_events():
    """In Pass mode they change nothing but the events; a stop is at the first that is left."""
    draw = np.random.default_rng(5)
    meshes = [random_mesh(draw, 150, 2.0) for _ in range(3)]
    scene = ropewalk.Scene.from_meshes(meshes, masks=[1, 6, 12])
    n, steps = 9000, 4
    start = draw.uniform(-1, 1, (n, 3))
    directions = draw.normal(size=(n * steps, 3)).astype(np.float32)
    rows, bits = np.arange(n + 1) * steps, draw.integers(0, 16, n)
    plain = ropewalk.Walker(scene, start)
    every = plain.run(rows, directions, 0.5)
    names = ("particle_id", "segment", "t", "prim_id", "geom_id", "entering")
    for masks, faces in ((bits, "both"), (None, "front"), (4, "back"), (bits, "front"), (0, "both"), (-1, "back")):
        each = np.broadcast_to(-1 if masks is None else masks, n)[every.particle_id]
        left = (each & np.array([1, 6, 12])[every.geom_id]) != 0
        if faces != "both":
            left &= every.entering == (faces == "front")
        for threads in (1, 2):
            walker = ropewalk.Walker(scene, start, threads=threads)
            events = walker.run(rows, directions, 0.5, masks=masks, faces=faces)
            assert (walker.positions == plain.positions).all()
            for name in names:
                np.testing.assert_array_equal(getattr(events, name), getattr(every, name)[left])
            stopper = ropewalk.Walker(scene, start, threads=threads)
            stops = stopper.run(rows, directions, 0.5, stop=True, masks=masks, faces=faces)
            _, first = np.unique(every.particle_id[left], return_index=True)
            for name in names:
                np.testing.assert_array_equal(getattr(stops, name), getattr(events, name)[first])
            assert stopper.stopped.sum() == len(first)


def test_skip_is_the_face_that_a_particle_leaves():
    scene = ropewalk.Scene.from_meshes([random_mesh(np.random.default_rng(6), 300, 2.0), box(-5.0, 5.0)])
    draw = np.random.default_rng(6)
    hits = scene.closest_hit(draw.uniform(-1, 1, (2000, 3)), draw.normal(size=(2000, 3)))
    assert hits.hit.all()
    ways = draw.normal(size=(2000, 3)).astype(np.float32)
    for skip in (hits, (hits.prim_id, hits.geom_id)):
        walker = ropewalk.Walker(scene, hits.position)
        events = walker.advance(ways, 0.5, skip=skip)
        left = np.stack([hits.prim_id, hits.geom_id])[:, events.particle_id]
        assert not (left == [events.prim_id, events.geom_id]).all(axis=0).any()
    # All else is met, and nothing but the first segment has a face to skip.
    every = ropewalk.Walker(scene, hits.position).advance(ways, 0.5)
    left = np.stack([hits.prim_id, hits.geom_id])[:, every.particle_id]
    other = ~(left == [every.prim_id, every.geom_id]).all(axis=0)
    np.testing.assert_array_equal(events.t, every.t[other])
    flat = ropewalk.Scene([[-9, -9, 0], [9, -9, 0], [0, 9, 0]], [[0, 1, 2]])
    walker = ropewalk.Walker(flat, [[0, 0, -1], [0, 0, -1]])
    events = walker.run([0, 2, 4], [[0, 0, 2], [0, 0, -2]] * 2, 1, skip=[0, -1])
    assert events.segment.tolist() == [1, 0, 1] and events.counts.tolist() == [1, 2]
    # One that is stopped passes its face, or the one that is skipped instead of it.
    walker = ropewalk.Walker(flat, [[0, 0, -1]])
    assert len(walker.advance([0, 0, 1], 2, stop=True)) == 1 and walker.stopped.all()
    assert len(walker.advance([0, 0, 1], 1, skip=-1)) == 0
    for call in (
        lambda: walker.advance([0, 0, 1], skip=1),
        lambda: walker.advance([0, 0, 1], skip=[0, 0]),
        lambda: walker.advance([0, 0, 1], masks=2**32),
        lambda: walker.advance([0, 0, 1], masks=[1, 2]),
        lambda: walker.advance([0, 0, 1], faces="left"),
    ):
        with pytest.raises(ropewalk.ArgumentError):
            call()
    for call in (lambda: walker.advance([0, 0, 1], masks=1.5), lambda: walker.advance([0, 0, 1], faces=1)):
        with pytest.raises(ropewalk.ArgumentTypeError):
            call()


def test_bad_input_is_refused():
    scene = ropewalk.Scene(*box(-1.0, 1.0))
    walker = ropewalk.Walker(scene, [[0, 0, 0], [5, 5, 5]])
    with pytest.raises(ropewalk.ArgumentTypeError):
        ropewalk.Walker("scene", [[0, 0, 0]])
    for call in (
        lambda: ropewalk.Walker(scene, [0, 0, 0]),
        lambda: walker.advance([[1, 0, 0]] * 3),
        lambda: walker.advance([1, 0, 0], [1, 2, 3]),
        lambda: walker.run([0, 1], [[1, 0, 0]], 1),
        lambda: walker.run([0, 2, 1], [[1, 0, 0]] * 2, 1),
        lambda: walker.run([0, 1, 3], [[1, 0, 0]] * 2, 1),
        lambda: walker.run([-1, 1, 2], [[1, 0, 0]] * 2, 1),
        lambda: setattr(walker, "positions", [[0, 0, 0]]),
    ):
        with pytest.raises(ropewalk.ArgumentError):
            call()
    with pytest.raises(ropewalk.ArgumentTypeError):
        walker.run([0.0, 1.0, 2.0], [[1, 0, 0]] * 2, 1)
    with pytest.raises(ropewalk.ArgumentTypeError):
        scene.closest_hit([0, 0, 0], [1, 0, 0], start=0.5)
    with pytest.warns(ropewalk.InvalidRayWarning, match="3 segments"):
        bad = [[np.nan, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 1]]
        events = walker.run([0, 4, 4], bad, [1, -1, np.inf, 3])
    assert list(events.entering) == [False] and (walker.positions[0] == [0, 0, 3]).all()
    assert repr(events).startswith("<ropewalk.Events") and "2 particles" in repr(walker)
    empty = ropewalk.Walker(scene, np.zeros((0, 3)))
    assert len(empty) == 0 and list(empty.advance([1, 0, 0]).offsets) == [0]
    spheres = ropewalk.load("spd:balls:1")
    with pytest.raises(ropewalk.ArgumentError, match="other primitives"):
        ropewalk.Walker(spheres, [[0, 0, 0]]).advance([1, 0, 0])


def test_any_cell_is_right():
    scene = ropewalk.Scene(*random_mesh(np.random.default_rng(4), 400, 2.0))
    origins, directions = rays(np.random.default_rng(40), 3000, 1.0)
    hits = scene.closest_hit(origins, directions)
    assert ((hits.cell >= 0) == hits.hit).all() and hits.cell.shape == hits.shape
    points, draw = hits.position[hits.hit], np.random.default_rng(4)
    ways = draw.normal(size=points.shape).astype(np.float32)
    skip, cells = hits.prim_id[hits.hit], hits.cell[hits.hit]
    for t_max in (0.01, 0.5, np.inf):
        expected = scene.closest_hit(points, ways, t_max=t_max, skip=skip)
        dark = scene.occluded(points, ways, t_max=t_max, skip=skip)
        wild = draw.integers(-(2**62), 2**62, len(points))
        near = draw.integers(0, 5000, len(points)).astype(np.uint64)
        for start in (cells, np.roll(cells, 1), wild, near, 7, -1):
            for threads in (1, 2):
                found = scene.closest_hit(
                    points, ways, t_max=t_max, skip=skip, start=start, threads=threads
                )
                assert (found.t == expected.t).all() and (found.prim_id == expected.prim_id).all()
            found = scene.occluded(points, ways, t_max=t_max, skip=skip, start=start)
            assert (found == dark).all()
    again = scene.closest_hit(origins, directions, start=hits)
    assert (again.t == hits.t).all()
    walker = ropewalk.Walker(scene, points)
    assert (walker.cell >= 0).any() and walker.cell.dtype == np.int64


def test_many_segments_are_quiet():
    scene = ropewalk.Scene(*box(-1.0, 1.0))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        walker = ropewalk.Walker(scene, np.zeros((10_000, 3)))
        events = walker.advance([3, 0, 0])
    assert (events.counts == 1).all() and not events.entering.any()
    assert (events.geom_id == 0).all() and np.allclose(events.t, 1 / 3)
