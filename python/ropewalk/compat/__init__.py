"""Drop-ins for peers: :mod:`~ropewalk.compat.trimesh`, :mod:`~ropewalk.compat.open3d` and
:mod:`~ropewalk.compat.embreex` have the names, signatures, orders, dtypes, units and signs of the packages whose
names they bear, which need not be installed.

Where a peer is known to answer wrongly (unordered, twice, not at all, at random) these do not; docs/coming-from.md
lists all that differs.

>>> import numpy as np
>>> from ropewalk.compat.embreex import mesh_construction, rtcore_scene
>>> scene = rtcore_scene.EmbreeScene()
>>> mesh = mesh_construction.TriangleMesh(scene, np.float32([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]))
>>> scene.run(np.float32([[0.2, 0.2, 1], [2, 2, 1]]), np.float32([[0, 0, -1]]))
array([ 0, -1], dtype=int32)
"""

__all__ = ["embreex", "open3d", "trimesh"]
