"""The three steps of the heat method, each to be tried alone: diffuse, normalize, integrate.

Algorithm 1 of the paper, on any domain that has `Operators`. The two steps that solve a system also exist as a class
that factors once, `HeatFlow` and `PoissonProblem`. Fields are arrays (n,) over vertices, or (n, k) for k right-hand
sides at once; vector fields are stacked by coordinate like the rows of G: (d m,) or (d m, k).
"""

from __future__ import annotations

from math import factorial
from typing import Any, Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import require_choice
from heat_igl.kernels.heat.divergence import divergence_of_descent
from heat_igl.linear import Analysis, Backend, Factorization, analyse, factorize
from heat_igl.operators import Operators, TriangleElements, with_rotations
from heat_igl.runtime import LARGEST_EXPONENT, LOWEST_HEAT, RANGE_LIMIT
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = [
    "Boundary",
    "HeatFlow",
    "NormalizedDivergence",
    "PoissonProblem",
    "VectorHeatFlow",
    "analysis",
    "damping",
    "diffuse",
    "fitted_laplacian",
    "integrate",
    "normalize",
    "smallest_time_step",
    "smallest_time_steps",
]

Boundary = Literal["neumann", "dirichlet", "average"]
# Share of a front's rate of decay from which on a direction is trusted fully; docs/engines_theory.md compares values.
# Fronts of a fitted flow scatter less.
_FULL_RATE, _FULL_RATE_FITTED = 0.9, 0.95
# At an insulated boundary a front meets the mirror image of itself and falls a little more slowly. A fitted flow is
# damped there from this share of the rate; without damping a regular grid is 1.84 % wrong instead of 1.68.
_AT_BOUNDARY = 0.8
# A negative weight that is a smaller share of the largest is 0 but for rounding, as across a square.
_ROUNDING = 1e-12


def fitted_laplacian(domain: Operators, t: float | FloatArray) -> sp.csc_matrix:
    """L with the weight of each edge fitted to heat that falls like exp(-d / sqrt(t)), however long the edge.

    If (1 - t Laplace) u = 0, the mean of u over a circle of radius r is I0(r / sqrt(t)) times the value in the
    centre, I0 the modified Bessel function. Linear elements know the first terms of that series alone, 1 + r^2 / (4 t):
    along an edge much longer than sqrt(t) heat falls by too little, and the front runs ahead there and bends. So an
    edge of length r gets the weight times (r^2 / (4 t)) / (I0(r / sqrt(t)) - 1), which is 1 for short ones. Negative
    weights are left out, so that heat is positive and keeps its digits on any triangles.

    Parameters
    ----------
    domain : Operators
        One whose `lengths` are known.
    t : float or (n_components,) float64
        Time step, a squared length.

    Returns
    -------
    (n, n) csc_matrix
        Symmetric, negative semidefinite, rows sum to 0; no entry off the diagonal is negative. In the pattern of L.

    Raises
    ------
    ValueError
        If the lengths are not known, or not that of an entry of L.

    Notes
    -----
    The weights are those of L and the lengths those of the edges, and they have to agree: t is a squared length in the
    metric of L and M. Twice L and twice M are the same metric. Twice L alone is that of edges shorter by sqrt(2): in
    M - t L it counts like 2 t, so heat falls like exp(-d / sqrt(2 t)) over short edges, but long ones would still be
    fitted at t. Give `Operators.lengths` for such an L, or keep L and pass 2 t.
    """
    L, n = domain.L, domain.n
    edges = domain.edge_lengths()
    if edges is None:
        raise ValueError("weights are fitted to the lengths of edges, which this domain does not have")
    i, j, length = edges
    fitted = _fit(length / np.sqrt(t[domain.components[i]] if isinstance(t, np.ndarray) else t))
    # Entry 0 takes the pairs that L does not couple.
    entry = sp.csc_matrix((np.arange(1, L.nnz + 1, dtype=L.indices.dtype), L.indices, L.indptr), shape=L.shape)
    factor = np.zeros(L.nnz + 1)
    for rows, columns in ((i, j), (j, i)):
        # L has one entry for all edges between the same two vertices. The largest factor is that of the shortest: heat
        # arrives along it first, and it has most of the weight, which is the length of the dual edge over the length of
        # the edge.
        np.maximum.at(factor, np.asarray(entry[rows, columns]).ravel(), fitted)
    column = np.repeat(np.arange(n), np.diff(L.indptr))
    on_diagonal = np.flatnonzero(L.indices == column)
    weight = np.maximum(L.data, 0.0)
    weight[on_diagonal] = 0
    unknown = (weight > 0) & (factor[1:] == 0)
    if unknown.any():
        first = int(np.argmax(unknown))
        raise ValueError(
            f"L[{L.indices[first]}, {column[first]}] couples vertices whose distance is not known "
            f"({int(unknown.sum())} entries do): give lengths for all that L couples, or do not fit (magnitude='unit')"
        )
    weight *= factor[1:]
    weight[on_diagonal] = -np.bincount(column, weight, n)[column[on_diagonal]]
    return sp.csc_matrix((weight, L.indices, L.indptr), shape=L.shape)


