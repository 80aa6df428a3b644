"""The drop-in for embreex: by itself, and beside embreex where it is installed."""

import contextlib
import io
import pickle

import numpy as np
import pytest

import ropewalk
from meshes import box, degenerate_mesh, grid_mesh, random_mesh, rays
from oracle import Oracle
from ropewalk.compat import embreex
from ropewalk.compat.embreex import rtcore, rtcore_scene
from ropewalk.compat.embreex.mesh_construction import ElementMesh, TriangleMesh


def scene_of(*meshes):
    scene = rtcore_scene.EmbreeScene()
    for vertices, indices in meshes:
        TriangleMesh(scene, np.float32(vertices), np.int32(indices))
    return scene


def wall(x):
    """Two triangles in the plane of an x."""
    corners = [[x, -1, -1], [x, 1, -1], [x, -1, 1], [x, 1, 1]]
    return np.float32(corners), np.int32([[0, 1, 2], [1, 3, 2]])


ORIGINS = np.float32([[0.1, -0.2, 0], [0.1, 0.2, 0], [0.1, 0.3, 0], [0.1, -8.2, 0]])
ALONG = np.float32([[1, 0, 0]] * 4)


def test_queries():
    scene = scene_of(wall(7))
    hit = scene.run(ORIGINS, ALONG)
    assert hit.dtype == np.int32 and hit.tolist() == [0, 1, 1, -1]
    occluded = scene.run(ORIGINS, ALONG, query="OCCLUDED")
    assert occluded.dtype == np.int32 and occluded.tolist() == [0, 0, 0, -1]
    far = scene.run(ORIGINS, ALONG, query="DISTANCE")
    assert far.dtype == np.float32
    np.testing.assert_array_equal(far, np.float32([6.9, 6.9, 6.9, 1e37]))
    # A direction for all rays, and distances in its lengths.
    np.testing.assert_allclose(scene.run(ORIGINS, 2 * ALONG[:1], query="DISTANCE")[:3], 3.45, rtol=1e-6)


@pytest.mark.parametrize("query", ["INTERSECT", "OCCLUDED", "DISTANCE"])
def test_output(query):
    found = scene_of(wall(9), wall(7)).run(ORIGINS, ALONG, dists=100, query=query, output=1)
    assert list(found) == ["u", "v", "Ng", "tfar", "primID", "geomID"]
    kinds = {"u": "f4", "v": "f4", "Ng": "f4", "tfar": "f4", "primID": "i4", "geomID": "i4"}
    assert {name: array.dtype.str[1:] for name, array in found.items()} == kinds
    assert found["primID"].tolist() == [0, 1, 1, -1] and found["geomID"].tolist() == [1, 1, 1, -1]
    np.testing.assert_allclose(found["u"], [0.4, 0.1, 0.15, 0], atol=1e-6)
    np.testing.assert_allclose(found["v"], [0.5, 0.4, 0.35, 0], atol=1e-6)
    np.testing.assert_allclose(found["tfar"], [6.9, 6.9, 6.9, 100], rtol=1e-6)
    np.testing.assert_array_equal(found["Ng"], [[4, 0, 0]] * 3 + [[0, 0, 0]])


def test_dists_end_rays_and_are_not_written_to():
    scene = scene_of(wall(7))
    dists = np.float32([6.8, 7.0, 6.9, 1.0])
    before = dists.copy()
    assert scene.run(ORIGINS, ALONG, dists).tolist() == [-1, 1, 1, -1]
    far = scene.run(ORIGINS, ALONG, dists, query="DISTANCE")
    np.testing.assert_array_equal(far, np.float32([6.8, 6.9, 6.9, 1.0]))
    assert (dists == before).all()
    assert scene.run(ORIGINS, ALONG, 5.0).tolist() == [-1] * 4
    assert scene.run(ORIGINS, ALONG, -1.0, query="OCCLUDED").tolist() == [-1] * 4


