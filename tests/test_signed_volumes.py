"""Signed distance in space from surfaces with holes: closed forms, libigl where the surface is closed, errors."""

import igl
import numpy as np
import pytest
from surfaces import box_surface, twice

from heat_igl import Mesh, MeshError, PointCloud, SourceError, VoxelBox, shapes, volume_signed_distance


def ball() -> Mesh:
    sphere = shapes.icosphere(3)
    return Mesh(0.3 * sphere.V + 0.5, sphere.F)


def brick() -> Mesh:
    mesh = box_surface(6, (0.6, 0.5, 0.4))
    return Mesh(mesh.V + np.array([0.2, 0.25, 0.3]), mesh.F)


def ring() -> Mesh:
    torus = shapes.torus(48, 24)
    return Mesh(0.25 * torus.V + 0.5, torus.F)


SURFACES = {"sphere": ball, "box": brick, "torus": ring}


def with_holes(mesh: Mesh) -> Mesh:
    """A fifth of the area away: patches around a few faces."""
    centre = mesh.V[mesh.F].mean(axis=1)
    kept = np.ones(mesh.n_faces, bool)
    rng = np.random.default_rng(1)
    while mesh.measures[kept].sum() > 0.8 * mesh.measures.sum():
        away = np.linalg.norm(centre - centre[rng.integers(mesh.n_faces)], axis=1)
        kept &= away > 0.07
    return Mesh(mesh.V, mesh.F[kept])


def winding_distance(points: np.ndarray, mesh: Mesh) -> np.ndarray:
    kind = igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    return np.asarray(igl.signed_distance(points, mesh.V, mesh.F, sign_type=kind)[0])


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("domain", ["grid", "tetrahedra"])
def test_closed_surfaces_and_surfaces_with_holes(name, domain):
    mesh = SURFACES[name]()
    if domain == "grid":
        box = VoxelBox([0, 0, 0], 1 / 32, [33, 33, 33])
        where, points, cell = box, box.positions().reshape(-1, 3), 1 / 32
    else:
        where = shapes.box(14)
        points, cell = where.V, 1 / 14
    truth = winding_distance(points, mesh)
    for surface, bound in ((mesh, 0.5), (with_holes(mesh), 1.0)):
        distance = volume_signed_distance(where, surface).ravel()
        near = np.abs(truth) < cell
        assert np.abs(distance - truth)[near].mean() < bound * cell
        # Around a convex edge normals of both sides are blended, and do not fan out: farther away that adds up.
        assert np.abs(distance - truth).mean() < cell
        far = np.abs(truth) > 2 * cell
        np.testing.assert_array_equal(distance[far] < 0, truth[far] < 0)


def test_points_with_normals():
    box = VoxelBox([0, 0, 0], 1 / 24, [25, 25, 25])
    normals = np.random.default_rng(0).normal(size=(400, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    distance = volume_signed_distance(box, PointCloud(0.5 + 0.3 * normals, normals))
    truth = np.linalg.norm(box.positions() - 0.5, axis=-1) - 0.3
    assert np.abs(distance - truth).mean() < 0.5 / 24


def test_large_grids_keep_directions_far_away():
    # 120 spacings away, heat of one time step is far below the rounding of the transforms.
    box = VoxelBox([0, 0, 0], 1.0, [130, 5, 5])
    wall = Mesh([[4.5, 0, 0], [4.5, 4, 0], [4.5, 4, 4], [4.5, 0, 4]], [[0, 1, 2], [0, 2, 3]])
    distance = volume_signed_distance(box, wall)
    np.testing.assert_allclose(distance, box.positions()[..., 0] - 4.5, atol=0.05)


def test_components_of_the_tetrahedra():
    one = shapes.box(8)
    both = twice(one, np.array([3, 0, 0]))
    distance = volume_signed_distance(both, ball())
    assert np.isfinite(distance[: one.n_vertices]).all()
    np.testing.assert_array_equal(distance[one.n_vertices :], np.inf)


def test_a_box_around_a_mesh():
    box = VoxelBox.around(ball(), 20, margin=0.25)
    low, high = box.positions()[0, 0, 0], box.positions()[-1, -1, -1]
    np.testing.assert_allclose(low, 0.05, atol=1e-3)
    assert (high >= ball().V.max(axis=0) + 0.14).all()
    assert max(box.shape) <= 21


def test_bad_input():
    box = VoxelBox([0, 0, 0], 0.1, [11, 11, 11])
    with pytest.raises(SourceError, match=r"the surface leaves the box at .* VoxelBox.around"):
        volume_signed_distance(box, shapes.icosphere(1))
    with pytest.raises(SourceError, match="the surface leaves the tetrahedra"):
        volume_signed_distance(shapes.box(4), Mesh(ball().V + 2, ball().F))
    with pytest.raises(MeshError, match="domain must be tetrahedra or a VoxelBox"):
        volume_signed_distance(ball(), ball())
    assert np.isfinite(volume_signed_distance(box, ball())).all()
