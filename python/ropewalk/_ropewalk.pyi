"""The extension module. Everything in it but the first two functions is private to the package."""

from collections.abc import Callable
from typing import Literal, final

import numpy as np
from numpy.typing import NDArray

def simd_level() -> Literal["scalar", "avx2", "avx512"]: ...
def default_threads() -> int: ...
def save(core: Core | DoubleCore, path: str) -> int: ...
def open(
    path: str,
    verify: bool,
    copy: bool,
    rounded: _F32 | None = None,
    vertices: _F64 | None = None,
    faces: _U32 | None = None,
) -> Core | DoubleCore: ...

def read_mesh(
    path: str, merge: float | None = None
) -> tuple[NDArray[np.float64], NDArray[np.uint32]] | None: ...
def read_instances(
    path: str,
) -> tuple[
    list[tuple[NDArray[np.float64], NDArray[np.uint32]]],
    NDArray[np.int32],
    NDArray[np.float64],
    list[str],
    NDArray[np.int64],
] | None: ...

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]
_I32 = NDArray[np.int32]
_I64 = NDArray[np.int64]
_U32 = NDArray[np.uint32]
_State = tuple[
    NDArray[np.uint8],
    NDArray[np.uint64],
    _F32,
    list[int],
    list[int],
    tuple[str, str],
    NDArray[np.uint8] | None,
]

def cells_of(core: Core | DoubleCore, points: NDArray[np.float64], threads: int) -> _I64: ...
def walk(
    core: Core,
    positions: _F32,
    stopped: _U32,
    offsets: _I64,
    directions: _F32,
    lengths: _F32,
    stop: bool,
    threads: int,
    masks: _U32 | None = None,
    faces: str = "both",
) -> tuple[
    tuple[_F32, _U32],
    tuple[_I64, _I32, _F32, _I32, _I32, NDArray[np.bool_]],
    _I32,
    int,
]: ...
def walk_double(
    core: DoubleCore,
    positions: _F64,
    stopped: _U32,
    offsets: _I64,
    directions: _F64,
    lengths: _F64,
    stop: bool,
    threads: int,
    masks: _U32 | None = None,
    faces: str = "both",
) -> tuple[
    tuple[_F64, _U32],
    tuple[_I64, _I32, _F64, _I32, _I32, NDArray[np.bool_]],
    _I32,
    int,
]: ...
@final
class Rays:
    def __new__(
        cls,
        count: int,
        origins: _F32,
        directions: _F32,
        t_min: _F32,
        t_max: _F32,
        masks: _U32 | None = None,
        skip: _I32 | None = None,
        faces: str = "both",
    ) -> Rays: ...
    def __len__(self) -> int: ...
    def first_invalid(self) -> int | None: ...
    def invalid(self) -> tuple[int, int]: ...

@final
class DoubleRays:
    def __new__(
        cls,
        count: int,
        origins: _F64,
        directions: _F64,
        t_min: _F64,
        t_max: _F64,
        masks: _U32 | None = None,
        skip: _I32 | None = None,
        faces: str = "both",
    ) -> DoubleRays: ...
    def __len__(self) -> int: ...
    def first_invalid(self) -> int | None: ...
    def invalid(self) -> tuple[int, int]: ...

