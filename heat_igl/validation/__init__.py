"""Grade distances: generated domains, closed forms to compare with, error norms, and reports on several methods."""

from heat_igl.validation import closed_forms, metrics
from heat_igl.validation.comparison import METHODS, Method, Progress, Solver, draw_sources, validate
from heat_igl.validation.metrics import (
    BoundViolations,
    ErrorSummary,
    TriangleViolations,
    asymmetry,
    bound_violations,
    eikonal_residual,
    error_summary,
    relative_error,
    triangle_violations,
)
from heat_igl.validation.report import ValidationReport, ValidationRow

__all__ = [
    "BoundViolations",
    "ErrorSummary",
    "METHODS",
    "Method",
    "Progress",
    "Solver",
    "TriangleViolations",
    "ValidationReport",
    "ValidationRow",
    "asymmetry",
    "bound_violations",
    "closed_forms",
    "draw_sources",
    "eikonal_residual",
    "error_summary",
    "metrics",
    "relative_error",
    "triangle_violations",
    "validate",
]
