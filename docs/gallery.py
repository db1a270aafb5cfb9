"""Pictures for the documentation, from generated shapes and from a mesh of the pymeshlab wheel.

``python docs/gallery.py --out DIR`` writes the pictures, an interactive page, and gallery.md with pictures and code.
"""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import heat_igl
from heat_igl import shapes
from heat_igl.demo import sample_mesh
from heat_igl.drawing import Page, Picture, page, plot, plot_field


def torus() -> Picture:
    """Stripes of equal distance from one vertex, with kinks at the cut locus."""
    mesh = shapes.torus(160, 80)
    phi = heat_igl.HeatMethodSolver(mesh).distance(0)
    return plot(mesh, phi, sources=0, style="stripes", view=(30, 50))


def bunny() -> Picture:
    """Isolines of the distance from the nearest of three vertices."""
    path = sample_mesh()
    mesh = heat_igl.read_mesh(path) if path else shapes.icosphere(5)
    sources = [1234, 4000, 9000]
    phi = heat_igl.HeatMethodSolver(mesh).distance(sources)
    return plot(mesh, phi, sources=sources)


def heat() -> Picture:
    """The heat after step 1, which decays exponentially with distance."""
    mesh = shapes.disk(40)
    solution = heat_igl.HeatMethodSolver(mesh).solve(0)
    return plot_field(mesh, np.log10(solution.heat), spacing=5, label="log10 of heat", sources=0, colormap="magma")


def error() -> Picture:
    """The error of the heat method on a sphere: distance is too short at the antipode of the source."""
    mesh = shapes.icosphere(5)
    source = int(np.argmax(mesh.V[:, 2]))
    phi = heat_igl.HeatMethodSolver(mesh).distance(source)
    exact = np.arccos(np.clip(mesh.V @ mesh.V[source], -1, 1))
    relative = np.divide(phi - exact, exact, out=np.zeros_like(exact), where=exact > 0)
    return plot_field(mesh, 100 * relative, limits=(-2, 2), label="error, % of exact", view=(150, -20))


def book() -> Picture:
    """Five pages that share an edge, which shortest paths cross."""
    mesh = shapes.book(5, 24)
    phi = heat_igl.HeatMethodSolver(mesh).distance(40)
    return plot(mesh, phi, sources=40, view=(35, 35))


def scribble() -> Picture:
    """Signed distance from a loop with four gaps."""
    mesh = shapes.torus(160, 80)
    angle = np.linspace(0, 2 * np.pi, 200)
    x = np.cos(angle) * (0.55 + 0.15 * np.cos(3 * angle))
    loop = np.stack([0.9 + 0.55 * x, np.sin(angle) * 0.6, np.full(200, 0.39)], axis=1)
    places = heat_igl.closest_points(mesh, loop).points.positions(mesh)
    arcs = [heat_igl.curve_on(mesh, places[i : i + 36]) for i in (0, 50, 100, 150)]
    phi = heat_igl.SignedHeatSolver(mesh, refine="unfold").distance(arcs)
    return plot_field(mesh, phi, label="signed distance", limits=(-1, 1), spacing=0.1, curves=arcs, view=(10, 60))


def asked() -> Page:
    """An interactive page: a click moves the source."""
    mesh = shapes.torus(100, 50)
    phi = heat_igl.HeatMethodSolver(mesh).distance(0)
    return page(mesh, phi, sources=0, view=(30, 50), title="Distance on a torus", method="Distance by the heat method.")


ENTRIES = (torus, bunny, heat, error, book, scribble, asked)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, default=Path("gallery"), help="directory for the results; made if missing")
    out: Path = parser.parse_args(argv).out
    (out / "pages").mkdir(parents=True, exist_ok=True)
    text = []
    for entry in ENTRIES:
        result = entry()
        if isinstance(result, Picture):
            result.save(out / f"{entry.__name__}.png")
            shown = f"![{entry.__doc__}]({entry.__name__}.png)"
        else:
            result.save(out / "pages" / f"{entry.__name__}.html")
            shown = f'<iframe src="{entry.__name__}.html" style="width: 100%; height: 520px; border: 0"></iframe>'
        text.append(f"## {entry.__doc__}\n\n{shown}\n\n```python\n{_body(entry)}```\n")
    (out / "gallery.md").write_text("\n".join(text), encoding="utf8")
    return 0


def _body(entry: Callable[[], object]) -> str:
    """The lines of a function without signature and docstring."""
    lines = inspect.getsource(entry).splitlines(keepends=True)[2:]
    return "".join(line[4:].removeprefix("return ") for line in lines)


if __name__ == "__main__":
    raise SystemExit(main())
