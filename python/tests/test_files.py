"""Mesh files: what is read and what is refused. Every format has its own tests in Rust."""

import gzip
import struct
import warnings

import numpy as np
import pytest

import ropewalk

V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.5]]
F = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
PLY = (
    "ply\nformat {}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
)


def obj():
    rows = [f"v {x} {y} {z}" for x, y, z in V] + [f"f {a + 1} {b + 1}/1 {c + 1}//2" for a, b, c in F]
    return "\n".join(rows).encode()


def off():
    rows = ["OFF", "4 4 0"] + [" ".join(map(str, v)) for v in V]
    return "\n".join(rows + [f"3 {a} {b} {c}" for a, b, c in F]).encode()


def ply(order):
    form = "<" if order == "binary_little" else ">"
    data = b"".join(struct.pack(form + "3f", *v) for v in V)
    return PLY.format(order).encode() + data + b"".join(struct.pack(form + "B3i", 3, *f) for f in F)


def stl():
    rows = b"".join(struct.pack("<12f", 0, 0, 0, *sum((V[i] for i in f), [])) + b"\0\0" for f in F)
    return b"solid".ljust(80) + struct.pack("<I", 4) + rows


FILES = {"a.obj": obj(), "a.off": off(), "le.ply": ply("binary_little"), "be.ply": ply("binary_big"), "a.STL": stl()}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("is_gzip", [False, True])
def test_formats(tmp_path, name, is_gzip):
    path = tmp_path / (name + ".gz" if is_gzip else name)
    path.write_bytes(gzip.compress(FILES[name]) if is_gzip else FILES[name])
    vertices, faces = ropewalk.read_mesh(path)
    assert (vertices.dtype, faces.dtype) == (np.float64, np.uint32)
    np.testing.assert_array_equal(vertices[faces], np.array(V)[F])
    scene = ropewalk.load(path)
    assert len(scene) == 4 and scene.mesh_sizes.tolist() == [4]
    hits = scene.closest_hit([[0.1, 0.1, 5], [0.1, 0.1, -5]], [[0, 0, -1], [0, 0, 1]])
    assert hits.prim_id.tolist() == [3, 0]
    assert scene.contains([0.1, 0.1, 0.1])


@pytest.mark.parametrize("name", FILES)
def test_cut_off_anywhere(tmp_path, name):
    path, whole = tmp_path / name, FILES[name]
    for end in range(0, len(whole), 7):
        path.write_bytes(whole[:end])
        try:
            scene = ropewalk.load(path)
        except ropewalk.SceneFileError as error:
            assert name in str(error) and "expected" in str(error)
            assert error.argument == "path"
        else:
            assert 1 <= len(scene) <= 4


