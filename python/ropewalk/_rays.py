"""What rays are asked."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import prod
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arrays import (
    ArrayLike,
    as_array,
    as_choice,
    as_float32,
    as_float64,
    as_integer,
    as_masks,
    as_points,
    as_threads,
    per_ray,
)
from ._errors import ArgumentError, ArgumentTypeError, InvalidRayError, InvalidRayWarning
from ._hits import HitLists, Hits, make_hits, make_lists
from ._ropewalk import DoubleCore, DoubleRays, Rays

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._ropewalk import Core

#: Up to so many rays are answered on the calling thread: waking others would take longer.
_FEW_RAYS = 2048


#: Origins and directions, and where rays end.
RaySample = tuple[ArrayLike, ArrayLike] | tuple[ArrayLike, ArrayLike, ArrayLike]


class RayMethods:
    """What :class:`Scene` has to do with rays."""

    __slots__ = ()

    _core: Core | DoubleCore
    _starts: NDArray[np.int64]

    def closest_hit(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        start: ArrayLike | Hits | None = None,
        faces: str = "both",
        threads: int = 0,
        strict: bool = False,
    ) -> Hits:
        """The nearest hit of each ray.

        Args:
            origins: shape (..., 3), any numeric dtype, rounded to float32 unless the scene is of double
                precision. Contiguous arrays of that dtype are read where they are.
            directions: shape (..., 3), of any length but 0; shapes broadcast, so that one origin
                serves many directions.
            t_min: smallest accepted parameter, in lengths of the direction: a number, or one a ray.
            t_max: largest accepted parameter; both ends are included.
            masks: 32 bits for all rays or a ray; see :meth:`from_meshes`.
            skip: a primitive that each ray ignores, all of it, usually the one that it leaves: ``prim_id`` of a
                scene of one mesh, a pair ``(prim_id, geom_id)``, or the :class:`Hits` that the rays
                start at. -1 ignores nothing.
            start: cells from which the rays may be walked: ``hits.cell`` of the hits that they start at,
                those hits, or ``walker.cell``. A hint for short rays, used where it pays: it changes no
                answer, also if it is wrong.
            faces: which sides are hit: ``"both"``, ``"front"``, the side from which vertices run
                counter-clockwise, or ``"back"``; rays pass through the other one. Scenes of triangles and
                quads alone have a choice.
            threads: threads of this call; 0 is one a processor that this process may use.
            strict: refuse rays that can hit nothing, instead of counting them in a warning.

        Of hits at equal ``t`` the answer is the one with the lowest ``geom_id``, then ``prim_id``.
        A ray whose ``t_min`` exceeds its ``t_max``, and one that is NaN, infinite or without
        direction, misses. Arrays must not be written to while a query runs.

        Raises:
            ArgumentError: shapes that do not fit each other.
            ArgumentTypeError: arrays that are no real numbers.
            InvalidRayError: with ``strict``, the first such ray.
            KeyboardInterrupt: Ctrl-C stops a query within a fraction of a second.

        The tree is walked after Havran (1997), many rays at a time; triangles are tested after Woop,
        Benthin and Wald (2013), so that no ray passes between two that share an edge.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.closest_hit([[0.2, 0.2, 1], [0.2, 0.2, -1]], [0, 0, 1]).t
        array([inf,  1.], dtype=float32)
        >>> bool(scene.closest_hit([0.2, 0.2, -1], [0, 0, 1], t_max=0.5).hit)
        False
        """
        rays, shape, threads = self._rays(
            origins, directions, t_min, t_max, masks, skip, faces, threads, strict
        )
        t, prim, geom, invalid, first = self._core.closest_hit(
            rays, threads, _cells(start, shape)
        )
        _warn(invalid, first)
        return make_hits(self._core, rays, threads, shape, (t, prim, geom))

    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        start: ArrayLike | Hits | None = None,
        faces: str = "both",
        threads: int = 0,
        strict: bool = False,
    ) -> NDArray[np.bool_]:
        """Whether each ray hits anything: bool, in the rays' shape.

        Arguments and errors are those of :meth:`closest_hit`; it agrees with ``closest_hit(...).hit``.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.occluded([[0.2, 0.2, 1], [2, 2, 1]], [0, 0, -1])
        array([ True, False])
        """
        rays, shape, threads = self._rays(
            origins, directions, t_min, t_max, masks, skip, faces, threads, strict
        )
        hit, invalid, first = self._core.occluded(rays, threads, _cells(start, shape))
        _warn(invalid, first)
        return hit.reshape(shape)

    def all_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        faces: str = "both",
        threads: int = 0,
        strict: bool = False,
    ) -> HitLists:
        """Every hit of each ray, in order; each primitive at most once, where the ray first hits it.

        Where a ray meets an edge or a vertex exactly, each crossing of the surface there is listed once, not each
        triangle, so that closed surfaces are entered as often as they are left.

        Arguments and errors are those of :meth:`closest_hit`.

        Raises:
            OutOfMemoryError: the hits do not fit into memory; :meth:`count_hits` says how many there
                are.

        >>> import ropewalk
        >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
        >>> scene = ropewalk.Scene(v, [[0, 1, 2], [3, 4, 5]])
        >>> scene.all_hits([0.2, 0.2, -1], [0, 0, 1]).t
        array([1., 2.], dtype=float32)
        """
        return self._lists(
            None, origins, directions, t_min, t_max, masks, skip, faces, threads, strict
        )

    def first_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        k: int,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        faces: str = "both",
        threads: int = 0,
        strict: bool = False,
    ) -> HitLists:
        """The first ``k`` hits of each ray, in order, each once: the beginnings of :meth:`all_hits`.

        Arguments and errors are those of :meth:`closest_hit`; ``k`` is 0 or more.

        >>> import ropewalk
        >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]
        >>> scene = ropewalk.Scene(v, [[0, 1, 2], [3, 4, 5]])
        >>> scene.first_hits([0.2, 0.2, -1], [0, 0, 1], 1).t
        array([1.], dtype=float32)
        """
        k = as_integer(k, "k", 0, 2**63 - 1)
        return self._lists(k, origins, directions, t_min, t_max, masks, skip, faces, threads, strict)

    def count_hits(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike = 0.0,
        t_max: ArrayLike = np.inf,
        *,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        faces: str = "both",
        threads: int = 0,
        strict: bool = False,
    ) -> NDArray[np.int32]:
        """The number of hits that :meth:`all_hits` lists for each ray: int32, in the rays' shape.

        Arguments and errors are those of :meth:`closest_hit`; it agrees with ``all_hits(...).counts``.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
        >>> scene.count_hits([[0.2, 0.2, 1], [2, 2, 1]], [0, 0, -1])
        array([2, 0], dtype=int32)
        """
        rays, shape, threads = self._rays(
            origins, directions, t_min, t_max, masks, skip, faces, threads, strict
        )
        counts, invalid, first = self._core.count_hits(rays, threads)
        _warn(invalid, first)
        return counts.reshape(shape)

    def _lists(
        self,
        k: int | None,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike,
        t_max: ArrayLike,
        masks: ArrayLike | None,
        skip: Any,
        faces: str,
        threads: int,
        strict: bool,
    ) -> HitLists:
        rays, shape, threads = self._rays(
            origins, directions, t_min, t_max, masks, skip, faces, threads, strict
        )
        offsets, t, prim, geom, invalid, first = self._core.first_hits(rays, threads, k)
        _warn(invalid, first, stacklevel=4)
        return make_lists(self._core, rays, threads, shape, (offsets, t, prim, geom))

    def _rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        t_min: ArrayLike,
        t_max: ArrayLike,
        masks: ArrayLike | None,
        skip: Any,
        faces: str,
        threads: int,
        strict: bool,
    ) -> tuple[Any, tuple[int, ...], int]:
        o, d = as_points(origins, "origins"), as_points(directions, "directions")
        try:
            shape = np.broadcast_shapes(o.shape[:-1], d.shape[:-1])
        except ValueError:
            raise ArgumentError(
                f"directions: expected a shape that fits that of origins, {o.shape}; "
                f"found {d.shape}",
                "directions",
            ) from None
        count = 1
        for length in shape:
            count *= length
        sides = as_choice(faces, "faces", ("both", "front", "back"))
        if sides != "both" and self._core.has_shapes:
            # A sphere has a hit of each side, of which queries know the first.
            raise ArgumentError(
                f"faces: expected 'both' for a scene of other primitives than triangles, found {faces!r}",
                "faces",
            )
        double = isinstance(self._core, DoubleCore)
        kind, as_float = (DoubleRays, as_float64) if double else (Rays, as_float32)
        rays = kind(
            count,
            _points(o, shape, as_float),
            _points(d, shape, as_float),
            as_float(per_ray(as_array(t_min, "t_min"), shape, "t_min")),
            as_float(per_ray(as_array(t_max, "t_max"), shape, "t_max")),
            None if masks is None else per_ray(as_masks(masks, "masks"), shape, "masks"),
            None if skip is None else self._skip(skip, shape),
            sides,
        )
        if strict and (index := rays.first_invalid()) is not None:
            reason = _why(o, d, t_min, t_max, shape, index, double)
            raise InvalidRayError(f"ray {index} can hit nothing: {reason}", "rays", index)
        threads = as_threads(threads)
        return rays, shape, 1 if count <= _FEW_RAYS else threads

    def _skip(self, skip: Any, shape: tuple[int, ...]) -> NDArray[np.int32]:
        """Primitives to ignore, numbered through all meshes; -1 for none."""
        geometry: np.ndarray | None = None
        if isinstance(skip, Hits):
            primitive, geometry = skip.prim_id, skip.geom_id
        elif isinstance(skip, tuple) and len(skip) == 2:
            primitive, geometry = as_array(skip[0], "skip[0]"), as_array(skip[1], "skip[1]")
        else:
            primitive = as_array(skip, "skip")
        if len(self._starts) != 2 and geometry is None and np.any(primitive >= 0):
            raise ArgumentError(
                f"skip: expected a pair (prim_id, geom_id), since the scene has "
                f"{len(self._starts) - 1} meshes; found primitives alone",
                "skip",
            )
        if geometry is None:
            geometry = np.where(primitive < 0, -1, 0)
        for name, array in (("skip", primitive), ("skip", geometry)):
            if array.dtype.kind == "f" and array.size:
                raise ArgumentTypeError(
                    f"{name}: expected integers, found dtype {array.dtype}", name
                )
        try:
            primitive, geometry = np.broadcast_arrays(primitive, geometry)
        except ValueError:
            raise ArgumentError(
                f"skip: expected shapes that fit each other, found {primitive.shape} and "
                f"{geometry.shape}",
                "skip",
            ) from None
        sizes = np.diff(self._starts)
        none = (primitive < 0) | (geometry < 0)
        known = geometry < len(sizes)
        mesh = np.where(none | ~known, 0, geometry).astype(np.int64)
        if len(sizes):
            known &= primitive < sizes[mesh]
        wrong = ~none & ~known
        if wrong.any():
            index = int(np.argmax(wrong.reshape(-1)))
            raise ArgumentError(
                f"skip: primitive {primitive.reshape(-1)[index]} of mesh "
                f"{geometry.reshape(-1)[index]} is not in the scene (ray {index})",
                "skip",
                index,
            )
        numbered = np.where(none, -1, self._starts[mesh] + np.where(none, 0, primitive))
        return per_ray(numbered.astype(np.int32), shape, "skip")


def _cells(start: Any, shape: tuple[int, ...]) -> NDArray[np.int64] | None:
    """Cells to start from: one for all rays or one a ray; numbers of no cell are none."""
    if start is None:
        return None
    cells = as_array(start.cell if isinstance(start, Hits) else start, "start")
    if cells.dtype.kind == "f" and cells.size:
        raise ArgumentTypeError(f"start: expected integers, found dtype {cells.dtype}", "start")
    if cells.dtype == np.uint64:
        cells = np.minimum(cells, np.uint64(2**63 - 1))
    return np.ascontiguousarray(per_ray(cells, shape, "start"), np.int64)


def as_sample(rays: RaySample | None, kind: Any, stacklevel: int) -> Any:
    """The rays of a sample."""
    if rays is None:
        return None
    if not isinstance(rays, (tuple, list)) or len(rays) not in (2, 3):
        found = f"{len(rays)} of them" if isinstance(rays, (tuple, list)) else type(rays).__name__
        raise ArgumentTypeError(
            f"rays: expected a tuple (origins, directions) or (origins, directions, t_max), found {found}",
            "rays",
        )
    o, d = as_points(rays[0], "rays[0]"), as_points(rays[1], "rays[1]")
    try:
        shape = np.broadcast_shapes(o.shape[:-1], d.shape[:-1])
    except ValueError:
        raise ArgumentError(
            f"rays: expected origins and directions of shapes that fit, found {o.shape} and {d.shape}",
            "rays",
        ) from None
    as_float = as_float64 if kind is DoubleRays else as_float32
    t_max = per_ray(as_array(rays[2] if len(rays) == 3 else np.inf, "rays[2]"), shape, "rays[2]")
    made = kind(
        prod(shape),
        _points(o, shape, as_float),
        _points(d, shape, as_float),
        as_float(np.zeros(1)),
        as_float(t_max),
    )
    invalid, first = made.invalid()
    if invalid:
        warnings.warn(
            f"rays: {invalid} rays have NaN or infinite numbers or no direction and are left out of the "
            f"sample; the first is ray {first}",
            InvalidRayWarning,
            stacklevel=stacklevel,
        )
    return made


def _points(
    array: np.ndarray, shape: tuple[int, ...], as_float: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Coordinates of one point for all rays or of one a ray, flat."""
    if array.shape[:-1] != shape and array.size != 3:
        array = np.broadcast_to(array, (*shape, 3))
    return as_float(array).reshape(-1)


