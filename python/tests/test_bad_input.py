"""The table of bad input in docs/python.md, row by row."""

import gzip
import warnings

import numpy as np
import pytest

import ropewalk
from ropewalk import ArgumentError, ArgumentTypeError

V = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
F = np.int64([[0, 1, 2], [0, 2, 3]])
SCENE = ropewalk.Scene(V, F)
O, D = np.float32([0.2, 0.2, 2]), np.float32([0, 0, -1])
QUERIES = ["closest_hit", "occluded", "all_hits", "count_hits", "first_hits"]


def ask(query, origins, directions, *args, scene=SCENE, **kwargs):
    k = (3,) if query == "first_hits" else ()
    return getattr(scene, query)(origins, directions, *k, *args, **kwargs)


def counts(query, *args, **kwargs):
    """Hits of each ray as far as the query says."""
    found = ask(query, *args, **kwargs)
    if isinstance(found, ropewalk.Hits):
        return found.hit
    return getattr(found, "counts", found)


def refused(error, argument, index, text, call):
    with pytest.raises(error, match=text) as caught:
        call()
    assert isinstance(caught.value, ropewalk.RopewalkError)
    assert (caught.value.argument, caught.value.index) == (argument, index)
    assert (argument or "") in str(caught.value)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e39, -1e300])
def test_vertices_that_are_not_finite(value):
    vertices = V.astype(np.float64)
    vertices[2, 1] = value
    meshes = [(V, F), (vertices, F)]
    name = "meshes[1].vertices"
    for precision in ("single",) if abs(value) == 1e39 else ("auto", "single", "double"):
        kind = {"precision": precision}
        refused(ArgumentError, "vertices", 2, "finite", lambda: ropewalk.Scene(vertices, F, **kind))
        refused(ArgumentError, name, 2, "finite", lambda: ropewalk.Scene.from_meshes(meshes, **kind))


@pytest.mark.parametrize("index", [-1, 4, 2**31, 2**32, 2**32 + 1, -(2**32), 2**62])
def test_faces_that_name_no_vertex(index):
    faces = F.copy()
    faces[1, 2] = index
    refused(ArgumentError, "faces", 1, f"vertex {index}", lambda: ropewalk.Scene(V, faces))
    with pytest.raises(ArgumentError, match=r"meshes\[0\]\.faces\[1\]"):
        ropewalk.Scene.from_meshes([(V, faces), (V, F)])


def test_unsigned_faces_that_name_no_vertex():
    faces = F.astype(np.uint64)
    faces[0, 0] = 2**64 - 1
    refused(ArgumentError, "faces", 0, "18446744073709551615", lambda: ropewalk.Scene(V, faces))


def test_quads_that_name_no_vertex():
    for index in (-1, 4, 2**40):
        faces = np.int64([[0, 1, 2, 3], [0, 2, 3, 3]])
        faces[1, 3] = index
        for precision in ("single", "double"):
            bad = lambda: ropewalk.Scene(V, faces, precision=precision)  # noqa: B023, E731
            refused(ArgumentError, "faces", 1, f"vertex {index}", bad)
    with pytest.raises(ArgumentError, match="third index twice"):
        ropewalk.Scene(V, [[0, 1, 2, -1]])
    refused(ArgumentTypeError, "faces", None, "integers", lambda: ropewalk.Scene(V, np.zeros((1, 4))))


BAD_POINT = [np.nan, np.inf, 1e39]


@pytest.mark.parametrize("value", BAD_POINT)
def test_shapes_that_are_not_finite(value):
    good, bad = np.zeros((3, 3)), np.zeros((3, 3))
    bad[1, 2] = value
    text = "expected finite numbers"
    refused(ArgumentError, "centers", 1, text, lambda: ropewalk.Spheres(bad, 1))
    refused(ArgumentError, "base", 1, text, lambda: ropewalk.Cones(bad, good, 1, 1))
    refused(ArgumentError, "apex", 1, text, lambda: ropewalk.Cylinders(good, bad, 1))
    reach = np.full((2, 3), 3e38)
    refused(ArgumentError, "centers", 1, "beyond", lambda: ropewalk.Spheres(reach, [1e37, 3e38]))


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1e39, 1e-60])
def test_radii_of_nothing(value):
    o, u = np.zeros((3, 3)), np.ones((3, 3))
    refused(ArgumentError, "radii", 2, "expected a finite", lambda: ropewalk.Spheres(o, [1, 1, value]))
    refused(ArgumentError, "radii", None, "expected a finite", lambda: ropewalk.Spheres(o, value))
    refused(ArgumentError, "radius", 0, "expected", lambda: ropewalk.Cylinders(o, u, [value, 1, 1]))
    if 0 <= value < 1:
        refused(ArgumentError, "base_radius", 1, "above 0", lambda: ropewalk.Cones(o, u, [1, value, 1], 0))
        assert len(ropewalk.Cones(o, u, value, 1)) == 3
    else:
        refused(ArgumentError, "apex_radius", 1, "finite", lambda: ropewalk.Cones(o, u, 1, [1, value, 1]))


