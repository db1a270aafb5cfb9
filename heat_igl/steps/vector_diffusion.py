"""Heat flow of tangent vectors: one backward Euler step with a connection Laplacian."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.linear import Backend, factorize
from heat_igl.operators import Operators, with_rotations
from heat_igl.steps.fitted import fitted_laplacian
from heat_igl.steps.three_steps import shifted
from heat_igl.typing import AnyArray, FloatArray


class VectorHeatFlow:
    """One backward Euler step of the heat flow of tangent vectors, (M - t L) Y = mean_mass * b, factored.

    L is the connection Laplacian. The complex matrix A + i B is Hermitian and factored as a real symmetric one of twice
    the size, [[A, -B], [B, A]], in which the two components of a vertex are next to each other.

    Parameters
    ----------
    operators : Operators
        The domain.
    rotations : (n, n) csc_matrix of complex128
        Factors of transport along the edges, as `edge_rotations` gives it for triangles.
    t : float or (n_components,) float64
        Time step, a squared length; one for all components, or one for each.
    backend : {"auto", "scipy", "multifrontal"}
        See `factorize`.
    fitted : bool
        As for `HeatFlow`. No weight is negative then, and Y is nowhere longer than heat that starts with the lengths
        of b.
    mass : (n,) float64, optional
        In place of the diagonal of M.

    Raises
    ------
    FactorizationError
        If M - t L is not positive definite.
    """

    def __init__(
        self,
        operators: Operators,
        rotations: sp.csc_matrix,
        t: float | FloatArray,
        backend: Backend = "auto",
        fitted: bool = False,
        mass: FloatArray | None = None,
    ) -> None:
        self.t, self.mean_mass, self._n = t, operators.mean_mass, operators.n
        L = fitted_laplacian(operators, t) if fitted else operators.L
        lumped = operators.M.diagonal() if mass is None else mass
        step = operators.expand_to_vertices(t) if isinstance(t, np.ndarray) else t
        matrix = shifted(with_rotations(L, rotations), -step / self.mean_mass, lumped / self.mean_mass)
        self.factor = factorize(_real(matrix), backend, np.repeat(operators.referenced, 2))

    def solve(self, b: AnyArray) -> AnyArray:
        """Vectors Y after the time step, complex (n,) or (n, k), for initial vectors `b` in units of `mean_mass`."""
        columns = np.ascontiguousarray(b.reshape(self._n, -1).T).astype(np.complex128, copy=False)
        parts: FloatArray = columns.view(np.float64).T
        Y = self.factor.solve(parts[:, 0] if parts.shape[1] == 1 else np.ascontiguousarray(parts))
        return np.ascontiguousarray(Y.reshape(2 * self._n, -1).T).view(np.complex128).T.reshape(b.shape)


def _real(A: sp.csc_matrix) -> sp.csc_matrix:
    """A Hermitian matrix (n, n) as a real symmetric one (2 n, 2 n), with the block [[a, -b], [b, a]] for a + i b."""
    rows = A.tocsr()
    blocks = np.empty((rows.nnz, 2, 2))
    blocks[:, 0, 0] = blocks[:, 1, 1] = rows.data.real
    blocks[:, 1, 0], blocks[:, 0, 1] = rows.data.imag, -rows.data.imag
    real = sp.bsr_matrix((blocks, rows.indices, rows.indptr), shape=(2 * A.shape[0], 2 * A.shape[1])).tocsc()
    real.sort_indices()
    return real
