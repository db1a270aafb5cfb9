"""Other methods for geodesic distance that the paper discusses, for comparison.

Varadhan's formula (`varadhan`) and the boundary problem BP (`boundary_problem`). By theorem 3.1 (`graph_limit`) both
tend to distances along edges (`heat_igl.reference.edge_paths`) as t tends to 0. They take source vertices and return
distances (n,), which are 0 at the sources, ``inf`` at unreachable vertices, and never negative.

The heat method uses only the direction of the heat gradient. Varadhan's formula and BP use the magnitude of the heat,
so all errors of the magnitude (from the time step, the mesh, the boundary and the curvature) become errors of the
distance.

Examples
--------
>>> import heat_igl
>>> mesh = heat_igl.shapes.strip(4, 3)
>>> limit = heat_igl.reference.baselines.graph_limit(heat_igl.operators.operators(mesh).L, 0, -1e6)
>>> limit.round(3)[[4, 15, 19]].tolist()
[4.0, 3.0, 7.0]
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl.errors import AccuracyWarning
from heat_igl.linear import factorize
from heat_igl.mesh import MeshLike, as_simplices, connectivity
from heat_igl.operators import Operators, operators
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, warn_caller
from heat_igl.sources import Sources, vertex_sources
from heat_igl.steps import HeatFlow, smallest_time_step
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["boundary_problem", "graph_limit", "varadhan"]

# Entries of A below this fraction of the largest are rounding errors, not edges of the graph. For example, the two
# right angles opposite the diagonal of a square have cotangents of 1e-17.
_ROUNDING = 1e-12


def varadhan(mesh: MeshLike | Operators, sources: Sources, *, t: float | None = None) -> FloatArray:
    """Varadhan's formula: distance ``-sqrt(t) log(u / u_source)`` from the heat u of one step, (id - t Lap) u = delta.

    The paper's equation (delta t) has an additional factor 1/2, which halves every distance: in one dimension the step
    gives ``u = exp(-x / sqrt(t)) / (2 sqrt(t))``.

    Parameters
    ----------
    mesh : mesh or Operators
        The domain.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    t : float, optional
        Time, a squared length; h^2 by default. It is raised if heat cannot cross the domain in double precision.

    Returns
    -------
    (n,) float64
        Distance in the unit of the mesh; 0 at the sources, ``inf`` at unreachable vertices.

    Raises
    ------
    SourceError
        If the sources are not vertices of the mesh.
    ValueError
        If t is not positive.

    Warns
    -----
    AccuracyWarning
        If a given t is raised, or the heat is not positive everywhere.

    Notes
    -----
    On a line with edges of length h, log u decreases by ``acosh(1 + h^2 / (2 t))`` per edge. Distance is then too
    short by the fraction ``h^2 / (24 t)`` (3.8 % at t = h^2). In two dimensions it is too long by
    ``sqrt(t) log(d / sqrt(t)) / 2``.
    """
    domain = _domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    step = _time_step(t, domain)
    flow = HeatFlow(domain, step)
    mass = domain.M.diagonal()[chosen] / flow.mean_mass
    initial = np.zeros(domain.n)
    # The largest heat that cannot overflow: the rows of L sum to zero, so u is at most the initial heat over mass.
    initial[chosen] = SOURCE_HEAT * float(mass[mass > 0].min(initial=1.0))
    log_u = _logarithm(flow.solve(initial), _reached_from(domain, chosen))
    return np.asarray(np.sqrt(step) * _fallen_from_sources(log_u, domain, chosen))


def boundary_problem(mesh: MeshLike | Operators, sources: Sources, *, t: float | None = None) -> FloatArray:
    """Distance -sqrt(t) log v from the boundary problem (BP): (id - t Lap) v = 0 off the sources, v = 1 on the sources.

    For one source the result equals `varadhan` to rounding, because u / u_source solves
    BP. For several sources BP is more accurate, since v is 1 at each source regardless of mass and neighbours.

    Parameters
    ----------
    mesh, sources
        As for `varadhan`.
    t : float, optional
        Time, a squared length; h^2 by default. It is raised if v would underflow before it crosses the domain.

    Returns
    -------
    (n,) float64
        Distance, as from `varadhan`.

    Raises
    ------
    SourceError
        If the sources are not vertices of the mesh.
    FactorizationError
        If the matrix is not positive definite.
    ValueError
        If t is not positive.

    Warns
    -----
    AccuracyWarning
        If a given t is raised, or v is not positive everywhere.
    """
    domain = _domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    step = _time_step(t, domain)
    reached = _reached_from(domain, chosen)
    free = reached.copy()
    free[chosen] = False
    v = np.zeros(domain.n)
    v[chosen] = SOURCE_HEAT
    if free.any():
        # Division by the mean mass prevents overflow in every unit of length.
        matrix = ((domain.M - step * domain.L) / domain.M.diagonal()[domain.referenced].mean()).tocsr()[free]
        v[free] = factorize(matrix[:, free].tocsc()).solve(-(matrix @ v))
    log_v = _logarithm(v, reached)
    return np.asarray(np.sqrt(step) * _fallen_from_sources(log_v, domain, chosen))


def _domain_of(mesh: MeshLike | Operators) -> Operators:
    """The operators of a mesh on the intrinsic Delaunay triangulation; given operators are returned unchanged."""
    return mesh if isinstance(mesh, Operators) else operators(as_simplices(mesh))


def _time_step(t: float | None, domain: Operators) -> float:
    """The time step `t` or h^2, raised to what heat needs to cross the mesh; warns if a given `t` is raised."""
    smallest = smallest_time_step(domain)
    if t is None:
        return max(domain.mean_edge_length**2, smallest)
    if not (np.isfinite(t) and t > 0):
        raise ValueError(f"t must be a positive number (a squared length), not {t!r}")
    if t < smallest:
        message = f"t = {t:.4g} is too small for heat to cross the mesh in double precision; using {smallest:.4g}"
        warn_caller(message, AccuracyWarning)
    return max(float(t), smallest)


def _reached_from(domain: Operators, sources: IntArray) -> BoolArray:
    """Mask (n,) of the referenced vertices in the components of the sources."""
    return domain.referenced & np.isin(domain.components, domain.components[sources])


def _logarithm(heat: FloatArray, reached: BoolArray) -> FloatArray:
    """Logarithm of `heat`, -inf at unreachable vertices; warns if reachable vertices have no positive heat."""
    lost = reached & ~(heat >= LOWEST_HEAT)
    if lost.any():
        warn_caller(
            f"no positive heat arrives at {int(lost.sum())} of {int(reached.sum())} vertices, where distances are too "
            "short: raise the time step, or, on triangles, use laplacian='intrinsic-delaunay'",
            AccuracyWarning,
        )
    log_heat = np.full(len(heat), -np.inf)
    log_heat[reached] = np.log(np.where(lost, LOWEST_HEAT, heat)[reached])
    return log_heat


def _fallen_from_sources(log_heat: FloatArray, domain: Operators, sources: IntArray) -> FloatArray:
    """``-log(u / u_source)`` (n,), at least 0, with u_source the largest heat at a source of the same component."""
    warmest = np.full(int(domain.components.max()) + 1, -np.inf)
    np.maximum.at(warmest, domain.components[sources], log_heat[sources])
    arrived = np.isfinite(log_heat)
    fallen = np.full(domain.n, np.inf)
    fallen[arrived] = np.maximum(warmest[domain.components[arrived]] - log_heat[arrived], 0.0)
    fallen[sources] = 0.0
    return fallen


def graph_limit(A: sp.spmatrix, sources: Sources, log_t: float) -> FloatArray:
    """``log u_t / log t`` for (Id - t A) u_t = delta, for times t far below the range of doubles (theorem 3.1).

    By the theorem this tends to the number of edges n_v from the source as t tends to 0, for every Laplacian. With
    ``u_v = t^n_v y_v`` the system reads ``y_v - sum_w A_vw t^(1 + n_w - n_v) y_w = delta_v``. The numbers of edges of
    adjacent vertices differ by at most 1, so only the powers t^0, t and t^2 occur, which may underflow without harm.
    The range of ``log u_v = n_v log t + log y_v`` is unlimited. In the limit ``y_v = (A^n_v delta)_v``, hence

        ``log u_t / log t = n_v + log|(A^n_v delta)_v| / log t + O(t / log t)``:

    The convergence is like 1 / log t. Without the scaling, t^n underflows at 1e-308 long before the limit is near.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Real and symmetric, for instance `Operators.L`. Entries below 1e-12 of the largest do not count as edges.
    sources : int, sequence of int, or (n,) mask of bool
        Rows in which delta is 1.
    log_t : float
        Natural logarithm of t, negative, for example -1e6.

    Returns
    -------
    (n,) float64
        ``log u_t / log t``, which is O(t / log t) at the sources. The value is ``inf`` at unreachable rows and if the
        leading terms cancel: the theorem holds for generic A, and for all A without negative off-diagonal entries.

    Raises
    ------
    SourceError
        If the sources are not rows of A.
    ValueError
        If A is not a symmetric matrix, or `log_t` is not negative.
    """
    matrix = sp.csr_array(A, dtype=np.float64)
    if matrix.shape[0] != matrix.shape[1] or abs(matrix - matrix.T).max() > _ROUNDING * abs(matrix).max():
        raise ValueError(f"A must be a symmetric matrix, but the one of shape {matrix.shape} is not")
    if not (np.isfinite(log_t) and log_t < 0):
        raise ValueError(f"log_t must be a negative number, the logarithm of t < 1, not {log_t!r}")
    chosen = vertex_sources(sources, matrix.shape[0])
    matrix.data[np.abs(matrix.data) <= _ROUNDING * np.abs(matrix.data).max(initial=0.0)] = 0.0
    matrix.eliminate_zeros()
    edges = connectivity.edge_distance(abs(matrix), chosen, count_edges=True)
    reached = np.flatnonzero(np.isfinite(edges))
    graph = sp.coo_array(matrix[reached][:, reached])
    n = edges[reached]
    with np.errstate(under="ignore"):
        power = np.exp(log_t * (1 + n[graph.col] - n[graph.row]))
        scaled = sp.csc_array((graph.data * power, (graph.row, graph.col)), shape=graph.shape)
    # Without pivoting, and with nonnegative off-diagonal entries of A, elimination only adds nonnegative numbers. y
    # grows like the number of paths; with 1e40 paths a pivoted factorization loses the values near the source.
    factor = spl.splu(sp.eye_array(len(n), format="csc") - scaled, diag_pivot_thresh=0.0)
    y = factor.solve(np.isin(reached, chosen).astype(np.float64))
    limit = np.full(matrix.shape[0], np.inf)
    with np.errstate(divide="ignore"):
        limit[reached] = n + np.log(np.abs(y)) / log_t
    return limit
