"""The three steps of the heat method on any domain that has `Operators`: diffuse, normalize, integrate.

Algorithm 1 of the paper, with a backward Euler step (4) for the heat. Each step is a function to be tried alone; the
two that solve a system also exist as a class that factors once, `HeatFlow` and `PoissonProblem`.

Fields are arrays (n,) over vertices, or (n, k) for k right-hand sides at once; vector fields are stacked by coordinate
like the rows of G: (d m,) or (d m, k).
"""

from __future__ import annotations

import importlib.util
from typing import Literal

import numpy as np
import scipy.sparse as sp

from heat_igl.linear import Analysis, Backend, Factorization, analyse
from heat_igl.operators import Operators
from heat_igl.steps.fitted import fitted_laplacian
from heat_igl.typing import FloatArray, IntArray

__all__ = [
    "Boundary",
    "Descent",
    "HeatFlow",
    "PoissonProblem",
    "analysis",
    "damping",
    "diffuse",
    "fitted_laplacian",
    "integrate",
    "normalize",
]

# Below this, gradients lose digits to gradual underflow and no longer have a direction worth keeping.
_SMALLEST_GRADIENT = 1e-300
# Share of a front's rate of decay from which on a direction is trusted fully; docs/heat_path.md compares values. Fronts
# of a fitted flow scatter less.
_FULL_RATE, _FULL_RATE_FITTED = 0.9, 0.95

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
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        See `factorize`.
    analysis : Analysis, optional
        As `analysis` makes it for a domain with the same pattern of L, to be shared; made anew where it does not fit.
    fitted : bool
        Whether to take `fitted_laplacian` for L, with which heat falls by the right factor over long edges too.

    Raises
    ------
    FactorizationError
        If M - t L is not positive definite.
    ValueError
        If t is not positive or `boundary` is unknown.
    """

    def __init__(
        self,
        operators: Operators,
        t: float,
        boundary: Boundary = "neumann",
        backend: Backend = "auto",
        analysis: Analysis | None = None,
        fitted: bool = False,
    ) -> None:
        if not (np.isfinite(t) and t > 0):
            raise ValueError(f"t must be a positive number (a squared length), not {t!r}")
        if boundary not in ("neumann", "dirichlet", "average"):
            raise ValueError(f"boundary must be 'neumann', 'dirichlet' or 'average', not {boundary!r}")
        if not operators.boundary.any():
            boundary = "neumann"
        mass = operators.M.diagonal()
        self.mean_mass = float(mass[operators.referenced].mean())
        L = fitted_laplacian(operators, t) if fitted else operators.L
        matrix = _shifted(L, -t / self.mean_mass, mass / self.mean_mass)
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
            self._dirichlet = analysis.factorize(matrix, operators.referenced & ~operators.boundary)
            self._from_boundary = matrix[:, operators.boundary]
            self._boundary_diagonal = matrix.diagonal()[operators.boundary]
            self._on_boundary = operators.boundary

    @property
    def factors(self) -> list[Factorization]:
        """The factored matrices, for what they hold."""
        return [part for part in (self._neumann, self._dirichlet) if part is not None]

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

    def __init__(self, operators: Operators, backend: Backend = "auto", analysis: Analysis | None = None) -> None:
        free = operators.referenced.copy()
        # The first vertex of every component; components without faces are not free anyway.
        free[np.unique(operators.components, return_index=True)[1]] = False
        # Here, and only here, the sign is turned: L is negative semidefinite, Cholesky wants positive.
        matrix = _shifted(operators.L, -1.0, np.zeros(operators.n))
        if analysis is None or not analysis.fits(matrix):
            analysis = analyse(matrix, backend)
        self.backend = analysis.backend
        self.factor = analysis.factorize(matrix, free)

    def solve(self, b: FloatArray) -> FloatArray:
        """The solution phi, 0 at the grounded vertices. On each component b must sum to 0, as a divergence does."""
        phi = self.factor.solve(b)
        # The right-hand side's sign, turned afterwards and in place: at a million vertices a copy costs milliseconds.
        return np.asarray(np.subtract(0.0, phi, out=phi))


def analysis(L: sp.csc_matrix, backend: Backend = "auto", known: Analysis | None = None) -> Analysis:
    """Order and analyse the pattern that the matrices of the heat flow and of the Poisson problem have in common.

    Of the Laplacian `L` only the pattern matters. An analysis that is `known` is returned as it is if it fits.
    """
    pattern = _shifted(L, 1.0, np.zeros(L.shape[0]))
    return known if known is not None and known.fits(pattern) else analyse(pattern, backend)


def _shifted(L: sp.csc_matrix, factor: float, diagonal: FloatArray) -> sp.csc_matrix:
    """``factor * L + diag(diagonal)`` with the pattern of L and its whole diagonal, zeros stored."""
    on_diagonal = np.flatnonzero(L.indices == np.repeat(np.arange(len(diagonal)), np.diff(L.indptr)))
    if len(on_diagonal) == len(diagonal):
        data = factor * L.data
        data[on_diagonal] += diagonal
        return sp.csc_matrix((data, L.indices, L.indptr), shape=L.shape)
    # Vertices that no face uses have no entry of their own.
    entries, everyone = L.tocoo(), np.arange(len(diagonal))
    rows, columns = np.append(entries.row, everyone), np.append(entries.col, everyone)
    return sp.csc_matrix((np.append(factor * entries.data, diagonal), (rows, columns)), shape=L.shape)


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


def normalize(operators: Operators, u: FloatArray, of_log: bool = False) -> FloatArray:
    """Step 2: the unit field X = -grad u / |grad u| that points away from the heat.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat; only its direction of descent matters.
    of_log : bool
        Take the direction of grad log u instead, where u is not below 1e-300. Both are the same but for interpolation:
        log u is nearly linear where u is nearly exponential.

    Returns
    -------
    (d m,) or (d m, k) float64
        Unit vectors; 0 on faces where the gradient is zero or below 1e-300, which have no direction.
    """
    gradient = operators.gradient_rows @ u
    components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
    # Squares of entries below 1e-154 would vanish, and heat far away is far below that; so each face is divided by its
    # largest entry before the norm is taken.
    largest = np.abs(components).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        components /= largest
        components /= -np.sqrt(np.einsum("k...,k...->...", components, components))
    components[:, largest < _SMALLEST_GRADIENT] = 0
    if of_log:
        along_log = normalize(operators, np.log(u, out=np.full_like(u, np.nan), where=u >= _SMALLEST_GRADIENT))
        np.copyto(gradient, along_log, where=np.isfinite(along_log))
    return np.asarray(gradient)


def damping(
    operators: Operators, u: FloatArray, t: float, full_rate: float | None = None, fitted: bool = False
) -> FloatArray:
    """How sure the direction of X is on each face: 1 almost everywhere, less where heat arrives from several sides.

    A front of heat falls by the same factor over each length, |grad log u| = 1 / sqrt(t) for small faces and in a
    fitted flow, else by arccosh(1 + l^2 / (2 t)) over an edge of length l on large ones. Where fronts meet, at the cut
    locus and between two sources, it falls more slowly, and the distance has no gradient of length 1 there either.
    Integrating a unit field all the same overestimates distance on both sides.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat.
    t : float
        Time step that the heat was made with.
    full_rate : float, optional
        Share of a front's rate from which on a direction is trusted fully: on a mesh, fronts scatter by some percent
        around 1. 0.95 for a fitted flow and 0.9 else; docs/heat_path.md compares values.
    fitted : bool
        Whether the heat comes from a fitted `HeatFlow`.

    Returns
    -------
    (m,) or (m, k) float64
        Factor of X on each face, between 0 and 1; 1 on faces with a corner on the boundary, where an insulated
        boundary turns the front into its own mirror image, or where u is not positive.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = operators.gradient_rows @ np.log(u)
        components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
        rate = np.sqrt(np.einsum("k...,k...->...", components, components))
    factor = (rate.T / _lowest_full_rate(operators, t, fitted, full_rate)).T
    factor[operators.boundary_faces] = 1
    return np.asarray(np.where(factor < 1, factor, 1.0))


