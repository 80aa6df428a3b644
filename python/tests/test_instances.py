"""Instances against the same triangles in a scene of their own."""

import json
import pickle
import struct

import numpy as np
import pytest

import ropewalk
from meshes import random_mesh


def objects(seed=0):
    rng = np.random.default_rng(seed)
    made = []
    for count in (40, 7):
        vertices, faces = random_mesh(rng, count, 1.0)
        made.append((np.float64(vertices) / 3, faces))
    return rng, made


def matrices(rng, count, offset=0.0):
    """Rotations and mirrors about axes with scales that are powers of two, so that nothing is rounded."""
    made = np.zeros((count, 4, 4))
    for matrix in made:
        axes = rng.permutation(3)
        matrix[np.arange(3), axes] = rng.choice([-1, 1], 3) * 2.0 ** rng.integers(-1, 2, 3)
        matrix[:3, 3] = rng.integers(-3, 4, 3) / 4 + offset
        matrix[3, 3] = 1
    return made


@pytest.mark.parametrize("offset", [0.0, 2.0**20])
def test_instances_equal_moved_meshes(offset):
    rng, meshes = objects()
    scenes = [ropewalk.Scene(*mesh, precision="double") for mesh in meshes]
    places = matrices(rng, 10, offset)
    which = [i % 2 for i in range(10)]
    scene = ropewalk.Scene.from_instances((scenes[k], m) for k, m in zip(which, places))
    moved = [
        (meshes[k][0] @ m[:3, :3].T + m[:3, 3], meshes[k][1]) for k, m in zip(which, places)
    ]
    same = ropewalk.Scene.from_meshes(moved, precision="double")
    origins = rng.uniform(-2, 2, (20_000, 3)) + offset
    directions = rng.uniform(-0.8, 0.8, (20_000, 3)) + offset - origins
    close = {"rtol": 1e-9, "atol": 1e-9 * (1 + offset)}
    a, b = scene.closest_hit(origins, directions), same.closest_hit(origins, directions)
    assert a.hit.mean() > 0.1
    np.testing.assert_array_equal(a.prim_id, b.prim_id)
    np.testing.assert_array_equal(a.geom_id, b.geom_id)
    np.testing.assert_allclose(a.t, b.t, **close)
    for name in ("uv", "position"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), **close)
    # Mirrors turn faces inside out; normals follow the surface.
    np.testing.assert_allclose(np.abs((a.normal * b.normal).sum(axis=-1)[a.hit]), 1.0)
    np.testing.assert_array_equal(scene.occluded(origins, directions), b.hit)
    np.testing.assert_array_equal(
        scene.count_hits(origins, directions), same.count_hits(origins, directions)
    )
    for k in (1, 3, None):
        if k is None:
            a, b = scene.all_hits(origins, directions), same.all_hits(origins, directions)
        else:
            a, b = (s.first_hits(origins, directions, k) for s in (scene, same))
        np.testing.assert_array_equal(a.offsets, b.offsets)
        np.testing.assert_array_equal(a.prim_id, b.prim_id)
        np.testing.assert_array_equal(a.geom_id, b.geom_id)
        np.testing.assert_allclose(a.t, b.t, **close)
    one = scene.all_hits(origins, directions, threads=1)
    np.testing.assert_array_equal(one.t, a.t)
    first = scene.closest_hit(origins, directions)
    rest = scene.first_hits(origins, directions, 1, skip=first)
    second = scene.first_hits(origins, directions, 2)
    np.testing.assert_array_equal(rest.counts[first.hit], second.counts[first.hit] - 1)
    other = pickle.loads(pickle.dumps(scene))
    np.testing.assert_array_equal(other.closest_hit(origins, directions).t, first.t)