@pytest.mark.parametrize("make", [random_mesh, grid_mesh, degenerate_mesh])
def test_brute_force(make):
    rng = np.random.default_rng(11)
    first, second = make(rng, 50, 1.0), make(rng, 70, 1.0)
    scene = scene_of(first, second)
    corners = np.concatenate([v[f] for v, f in (first, second)])
    origins, directions = rays(rng, 600, 1.0)
    ends = np.float32(10.0 ** rng.uniform(-3, 3, 600))
    for far, dists in ((1e37, None), (ends, ends), (2.5, 2.5)):
        oracle = Oracle(corners, origins, directions)
        if dists is not None:
            oracle.only(oracle.t <= np.reshape(np.float32(dists), (-1, 1)))
        t, triangle = oracle.closest()
        hit, sure = triangle >= 0, oracle.sure
        found = scene.run(origins, directions, dists, output=1)
        geom = np.where(hit, (triangle >= 50).astype(int), -1)
        prim = np.where(hit, triangle - 50 * (triangle >= 50), -1)
        assert (found["primID"] == prim)[sure].all() and (found["geomID"] == geom)[sure].all()
        assert (found["tfar"] == np.where(hit, t, np.float32(far)))[sure].all()
        uv = oracle.uv[np.arange(600), triangle]
        both = hit & sure
        np.testing.assert_allclose(np.stack([found["u"], found["v"]], -1)[both], uv[both], atol=1e-6)
        edges = corners[triangle[both]].astype(float)
        normal = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])
        np.testing.assert_array_equal(found["Ng"][both], np.float32(normal))
        assert (scene.run(origins, directions, dists) == found["primID"]).all()
        assert (scene.run(origins, directions, dists, query="DISTANCE") == found["tfar"]).all()
        assert ((scene.run(origins, directions, dists, query="OCCLUDED") == 0) == (found["primID"] >= 0)).all()


def test_elements():
    scene = rtcore_scene.EmbreeScene()
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    ElementMesh(scene, np.float32(corners), np.uint32([[0, 1, 2, 3]]))
    origins, along = np.float32([[-0.1, 0.1, 0.1], [-0.1, 0.2, 0.2]]), np.float32([[1, 0, 0]] * 2)
    found = scene.run(origins, along, output=1)
    assert found["primID"].tolist() == [2, 2]
    np.testing.assert_allclose(found["tfar"], [0.1, 0.1], rtol=1e-6)
    np.testing.assert_allclose(found["u"], [0.1, 0.2], rtol=1e-6)
    scene = rtcore_scene.EmbreeScene()
    base = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]]
    corners = base + [[x, y, 1] for x, y, _ in base]
    ElementMesh(scene, np.float32(corners), np.int64([range(8)]))
    found = scene.run(np.float32([[-0.1, 0.9, 0.1], [-0.1, 0.8, 0.2]]), along, output=1)
    np.testing.assert_allclose(found["tfar"], [0.1, 0.1], rtol=1e-6)
    np.testing.assert_allclose(found["u"], [0.1, 0.2], rtol=1e-5)
    np.testing.assert_allclose(found["v"], [0.8, 0.6], rtol=1e-5)
    # Closed: from inside every ray leaves through one of the twelve triangles.
    directions = np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32)
    assert (scene.run(np.full((500, 3), 0.5, np.float32), directions) >= 0).all()
    assert len(set(scene.run(np.full((500, 3), 0.5, np.float32), directions))) == 12


def test_meshes_added_after_a_run_count():
    scene = scene_of(wall(7))
    assert scene.run(ORIGINS, ALONG, output=1)["primID"][0] == 0
    TriangleMesh(scene, np.float32([[[5, -1, -1], [5, 1, -1], [5, -1, 1]]]))
    found = scene.run(ORIGINS, ALONG, output=1)
    assert found["geomID"].tolist() == [1, 0, 0, -1]
    np.testing.assert_array_equal(found["Ng"], [[4, 0, 0]] * 3 + [[0, 0, 0]])


def test_vertices_are_copied():
    vertices, indices = wall(7)
    scene = scene_of()
    TriangleMesh(scene, vertices, indices)
    vertices += 100
    indices[:] = 0
    assert scene.run(ORIGINS, ALONG)[0] == 0


def test_empty_scenes_and_no_rays():
    scene = rtcore_scene.EmbreeScene()
    assert scene.run(ORIGINS, ALONG).tolist() == [-1] * 4
    assert scene.run(ORIGINS, ALONG, output=1)["Ng"].shape == (4, 3)
    none = np.empty((0, 3), np.float32)
    for query in ("INTERSECT", "OCCLUDED", "DISTANCE"):
        assert scene_of(wall(7)).run(none, none, query=query).shape == (0,)
    assert scene_of(wall(7)).run(none, ALONG[:1], output=1)["Ng"].shape == (0, 3)


def test_devices_and_names():
    scene = embreex.EmbreeScene(rtcore.EmbreeDevice(), robust=False)
    embreex.TriangleMesh(scene, *wall(7))
    assert scene.run(ORIGINS, ALONG)[0] == 0
    assert "Ropewalk" in repr(rtcore.EmbreeDevice())
    assert embreex.rtcore_scene.EmbreeScene is embreex.EmbreeScene