def _lowest_full_rate(operators: Operators, t: float, fitted: bool, full_rate: float | None = None) -> FloatArray:
    """The rate (m,), in e-foldings per length, from which on a direction is trusted fully."""
    if full_rate is None:
        full_rate = _FULL_RATE_FITTED if fitted else _FULL_RATE
    return full_rate * (np.full(len(operators.weights), t**-0.5) if fitted else _front_rate(operators, t))


def _front_rate(operators: Operators, t: float) -> FloatArray:
    """How fast a front of heat falls on each face (m,), in e-foldings per length, where the flow is not fitted."""
    size = operators.face_sizes
    # The same as arccosh(1 + size^2 / (2 t)) / size, which is 0 where size^2 is lost beside 1: faces of no size at all.
    return np.asarray(2 * np.arcsinh(size / (2 * np.sqrt(t))) / size)


class Descent:
    """The right-hand side of step 3, the divergence of the field X of step 2, in one pass over the faces.

    The same as ``D @ normalize(operators, u, fitted)`` to rounding, and without storing a field; by a compiled kernel
    where numba is installed. What the kernel reads of the faces is put together once.

    Parameters
    ----------
    operators : Operators
        The domain.
    t : float, optional
        Time step that the heat was made with, to have the field damped by `damping`; it has length 1 otherwise.
    order : (n,) int, optional
        All vertices, near ones near each other, to read memory in; that of the mesh may jump, and a pass that waits for
        memory takes several times as long.
    fitted : bool
        Whether the heat comes from a fitted `HeatFlow`; the field then follows the gradient of log u.
    """

    def __init__(
        self, operators: Operators, t: float | None = None, order: IntArray | None = None, fitted: bool = False
    ) -> None:
        self._operators, self._t, self._order, self._fitted = operators, t, order, fitted
        triangulation = operators.triangulation
        self._full_rate = self._triangles = None
        if importlib.util.find_spec("numba") is None:
            _ = operators.D  # made on first use otherwise, in the middle of the first query
            return
        from heat_igl.steps import descending

        full_rate = np.zeros(len(operators.weights)) if t is None else _lowest_full_rate(operators, t, fitted)
        full_rate[operators.boundary_faces] = 0.0
        # A matrix given for G may be another than the triangles'.
        if triangulation is None or not callable(operators.gradient):
            self._full_rate = full_rate
            _ = operators.gradient_rows
        else:
            F, lengths = triangulation.F, triangulation.l
            self._triangles = descending.triangles(F, lengths, operators.weights, full_rate, order)

    def divergence(self, u: FloatArray) -> FloatArray:
        """Integrated divergence (n, k) for heat (n, k)."""
        operators = self._operators
        if self._triangles is not None:
            from heat_igl.steps.descending import descent_on_triangles

            return descent_on_triangles(self._triangles, u, _SMALLEST_GRADIENT, self._fitted)
        rows = operators.gradient_rows
        if self._full_rate is not None:
            from heat_igl.steps.descending import descent

            heat = np.ascontiguousarray(u)
            return np.asarray(
                descent(
                    rows.indptr,
                    rows.indices,
                    rows.data,
                    operators.weights,
                    self._full_rate,
                    heat,
                    _SMALLEST_GRADIENT,
                    self._fitted,
                )
            )
        X = normalize(operators, u, self._fitted)
        if self._t is not None:
            X *= np.tile(damping(operators, u, self._t, fitted=self._fitted), (operators.dimension, 1))
        return np.asarray(operators.D @ X)

    def __reduce__(self) -> tuple[type[Descent], tuple[Operators, float | None, IntArray | None, bool]]:
        return Descent, (self._operators, self._t, self._order, self._fitted)


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
