"""The paper's figures 1 to 5, as PNG and PDF, with their data as CSV beside them.

    python scripts/paper_figures.py                            # all, into ./paper-figures: about two minutes
    python scripts/paper_figures.py --out DIRECTORY --figure 5 # one of them
    python scripts/paper_figures.py --figure 1 --mesh camelhead.off --source 7
    python scripts/paper_figures.py --quick                    # small grids, coarse curves: seconds

1  heat and distance on an animal that steps on a hot rock: any mesh, by default the cow of the pymeshlab wheel
2  processor time of precomputation and of one solve on the unit square of step 1 / i
3  error of polynomials of degree 1 to 10 fitted to them, and of a power law
4  distance from a corner of the square of step 1 / 70
5  mean error from that corner against i, and (5_jump) the same in single precision

docs/paper.md says what they show. Needs the extras ``view`` and ``fast``.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import AccuracyWarning, HeatMethodSolver, shapes
from heat_igl.drawing.plots import Picture, plot

from paper_formulas import Square, mean_error
from paper_measurements import accuracy, computation_times, polynomial_errors, power_law
from scaffold import environment, environment_line, option_parser, sample, write_json

WIDTH = 3.15  # inches, one column
FONT = 7.0
# Okabe and Ito's colours, told apart by every eye.
BLUE, ORANGE, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#777777"
COW = 2904, 751  # vertices; the one under a hoof that a picture from the side shows
SIZES, SIZES_QUICK = range(10, 301, 10), range(5, 41, 5)


# How it is shown.


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
    if x is not None:
        panel.set_xlabel(x, fontsize=FONT)
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


def save(out: Path, name: str, picture: Picture) -> None:
    for suffix in (".png", ".pdf"):
        picture.save(out / f"{name}{suffix}")


def write_csv(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf8") as file:
        writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def figure_1(out: Path, options: argparse.Namespace) -> None:
    mesh = heat_igl.read_mesh(options.mesh) if options.mesh else sample("cow")
    source = options.source
    if source is None:
        lowest = int(np.argmin(mesh.V[:, "xyz".index(options.up)]))
        source = lowest if options.mesh or mesh.n_vertices != COW[0] else COW[1]
    solution = HeatMethodSolver(mesh).solve(source)
    with np.errstate(divide="ignore"):
        decades = np.log10(solution.heat[source] / solution.heat)
    heat = {"label": "heat, decades below the source", "colormap": "inferno_r"}
    view = {"sources": source, "up": options.up, "view": options.view}
    save(out, "figure_1_heat", plot(mesh, decades, **view, **heat))
    save(out, "figure_1_distance", plot(mesh, solution.distance, **view))
    columns = zip(mesh.V.tolist(), decades.tolist(), solution.distance.tolist(), strict=True)
    write_csv(
        out / "figure_1.csv",
        [{"x": x, "y": y, "z": z, "decades": heat, "distance": phi} for (x, y, z), heat, phi in columns],
    )


def figure_2(out: Path, options: argparse.Namespace) -> None:
    rows = _times(options)
    write_csv(out / "figure_2.csv", rows)
    i = [row["i"] for row in rows]
    figure, (panel,) = canvas(2.2)
    for name, colour, marker in (("precomputation", BLUE, "o"), ("solve", ORANGE, "s")):
        seconds = [1e3 * row[name] for row in rows]
        exponent = power_law(i, seconds)["exponent"]
        panel.loglog(i, seconds, marker, color=colour, markersize=2.5, label=f"{name}, about $i^{{{exponent:.2f}}}$")
        fit = np.array([max(seconds) * (k / max(i)) ** exponent for k in i])
        panel.loglog(i, fit, color=colour, linewidth=0.7)
    plain_ticks(panel.xaxis, [5, 10, 20, 40] if options.quick else [10, 20, 50, 100, 200, 300])
    label(panel, "cells per side $i$ (step $1/i$, $2i^2$ faces)", "processor time in ms")
    save(out, "figure_2", Picture(figure))


def _times(options: argparse.Namespace) -> list[dict[str, float]]:
    """The times of figures 2 and 3, measured once in a run."""
    if options.times is None:
        options.times = computation_times(SIZES_QUICK if options.quick else SIZES, 1 if options.quick else 9)
    return list(options.times)


def figure_3(out: Path, options: argparse.Namespace) -> None:
    times = _times(options)
    i = [row["i"] for row in times]
    figure, panels = canvas(3.2, 2)
    table: list[dict[str, Any]] = []
    for panel, name in zip(panels, ("precomputation", "solve"), strict=True):
        seconds = [row[name] for row in times]
        rows = polynomial_errors(i, seconds, range(1, min(11, len(i) - 1)))
        law = power_law(i, seconds)
        table += [{"time": name, **row} for row in rows] + [{"time": name, "degree": "power law", **_errors(law)}]
        degree = [row["degree"] for row in rows]
        for key, colour, marker, text in (
            ("left_out", ORANGE, "s", "points left out"),
            ("in_sample", BLUE, "o", "points fitted"),
        ):
            percent = [100 * row[key] for row in rows]
            panel.semilogy(degree, percent, marker + "-", color=colour, markersize=3, linewidth=0.8, label=text)
        panel.axhline(
            100 * law["left_out"],
            color=BLACK,
            linewidth=0.8,
            linestyle="--",
            label=f"$a\\,i^{{{law['exponent']:.2f}}}$",
        )
        panel.set_title(name, fontsize=FONT, loc="left", pad=3)
        plain_ticks(panel.xaxis, degree)
        plain_ticks(panel.yaxis, round_between(*panel.get_ylim()))
        label(panel, None, "RMS error, % of mean")
    panels[1].set_xlabel("degree of the polynomial in $i$", fontsize=FONT)
    write_csv(out / "figure_3.csv", table)
    save(out, "figure_3", Picture(figure))


def _errors(law: dict[str, float]) -> dict[str, float]:
    return {name: law[name] for name in ("in_sample", "left_out")}


def figure_4(out: Path, options: argparse.Namespace) -> None:
    i = 20 if options.quick else 70
    square = shapes.grid(i)
    distance = HeatMethodSolver(square, laplacian="cotan").distance(0)
    save(out, "figure_4", plot(square, distance, sources=0, label="distance from the corner (side = 1)"))
    truth = np.linalg.norm(square.V, axis=1)
    columns = zip(square.V[:, :2].tolist(), distance.tolist(), truth.tolist(), strict=True)
    write_csv(out / "figure_4.csv", [{"x": x, "y": y, "distance": phi, "truth": d} for (x, y), phi, d in columns])


def figure_5(out: Path, options: argparse.Namespace) -> None:
    rows = [accuracy(i) for i in (range(2, 21) if options.quick else range(2, 121))]
    write_csv(out / "figure_5.csv", rows)
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
    errors.legend(fontsize=FONT - 0.5, frameon=False, loc="lower left", labelspacing=0.25, handlelength=1.8)
    errors.set_ylim(1e-3, 1)
    rounding.set_ylim(1e-17, 1e-13)
    rounding.set_xlabel("cells per side $i$ (step $1/i$)", fontsize=FONT)
    save(out, "figure_5", Picture(figure))
    _jump(out, options.quick)


def _jump(out: Path, quick: bool) -> None:
    """The paper's unexplained rise at i = 56: errors in double and single precision."""
    squares = [Square(i) for i in (range(48, 60, 4) if quick else range(40, 71))]
    rows = [
        {
            "i": square.i,
            "double": mean_error(square),
            "single": mean_error(square, dtype=np.float32),
            "single_safe_norm": mean_error(square, dtype=np.float32, safe_norm=True),
        }
        for square in squares
    ]
    write_csv(out / "figure_5_jump.csv", rows)
    figure, (panel,) = canvas(2.1)
    for name, colour, style, width, text in (
        ("single", ORANGE, "-", 1.0, "single precision"),
        ("double", BLUE, "-", 2.2, "double precision"),
        ("single_safe_norm", GREEN, "--", 0.9, "single, norm that cannot underflow"),
    ):
        errors = [row[name] for row in rows]
        panel.plot([row["i"] for row in rows], errors, style, color=colour, linewidth=width, label=text)
    panel.axvline(56, color=GREY, linewidth=0.6, linestyle=":")
    panel.text(56.3, 0.001, "$i = 56$", fontsize=FONT - 0.5, color=GREY)
    panel.set_ylim(0, 0.02)
    panel.set_xlim(40, 66)
    label(panel, "cells per side $i$ (step $1/i$)", "mean error")
    save(out, "figure_5_jump", Picture(figure))


