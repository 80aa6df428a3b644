"""The drop-in for trimesh's intersectors: by itself, in trimesh's own ray tests, and beside trimesh.

Trimesh's tests are read from the folder that ROPEWALK_TRIMESH_TESTS names, `tests` of its unpacked source
distribution or of a checkout, which has model files too. scripts/test-compat gets them.
"""

import copy
import importlib.util
import inspect
import logging
import os
import pathlib
import pickle
import subprocess
import sys
import time
import types

import numpy as np
import pytest

import ropewalk
from meshes import box, degenerate_mesh, faces as face_list, grid_mesh, random_mesh, sphere, subdivide
from oracle import Oracle
from ropewalk.compat.trimesh import RayMeshIntersector

DOWN = [0.0, 0.0, -1.0]


class Mesh:
    """What a mesh must have, and no more."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = np.array(vertices, float), np.array(faces)


def intersector(mesh):
    return RayMeshIntersector(Mesh(*mesh))


def box_of(extents):
    half = np.array(extents) / 2
    return box(-half, half)


def test_orders_shapes_and_dtypes():
    ray = intersector(box())
    origins = [[0.2, 0.3, 5], [9, 9, 9], [0.6, 0.3, 5]]
    directions = [[0, 0, -2], DOWN, DOWN]
    locations, index_ray, index_tri = ray.intersects_location(origins, directions)
    assert index_ray.tolist() == [0, 0, 2, 2]
    np.testing.assert_allclose(locations, [[0.2, 0.3, 1], [0.2, 0.3, 0], [0.6, 0.3, 1], [0.6, 0.3, 0]], atol=1e-15)
    tri, of, where = ray.intersects_id(origins, directions, return_locations=True)
    assert (tri == index_tri).all() and (of == index_ray).all() and (where == locations).all()
    assert tri.dtype == of.dtype == np.int64 and where.dtype == np.float64
    assert len(ray.intersects_id(origins, directions)) == 2
    first = ray.intersects_first(origins, directions)
    assert first.dtype == np.int64 and first.tolist() == [tri[0], -1, tri[2]]
    hit = ray.intersects_any(origins, directions)
    assert hit.dtype == bool and hit.tolist() == [True, False, True]
    nearest = ray.intersects_location(origins, directions, multiple_hits=False)
    assert [len(array) for array in nearest] == [2, 2, 2] and (nearest[2] == tri[[0, 2]]).all()
    tri, of = ray.intersects_id(origins, directions, multiple_hits=False)
    assert of.tolist() == [0, 2]


def test_nothing_hit_and_no_rays():
    ray = intersector(box())
    for o, d in (([[9, 9, 9]], [DOWN]), ([], []), (np.empty((0, 3)), np.empty((0, 3)))):
        locations, index_ray, index_tri = ray.intersects_location(o, d)
        assert locations.shape == (0, 3) and index_ray.shape == index_tri.shape == (0,)
        assert (locations.dtype, index_ray.dtype, index_tri.dtype) == (np.float64, np.int64, np.int64)
        for some in ({}, {"multiple_hits": False}, {"max_hits": 0}):
            found = ray.intersects_id(o, d, return_locations=True, **some)
            assert [array.shape for array in found] == [(0,), (0,), (0, 3)]
        assert not ray.intersects_any(o, d).any() and (ray.intersects_first(o, d) == -1).all()
    assert ray.contains_points([]).shape == (0,)
    empty = intersector((np.empty((0, 3)), np.empty((0, 3), int)))
    assert empty.intersects_first([[0, 0, 0]], [DOWN]).tolist() == [-1]
    assert empty.intersects_location([[0, 0, 0]], [DOWN])[0].shape == (0, 3)
    assert not empty.contains_points([[0, 0, 0]]).any()


def test_a_ray_or_a_point_by_itself():
    ray = intersector(box())
    assert ray.intersects_any([0.2, 0.3, 5], DOWN).tolist() == [True]
    assert ray.contains_points([0.5, 0.5, 0.5]).tolist() == [True]


@pytest.mark.parametrize("make", [random_mesh, grid_mesh, degenerate_mesh])
def test_hits_are_those_of_brute_force_in_float64(make):
    rng = np.random.default_rng(3)
    vertices, indices = make(rng, 60, 1.0)
    vertices = vertices + (1e-9 * rng.normal(size=vertices.shape) if make is random_mesh else 0.0)
    origins = rng.uniform(-1, 1, (400, 3))
    directions = rng.uniform(-0.5, 0.5, (400, 3)) - origins
    directions *= 10.0 ** rng.uniform(-3, 3, (400, 1))
    oracle = Oracle(np.float64(vertices)[indices], origins, directions, dtype=np.float64)
    ray = intersector((vertices, indices))
    tri, of = ray.intersects_id(origins, directions, max_hits=10**6)
    location_rays = ray.intersects_location(origins, directions)[1]
    assert (location_rays == of).all()
    first, any_hit = ray.intersects_first(origins, directions), ray.intersects_any(origins, directions)
    nearest = oracle.closest()[1]
    checked = 0
    for i, expected in enumerate(oracle.lists()):
        if not oracle.sure[i]:
            continue
        merged = [p for j, (t, p) in enumerate(expected) if j == 0 or t - expected[j - 1][0] > 1e-11 * t]
        assert tri[of == i].tolist() == merged
        assert first[i] == nearest[i] and any_hit[i] == bool(expected)
        checked += len(merged)
    assert checked > 100


def test_one_hit_a_place_on_edges_and_vertices():
    """Trimesh's 457 and duplicate hits: through edges and vertices a closed surface has two hits."""
    for scale in (1e-4, 0.1, 1.0, 10.0, 1e4, 1e8):
        vertices, indices = subdivide(*subdivide(*box_of([scale] * 3)))
        ray = intersector((vertices, indices))
        tri, of = ray.intersects_id([[0, 0, scale / 2], [0, 0, scale]], [DOWN, DOWN])
        assert of.tolist() == [0, 0, 1, 1], scale
    vertices, indices = sphere(3)
    ray = intersector((vertices, indices))
    directions = np.concatenate([vertices, (vertices[indices[:, 0]] + vertices[indices[:, 1]]) / 2])
    for o, count in ((np.zeros_like(directions), 1), (-3 * directions, 2)):
        of = ray.intersects_location(o, directions)[1]
        assert (np.bincount(of, minlength=len(o)) == count).all()
    away = intersector(box()).intersects_location([[0.5, 0.5, 0.5]], [[0.5, 0.5, 0.5]])
    np.testing.assert_allclose(away[0], [[1, 1, 1]], atol=1e-15)


