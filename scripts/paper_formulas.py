"""What `paper_claims` and `paper_figures` measure: the paper's formulas as printed, times on grids and their growth.

The formulas are for its triangulation of the unit square, in double or single precision: `heat_igl.steps` is the way to
run the three steps.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from scipy.optimize import curve_fit

from heat_igl import GeodesicSolver, HeatMethodSolver, shapes
from heat_igl.operators import operators
from heat_igl.reference import baselines
from heat_igl.steps import diffuse, integrate, normalize


class Square:
    """Operators of the unit square of step ``eps = 1 / i`` from (7) to (11), with libigl's signs.

    `per_row` takes the paper's index formula for the faces literally, with so many vertices to a row: 1 / eps as its
    formula for d has it, or the 1 / eps + 1 of its vertices. `heat_igl.shapes.grid` leaves out the faces that go from
    the end of one row to the start of the next.
    """

    def __init__(self, i: int, per_row: int | None = None) -> None:
        self.i = i
        if per_row is None:
            mesh = shapes.grid(i)
            V, F = mesh.V, mesh.F
        else:
            V, F = printed_triangulation(i, per_row)
        self.V, self.F = V, F
        self.truth = np.linalg.norm(V, axis=1)
        self.L = igl.cotmatrix(V, F)
        self.M = igl.massmatrix(V, F, igl.MASSMATRIX_TYPE_BARYCENTRIC)
        self.G = igl.grad(V, F)
        self.W = sp.diags(np.tile(igl.doublearea(V, F) / 2, 3)).tocsc()


def printed_triangulation(i: int, per_row: int) -> tuple[np.ndarray, np.ndarray]:
    """``F = {(k, k + 1, k + n), (k, k + n, k + n - 1)}``, as far as these are vertices, with n = `per_row`."""
    k = np.arange(per_row**2)
    F = np.concatenate([np.c_[k, k + 1, k + per_row], np.c_[k, k + per_row, k + per_row - 1]])
    V = np.c_[k % per_row, k // per_row, np.zeros(len(k))] / i
    return V, F[F.max(axis=1) < len(k)]


def distance(
    square: Square,
    *,
    dtype: type = np.float64,
    t: float | None = None,
    unit_heat: bool = False,
    safe_norm: bool = False,
    threshold: float = 0.0,
    heat_tolerance: float | None = None,
    poisson_tolerance: float | None = None,
    grounded: bool = True,
    poisson_shift: float = 0.0,
) -> np.ndarray:
    """Section 3 from vertex 0, shifted so that the smallest value is 0, with one thing or another done differently.

    Parameters
    ----------
    square : Square
    dtype : type
        Of every array and both solves.
    t : float, optional
        1.3 eps^2 by default.
    unit_heat : bool
        The right-hand side of (4) as theorem 3.1 has it, (id - t Lap) u = delta with 1 at the source; by default
        delta is an integral, as in (VA - t L_C) u = u0.
    safe_norm : bool
        Divide each gradient by its largest entry before it is squared.
    threshold : float
        Shorter gradients count as zero, and X with them.
    heat_tolerance, poisson_tolerance : float, optional
        Relative tolerance of conjugate gradients in place of a factorization.
    grounded : bool
        Hold phi at the source; otherwise the singular matrix is factored as it is.
    poisson_shift : float
        Multiple of the identity added to the Poisson matrix instead.
    """
    L, M = square.L.astype(dtype), square.M.astype(dtype)
    t = 1.3 / square.i**2 if t is None else t
    u0 = np.zeros(len(square.V), dtype)
    u0[0] = M[0, 0] if unit_heat else 1
    with np.errstate(under="ignore"):
        u = _solved((M - dtype(t) * L).tocsc(), u0, heat_tolerance)
        X = -_normalized((square.G.astype(dtype) @ u).reshape(3, -1), safe_norm, threshold)
    b = -(square.G.T.astype(dtype) @ (square.W.astype(dtype) @ X.ravel()))
    phi = np.zeros(len(b), dtype)
    if poisson_tolerance is not None:
        phi = _solved(-L, -b, poisson_tolerance)
    elif poisson_shift:
        phi = _solved((dtype(poisson_shift) * sp.identity(len(b), dtype) - L).tocsc(), -b)
    elif grounded:
        phi[1:] = _solved(-L[1:, 1:], -b[1:])
    else:
        phi = _solved(-L, -b)
    return np.asarray(phi - phi.min(), np.float64)


def mean_error(square: Square, **options: Any) -> float:
    """Mean of |phi - d| over the vertices, d the straight line from vertex 0; options of `distance`."""
    return float(np.abs(distance(square, **options) - square.truth).mean())


def _normalized(gradient: np.ndarray, safe: bool, threshold: float) -> np.ndarray:
    """Unit vectors, by a norm that squares its entries; 0 where that is 0 or below the threshold."""
    if safe:
        largest = np.abs(gradient).max(axis=0)
        gradient = gradient / np.where(largest > 0, largest, 1)
    norm = np.sqrt((gradient * gradient).sum(axis=0))
    kept = norm > threshold
    return np.asarray(np.where(kept, gradient / np.where(kept, norm, 1), 0))


def _solved(A: sp.csc_matrix, b: np.ndarray, tolerance: float | None = None) -> np.ndarray:
    if tolerance is not None:
        return np.asarray(spl.cg(A, b, rtol=tolerance, atol=0.0, maxiter=20 * len(b))[0])
    try:
        return np.asarray(spl.splu(A.tocsc()).solve(b))
    except RuntimeError:  # exactly singular
        return np.full(len(b), np.nan, b.dtype)


def computation_times(sizes: Sequence[int], repeats: int) -> list[dict[str, float]]:
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
    return [{"i": i, "faces": 2 * i * i, "precomputation": a, "solve": b} for i, (a, b) in least.items()]


def polynomial_errors(i: Sequence[float], seconds: Sequence[float], degrees: Iterable[int]) -> list[dict[str, float]]:
    """Root mean square error of least-squares polynomials, over the mean time: on the data, and left out one by one.

    A point left out is predicted by the fit to all others; the leverages give that without fitting again.
    """
    x, y = np.asarray(i, float), np.asarray(seconds, float)
    x = 2 * (x - x.min()) / np.ptp(x) - 1
    rows = []
    for degree in degrees:
        basis, _ = np.linalg.qr(np.polynomial.legendre.legvander(x, degree))
        residual = y - basis @ (basis.T @ y)
        left_out = residual / (1 - (basis**2).sum(axis=1))
        rows.append({"degree": degree, "in_sample": _rms(residual) / y.mean(), "left_out": _rms(left_out) / y.mean()})
    return rows


def power_law(i: Sequence[float], seconds: Sequence[float]) -> dict[str, float]:
    """Least-squares fit of ``a i^p``: p, and the two errors of `polynomial_errors`."""
    x, y = np.asarray(i, float), np.asarray(seconds, float)
    scale = x.max()

    def law(x: np.ndarray, a: float, p: float) -> np.ndarray:
        return np.asarray(a * (x / scale) ** p)

    def fit(chosen: np.ndarray) -> np.ndarray:
        return np.asarray(curve_fit(law, x[chosen], y[chosen], p0=(y.max(), 2.0))[0])

    everything = fit(np.ones(len(x), bool))
    left_out = [y[k] - law(x[k], *fit(np.arange(len(x)) != k)) for k in range(len(x))]
    return {
        "exponent": float(everything[1]),
        "in_sample": _rms(y - law(x, *everything)) / float(y.mean()),
        "left_out": _rms(np.array(left_out)) / float(y.mean()),
    }


def accuracy(i: int) -> dict[str, float]:
    """Mean error of distances from the corner of the square of step 1 / i, |d - truth| over all vertices.

    ``edges`` is the curve that the paper's section 4.2.2 expects, paths along edges; ``bound`` the one it is bounded
    by. ``heat`` is the paper's three steps at its t, ``log_gradient`` takes the direction from log u instead of u;
    ``default`` and ``sweep`` are `HeatMethodSolver`, and `GeodesicSolver` with ``method="sweep"``.
    """
    square = shapes.grid(i)
    truth = np.linalg.norm(square.V, axis=1)
    domain = operators(square, "cotan")
    t = 1.3 / i**2
    delta = np.zeros(square.n_vertices)
    delta[0] = 1e290
    u = diffuse(domain, delta, t)

    def error(distance: np.ndarray) -> float:
        return float(np.abs(distance - truth).mean())

    return {
        "i": i,
        "bound": float((square.V.sum(axis=1) / 2).mean()),
        "edges": error(baselines.graph_distance(square, 0, count_edges=True) / i),
        "heat": error(integrate(domain, normalize(domain, u))),
        "log_gradient": error(integrate(domain, normalize(domain, np.log(u)))),
        "default": error(HeatMethodSolver(square).distance(0)),
        "sweep": error(GeodesicSolver(square, method="sweep").distance(0)),
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
