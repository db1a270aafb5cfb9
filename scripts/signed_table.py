"""Signed distance from broken curves, beside potpourri3d's: errors, failures, and times.

    python scripts/signed_table.py MESH [MESH ...] [--cases 40] [--signs 0] [--steps] [--no-times] [--json FILE]

Each case is a level of a random smooth function on one of the meshes, in turn, and 10, 30 or 50 % of the length of its
curves removed, in turn, in one to six pieces. The truth is the unfolded distance from the whole curves, with the sign
of the function. Errors are means over the vertices, as a share of the square root of the area inside, in percent.
Times are medians of paired runs; those of potpourri3d's first query are part of its precomputation, since it factors
then. With --signs, the curves around as many random regions of each mesh: across faces, through vertices, along edges
and through midpoints of edges in turn; signs are compared with the pieces of the cut mesh, at all vertices farther than
half a mean edge from the curves. With --steps, the errors of the heat for several time steps on each mesh, for whole
levels and with 30 % of their length removed, in the mean over three of each. The errors of --cases and the times need
potpourri3d; docs/signed.md shows the tables.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl import Mesh, SignedHeatSolver, SurfaceCurve, cut, geodesic_distance, isolines
from heat_igl.curves import sublevel_areas
from heat_igl.mesh import region_boundary
from heat_igl.typing import FloatArray

from measuring import seconds_of
from scaffold import add_json, add_seed, environment, option_parser, publish, table

SHARES = (0.1, 0.3, 0.5)
LEVELS = ("ZeroSet", "None")
T_COEFS = (0.25, 0.5, 1.0, 2.0)
KINDS = ("across faces", "through vertices", "along edges", "through midpoints")


class Peer:
    """potpourri3d's signed heat method; its curves are lists of vertices, points on edges and points in faces."""

    def __init__(self, mesh: Mesh) -> None:
        import potpourri3d

        self._mesh = mesh
        self._solver = potpourri3d.MeshSignedHeatSolver(mesh.V, mesh.F)
        pairs = np.asarray(potpourri3d.edges(mesh.V, mesh.F)).tolist()
        self._edge = {frozenset(pair): (i, pair[0]) for i, pair in enumerate(pairs)}

    def nodes(self, curves: list[SurfaceCurve]) -> list[list[tuple[int, list[float]]]]:
        """The curves as it takes them, reversed: it is positive on the left."""
        found = []
        for curve in curves:
            places = [(curve.faces[0], curve.start[0]), *zip(curve.faces, curve.end, strict=True)]
            found.append([self._node(int(face), at) for face, at in places[::-1]])
        return found

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
        """The answer; a RuntimeError or a ValueError where it fails."""
        return np.asarray(self._solver.compute_distance(nodes, level_set_constraint=level))


def broken(mesh: Mesh, curve: SurfaceCurve, share: float, gaps: int, rng: np.random.Generator) -> list[SurfaceCurve]:
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


def smooth_function(mesh: Mesh, rng: np.random.Generator) -> FloatArray:
    """A sum of a few waves, at most two wavelengths across the mesh."""
    waves = rng.normal(size=(3, 4)) * rng.uniform(1, 5, 4) / np.ptp(mesh.V, axis=0).max()
    return np.asarray(np.sin(mesh.V @ waves + rng.uniform(0, 2 * np.pi, 4)) @ rng.normal(size=4))


def our_solvers(mesh: Mesh) -> dict[str, Any]:
    """By default, with the integrated distance, and refined."""
    return {
        "default": SignedHeatSolver(mesh),
        "heat": SignedHeatSolver(mesh, t_coef=T_COEFS[0]),
        "windows": SignedHeatSolver(mesh, method="windows"),
    }


def measure_case(mesh: Mesh, solvers: dict[str, Any], share: float, rng: np.random.Generator) -> dict[str, float]:
    """The errors of all solvers in one case; NaN where one fails."""
    values = smooth_function(mesh, rng)
    level = float(np.quantile(values, rng.uniform(0.3, 0.7)))
    whole = isolines(mesh, values, level)[0]
    gaps = int(rng.integers(1, 7))
    pieces = [piece for curve in whole for piece in broken(mesh, curve, share, gaps, rng)]
    truth = np.where(values < level, -1, 1) * geodesic_distance(mesh, whole)
    size = float(np.sqrt(sublevel_areas(mesh, values, level)[0]))
    answers: dict[str, FloatArray | None] = {}
    for name, solver in solvers.items():
        if isinstance(solver, Peer):
            for constraint in LEVELS:
                try:
                    answers[f"{name} {constraint}"] = solver.distance(solver.nodes(pieces), constraint)
                except (RuntimeError, ValueError):  # a factorization that failed
                    answers[f"{name} {constraint}"] = None
        else:
            answers[name] = solver.distance(pieces)
    return {
        name: np.nan if found is None else float(100 * np.abs(found - truth).mean() / size)
        for name, found in answers.items()
    }