FIGURES: dict[int, Callable[[Path, argparse.Namespace], Any]] = {
    1: figure_1,
    2: figure_2,
    3: figure_3,
    4: figure_4,
    5: figure_5,
}


def main(argv: Sequence[str] | None = None) -> int:
    # The errors of the paper's method are what is measured here.
    warnings.simplefilter("ignore", AccuracyWarning)
    parser = option_parser(__doc__)
    parser.add_argument("--out", type=Path, default=Path("paper-figures"), help="directory (default ./paper-figures)")
    parser.add_argument("--figure", type=int, choices=sorted(FIGURES), action="append", help="one figure; repeatable")
    parser.add_argument("--mesh", type=Path, help="of figure 1 (default: the cow of the pymeshlab wheel)")
    parser.add_argument("--source", type=int, help="vertex on the hot rock (default: the lowest)")
    parser.add_argument("--up", choices="xyz", default="y", help="coordinate that points upwards in figure 1")
    parser.add_argument("--view", type=float, nargs=2, metavar=("AZIMUTH", "ELEVATION"), help="of figure 1, in degrees")
    parser.add_argument("--quick", action="store_true", help="small grids")
    arguments = parser.parse_args(argv)
    arguments.times = None
    arguments.out.mkdir(parents=True, exist_ok=True)
    for number in sorted(set(arguments.figure or FIGURES)):
        start = time.perf_counter()
        FIGURES[number](arguments.out, arguments)
        print(f"figure {number}: {time.perf_counter() - start:.1f} s")
    around = environment()
    print(f"Environment: {environment_line(around)}")
    write_json(arguments.out / "environment.json", around)
    return 0


if __name__ == "__main__":
    sys.exit(main())
