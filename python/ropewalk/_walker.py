"""Particles that are moved through a scene segment by segment."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arrays import (
    ArrayLike,
    as_array,
    as_choice,
    as_float32,
    as_float64,
    as_masks,
    as_rows,
    as_threads,
    per_ray,
)
from ._errors import ArgumentError, ArgumentTypeError, InvalidRayWarning
from ._hits import Hits
from ._ropewalk import DoubleCore, cells_of, walk, walk_double
from ._scene import Scene

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Up to so many segments are walked on the calling thread: waking others would take longer.
_FEW_SEGMENTS = 4096

_NONE = 0xFFFF_FFFF


class Events:
    """What particles met: rows of crossings, in the order in which each particle comes to them.

    Attributes:
        offsets: int64, (N + 1,); the events of particle ``i`` are ``offsets[i]:offsets[i + 1]``.
        segment: int32, the segment, counted from the first of the particle's list.
        t: float32, float64 in a scene of double precision; where on the segment, in lengths of its direction.
        prim_id: int32, face within its mesh.
        geom_id: int32, mesh.
        entering: bool, from the front to the back of the face: into a body whose faces run
            counter-clockwise as seen from outside.
        walked: int32, (N,); segments that each particle began, fewer than its list has if it was stopped.
    """

    __slots__ = ("entering", "geom_id", "offsets", "prim_id", "segment", "t", "walked")

    offsets: NDArray[np.int64]
    segment: NDArray[np.int32]
    t: NDArray[np.float32] | NDArray[np.float64]
    prim_id: NDArray[np.int32]
    geom_id: NDArray[np.int32]
    entering: NDArray[np.bool_]
    walked: NDArray[np.int32]

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of events of each particle."""
        return np.diff(self.offsets)

    @property
    def particle_id(self) -> NDArray[np.int64]:
        """The particle of each event."""
        return np.repeat(np.arange(len(self.offsets) - 1), self.counts)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<ropewalk.Events: {len(self.t)} of {len(self.walked)} particles>"


