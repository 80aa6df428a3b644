"""Points in scenes of double precision: as in test_points, at any scale and distance from the origin."""

import pickle

import numpy as np
import pytest

import ropewalk
from meshes import degenerate_mesh, grid_mesh, random_mesh
from test_points import CUBE_F, CUBE_V, QUERIES, ball, brute_distance, every, refused

rng = np.random.default_rng(11)

PLACES = [(1e-6, 0.0), (1.0, 0.0), (1e6, 0.0), (10.0, 1e7), (1.0, -3e7), (1e60, 0.0)]
place = pytest.mark.parametrize(("scale", "offset"), PLACES)


def double(vertices, faces):
    scene = ropewalk.Scene(vertices, faces, precision="double")
    assert scene.precision == "double"
    return scene


CUBE = double(CUBE_V, CUBE_F)


@place
@pytest.mark.parametrize("make", [random_mesh, degenerate_mesh, grid_mesh])
def test_distances_are_those_of_brute_force(make, scale, offset):
    vertices, faces = make(rng, 120, 1.0)
    vertices = np.float64(vertices) / 3 * scale + offset
    scene = double(vertices, faces)
    points = scale * rng.normal(size=(500, 3)) + offset
    # About the offset, so that NumPy does not lose what it has to compare.
    expected = brute_distance((vertices[faces] - offset) / scale, (points - offset) / scale, float)
    found = scene.closest_point(points)
    np.testing.assert_allclose(found.distance / scale, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(scene.distance(points), found.distance)
    reach = np.linalg.norm((found.position - points) / scale, axis=1)
    np.testing.assert_allclose(reach, expected, rtol=1e-9, atol=1e-12 + 1e-15 * abs(offset) / scale)
    a, b, c = np.moveaxis(vertices[faces[found.prim_id]], 1, 0)
    u, v = found.uv[:, :1], found.uv[:, 1:]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), found.position, rtol=1e-15, atol=1e-12 * scale)
    assert (found.geom_id == 0).all()


def test_meshes_are_named():
    far = CUBE_V / 3 + 1e7
    scene = ropewalk.Scene.from_meshes([(far + 9, CUBE_F), (far, np.tile(CUBE_F, (2, 1)))])
    assert scene.precision == "double"
    found = scene.closest_point(rng.uniform(-1, 1, (500, 3)) + 1e7)
    assert (found.geom_id == 1).all() and (found.prim_id < len(CUBE_F)).all()


@place
def test_sides_with_ties(scale, offset):
    """A grid that meets faces, edges, vertices and the diagonals of faces."""
    steps = np.arange(-4, 9) / 4
    p = np.stack(np.meshgrid(steps, steps, steps), -1)
    within, inside = ((p >= 0) & (p <= 1)).all(-1), ((p > 0) & (p < 1)).all(-1)
    # Rounding keeps planes parallel to the axes, and points in them.
    move = lambda q: q * scale + offset  # noqa: E731
    scene = double(move(CUBE_V), CUBE_F)
    np.testing.assert_array_equal(scene.contains(move(p)), within)
    signed = scene.signed_distance(move(p))
    assert (signed[inside] < 0).all() and (signed[~within] > 0).all()
    assert (signed[within & ~inside] == 0).all()
    # Distances of points on the surface are rounded, their sides are not.
    np.testing.assert_allclose(abs(signed), scene.distance(move(p)), rtol=0, atol=1e-15 * scale)


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0), (1, 0), (1e6, 0), (1e4, 1e7)])
def test_beside_faces_and_in_cavities(scale, offset):
    outer, inner = ball(4), ball(3, 0.5)
    meshes = [(v / 3 * scale + offset, f) for v, f in (outer, (inner[0], inner[1][:, ::-1]))]
    shell = ropewalk.Scene.from_meshes(meshes, precision="double")
    for radius, expected in [(0.1, False), (0.4, False), (0.7, True), (1.5, False)]:
        p = rng.normal(size=(500, 3))
        p *= radius / 3 * scale / np.linalg.norm(p, axis=1, keepdims=True)
        assert (shell.contains(p + offset) == expected).all()
        assert (shell.contains(p + offset, method="winding") == expected).all()
    (v, f), _ = meshes
    tri = v[f]
    middle = tri[:, 0] + ((tri[:, 1] - tri[:, 0]) + (tri[:, 2] - tri[:, 0])) / 3
    normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    step = max(1e-9 * scale, 1e-15 * offset)
    assert shell.contains(middle - step * normal).all()
    assert not shell.contains(middle + step * normal).any()