def test_masks_and_report():
    triangle = ropewalk.Scene(np.eye(3), [[0, 1, 2]], precision="double")
    up = np.eye(4)
    up[2, 3] = 1
    scene = ropewalk.Scene.from_instances([(triangle, None), (triangle, up)], masks=[1, 2])
    o, d = [0.2, 0.2, -1], [0, 0, 1]
    assert scene.count_hits(o, d) == 2
    assert scene.closest_hit(o, d, masks=2).geom_id == 1
    assert not scene.occluded(o, d, masks=4)
    report = scene.report
    assert (report.meshes, report.primitives) == (2, 2)
    assert report.tree_bytes > triangle.report.tree_bytes
    assert len(scene) == 2 and scene.mesh_sizes.tolist() == [1, 1]
    np.testing.assert_allclose(scene.bounds, [[0, 0, 0], [1, 1, 2]], atol=1e-9)
    assert "2 meshes" in repr(scene)


def test_without_instances():
    scene = ropewalk.Scene.from_instances([])
    assert not scene.closest_hit([0, 0, 0], [1, 0, 0]).hit
    assert len(scene) == 0 and np.isnan(scene.bounds).all()
    assert not pickle.loads(pickle.dumps(scene)).occluded([0, 0, 0], [1, 0, 0])


def test_bad_instances():
    triangle = ropewalk.Scene(np.eye(3), [[0, 1, 2]], precision="double")
    make = ropewalk.Scene.from_instances
    cases = [
        (3, ropewalk.ArgumentTypeError, "instances: expected pairs"),
        ([triangle], ropewalk.ArgumentTypeError, r"instances\[0\]: expected a pair"),
        ([(triangle, None), (1, 2)], ropewalk.ArgumentTypeError, r"instances\[1\]: expected a pair"),
        ([(triangle, np.eye(3))], ropewalk.ArgumentError, r"shape \(3, 4\) or \(4, 4\), found \(3, 3\)"),
        ([(triangle, np.zeros((4, 4)))], ropewalk.ArgumentError, "last row"),
        ([(triangle, np.zeros((3, 4)))], ropewalk.ArgumentError, r"instances\[0\]: matrix: .* inverse"),
        ([(triangle, np.full((3, 4), np.nan))], ropewalk.ArgumentError, "row 0, column 0 is NaN"),
        ([(make([(triangle, None)]), None)], ropewalk.ArgumentError, "scene of meshes, found instances"),
        (
            [(ropewalk.Scene(np.eye(3), [[0, 1, 2]]), None)],
            ropewalk.ArgumentError,
            "precision='double'",
        ),
    ]
    for instances, error, text in cases:
        with pytest.raises(error, match=text):
            make(instances)
    with pytest.raises(ropewalk.ArgumentError, match="2 masks, one an instance"):
        make([(triangle, None)] * 2, masks=[1])


def write_glb(path, meshes, nodes, **rest):
    """Meshes of arrays (vertices, faces), each placed by the nodes."""
    data, views, accessors, described = b"", [], [], []
    for vertices, faces in meshes:
        for array, kind, shape in ((np.float32(vertices), 5126, "VEC3"), (np.uint32(faces).ravel(), 5125, "SCALAR")):
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
            accessors.append(
                {"bufferView": len(views) - 1, "componentType": kind, "count": len(array), "type": shape}
            )
            data += array.tobytes()
        last = len(accessors) - 1
        described.append({"primitives": [{"attributes": {"POSITION": last - 1}, "indices": last}]})
    document = {
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": described,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
        **rest,
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(
        struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(data))
        + struct.pack("<I4s", len(text), b"JSON") + text
        + struct.pack("<I4s", len(data), b"BIN\0") + data
    )
    return path


def file_of_instances(folder):
    """Two meshes placed eleven times, two of them below another node, and half of them mirrored."""
    rng, meshes = objects(5)
    nodes = [
        {"mesh": i % 2, "name": f"part {i}", "matrix": matrix.T.ravel().tolist()}
        for i, matrix in enumerate(matrices(rng, 9))
    ]
    nodes += [{"mesh": 0}, {"mesh": 1, "scale": [1, 2, 1]}]
    nodes.append({"children": [9, 10], "translation": [0.5, 0, 0.25]})
    scenes = [{"nodes": [*range(9), 11]}]
    return write_glb(folder / "parts.glb", meshes, nodes, scenes=scenes, scene=0), rng


