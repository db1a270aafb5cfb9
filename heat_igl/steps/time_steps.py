"""The smallest time step whose heat crosses a domain in double precision."""

from __future__ import annotations

import numpy as np

from heat_igl.operators import Operators
from heat_igl.runtime import LARGEST_EXPONENT, RANGE_LIMIT
from heat_igl.typing import FloatArray

__all__ = ["smallest_time_step", "smallest_time_steps"]


def smallest_time_step(domain: Operators, fitted: bool = False) -> float:
    """The smallest time step whose heat crosses `domain` without underflow in double precision.

    Along a line of edges of length h, one backward Euler step falls by acosh(1 + h^2 / (2 t)) e-foldings per edge, and
    by h / sqrt(t) if the flow is `fitted`. The result makes that, times the number of edges across, `RANGE_LIMIT`.
    """
    return _smallest(domain.longest_distance, domain.mean_edge_length, fitted)


def smallest_time_steps(domain: Operators, fitted: bool) -> FloatArray:
    """`smallest_time_step` (n_components,) of each component."""
    if domain.longest_distances is None or domain.n_components == 1:
        return np.full(domain.n_components, smallest_time_step(domain, fitted))
    of_component = zip(domain.longest_distances, domain.mean_edge_lengths, strict=True)
    return np.array([_smallest(longest, h, fitted) if longest > 0 else 0.0 for longest, h in of_component])


def _smallest(longest: float, h: float, fitted: bool) -> float:
    """`smallest_time_step` for a longest distance and a mean edge length."""
    if fitted:
        return float((longest / RANGE_LIMIT) ** 2)
    per_edge = RANGE_LIMIT / (longest / h)
    return float(h**2 / (2 * (float(np.cosh(per_edge)) - 1))) if per_edge < LARGEST_EXPONENT else 0.0