def measure_times(mesh: Mesh, rounds: int) -> dict[str, float]:
    """Seconds, and their ratios: a curve through the middle of the mesh, whole for the peer and in every ratio."""
    height = mesh.V @ [0.3, 0.5, 0.81]
    curves = isolines(mesh, height, float(np.median(height)))[0]
    rng = np.random.default_rng(0)
    pieces = [piece for curve in curves for piece in broken(mesh, curve, 0.3, 3, rng)]
    found: dict[str, list[float]] = {}

    def ours() -> SignedHeatSolver:
        return SignedHeatSolver(mesh)

    peer = Peer(mesh)
    nodes = peer.nodes(curves)

    def theirs() -> None:
        import potpourri3d

        solver = potpourri3d.MeshSignedHeatSolver(mesh.V, mesh.F)
        solver.compute_distance(nodes, level_set_constraint="None")

    solver, refined = ours(), SignedHeatSolver(mesh, method="windows")
    queries = {
        "query": lambda: solver.distance(curves),
        "broken query": lambda: solver.distance(pieces),
        "heat query": lambda: solver.distance(curves, level="zero"),
        "refined query": lambda: refined.distance(curves),
    }
    for ask in (*queries.values(), lambda: peer.distance(nodes, "None")):
        ask()
    for _ in range(rounds):
        times = {"precomputation": (seconds_of(ours), seconds_of(theirs))}
        for name, ask in queries.items():
            times[name] = seconds_of(ask), seconds_of(lambda: peer.distance(nodes, "None"))
        for name, (one, other) in times.items():
            for key, value in ((f"{name}, s", one), (f"{name}, peer, s", other), (f"{name}, ratio", one / other)):
                found.setdefault(key, []).append(value)
    return {"vertices": mesh.n_vertices} | {name: statistics.median(each) for name, each in found.items()}


def drawn(kind: str, mesh: Mesh, values: FloatArray, level: float) -> list[SurfaceCurve]:
    """Closed curves around a region of low values, with the region on their left."""
    if kind == "across faces":
        return isolines(mesh, values, level)[0]
    if kind == "through vertices":
        return isolines(mesh, values, float(values[np.argmin(np.abs(values - level))]))[0]
    if kind == "along edges":
        return region_boundary(mesh, faces=values[mesh.F].mean(axis=1) < level)
    return region_boundary(mesh, vertices=values < level)


def wrong_signs(mesh: Mesh, count: int, rng: np.random.Generator) -> dict[str, int]:
    """Cases with a wrong sign, and vertices compared; the truth is a flood fill of the cut mesh."""
    solvers = our_solvers(mesh)
    found = {"cases": 0, "curves": 0, "vertices compared": 0}
    found |= {f"{name}, cases with a wrong sign": 0 for name in solvers}
    for case in range(count):
        values = smooth_function(mesh, rng)
        level = float(np.quantile(values, rng.uniform(0.2, 0.8)))
        curves = drawn(KINDS[case % len(KINDS)], mesh, values, level)
        pieces = cut(mesh, curves)
        left, right = (set(side[side >= 0].tolist()) for side in pieces.pieces[pieces.sides].T)
        if left & right:
            raise RuntimeError(f"case {case}: the curves do not separate the mesh")
        is_left = np.zeros(pieces.mesh.n_vertices, bool)
        is_left[pieces.mesh.F[np.isin(pieces.pieces, sorted(left))]] = True
        far = geodesic_distance(mesh, curves) > mesh.edge_lengths.mean() / 2
        found["cases"] += 1
        found["curves"] += len(curves)
        found["vertices compared"] += int(far.sum())
        for name, solver in solvers.items():
            is_wrong = (solver.distance(curves) < 0) != is_left[: mesh.n_vertices]
            found[f"{name}, cases with a wrong sign"] += bool(is_wrong[far].any())
    return found


