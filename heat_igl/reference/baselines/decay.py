"""Distance from the decay of a solution with the distance: parts that the baselines share."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.operators import Operators, operators
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, warn_caller
from heat_igl.steps import HeatFlow
from heat_igl.typing import BoolArray, FloatArray, IntArray


def domain_of(mesh: MeshLike | Operators) -> Operators:
    """The operators of a mesh on the intrinsic Delaunay triangulation; given operators are returned unchanged."""
    return mesh if isinstance(mesh, Operators) else operators(as_simplices(mesh))


def time_step(t: float | None, default: float, smallest: float, name: str = "t") -> float:
    """The time step `t` or the default, but at least `smallest`; a warning is issued if a given `t` is raised."""
    if t is None:
        return max(default, smallest)
    if not (np.isfinite(t) and t > 0):
        raise ValueError(f"{name} must be a positive number (a squared length), not {t!r}")
    if t < smallest:
        warn_caller(
            f"{name} = {t:.4g} is too small for heat to cross the mesh in double precision; using {smallest:.4g}",
            AccuracyWarning,
        )
    return max(float(t), smallest)


def reached_from(domain: Operators, sources: IntArray) -> BoolArray:
    """Mask (n,) of the referenced vertices in the components of the sources."""
    return domain.referenced & np.isin(domain.components, domain.components[sources])


def log_step(domain: Operators, sources: IntArray, t: float, share: FloatArray | None = None) -> FloatArray:
    """Logarithm of u for (M - t L) u = delta, equation (4), with `share` units of heat on each source (default 1)."""
    flow = HeatFlow(domain, t)
    mass = domain.M.diagonal()[sources] / flow.mean_mass
    # The largest heat that cannot overflow: the rows of L sum to zero, so u is at most the initial heat over mass.
    unit = SOURCE_HEAT * float(mass[mass > 0].min(initial=1.0))
    initial = np.zeros(domain.n)
    initial[sources] = unit if share is None else unit * share[sources]
    u = flow.solve(initial)
    log_u = logarithm(u, reached_from(domain, sources))
    return np.asarray(log_u - np.log(unit) - np.log(flow.mean_mass))


def logarithm(heat: FloatArray, reached: BoolArray) -> FloatArray:
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


def fallen_from_sources(log_heat: FloatArray, domain: Operators, sources: IntArray) -> FloatArray:
    """``-log(u / u_source)`` (n,), at least 0, with u_source the largest heat at a source of the same component."""
    warmest = np.full(int(domain.components.max()) + 1, -np.inf)
    np.maximum.at(warmest, domain.components[sources], log_heat[sources])
    arrived = np.isfinite(log_heat)
    fallen = np.full(domain.n, np.inf)
    fallen[arrived] = np.maximum(warmest[domain.components[arrived]] - log_heat[arrived], 0.0)
    fallen[sources] = 0.0
    return fallen
