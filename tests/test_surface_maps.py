"""Maps on a surface: parcel distances from full matrices, widths of smoothed deltas, errors of matches."""

import numpy as np
import pytest
from surfaces import arcs, bumpy, twice

import heat_igl
from heat_igl import Mesh, geodesic_errors, parcel_distances, shapes, smooth


def all_distances(mesh: Mesh) -> np.ndarray:
    return np.stack([heat_igl.geodesic_distance(mesh, v, method="exact") for v in range(mesh.n_vertices)])


@pytest.fixture(scope="module")
def cases():
    """A mesh, a region of it or None, and all distances in the region."""
    mesh = bumpy(2)
    region = mesh.V[:, 2] < 0.5
    of_faces = mesh.V[mesh.F].mean(axis=1)[:, 2] < 0.5
    found = [(mesh, None, all_distances(mesh))]
    for mask, faces in ((region, region[mesh.F].all(axis=1)), (of_faces, of_faces)):
        used, F = np.unique(mesh.F[faces], return_inverse=True)
        distance = np.full((mesh.n_vertices,) * 2, np.inf)
        distance[np.ix_(used, used)] = all_distances(Mesh(mesh.V[used], F.reshape(-1, 3)))
        found.append((mesh, mask, distance))
    return found


@pytest.mark.parametrize("case", range(3))
def test_parcel_distances_are_those_of_the_full_matrix(cases, case):
    mesh, region, distance = cases[case]
    # Five parcels of unequal size with gaps between their names, and a fifth of the vertices in none.
    share, n = [0.2, 0.1, 0.3, 0.2, 0.15, 0.05], mesh.n_vertices
    labels = np.random.default_rng(4).choice([-1, 0, 3, 4, 9, 20], n, p=share)
    inside = np.isfinite(distance).any(axis=1)
    parcels = [np.flatnonzero((labels == name) & inside) for name in (0, 3, 4, 9, 20)]
    blocks = [[distance[np.ix_(a, b)] for b in parcels] for a in parcels]
    centres = [a[blocks[i][i].sum(axis=1).argmin()] for i, a in enumerate(parcels)]
    expected = {
        "mean": [[block.mean() for block in row] for row in blocks],
        "min": [[block.min() for block in row] for row in blocks],
        "centre": distance[np.ix_(centres, centres)],
    }
    for statistic, values in expected.items():
        found = parcel_distances(mesh, labels, statistic=statistic, region=region)
        np.testing.assert_allclose(found, values, rtol=2e-5)
        assert (found == found.T).all()


def test_parcel_distances_by_another_method():
    mesh = shapes.icosphere(4)
    labels = np.digitize(mesh.V[:, 2], [-0.7, 0.7])
    parcels = [np.flatnonzero(labels == k) for k in range(3)]
    rows = heat_igl.GeodesicSolver(mesh, method="sweep").distances(parcels)
    expected = np.array([[row[parcel].min() for parcel in parcels] for row in rows])
    found = parcel_distances(mesh, labels, statistic="min", method="sweep")
    np.testing.assert_allclose(found, (expected + expected.T) / 2, rtol=1e-12)
    assert 1e-6 < abs(found - parcel_distances(mesh, labels, statistic="min")).max() < 1e-2


def test_parcels_on_other_components_are_infinitely_far():
    mesh = twice(shapes.grid(2), 2)
    for statistic in ("mean", "min", "centre"):
        found = parcel_distances(mesh, np.repeat([0, 1], 9), statistic=statistic)
        assert np.isinf(found[0, 1])
        assert np.isfinite(found.diagonal()).all()


def width(distance: np.ndarray, heat: np.ndarray) -> float:
    """Twice the distance at which heat is half of the largest: where a parabola of its logarithm says so."""
    near = heat > 0.25 * heat.max()
    b, a = np.polyfit(distance[near] ** 2, np.log(heat[near]), 1)
    return 2 * float(np.sqrt((np.log(heat.max() / 2) - a) / b))


@pytest.mark.parametrize("fwhm", [0.14, 0.3, 0.6])  # from four edges on
def test_width_of_a_smoothed_delta_on_a_sphere(fwhm):
    mesh = shapes.icosphere(5)
    delta = np.where(np.arange(mesh.n_vertices) == 77, 1.0, 0.0)
    angle = arcs(mesh.V, 77)
    assert width(angle, smooth(mesh, delta, fwhm)) == pytest.approx(fwhm, rel=0.015)


def test_smoothing_keeps_the_sum_and_is_linear():
    mesh = bumpy(2)
    operators = heat_igl.HeatMethodSolver(mesh, laplacian="intrinsic-delaunay").operators
    values = np.random.default_rng(1).normal(size=(2, mesh.n_vertices))
    mass = operators.M.diagonal()[: mesh.n_vertices]
    smoothed = smooth(mesh, values, 0.7)
    np.testing.assert_allclose(smoothed @ mass, values @ mass, atol=1e-12 * mass.sum())
    np.testing.assert_allclose(smooth(mesh, values[0] - 2 * values[1], 0.7), [1, -2] @ smoothed, atol=1e-12)
    np.testing.assert_allclose(smooth(mesh, np.ones(mesh.n_vertices), 0.7), 1, atol=1e-12)


def test_smoothing_levels_a_component_that_is_small_for_it():
    ball, values = shapes.icosphere(2), np.random.default_rng(0).normal(size=324)
    found = smooth(Mesh([*(1e-20 * ball.V), *(5 * ball.V)], [*ball.F, *(ball.F + 162)]), values, 2.0)
    np.testing.assert_allclose(found, [*smooth(ball, values[:162], 50.0), *smooth(ball, values[162:], 0.4)], atol=1e-9)


def test_smoothing_stays_in_its_region():
    mesh = shapes.grid(20)
    region = mesh.V[:, 0] < 0.45
    values = np.where(mesh.V[:, 0] > 0.45, 100.0, np.random.default_rng(0).normal(size=mesh.n_vertices))
    found = smooth(mesh, values, 0.4, region=region)
    assert (found[~region] == values[~region]).all()
    assert np.abs(found[region]).max() < np.abs(values[region]).max()


def test_errors_of_matches():
    mesh = bumpy(2)
    rng = np.random.default_rng(5)
    truth, matches = rng.integers(mesh.n_vertices, size=(2, 40))
    expected = all_distances(mesh)[truth, matches] / np.sqrt(mesh.measures.sum())
    np.testing.assert_allclose(geodesic_errors(mesh, matches, truth), expected, rtol=1e-12)
    # The same on a mesh in another unit.
    np.testing.assert_allclose(geodesic_errors(Mesh(1000 * mesh.V, mesh.F), matches, truth), expected, rtol=1e-12)
