"""Pictures of a scene's tree; needs matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._errors import ArgumentError

if TYPE_CHECKING:
    from ._scene import Scene


def plot(scene: Scene) -> Any:
    """See :meth:`Scene.plot`."""
    try:
        import matplotlib.pyplot as plt
    except ImportError as error:
        raise ImportError("Scene.plot needs matplotlib: pip install 'ropewalk[plot]'") from error
    report = scene.report
    leaves = np.asarray(report.leaf_sizes)
    costs = _costs(scene, len(leaves))
    figure, axes = plt.subplots(
        1, 2 if costs is not None else 1, figsize=(10 if costs is not None else 5.5, 3.6),
        layout="constrained", squeeze=False,
    )  # fmt: skip
    used = np.flatnonzero(leaves)
    last = max(int(used[-1]) if len(used) else 1, 8)
    sizes = np.arange(last + 1)
    # Blocks of eight are tested at once.
    edges = np.arange(8.5, last + 0.5, 8)
    left = axes[0, 0]
    left.bar(sizes, leaves[: last + 1], width=0.85, color="#3b6ea5")
    left.set_yscale("log")
    left.set_ylim(0.7, max(leaves.max(), 1) * 1.6)
    left.set_ylabel("leaves")
    left.set_title(f"{report.leaves:,} leaves, {report.empty_leaves:,} empty", fontsize=10)
    if costs is not None:
        visits, tests = costs
        right = axes[0, 1]
        right.bar(sizes, tests[: last + 1], width=0.85, color="#c8763a", label="tests")
        right.plot(sizes, visits[: last + 1], "o-", ms=3, lw=1, color="#3b6ea5", label="visits")
        right.set_ylabel("predicted for a line")
        right.set_title(
            f"{report.predicted_steps:.1f} steps, {visits.sum():.1f} leaves, {tests.sum():.1f} tests",
            fontsize=10,
        )
        right.legend(frameon=False)
    for ax in axes[0]:
        for edge in edges:
            ax.axvline(edge, color="0.85", lw=0.8, zorder=0)
        ax.set_xlabel("primitives in the leaf" + (f" ({len(leaves) - 1}: or more)" if last == len(leaves) - 1 else ""))
        ax.spines[["top", "right"]].set_visible(False)
    figure.suptitle(
        f"{report.primitives:,} primitives, {report.duplication:.2f} references and "
        f"{report.bytes_per_primitive:.0f} bytes each, preset {report.preset}",
        fontsize=11,
    )
    return figure


def _costs(scene: Scene, bins: int) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]] | None:
    """Visits and tests of a line by size of leaf, as the surface-area measure predicts them; None
    for scenes of other primitives than triangles."""
    try:
        cells = scene.cells()
    except ArgumentError:
        return None
    edges = np.diff(cells.bounds.astype(np.float64), axis=1)[:, 0]
    area = edges[:, 0] * edges[:, 1] + edges[:, 1] * edges[:, 2] + edges[:, 2] * edges[:, 0]
    x, y, z = np.diff(scene.bounds.astype(np.float64), axis=0)[0]
    whole = x * y + y * z + z * x
    if not whole > 0:
        return None
    size = np.minimum(cells.primitives, bins - 1)
    visits = np.bincount(size, area / whole, bins)
    tests = np.bincount(size, area / whole * cells.primitives, bins)
    return visits, tests