def errors_by_step(mesh: Mesh, rng: np.random.Generator) -> dict[str, Any]:
    """Mean error for each time step: of whole levels, and with 30 % of their length removed."""
    solvers = {t_coef: SignedHeatSolver(mesh, t_coef=t_coef) for t_coef in T_COEFS}
    errors = np.zeros((2, len(T_COEFS)))
    for _ in range(3):
        values = smooth_function(mesh, rng)
        level = float(np.quantile(values, rng.uniform(0.3, 0.7)))
        whole = isolines(mesh, values, level)[0]
        truth = np.where(values < level, -1, 1) * geodesic_distance(mesh, whole)
        size = float(np.sqrt(sublevel_areas(mesh, values, level)[0]))
        pieces = [piece for curve in whole for piece in broken(mesh, curve, 0.3, 3, rng)]
        for row, curves in zip(errors, (whole, pieces), strict=True):
            row += [100 * np.abs(solver.distance(curves) - truth).mean() / size / 3 for solver in solvers.values()]
    names = [f"{what}, t = {t_coef:g} h^2" for what in ("whole", "30 % removed") for t_coef in T_COEFS]
    return {"vertices": mesh.n_vertices} | dict(zip(names, errors.ravel().tolist(), strict=True))


def summary(rows: list[dict[str, Any]]) -> str:
    names = [name for name in rows[0] if name not in ("mesh", "removed")]
    lines = []
    for share in SHARES:
        those = [row for row in rows if row["removed"] == share]
        cells = []
        for name in names:
            errors = np.array([row[name] for row in those])
            failed = int(np.isnan(errors).sum())
            cells.append(f"{np.nanmean(errors):.3g}" + (f" ({failed} failed)" if failed else ""))
        lines.append((f"{100 * share:.0f} %", str(len(those)), *cells))
    best = np.array([np.nanmin([row[name] for name in names if name.startswith("potpourri3d")]) for row in rows])
    better = [f"{int((np.array([row[name] for row in rows]) <= best).sum())} of {len(rows)}" for name in names]
    lines.append(("no worse than the better of potpourri3d's", str(len(rows)), *better))
    shares = [np.array([row[name] for row in rows]) / best for name in names]
    lines.append(("of its error, at most", "", *(f"{np.nanmax(share):.3g}" for share in shares)))
    lines.append(("in the geometric mean", "", *(f"{np.exp(np.nanmean(np.log(share))):.3g}" for share in shares)))
    return "\n".join(table(["removed", "cases", *names], lines))


def measure_errors(meshes: dict[str, Mesh], count: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """A row for each case: mesh, share removed, and the errors of all solvers."""
    solvers = {name: our_solvers(mesh) | {"potpourri3d": Peer(mesh)} for name, mesh in meshes.items()}
    rows: list[dict[str, Any]] = []
    for case in range(count):
        name, share = list(meshes)[case % len(meshes)], SHARES[case // len(meshes) % len(SHARES)]
        rows.append({"mesh": name, "removed": share} | measure_case(meshes[name], solvers[name], share, rng))
        print(rows[-1], file=sys.stderr, flush=True)
    return rows


def one_row_each(found: dict[str, dict[str, Any]]) -> str:
    """A table with a row for each mesh."""
    head = ["mesh", *next(iter(found.values()))]
    cells = [
        (name, *(f"{value:.3g}" if isinstance(value, float) else str(value) for value in row.values()))
        for name, row in found.items()
    ]
    return "\n".join(table(head, cells))


def main(argv: Sequence[str] | None = None) -> int:
    parser = option_parser(__doc__)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--cases", type=int, default=40, help="number of cases (default 40)")
    parser.add_argument("--signs", type=int, default=0, help="number of regions on each mesh for the signs (default 0)")
    parser.add_argument("--steps", action="store_true", help="errors of the heat for several time steps")
    parser.add_argument("--no-times", action="store_true", help="errors and signs only")
    add_seed(parser)
    add_json(parser)
    arguments = parser.parse_args(argv)
    rng = np.random.default_rng(arguments.seed)
    meshes = {path.stem: heat_igl.read_mesh(path) for path in arguments.meshes}
    parts: list[str] = []
    rows = measure_errors(meshes, arguments.cases, rng) if arguments.cases else []
    if rows:
        parts.append(summary(rows))
    signs = {name: wrong_signs(mesh, arguments.signs, rng) for name, mesh in meshes.items() if arguments.signs}
    times = {name: measure_times(mesh, 5) for name, mesh in meshes.items() if not arguments.no_times}
    steps = {name: errors_by_step(mesh, rng) for name, mesh in meshes.items() if arguments.steps}
    parts += [one_row_each(found) for found in (signs, times, steps) if found]
    result = {"environment": environment(), "rows": rows, "signs": signs, "times": times, "steps": steps}
    publish(result, "\n\n".join(parts), json_file=arguments.json)
    return 0


if __name__ == "__main__":
    sys.exit(main())
