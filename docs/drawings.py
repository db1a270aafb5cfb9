"""The drawings in docs/images: those of the theory, from the package's own results, and the pictures of the README.

    python docs/drawings.py                           # all: about a minute
    python docs/drawings.py theory_cone.svg bunny.png

theory_steps  the heat, its direction and the distance on a square with walls, as the three steps make them
theory_sweep  a source that is placed through two triangles
theory_strip  a shortest path on a torus, and its faces laid out in the plane
theory_cone   a cone and its sector, and a vertex with more than the full angle

Needs the extra ``view``. `scripts/paper.py` draws those of docs/paper.md.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import shapes
from heat_igl.drawing.plots import plot

DOCS = Path(__file__).resolve().parent / "images"
WIDTH = 7.2  # inches, the text of a page
FONT = 9.0
# Okabe and Ito's colours, told apart by every eye.
BLUE, ORANGE, GREEN, BLACK, GREY, PALE = "#0072B2", "#D55E00", "#009E73", "#000000", "#777777", "#dbe9f3"
Array = np.ndarray[Any, Any]


# How it is drawn.


def canvas(height: float, panels: int, ratios: Sequence[float] | None = None) -> tuple[Any, list[Any]]:
    """A white figure as wide as a page, and its panels: planes without axes, with equal scales."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH, height), layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, panels, squeeze=False, width_ratios=ratios)[0]
    for panel in axes:
        panel.set_aspect("equal")
        panel.axis("off")
    return figure, list(axes)


def polygon(panel: Any, corners: Array, face: str = PALE, edge: str = BLUE, **style: Any) -> None:
    from matplotlib.patches import Polygon

    panel.add_patch(Polygon(corners, closed=True, facecolor=face, edgecolor=edge, linewidth=0.8, **style))
    panel.plot(*np.asarray(corners).T, alpha=0)  # patches alone do not set the limits


def line(panel: Any, points: Any, colour: str = ORANGE, width: float = 1.8, style: str = "-") -> None:
    panel.plot(*np.asarray(points, float).T, style, color=colour, linewidth=width, zorder=3)


def point(panel: Any, at: Any, name: str, shift: tuple[float, float] = (5, 5), colour: str = BLACK) -> None:
    panel.plot(*at, "o", color=colour, markersize=4, zorder=4)
    note(panel, at, name, shift, colour)


def note(panel: Any, at: Any, text: str, shift: tuple[float, float] = (0, 0), colour: str = BLACK) -> None:
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 0.8}
    panel.annotate(
        text, at, shift, textcoords="offset points", fontsize=FONT, color=colour, zorder=5, ha="center", va="center",
        bbox=box,
    )  # fmt: skip


def title(panel: Any, text: str) -> None:
    panel.set_title(text, fontsize=FONT)


# The figures.