def _fit(x: FloatArray) -> FloatArray:
    """(x^2 / 4) / (I0(x) - 1): the factor of a weight whose edge has length x in units of sqrt(t)."""
    # I0 is the sum of y^k / (k!)^2, and 13 terms give it to 1e-12 up to x = 4; beyond, nothing cancels.
    y = np.minimum(x, 4.0) ** 2 / 4
    over_y = np.zeros_like(x)
    for k in range(13, 0, -1):
        over_y *= y
        over_y += 1 / factorial(k) ** 2
    fitted = 1 / over_y
    far = x > 4
    # exp(-600) is as good as no heat, and leaves the weight a number.
    beyond = np.minimum(x[far], 600.0)
    fitted[far] = beyond**2 / 4 / (np.i0(beyond) - 1)
    return np.asarray(fitted)


def analysis(L: sp.csc_matrix, backend: Backend = "auto", known: Analysis | None = None) -> Analysis:
    """The symbolic analysis of the sparsity pattern that the heat flow and the Poisson problem share.

    Only the pattern of the Laplacian `L` matters. If the analysis `known` fits it, `known` is returned.
    """
    pattern = shifted(L, 1.0, np.zeros(L.shape[0]))
    return known if known is not None and known.fits(pattern) else analyse(pattern, backend)


def shifted(L: sp.csc_matrix, factor: float | FloatArray, diagonal: FloatArray) -> sp.csc_matrix:
    """``L * factor + diag(diagonal)`` with the pattern of L and the whole diagonal, zeros stored.

    `factor` is a number, or one (n,) for each column.
    """
    if np.ndim(factor):
        factor = np.repeat(factor, np.diff(L.indptr))
    on_diagonal = np.flatnonzero(L.indices == np.repeat(np.arange(len(diagonal)), np.diff(L.indptr)))
    if len(on_diagonal) == len(diagonal):
        data = factor * L.data
        data[on_diagonal] += diagonal
        return sp.csc_matrix((data, L.indices, L.indptr), shape=L.shape)
    # Vertices that no face uses have no entry of their own.
    entries = sp.csc_matrix((factor * L.data, L.indices, L.indptr), shape=L.shape).tocoo()
    everyone = np.arange(len(diagonal))
    rows, columns = np.append(entries.row, everyone), np.append(entries.col, everyone)
    return sp.csc_matrix((np.append(entries.data, diagonal), (rows, columns)), shape=L.shape)


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
    backend : {"auto", "scipy", "multifrontal"}
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
        require_choice("boundary", boundary, get_args(Boundary))
        if not operators.boundary.any():
            boundary = "neumann"
        inner = operators.referenced & ~operators.boundary
        if boundary != "neumann" and not inner.any():
            raise ValueError(
                f"boundary={boundary!r} holds the heat on the boundary, and every vertex lies there: take "
                "boundary='neumann', or divide the faces"
            )
        mass = operators.M.diagonal()
        # A number, or one (n,) for each vertex if each component has a t.
        has_several = isinstance(t, np.ndarray)
        self.mean_mass = operators.expand_to_vertices(operators.mean_masses) if has_several else operators.mean_mass
        L = fitted_laplacian(operators, t) if fitted else operators.L
        step = operators.expand_to_vertices(t) if isinstance(t, np.ndarray) else t
        matrix = shifted(L, -step / self.mean_mass, mass / self.mean_mass)
        del L  # as large as the matrix, and not needed while that is factored
        if analysis is None or not analysis.fits(matrix):
            analysis = analyse(matrix, backend)
        self.t = t
        self.boundary = boundary
        self.backend = analysis.backend
        self._neumann = None if boundary == "dirichlet" else analysis.factorize(matrix, operators.referenced)
        self._dirichlet = None if boundary == "neumann" else analysis.factorize(matrix, inner)
        if self._dirichlet is not None:
            self._from_boundary = matrix[:, operators.boundary]
            self._boundary_diagonal = matrix.diagonal()[operators.boundary]
            self._on_boundary = operators.boundary

    def solve(self, b: FloatArray) -> FloatArray:
        """Heat u (n,) or (n, k) after the time step, for initial heat `b` in units of `mean_mass`."""
        solutions = [] if self._neumann is None else [self._neumann.solve(b)]
        if self._dirichlet is not None:
            held = (b[self._on_boundary].T / self._boundary_diagonal).T
            u = self._dirichlet.solve(b - self._from_boundary @ held if held.any() else b)
            u[self._on_boundary] = held
            solutions.append(u)
        return solutions[0] if len(solutions) == 1 else (solutions[0] + solutions[1]) / 2


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


