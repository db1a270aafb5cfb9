"""The time step: in proportion to the square of the mean edge length, and large enough for the heat to cross."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.heat.options import SolverOptions
from heat_igl.operators import Operators, is_rough_or_narrow
from heat_igl.plan import FARTHEST_SPREAD, T_COEF, T_COEF_FITTED, T_COEF_ROUGH
from heat_igl.runtime import warn_caller
from heat_igl.steps import smallest_time_step, smallest_time_steps
from heat_igl.typing import FloatArray

__all__ = ["time_step", "check_large_step"]


def time_step(options: SolverOptions, domain: Operators, fitted: bool) -> tuple[float | FloatArray, float | FloatArray]:
    """The time step for `domain`, and the one that was asked for: ``options.t``, or ``t_coef * h**2``.

    Each is a number, or one (n_components,) for each component if their mean edge lengths h differ.

    Warns
    -----
    AccuracyWarning
        If an explicit t had to be raised for the heat to cross the domain.
    """
    if options.t is not None:
        step = max(options.t, smallest_time_step(domain, fitted))
        if step > options.t:
            warn_caller(
                f"t = {options.t:.4g} is too small for heat to cross the mesh in double precision; using {step:.4g}",
                AccuracyWarning,
            )
        return step, options.t
    t_coef = options.t_coef
    if t_coef is None:
        t_coef = T_COEF
        if fitted:
            t_coef = T_COEF_ROUGH if is_rough_or_narrow(domain) else T_COEF_FITTED
    requested = t_coef * domain.mean_edge_lengths**2
    steps = np.maximum(requested, smallest_time_steps(domain, fitted))
    used = np.unique(domain.components[domain.referenced])
    if len(used) == 1:
        return float(steps[used[0]]), float(requested[used[0]])
    return steps, requested


def check_large_step(options: SolverOptions, domain: Operators) -> None:
    """Warn if the step that was asked for is so large that heat is nearly level over the whole domain.

    Raise ValueError if M - t L would be singular in double precision.

    Heat falls like exp(-d / sqrt(t)). With sqrt(t) above the longest distance it falls by less than a factor of e
    altogether, and distances follow the shape of the domain more than the way to the source.
    """
    step = options.t
    if step is None and options.t_coef is not None:
        step = options.t_coef * domain.mean_edge_length**2
    name, value = ("t", options.t) if options.t is not None else ("t_coef", options.t_coef)
    if step is not None and np.sqrt(step) > FARTHEST_SPREAD * domain.longest_distance:
        raise ValueError(
            f"{name} = {value:.4g} is too large: heat spreads over sqrt(t) = {np.sqrt(step):.4g}, and the longest "
            f"distance on the mesh is {domain.longest_distance:.4g}, so heat is level; t is a squared "
            "length"
        )
    if step is not None and np.sqrt(step) > domain.longest_distance:
        warn_caller(
            f"{name} = {value:.4g} is very large: heat spreads over sqrt(t) = {np.sqrt(step):.4g}, more than the "
            f"longest distance on the mesh, {domain.longest_distance:.4g}, and distances are smoothed by as much; "
            "t_coef from 0.5 to 10 is usual, and t is a squared length",
            AccuracyWarning,
        )