def _warn(invalid: int, first: int, stacklevel: int = 3) -> None:
    if invalid:
        warnings.warn(
            f"{invalid} rays have NaN or infinite numbers or no direction and miss; the first is "
            f"ray {first}",
            InvalidRayWarning,
            stacklevel=stacklevel,
        )


def _why(
    o: np.ndarray,
    d: np.ndarray,
    t_min: ArrayLike,
    t_max: ArrayLike,
    shape: tuple[int, ...],
    i: int,
    double: bool,
) -> str:
    as_float, name = (as_float64, "float64") if double else (as_float32, "float32")
    origin = as_float(np.broadcast_to(o, (*shape, 3)).reshape(-1, 3)[i])
    direction = as_float(np.broadcast_to(d, (*shape, 3)).reshape(-1, 3)[i])
    low = as_float(np.broadcast_to(np.asarray(t_min), shape).reshape(-1)[i])
    high = as_float(np.broadcast_to(np.asarray(t_max), shape).reshape(-1)[i])
    if not np.isfinite(origin).all():
        return f"its origin is {origin}; expected finite numbers within the range of {name}"
    if not np.isfinite(direction).all():
        return f"its direction is {direction}; expected finite numbers within the range of {name}"
    if not direction.any():
        return f"its direction is zero in {name}; expected any other length"
    return f"its range is {low} to {high}; expected t_min <= t_max"
