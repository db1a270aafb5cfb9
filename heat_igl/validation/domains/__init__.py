"""Small domains of every kind with known distances: points, metrics, tetrahedra, polygons and images."""

from heat_igl.validation.domains import body_cases, surface_cases
from heat_igl.validation.domains.case import METHODS, DomainCase, Problem, solver_for

__all__ = ["CASES", "METHODS", "DomainCase", "Problem", "solver_for"]

#: All cases, kind after kind.
CASES: tuple[DomainCase, ...] = (*surface_cases.CASES, *body_cases.CASES)