def test_thin_sheets_are_two_places():
    low, high = box(), box((0, 0, 1 + 1e-9), (1, 1, 2))
    vertices = np.concatenate([low[0], high[0]])
    ray = intersector((vertices, np.concatenate([low[1], high[1] + 8])))
    locations = ray.intersects_location([[0.3, 0.4, 5]], [DOWN])[0]
    np.testing.assert_allclose(locations[:, 2], [2, 1 + 1e-9, 1, 0], atol=1e-15)


def test_max_hits_counts_places():
    layers = [box((0, 0, z), (1, 1, z + 0.5)) for z in range(8)]
    vertices = np.concatenate([v for v, _ in layers])
    indices = np.concatenate([f + 8 * i for i, (_, f) in enumerate(layers)])
    ray = intersector((vertices, indices))
    # The first ray meets the diagonals, two faces at each place; the second one face.
    origins, directions = [[0.5, 0.5, 9], [0.3, 0.6, 9], [5, 5, 5]], [DOWN] * 3
    every = ray.intersects_id(origins, directions, return_locations=True)
    assert every[1].tolist() == [0] * 16 + [1] * 16
    for limit in (0, 1, 2, 3, 7, 15, 16, 17, 100):
        tri, of, where = ray.intersects_id(origins, directions, max_hits=limit, return_locations=True)
        keep = np.concatenate([np.arange(16) < limit] * 2)
        assert (tri == every[0][keep]).all() and (of == every[1][keep]).all()
        assert (where == every[2][keep]).all()
        again = ray.intersects_location(origins, directions, max_hits=limit)
        assert (again[0] == where).all()
    # Two faces at the first place and one at each other: twice as many hits are more places than asked for.
    vertices = np.concatenate([vertices, [[0, 0, 8], [1, 0, 8], [1, 1, 8], [0, 1, 8]]])
    ray = intersector((vertices, np.concatenate([indices, [[64, 65, 66], [64, 66, 67], [64, 65, 66]]])))
    for limit in (1, 2, 3, 5):
        tri, of, where = ray.intersects_id([[0.7, 0.4, 9]], [DOWN], max_hits=limit, return_locations=True)
        assert len(tri) == len(of) == limit
        np.testing.assert_allclose(where[:, 2], [8, 7.5, 7, 6.5, 6][:limit])


