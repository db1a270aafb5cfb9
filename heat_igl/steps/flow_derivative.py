"""The derivative of one solution of the heat flow, by the initial heat and by the matrix."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from heat_igl.operators import Operators
from heat_igl.steps.diffusion import HeatFlow
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["FlowDerivative", "MatrixSlopes"]


class MatrixSlopes(NamedTuple):
    """The derivative of a number by the matrix A = M - t L: -x . dA u in each row, and `diagonal` . (diagonal of dA).

    Attributes
    ----------
    x, u : (k, n) float64
        Adjoints and solutions.
    diagonal : (n,) float64
        By the diagonal of A directly.
    """

    x: FloatArray
    u: FloatArray
    diagonal: FloatArray

    def joined(self, other: MatrixSlopes) -> MatrixSlopes:
        """The derivative of the sum of two numbers."""
        return MatrixSlopes(
            np.concatenate([self.x, other.x]), np.concatenate([self.u, other.u]), self.diagonal + other.diagonal
        )


class FlowDerivative:
    """One solution of a heat flow, to be differentiated.

    Heat under "average" is the mean of two solutions. Under "dirichlet", heat h = b / A_ii that is put on the boundary
    is held there, and the rest solves (A u)_i = b_i at all inner vertices i.

    Parameters
    ----------
    flow : HeatFlow
        The factored system.
    domain : Operators
        Its domain.
    b : (n,) float64
        Initial heat.

    Attributes
    ----------
    u : (n,) float64
        The heat.
    """

    def __init__(self, flow: HeatFlow, domain: Operators, b: FloatArray) -> None:
        self._flow = flow
        self._on_boundary: BoolArray = domain.boundary
        self._parts = [flow.solve_under(boundary, b) for boundary in flow.boundaries]
        self.u = np.ascontiguousarray(sum(self._parts) / len(self._parts))

    def pull_back(self, by_heat: FloatArray) -> tuple[FloatArray, MatrixSlopes]:
        """The derivative by the initial heat (n,), and by the matrix, from that by the heat (n,)."""
        by_initial, rows = np.zeros_like(self.u), []
        diagonal = np.zeros_like(self.u)
        unit = self._flow.mean_mass
        for boundary, u in zip(self._flow.boundaries, self._parts, strict=True):
            x = self._flow.solve_transposed(boundary, by_heat / len(self._parts))
            by_initial += x
            if boundary == "dirichlet":
                # On the boundary the equation is A_ii u_i = b_i.
                held = self._on_boundary
                diagonal[held] = -(x * u / unit)[held]
                x = np.where(held, 0.0, x)
            rows.append(x)
        return by_initial, MatrixSlopes(np.stack(rows), np.stack(self._parts) / unit, diagonal)

    def push_forward(
        self, by_initial: FloatArray, change: Callable[[FloatArray], FloatArray], diagonal: FloatArray
    ) -> FloatArray:
        """How the heat (n,) changes with the initial heat (n,) and the matrix A.

        Parameters
        ----------
        by_initial : (n,) float64
            Change of the initial heat.
        change : callable
            The product of the change of A with a vector (n,).
        diagonal : (n,) float64
            The diagonal of the change of A.
        """
        total, unit = np.zeros_like(self.u), self._flow.mean_mass
        for boundary, u in zip(self._flow.boundaries, self._parts, strict=True):
            of_matrix = change(u / unit)
            if boundary == "dirichlet":
                of_matrix = np.where(self._on_boundary, diagonal * u / unit, of_matrix)
            total += self._flow.solve_under(boundary, by_initial - of_matrix)
        return np.asarray(total / len(self._parts))
