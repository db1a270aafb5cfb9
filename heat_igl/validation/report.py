"""The result of a validation, with its rows of numbers as a dictionary, as Markdown, or as a figure."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.drawing.figure import fitted, mark_dots, surface_image
from heat_igl.drawing.raster import to_pixels
from heat_igl.drawing.scene import Scene, colours, scene
from heat_igl.errors import MissingExtraError
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.metrics import BoundViolations, ErrorSummary, relative_error

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Columns of a table: the attribute of `ValidationRow`, and the factor that converts it to the unit of the column.
_COLUMNS = {
    "mean %": ("errors.mean", 1e2),
    "median %": ("errors.median", 1e2),
    "95 % %": ("errors.percentile_95", 1e2),
    "max %": ("errors.maximum", 1e2),
    "L1 %": ("errors.l1", 1e2),
    "L2 %": ("errors.l2", 1e2),
    "L-inf %": ("errors.l_infinity", 1e2),
    "near field %": ("errors.near_field", 1e2),
    "eikonal": ("eikonal", 1),
    "below line": ("bounds.n_below", 1),
    "above edges": ("bounds.n_above", 1),
    "precompute s": ("precompute_seconds", 1),
    "solve ms": ("solve_seconds", 1e3),
    "memory MB": ("peak_memory", 1e-6),
}

# Errors from 0.001 % to 10 %, the range in which methods differ. All panels share it, so that they can be compared.
_LOWEST, _HIGHEST = 1e-5, 1e-1
_ACROSS, _ROW_INCHES = 3, 3.2
_PIXELS_ACROSS, _LARGEST_ROWS = 560, 450  # of the picture of the surface


@dataclass(frozen=True)
class ValidationRow:
    """One method on one mesh.

    Attributes
    ----------
    method : str
        Name of the method.
    parameters : dict
        The parameters that it was given or chose itself.
    errors : ErrorSummary or None
        Errors against the reference; None without a reference, or if the method failed.
    eikonal : float or None
        Mean over faces, weighted by area, of | |grad d| - 1 |.
    bounds : BoundViolations or None
        Sums and maxima over the sets of sources.
    asymmetry : float or None
        Largest |d(a, b) - d(b, a)|, divided by the mean of both; None unless there are at least two sets of sources and
        each is a single vertex.
    triangle_excess : float or None
        Largest violation of the triangle inequality, see `TriangleViolations.largest`; None likewise.
    precompute_seconds, solve_seconds : float or None
        Time for the part that depends on the mesh alone; median over the sets of sources of the time for the rest.
    peak_memory : int or None
        Bytes by which the process that ran the method grew at most.
    notes : tuple of str
        Warnings about accuracy that the method gave.
    failure : str or None
        The reason why the method failed; None if it did not.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.disk(20)
    >>> report = heat_igl.validate(mesh, 0, methods=["exact"], reference=heat_igl.validation.closed_forms.plane)
    >>> row = report.rows[0]
    >>> row.failure is None, row.errors.n_compared == mesh.n_vertices - 1, row.errors.maximum < 1e-9
    (True, True, True)
    """

    method: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    errors: ErrorSummary | None = None
    eikonal: float | None = None
    bounds: BoundViolations | None = None
    asymmetry: float | None = None
    triangle_excess: float | None = None
    precompute_seconds: float | None = None
    solve_seconds: float | None = None
    peak_memory: int | None = None
    notes: tuple[str, ...] = ()
    failure: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """The row as values that JSON can carry; an infinite error becomes the string ``"inf"``."""
        return {name: plain(value) for name, value in asdict(self).items()}

    def cells(self, columns: Sequence[str] = tuple(_COLUMNS)) -> list[str]:
        """The cells of a table below some of the columns of `ValidationReport.to_markdown`, the method first."""
        if self.failure is not None:
            return [self.method, "failed"] + ["-"] * (len(columns) - 1)
        return [self.method, *(self._cell(*_COLUMNS[column]) for column in columns)]

    def _cell(self, path: str, factor: float) -> str:
        value: Any = self
        for name in path.split("."):
            value = getattr(value, name, None)
        if value is None:
            return "-"
        return str(value) if factor == 1 and isinstance(value, int) else f"{factor * value:.3g}"


@dataclass(frozen=True, eq=False)
class ValidationReport:
    """Several methods on one mesh against one reference; made by `heat_igl.validate`.

    Attributes
    ----------
    name : str
        Name of the mesh.
    mesh : Mesh
        The mesh.
    reference : str or None
        The reference that the errors are measured against.
    source_sets : tuple of (k_i,) int64
        The sets of sources, one distance each.
    rows : tuple of ValidationRow
        In the order asked for.
    truths : (k, n) float64 or None
        Distances of the reference.
    distances : dict of str to (k, n) float64
        Distances of each method that did not fail.
    failure : str or None
        The reason why the reference failed, which leaves the errors of all rows empty; None if it did not.

    Examples
    --------
    >>> import heat_igl
    >>> from heat_igl.validation import closed_forms
    >>> mesh = heat_igl.shapes.disk(20)
    >>> report = heat_igl.validate(mesh, 0, methods=["heat", "exact"], reference=closed_forms.plane)
    >>> bool(abs(report.distances["exact"] - report.truths).max() < 1e-9)
    True
    >>> print(report.to_markdown().splitlines()[0])
    **mesh**: 1261 vertices, 2400 faces, 1 set of sources, errors against plane
    """

    name: str
    mesh: Mesh
    reference: str | None
    source_sets: tuple[IntArray, ...]
    rows: tuple[ValidationRow, ...]
    truths: FloatArray | None = field(repr=False)
    distances: Mapping[str, FloatArray] = field(repr=False)
    failure: str | None = None

    def exceeding(self, percent: float) -> tuple[ValidationRow, ...]:
        """The rows that do not prove a mean relative error of at most `percent`.

        A row that failed proves nothing and is included, as is one that calls reachable vertices unreachable or the
        other way round. Without a reference, all rows are.
        """
        return tuple(
            row
            for row in self.rows
            # Written so that NaN, which is no proof either, is included.
            if row.errors is None or row.errors.n_wrong_reach or not row.errors.mean * 100 <= percent
        )

    def to_dict(self) -> dict[str, Any]:
        """The report without the arrays, as values that JSON can carry."""
        return {
            "name": self.name,
            "n_vertices": self.mesh.n_vertices,
            "n_faces": self.mesh.n_faces,
            "reference": self.reference,
            "reference_failure": self.failure,
            "sources": [sources.tolist() for sources in self.source_sets],
            "rows": [row.to_dict() for row in self.rows],
        }

    def to_markdown(self, columns: Sequence[str] = tuple(_COLUMNS)) -> str:
        """A table with one line per method, errors in percent, and below it why a method failed or warned.

        All columns, or those of some names.
        """
        against = f"errors against {self.reference}" if self.reference else "no reference"
        if self.failure is not None:
            against = f"no errors, since {self.reference} failed"
        lines = [
            f"**{self.name}**: {self.mesh.n_vertices} vertices, {self.mesh.n_faces} faces, "
            f"{len(self.source_sets)} {'set' if len(self.source_sets) == 1 else 'sets'} of sources, {against}",
            "",
            "| " + " | ".join(("method", *columns)) + " |",
            "|---" + "|---:" * len(columns) + "|",
        ]
        lines += ["| " + " | ".join(row.cells(columns)) + " |" for row in self.rows]
        said = [] if self.failure is None else [(f"reference {self.reference}", self.failure)]
        said += [(row.method, text) for row in self.rows for text in (row.failure, *row.notes) if text]
        remarks = ["", *(f"- {method}: {text}" for method, text in said)] if said else []
        return "\n".join([*lines, *remarks]) + "\n"

    def plot(self, case: int = 0) -> Figure:
        """Relative error of each method: on the surface, and against distance.

        Parameters
        ----------
        case : int
            Index of the set of sources.

        Returns
        -------
        matplotlib.figure.Figure
            Save it with ``figure.savefig(path)``.

        Raises
        ------
        MissingExtraError
            If matplotlib is not installed (extra ``view``).
        ValueError
            If there is no reference, or nothing to draw.
        """
        if self.truths is None or not self.distances:
            reason = self.failure or "the report has no reference, or every method failed"
            raise ValueError(f"there are no errors to draw: {reason}")
        title = f"{self.name}: relative error against {self.reference}"
        distances = {method: rows[case] for method, rows in self.distances.items()}
        return error_figure(title, self.mesh, self.truths[case], distances)


def plain(value: Any) -> Any:
    """A value that JSON can carry. It has no infinity and no NaN, which become text."""
    if isinstance(value, Mapping):
        return {str(name): plain(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(float(value))
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return plain(value.tolist()) if hasattr(value, "tolist") else str(value)


def error_figure(title: str, mesh: Mesh, truth: FloatArray, distances: Mapping[str, FloatArray]) -> Figure:
    """A figure with two panels for each method: its error on the surface, and below that against distance.

    `truth` (n,) is what each of the `distances` (n,) is compared with. The surface is seen as `heat_igl.plots.plot`
    shows it. A MissingExtraError without matplotlib.
    """
    with MissingExtraError.guard("a figure", "matplotlib", "view"):
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import LogNorm
        from matplotlib.figure import Figure
    across = min(_ACROSS, len(distances))
    down = -(-len(distances) // across)
    figure = Figure(figsize=(0.6 + 2.8 * across, _ROW_INCHES * down + 0.4), layout="constrained")
    figure.suptitle(title)
    axes = figure.subplots(2 * down, across, squeeze=False)
    surfaces, scatters = axes[::2].ravel(), axes[1::2].ravel()
    for empty in (*surfaces[len(distances) :], *scatters[len(distances) :]):
        empty.set_axis_off()
    norm = LogNorm(_LOWEST, _HIGHEST)
    reachable = np.isfinite(truth) & (truth > 0)
    limits = float(np.log10(_LOWEST)), float(np.log10(_HIGHEST))
    seen = scene(mesh, np.zeros(mesh.n_vertices), sources=np.flatnonzero(truth == 0), limits=limits)
    table = colours("viridis", is_trimmed=False)
    for (surface, scatter), (method, distance) in zip(
        zip(surfaces, scatters, strict=True), distances.items(), strict=False
    ):
        error = np.nan_to_num(relative_error(distance, truth), nan=_HIGHEST)
        # A source has no relative error; it is drawn as if it had the smallest. Unreachable vertices have no colour.
        shown = np.where(reachable, np.clip(error, _LOWEST, _HIGHEST), np.where(truth == 0, _LOWEST, np.inf))
        _paint(surface, replace(seen, values=np.log10(shown)), table)
        surface.set_title(method, fontsize=10)
        size = float(np.clip(60 / np.sqrt(reachable.sum()), 0.3, 3))
        errors = np.maximum(error[reachable], _LOWEST)
        scatter.plot(truth[reachable], errors, "o", ms=size, mew=0, color="tab:blue", rasterized=True)
        scatter.set(yscale="log", ylim=(_LOWEST / 2, 1), xlim=(0, truth[reachable].max()))
        scatter.grid(visible=True, alpha=0.3)
    figure.colorbar(ScalarMappable(norm, table), ax=axes, extend="both", label="relative error", shrink=0.5)
    for row in axes[1::2]:
        row[0].set_ylabel("relative error")
    for scatter in axes[-1]:
        scatter.set_xlabel("distance")
    return figure


def _paint(axes: Any, seen: Scene, table: Any) -> None:
    """Draw the surface in the colours of its values, and mark the sources."""
    _, (width, height) = seen.box
    rows = int(np.clip(_PIXELS_ACROSS * height / width, 200, _LARGEST_ROWS))
    scale, centre = fitted(seen, _PIXELS_ACROSS, rows, 0.02 * _PIXELS_ACROSS)
    image, depth = surface_image(to_pixels(seen.turned, scale, centre), seen, _PIXELS_ACROSS, rows, "plain", table)
    axes.imshow(image, interpolation="antialiased")
    mark_dots(axes, to_pixels(seen.dots @ seen.turn.T, scale, centre), depth)
    axes.set_axis_off()
