"""``embreex.rtcore``: the device, which there is nothing to say of."""

from __future__ import annotations

from ..._ropewalk import simd_level

__all__ = ["EmbreeDevice"]


class EmbreeDevice:
    """Stands for an Embree device, so that scripts which make one run.

    >>> scene_device = EmbreeDevice()
    """

    def __repr__(self) -> str:
        from ... import __version__

        return f"Ropewalk version:  {__version__} ({simd_level()}) in place of Embree"
