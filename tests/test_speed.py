"""Travel time with a speed on each face: identities, and closed forms in optics and conformal geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import flat_perturbed, mean_error, perturbed

import heat_igl
from heat_igl import metric_operators, shapes, speed_operators
from heat_igl.mesh import Mesh, connectivity
from heat_igl.operators import operators
from heat_igl.typing import FloatArray


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


@pytest.mark.parametrize("mesh", [shapes.icosphere(3), shapes.box(6)], ids=["sphere", "box"])
def test_one_speed_divides_all_distances(mesh):
    expected = heat_igl.GeodesicSolver(mesh).distance(5) / 2.5
    found = solver(mesh, np.full(mesh.n_faces, 2.5)).distance(5)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12)
    across = speed_operators(mesh, np.full(mesh.n_faces, 2.5)).longest_distance
    assert across == pytest.approx(mesh.longest_distance / 2.5)


def test_one_speed_flips_the_same_edges(cow):
    expected = operators(cow)
    found = speed_operators(cow, np.ones(cow.n_faces))
    assert expected.surface is not None
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
        source = int(np.argmin(np.linalg.norm(mesh.V - [0.5, 0, 0], axis=1)))
        exact = np.arccos(np.clip(on_sphere @ on_sphere[source], -1, 1))
        speed = (1 + (mesh.V[mesh.F].mean(axis=1) ** 2).sum(axis=1)) / 2
        by_heat, unfolded = (solver(mesh, speed, method=method).distance(source) for method in ("heat", "exact"))
        errors.append([np.abs(time - exact).mean() / exact.mean() for time in (by_heat, unfolded)])
    assert (np.array(errors[1]) < 0.65 * np.array(errors[0])).all()
    assert (np.array(errors[2]) < 0.65 * np.array(errors[1])).all()
    assert errors[2][0] < 0.004
    assert errors[2][1] < 0.0003


def test_hyperbolic_space_on_tetrahedra():
    """Speed (1 - r^2) / 2: Poincare's ball, in which a cube about the centre is convex."""
    errors = []
    for n in (6, 12, 24):
        mesh = perturbed(shapes.box(n))
        mesh = Mesh(mesh.V - 0.5, mesh.F)
        r2 = (mesh.V**2).sum(axis=1)
        source = int(np.argmin(np.linalg.norm(mesh.V - [0.3, 0, 0], axis=1)))
        apart = ((mesh.V - mesh.V[source]) ** 2).sum(axis=1)
        exact = np.arccosh(1 + 2 * apart / ((1 - r2) * (1 - r2[source])))
        speed = (1 - (mesh.V[mesh.F].mean(axis=1) ** 2).sum(axis=1)) / 2
        errors.append(np.abs(solver(mesh, speed).distance(source) - exact).mean() / exact.mean())
    assert errors[1] < 0.7 * errors[0]
    assert errors[2] < 0.7 * errors[1]
    assert errors[2] < 0.005


def by_fermat(source: FloatArray, points: FloatArray, above: float, below: float) -> FloatArray:
    """Time from a source above y = 0: straight, refracted where the way crosses, or along the faster side."""
    crossing = np.linspace(-0.5, 1.5, 4001)
    to_crossing = np.hypot(source[0] - crossing, source[1]) / above
    refracted = np.array([(to_crossing + np.hypot(x - crossing, y) / below).min() for x, y in points])
    straight = np.linalg.norm(points - source, axis=1) / above
    if below > above:
        critical = np.arcsin(above / below)  # Snell: along the border the refracted ray is at 90 degrees
        depth, along = source[1] + points[:, 1], np.abs(points[:, 0] - source[0])
        head = np.where(along >= depth * np.tan(critical), depth * np.cos(critical) / above + along / below, np.inf)
        straight = np.minimum(straight, head)
    return np.where(points[:, 1] < 0, refracted, straight)


@pytest.mark.parametrize("speeds", [(1.0, 2.0), (2.0, 1.0), (1.0, 1e3), (1e3, 1.0), (1.0, 1e6), (1e6, 1.0)])
def test_refraction_at_a_straight_border(speeds):
    errors = []
    for n in (16, 32, 64):
        square = shapes.grid(n)
        moved = flat_perturbed(square, 0.25).V - [0, 0.5, 0]
        border = square.V[:, 1] == 0.5
        moved[border] = square.V[border] - [0, 0.5, 0]
        mesh = Mesh(moved, square.F)
        source = int(np.argmin(np.linalg.norm(mesh.V - [0.25, 0.3, 0], axis=1)))
        speed = np.where(mesh.V[mesh.F][:, :, 1].mean(axis=1) > 0, *speeds)
        exact = by_fermat(mesh.V[source, :2], mesh.V[:, :2], *speeds)
        errors.append(mean_error(solver(mesh, speed).distance(source), exact))
    assert errors[1] < max(0.8 * errors[0], 5e-5)
    assert errors[2] < max(0.8 * errors[1], 5e-5)
    assert errors[2] < (1e-4 if speeds != (1.0, 2.0) else 5e-4)
    # From the border itself, straight lines in the slow half and the waves that the fast half sends there: they part at
    # the source, and what is wrong on the first ring of vertices stays, a hundredth of an edge.
    source = int(np.argmin(np.linalg.norm(mesh.V - [0.25, 0, 0], axis=1)))
    exact = by_fermat(mesh.V[source, :2], mesh.V[:, :2], *speeds)
    assert np.nanmean(np.abs(solver(mesh, speed).distance(source) - exact)) * min(speeds) < 0.01 / 64


