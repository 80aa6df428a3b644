"""Points: nearest triangles, sides, winding numbers and cells."""

import numpy as np
import pytest

import ropewalk
from meshes import degenerate_mesh, random_mesh

rng = np.random.default_rng(7)

CUBE_V = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE_F = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
CUBE = ropewalk.Scene(CUBE_V, CUBE_F)
QUERIES = {
    "closest_point": lambda scene, p, **k: scene.closest_point(p, **k).distance,
    "distance": lambda scene, p, **k: scene.distance(p, **k),
    "signed_distance": lambda scene, p, **k: scene.signed_distance(p, **k),
    "contains": lambda scene, p, **k: scene.contains(p, **k),
    "contains_winding": lambda scene, p, **k: scene.contains(p, method="winding", **k),
    "winding_number": lambda scene, p, **k: scene.winding_number(p, **k),
    "locate": lambda scene, p, **k: scene.locate(p, **k),
}
every = pytest.mark.parametrize("query", QUERIES)


def refused(error, argument, index, text, call):
    with pytest.raises(error, match=text) as caught:
        call()
    assert isinstance(caught.value, ropewalk.RopewalkError)
    assert (caught.value.argument, caught.value.index) == (argument, index)


def ball(levels, scale=1.0, offset=0.0):
    """Vertices and faces of a ball, fronts outside."""
    v = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    tri = []
    for x in (0, 1):
        for y in (2, 3):
            for z in (4, 5):
                turned = (x + y + z) % 2 == 1
                tri.append(v[[x, z, y] if turned else [x, y, z]])
    tri = np.array(tri)
    for _ in range(levels):
        a, b, c = tri[:, 0], tri[:, 1], tri[:, 2]
        d, e, f = (a + b) / 2, (b + c) / 2, (c + a) / 2
        tri = np.concatenate([np.stack(t, 1) for t in ([a, d, f], [d, b, e], [f, e, c], [d, e, f])])
    tri /= np.linalg.norm(tri, axis=2, keepdims=True)
    corners, faces = np.unique(tri.reshape(-1, 3).astype(np.float32), axis=0, return_inverse=True)
    return corners.astype(float) * scale + offset, faces.reshape(-1, 3)


def brute_distance(triangles, p, dtype=np.float32):
    """Least distances from triangles, in float64, from edges and planes."""
    best = np.full(len(p), np.inf)
    for a, b, c in triangles.astype(dtype).astype(float):
        normal = np.cross(b - a, c - a)
        if not normal.any():
            continue
        for q, r in ((a, b), (b, c), (c, a)):
            along = r - q
            t = np.clip((p - q) @ along / (along @ along), 0, 1)
            best = np.minimum(best, np.linalg.norm(p - q - t[:, None] * along, axis=1))
        inside = np.ones(len(p), bool)
        for q, r in ((a, b), (b, c), (c, a)):
            inside &= (p - q) @ np.cross(normal, r - q) >= 0
        best[inside] = np.minimum(best[inside], np.abs((p - a) @ normal)[inside] / np.linalg.norm(normal))
    return best


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("make", [random_mesh, degenerate_mesh])
def test_distances_are_those_of_brute_force(make, scale):
    vertices, faces = make(rng, 120, scale)
    scene = ropewalk.Scene(vertices, faces)
    points = scale * rng.normal(size=(700, 3))
    expected = brute_distance(vertices[faces], points)
    found = scene.closest_point(points)
    np.testing.assert_allclose(found.distance, expected, rtol=1e-9, atol=1e-12 * scale)
    np.testing.assert_array_equal(scene.distance(points), found.distance)
    np.testing.assert_allclose(
        np.linalg.norm(found.position - points, axis=1), found.distance, rtol=1e-7, atol=1e-9 * scale
    )
    a, b, c = np.moveaxis(vertices.astype(float)[faces[found.prim_id]], 1, 0)
    u, v = found.uv[:, :1], found.uv[:, 1:]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), found.position, atol=1e-9 * scale)
    assert (found.geom_id == 0).all() and "700 points" in repr(found)


def test_of_equally_near_triangles_the_first():
    twice = ropewalk.Scene.from_meshes([(CUBE_V + 9, CUBE_F), (CUBE_V, np.tile(CUBE_F, (2, 1)))])
    found = twice.closest_point(rng.uniform(-1, 2, (500, 3)))
    assert (found.geom_id == 1).all() and (found.prim_id < len(CUBE_F)).all()