def test_shapes_of_a_wrong_shape():
    o = np.zeros((3, 3))
    refused(ArgumentError, "centers", None, "shape", lambda: ropewalk.Spheres(np.zeros((3, 4)), 1))
    refused(ArgumentError, "radii", None, "shape", lambda: ropewalk.Spheres(o, [1, 1]))
    refused(ArgumentError, "radii", None, "shape", lambda: ropewalk.Spheres(o, np.ones((3, 1))))
    refused(ArgumentError, "apex", None, "shape", lambda: ropewalk.Cones(o, o[:2], 1, 1))
    refused(ArgumentError, "apex_radius", None, "shape", lambda: ropewalk.Cones(o, o, 1, np.ones(4)))
    refused(ArgumentTypeError, "centers", None, "real numbers", lambda: ropewalk.Spheres("text", 1))
    refused(ArgumentTypeError, "radii", None, "real numbers", lambda: ropewalk.Spheres(o, [True] * 3))
    refused(ArgumentTypeError, "radius", None, "real numbers", lambda: ropewalk.Cylinders(o, o, 1j))
    with pytest.raises(ArgumentTypeError, match=r"meshes\[1\]: expected a pair .* Spheres") as caught:
        ropewalk.Scene.from_meshes([(V, F), 7])
    assert caught.value.index == 1


def test_spheres_in_double_precision():
    for made in (ropewalk.Spheres([[0, 0, 0]], 1), ropewalk.Cylinders([[0, 0, 0]], [[0, 0, 1]], 1)):
        refused(
            ArgumentError, "precision", None, "move the scene",
            lambda: ropewalk.Scene.from_meshes([made, (V, F)], precision="double"),  # noqa: B023
        )  # fmt: skip


def test_faces_without_vertices():
    refused(ArgumentError, "faces", 0, "no vertices", lambda: ropewalk.Scene([], F))


@pytest.mark.parametrize("shape", [(), (3,), (4, 2), (4, 4), (1, 4, 3), (12,)])
def test_vertices_of_a_wrong_shape(shape):
    refused(ArgumentError, "vertices", None, "shape", lambda: ropewalk.Scene(np.zeros(shape), F))


@pytest.mark.parametrize("shape", [(), (3,), (2, 2), (2, 5), (1, 2, 3)])
def test_faces_of_a_wrong_shape(shape):
    faces = np.zeros(shape, np.int32)
    refused(ArgumentError, "faces", None, "shape", lambda: ropewalk.Scene(V, faces))


BAD_DTYPES = [
    np.zeros((2, 3), bool),
    np.zeros((2, 3), complex),
    np.zeros((2, 3), "U4"),
    np.zeros((2, 3), object),
    np.zeros((2, 3), "M8[s]"),
    "text",
    None,
    object(),
    [[1, 2, 3], [1, 2]],
    {"a": 1},
]


@pytest.mark.parametrize("value", BAD_DTYPES, ids=repr)
def test_what_is_no_array_of_numbers(value):
    refused(ArgumentTypeError, "vertices", None, "expected", lambda: ropewalk.Scene(value, F))
    refused(ArgumentTypeError, "faces", None, "expected", lambda: ropewalk.Scene(V, value))
    for query in QUERIES:
        refused(ArgumentTypeError, "origins", None, "expected", lambda: ask(query, value, D))
        refused(ArgumentTypeError, "directions", None, "expected", lambda: ask(query, O, value))
        refused(ArgumentTypeError, "t_min", None, "expected", lambda: ask(query, O, D, value))
        refused(ArgumentTypeError, "t_max", None, "expected", lambda: ask(query, O, D, 0, value))


def test_faces_of_floats():
    faces = F.astype(np.float64)
    refused(ArgumentTypeError, "faces", None, "integers", lambda: ropewalk.Scene(V, faces))


