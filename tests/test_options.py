"""Options of the solver: checked once, with the same words and defaults wherever they are given."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import HeatMethodSolver, shapes
from heat_igl.heat_method import SolverOptions
from heat_igl.operators import operators


def test_options_put_together_before_are_those_of_the_keywords():
    mesh = perturbed(shapes.disk(6))
    chosen = {"t_coef": np.float32(3), "laplacian": "cotan", "boundary": "average", "backend": "scipy"}
    options = SolverOptions(**chosen)
    assert type(options.t_coef) is float
    np.testing.assert_array_equal(
        HeatMethodSolver.from_options(mesh, options).distance(5), HeatMethodSolver(mesh, **chosen).distance(5)
    )


@pytest.mark.parametrize(
    ("options", "surface", "volume"),
    [
        (SolverOptions(), True, False),
        (SolverOptions(laplacian="cotan"), False, False),
        (SolverOptions(magnitude="unit"), False, False),
        (SolverOptions(laplacian="cotan", magnitude="damped"), True, True),
    ],
)
def test_which_fields_are_damped(options, surface, volume):
    assert options.damps(operators(shapes.grid(2))) is surface
    assert options.damps(operators(shapes.box(1))) is volume