def test_pickles():
    scene = scene_of(wall(7))
    scene.run(ORIGINS, ALONG)
    assert pickle.loads(pickle.dumps(scene)).run(ORIGINS, ALONG).tolist() == [0, 1, 1, -1]


def test_doubles_are_rounded_and_loss_is_warned_of():
    scene = rtcore_scene.EmbreeScene()
    vertices, indices = wall(7)
    TriangleMesh(scene, vertices.astype(float), indices)
    assert scene.run(ORIGINS.astype(float), ALONG.astype(float))[0] == 0
    with pytest.warns(ropewalk.PrecisionWarning):
        TriangleMesh(scene, vertices.astype(float) + 1e7 + 0.1, indices)


def test_bad_input():
    scene = scene_of(wall(7))
    with pytest.raises(ValueError, match="Embree ray query type NEAREST not recognized") as caught:
        scene.run(ORIGINS, ALONG, query="NEAREST")
    assert isinstance(caught.value, ropewalk.ArgumentError)
    for call in (
        lambda: scene.run(ORIGINS, ALONG[:3]),
        lambda: scene.run(ORIGINS[0], ALONG),
        lambda: scene.run(ORIGINS[:, :2], ALONG),
        lambda: scene.run(ORIGINS, ALONG, dists=np.ones(3)),
        lambda: TriangleMesh(scene, wall(7)[0]),
        lambda: TriangleMesh(scene, wall(7)[0], [[0, 1, 4]]),
        lambda: TriangleMesh(scene, np.full((1, 3, 3), np.nan)),
        lambda: ElementMesh(scene, wall(7)[0], [[0, 1, 2]]),
    ):
        with pytest.raises(ropewalk.ArgumentError):
            call()
    with pytest.raises(ropewalk.ArgumentError, match=r"indices\[1\] names vertex 4") as caught:
        ElementMesh(scene, wall(7)[0], [[0, 1, 2, 3], [0, 1, 2, 4]])
    assert caught.value.index == 1
    for call in (
        lambda: scene.run([["a", "b", "c"]], ALONG[:1]),
        lambda: TriangleMesh(None, wall(7)[0], wall(7)[1]),
        lambda: TriangleMesh(scene, wall(7)[0], [[0.0, 1.0, 2.0]]),
        lambda: ElementMesh(scene, wall(7)[0], [[0.0, 1.0, 2.0, 3.0]]),
    ):
        with pytest.raises(ropewalk.ArgumentTypeError):
            call()
    assert scene.run(ORIGINS, ALONG).tolist() == [0, 1, 1, -1]
    with pytest.warns(ropewalk.InvalidRayWarning):
        assert scene.run(ORIGINS, 0 * ALONG).tolist() == [-1] * 4


# --- embreex itself ---------------------------------------------------------------------------------------------

#: After embreex's examples: where rays meet a wall, and how far photons come in walls that absorb.
SCRIPT = """
import numpy as np
from embreex import rtcore_scene as rtcs
from embreex.mesh_construction import TriangleMesh

def xplane(x):
    return [[[x, -1.0, -1.0], [x, 1.0, -1.0], [x, -1.0, 1.0]],
            [[x, 1.0, -1.0], [x, 1.0, 1.0], [x, -1.0, 1.0]]]

triangles = np.array(xplane(0.0) + xplane(1.0) + xplane(2.0) + xplane(3.0), "float32")
scene = rtcs.EmbreeScene()
mesh = TriangleMesh(scene, triangles)
N = 1000
origins = np.zeros((N, 3), dtype="float32")
origins[:, 0] += 1e-8
origins[:, 1] = np.linspace(-2, 2, N)
origins[:, 2] = 0.1
dirs = np.zeros((N, 3), dtype="float32")
dirs[:, 0] = 1.0
res = scene.run(origins, dirs, output=1)
ray_inter = res["geomID"] >= 0
primID = res["primID"][ray_inter]
u = res["u"][ray_inter]
v = res["v"][ray_inter]
w = 1 - u - v
inters = (np.vstack(w) * triangles[primID][:, 0, :]
          + np.vstack(u) * triangles[primID][:, 1, :]
          + np.vstack(v) * triangles[primID][:, 2, :])
dists = np.asarray(np.log(np.random.RandomState(0).random_sample(N)) / -0.5, dtype="float32")
intersects = scene.run(origins, dirs, dists)
bi = intersects == -1
maxdist = origins[bi, 0] + dists[bi]
neworigins = np.asarray(triangles[intersects[~bi], 0, :], dtype="float32")
print(sum(ray_inter), primID.tolist(), inters.round(4).tolist(), maxdist.tolist(), neworigins.tolist())
"""