def test_every_location_however_many():
    count = 150  # more than trimesh's limit of 100
    corners = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0]], float)
    vertices = np.concatenate([corners + [0, 0, z] for z in range(count)])
    ray = intersector((vertices, face_list(count)))
    locations = ray.intersects_location([[1, 1, 1000]], [DOWN])[0]
    assert (locations[:, 2] == np.arange(count)[::-1]).all()
    assert len(ray.intersects_id([[1, 1, 1000]], [DOWN])[0]) == 100


def test_small_meshes_from_afar_and_large_coordinates():
    ray = intersector(box_of([1e-3] * 3))
    locations = ray.intersects_location([[0, 0, 10000.0]], [DOWN])[0]
    np.testing.assert_allclose(locations[:, 2], [5e-4, -5e-4], rtol=1e-9)
    wall = [[528980.85, 183526.1, 0], [528980.85, 183526.1, 3], [528982.3, 183523.55, 0], [528982.3, 183523.55, 3]]
    ray = intersector((wall, [[1, 0, 2], [1, 2, 3]]))
    normal = np.cross(np.subtract(wall[1], wall[0]), np.subtract(wall[2], wall[0]))
    normal /= np.linalg.norm(normal)
    origin = (np.array(wall[0]) + wall[2]) / 2 + [0, 0, 1] + 0.01 * normal
    assert ray.intersects_any([origin, origin], [normal, -normal]).tolist() == [False, True]


def test_in_the_plane_of_a_face_is_a_miss():
    square = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.3, 0], [0, 0.3, 0]]
    ray = intersector((square, [[0, 1, 2], [0, 2, 3]]))
    found = ray.intersects_location([[-0.5, 0.1, 0]], [[1, 0, 0]], multiple_hits=False)
    assert [array.shape for array in found] == [(0, 3), (0,), (0,)]


def test_through_edges_of_a_box_nothing_is_lost():
    ray = intersector(box_of([2, 2, 2]))
    origins = [[x, y, 5] for x in (-1, 0, 1) for y in (-1, 0, 1)]
    assert ray.intersects_any(origins, [DOWN] * 9).all()
    xy = np.linspace(-0.9, 0.9, 40)
    origins = np.array([[x, y, -5] for x in xy for y in xy])
    assert ray.intersects_any(origins, np.tile([0, 0, 1], (1600, 1))).all()


def test_one_at_a_time_as_all_at_once():
    vertices, indices = sphere(3)
    ray = intersector((vertices, indices))
    origins, directions = vertices * 1.01, -vertices
    batch = ray.intersects_location(origins, directions, multiple_hits=False)
    for i in range(0, len(vertices), 7):
        single = ray.intersects_location([origins[i]], [directions[i]], multiple_hits=False)
        assert (single[0] == batch[0][i]).all() and (single[2] == batch[2][i]).all()
    cross = np.cross(batch[0] - origins, directions)
    assert np.abs(cross).max() < 1e-14


def test_contains():
    ray = intersector(box())
    assert ray.contains_points([[0.5] * 3, [1.5] * 3, [1e-12] * 3, [-1e-12] * 3]).tolist() == [True, False, True, False]
    outer, inner = box_of([1, 1, 1]), box_of([0.1, 0.1, 0.1])
    cavity = np.concatenate([outer[0], inner[0]]), np.concatenate([outer[1], inner[1][:, ::-1] + 8])
    ray = intersector(cavity)
    assert ray.contains_points([[0, 0, 0], [0.2, 0, 0], [0.7, 0, 0]]).tolist() == [False, True, False]
    vertices, indices = sphere(4)
    ray = intersector((vertices, indices))
    points = np.random.default_rng(0).uniform(-1.1, 1.1, (4096, 3))
    inside, radii = ray.contains_points(points), np.linalg.norm(points, axis=1)
    shell = np.linalg.norm(vertices[indices].mean(axis=1), axis=1).min()
    assert inside[radii < 0.99 * shell].all() and not inside[radii > 1].any()
    for _ in range(5):
        assert (ray.contains_points(points) == inside).all()


def test_a_changed_mesh_is_built_anew():
    mesh = Mesh(*box())
    ray = RayMeshIntersector(mesh)
    scene = ray.scene
    assert ray.scene is scene
    assert ray.intersects_any([[0.5, 0.5, 5]], [DOWN]).all()
    mesh.vertices[:, 0] += 10
    assert ray.scene is not scene and not ray.intersects_any([[0.5, 0.5, 5]], [DOWN]).any()
    mesh.faces = mesh.faces[:2]
    assert len(ray.scene) == 2


