"""Measures of a distance: errors against the truth, and violations of properties that every distance has.

Relative errors are fractions, not percent. A row of a (k, n) array is the distance from one set of sources, as
`HeatMethodSolver.distances` returns it.

Examples
--------
>>> import heat_igl
>>> heat_igl.validation.metrics.relative_error([0.0, 1.1, 2.0], [0.0, 1.0, 2.0]).round(6).tolist()  # nan at the source
[nan, 0.1, 0.0]
"""

from __future__ import annotations

from heat_igl.validation.error_norms import ErrorSummary, error_summary, relative_error
from heat_igl.validation.violations import (
    BoundViolations,
    TriangleViolations,
    asymmetry,
    bound_violations,
    eikonal_residual,
    triangle_violations,
)

__all__ = [
    "BoundViolations",
    "ErrorSummary",
    "TriangleViolations",
    "asymmetry",
    "bound_violations",
    "eikonal_residual",
    "error_summary",
    "relative_error",
    "triangle_violations",
]
