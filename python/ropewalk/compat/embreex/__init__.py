"""A drop-in for embreex, and for pyembree, which has the same names: put ``ropewalk.compat.`` in front of
``embreex`` where it is imported.

>>> import numpy as np
>>> from ropewalk.compat.embreex import rtcore_scene as rtcs
>>> from ropewalk.compat.embreex.mesh_construction import TriangleMesh
>>> scene = rtcs.EmbreeScene()
>>> mesh = TriangleMesh(scene, np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.int32([[0, 1, 2]]))
>>> scene.run(np.float32([[0.2, 0.2, 1]]), np.float32([[0, 0, -1]]), query="DISTANCE")
array([1.], dtype=float32)

embreex itself is not needed. What differs from it is in docs/coming-from.md.
"""

from . import mesh_construction, rtcore, rtcore_scene
from .mesh_construction import ElementMesh, TriangleMesh
from .rtcore import EmbreeDevice
from .rtcore_scene import EmbreeScene

__all__ = [
    "ElementMesh",
    "EmbreeDevice",
    "EmbreeScene",
    "TriangleMesh",
    "mesh_construction",
    "rtcore",
    "rtcore_scene",
]
