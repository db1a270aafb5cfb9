"""The paper's figures 1 to 5, and their data.

    python scripts/paper_figures.py                            # all, into ./paper-figures: about two minutes
    python scripts/paper_figures.py --out docs/images --figure 5     # one of them, for docs/paper.md
    python scripts/paper_figures.py --figure 1 --mesh camelhead.off --source 7
    python scripts/paper_figures.py --data --format pdf        # with the data as CSV beside them
    python scripts/paper_figures.py --quick                    # small grids, coarse curves: seconds

1  heat and distance on an animal that steps on a hot rock: any mesh, by default the cow of the pymeshlab wheel
2  processor time of precomputation and of one solve on the unit square of step 1 / i
3  error of polynomials of degree 1 to 10 fitted to them, and of a power law
4  distance from a corner of the square of step 1 / 70
5  mean error from that corner against i, and (5_jump) the same in single precision

Needs the extras ``view`` and ``fast``.
"""

from __future__ import annotations

import csv
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from heat_igl import AccuracyWarning, HeatMethodSolver, read_mesh, shapes
from heat_igl.drawing.plots import Picture, plot

from harness import Row, parsed, sample
from paper_formulas import Square, accuracy, computation_times, mean_error, polynomial_errors, power_law

WIDTH, FONT = 3.15, 7.0  # inches, one column; points
# Okabe and Ito's colours, told apart by every eye.
BLUE, ORANGE, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#777777"
COW = 2904, 751  # vertices; the one under a hoof that a picture from the side shows
SIZES, SIZES_QUICK = range(10, 301, 10), range(5, 41, 5)
# Name, picture, and the data that it shows.
Drawn = Iterator[tuple[str, Picture, list[Row]]]


