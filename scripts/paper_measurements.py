"""What `paper_claims` and `paper_figures` both measure: times on grids, their growth, and errors on the unit square."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

import numpy as np
from scipy.optimize import curve_fit

from heat_igl import GeodesicSolver, HeatMethodSolver, shapes
from heat_igl.operators import operators
from heat_igl.reference import baselines
from heat_igl.steps import diffuse, integrate, normalize


def computation_times(sizes: Sequence[int], repeats: int) -> list[dict[str, float]]:
    """Seconds of processor time on grids of step 1 / i: everything before the first source, and one solve.

    The paper's operators (``laplacian="cotan"``). Not the clock on the wall, on which a busy machine writes three times
    as much; and the shortest of `repeats` runs, since what else the machine does only adds to it.
    """
    HeatMethodSolver(shapes.grid(4), laplacian="cotan").distance(0)  # libraries are loaded
    seconds: dict[int, list[tuple[float, float]]] = {i: [] for i in sizes}
    for _ in range(repeats):
        for i in sizes:
            square = shapes.grid(i)
            start = time.process_time()
            solver = HeatMethodSolver(square.V, square.F, laplacian="cotan")
            ready = time.process_time()
            solver.distance(0)
            seconds[i].append((ready - start, time.process_time() - ready))
    rows = []
    for i in sizes:
        before, solve = (min(column) for column in zip(*seconds[i], strict=True))
        rows.append({"i": i, "faces": 2 * i * i, "precomputation": before, "solve": solve})
    return rows


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