@final
class DoubleCore:
    @staticmethod
    def build(
        vertices: _F64,
        faces: _U32,
        starts: list[int],
        masks: list[int],
        plan: tuple[str, str],
        threads: int,
        progress: Callable[[float], object] | None = None,
        memory_limit: int | None = None,
        rays: DoubleRays | None = None,
    ) -> DoubleCore: ...
    @staticmethod
    def place(
        objects: list[DoubleCore],
        matrices: _F64,
        masks: list[int],
        threads: int,
    ) -> DoubleCore: ...
    def meshes(self) -> tuple[_F64, _U32]: ...
    @property
    def starts(self) -> list[int]: ...
    @property
    def masks(self) -> list[int]: ...
    @property
    def has_shapes(self) -> bool: ...
    @property
    def plan(self) -> tuple[str, str]: ...
    @property
    def bounds(self) -> tuple[list[float], list[float]] | None: ...
    def report(self) -> dict[str, object]: ...
    def closest_hit(
        self, rays: DoubleRays, threads: int, _start: _I64 | None = None
    ) -> tuple[_F64, _I32, _I32, int, int]: ...
    def occluded(
        self, rays: DoubleRays, threads: int, _start: _I64 | None = None
    ) -> tuple[NDArray[np.bool_], int, int]: ...
    def count_hits(self, rays: DoubleRays, threads: int) -> tuple[_I32, int, int]: ...
    def first_hits(
        self, rays: DoubleRays, threads: int, k: int | None = None
    ) -> tuple[_I64, _F64, _I32, _I32, int, int]: ...
    def surface(
        self,
        what: list[str],
        rays: DoubleRays,
        t: _F64,
        prim: _I32,
        geom: _I32,
        threads: int,
        ray: _I64 | None = None,
    ) -> tuple[list[_F64], int]: ...

@final
class Core:
    @staticmethod
    def build(
        meshes: list[tuple[_F32, _U32] | _F32],
        masks: list[int],
        plan: tuple[str, str],
        threads: int,
        progress: Callable[[float], object] | None = None,
        memory_limit: int | None = None,
        rays: Rays | None = None,
    ) -> Core: ...
    @staticmethod
    def load(
        path: str,
        plan: tuple[str, str],
        threads: int,
        progress: Callable[[float], object] | None = None,
        memory_limit: int | None = None,
        rays: Rays | None = None,
    ) -> Core: ...
    @staticmethod
    def from_state(
        kinds: NDArray[np.uint8],
        ends: NDArray[np.uint64],
        numbers: _F32,
        starts: list[int],
        masks: list[int],
        plan: tuple[str, str],
        threads: int,
        quads: NDArray[np.uint8] | None = None,
    ) -> Core: ...
    def state(self) -> _State: ...
    @property
    def starts(self) -> list[int]: ...
    @property
    def masks(self) -> list[int]: ...
    @property
    def has_shapes(self) -> bool: ...
    @property
    def bounds(self) -> tuple[list[float], list[float]] | None: ...
    def report(self) -> dict[str, object]: ...
    def closest_hit(
        self, rays: Rays, threads: int, start: _I64 | None = None
    ) -> tuple[_F32, _I32, _I32, int, int]: ...
    def occluded(
        self, rays: Rays, threads: int, start: _I64 | None = None
    ) -> tuple[NDArray[np.bool_], int, int]: ...
    def count_hits(self, rays: Rays, threads: int) -> tuple[_I32, int, int]: ...
    def first_hits(
        self, rays: Rays, threads: int, k: int | None = None
    ) -> tuple[_I64, _F32, _I32, _I32, int, int]: ...
    def surface(
        self,
        what: list[str],
        rays: Rays,
        t: _F32,
        prim: _I32,
        geom: _I32,
        threads: int,
        ray: _I64 | None = None,
    ) -> tuple[list[_F32], int]: ...
    def engine_seconds(self, query: str, rays: Rays) -> float: ...

@final
class Points:
    def __new__(cls, core: Core | DoubleCore) -> Points: ...
    def invalid(self, points: _F64) -> tuple[int, int]: ...
    def closest_point(
        self, points: _F64, threads: int
    ) -> tuple[_F64, _I32, _I32, _F64, _F64]: ...
    def distance(self, points: _F64, signed: bool, threads: int) -> _F64: ...
    def contains(self, points: _F64, winding: bool, threads: int) -> NDArray[np.bool_]: ...
    def winding_number(self, points: _F64, accuracy: float, threads: int) -> _F64: ...
    def locate(self, points: _F64, threads: int) -> _I64: ...
    def cells(self, cells: _I64 | None = None) -> tuple[_I64, _F64, _I32]: ...
