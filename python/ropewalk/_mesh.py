"""Mesh files as arrays."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from . import _ropewalk
from ._errors import ArgumentError, ArgumentTypeError, SceneFileError
from ._report import plural

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Instances(NamedTuple):
    """Meshes of a file, each once, and where they are placed; N placements.

    Attributes:
        meshes: vertices (V, 3) and triangles (F, 3) of each mesh in its own space, in the order of their first
            placement.
        mesh: int32, shape (N,): the mesh of each placement, a position in ``meshes``.
        matrices: float64, shape (N, 3, 4): from the space of the mesh to that of the file.
        names: N names of nodes, "" where there is none.
        nodes: int64, shape (N,): the node in the file, -1 where there are no nodes.
    """

    meshes: list[tuple[NDArray[np.float64], NDArray[np.uint32]]]
    mesh: NDArray[np.int32]
    matrices: NDArray[np.float64]
    names: list[str]
    nodes: NDArray[np.int64]

    def __repr__(self) -> str:
        placements = plural(len(self.mesh), "placement", "placements")
        return f"<ropewalk.Instances: {placements} of {plural(len(self.meshes), 'mesh', 'meshes')}>"


def as_path(path: str | os.PathLike[str]) -> str:
    """A path as text."""
    try:
        name = os.fsdecode(path)
        name.encode()
    except (TypeError, UnicodeError) as error:
        raise ArgumentTypeError(
            f"path: expected a path that is valid Unicode, found {path!r} ({error})", "path"
        ) from None
    return name


def as_merge(merge: bool | float) -> float | None:
    """Within which distance vertices are merged; None if they are not."""
    if isinstance(merge, (bool, np.bool_)):
        return 0.0 if merge else None
    if not isinstance(merge, (int, float, np.integer, np.floating)):
        raise ArgumentTypeError(
            f"merge: expected True, False or a distance, found {type(merge).__name__}", "merge"
        )
    distance = float(merge)
    if not 0 <= distance < np.inf:
        raise ArgumentError(
            f"merge: expected a distance that is finite and 0 or more, found {distance:g}", "merge"
        )
    return distance


def read_mesh(
    path: str | os.PathLike[str],
    *,
    merge: bool | float = False,
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file: OBJ, PLY (ascii or binary, both byte orders),
    STL (ascii or binary), OFF, or glTF 2.0 (.gltf with its buffers, .glb), also gzipped. Which of them it is
    the content tells, then the name, as for the command line.

    Positions and faces are read, nothing else. All meshes, groups and nodes of a file are one mesh, in
    their order, those of glTF moved by their nodes. Polygons become triangles in the order of their
    corners: convex ones by diagonals from a corner, others by cutting off ears. STL has three
    vertices of its own for each triangle.

    Args:
        path: the file.
        merge: True makes one of vertices at exactly the same place, a distance one of those within it: taken in their
            order, each becomes the first one kept that lies no farther (Euclidean), or is kept as it is. Faces stay,
            those that lose their area too.

    Raises:
        ArgumentError, ArgumentTypeError: a bad ``merge``.
        SceneNotFoundError: the file cannot be opened.
        SceneFileError: its content is wrong; the message says in which line, at which byte or in which
            part, and what was expected. Vertices that are not finite, faces that name no vertex or have
            fewer than 3 corners, and files without faces are refused, nothing is repaired. A glTF
            file can name buffers in its own folder and below it alone.

    >>> import pathlib, tempfile, ropewalk
    >>> path = pathlib.Path(tempfile.mkdtemp(), "one.obj")
    >>> _ = path.write_text("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> ropewalk.read_mesh(path)[1]
    array([[0, 1, 2]], dtype=uint32)
    """
    name = as_path(path)
    mesh = _ropewalk.read_mesh(name, as_merge(merge))
    if mesh is None:
        raise _not_a_mesh(name)
    return mesh


def read_instances(path: str | os.PathLike[str]) -> Instances:
    """Meshes of a glTF file, each once, and where its nodes place them (EXT_mesh_gpu_instancing among them).
    ``ropewalk.load(path, instances=True)`` makes a scene of them; placement ``i`` is ``geom_id`` ``i`` of its hits.

    Meshes without triangles are left out. All placements together, moved by their matrices, are the mesh of
    :func:`read_mesh`, which swaps the last two corners of triangles that a matrix mirrors. Files of other
    formats hold one mesh, placed where it is.

    Raises:
        SceneNotFoundError, SceneFileError: as of :func:`read_mesh`.

    >>> import pathlib, tempfile, ropewalk
    >>> path = pathlib.Path(tempfile.mkdtemp(), "one.obj")
    >>> _ = path.write_text("v 0 0 0\\nv 1 0 0\\nv 0 1 0\\nf 1 2 3\\n")
    >>> found = ropewalk.read_instances(path)
    >>> found
    <ropewalk.Instances: 1 placement of 1 mesh>
    >>> found.mesh, found.matrices.shape
    (array([0], dtype=int32), (1, 3, 4))
    """
    name = as_path(path)
    found = _ropewalk.read_instances(name)
    if found is None:
        raise _not_a_mesh(name)
    return Instances(*found)


def _not_a_mesh(name: str) -> SceneFileError:
    return SceneFileError(
        f"{name}: expected a mesh in OBJ, PLY, STL, OFF or glTF, found a scene, which ropewalk.load reads",
        "path",
    )