def test_a_device_array():
    class OnDevice:
        def __dlpack__(self, **_):
            raise RuntimeError("lives on a GPU")

        def __dlpack_device__(self):
            return (2, 0)

    refused(ArgumentTypeError, "origins", None, "CPU", lambda: SCENE.closest_hit(OnDevice(), D))


@pytest.mark.parametrize("query", QUERIES)
@pytest.mark.parametrize("shape", [(), (2,), (5, 4), (3, 1)])
def test_rays_of_a_wrong_shape(query, shape):
    wrong = np.ones(shape)
    refused(ArgumentError, "origins", None, "shape", lambda: ask(query, wrong, D))
    refused(ArgumentError, "directions", None, "shape", lambda: ask(query, O, wrong))


@pytest.mark.parametrize("query", QUERIES)
def test_rays_that_do_not_fit_each_other(query):
    o, d = np.zeros((5, 3)), np.ones((4, 3))
    refused(ArgumentError, "directions", None, "fits", lambda: ask(query, o, d))
    for name in ("t_min", "t_max", "masks", "skip"):
        value = np.zeros(4, np.int32)
        text = "scalar or an array"
        refused(ArgumentError, name, None, text, lambda: ask(query, o, [1, 0, 0], **{name: value}))


def test_empty_arrays():
    empty = ropewalk.Scene(np.empty((0, 3)), np.empty((0, 3), int))
    for scene in (empty, ropewalk.Scene([], []), ropewalk.Scene(V, []), ropewalk.Scene.from_meshes([])):
        assert len(scene) == 0 and "without" in repr(scene)
        assert np.isnan(scene.bounds).all()
        assert not scene.closest_hit(np.zeros((9, 3)), [0, 0, 1]).hit.any()
        for query in QUERIES:
            assert not counts(query, np.zeros((9, 3)), [0, 0, 1], scene=scene).any()
    for query in QUERIES:
        assert counts(query, np.empty((0, 3)), np.empty((0, 3))).shape == (0,)
        assert counts(query, np.empty((0, 3)), D).shape == (0,)
    assert SCENE.all_hits(np.empty((0, 3)), D).offsets.tolist() == [0]
    assert SCENE.first_hits(O, D, 0).offsets.tolist() == [0, 0]


def test_one_triangle():
    scene = ropewalk.Scene(V, F[:1])
    assert scene.closest_hit(O, D).t == 2
    for query in QUERIES:
        assert counts(query, O, D, scene=scene).tolist() == 1


def test_faces_without_area():
    scene = ropewalk.Scene(V, [[0, 0, 1], [2, 2, 2], [0, 1, 2]])
    assert scene.report.degenerate == 2
    assert scene.closest_hit(O, D).prim_id == 2
    flat = ropewalk.Scene(V, [[0, 0, 1], [2, 2, 2]])
    assert not flat.occluded([O, [0, 0, 1]], [D, [0, 0, -1]]).any()


BAD_RAYS = {
    "NaN origin": ([np.nan, 0.2, 2], [0, 0, -1]),
    "infinite origin": ([0.2, np.inf, 2], [0, 0, -1]),
    "origin beyond float32": ([0.2, 1e39, 2], [0, 0, -1]),
    "NaN direction": ([0.2, 0.2, 2], [0, np.nan, -1]),
    "infinite direction": ([0.2, 0.2, 2], [0, 0, -np.inf]),
    "zero direction": ([0.2, 0.2, 2], [0, -0.0, 0]),
    "direction below float32": ([0.2, 0.2, 2], [0, 0, -1e-60]),
}


@pytest.mark.parametrize("query", QUERIES)
@pytest.mark.parametrize("what", BAD_RAYS)
def test_rays_without_meaning(query, what):
    o, d = np.tile(O, (5000, 1)).astype(float), np.tile(D, (5000, 1)).astype(float)
    o[4321], d[4321] = BAD_RAYS[what]
    o[4999], d[4999] = BAD_RAYS[what]
    with pytest.warns(ropewalk.InvalidRayWarning, match="2 rays .* ray 4321"):
        found = counts(query, o, d)
    assert found.sum() == 4998 and not found[4321] and not found[4999]
    with pytest.raises(ropewalk.InvalidRayError, match="ray 4321 can hit nothing") as caught:
        ask(query, o, d, strict=True)
    assert caught.value.index == 4321
    assert counts(query, o[:9], d[:9], strict=True).all()


