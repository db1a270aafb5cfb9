"""The command that checks every kind of domain against exact distances."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

import heat_igl
from heat_igl.cli.options import JsonOption
from heat_igl.cli.output import check_json, print_json, prints_json, say
from heat_igl.validation.domains import DOMAINS, LEGEND, DomainReport

__all__ = ["validate_domains"]


def validate_domains(
    domain: Annotated[
        list[str] | None, typer.Option(help=f"Only this kind, may be repeated: {', '.join(DOMAINS)}.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="For random points, tetrahedra and sources.")] = 0,
    json_file: JsonOption = None,
) -> None:
    """Errors on points, metrics, tetrahedra, polygons and images against exact distances; 1 if one is too large."""
    check_json(json_file)
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        report = heat_igl.validate_domains(
            domain or None,
            seed=seed,
            progress=lambda label, done, total: bar.update(task, description=label, completed=done, total=total),
        )
    if json_file is not None:
        print_json(report.to_dict(), json_file)
    if not prints_json(json_file):
        _print(report)
    if report.failed:
        say(f"{len(report.failed)} of {len(report.rows)} rows did not pass: {_names(report)}")
        raise typer.Exit(1)


def _names(report: DomainReport) -> str:
    return "; ".join(f"{row.case}, {row.method}" for row in report.failed)


def _print(report: DomainReport) -> None:
    """A table that fits a terminal, and Markdown with all columns for anything else."""
    console = Console(highlight=False)
    if not console.is_terminal:
        print(report.to_markdown(), end="")
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in ("case", "method"):
        table.add_column(head)
    for head in ("mean %", "bound %"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("passed")
    for row in report.rows:
        mean = "failed" if row.mean is None else f"{100 * row.mean:.2g}"
        table.add_row(row.case, row.method, mean, f"{100 * row.bound:g}", "yes" if row.passed else "NO")
    console.print(table)
    console.print(f"\n{LEGEND}")
