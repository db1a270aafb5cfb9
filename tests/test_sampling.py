"""Farthest points, Voronoi cells and their dual, centres, diameters, matrices: against closed forms and definitions."""

import numpy as np
import pytest
from scipy.spatial import Delaunay
from surfaces import twice

import heat_igl
from heat_igl import sampling, shapes
from heat_igl.mesh import Mesh


@pytest.fixture(scope="module")
def square():
    """A flat square, where the sweep is exact."""
    mesh = shapes.grid(20)
    return mesh, heat_igl.GeodesicSolver(mesh, method="sweep")


def two_spheres() -> Mesh:
    """Two spheres and a vertex that no face uses."""
    both = twice(shapes.icosphere(2))
    return Mesh(np.vstack([both.V, np.ones((1, 3))]), both.F)


def test_every_point_is_the_farthest_from_those_before(square):
    mesh, solver = square
    points = heat_igl.farthest_points(solver, 40, start=37)
    assert points[0] == 37
    for j in range(1, 40):
        to_earlier = np.linalg.norm(mesh.V[:, None] - mesh.V[points[:j]], axis=2).min(axis=1)
        assert to_earlier[points[j]] == pytest.approx(to_earlier.max(), rel=1e-9)


def test_points_are_distinct_where_distances_are_zero():
    """As between vertices in one place: a solver that says 0 everywhere."""

    class Nowhere:
        n_vertices = 5
        referenced = np.ones(5, bool)

        def distance(self, _source, cutoff):  # noqa: ARG002
            return np.zeros(5)

    assert sorted(heat_igl.farthest_points(Nowhere(), 5, start=2).tolist()) == [0, 1, 2, 3, 4]


def test_every_component_gets_a_point_first_and_loose_vertices_none():
    mesh = two_spheres()
    solver = heat_igl.HeatMethodSolver(mesh)
    points = heat_igl.farthest_points(solver, mesh.n_vertices - 1)
    assert mesh.components[points[0]] != mesh.components[points[1]]
    assert mesh.n_vertices - 1 not in points
    loose = Mesh(np.vstack([np.ones((1, 3)), mesh.V]), mesh.F + 1)
    assert np.array_equal(heat_igl.farthest_points(loose, 9), heat_igl.farthest_points(mesh, 9) + 1)


def test_several_starting_points_come_first(square):
    _, solver = square
    points = heat_igl.farthest_points(solver, 4, start=[20, 0])
    assert points[:2].tolist() == [0, 20]


def test_cells_come_with_the_sampling():
    mesh = two_spheres()
    solver = heat_igl.HeatMethodSolver(mesh)
    cells = heat_igl.farthest_cells(solver, 30)
    again = heat_igl.voronoi_cells(solver, cells.sites)
    assert np.array_equal(cells.sites, heat_igl.farthest_points(solver, 30))
    assert (cells.labels == again.labels).mean() > 0.99  # blocks of right-hand sides round differently
    np.testing.assert_allclose(cells.distance, again.distance, rtol=1e-9)
    assert cells.labels[-1] == -1
    assert cells.distance[-1] == np.inf
    assert np.array_equal(cells.labels[cells.sites], np.arange(30))


def test_cells_of_single_searches_are_those_of_all_sites_together(bunny):
    """Each search ends where earlier sites are nearer; on the bunny two threads share it."""
    for mesh in (bunny, two_spheres()):
        cells = heat_igl.farthest_cells(mesh, 40)
        each = heat_igl.GeodesicSolver(mesh).distances(cells.sites[:, None])
        np.testing.assert_allclose(cells.distance, each.min(axis=0), rtol=1e-12)
        np.testing.assert_allclose(cells.distance, each[cells.labels, np.arange(mesh.n_vertices)], rtol=1e-12)


@pytest.mark.parametrize(
    ("mesh", "k"), [(shapes.icosphere(4), 60), (shapes.torus(40, 100), 150), (shapes.cylinder(60, 60), 120)]
)
def test_dual_has_the_topology_of_the_mesh(mesh, k):
    cells = heat_igl.farthest_cells(heat_igl.HeatMethodSolver(mesh), k)
    dual = sampling.dual_triangulation(mesh, cells)
    report, original = dual.report(), mesh.report()
    assert dual.n_vertices == k
    assert report.euler_characteristic == original.euler_characteristic
    assert report.n_boundary_loops == original.n_boundary_loops
    assert not len(report.nonmanifold_edges)
    assert not len(report.nonmanifold_vertices)