def test_sides_of_a_cube_with_ties():
    """A grid that meets faces, edges, vertices and the diagonals of faces."""
    grid = np.arange(-4, 9) / 4
    p = np.stack(np.meshgrid(grid, grid, grid), -1)
    within, inside = ((p >= 0) & (p <= 1)).all(-1), ((p > 0) & (p < 1)).all(-1)
    np.testing.assert_array_equal(CUBE.contains(p), within)
    signed = CUBE.signed_distance(p)
    assert (signed[inside] < 0).all() and (signed[~within] > 0).all()
    assert (signed[within & ~inside] == 0).all()
    np.testing.assert_array_equal(abs(signed), CUBE.distance(p))
    turned = ropewalk.Scene(CUBE_V, CUBE_F[:, ::-1])
    np.testing.assert_array_equal(turned.contains(p), within)


def test_beside_faces_and_in_cavities():
    outer, inner = ball(4), ball(3, 0.5)
    shell = ropewalk.Scene.from_meshes([outer, (inner[0], inner[1][:, ::-1])])
    for radius, expected in [(0.1, False), (0.4, False), (0.7, True), (1.5, False)]:
        p = rng.normal(size=(2000, 3))
        p *= radius / np.linalg.norm(p, axis=1, keepdims=True)
        assert (shell.contains(p) == expected).all()
        assert (shell.contains(p, method="winding") == expected).all()
    v, f = outer
    tri = v.astype(np.float32).astype(float)[f]
    middle = tri.mean(axis=1)
    normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert (normal * middle).sum(1).min() > 0, "fronts are outside"
    for step in (1e-9, 1e-14):
        assert shell.contains(middle - step * normal).all()
        assert not shell.contains(middle + step * normal).any()


@pytest.mark.parametrize("scale, offset", [(1e-6, 0), (1, 0), (1e6, 0), (1e4, 1e7)])
def test_parity_is_winding_on_closed_surfaces(scale, offset):
    v, f = ball(3, scale, offset)
    scene = ropewalk.Scene(v.astype(np.float32), f)
    p = rng.uniform(-1.2, 1.2, (2000, 3)) * scale + offset
    number = scene.winding_number(p, accuracy=0)
    assert (np.abs(number - number.round()) < 1e-6).all()
    for accuracy in (0.2, 0.01, 1e-4):
        off = np.abs(scene.winding_number(p, accuracy=accuracy) - number)
        assert off.max() <= accuracy
    assert np.abs(scene.winding_number(p) - number).max() <= 0.01
    np.testing.assert_array_equal(scene.contains(p), number.round() == 1)
    np.testing.assert_array_equal(scene.contains(p, method="winding"), number.round() == 1)


def test_an_open_surface():
    v, f = ball(4)
    half = f[(v[f][:, :, 2] >= -1e-9).all(1)]
    scene = ropewalk.Scene(v, half)
    p = rng.uniform(-1, 1, (3000, 3))
    inside = scene.winding_number(p, accuracy=0) > 0.5
    np.testing.assert_array_equal(scene.contains(p, method="winding"), inside)
    assert abs(scene.winding_number([0, 0, 0]) - 0.5) < 1e-3
    assert scene.contains([[0, 0, 0.3], [0, 0, -0.3]], method="winding").tolist() == [True, False]


@every
def test_shapes(query):
    ask = QUERIES[query]
    p = rng.uniform(-1, 2, (4, 5, 3))
    expected = ask(CUBE, p)
    assert expected.shape == (4, 5)
    assert ask(CUBE, p[0, 0]).shape == ()
    assert ask(CUBE, np.empty((0, 3))).shape == (0,)
    assert ask(CUBE, np.empty((2, 0, 3))).shape == (2, 0)
    for other in (p.tolist(), np.asfortranarray(p), p[::-1][::-1], p.astype(">f8")):
        np.testing.assert_array_equal(ask(CUBE, other), expected)
    single = p.astype(np.float32)
    np.testing.assert_array_equal(ask(CUBE, single), ask(CUBE, single.astype(float)))
    whole = np.array([[0, 1, 2], [1, 0, 0]])
    np.testing.assert_array_equal(ask(CUBE, whole), ask(CUBE, whole.astype(float)))
    single.flags.writeable = False
    ask(CUBE, single)


@every
def test_any_number_of_threads(query):
    scene = ropewalk.Scene(*ball(4))
    p = rng.uniform(-1.3, 1.3, (9000, 3))
    expected = QUERIES[query](scene, p, threads=1)
    for threads in (0, 2, 5):
        np.testing.assert_array_equal(QUERIES[query](scene, p, threads=threads), expected)
    np.testing.assert_array_equal(QUERIES[query](scene, p[::-1])[::-1], expected)