def test_copies_and_pickles():
    mesh = Mesh(*box())
    mesh.ray = RayMeshIntersector(mesh, scale_to_box=False)
    assert mesh.ray.intersects_any([[0.5, 0.5, 5]], [DOWN]).all()
    assert copy.copy(mesh.ray).mesh is mesh and copy.deepcopy(mesh.ray).mesh is mesh
    again = pickle.loads(pickle.dumps(mesh.ray))
    assert again._built is None
    assert again.intersects_any([[0.5, 0.5, 5]], [DOWN]).all() and not again._scale_to_box


def test_triangles_serve_where_there_are_no_faces():
    vertices, indices = box()
    ray = RayMeshIntersector(types.SimpleNamespace(triangles=vertices[indices]))
    assert ray.intersects_first([[0.5, 0.3, 5]], [DOWN]) == intersector(box()).intersects_first([[0.5, 0.3, 5]], [DOWN])


def test_bad_input():
    ray = intersector(box())
    with pytest.raises(ValueError, match="Ray origin and direction don't match!") as caught:
        ray.intersects_any([[0, 0, 0], [1, 1, 1]], [DOWN])
    assert isinstance(caught.value, ropewalk.ArgumentError) and caught.value.argument == "ray_directions"
    for call in (
        lambda: ray.intersects_first([[0, 0]], [[0, 0]]),
        lambda: ray.contains_points([[0, 0]]),
        lambda: ray.intersects_id([[0, 0, 0]], [DOWN], max_hits=-1),
        lambda: intersector(([[0, 0, 0]], [[0, 1, 2]])).scene,
        lambda: intersector(([[np.nan, 0, 0]] * 3, [[0, 1, 2]])).scene,
        lambda: RayMeshIntersector(types.SimpleNamespace(triangles=np.zeros((2, 3)))).scene,
    ):
        with pytest.raises(ropewalk.ArgumentError):
            call()
    for call in (
        lambda: ray.intersects_first([["a", "b", "c"]], [DOWN]),
        lambda: ray.intersects_location([[0, 0, 0]], [DOWN], nonsense=1),
        lambda: RayMeshIntersector(object()).scene,
    ):
        with pytest.raises(ropewalk.ArgumentTypeError):
            call()
    with pytest.warns(ropewalk.InvalidRayWarning):
        assert ray.intersects_first([[np.nan, 0, 0], [0.5, 0.4, 5]], [DOWN, DOWN])[0] == -1


# --- trimesh itself ---------------------------------------------------------------------------------------------

NO_WARNINGS = pytest.mark.filterwarnings("ignore")

#: All cases of trimesh 5.2.0's ray tests, and what they need beyond trimesh.
UPSTREAM = {
    "test_ray": {
        "test_rays": "model files",
        "test_rps": "unit_sphere.STL",
        "test_empty": "unit_sphere.STL",
        "test_contains": "unit_cube.STL",
        "test_contains_cavity": "manifold3d",
        "test_on_vertex": "",
        "test_on_edge": "model files",
        "test_multiple_hits": "",
        "test_contain_single": "model files",
        "test_box": "unit_cube.STL",
        "test_embree_duplicate_hits": "",
    },
    "test_ray_upstream": {
        "test_issue_2504_duplicate_hits_small_scale": "",
        "test_issue_2324_apply_scale_breaks_embree": "",
        "test_issue_1496_edge_vertex_hits_any_vs_id": "",
        "test_issue_2317_robust_edge_hits": "",
        "test_issue_1362_many_rays_consistency": "model files",
        "test_issue_1898_locations_colinear_with_directions": "",
        "test_issue_306_single_vs_batched_rays": "",
        "test_issue_93_triangle_index_correct_for_first_hit": "",
        "test_issue_181_contains_deterministic": "",
        "test_issue_242_contains_matches_ground_truth": "",
        "test_issue_545_contains_simple_sphere": "",
        "test_issue_48_large_coordinate_ray_offset": "",
        "test_issue_331_surface_origin_no_self_hit": "",
        "test_issue_72_axis_aligned_voxel_hits": "",
        "test_issue_457_multihit_cylinder_count": "",
        "test_issue_1919_engines_agree_simple_mesh": "rtree",
        "test_issue_1180_first_hit_arrays_aligned": "",
        "test_issue_1786_contains_stable_over_many_calls": "",
        "test_issue_2462_coplanar_ray_no_error": "",
    },
}


