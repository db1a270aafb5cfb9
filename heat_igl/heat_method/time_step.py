"""The time step: in proportion to the square of the mean edge length, and large enough for the heat to cross."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.heat_method.options import SolverOptions
from heat_igl.operators import Operators
from heat_igl.runtime import LARGEST_EXPONENT, RANGE_LIMIT, warn_caller

__all__ = ["smallest_time_step", "time_step"]

# Between two aims, see the tables of docs/heat_path.md: on scans the error falls further with t, on a regular grid of
# squares, where heat prefers diagonals, it grows.
_T_COEF_FITTED = 0.5
# The paper's: t = h^2.
_T_COEF = 1.0


def time_step(options: SolverOptions, domain: Operators, fitted: bool) -> tuple[float, float]:
    """The time step for `domain`, and the one that was asked for: ``options.t``, or ``t_coef * h**2``.

    Warns
    -----
    AccuracyWarning
        If an explicit t had to be raised for the heat to cross the domain.
    """
    requested = options.t
    if requested is None:
        default = _T_COEF_FITTED if fitted else _T_COEF
        requested = (default if options.t_coef is None else options.t_coef) * domain.mean_edge_length**2
    step = max(requested, smallest_time_step(domain, fitted))
    if options.t is not None and step > requested:
        warn_caller(
            f"t = {requested:.4g} is too small for heat to cross the mesh in double precision; using {step:.4g}",
            AccuracyWarning,
        )
    return step, requested


def smallest_time_step(domain: Operators, fitted: bool = False) -> float:
    """The smallest time step whose heat crosses `domain` without underflow in double precision.

    Along a line of edges of length h, one backward Euler step falls by acosh(1 + h^2 / (2 t)) e-foldings per edge, and
    by h / sqrt(t) if the flow is `fitted`. The result makes that, times the number of edges across, `RANGE_LIMIT`.
    """
    if fitted:
        return (domain.longest_distance / RANGE_LIMIT) ** 2
    h = domain.mean_edge_length
    per_edge = RANGE_LIMIT / (domain.longest_distance / h)
    return h**2 / (2 * (float(np.cosh(per_edge)) - 1)) if per_edge < LARGEST_EXPONENT else 0.0
