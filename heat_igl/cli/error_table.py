"""The errors of a validation, as a table that fits the terminal, with a legend; in pipes as Markdown."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from heat_igl.validation import ValidationReport, ValidationRow

__all__ = ["print_report"]


class _Column(NamedTuple):
    """A column: its head, what it means, its value in a row, and how early it is left out for lack of space."""

    head: str
    meaning: str
    value: Callable[[ValidationRow], float | None]
    left_out: int = 0


def _percent(name: str) -> Callable[[ValidationRow], float | None]:
    return lambda row: None if row.errors is None else 100 * float(getattr(row.errors, name))


def _bound(name: str) -> Callable[[ValidationRow], float | None]:
    return lambda row: None if row.bounds is None else float(getattr(row.bounds, name))


_COLUMNS = (
    _Column("mean", "mean of |d - exact| / exact, in percent", _percent("mean")),
    _Column("median", "median of the same", _percent("median"), 3),
    _Column("95 %", "below this at 95 % of the vertices, in percent", _percent("percentile_95"), 2),
    _Column("max", "largest of the same, in percent", _percent("maximum")),
    _Column("L2", "root of the integral of (d - exact)^2, in percent of that of exact^2", _percent("l2"), 4),
    _Column("near", "mean near the sources, in percent", _percent("near_field"), 1),
    _Column("eikonal", "mean of ||grad d| - 1| over the area", lambda row: row.eikonal, 1),
    _Column("below", "values below the straight line", _bound("n_below"), 2),
    _Column("above", "values above the path along edges", _bound("n_above"), 2),
    _Column("once s", "seconds for what depends on the mesh alone", lambda row: row.precompute_seconds),
    _Column("ms", "milliseconds for a distance after that", lambda row: row.solve_seconds and 1e3 * row.solve_seconds),
    _Column("MB", "memory by which the process grew", lambda row: row.peak_memory and row.peak_memory / 1e6, 3),
)


def print_report(report: ValidationReport) -> None:
    """Print a table with a legend to a terminal, and Markdown to anything else."""
    console = Console(highlight=False)
    if not console.is_terminal:
        print(report.to_markdown(), end="")
        return
    heading, *_, remarks = report.to_markdown().split("\n\n")
    console.print(Text(heading.replace("**", "")))
    columns: tuple[_Column, ...] = _COLUMNS
    unbounded = console.options.update(width=1000)
    for earliest in (4, 3, 2, 1):
        if console.measure(_table(report, columns), options=unbounded).maximum <= console.width:
            break
        columns = tuple(column for column in columns if column.left_out < earliest)
    console.print(_table(report, columns))
    legend = Table.grid(padding=(0, 2))
    for column in columns:
        legend.add_row(Text(column.head, "bold"), Text(column.meaning, "dim"))
    console.print(legend)
    if remarks.startswith("- "):
        console.print(Text(remarks.rstrip()))


def _table(report: ValidationReport, columns: tuple[_Column, ...]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("method", no_wrap=True)
    for column in columns:
        table.add_column(column.head, justify="right", no_wrap=True)
    for row in report.rows:
        if row.failure is not None:
            table.add_row(row.method, "failed")
            continue
        cells = (column.value(row) for column in columns)
        table.add_row(row.method, *("-" if cell is None else f"{cell:.3g}" for cell in cells))
    return table