class Walker:
    """Many particles in a scene of triangles and quads, each moved along segments of its own.

    Args:
        scene: the scene; it must hold nothing but triangles and quads, and be none of instances.
        positions: shape (N, 3), rounded to float32 unless the scene is of double precision.
        threads: threads of each call; 0 is one a processor that this process may use.

    A segment leads from where its particle is to ``position + length * direction``, rounded to float32
    once; in a scene of double precision it is computed in float64, as NumPy would. Every face that it crosses is reported, exactly once, and it is decided without rounding which
    these are: also where segments end in faces, on edges or in vertices, and where particles turn there,
    none is missed or counted twice. A point in a face counts as on the side to which a step along +x
    leads (+y, +z if the face is parallel to that). A quad is crossed as its two triangles are: one that is
    not flat can be entered and left by one segment. No answer depends on the number of threads. Threads can share
    a scene but not a walker: each call moves its particles.

    Raises:
        ArgumentError: wrong shapes; a scene of instances or with other primitives, when particles are moved.
        ArgumentTypeError: no scene, or arrays that are no real numbers.

    >>> import ropewalk
    >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> walker = ropewalk.Walker(scene, [[0.2, 0.2, 1.0], [2.0, 2.0, 1.0]])
    >>> events = walker.advance([[0, 0, -1], [0, 0, -1]], [1.5, 1.5])
    >>> events.t, events.particle_id, events.entering
    (array([1.], dtype=float32), array([0]), array([ True]))
    >>> walker.positions[:, 2]
    array([-0.5, -0.5], dtype=float32)
    """

    __slots__ = ("_positions", "_scene", "_stopped", "_threads")

    def __init__(self, scene: Scene, positions: ArrayLike, *, threads: int = 0) -> None:
        if not isinstance(scene, Scene):
            raise ArgumentTypeError(
                f"scene: expected a ropewalk.Scene, found {type(scene).__name__}", "scene"
            )
        self._scene, self._threads = scene, as_threads(threads)
        self._positions = self._floats(as_rows(positions, "positions")).copy()
        self._stopped: NDArray[np.uint32] = np.full(len(self._positions), _NONE, np.uint32)

    def _floats(self, array: np.ndarray) -> np.ndarray:
        """In the scene's precision."""
        return as_float64(array) if isinstance(self._scene._core, DoubleCore) else as_float32(array)

    @property
    def positions(self) -> NDArray[np.float32] | NDArray[np.float64]:
        """Where the particles are, shape (N, 3), in the scene's precision; assign to it to put them elsewhere."""
        view = self._positions.view()
        view.flags.writeable = False
        return view

    @positions.setter
    def positions(self, positions: ArrayLike) -> None:
        rows = self._floats(as_rows(positions, "positions"))
        if rows.shape != self._positions.shape:
            raise ArgumentError(
                f"positions: expected shape {self._positions.shape}, found {rows.shape}", "positions"
            )
        self._positions = rows.copy()
        self._stopped = np.full(len(rows), _NONE, np.uint32)

    @property
    def stopped(self) -> NDArray[np.bool_]:
        """True for particles that were stopped by a face in their last segment."""
        return self._stopped != _NONE

    @property
    def cell(self) -> NDArray[np.int64]:
        """The cells in which the particles are, for ``start=`` of queries; -1 outside of the scene, and without
        meshes of triangles."""
        points = self._positions.astype(np.float64).reshape(-1)
        return cells_of(self._scene._core, points, self._threads)

    def __len__(self) -> int:
        return len(self._positions)

    def __repr__(self) -> str:
        return f"<ropewalk.Walker: {len(self)} particles in {self._scene!r}>"

    def advance(
        self,
        directions: ArrayLike,
        lengths: ArrayLike = 1.0,
        *,
        stop: bool = False,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        faces: str = "both",
    ) -> Events:
        """Moves each particle along one segment.

        Args:
            directions: shape (N, 3) or (3,), of any length.
            lengths: 0 or more, in lengths of the direction: a number, or one a particle.
            stop: particles stop at the first face that they meet. They then stand in it, and pass it in
                their next segment without an event, to whichever side that leads.
            masks: 32 bits for all particles or a particle; see :meth:`Scene.from_meshes`. Faces of meshes
                without a common bit are no events and stop nothing.
            skip: a face that the first segment of each particle passes without an event, usually the one
                from which it starts, as for :meth:`Scene.closest_hit`; -1 is none. It takes the place of
                the face at which the particle was stopped.
            faces: ``"front"`` if only particles that enter (from the front to the back) meet a face,
                ``"back"`` if only those that leave.

        Segments with a number that is NaN, infinite or beyond 1e30 (1e100 times the scene's size in double
        precision), or with a negative length, are left out and counted in an ``InvalidRayWarning``.

        Raises:
            ArgumentError, ArgumentTypeError: as :class:`Walker`.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> walker = ropewalk.Walker(scene, [[0.2, 0.2, 1.0]])
        >>> len(walker.advance([0, 0, -1], 9, stop=True)), walker.positions
        (1, array([[0.2, 0.2, 0. ]], dtype=float32))
        """
        n = len(self._positions)
        array = as_array(directions, "directions")
        if array.shape not in ((3,), (n, 3)):
            raise ArgumentError(
                f"directions: expected shape ({n}, 3) or (3,), found {array.shape}", "directions"
            )
        array = np.broadcast_to(array, (n, 3))
        length = np.broadcast_to(per_ray(as_array(lengths, "lengths"), (n,), "lengths"), (n,))
        rows = np.arange(n + 1, dtype=np.int64)
        return self._walk(rows, array, length, stop, masks, skip, faces)

    def run(
        self,
        offsets: ArrayLike,
        directions: ArrayLike,
        lengths: ArrayLike,
        *,
        stop: bool = False,
        masks: ArrayLike | None = None,
        skip: ArrayLike | Hits | tuple[ArrayLike, ArrayLike] | None = None,
        faces: str = "both",
    ) -> Events:
        """Moves each particle along a list of segments, each from where the one before ended.

        Args:
            offsets: (N + 1,), integers that do not descend; particle ``i`` has the segments
                ``offsets[i]:offsets[i + 1]``.
            directions: shape (S, 3).
            lengths: (S,), or a number.
            stop: particles stop at the first face that they meet and leave out the rest of their list.
            masks: as for :meth:`advance`.
            skip: as for :meth:`advance`.
            faces: as for :meth:`advance`.

        Raises:
            ArgumentError, ArgumentTypeError: as :class:`Walker`.

        >>> import ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> walker = ropewalk.Walker(scene, [[0.2, 0.2, 1.0]])
        >>> events = walker.run([0, 3], [[0, 0, -1], [0, 0, -1], [0, 0, 1]], [1, 1, 2])
        >>> events.segment, events.entering
        (array([1, 2], dtype=int32), array([ True, False]))
        """
        rows = as_array(offsets, "offsets")
        if rows.dtype.kind == "f":
            raise ArgumentTypeError(f"offsets: expected integers, found dtype {rows.dtype}", "offsets")
        if rows.shape != (len(self._positions) + 1,):
            raise ArgumentError(
                f"offsets: expected shape ({len(self._positions) + 1},), found {rows.shape}", "offsets"
            )
        array = as_rows(directions, "directions")
        length = np.broadcast_to(
            per_ray(as_array(lengths, "lengths"), (len(array),), "lengths"), (len(array),)
        )
        low, high = int(rows[0]), int(rows[-1])
        if low < 0 or high > len(array) or np.any(rows[1:] < rows[:-1]):
            raise ArgumentError(
                f"offsets: expected numbers from 0 to {len(array)} that do not descend", "offsets"
            )
        rows = np.ascontiguousarray(rows, np.int64)
        return self._walk(rows, array, length, stop, masks, skip, faces)

    def _walk(
        self,
        offsets: NDArray[np.int64],
        directions: np.ndarray,
        lengths: np.ndarray,
        stop: bool,
        masks: Any,
        skip: Any,
        faces: str,
    ) -> Events:
        few, shape = len(directions) <= _FEW_SEGMENTS, self._stopped.shape
        sides = as_choice(faces, "faces", ("both", "front", "back"))
        bits = None if masks is None else per_ray(as_masks(masks, "masks"), shape, "masks")
        passed: NDArray[np.uint32] = self._stopped
        if skip is not None:
            numbered = self._scene._skip(skip, shape)
            passed = np.where(numbered < 0, passed, numbered.view(np.uint32))
        core = self._scene._core
        arrays = (
            self._positions.reshape(-1),
            passed,
            offsets,
            self._floats(directions).reshape(-1),
            self._floats(lengths),
        )
        how = (bool(stop), 1 if few else self._threads, bits, sides)
        events = Events()
        at: tuple[np.ndarray, NDArray[np.uint32]]
        rows: tuple[np.ndarray, ...]
        if isinstance(core, DoubleCore):
            at, rows, events.walked, invalid = walk_double(core, *arrays, *how)
        else:
            at, rows, events.walked, invalid = walk(core, *arrays, *how)
        self._positions, self._stopped = at[0].reshape(-1, 3), at[1]
        events.offsets, events.segment, events.t = rows[0], rows[1], rows[2]
        events.prim_id, events.geom_id, events.entering = rows[3], rows[4], rows[5]
        if invalid:
            limit = "1e100 sizes of the scene" if isinstance(core, DoubleCore) else "1e30"
            warnings.warn(
                f"{invalid} segments have no end and were left out: numbers that are NaN, infinite or "
                f"beyond {limit}, or negative lengths",
                InvalidRayWarning,
                stacklevel=3,
            )
        return events
