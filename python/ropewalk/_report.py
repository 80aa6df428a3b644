"""What a build did."""

from __future__ import annotations

from dataclasses import dataclass, fields
from html import escape
from math import log1p


@dataclass(frozen=True)
class Report:
    """Figures of a scene's tree.

    Predictions are those of the surface-area measure (MacDonald and Booth 1990) for a line that
    crosses the scene's box and ends nowhere: a ray that hits something needs less.

    >>> import ropewalk
    >>> report = ropewalk.load("spd:tetra:3").report
    >>> report.primitives, report.preset, report.tree_bytes > 0
    (64, 'balanced', True)
    """

    #: Preset of the build.
    preset: str
    #: Cost model of the build; None for a scene that was opened.
    cost_model: str | None
    #: Sample rays that steered the build.
    sample_rays: int
    #: Number of meshes.
    meshes: int
    #: Number of primitives, degenerate ones included; a quad is one.
    primitives: int
    #: Primitives without area, of quads their triangles; they are kept and never hit.
    degenerate: int
    #: References to primitives in leaves, of quads to their triangles.
    references: int
    #: References per primitive, of quads per triangle; 0 for an empty scene.
    duplication: float
    #: Inner nodes of the binary tree.
    inner_nodes: int
    #: Leaves, empty ones included.
    leaves: int
    #: Empty leaves.
    empty_leaves: int
    #: Depth of the deepest leaf; the root's is 0.
    max_depth: int
    #: Bytes of the tree, its own copy of the triangles included.
    tree_bytes: int
    #: Bytes of the primitives as given.
    geometry_bytes: int
    #: Inner nodes of the binary tree that a line visits; the wide tree takes up to three in a step.
    predicted_steps: float
    #: Leaves that a line visits.
    predicted_leaves: float
    #: Primitives that a line is tested against, one by one; blocks of eight are tested at once.
    predicted_tests: float
    #: Number of leaves by number of references; the last entry holds all larger ones.
    leaf_sizes: list[int]
    #: Seconds of the build by the clock; 0 for a scene that was opened.
    seconds: float

    @property
    def bytes_per_primitive(self) -> float:
        """Bytes of the tree per primitive; 0 for an empty scene."""
        return self.tree_bytes / self.primitives if self.primitives else 0.0

    def _rows(self) -> list[tuple[str, str]]:
        return [
            ("primitives", f"{self.primitives:,} in {plural(self.meshes, 'mesh', 'meshes')}"),
            ("degenerate", f"{self.degenerate:,}"),
            ("tree", f"{size_of(self.tree_bytes)}, {self.bytes_per_primitive:.0f} bytes a primitive"),
            ("geometry", size_of(self.geometry_bytes)),
            ("duplication", f"{self.duplication:.2f} references a primitive"),
            ("leaves", f"{self.leaves:,}, {self.empty_leaves:,} of them empty"),
            ("depth", str(self.max_depth)),
            ("predicted for a line", f"{self.predicted_steps:.1f} steps, {self.predicted_tests:.1f} tests"),
            ("build", f"{self._build_time()}, preset {self.preset}{self._steered_by()}"),
        ]

    def _build_time(self) -> str:
        return f"{self.seconds:.3g} s" if self.seconds else "saved"

    def _steered_by(self) -> str:
        model = self.cost_model if self.cost_model not in (None, "surface_area") else None
        rays = f"{self.sample_rays:,} rays" if self.sample_rays else None
        return "".join(f", {part}" for part in (model, rays) if part)

    def __str__(self) -> str:
        rows = self._rows()
        width = max(len(name) for name, _ in rows)
        return "\n".join(f"{name:{width}}  {value}" for name, value in rows)

    def _repr_html_(self) -> str:
        rows = (
            f"<tr><th style='text-align:left'>{escape(k)}</th><td style='text-align:left'>{escape(v)}</td></tr>"
            for k, v in self._rows()
        )
        return f"<table>{''.join(rows)}</table>{self._histogram()}"

    def _histogram(self) -> str:
        """Leaves by number of references as a small picture, heights by their logarithms."""
        last = max((size for size, count in enumerate(self.leaf_sizes) if count), default=0)
        counts = self.leaf_sizes[: max(last, 8) + 1]
        top = log1p(max(counts))
        if top == 0:
            return ""
        width, height = 9, 60
        bars = []
        for size, count in enumerate(counts):
            tall = height * log1p(count) / top
            more = " or more" if size == len(self.leaf_sizes) - 1 else ""
            bars.append(
                f"<rect x='{width * size}' y='{height - tall:.1f}' width='{width - 1}' height='{tall:.1f}' "
                f"fill='#3b6ea5'><title>{count:,} leaves of {size}{more}</title></rect>"
            )
        wide = width * len(counts)
        return (
            f"<svg width='{wide}' height='{height + 14}' role='img' aria-label='leaves by size'>"
            f"{''.join(bars)}<text x='0' y='{height + 12}' font-size='10' fill='currentColor'>0</text>"
            f"<text x='{wide - 1}' y='{height + 12}' font-size='10' fill='currentColor' text-anchor='end'>"
            f"{len(counts) - 1} references in a leaf</text></svg>"
        )


def report_of(figures: dict[str, object]) -> Report:
    """The report of the extension module's figures."""
    return Report(**{field.name: figures[field.name] for field in fields(Report)})  # type: ignore[arg-type]


def plural(count: int, one: str, many: str) -> str:
    """A number with its noun."""
    return f"{count:,} {one if count == 1 else many}"


def size_of(count: float) -> str:
    """Bytes for people."""
    for unit in ("bytes", "KiB", "MiB"):
        if count < 1024:
            return f"{count:.0f} {unit}" if unit == "bytes" else f"{count:.1f} {unit}"
        count /= 1024
    return f"{count:.2f} GiB"