def smallest_time_step(longest: float, h: float, fitted: bool = False) -> float:
    """The smallest time step whose heat crosses a domain without underflow in double precision.

    Along a line of edges of length h, one backward Euler step falls by acosh(1 + h^2 / (2 t)) e-foldings per edge, and
    by h / sqrt(t) if the flow is `fitted`. The result makes that, times the number of edges on the longest of the
    shortest paths along edges, `RANGE_LIMIT`.
    """
    if fitted:
        return float((longest / RANGE_LIMIT) ** 2)
    per_edge = RANGE_LIMIT / (longest / h)
    return float(h**2 / (2 * (float(np.cosh(per_edge)) - 1))) if per_edge < LARGEST_EXPONENT else 0.0


def smallest_time_steps(domain: Operators, fitted: bool) -> FloatArray:
    """`smallest_time_step` (n_components,) of each component."""
    if domain.longest_distances is None or domain.n_components == 1:
        smallest = smallest_time_step(domain.longest_distance, domain.mean_edge_length, fitted)
        return np.full(domain.n_components, smallest)
    of_component = zip(domain.longest_distances, domain.mean_edge_lengths, strict=True)
    return np.array([smallest_time_step(longest, h, fitted) if longest > 0 else 0.0 for longest, h in of_component])


def normalize(operators: Operators, u: FloatArray, of_log: bool = False) -> FloatArray:
    """Step 2: the unit field X = -grad u / |grad u| that points away from the heat.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat; only the direction of descent matters.
    of_log : bool
        Take the direction of grad log u instead, on faces with u not below 1e-300. Both are the same but for
        interpolation: log u is nearly linear if u is nearly exponential.

    Returns
    -------
    (d m,) or (d m, k) float64
        Unit vectors; 0 on faces with a gradient of zero or below 1e-300, which have no direction.
    """
    gradient = operators.gradient_rows @ u
    components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
    # Squares of entries below 1e-154 would vanish, and heat far away is far below that; so each face is divided by its
    # largest entry before the norm is taken.
    largest = np.abs(components).max(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        components /= largest
        components /= -np.sqrt(np.einsum("k...,k...->...", components, components))
    components[:, largest < LOWEST_HEAT] = 0
    if of_log:
        along_log = normalize(operators, np.log(u, out=np.full_like(u, np.nan), where=u >= LOWEST_HEAT))
        np.copyto(gradient, along_log, where=np.isfinite(along_log))
    return np.asarray(gradient)


def damping(
    operators: Operators, u: FloatArray, t: float | FloatArray, full_rate: float | None = None, fitted: bool = False
) -> FloatArray:
    """The magnitude of the field on each face: 1 almost everywhere, less if heat arrives from several sides.

    A front of heat falls by the same factor over each length, |grad log u| = 1 / sqrt(t) for small faces and in a
    fitted flow, else by arccosh(1 + l^2 / (2 t)) over an edge of length l on large ones. If fronts meet, at the cut
    locus and between two sources, it falls more slowly, and the distance has no gradient of length 1 there either.
    Integrating a unit field all the same overestimates distance on both sides.

    Parameters
    ----------
    operators : Operators
        The domain.
    u : (n,) or (n, k) float64
        Heat.
    t : float or (n_components,) float64
        Time step that the heat was made with.
    full_rate : float, optional
        Share of a front's rate from which on a direction is trusted fully: on a mesh, fronts scatter by some percent
        around 1. 0.95 for a fitted flow and 0.9 else; docs/engines_theory.md compares values.
    fitted : bool
        Whether the heat comes from a fitted `HeatFlow`.

    Returns
    -------
    (m,) or (m, k) float64
        Factor of X on each face, between 0 and 1; 1 if u is not positive. On faces with a corner on the boundary, which
        mirrors the front if it is insulated, a slower rate is enough, and the factor is 1 if the flow is not `fitted`.
    """
    lowest = lowest_full_rate(operators, t, fitted, full_rate)
    with np.errstate(divide="ignore", invalid="ignore"):
        gradient = operators.gradient_rows @ np.log(u)
        components = gradient.reshape(operators.dimension, len(operators.weights), *u.shape[1:])
        rate = np.sqrt(np.einsum("k...,k...->...", components, components))
        share = (rate.T / lowest).T
    # 1 also if the lowest rate is 0, or u is not positive.
    return np.asarray(np.where(share < 1, share, 1.0))


def lowest_full_rate(
    operators: Operators, t: float | FloatArray, fitted: bool, full_rate: float | None = None
) -> FloatArray:
    """The rate (m,), in e-foldings per length, from which on a direction is trusted fully."""
    if full_rate is None:
        full_rate = _FULL_RATE_FITTED if fitted else _FULL_RATE
    if isinstance(t, np.ndarray):
        t = operators.expand_to_faces(t)
    size = operators.face_sizes
    # The same as arccosh(1 + size^2 / (2 t)) / size, which is 0 if size^2 is lost beside 1: faces of no size at all.
    lowest = full_rate * (np.full(len(size), t**-0.5) if fitted else 2 * np.arcsinh(size / (2 * np.sqrt(t))) / size)
    lowest[operators.boundary_faces] *= _AT_BOUNDARY if fitted else 0.0
    return np.asarray(lowest)


class NormalizedDivergence:
    """The right-hand side of step 3: the divergence of the field X of step 2.

    The same as ``D @ (damping(...) * normalize(...))`` to rounding. For triangles there is a compiled kernel, one pass
    over the faces that stores no field; the tables are made once.

    Parameters
    ----------
    operators : Operators
        The domain.
    t : float or (n_components,) float64, optional
        Time step that the heat was made with, to have the field damped by `damping`; it has length 1 otherwise.
    order : (n,) int, optional
        All vertices, near ones near each other, to read memory in; that of the mesh may jump, and a pass that waits for
        memory takes several times as long.
    fitted : bool
        Whether the heat comes from a fitted `HeatFlow`; the field then follows the gradient of log u.
    """

    def __init__(
        self,
        operators: Operators,
        t: float | FloatArray | None = None,
        order: IntArray | None = None,
        fitted: bool = False,
    ) -> None:
        self._arguments = operators, t, order, fitted
        self._tables: tuple[AnyArray, FloatArray] | None = None
        if isinstance(operators.gradient, TriangleElements):
            self._order = np.arange(operators.n) if order is None else order
            lowest = np.zeros(len(operators.weights)) if t is None else lowest_full_rate(operators, t, fitted)
            self._tables = _divergence_tables(operators.gradient, operators.weights, lowest, self._order)
        else:
            _ = operators.D  # made on first use otherwise, in the middle of the first query

    def divergence(self, u: FloatArray) -> FloatArray:
        """Integrated divergence (n, k) for heat (n, k)."""
        operators, t, _, fitted = self._arguments
        divergence = np.empty(u.shape)
        # One column at a time: the field of all takes more memory than the caches hold.
        for column, of_column in zip(u.T, divergence.T, strict=True):
            if self._tables is not None:
                ordered = column[self._order].astype(np.float64, copy=False)
                with np.errstate(divide="ignore", invalid="ignore"):
                    log_u = np.log(ordered)
                of_column[self._order] = divergence_of_descent(*self._tables, ordered, log_u, LOWEST_HEAT, fitted)
                continue
            column = np.ascontiguousarray(column)
            X = normalize(operators, column, fitted)
            if t is not None:
                X *= np.tile(damping(operators, column, t, fitted=fitted), operators.dimension)
            of_column[:] = operators.D @ X
        return divergence

    def __reduce__(self) -> tuple[type[NormalizedDivergence], tuple[Any, ...]]:
        return NormalizedDivergence, self._arguments


def _divergence_tables(
    elements: TriangleElements, weights: FloatArray, full_rate: FloatArray, order: IntArray
) -> tuple[AnyArray, FloatArray]:
    """All that the divergence takes of a triangulation, a row per face, so that a pass reads little memory.

    Corners (m, 3) int32 are places in the `order` in which vertices are visited; faces have the order of their first
    corners there. The numbers (m, 5) of a face are one over the length of the side from corner 0 to corner 1; the foot
    of corner 2 on it, from 0 to 1; one over the height; the area; one over the square of `full_rate`, the rate below
    which a direction is not trusted fully, 0 for any.
    """
    F = elements.corners
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    corners = place[F]
    first = np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])
    # No two of these numbers are equal, so that every way of sorting gives the same.
    by_first = np.sort(first.astype(np.int64) * len(F) + np.arange(len(F))) % len(F)
    numbers = np.empty((len(F), 5))
    with np.errstate(divide="ignore"):
        for column, values in enumerate((*elements.frames(), weights, full_rate**-2.0)):
            numbers[:, column] = values[by_first]
    return corners[by_first], numbers


