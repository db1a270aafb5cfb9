"""Step 1: one backward Euler step of heat flow, equation (4) of the paper."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from heat_igl.linear import Analysis, Backend, Factorization, analyse
from heat_igl.operators import Operators
from heat_igl.steps.fitted import fitted_laplacian
from heat_igl.steps.pattern import shifted
from heat_igl.typing import FloatArray

__all__ = ["Boundary", "HeatFlow", "check_boundary", "diffuse", "mass_unit"]

Boundary = Literal["neumann", "dirichlet", "average"]


def check_boundary(boundary: str) -> None:
    """Raise a ValueError if there is no such `Boundary`."""
    if not isinstance(boundary, str) or boundary not in get_args(Boundary):
        raise ValueError(f"boundary must be 'neumann', 'dirichlet' or 'average', not {boundary!r}")


class HeatFlow:
    """One backward Euler step of heat flow, (M - t L) u = mean_mass * b, factored.

    Dividing by the mean vertex mass leaves a matrix without a unit, so that a very large right-hand side `b` overflows
    in no unit of length. If each component has a time step, it is divided by the mean mass of that component.

    Parameters
    ----------
    operators : Operators
        The domain.
    t : float or (n_components,) float64
        Time step, a squared length; one for all components, or one for each.
    boundary : {"neumann", "dirichlet", "average"}
        Insulated boundary, boundary held at zero, or the mean of both solutions. Under "dirichlet" heat that is put on
        a boundary vertex stays there as a fixed value.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        See `factorize`.
    analysis : Analysis, optional
        As `analysis` makes it for a domain with the same pattern of L, to be shared; made anew if it does not fit.
    fitted : bool
        Whether to take `fitted_laplacian` for L, with which heat falls by the right factor over long edges too.

    Raises
    ------
    FactorizationError
        If M - t L is not positive definite.
    ValueError
        If t is not positive, if `boundary` is unknown, or if it holds the heat of all vertices.
    """

    def __init__(
        self,
        operators: Operators,
        t: float | FloatArray,
        boundary: Boundary = "neumann",
        backend: Backend = "auto",
        analysis: Analysis | None = None,
        fitted: bool = False,
    ) -> None:
        if not (np.isfinite(t).all() and np.min(t) > 0):
            raise ValueError(f"t must be a positive number (a squared length), not {t!r}")
        check_boundary(boundary)
        if not operators.boundary.any():
            boundary = "neumann"
        inner = operators.referenced & ~operators.boundary
        if boundary != "neumann" and not inner.any():
            raise ValueError(
                f"boundary={boundary!r} holds the heat on the boundary, and every vertex lies there: take "
                "boundary='neumann', or divide the faces"
            )
        mass = operators.M.diagonal()
        self.mean_mass = mass_unit(operators, t)
        L = fitted_laplacian(operators, t) if fitted else operators.L
        step = operators.expand_to_vertices(t) if isinstance(t, np.ndarray) else t
        matrix = shifted(L, -step / self.mean_mass, mass / self.mean_mass)
        del L  # as large as the matrix, and not needed while that is factored
        if analysis is None or not analysis.fits(matrix):
            analysis = analyse(matrix, backend)
        self.t = t
        self.boundary = boundary
        self.backend = analysis.backend
        self._neumann: Factorization | None = None
        self._dirichlet: Factorization | None = None
        if boundary in ("neumann", "average"):
            self._neumann = analysis.factorize(matrix, operators.referenced)
        if boundary in ("dirichlet", "average"):
            self._dirichlet = analysis.factorize(matrix, inner)
            self._from_boundary = matrix[:, operators.boundary]
            self._boundary_diagonal = matrix.diagonal()[operators.boundary]
            self._on_boundary = operators.boundary

    @property
    def factors(self) -> list[Factorization]:
        """The factored matrices, for their sizes."""
        return [part for part in (self._neumann, self._dirichlet) if part is not None]

    def solve(self, b: FloatArray) -> FloatArray:
        """Heat u (n,) or (n, k) after the time step, for initial heat `b` in units of `mean_mass`."""
        solutions = [] if self._neumann is None else [self._neumann.solve(b)]
        if self._dirichlet is not None:
            held = (b[self._on_boundary].T / self._boundary_diagonal).T
            u = self._dirichlet.solve(b - self._from_boundary @ held if held.any() else b)
            u[self._on_boundary] = held
            solutions.append(u)
        return solutions[0] if len(solutions) == 1 else (solutions[0] + solutions[1]) / 2


def mass_unit(operators: Operators, t: float | FloatArray) -> float | FloatArray:
    """The mean mass by which `HeatFlow` divides: a number, or one (n,) for each vertex if each component has a t."""
    return operators.expand_to_vertices(operators.mean_masses) if np.ndim(t) else operators.mean_mass


def diffuse(operators: Operators, u0: FloatArray, t: float, boundary: Boundary = "neumann") -> FloatArray:
    """Step 1: heat after one backward Euler step, (M - t L) u = u0, equation (4).

    Parameters
    ----------
    operators : Operators
        The domain.
    u0 : (n,) or (n, k) float64
        Initial heat, integrated over each vertex's cell: 1 at a source and 0 elsewhere for a Dirac. Distant values
        fall like exp(-distance / sqrt(t)) and underflow beyond about 700 sqrt(t); a larger value at the source (1e290)
        doubles that range and changes no direction.
    t : float
        Time step, a squared length; the square of the mean edge length is the paper's choice.
    boundary : {"neumann", "dirichlet", "average"}
        See `HeatFlow`.

    Returns
    -------
    (n,) or (n, k) float64
        Heat per area, u. Not negative if `operators.L` has no negative weight; 0 at unreferenced vertices.
    """
    flow = HeatFlow(operators, t, boundary)
    return flow.solve(np.asarray(u0, dtype=np.float64) / flow.mean_mass)
