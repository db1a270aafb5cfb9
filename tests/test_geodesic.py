"""GeodesicSolver, geodesic_distance and the plan: which engine answers, for every kind of source, cutoff and target."""

import numpy as np
import pytest
from conftest import perturbed

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, OffsetSources, SurfacePoints, geodesic_distance, shapes
from heat_igl.plan import SurfaceMeasures, distance_plan, sweep_plan
from heat_igl.windows import engine
from heat_igl.windows.tables import from_mesh

TORUS = perturbed(shapes.torus(20, 30))


@pytest.mark.parametrize("sources", [5, [5, 300], OffsetSources([5, 300], [0.1, 0.0])], ids=["one", "two", "late"])
def test_a_cutoff_looks_at_what_is_near_alone(sources, monkeypatch):
    """On the part within the cutoff distances are those on the whole mesh, also beyond its narrow places."""
    mesh = shapes.torus(60, 40)
    exact = geodesic_distance(mesh, sources, method="exact")
    sizes = []
    monkeypatch.setattr(engine, "from_mesh", lambda part, start: sizes.append(part.n_faces) or from_mesh(part, start))
    for cutoff in (0.02, 0.2, 0.6):
        near = np.where(exact <= cutoff, exact, np.inf)
        found = geodesic_distance(mesh, sources, cutoff=cutoff, method="exact")
        np.testing.assert_allclose(found, near, rtol=1e-12)
    assert sizes == sorted(sizes)
    assert sizes[0] < 0.02 * mesh.n_faces


def test_faces_that_are_there_twice_count_once():
    twice = Mesh(TORUS.V, np.concatenate([TORUS.F, TORUS.F[100:400, [1, 2, 0]]]))
    for method in ("windows", "sweep", "exact"):
        expected = geodesic_distance(TORUS, 5, method=method)
        np.testing.assert_allclose(geodesic_distance(twice, 5, method=method), expected, atol=1e-9)
    solver = GeodesicSolver(twice, method="exact")
    np.testing.assert_allclose(geodesic_distance(twice, 5), solver.distance(5), atol=1e-3 * expected.max())
    # Faces of points are counted in the mesh as it is given.
    there = SurfacePoints([TORUS.n_faces + 3], [[0.2, 0.3, 0.5]])
    here = SurfacePoints([103], [[0.5, 0.2, 0.3]])
    np.testing.assert_allclose(there.positions(twice), here.positions(TORUS))
    np.testing.assert_allclose(geodesic_distance(twice, there), geodesic_distance(TORUS, here), atol=1e-9)
    back = [geodesic_distance(twice, 5, method="exact", targets=place) for place in (there, here)]
    np.testing.assert_allclose(back[0], back[1], rtol=1e-12)
    np.testing.assert_allclose(back[1], geodesic_distance(TORUS, 5, method="exact", targets=here), rtol=1e-12)


def test_a_mesh_that_everybody_has(monkeypatch):
    mesh = heat_igl.sample_mesh()
    assert mesh.n_vertices > 2500
    assert not mesh.is_tetrahedral
    monkeypatch.setattr(heat_igl.validation.shapes, "bunny_path", lambda: None)
    blob = heat_igl.sample_mesh()
    np.testing.assert_array_equal(blob.V, shapes.blob(4).V)
    report = blob.report()
    assert (report.n_components, report.euler_characteristic, report.n_boundary_loops) == (1, 2, 0)
    assert not len(report.nonmanifold_vertices)
    assert np.isfinite(geodesic_distance(blob, 1234)).all()


# --- The plan names the engine for each kind of domain, its tolerance and the reason; solvers do as it says


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
        ("tetrahedra", "auto", "lines", None),
        ("separate simplices", "sweep", "hopf-lax", None),
    ],
)
def test_engines_by_kind_and_method(kind, method, engine, tolerance):
    plan = distance_plan(kind, method, 1e-4)
    assert (plan.engine, plan.tolerance) == (engine, tolerance)
    assert str(plan).startswith(engine)
    assert plan.reason in str(plan)


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
    assert GeodesicSolver(shapes.box(3)).plan.engine == "lines"
    cloud = heat_igl.PointCloud(shapes.icosphere(4).V)
    assert GeodesicSolver(cloud).plan.engine == "sweep"
    assert HeatMethodSolver(cloud).plan.engine == "heat"