def test_dual_is_oriented_like_the_mesh():
    mesh = shapes.icosphere(4)
    cells = heat_igl.farthest_cells(heat_igl.HeatMethodSolver(mesh), 60)
    a, b, c = np.moveaxis(sampling.dual_triangulation(mesh, cells).V[sampling.dual_triangulation(mesh, cells).F], 1, 0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()


def test_dual_in_the_plane_is_the_delaunay_triangulation():
    """Cells known exactly; but for slivers along the hull, whose circumcentre, where cells would meet, lies outside."""
    mesh = shapes.grid(150)
    sites = np.random.default_rng(11).choice(mesh.n_vertices, 12, replace=False)
    euclidean = np.linalg.norm(mesh.V[:, None] - mesh.V[sites], axis=2)
    cells = sampling.VoronoiCells(sites, euclidean.argmin(axis=1), euclidean.min(axis=1))
    faces = np.sort(Delaunay(mesh.V[sites, :2]).simplices, axis=1)
    corner = mesh.V[sites][faces][..., :2]
    squares = (corner**2).sum(axis=2)
    centre = np.linalg.solve(2 * (corner[:, 1:] - corner[:, :1]), (squares[:, 1:] - squares[:, :1])[..., None])
    centre = centre[..., 0]
    # Two triangles whose cells meet closer than the mesh resolves could be cut along the other diagonal.
    apart = np.linalg.norm(centre[:, None] - centre, axis=2) + np.eye(len(faces))
    assert apart.min() > 3 / 150
    inside = ((centre > 0) & (centre < 1)).all(axis=1)
    found = sampling.dual_triangulation(mesh, cells).F
    assert {tuple(sorted(face)) for face in found.tolist()} == {tuple(face) for face in faces[inside].tolist()}


def test_islands_and_zigzag_borders_leave_the_dual_alone():
    mesh = shapes.icosphere(4)
    cells = heat_igl.farthest_cells(heat_igl.HeatMethodSolver(mesh), 40)
    dual = sampling.dual_triangulation(mesh, cells)
    labels = cells.labels.copy()
    # Inside a cell: next to a border, a vertex of another label may join two cells that are apart.
    at_border = mesh.edges[np.diff(labels[mesh.edges], axis=1)[:, 0] != 0]
    alone = np.setdiff1d(np.arange(mesh.n_vertices), np.concatenate([cells.sites, at_border.ravel()]))[5::200]
    assert len(alone) > 5
    labels[alone] = (labels[alone] + 17) % 40
    noisy = sampling.dual_triangulation(mesh, sampling.VoronoiCells(cells.sites, labels, cells.distance))
    assert {tuple(face) for face in noisy.F.tolist()} == {tuple(face) for face in dual.F.tolist()}


def every_vertex_a_site(mesh: Mesh) -> sampling.VoronoiCells:
    """Cells whose dual is the mesh itself."""
    every = np.arange(mesh.n_vertices)
    return sampling.VoronoiCells(every, every, np.zeros(mesh.n_vertices))


def test_dual_must_be_a_manifold_with_every_site():
    sphere = shapes.icosphere(1)
    dual = sampling.dual_triangulation(sphere, every_vertex_a_site(sphere))
    assert {tuple(sorted(face)) for face in dual.F.tolist()} == {tuple(sorted(face)) for face in sphere.F.tolist()}
    bow_tie = Mesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 0, 0], [-1, -1, 0]], [[0, 1, 2], [0, 3, 4]])
    for mesh, said in (
        (Mesh([*sphere.V, *np.ones((2, 3))], sphere.F), r"cell 42 has no triangle \(2 of 44 cells have none\)"),
        (shapes.book(3, 2), r"between cells 0 and 1 has more than two triangles \(2 edges have\)"),
        (bow_tie, r"the triangles at cell 0 are not one fan \(1 cells"),
    ):
        with pytest.raises(heat_igl.MeshError, match=said):
            sampling.dual_triangulation(mesh, every_vertex_a_site(mesh))


def test_diameter_of_a_square_and_a_sphere(square):
    distance, first, second = heat_igl.diameter(square[1], start=130)
    assert heat_igl.diameter(heat_igl.Mesh([[9, 9, 9], *square[0].V], square[0].F + 1))[0] == pytest.approx(2**0.5)
    assert distance == pytest.approx(np.sqrt(2))
    assert np.linalg.norm(square[0].V[first] - square[0].V[second]) == pytest.approx(np.sqrt(2))
    sphere = shapes.icosphere(4)
    distance, first, second = heat_igl.diameter(heat_igl.GeodesicSolver(sphere, method="exact"))
    assert distance == pytest.approx(np.pi, rel=5e-3)


def test_diameter_stays_in_the_component_of_the_start():
    mesh = two_spheres()
    solver = heat_igl.HeatMethodSolver(mesh)
    for start in (0, 200):
        _, first, second = heat_igl.diameter(solver, start=start)
        assert mesh.components[first] == mesh.components[second] == mesh.components[start]
    assert heat_igl.diameter(solver, start=mesh.n_vertices - 1)[0] == 0.0


def test_distance_matrix_is_symmetric_and_the_mean_of_both_ways():
    mesh = two_spheres()
    solver = heat_igl.HeatMethodSolver(mesh)
    matrix = heat_igl.distance_matrix(solver)
    assert matrix.shape == (mesh.n_vertices, mesh.n_vertices)
    assert np.array_equal(matrix, matrix.T)
    assert not np.diag(matrix).any()
    assert np.isinf(matrix[0, 200])
    assert matrix[3, 90] == pytest.approx((solver.distance(3)[90] + solver.distance(90)[3]) / 2, rel=1e-9)
