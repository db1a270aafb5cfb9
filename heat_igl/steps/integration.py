"""Step 3: the function whose gradient is closest to the field of step 2, by a Poisson problem."""

from __future__ import annotations

import numpy as np

from heat_igl.linear import Analysis, Backend, analyse
from heat_igl.operators import Operators
from heat_igl.steps.pattern import shifted
from heat_igl.typing import FloatArray

__all__ = ["PoissonProblem", "integrate"]


class PoissonProblem:
    """L phi = b, factored, with one vertex of each component grounded.

    The constants on each component are the null space of L. Fixing one value in each removes the null space and changes
    nothing else; adding a small multiple of the identity instead would distort the solution on large domains.

    Parameters
    ----------
    operators : Operators
        The domain.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        See `factorize`.
    analysis : Analysis, optional
        As `analysis` makes it for a domain with the same pattern of L, to be shared; made anew if it does not fit.

    Raises
    ------
    FactorizationError
        If -L without the grounded vertices is not positive definite.
    """

    def __init__(self, operators: Operators, backend: Backend = "auto", analysis: Analysis | None = None) -> None:
        free = operators.referenced.copy()
        # The first vertex of every component; components without faces are not free anyway.
        free[np.unique(operators.components, return_index=True)[1]] = False
        # Here, and only here, the sign changes: L is negative semidefinite, factors need a positive definite matrix.
        matrix = shifted(operators.L, -1.0, np.zeros(operators.n))
        if analysis is None or not analysis.fits(matrix):
            analysis = analyse(matrix, backend)
        self.backend = analysis.backend
        self.factor = analysis.factorize(matrix, free)

    def solve(self, b: FloatArray) -> FloatArray:
        """The solution phi, 0 at the grounded vertices. On each component b must sum to 0, as a divergence does."""
        phi = self.factor.solve(b)
        # The right-hand side's sign, turned afterwards and in place: at a million vertices a copy costs milliseconds.
        return np.asarray(np.subtract(0.0, phi, out=phi))


def integrate(operators: Operators, X: FloatArray) -> FloatArray:
    """Step 3: the function whose gradient is closest to X, L phi = D X.

    Parameters
    ----------
    operators : Operators
        The domain.
    X : (d m,) or (d m, k) float64
        Vector field, constant per face, stacked by coordinate.

    Returns
    -------
    (n,) or (n, k) float64
        phi, determined up to a constant on each component: 0 at the first vertex of each.
    """
    return PoissonProblem(operators).solve(operators.D @ X)
