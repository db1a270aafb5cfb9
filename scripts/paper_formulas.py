"""The paper's formulas as printed, on its triangulation of the unit square, in double or single precision.

For `paper_claims` and figure 5 only: `heat_igl.steps` is the way to run the three steps.
"""

from __future__ import annotations

from typing import Any

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl import shapes


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
