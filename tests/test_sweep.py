"""Distance by sweeps over triangles in an order of their own, and the bounds that it is moved inside."""

import numpy as np
import pytest
from conftest import relative_error, zoo
from surfaces import COORDINATES, arcs, bumpy, moebius_strip, on_pages
from test_exact import FLAT

from heat_igl import GeodesicSolver, Mesh, OffsetSources, SurfacePoints, shapes
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.kernels.sweep import sweeping
from heat_igl.operators import unfolding_surface
from heat_igl.reference import edge_paths
from heat_igl.sources import source_set
from heat_igl.sweep import SweepEngine
from heat_igl.sweep.sweep import numbered_spokes
from heat_igl.windows import MeshTriangles
from heat_igl.windows.exact import exact_distance
from heat_igl.windows.invariants import raise_to_lines


def swept(mesh: Mesh, sources: object) -> np.ndarray:
    """A sweep, also on meshes on which the plan takes windows."""
    return SweepEngine(MeshTriangles(mesh)).distance(source_set(sources, mesh.n_vertices, mesh.F))


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


def test_the_error_on_the_sphere_converges():
    errors = []
    for k in (3, 4, 5):
        mesh = shapes.icosphere(k)
        truth = arcs(mesh.V, 7)
        errors.append(relative_error(swept(mesh, 7), truth).mean())
        # A source that begins after the front has come changes nothing.
        np.testing.assert_array_equal(swept(mesh, OffsetSources([7, 20], [0, 1.01 * truth[20]])), swept(mesh, 7))
    assert errors[2] < 4e-4
    assert np.log2(errors[0] / errors[2]) / 2 > 1


def test_faces_turned_over_have_the_same_spokes():
    """No orientation suits all faces of a Moebius strip, and none is needed."""
    mesh = moebius_strip(24, 4)

    def triangles(F):
        """At each vertex v the side ab of each, a < b, and where v and the corner beyond are over it from a on."""
        number, (first, spoke, _, _) = numbered_spokes(intrinsic_triangulation(Mesh(mesh.V, F)))
        spoke, row = spoke[: first[-1]], np.repeat(np.arange(len(number)), np.diff(first))
        spoke, row = spoke[~np.isnan(spoke["height"])], row[~np.isnan(spoke["height"])]
        vertex, beyond = np.append(np.argsort(number), -1), spoke["beyond"]
        a, b = vertex[spoke["neighbour"]], vertex[spoke["next_neighbour"]]
        along, beyond_along = spoke["along"], np.where(beyond < 0, spoke["base"] / 2, spoke["beyond_along"])
        places = [np.where(a < b, x, spoke["base"] - x) for x in (along, beyond_along)]
        columns = vertex[row], np.minimum(a, b), np.maximum(a, b), vertex[beyond], spoke["height"], *places
        return np.stack(columns, axis=1)[np.lexsort(columns[:3])]

    F = mesh.F.copy()
    F[::3] = F[::3, [0, 2, 1]]
    np.testing.assert_allclose(triangles(F), triangles(mesh.F), atol=1e-12)


@pytest.mark.parametrize("k", [1, 2, 5])
def test_straight_over_an_edge_of_more_than_two_faces(k):
    """Any two of five pages are a plane folded on the line: the path between them is straight when rolled out."""
    mesh = shapes.book(5, k)
    source = mesh.n_vertices - 1
    # Beyond the first row of a page, straight paths are found where both ends of an edge on the line see the source.
    own_page = np.arange(mesh.n_vertices) >= (k + 1) + 4 * k * (k + 1)
    first_row = own_page | (np.hypot(mesh.V[:, 0], mesh.V[:, 1]) < 1.5 / k)
    truth = on_pages(mesh.V, source)
    np.testing.assert_allclose(swept(mesh, source)[first_row], truth[first_row], rtol=1e-9)


def test_a_sweep_visits_few_vertices_again(monkeypatch):
    visits = []
    sweep = sweeping.sweep
    monkeypatch.setattr(sweeping, "sweep", lambda *arguments: visits.append(sweep(*arguments)))
    swept(bumpy(4), 0)
    swept(shapes.torus(60, 40), [0, 1000])
    assert len(visits) == 2
    assert max(visits) < 2


def test_the_plan_takes_windows_where_these_cost_little():
    small = GeodesicSolver(shapes.icosphere(2), method="sweep")
    assert (small.plan.engine, small.plan.tolerance) == ("windows", 0)
    assert GeodesicSolver(bumpy(4), method="sweep").plan.engine in ("sweep", "windows")
    fine = GeodesicSolver(shapes.icosphere(4), method="sweep")
    assert fine.plan.engine == "sweep"
    np.testing.assert_array_equal(fine.distance(9), swept(shapes.icosphere(4), 9))


ROUGH = ["noise 10 times", "beams", "voxel ball", "plate", "cube less one", "noisy sphere"]
TORUS = shapes.torus(48, 30)


def test_surfaces_with_holes_are_told_from_disks_and_spheres():
    for mesh in (zoo("sponge"), TORUS):
        assert SweepEngine(MeshTriangles(mesh)).measures.has_holes
    for mesh in (shapes.grid(5), shapes.icosphere(2), zoo("two spheres 1 to 10")):
        assert not SweepEngine(MeshTriangles(mesh)).measures.has_holes


@pytest.mark.parametrize("name", ROUGH)
def test_small_and_rough_meshes_are_exact(name):
    mesh = zoo(name)
    solver = GeodesicSolver(mesh, method="sweep")
    for source in (0, mesh.n_vertices // 2):
        exact = exact_distance(mesh.V, mesh.F, source)
        np.testing.assert_allclose(solver.distance(source), exact, rtol=0, atol=1e-10 * exact.max())


@pytest.mark.parametrize("count", [4, 300])
def test_a_sweep_from_vertices_is_no_sweep_from_the_edges_between_them(count):
    mesh = shapes.grid(40)
    sources = np.random.default_rng(3).choice(mesh.n_vertices, count, replace=False)
    if count == 4:
        sources = np.array([820, 821, 861, 862])  # the corners of a cell
    truth = np.linalg.norm(mesh.V[:, None] - mesh.V[sources], axis=2).min(axis=1)
    d = GeodesicSolver(mesh, method="sweep").distance(sources)
    assert np.abs(d - truth)[truth > 0].mean() < 0.002 * truth.mean()
    assert np.abs(d - truth).max() < 0.05 * truth.max()


def test_what_leaves_the_bounds_is_brought_back():
    mesh = TORUS
    surface = unfolding_surface(mesh)
    sources = source_set(5, mesh.n_vertices, mesh.F)
    along_edges = edge_paths(mesh, 5)
    straight = np.linalg.norm(mesh.V - mesh.V[5], axis=1)
    d = 2 * along_edges
    surface.paths.shorten(d)
    assert (d <= along_edges * (1 + 1e-9)).all()
    d = straight / 2
    raise_to_lines(d, surface.V, mesh.F, sources)
    np.testing.assert_allclose(d, straight, rtol=1e-9)
