"""Means and medians on surfaces, and geodesic Bezier curves, against closed forms."""

import numpy as np
import pytest
from conftest import flat_perturbed
from surfaces import folded_torus

import heat_igl
from heat_igl import Mesh, SurfacePoints, centroidal_voronoi, geodesic_distance, karcher_mean, shapes, voronoi_cells
from heat_igl.curves import geodesic_bezier
from heat_igl.validation.zoo import FAMILIES

CELLS = 12


def torus_vertex(cell: np.ndarray) -> np.ndarray:
    return cell[..., 0] % CELLS * CELLS + cell[..., 1] % CELLS


def torus_coordinates(mesh: Mesh, points: SurfacePoints) -> np.ndarray:
    """Of one point near the origin, in cells."""
    cell = np.stack(np.divmod(mesh.F[points.faces[0]], CELLS), axis=1)
    return points.barycentric[0] @ ((cell + CELLS // 2) % CELLS - CELLS // 2)


def sphere_mean(P: np.ndarray, weights: np.ndarray, p: float) -> np.ndarray:
    """The mean on the unit sphere, by the Karcher iteration with the log map of the sphere."""
    z = weights @ P / np.linalg.norm(weights @ P)
    for _ in range(2000):
        angle = np.arccos(np.clip(P @ z, -1, 1))
        log = (P - np.cos(angle)[:, None] * z) * (angle / np.sin(angle))[:, None]
        share = weights * angle ** (p - 2)
        step = share @ log / (share.sum() * max(p - 1, 1))
        size = np.linalg.norm(step)
        z = np.cos(size) * z + np.sinc(size / np.pi) * step
    return z


def test_means_on_the_flat_torus_are_those_of_the_plane():
    mesh = folded_torus(CELLS)
    rng = np.random.default_rng(0)
    for _ in range(6):
        cell = rng.integers(-2, 3, (5, 2))
        weights = rng.uniform(0, 2, 5)
        found = karcher_mean(mesh, torus_vertex(cell), weights)
        np.testing.assert_allclose(torus_coordinates(mesh, found), weights @ cell / weights.sum(), atol=1e-6)


def test_medians_on_the_flat_torus_are_those_of_the_plane():
    mesh = folded_torus(CELLS)
    # Where the diagonals of a convex quadrilateral meet.
    found = karcher_mean(mesh, torus_vertex(np.array([[-2, -1], [2, 2], [-1, 2], [2, -2]])), p=1)
    share = np.linalg.solve([[4, -3], [3, 4]], [1, 3])[0]
    np.testing.assert_allclose(torus_coordinates(mesh, found), [-2 + 4 * share, -1 + 3 * share], atol=1e-6)
    # A corner with an angle of 120 degrees or more, and a point that weighs as much as all others.
    cell = np.array([[0, 0], [2, -1], [-2, -1]])
    np.testing.assert_array_equal(torus_coordinates(mesh, karcher_mean(mesh, torus_vertex(cell), p=1)), [0, 0])
    heavy = karcher_mean(mesh, torus_vertex(cell), [1, 1, 2], p=1)
    np.testing.assert_array_equal(torus_coordinates(mesh, heavy), [-2, -1])


@pytest.mark.parametrize("p", [1, 1.5, 2, 4])
def test_means_on_spheres_approach_those_of_the_sphere(p):
    errors = []
    for level in (2, 4):
        mesh = shapes.icosphere(level)
        # Vertices of the coarser sphere are the first of the finer.
        cap = np.flatnonzero(mesh.V[:162] @ [0.36, 0.48, 0.8] > 0.4)
        chosen = np.random.default_rng(4).choice(cap, 6, replace=False)
        weights = np.random.default_rng(5).uniform(0.5, 1.5, 6)
        found = karcher_mean(mesh, chosen, weights, p=p).positions(mesh)[0]
        expected = sphere_mean(mesh.V[chosen], weights, p)
        errors.append(np.linalg.norm(found / np.linalg.norm(found) - expected))
    assert errors[1] < 4e-3
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize(
    ("kind", "seed", "ends"), [("tube of few sides", 700335, [33, 471]), ("helix", 700417, [0, 99])]
)
def test_means_divide_a_shortest_path_and_are_no_worse_than_a_vertex(kind, seed, ends):
    mesh = FAMILIES[kind](seed)
    parts = geodesic_distance(mesh, karcher_mean(mesh, ends, [1, 9], p=3), method="exact")[ends]
    np.testing.assert_allclose(parts, heat_igl.pair_distances(mesh, [ends]) * np.array([0.75, 0.25]), rtol=1e-9)
    points = [*ends, *np.random.default_rng(3).choice(mesh.n_vertices, 3)]
    rows = np.stack([geodesic_distance(mesh, int(v), method="exact") for v in points])
    found = geodesic_distance(mesh, karcher_mean(mesh, points), method="exact")[points]
    assert (found**2).sum() <= (1 + 1e-9) * (rows**2).sum(axis=0).min()


def test_a_median_at_a_point_is_no_worse_than_a_vertex():
    """The best of the points is better than all places beside it, but on the other side of the torus one is better."""
    mesh = shapes.torus(16, 10)
    points = np.random.default_rng(77).choice(mesh.n_vertices, 4, replace=False)
    least = heat_igl.GeodesicSolver(mesh).distances(points.tolist()).sum(axis=0).min()
    assert geodesic_distance(mesh, karcher_mean(mesh, points, p=1))[points].sum() <= (1 + 1e-9) * least
    # The tip of a triangle a thousand times as long as the others weighs more than the rest.
    mesh = Mesh([*shapes.grid(20).V, [1000, 0.5, 0]], [*shapes.grid(20).F, [230, 441, 251]])
    assert karcher_mean(mesh, [441, 0, 20], weights=[5, 1, 1], p=1).barycentric.tolist() == [[0, 1, 0]]


def test_single_points_are_their_means(sphere):
    point = SurfacePoints([7], [[0.2, 0.3, 0.5]])
    found = karcher_mean(sphere, point)
    np.testing.assert_array_equal(found.faces, [7])
    np.testing.assert_allclose(found.barycentric, [[0.2, 0.3, 0.5]])
    np.testing.assert_array_equal(karcher_mean(sphere, [5, 9, 30], [0, 1, 0]).positions(sphere)[0], sphere.V[9])
    grid = shapes.grid(8)
    for unit in (1e-6, 1e6):  # in these, powers of distances would vanish or overflow
        centre = karcher_mean(Mesh(unit * grid.V, grid.F), [0, 8, 72, 80], p=64)
        np.testing.assert_allclose(centre.positions(grid), [[0.5, 0.5, 0]], atol=1e-6)
    mixed = karcher_mean(sphere, [point, 40])
    assert geodesic_distance(sphere, mixed)[40] == pytest.approx(geodesic_distance(sphere, point)[40] / 2, rel=1e-6)


def test_bezier_curves_in_the_plane_are_polynomials():
    mesh = flat_perturbed(shapes.grid(8))
    control = SurfacePoints([3, 60, 100, 30], np.random.default_rng(0).dirichlet([1, 1, 1], 4))
    P = control.positions(mesh)
    curve = geodesic_bezier(mesh, control, 8)
    t = np.arange(9)[:, None] / 8
    expected = (1 - t) ** 3 * P[0] + 3 * t * (1 - t) ** 2 * P[1] + 3 * t**2 * (1 - t) * P[2] + t**3 * P[3]
    gap = np.linalg.norm(curve.positions(mesh)[:, None] - expected, axis=2).min(axis=0)
    np.testing.assert_allclose(gap, 0, atol=1e-9)
    np.testing.assert_allclose(curve.lengths(mesh).sum(), np.linalg.norm(np.diff(expected, axis=0), axis=1).sum())


def test_sites_become_centroidal():
    mesh = shapes.grid(21)
    found = centroidal_voronoi(mesh, [0, 1, 2, 23, 24, 46, 200, 300, 400])
    assert (np.diff(found.energies) < 0).all()
    assert len(np.unique(found.sites)) == 9
    cells = voronoi_cells(mesh, found.sites)
    # Of two equally near sites either may be named.
    rows = np.stack([geodesic_distance(mesh, int(site)) for site in found.sites])
    for labels in (found.labels, cells.labels):
        np.testing.assert_allclose(rows[labels, np.arange(mesh.n_vertices)], rows.min(axis=0), atol=1e-9)
    areas = np.bincount(mesh.F.ravel(), np.repeat(mesh.measures / 3, 3), mesh.n_vertices)
    assert found.energies[-1] == pytest.approx(areas @ cells.distance**2, rel=1e-3)
    # Hexagons are the best cells of a plane, and squares are better than what 9 cells of a square come to by chance.
    hexagons = 5 / (18 * np.sqrt(3)) / 9
    assert hexagons < found.energies[-1] < 1.4 * hexagons
    means = np.stack([areas[found.labels == i] @ mesh.V[found.labels == i] for i in range(9)])
    means /= np.bincount(found.labels, areas)[:, None]
    assert np.linalg.norm(means - mesh.V[found.sites], axis=1).max() < 1.5 / 21


def test_relaxation_stops_where_no_site_moves():
    mesh = shapes.icosphere(3)
    found = centroidal_voronoi(mesh, [0, 1, 2, 3, 4, 5])
    again = centroidal_voronoi(mesh, found.sites)
    np.testing.assert_array_equal(again.sites, found.sites)
    assert len(again.energies) == 1
    assert len(centroidal_voronoi(mesh, [0, 1, 2], rounds=0).energies) == 1
    for seed in range(8):  # on few vertices, the one nearest to the mean of a cell may have a higher energy
        sites = np.random.default_rng(seed).choice(81, 5, replace=False)
        assert (np.diff(centroidal_voronoi(shapes.grid(8), sites).energies) < 0).all()