@pytest.mark.parametrize("query", QUERIES)
def test_t_min_above_t_max(query):
    assert not counts(query, [O, O], D, 3.0, [2.5, 2.0]).any()
    with pytest.raises(ropewalk.InvalidRayError, match=r"ray 1 .* 3.0 to 2.5"):
        ask(query, [O, O], D, 3.0, [3.0, 2.5], strict=True)


@pytest.mark.parametrize("query", QUERIES)
def test_nan_in_a_range(query):
    for arguments in ((np.nan,), (0, np.nan)):
        with pytest.warns(ropewalk.InvalidRayWarning):
            assert not counts(query, O, D, *arguments)


def test_ends_of_the_range_are_included():
    for query in QUERIES:
        assert counts(query, O, D, 2.0, 2.0)
        assert counts(query, O, D, -np.inf, np.inf)
        assert not counts(query, O, D, np.nextafter(np.float32(2), np.float32(3)))


@pytest.mark.parametrize("query", QUERIES)
def test_masks(query):
    for value in (2**32, -(2**31) - 1, [1, 2**40]):
        rays = [O, O]
        refused(ArgumentError, "masks", None, "32 bits", lambda: ask(query, rays, D, masks=value))
    refused(ArgumentTypeError, "masks", None, "integers", lambda: ask(query, O, D, masks=1.5))
    for value in (1, -1, 2**32 - 1, np.uint8(1), np.int64(-1), [1], -(2**31) + 1):
        assert counts(query, O, D, masks=value), value
    assert not counts(query, O, D, masks=0)


def test_masks_of_meshes():
    for value in ([1], [1, 2, 3], 1, [[1, 2]]):
        with pytest.raises(ArgumentError, match="one a mesh"):
            ropewalk.Scene.from_meshes([(V, F), (V, F)], masks=value)


@pytest.mark.parametrize("query", QUERIES)
def test_skip(query):
    two = ropewalk.Scene.from_meshes([(V, F), (V, F[:1])])
    refused(ArgumentError, "skip", 0, "not in the scene", lambda: ask(query, O, D, skip=2))
    refused(ArgumentError, "skip", 1, "not in the scene", lambda: ask(query, [O, O], D, skip=[0, 2**40]))
    refused(ArgumentError, "skip", None, "pair", lambda: ask(query, O, D, skip=0, scene=two))
    refused(ArgumentError, "skip", 0, "not in", lambda: ask(query, O, D, skip=(1, 1), scene=two))
    refused(ArgumentError, "skip", 0, "not in", lambda: ask(query, O, D, skip=(0, 2), scene=two))
    refused(ArgumentTypeError, "skip", None, "integers", lambda: ask(query, O, D, skip=0.5))
    assert counts(query, O, D, skip=-1, scene=two)
    assert not counts(query, O, D, skip=0)


@pytest.mark.parametrize("query", QUERIES)
def test_sides_that_are_none(query):
    refused(ArgumentError, "faces", None, "'front'", lambda: ask(query, O, D, faces="inside"))
    refused(ArgumentTypeError, "faces", None, "string", lambda: ask(query, O, D, faces=1))
    balls = ropewalk.load("spd:balls:1")
    refused(ArgumentError, "faces", None, "'both'", lambda: ask(query, O, D, faces="back", scene=balls))
    ask(query, O, D, faces="both", scene=balls)


def test_memory_limits():
    vertices = np.random.default_rng(0).normal(size=(30_000, 3))
    faces = np.arange(30_000).reshape(-1, 3)
    build = lambda limit: ropewalk.Scene(vertices, faces, memory_limit=limit)  # noqa: E731
    refused(ropewalk.OutOfMemoryError, "memory_limit", None, "needs about .* bytes", lambda: build(10_000))
    refused(ArgumentError, "memory_limit", None, "found -1", lambda: build(-1))
    refused(ArgumentTypeError, "memory_limit", None, "integer", lambda: build(1e9))
    meshes = [(vertices, faces)] * 2
    with pytest.raises(MemoryError):
        ropewalk.Scene.from_meshes(meshes, memory_limit=2**20)
    with pytest.raises(MemoryError):
        ropewalk.load("spd:tetra:6", memory_limit=2**16)
    free, tight = build(None), build(2_400_000)
    assert build(2**40).report.tree_bytes == free.report.tree_bytes
    assert tight.report.tree_bytes + tight.report.geometry_bytes <= 2_400_000
    assert tight.report.duplication < free.report.duplication
    o, d = np.random.default_rng(1).normal(size=(2, 5000, 3))
    np.testing.assert_array_equal(tight.closest_hit(o, d).t, free.closest_hit(o, d).t)


