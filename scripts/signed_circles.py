"""Signed distance from circles against closed forms, and how near 0 it is on the curves.

    python scripts/signed_circles.py [--finest 160] [--seed 0] [--json FILE]

Circles on a perturbed square, a sphere and a cylinder, on meshes with edges of half the length each: mean error as a
share of the mean distance, in percent, and the order to which it falls from each mesh to the next: by default, by the
heat alone with the default time step and with one that falls with h, and refined. Besides the closed form, distances
are compared with the exact ones of the polyhedral surface from the same curve: what these are off by is the error of
the mesh.

Then the values on the curves, at the middles of the segments and linear in each triangle, as a share of the mean edge
length, in the root of the mean square: circles, and the largest of six levels of random smooth functions on three
coarse meshes. docs/signed.md shows the tables. Takes about ten seconds.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from heat_igl import Mesh, SignedHeatSolver, SurfaceCurve, curve_on, geodesic_distance, isolines, shapes
from heat_igl.heat_method import Level
from heat_igl.typing import FloatArray

from scaffold import add_json, add_seed, environment, option_parser, publish, table

COARSEST = 20
# A regular grid has edges in three directions, which heat prefers; a random move of the vertices, by this share of the
# spacing, leaves none that the curve could follow.
MOVED = 0.2
LEVELS: tuple[Level | None, ...] = ("none", "zero", None)
Case = tuple[Mesh, list[SurfaceCurve], FloatArray]


def on_plane(n: int, seed: int) -> Case:
    """A circle of radius 0.3 on a unit square of n x n perturbed squares."""
    mesh = shapes.grid(n)
    inner = ~mesh.boundary
    V = mesh.V.copy()
    V[inner, :2] += np.random.default_rng(seed).uniform(-MOVED / n, MOVED / n, (int(inner.sum()), 2))
    x, y, _ = (V - [0.5, 0.5, 0]).T
    around = np.stack([0.5 + 0.3 * _circle()[0], 0.5 + 0.3 * _circle()[1], 0 * _circle()[0]], axis=1)
    moved = Mesh(V, mesh.F)
    return moved, [curve_on(moved, around, closed=True)], np.hypot(x, y) - 0.3


def on_sphere(n: int, seed: int) -> Case:
    """The circle of latitude at height 0.8 on an icosphere with edges of about 2.8 / n."""
    del seed
    mesh = shapes.icosphere(3 + round(math.log2(n / COARSEST)))
    x, y = _circle()
    latitude = np.arctan2(np.hypot(*mesh.V[:, :2].T), mesh.V[:, 2])
    curve = curve_on(mesh, np.stack([0.6 * x, 0.6 * y, 0.8 + 0 * x], axis=1), closed=True)
    return mesh, [curve], latitude - np.arctan2(3, 4)


def on_cylinder(n: int, seed: int) -> Case:
    """The circle at height 0.77 of a cylinder of 2 n x n squares and height 2."""
    del seed
    mesh = shapes.cylinder(2 * n, n, 2.0)
    height = mesh.V[:, 2] - mesh.V[:, 2].min() - 0.77
    return mesh, isolines(mesh, height, 0.0)[0], height


def _circle() -> FloatArray:
    angle = np.linspace(0, 2 * np.pi, 5760, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle)])


SURFACES: dict[str, Callable[[int, int], Case]] = {"plane": on_plane, "sphere": on_sphere, "cylinder": on_cylinder}


def circle_errors(surface: str, n: int, seed: int) -> dict[str, Any]:
    """Mean errors on one mesh, in percent of the mean distance."""
    mesh, curves, truth = SURFACES[surface](n, seed)
    solvers = {
        "default": SignedHeatSolver(mesh),
        "heat, t = h^2 / 4": SignedHeatSolver(mesh, t_coef=0.25),
        "heat, t with h": SignedHeatSolver(mesh, t_coef=n / 80),
        "windows": SignedHeatSolver(mesh, method="windows"),
    }
    found = {name: solver.distance(curves) for name, solver in solvers.items()}
    found["polyhedral"] = np.where(truth < 0, -1, 1) * geodesic_distance(mesh, curves, method="exact")
    errors = {name: _percent(distance, truth) for name, distance in found.items()}
    for name in ("default", "windows"):
        errors[f"{name} from polyhedral"] = _percent(found[name], found["polyhedral"])
    return {"surface": surface, "n": n, "vertices": mesh.n_vertices} | errors


def _percent(distance: FloatArray, truth: FloatArray) -> float:
    return float(100 * np.abs(distance - truth).mean() / np.abs(truth).mean())


def on_curves(mesh: Mesh, curves: list[SurfaceCurve], values: FloatArray) -> float:
    """Root mean square of values along curves, in mean edge lengths."""
    middle = np.concatenate([np.einsum("sc,sc->s", (c.start + c.end) / 2, values[mesh.F[c.faces]]) for c in curves])
    length = np.concatenate([curve.lengths(mesh) for curve in curves])
    return float(np.sqrt(np.average(middle**2, weights=length)) / mesh.edge_lengths.mean())


def nearness(seed: int) -> list[dict[str, Any]]:
    """How near 0 the answers are on circles and on levels with bends; the largest of several cases."""
    rng = np.random.default_rng(seed)
    cases: dict[str, list[Case]] = {
        "circle, square, n = 12": [on_plane(12, seed)],
        "circle, square, n = 40": [on_plane(40, seed)],
        "circle, sphere, n = 20": [on_sphere(20, seed)],
    }
    coarse = {"sphere": shapes.icosphere(3), "torus": shapes.torus(40, 20), "blob": shapes.blob(3)}
    for name, mesh in coarse.items():
        cases[f"levels, {name} of {mesh.n_vertices} vertices"] = [_level(mesh, rng) for _ in range(6)]
    rows = []
    for name, each in cases.items():
        row: dict[str, Any] = {"curves": name}
        for level in LEVELS:
            values = [SignedHeatSolver(mesh).distance(curves, level=level) for mesh, curves, _ in each]
            row[level or "default"] = max(on_curves(*case[:2], phi) for case, phi in zip(each, values, strict=True))
        row["true distance"] = max(on_curves(*case) for case in each) if name.startswith("circle") else None
        rows.append(row)
    return rows


def _level(mesh: Mesh, rng: np.random.Generator) -> Case:
    values = np.sin(mesh.V @ rng.normal(size=(3, 5)) * 2 + rng.uniform(0, 6, 5)).sum(axis=1)
    return mesh, isolines(mesh, values, float(np.quantile(values, 0.4)))[0], values


def circles_table(rows: list[dict[str, Any]]) -> str:
    names = [name for name in rows[0] if name not in ("surface", "n", "vertices")]
    lines = []
    for before, row in zip([None, *rows[:-1]], rows, strict=True):
        cells = [row["surface"], f"{row['vertices']}"]
        for name in names:
            # Below, it is rounding that is compared.
            error = row[name] if row[name] > 1e-9 else 0.0
            falls = before is not None and before["surface"] == row["surface"] and error
            order = f" ({math.log2(before[name] / error):.1f})" if falls and before[name] > 1e-9 else ""
            cells.append(f"{error:.2g}{order}")
        lines.append(cells)
    return "\n".join(table(["surface", "vertices", *names], lines))


def nearness_table(rows: list[dict[str, Any]]) -> str:
    cells = [[str(row["curves"]), *("" if v is None else f"{v:.2g}" for v in list(row.values())[1:])] for row in rows]
    return "\n".join(table(list(rows[0]), cells))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("--finest", type=int, default=160, help="squares along a side of the finest mesh (default 160)")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    sizes = [COARSEST * 2**k for k in range(1 + max(0, int(math.log2(arguments.finest / COARSEST))))]
    circles = [circle_errors(surface, n, arguments.seed) for surface in SURFACES for n in sizes]
    near = nearness(arguments.seed)
    result = {"environment": environment(), "circles": circles, "nearness": near}
    publish(result, f"{circles_table(circles)}\n\n{nearness_table(near)}", json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