def steps() -> Any:
    """The three steps on a square with two walls."""
    from matplotlib.collections import LineCollection

    n = 60
    mask = np.ones((n, n), bool)
    mask[: 2 * n // 3, n // 3] = mask[n // 3 :, 2 * n // 3] = False
    domain = heat_igl.image_domain(mask, 1 / n)
    mesh, source = domain.mesh, domain.index[n // 4, n // 8]
    solution = heat_igl.HeatMethodSolver(mesh, laplacian="cotan", magnitude="unit").solve(source)
    x, y = mesh.V[:, 0], -mesh.V[:, 1]
    rim = np.stack([x, y], axis=1)[mesh.edges[mesh.boundary[mesh.edges].all(axis=1)]]
    figure, panels = canvas(2.7, 3)
    fields = ((np.log10(solution.heat), "magma"), (np.zeros(len(x)), "Greys"), (solution.distance, "viridis"))
    names = ("1  diffuse: $\\log u$", "2  normalize: $X = -\\nabla u\\,/\\,|\\nabla u|$", "3  integrate: $\\phi$")
    for panel, name, (field, colours) in zip(panels, names, fields, strict=True):
        panel.tripcolor(x, y, mesh.F, field, shading="gouraud", cmap=colours, rasterized=True)
        panel.add_collection(LineCollection(rim, colors=BLACK, linewidths=0.8))
        panel.plot(x[source], y[source], "o", color=ORANGE, markeredgecolor="white", markersize=6, zorder=4)
        panel.set(xlim=(x.min() - 0.01, x.max() + 0.01), ylim=(y.min() - 0.01, y.max() + 0.01))
        title(panel, name)
    panels[2].tricontour(x, y, mesh.F, solution.distance, 14, colors="white", linewidths=0.7)
    # One arrow for each block of 4 by 4 pixels, at the face above the centre of a pixel.
    rows, columns = np.mgrid[2:n:4, 1:n:4].reshape(2, -1)
    inside = mask[rows, columns]
    centre = domain.index[rows[inside], columns[inside]]
    face = np.array([np.flatnonzero(np.isin(mesh.F, vertex).any(axis=1))[0] for vertex in centre])
    panels[1].quiver(
        x[centre], y[centre], solution.direction[face, 0], -solution.direction[face, 1],
        color=BLUE, angles="xy", scale=21, width=0.007, headwidth=4.5, pivot="middle",
    )  # fmt: skip
    return figure


def sweep() -> Any:
    """Two circles place the source beyond an edge; the next triangle places it better."""
    a, b, w, v = np.array([0.0, 0.0]), np.array([1.0, 0.0]), np.array([0.42, -0.75]), np.array([0.55, 0.85])
    figure, panels = canvas(4.2, 2)
    names = ("the first triangle: circles about $a$ and $b$", "the second: circles about $w$ and $p = b$")
    sources = np.array([0.86, -1.62]), np.array([0.93, -1.56])  # surfaces are curved: the two disagree a little
    for panel, name, s, corners in zip(panels, names, sources, ((a, b), (w, b)), strict=True):
        polygon(panel, np.array([a, b, v]))
        if corners[0] is w:
            polygon(panel, np.array([a, b, w]), face="#f3f7fa")
        for corner in corners:
            _arc(panel, corner, s)
            line(panel, [corner, s], GREY, 0.8, "--")
        line(panel, [v, s])
        point(panel, a, "$a$", (-9, 4))
        point(panel, b, "$b$" if corners[0] is a else "$b = p$", (9 if corners[0] is a else 17, 4))
        point(panel, v, "$v$", (0, 9))
        if corners[0] is w:
            point(panel, w, "$w$", (-9, -3))
        point(panel, s, "$s$", (10, -4), ORANGE)
        title(panel, name)
        panel.set(xlim=(-0.35, 1.55), ylim=(-1.85, 1.05))
    note(panels[0], 0.5 * (a + sources[0]), "$d(a)$", (-14, 0), GREY)
    note(panels[0], 0.5 * (b + sources[0]), "$d(b)$", (16, 0), GREY)
    note(panels[1], 0.5 * (w + sources[1]), "$d(w)$", (-16, -4), GREY)
    note(panels[1], 0.5 * (b + sources[1]), "$d(b)$", (16, 0), GREY)
    note(panels[0], v + 0.3 * (sources[0] - v), "$d(v)$", (-17, 0), ORANGE)
    note(panels[1], v + 0.3 * (sources[1] - v), "$d(v)$", (-17, 0), ORANGE)
    return figure


def _arc(panel: Any, centre: Array, through: Array, half: float = 0.33) -> None:
    """The arc of a circle about `centre`, around the place `through`."""
    radius, angle = np.hypot(*(through - centre)), np.arctan2(*(through - centre)[::-1])
    turn = angle + np.linspace(-half, half, 40)
    line(panel, centre + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1), GREEN, 1.1)


def strip() -> Any:
    """The faces that a shortest path crosses, in space and laid out in the plane."""
    mesh = shapes.torus(14, 22, tube=0.5)
    # From inside one face to inside another, so that each face of the strip has an edge in common with the next.
    ends = heat_igl.SurfacePoints([476, 546], [[0.2, 0.3, 0.5], [0.3, 0.4, 0.3]])
    path = heat_igl.geodesic_path(mesh, ends)
    corners, straight = laid_out(mesh, path)
    figure, panels = canvas(3.1, 2, (1.0, 1.25))
    seen = _projected(mesh.V, tilt=-45, turn=20)
    order = np.argsort(seen[mesh.F].mean(axis=1)[:, 2])
    _surface(panels[0], mesh, seen, order)
    for face in path.faces:
        polygon(panels[0], seen[mesh.F[face], :2], zorder=2)
    way = _projected(path.positions(mesh), tilt=-45, turn=20)[:, :2]
    line(panels[0], way)
    for triangle in corners:
        polygon(panels[1], triangle)
    line(panels[1], straight)
    for panel, drawn in ((panels[0], way), (panels[1], straight)):
        point(panel, drawn[0], "source", (0, -10), ORANGE)
        point(panel, drawn[-1], "$v$", (0, 10))
    title(panels[0], "on the surface")
    title(panels[1], "the same faces in the plane: one straight line")
    return figure


def _level(points: Array, first: Array, last: Array) -> Array:
    """Points of the plane, moved and turned so that `first` is the origin and `last` on the axis to the right."""
    turn = np.conj(complex(*(last - first)))
    moved = ((points - first) @ [1, 1j]) * turn / abs(turn)
    return np.stack([moved.real, moved.imag], axis=-1)


def _surface(panel: Any, mesh: heat_igl.Mesh, seen: Array, order: Array) -> None:
    """The faces from back to front, shaded by their slope to the viewer."""
    from matplotlib.collections import PolyCollection

    triangles = seen[mesh.F[order]]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    facing = np.abs(normal[:, 2]) / np.linalg.norm(normal, axis=1)
    grey = 0.72 + 0.26 * facing
    panel.add_collection(
        PolyCollection(triangles[:, :, :2], facecolors=np.repeat(grey[:, None], 3, 1), edgecolors="0.6", linewidths=0.3)
    )


def _projected(points: Array, tilt: float, turn: float) -> Array:
    """Positions as seen from the direction of these angles in degrees: x, y, and the nearness to the viewer."""
    t, u = np.deg2rad([tilt, turn])
    about_z = np.array([[np.cos(u), -np.sin(u), 0], [np.sin(u), np.cos(u), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(t), np.sin(t)], [0, -np.sin(t), np.cos(t)]])
    return np.asarray(points @ (about_x.T @ about_z).T)


def laid_out(mesh: heat_igl.Mesh, path: heat_igl.SurfaceCurve) -> tuple[Array, Array]:
    """The faces of a path (s, 3, 2) in one plane, each beside the one before it, and the path (s + 1, 2).

    The path starts in the origin, and ends on the axis to the right.
    """
    laid: list[Array] = []
    for k, face in enumerate(path.faces):
        V = mesh.V[mesh.F[face]]
        x = (V[1] - V[0]) / np.linalg.norm(V[1] - V[0])
        y = V[2] - V[0] - x * ((V[2] - V[0]) @ x)
        own = (V - V[0]) @ np.stack([x, y / np.linalg.norm(y)], axis=1)
        if laid:
            (i, first), (j, second) = _common(mesh, face, path.faces[k - 1])
            one, other = (complex(*laid[-1][corner]) for corner in (first, second))
            moved = ((own - own[i]) @ [1, 1j]) * (other - one) / complex(*(own[j] - own[i])) + one
            own = np.stack([moved.real, moved.imag], axis=1)
        laid.append(own)
    corners = np.array(laid)
    line_of = np.einsum(
        "kc,kcd->kd", np.concatenate([path.start, path.end[-1:]]), np.concatenate([corners, corners[-1:]])
    )
    return _level(corners, line_of[0], line_of[-1]), _level(line_of, line_of[0], line_of[-1])


def _common(mesh: heat_igl.Mesh, face: int, other: int) -> list[tuple[int, int]]:
    """Corners of two faces at the same vertex."""
    return [(i, k) for i in range(3) for k in range(3) if mesh.F[face, i] == mesh.F[other, k]]


def cone() -> Any:
    """A cone, its sector in the plane, and a vertex with more than the full angle."""
    half = np.deg2rad(25)
    full = 2 * np.pi * np.sin(half)  # the angle of the sector
    figure, panels = canvas(2.9, 3, (0.8, 1.25, 1.0))
    slant, turn = (0.62, 0.75), (-0.23 * full, 0.23 * full)
    ends = [r * np.array([np.cos(t), np.sin(t)]) for r, t in zip(slant, turn, strict=True)]
    way = ends[0] + np.linspace(0, 1, 60)[:, None] * (ends[1] - ends[0])
    _cone_in_space(panels[0], way, half)
    rim = np.linspace(-full / 2, full / 2, 80)
    sector = np.concatenate([[[0, 0]], np.stack([np.cos(rim), np.sin(rim)], axis=1)])
    turned = np.array([[0.0, -1.0], [1.0, 0.0]])  # the tip at the top
    polygon(panels[1], sector @ turned)
    line(panels[1], way @ turned)
    for side in (1, -1):
        line(panels[1], [[0, 0], sector[side] @ turned], GREEN, 1.6, "--")
    point(panels[1], ends[0] @ turned, "source", (2, -10), ORANGE)
    point(panels[1], ends[1] @ turned, "$v$", (2, -10))
    title(panels[0], "a cone")
    title(panels[1], "cut open and laid out")
    _saddle(panels[2])
    title(panels[2], "an angle of more than $2\\pi$ at $p$")
    return figure


def _cone_in_space(panel: Any, way: Array, half: float) -> None:
    """A cone from the side, with a way given in the plane of the sector."""
    radius, angle = np.hypot(*way.T), np.arctan2(way[:, 1], way[:, 0]) / np.sin(half)

    def seen(r: Array, t: Array) -> Array:
        p = np.stack([r * np.sin(half) * np.sin(t), -r * np.sin(half) * np.cos(t), -r * np.cos(half)], axis=-1)
        return p[:, [0, 2]] + 0.35 * p[:, [1]] * [[0, 1]]

    around = np.linspace(-np.pi, np.pi, 120)
    rim = seen(np.ones(120), around)
    polygon(panel, np.concatenate([[[0, 0]], rim[np.abs(around) <= 0.5 * np.pi]]))
    polygon(panel, rim, edge=GREY, face="none", linestyle=":")
    line(panel, seen(radius, angle))
    line(panel, seen(np.array([0, 1.0]), np.array([np.pi, np.pi])), GREEN, 1.6, "--")
    point(panel, seen(radius[:1], angle[:1])[0], "source", (-6, -10), ORANGE)
    point(panel, seen(radius[-1:], angle[-1:])[0], "$v$", (8, -6))


def _saddle(panel: Any) -> None:
    """Straight lines on both sides of a vertex, and the part behind it that none of them reaches; from above."""
    n = 24
    turn = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(turn), np.sin(turn), 0.8 * np.cos(2 * turn)], axis=1)
    first = np.arange(n)
    mesh = heat_igl.Mesh([[0, 0, 0], *ring], np.stack([0 * first, 1 + first, 1 + (first + 1) % n], axis=1))
    behind = heat_igl.SurfacePoints([n // 2], [[0.2, 0.8, 0.0]])
    to_p = -ring[n // 2]
    across = np.array([0.0, 1.0, 0.0])
    rim = ring[np.append(first, 0), :2]
    polygon(panel, rim, edge=GREY, face="#f3f7fa")
    rays = [
        heat_igl.trace_geodesic(mesh, behind, to_p + slope * across, 5.0).positions(mesh)[:, :2]
        for slope in (-0.9, -0.45, -0.001, 0.001, 0.45, 0.9)
    ]
    low, high = rays[2], rays[3]
    ends = np.arctan2([low[-1, 1], high[-1, 1]], [low[-1, 0], high[-1, 0]])
    arc = np.linspace(*ends, 40)
    shade = np.concatenate([low[-1:], np.stack([np.cos(arc), np.sin(arc)], axis=1), high[-1:], [[0, 0]]])
    polygon(panel, shade, face="#fbe6da", edge=ORANGE, linestyle="--")
    for ray in (*rays[:2], *rays[4:]):
        line(panel, ray, GREY, 0.9)
    for angle in np.linspace(*ends, 5)[1:-1]:
        line(panel, [rays[0][0], [0, 0], 0.97 * np.array([np.cos(angle), np.sin(angle)])], ORANGE, 1.4)
    point(panel, rays[0][0], "source", (4, -11), ORANGE)
    point(panel, (0, 0), "$p$", (-3, 10))


def bunny() -> Any:
    """Distance from one vertex of the bunny, which heads the README."""
    path = shapes.bunny_path()
    mesh = heat_igl.read_mesh(path) if path else shapes.icosphere(5)
    return plot(mesh, heat_igl.HeatMethodSolver(mesh).distance(1234), sources=1234).figure


# Functions of docs/gallery.py, and what they show.
MORE = {
    "cells": "Voronoi cells",
    "paths": "shortest paths",
    "grown": "signed distance",
    "directions": "log map",
    "straightest": "straightest geodesics",
    "cloud": "point clouds",
}


def more() -> Any:
    """Six pictures of the gallery, for the README."""
    from matplotlib.image import imread

    gallery = importlib.import_module("gallery")
    figure, _ = canvas(5, 1)
    figure.clear()
    with tempfile.TemporaryDirectory() as folder:
        for panel, (name, text) in zip(figure.subplots(2, 3).flat, MORE.items(), strict=True):
            path = Path(folder, f"{name}.png")
            getattr(gallery, name)().save(path)
            panel.imshow(imread(path))
            title(panel, text)
            panel.set_anchor("N")
            panel.axis("off")
    return figure


FIGURES: dict[str, Callable[[], Any]] = {
    "theory_steps.png": steps,
    "theory_sweep.svg": sweep,
    "theory_strip.svg": strip,
    "theory_cone.svg": cone,
    "bunny.png": bunny,
    "more.png": more,
}


def main() -> None:
    """Write the files that are named, or all: as PNG where they show a field, as SVG elsewhere."""
    import matplotlib

    for name in sys.argv[1:] or FIGURES:
        path = DOCS / name
        # The same bytes in every run: names of the parts by this word, and no date.
        with matplotlib.rc_context({"svg.hashsalt": "heat_igl", "mathtext.fontset": "cm"}):
            options = {"dpi": 200} if path.suffix == ".png" else {"metadata": {"Date": None}}
            FIGURES[name]().savefig(path, facecolor="white", **options)
        print(path)


if __name__ == "__main__":
    main()
