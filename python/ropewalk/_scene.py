"""Scenes: geometry and its tree."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ropewalk
from ._arrays import (
    ArrayLike,
    as_array,
    as_faces,
    as_float32,
    as_float64,
    as_limit,
    as_masks,
    as_rows,
    as_threads,
    moved,
)
from ._errors import ArgumentError, ArgumentTypeError, PrecisionWarning, SceneFileError
from ._file import Saved
from ._mesh import Instances, as_merge, as_path
from ._points import PointMethods
from ._rays import RayMethods, RaySample, as_sample
from ._report import Report, plural, report_of, size_of
from ._ropewalk import Core, DoubleCore, DoubleRays, Rays, default_threads
from ._shapes import Shapes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

#: Rounding by more than this share of the box's diagonal is warned of: 2^-25 is what rounding to
#: float32 costs an object around the origin, this is an object 32 times its size away.
_PRECISION = 2.0**-20

_ALL_BITS = 0xFFFF_FFFF

#: Coordinates in float64 beyond this would overflow in products.
_LARGEST = 1e100

#: Vertices as given, faces, and what arguments of the mesh are called.
_Mesh = tuple[np.ndarray, np.ndarray, str]


class Scene(Saved, RayMethods, PointMethods):
    """Triangles and quads that rays can be cast at. A scene never changes and can be used by many threads.

    Args:
        vertices: shape (V, 3), any numeric dtype.
        faces: shape (F, 3) for triangles or (F, 4) for quads, integers from 0 to V - 1; face ``i`` is primitive
            ``i``. A quad (a, b, c, d) is the triangles (a, b, c) and (a, c, d), and one primitive: a ray hits it once
            at most, at the first hit of the two. One whose fourth index is its third is a triangle.
        preset: ``"fast"``, ``"balanced"`` or ``"best"``: how long to build for how fast a tree;
            ``"compact"`` for a small one.
        cost_model: what the build minimises: ``"surface_area"`` (MacDonald and Booth 1990), the measure of rays that
            end where they hit, ``"termination"`` (Havran 1997, corrected), ``"termination_projection"`` or
            ``"termination_lines"`` by how their ends are estimated, or the paper's formula as it was printed,
            ``"havran_printed"`` or ``"havran_printed_crossed"``. All but the first take several times as long.
        rays: a sample of the rays that the scene is for, ``(origins, directions)`` or ``(origins, directions,
            t_max)``, shaped as in :meth:`closest_hit`. Cells that they meet more often than their surface area says
            weigh more (Bittner and Havran 2009). A ray counts up to ``t_max`` and may be in any order; of
            more than 65,536 so many are drawn. No answer depends on them. With ``"surface_area"`` alone.
        precision: ``"single"`` rounds vertices and rays to float32. ``"double"`` keeps them in float64, and
            answers are those of brute force in float64, at any distance from the origin, for 1.1 to 2.2
            times the time of an incoherent ray, more of a coherent one. ``"auto"`` is ``"double"`` where
            rounding would move a vertex by more than 2^-20 of the mesh's diagonal.
        threads: threads of the build; 0 is one a processor that this process may use. The tree is the
            same for any number.
        progress: True for a bar (where tqdm is installed), or a function of the share done, which may raise to
            stop the build.
        memory_limit: bytes that the scene and its build may take beyond the arrays given. A build that needs
            more is refused before it takes any; one that comes close gets a smaller tree.

    Faces without area are kept and never hit; both sides of others are. A scene without faces is
    valid, and every ray misses it.

    Raises:
        ArgumentError: wrong shapes, vertices that are not finite, faces that name none, unknown names, rays
            with another cost model than the surface area.
        ArgumentTypeError: arrays that are no real numbers, faces that are no integers.
        OutOfMemoryError: the tree does not fit into memory, or into ``memory_limit``; the message says how
            much it needs.
        KeyboardInterrupt: Ctrl-C stops a build within a fraction of a second.

    >>> import ropewalk
    >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> float(scene.closest_hit([0.2, 0.2, 1.0], [0, 0, -1]).t)
    1.0
    >>> down = [[0.1, 0.2, 1], [0.2, 0.1, 1]], [0, 0, -1]
    >>> steered = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], rays=down)
    >>> steered.report.sample_rays, steered.report.cost_model
    (2, 'surface_area')
    """

    __slots__ = ("__weakref__", "_core", "_placed", "_points", "_report", "_starts")

    _core: Core | DoubleCore

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        preset: str = "balanced",
        cost_model: str = "surface_area",
        rays: RaySample | None = None,
        precision: str = "auto",
        threads: int = 0,
        progress: bool | Callable[[float], object] | None = None,
        memory_limit: int | None = None,
    ) -> None:
        mesh = _mesh(vertices, faces, "")
        plan = _plan(preset, cost_model)
        self._adopt(
            _build([mesh], [_ALL_BITS], plan, precision, threads, progress, memory_limit, rays)
        )

    @classmethod
    def from_meshes(
        cls,
        meshes: Iterable[tuple[ArrayLike, ArrayLike] | Shapes],
        *,
        masks: ArrayLike | None = None,
        preset: str = "balanced",
        cost_model: str = "surface_area",
        rays: RaySample | None = None,
        precision: str = "auto",
        threads: int = 0,
        progress: bool | Callable[[float], object] | None = None,
        memory_limit: int | None = None,
    ) -> Scene:
        """A scene of several meshes; hits name the mesh (``geom_id``) and the face in it (``prim_id``).

        Args:
            meshes: pairs of vertices (V, 3) and faces (F, 3) or (F, 4), as for :class:`Scene`; or
                :class:`Spheres`, :class:`Cones` or :class:`Cylinders`, which make the scene one of single precision.
            masks: 32 bits a mesh, all set by default. A ray hits a mesh if they have a bit in common.

        Raises:
            ArgumentError, ArgumentTypeError, OutOfMemoryError: as :class:`Scene`; ArgumentError also for
                ``precision="double"`` with other shapes than triangles and quads.

        >>> import ropewalk
        >>> a = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> b = ([[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2], [0, 2, 1]])
        >>> scene = ropewalk.Scene.from_meshes([a, b], masks=[1, 2])
        >>> scene.closest_hit([0.2, 0.2, 5], [0, 0, -1]).geom_id
        array(1, dtype=int32)
        >>> scene.closest_hit([0.2, 0.2, 5], [0, 0, -1], masks=1).geom_id
        array(0, dtype=int32)
        >>> scene = ropewalk.Scene.from_meshes([a, ropewalk.Spheres([[0.2, 0.2, -4]], 1)])
        >>> scene.all_hits([0.2, 0.2, 5], [0, 0, -1]).geom_id
        array([0, 1], dtype=int32)
        """
        checked: list[_Mesh | Shapes] = []
        try:
            pairs = list(meshes)
        except TypeError:
            raise ArgumentTypeError(
                f"meshes: expected pairs of arrays or shapes, found {type(meshes).__name__}", "meshes"
            ) from None
        for i, pair in enumerate(pairs):
            if isinstance(pair, Shapes):
                checked.append(pair)
                continue
            try:
                vertices, faces = pair
            except (TypeError, ValueError):
                raise ArgumentTypeError(
                    f"meshes[{i}]: expected a pair (vertices, faces), Spheres, Cones or Cylinders, found "
                    f"{type(pair).__name__}",
                    "meshes",
                    i,
                ) from None
            checked.append(_mesh(vertices, faces, f"meshes[{i}]."))
        bits = [_ALL_BITS] * len(checked) if masks is None else _mesh_masks(masks, len(checked), "mesh")
        scene = cls.__new__(cls)
        scene._adopt(
            _build(
                checked,
                bits,
                _plan(preset, cost_model),
                precision,
                threads,
                progress,
                memory_limit,
                rays,
            )
        )
        return scene

    @classmethod
    def from_instances(
        cls,
        instances: Iterable[tuple[Scene, ArrayLike | None]],
        *,
        masks: ArrayLike | None = None,
        threads: int = 0,
    ) -> Scene:
        """A scene of other scenes, each placed any number of times without copying it.

        Args:
            instances: pairs of a scene of double precision and an affine transform into the new scene, shape
                (3, 4) or (4, 4) with the last row (0, 0, 0, 1), or None for where it is. The same scene may
                occur often; what it holds and its tree are shared.
            masks: 32 bits an instance; see :meth:`from_meshes`. Masks of meshes within do not count.
            threads: threads of the build; only a tree over the boxes of the instances is built, so that moving
                them takes a call of this method alone, and replacing one of the scenes its own build too.

        In hits ``geom_id`` is the instance and ``prim_id`` the face within its scene, all of its meshes counted
        through. Rays are transformed in float64 and answered as by a scene of double precision; positions and
        normals are those of the new scene. One level: instances hold no instances.

        Raises:
            ArgumentError: matrices without an inverse or not finite, scenes of single precision or of
                instances, more than 2^31 - 1 faces with all instances counted.
            ArgumentTypeError: what is no pair of scene and matrix.

        >>> import numpy as np, ropewalk
        >>> triangle = ropewalk.Scene(np.eye(3), [[0, 1, 2]], precision="double")
        >>> up = np.eye(4)
        >>> up[2, 3] = 5
        >>> scene = ropewalk.Scene.from_instances([(triangle, None), (triangle, up)])
        >>> hits = scene.all_hits([0.2, 0.2, -9], [0, 0, 1])
        >>> hits.geom_id, hits.t
        (array([0, 1], dtype=int32), array([ 9.6, 14.6]))
        """
        try:
            pairs = list(instances)
        except TypeError:
            raise ArgumentTypeError(
                f"instances: expected pairs of a scene and a matrix, found {type(instances).__name__}",
                "instances",
            ) from None
        scenes, matrices = [], np.zeros((len(pairs), 3, 4))
        cores: list[DoubleCore] = []
        for i, pair in enumerate(pairs):
            name = f"instances[{i}]"
            try:
                scene, matrix = pair
            except (TypeError, ValueError):
                scene, matrix = None, None
            if not isinstance(scene, Scene):
                raise ArgumentTypeError(
                    f"{name}: expected a pair (scene, matrix), found {type(pair).__name__}",
                    "instances",
                    i,
                )
            if not isinstance(scene._core, DoubleCore):
                raise ArgumentError(
                    f"{name}: expected a scene of double precision, found one of single precision; "
                    f"make it with precision='double'",
                    "instances",
                    i,
                )
            scenes.append(scene)
            cores.append(scene._core)
            matrices[i] = _matrix(matrix, name, i)
        bits = [_ALL_BITS] * len(pairs) if masks is None else _mesh_masks(masks, len(pairs), "instance")
        placed = cls.__new__(cls)
        core = DoubleCore.place(cores, matrices.reshape(-1), bits, as_threads(threads))
        placed._adopt(core)
        placed._placed = scenes, matrices
        return placed

    @classmethod
    def _of_file(
        cls,
        name: str,
        found: Instances,
        plan: tuple[str, str],
        threads: int,
        progress: bool | Callable[[float], object] | None,
    ) -> Scene:
        """Builds each mesh once, and places them."""
        scenes, done = [], 0
        total = sum(len(faces) for _, faces in found.meshes)
        with _progress(progress) as show:
            for vertices, faces in found.meshes:
                starts, masks = [0, len(faces)], [_ALL_BITS]
                share = None if show is None else _share(show, done / total, len(faces) / total)
                scene = cls.__new__(cls)
                scene._adopt(DoubleCore.build(vertices, faces, starts, masks, plan, threads, share))
                scenes.append(scene)
                done += len(faces)
        placed = cls.__new__(cls)
        all_scenes = [scenes[i] for i in found.mesh.tolist()]
        cores, masks = [scene._core for scene in all_scenes], [_ALL_BITS] * len(all_scenes)
        try:
            core = DoubleCore.place(cores, found.matrices.reshape(-1), masks, threads)
        except ArgumentError as error:
            if error.index is None:
                raise SceneFileError(f"{name}: {error}; instances=False may read it", "path") from None
            why = str(error).removeprefix(f"instances[{error.index}]: ")
            node, called = found.nodes[error.index], found.names[error.index]
            where = f"nodes[{node}]" + (f" ({called})" if called else "") if node >= 0 else "the mesh"
            raise SceneFileError(
                f"{name}: {where}: {why}; instances=False works such nodes into the vertices", "path"
            ) from None
        placed._adopt(core)
        placed._placed = all_scenes, found.matrices
        return placed

    def _adopt(self, core: Core | DoubleCore) -> None:
        self._core = core
        self._points = None
        self._starts = np.asarray(core.starts, np.int64)
        self._report: Report | None = None
        # Scenes and matrices that instances were made of.
        self._placed: tuple[list[Scene], np.ndarray] | None = None

    @property
    def report(self) -> Report:
        """Figures of the build and of the tree.

        >>> import ropewalk
        >>> ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).report.leaves
        1
        """
        if self._report is None:
            self._report = report_of(self._core.report())
        return self._report

    @property
    def bounds(self) -> NDArray[np.float32] | NDArray[np.float64]:
        """Lower and upper corner of the box of all primitives, shape (2, 3); NaN without any.

        >>> import ropewalk
        >>> ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]).bounds
        array([[0., 0., 0.],
               [1., 1., 0.]], dtype=float32)
        """
        bounds = self._core.bounds
        corners = np.full((2, 3), np.nan) if bounds is None else np.array(bounds, np.float64)
        return corners if isinstance(self._core, DoubleCore) else corners.astype(np.float32)

    @property
    def precision(self) -> str:
        """``"single"`` or ``"double"``: the floats of vertices, rays and parameters.

        >>> import ropewalk
        >>> ropewalk.Scene([[1e7, 0, 0], [1e7 + 0.1, 0, 0], [1e7, 1, 0]], [[0, 1, 2]]).precision
        'double'
        """
        return "double" if isinstance(self._core, DoubleCore) else "single"

    @property
    def mesh_sizes(self) -> NDArray[np.int64]:
        """Number of primitives of each mesh; a quad is one.

        >>> import ropewalk
        >>> ropewalk.load("spd:tetra:2").mesh_sizes
        array([16])
        """
        return np.diff(self._starts)

    @property
    def masks(self) -> NDArray[np.uint32]:
        """Mask of each mesh.

        >>> import ropewalk
        >>> ropewalk.load("spd:tetra:2").masks
        array([4294967295], dtype=uint32)
        """
        return np.asarray(self._core.masks, np.uint32)

    def __len__(self) -> int:
        """Number of primitives."""
        return int(self._starts[-1])

    def __bool__(self) -> bool:
        return True

    def __repr__(self) -> str:
        count, meshes = len(self), len(self._starts) - 1
        if not count:
            return f"<ropewalk.Scene without primitives, {plural(meshes, 'mesh', 'meshes')}>"
        low, high = (", ".join(f"{x:.6g}" for x in corner) for corner in self.bounds)
        return (
            f"<ropewalk.Scene of {plural(count, 'primitive', 'primitives')} in "
            f"{plural(meshes, 'mesh', 'meshes')}, box ({low}) to ({high}), "
            f"tree {size_of(self.report.tree_bytes)}>"
        )

    def _repr_html_(self) -> str:
        """What a notebook shows: the report as a table."""
        return f"<b>ropewalk.Scene</b>{self.report._repr_html_()}"

    def plot(self) -> Any:
        """A matplotlib figure: leaves by the number of their primitives, and what a line is predicted to
        cost in them (scenes of triangles).

        Raises:
            ImportError: matplotlib is not installed (``pip install 'ropewalk[plot]'``).

        >>> import ropewalk
        >>> figure = ropewalk.load("spd:tetra:3").plot()  # doctest: +SKIP
        """
        from ._plot import plot

        return plot(self)

    def __copy__(self) -> Scene:
        return self

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        return self

    def __reduce__(self) -> tuple[Callable[..., Scene], tuple[Any, ...]]:
        """Pickled as its primitives; the same tree is built again, without the rays of a sample."""
        core = self._core
        if self._placed is not None:
            return _restore_instances, (type(self), *self._placed, core.masks)
        if isinstance(core, DoubleCore):
            return _restore_double, (type(self), *core.meshes(), core.starts, core.masks, core.plan)
        *state, quads = core.state()
        return _restore, (type(self), *state) if quads is None else (type(self), *state, quads)


def load(
    path: str | os.PathLike[str],
    *,
    preset: str = "balanced",
    cost_model: str = "surface_area",
    rays: RaySample | None = None,
    precision: str = "auto",
    threads: int = 0,
    progress: bool | Callable[[float], object] | None = None,
    memory_limit: int | None = None,
    instances: bool = False,
    merge: bool | float = False,
) -> Scene:
    """Loads a scene: a mesh file as :func:`read_mesh` reads it (OBJ, PLY, STL, OFF, glTF), an NFF file,
    both gzipped or not, told apart by content, then by name, or a built-in scene, ``"spd:NAME"`` or
    ``"spd:NAME:SIZE"`` of the Standard Procedural Databases (Haines 1987), or the mesh ``"stage:room"``.

    Triangle or object ``i`` of the file is primitive ``i`` of one mesh, hit on both sides; polygons,
    spheres, cones and patches of NFF stay what they are, and are always of single precision. The other
    arguments are those of :class:`Scene`.

    With ``instances``, meshes of glTF that several nodes name are held once, in double precision, and placed:
    ``geom_id`` is the placement of :func:`read_instances`, ``prim_id`` the triangle within its mesh, as of
    :meth:`Scene.from_instances`. Memory and build time then go by the meshes, rays that meet many instances take
    longer. ``rays``, ``memory_limit`` and ``merge`` are not known there.

    ``merge`` makes one of vertices as :func:`read_mesh` says; with True rays hit the same, and the scene takes less memory.

    Raises:
        SceneNotFoundError: the file cannot be opened.
        SceneFileError: its content is wrong; the message says where. With ``instances`` also for a node whose
            transform has no inverse.
        ArgumentError: ``instances`` or ``merge`` with an NFF file or a built-in scene; ``instances`` with single
            precision, ``rays``, ``memory_limit`` or ``merge``.

    >>> import ropewalk
    >>> ropewalk.load("spd:balls:2")
    <ropewalk.Scene of 92 primitives in 1 mesh, box (-12, -12, -0.5) to (12, 12, 0.785072), tree 6.4 KiB>
    """
    name, distance = as_path(path), as_merge(merge)
    if instances:
        for argument, value, expected in (
            ("precision", precision, ("auto", "double")),
            ("rays", rays, (None,)),
            ("memory_limit", memory_limit, (None,)),
            ("merge", distance, (None,)),
        ):
            if not any(value is x or (isinstance(value, str) and value == x) for x in expected):
                what = " or ".join(map(repr, expected))
                raise ArgumentError(f"{argument}: expected {what} with instances=True", argument)
        found = _ropewalk.read_instances(name)
        if found is None:
            raise ArgumentError(
                "instances: expected False for NFF files and built-in scenes, found True", "instances"
            )
        plan = _plan(preset, cost_model)
        return Scene._of_file(name, Instances(*found), plan, as_threads(threads), progress)
    mesh = _ropewalk.read_mesh(name, distance)
    if mesh is not None:
        return Scene(
            *mesh,
            preset=preset,
            cost_model=cost_model,
            rays=rays,
            precision=precision,
            threads=threads,
            progress=progress,
            memory_limit=memory_limit,
        )
    if distance is not None:
        raise ArgumentError(
            f"merge: expected False for NFF files and built-in scenes, found {merge!r}", "merge"
        )
    if precision == "double":
        raise ArgumentError(
            "precision: expected 'auto' or 'single' for NFF files and built-in scenes, found 'double'",
            "precision",
        )
    with _progress(progress) as show:
        limit, plan = as_limit(memory_limit), _plan(preset, cost_model)
        sample = as_sample(rays, Rays, stacklevel=3)
        core = Core.load(name, plan, as_threads(threads), show, limit, sample)
    scene = Scene.__new__(Scene)
    scene._adopt(core)
    return scene


def _restore(
    kind: type[Scene],
    kinds: NDArray[np.uint8],
    ends: NDArray[np.uint64],
    numbers: NDArray[np.float32],
    starts: list[int],
    masks: list[int],
    plan: tuple[str, str],
    quads: NDArray[np.uint8] | None = None,
) -> Scene:
    scene = kind.__new__(kind)
    threads = default_threads()
    scene._adopt(Core.from_state(kinds, ends, numbers, starts, masks, plan, threads, quads))
    return scene


def _restore_instances(
    kind: type[Scene], scenes: list[Scene], matrices: np.ndarray, masks: list[int]
) -> Scene:
    return kind.from_instances(zip(scenes, matrices), masks=masks or None)


def _restore_double(
    kind: type[Scene],
    vertices: NDArray[np.float64],
    faces: NDArray[np.uint32],
    starts: list[int],
    masks: list[int],
    plan: tuple[str, str],
) -> Scene:
    scene = kind.__new__(kind)
    threads = default_threads()
    scene._adopt(DoubleCore.build(vertices, faces, starts, masks, plan, threads))
    return scene


def _build(
    meshes: list[_Mesh | Shapes],
    masks: list[int],
    plan: tuple[str, str],
    precision: str,
    threads: int,
    progress: bool | Callable[[float], object] | None,
    memory_limit: int | None,
    rays: RaySample | None,
) -> Core | DoubleCore:
    threads, limit = as_threads(threads), as_limit(memory_limit)
    if precision not in ("auto", "single", "double"):
        raise ArgumentError(
            f"precision: expected 'auto', 'single' or 'double', found {precision!r}", "precision"
        )
    flat = [mesh for mesh in meshes if not isinstance(mesh, Shapes)]
    has_shapes = len(flat) < len(meshes)
    if has_shapes and precision == "double":
        raise ArgumentError(
            "precision: spheres and cones are of single precision; expected 'auto' or 'single', found 'double' "
            "(move the scene to the origin, or make one of the meshes alone)",
            "precision",
        )
    vertices = [as_float32(mesh[0]) for mesh in flat]
    shifts = [moved(mesh[0], rounded) for mesh, rounded in zip(flat, vertices)]
    if precision == "auto":
        far = any(by > _PRECISION * size for by, size in shifts)
        precision = "double" if far and not has_shapes else "single"
    if precision == "double" and sum(len(mesh[1]) for mesh in flat) > 0:
        return _build_double(flat, masks, plan, threads, progress, limit, rays)
    instead = (
        "move the scene to the origin, since spheres and cones are of single precision"
        if has_shapes
        else "leave out precision='single'"
    )
    notes = [(shift, f"{mesh[2]}vertices") for shift, mesh in zip(shifts, flat) if len(mesh[1])]
    notes += [(m._moved, f"meshes[{i}]") for i, m in enumerate(meshes) if isinstance(m, Shapes)]
    for (by, size), name in notes:
        if _PRECISION * size < by < np.inf:
            warnings.warn(
                f"{name}: rounding to float32 moves vertices by up to {by:.3g}, where the "
                f"diagonal of all is {size:.3g}; {instead}",
                PrecisionWarning,
                stacklevel=4,
            )
    rounded = iter(vertices)
    parts = [m._numbers if isinstance(m, Shapes) else (next(rounded), m[1]) for m in meshes]
    sample = as_sample(rays, Rays, stacklevel=5)
    with _progress(progress) as show:
        return Core.build(parts, masks, plan, threads, show, limit, sample)


def _build_double(
    meshes: list[_Mesh],
    masks: list[int],
    plan: tuple[str, str],
    threads: int,
    progress: bool | Callable[[float], object] | None,
    limit: int | None,
    rays: RaySample | None,
) -> DoubleCore:
    vertices, faces, starts, first = [], [], [0], 0
    width = max(mesh[1].shape[1] for mesh in meshes)
    for given, corners, name in meshes:
        if corners.shape[1] < width:
            corners = np.concatenate([corners, corners[:, 2:]], axis=1)
        array = as_float64(given)
        wrong = ~(np.abs(array) <= _LARGEST)
        if wrong.any():
            index = int(np.argmax(wrong.any(axis=1)))
            x, y, z = array[index].tolist()
            raise ArgumentError(
                f"{name}vertices[{index}] is ({x:g}, {y:g}, {z:g}); expected finite numbers of at "
                f"most {_LARGEST:g} in size",
                f"{name}vertices",
                index,
            )
        vertices.append(array)
        faces.append(corners + np.uint32(first) if first else corners)
        first += len(array)
        starts.append(starts[-1] + len(corners))
    if first > 2**32 - 1 or starts[-1] > 2**32 - 1:
        raise ArgumentError(f"meshes: {first} vertices are too many; expected less than 2^32", "meshes")
    v, f = vertices[0], faces[0]
    if len(meshes) > 1:
        v, f = np.concatenate(vertices), np.concatenate(faces)
    sample = as_sample(rays, DoubleRays, stacklevel=6)
    with _progress(progress) as show:
        return DoubleCore.build(v, f, starts, masks, plan, threads, show, limit, sample)


def _plan(preset: str, cost_model: str) -> tuple[str, str]:
    """Names of a preset and a cost model, which the extension module knows."""
    for name, value in (("preset", preset), ("cost_model", cost_model)):
        if not isinstance(value, str):
            raise ArgumentTypeError(f"{name}: expected a string, found {type(value).__name__}", name)
    return preset, cost_model


def _mesh(vertices: ArrayLike, faces: ArrayLike, name: str) -> _Mesh:
    given = as_rows(vertices, f"{name}vertices")
    return given, as_faces(faces, f"{name}faces", len(given)), name


def _mesh_masks(masks: ArrayLike, count: int, what: str) -> list[int]:
    bits = as_masks(masks, "masks").tolist()
    if not isinstance(bits, list) or len(bits) != count:
        raise ArgumentError(
            f"masks: expected {count} masks, one {'an' if what[0] == 'i' else 'a'} {what}, found {bits}",
            "masks",
        )
    return bits


def _matrix(matrix: ArrayLike | None, name: str, index: int) -> np.ndarray:
    """Three rows of an affine transform."""
    if matrix is None:
        return np.eye(3, 4)
    array = as_float64(as_array(matrix, f"{name}: matrix"))
    if array.shape not in ((3, 4), (4, 4)):
        raise ArgumentError(
            f"{name}: expected a matrix of shape (3, 4) or (4, 4), found {array.shape}",
            "instances",
            index,
        )
    if array.shape == (4, 4) and not np.array_equal(array[3], [0, 0, 0, 1]):
        raise ArgumentError(
            f"{name}: expected a matrix whose last row is (0, 0, 0, 1), found {tuple(array[3].tolist())}",
            "instances",
            index,
        )
    return array[:3]


def _share(show: Callable[[float], object], done: float, part: float) -> Callable[[float], object]:
    """Progress of one of several builds."""
    return lambda share: show(done + part * share)


@contextmanager
def _progress(
    progress: bool | Callable[[float], object] | None,
) -> Iterator[Callable[[float], object] | None]:
    """A function of the share done: the caller's, that of a bar, or None."""
    if progress is None or progress is False:
        yield None
        return
    if callable(progress):
        yield progress
        return
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped]
    except ImportError:
        yield None
        return
    bar_format = "{l_bar}{bar}| {elapsed}<{remaining}"
    with tqdm(total=1.0, desc="ropewalk", bar_format=bar_format) as bar:
        yield lambda share: bar.update(max(0.0, share - bar.n))
