"""What users give, as contiguous arrays that the extension module takes."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._errors import ArgumentError, ArgumentTypeError
from ._ropewalk import default_threads

#: The most threads that can be asked for.
MAX_THREADS = 1024

#: Any numeric array: NumPy's, nested sequences, or what has DLPack, the array interface or the
#: buffer protocol (torch CPU tensors do).
ArrayLike = Any


def as_array(value: ArrayLike, argument: str) -> np.ndarray:
    """A NumPy array that shares memory with ``value`` where that is possible."""
    array: np.ndarray
    if isinstance(value, np.ndarray):
        array = value
    else:
        has_array = hasattr(value, "__array__") or hasattr(value, "__array_interface__")
        try:
            if hasattr(value, "__dlpack__") and not has_array:
                array = np.from_dlpack(value)
            else:
                array = np.asarray(value)
        except Exception as error:
            raise ArgumentTypeError(
                f"{argument}: expected a numeric array in the memory of the CPU, found "
                f"{type(value).__name__} ({error})",
                argument,
            ) from error
    if array.dtype.kind not in "fiu":
        raise ArgumentTypeError(
            f"{argument}: expected an array of real numbers, found dtype {array.dtype}", argument
        )
    return array


def as_float32(array: np.ndarray) -> np.ndarray:
    """Rounded to float32, C-contiguous and aligned; the array itself where it is so already.

    Numbers beyond float32 become infinite, which the caller refuses or counts.
    """
    if array.dtype == np.float32 and array.dtype.isnative:
        return np.require(array, requirements=("C", "A"))
    with np.errstate(over="ignore", under="ignore"):
        return np.require(array, dtype=np.float32, requirements=("C", "A"))


def as_float64(array: np.ndarray) -> np.ndarray:
    """As float64, C-contiguous and aligned; the array itself where it is so already."""
    return np.require(array, dtype=np.float64, requirements=("C", "A"))


def as_points(value: ArrayLike, argument: str) -> np.ndarray:
    """An array of shape (..., 3)."""
    array = as_array(value, argument)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ArgumentError(
            f"{argument}: expected an array of shape (..., 3), found {array.shape}", argument
        )
    return array


def as_rows(value: ArrayLike, argument: str) -> np.ndarray:
    """An array of shape (N, 3); an empty sequence is (0, 3)."""
    array = as_array(value, argument)
    if array.shape == (0,):
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ArgumentError(
            f"{argument}: expected an array of shape (N, 3), found {array.shape}", argument
        )
    return array


def as_integer(value: Any, argument: str, low: int, high: int) -> int:
    """An integer from ``low`` to ``high``."""
    try:
        number = value.__index__()
    except AttributeError:
        raise ArgumentTypeError(
            f"{argument}: expected an integer, found {type(value).__name__}", argument
        ) from None
    if not low <= number <= high:
        raise ArgumentError(f"{argument}: expected {low} to {high}, found {number}", argument)
    return int(number)


def as_threads(value: Any) -> int:
    """A number of threads; 0 is as many as this process may run on."""
    return as_integer(value, "threads", 0, MAX_THREADS) or default_threads()


def as_limit(value: Any) -> int | None:
    """Bytes, or no limit."""
    return None if value is None else as_integer(value, "memory_limit", 0, 2**63 - 1)


def as_choice(value: Any, argument: str, choices: tuple[str, ...]) -> str:
    """One of some words."""
    if not isinstance(value, str):
        raise ArgumentTypeError(
            f"{argument}: expected a string, found {type(value).__name__}", argument
        )
    if value not in choices:
        expected = ", ".join(map(repr, choices))
        raise ArgumentError(f"{argument}: expected one of {expected}, found {value!r}", argument)
    return value


def as_faces(value: ArrayLike, argument: str, vertices: int) -> np.ndarray:
    """Faces as uint32, shape (N, 3) or (N, 4), every index checked before it is narrowed."""
    faces = as_array(value, argument)
    if faces.shape == (0,):
        faces = faces.reshape(0, 3)
    if faces.ndim != 2 or faces.shape[1] not in (3, 4):
        raise ArgumentError(
            f"{argument}: expected an array of shape (N, 3) or (N, 4), found {faces.shape}", argument
        )
    if faces.size == 0:
        return np.empty((0, faces.shape[1]), np.uint32)
    if faces.dtype.kind == "f":
        raise ArgumentTypeError(
            f"{argument}: expected integers, found dtype {faces.dtype}", argument
        )
    if faces.min() < 0 or faces.max() >= vertices:
        wrong = (faces < 0) | (faces >= vertices)
        face = int(np.argmax(wrong.any(axis=1)))
        found = int(faces[face][wrong[face]][0])
        expected = f"expected 0 to {vertices - 1}" if vertices else "there are no vertices"
        if found == -1 and faces.shape[1] == 4:
            expected += "; a triangle among quads has its third index twice"
        raise ArgumentError(f"{argument}[{face}] names vertex {found}; {expected}", argument, face)
    if faces.dtype == np.int32 and faces.dtype.isnative and faces.flags.c_contiguous:
        faces = faces.view(np.uint32)
    return np.require(faces, dtype=np.uint32, requirements=("C", "A"))


def as_masks(value: ArrayLike, argument: str) -> np.ndarray:
    """Bit masks as uint32; negative numbers of 32 bits stand for their bits."""
    array = as_array(value, argument)
    if array.dtype.kind == "f" and array.size:
        raise ArgumentTypeError(
            f"{argument}: expected integers, found dtype {array.dtype}", argument
        )
    if array.size and array.dtype != np.uint32:
        low, high = int(array.min()), int(array.max())
        if low < -(2**31) or high >= 2**32:
            wrong = low if low < -(2**31) else high
            raise ArgumentError(f"{argument}: expected masks of 32 bits, found {wrong}", argument)
        array = array.astype(np.uint32 if high > 2**31 - 1 and low >= 0 else np.int64)
        array = array.astype(np.uint32)
    return np.require(array, dtype=np.uint32, requirements=("C", "A"))


def per_ray(array: np.ndarray, shape: tuple[int, ...], argument: str) -> np.ndarray:
    """One entry for all rays, or one for each of ``shape``, as a flat array."""
    if array.size == 1:
        return array.reshape(1)
    if array.shape == shape:
        return array.reshape(-1)
    try:
        return np.ascontiguousarray(np.broadcast_to(array, shape)).reshape(-1)
    except ValueError:
        raise ArgumentError(
            f"{argument}: expected a scalar or an array of the rays' shape {shape}, "
            f"found {array.shape}",
            argument,
        ) from None


def moved(given: np.ndarray, rounded: np.ndarray) -> tuple[float, float]:
    """By how much rounding moves points at most, and the diagonal of all; bit by bit, to spare memory.

    Infinite for numbers beyond float32, 0 where a number is none.
    """
    kind, size = given.dtype.kind, given.dtype.itemsize
    if (kind == "f" and size <= 4) or (kind in "iu" and size <= 2) or not len(given):
        return 0.0, 0.0
    if not np.isfinite(rounded).all():
        return (np.inf if np.isfinite(given).all() else 0.0), 0.0
    span = rounded.max(axis=0).astype(np.float64) - rounded.min(axis=0)
    step, worst = 1 << 16, 0.0
    for start in range(0, len(given), step):
        part = slice(start, start + step)
        worst = max(worst, float(np.abs(given[part] - rounded[part].astype(np.float64)).max()))
    return worst, float(np.linalg.norm(span))
