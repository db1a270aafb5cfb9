"""The pictures of the documentation.

    python scripts/pictures.py                      # into docs/images: about three minutes
    python scripts/pictures.py --out DIRECTORY --picture bunny

``bunny`` heads the README, ``more`` there shows six pictures of the gallery; ``paper`` makes those of docs/paper.md,
``theory`` those of docs/theory.md. Needs the extras ``view`` and ``fast``, and the meshes of the pymeshlab wheel.
"""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from heat_igl import HeatMethodSolver
from heat_igl.drawing.plots import plot

from scaffold import environment, environment_line, option_parser, sample

SCRIPTS = Path(__file__).resolve().parent
DOCS = SCRIPTS.parent / "docs" / "images"


def bunny(out: Path) -> None:
    mesh = sample("bunny")
    source = 1234
    plot(mesh, HeatMethodSolver(mesh).distance(source), sources=source).save(out / "bunny.png")


def paper(out: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, SCRIPTS / "paper_figures.py", "--out", folder], check=True)
        for name in ("1_heat", "1_distance", "2", "3", "5", "5_jump"):
            shutil.copyfile(Path(folder, f"figure_{name}.png"), out / f"paper_{name}.png")


# Functions of docs/gallery.py, and what they show.
MORE = {
    "cells": "Voronoi cells",
    "paths": "shortest paths",
    "grown": "signed distance",
    "directions": "log map",
    "straightest": "straightest geodesics",
    "cloud": "point clouds",
}


def more(out: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.image import imread

    sys.path.insert(0, str(SCRIPTS.parent / "docs"))
    gallery = importlib.import_module("gallery")
    figure = Figure(figsize=(9, 6.2), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    with tempfile.TemporaryDirectory() as folder:
        for panel, (name, title) in zip(figure.subplots(2, 3).flat, MORE.items(), strict=True):
            path = Path(folder, f"{name}.png")
            getattr(gallery, name)().save(path)
            panel.imshow(imread(path))
            panel.set_title(title)
            panel.set_anchor("N")
            panel.axis("off")
    figure.savefig(out / "more.png", dpi=120)


def theory(out: Path) -> None:
    subprocess.run([sys.executable, SCRIPTS / "theory_figures.py", "--out", out], check=True)


PICTURES: dict[str, Callable[[Path], None]] = {"bunny": bunny, "more": more, "paper": paper, "theory": theory}


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--out", type=Path, default=DOCS, help="directory (default docs/images)")
    parser.add_argument("--picture", choices=list(PICTURES), action="append", help="one of them; repeatable")
    arguments = parser.parse_args(argv)
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in arguments.picture or PICTURES:
        PICTURES[name](arguments.out)
    print(f"Environment: {environment_line(environment())}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
