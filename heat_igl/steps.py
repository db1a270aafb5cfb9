"""The three steps of the heat method on any domain that has `Operators`: diffuse, normalize, integrate.

Algorithm 1 of the paper, with a backward Euler step (4) for the heat. Each step is a function to be tried alone; the
two that solve a system also exist as a class that factors once, `HeatFlow` and `PoissonProblem`.

Fields are arrays (n,) over vertices, or (n, k) for k right-hand sides at once; vector fields are stacked by coordinate
like the rows of G: (d m,) or (d m, k).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.sparse as sp

from heat_igl.factorization import Backend, Factorization, factorize
from heat_igl.operators import Operators
from heat_igl.typing import BoolArray, FloatArray

__all__ = ["Boundary", "HeatFlow", "PoissonProblem", "damping", "diffuse", "integrate", "normalize"]

# Below this, gradients lose digits to gradual underflow and no longer have a direction worth keeping.
_SMALLEST_GRADIENT = 1e-300

Boundary = Literal["neumann", "dirichlet", "average"]


class HeatFlow:
    """One backward Euler step of heat flow, (M - t L) u = mean_mass * b, factored.

    Dividing by the mean vertex mass leaves a matrix without a unit, so that a very large right-hand side `b` overflows
    in no unit of length.

    Parameters
    ----------
    operators : Operators
        The domain.
    t : float
        Time step, a squared length.
    boundary : {"neumann", "dirichlet", "average"}
        Insulated boundary, boundary held at zero, or the mean of both solutions. Under "dirichlet" heat that is put on
        a boundary vertex stays there as its fixed value.
    backend : {"auto", "scipy", "cholespy"}
        See `factorize`.

    Raises
    ------
    FactorizationError
        If M - t L is not positive definite.
    ValueError
        If t is not positive or `boundary` is unknown.
    """

    def __init__(
        self, operators: Operators, t: float, boundary: Boundary = "neumann", backend: Backend = "auto"
    ) -> None:
        if not (np.isfinite(t) and t > 0):
            raise ValueError(f"t must be a positive number (a squared length), not {t!r}")
        if boundary not in ("neumann", "dirichlet", "average"):
            raise ValueError(f"boundary must be 'neumann', 'dirichlet' or 'average', not {boundary!r}")
        if not operators.boundary.any():
            boundary = "neumann"
        self.mean_mass = float(operators.M.diagonal()[operators.referenced].mean())
        matrix = ((operators.M - t * operators.L) / self.mean_mass).tocsc()
        self.t = t
        self.boundary = boundary
        self._neumann: _Restricted | None = None
        self._dirichlet: _Restricted | None = None
        if boundary in ("neumann", "average"):
            self._neumann = _Restricted(matrix, operators.referenced, backend)
        if boundary in ("dirichlet", "average"):
            self._dirichlet = _Restricted(matrix, operators.referenced & ~operators.boundary, backend)
            self._from_boundary = matrix[:, operators.boundary]
            self._boundary_diagonal = matrix.diagonal()[operators.boundary]
            self._on_boundary = operators.boundary

    @property
    def backend(self) -> str:
        """Library that holds the factors."""
        return next(part.backend for part in (self._neumann, self._dirichlet) if part is not None)

    def solve(self, b: FloatArray) -> FloatArray:
        """Heat u (n,) or (n, k) after the time step, for initial heat `b` in units of `mean_mass`."""
        solutions = []
        if self._neumann is not None:
            solutions.append(self._neumann.solve(b))
        if self._dirichlet is not None:
            held = (b[self._on_boundary].T / self._boundary_diagonal).T
            u = self._dirichlet.solve(b - self._from_boundary @ held if held.any() else b)
            u[self._on_boundary] = held
            solutions.append(u)
        return solutions[0] if len(solutions) == 1 else (solutions[0] + solutions[1]) / 2


class PoissonProblem:
    """L phi = b, factored, with one vertex of each component grounded.

    The constants on each component are the null space of L. Fixing one value in each removes exactly that and changes
    nothing else; adding a small multiple of the identity instead would bend the solution on large domains.
    """

    def __init__(self, operators: Operators, backend: Backend = "auto") -> None:
        free = operators.referenced.copy()
        # The first vertex of every component; components without faces are not free anyway.
        free[np.unique(operators.components, return_index=True)[1]] = False
        # Here, and only here, the sign is turned: L is negative semidefinite, Cholesky wants positive.
        self._negative = _Restricted(-operators.L, free, backend)
        self.backend = self._negative.backend

    def solve(self, b: FloatArray) -> FloatArray:
        """The solution phi, 0 at the grounded vertices. On each component b must sum to 0, as a divergence does."""
        return self._negative.solve(-b)


class _Restricted:
    """A factored principal submatrix: solves on some vertices, gives 0 on the others."""

    def __init__(self, matrix: sp.csc_matrix, mask: BoolArray, backend: Backend) -> None:
        self._mask = None if mask.all() else mask
        self._factor: Factorization | None = None
        if mask.any():
            restricted = matrix if mask.all() else matrix[mask][:, mask]
            self._factor = factorize(restricted.tocsc(), backend)

    def solve(self, b: FloatArray) -> FloatArray:
        if self._factor is None:
            return np.zeros_like(b)
        if self._mask is None:
            return self._factor.solve(b)
        x = np.zeros_like(b)
        x[self._mask] = self._factor.solve(b[self._mask])
        return x

    @property
    def backend(self) -> str:
        return "none" if self._factor is None else self._factor.backend


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
        Heat per area, u. Not negative where `operators.L` has no negative weight; 0 at unreferenced vertices.
    """
    flow = HeatFlow(operators, t, boundary)
    return flow.solve(np.asarray(u0, dtype=np.float64) / flow.mean_mass)