def upstream_tests():
    """The folder of trimesh's tests."""
    folder = os.environ.get("ROPEWALK_TRIMESH_TESTS")
    if not folder or not pathlib.Path(folder, "test_ray.py").exists():
        pytest.skip("ROPEWALK_TRIMESH_TESTS names no folder with trimesh's test_ray.py (scripts/test-compat does)")
    return pathlib.Path(folder)


def generic(trimesh, folder):
    """What trimesh's tests import as `generic`: its model files where they are, else two that can be made."""
    models = folder.parent / "models"

    def get_mesh(file_name, **kwargs):
        name = file_name
        if (models / name).exists():
            return trimesh.load(models / name, **kwargs)
        if name == "unit_cube.STL":
            made = trimesh.creation.box()
        elif name == "unit_sphere.STL":
            made = trimesh.creation.icosphere()
        else:
            pytest.skip(f"trimesh's model file {name} is not there")
        return trimesh.Trimesh(made.vertices, made.faces, **kwargs)

    module = types.ModuleType("generic")
    module.np, module.trimesh, module.time, module.get_mesh = np, trimesh, time, get_mesh
    module.log = logging.getLogger("trimesh")
    module.random = lambda *shape: np.random.RandomState(seed=1).random_sample(*shape)
    module.data = {}
    if (folder / "data/ray_data.json").exists():
        import json

        module.data["ray_data"] = json.loads((folder / "data/ray_data.json").read_text())
    return module


def swap(monkeypatch, trimesh, native):
    """Puts our intersector in place of trimesh's."""
    names = ["ray_pyembree", "ray_triangle"] if native else ["ray_pyembree"]
    for name in names:
        module = types.ModuleType(f"trimesh.ray.{name}")
        module.RayMeshIntersector = RayMeshIntersector
        monkeypatch.setitem(sys.modules, module.__name__, module)
        monkeypatch.setattr(trimesh.ray, name, module)
    monkeypatch.setattr(trimesh.ray, "has_embree", True)
    embreex = types.ModuleType("embreex")
    embreex.__version__ = "4.4.0"
    monkeypatch.setitem(sys.modules, "embreex", embreex)