def canvas(height: float, panels: int = 1, ratios: Sequence[float] | None = None) -> tuple[Any, list[Any]]:
    """A figure one column wide, without pyplot and without a display, and its panels from top to bottom."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(panels, 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for panel in axes:
        panel.tick_params(labelsize=FONT, length=2.5, width=0.5, which="both")
        panel.grid(color="0.88", linewidth=0.4)
        panel.set_axisbelow(True)
        for side, spine in panel.spines.items():
            spine.set_linewidth(0.5)
            spine.set_visible(side in ("left", "bottom"))
    return figure, list(axes)


def label(panel: Any, x: str | None, y: str) -> None:
    panel.set_xlabel(x or "", fontsize=FONT)
    panel.set_ylabel(y, fontsize=FONT)
    if panel.get_legend_handles_labels()[0]:
        panel.legend(fontsize=FONT - 0.5, frameon=False, handlelength=1.8, borderaxespad=0.2, labelspacing=0.3)


def plain_ticks(axis: Any, ticks: Sequence[float]) -> None:
    """Ticks at these places alone, written as plain numbers."""
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def round_between(low: float, high: float) -> list[float]:
    """Three or more round numbers from `low` to `high`, for a logarithmic axis."""
    found: list[float] = []
    for digits in ((1,), (1, 2, 5), (1, 1.5, 2, 3, 4, 5, 7), tuple(np.arange(10, 100) / 10)):
        found = [float(d * 10.0**e) for e in range(-6, 7) for d in digits if low <= d * 10.0**e <= high]
        if len(found) >= 3:
            break
    return found


def figure_1(options: Any) -> Drawn:
    mesh = read_mesh(options.mesh) if options.mesh else sample("cow")
    source = options.source
    if source is None:
        lowest = int(np.argmin(mesh.V[:, "xyz".index(options.up)]))
        source = lowest if options.mesh or mesh.n_vertices != COW[0] else COW[1]
    solution = HeatMethodSolver(mesh).solve(source)
    with np.errstate(divide="ignore"):
        decades = np.log10(solution.heat[source] / solution.heat)
    view: Row = {"sources": source, "up": options.up, "view": options.view}
    heat = {"label": "heat, decades below the source", "colormap": "inferno_r"}
    columns = np.column_stack([mesh.V, decades, solution.distance]).tolist()
    rows = [dict(zip(("x", "y", "z", "decades", "distance"), row, strict=True)) for row in columns]
    yield "1_heat", plot(mesh, decades, **view, **heat), rows
    yield "1_distance", plot(mesh, solution.distance, **view), rows


def figure_2(options: Any) -> Drawn:
    rows = options.times
    i = [row["i"] for row in rows]
    figure, (panel,) = canvas(2.2)
    for name, colour, marker in (("precomputation", BLUE, "o"), ("solve", ORANGE, "s")):
        seconds = [1e3 * row[name] for row in rows]
        exponent = power_law(i, seconds)["exponent"]
        panel.loglog(i, seconds, marker, color=colour, markersize=2.5, label=f"{name}, about $i^{{{exponent:.2f}}}$")
        panel.loglog(i, max(seconds) * (np.array(i) / max(i)) ** exponent, color=colour, linewidth=0.7)
    plain_ticks(panel.xaxis, [5, 10, 20, 40] if options.quick else [10, 20, 50, 100, 200, 300])
    label(panel, "cells per side $i$ (step $1/i$, $2i^2$ faces)", "processor time in ms")
    yield "2", Picture(figure), rows


def figure_3(options: Any) -> Drawn:
    i = [row["i"] for row in options.times]
    figure, panels = canvas(3.2, 2)
    table: list[Row] = []
    for panel, name in zip(panels, ("precomputation", "solve"), strict=True):
        seconds = [row[name] for row in options.times]
        rows = polynomial_errors(i, seconds, range(1, min(11, len(i) - 1)))
        law = power_law(i, seconds)
        table += [{"time": name, **row} for row in [*rows, {"degree": "power law", **law}]]
        degree = [row["degree"] for row in rows]
        for key, form, text in (("left_out", "s-", "points left out"), ("in_sample", "o-", "points fitted")):
            percent, colour = [100 * row[key] for row in rows], ORANGE if key == "left_out" else BLUE
            panel.semilogy(degree, percent, form, color=colour, markersize=3, linewidth=0.8, label=text)
        of_law = f"$a\\,i^{{{law['exponent']:.2f}}}$"
        panel.axhline(100 * law["left_out"], color=BLACK, linewidth=0.8, linestyle="--", label=of_law)
        panel.set_title(name, fontsize=FONT, loc="left", pad=3)
        plain_ticks(panel.xaxis, degree)
        plain_ticks(panel.yaxis, round_between(*panel.get_ylim()))
        label(panel, None, "RMS error, % of mean")
    panels[1].set_xlabel("degree of the polynomial in $i$", fontsize=FONT)
    yield "3", Picture(figure), [{"exponent": "", **row} for row in table]


def figure_4(options: Any) -> Drawn:
    square = shapes.grid(20 if options.quick else 70)
    distance = HeatMethodSolver(square, laplacian="cotan").distance(0)
    columns = np.column_stack([square.V[:, :2], distance, np.linalg.norm(square.V, axis=1)]).tolist()
    rows = [dict(zip(("x", "y", "distance", "truth"), row, strict=True)) for row in columns]
    yield "4", plot(square, distance, sources=0, label="distance from the corner (side = 1)"), rows


def figure_5(options: Any) -> Drawn:
    rows = [accuracy(i) for i in (range(2, 21) if options.quick else range(2, 121))]
    i = [row["i"] for row in rows]
    figure, (errors, rounding) = canvas(3.4, 2, (3.2, 1))
    for name, colour, style, width, text in (
        ("bound", GREY, ":", 1.0, "the paper's bound"),
        ("edges", BLACK, "--", 1.0, r"the paper's theory, $\varepsilon\varphi - d$"),
        ("heat", BLUE, "-", 2.2, "heat"),
        ("log_gradient", ORANGE, "-", 0.8, r"heat, direction of $\nabla \log u$"),
    ):
        errors.loglog(i, [row[name] for row in rows], style, color=colour, linewidth=width, label=text)
    # Zero has no place on a logarithmic axis.
    rounding.loglog(i, [max(row["sweep"], 1e-18) for row in rows], color=GREEN, linewidth=0.8, label="sweep")
    plain_ticks(rounding.xaxis, [2, 5, 10, 20] if options.quick else [2, 5, 10, 20, 56, 120])
    for panel in (errors, rounding):
        label(panel, None, "mean error")
    errors.set_ylim(1e-3, 1)
    rounding.set_ylim(1e-17, 1e-13)
    rounding.set_xlabel("cells per side $i$ (step $1/i$)", fontsize=FONT)
    yield "5", Picture(figure), rows
    yield jump(range(48, 60, 4) if options.quick else range(40, 71))


def jump(sizes: Sequence[int]) -> tuple[str, Picture, list[Row]]:
    """The paper's unexplained rise at i = 56: errors in double and single precision."""
    lines: dict[str, tuple[Row, str, str, float, str]] = {
        "single": ({"dtype": np.float32}, ORANGE, "-", 1.0, "single precision"),
        "double": ({}, BLUE, "-", 2.2, "double precision"),
        "single_safe_norm": (
            {"dtype": np.float32, "safe_norm": True}, GREEN, "--", 0.9, "single, norm that cannot underflow"
        ),
    }  # fmt: skip
    rows: list[Row] = [{"i": i} | {k: mean_error(Square(i), **line[0]) for k, line in lines.items()} for i in sizes]
    figure, (panel,) = canvas(2.1)
    for name, (_, colour, style, width, text) in lines.items():
        panel.plot(sizes, [row[name] for row in rows], style, color=colour, linewidth=width, label=text)
    panel.axvline(56, color=GREY, linewidth=0.6, linestyle=":")
    panel.text(56.3, 0.001, "$i = 56$", fontsize=FONT - 0.5, color=GREY)
    panel.set(ylim=(0, 0.02), xlim=(40, 66))
    label(panel, "cells per side $i$ (step $1/i$)", "mean error")
    return "5_jump", Picture(figure), rows


FIGURES: dict[int, Callable[[Any], Drawn]] = {1: figure_1, 2: figure_2, 3: figure_3, 4: figure_4, 5: figure_5}


def main(argv: Sequence[str] | None = None) -> None:
    warnings.simplefilter("ignore", AccuracyWarning)  # the errors of the paper's method are what is measured here
    more: Row = {"mesh": Path, "source": int, "up": "y", "view": [30.0, 20.0], "format": "png", "data": False}
    options = parsed(__doc__, argv, out=Path("paper-figures"), figure=[*FIGURES], quick=False, **more)
    options.view = None if options.view == more["view"] else options.view
    if {2, 3} & set(options.figure):
        options.times = computation_times(SIZES_QUICK if options.quick else SIZES, 1 if options.quick else 9)
    options.out.mkdir(parents=True, exist_ok=True)
    for number in options.figure:
        for name, picture, rows in FIGURES[number](options):
            picture.save(options.out / f"paper_{name}.{options.format}")
            if options.data:
                with (options.out / f"paper_{name}.csv").open("w", newline="", encoding="utf8") as file:
                    writer = csv.DictWriter(file, list(rows[0]), restval="", lineterminator="\n")
                    writer.writeheader()
                    writer.writerows(rows)


if __name__ == "__main__":
    sys.exit(main())