def normalize(operators: Operators, u: FloatArray) -> FloatArray:
    """Step 2: the unit field X = -grad u / |grad u| that points away from the heat.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat; only its direction of descent matters.

    Returns
    -------
    (d m,) or (d m, k) float64
        Unit vectors; 0 on faces where the gradient is zero or below 1e-300, which have no direction.
    """
    gradient = operators.G @ u
    components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
    # Squares of entries below 1e-154 would vanish, and heat far away is far below that; so each face is divided by its
    # largest entry before the norm is taken.
    largest = np.abs(components).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        components /= largest
        components /= -np.sqrt(np.einsum("k...,k...->...", components, components))
    components[:, largest < _SMALLEST_GRADIENT] = 0
    return np.asarray(gradient)


def damping(operators: Operators, u: FloatArray, t: float, full_rate: float = 0.9) -> FloatArray:
    """How sure the direction of X is on each face: 1 almost everywhere, less where heat arrives from several sides.

    A front of heat falls by the same factor over each length, |grad log u| = 1 / sqrt(t) for small faces, and by
    arccosh(1 + l^2 / (2 t)) over an edge of length l on large ones. Where fronts meet, at the cut locus and between
    two sources, it falls more slowly, and the distance has no gradient of length 1 there either. Integrating a unit
    field all the same overestimates distance on both sides.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat.
    t : float
        Time step that the heat was made with.
    full_rate : float
        Share of a front's rate from which on a direction is trusted fully: on a mesh, fronts scatter by some percent
        around 1. docs/heat_path.md compares values.

    Returns
    -------
    (m,) or (m, k) float64
        Factor of X on each face, between 0 and 1; 1 on faces with a corner on the boundary, where an insulated
        boundary turns the front into its own mirror image, or where u is not positive.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = operators.G @ np.log(u)
        components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
        rate = np.sqrt(np.einsum("k...,k...->...", components, components))
    size = operators.face_sizes
    # The same as arccosh(1 + size^2 / (2 t)) / size, which is 0 where size^2 is lost beside 1: faces of no size at all.
    front = 2 * np.arcsinh(size / (2 * np.sqrt(t))) / size
    factor = (rate.T / (full_rate * front)).T
    factor[operators.boundary_faces] = 1
    return np.asarray(np.where(factor < 1, factor, 1.0))


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