def test_detail_of_a_thousandth_at_ten_million():
    """A box a thousandth high, and points a tenth of that beside its faces."""
    v = CUBE_V * [100, 100, 1e-3] + [1e7, -1e7, 0.5]
    scene = double(v, CUBE_F)
    heights = 0.5 + np.array([-1e-4, 0, 1e-4, 9e-4, 1.1e-3])
    p = np.stack([np.full(5, 1e7 + 50.1), np.full(5, -1e7 + 20.3), heights], -1)
    assert scene.contains(p).tolist() == [False, True, True, True, False]
    np.testing.assert_allclose(scene.signed_distance(p), [1e-4, 0, -1e-4, -1e-4, 1e-4], atol=1e-15)


@pytest.mark.parametrize(("scale", "offset"), [(1e-6, 0), (1, 0), (1e6, 0), (1e4, 1e7)])
def test_parity_is_winding_on_closed_surfaces(scale, offset):
    v, f = ball(3, scale, offset)
    scene = double(v, f)
    p = rng.uniform(-1.2, 1.2, (1000, 3)) * scale + offset
    number = scene.winding_number(p, accuracy=0)
    assert (np.abs(number - number.round()) < 1e-6).all()
    for accuracy in (0.2, 0.01, 1e-4):
        assert np.abs(scene.winding_number(p, accuracy=accuracy) - number).max() <= accuracy
    np.testing.assert_array_equal(scene.contains(p), number.round() == 1)
    np.testing.assert_array_equal(scene.contains(p, method="winding"), number.round() == 1)


@every
def test_what_float32_holds_is_answered_as_in_single_precision(query):
    v, f = ball(3)
    p = rng.uniform(-1.3, 1.3, (2000, 3))
    one, two = (QUERIES[query](ropewalk.Scene(v, f, precision=k), p) for k in ("single", "double"))
    if query == "locate":
        np.testing.assert_array_equal(one >= 0, two >= 0)
    elif query == "winding_number":
        np.testing.assert_allclose(one, two, atol=0.02)
    else:
        np.testing.assert_array_equal(one, two)


@every
def test_shapes_threads_and_pickles(query):
    ask, scene = QUERIES[query], double(*ball(4))
    p = rng.uniform(-1.3, 1.3, (30, 100, 3))
    expected = ask(scene, p, threads=1)
    assert expected.shape == (30, 100) and ask(scene, p[0, 0]).shape == ()
    assert ask(scene, np.empty((2, 0, 3))).shape == (2, 0)
    for threads in (0, 2, 5):
        np.testing.assert_array_equal(ask(scene, p, threads=threads), expected)
    np.testing.assert_array_equal(ask(pickle.loads(pickle.dumps(scene)), p), expected)


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


def test_points_beyond_the_size_of_a_small_scene():
    small = double(CUBE_V * 1e-60, CUBE_F)
    with pytest.warns(ropewalk.InvalidPointWarning, match="1 points"):
        assert np.isnan(small.distance([[1e60, 0, 0], [1e30, 0, 0]])).tolist() == [True, False]


@every
def test_bad_arguments(query):
    ask = QUERIES[query]
    for wrong in (np.zeros(2), np.zeros((3, 4)), 1.0):
        refused(ropewalk.ArgumentError, "points", None, "shape", lambda: ask(CUBE, wrong))
    for wrong in (None, "text", [[1, 2, 3], [1, 2]], np.zeros((2, 3), complex), np.zeros((2, 3), bool)):
        refused(ropewalk.ArgumentTypeError, "points", None, "expected", lambda: ask(CUBE, wrong))
    placed = ropewalk.Scene.from_instances([(CUBE, np.eye(4))])
    refused(ropewalk.ArgumentError, "scene", None, "instances", lambda: ask(placed, [0, 0, 0]))


@every
def test_scenes_without_area(query):
    found = QUERIES[query](double(CUBE_V, [[0, 0, 1]]), [[0.5, 0.5, 0.5], [9, 9, 9]])
    if "distance" in query or query == "closest_point":
        assert (found == np.inf).all()
    else:
        assert not (found > 0).any()


def test_cells_hold_what_is_found_in_them():
    v, f = ball(4, 10.0, 1e7)
    scene = double(v, f)
    every_cell = scene.cells()
    assert every_cell.bounds.dtype == np.float64
    assert len(every_cell.cell) == scene.report.leaves
    assert every_cell.primitives.sum() == scene.report.references
    p = rng.uniform(-11, 11, (40, 40, 3)) + 1e7
    cell = scene.locate(p)
    within = ((p >= scene.bounds[0]) & (p <= scene.bounds[1])).all(-1)
    np.testing.assert_array_equal(cell >= 0, within)
    bounds = scene.cells(cell).bounds
    low, high = bounds[..., 0, :] - 1e-8, bounds[..., 1, :] + 1e-8
    assert ((low <= p) & (p <= high)).all(-1)[within].all()
    assert np.isnan(bounds[~within]).all()
