"""Images of three dimensions: voxels as tetrahedra, and distance through them."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import HeatMethodSolver, Mesh, MeshError, PointCloud, PolygonMesh, image_domain, speed_operators


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


def test_distance_in_a_block_of_long_voxels():
    domain = image_domain(np.ones((6, 8, 10), bool), spacing=(2.5, 1.0, 0.7))
    chosen = np.zeros((6, 8, 10), bool)
    chosen[0, 3, 9] = True
    solver = HeatMethodSolver(domain.mesh)
    found = domain.image(solver.distance(domain.vertices(chosen)))
    apart = (np.indices(found.shape).T - [0, 3, 9]) * [2.5, 1.0, 0.7]
    np.testing.assert_allclose(found, np.linalg.norm(apart, axis=3).T, atol=1e-4)


def test_distance_around_a_wall():
    """A wall with one opening: the way bends at its rim."""
    mask = np.ones((1, 21, 21), bool)
    mask[0, 4:, 10] = False
    domain = image_domain(mask)
    found = domain.image(HeatMethodSolver(domain.mesh).distance(domain.index[0, 20, 0]))
    # Around the corners (3.5, 9.5) and (3.5, 10.5) of the wall.
    exact = np.hypot(16.5, 9.5) + 1 + np.hypot(16.5, 9.5)
    assert found[0, 20, 20] == pytest.approx(exact, rel=1e-9)
    assert np.isinf(found[0, 10, 10])


def test_speeds_of_voxels():
    mask = np.ones((3, 3, 12), bool)
    domain = image_domain(mask)
    speed = np.where(np.arange(12) < 6, 1.0, 4.0) * np.ones(mask.shape)
    operators = speed_operators(domain.mesh, domain.per_face(speed))
    found = domain.image(HeatMethodSolver.from_operators(operators).distance(domain.index[1, 1, 0]))
    np.testing.assert_allclose(found[1, 1, [5, 11]], [5, 5.5 + 5.5 / 4], rtol=1e-3)


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
    assert HeatMethodSolver(V, [[0, 1, 3], [1, 2, 3]], refine="exact").distance(0).tolist() == [0, 3, 5, 4]
    np.testing.assert_array_equal(mesh.with_vertices(2 * V).V, 2 * mesh.V)
    assert PolygonMesh(V, [[0, 1, 2, 3]]).V.shape == (4, 3)
    assert PointCloud(V).P.shape == (4, 3)
