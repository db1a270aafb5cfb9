"""Distance as the logarithm of a linear problem's solution: Varadhan's formula and the boundary problem BP.

Both take the logarithm of heat itself, where the heat method only uses its direction, so that every error of its
magnitude (the time step, the mesh, the boundary, the curvature) becomes one of the distance.
"""

from __future__ import annotations

import warnings
from typing import Literal

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning
from heat_igl.heat_method import smallest_time_step
from heat_igl.linear import factorize
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators, operators
from heat_igl.runtime import LOWEST_HEAT as _LOWEST_HEAT
from heat_igl.runtime import RANGE_LIMIT
from heat_igl.runtime import SOURCE_HEAT as _SOURCE_HEAT
from heat_igl.sources import Sources, vertex_sources
from heat_igl.steps import HeatFlow
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["boundary_problem", "log_heat_kernel", "varadhan"]

# Products that the heat kernel may cost; clean meshes need 1000 to 30 000, and a single sliver can ask for 1e9.
_MOST_PRODUCTS = 1e5

# Factor c in t = c h^(2/3) D^(4/3) for the heat kernel. Geometric mean of the mean errors over the square, disk,
# sphere, cylinder, cow and bunny: 3.6, 3.3 and 3.9 % for 0.05, 0.07 and 0.1.
_KERNEL_TIME = 0.07


def varadhan(
    mesh: Mesh | Operators,
    sources: Sources,
    *,
    t: float | None = None,
    form: Literal["backward-euler", "heat-kernel"] = "backward-euler",
) -> FloatArray:
    """Varadhan's formula: distance from the magnitude of heat after a short time.

    Parameters
    ----------
    mesh : Mesh or Operators
        The domain.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    t : float, optional
        Time, a squared length; raised where heat could not cross the domain in double precision. By default h^2 for
        "backward-euler" and 0.07 h^(2/3) D^(4/3) for "heat-kernel", h the mean edge length, D the longest distance.
    form : {"backward-euler", "heat-kernel"}
        "backward-euler": ``-sqrt(t) log(u / u_source)`` of one step (4), (id - t Lap) u = delta. The paper's equation
        (delta t) has a factor 1/2, which halves every distance: in one dimension the step is
        ``u = exp(-x / sqrt(t)) / (2 sqrt(t))``.
        "heat-kernel": ``sqrt(-4 t log(k / k_source))``, equation (VF), of the heat kernel itself. Dividing by
        k_source takes away the factor (4 pi t)^(-n/2) of (2), without which distances would depend on the unit.

    Returns
    -------
    (n,) float64
        In the mesh's unit; 0 at the sources, ``inf`` where none is reached.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    ValueError
        If t is not positive or `form` is unknown.

    Warns
    -----
    AccuracyWarning
        If an explicit t had to be raised, or heat is not positive everywhere.

    Notes
    -----
    On a line of edges h the step falls by ``acosh(1 + h^2 / (2 t))`` per edge, so that the first form is too short by
    the fraction ``h^2 / (24 t)`` (3.8 % at t = h^2); in two dimensions it is too long by
    ``sqrt(t) log(d / sqrt(t)) / 2``.

    The heat kernel of the same line is a Bessel function, too large far away: the second form is too short by the
    fraction ``d^2 h^2 / (96 t^2)``, while curvature and the cut locus add an error of the order of t / d. Both vanish
    alike for t = c h^(2/3) D^(4/3). Between sources nearer to each other than sqrt(t) their heat adds up to more than
    u_source, and distance reads 0.
    """
    domain = domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    h, longest = domain.mean_edge_length, domain.longest_distance
    if form == "backward-euler":
        step = time_step(t, h**2, smallest_time_step(domain))
        return np.asarray(np.sqrt(step) * fallen_from_sources(log_step(domain, chosen, step), domain, chosen))
    if form != "heat-kernel":
        raise ValueError(f"form must be 'backward-euler' or 'heat-kernel', not {form!r}")
    step = time_step(t, _KERNEL_TIME * (h * longest**2) ** (2 / 3), longest**2 / (4 * RANGE_LIMIT))
    log_k = log_heat_kernel(domain, chosen, step)
    return np.asarray(np.sqrt(4 * step * fallen_from_sources(log_k, domain, chosen)))


