"""A drop-in for the ray intersectors of trimesh (``trimesh.ray.ray_pyembree`` and ``trimesh.ray.ray_triangle``).

>>> from types import SimpleNamespace
>>> from ropewalk.compat.trimesh import RayMeshIntersector
>>> mesh = SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]])
>>> mesh.ray = RayMeshIntersector(mesh)  # a Trimesh takes it just so
>>> mesh.ray.intersects_first([[0.2, 0.2, 1], [2, 2, 1]], [[0, 0, -1], [0, 0, -1]])
array([ 0, -1])

trimesh itself is not needed. What differs from it is in docs/coming-from.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .._arrays import ArrayLike, as_array, as_faces, as_float64, as_integer, as_rows
from .._errors import ArgumentError, ArgumentTypeError
from .._scene import Scene
from ._lazy import SAME_PLACE, first_of_places

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["RayMeshIntersector"]


class RayMeshIntersector:
    """Rays and points asked of a mesh, with trimesh's names and orders of results.

    Args:
        geometry: a ``trimesh.Trimesh``, or anything with ``vertices`` (V, 3) and ``faces`` (F, 3), or with
            ``triangles`` (F, 3, 3). Kept as ``mesh``. Its tree is built when it is first asked, and again
            after the mesh has changed: by ``hash(mesh)`` where its class defines one, as trimesh's do, else by
            its numbers.
        scale_to_box: without effect: rays are answered in float64, at any scale.

    Directions may have any length. Results are in order of rays, and along each ray in order of distance. Of
    several faces that a ray meets at one place (on an edge, or coincident) the first in order is named, once.

    Raises:
        ArgumentError: (ValueError) arrays of wrong shapes, origins and directions that do not match, vertices
            that are not finite, faces that name no vertex.
        ArgumentTypeError: (TypeError) arrays that are no real numbers, a mesh without triangles.

    Rays that are NaN, infinite or without direction miss, and an ``InvalidRayWarning`` counts them.

    >>> from types import SimpleNamespace
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> ray = RayMeshIntersector(SimpleNamespace(vertices=square, faces=[[0, 1, 2], [0, 2, 3]]))
    >>> ray.intersects_id([[0.5, 0.5, 1]], [[0, 0, -1]])  # through the diagonal
    (array([0]), array([0]))
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True) -> None:
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._built: tuple[Any, Scene] | None = None

    @property
    def scene(self) -> Scene:
        """The :class:`ropewalk.Scene` that answers, in double precision."""
        of_class: Any = type(self.mesh).__hash__
        known = of_class is not None and of_class is not object.__hash__
        if known and self._built is not None and self._built[0] == hash(self.mesh):
            return self._built[1]
        vertices, faces = _arrays(self.mesh)
        if not known and self._built is not None:
            before = self._built[0]
            if np.array_equal(before[0], vertices) and np.array_equal(before[1], faces):
                return self._built[1]
        scene = Scene(vertices, faces, precision="double")
        self._built = (hash(self.mesh) if known else (vertices.copy(), faces.copy())), scene
        return scene

    def intersects_location(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        **kwargs: Any,
    ) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """Where rays meet the surface.

        Args:
            ray_origins: shape (n, 3), or (3,) for one ray.
            ray_directions: of the same shape.
            multiple_hits: all places along each ray, else the first alone.
            kwargs: ``max_hits`` as in :meth:`intersects_id`; here there is no limit unless it is given.

        Returns:
            locations (m, 3) float64, index_ray (m,) int64, index_tri (m,) int64.

        >>> from types import SimpleNamespace
        >>> ray = RayMeshIntersector(SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]]))
        >>> ray.intersects_location([[0.25, 0.5, 1]], [[0, 0, -2]])
        (array([[0.25, 0.5 , 0.  ]]), array([0]), array([0]))
        """
        limit = kwargs.pop("max_hits", None)
        if kwargs:
            raise ArgumentTypeError(f"expected no argument {next(iter(kwargs))!r}", next(iter(kwargs)))
        found = self._hits(ray_origins, ray_directions, multiple_hits, limit, True)
        return found[2], found[1], found[0]

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> Any:
        """Which triangles rays meet.

        Args:
            ray_origins: shape (n, 3), or (3,) for one ray.
            ray_directions: of the same shape.
            multiple_hits: all places along each ray, else the first alone.
            max_hits: so many places of each ray at most, the nearest.
            return_locations: also where.

        Returns:
            index_tri (m,) int64, index_ray (m,) int64, and locations (m, 3) float64 if asked for.

        The order of arguments is that of ``ray_pyembree``; ``ray_triangle`` has ``return_locations`` third.

        >>> from types import SimpleNamespace
        >>> ray = RayMeshIntersector(SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]]))
        >>> ray.intersects_id([[5, 5, 1], [0.25, 0.5, 1]], [[0, 0, -1], [0, 0, -1]], return_locations=True)
        (array([0]), array([1]), array([[0.25, 0.5 , 0.  ]]))
        """
        limit = as_integer(max_hits, "max_hits", 0, 2**63 - 1)
        return self._hits(ray_origins, ray_directions, multiple_hits, limit, return_locations)

    def intersects_first(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, **kwargs: Any
    ) -> NDArray[np.int64]:
        """The triangle that each ray meets first: (n,) int64, -1 for a miss.

        Arguments are those of :meth:`intersects_id`; further ones are ignored.

        >>> from types import SimpleNamespace
        >>> ray = RayMeshIntersector(SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]]))
        >>> ray.intersects_first([[0.25, 0.5, 1]], [[0, 0, 1]])
        array([-1])
        """
        origins, directions = _rays(ray_origins, ray_directions)
        return self.scene.closest_hit(origins, directions).prim_id.astype(np.int64)

    def intersects_any(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, **kwargs: Any
    ) -> NDArray[np.bool_]:
        """Whether each ray meets the mesh: (n,) bool, in agreement with :meth:`intersects_first`.

        >>> from types import SimpleNamespace
        >>> ray = RayMeshIntersector(SimpleNamespace(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0]], faces=[[0, 1, 2]]))
        >>> ray.intersects_any([[0.25, 0.5, 1]], [[0, 0, -1]])
        array([ True])
        """
        return self.scene.occluded(*_rays(ray_origins, ray_directions))

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether each point is inside of a closed mesh: (n,) bool; exact, and True on the surface.

        Args:
            points: shape (n, 3), or (3,) for one point.

        Raises:
            ArgumentError: (ValueError) points of another shape.

        >>> from types import SimpleNamespace
        >>> v, f = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
        >>> RayMeshIntersector(SimpleNamespace(vertices=v, faces=f)).contains_points([[0.1, 0.1, 0.1], [1, 1, 1]])
        array([ True, False])
        """
        return self.scene.contains(_rows(points, "points"))

    def _hits(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool,
        limit: int | None,
        locations: bool,
    ) -> Any:
        """Triangles, rays and, if asked for, locations."""
        scene = self.scene
        o, d = _rays(ray_origins, ray_directions)
        if not multiple_hits and limit != 0:
            nearest = scene.closest_hit(o, d)
            hit = nearest.hit
            found = nearest.prim_id[hit].astype(np.int64), np.flatnonzero(hit)
            return (*found, nearest.position[hit]) if locations else found
        lists = scene.all_hits(o, d) if limit is None else scene.first_hits(o, d, limit)
        keep = first_of_places(lists, _slack(scene, o, d))
        parts = [(lists, keep, np.arange(len(o)))]
        # Rays whose list was cut before it had so many places ask again, for twice as many hits.
        asked = limit or 0
        while limit is not None:
            lists, keep, rays = parts[-1]
            full = lists.counts == asked
            full &= np.bincount(lists.ray_id[keep], minlength=len(rays)) < limit
            if not full.any() or not asked:
                break
            keep &= ~full[lists.ray_id]
            asked *= 2
            again = rays[full]
            lists = scene.first_hits(o[again], d[again], asked)
            parts.append((lists, first_of_places(lists, _slack(scene, o[again], d[again])), again))
        tri = np.concatenate([part.prim_id[keep] for part, keep, _ in parts]).astype(np.int64)
        ray = np.concatenate([rays[part.ray_id[keep]] for part, keep, rays in parts])
        where = np.concatenate([part.position[keep] for part, keep, _ in parts]) if locations else None
        if len(parts) > 1:
            order = np.argsort(ray, kind="stable")
            tri, ray = tri[order], ray[order]
            where = where[order] if where is not None else None
        if limit is not None and len(ray):
            starts = np.flatnonzero(np.diff(ray, prepend=-1))
            rank = np.arange(len(ray)) - np.repeat(starts, np.diff(starts, append=len(ray)))
            tri, ray = tri[rank < limit], ray[rank < limit]
            where = where[rank < limit] if where is not None else None
        return (tri, ray, where) if locations else (tri, ray)

    def __getstate__(self) -> dict[str, Any]:
        """Pickled without the tree, which is built again."""
        return {"mesh": self.mesh, "_scale_to_box": self._scale_to_box, "_built": None}

    def __copy__(self) -> RayMeshIntersector:
        return type(self)(self.mesh, self._scale_to_box)

    def __deepcopy__(self, memo: dict[int, Any]) -> RayMeshIntersector:
        """As trimesh does: of the same mesh."""
        return self.__copy__()


def _arrays(mesh: Any) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of a mesh."""
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        vertices = np.asarray(as_rows(mesh.vertices, "geometry.vertices"))
        return vertices, np.asarray(as_faces(mesh.faces, "geometry.faces", len(vertices)))
    if hasattr(mesh, "triangles"):
        triangles = np.asarray(as_array(mesh.triangles, "geometry.triangles"))
        if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
            raise ArgumentError(
                f"geometry.triangles: expected an array of shape (F, 3, 3), found {triangles.shape}",
                "geometry",
            )
        count = len(triangles)
        return triangles.reshape(-1, 3), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    raise ArgumentTypeError(
        f"geometry: expected something with vertices and faces, or triangles, found {type(mesh).__name__}",
        "geometry",
    )


def _rows(value: ArrayLike, argument: str) -> NDArray[np.float64]:
    """Shape (n, 3); one row for (3,)."""
    array = np.asarray(as_array(value, argument))
    return as_float64(as_rows(array.reshape(1, 3) if array.shape == (3,) else array, argument))


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions of the same shape (n, 3)."""
    o, d = _rows(origins, "ray_origins"), _rows(directions, "ray_directions")
    if o.shape != d.shape:
        raise ArgumentError(
            f"Ray origin and direction don't match! Expected ray_directions of shape {o.shape}, found {d.shape}",
            "ray_directions",
        )
    return o, d


def _slack(scene: Scene, o: np.ndarray, d: np.ndarray) -> NDArray[np.float64]:
    """By how much parameters of one place may differ, for each ray."""
    low, high = scene.bounds.astype(np.float64)
    with np.errstate(all="ignore"):
        far = np.linalg.norm(np.maximum(np.abs(o - low), np.abs(o - high)), axis=1)
        slack = SAME_PLACE * far / np.linalg.norm(d, axis=1)
    return np.where(np.isfinite(slack), slack, 0.0)