@every
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300])
def test_points_without_an_answer(query, bad):
    p = np.full((3000, 3), 0.5)
    p[[1234, 2999], 1] = bad
    with pytest.warns(ropewalk.InvalidPointWarning, match="2 points .* point 1234"):
        found = QUERIES[query](CUBE, p)
    for i in (1234, 2999):
        assert np.isnan(found[i]) or found[i] in (False, -1)
    np.testing.assert_array_equal(found[:1234], QUERIES[query](CUBE, p[:1234]))
    refused(ropewalk.InvalidPointError, "points", 1234, "1e100", lambda: QUERIES[query](CUBE, p, strict=True))
    QUERIES[query](CUBE, p[:1234], strict=True)


@every
def test_bad_arguments(query):
    ask = QUERIES[query]
    for wrong in (np.zeros(2), np.zeros((3, 4)), 1.0):
        refused(ropewalk.ArgumentError, "points", None, "shape", lambda: ask(CUBE, wrong))
    for wrong in (None, "text", [[1, 2, 3], [1, 2]], np.zeros((2, 3), complex), np.zeros((2, 3), bool)):
        refused(ropewalk.ArgumentTypeError, "points", None, "expected", lambda: ask(CUBE, wrong))
    refused(ropewalk.ArgumentError, "threads", None, "0 to", lambda: ask(CUBE, [0, 0, 0], threads=-1))
    balls = ropewalk.load("spd:balls:1")
    refused(ropewalk.ArgumentError, "scene", None, "triangles only", lambda: ask(balls, [0, 0, 0]))


@pytest.mark.parametrize("accuracy", [-1, np.nan, [0.1, 0.2]])
def test_accuracies_that_are_none(accuracy):
    ask = lambda: CUBE.winding_number([0, 0, 0], accuracy=accuracy)  # noqa: E731
    refused(ropewalk.ArgumentError, "accuracy", None, "0 or more", ask)
    refused(ropewalk.ArgumentTypeError, "accuracy", None, "expected", lambda: CUBE.winding_number([0, 0, 0], accuracy="x"))


def test_a_method_that_is_none():
    refused(ropewalk.ArgumentError, "method", None, "winding", lambda: CUBE.contains([0, 0, 0], method="x"))


@every
def test_scenes_without_triangles(query):
    for scene in (ropewalk.Scene([], []), ropewalk.Scene(CUBE_V, [[0, 0, 1]])):
        found = QUERIES[query](scene, [[0.5, 0.5, 0.5], [9, 9, 9]])
        expected = np.inf if "distance" in query or query == "closest_point" else None
        if expected is None:
            assert not (found > 0).any()
        else:
            assert (found == np.inf).all()


def test_cells_hold_what_is_found_in_them():
    scene = ropewalk.Scene(*ball(4))
    every_cell = scene.cells()
    assert len(every_cell.cell) == scene.report.leaves
    assert (every_cell.primitives == 0).sum() == scene.report.empty_leaves
    assert every_cell.primitives.sum() == scene.report.references
    edges = np.diff(every_cell.bounds.astype(float), axis=1)[:, 0]
    whole = np.diff(scene.bounds.astype(float), axis=0)[0]
    assert abs(edges.prod(1).sum() / whole.prod() - 1) < 1e-6
    p = rng.uniform(-1.1, 1.1, (50, 40, 3))
    cell = scene.locate(p)
    within = ((p >= scene.bounds[0]) & (p <= scene.bounds[1])).all(-1)
    np.testing.assert_array_equal(cell >= 0, within)
    found = scene.cells(cell)
    low, high = found.bounds[..., 0, :], found.bounds[..., 1, :]
    assert ((low <= p) & (p <= high)).all(-1)[within].all()
    assert np.isnan(found.bounds[~within]).all() and (found.primitives[~within] == -1).all()
    assert np.isin(cell[within], every_cell.cell).all()


def test_cells_that_are_none():
    for wrong in (-1, 2**40, -(2**63), np.uint64(2**64 - 1)):
        found = CUBE.cells(wrong)
        assert found.bounds.shape == (2, 3) and np.isnan(found.bounds).all() and found.primitives == -1
    refused(ropewalk.ArgumentTypeError, "cell", None, "integers", lambda: CUBE.cells(0.5))
    assert CUBE.cells([]).bounds.shape == (0, 2, 3)
    assert "1 leaf, 0 empty" in repr(CUBE.cells())
