"""The plan names the engine for each kind of domain, its tolerance and the reason; solvers do as it says."""

from __future__ import annotations

import numpy as np
import pytest

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, MeshError, shapes
from heat_igl.plan import SurfaceMeasures, distance_plan, sweep_plan

SMOOTH = SurfaceMeasures(n=5000, curvature=0.02, flatness=0.0, has_holes=False)


@pytest.mark.parametrize(
    ("kind", "method", "engine", "tolerance"),
    [
        ("triangles", "auto", "windows", 1e-4),
        ("triangles", "windows", "windows", 1e-4),
        ("triangles", "exact", "windows", 0.0),
        ("triangles", "sweep", "sweep", None),
        ("points", "auto", "sweep", None),
        ("points", "windows", "windows", 1e-4),
        ("tetrahedra", "auto", "fronts", None),
        ("separate simplices", "sweep", "fronts", None),
    ],
)
def test_engines_by_kind_and_method(kind, method, engine, tolerance):
    plan = distance_plan(kind, method, 1e-4)
    assert (plan.engine, plan.tolerance) == (engine, tolerance)
    assert str(plan).startswith(engine)
    assert plan.reason in str(plan)


@pytest.mark.parametrize("kind", ["tetrahedra", "separate simplices"])
@pytest.mark.parametrize("method", ["windows", "exact"])
def test_windows_need_triangles_that_fit_together(kind, method):
    with pytest.raises(MeshError, match=f"method='{method}' needs triangles that fit together, and .*: take method="):
        distance_plan(kind, method, 1e-5)


@pytest.mark.parametrize("tolerance", [-1e-9, 1, np.nan, "1e-5", True])
def test_tolerances_without_a_meaning(tolerance):
    with pytest.raises(ValueError, match="tolerance must be at least 0 and less than 1, not"):
        GeodesicSolver(shapes.grid(3), tolerance=tolerance)
    GeodesicSolver(shapes.grid(3), tolerance=0.5)


@pytest.mark.parametrize(
    ("measures", "words"),
    [
        (SurfaceMeasures(900, 0.02, 0.0, False), "on 900 vertices"),
        (SurfaceMeasures(5000, 0.5, 0.0, False), "0.5 radians"),
        (SurfaceMeasures(5000, 0.02, 0.8, True), "flat with holes"),
        (SurfaceMeasures(5000, 0.02, 0.0, False, 0.5), "triangles are large"),
    ],
)
def test_where_a_sweep_is_replaced_the_plan_says_why(measures, words):
    asked = distance_plan("triangles", "sweep", 1e-5)
    assert sweep_plan(SMOOTH, asked) == asked
    found = sweep_plan(measures, asked)
    assert (found.engine, found.tolerance) == ("windows", 0)
    assert words in found.reason


def test_solvers_carry_their_plan():
    mesh = shapes.icosphere(2)
    assert GeodesicSolver(mesh, tolerance=1e-3).plan.tolerance == 1e-3
    heat = HeatMethodSolver(mesh).plan
    assert (heat.engine, heat.tolerance) == ("heat", None)
    assert "t = 0.5 h^2" in heat.reason
    assert HeatMethodSolver(shapes.box(3)).plan.engine == "heat"
    assert GeodesicSolver(shapes.box(3)).plan.engine == "fronts"
    cloud = heat_igl.PointCloud(shapes.icosphere(4).V)
    assert GeodesicSolver(cloud).plan.engine == "sweep"
    assert HeatMethodSolver(cloud).plan.engine == "heat"
