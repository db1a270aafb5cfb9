"""Signed distance on surfaces: errors from circles and from broken curves.

    python scripts/signed_table.py circles [--finest 160]        # circles against closed forms
    python scripts/signed_table.py broken MESH ... [--cases 40]  # curves with gaps, beside potpourri3d

circles: on a perturbed square, a sphere and a cylinder, each mesh with edges half as long as the one before: the mean
error in percent of the mean distance, and the order to which it falls.
broken: a level of a random smooth function on one of the meshes, in turn, and 10, 30 or 50 % of the length of its
curves removed in one to six pieces. Truth is exact distance from the whole curves with the sign of the function; errors
are means over the vertices, as a share of the square root of the area inside, in percent.
docs/signed_theory.md shows the tables.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from heat_igl import Mesh, SignedHeatSolver, SurfaceCurve, curve_on, geodesic_distance, isolines, shapes
from heat_igl.curves import sublevel_areas
from heat_igl.typing import FloatArray

from harness import Row, as_they_are, collected, geometric_mean, moved_inside, named, parsed, publish

COARSEST = 20
# A regular grid has edges in three directions, which heat prefers; a random move of the vertices, by this share of the
# spacing, leaves none that the curve could follow.
MOVED = 0.2
GAPS = (0.1, 0.3, 0.5)
Curves = list[SurfaceCurve]
Case = tuple[Mesh, Curves, FloatArray]


# Circles.


def circle() -> FloatArray:
    angle = np.linspace(0, 2 * np.pi, 5760, endpoint=False)
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)


def on_plane(n: int, seed: int) -> Case:
    """A circle of radius 0.3 on a unit square of n x n perturbed squares."""
    mesh = moved_inside(shapes.grid(n), np.random.default_rng(seed), MOVED / n)
    middle = np.array([0.5, 0.5, 0])
    truth = np.linalg.norm(mesh.V - middle, axis=1) - 0.3
    return mesh, [curve_on(mesh, 0.3 * circle() + middle, closed=True)], truth


def on_sphere(n: int, _: int) -> Case:
    """The circle of latitude at height 0.8 on an icosphere with edges of about 2.8 / n."""
    mesh = shapes.icosphere(3 + round(math.log2(n / COARSEST)))
    latitude = np.arctan2(np.hypot(*mesh.V[:, :2].T), mesh.V[:, 2])
    return mesh, [curve_on(mesh, 0.6 * circle() + [0, 0, 0.8], closed=True)], latitude - np.arctan2(3, 4)


def on_cylinder(n: int, _: int) -> Case:
    """The circle at height 0.77 of a cylinder of 2 n x n squares and height 2."""
    mesh = shapes.cylinder(2 * n, n, 2.0)
    height = mesh.V[:, 2] - mesh.V[:, 2].min() - 0.77
    return mesh, isolines(mesh, height, 0.0)[0], height


SURFACES = {"plane": on_plane, "sphere": on_sphere, "cylinder": on_cylinder}
WAYS: dict[str, dict[str, Any]] = {"default": {}, "heat, t = h^2 / 4": {"t_coef": 0.25}}


def circles(options: argparse.Namespace) -> Iterator[Row]:
    """Mean errors on each mesh, and the orders; an error below 1e-9 is rounding."""
    before: Row = {}
    for surface, make in SURFACES.items():
        for k in range(1 + max(0, int(math.log2(options.finest / COARSEST)))):
            n = COARSEST * 2**k
            mesh, curves, truth = make(n, options.seed)
            row: Row = {"surface": surface, "vertices": mesh.n_vertices}
            for name, way in (WAYS | {"heat, t with h": {"t_coef": n / 80}}).items():
                off = np.abs(SignedHeatSolver(mesh, **way).distance(curves) - truth).mean()
                error = 100 * off / np.abs(truth).mean()
                order = k and min(error, before[name]) > 1e-9 and math.log2(before[name] / error)
                row[name] = f"{error * (error > 1e-9):.2g}" + (f" ({order:.1f})" if order else "")
                before[name] = error
            yield row


# Levels of random smooth functions, whole and broken.


class Peer:
    """potpourri3d's signed heat method; its curves are lists of vertices, points on edges and points in faces."""

    def __init__(self, mesh: Mesh) -> None:
        import potpourri3d

        self._mesh = mesh
        self.solver = potpourri3d.MeshSignedHeatSolver(mesh.V, mesh.F)
        pairs = np.asarray(potpourri3d.edges(mesh.V, mesh.F)).tolist()
        self._edge = {frozenset(pair): (i, pair[0]) for i, pair in enumerate(pairs)}

    def nodes(self, curves: Curves) -> list[list[tuple[int, list[float]]]]:
        """The curves as it takes them, reversed: it is positive on the left."""
        places = [[(c.faces[0], c.start[0]), *zip(c.faces, c.end, strict=True)] for c in curves]
        return [[self._node(int(face), at) for face, at in each[::-1]] for each in places]

    def _node(self, face: int, at: FloatArray) -> tuple[int, list[float]]:
        held = np.flatnonzero(at > 1e-12)
        corners = self._mesh.F[face, held].tolist()
        if len(held) == 1:
            return corners[0], []
        if len(held) == 3:
            return face, at.tolist()
        edge, tail = self._edge[frozenset(corners)]
        return edge, [float(at[held[1 if tail == corners[0] else 0]])]

    def distance(self, nodes: Any, level: str) -> FloatArray:
        """The answer; NaN where a factorization fails."""
        try:
            return np.asarray(self.solver.compute_distance(nodes, level_set_constraint=level))
        except (RuntimeError, ValueError):
            return np.full(self._mesh.n_vertices, np.nan)


