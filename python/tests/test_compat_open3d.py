"""The drop-in for Open3D's RaycastingScene: what Open3D documents, brute force, and beside Open3D where it is installed."""

import pickle
import sys
import threading
import types

import numpy as np
import pytest

import ropewalk
import ropewalk.compat.open3d as compat
from meshes import box, degenerate_mesh, grid_mesh, random_mesh, rays as random_rays, sphere
from oracle import Oracle
from ropewalk.compat.open3d import RaycastingScene, Tensor

INVALID = RaycastingScene.INVALID_ID
NO_WARNINGS = pytest.mark.filterwarnings("ignore")


def scene_of(*meshes):
    scene = RaycastingScene()
    for vertices, triangles in meshes:
        scene.add_triangles(np.float32(vertices), np.uint32(triangles))
    return scene


TRIANGLE = [[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]]
RAYS = np.float32([[0.2, 0.1, 1, 0, 0, -1], [10, 10, 10, 1, 0, 0]])
THROUGH = np.float32([[0.5, 0.5, -1, 0, 0, 1], [0.5, 0.5, 0.5, 0, 0, 1], [10, 10, 10, 1, 0, 0]])


def test_cast_rays():
    scene = RaycastingScene()
    assert scene.add_triangles(*map(np.array, TRIANGLE)) == 0
    ans = scene.cast_rays(RAYS)
    assert set(ans) == {"t_hit", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals"}
    kinds = {name: array.dtype.name for name, array in ans.items()}
    assert kinds.pop("geometry_ids") == kinds.pop("primitive_ids") == "uint32" and set(kinds.values()) == {"float32"}
    assert INVALID == 0xFFFFFFFF
    assert ans["geometry_ids"].tolist() == [0, INVALID] and ans["primitive_ids"].tolist() == [0, INVALID]
    assert ans["t_hit"].tolist() == [1.0, np.inf]
    np.testing.assert_allclose(ans["primitive_uvs"], [[0.1, 0.1], [0, 0]], atol=1e-7)
    assert ans["primitive_normals"].tolist() == [[0, 0, 1], [0, 0, 0]]
    # Distances in lengths of the direction; the normal does not depend on the side that is hit.
    ans = scene.cast_rays(np.float32([[0.2, 0.1, -3, 0, 0, 2]]))
    assert ans["t_hit"].item() == 1.5 and ans["primitive_normals"].tolist() == [[0, 0, 1]]


def test_tensors():
    ans = scene_of(TRIANGLE).cast_rays(RAYS)
    for name, tensor in ans.items():
        assert isinstance(tensor, Tensor), name
        assert type(tensor.numpy()) is np.ndarray and np.shares_memory(tensor.numpy(), tensor)
        assert type(tensor.cpu().clone().numpy()) is np.ndarray
    assert ans["t_hit"].isfinite().numpy().tolist() == [True, False]
    assert ans["t_hit"].isinf().numpy().tolist() == [False, True] and not ans["t_hit"].isnan().any()
    # Elements are tensors too, as Open3D's are.
    first = ans["geometry_ids"][0]
    assert isinstance(first, Tensor) and first.shape == () and first.item() == 0 and first.cpu().numpy() == 0
    assert {0: "one"}[first.item()] == "one" and ans["geometry_ids"][1] == INVALID
    hit = ans["t_hit"].isfinite()
    assert ans["t_hit"][hit].reshape((-1, 1)).shape == (1, 1)
    assert ans["t_hit"].to(np.float64).dtype == np.float64 and ans["t_hit"].to("CPU:0") is ans["t_hit"]
    assert ans["t_hit"].to(compat.core.Device("CPU:0"), copy=True) is ans["t_hit"]
    made = Tensor([[1, 2], [3, 4]], dtype=np.float32)
    assert made.dtype == np.float32 and made[0].tolist() == [1, 2] and made[:, 1].numpy().tolist() == [2, 4]
    assert Tensor.from_numpy(np.zeros(3)).numpy().shape == (3,) and (made.T @ made).shape == (2, 2)
    assert pickle.loads(pickle.dumps(made)).tolist() == made.tolist()
    with pytest.raises(ropewalk.ArgumentTypeError):
        made.to("nonsense")


@pytest.mark.parametrize("shape", [[], [11], [1, 2, 3], [32, 14], [0], [2, 0, 3]])
def test_shapes(shape):
    scene = scene_of(TRIANGLE)
    rng = np.random.default_rng(123)
    rays = rng.uniform(size=[*shape, 6]).astype(np.float32)
    points = rng.uniform(size=[*shape, 3]).astype(np.float32)
    last = {"primitive_uvs": [2], "primitive_normals": [3], "points": [3]}
    for ans in (
        scene.count_intersections(rays),
        scene.test_occlusions(rays),
        scene.compute_distance(points),
        scene.compute_signed_distance(points),
        scene.compute_occupancy(points),
    ):
        assert list(ans.shape) == shape and isinstance(ans, Tensor)
    for found in (scene.cast_rays(rays), scene.compute_closest_points(points)):
        for name, tensor in found.items():
            assert list(tensor.shape) == shape + last.get(name, []), name
    count = int(scene.count_intersections(rays).sum())
    for name, tensor in scene.list_intersections(rays).items():
        expected = [np.prod(shape, dtype=int) + 1] if name == "ray_splits" else [count, *last.get(name, [])]
        assert list(tensor.shape) == expected, name


def test_dtypes():
    scene = scene_of(box())
    points = np.float32([[0.5, 0.5, 0.5]])
    assert scene.count_intersections(THROUGH).dtype == np.int32
    assert scene.test_occlusions(THROUGH).dtype == np.bool_
    for ans in (scene.compute_distance, scene.compute_signed_distance, scene.compute_occupancy):
        assert ans(points).dtype == np.float32
    listed = {name: tensor.dtype.name for name, tensor in scene.list_intersections(THROUGH).items()}
    assert listed == {
        "ray_splits": "uint32",
        "ray_ids": "uint32",
        "t_hit": "float32",
        "geometry_ids": "uint32",
        "primitive_ids": "uint32",
        "primitive_uvs": "float32",
    }
    near = {name: tensor.dtype.name for name, tensor in scene.compute_closest_points(points).items()}
    assert near.pop("geometry_ids") == near.pop("primitive_ids") == "uint32" and set(near.values()) == {"float32"}


def test_occlusions_within_a_range():
    scene = scene_of(TRIANGLE)
    assert scene.test_occlusions(RAYS).numpy().tolist() == [True, False]
    assert not scene.test_occlusions(RAYS, tfar=0.5).any()
    assert not scene.test_occlusions(RAYS, tnear=1.5).any()
    assert not scene.test_occlusions(RAYS, 1.5, 2.0).any()
    # Both ends are included.
    assert scene.test_occlusions(RAYS, tnear=1.0, tfar=1.0).numpy().tolist() == [True, False]


def test_counting_and_listing_on_a_box():
    """Through the diagonals of two faces: an intersection is counted once."""
    scene = scene_of(box())
    assert scene.count_intersections(THROUGH).numpy().tolist() == [2, 1, 0]
    listed = scene.list_intersections(THROUGH)
    assert listed["t_hit"].tolist() == [1.0, 2.0, 0.5]
    assert listed["ray_splits"].tolist() == [0, 2, 3, 3] and listed["ray_ids"].tolist() == [0, 0, 1]


def test_counting_through_edges_and_vertices_of_a_sphere():
    vertices, triangles = sphere(3)
    vertices = np.float32(vertices)
    scene = scene_of((vertices, triangles))
    middles = (vertices[triangles[:, 0]] + vertices[triangles[:, 1]]) / 2
    targets = np.concatenate([vertices, middles])
    inside = np.concatenate([np.zeros_like(targets), targets], axis=1)
    assert (scene.count_intersections(inside) == 1).all()
    across = np.concatenate([-3 * targets, targets], axis=1)
    assert (scene.count_intersections(across) == 2).all()
    assert (np.diff(scene.list_intersections(across)["ray_splits"].astype(int)) == 2).all()


def test_faces_of_a_vertex_are_one_place_where_float32_ends():
    """Along an axis through vertices the parameter is a difference of coordinates, often in the middle of two float32."""
    vertices, triangles = sphere(4)
    vertices = np.float32(vertices)
    low = vertices[np.linalg.norm(vertices[:, :2], axis=1) < 0.98]
    rays = np.zeros((len(low), 6), np.float32)
    rays[:, :2], rays[:, 2], rays[:, 5] = low[:, :2], -3.1, 1
    for meshes in ([(vertices, triangles)], [(vertices, triangles), (vertices, triangles)]):
        scene = scene_of(*meshes)
        assert (scene.count_intersections(rays) == 2 * len(meshes)).all()
        assert len(scene.list_intersections(rays)["t_hit"]) == 2 * len(meshes) * len(low)
    # Two sheets of one mesh that are one unit in the last place apart are two.
    sheets = np.float32([[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 0], [4, 0, 0], [0, 4, 0]])
    sheets[3:, 2] = np.float32(2**-22)
    scene = scene_of((sheets, [[0, 1, 2], [3, 4, 5]]))
    ans = scene.list_intersections([[1, 1, -2.5, 0, 0, 1]])
    assert ans["t_hit"].tolist() == [2.5, np.nextafter(np.float32(2.5), np.float32(3))]


@pytest.mark.parametrize("make", [random_mesh, grid_mesh, degenerate_mesh])
def test_brute_force(make):
    rng = np.random.default_rng(17)
    meshes = [make(rng, 50, 1.0), make(rng, 70, 1.0)]
    scene = scene_of(*meshes)
    corners = np.concatenate([v[f] for v, f in meshes])
    o, d = random_rays(rng, 600, 1.0)
    rays = np.concatenate([o, d], axis=1)
    oracle = Oracle(corners, o, d)
    t, triangle = oracle.closest()
    sure, hit = oracle.sure, triangle >= 0
    ans = scene.cast_rays(rays)
    assert (ans["t_hit"] == t)[sure].all()
    geom = np.where(hit, triangle >= 50, INVALID)
    prim = np.where(hit, triangle - 50 * (triangle >= 50), INVALID)
    assert (ans["geometry_ids"] == geom)[sure].all() and (ans["primitive_ids"] == prim)[sure].all()
    both = hit & sure
    uv = oracle.uv[np.arange(600), triangle]
    np.testing.assert_allclose(ans["primitive_uvs"][both], uv[both], atol=1e-6)
    assert (ans["primitive_uvs"][~hit & sure] == 0).all() and (ans["primitive_normals"][~hit & sure] == 0).all()
    edges = corners[triangle].astype(float)
    normal = np.cross(edges[:, 1] - edges[:, 0], edges[:, 2] - edges[:, 0])[both]
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    np.testing.assert_allclose(ans["primitive_normals"][both], normal, atol=1e-6)
    assert (scene.test_occlusions(rays) == hit)[sure].all()
    counts, listed = scene.count_intersections(rays), scene.list_intersections(rays)
    splits = listed["ray_splits"].numpy()
    assert (np.diff(splits.astype(int)) == counts).all()
    assert (listed["ray_ids"] == np.repeat(np.arange(600), counts)).all()
    for i, expected in enumerate(oracle.lists()):
        if not sure[i]:
            continue
        expected = [(x, int(p >= 50), int(p - 50 * (p >= 50))) for x, p in expected]
        kept = [e for j, e in enumerate(expected) if j == 0 or e[:2] != expected[j - 1][:2]]
        row = slice(splits[i], splits[i + 1])
        found = zip(*(listed[n][row].tolist() for n in ("t_hit", "geometry_ids", "primitive_ids")))
        assert list(found) == kept


def test_blocks_of_counts(monkeypatch):
    scene = scene_of(box())
    rays = np.tile(THROUGH, (7, 1)).reshape(3, 7, 6)
    whole = scene.count_intersections(rays)
    monkeypatch.setattr(compat, "_BLOCK", 4)
    assert (scene.count_intersections(rays) == whole).all() and whole.sum() == 21


def test_closest_points():
    scene = scene_of(TRIANGLE, (np.array(TRIANGLE[0]) + [0, 0, 50], TRIANGLE[1]))
    ans = scene.compute_closest_points(np.float32([[0.2, 0.1, 1], [10, 10, 10], [0.5, 0.25, 49]]))
    assert set(ans) == {"points", "geometry_ids", "primitive_ids", "primitive_uvs", "primitive_normals"}
    np.testing.assert_allclose(ans["points"], [[0.2, 0.1, 0], [1, 1, 0], [0.5, 0.25, 50]], atol=1e-6)
    assert ans["geometry_ids"].tolist() == [0, 0, 1] and ans["primitive_ids"].tolist() == [0, 0, 0]
    np.testing.assert_allclose(ans["primitive_uvs"], [[0.1, 0.1], [0, 1], [0.25, 0.25]], atol=1e-6)
    assert ans["primitive_normals"].tolist() == [[0, 0, 1]] * 3
    ans = scene_of((3 * np.array(TRIANGLE[0]), [[0, 2, 1]])).compute_closest_points([0.2, 0.1, 1])
    assert ans["primitive_normals"].tolist() == [0, 0, -1]


def test_distances_and_occupancy_of_a_box():
    scene = scene_of(box())
    points = np.float32([[0.5, 0.5, 0.5], [-0.5, -0.5, -0.5], [0, 0, 0]])
    np.testing.assert_allclose(scene.compute_distance(points), [0.5, np.sqrt(0.75), 0], rtol=1e-7)
    np.testing.assert_allclose(scene.compute_signed_distance(points), [-0.5, np.sqrt(0.75), 0], rtol=1e-7)
    assert scene.compute_occupancy(points[:2]).numpy().tolist() == [1.0, 0.0]
    for nsamples in (1, 3, 11):
        np.testing.assert_array_equal(scene.compute_occupancy(points, nsamples=nsamples), [1, 0, 1])
        assert scene.compute_signed_distance(points, 1, nsamples)[0] == -0.5


def test_occupancy_grid_of_a_sphere():
    """Where rays of a grid meet edges and vertices."""
    vertices, triangles = sphere(3, 0.8)
    scene = scene_of((vertices, triangles))
    axis = np.linspace(-0.88, 0.88, 23)
    points = np.stack(np.meshgrid(axis, axis, axis), axis=-1).astype(np.float32)
    occupancy = scene.compute_occupancy(points)
    signed = scene.compute_signed_distance(points)
    assert ((signed < 0) == (occupancy == 1))[signed != 0].all()
    radius = np.linalg.norm(points, axis=-1)
    shell = np.linalg.norm(vertices[triangles].mean(axis=1), axis=1).min()
    assert (occupancy[radius < 0.99 * shell] == 1).all() and (occupancy[radius > 0.801] == 0).all()
    np.testing.assert_allclose(np.abs(signed), scene.compute_distance(points), rtol=0, atol=0)


def test_two_bodies_and_a_cavity():
    outer, inner = box((-1, -1, -1), (1, 1, 1)), box((-0.25, -0.25, -0.25), (0.25, 0.25, 0.25))
    scene = scene_of(outer, inner, box((3, 3, 3), (4, 4, 4)))
    points = [[0, 0, 0], [0.5, 0, 0], [2, 0, 0], [3.5, 3.5, 3.5]]
    assert scene.compute_occupancy(points).tolist() == [0, 1, 0, 1]
    assert (np.sign(scene.compute_signed_distance(points)) == [1, -1, 1, -1]).all()


def pinhole(fov, center, eye, up, width, height):
    """A camera written down a second time, pixel by pixel."""
    center, eye, up = map(np.float64, (center, eye, up))
    forward = (center - eye) / np.linalg.norm(center - eye)
    right = np.cross(up, forward)
    right /= np.linalg.norm(right)
    over = np.cross(forward, right)
    half = np.tan(np.radians(fov) / 2)
    rays = np.empty((height, width, 6))
    for y in range(height):
        for x in range(width):
            across, down = (2 * x + 1) / width - 1, ((2 * y + 1) - height) / width
            rays[y, x] = [*eye, *(forward + half * across * right + half * down * over)]
    return rays


def test_pinhole_rays():
    look = dict(fov_deg=60, center=[0.5, 0.5, 0.5], eye=[-1, -1, -1], up=[0, 0, 1], width_px=7, height_px=5)
    rays = RaycastingScene.create_rays_pinhole(**look)
    assert rays.shape == (5, 7, 6) and rays.dtype == np.float32 and isinstance(rays, Tensor)
    np.testing.assert_allclose(rays, pinhole(*look.values()), atol=1e-6)
    assert (RaycastingScene().create_rays_pinhole(*look.values()) == rays).all()
    intrinsic = [[4, 0.5, 2.5], [0, 5, 1.5], [0, 0, 1]]
    cos, sin = np.cos(0.3), np.sin(0.3)
    extrinsic = np.array([[cos, -sin, 0, 1], [sin, cos, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    rays = RaycastingScene.create_rays_pinhole(intrinsic, extrinsic, 4, 3)
    for y in range(3):
        for x in range(4):
            ray = rays[y, x].numpy()
            seen = extrinsic @ [*(ray[:3] + 2 * ray[3:]), 1]
            np.testing.assert_allclose(intrinsic @ seen[:3], [2 * x + 1, 2 * y + 1, 2], atol=1e-5)
    np.testing.assert_allclose(extrinsic @ [*rays[0, 0, :3], 1], [0, 0, 0, 1], atol=1e-6)


def test_meshes_like_those_of_open3d():
    vertices, faces = box()
    tensors = types.SimpleNamespace(
        vertex={"positions": np.float32(vertices)}, triangle=types.SimpleNamespace(indices=np.int64(faces))
    )
    legacy = types.SimpleNamespace(vertices=vertices, triangles=np.int32(faces))
    trimesh = types.SimpleNamespace(vertices=vertices, faces=faces)
    scene = RaycastingScene()
    assert [scene.add_triangles(m) for m in (tensors, legacy, trimesh)] == [0, 1, 2]
    assert scene.add_triangles(mesh=tensors) == 3
    assert scene.add_triangles(triangle_indices=faces, vertex_positions=np.float32(vertices)) == 4
    assert scene.add_triangles(np.float32(vertices), triangle_indices=faces) == 5
    assert scene.count_intersections(THROUGH).tolist() == [12, 6, 0]
    listed = scene.list_intersections(THROUGH[:1])
    assert listed["geometry_ids"].tolist() == [0, 1, 2, 3, 4, 5] * 2
    empty = types.SimpleNamespace(vertices=[], triangles=[])
    assert RaycastingScene().add_triangles(empty) == 0


def test_empty_scenes():
    scene = RaycastingScene()
    ans = scene.cast_rays(RAYS)
    assert np.isinf(ans["t_hit"]).all() and (ans["geometry_ids"] == INVALID).all()
    assert scene.count_intersections(RAYS).tolist() == [0, 0]
    assert scene.list_intersections(RAYS)["ray_splits"].tolist() == [0, 0, 0]
    near = scene.compute_closest_points(RAYS[:, :3])
    assert np.isnan(near["points"]).all() and (near["primitive_ids"] == INVALID).all()
    assert (near["primitive_uvs"] == 0).all() and (near["primitive_normals"] == 0).all()
    assert np.isinf(scene.compute_distance(RAYS[:, :3])).all()
    assert (scene.compute_occupancy(RAYS[:, :3]) == 0).all()


def test_meshes_added_after_a_query_count():
    scene = scene_of(TRIANGLE)
    assert scene.cast_rays(RAYS)["t_hit"][0] == 1
    assert scene.add_triangles(np.float32(TRIANGLE[0]) + np.float32([0, 0, 0.5]), np.uint32([[0, 1, 2]])) == 1
    ans = scene.cast_rays(RAYS)
    assert ans["t_hit"][0] == 0.5 and ans["geometry_ids"][0] == 1


def test_threads_and_pickles():
    scene = scene_of(box())
    again = pickle.loads(pickle.dumps(scene))
    assert again.count_intersections(THROUGH, nthreads=2).tolist() == [2, 1, 0]
    assert RaycastingScene(nthreads=1, device="CPU:0").count_intersections(THROUGH).tolist() == [0] * 3
    answers = []
    ask = lambda: answers.append(scene.count_intersections(THROUGH).tolist())  # noqa: E731
    workers = [threading.Thread(target=ask) for _ in range(8)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert answers == [[2, 1, 0]] * 8


def test_bad_input():
    scene = scene_of(TRIANGLE)
    vertices, faces = np.float32(TRIANGLE[0]), np.uint32(TRIANGLE[1])
    look = dict(fov_deg=60, center=[0, 0, 0], eye=[0, 0, 1], up=[0, 1, 0], width_px=4, height_px=3)
    for call in (
        lambda: scene.cast_rays(np.zeros((3, 5))),
        lambda: scene.test_occlusions(1.0),
        lambda: scene.compute_distance(np.zeros((3, 6))),
        lambda: scene.compute_occupancy([[0, 0, 0]], nsamples=2),
        lambda: scene.compute_signed_distance([[0, 0, 0]], nsamples=0),
        lambda: scene.cast_rays(RAYS, nthreads=-1),
        lambda: scene.add_triangles(vertices, [[0, 1, 3]]),
        lambda: scene.add_triangles(vertices * np.nan, faces),
        lambda: scene.add_triangles(vertices[:, :2], faces),
        lambda: RaycastingScene(device="CUDA:0"),
        lambda: RaycastingScene.create_rays_pinhole(**{**look, "up": [0, 0, 1]}),
        lambda: RaycastingScene.create_rays_pinhole(**{**look, "fov_deg": 180}),
        lambda: RaycastingScene.create_rays_pinhole(np.zeros((3, 3)), np.eye(4), 2, 2),
        lambda: RaycastingScene.create_rays_pinhole(np.eye(3), np.eye(3), 2, 2),
    ):
        with pytest.raises(ropewalk.ArgumentError):
            call()
    for call in (
        lambda: scene.cast_rays([["a"] * 6]),
        lambda: scene.add_triangles(vertices, np.float32(faces)),
        lambda: scene.add_triangles(),
        lambda: scene.add_triangles(object()),
        lambda: scene.add_triangles(vertices, faces, faces),
        lambda: scene.add_triangles(vertices, nonsense=faces),
        lambda: scene.add_triangles(vertices, faces, triangle_indices=faces),
        lambda: RaycastingScene.create_rays_pinhole(np.eye(3), np.eye(4), 2),
        lambda: RaycastingScene.create_rays_pinhole(fov_deg=60),
        lambda: RaycastingScene.create_rays_pinhole(np.eye(3), np.eye(4), 2.5, 2),
    ):
        with pytest.raises(ropewalk.ArgumentTypeError):
            call()
    with pytest.raises(ropewalk.ArgumentError, match=r"vertex_positions\[1\] is \(NaN") as caught:
        scene.add_triangles([[0, 0, 0], [np.nan, 0, 0], [1, 1, 0]], faces)
    assert (caught.value.argument, caught.value.index) == ("vertex_positions", 1)
    assert scene.cast_rays(RAYS)["t_hit"][0] == 1
    with pytest.warns(ropewalk.InvalidRayWarning):
        assert scene.cast_rays([[np.nan, 0, 0, 0, 0, 1]])["geometry_ids"][0] == INVALID
    with pytest.warns(ropewalk.InvalidPointWarning):
        assert np.isnan(scene.compute_closest_points([[np.nan, 0, 0]])["points"]).all()


def test_names_without_open3d(monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    o3d = compat
    assert o3d.t.geometry.RaycastingScene is RaycastingScene
    tensor = o3d.core.Tensor([[1, 2]], dtype=o3d.core.Dtype.Float32, device=o3d.core.Device("CPU", 0))
    assert tensor.dtype == np.float32 and o3d.core.uint32 is np.uint32 and str(o3d.core.Device()) == "CPU:0"
    for name in ("io", "visualization"):
        with pytest.raises(AttributeError, match=f"open3d.{name} is Open3D's own, and Open3D is not installed"):
            getattr(o3d, name)
    with pytest.raises(AttributeError, match=r"open3d\.t\.geometry\.TriangleMesh"):
        o3d.t.geometry.TriangleMesh


#: After the pages of Open3D on ray casting and distance queries; the import is what changes.
ARRAYS = """
import open3d as o3d
import numpy as np

scene = o3d.t.geometry.RaycastingScene()
vertices = o3d.core.Tensor([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=o3d.core.float32)
triangles = o3d.core.Tensor([[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
                             [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]], dtype=o3d.core.uint32)
mesh_ids = {scene.add_triangles(vertices, triangles): 'cube'}
rays = o3d.core.Tensor([[0.5, 0.4, 10, 0, 0, -1], [-1, -1, -1, 0, 0, -1]], dtype=o3d.core.Dtype.Float32)
ans = scene.cast_rays(rays)
depth = ans['t_hit'].numpy(), ans['geometry_ids'].numpy()
assert o3d.t.geometry.RaycastingScene.INVALID_ID == ans['geometry_ids'][1].item()
name = mesh_ids[ans['geometry_ids'][0].item()]
camera = o3d.t.geometry.RaycastingScene.create_rays_pinhole(
    fov_deg=90, center=[0, 0, 2], eye=[2, 3, 0], up=[0, 1, 0], width_px=64, height_px=48)
ans = scene.cast_rays(camera)
hit = ans['t_hit'].isfinite()
points = camera[hit][:, :3] + camera[hit][:, 3:] * ans['t_hit'][hit].reshape((-1, 1))
shade = np.abs(ans['primitive_normals'].numpy())
query_point = o3d.core.Tensor([[0, 0, 0.25]], dtype=o3d.core.Dtype.Float32)
near = scene.compute_closest_points(query_point)
near = near['points'].numpy(), near['primitive_ids'][0].item() >= 0
xyz_range = np.linspace([-0.6, -0.55, -0.5], [1.6, 1.5, 1.7], num=8)
query_points = np.stack(np.meshgrid(*xyz_range.T), axis=-1).astype(np.float32)
signed_distance = scene.compute_signed_distance(query_points)
middle = signed_distance.numpy()[:, :, 4]
rays = np.concatenate([query_points, np.ones_like(query_points) * [1, 0.93, 0.81]], axis=-1).astype(np.float32)
is_inside = scene.count_intersections(rays).numpy() % 2 == 1
lx = scene.list_intersections(rays)
lx = {k: v.numpy() for k, v in lx.items()}
lengths = [sum(lx['t_hit'][start:end]) for start, end in zip(lx['ray_splits'][:-1], lx['ray_splits'][1:])]
result = [*depth, near[0], points.numpy(), shade, middle, is_inside, np.array(lengths), scene.compute_occupancy(query_points).numpy()]
"""

#: The same of meshes that Open3D makes.
MESHES = """
import open3d as o3d
import numpy as np

cube = o3d.t.geometry.TriangleMesh.from_legacy(o3d.geometry.TriangleMesh.create_box().translate([-1.2, -1.2, 0]))
sphere = o3d.t.geometry.TriangleMesh.from_legacy(
    o3d.geometry.TriangleMesh.create_sphere(0.5).translate([0.7, 0.8, 0]))
scene = o3d.t.geometry.RaycastingScene()
mesh_ids = {}
mesh_ids[scene.add_triangles(cube)] = 'cube'
mesh_ids[scene.add_triangles(sphere)] = 'sphere'
query_point = o3d.core.Tensor([[0, 0, 0]], dtype=o3d.core.Dtype.Float32)
ans = scene.compute_closest_points(query_point)
owner = mesh_ids[ans['geometry_ids'][0].item()]
rays = np.concatenate([query_point.numpy(), np.ones(query_point.shape, dtype=np.float32)], axis=-1)
is_inside = scene.count_intersections(rays).numpy() % 2 == 1
xyz_range = np.linspace([-2, -2, -2], [2, 2, 2], num=12)
query_points = np.stack(np.meshgrid(*xyz_range.T), axis=-1).astype(np.float32)
closest = scene.compute_closest_points(query_points)
distance = np.linalg.norm(query_points - closest['points'].numpy(), axis=-1)
camera = scene.create_rays_pinhole(fov_deg=60, center=[0, 0, 0], eye=[-3, -2, 3], up=[0, 0, 1], width_px=32, height_px=24)
depth = scene.cast_rays(camera)['t_hit']
cloud = o3d.t.geometry.PointCloud(closest['points'].reshape((-1, 3)))
signed = scene.compute_signed_distance(query_points, nsamples=3).numpy()
result = [np.array(owner == 'cube'), ans['points'].numpy(), is_inside, distance, depth.numpy(),
          closest['geometry_ids'].numpy(), signed, np.array(cloud.point.positions.shape)]
"""


def run_both(code):
    """What a script computes with our import and, where there is Open3D, as it is."""
    ours = {}
    exec(code.replace("import open3d as o3d", "import ropewalk.compat.open3d as o3d"), ours)
    if "open3d" not in sys.modules:
        pytest.importorskip("open3d", reason="open3d, to run the script as it is, is not installed")
    theirs = {}
    exec(code, theirs)
    for mine, other in zip(ours["result"], theirs["result"], strict=True):
        assert mine.dtype == other.dtype and mine.shape == other.shape
        np.testing.assert_allclose(mine, other, rtol=1e-4, atol=1e-5)


def test_a_script_runs_without_open3d(monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    names = {}
    exec(ARRAYS.replace("import open3d as o3d", "import ropewalk.compat.open3d as o3d"), names)
    assert names["name"] == "cube" and names["depth"][0].tolist() == [9, np.inf]
    assert names["near"][0].tolist() == [[0, 0, 0.25]] and names["points"].shape[0] > 50


@NO_WARNINGS
@pytest.mark.parametrize("code", [ARRAYS, MESHES], ids=["arrays", "meshes"])
def test_a_script_runs_with_another_import(code):
    pytest.importorskip("open3d", reason="open3d, to run the script as it is, is not installed")
    run_both(code)


@NO_WARNINGS
def test_tensors_of_open3d():
    open3d = pytest.importorskip("open3d", reason="open3d is not installed")
    scene = RaycastingScene(device=open3d.core.Device("CPU:0"))
    cube = open3d.t.geometry.TriangleMesh.create_box()
    assert scene.add_triangles(cube) == 0
    assert scene.add_triangles(open3d.geometry.TriangleMesh.create_box().translate([5, 0, 0])) == 1
    assert scene.add_triangles(cube.vertex.positions + 9.5, cube.triangle.indices.to(open3d.core.uint32)) == 2
    rays = open3d.core.Tensor(THROUGH)
    assert scene.count_intersections(rays).tolist() == [2, 1, 1]
    ans = scene.cast_rays(rays)
    mask = open3d.core.Tensor(np.array([True, False, False]))
    assert ans["t_hit"][mask].tolist() == [1.0] and ans["t_hit"].to(open3d.core.float64).dtype == np.float64
    made = scene.create_rays_pinhole(open3d.core.Tensor(np.eye(3)), open3d.core.Tensor(np.eye(4)), 4, 3)
    assert made.shape == (3, 4, 6)
    assert Tensor(rays, dtype=open3d.core.Dtype.Float64).dtype == np.float64


@NO_WARNINGS
@pytest.mark.parametrize("make", ["random", "closed"])
def test_beside_open3d(make):
    """Same random rays: where brute force in float64 is sure, differences are Open3D's."""
    open3d = pytest.importorskip("open3d", reason="open3d is not installed")
    rng = np.random.default_rng(21)
    if make == "random":
        meshes = [random_mesh(rng, 200, 1.0), random_mesh(rng, 300, 1.0)]
    else:
        meshes = [sphere(3, 0.5), box((1, 1, 1), (2, 2, 2))]
    meshes = [(np.float32(v), np.uint32(f)) for v, f in meshes]
    ours, theirs = RaycastingScene(), open3d.t.geometry.RaycastingScene()
    for vertices, faces in meshes:
        assert ours.add_triangles(vertices, faces) == theirs.add_triangles(vertices, faces)
    o, d = random_rays(rng, 3000, 1.0)
    if make == "closed":
        d = (rng.uniform(-0.5, 2, (3000, 3)) - o).astype(np.float32)
    rays = np.concatenate([o, d], axis=1).reshape(50, 60, 6)
    corners = np.concatenate([v[f] for v, f in meshes])
    oracle = Oracle(corners, o, d)
    truth, sure = oracle.closest()[1], oracle.sure
    mine, other = ours.cast_rays(rays), {k: v.numpy() for k, v in theirs.cast_rays(rays).items()}
    assert set(mine) == set(other)
    for name in mine:
        assert mine[name].dtype == other[name].dtype and mine[name].shape == other[name].shape
    first = len(meshes[0][1])
    named = [
        np.where(a["geometry_ids"] == INVALID, -1, first * (a["geometry_ids"] == 1) + a["primitive_ids"].astype(int))
        for a in (mine, other)
    ]
    assert (named[0].reshape(-1) == truth)[sure].all() and sure.mean() > 0.99
    same = named[0] == named[1]
    assert same.mean() > 0.999
    np.testing.assert_allclose(mine["t_hit"][same], other["t_hit"][same], rtol=1e-4)
    np.testing.assert_allclose(mine["primitive_normals"][same], other["primitive_normals"][same], atol=1e-4)
    off = np.abs(mine["primitive_uvs"] - other["primitive_uvs"])[same]
    assert np.median(off) < 1e-6 and (off > 1e-3).mean() < 0.01
    for limits in ({}, {"tnear": 0.5}, {"tfar": 0.7}, {"tnear": 0.2, "tfar": 1.1}):
        found, expected = (s.test_occlusions(rays, **limits) for s in (ours, theirs))
        assert (found == expected.numpy()).mean() > 0.999
    counts, others = ours.count_intersections(rays), theirs.count_intersections(rays).numpy()
    assert counts.dtype == others.dtype and (counts.reshape(-1) == oracle.hit.sum(axis=1))[sure].all()
    assert (counts == others).mean() > 0.998
    mine, other = ours.list_intersections(rays), {k: v.numpy() for k, v in theirs.list_intersections(rays).items()}
    assert set(mine) == set(other)
    rows = []
    for found in (mine, other):
        keep = (counts == others).reshape(-1)[found["ray_ids"].astype(int)]
        order = np.lexsort((found["t_hit"], found["ray_ids"]))
        order = order[keep[order]]
        rows.append({k: np.asarray(v)[order] for k, v in found.items() if k != "ray_splits"})
    for name in rows[0]:
        assert mine[name].dtype == other[name].dtype
        assert np.isclose(rows[0][name], rows[1][name], rtol=1e-3, atol=1e-3).mean() > 0.99, name
    points = rng.uniform(-1, 2.5, (40, 50, 3)).astype(np.float32)
    mine, other = ours.compute_closest_points(points), theirs.compute_closest_points(points)
    for name in mine:
        assert mine[name].dtype == other[name].numpy().dtype and mine[name].shape == other[name].numpy().shape
    np.testing.assert_allclose(ours.compute_distance(points), theirs.compute_distance(points).numpy(), atol=1e-5)
    apart = np.linalg.norm(mine["points"] - other["points"].numpy(), axis=-1)
    assert np.median(apart) < 1e-6
    if make == "closed":
        inside, expected = ours.compute_occupancy(points), theirs.compute_occupancy(points, nsamples=3).numpy()
        assert inside.dtype == expected.dtype and (inside == expected).mean() > 0.999 and 0 < inside.mean() < 1
        signed, expected = ours.compute_signed_distance(points), theirs.compute_signed_distance(points, nsamples=3)
        assert (np.abs(signed - expected.numpy()) < 1e-5).mean() > 0.999


@NO_WARNINGS
def test_pinhole_beside_open3d():
    open3d = pytest.importorskip("open3d", reason="open3d is not installed")
    theirs = open3d.t.geometry.RaycastingScene.create_rays_pinhole
    rng = np.random.default_rng(1)
    for _ in range(5):
        vectors = rng.normal(size=(3, 3))
        look = [float(rng.uniform(10, 120)), *vectors, 13, 7]
        expected = theirs(look[0], *map(open3d.core.Tensor, vectors), 13, 7).numpy()
        np.testing.assert_allclose(RaycastingScene.create_rays_pinhole(*look), expected, atol=2e-6)
        intrinsic = np.array([[rng.uniform(5, 20), rng.uniform(-1, 1), 6], [0, rng.uniform(5, 20), 3], [0, 0, 1]])
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        extrinsic = np.eye(4)
        extrinsic[:3, :3], extrinsic[:3, 3] = turn, rng.normal(size=3)
        expected = theirs(open3d.core.Tensor(intrinsic), open3d.core.Tensor(extrinsic), 9, 5).numpy()
        np.testing.assert_allclose(RaycastingScene.create_rays_pinhole(intrinsic, extrinsic, 9, 5), expected, atol=2e-6)
