"""Exceptions and warnings of the package."""

from __future__ import annotations


class RopewalkError(Exception):
    """Base of all exceptions that this package raises by itself.

    Attributes:
        argument: name of the argument at fault, such as ``"faces"``, or None.
        index: position in that argument (first axis, rays counted in C order), or None.
    """

    argument: str | None
    index: int | None

    def __init__(
        self, message: str, argument: str | None = None, index: int | None = None
    ) -> None:
        super().__init__(message)
        self.argument = argument
        self.index = index

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.argument, self.index)


class ArgumentError(RopewalkError, ValueError):
    """An argument has a shape, a value or an index that cannot be used."""


class ArgumentTypeError(RopewalkError, TypeError):
    """An argument is of a type or dtype that cannot be used."""


class InvalidRayError(ArgumentError):
    """With ``strict=True``: a ray that can hit nothing whatever the scene."""


class InvalidPointError(ArgumentError):
    """With ``strict=True``: a point that is NaN, infinite or beyond 1e100."""


class OutOfMemoryError(RopewalkError, MemoryError):
    """A tree or a result does not fit into memory or into its indices."""


class SceneFileError(RopewalkError, ValueError):
    """The content of a scene file, or the name of a built-in scene, is wrong."""


class SceneNotFoundError(SceneFileError, FileNotFoundError):
    """A scene file that cannot be opened."""


class SceneReadError(SceneFileError, OSError):
    """The system failed while a scene file was read."""


class SceneWriteError(RopewalkError, OSError):
    """A scene could not be saved; nothing is left behind, and a file that was there is untouched."""


class OtherGeometryError(SceneFileError):
    """A saved scene was built for other geometry than the one given."""


class InternalError(RopewalkError, RuntimeError):
    """A defect of this package, or threads that the system does not give."""


class InvalidRayWarning(UserWarning):
    """Some rays are NaN, infinite or without direction; they were counted and miss."""


class InvalidPointWarning(UserWarning):
    """Some points are NaN, infinite or beyond 1e100; they were counted and have no answer."""


class PrecisionWarning(UserWarning):
    """Rounding vertices to float32 loses detail that their size shows."""
