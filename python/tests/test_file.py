"""Scene.save and Scene.open: what is opened answers as what was saved, everything else is refused."""

import os
import pathlib
import pickle
import struct
import subprocess
import sys
import threading

import numpy as np
import pytest

import meshes
import ropewalk


def random_mesh(count, seed):
    return meshes.random_mesh(np.random.default_rng(seed), count, 1.0)


def rays(count, seed):
    return meshes.rays(np.random.default_rng(seed), count, 1.0)


def answers(scene, o, d):
    hits = scene.closest_hit(o, d)
    lists = scene.all_hits(o, d)
    first = scene.first_hits(o, d, 2)
    return [
        hits.t, hits.prim_id, hits.geom_id, hits.uv, hits.normal, hits.position,
        scene.occluded(o, d), scene.count_hits(o, d),
        lists.offsets, lists.t, lists.prim_id, lists.geom_id, lists.position,
        first.t, first.prim_id, scene.bounds, scene.mesh_sizes, scene.masks,
    ]  # fmt: skip


def same(a, b):
    o, d = rays(500, 1)
    for x, y in zip(answers(a, o, d), answers(b, o, d), strict=True):
        np.testing.assert_array_equal(x, y)


@pytest.fixture
def scene():
    return ropewalk.Scene(*random_mesh(300, 1))


@pytest.fixture
def saved(scene, tmp_path):
    path = tmp_path / "scene.rope"
    scene.save(path)
    return path


@pytest.mark.parametrize("name", ["a b.rope", "Bälle 球.rope", "none", b"bytes.rope"])
@pytest.mark.parametrize("copy", [False, True])
def test_round_trip(scene, tmp_path, name, copy):
    path = os.path.join(os.fsencode(tmp_path) if isinstance(name, bytes) else tmp_path, name)
    scene.save(path)
    assert len(os.listdir(tmp_path)) == 1
    again = ropewalk.Scene.open(path, verify=True, copy=copy)
    same(scene, again)
    report = again.report
    assert report.preset == "balanced" and report.seconds == 0
    assert report.leaf_sizes == scene.report.leaf_sizes
    assert "saved" in str(report)
    assert repr(again) == repr(scene)


def test_several_meshes_with_masks(tmp_path):
    parts = [random_mesh(50, 1), random_mesh(0, 2), random_mesh(70, 3)]
    scene = ropewalk.Scene.from_meshes(parts, masks=[1, 2, 4], preset="fast")
    scene.save(tmp_path / "a")
    again = ropewalk.Scene.open(tmp_path / "a")
    same(scene, again)
    assert again.report.preset == "fast"
    o, d = rays(200, 4)
    for mask in (1, 4, 5):
        np.testing.assert_array_equal(
            scene.closest_hit(o, d, masks=mask).prim_id, again.closest_hit(o, d, masks=mask).prim_id
        )
    with pytest.raises(ropewalk.OtherGeometryError, match="it holds 3 meshes; expected one"):
        ropewalk.Scene.open(tmp_path / "a", vertices=parts[0][0], faces=parts[0][1])


def test_scenes_of_other_primitives_and_of_none(tmp_path):
    for made in (ropewalk.load("spd:balls:2"), ropewalk.Scene(np.zeros((0, 3)), np.zeros((0, 3), int))):
        made.save(tmp_path / "a")
        same(made, ropewalk.Scene.open(tmp_path / "a", verify=True))


def test_the_same_arrays_give_the_same_bytes(tmp_path):
    v, f = random_mesh(5000, 5)
    for threads in (1, 2, 3):
        ropewalk.Scene(v, f, threads=threads).save(tmp_path / str(threads))
    first = (tmp_path / "1").read_bytes()
    assert first == (tmp_path / "2").read_bytes() == (tmp_path / "3").read_bytes()
    ropewalk.Scene.open(tmp_path / "1").save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == first


def test_other_geometry_is_refused(saved, scene):
    v, f = random_mesh(300, 1)
    same(scene, ropewalk.Scene.open(saved, vertices=v, faces=f))
    same(scene, ropewalk.Scene.open(saved, vertices=v.astype(np.float64), faces=f.tolist()))
    moved = v.copy()
    moved[f[0][0], 1] = np.nextafter(moved[f[0][0], 1], np.float32(9))
    for vertices, faces, match in [
        (moved, f, "built for other geometry; expected hash "),
        (v, f[::-1].copy(), "built for other geometry"),
        (v, f[:-1], "built for 300 primitives; expected 299"),
    ]:
        with pytest.raises(ropewalk.OtherGeometryError, match=match) as raised:
            ropewalk.Scene.open(saved, vertices=vertices, faces=faces)
        assert raised.value.argument == "path" and str(saved) in str(raised.value)
    with pytest.raises(ropewalk.ArgumentError, match="expected both or none"):
        ropewalk.Scene.open(saved, vertices=v)
    bad = f.copy()
    bad[7, 2] = 10**6
    with pytest.raises(ropewalk.ArgumentError) as raised:
        ropewalk.Scene.open(saved, vertices=v, faces=bad)
    assert raised.value.index == 7


