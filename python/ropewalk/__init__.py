"""Ray casting on kd-trees: closest, any, all and first hits, and points, from NumPy arrays.

>>> import numpy as np, ropewalk
>>> scene = ropewalk.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
>>> hits = scene.closest_hit([[0.2, 0.2, 1.0], [2.0, 2.0, 1.0]], [0, 0, -1])
>>> hits.t
array([ 1., inf], dtype=float32)

Answers are those of brute force in double precision over vertices and rays rounded to float32, for any
number of threads and any processor.
"""

from importlib.metadata import version as _version


from ._errors import (
    ArgumentError,
    ArgumentTypeError,
    InternalError,
    InvalidPointError,
    InvalidPointWarning,
    InvalidRayError,
    InvalidRayWarning,
    OtherGeometryError,
    OutOfMemoryError,
    PrecisionWarning,
    RopewalkError,
    SceneFileError,
    SceneNotFoundError,
    SceneReadError,
    SceneWriteError,
)
from ._hits import HitLists, Hits
from ._mesh import Instances, read_instances, read_mesh
from ._points import Cells, ClosestPoints
from ._report import Report
from ._ropewalk import default_threads, simd_level
from ._scene import Scene, load
from ._shapes import Cones, Cylinders, Spheres
from ._walker import Events, Walker

__version__ = _version("ropewalk")

__all__ = [
    "ArgumentError",
    "ArgumentTypeError",
    "Cells",
    "ClosestPoints",
    "Cones",
    "Cylinders",
    "Events",
    "HitLists",
    "Hits",
    "Instances",
    "InternalError",
    "InvalidPointError",
    "InvalidPointWarning",
    "InvalidRayError",
    "InvalidRayWarning",
    "OtherGeometryError",
    "OutOfMemoryError",
    "PrecisionWarning",
    "Report",
    "RopewalkError",
    "Scene",
    "SceneFileError",
    "SceneNotFoundError",
    "SceneReadError",
    "SceneWriteError",
    "Spheres",
    "Walker",
    "default_threads",
    "load",
    "read_instances",
    "read_mesh",
    "simd_level",
]
