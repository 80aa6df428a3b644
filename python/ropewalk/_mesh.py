"""Mesh files as arrays."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from . import _ropewalk
from ._errors import ArgumentTypeError, SceneFileError

if TYPE_CHECKING:
    from numpy.typing import NDArray


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


def read_mesh(
    path: str | os.PathLike[str],
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Vertices (V, 3) and triangles (F, 3) of a mesh file: OBJ, PLY (ascii or binary, both byte orders),
    STL (ascii or binary), OFF, or glTF 2.0 (.gltf with its buffers, .glb), also gzipped. Which of them it is
    the content tells, then the name, as for the command line.

    Positions and faces are read, nothing else. All meshes, groups and nodes of a file are one mesh, in
    their order, those of glTF moved by their nodes. Polygons become triangles in the order of their
    corners: convex ones by diagonals from a corner, others by cutting off ears. STL has three
    vertices of its own for each triangle.

    Raises:
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
    mesh = _ropewalk.read_mesh(name)
    if mesh is None:
        raise SceneFileError(
            f"{name}: expected a mesh in OBJ, PLY, STL, OFF or glTF, found a scene, which ropewalk.load reads",
            "path",
        )
    return mesh
