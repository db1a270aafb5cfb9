"""Options of the solver: checked once, with the same words and defaults wherever they are given."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import HeatMethodSolver, shapes
from heat_igl.heat_method import SolverOptions
from heat_igl.operators import operators


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("t_coef", 0, "t_coef must be a positive number, not 0"),
        ("t", "soon", "t must be a positive number, not 'soon'"),
        (
            "laplacian",
            "graph",
            "laplacian must be one of 'auto', 'intrinsic-delaunay', 'intrinsic-delaunay-refined', 'cotan', not 'graph'",
        ),
        ("boundary", "robin", "boundary must be one of 'neumann', 'dirichlet', 'average', not 'robin'"),
        ("magnitude", "log", "magnitude must be one of 'auto', 'unit', 'damped', not 'log'"),
        ("backend", "magma", "backend must be one of 'auto', .*, not 'magma'"),
    ],
)
def test_an_option_without_a_meaning_is_refused_when_options_are_put_together(option, value, message):
    with pytest.raises(ValueError, match=message):
        SolverOptions(**{option: value})
    with pytest.raises(ValueError, match=message):
        HeatMethodSolver(shapes.grid(2), **{option: value})


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
