"""A drop-in for ``open3d.t.geometry.RaycastingScene``.

>>> import numpy as np
>>> import ropewalk.compat.open3d as o3d
>>> scene = o3d.t.geometry.RaycastingScene()
>>> scene.add_triangles(np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.uint32([[0, 1, 2]]))
0
>>> ans = scene.cast_rays(np.float32([[0.5, 0.25, 1, 0, 0, -1], [10, 10, 10, 1, 0, 0]]))
>>> ans["t_hit"].numpy(), ans["geometry_ids"].numpy()
(array([ 1., inf], dtype=float32), array([         0, 4294967295], dtype=uint32))

Open3D itself is not needed. Where it is installed, all other names of this module (``o3d.core``, ``o3d.io``,
``o3d.t.geometry.TriangleMesh``) are its own, so that ``import ropewalk.compat.open3d as o3d`` is all that a script changes;
where it is not, ``o3d.core`` has :class:`Tensor`, ``Device``, ``Dtype`` and the names of dtypes. What differs from Open3D is in
docs/coming-from.md.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import ArrayLike, as_array, as_float32, as_float64, as_integer, as_threads
from .._errors import ArgumentError, ArgumentTypeError
from ._lazy import LazyScene

if TYPE_CHECKING:
    from numpy.typing import DTypeLike, NDArray

__all__ = ["RaycastingScene", "Tensor", "core", "t"]

#: Rays that are listed at once where only their number of intersections is kept.
_BLOCK = 1 << 20


class Tensor(np.ndarray):
    """A NumPy array with what scripts ask of an ``open3d.core.Tensor``; its elements are tensors without axes.

    Args:
        data: any numeric array-like.
        dtype: a dtype of NumPy or Open3D; that of the data by default.
        device: without effect.

    >>> import numpy as np
    >>> tensor = Tensor([1.5, np.inf], dtype=np.float32)
    >>> tensor.numpy(), tensor.isfinite().numpy(), tensor[0].item(), tensor.cpu() is tensor
    (array([1.5, inf], dtype=float32), array([ True, False]), 1.5, True)
    """

    def __new__(cls, data: ArrayLike, dtype: Any = None, device: Any = None) -> Tensor:
        return np.array(_given(data), None if dtype is None else _dtype(dtype)).view(cls)

    def __getitem__(self, key: Any) -> Any:
        found: Any = super().__getitem__(_given(key))
        return found if isinstance(found, np.ndarray) else np.asarray(found).view(Tensor)

    @staticmethod
    def from_numpy(array: NDArray[Any]) -> Tensor:
        """The array as a tensor, in the same memory."""
        return array.view(Tensor)

    def numpy(self) -> NDArray[Any]:
        """As a plain NumPy array, in the same memory."""
        return self.view(np.ndarray)

    def cpu(self) -> Tensor:
        """The tensor itself."""
        return self

    def clone(self) -> Tensor:
        """A copy."""
        return self.copy()

    def to(self, *args: Any, **kwargs: Any) -> Tensor:
        """As another dtype; devices and ``copy=`` are taken without effect."""
        kinds = [v for v in (*args, *kwargs.values()) if not isinstance(v, bool) and not _is_device(v)]
        return self.astype(_dtype(kinds[0])).view(Tensor) if kinds else self

    def isfinite(self) -> Tensor:
        """Whether each number is finite."""
        return np.asarray(np.isfinite(self)).view(Tensor)

    def isinf(self) -> Tensor:
        """Whether each number is infinite."""
        return np.asarray(np.isinf(self)).view(Tensor)

    def isnan(self) -> Tensor:
        """Whether each number is NaN."""
        return np.asarray(np.isnan(self)).view(Tensor)


class RaycastingScene:
    """Triangle meshes that rays and points are asked of, with Open3D's names, shapes and dtypes.

    Args:
        nthreads: threads of the build; 0 is one a processor that this process may use.
        device: ``"CPU:0"`` or what shows itself as that, of which there is no other here.

    ``{..}`` below stands for any shape, also none. Rays are ``[ox, oy, oz, dx, dy, dz]`` and distances along them in lengths of
    ``[dx, dy, dz]``. Results are :class:`Tensor`. The tree is built by the first query, and again by the first one after
    another mesh was added. Scenes can be pickled, and queries may come from several threads.

    Raises:
        ArgumentError: (ValueError) arrays of wrong shapes, vertices that are not finite, triangles that name no
            vertex, another device, ``nsamples`` that are not odd.
        ArgumentTypeError: (TypeError) arrays that are no real numbers, triangles that are no integers.

    >>> import numpy as np
    >>> scene = RaycastingScene()
    >>> scene.add_triangles(np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.uint32([[0, 1, 2]]))
    0
    >>> scene.test_occlusions(np.float32([[0.5, 0.25, 1, 0, 0, -1]]), tfar=0.5).numpy()
    array([False])
    """

    #: Geometry and primitive of a ray that hits nothing.
    INVALID_ID: int = 0xFFFF_FFFF

    def __init__(self, nthreads: int = 0, device: Any = "CPU:0") -> None:
        as_threads(nthreads)
        if not str(device).upper().startswith("CPU"):
            raise ArgumentError(f"device: expected 'CPU:0', found {str(device)!r}", "device")
        self._meshes = LazyScene(nthreads)

    def add_triangles(self, *args: Any, **kwargs: Any) -> int:
        """Adds a mesh; arrays are copied.

        Args:
            vertex_positions: {N, 3} float32.
            triangle_indices: {M, 3} of any integers.
            mesh: instead of both a ``TriangleMesh`` of ``open3d.t.geometry`` or ``open3d.geometry``, or anything that has
                ``vertices`` and ``triangles`` or ``faces``.

        Returns:
            the geometry ID: 0 for the first one, 1 for the next.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> corners, triangles = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.uint32([[0, 1, 2]])
        >>> scene.add_triangles(corners, triangles), scene.add_triangles(corners + 1, triangles)
        (0, 1)
        """
        names = ("mesh",) if "mesh" in kwargs or len(args) + len(kwargs) == 1 else _TRIANGLES
        given = _bind("add_triangles", names, args, kwargs)
        vertices, faces = _of_mesh(given["mesh"]) if "mesh" in given else given.values()
        return self._meshes.add(_given(vertices), _given(faces), _TRIANGLES)

    def cast_rays(self, rays: ArrayLike, nthreads: int = 0) -> dict[str, Tensor]:
        """The first hit of each ray.

        Args:
            rays: {.., 6}, rounded to float32.
            nthreads: threads of this call; 0 is one a processor that this process may use.

        Returns:
            ``t_hit`` {..} float32, inf for a miss; ``geometry_ids`` and ``primitive_ids`` {..} uint32, ``INVALID_ID`` for
            a miss; ``primitive_uvs`` {.., 2} float32, weights of vertices 1 and 2, and ``primitive_normals`` {.., 3}
            float32, of unit length, on the side from which vertices run counter-clockwise; both 0 for a miss.

        Of hits at equal distances the one with the lowest geometry, then primitive.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> scene.add_triangles(np.float32([[0, 0, 0], [2, 0, 0], [0, 2, 0]]), np.uint32([[0, 1, 2]]))
        0
        >>> ans = scene.cast_rays(np.float32([[0.5, 1, 4, 0, 0, -2]]))
        >>> ans["t_hit"].numpy(), ans["primitive_uvs"].numpy(), ans["primitive_normals"].numpy()
        (array([2.], dtype=float32), array([[0.25, 0.5 ]], dtype=float32), array([[0., 0., 1.]], dtype=float32))
        """
        o, d = _rays(rays)
        hits = self._meshes.scene().closest_hit(o, d, threads=as_threads(nthreads))
        uv, normal = hits._look("uv", "normal")
        missed = ~hits.hit
        uv[missed] = normal[missed] = 0
        return {
            "t_hit": _tensor(hits.t),
            "geometry_ids": _ids(hits.geom_id),
            "primitive_ids": _ids(hits.prim_id),
            "primitive_uvs": _tensor(uv),
            "primitive_normals": _tensor(normal),
        }

    def test_occlusions(
        self, rays: ArrayLike, tnear: float = 0.0, tfar: float = np.inf, nthreads: int = 0
    ) -> Tensor:
        """Whether each ray hits anything from ``tnear`` to ``tfar``, both included: {..} bool.

        >>> import numpy as np
        >>> RaycastingScene().test_occlusions(np.float32([[0, 0, 0, 0, 0, 1]])).numpy()
        array([False])
        """
        o, d = _rays(rays)
        scene, threads = self._meshes.scene(), as_threads(nthreads)
        return _tensor(scene.occluded(o, d, tnear, tfar, threads=threads))

    def count_intersections(self, rays: ArrayLike, nthreads: int = 0) -> Tensor:
        """How often each ray meets a surface: {..} int32.

        Faces of one geometry that are met at one distance, on an edge that they share or because they coincide, are
        one intersection; so the numbers are those of :meth:`list_intersections`.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> square = np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        >>> scene.add_triangles(square, np.uint32([[0, 1, 2], [0, 2, 3]]))
        0
        >>> scene.count_intersections(np.float32([[0.5, 0.5, 1, 0, 0, -1], [5, 5, 5, 0, 0, -1]])).numpy()
        array([1, 0], dtype=int32)
        """
        o, d = _rays(rays)
        scene, threads = self._meshes.scene(), as_threads(nthreads)
        shape, o, d = o.shape[:-1], o.reshape(-1, 3), d.reshape(-1, 3)
        counts = np.zeros(len(o), np.int32)
        for start in range(0, len(o), _BLOCK):
            part = slice(start, start + _BLOCK)
            lists = scene.all_hits(o[part], d[part], threads=threads)
            kept = lists.ray_id[self._meshes.first_of_places(lists, o[part], d[part])]
            counts[part] = np.bincount(kept, minlength=len(lists.offsets) - 1)
        return _tensor(counts.reshape(shape))

    def list_intersections(self, rays: ArrayLike, nthreads: int = 0) -> dict[str, Tensor]:
        """All intersections of each ray, in order of distance, then geometry.

        Returns:
            those of ray ``i``, counted in C order, at ``ray_splits[i]`` to ``ray_splits[i + 1]`` of the others:
            ``ray_splits`` {R + 1} and ``ray_ids`` {K} uint32, ``t_hit`` {K} float32, ``geometry_ids`` and
            ``primitive_ids`` {K} uint32, ``primitive_uvs`` {K, 2} float32. Of faces that are one intersection (see
            :meth:`count_intersections`) the first is named.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> sheets = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]])
        >>> scene.add_triangles(sheets, np.uint32([[0, 1, 2], [3, 4, 5]]))
        0
        >>> lx = scene.list_intersections(np.float32([[0.2, 0.2, 5, 0, 0, -1], [9, 9, 9, 0, 0, -1]]))
        >>> lx["ray_splits"].numpy(), lx["t_hit"].numpy(), lx["primitive_ids"].numpy()
        (array([0, 2, 2], dtype=uint32), array([4., 5.], dtype=float32), array([1, 0], dtype=uint32))
        """
        o, d = _rays(rays)
        lists = self._meshes.scene().all_hits(o, d, threads=as_threads(nthreads))
        keep = self._meshes.first_of_places(lists, o, d)
        splits = np.concatenate([[0], np.cumsum(keep)])[lists.offsets]
        # Open3D's are uint32, which holds no more than that.
        small = np.uint32 if splits[-1] < 2**32 and len(splits) <= 2**32 else np.int64
        return {
            "ray_splits": _tensor(splits, small),
            "ray_ids": _tensor(lists.ray_id[keep], small),
            "t_hit": _tensor(lists.t[keep]),
            "geometry_ids": _ids(lists.geom_id[keep]),
            "primitive_ids": _ids(lists.prim_id[keep]),
            "primitive_uvs": _tensor(lists.uv[keep]),
        }

    def compute_closest_points(
        self, query_points: ArrayLike, nthreads: int = 0
    ) -> dict[str, Tensor]:
        """The nearest point of the surface to each point.

        Args:
            query_points: {.., 3}, of any real numbers.
            nthreads: threads of this call; 0 is one a processor that this process may use.

        Returns:
            ``points`` {.., 3} float32, ``geometry_ids`` and ``primitive_ids`` {..} uint32, ``primitive_uvs`` {.., 2} and
            ``primitive_normals`` {.., 3} float32. Without triangles, and for points that are NaN, points are NaN,
            IDs ``INVALID_ID``, the rest 0.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> scene.add_triangles(np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.uint32([[0, 1, 2]]))
        0
        >>> scene.compute_closest_points(np.float32([[10, 10, 10]]))["points"].numpy()
        array([[1., 1., 0.]], dtype=float32)
        """
        points = _points(query_points)
        near = self._meshes.scene().closest_point(points, threads=as_threads(nthreads))
        found = near.prim_id >= 0
        normals = np.zeros(points.shape)
        corners = self._meshes.triangles(near.geom_id[found], near.prim_id[found])
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals[found] = cross / np.linalg.norm(cross, axis=1, keepdims=True)
        return {
            "points": _tensor(near.position, np.float32),
            "geometry_ids": _ids(near.geom_id),
            "primitive_ids": _ids(near.prim_id),
            "primitive_uvs": _tensor(np.where(found[..., None], near.uv, 0), np.float32),
            "primitive_normals": _tensor(normals, np.float32),
        }

    def compute_distance(self, query_points: ArrayLike, nthreads: int = 0) -> Tensor:
        """The distance of each point from the surface: {..} float32; inf without triangles.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> scene.add_triangles(np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), np.uint32([[0, 1, 2]]))
        0
        >>> scene.compute_distance(np.float32([[0.5, 0.25, -2]])).numpy()
        array([2.], dtype=float32)
        """
        scene, threads = self._meshes.scene(), as_threads(nthreads)
        return _tensor(scene.distance(_points(query_points), threads=threads), np.float32)

    def compute_signed_distance(
        self, query_points: ArrayLike, nthreads: int = 0, nsamples: int = 1
    ) -> Tensor:
        """The distance of each point from closed surfaces, negative inside: {..} float32.

        Args:
            query_points: {.., 3}, of any real numbers.
            nthreads: threads of this call; 0 is one a processor that this process may use.
            nsamples: odd; without effect, since no rays are sampled: sides are decided exactly.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> scene.add_triangles(corners, np.uint32([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
        0
        >>> scene.compute_signed_distance(np.float32([[0.25, 0.25, 0.125], [0.25, 0.25, -2]])).numpy()
        array([-0.125,  2.   ], dtype=float32)
        """
        _samples(nsamples)
        scene, threads = self._meshes.scene(), as_threads(nthreads)
        return _tensor(scene.signed_distance(_points(query_points), threads=threads), np.float32)

    def compute_occupancy(
        self, query_points: ArrayLike, nthreads: int = 0, nsamples: int = 1
    ) -> Tensor:
        """1 for each point inside of closed surfaces or on them, else 0: {..} float32.

        Arguments are those of :meth:`compute_signed_distance`.

        >>> import numpy as np
        >>> scene = RaycastingScene()
        >>> corners = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
        >>> scene.add_triangles(corners, np.uint32([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
        0
        >>> scene.compute_occupancy(np.float32([[0.25, 0.25, 0.125], [0.25, 0.25, -2]])).numpy()
        array([1., 0.], dtype=float32)
        """
        _samples(nsamples)
        scene, threads = self._meshes.scene(), as_threads(nthreads)
        return _tensor(scene.contains(_points(query_points), threads=threads), np.float32)

    @staticmethod
    def create_rays_pinhole(*args: Any, **kwargs: Any) -> Tensor:
        """Rays through the middles of the pixels of a pinhole camera: {height_px, width_px, 6} float32.

        Args:
            intrinsic_matrix: (3, 3), upper triangular.
            extrinsic_matrix: (4, 4), from the world to the camera.
            width_px: pixels of a row.
            height_px: rows.

        Or instead of the matrices:

        Args:
            fov_deg: horizontal field of view in degrees.
            center: (3,), the point that the camera looks at.
            eye: (3,), where the camera is.
            up: (3,), up.

        Directions reach to distance 1 along the camera's axis; the camera's y axis points along ``up``, as Open3D has
        it.

        >>> rays = RaycastingScene.create_rays_pinhole(
        ...     fov_deg=90, center=[0, 0, 0], eye=[0, 0, 2], up=[0, 1, 0], width_px=4, height_px=2)
        >>> rays.shape, rays[0, 0].numpy()
        ((2, 4, 6), array([ 0.  ,  0.  ,  2.  ,  0.75, -0.25, -1.  ], dtype=float32))
        """
        look = "fov_deg" in kwargs or (len(args) > 0 and np.ndim(_given(args[0])) == 0)
        given = _bind("create_rays_pinhole", _LOOK if look else _MATRICES, args, kwargs)
        width = as_integer(given["width_px"], "width_px", 0, 2**31 - 1)
        height = as_integer(given["height_px"], "height_px", 0, 2**31 - 1)
        if look:
            intrinsic, extrinsic = _camera(given, width, height)
        else:
            intrinsic = _matrix(given["intrinsic_matrix"], "intrinsic_matrix", (3, 3))
            extrinsic = _matrix(given["extrinsic_matrix"], "extrinsic_matrix", (4, 4))
        turn = extrinsic[:3, :3].T
        try:
            to_world = turn @ np.linalg.inv(intrinsic)
        except np.linalg.LinAlgError:
            raise ArgumentError(
                "intrinsic_matrix: expected a matrix that has an inverse", "intrinsic_matrix"
            ) from None
        rays = np.empty((height, width, 6), np.float32)
        rays[..., :3] = -turn @ extrinsic[:3, 3]
        x, y = np.arange(width) + 0.5, np.arange(height) + 0.5
        rays[..., 3:] = x[:, None] * to_world[:, 0] + y[:, None, None] * to_world[:, 1] + to_world[:, 2]
        return rays.view(Tensor)


_TRIANGLES = ("vertex_positions", "triangle_indices")
_MATRICES = ("intrinsic_matrix", "extrinsic_matrix", "width_px", "height_px")
_LOOK = ("fov_deg", "center", "eye", "up", "width_px", "height_px")


def _bind(
    function: str, names: tuple[str, ...], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> dict[str, Any]:
    """Arguments of one of several signatures by name, in its order."""
    given = {**dict(zip(names, args)), **kwargs}
    if len(args) > len(names) or set(given) != set(names) or len(args) + len(kwargs) > len(given):
        found = ", ".join([*(type(value).__name__ for value in args), *kwargs]) or "nothing"
        raise ArgumentTypeError(f"{function}: expected {', '.join(names)}; found {found}")
    return {name: given[name] for name in names}


def _given(value: Any) -> Any:
    """Tensors of Open3D as NumPy arrays; what else there is as it is."""
    if isinstance(value, np.ndarray):
        return value
    if type(value).__module__.startswith("open3d") and hasattr(value, "numpy"):
        return value.cpu().numpy() if hasattr(value, "cpu") else value.numpy()
    return value


def _of_mesh(mesh: Any) -> tuple[Any, Any]:
    """Vertices and triangles of a mesh of Open3D, or of something like it."""
    if hasattr(mesh, "vertex") and hasattr(mesh, "triangle"):
        parts: Any = []
        for holder, name in ((mesh.vertex, "positions"), (mesh.triangle, "indices")):
            parts.append(getattr(holder, name) if hasattr(holder, name) else holder[name])
        return parts[0], parts[1]
    for name in ("triangles", "faces"):
        if hasattr(mesh, "vertices") and hasattr(mesh, name):
            # Vectors of the legacy interface have no dtype while they are empty.
            vertices, faces = np.asarray(mesh.vertices), np.asarray(getattr(mesh, name))
            return vertices.reshape(-1, 3), faces.reshape(-1, 3) if faces.size else []
    raise ArgumentTypeError(
        "mesh: expected a TriangleMesh, or something with vertices and triangles, found "
        f"{type(mesh).__name__}",
        "mesh",
    )


def _rays(rays: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Origins and directions."""
    array = as_float32(np.asarray(as_array(_given(rays), "rays")))
    if array.ndim == 0 or array.shape[-1] != 6:
        raise ArgumentError(f"rays: expected an array of shape (.., 6), found {array.shape}", "rays")
    return array[..., :3], array[..., 3:]


def _points(points: ArrayLike) -> NDArray[Any]:
    array = np.asarray(as_array(_given(points), "query_points"))
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ArgumentError(
            f"query_points: expected an array of shape (.., 3), found {array.shape}", "query_points"
        )
    return array


def _samples(nsamples: int) -> None:
    if as_integer(nsamples, "nsamples", 1, 2**31 - 1) % 2 == 0:
        raise ArgumentError(f"nsamples: expected an odd number, found {nsamples}", "nsamples")


def _matrix(value: ArrayLike, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    array = as_float64(np.asarray(as_array(_given(value), name)))
    if array.shape != shape:
        raise ArgumentError(f"{name}: expected shape {shape}, found {array.shape}", name)
    return array


def _camera(
    given: dict[str, Any], width: int, height: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrices of a camera that looks at a point."""
    center, eye, up = (_matrix(given[name], name, (3,)) for name in ("center", "eye", "up"))
    angle = as_array(given["fov_deg"], "fov_deg")
    if angle.ndim != 0 or not 0 < angle < 180:
        raise ArgumentError(f"fov_deg: expected degrees from 0 to 180, found {given['fov_deg']}", "fov_deg")
    forward = center - eye
    right = np.cross(up, forward)
    if not right.any():
        raise ArgumentError("up: expected another direction than from eye to center", "up")
    rows = [right, np.cross(forward, right), forward]
    extrinsic = np.eye(4)
    extrinsic[:3, :3] = [row / np.linalg.norm(row) for row in rows]
    extrinsic[:3, 3] = -extrinsic[:3, :3] @ eye
    focal = 0.5 * width / np.tan(0.5 * np.radians(float(angle)))
    return np.array([[focal, 0, 0.5 * width], [0, focal, 0.5 * height], [0, 0, 1]]), extrinsic


def _tensor(array: NDArray[Any], dtype: DTypeLike | None = None) -> Tensor:
    return np.asarray(array, dtype).view(Tensor)


def _ids(array: NDArray[np.int32]) -> Tensor:
    """-1 becomes ``INVALID_ID``, which has the same bits."""
    return np.ascontiguousarray(array).view(np.uint32).reshape(array.shape).view(Tensor)


def _is_device(value: Any) -> bool:
    return str(value).upper().startswith(("CPU", "CUDA", "SYCL"))


def _dtype(dtype: Any) -> np.dtype[Any]:
    """A dtype of NumPy for one of either package."""
    for name in (dtype, str(dtype).lower()):
        try:
            kind: np.dtype[Any] = np.dtype(name)
        except TypeError:
            continue
        return kind
    raise ArgumentTypeError(f"dtype: expected a dtype, found {dtype!r}", "dtype")


class _Device:
    """Stands for a device of Open3D; there is the CPU alone."""

    def __init__(self, name: str = "CPU:0", index: int | None = None) -> None:
        self._name = name if index is None else f"{name}:{index}"

    def __repr__(self) -> str:
        return self._name


_DTYPES = {
    "Float32": np.float32,
    "Float64": np.float64,
    "Int8": np.int8,
    "Int16": np.int16,
    "Int32": np.int32,
    "Int64": np.int64,
    "UInt8": np.uint8,
    "UInt16": np.uint16,
    "UInt32": np.uint32,
    "UInt64": np.uint64,
    "Bool": np.bool_,
}


class _Namespace:
    """A module of Open3D: our names, then its own where it is installed, then what stands for them."""

    def __init__(self, path: str, ours: dict[str, Any], without: dict[str, Any]) -> None:
        self._path, self._ours, self._without = path, ours, without

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _look_up(self._path, name, self._ours, self._without)

    def __repr__(self) -> str:
        return f"<{self._path} of ropewalk.compat>"


def _look_up(path: str, name: str, ours: dict[str, Any], without: dict[str, Any]) -> Any:
    if name in ours:
        return ours[name]
    try:
        module: Any = importlib.import_module("open3d")
    except ImportError:
        if name in without:
            return without[name]
        raise AttributeError(
            f"{path}.{name} is Open3D's own, and Open3D is not installed"
        ) from None
    for part in path.split(".")[1:]:
        module = getattr(module, part)
    return getattr(module, name)


#: ``o3d.core``.
core = _Namespace(
    "open3d.core",
    {},
    {
        "Tensor": Tensor,
        "Device": _Device,
        "Dtype": _Namespace("open3d.core.Dtype", dict(_DTYPES), {}),
        **_DTYPES,
        **{name.lower(): kind for name, kind in _DTYPES.items()},
    },
)

#: ``o3d.t``.
t = _Namespace(
    "open3d.t",
    {"geometry": _Namespace("open3d.t.geometry", {"RaycastingScene": RaycastingScene}, {})},
    {},
)


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    return _look_up("open3d", name, {}, {})