def broken(mesh: Mesh, curve: SurfaceCurve, share: float, gaps: int, rng: np.random.Generator) -> Curves:
    """What is left of a curve when a share of its length is removed, in pieces of equal length."""
    lengths = curve.lengths(mesh)
    middle = (np.cumsum(lengths) - lengths / 2) / lengths.sum()
    kept = np.ones(len(curve), bool)
    for start in (rng.uniform() + np.arange(gaps) + rng.uniform(-0.3, 0.3, gaps) * (1 - share)) / gaps:
        kept &= (middle - start) % 1 >= share / gaps
    if kept.all() or not kept.any():
        return [curve] if kept.all() else []
    # A closed one from a gap on, so that no piece lies over the start.
    order = np.roll(np.arange(len(curve)), -int(np.argmin(kept)) if curve.is_closed else 0)
    runs = np.split(order, np.flatnonzero(np.diff(kept[order].astype(int))) + 1)
    return [SurfaceCurve(curve.faces[run], curve.start[run], curve.end[run]) for run in runs if kept[run[0]]]


def broken_rows(options: argparse.Namespace) -> Iterator[Row]:
    meshes, rng = named(options.meshes), np.random.default_rng(options.seed)
    solvers = {name: {way: SignedHeatSolver(m, **kept) for way, kept in WAYS.items()} for name, m in meshes.items()}
    peers = {name: Peer(mesh) for name, mesh in meshes.items()}
    for case in range(options.cases):
        name, share = list(meshes)[case % len(meshes)], GAPS[case // len(meshes) % len(GAPS)]
        mesh, gaps = meshes[name], int(rng.integers(1, 7))
        # A sum of a few waves, at most two wavelengths across the mesh.
        waves = rng.normal(size=(3, 4)) * rng.uniform(1, 5, 4) / np.ptp(mesh.V, axis=0).max()
        values = np.sin(mesh.V @ waves + rng.uniform(0, 2 * np.pi, 4)) @ rng.normal(size=4)
        at = float(np.quantile(values, rng.uniform(0.3, 0.7)))
        whole = isolines(mesh, values, [at])[0]
        pieces = [piece for curve in whole for piece in broken(mesh, curve, share, gaps, rng)]
        found = {way: solver.distance(pieces) for way, solver in solvers[name].items()}
        nodes = peers[name].nodes(pieces)
        found |= {f"potpourri3d {level}": peers[name].distance(nodes, level) for level in ("ZeroSet", "None")}
        truth = np.where(values < at, -1, 1) * geodesic_distance(mesh, whole)
        size = np.sqrt(sublevel_areas(mesh, values, at)[0])
        errors = {way: float(100 * np.abs(d - truth).mean() / size) for way, d in found.items()}
        yield {"mesh": name, "removed": share} | errors


def summary(rows: Sequence[Row]) -> Iterator[Row]:
    """Means for each share removed, and comparisons with the better of the peer's answers."""
    names = [name for name in rows[0] if name not in ("mesh", "removed")]
    best = [np.nanmin([row[name] for name in names if name.startswith("potpourri3d")]) for row in rows]
    for share in GAPS:
        some = [row for row in rows if row["removed"] == share]
        if some:
            yield {"removed": f"{share:.0%}", "n": len(some)} | {
                k: f"{np.nanmean([r[k] for r in some]):.3g}" for k in names
            }
    ratios = {name: np.array([row[name] for row in rows]) / best for name in names}
    yield {"removed": "failed", "n": len(rows)} | {k: str(int(np.isnan(r).sum())) for k, r in ratios.items()}
    yield {"removed": "no worse", "n": len(rows)} | {k: str(int((r <= 1).sum())) for k, r in ratios.items()}
    yield {"removed": "of its error, at most", "n": ""} | {k: np.nanmax(r) for k, r in ratios.items()}
    means = {k: geometric_mean(r[~np.isnan(r)]) for k, r in ratios.items()}
    yield {"removed": "in the geometric mean", "n": ""} | means


def main(argv: Sequence[str] | None = None) -> None:
    options = parsed(__doc__, argv, "*", ("circles", "broken"), finest=160, cases=40)
    rows = circles(options) if options.table == "circles" else summary(collected(broken_rows(options)))
    publish(options, {options.table: as_they_are(collected(rows))})


if __name__ == "__main__":
    main()
