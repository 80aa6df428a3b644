"""What may be given: dtypes, layouts, shapes, and arrays of others."""

import array
import os
import sys

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh, rays

rng = np.random.default_rng(23)
VERTICES, FACES = random_mesh(rng, 100, 1.0)
SCENE = ropewalk.Scene(VERTICES, FACES)
ORIGINS, DIRECTIONS = rays(rng, 600, 1.0)
EXPECTED = SCENE.closest_hit(ORIGINS, DIRECTIONS)


def same(hits, expected=EXPECTED):
    np.testing.assert_array_equal(hits.t, expected.t)
    np.testing.assert_array_equal(hits.prim_id, expected.prim_id)
    np.testing.assert_array_equal(hits.uv, expected.uv)
    np.testing.assert_array_equal(hits.position, expected.position)


@pytest.mark.parametrize("dtype", ["f4", "f8", ">f4", ">f8", "g"])
def test_floats(dtype):
    same(SCENE.closest_hit(ORIGINS.astype(dtype), DIRECTIONS.astype(dtype)))
    same(ropewalk.Scene(VERTICES.astype(dtype), FACES).closest_hit(ORIGINS, DIRECTIONS))


@pytest.mark.parametrize("dtype", ["f2", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4"])
def test_small_numbers(dtype):
    small = rng.integers(0, 5, (200, 3))
    ahead = np.maximum(small[::-1], 1)
    expected = SCENE.closest_hit(small.astype("f4"), ahead.astype("f4"))
    same(SCENE.closest_hit(small.astype(dtype), ahead.astype(dtype)), expected)


@pytest.mark.parametrize("dtype", ["i2", "i4", "i8", "u1", "u2", "u4", "u8", ">i4", ">u8"])
def test_faces_of_any_integers(dtype):
    faces = FACES[:80].astype(dtype)
    expected = ropewalk.Scene(VERTICES, FACES[:80]).closest_hit(ORIGINS, DIRECTIONS)
    same(ropewalk.Scene(VERTICES, faces).closest_hit(ORIGINS, DIRECTIONS), expected)
    same(ropewalk.Scene(VERTICES, np.asfortranarray(faces)).closest_hit(ORIGINS, DIRECTIONS), expected)


def unaligned(values):
    raw = np.zeros(values.nbytes + 1, np.uint8)
    view = raw[1:].view(values.dtype).reshape(values.shape)
    view[...] = values
    assert not view.flags.aligned
    return view


def read_only(values):
    values = values.copy()
    values.flags.writeable = False
    return values


LAYOUTS = {
    "fortran": np.asfortranarray,
    "strided": lambda x: np.repeat(x, 2, axis=0)[::2],
    "columns": lambda x: np.concatenate([x, x], axis=1)[:, :3],
    "reversed": lambda x: x[::-1].copy()[::-1],
    "transposed": lambda x: x.T.copy().T,
    "unaligned": unaligned,
    "read-only": read_only,
    "list": lambda x: x.tolist(),
    "rows": list,
    "structured": lambda x: np.rec.fromarrays(x.T, names="x,y,z").view(("f4", 3)).view(np.ndarray),
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_layouts(layout):
    make = LAYOUTS[layout]
    same(SCENE.closest_hit(make(ORIGINS), make(DIRECTIONS)))
    if layout != "list":
        same(ropewalk.Scene(make(VERTICES), FACES).closest_hit(ORIGINS, DIRECTIONS))


class Interface:
    """An array of somebody else's, by the array interface."""

    def __init__(self, values):
        self.values = values
        self.__array_interface__ = values.__array_interface__


class DLPack:
    """An array of somebody else's, by DLPack."""

    def __init__(self, values):
        self.values = values

    def __dlpack__(self, **options):
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


@pytest.mark.parametrize("wrap", [Interface, DLPack, memoryview])
def test_arrays_of_others(wrap):
    same(SCENE.closest_hit(wrap(ORIGINS), wrap(DIRECTIONS)))
    same(ropewalk.Scene(wrap(VERTICES), wrap(FACES)).closest_hit(ORIGINS, DIRECTIONS))


def test_torch():
    torch = pytest.importorskip("torch")
    o, d = torch.from_numpy(ORIGINS), torch.from_numpy(DIRECTIONS)
    same(SCENE.closest_hit(o, d))
    same(SCENE.closest_hit(o.double().T.contiguous().T, d))


def test_array_module():
    one = SCENE.closest_hit(array.array("d", ORIGINS[0]), array.array("f", DIRECTIONS[0]))
    assert one.t == EXPECTED.t[0]


@pytest.mark.parametrize("shape", [(), (1,), (600,), (20, 30), (2, 3, 100), (0,), (4, 0, 2)])
def test_results_have_the_shape_of_the_rays(shape):
    count = int(np.prod(shape))
    o, d = ORIGINS[:count].reshape(*shape, 3), DIRECTIONS[:count].reshape(*shape, 3)
    hits = SCENE.closest_hit(o, d)
    for name, width in (("t", ()), ("prim_id", ()), ("geom_id", ()), ("hit", ())):
        assert getattr(hits, name).shape == shape + width, name
    assert hits.uv.shape == (*shape, 2)
    assert hits.normal.shape == hits.position.shape == (*shape, 3)
    assert (hits.t.dtype, hits.prim_id.dtype, hits.geom_id.dtype) == (np.float32, np.int32, np.int32)
    assert (hits.uv.dtype, hits.normal.dtype, hits.position.dtype) == (np.float32,) * 3
    np.testing.assert_array_equal(hits.t.reshape(-1), EXPECTED.t[:count])
    assert SCENE.occluded(o, d).shape == SCENE.count_hits(o, d).shape == shape
    assert SCENE.occluded(o, d).dtype == np.bool_ and SCENE.count_hits(o, d).dtype == np.int32
    lists = SCENE.all_hits(o, d)
    assert lists.counts.shape == lists.shape == shape and lists.offsets.shape == (count + 1,)
    assert lists.t.shape == lists.ray_id.shape == (len(lists),)
    assert lists.uv.shape == (len(lists), 2) and lists.position.shape == (len(lists), 3)
    assert (lists.offsets.dtype, lists.ray_id.dtype) == (np.int64, np.int64)
    assert hits.shape == shape
    repr(hits), repr(lists)


def test_shapes_broadcast():
    eye = [0.1, 0.2, -3.0]
    grid = SCENE.closest_hit(eye, DIRECTIONS.reshape(20, 30, 3))
    same(grid, SCENE.closest_hit(np.tile(np.float32(eye), (20, 30, 1)), DIRECTIONS.reshape(20, 30, 3)))
    along = SCENE.closest_hit(ORIGINS, [0, 0, 1])
    same(along, SCENE.closest_hit(ORIGINS, np.tile([0, 0, 1], (600, 1))))
    outer = SCENE.closest_hit(ORIGINS[:7, None], DIRECTIONS[None, :5])
    assert outer.t.shape == (7, 5)
    assert outer.t[3, 2] == SCENE.closest_hit(ORIGINS[3], DIRECTIONS[2]).t


def test_ranges_of_any_shape():
    t_max = np.linspace(0, 2, 600)
    expected = SCENE.closest_hit(ORIGINS, DIRECTIONS, 0.1, t_max)
    low = np.full(600, 0.1, np.float32)
    same(SCENE.closest_hit(ORIGINS, DIRECTIONS, low, t_max.astype("f4")), expected)
    same(SCENE.closest_hit(ORIGINS, DIRECTIONS, t_min=[0.1], t_max=t_max.tolist()), expected)
    picture = SCENE.closest_hit(
        ORIGINS.reshape(20, 30, 3), DIRECTIONS.reshape(20, 30, 3), 0.1, t_max.reshape(20, 30)
    )
    np.testing.assert_array_equal(picture.t.reshape(-1), expected.t)
    rows = SCENE.closest_hit(
        ORIGINS.reshape(20, 30, 3), DIRECTIONS.reshape(20, 30, 3), t_max=t_max[:30]
    )
    np.testing.assert_array_equal(
        rows.t.reshape(-1), SCENE.closest_hit(ORIGINS, DIRECTIONS, t_max=np.tile(t_max[:30], 20)).t
    )


def test_nothing_is_copied_that_is_ready():
    """Rays are read where they are: what a query allocates are its results."""
    from ropewalk._arrays import as_float32

    assert as_float32(ORIGINS) is ORIGINS
    assert as_float32(read_only(ORIGINS)).base is None
    before = sys.getrefcount(ORIGINS)
    hits = SCENE.closest_hit(ORIGINS, DIRECTIONS)
    assert sys.getrefcount(ORIGINS) > before, "kept by the hits for uv, normal and position"
    del hits
    assert sys.getrefcount(ORIGINS) == before


def test_inputs_are_left_alone():
    o, d, t_max = ORIGINS.copy(), DIRECTIONS.copy(), np.full(600, 5.0, np.float32)
    hits = SCENE.closest_hit(o, d, t_max=t_max)
    hits.uv, SCENE.all_hits(o, d), SCENE.occluded(o, d, t_max=t_max)
    np.testing.assert_array_equal(o, ORIGINS)
    np.testing.assert_array_equal(d, DIRECTIONS)
    assert (t_max == 5).all()


def test_surface_data_of_rays_that_were_written_to_is_refused():
    o = ORIGINS.copy()
    hits = SCENE.closest_hit(o, DIRECTIONS)
    o += 1
    with pytest.raises(ropewalk.RopewalkError, match="written to"):
        hits.position


@pytest.mark.skipif(not os.path.exists("/proc/self/clear_refs"), reason="reads peaks from /proc")
@pytest.mark.parametrize("threads", [1, 2])
def test_a_query_needs_no_memory_but_its_results(threads):
    count = 2_000_000
    o = np.tile(ORIGINS, (count // 600, 1))
    d = np.tile(DIRECTIONS, (count // 600, 1))
    SCENE.closest_hit(o[:100_000], d[:100_000], threads=threads)

    def status(name):
        with open("/proc/self/status") as lines:
            return next(int(line.split()[1]) for line in lines if line.startswith(name)) * 1024

    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")  # forgets the peak
    before = status("VmRSS")
    hits = SCENE.closest_hit(o, d, threads=threads)
    more = status("VmHWM") - before
    results = hits.t.nbytes + hits.prim_id.nbytes + hits.geom_id.nbytes
    assert more < results + 8_000_000, "rays interleaved would be 64 MB"
