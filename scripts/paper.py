"""What in the paper holds and what does not, each with a number: the tables and figures of docs/paper.md.

    python scripts/paper.py                            # the tables: two to five minutes
    python scripts/paper.py --figures docs/images      # the tables and their figures
    python scripts/paper.py --quick                    # small grids: seconds

Most of it happens on the paper's own mesh, the unit square of step eps = 1 / i, with distances from a corner. Nothing
is drawn at random. Times depend on the machine; the rest does not, up to rounding. Figures need the extra ``view``.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl import AccuracyWarning, GeodesicSolver, HeatMethodSolver, Mesh, shapes
from heat_igl.heat.steps import diffuse, integrate, normalize, smallest_time_step
from heat_igl.operators import operators
from heat_igl.reference import edge_paths

from harness import Row, as_they_are, parsed, publish

Rows = list[Row]


# The formulas as printed: `heat_igl.heat.steps` is the way to run the three steps.


class Square:
    """Operators of the unit square of step ``eps = 1 / i`` from (7) to (11), with libigl's signs.

    `per_row` takes the paper's index formula for the faces literally, with so many vertices to a row: 1 / eps as its
    formula for d has it, or the 1 / eps + 1 of its vertices. `heat_igl.shapes.grid` leaves out the faces that go from
    the end of one row to the start of the next.
    """

    def __init__(self, i: int, per_row: int | None = None) -> None:
        mesh = shapes.grid(i)
        V, F = mesh.V, mesh.F
        if per_row is not None:
            # F = {(k, k + 1, k + n), (k, k + n, k + n - 1)}, as far as these are vertices, with n = `per_row`.
            k = np.arange(per_row**2)
            F = np.concatenate([np.c_[k, k + 1, k + per_row], np.c_[k, k + per_row, k + per_row - 1]])
            V, F = np.c_[k % per_row, k // per_row, np.zeros(len(k))] / i, F[F.max(axis=1) < len(k)]
        self.i, self.V, self.F = i, V, F
        self.truth = np.linalg.norm(V, axis=1)
        self.L = igl.cotmatrix(V, F)
        self.M = igl.massmatrix(V, F, igl.MASSMATRIX_TYPE_BARYCENTRIC)
        self.G = igl.grad(V, F)
        self.W = sp.diags(np.tile(igl.doublearea(V, F) / 2, 3)).tocsc()


def distance(
    square: Square, *, dtype: type = np.float64, t: float | None = None, safe_norm: bool = False, threshold: float = 0
) -> np.ndarray:
    """Section 3 from vertex 0, shifted so that the smallest value is 0, with one thing or another done differently.

    `dtype` is that of every array and both solves, and `t` is 1.3 eps^2 by default. With `safe_norm`, each gradient is
    divided by its largest entry before it is squared. Where the gradient is shorter than `threshold`, X is zero.
    """
    L, M, G = (A.astype(dtype) for A in (square.L, square.M, square.G))
    t = 1.3 / square.i**2 if t is None else t
    u0 = np.zeros(len(square.V), dtype)
    u0[0] = 1
    with np.errstate(under="ignore"):
        u = spl.splu((M - dtype(t) * L).tocsc()).solve(u0)
        gradient = (G @ u).reshape(3, -1)
        if safe_norm:
            largest = np.abs(gradient).max(axis=0)
            gradient = gradient / np.where(largest > 0, largest, 1)
        norm = np.sqrt((gradient * gradient).sum(axis=0))
        kept = norm > threshold
        X = -np.where(kept, gradient / np.where(kept, norm, 1), 0)
    b = -(G.T @ (square.W.astype(dtype) @ X.ravel()))
    phi = np.zeros(len(b), dtype)
    phi[1:] = spl.splu(-L[1:, 1:].tocsc()).solve(-b[1:])
    return np.asarray(phi - phi.min(), np.float64)


def mean_error(square: Square, **options: Any) -> float:
    """Mean of |phi - d| over the vertices, d the straight line from vertex 0; options of `distance`."""
    return float(np.abs(distance(square, **options) - square.truth).mean())


# The tables.


def triangulation(i: int) -> Rows:
    """Section 4.2.1: F by its formula, and without the faces that it puts between the end of a row and the next."""
    rows = []
    for name, square in (
        ("formula, 1 / eps + 1 vertices to a row", Square(i, i + 1)),
        ("formula, 1 / eps vertices to a row", Square(i, i)),
        ("within rows", Square(i)),
    ):
        V, F = square.V, square.F
        area = float(square.W.diagonal()[: len(F)].sum())
        row: Row = {"faces": name, "number": len(F), "across the square": int((np.ptp(V[F, 0], 1) > 1.5 / i).sum())}
        rows.append(row | {"area": area, "mean error": mean_error(square)})
    return rows


def signs(i: int) -> Rows:
    """Section 3.2: signs and factors of equations (5) to (11) against libigl's."""
    square = Square(i)
    L, M, G, W = square.L, square.M, square.G, square.W
    a, b, c = (square.V[square.F[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    twice_area = np.linalg.norm(normal, axis=1, keepdims=True)
    u = np.cos(np.arange(len(square.V)))
    by_5 = sum(u[square.F[:, k], None] * np.cross(normal, e) for k, e in enumerate((c - b, a - c, b - a)))
    by_5 /= twice_area**2
    by_10 = G.T @ W @ G

    def smallest_eigenvalue(A: sp.spmatrix) -> float:
        return float(spl.eigsh((A * i**2).tocsc(), k=1, which="SA", return_eigenvectors=False)[0])

    def off(found: Any, expected: Any) -> float:
        return float(abs(found - expected).max() / abs(expected).max())

    def ratio(square: Square) -> float:
        return float(np.median(distance(square)[1:] / square.truth[1:]))

    twice = Square(i)
    twice.L = 2 * L
    found = {
        "(5) and libigl's gradient: largest difference, relative": off(by_5, (G @ u).reshape(3, -1).T),
        "(8): |e1 x e2| / 2 over 1 / (2 A)": float(twice_area[0, 0] ** 2 / 2),
        "(10): G^T A G and minus libigl's L: largest difference, relative": off(by_10, -L),
        "M - t Lap with (10): smallest eigenvalue / eps^2": smallest_eigenvalue(M - 1.3 / i**2 * by_10),
        "M - t Lap with (11): smallest eigenvalue / eps^2": smallest_eigenvalue(M - 1.3 / i**2 * L),
        "L_C with the factor 1/2 of (11): median of phi / d": ratio(square),
        "L_C 'the sum part' alone: median of phi / d": ratio(twice),
    }
    return [{"what": what, "value": value} for what, value in found.items()]


def logarithm_of_heat(mesh: Mesh, sources: Any, t: float) -> np.ndarray:
    """-sqrt(t) log v with v = u / u_source, u of equation (delta t); t is raised if heat would underflow."""
    domain, initial = operators(mesh), np.zeros(mesh.n_vertices)
    t = max(t, smallest_time_step(domain.longest_distance, domain.mean_edge_length))
    initial[sources] = 1e290
    u = diffuse(domain, initial, t)
    return -np.sqrt(t) * np.log(u / u[sources].max())


def varadhan(i: int) -> Rows:
    """Equation (delta t): -sqrt(t) / 2 log v, and without the 1/2, over the distance."""
    line, square = shapes.strip(1000, 1), shapes.grid(i)
    left = np.flatnonzero(line.V[:, 0] == 0)
    rows = []
    for domain, mesh, sources, eps, truth in (
        ("line, 1000 edges", line, left, 1, line.V[:, 0]),
        (f"square, i = {i}", square, 0, 1 / i, np.linalg.norm(square.V, axis=1)),
    ):
        for steps in (10, 4, 1.14):
            phi = logarithm_of_heat(mesh, sources, (steps * eps) ** 2)
            ratio = float(np.median(phi[truth > 0] / truth[truth > 0]))
            row: Row = {"domain": domain, "sqrt(t) / eps": steps}
            rows.append(row | {"-sqrt(t) / 2 log v / d": ratio / 2, "-sqrt(t) log v / d": ratio})
    return rows


def small_steps(i: int) -> Rows:
    """Section 4.1: "approximately the combinatorial weighted distance for smaller values of t"."""
    square = shapes.grid(i)
    d, edges = np.linalg.norm(square.V, axis=1), edge_paths(square, 0)
    rows = []
    for coefficient in (100.0, 10.0, 1.0, 0.1, 1e-2, 1e-4):
        solver = HeatMethodSolver(square, laplacian="cotan", t_coef=coefficient)
        phi, logarithm = solver.distance(0), logarithm_of_heat(square, 0, solver.t)
        row: Row = {"t / h^2": coefficient, "heat method, from d": float(np.abs(phi - d).mean())}
        row |= {"heat method, from edges": float(np.abs(phi - edges).mean())}
        rows.append(row | {"Varadhan, from d": float(np.abs(logarithm - d).mean())})
    return rows


def computation_times(sizes: Sequence[int], repeats: int) -> Rows:
    """Seconds of processor time on grids of step 1 / i: everything before the first source, and one solve.

    The paper's operators (``laplacian="cotan"``). Not the clock on the wall, on which a busy machine writes three times
    as much; and the shortest of `repeats` runs, since what else the machine does only adds to it.
    """
    HeatMethodSolver(shapes.grid(4), laplacian="cotan").distance(0)  # libraries are loaded
    least = {i: [np.inf, np.inf] for i in sizes}
    for i in [*sizes] * repeats:
        square = shapes.grid(i)
        start = time.process_time()
        solver = HeatMethodSolver(square.V, square.F, laplacian="cotan")
        ready = time.process_time()
        solver.distance(0)
        least[i] = [min(least[i][0], ready - start), min(least[i][1], time.process_time() - ready)]
    return [{"i": i, "precomputation": a, "solve": b} for i, (a, b) in least.items()]


def power(sizes: Sequence[float], values: Sequence[float]) -> float:
    """The exponent p of the power law ``a i^p``, fitted to the values rather than to their logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(values), 1, w=values)[0])


def growth(times: Rows) -> Rows:
    """Sections 4.1 and 4.2.1: exponents p in |F|^p of times and of memory, on grids."""
    sizes = [row["i"] for row in times]
    columns = {f"processor seconds, {name}": [row[name] for row in times] for name in ("precomputation", "solve")}
    symmetric = {"SymmetricMode": True}
    entries = []
    for square in map(Square, sizes):
        A = (square.M - 1.3 / square.i**2 * square.L).tocsc()
        factor = spl.splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=symmetric).L
        entries.append((square.G.nnz, square.L.nnz, factor.nnz))
    names = ("entries of G", "entries of L", "entries of the Cholesky factor")
    columns |= dict(zip(names, map(list, zip(*entries, strict=True)), strict=True))
    return [
        {"what": name, "at the largest": values[-1], "exponent of |F|": power(sizes, values) / 2}
        for name, values in columns.items()
    ]


def accuracy(i: int) -> Row:
    """Section 4.2.2: mean of |d - truth| over the vertices of the square of step 1 / i.

    ``edges`` is the curve that the paper expects, paths along edges; ``bound`` the one it is bounded by. ``heat`` is
    the paper's three steps at its t, ``log_gradient`` takes the direction from log u instead of u.
    """
    square = shapes.grid(i)
    truth = np.linalg.norm(square.V, axis=1)
    domain = operators(square, "cotan")
    delta = np.zeros(square.n_vertices)
    delta[0] = 1e290
    u = diffuse(domain, delta, 1.3 / i**2)
    edges = square.V.sum(axis=1)
    row = {
        "i": i,
        "largest (eps phi - d) / (eps phi)": float(((edges - truth)[1:] / edges[1:]).max()),
        "bound": float((edges / 2).mean()),
    }
    for name, found in (
        ("edges", edge_paths(square, 0, count_edges=True) / i),
        ("heat", integrate(domain, normalize(domain, u))),
        ("log_gradient", integrate(domain, normalize(domain, np.log(u)))),
        ("sweep", GeodesicSolver(square, method="sweep").distance(0)),
    ):
        row[name] = float(np.abs(found - truth).mean())
    return row | {"theory / heat": row["edges"] / row["heat"]}


#: What may have made the error rise at i = 56: options of `distance` or of `Square`.
SUSPECTS: dict[str, dict[str, Any]] = {
    "double precision": {},
    "single precision": {"dtype": np.float32},
    "single precision, norm that cannot underflow": {"dtype": np.float32, "safe_norm": True},
    "single precision, t = eps^2": {"dtype": np.float32, "t_coef": 1.0},
    "single precision, t = 2.6 eps^2 (L_C without 1/2)": {"dtype": np.float32, "t_coef": 2.6},
    "index formula, 1 / eps + 1 to a row": {"per_row": 1},
    "index formula, 1 / eps to a row": {"per_row": 0},
    "int(1 / eps) in double precision": {"truncated": np.float64},
    "int(1 / eps) in single precision": {"truncated": np.float32},
    "|grad u| below 1e-8 is zero": {"threshold": 1e-8},
    "|grad u| below 1e-16 is zero": {"threshold": 1e-16},
    "|grad u| below 1e-24 is zero": {"threshold": 1e-24},
}


def suspect_error(square: Square, options: dict[str, Any]) -> float:
    """Mean error on the square of step 1 / i with one of `SUSPECTS` in place."""
    options, i = dict(options), square.i
    if "per_row" in options:
        square = Square(i, i + options.pop("per_row"))
    if "t_coef" in options:
        options["t"] = options.pop("t_coef") / i**2
    if "truncated" in options:
        # d(k) = eps sqrt((k mod n)^2 + (k // n)^2) with n from 1 / eps in floating point.
        real = options.pop("truncated")
        per_row = int(real(1) / (real(1) / real(i))) + 1
        k = np.arange(len(square.V))
        return float(np.abs(distance(square, **options) - np.hypot(k % per_row, k // per_row) / i).mean())
    return mean_error(square, **options)


def jump(sizes: Sequence[int]) -> Rows:
    """Section 4.2.2: which suspect makes the error of figure 5 rise, and where."""
    squares = [Square(i) for i in sizes]
    rows: Rows = []
    for name, options in SUSPECTS.items():
        errors = np.array([suspect_error(square, options) for square in squares])
        rises = errors[1:] > errors[:-1]
        upward = [i for i, *three in zip(sizes[1:], rises, rises[1:], rises[2:], strict=False) if all(three)]
        jumps = np.asarray(sizes[1:])[errors[1:] > 1.5 * errors[:-1]].tolist()
        row: Row = {"suspect": name} | {f"error at {i}": float(errors[list(sizes).index(i)]) for i in (55, 56, 57)}
        rows.append(row | {"upward from": upward[0] if upward else None, "jumps by half at": jumps})
    return rows


# The figures.


def draw(folder: Path, times: Rows, errors: Rows, sizes: Sequence[int]) -> None:
    """Times against i, mean errors against i, and the rise at i = 56 in double and single precision."""
    from matplotlib.figure import Figure

    def figure(name: str, rows: Rows, lines: dict[str, str], scale: str, y: str) -> None:
        drawn = Figure(figsize=(4.5, 3.6), layout="constrained")
        panel = drawn.subplots()
        for (key, text), style in zip(lines.items(), ("-", "--", ":", "-."), strict=False):
            panel.plot([row["i"] for row in rows], [row[key] for row in rows], style, label=text)
        panel.set(xscale=scale, yscale=scale, xlabel="cells per side $i$ (step $1/i$, $2i^2$ faces)", ylabel=y)
        for axis in (panel.xaxis, panel.yaxis) if scale == "log" else ():
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("")
        panel.grid(color="0.88", linewidth=0.4)
        drawn.legend(loc="outside upper left", frameon=False)
        drawn.savefig(folder / f"paper_{name}.png", dpi=200)

    seconds = {k: f"{k}, about $i^{{{power(*zip(*((r['i'], r[k]) for r in times), strict=True)):.2f}}}$"
               for k in ("precomputation", "solve")}  # fmt: skip
    figure("2", times, seconds, "log", "processor time in s")
    curves = {"heat": "heat", "edges": r"the paper's theory, $\varepsilon\varphi - d$", "bound": "the paper's bound",
              "log_gradient": r"heat, direction of $\nabla \log u$"}  # fmt: skip
    figure("5", errors, curves, "log", "mean error")
    names = [*SUSPECTS][:3]
    squares = [(i, Square(i)) for i in sizes]
    rows: Rows = [{"i": i} | {name: suspect_error(square, SUSPECTS[name]) for name in names} for i, square in squares]
    figure("5_jump", rows, {name: name for name in names}, "linear", "mean error")


def main(argv: Sequence[str] | None = None) -> None:
    # The errors of the paper's method are what is measured here.
    warnings.simplefilter("ignore", AccuracyWarning)
    options = parsed(__doc__, argv, quick=False, figures=Path)
    i = 20 if options.quick else 70
    times = computation_times((10, 20, 30, 40) if options.quick else range(50, 301, 50), 1 if options.quick else 3)
    makers: dict[str, Callable[[], Rows]] = {
        f"Triangulation, i = {i}": lambda: triangulation(i),
        f"Signs and factors, i = {i}": lambda: signs(i),
        "Varadhan's factor": lambda: varadhan(40 if options.quick else 300),
        f"Small time steps, i = {i}": lambda: small_steps(i),
        "Growth": lambda: growth(times),
        "Accuracy": lambda: [accuracy(i) for i in ((5, 10, 20) if options.quick else (10, 30, 56, 100, 200))],
        "The jump at i = 56": lambda: jump(range(52, 60) if options.quick else range(10, 81)),
    }
    publish(options, {title: as_they_are(make(), f"## {title}", ".4g") for title, make in makers.items()})
    if options.figures:
        errors = [accuracy(i) for i in (range(2, 21) if options.quick else range(2, 121))]
        draw(options.figures, times, errors, range(48, 60, 4) if options.quick else range(40, 71))


if __name__ == "__main__":
    main()