def printed(code):
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(code, {})
    return out.getvalue()


def test_a_script_runs_with_another_import():
    ours = printed(SCRIPT.replace("from embreex", "from ropewalk.compat.embreex"))
    assert ours.startswith("500 ")
    pytest.importorskip("embreex", reason="embreex, to run the script as it is, is not installed")
    assert ours == printed(SCRIPT)


@pytest.mark.parametrize("make", [random_mesh, box])
def test_beside_embreex(make):
    """Same random rays: where brute force in float64 is sure, differences are embreex's."""
    pytest.importorskip("embreex", reason="embreex is not installed")
    from embreex import mesh_construction as theirs, rtcore_scene as their_scene

    rng = np.random.default_rng(2)
    vertices, indices = make(rng, 400, 1.0) if make is random_mesh else box(dtype=np.float32)
    origins, directions = rays(rng, 4000, 1.0)
    scenes = []
    for scene, mesh in ((rtcore_scene.EmbreeScene(), TriangleMesh), (their_scene.EmbreeScene(), theirs.TriangleMesh)):
        mesh(scene, np.float32(vertices), np.int32(indices))
        mesh(scene, np.float32(vertices + 1)[indices])
        scenes.append(scene)
    corners = np.concatenate([np.float32(vertices)[indices], np.float32(vertices + 1)[indices]])
    oracle = Oracle(corners, origins, directions)
    truth, sure = oracle.closest()[1], oracle.sure
    for dists in (None, 0.5, np.float32(rng.uniform(0, 3, 4000))):
        given = [None if dists is None else np.copy(dists) for _ in scenes]
        given = [float(d) if np.ndim(d) == 0 and d is not None else d for d in given]
        ours, other = (s.run(origins, directions, d, output=1) for s, d in zip(scenes, given))
        assert list(ours) == list(other)
        for name in ours:
            assert ours[name].dtype == other[name].dtype and ours[name].shape == other[name].shape
        same = (ours["primID"] == other["primID"]) & (ours["geomID"] == other["geomID"])
        if dists is None:
            mine = np.where(ours["primID"] >= 0, ours["geomID"] * len(indices) + ours["primID"], -1)
            assert (mine == truth)[sure].all()
        assert same.mean() > 0.999
        hit = same & (ours["primID"] >= 0)
        np.testing.assert_allclose(ours["tfar"][same], other["tfar"][same], rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(ours["Ng"][hit], other["Ng"][hit], rtol=1e-4, atol=1e-6)
        far = np.abs(ours["u"] - other["u"])[hit]
        assert np.median(far) < 1e-6 and (far > 1e-3).mean() < 0.01
        for query in ("INTERSECT", "OCCLUDED", "DISTANCE"):
            given = [np.copy(d) if np.ndim(d) else d for d in (dists, dists)]
            ours_of, other_of = (s.run(origins, directions, d, query) for s, d in zip(scenes, given))
            assert ours_of.dtype == other_of.dtype
            assert np.isclose(ours_of, other_of, rtol=1e-3, atol=1e-5).mean() > 0.999


def test_elements_beside_embreex():
    pytest.importorskip("embreex", reason="embreex is not installed")
    from embreex import mesh_construction as theirs, rtcore_scene as their_scene

    rng = np.random.default_rng(4)
    base = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0]]
    cube = np.array(base + [[x, y, 1] for x, y, _ in base], np.float32)
    cells = {8: cube, 4: np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])}
    for count, corners in cells.items():
        vertices = np.concatenate([corners, corners + 2])
        elements = np.arange(2 * count, dtype=np.uint32).reshape(2, count)
        origins = rng.uniform(-1, 4, (2000, 3)).astype(np.float32)
        directions = (rng.choice([0.3, 2.3], (2000, 1)) + rng.uniform(-0.2, 0.2, (2000, 3)) - origins).astype(np.float32)
        ours, other = rtcore_scene.EmbreeScene(), their_scene.EmbreeScene()
        ElementMesh(ours, vertices, elements)
        theirs.ElementMesh(other, vertices, elements)
        found, expected = ours.run(origins, directions), other.run(origins, directions)
        assert (found == expected).mean() > 0.999 and (found >= 0).mean() > 0.5