def test_bad_files(saved, tmp_path):
    whole = saved.read_bytes()

    def refused(error, match, content=None, **options):
        path = tmp_path / "bad.rope"
        if content is not None:
            path.write_bytes(content)
        for copy in (False, True):
            with pytest.raises(error, match=match) as raised:
                ropewalk.Scene.open(path, copy=copy, **options)
            assert type(raised.value) is error and raised.value.argument == "path"
            assert str(path) in str(raised.value)
            assert isinstance(pickle.loads(pickle.dumps(raised.value)), error)

    refused(ropewalk.SceneNotFoundError, "cannot open .*bad.rope")
    refused(ropewalk.SceneFileError, "expected 192 bytes, found 0", b"")
    refused(ropewalk.SceneFileError, 'expected the bytes "ROPEWALK", found "v', b"v\nfrom 0 0 0\n")
    refused(ropewalk.SceneFileError, "cut off: expected [0-9]+ bytes, found", whole[:-64])
    refused(ropewalk.SceneFileError, "format version 7 at offset 12; .*newer", whole[:12] + b"\7" + whole[13:])
    swapped = bytearray(whole)
    swapped[8:12] = swapped[8:12][::-1]
    refused(ropewalk.SceneFileError, "big-endian", bytes(swapped))
    altered = bytearray(whole)
    altered[-100] ^= 1
    refused(ropewalk.SceneFileError, "the bytes were altered; expected checksum", bytes(altered), verify=True)
    altered = bytearray(whole)
    altered[200] ^= 1
    refused(ropewalk.SceneFileError, "header, offset 0: the bytes were altered", bytes(altered))
    for folder in (tmp_path, pathlib.Path("/")):
        with pytest.raises(ropewalk.SceneFileError):
            ropewalk.Scene.open(folder)
    for path in (None, 3, 1.5, [], object()):
        with pytest.raises(ropewalk.ArgumentTypeError, match="path: expected a path"):
            ropewalk.Scene.open(path)
    with pytest.raises(ropewalk.ArgumentError, match="NUL"):
        ropewalk.Scene.open("a\0b")


def test_meshes_that_cannot_be_are_refused(saved):
    """The section of meshes is not checked by the engine; its checksum is left to verify."""
    whole = saved.read_bytes()
    count = struct.unpack_from("<I", whole, 20)[0]
    tables = [struct.unpack_from("<4s4xQQ", whole, 192 + 64 * i) for i in range(count)]
    offset = next(offset for tag, offset, _ in tables if tag == b"mesh")
    for words in [(1, 5, 300, 0), (1, 0, 299, 0), (2, 0, 300, 0), (2**32 - 1, 0, 300, 0), (0, 0, 0, 0)]:
        bad = bytearray(whole)
        struct.pack_into("<4I", bad, offset, *words)
        saved.write_bytes(bytes(bad))
        with pytest.raises(ropewalk.SceneFileError, match="section mesh"):
            ropewalk.Scene.open(saved)


@pytest.mark.parametrize("seed", range(20))
def test_altered_files_harm_nobody(saved, seed):
    """Blocks and triangles of nonsense, under checks of structure alone: any answer or any error of ours."""
    whole, random = bytearray(saved.read_bytes()), np.random.default_rng(seed)
    for at in random.integers(192 + 64 * 4, len(whole), 12):
        whole[at] = random.integers(256)
    saved.write_bytes(bytes(whole))
    try:
        scene = ropewalk.Scene.open(saved)
    except ropewalk.SceneFileError:
        return
    o, d = rays(300, 2)
    for query in (scene.closest_hit, scene.occluded, scene.all_hits, scene.count_hits):
        query(o, d)
        query(o, d, masks=1)
    try:
        answers(scene, o, d)
    except ropewalk.RopewalkError as error:
        # Tree and triangles differ now.
        assert "not on their rays any more" in str(error)
    str(scene.report)


def test_saving_fails_and_leaves_nothing(scene, tmp_path):
    file = tmp_path / "file"
    file.write_text("something")
    for path in (tmp_path / "no" / "a.rope", file / "a.rope", tmp_path):
        with pytest.raises(ropewalk.SceneWriteError, match="cannot save") as raised:
            scene.save(path)
        assert isinstance(raised.value, OSError)
    assert os.listdir(tmp_path) == ["file"] and file.read_text() == "something"
    if os.path.exists("/dev/full"):
        with pytest.raises(ropewalk.SceneWriteError, match="No space left"):
            scene.save("/dev/full")
    with pytest.raises(ropewalk.ArgumentTypeError):
        scene.save(None)


def double_scene(n, seed):
    v, f = random_mesh(n, seed)
    v = v.astype(np.float64) / 3 + 1e7
    flat = np.concatenate([f, [[0, 0, 1]]])
    scene = ropewalk.Scene.from_meshes([(v, flat), (v + 1, f)], masks=[1, 6])
    assert scene.precision == "double"
    return scene, v, f


