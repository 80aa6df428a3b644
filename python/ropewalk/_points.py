"""Points: nearest triangle, inside or outside, winding numbers, cells."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ._arrays import ArrayLike, as_array, as_points, as_threads
from ._errors import ArgumentError, ArgumentTypeError, InvalidPointError, InvalidPointWarning
from ._report import plural
from ._ropewalk import DoubleCore, Points

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ._ropewalk import Core

#: Up to so many points are answered on the calling thread.
_FEW_POINTS = 512


class ClosestPoints(NamedTuple):
    """The nearest face of each point, in arrays of the points' shape.

    Attributes:
        distance: float64; inf without triangles, NaN for a point that is none.
        prim_id: int32, face within its mesh, of those equally near the first; -1 without one.
        geom_id: int32, mesh; -1 without one.
        position: float64, shape (..., 3), the nearest point of the face; NaN without one.
        uv: float64, shape (..., 2), weights of the triangle's vertices 1 and 2 there (Embree's order), on quads as
            those of :attr:`Hits.uv`.

    >>> import ropewalk
    >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> nearest = scene.closest_point([[0.25, 0.5, 2.0], [-3.0, 0.0, 4.0]])
    >>> nearest.distance, nearest.uv[0]
    (array([2., 5.]), array([0.25, 0.5 ]))
    """

    distance: NDArray[np.float64]
    prim_id: NDArray[np.int32]
    geom_id: NDArray[np.int32]
    position: NDArray[np.float64]
    uv: NDArray[np.float64]

    def __repr__(self) -> str:
        shape = self.distance.shape
        return f"<ropewalk.ClosestPoints of {self.distance.size:,} points, shape {shape}>"


class Cells(NamedTuple):
    """Leaves of a scene's tree.

    Attributes:
        cell: int64, their numbers, which mean nothing to other scenes.
        bounds: float32, shape (..., 2, 3), lower and upper corners; NaN for what is no leaf. Of a scene of
            double precision float64, rounded: the tree has numbers of its own.
        primitives: int32, how many each leaf refers to; -1 for what is no leaf.
    """

    cell: NDArray[np.int64]
    bounds: NDArray[np.float32] | NDArray[np.float64]
    primitives: NDArray[np.int32]

    def __repr__(self) -> str:
        empty = int((self.primitives == 0).sum())
        return f"<ropewalk.Cells: {plural(self.cell.size, 'leaf', 'leaves')}, {empty:,} empty>"


class PointMethods:
    """What a scene answers about points."""

    __slots__ = ()

    _core: Core | DoubleCore
    _points: Points | None

    def closest_point(
        self, points: ArrayLike, *, threads: int = 0, strict: bool = False
    ) -> ClosestPoints:
        """The nearest face of each point, and the nearest point of it; a quad is its two triangles.

        Args:
            points: shape (..., 3), any numeric dtype, used in float64.
            threads: threads of this call; 0 is one a processor that this process may use.
            strict: refuse points that are NaN, infinite or beyond 1e100 (in a scene of double precision also
                beyond 1e100 times its size), instead of counting them in a warning.

        Distances are in units of the vertices. Faces without area are never the nearest.

        Raises:
            ArgumentError: points of another shape; a scene that holds other primitives than triangles and quads,
                or instances.
            ArgumentTypeError: points that are no real numbers.
            InvalidPointError: with ``strict``, the first such point.
            KeyboardInterrupt: Ctrl-C stops a query within a fraction of a second.

        The tree is walked nearest cell first; triangles are measured in float64 (docs/numerics.md).

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.closest_point([0.25, 0.25, -2]).position
        array([0.25, 0.25, 0.  ])
        """
        values, shape, threads = self._given(points, threads, strict)
        distance, prim, geom, position, uv = self._ask().closest_point(values, threads)
        return ClosestPoints(
            distance.reshape(shape),
            prim.reshape(shape),
            geom.reshape(shape),
            position.reshape(*shape, 3),
            uv.reshape(*shape, 2),
        )

    def distance(
        self, points: ArrayLike, *, threads: int = 0, strict: bool = False
    ) -> NDArray[np.float64]:
        """The distance of each point from the nearest triangle: float64, in the points' shape.

        Arguments and errors are those of :meth:`closest_point`, with which it agrees.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.distance([[0.25, 0.25, -2], [0, 0, 0]])
        array([2., 0.])
        """
        values, shape, threads = self._given(points, threads, strict)
        return self._ask().distance(values, False, threads).reshape(shape)

    def signed_distance(
        self, points: ArrayLike, *, threads: int = 0, strict: bool = False
    ) -> NDArray[np.float64]:
        """The distance of each point from a closed surface: negative inside, 0 on it.

        Arguments and errors are those of :meth:`closest_point`; the sign is that of :meth:`contains`
        by parity, exact however close to the surface a point is. (Open3D has the same sign, trimesh
        the opposite one.)

        >>> import ropewalk
        >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> scene = ropewalk.Scene(v, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        >>> scene.signed_distance([[0.25, 0.25, 0.125], [0.25, 0.25, -2.0]])
        array([-0.125,  2.   ])
        """
        values, shape, threads = self._given(points, threads, strict)
        return self._ask().distance(values, True, threads).reshape(shape)

    def contains(
        self,
        points: ArrayLike,
        *,
        method: str = "parity",
        threads: int = 0,
        strict: bool = False,
    ) -> NDArray[np.bool_]:
        """Whether each point lies inside of the surface: bool, in the points' shape.

        Args:
            points: as for :meth:`closest_point`, as ``threads`` and ``strict`` are.
            method: ``"parity"`` for closed surfaces: an odd number of faces above the point; decided
                without rounding, also on edges and vertices, so that a point of the surface counts as
                inside and one beside it as what it is. Which way faces turn does not matter, coincident
                ones cancel. ``"winding"`` for surfaces with holes: a generalised winding number
                above 0.5; faces must turn counter-clockwise as seen from outside. Decided as the sum
                over all faces decides, which is only taken where a bound on its error leaves doubt.

        Points without an answer (NaN) are not inside.

        Raises:
            ArgumentError, ArgumentTypeError, InvalidPointError: as :meth:`closest_point`.

        >>> import ropewalk
        >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> scene = ropewalk.Scene(v, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        >>> scene.contains([[0.1, 0.1, 0.1], [0.1, 0.1, -1e-12], [0, 0, 0]])
        array([ True, False,  True])
        """
        if method not in ("parity", "winding"):
            raise ArgumentError(
                f"method: expected 'parity' or 'winding', found {method!r}", "method"
            )
        values, shape, threads = self._given(points, threads, strict)
        return self._ask().contains(values, method == "winding", threads).reshape(shape)

    def winding_number(
        self,
        points: ArrayLike,
        *,
        accuracy: float = 0.01,
        threads: int = 0,
        strict: bool = False,
    ) -> NDArray[np.float64]:
        """The generalised winding number of each point: float64, in the points' shape.

        1 inside of a closed surface whose faces turn counter-clockwise as seen from outside, 0 outside,
        in between near holes; NaN for points without an answer.

        Args:
            points: as for :meth:`closest_point`, as ``threads`` and ``strict`` are.
            accuracy: how far a number may be from the sum over all faces, 0 or more: a proven bound,
                mostly missed by far (thirty times at 0.01). 0 takes the sum itself, in time that grows
                with the number of faces.

        Raises:
            ArgumentError, ArgumentTypeError, InvalidPointError: as :meth:`closest_point`.

        After Jacobson, Kavan and Sorkine-Hornung (2013); faces far away count by their moments (Barill et
        al. 2018), which the first call makes.

        >>> import ropewalk
        >>> v = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> scene = ropewalk.Scene(v, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
        >>> float(scene.winding_number([0.1, 0.1, 0.1]).round(6))
        1.0
        """
        off = as_array(accuracy, "accuracy")
        if off.size != 1 or not off >= 0:
            raise ArgumentError(
                f"accuracy: expected a number, 0 or more, found {accuracy!r}", "accuracy"
            )
        values, shape, threads = self._given(points, threads, strict)
        return self._ask().winding_number(values, float(off.item()), threads).reshape(shape)

    def locate(
        self, points: ArrayLike, *, threads: int = 0, strict: bool = False
    ) -> NDArray[np.int64]:
        """The leaf of the tree that holds each point: int64, in the points' shape; -1 outside of
        :attr:`bounds`.

        A point in a cutting plane belongs to the upper side. :meth:`cells` has the boxes. Arguments
        and errors are those of :meth:`closest_point`.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.locate([[0.2, 0.2, 0], [5, 5, 5]])
        array([ 0, -1])
        """
        values, shape, threads = self._given(points, threads, strict)
        return self._ask().locate(values, threads).reshape(shape)

    def cells(self, cell: ArrayLike | None = None) -> Cells:
        """Boxes of leaves, by what :meth:`locate` returned; of all leaves if nothing is given.

        Args:
            cell: integers of any shape; those that are no leaves of this scene's tree get NaN boxes.

        Raises:
            ArgumentTypeError: cells that are no integers.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> scene.cells()
        <ropewalk.Cells: 1 leaf, 0 empty>
        >>> scene.cells(scene.locate([0.2, 0.2, 0])).bounds
        array([[0., 0., 0.],
               [1., 1., 0.]], dtype=float32)
        """
        if cell is None:
            found, bounds, count = self._ask().cells()
            return Cells(found, self._as_bounds(bounds), count)
        given = as_array(cell, "cell")
        if given.dtype.kind == "f" and given.size:
            raise ArgumentTypeError(f"cell: expected integers, found dtype {given.dtype}", "cell")
        if given.dtype == np.uint64:
            given = np.minimum(given, 2**63 - 1)
        numbers = np.ascontiguousarray(given, np.int64).reshape(-1)
        found, bounds, count = self._ask().cells(numbers)
        shape = given.shape
        boxes = self._as_bounds(bounds).reshape(*shape, 2, 3)
        return Cells(found.reshape(shape), boxes, count.reshape(shape))

    def _as_bounds(
        self, bounds: NDArray[np.float64]
    ) -> NDArray[np.float32] | NDArray[np.float64]:
        return bounds if isinstance(self._core, DoubleCore) else bounds.astype(np.float32)

    def _ask(self) -> Points:
        if self._points is None:
            self._points = Points(self._core)  # type: ignore[misc]  # a slot of Scene
        return self._points

    def _given(
        self, points: ArrayLike, threads: int, strict: bool
    ) -> tuple[NDArray[np.float64], tuple[int, ...], int]:
        """Points as contiguous float64, their shape, and threads."""
        given = as_points(points, "points")
        # Numbers beyond float64 (of long double) become infinite, which is refused or counted.
        with np.errstate(over="ignore", under="ignore"):
            values = np.require(given, np.float64, ("C", "A")).reshape(-1)
        threads = as_threads(threads)
        invalid, first = self._ask().invalid(values)
        if invalid and strict:
            raise InvalidPointError(
                f"points[{first}] is {tuple(map(float, values[3 * first : 3 * first + 3]))}; expected "
                "finite numbers up to 1e100",
                "points",
                first,
            )
        if invalid:
            warnings.warn(
                f"{invalid} points are NaN, infinite or beyond 1e100 and have no answer; the first is "
                f"point {first}",
                InvalidPointWarning,
                stacklevel=3,
            )
        count = len(values) // 3
        return values, given.shape[:-1], 1 if count <= _FEW_POINTS else threads
