"""What in the paper holds and what does not, each with a number: the tables of docs/paper.md.

    python scripts/paper_claims.py                      # two to five minutes
    python scripts/paper_claims.py --quick              # small grids: seconds
    python scripts/paper_claims.py --output DIRECTORY   # for paper_claims.json and .md

Most of it happens on the paper's own mesh, the unit square of step eps = 1 / i, with its formulas as `paper_formulas`
has them. Nothing is drawn at random. Times depend on the machine; the rest does not, up to rounding.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, shapes
from heat_igl.operators import operators
from heat_igl.reference import baselines

from harness import Row, Table, parsed, publish
from paper_formulas import Square, accuracy, computation_times, distance, mean_error, power_law

Rows = list[Row]


def edge_length(sizes: Sequence[int]) -> Rows:
    """Section 4.2.1: h = (2 + sqrt 2) / 3 eps and t = 1.3 eps^2."""
    found = {f"{i}": float(shapes.grid(i).edge_lengths.mean()) * i for i in sizes}
    found["(2 + sqrt 2) / 3"] = (2 + np.sqrt(2)) / 3
    return [{"i": i, "h / eps": h, "t / eps^2": h**2} for i, h in found.items()]


def triangulation(i: int) -> Rows:
    """Section 4.2.1: F by its formula, and without the faces that it puts between the end of a row and the next."""
    rows = []
    for name, square in (
        ("formula, 1 / eps + 1 vertices to a row", Square(i, i + 1)),
        ("formula, 1 / eps vertices to a row", Square(i, i)),
        ("within rows", Square(i)),
    ):
        V, F = square.V, square.F
        edges = igl.edges(F)
        rows.append(
            {
                "faces": name,
                "number": len(F),
                "across the square": int((np.ptp(V[F, 0], axis=1) > 1.5 / i).sum()),
                "area": float(square.W.diagonal()[: len(F)].sum()),
                "h / eps": float(np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1).mean() * i),
                "mean error": mean_error(square),
            }
        )
    return rows


def signs(i: int) -> Rows:
    """Section 3.2: signs and factors of equations (5) to (11) against libigl's."""
    square = Square(i)
    L, M, G, W = square.L, square.M, square.G, square.W
    t = 1.3 / i**2
    a, b, c = (square.V[square.F[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    twice_area = np.linalg.norm(normal, axis=1, keepdims=True)
    u = np.cos(np.arange(len(square.V)))
    by_5 = sum(u[square.F[:, k], None] * np.cross(normal, e) for k, e in enumerate((c - b, a - c, b - a)))
    by_5 /= twice_area**2
    by_10 = G.T @ W @ G

    def smallest_eigenvalue(A: sp.spmatrix) -> float:
        return float(spl.eigsh((A * i**2).tocsc(), k=1, which="SA", return_eigenvectors=False)[0])

    twice = Square(i)
    twice.L = 2 * L

    def ratio(square: Square) -> float:
        return float(np.median(distance(square, t=t)[1:] / square.truth[1:]))

    found = {
        "(5) and libigl's gradient: largest difference, relative": _difference(by_5, (G @ u).reshape(3, -1).T),
        "(8): |e1 x e2| / 2 over 1 / (2 A)": float(twice_area[0, 0] ** 2 / 2),
        "(10): G^T A G and minus libigl's L: largest difference, relative": _difference(by_10, -L),
        "M - t Lap with (10): smallest eigenvalue / eps^2": smallest_eigenvalue(M - t * by_10),
        "M - t Lap with (11): smallest eigenvalue / eps^2": smallest_eigenvalue(M - t * L),
        "L_C with the factor 1/2 of (11): median of phi / d": ratio(square),
        "L_C 'the sum part' alone: median of phi / d": ratio(twice),
    }
    return [{"what": what, "value": value} for what, value in found.items()]


def _difference(found: Any, expected: Any) -> float:
    return float(abs(found - expected).max() / abs(expected).max())


def varadhan(i: int) -> Rows:
    """Equation (delta t): -sqrt(t) / 2 log v, and without the 1/2, over the distance."""
    rows = []
    square = shapes.grid(i)
    d = np.linalg.norm(square.V, axis=1)
    for domain, mesh, truth, times in (
        ("line, 1000 edges", _line(1000), np.arange(1001) / 1000, (1e-4, 1.6e-5, 1.3e-6)),
        (f"square, i = {i}", square, d, (100 / i**2, 16 / i**2, 1.3 / i**2)),
    ):
        for t in times:
            v = _log_boundary_problem(*mesh, t) if isinstance(mesh, tuple) else None
            phi = baselines.boundary_problem(square, 0, t=t) if v is None else -np.sqrt(t) * v
            ratio = float(np.median(phi[1:] / truth[1:]))
            rows.append({"domain": domain, "sqrt(t) / eps": np.sqrt(t) * (len(truth) - 1 if v is not None else i)})
            rows[-1] |= {"-sqrt(t) / 2 log v / d": ratio / 2, "-sqrt(t) log v / d": ratio}
    return rows


def _line(n: int) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """L and M of n edges that fill [0, 1]."""
    L = n * sp.diags_array([np.ones(n), -np.r_[1, np.full(n - 1, 2.0), 1], np.ones(n)], offsets=[-1, 0, 1])
    return L.tocsc(), sp.diags(np.r_[0.5, np.ones(n - 1), 0.5] / n).tocsc()


def _log_boundary_problem(L: sp.csc_matrix, M: sp.csc_matrix, t: float) -> np.ndarray:
    """The logarithm of v in (M - t L) v = 0 off vertex 0, v = 1 there."""
    A = (M - t * L).tocsc()
    v = np.ones(A.shape[0])
    v[1:] = spl.splu(A[1:, 1:]).solve(-A[1:, [0]].toarray().ravel() * 1e200)
    return np.asarray(np.r_[0, np.log(v[1:]) - np.log(1e200)])


def graph_limit(i: int) -> Rows:
    """Theorem 3.1: log u_t / log t against the number of edges phi."""
    square = shapes.grid(i)
    A = operators(square, "cotan").L
    edges = baselines.graph_distance(square, 0, count_edges=True)
    rows = []
    for decades in (1, 10, 100, 1000, 10_000, 100_000):
        found = baselines.graph_limit(A, 0, -decades * np.log(10))
        rows.append({"t": f"1e-{decades}", "largest |log u / log t - phi| / phi": _largest(found, edges)})
    return rows


def _largest(found: np.ndarray, edges: np.ndarray) -> float:
    return float((np.abs(found - edges)[1:] / edges[1:]).max())


def small_steps(i: int) -> Rows:
    """Section 4.1: "approximately the combinatorial weighted distance for smaller values of t"."""
    square = shapes.grid(i)
    d, edges = np.linalg.norm(square.V, axis=1), baselines.graph_distance(square, 0)
    rows = []
    for coefficient in (100.0, 10.0, 1.0, 0.1, 1e-2, 1e-4):
        solver = HeatMethodSolver(square, laplacian="cotan", t_coef=coefficient)
        phi = solver.distance(0)
        varadhan = baselines.varadhan(square, 0, t=solver.t)
        rows.append(
            {
                "t / h^2": coefficient,
                "used": solver.t / solver.diagnostics.mean_edge_length**2,
                "heat method, from d": float(np.abs(phi - d).mean()),
                "heat method, from edges": float(np.abs(phi - edges).mean()),
                "Varadhan, from d": float(np.abs(varadhan - d).mean()),
            }
        )
    return rows


def growth(sizes: Sequence[int], repeats: int) -> Rows:
    """Sections 4.1 and 4.2.1: exponents p in |F|^p of times and of memory, on grids."""
    times = computation_times(sizes, repeats)
    columns: dict[str, list[float]] = {
        "seconds, precomputation": [row["precomputation"] for row in times],
        "seconds, one solve": [row["solve"] for row in times],
        "entries of G": [],
        "entries of L": [],
        "entries of the Cholesky factor": [],
    }
    for i in sizes:
        square = Square(i)
        factor = _factor((square.M - 1.3 / i**2 * square.L).tocsc())
        entries = (square.G.nnz, square.L.nnz, factor.L.nnz)
        for name, value in zip(list(columns)[2:], entries, strict=True):
            columns[name].append(value)
    return [
        {"what": name, "at the largest": values[-1], "exponent of |F|": power_law(sizes, values)["exponent"] / 2}
        for name, values in columns.items()
    ]


def _factor(A: sp.csc_matrix) -> Any:
    return spl.splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def memory(mesh: Mesh) -> Rows:
    """Section 4.1: what the matrices of a mesh of 50 000 vertices take, dense and sparse."""
    domain = operators(mesh, "cotan")
    n, m = mesh.n_vertices, mesh.n_faces
    factor = _factor((domain.M - domain.mean_edge_length**2 * domain.L).tocsc())
    # One triangle of the symmetric factor, its values and row numbers.
    entries = {
        "150 000 x 150 000": (9 * n * n, None),
        "three of |V| x |V|": (3 * n * n, None),
        "|V| x |V|": (n * n, None),
        "gradient, 3|F| x |V|": (3 * m * n, _bytes(domain.G)),
        "divergence, |V| x 3|F|": (3 * m * n, _bytes(domain.D)),
        "Laplacian, |V| x |V|": (n * n, _bytes(domain.L)),
        "mass, |V| x |V|": (n * n, _bytes(domain.M)),
        "Cholesky factor": (n * n, factor.L.nnz * 12),
    }
    rows: Rows = [
        {"matrix": name, "entries / 1e9": k / 1e9, "dense GB": 8 * k / 1e9, "sparse MB": size and size / 1e6}
        for name, (k, size) in entries.items()
    ]
    total = sum(size for _, size in entries.values() if size)
    return [*rows, {"matrix": "sparse, together", "entries / 1e9": None, "dense GB": None, "sparse MB": total / 1e6}]


def _bytes(A: sp.csc_matrix) -> int:
    return int(A.data.nbytes + A.indices.nbytes + A.indptr.nbytes)


def expected_accuracy(sizes: Sequence[int]) -> Rows:
    """Section 4.2.2: the mean of eps phi - d, its bound, and what is measured."""
    rows = []
    for i in sizes:
        found = accuracy(i)
        square = shapes.grid(i)
        edges = square.V.sum(axis=1)
        largest = ((edges - np.linalg.norm(square.V, axis=1))[1:] / edges[1:]).max()
        rows.append({"i": i, "largest (eps phi - d) / (eps phi)": float(largest)})
        rows[-1] |= {name: found[name] for name in ("bound", "edges", "heat", "log_gradient", "sweep")}
        rows[-1]["theory / heat"] = found["edges"] / found["heat"]
    return rows


#: What may have made the error rise at i = 56: options of `paper_formulas.distance`, or of `Square`.
SUSPECTS: dict[str, dict[str, Any]] = {
    "double precision": {},
    "single precision": {"dtype": np.float32},
    "single precision, Poisson matrix not grounded": {"dtype": np.float32, "grounded": False},
    "single precision, norm that cannot underflow": {"dtype": np.float32, "safe_norm": True},
    "single precision, u0 = 1 in (id - t Lap) u = u0": {"dtype": np.float32, "unit_heat": True},
    "single precision, t = eps^2": {"dtype": np.float32, "t_coef": 1.0},
    "single precision, t = 2.6 eps^2 (L_C without 1/2)": {"dtype": np.float32, "t_coef": 2.6},
    "index formula, 1 / eps + 1 to a row": {"per_row": 1},
    "index formula, 1 / eps to a row": {"per_row": 0},
    "int(1 / eps) in double precision": {"truncated": np.float64},
    "int(1 / eps) in single precision": {"truncated": np.float32},
    "conjugate gradients for heat, 1e-5": {"heat_tolerance": 1e-5},
    "conjugate gradients for heat, 1e-12": {"heat_tolerance": 1e-12},
    "conjugate gradients for Poisson, 1e-5": {"poisson_tolerance": 1e-5},
    "|grad u| below 1e-8 is zero": {"threshold": 1e-8},
    "|grad u| below 1e-16 is zero": {"threshold": 1e-16},
    "|grad u| below 1e-24 is zero": {"threshold": 1e-24},
    "|grad u| below 1e-30 is zero": {"threshold": 1e-30},
    "Poisson matrix not grounded": {"grounded": False},
    "Poisson matrix plus 1e-6 id": {"poisson_shift": 1e-6},
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
        growth = errors[1:] / errors[:-1]
        rises = growth > 1
        upward = [i for i, *three in zip(sizes[1:], rises, rises[1:], rises[2:], strict=False) if all(three)]
        at = dict(zip(sizes, errors, strict=True))
        rows.append(
            {
                "suspect": name,
                "error at 55": float(at[55]),
                "at 56": float(at[56]),
                "at 57": float(at[57]),
                "upward from": upward[0] if upward else None,
                "jumps by half at": [int(i) for i in np.asarray(sizes[1:])[growth > 1.5]],
            }
        )
    return rows


def cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value).replace("|", r"\|")


def claims(quick: bool) -> dict[str, Rows]:
    """All tables, by title."""
    i = 20 if quick else 70
    todo: dict[str, Callable[[], Rows]] = {
        "Mean edge length and time step": lambda: edge_length((10, 70, 300)),
        f"Triangulation, i = {i}": lambda: triangulation(i),
        f"Signs and factors, i = {i}": lambda: signs(i),
        "Varadhan's factor": lambda: varadhan(40 if quick else 300),
        f"Theorem 3.1, i = {i}": lambda: graph_limit(i),
        f"Small time steps, i = {i}": lambda: small_steps(i),
        "Growth": lambda: growth((10, 20, 30, 40) if quick else (50, 100, 150, 200, 250, 300), 1 if quick else 3),
        "Memory": lambda: memory(shapes.torus(25, 20) if quick else shapes.torus(250, 200)),
        "Expected accuracy": lambda: expected_accuracy((5, 10, 20) if quick else (10, 30, 56, 100, 200)),
        "The jump at i = 56": lambda: jump(range(52, 60) if quick else range(10, 81)),
    }
    return {title: rows() for title, rows in todo.items()}


def main(argv: Sequence[str] | None = None) -> None:
    # The errors of the paper's method are what is measured here.
    warnings.simplefilter("ignore", AccuracyWarning)
    options = parsed(__doc__, argv, quick=False)
    tables = {}
    for title, rows in claims(options.quick).items():
        shown = [{name: cell(value) for name, value in row.items()} for row in rows]
        tables[title] = Table(shown, {cell(name): name for name in rows[0]}, f"## {title}")
    publish(options, tables)


if __name__ == "__main__":
    sys.exit(main())