@pytest.mark.parametrize("how", [{}, {"verify": True}, {"copy": True}])
def test_scenes_of_double_precision(tmp_path, how):
    scene, v, f = double_scene(300, 1)
    path = tmp_path / "double.rope"
    scene.save(path)
    opened = ropewalk.Scene.open(path, **how)
    assert opened.precision == "double" and opened.report.degenerate == 1
    np.testing.assert_array_equal(opened.bounds, scene.bounds)
    np.testing.assert_array_equal(opened.masks, scene.masks)
    np.testing.assert_array_equal(opened.mesh_sizes, scene.mesh_sizes)
    rng = np.random.default_rng(2)
    o, d = rng.normal(size=(500, 3)) * 3 + 1e7, rng.normal(size=(500, 3))
    for other in (opened, pickle.loads(pickle.dumps(opened))):
        one, two = scene.all_hits(o, d), other.all_hits(o, d)
        for name in ("offsets", "t", "prim_id", "geom_id"):
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
        np.testing.assert_array_equal(scene.closest_hit(o, d).normal, other.closest_hit(o, d).normal)
        for one, two in zip(scene.closest_point(o), other.closest_point(o)):
            np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(scene.contains(o), other.contains(o))
    again = tmp_path / "again.rope"
    opened.save(again)
    assert again.read_bytes() == path.read_bytes()
    placed = ropewalk.Scene.from_instances([(opened, np.eye(4))])
    np.testing.assert_array_equal(placed.closest_hit(o, d).t, scene.closest_hit(o, d).t)
    with pytest.raises(ropewalk.SceneWriteError, match="instances cannot be saved"):
        placed.save(tmp_path / "placed")
    with pytest.raises(ropewalk.OtherGeometryError, match="2 meshes"):
        ropewalk.Scene.open(path, vertices=v, faces=f)


def test_double_precision_only_for_its_own_geometry(tmp_path):
    v, f = random_mesh(50, 3)
    v, path = v.astype(np.float64) / 3 + 1e7, tmp_path / "double.rope"
    ropewalk.Scene(v, f).save(path)
    assert ropewalk.Scene.open(path, vertices=v, faces=f).precision == "double"
    for other in (v + 1e-8, v.astype(np.float32)):
        with pytest.raises(ropewalk.OtherGeometryError, match="other geometry"):
            ropewalk.Scene.open(path, vertices=other, faces=f)
    with pytest.raises(ropewalk.OtherGeometryError, match="built for"):
        ropewalk.Scene.open(path, vertices=v, faces=f[1:])


def test_altered_double_precision_harms_nobody(tmp_path):
    scene, _, _ = double_scene(200, 4)
    path = tmp_path / "double.rope"
    scene.save(path)
    whole, rng = path.read_bytes(), np.random.default_rng(5)
    for cut in (0, 100, 1000, len(whole) - 64):
        path.write_bytes(whole[:cut])
        with pytest.raises(ropewalk.SceneFileError):
            ropewalk.Scene.open(path)
    o, d = rng.normal(size=(300, 3)) * 3 + 1e7, rng.normal(size=(300, 3))
    for at in rng.integers(1000, len(whole), 60):
        altered = bytearray(whole)
        altered[at] ^= 0xFF
        path.write_bytes(altered)
        with pytest.raises(ropewalk.SceneFileError):
            ropewalk.Scene.open(path, verify=True)
        try:
            opened = ropewalk.Scene.open(path, copy=True)
        except ropewalk.SceneFileError:
            continue
        opened.all_hits(o, d)
        opened.signed_distance(o)


def test_whoever_has_a_file_open_keeps_it(scene, saved):
    mapped = ropewalk.Scene.open(saved)
    ropewalk.Scene(*random_mesh(10, 9)).save(saved)
    same(scene, mapped)
    assert ropewalk.Scene.open(saved).report.primitives == 10
    saved.unlink()
    same(scene, mapped)


def test_an_opened_scene_is_pickled_as_any_other(scene, saved):
    mapped = ropewalk.Scene.open(saved)
    data = pickle.dumps(mapped)
    saved.unlink()
    same(scene, pickle.loads(data))


def test_many_threads_open_one_file(scene, saved):
    failures = []

    def work():
        try:
            for _ in range(5):
                same(scene, ropewalk.Scene.open(saved, verify=True))
        except BaseException as error:  # noqa: BLE001
            failures.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures


def test_another_process_opens_it(scene, saved):
    program = (
        "import sys, ropewalk\n"
        "scene = ropewalk.Scene.open(sys.argv[1])\n"
        "print(scene.closest_hit([0.5, 0.5, 9], [0, 0, -1]).prim_id)\n"
    )
    run = [sys.executable, "-W", "error", "-c", program, str(saved)]
    output = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert int(output) == scene.closest_hit([0.5, 0.5, 9], [0, 0, -1]).prim_id


def test_subclasses_open_as_themselves(saved):
    class Mine(ropewalk.Scene):
        pass

    assert type(Mine.open(saved)) is Mine
