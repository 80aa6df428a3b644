"""Spheres, cones and cylinders, for :meth:`ropewalk.Scene.from_meshes`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ._arrays import ArrayLike, as_array, as_float32, as_rows, moved
from ._errors import ArgumentError
from ._report import plural

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Shapes:
    """Rows of float32 numbers, one a shape, and what rounding them cost."""

    __slots__ = ("_moved", "_numbers")

    _numbers: NDArray[np.float32]
    #: By how much points or radii were moved at most, and the diagonal of all.
    _moved: tuple[float, float]

    def __len__(self) -> int:
        """Number of shapes."""
        return len(self._numbers)

    def __repr__(self) -> str:
        name = type(self).__name__.lower()
        return f"<ropewalk.{type(self).__name__}: {plural(len(self), name[:-1], name)}>"

    def _view(self, columns: int | slice) -> NDArray[np.float32]:
        view = self._numbers[:, columns]
        view.flags.writeable = False
        return view

    def _adopt(
        self,
        points: list[tuple[np.ndarray, str]],
        radii: list[tuple[np.ndarray, str]],
        least: float,
    ) -> None:
        """Takes the columns of some points and radii; these must be above ``least``."""
        count = len(points[0][0])
        columns = [_finite(given, name) for given, name in points]
        columns += [_radii(given, name, count, least)[:, None] for given, name in radii]
        self._numbers = np.concatenate(columns, axis=1)
        given, name = points[0]
        if not count:
            self._moved = 0.0, 0.0
            return
        rounded = columns[: len(points)]
        # Boxes must fit into float32, too.
        widest = np.max([column[:, 0] for column in columns[len(points) :]], axis=0)
        reach = np.max([np.abs(p.astype(np.float64)).max(axis=1) for p in rounded], axis=0) + widest
        if (beyond := reach > np.finfo(np.float32).max).any():
            index = int(np.argmax(beyond))
            raise ArgumentError(
                f"{name}[{index}] and its radius reach beyond the range of float32", name, index
            )
        shifts = [moved(p, q)[0] for (p, _), q in zip(points, rounded)]
        turns = [np.abs(as_array(r, "") - as_float32(r)).max() for r, _ in radii if r.size]
        both = np.concatenate(rounded).astype(np.float64)
        span = np.ptp(both, axis=0) + 2 * float(widest.max())
        self._moved = float(max(shifts + turns)), float(np.linalg.norm(span))


class Spheres(Shapes):
    """Spheres for :meth:`Scene.from_meshes`: one mesh, sphere ``i`` is its primitive ``i``.

    Args:
        centers: shape (N, 3), any numeric dtype, rounded to float32.
        radii: a number, or one a sphere, shape (N,); above 0.

    A sphere is hollow and hit from both sides. As every primitive it is hit once by a ray: where the ray first meets
    it within its range, which is the far side for one that starts inside. ``skip`` ignores all of it. Normals
    point outwards, ``uv`` is 0. A scene that holds spheres is of single precision; points and walkers need one of
    triangles and quads.

    Raises:
        ArgumentError: other shapes; centres that are not finite; radii of 0 or less, NaN or infinite, all
            after rounding to float32.
        ArgumentTypeError: what is no array of real numbers.

    >>> import ropewalk
    >>> scene = ropewalk.Scene.from_meshes([ropewalk.Spheres([[0, 0, 0], [0, 0, 5]], [1, 2])])
    >>> hits = scene.closest_hit([0, 0, -3], [0, 0, 1])
    >>> hits.t, hits.prim_id, hits.normal
    (array(2., dtype=float32), array(0, dtype=int32), array([ 0.,  0., -1.], dtype=float32))
    >>> scene.all_hits([0, 0, 0], [0, 0, 1]).t
    array([1., 3.], dtype=float32)
    """

    __slots__ = ()

    def __init__(self, centers: ArrayLike, radii: ArrayLike) -> None:
        points, sizes = as_rows(centers, "centers"), as_array(radii, "radii")
        self._adopt([(points, "centers")], [(sizes, "radii")], np.nextafter(0.0, 1.0))

    @property
    def centers(self) -> NDArray[np.float32]:
        """Centres, shape (N, 3)."""
        return self._view(slice(0, 3))

    @property
    def radii(self) -> NDArray[np.float32]:
        """Radii, shape (N,)."""
        return self._view(3)


class Cones(Shapes):
    """Frustums of cones for :meth:`Scene.from_meshes`: one mesh, cone ``i`` is its primitive ``i``.

    Args:
        base: centres of the circles at one end, shape (N, 3), any numeric dtype, rounded to float32.
        apex: centres of those at the other end, shape (N, 3).
        base_radius: a number, or one a cone, shape (N,); 0 or more.
        apex_radius: the same at the other end; 0 for a cone with a tip, equal to ``base_radius`` for a cylinder.

    They have no caps: a ray along the axis passes through, or meets the inside of the tapering side. Otherwise they are hit
    as :class:`Spheres` are, once by a ray, where it first meets the side within its range. Normals
    point away from the axis. Cones whose ends are the same point are kept and never hit, as faces without area are.

    Raises:
        ArgumentError: other shapes; points that are not finite; radii that are negative, NaN, infinite or
            both 0, all after rounding to float32.
        ArgumentTypeError: what is no array of real numbers.

    >>> import ropewalk
    >>> cone = ropewalk.Cones([[0, 0, 0]], [[0, 0, 2]], 1, 0)
    >>> scene = ropewalk.Scene.from_meshes([cone])
    >>> scene.closest_hit([[-3, 0, 1], [0.25, 0, -3]], [[1, 0, 0], [0, 0, 1]]).t
    array([2.5, 4.5], dtype=float32)
    """

    __slots__ = ()

    def __init__(
        self, base: ArrayLike, apex: ArrayLike, base_radius: ArrayLike, apex_radius: ArrayLike
    ) -> None:
        ends = [(as_rows(base, "base"), "base"), (as_rows(apex, "apex"), "apex")]
        radii = [(base_radius, "base_radius"), (apex_radius, "apex_radius")]
        self._between(ends, [(as_array(given, name), name) for given, name in radii])

    def _between(
        self, ends: list[tuple[np.ndarray, str]], radii: list[tuple[np.ndarray, str]]
    ) -> None:
        (base, _), (apex, _) = ends
        if apex.shape != base.shape:
            raise ArgumentError(
                f"apex: expected the shape of base, {base.shape}, found {apex.shape}", "apex"
            )
        self._adopt(ends, radii, 0.0)
        pointless = (self._numbers[:, 6:] == 0).all(axis=1)
        if pointless.any():
            index, name = int(np.argmax(pointless)), radii[0][1]
            raise ArgumentError(
                f"{name}[{index}] is 0, and so is the radius at the other end; expected one above 0",
                name,
                index,
            )

    @property
    def base(self) -> NDArray[np.float32]:
        """Centres of the circles at one end, shape (N, 3)."""
        return self._view(slice(0, 3))

    @property
    def apex(self) -> NDArray[np.float32]:
        """Centres of the circles at the other end, shape (N, 3)."""
        return self._view(slice(3, 6))

    @property
    def base_radius(self) -> NDArray[np.float32]:
        """Radii at ``base``, shape (N,)."""
        return self._view(6)

    @property
    def apex_radius(self) -> NDArray[np.float32]:
        """Radii at ``apex``, shape (N,)."""
        return self._view(7)


class Cylinders(Cones):
    """Cylinders for :meth:`Scene.from_meshes`, open at both ends: :class:`Cones` of equal radii.

    Args:
        base: centres of the circles at one end, shape (N, 3), any numeric dtype, rounded to float32.
        apex: centres of those at the other end, shape (N, 3).
        radius: a number, or one a cylinder, shape (N,); above 0.

    Raises:
        ArgumentError, ArgumentTypeError: as :class:`Cones`.

    >>> import ropewalk
    >>> scene = ropewalk.Scene.from_meshes([ropewalk.Cylinders([[0, 0, 0]], [[0, 0, 2]], 1)])
    >>> scene.occluded([[-3, 0, 1], [-3, 0, 3], [0, 0, -3]], [[1, 0, 0], [1, 0, 0], [0, 0, 1]])
    array([ True, False, False])
    """

    __slots__ = ()

    def __init__(self, base: ArrayLike, apex: ArrayLike, radius: ArrayLike) -> None:
        ends = [(as_rows(base, "base"), "base"), (as_rows(apex, "apex"), "apex")]
        given = as_array(radius, "radius")
        self._between(ends, [(given, "radius"), (given, "radius")])


def _finite(given: np.ndarray, name: str) -> NDArray[np.float32]:
    """Points as float32."""
    rounded = as_float32(given)
    wrong = ~np.isfinite(rounded).all(axis=1)
    if wrong.any():
        index = int(np.argmax(wrong))
        x, y, z = given[index].tolist()
        raise ArgumentError(
            f"{name}[{index}] is ({x:g}, {y:g}, {z:g}); expected finite numbers within the range of float32",
            name,
            index,
        )
    return rounded


def _radii(given: np.ndarray, name: str, count: int, least: float) -> NDArray[np.float32]:
    """Radii of ``count`` shapes as float32."""
    if given.shape not in ((), (count,)):
        raise ArgumentError(
            f"{name}: expected a number or an array of shape ({count},), found {given.shape}", name
        )
    rounded = as_float32(given)
    wrong = ~(np.isfinite(rounded) & (rounded >= least))
    if wrong.any():
        index = int(np.argmax(wrong)) if given.ndim else None
        value = float(given[index] if index is not None else given)
        at = name if index is None else f"{name}[{index}]"
        expected = "a finite number above 0" if least > 0 else "a finite number, 0 or more"
        raise ArgumentError(f"{at} is {value:g}; expected {expected}, in float32", name, index)
    return np.broadcast_to(rounded, (count,))