def test_files_as_instances(tmp_path):
    path, rng = file_of_instances(tmp_path)
    found = ropewalk.read_instances(path)
    assert [len(faces) for _, faces in found.meshes] == [40, 7]
    assert found.mesh.tolist() == [i % 2 for i in range(9)] + [0, 1]
    assert found.names == [f"part {i}" for i in range(9)] + ["", ""]
    assert found.nodes.tolist() == list(range(11)) and found.matrices.shape == (11, 3, 4)
    scene = ropewalk.load(path, instances=True)
    assert scene.precision == "double" and scene.mesh_sizes.tolist() == [40, 7] * 4 + [40, 40, 7]
    flat = ropewalk.load(path, precision="double")
    assert len(flat) == len(scene)
    starts = np.concatenate([[0], np.cumsum(scene.mesh_sizes)])[:-1]
    origins = rng.uniform(-3, 3, (20_000, 3))
    directions = rng.uniform(-1, 1, (20_000, 3)) - origins
    for faces in ("both", "front", "back"):
        a = scene.closest_hit(origins, directions, faces=faces)
        b = flat.closest_hit(origins, directions, faces=faces)
        assert a.hit.mean() > 0.1
        np.testing.assert_array_equal(np.where(a.hit, starts[a.geom_id] + a.prim_id, -1), b.prim_id)
        np.testing.assert_allclose(a.t, b.t, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(a.normal, b.normal, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(
        scene.count_hits(origins, directions), flat.count_hits(origins, directions)
    )
    again = pickle.loads(pickle.dumps(scene))
    np.testing.assert_array_equal(again.closest_hit(origins, directions).t, scene.closest_hit(origins, directions).t)
    shares = []
    ropewalk.load(path, instances=True, preset="fast", threads=1, progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert 40 / 47 in shares, "the first of two meshes"


def test_files_of_one_mesh_as_instances(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    found = ropewalk.read_instances(path)
    assert found.names == [""] and found.nodes.tolist() == [-1]
    np.testing.assert_array_equal(found.matrices, [np.eye(3, 4)])
    assert ropewalk.load(path, instances=True).closest_hit([0.2, 0.2, 1], [0, 0, -1]).t == 1


def test_bad_files_of_instances(tmp_path):
    _, meshes = objects()
    flat = write_glb(tmp_path / "flat.glb", meshes, [{"mesh": 0}, {"mesh": 1, "name": "shadow", "scale": [1, 1, 0]}])
    with pytest.raises(ropewalk.SceneFileError, match=r"flat\.glb: nodes\[1\] \(shadow\): matrix: .* inverse, .*; instances=False"):
        ropewalk.load(flat, instances=True)
    assert len(ropewalk.load(flat)) == 47
    twice = write_glb(tmp_path / "twice.glb", meshes, [{"mesh": 0}, {"children": [0]}, {"children": [0]}])
    for read in (ropewalk.read_instances, lambda path: ropewalk.load(path, instances=True)):
        with pytest.raises(ropewalk.SceneFileError, match=r"twice\.glb: nodes\[0\]: expected a node with one parent"):
            read(twice)
        with pytest.raises(ropewalk.SceneNotFoundError, match="no such file"):
            read(tmp_path / "absent.glb")
        with pytest.raises(ropewalk.ArgumentTypeError, match="path"):
            read(3.5)
    with pytest.raises(ropewalk.SceneFileError, match="found a scene, which ropewalk.load reads"):
        ropewalk.read_instances("spd:balls:1")
    for name, value, path in (
        ("instances", True, "spd:balls:1"),
        ("precision", "single", flat),
        ("memory_limit", 1 << 30, flat),
        ("rays", (np.zeros((1, 3)), np.ones((1, 3))), flat),
        ("preset", "none", flat),
    ):
        with pytest.raises(ropewalk.ArgumentError, match=name) as caught:
            ropewalk.load(path, **{"instances": True, name: value})
        assert caught.value.argument == name
