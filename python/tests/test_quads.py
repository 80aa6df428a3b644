"""Quads: two triangles, one primitive."""

import pickle

import numpy as np
import pytest

import ropewalk
from meshes import rays
from oracle import Oracle

PRECISIONS = {"single": np.float32, "double": np.float64}


def quads(rng, count, scale, bent):
    """Quads with some triangles among them; flat ones on a grid of exact numbers."""
    if bent:
        a = rng.uniform(-0.5, 0.5, (count, 1, 3))
        corners = a + rng.normal(0, 0.2, (count, 4, 3))
    else:
        a = rng.integers(-8, 9, (count, 3)) / 16
        u, v = rng.integers(-4, 5, (2, count, 3)) / 16
        corners = np.stack([a, a + u, a + u + v, a + v], axis=1)
    faces = np.arange(4 * count).reshape(count, 4)
    faces[::5, 3] = faces[::5, 2]
    return (scale * corners).astype(np.float32).reshape(-1, 3), faces


def cut(faces):
    """Triangles of faces, and the face of each."""
    both = np.stack([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    of = np.repeat(np.arange(len(faces)), 2)
    there = np.stack([np.ones(len(faces), bool), faces[:, 2] != faces[:, 3]], axis=1).reshape(-1)
    return both[there], of[there]


def by_face(t, of, count):
    """The first hit of each ray and face, inf without one."""
    first = np.full((len(t), count), np.inf, t.dtype)
    for i, face in enumerate(of):
        first[:, face] = np.minimum(first[:, face], t[:, i])
    return first


def case(precision, bent, scale=1.0, seed=0, allowed=None):
    rng = np.random.default_rng([seed, int(np.log10(scale)) + 9, bent])
    vertices, faces = quads(rng, 70, scale, bent)
    triangles, of = cut(faces)
    origins, directions = rays(rng, 3000, scale)
    corners = vertices[triangles]
    kind = PRECISIONS[precision]
    sure = Oracle(corners, origins, directions, dtype=kind).sure
    assert sure.mean() > 0.7
    origins, directions = origins[sure], directions[sure]
    oracle = Oracle(corners, origins, directions, dtype=kind)
    if allowed is not None:
        oracle.only(allowed(oracle, corners, directions))
    t = by_face(oracle.t, of, len(faces))
    scene = ropewalk.Scene(vertices, faces, precision=precision, preset="best")
    assert len(scene) == 70 and scene.mesh_sizes.tolist() == [70] and scene.report.primitives == 70
    return scene, origins, directions, t, (vertices, faces, oracle, of)


def rows(t, k=None):
    """Hits (t, face) of each ray in order, or the first k."""
    order = np.argsort(t, axis=1, kind="stable")
    return [[(t[i, j], j) for j in order[i] if np.isfinite(t[i, j])][:k] for i in range(len(t))]


def compare(scene, origins, directions, t, **options):
    """All queries with the first hits of all faces."""
    hits = scene.closest_hit(origins, directions, **options)
    np.testing.assert_array_equal(hits.t, t.min(axis=1))
    prim = np.where(np.isfinite(t.min(axis=1)), t.argmin(axis=1), -1)
    np.testing.assert_array_equal(hits.prim_id, prim)
    np.testing.assert_array_equal(scene.occluded(origins, directions, **options), prim >= 0)
    counts = np.isfinite(t).sum(axis=1)
    np.testing.assert_array_equal(scene.count_hits(origins, directions, **options), counts)
    for k in (None, 0, 1, 2, 5):
        if k is None:
            lists = scene.all_hits(origins, directions, **options)
        else:
            lists = scene.first_hits(origins, directions, k, **options)
        expected = rows(t, k)
        np.testing.assert_array_equal(lists.counts, [len(row) for row in expected])
        np.testing.assert_array_equal(lists.prim_id, [face for row in expected for _, face in row])
        np.testing.assert_array_equal(lists.t, [at for row in expected for at, _ in row])
    return hits


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_every_query(precision, bent, scale):
    scene, origins, directions, t, _ = case(precision, bent, scale)
    assert np.isfinite(t).sum() > 500
    hits = compare(scene, origins, directions, t)
    # A quad is skipped as a whole.
    left = np.where(np.arange(70)[None] == hits.prim_id[:, None], np.inf, t)
    compare(scene, origins, directions, left, skip=hits)
    for threads in (1, 2, 3):
        same = scene.all_hits(origins, directions, threads=threads)
        np.testing.assert_array_equal(same.t, scene.all_hits(origins, directions).t)


@pytest.mark.parametrize("faces", ["front", "back"])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_sides(precision, faces):
    def allowed(oracle, corners, directions):
        a, b, c = np.moveaxis(corners.astype(float), 1, 0)
        towards = directions.astype(float) @ np.cross(b - a, c - a).T
        return towards < 0 if faces == "front" else towards > 0

    scene, origins, directions, t, _ = case(precision, True, seed=2, allowed=allowed)
    hits = compare(scene, origins, directions, t, faces=faces)
    towards = np.einsum("ij,ij->i", hits.normal[hits.hit], directions[hits.hit])
    assert (towards < 0 if faces == "front" else towards > 0).all()


@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_surface(precision, bent):
    scene, origins, directions, _, (vertices, faces, oracle, of) = case(precision, bent, seed=3)
    for found in (scene.closest_hit(origins, directions), scene.all_hits(origins, directions)):
        there = found.prim_id >= 0
        face = faces[found.prim_id[there]]
        a, b, c, d = (vertices[face[:, i]].astype(float) for i in range(4))
        u, v = found.uv[there].astype(float).T[:, :, None]
        assert (u >= 0).all() and (v >= 0).all() and (u <= 1).all() and (v <= 1).all()
        lower = (1 - u) * a + (u - v) * b + v * c
        upper = (1 - v) * a + u * c + (v - u) * d
        single = (1 - u - v) * a + u * b + v * c
        triangle = (face[:, 2] == face[:, 3])[:, None]
        expected = np.where(triangle, single, np.where(u >= v, lower, upper))
        np.testing.assert_allclose(found.position[there], expected, atol=2e-6)
        below = np.cross(b - a, c - a)
        above = np.where(triangle, below, np.cross(c - a, d - a))
        normal = np.where(triangle | (u >= v), below, above)
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        clear = (np.abs(u - v) > 1e-4)[:, 0] & (size[:, 0] > 1e-6)
        np.testing.assert_allclose(found.normal[there][clear], (normal / size)[clear], atol=1e-5)
        assert (u > v).any() and (u < v).any()


CORNERS = np.float64([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_flat_quad_is_hit_once(precision):
    """Through its diagonal, edges and corners, from all around, and beside an equal one."""
    rng = np.random.default_rng(4)
    share = rng.integers(0, 9, (4000, 1)) / 8
    on = np.concatenate([
        share * CORNERS[2], share * CORNERS[1], CORNERS[3] + share * CORNERS[1], rng.uniform(0, 1, (4000, 3)) * CORNERS[2],
    ])  # fmt: skip
    origins = np.float32(on + rng.normal(size=on.shape)).astype(float)
    origins[:, 2] = np.where(np.abs(origins[:, 2]) < 0.01, 1.0, origins[:, 2])
    # Exact: the target is in the middle between two ends that are numbers in float32.
    scene = ropewalk.Scene(CORNERS, [[0, 1, 2, 3]], precision=precision)
    down = np.float64([0, 0, -1])
    above = np.concatenate([on[:12000], on[12000:]]) + [0, 0, 1]
    assert (scene.count_hits(above, down) == 1).all()
    lists = scene.all_hits(above, down)
    assert (lists.counts == 1).all() and (lists.t == 1).all() and (lists.prim_id == 0).all()
    np.testing.assert_allclose(lists.uv, on[:, :2] / [2, 1], atol=1e-6)
    # Slanted rays, which may miss at the border but never count twice.
    directions = on - origins
    counts = scene.count_hits(origins, directions)
    assert counts.max() == 1 and counts[12000:].mean() > 0.99
    two = ropewalk.Scene(CORNERS, [[0, 1, 2, 3], [0, 1, 2, 3]], precision=precision)
    assert (two.count_hits(above, down) == 2).all()
    assert (two.closest_hit(above, down).prim_id == 0).all()
    skipped = two.closest_hit(above, down, skip=0)
    assert (skipped.prim_id == 1).all() and (skipped.t == 1).all()


def test_a_bent_quad_is_hit_where_it_is_first():
    bent = np.float64([[0, 0, 0], [1, 0, 1], [1, 1, 0], [0, 1, 1]])
    scene = ropewalk.Scene(bent, [[0, 1, 2, 3]])
    # Across the valley: both triangles are met, at different parameters.
    origin, direction = [1.5, -0.5, 0.4], [-1.0, 1.0, 0.0]
    triangles = ropewalk.Scene(bent, [[0, 1, 2], [0, 2, 3]])
    both = triangles.all_hits(origin, direction)
    assert len(both) == 2
    assert scene.all_hits(origin, direction).t == both.t[0]
    assert scene.count_hits(origin, direction) == 1
    assert scene.closest_hit(origin, direction, skip=0).t == np.inf
    assert scene.closest_hit(origin, direction, both.t[0] + 0.1).t == both.t[1]


def test_many_quads_on_a_ray():
    """Rows longer than those that are compared face by face."""
    count = 200
    vertices = (CORNERS[None] + np.arange(count)[:, None, None] * [0, 0, 0.25]).reshape(-1, 3)
    scene = ropewalk.Scene(vertices, np.arange(4 * count).reshape(-1, 4))
    lists = scene.all_hits([1, 0.5, -1], [[0, 0, 1], [0, 0, -1]])
    assert lists.counts.tolist() == [count, 0] and lists.prim_id.tolist() == list(range(count))
    assert scene.first_hits([1, 0.5, -1], [0, 0, 1], 50).prim_id.tolist() == list(range(50))


@pytest.mark.parametrize("precision", PRECISIONS)
def test_meshes_masks_files_and_pickles(precision, tmp_path):
    rng = np.random.default_rng(5)
    meshes = [quads(rng, count, 1.0, True) for count in (30, 40, 20)]
    meshes[1] = (meshes[1][0], meshes[1][1][:, :3])
    wide = [(v, f if f.shape[1] == 4 else f[:, [0, 1, 2, 2]]) for v, f in meshes]
    starts = np.cumsum([0, 30, 40])
    geom = np.repeat([0, 1, 2], [30, 40, 20])
    parts = [cut(f) for _, f in wide]
    corners = np.concatenate([v[f] for (v, _), (f, _) in zip(wide, parts)])
    of = np.concatenate([start + of for start, (_, of) in zip(starts, parts)])
    origins, directions = rays(rng, 2000, 1.0)
    kind = PRECISIONS[precision]
    sure = Oracle(corners, origins, directions, dtype=kind).sure
    origins, directions = origins[sure], directions[sure]
    t = by_face(Oracle(corners, origins, directions, dtype=kind).t, of, 90)
    scene = ropewalk.Scene.from_meshes(meshes, masks=[1, 2, 4], precision=precision)
    assert scene.mesh_sizes.tolist() == [30, 40, 20]
    path = tmp_path / "quads.rope"
    scene.save(path)
    again = ropewalk.Scene.open(path, verify=True)
    assert again.report.primitives == 90 and repr(again) == repr(scene)
    reopened = pickle.loads(pickle.dumps(again))
    for one in (scene, again, reopened, pickle.loads(pickle.dumps(scene))):
        for mask in (7, 1, 2, 5):
            masked = np.where(mask >> geom & 1, t, np.inf)
            hits = one.closest_hit(origins, directions, masks=mask)
            face = masked.argmin(axis=1)
            np.testing.assert_array_equal(hits.t, masked.min(axis=1))
            np.testing.assert_array_equal(hits.geom_id, np.where(hits.hit, geom[face], -1))
            np.testing.assert_array_equal(hits.prim_id, np.where(hits.hit, face - starts[geom[face]], -1))
            counts = one.count_hits(origins, directions, masks=mask)
            np.testing.assert_array_equal(counts, np.isfinite(masked).sum(axis=1))
        np.testing.assert_array_equal(one.closest_hit(origins, directions).uv, scene.closest_hit(origins, directions).uv)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_file_of_quads_is_no_file_of_triangles(precision, tmp_path):
    vertices, faces = quads(np.random.default_rng(6), 50, 1.0, True)
    scene = ropewalk.Scene(vertices, faces, precision=precision)
    path = tmp_path / "quads.rope"
    scene.save(path)
    assert len(ropewalk.Scene.open(path, vertices=vertices, faces=faces)) == 50
    other = faces.copy()
    other[7] = np.roll(other[7], 1)
    for wrong in (cut(faces)[0], other, faces[:-1]):
        with pytest.raises(ropewalk.OtherGeometryError):
            ropewalk.Scene.open(path, vertices=vertices, faces=wrong)
    # The same triangles, otherwise shared out over faces.
    triangles = cut(faces)[0]
    ropewalk.Scene(vertices, triangles, precision=precision).save(path)
    with pytest.raises(ropewalk.OtherGeometryError):
        ropewalk.Scene.open(path, vertices=vertices, faces=faces)


def test_damaged_pickles():
    """The bits that say which triangles are the second ones of quads."""
    vertices = np.random.default_rng(12).normal(size=(8, 3))
    scene = ropewalk.Scene.from_meshes([(vertices, [[0, 1, 2, 3], [0, 1, 2, 2]]), (vertices, [[4, 5, 6, 7]])])
    restore, (kind, *state, bits) = scene.__reduce__()
    assert bits.tolist() == [0b10010] and state[3] == [0, 3, 5]
    assert restore(kind, *state, bits).mesh_sizes.tolist() == [2, 1]
    for damaged in ([0b1], [0b110], [0b1000], [], [2, 0]):
        with pytest.raises(ropewalk.ArgumentError, match="damaged"):
            restore(kind, *state, np.array(damaged, np.uint8))
    # Pickles from before there were quads.
    assert restore(kind, *state).mesh_sizes.tolist() == [3, 2]


@pytest.mark.parametrize("precision", PRECISIONS)
def test_points(precision):
    rng = np.random.default_rng(7)
    vertices, faces = quads(rng, 60, 1.0, True)
    triangles, of = cut(faces)
    scene = ropewalk.Scene(vertices, faces, precision=precision)
    same = ropewalk.Scene(vertices, triangles, precision=precision)
    points = rng.uniform(-1, 1, (3000, 3))
    a, b = scene.closest_point(points), same.closest_point(points)
    np.testing.assert_array_equal(a.distance, b.distance)
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.prim_id, of[b.prim_id])
    u, v = b.uv.T
    first = np.r_[True, of[1:] != of[:-1]][b.prim_id]
    whole = (faces[:, 2] == faces[:, 3])[a.prim_id]
    expected = np.where(first, [u + v, v], [u, u + v])
    np.testing.assert_allclose(a.uv, np.where(whole, [u, v], expected).T)
    np.testing.assert_array_equal(scene.winding_number(points, accuracy=0), same.winding_number(points, accuracy=0))
    leaves = scene.cells(scene.locate(points))
    assert (leaves.primitives <= same.cells(same.locate(points)).primitives).all()
    one = ropewalk.Scene(CORNERS, [[0, 1, 2, 3]], precision=precision)
    assert one.cells().primitives.sum() == len(one.cells().cell)


def test_a_cube_of_quads():
    corners = np.float64([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    rng = np.random.default_rng(8)
    points = rng.uniform(-0.5, 1.5, (2000, 3))
    inside = ((points > 0) & (points < 1)).all(axis=1)
    for precision in PRECISIONS:
        scene = ropewalk.Scene(corners, sides, precision=precision)
        np.testing.assert_array_equal(scene.contains(points), inside)
        # From the middle to corners, edges and diagonals: one way out.
        targets = rng.integers(0, 3, (5000, 3)) / 2
        targets = targets[(targets != 0.5).any(axis=1)]
        assert scene.occluded([0.5, 0.5, 0.5], targets - 0.5).all()


def test_walkers():
    corners = np.float64([[x, y, z] for x in (-2, 2) for y in (-2, 2) for z in (-2, 2)])
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    scene = ropewalk.Scene(corners, sides)
    triangles, of = cut(sides)
    same = ropewalk.Scene(corners, triangles)
    rng = np.random.default_rng(9)
    n = 3000
    walkers = [ropewalk.Walker(s, np.full((n, 3), -5.0)) for s in (scene, same)]
    found = 0
    for step in range(12):
        # Ends on integers: in faces, on edges, diagonals and in corners.
        ends = rng.integers(-4, 5, (n, 3)).astype(np.float32)
        a, b = (w.advance(ends - w.positions, 1.0) for w in walkers)
        np.testing.assert_array_equal(a.prim_id, of[b.prim_id])
        for name in ("offsets", "t", "entering", "geom_id", "segment"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        found += len(a)
    assert found > 1000
    # Who was stopped at a quad, or skips it, passes all of it: particles stopped beside the diagonal
    # move on across the other triangle, from a point that was rounded.
    flat = ropewalk.Scene(np.float64([[0, 0, 0], [1, 0, 0.1], [1, 1, 0.3], [0, 1, 0.2]]), [[0, 1, 2, 3]])
    near = rng.uniform(0.2, 0.8, (n, 1)) + rng.normal(0, 1e-7, (n, 2))
    walker = ropewalk.Walker(flat, np.concatenate([near, np.full((n, 1), 2.0)], axis=1))
    events = walker.advance([0.0, 0.0, -1.0], 5.0, stop=True)
    assert (events.counts == 1).all() and (events.prim_id == 0).all() and walker.stopped.all()
    assert len(walker.advance(rng.normal(size=(n, 3)), 1.0)) == 0
    walker = ropewalk.Walker(flat, np.concatenate([near, np.full((n, 1), 2.0)], axis=1))
    assert len(walker.advance([0.0, 0.0, -1.0], 5.0, skip=0)) == 0
    assert (walker.advance([0.0, 0.0, 1.0], 5.0).counts == 1).all()


def test_instances():
    rng = np.random.default_rng(10)
    made = [quads(rng, 30, 1.0, True), quads(rng, 20, 1.0, False)]
    made[1] = (made[1][0], cut(made[1][1])[0])
    scenes = [ropewalk.Scene(*mesh, precision="double") for mesh in made]
    places = np.tile(np.eye(4), (4, 1, 1))
    places[:, 0, 3] = np.arange(4)
    scene = ropewalk.Scene.from_instances((scenes[i % 2], m) for i, m in enumerate(places))
    assert scene.mesh_sizes.tolist() == [30, len(made[1][1])] * 2
    moved = [(made[i % 2][0].astype(float) + m[:3, 3], made[i % 2][1]) for i, m in enumerate(places)]
    same = ropewalk.Scene.from_meshes(moved, precision="double")
    origins = rng.uniform(-1, 4, (4000, 3))
    directions = rng.normal(size=(4000, 3))
    for a, b in (
        (scene.closest_hit(origins, directions), same.closest_hit(origins, directions)),
        (scene.all_hits(origins, directions), same.all_hits(origins, directions)),
        (scene.first_hits(origins, directions, 2), same.first_hits(origins, directions, 2)),
        (pickle.loads(pickle.dumps(scene)).closest_hit(origins, directions), same.closest_hit(origins, directions)),
    ):
        np.testing.assert_array_equal(a.prim_id, b.prim_id)
        np.testing.assert_array_equal(a.geom_id, b.geom_id)
        for name in ("t", "uv", "position", "normal"):
            np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-9, atol=1e-9)
    counts = scene.count_hits(origins, directions)
    np.testing.assert_array_equal(counts, same.count_hits(origins, directions))
    first = scene.closest_hit(origins, directions)
    rest = scene.count_hits(origins, directions, skip=first)
    np.testing.assert_array_equal(rest, counts - first.hit)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_memory(precision):
    """Triangles among quads cost what triangles cost; quads four bytes a triangle more."""
    vertices, faces = quads(np.random.default_rng(11), 2000, 1.0, True)
    triangles = cut(faces)[0]
    as_quads = ropewalk.Scene(vertices, faces, precision=precision).report
    as_triangles = ropewalk.Scene(vertices, triangles, precision=precision).report
    assert as_quads.tree_bytes == as_triangles.tree_bytes
    assert as_quads.geometry_bytes == as_triangles.geometry_bytes + 4 * len(triangles)
    doubled = triangles[:, [0, 1, 2, 2]]
    assert ropewalk.Scene(vertices, doubled, precision=precision).report.geometry_bytes == as_triangles.geometry_bytes
    for limit, fits in ((1000, False), (10**9, True)):
        build = lambda: ropewalk.Scene(vertices, faces, precision=precision, memory_limit=limit)  # noqa: B023, E731
        if fits:
            assert len(build()) == 2000
        else:
            with pytest.raises(ropewalk.OutOfMemoryError):
                build()
