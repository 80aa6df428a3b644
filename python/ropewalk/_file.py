"""Saved scenes."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _ropewalk
from ._arrays import ArrayLike, as_faces, as_float32, as_float64, as_rows
from ._errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from ._ropewalk import Core, DoubleCore
    from ._scene import Scene


class Saved:
    """What :class:`Scene` has to do with files."""

    __slots__ = ()

    _core: Core | DoubleCore

    def save(self, path: str | os.PathLike[str]) -> None:
        """Saves the scene with its tree, for :meth:`open`.

        The file is written under a temporary name in the same folder and renamed once it is complete.
        The same arrays and preset give the same bytes. ``.rope`` is the usual extension.

        Args:
            path: the file; one that is there is replaced, and whoever has it open keeps it.

        Raises:
            SceneWriteError: it cannot be written, and nothing is left behind; or the scene is one of
                instances.

        >>> import os, tempfile, ropewalk
        >>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     scene.save(os.path.join(folder, "triangle.rope"))
        """
        _ropewalk.save(self._core, _path(path))

    @classmethod
    def open(
        cls,
        path: str | os.PathLike[str],
        *,
        verify: bool = False,
        copy: bool = False,
        vertices: ArrayLike | None = None,
        faces: ArrayLike | None = None,
    ) -> Scene:
        """Opens a saved scene: it is mapped into memory, nothing is copied, and processes share it.

        Header, sizes and all links of the tree are checked, so that no altered file can do harm
        (docs/file-format.md); answers are surely those of the scene that was saved only with ``verify``.

        Args:
            path: a file that :meth:`save` or ``ropewalk build --save`` wrote.
            verify: check the checksums of everything too, which reads the whole file.
            copy: read the file into memory instead. A mapped file must not be written into or cut off
                while the scene is in use: answers may be anything then, and the process may end.
                Saving over it is safe.
            vertices: with ``faces``, open the file only if the scene was made of these arrays, rounded to
                float32 unless it is of double precision.
            faces: see ``vertices``; quads as rows of four.

        Raises:
            SceneNotFoundError: the file cannot be opened.
            SceneReadError: the system does not read or map it.
            SceneFileError: it holds no saved scene, is of another version, cut off or altered; the message
                says where, what was expected and what was found.
            OtherGeometryError: it was built for other geometry.
            ArgumentError, ArgumentTypeError: bad ``vertices`` or ``faces``, as for :class:`Scene`.

        >>> import os, tempfile, ropewalk
        >>> v, f = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     path = os.path.join(folder, "triangle.rope")
        ...     ropewalk.Scene(v, f).save(path)
        ...     scene = ropewalk.Scene.open(path, vertices=v, faces=f)
        >>> float(scene.closest_hit([0.2, 0.2, 1.0], [0, 0, -1]).t)
        1.0
        """
        rounded: np.ndarray | None = None
        v: np.ndarray | None = None
        f: np.ndarray | None = None
        if (vertices is None) != (faces is None):
            raise ArgumentError("vertices, faces: expected both or none", "vertices")
        if vertices is not None and faces is not None:
            rows = as_rows(vertices, "vertices")
            rounded, v = as_float32(rows), as_float64(rows)
            f = as_faces(faces, "faces", len(v))
        core = _ropewalk.open(_path(path), bool(verify), bool(copy), rounded, v, f)
        scene: Any = cls.__new__(cls)
        scene._adopt(core)
        return scene  # type: ignore[no-any-return]


def _path(path: str | os.PathLike[str]) -> str:
    try:
        name = os.fsdecode(path)
    except TypeError as error:
        raise ArgumentTypeError(f"path: expected a path, found {path!r} ({error})", "path") from None
    if "\0" in name:
        raise ArgumentError(f"path: expected a path without NUL characters, found {path!r}", "path")
    return name