@pytest.mark.parametrize("query", QUERIES)
def test_threads(query):
    refused(ArgumentError, "threads", None, "0 to", lambda: ask(query, O, D, threads=-1))
    refused(ArgumentError, "threads", None, "0 to", lambda: ask(query, O, D, threads=10**6))
    refused(ArgumentTypeError, "threads", None, "integer", lambda: ask(query, O, D, threads=1.5))
    refused(ArgumentError, "threads", None, "0 to", lambda: ropewalk.Scene(V, F, threads=-2))


def test_k():
    refused(ArgumentError, "k", None, "found -1", lambda: SCENE.first_hits(O, D, -1))
    refused(ArgumentTypeError, "k", None, "integer", lambda: SCENE.first_hits(O, D, 1.0))
    assert len(SCENE.first_hits(O, D, 2**62)) == 1
    assert len(SCENE.first_hits(O, D, np.int8(1))) == 1


def test_presets():
    refused(ArgumentError, "preset", None, "fast, balanced, best", lambda: ropewalk.Scene(V, F, preset="fats"))
    refused(ArgumentTypeError, "preset", None, "string", lambda: ropewalk.Scene(V, F, preset=2))


def test_meshes_that_are_none():
    refused(ArgumentTypeError, "meshes", None, "pairs", lambda: ropewalk.Scene.from_meshes(3))
    refused(ArgumentTypeError, "meshes", 1, "pair", lambda: ropewalk.Scene.from_meshes([(V, F), V[:1]]))


def test_far_from_the_origin():
    far = V.astype(np.float64) / 3 + 1e7
    with pytest.warns(ropewalk.PrecisionWarning, match="vertices"):
        ropewalk.Scene(far, F, precision="single")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ropewalk.Scene(V.astype(np.float64) / 3, F, precision="single")
        assert ropewalk.Scene(far, F).precision == "double"
        ropewalk.Scene(far.astype(np.float32), F[:0])
        ropewalk.Scene(100 * V + np.float64(1e3), F)


def test_files(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file") as caught:
        ropewalk.load(tmp_path / "absent.nff")
    assert isinstance(caught.value, ropewalk.SceneNotFoundError)
    for name, content, text in [
        ("words.nff", b"b 0 0 0\nnonsense", r"words\.nff.*2"),
        ("cut.nff", b"s 0 0", "cut.nff"),
        ("binary.nff", bytes(range(256)), "binary.nff"),
        ("cut.nff.gz", gzip.compress(b"s 0 0 0 1\n" * 100)[:-20], "cut.nff.gz"),
        ("plain.nff.gz", b"s 0 0 0 1", "gzip"),
    ]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(ropewalk.SceneFileError, match=text):
            ropewalk.load(tmp_path / name)
    with pytest.raises(ropewalk.SceneFileError, match="directory"):
        ropewalk.load(tmp_path)
    with pytest.raises(ropewalk.SceneFileError, match="balls, gears"):
        ropewalk.load("spd:nonesuch")
    refused(ArgumentTypeError, "path", None, "path", lambda: ropewalk.load(3.5))
    refused(ArgumentTypeError, "path", None, "path", lambda: ropewalk.load("\udcff"))
    (tmp_path / "good.nff.gz").write_bytes(gzip.compress(b"s 0 0 0 1\n"))
    assert ropewalk.load(tmp_path / "good.nff.gz").closest_hit([0, 0, 3], [0, 0, -1]).t == 2


def test_a_damaged_pickle():
    restore, (kind, kinds, ends, numbers, starts, masks, preset) = SCENE.__reduce__()
    for damaged in [
        (kinds[:1], ends, numbers, starts, masks),
        (kinds, ends[:1], numbers, starts, masks),
        (kinds, ends, numbers[:-1], starts, masks),
        (kinds, ends[::-1].copy(), numbers, starts, masks),
        (kinds + np.uint8(9), ends, numbers, starts, masks),
        (kinds, ends, numbers * np.float32(np.nan), starts, masks),
        (kinds, ends, numbers, [0], masks),
        (kinds, ends, numbers, [0, 99], masks),
        (kinds, ends, numbers, [1, 2], masks),
        (kinds, ends, numbers, starts, []),
    ]:
        with pytest.raises(ropewalk.ArgumentError, match="damaged"):
            restore(kind, *damaged, preset)
