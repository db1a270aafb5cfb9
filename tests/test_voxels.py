"""Images of three dimensions: voxels as tetrahedra, and distance through them."""

from __future__ import annotations

import numpy as np
import pytest

import heat_igl
from heat_igl import (
    GeodesicSolver,
    HeatMethodSolver,
    Mesh,
    MeshError,
    PointCloud,
    PolygonMesh,
    image_domain,
    metric_operators,
    read_point_cloud,
    shapes,
    speed_operators,
)
from heat_igl.compat import igl as igl_names
from heat_igl.compat import potpourri3d as potpourri3d_names


def test_tetrahedra_fit_together_and_fill_the_voxels():
    rng = np.random.default_rng(0)
    mask = rng.random((4, 5, 6)) < 0.7
    domain = image_domain(mask, spacing=(3.0, 2.0, 0.5))
    mesh = domain.mesh
    assert mesh.n_faces == 12 * mask.sum()
    np.testing.assert_allclose(mesh.measures, 3.0 / 12)
    # A triangle that only one tetrahedron has lies on a side between a voxel of the mask and one outside.
    outer = mesh.facets.vertices[mesh.facets.n_faces == 1]
    assert mesh.facets.n_faces.max() == 2
    padded = np.pad(mask, 1).astype(int)
    assert len(outer) == 2 * sum(np.abs(np.diff(padded, axis=axis)).sum() for axis in range(3))
    centre = mesh.V[domain.index[mask]]
    np.testing.assert_allclose(centre, np.argwhere(mask)[:, ::-1] * [0.5, 2.0, 3.0])


def test_distance_around_a_wall():
    """A wall with one opening: the way bends at its rim."""
    mask = np.ones((1, 21, 21), bool)
    mask[0, 4:, 10] = False
    domain = image_domain(mask)
    found = domain.image(GeodesicSolver(domain.mesh).distance(domain.index[0, 20, 0]))
    # Around the corners (3.5, 9.5) and (3.5, 10.5) of the wall.
    exact = np.hypot(16.5, 9.5) + 1 + np.hypot(16.5, 9.5)
    assert found[0, 20, 20] == pytest.approx(exact, rel=1e-9)
    assert np.isinf(found[0, 10, 10])


def test_speeds_of_voxels():
    mask = np.ones((3, 3, 12), bool)
    domain = image_domain(mask)
    speed = np.where(np.arange(12) < 6, 1.0, 4.0) * np.ones(mask.shape)
    operators = speed_operators(domain.mesh, domain.per_face(speed))
    found = domain.image(GeodesicSolver(operators).distance(domain.index[1, 1, 0]))
    np.testing.assert_allclose(found[1, 1, [5, 11]], [5, 5.5 + 5.5 / 4], rtol=1e-2)


@pytest.mark.parametrize(
    ("mask", "spacing", "error", "message"),
    [
        (np.ones((2, 2, 2, 2), bool), 1.0, MeshError, r"mask must be a boolean image .* of shape \(2, 2, 2, 2\)"),
        (np.zeros((2, 2, 2), bool), 1.0, MeshError, "mask holds no pixel"),
        (np.ones((2, 2, 2), bool), (1.0, 2.0), ValueError, "spacing must be one or three positive numbers"),
    ],
)
def test_wrong_images_are_refused(mask, spacing, error, message):
    with pytest.raises(error, match=message):
        image_domain(mask, spacing)
    assert image_domain(np.ones((2, 2, 2), bool), (1.0, 2.0, 3.0)).mesh.is_tetrahedral


def test_planar_positions():
    V = np.array([[0, 0], [3, 0], [3, 4], [0, 4]])
    mesh = Mesh(V, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(mesh.V, np.append(V, np.zeros((4, 1)), axis=1))
    assert GeodesicSolver((V, [[0, 1, 3], [1, 2, 3]]), method="exact").distance(0).tolist() == [0, 3, 5, 4]
    np.testing.assert_array_equal(mesh.with_vertices(2 * V).V, 2 * mesh.V)
    assert PolygonMesh(V, [[0, 1, 2, 3]]).V.shape == (4, 3)
    assert PointCloud(V).P.shape == (4, 3)


def test_planar_points_of_files(tmp_path):
    P = np.random.default_rng(0).random((30, 2))
    np.save(tmp_path / "a.npy", P)
    np.savetxt(tmp_path / "a.xyz", P, fmt="%.17g")
    for name in ("a.npy", "a.xyz"):
        np.testing.assert_array_equal(read_point_cloud(tmp_path / name).P, PointCloud(P).P)
    np.save(tmp_path / "b.npy", np.ones((30, 4)))
    with pytest.raises(MeshError, match=r"or \(n, 2\) in the plane, but its shape is \(30, 4\)"):
        read_point_cloud(tmp_path / "b.npy")


# What each function that takes positions makes of two columns is what it makes of three with z = 0.
FLAT = shapes.disk(6)
TAKE_POSITIONS = {
    "HeatMethodSolver": lambda V: HeatMethodSolver(V, FLAT.F).distance(3),
    "geodesic_distance": lambda V: heat_igl.geodesic_distance((V, FLAT.F), 3),
    "closest_points": lambda V: heat_igl.closest_points(FLAT, V[:5] / 2).points.barycentric,
    "curve_on": lambda V: heat_igl.curve_on(FLAT, V[[0, 4, 9]]).start,
    "PointCloud": lambda V: HeatMethodSolver(PointCloud(V)).distance(3),
    "polygon_operators": lambda V: heat_igl.operators.polygon_operators(PolygonMesh(V, FLAT.F)).L.toarray(),
    "tangent_frames": lambda V: heat_igl.tangent_frames((V, FLAT.F)).x,
    "closed_forms.plane": lambda V: heat_igl.validation.closed_forms.plane((V, FLAT.F), 3),
    "with_vertices": lambda V: HeatMethodSolver(FLAT).with_vertices(2 * V).distance(3),
    "metric_operators": lambda V: metric_operators((V, FLAT.F), np.tile(np.eye(3), (FLAT.n_faces, 1, 1))).L.toarray(),
    "libigl": lambda V: igl_names.heat_geodesic(V, FLAT.F, 0.01, np.array([3])),
    "potpourri3d": lambda V: potpourri3d_names.PointCloudHeatSolver(V).compute_distance(3),
}


@pytest.mark.filterwarnings("ignore:heat gave distances up to 7.2 %")  # on so few points
@pytest.mark.parametrize("name", TAKE_POSITIONS)
def test_two_columns_are_a_plane(name):
    call = TAKE_POSITIONS[name]
    np.testing.assert_array_equal(call(FLAT.V[:, :2]), call(FLAT.V))
