"""Results of queries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import RopewalkError
from ._ropewalk import DoubleCore, cells_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._ropewalk import Core, DoubleRays, Rays

_SURFACE = ("uv", "normal", "position")


class _Surface:
    """What hits of both kinds have in common: surface data worked out when it is asked for."""

    __slots__ = ("_core", "_normal", "_position", "_rays", "_threads", "_uv", "geom_id", "prim_id", "t")

    t: NDArray[np.float32] | NDArray[np.float64]
    prim_id: NDArray[np.int32]
    geom_id: NDArray[np.int32]
    _core: Any
    _rays: Any
    _threads: int

    def _ray_ids(self) -> NDArray[np.int64] | None:
        return None

    def _look(self, *what: str) -> list[NDArray[Any]]:
        """Surface data by name, all that is not yet known in one pass over the hits."""
        kept: dict[str, Any] = {name: getattr(self, f"_{name}", None) for name in what}
        missing = [name for name, values in kept.items() if values is None]
        if missing:
            assert self._core is not None and self._rays is not None
            t, prim, geom = np.ravel(self.t), np.ravel(self.prim_id), np.ravel(self.geom_id)
            found, lost = self._core.surface(
                missing, self._rays, t, prim, geom, self._threads, self._ray_ids()
            )
            if lost:
                raise RopewalkError(
                    f"{lost} of the hits are not on their rays any more: origins, directions or results "
                    f"were written to after the query; read .{missing[0]} before, or hand over copies"
                )
            for name, values in zip(missing, found):
                kept[name] = values.reshape(*self.t.shape, values.shape[1])
                if name in _SURFACE:
                    setattr(self, f"_{name}", kept[name])
        return [kept[name] for name in what]

    @property
    def uv(self) -> NDArray[Any]:
        """Barycentric weights of vertices 1 and 2, shape (..., 2); NaN for a miss.

        A hit is at ``(1 - u - v) * v0 + u * v1 + v * v2`` (Embree's order). On a quad they run from (0, 0) at vertex
        0 over (1, 0) at vertex 1 and (1, 1) at vertex 2 to (0, 1) at vertex 3, as Embree's do, linear on each of its
        triangles: the hit is at ``(1 - u) * v0 + (u - v) * v1 + v * v2`` where ``u >= v``, else at
        ``(1 - v) * v0 + u * v2 + (v - u) * v3``. Both are 0 on spheres, cones, polygons and patches. Worked out
        when first asked for, from the arrays of the query.
        """
        return self._look("uv")[0]

    @property
    def normal(self) -> NDArray[Any]:
        """Unit normals of the surface, shape (..., 3); NaN for a miss.

        They point to the side from which the vertices run counter-clockwise, whichever side was hit; of a quad that
        is not flat it is the triangle's that was hit. Those of spheres and cones point outwards.
        """
        return self._look("normal")[0]

    @property
    def position(self) -> NDArray[Any]:
        """Points of the hits, shape (..., 3); NaN for a miss.

        On triangles and quads from their vertices, which is nearer to the surface than ``origin + t * direction`` in
        float32; worked out in float64 and rounded once.
        """
        return self._look("position")[0]

    def __getstate__(self) -> dict[str, Any]:
        """Pickled without the scene: surface data is worked out first."""
        self._look(*_SURFACE)
        names = [name for kind in type(self).__mro__ for name in getattr(kind, "__slots__", ())]
        state = {name: getattr(self, name) for name in names if hasattr(self, name)}
        return {**state, "_core": None, "_rays": None}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            setattr(self, name, value)


class Hits(_Surface):
    """The nearest hit of each ray, in arrays of the rays' shape.

    Attributes:
        t: parameter of the hit in lengths of the ray's direction; inf for a miss. float32, like all that is
            not an id, or float64 in a scene of double precision.
        prim_id: int32, primitive within its mesh; -1 for a miss.
        geom_id: int32, mesh; -1 for a miss.

    >>> import ropewalk
    >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> hits = scene.closest_hit([[0.25, 0.5, 2.0], [5.0, 5.0, 2.0]], [0, 0, -1])
    >>> hits.hit, hits.prim_id
    (array([ True, False]), array([ 0, -1], dtype=int32))
    >>> hits.uv[0], hits.normal[0]
    (array([0.25, 0.5 ], dtype=float32), array([0., 0., 1.], dtype=float32))
    >>> hits.position[hits.hit]
    array([[0.25, 0.5 , 0.  ]], dtype=float32)
    """

    __slots__ = ("_cell",)

    @property
    def cell(self) -> NDArray[np.int64]:
        """The cells of the scene in which the hits are, for ``start=`` of later queries; -1 for a miss.

        They are hints, good for the scene that was hit: another cell, or one of another scene, changes no
        answer. Worked out when first asked for; results that were pickled before have -1, and those of scenes of
        double precision.
        """
        kept: NDArray[np.int64] | None = getattr(self, "_cell", None)
        if kept is not None:
            return kept
        if self._core is None or isinstance(self._core, DoubleCore):
            return np.full(self.t.shape, -1, np.int64)
        points = self.position.astype(np.float64).reshape(-1)
        self._cell = cells_of(self._core, points, self._threads).reshape(self.t.shape)
        return self._cell

    @property
    def hit(self) -> NDArray[np.bool_]:
        """True where the ray hits something."""
        return self.prim_id >= 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the rays."""
        return self.t.shape

    def __len__(self) -> int:
        """Length of the first axis of the rays.

        Raises:
            TypeError: for a single ray, as for a NumPy scalar.
        """
        return len(self.t)

    def __repr__(self) -> str:
        found = int(np.count_nonzero(self.hit))
        span = ""
        if found:
            span = f", t {self.t.min():.6g} to {self.t[self.hit].max():.6g}"
        return f"<ropewalk.Hits of {self.t.size:,} rays, shape {self.shape}: {found:,} hits{span}>"


class HitLists(_Surface):
    """Hits of each ray in order of ``(t, geom_id, prim_id)``, each once, in compressed rows.

    Those of ray ``i``, counted in C order, are ``offsets[i]:offsets[i + 1]`` in all other arrays.

    Attributes:
        offsets: int64, one more than there are rays.
        t: float32 or float64 (see :class:`Hits`), parameters in lengths of the ray's direction.
        prim_id: int32, primitives within their meshes.
        geom_id: int32, meshes.
        shape: shape of the rays.

    >>> import ropewalk
    >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
    >>> scene = ropewalk.Scene(v, [[0, 1, 2], [3, 4, 5]])
    >>> all = scene.all_hits([[0.2, 0.2, 3.0], [5.0, 5.0, 3.0]], [0, 0, -1])
    >>> all.offsets, all.t, all.prim_id
    (array([0, 2, 2]), array([2., 3.], dtype=float32), array([1, 0], dtype=int32))
    >>> all.counts
    array([2, 0])
    """

    __slots__ = ("_ray_id", "offsets", "shape")

    offsets: NDArray[np.int64]
    shape: tuple[int, ...]

    def _ray_ids(self) -> NDArray[np.int64] | None:
        return self.ray_id

    @property
    def ray_id(self) -> NDArray[np.int64]:
        """Ray of each hit, counted in C order; made when first asked for."""
        kept: NDArray[np.int64] | None = getattr(self, "_ray_id", None)
        if kept is None:
            rays = np.arange(len(self.offsets) - 1, dtype=np.int64)
            kept = self._ray_id = np.repeat(rays, np.diff(self.offsets))
        return kept

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of hits of each ray, in the rays' shape."""
        return np.diff(self.offsets).reshape(self.shape)

    def __len__(self) -> int:
        """Number of hits in all."""
        return len(self.t)

    def __repr__(self) -> str:
        rays = len(self.offsets) - 1
        most = int(np.diff(self.offsets).max()) if rays else 0
        return (
            f"<ropewalk.HitLists of {rays:,} rays, shape {self.shape}: {len(self.t):,} hits, "
            f"{most:,} at most on a ray>"
        )


def make_hits(
    core: Core | DoubleCore,
    rays: Rays | DoubleRays,
    threads: int,
    shape: tuple[int, ...],
    arrays: tuple[np.ndarray, ...],
) -> Hits:
    """Hits of arrays in order of the rays."""
    hits = Hits()
    hits._core, hits._rays, hits._threads = core, rays, threads
    hits.t, hits.prim_id, hits.geom_id = (array.reshape(shape) for array in arrays)
    return hits


def make_lists(
    core: Core | DoubleCore,
    rays: Rays | DoubleRays,
    threads: int,
    shape: tuple[int, ...],
    arrays: tuple[np.ndarray, ...],
) -> HitLists:
    """Lists of offsets and arrays of hits."""
    lists = HitLists()
    lists._core, lists._rays, lists._threads = core, rays, threads
    lists.shape = shape
    lists.offsets, lists.t, lists.prim_id, lists.geom_id = arrays
    return lists
