"""Tangent frames: axes, polar angles, conversions, and the holonomy of transport."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed

import heat_igl
from heat_igl import Mesh, shapes, tangent_frames
from heat_igl.intrinsic import (
    carried_angles,
    intrinsic_delaunay,
    intrinsic_triangulation,
    polar_angles,
    transport_angles,
)


def off_multiples(angles: np.ndarray, period: float = 2 * np.pi) -> np.ndarray:
    """How far angles are from the nearest multiple of the period."""
    return np.abs(angles - period * np.round(angles / period))


@pytest.mark.parametrize("mesh", [shapes.icosphere(2), shapes.torus(12, 20), shapes.grid(4), shapes.cone(7, 3)])
def test_frames_are_orthonormal_and_right_handed(mesh):
    frames = tangent_frames(mesh)
    axes = np.stack([frames.x, frames.y, frames.normal], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-14)
    assert np.linalg.det(axes).min() > 0.99


def test_normals_of_a_sphere_point_outwards(sphere):
    frames = tangent_frames(shapes.icosphere(3))
    np.testing.assert_allclose(frames.normal, shapes.icosphere(3).V, atol=6e-3)
    assert (np.einsum("vx,vx->v", tangent_frames(sphere).normal, sphere.V) > 0.9).all()


@pytest.mark.parametrize("mesh", [shapes.grid(5), perturbed(shapes.icosphere(2)), shapes.cylinder(9, 4)])
def test_angles_sum_to_two_pi_and_to_pi_on_the_boundary(mesh):
    angles = tangent_frames(mesh).angles
    np.testing.assert_array_equal(angles.on_boundary, mesh.boundary)
    scaled = np.bincount(mesh.F.ravel(), (angles.scale[mesh.F] * angles.corners).ravel())
    np.testing.assert_allclose(scaled, np.where(mesh.boundary, np.pi, 2 * np.pi))
    # Every vertex has a reference edge, and on the boundary it is the first.
    smallest = np.full(mesh.n_vertices, np.inf)
    np.minimum.at(smallest, mesh.F[:, [1, 2, 0]].ravel(), angles.leaving)
    np.testing.assert_array_equal(smallest, 0)


def test_flat_frames_are_those_of_the_plane():
    mesh = shapes.grid(5)
    frames = tangent_frames(mesh)
    np.testing.assert_allclose(frames.normal, np.broadcast_to([0, 0, 1], (36, 3)), atol=1e-15)
    # The polar angle of an edge inside is its angle in the plane, up to that of x.
    along = mesh.V[np.roll(mesh.F, -1, axis=1)] - mesh.V[mesh.F]
    leaving = frames.angles.leaving.reshape(-1, 3)[:, [2, 0, 1]]
    inside = ~mesh.boundary[mesh.F]
    expected = np.arctan2(along[..., 1], along[..., 0]) - np.arctan2(frames.x[:, 1], frames.x[:, 0])[mesh.F]
    assert off_multiples(leaving - expected)[inside].max() < 1e-13


def test_conversions_are_inverse_to_each_other(sphere):
    frames = tangent_frames(sphere)
    vectors = np.random.default_rng(0).standard_normal((sphere.n_vertices, 2))
    np.testing.assert_allclose(frames.from_world(frames.to_world(vectors)), vectors, atol=1e-13)
    faces, corners, in_faces = frames.to_faces(np.arange(sphere.n_vertices), vectors)
    np.testing.assert_array_equal(sphere.F[faces, corners], np.arange(sphere.n_vertices))
    np.testing.assert_allclose(np.linalg.norm(in_faces, axis=1), np.linalg.norm(vectors, axis=1))
    np.testing.assert_allclose(frames.from_faces(faces, corners, in_faces), vectors, atol=1e-12)
    angles = frames.to_angles(vectors)
    assert angles.min() >= 0
    assert angles.max() < 2 * np.pi
    np.testing.assert_allclose(frames.from_angles(angles, np.hypot(*vectors.T)), vectors, atol=1e-13)


def test_a_vector_along_an_edge_has_its_angle_from_both_faces(sphere):
    frames = tangent_frames(sphere)
    F, V = sphere.F, sphere.V
    faces = np.arange(len(F))
    for c in range(3):
        next_corner, previous = (c + 1) % 3, (c + 2) % 3
        towards = frames.to_angles(frames.from_faces(faces, np.full(len(F), c), V[F[:, next_corner]] - V[F[:, c]]))
        assert off_multiples(towards - frames.angles.leaving.reshape(-1, 3)[:, previous]).max() < 1e-12
        # The other side of the corner leaves from it in the neighbour.
        other = frames.to_angles(frames.from_faces(faces, np.full(len(F), c), V[F[:, previous]] - V[F[:, c]]))
        twin = frames.triangulation.twin.reshape(-1, 3)[:, next_corner]
        assert off_multiples(other - frames.angles.leaving[twin]).max() < 1e-12


def test_flips_keep_the_directions_of_edges():
    mesh = perturbed(shapes.torus(12, 40), 0.6)
    faces = intrinsic_triangulation(mesh)
    flipped = intrinsic_delaunay(faces)
    assert flipped.n_flips > 10
    angles = carried_angles(polar_angles(faces), flipped)
    rho = transport_angles(flipped, angles)
    assert off_multiples(rho + rho[flipped.twin]).max() < 1e-12
    # Around a face, the angles of its corners follow one another.
    half_edge = np.arange(flipped.F.size).reshape(-1, 3)
    for c in range(3):
        vertex, out, back = flipped.F[:, c], half_edge[:, (c + 2) % 3], half_edge[:, (c + 1) % 3]
        wide = angles.leaving[flipped.twin[back]] - angles.leaving[out]
        assert off_multiples(wide - angles.scale[vertex] * angles.corners[:, c]).max() < 1e-11


@pytest.mark.parametrize(("mesh", "characteristic"), [(shapes.icosphere(2), 2), (shapes.torus(12, 30), 0)])
def test_transport_around_vertices_turns_by_the_curvature_enclosed(mesh, characteristic):
    triangulation = intrinsic_triangulation(mesh)
    angles = polar_angles(triangulation)
    rho = transport_angles(triangulation, angles).reshape(-1, 3)
    # A face has the curvature that its corners are scaled by; all together have 2 pi times Euler's characteristic.
    of_face = (angles.scale[mesh.F] * angles.corners).sum(axis=1) - np.pi
    assert of_face.sum() == pytest.approx(2 * np.pi * characteristic, abs=1e-10)
    for v in range(mesh.n_vertices):
        face, corner = np.nonzero(v == mesh.F)
        # The half-edges opposite v are a loop counterclockwise around it.
        turned = rho[face, corner].sum()
        assert off_multiples(np.array([turned - of_face[face].sum()])).max() < 1e-11


def test_flat_pieces_with_corners_have_no_holonomy():
    mesh = shapes.grid(3)
    triangulation = intrinsic_triangulation(mesh)
    rho = transport_angles(triangulation, polar_angles(triangulation))
    assert off_multiples(rho.reshape(-1, 3).sum(axis=1)).max() < 1e-12


def test_boundary_angles_for_transport_become_polar_angles():
    mesh = shapes.grid(2)
    frames = tangent_frames(mesh)
    corner, edge = 0, np.array([[1.0, 0, 0], [0, 1.0, 0], [1, 1, 0]])
    angle = frames.to_angles(frames.from_world(edge, np.full(3, corner)))
    np.testing.assert_allclose(frames.angles.to_polar(np.full(3, corner), angle), [0, np.pi, np.pi / 2], atol=1e-12)


def test_unused_vertices_have_the_axes_of_space():
    mesh = Mesh(np.vstack([shapes.grid(1).V, [[5, 5, 5]]]), shapes.grid(1).F)
    frames = tangent_frames(mesh)
    np.testing.assert_array_equal([frames.x[4], frames.y[4], frames.normal[4]], np.eye(3))


def moebius(n: int = 8) -> Mesh:
    angle = 2 * np.pi * np.arange(n) / n
    half = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1)
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    V = np.concatenate([middle - 0.3 * half, middle + 0.3 * half])
    k = np.arange(n - 1)
    F = np.concatenate([np.stack([k, k + 1, n + k], 1), np.stack([k + 1, n + k + 1, n + k], 1)])
    last = [[n - 1, n, 2 * n - 1], [n, 0, 2 * n - 1]]
    return Mesh(V, np.concatenate([F, last]))


def test_surfaces_without_tangent_planes_are_named():
    with pytest.raises(heat_igl.MeshError, match="is one of more than two faces"):
        tangent_frames(shapes.book(3, 2))
    with pytest.raises(heat_igl.MeshError, match="has faces that are oriented differently"):
        tangent_frames(moebius())
    with pytest.raises(heat_igl.MeshError, match="tetrahedral"):
        tangent_frames(shapes.box(1))
    two = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 1], [0, -1, 1]], [[0, 1, 2], [0, 3, 4]])
    with pytest.raises(heat_igl.MeshError, match="the faces at vertex 0 are not one fan"):
        tangent_frames(two)


def test_bad_vectors_are_named():
    frames = tangent_frames(shapes.grid(1))
    assert frames.to_world([1.0, 0], [0]).shape == (1, 3)
    with pytest.raises(ValueError, match=r"vectors must have shape \(4, 2\), but it has shape \(3, 2\)"):
        frames.to_world(np.ones((3, 2)))
    with pytest.raises(ValueError, match=r"vectors\[1\] = \[nan, 0.0\] is not finite"):
        frames.to_world([[0, 0], [np.nan, 0]], [0, 1])
    with pytest.raises(ValueError, match="vectors must hold real numbers"):
        frames.from_world(["a"], [0])
    with pytest.raises(heat_igl.MeshError, match=r"vertices\[0\] = 9 is out of range"):
        frames.to_world([[1, 0]], [9])