class PoissonProblem:
    """L phi = b, factored, with one vertex of each component grounded.

    The constants on each component are the null space of L. Fixing one value in each removes the null space and changes
    nothing else; adding a small multiple of the identity instead would distort the solution on large domains.

    Parameters
    ----------
    operators : Operators
        The domain.
    backend : {"auto", "scipy", "multifrontal"}
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
        self.t, self._n = t, operators.n
        has_several = isinstance(t, np.ndarray)
        self.mean_mass = operators.expand_to_vertices(operators.mean_masses) if has_several else operators.mean_mass
        L = fitted_laplacian(operators, t) if fitted else operators.L
        lumped = operators.M.diagonal() if mass is None else mass
        step = operators.expand_to_vertices(t) if isinstance(t, np.ndarray) else t
        matrix = shifted(with_rotations(L, rotations), -step / self.mean_mass, lumped / self.mean_mass)
        self.factor = factorize(_real(matrix), backend, np.repeat(operators.referenced, 2))
        self._scalar: Factorization | None = None
        weights = L - sp.diags_array(L.diagonal())
        if weights.min() < -_ROUNDING * weights.max():
            scalar = shifted(L, -step / self.mean_mass, lumped / self.mean_mass)
            self._scalar = factorize(scalar, backend, operators.referenced)

    def solve(self, b: AnyArray) -> AnyArray:
        """Vectors Y after the time step, complex (n,) or (n, k), for initial vectors `b` in units of `mean_mass`."""
        columns = np.ascontiguousarray(b.reshape(self._n, -1).T).astype(np.complex128, copy=False)
        parts: FloatArray = columns.view(np.float64).T
        Y = self.factor.solve(parts[:, 0] if parts.shape[1] == 1 else np.ascontiguousarray(parts))
        return np.ascontiguousarray(Y.reshape(2 * self._n, -1).T).view(np.complex128).T.reshape(b.shape)

    def sign(self, b: AnyArray) -> FloatArray | float:
        """The sign (n,) of the heat that starts with the lengths of `b` (n,), and that of vectors as multiples of it.

        Heat can only be negative if weights are, as those of obtuse triangles at the boundary.
        """
        return 1.0 if self._scalar is None else np.where(self._scalar.solve(np.abs(b)) < 0, -1.0, 1.0)


def unit_numbers(Y: AnyArray) -> AnyArray:
    """Complex numbers divided by their size; 0 where that is too small for a direction."""
    size = np.abs(Y)
    return np.divide(Y, size, out=np.zeros_like(Y), where=size > LOWEST_HEAT)


def _real(A: sp.csc_matrix) -> sp.csc_matrix:
    """A Hermitian matrix (n, n) as a real symmetric one (2 n, 2 n), with the block [[a, -b], [b, a]] for a + i b."""
    rows = A.tocsr()
    blocks = np.empty((rows.nnz, 2, 2))
    blocks[:, 0, 0] = blocks[:, 1, 1] = rows.data.real
    blocks[:, 1, 0], blocks[:, 0, 1] = rows.data.imag, -rows.data.imag
    real = sp.bsr_matrix((blocks, rows.indices, rows.indptr), shape=(2 * A.shape[0], 2 * A.shape[1])).tocsc()
    real.sort_indices()
    return real
