"""Distance by sweeps over triangles, in the order of their own front: exact on flat domains, near it on others."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed, pygeodesic_distance, relative_error
from surfaces import COORDINATES, moebius_strip, random_disk, sheared, with_point

from heat_igl import GeodesicSolver, Mesh, OffsetSources, SurfacePoints, shapes
from heat_igl.kernels.sweep import sweeping
from heat_igl.sources import source_set
from heat_igl.unfolding import MeshTriangles, SweepEngine

FLAT = {
    "grid": lambda: shapes.grid(12),
    "sheared grid": lambda: sheared(shapes.grid(12), 2.3),
    "sheared disk": lambda: sheared(random_disk(500, 3), 3.3),
}


def swept(mesh: Mesh, sources: object) -> np.ndarray:
    """A sweep, also on meshes on which the plan takes windows."""
    return SweepEngine(MeshTriangles(mesh)).distance(source_set(sources, mesh.n_vertices, mesh.F))


@pytest.fixture(scope="module")
def bumpy() -> Mesh:
    return perturbed(shapes.icosphere(4), 0.3, 1)


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("where", COORDINATES)
def test_points_on_flat_convex_domains_are_exact(name, where):
    mesh = FLAT[name]()
    for face in np.random.default_rng(0).integers(mesh.n_faces, size=3):
        point = SurfacePoints([face], [COORDINATES[where]])
        truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
        for offset in (0.0, 2.0):
            d = swept(mesh, OffsetSources(point, [offset]))
            np.testing.assert_allclose(d, truth + offset, rtol=1e-9, atol=1e-11)


def test_a_point_is_as_good_as_a_vertex_in_its_place():
    """On a curved surface, and on one that cannot be oriented."""
    for mesh in (perturbed(shapes.icosphere(3), 0.3, 1), moebius_strip(40, 5)):
        for face in (3, 77, 300):
            barycentric = np.array([0.2, 0.5, 0.3])
            truth = pygeodesic_distance(with_point(mesh, face, barycentric), mesh.n_vertices)[:-1]
            assert relative_error(swept(mesh, SurfacePoints([face], [barycentric])), truth).mean() < 2e-2


def test_the_error_on_the_sphere_converges():
    errors = []
    for k in (3, 4, 5):
        mesh = shapes.icosphere(k)
        truth = np.arccos(np.clip(mesh.V @ mesh.V[7], -1, 1))
        errors.append(relative_error(swept(mesh, 7), truth).mean())
    assert errors[2] < 4e-4
    assert np.log2(errors[0] / errors[2]) / 2 > 1


def test_faces_turned_over_change_less_than_the_error(bumpy):
    """They change the order inside a band."""
    F = bumpy.F.copy()
    F[::3] = F[::3, [0, 2, 1]]
    np.testing.assert_allclose(swept(Mesh(bumpy.V, F), 5), swept(bumpy, 5), rtol=3e-3)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_straight_over_an_edge_of_more_than_two_faces(k):
    """Any two of five pages are a plane folded on the line: the path between them is straight when rolled out."""
    mesh = shapes.book(5, k)
    source = mesh.n_vertices - 1
    page = (np.arange(mesh.n_vertices) - (k + 1)) // (k * (k + 1))
    from_line, height = np.hypot(mesh.V[:, 0], mesh.V[:, 1]), mesh.V[:, 2] - mesh.V[source, 2]
    same = (page == 4) | (from_line < 1e-9)
    truth = np.hypot(np.where(same, from_line - 1, from_line + 1), height)
    # Beyond the first row of a page, straight paths are found where both ends of an edge on the line see the source.
    first_row = same | (from_line < 1.5 / k)
    np.testing.assert_allclose(swept(mesh, source)[first_row], truth[first_row], rtol=1e-9)


def test_a_front_visits_few_vertices_again(bumpy, monkeypatch):
    visits = []
    sweep = sweeping.sweep
    monkeypatch.setattr(sweeping, "sweep", lambda *arguments: visits.append(sweep(*arguments)))
    swept(bumpy, 0)
    swept(shapes.torus(60, 40), [0, 1000])
    assert len(visits) == 2
    assert max(visits) < 2


def test_the_plan_takes_windows_where_these_cost_little(bumpy):
    small = GeodesicSolver(shapes.icosphere(2), method="sweep")
    assert (small.plan.engine, small.plan.tolerance) == ("windows", 0)
    assert GeodesicSolver(bumpy, method="sweep").plan.engine in ("sweep", "windows")
    fine = GeodesicSolver(shapes.icosphere(4), method="sweep")
    assert fine.plan.engine == "sweep"
    np.testing.assert_array_equal(fine.distance(9), swept(shapes.icosphere(4), 9))