@pytest.mark.parametrize(
    ("speed", "message"),
    [
        (np.ones(17), r"speed must have shape \(18,\), one per face, not \(17,\)"),
        (1.0, r"speed must have shape \(18,\), one per face, not \(\)"),
        ([1.0] * 17 + [0.0], r"speed\[17\] = 0.0 must be positive and finite \(1 of 18 are not\): remove faces"),
    ],
)
def test_wrong_speeds_are_refused(speed, message):
    with pytest.raises(ValueError, match=message):
        speed_operators(shapes.grid(3), speed)


def test_speed_that_grows_exponentially():
    """In the metric exp(-2 k x) |dz|^2 exp(-k z) / k unrolls the plane: every way is a straight line."""
    k = np.log(1e6) / 120
    mesh = flat_perturbed(shapes.strip(120, 12), 0.25)
    w = np.exp(-k * (mesh.V[:, 0] + 1j * mesh.V[:, 1])) / k
    source = int(np.argmin(np.linalg.norm(mesh.V - [60, 6, 0], axis=1)))
    exact = abs(w - w[source])
    speed = np.exp(k * mesh.V[mesh.F][:, :, 0].mean(axis=1))
    domain = speed_operators(mesh, speed)
    assert domain.contrast > 9e5
    found = {method: solver(mesh, speed, method=method).distance(source) for method in ("auto", "sweep", "exact")}
    for method, time in found.items():
        assert mean_error(time, exact) < 0.003, method


def test_faces_without_area_at_a_jump():
    """A vertex on the straight side of a triangle, in a square of two speeds."""
    square = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0.5, 0]]
    mesh = Mesh(square, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [0, 6, 1]])
    speed = [1.0, 1.0, 10.0, 10.0, 1.0]
    assert np.isfinite(solver(mesh, speed, t_coef=1.0).distance(0)).all()
    # To (1, 1) along the border at x = 1, on its fast side.
    steep = 0.1 / np.sqrt(0.99)
    border = np.hypot(1, steep) + (1 - steep) / 10
    np.testing.assert_allclose(
        solver(mesh, speed).distance(0)[[0, 1, 2, 3, 4, 6]], [0, 1, 1.1, 1, border, 0.5], rtol=0.01
    )


def test_checkerboard_of_speeds():
    """Shortest paths in a graph with 20 points on every edge, at most 0.1 % above the fastest ways."""
    mesh = flat_perturbed(shapes.grid(12), 0.25)
    column, row, _ = np.floor(mesh.V[mesh.F].mean(axis=1) * 4).astype(int).T
    for contrast in (2.0, 1e6):
        speed = np.where((column + row) % 2, contrast, 1.0)
        exact = on_graph(mesh, speed, 80, points=20)
        assert mean_error(solver(mesh, speed).distance(80), exact) < 0.025


def on_graph(mesh: Mesh, speed: FloatArray, source: int, points: int) -> FloatArray:
    """Travel times along straight lines between points on the edges of one face."""
    share = (1 - np.cos(np.pi * np.arange(1, points + 1) / (points + 1)))[:, None] / 2
    tail, head = mesh.edges.T
    inside = (1 - share) * mesh.V[tail, None] + share * mesh.V[head, None]
    nodes = np.concatenate([mesh.V, inside.reshape(-1, 3)])
    of_edge = mesh.n_vertices + np.arange(len(tail) * points).reshape(-1, points)
    i, j = np.triu_indices(3 + 3 * points, 1)
    of_face = np.concatenate([mesh.F, of_edge[mesh.facets.of_face].reshape(mesh.n_faces, -1)], axis=1)
    pairs = np.stack([of_face[:, i], of_face[:, j]], axis=-1).reshape(-1, 2)
    times = np.linalg.norm(nodes[pairs[:, 0]] - nodes[pairs[:, 1]], axis=1) / np.repeat(speed, len(i))
    graph = connectivity.shortest_edge_graph(pairs, times, len(nodes))
    return connectivity.edge_distance(graph, np.array([source]))[: mesh.n_vertices]