def load(monkeypatch, trimesh, folder, file):
    monkeypatch.setitem(sys.modules, "generic", generic(trimesh, folder))
    spec = importlib.util.spec_from_file_location(f"trimesh_{file}", folder / f"{file}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


CASES = [(file, name) for file, names in UPSTREAM.items() for name in names]


@NO_WARNINGS
@pytest.mark.parametrize("file, name", CASES, ids=[name for _, name in CASES])
def test_upstream(monkeypatch, file, name):
    folder = upstream_tests()
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    needs = UPSTREAM[file][name]
    if needs == "model files" and not (folder.parent / "models").exists():
        pytest.skip("trimesh's model files are not there")
    if needs == "manifold3d":
        pytest.importorskip("manifold3d", reason="manifold3d, which the case needs, is not installed")
    rtree = importlib.util.find_spec("rtree") is not None
    if needs == "rtree" and not rtree:
        pytest.skip("rtree, which trimesh's own intersector needs, is not installed")
    # One case compares with the native intersector, which stays what it is there.
    swap(monkeypatch, trimesh, native=needs != "rtree")
    module = load(monkeypatch, trimesh, folder, file)
    if needs == "model files" and name == "test_rays":
        if "ray_data" not in module.g.data:
            pytest.skip("trimesh's ray_data.json is not there")
    asked = []
    plain = RayMeshIntersector.scene.fget
    monkeypatch.setattr(RayMeshIntersector, "scene", property(lambda self: asked.append(1) or plain(self)))
    getattr(module, name)()
    assert asked, "the case never asked our intersector"


@NO_WARNINGS
def test_all_upstream_cases_are_listed(monkeypatch):
    folder = upstream_tests()
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    swap(monkeypatch, trimesh, native=False)
    for file, names in UPSTREAM.items():
        module = load(monkeypatch, trimesh, folder, file)
        there = {n for n, f in vars(module).items() if n.startswith("test_") and inspect.isfunction(f)}
        assert there == set(names)


@NO_WARNINGS
@pytest.mark.parametrize("engine", ["ray_pyembree", "ray_triangle"])
def test_beside_trimesh(engine):
    """Same random rays: where brute force in float64 is sure, differences are trimesh's."""
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    needs = "embreex" if engine == "ray_pyembree" else "rtree"
    pytest.importorskip(needs, reason=f"{needs}, which the intersector needs, is not installed")
    mesh = trimesh.creation.icosphere(subdivisions=2)
    theirs = getattr(trimesh.ray, engine).RayMeshIntersector(mesh)
    ours = RayMeshIntersector(mesh)
    rng = np.random.default_rng(5)
    origins = rng.uniform(-1.5, 1.5, (2000, 3))
    directions = rng.normal(size=(2000, 3))
    oracle = Oracle(mesh.triangles, origins, directions, dtype=np.float64)
    truth, sure = oracle.closest()[1], oracle.sure
    assert (ours.intersects_first(origins, directions) == truth)[sure].all() and sure.mean() > 0.99
    assert (theirs.intersects_first(origins, directions) != truth)[sure].mean() < 2e-3
    counts = oracle.hit.sum(axis=1)
    for multiple in (True, False):
        found = ours.intersects_location(origins, directions, multiple_hits=multiple)
        expected = theirs.intersects_location(origins, directions, multiple_hits=multiple)
        right = np.bincount(found[1], minlength=2000)
        assert (right == np.minimum(counts, 1 if not multiple else counts))[sure].all()
        off = right != np.bincount(expected[1], minlength=2000)
        assert off.mean() < 5e-3
        # The same places in the same rows, once theirs are put in order.
        rows = []
        for locations, ray, tri in (found, expected):
            along = np.einsum("ij,ij->i", locations - origins[ray], directions[ray])
            order = np.lexsort((along, ray))
            keep = ~off[ray[order]]
            rows.append((locations[order][keep], ray[order][keep], tri[order][keep]))
        assert (rows[0][1] == rows[1][1]).all() and (rows[0][2] == rows[1][2]).mean() > 0.998
        assert np.abs(rows[0][0] - rows[1][0]).max() < 1e-9
    points = rng.uniform(-1.1, 1.1, (2000, 3))
    assert (ours.contains_points(points) != theirs.contains_points(points)).mean() < 2e-3


#: After examples/ray.py of trimesh; the import is what changes.
SCRIPT = """
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

mesh = trimesh.primitives.Sphere()
mesh = trimesh.Trimesh(mesh.vertices, mesh.faces)
mesh.ray = RayMeshIntersector(mesh)
ray_origins = np.array([[0, 0, -5], [2, 2, -10]])
ray_directions = np.array([[0, 0, 1], [0, 0, 1]])
locations, index_ray, index_tri = mesh.ray.intersects_location(
    ray_origins=ray_origins, ray_directions=ray_directions)
ray_visualize = np.hstack((ray_origins, ray_origins + ray_directions)).reshape(-1, 2, 3)
colors = np.full((len(mesh.faces), 4), 255)
colors[index_tri] = [255, 0, 0, 255]
inside = mesh.contains([[0, 0, 0], [0, 0, 2]])
first = mesh.ray.intersects_first(ray_origins, ray_directions) != -1
result = sorted(locations.round(6)[:, 2].tolist()), index_ray.tolist(), len(set(index_tri)), inside.tolist(), first.tolist()
"""


@NO_WARNINGS
def test_a_script_runs_with_another_import():
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    ours = {}
    exec(SCRIPT.replace("from trimesh.ray.ray_pyembree", "from ropewalk.compat.trimesh"), ours)
    assert ours["result"] == ([-1.0, 1.0], [0, 0], 2, [True, False], [True, False])
    pytest.importorskip("embreex", reason="embreex, to run the script as it is, is not installed")
    theirs = {}
    exec(SCRIPT, theirs)
    assert theirs["result"] == ours["result"]


@NO_WARNINGS
def test_a_trimesh_that_changes():
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    mesh = trimesh.creation.box()
    mesh.ray = RayMeshIntersector(mesh)
    scene = mesh.ray.scene
    assert mesh.ray.scene is scene
    mesh.apply_translation([10, 0, 0])
    assert mesh.ray.scene is not scene and not mesh.ray.intersects_any([[0, 0, 5]], [DOWN]).any()
    assert mesh.contains([[10, 0, 0], [0, 0, 0]]).tolist() == [True, False]
    assert pickle.loads(pickle.dumps(mesh)).ray.intersects_any([[10, 0, 5]], [DOWN]).all()


def test_trimesh_is_not_needed():
    code = (
        "import sys; sys.modules.update(trimesh=None, open3d=None, embreex=None)\n"
        "import ropewalk.compat.trimesh, ropewalk.compat.embreex, ropewalk.compat.open3d\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