def boundary_problem(mesh: Mesh | Operators, sources: Sources, *, t: float | None = None) -> FloatArray:
    """The paper's boundary problem (BP): (id - t Lap) v = 0 off the sources, v = 1 on them, and -sqrt(t) log v.

    From one source it is `varadhan` with ``form="backward-euler"`` to rounding, because u / u_source solves BP. From
    several it is the better of the two: every source is held at 1, whatever its mass and its neighbours.

    Parameters
    ----------
    mesh : Mesh or Operators
        The domain.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    t : float, optional
        Time, a squared length; h^2 by default, raised where v could not cross the domain in double precision.

    Returns
    -------
    (n,) float64
        In the mesh's unit; 0 at the sources, ``inf`` where none is reached.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    FactorizationError
        If the matrix is not positive definite.
    ValueError
        If t is not positive.

    Warns
    -----
    AccuracyWarning
        If an explicit t had to be raised, or v is not positive everywhere.
    """
    domain = domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    step = time_step(t, domain.mean_edge_length**2, smallest_time_step(domain))
    reached = reached_from(domain, chosen)
    free = reached.copy()
    free[chosen] = False
    v = np.zeros(domain.n)
    v[chosen] = _SOURCE_HEAT
    if free.any():
        # In units of the mean mass, so that the large values on the sources overflow in no unit of length.
        matrix = ((domain.M - step * domain.L) / domain.M.diagonal()[domain.referenced].mean()).tocsr()[free]
        v[free] = factorize(matrix[:, free].tocsc()).solve(-(matrix @ v))
    log_v = _logarithm(v, reached)
    return np.asarray(np.sqrt(step) * fallen_from_sources(log_v, domain, chosen))


def log_heat_kernel(mesh: Mesh | Operators, sources: Sources, t: float) -> FloatArray:
    """The logarithm of the discrete heat kernel, ``log (exp(t M^-1 L) M^-1 delta)``, accurate far from the source.

    Parameters
    ----------
    mesh : Mesh or Operators
        The domain.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices, a unit of heat on each.
    t : float
        Time, a squared length.

    Returns
    -------
    (n,) float64
        Logarithm of heat per area; ``-inf`` where none arrives.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    ValueError
        If t is not positive.

    Warns
    -----
    AccuracyWarning
        If heat is not positive everywhere: below 1e-590 of the source, or with a Laplacian of negative weights.

    Notes
    -----
    By uniformization (Jensen 1953): with q the largest rate at which a vertex passes on heat, ``P = Id + M^-1 L / q``
    has no negative entry on an intrinsic Delaunay triangulation, and
    ``exp(t M^-1 L) = sum_j P^j exp(-q t) (q t)^j / j!`` is a sum without a cancellation: every value keeps its
    *relative* accuracy, 1e-13 against the closed form on a torus where k falls by 95 e-foldings.
    `scipy.sparse.linalg.expm_multiply` keeps 1e-16 of the largest value, so that on the same torus nothing is left
    beyond 37 e-foldings, or 12 sqrt(t).

    The cost is one product with P for each unit of q t. Where a vertex of tiny mass makes that more than 1e5, backward
    Euler steps are taken instead, as free of cancellations; implicit schemes of higher order are not always positive
    (Bolley and Crouzeix 1978). The logarithm, whose error is a series in the exponent over the number of steps, is
    extrapolated from three runs; distances then are within 0.1 % of what the sum gives (torus, cow, bunny).
    """
    domain = domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    time_step(t, t, 0.0)
    reached = reached_from(domain, chosen)
    if not reached.any():
        return np.full(domain.n, -np.inf)
    mass = np.where(domain.referenced, domain.M.diagonal(), np.inf)
    q = float((-domain.L.diagonal() / mass).max())
    least = float(mass[chosen].min())
    u = np.zeros(domain.n)
    u[chosen] = _SOURCE_HEAT * (least / mass[chosen])
    if q * t <= _MOST_PRODUCTS:
        P = (sp.identity(domain.n) + sp.diags(1 / (q * mass)) @ domain.L).tocsr()
        log_k = _logarithm(_poisson_mean(P, u, q * t, reached), reached)
    else:
        log_k = _extrapolated(domain, u, t, reached)
    return np.asarray(log_k - np.log(_SOURCE_HEAT) - np.log(least))


