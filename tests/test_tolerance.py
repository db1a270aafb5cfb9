"""Windows that are joined within a tolerance: errors, how many there are, and labels."""

import numpy as np
import pytest
from conftest import perturbed
from surfaces import arcs, bumpy, moebius_strip

from heat_igl import GeodesicSolver, Mesh, SurfacePoints, geodesic_distance, shapes
from heat_igl.plan import joining_accuracy
from heat_igl.windows import ExactSurface
from heat_igl.windows.tables import from_mesh

SPHERE = shapes.icosphere(5)
SMOOTH = {
    "ellipsoid": lambda: Mesh(SPHERE.V * [1.0, 0.7, 0.4], SPHERE.F),
    "blob": lambda: Mesh(SPHERE.V * (1 + 0.2 * np.sin(SPHERE.V @ [4.0, 1.0, 2.0]))[:, None], SPHERE.F),
    "torus": lambda: shapes.torus(100, 160),
    "cylinder": lambda: shapes.cylinder(300, 40),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_errors_are_within_the_tolerance_by_fewer_windows(name):
    """The raw answers, before their check, from two vertices that no symmetry names."""
    surface = ExactSurface(from_mesh(SMOOTH[name](), 0))
    for source in (np.array([77]), np.array([surface.n // 3])):
        truth = surface.solve(source)
        for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
            found = surface.solve(source, accuracy=joining_accuracy(tolerance))
            error = np.abs(found.distance - truth.distance)
            assert error.max() <= tolerance * truth.distance.max()
            if tolerance == 1e-3 and name != "cylinder":
                assert found.n_windows < 0.8 * truth.n_windows
                assert error.max() > 0


def test_a_sphere_against_great_circles():
    """The error of the polyhedron, 1e-4 here, hides that of a small tolerance."""
    found = geodesic_distance(SPHERE, 0, tolerance=1e-4)
    circles = arcs(SPHERE.V, 0)
    assert np.abs(found - circles).max() < 5e-4 * np.pi
    assert np.abs(found - geodesic_distance(SPHERE, 0, method="exact")).max() < 1e-4 * np.pi


@pytest.mark.parametrize(("seed", "source"), [(10, 4425), (35, 6647)])
def test_no_gap_opens_between_windows(seed, source):
    """Dented spheres on which, without windows in the gaps, vertices have no distance or one that is .7 % too long."""
    rng = np.random.default_rng(seed)
    k, phase = rng.normal(size=(6, 3)) * rng.uniform(2, 8), rng.uniform(0, 6.28, 6)
    V = SPHERE.V * (1 + 0.5 * np.sin(SPHERE.V @ k.T + phase).mean(axis=1))[:, None]
    surface = ExactSurface(from_mesh(Mesh(V + rng.normal(size=V.shape) * 0.0005 * rng.uniform(0, 4), SPHERE.F), 0))
    truth = surface.distance(np.array([source]))
    found = surface.distance(np.array([source]), accuracy=2e-5)
    assert np.abs(found - truth).max() < 5e-5 * truth.max()


def test_cells_are_those_of_exact_distance():
    """Within a tolerance single vertices would get the label of a cell beside theirs."""
    mesh = SMOOTH["ellipsoid"]()
    sources = list(range(0, mesh.n_vertices, 100))
    cells = GeodesicSolver(mesh, tolerance=1e-3).voronoi(sources)
    exact = GeodesicSolver(mesh, tolerance=0).voronoi(sources)
    assert np.array_equal(cells.labels, exact.labels)
    assert np.array_equal(cells.distance, exact.distance)


def test_a_source_in_a_face():
    mesh, source = SMOOTH["torus"](), SurfacePoints([3000], [[0.2, 0.3, 0.5]])
    exact = geodesic_distance(mesh, source, method="exact")
    found = geodesic_distance(mesh, source, tolerance=1e-3)
    assert 0 < np.abs(found - exact).max() <= 1e-4 * exact.max()


def test_derivatives_are_those_of_exact_distance():
    mesh = SMOOTH["torus"]()
    phi, pull_back = GeodesicSolver(mesh, tolerance=1e-3).distance_vjp(5)
    assert np.array_equal(phi, geodesic_distance(mesh, 5, method="exact"))
    assert not np.array_equal(phi, GeodesicSolver(mesh, tolerance=1e-3).distance(5))
    assert len(pull_back.inexact) == 0


ROUGH = {
    "bumpy": bumpy,
    "rough": lambda: perturbed(shapes.icosphere(4), 0.2),
    "with a boundary": lambda: moebius_strip(150, 8),
}


@pytest.mark.parametrize("make", ROUGH.values(), ids=ROUGH)
def test_where_windows_are_few_the_answer_is_exact(make):
    mesh = make()
    assert np.array_equal(geodesic_distance(mesh, 3, tolerance=1e-3), geodesic_distance(mesh, 3, method="exact"))


def test_a_cutoff_ends_the_search_and_offsets_count():
    surface = ExactSurface(from_mesh(SMOOTH["torus"](), 0))
    accuracy, sources, offsets = joining_accuracy(1e-3), np.array([0, 8000]), np.array([0.0, 0.3])
    truth = surface.solve(sources, offsets).distance
    found = surface.solve(sources, offsets, accuracy=accuracy).distance
    np.testing.assert_allclose(found, truth, atol=1e-4 * truth.max())
    within = surface.solve(sources, offsets, cutoff=1.0, accuracy=accuracy).distance
    near = truth < 1.0 - 1e-4 * truth.max()
    np.testing.assert_allclose(within[near], truth[near], atol=1e-4 * truth.max())
    assert np.isinf(within[truth > 1.0 + 1e-4 * truth.max()]).all()