@pytest.mark.parametrize(
    "name, content, text",
    [
        ("a.obj", b"v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3", r"a\.obj: line 2: expected a finite"),
        ("a.obj", b"v 0 0 0\nv 1 1e39 0\nv 0 1 0\nf 1 2 3", r"line 2: expected a finite .* f32"),
        ("a.obj", b"v 0 0 0\nf 1 2 3", "line 2: expected a vertex from 1 to 1, found 3"),
        ("a.obj", b"v 0 0 0\n", "at least one face"),
        ("a.off", b"OFF 99999999999 9 9\n", "line 1: expected 99999999999 vertices"),
        ("a.stl", stl()[:-1], "byte 80: expected 284 bytes"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 18446744073709551615\n", "end_header"),
        ("a.glb", b"glTF\1\0\0\0", "byte 4: expected version 2, found 1"),
        ("a.gltf", b"[]", "expected version 2"),
        ("a.obj.gz", b"v 0 0 0", "gzip"),
        ("a.obj.gz", gzip.compress(b"v 0 0 0\n" * 99)[:-15], "a.obj.gz"),
    ],
)
def test_files_that_are_wrong(tmp_path, name, content, text):
    path = tmp_path / name
    path.write_bytes(content)
    for read in (ropewalk.load, ropewalk.read_mesh):
        with pytest.raises(ropewalk.SceneFileError, match=text):
            read(path)


def test_names(tmp_path):
    for read in (ropewalk.load, ropewalk.read_mesh):
        with pytest.raises(ropewalk.SceneNotFoundError, match="no such file"):
            read(tmp_path / "absent.ply")
        with pytest.raises(ropewalk.ArgumentTypeError, match="path"):
            read(3.5)
    with pytest.raises(ropewalk.SceneFileError, match="found a scene, which ropewalk.load reads"):
        ropewalk.read_mesh("spd:balls:2")
    (tmp_path / "d.obj").mkdir()
    with pytest.raises(ropewalk.SceneFileError, match="directory"):
        ropewalk.load(tmp_path / "d.obj")
    odd = tmp_path / "with space \u00e4.obj"
    odd.write_bytes(obj())
    assert len(ropewalk.load(str(odd))) == len(ropewalk.load(odd)) == 4


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("other", ["mesh", "mesh.txt", "mesh.glb"])
def test_content_goes_before_the_name(tmp_path, name, other):
    # Of OBJ the content tells only where the name says nothing else.
    if other == "mesh.glb" and name == "a.obj":
        pytest.skip("the name tells")
    path = tmp_path / other
    path.write_bytes(FILES[name])
    vertices, faces = ropewalk.read_mesh(path)
    np.testing.assert_array_equal(vertices[faces], np.array(V)[F])
    assert len(ropewalk.load(path)) == 4


def test_scenes_and_others_by_content(tmp_path):
    scene = tmp_path / "scene"
    scene.write_text("v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 45\nhither 1\nresolution 8 8\ns 0 0 0 1\n")
    assert len(ropewalk.load(scene)) == 1
    with pytest.raises(ropewalk.SceneFileError, match="found a scene, which ropewalk.load reads"):
        ropewalk.read_mesh(scene)
    picture = tmp_path / "picture"
    picture.write_bytes(b"\x89PNG\r\n\x1a\n")
    for read in (ropewalk.load, ropewalk.read_mesh):
        with pytest.raises(ropewalk.SceneFileError, match="picture: expected .* found a PNG image"):
            read(picture)


def test_far_from_the_origin(tmp_path):
    path = tmp_path / "far.obj"
    path.write_text("v 10000000.1 0 0\nv 10000001.3 0 0\nv 10000000.7 1 0\nf 1 2 3\n")
    with pytest.warns(ropewalk.PrecisionWarning):
        ropewalk.load(path, precision="single")
    scene = ropewalk.load(path)
    assert scene.precision == "double" and scene.bounds[1, 0] == 10000001.3
    with pytest.raises(ropewalk.ArgumentError, match="precision"):
        ropewalk.load("spd:tetra:2", precision="double")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ropewalk.read_mesh(path)[0][0, 0] == 10000000.1


def test_vertices_are_merged_when_asked(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl())
    apart, faces = ropewalk.read_mesh(path)
    assert apart.shape == (12, 3)
    for merge, count in ((True, 4), (np.True_, 4), (0, 4), (0.6, 3), (np.float32(9), 1), (False, 12)):
        vertices, merged = ropewalk.read_mesh(path, merge=merge)
        assert (len(vertices), len(merged)) == (count, 4), merge
        assert np.abs(vertices[merged] - apart[faces]).max() <= (0 if count > 3 else 1)
    scene, other = ropewalk.load(path, merge=True), ropewalk.load(path)
    rays = [[0.1, 0.1, 5], [0.1, 0.1, -5]], [[0, 0, -1], [0, 0, 1]]
    assert scene.closest_hit(*rays).prim_id.tolist() == other.closest_hit(*rays).prim_id.tolist() == [3, 0]
    for bad, error in ((-1, ropewalk.ArgumentError), (np.nan, ropewalk.ArgumentError), (np.inf, ropewalk.ArgumentError),
                       ("x", ropewalk.ArgumentTypeError), (None, ropewalk.ArgumentTypeError)):
        for read in (ropewalk.read_mesh, ropewalk.load):
            with pytest.raises(error, match="^merge: expected") as caught:
                read(path, merge=bad)
            assert caught.value.argument == "merge"
    for options in ({}, {"instances": True}):
        with pytest.raises(ropewalk.ArgumentError, match="^merge: expected"):
            ropewalk.load("spd:balls:1", merge=True, **options)