def _extrapolated(domain: Operators, u: FloatArray, t: float, reached: BoolArray) -> FloatArray:
    """Logarithm of the heat after time t, from backward Euler in n, 2 n and 4 n steps (Richardson's extrapolation)."""
    exponent = domain.longest_distance**2 / (4 * t)
    n = 8 + int(2 * exponent)
    runs = []
    for steps in (n, 2 * n, 4 * n):
        flow = HeatFlow(domain, t / steps)
        mass = domain.M.diagonal() / flow.mean_mass
        heat = u
        for _ in range(steps):
            heat = flow.solve(mass * heat)
        runs.append(_logarithm(heat, reached))
    coarse, middle, fine = (run[reached] for run in runs)
    log_k = np.full(domain.n, -np.inf)
    log_k[reached] = (coarse - 6 * middle + 8 * fine) / 3
    return log_k


def _poisson_mean(P: sp.csr_matrix, u: FloatArray, expected: float, reached: BoolArray) -> FloatArray:
    """The mean of ``P^j u`` over a Poisson distributed j, until the rest is below 1e-12 of every value on `reached`."""
    total = np.zeros_like(u)
    smallest = -700.0  # as a logarithm: what is lighter underflows
    log_weight, j = -expected, 0
    while log_weight > smallest or j < expected:
        if log_weight > smallest:
            total += np.exp(log_weight) * u
        j += 1
        log_weight += np.log(expected / j)
        u = P @ u
        if j % 16 == 0 and j > expected:
            # From here on the weights fall at least like a geometric series, and P raises no value above the largest.
            rest = np.exp(log_weight) / (1 - expected / (j + 1)) * np.abs(u).max()
            if rest <= 1e-12 * total[reached].min():
                break
    return total


def domain_of(mesh: Mesh | Operators) -> Operators:
    """The operators of a mesh on its intrinsic Delaunay triangulation, or those given."""
    return operators(mesh) if isinstance(mesh, Mesh) else mesh


def time_step(t: float | None, default: float, smallest: float, name: str = "t") -> float:
    """The time step asked for or the default, raised with a warning to what heat needs to cross the domain."""
    if t is None:
        return max(default, smallest)
    if not (np.isfinite(t) and t > 0):
        raise ValueError(f"{name} must be a positive number (a squared length), not {t!r}")
    if t < smallest:
        warnings.warn(
            f"{name} = {t:.4g} is too small for heat to cross the mesh in double precision; using {smallest:.4g}",
            AccuracyWarning,
            stacklevel=3,
        )
    return max(float(t), smallest)


def reached_from(domain: Operators, sources: IntArray) -> BoolArray:
    """Vertices of faces that are connected with a source."""
    return domain.referenced & np.isin(domain.components, domain.components[sources])


def log_step(domain: Operators, sources: IntArray, t: float, share: FloatArray | None = None) -> FloatArray:
    """Logarithm of u in (M - t L) u = delta, `share` units of heat on each source (1 by default); equation (4)."""
    flow = HeatFlow(domain, t)
    mass = domain.M.diagonal()[sources] / flow.mean_mass
    # The largest heat that cannot overflow: rows of L sum to zero, so u is at most the initial heat over mass.
    unit = _SOURCE_HEAT * float(mass[mass > 0].min(initial=1.0))
    initial = np.zeros(domain.n)
    initial[sources] = unit if share is None else unit * share[sources]
    u = flow.solve(initial)
    log_u = _logarithm(u, reached_from(domain, sources))
    return np.asarray(log_u - np.log(unit) - np.log(flow.mean_mass))


def _logarithm(heat: FloatArray, reached: BoolArray) -> FloatArray:
    """The logarithm of `heat`, -inf where it cannot arrive, and a warning where it should have."""
    lost = reached & ~(heat >= _LOWEST_HEAT)
    if lost.any():
        warnings.warn(
            f"no positive heat arrives at {int(lost.sum())} of {int(reached.sum())} vertices, where distances are too "
            "short: raise the time step, or, on triangles, use laplacian='intrinsic-delaunay'",
            AccuracyWarning,
            stacklevel=4,
        )
    log_heat = np.full(len(heat), -np.inf)
    log_heat[reached] = np.log(np.where(lost, _LOWEST_HEAT, heat)[reached])
    return log_heat


def fallen_from_sources(log_heat: FloatArray, domain: Operators, sources: IntArray) -> FloatArray:
    """``-log(u / u_source)``, at least 0, with the warmest source of each component for u_source; 0 at the sources."""
    warmest = np.full(int(domain.components.max()) + 1, -np.inf)
    np.maximum.at(warmest, domain.components[sources], log_heat[sources])
    arrived = np.isfinite(log_heat)
    fallen = np.full(domain.n, np.inf)
    fallen[arrived] = np.maximum(warmest[domain.components[arrived]] - log_heat[arrived], 0.0)
    fallen[sources] = 0.0
    return fallen
