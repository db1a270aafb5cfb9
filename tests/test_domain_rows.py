"""Every kind of domain against known distances, and what those distances keep."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

import heat_igl
from heat_igl.validation.domains import CASES, DomainCase, body_cases, solver_for, surface_cases


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_method_stays_within_its_bound(case: DomainCase):
    problem = case.problem(np.random.default_rng([5, CASES.index(case)]))
    away = problem.exact > 0
    for method, bound in case.bounds.items():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", heat_igl.AccuracyWarning)
            found = solver_for(problem.domain, method).distance(problem.sources)
        error = found[away] / problem.exact[away] - 1
        assert np.abs(error).mean() <= bound, method
        # No value in a body is below the straight line by more than one percent.
        assert case.domain != "tetrahedra" or error.min() > -0.01, method


def test_refracted_time_obeys_snells_law():
    """The ray at an angle of incidence a leaves at b with sin a / sin b the ratio of the speeds."""
    left, right = 1.0, 0.4
    incidence = np.radians([0.0, 20, 40, 60])
    refracted = np.arcsin(np.sin(incidence) * right / left)
    end = np.stack([0.5 + 0.3 * np.cos(refracted), 0.1 + 0.2 * np.tan(incidence) + 0.3 * np.sin(refracted)], axis=1)
    V = np.concatenate([[[0.3, 0.1]], end])
    time = surface_cases.by_fermat(np.column_stack([V, np.zeros(5)]), 0, left, right)
    np.testing.assert_allclose(time[1:], 0.2 / np.cos(incidence) / left + 0.3 / right, rtol=1e-6)


def test_a_wall_is_passed_at_both_corners():
    V = np.array([[0.0, 0, 0], [3.0, 1, 0], [5.0, 9, 0], [5.0, 4, 0], [5.0, 4, 3], [4.5, 6, 0]]) - [7, 8, 9]
    to_end = math.hypot(4, 6)
    expected = [0, math.hypot(3, 1), math.hypot(5, 9), to_end + 1 + 2, math.hypot(to_end + 3, 3), to_end + 0.5]
    np.testing.assert_allclose(body_cases._around_the_wall(V, 0, -3.0, -2.0), expected)
