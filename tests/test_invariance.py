"""What must not matter: the order of vertices and faces, where the mesh lies, how it is turned, its unit of length."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from heat_igl import HeatMethodSolver, Mesh, shapes

seeds = st.integers(0, 2**32 - 1)


def irregular(kind: str) -> Mesh:
    """Meshes in general position (no four corners on a circle), squashed so that edges are flipped."""
    start = {
        "closed": shapes.icosphere(3),
        "boundary": shapes.disk(10),
        "handle": shapes.torus(16, 40),
        "tetrahedra": shapes.box(4),
    }[kind]
    mesh = perturbed(start, 0.25)
    return mesh if kind == "tetrahedra" else Mesh(mesh.V * [1.0, 0.7, 0.4], mesh.F)


KINDS = ("closed", "boundary", "handle", "tetrahedra")
MESHES = {kind: irregular(kind) for kind in KINDS}
DISTANCES = {kind: HeatMethodSolver(mesh).distance(3) for kind, mesh in MESHES.items()}


def assert_same(found: np.ndarray, kind: str, scale: float = 1.0) -> None:
    expected = DISTANCES[kind] * scale
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * expected.max())


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=15, derandomize=True)
@given(seed=seeds)
def test_distance_does_not_depend_on_the_order_of_vertices_and_faces(kind, seed):
    mesh = MESHES[kind]
    rng = np.random.default_rng(seed)
    order = rng.permutation(mesh.n_vertices)
    label = np.argsort(order)
    F = label[rng.permutation(mesh.F)]
    F = np.stack([np.roll(row, shift) for row, shift in zip(F, rng.integers(0, 4, len(F)), strict=True)])
    turned = rng.random(len(F)) < 0.3
    F[turned] = F[turned][:, ::-1]
    found = HeatMethodSolver(Mesh(mesh.V[order], F)).distance(label[3])
    assert_same(found[label], kind)


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=10, derandomize=True)
@given(seed=seeds)
def test_distance_does_not_change_by_rotation(kind, seed):
    mesh = MESHES[kind]
    turned = Mesh(mesh.V @ Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T, mesh.F)
    assert_same(HeatMethodSolver(turned).distance(3), kind)


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=10, derandomize=True)
@given(seed=seeds)
def test_translation_by_a_million(kind, seed):
    mesh = MESHES[kind]
    direction = np.random.default_rng(seed).standard_normal(3)
    moved = Mesh(mesh.V + 1e6 * direction / np.linalg.norm(direction), mesh.F)
    assert_same(HeatMethodSolver(moved).distance(3), kind)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scale", [1e-8, 1e-3, 1e8, 1e-30, 1e30])
def test_distance_scales_with_the_mesh(kind, scale):
    mesh = MESHES[kind]
    assert_same(HeatMethodSolver(Mesh(mesh.V * scale, mesh.F)).distance(3), kind, scale)


@pytest.mark.parametrize("boundary", ["dirichlet", "average"])
def test_scale_with_other_boundaries(boundary):
    mesh = MESHES["boundary"]
    expected = HeatMethodSolver(mesh, boundary=boundary).distance(3)
    found = HeatMethodSolver(Mesh(mesh.V * 1e8, mesh.F), boundary=boundary).distance(3)
    np.testing.assert_allclose(found, expected * 1e8, rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_isometric_copies_in_one_mesh(kind):
    """A second component changes nothing on the first."""
    mesh = MESHES[kind]
    both = Mesh(np.vstack([mesh.V, mesh.V + 10]), np.vstack([mesh.F, mesh.F + mesh.n_vertices]))
    found = HeatMethodSolver(both).distance([3, 3 + mesh.n_vertices])
    assert_same(found[: mesh.n_vertices], kind)
    assert_same(found[mesh.n_vertices :], kind)
