"""``embreex.mesh_construction``: meshes that are added to scenes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..._arrays import ArrayLike, as_array, as_rows
from ..._errors import ArgumentError, ArgumentTypeError
from .rtcore_scene import EmbreeScene, as_scene

__all__ = ["ElementMesh", "TriangleMesh"]

#: Two triangles for each face of a hexahedron, in the node order of Exodus II and in embreex's order.
_HEXAHEDRON = [
    [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
    [1, 2, 6], [1, 6, 5], [0, 7, 3], [0, 4, 7], [3, 6, 2], [3, 7, 6],
]  # fmt: skip

#: The faces of a tetrahedron, in embreex's order.
_TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


class TriangleMesh:
    """Triangles, added to a scene as its next geometry; arrays are copied.

    Args:
        scene: the :class:`~ropewalk.compat.embreex.rtcore_scene.EmbreeScene`.
        vertices: shape (V, 3), or (F, 3, 3) without ``indices``, rounded to float32.
        indices: integers of shape (F, 3), or None.

    Raises:
        ArgumentError: (ValueError) wrong shapes, vertices that are not finite, indices that name no vertex.
        ArgumentTypeError: (TypeError) arrays that are no real numbers, indices that are no integers, something
            else than a scene.

    >>> from ropewalk.compat.embreex import EmbreeScene
    >>> scene = EmbreeScene()
    >>> first = TriangleMesh(scene, [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    >>> second = TriangleMesh(scene, [[0, 0, 1], [1, 0, 1], [0, 1, 1]], [[0, 1, 2]])
    >>> scene.run([[0.2, 0.2, 3]], [[0, 0, -1]], output=1)["geomID"]
    array([1], dtype=int32)
    """

    def __init__(
        self, scene: EmbreeScene, vertices: ArrayLike, indices: ArrayLike | None = None
    ) -> None:
        meshes = as_scene(scene)
        if indices is None:
            array = np.asarray(as_array(vertices, "vertices"))
            if array.ndim != 3 or array.shape[1:] != (3, 3):
                raise ArgumentError(
                    f"vertices: expected an array of shape (F, 3, 3) without indices, found {array.shape}",
                    "vertices",
                )
            vertices = array.reshape(-1, 3)
            indices = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
        meshes.add(vertices, indices, ("vertices", "indices"))


class ElementMesh(TriangleMesh):
    """Surfaces of tetrahedra or hexahedra: 4 triangles for each one, or 12.

    Triangle ``i`` belongs to element ``i // 4`` or ``i // 12``. Faces between elements are there twice.

    Args:
        scene: the :class:`~ropewalk.compat.embreex.rtcore_scene.EmbreeScene`.
        vertices: shape (V, 3), rounded to float32.
        indices: integers of shape (E, 4), or (E, 8) in the node order of Exodus II.

    Raises:
        ArgumentError, ArgumentTypeError: as :class:`TriangleMesh`.

    >>> from ropewalk.compat.embreex import EmbreeScene
    >>> scene = EmbreeScene()
    >>> mesh = ElementMesh(scene, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    >>> scene.run([[0.2, 0.2, -1]], [[0, 0, 1]])
    array([0], dtype=int32)
    """

    def __init__(self, scene: EmbreeScene, vertices: ArrayLike, indices: ArrayLike) -> None:
        elements: Any = np.asarray(as_array(indices, "indices"))
        if elements.ndim != 2 or elements.shape[1] not in (4, 8):
            raise ArgumentError(
                f"indices: expected an array of shape (E, 4) or (E, 8), found {elements.shape}", "indices"
            )
        if elements.dtype.kind == "f":
            raise ArgumentTypeError(
                f"indices: expected integers, found dtype {elements.dtype}", "indices"
            )
        given = as_rows(vertices, "vertices")
        wrong = (elements < 0) | (elements >= len(given))
        if wrong.any():
            index = int(np.argmax(wrong.any(axis=1)))
            found = int(elements[index][wrong[index]][0])
            raise ArgumentError(
                f"indices[{index}] names vertex {found}; expected 0 to {len(given) - 1}", "indices", index
            )
        table = np.array(_HEXAHEDRON if elements.shape[1] == 8 else _TETRAHEDRON)
        super().__init__(scene, given, elements[:, table].reshape(-1, 3))
