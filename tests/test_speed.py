"""Travel time with a speed on each face: identities, and closed forms in optics and conformal geometry."""

from typing import Any

import numpy as np
import pytest
from conftest import flat_perturbed, mean_error, perturbed, two_halves
from surfaces import graph_distance, nearest_vertex

import heat_igl
from heat_igl import metric_operators, shapes, speed_operators
from heat_igl.mesh import Mesh
from heat_igl.operators import operators
from heat_igl.typing import FloatArray
from heat_igl.validation.closed_forms import by_fermat


def solver(mesh: Mesh, speed: FloatArray, method: str | None = None, **options: Any) -> Any:
    domain = speed_operators(mesh, speed)
    if method != "heat" and not options:
        return heat_igl.GeodesicSolver(domain, method=method or "auto")
    return heat_igl.HeatMethodSolver(domain, **options)


@pytest.mark.parametrize("mesh", [perturbed(shapes.torus(12, 30)), perturbed(shapes.box(4))], ids=["torus", "box"])
def test_areas_and_gradients_with_a_speed(mesh):
    p = mesh.F.shape[1] - 1
    speed = np.random.default_rng(0).choice([0.5, 1, 3], mesh.n_faces)
    # On the mesh's own faces: those of one speed are flipped otherwise.
    domain = metric_operators(mesh, np.eye(3) / speed[:, None, None] ** 2, laplacian="cotan")
    assert domain.weights == pytest.approx(mesh.measures / speed**p)
    assert np.array_equal(domain.boundary, mesh.boundary)
    # |grad x|^2 sums to the dimension over the coordinates, times the square of the speed.
    gradient = (domain.G @ mesh.V).reshape(domain.dimension, mesh.n_faces, 3)
    np.testing.assert_allclose((gradient**2).sum(axis=(0, 2)), p * speed**2, rtol=1e-9)


def test_one_speed_flips_the_same_edges(cow):
    expected = operators(cow)
    found = speed_operators(cow, np.ones(cow.n_faces))
    assert expected.surface.triangulation.n_flips > 100
    assert abs(found.L - expected.L).max() < 1e-9 * abs(expected.L).max()
    np.testing.assert_allclose(found.M.diagonal(), expected.M.diagonal(), rtol=1e-9)


def test_edges_stay_where_the_speed_changes():
    """A kite with an edge that Delaunay would flip."""
    mesh = Mesh([[0, 0, 0], [4, 0, 0], [2, 0.5, 0], [2, -0.5, 0]], [[0, 1, 2], [1, 0, 3]])
    assert speed_operators(mesh, [1.0, 1.0]).L[0, 1] == 0
    domain = speed_operators(mesh, [1.0, 2.0])
    assert domain.L[0, 1] != 0
    assert domain.weights.tolist() == pytest.approx([1.0, 0.25])
    # Shortest sides in time: of the fast face 2 and hypot(2, .5) / 2 twice, of the slow one hypot(2, .5) twice.
    assert domain.mean_edge_length == pytest.approx((2 + 3 * np.hypot(2, 0.5)) / 5)


def test_stereographic_projection_of_a_hemisphere():
    """Speed (1 + r^2) / 2 on the unit disk makes it one: the time is an angle."""
    errors = []
    for n in (16, 32, 64):
        mesh = flat_perturbed(shapes.disk(n), 0.25)
        r2 = (mesh.V**2).sum(axis=1, keepdims=True)
        on_sphere = np.concatenate([2 * mesh.V, 1 - r2], axis=1) / (1 + r2)
        source = nearest_vertex(mesh, [0.5, 0, 0])
        exact = np.arccos(np.clip(on_sphere @ on_sphere[source], -1, 1))
        speed = (1 + (mesh.V[mesh.F].mean(axis=1) ** 2).sum(axis=1)) / 2
        by_heat, unfolded = (solver(mesh, speed, method=method).distance(source) for method in ("heat", "exact"))
        errors.append([np.abs(time - exact).mean() / exact.mean() for time in (by_heat, unfolded)])
    assert (np.array(errors[1:]) < np.multiply(0.65, errors[:-1])).all()
    assert (np.array(errors[2]) < [0.004, 0.0003]).all()


@pytest.mark.parametrize("speeds", [(1.0, 2.0), (2.0, 1.0), (1.0, 1e3), (1e3, 1.0), (1.0, 1e6), (1e6, 1.0)])
def test_refraction_at_a_straight_border(speeds):
    errors = []
    for n in (32, 64):
        mesh = two_halves(n)
        source = nearest_vertex(mesh, [0.2, 0.25, 0])
        speed = np.where(mesh.V[mesh.F][:, :, 0].mean(axis=1) < 0.5, *speeds)
        exact = by_fermat(mesh.V, source, *speeds)
        errors.append(mean_error(solver(mesh, speed).distance(source), exact))
    assert errors[1] < max(0.8 * errors[0], 5e-5)
    assert errors[1] < (1e-4 if speeds != (1.0, 2.0) else 5e-4)
    # From the border itself, straight lines in the slow half and the waves that the fast half sends there: they part at
    # the source, and what is wrong on the first ring of vertices stays, a hundredth of an edge.
    source = nearest_vertex(mesh, [0.5, 0.25, 0])
    off = np.abs(solver(mesh, speed).distance(source) - by_fermat(mesh.V, source, *speeds))
    assert off.mean() * min(speeds) < 0.01 / 64


def test_faces_without_area_at_a_jump():
    """A vertex on the straight side of a triangle, in a square of two speeds."""
    square = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0.5, 0]]
    mesh = Mesh(square, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [0, 6, 1]])
    speed = [1.0, 1.0, 10.0, 10.0, 1.0]
    assert np.isfinite(solver(mesh, speed, t_coef=1.0).distance(0)).all()
    # To (1, 1) along the border at x = 1, on its fast side.
    steep = 0.1 / np.sqrt(0.99)
    border = np.hypot(1, steep) + (1 - steep) / 10
    found = solver(mesh, speed).distance(0)[[0, 1, 2, 3, 4, 6]]
    np.testing.assert_allclose(found, [0, 1, 1.1, 1, border, 0.5], rtol=0.01)


@pytest.mark.filterwarnings("ignore:the metric changes farther")
def test_checkerboard_of_speeds():
    """Shortest paths in a graph with 20 points on every edge, at most 0.1 % above the fastest ways."""
    mesh = flat_perturbed(shapes.grid(12), 0.25)
    column, row, _ = np.floor(mesh.V[mesh.F].mean(axis=1) * 4).astype(int).T
    for contrast in (2.0, 1e6):
        speed = np.where((column + row) % 2, contrast, 1.0)
        exact = graph_distance(mesh, 80, 20, speed)[0]
        assert mean_error(solver(mesh, speed).distance(80), exact) < 0.025
