"""Derivatives of the heat method in both directions: all kinds of sources, boundary conditions, speeds and metrics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_derivatives import HEAT, MESHES, differences

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, OffsetSources, SurfacePoints
from heat_igl.geodesic import SolverChoice

DELAUNAY = {"laplacian": "intrinsic-delaunay"}
POINTS = SurfacePoints([30, 151], [[0.2, 0.3, 0.5], [0.6, 0.15, 0.25]])
SOURCES = {
    "vertex": 150,
    "three": [5, 100, 150],
    "offsets": OffsetSources([3, 150, 60], [0.1, 0.05, 0.0]),
    "points": POINTS,
    "both": [150, POINTS],
    "late point": [OffsetSources(POINTS, [0.05, 0.1]), 150],
}
pytestmark = pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")


def assert_differentiated(solver: HeatMethodSolver, V: np.ndarray, sources: Any, directions: int = 1) -> None:
    """Both directions against central differences, vertex by vertex, and against each other."""
    rng = np.random.default_rng(2)
    distance, pull_back = solver.distance_vjp(sources)
    np.testing.assert_array_equal(distance, solver.distance(sources))
    exact = np.ones(len(distance), bool)
    exact[pull_back.inexact] = False
    assert exact.sum() > 20
    g = np.where(exact, rng.standard_normal(len(distance)), 0.0)
    step = 1e-6 * np.sqrt(np.ptp(V, axis=0).prod() ** (2 / 3) / len(V))
    for _ in range(directions):
        direction = rng.standard_normal(V.shape)
        expected, _ = differences(solver, V, sources, direction, step)
        change = pull_back.push_forward(direction)
        np.testing.assert_allclose(change[exact], expected[exact], atol=1e-5 * np.abs(expected).max())
        rate = (pull_back(g) * direction).sum()
        assert rate == pytest.approx((g * expected).sum(), rel=1e-4, abs=1e-6 * np.abs(expected).sum())
        assert rate == pytest.approx((g * change).sum(), abs=1e-10 * np.abs(g * change).sum())


@pytest.mark.parametrize("options", [HEAT[0], HEAT[1], DELAUNAY], ids=str)
@pytest.mark.parametrize("sources", SOURCES)
@pytest.mark.parametrize("name", ["grid", "moebius", "sphere"])
def test_all_kinds_of_sources(name: str, sources: str, options: dict[str, Any]) -> None:
    mesh = MESHES[name]()
    assert_differentiated(SolverChoice.of(**options).on(mesh), mesh.V, SOURCES[sources])


@pytest.mark.parametrize("sources", ["vertex", "three", "offsets"])
def test_sources_where_three_sheets_meet(sources: str) -> None:
    mesh = MESHES["book"]()
    solver = HeatMethodSolver(mesh, **DELAUNAY)
    assert solver.operators.surface.triangulation.is_cover
    assert_differentiated(solver, mesh.V, SOURCES[sources])
    assert_differentiated(solver, mesh.V, 5)  # beside the shared edge: distances around it are straight lines


@pytest.mark.parametrize("options", [HEAT[0], HEAT[1], DELAUNAY], ids=str)
@pytest.mark.parametrize("sources", [150, [150, 0], OffsetSources([150, 0], [0.1, 0.05]), POINTS], ids=str)
@pytest.mark.parametrize("boundary", ["dirichlet", "average"])
def test_boundary_conditions(boundary: Any, sources: Any, options: dict[str, Any]) -> None:
    mesh = MESHES["grid"]()
    solver = HeatMethodSolver(mesh, boundary=boundary, **options)
    assert (solver.solve(sources).distance != SolverChoice.of(**options).on(mesh).distance(sources)).any()
    assert_differentiated(solver, mesh.V, sources)


def test_components_with_time_steps_of_their_own() -> None:
    one, other = MESHES["grid"](), MESHES["sphere"]()
    n = one.n_vertices
    mesh = Mesh(np.concatenate([one.V, 3 + 2 * other.V]), np.concatenate([one.F, n + other.F]))
    solver = HeatMethodSolver(mesh, **DELAUNAY)
    assert len(solver.time_steps) == 2
    assert_differentiated(solver, mesh.V, [150, n + 5])
    assert_differentiated(solver, mesh.V, 150)  # the other component is not reached


@pytest.mark.parametrize("sources", ["points", "both"])
def test_points_move_in_their_faces(sources: str) -> None:
    mesh, rng = MESHES["sphere"](), np.random.default_rng(3)
    solver = HeatMethodSolver(mesh, **DELAUNAY)
    assert solver.diagnostics.n_flips
    change = rng.standard_normal((2, 3))
    change -= change.mean(axis=1, keepdims=True)

    def moved_by(amount: float) -> Any:
        points = SurfacePoints(POINTS.faces, POINTS.barycentric + amount * change)
        return [150, points] if sources == "both" else points

    _, pull_back = solver.distance_vjp(moved_by(0))
    g = rng.standard_normal(mesh.n_vertices)
    g[pull_back.inexact] = 0
    rate = (g * (solver.distance(moved_by(1e-6)) - solver.distance(moved_by(-1e-6)))).sum() / 2e-6
    motion = np.einsum("pc,pcx->px", change, mesh.V[mesh.F[POINTS.faces]])
    by_points = (pull_back.by_points(g) * motion).sum()
    assert by_points == pytest.approx(rate, rel=1e-5)
    change_of_all = pull_back.push_forward(np.zeros_like(mesh.V), motion) * g
    assert change_of_all.sum() == pytest.approx(by_points, abs=1e-10 * np.abs(change_of_all).sum())


def test_with_offsets_scaling_takes_their_derivative_too() -> None:
    """A mesh and offsets that are twice as large give twice the distance."""
    mesh, offsets = MESHES["sphere"](), np.array([0.1, 0.05, 0.0])
    solver = HeatMethodSolver(mesh, **DELAUNAY)

    def distance(scale: float) -> np.ndarray:
        return solver.distance(OffsetSources([3, 150, 60], scale * offsets))

    phi, pull_back = solver.distance_vjp(OffsetSources([3, 150, 60], offsets))
    by_offsets = (distance(1 + 1e-6) - distance(1 - 1e-6)) / 2e-6
    exact = np.ones(len(phi), bool)
    exact[pull_back.inexact] = False
    assert exact.mean() > 0.5
    np.testing.assert_allclose((pull_back.push_forward(mesh.V) + by_offsets)[exact], phi[exact], atol=1e-7)


def metric_of(mesh: Mesh, kind: str) -> np.ndarray:
    """A speed or a metric that changes slowly from face to face."""
    x, y, _ = mesh.V[mesh.F].mean(axis=1).T
    if kind == "speed":
        return np.asarray(1 + 0.1 * np.sin(2 * x + y))
    # In planes, of which each has axes of its own, the same in all directions.
    constant = np.eye(2) if kind == "in planes" else np.diag([1.2, 1.0, 0.8]) + 0.1
    return np.asarray((1 + 0.1 * x**2)[:, None, None] * constant)


def solver_in(mesh: Mesh, kind: str, values: np.ndarray, options: dict[str, Any]) -> Any:
    choice = SolverChoice.of(**options)
    if kind == "speed":
        return choice.on(heat_igl.speed_operators(mesh, values))
    return choice.on(heat_igl.metric_operators(mesh, values, laplacian="intrinsic-delaunay"))


@pytest.mark.parametrize("options", [{"method": "exact"}, {"method": "heat"}], ids=str)
@pytest.mark.parametrize("kind", ["speed", "in space", "in planes"])
def test_speeds_and_metrics(kind: str, options: dict[str, Any]) -> None:
    mesh, rng = MESHES["grid"](), np.random.default_rng(5)
    values = metric_of(mesh, kind)
    solver = solver_in(mesh, kind, values, options)
    distance, pull_back = solver.distance_vjp(150)
    g = rng.standard_normal(mesh.n_vertices)
    g[pull_back.inexact] = 0
    change = 0.1 * rng.standard_normal(values.shape)
    if kind != "speed":
        change += np.swapaxes(change, 1, 2)
    step = 1e-6
    ahead, behind = (solver_in(mesh, kind, values + e * change, options).distance(150) for e in (step, -step))
    by_values = pull_back.by_speed(g) if kind == "speed" else pull_back.by_metric(g)
    assert by_values.shape == values.shape
    assert (by_values * change).sum() == pytest.approx((g * (ahead - behind)).sum() / (2 * step), rel=1e-5)
    # Twice as fast, half as long; four times the metric, twice as long.
    of_scale = (by_values * values).sum() * (-1 if kind == "speed" else 2)
    assert of_scale == pytest.approx((g * distance).sum(), abs=1e-10 * np.abs(g * distance).sum())
    if kind == "in planes":
        with pytest.raises(ValueError, match="turns with the planes of the triangles"):
            pull_back(g)
        return
    direction = rng.standard_normal(mesh.V.shape)
    ahead, behind = (
        solver_in(mesh.with_vertices(mesh.V + e * direction), kind, values, options).distance(150)
        for e in (1e-7, -1e-7)
    )
    rate = (g * (ahead - behind)).sum() / 2e-7
    assert (pull_back(g) * direction).sum() == pytest.approx(rate, rel=1e-4)
    assert (pull_back.push_forward(direction) * g).sum() == pytest.approx((pull_back(g) * direction).sum(), rel=1e-10)


def test_what_has_no_metric_to_change() -> None:
    mesh = MESHES["grid"]()
    _, pull_back = HeatMethodSolver(mesh, **DELAUNAY).distance_vjp(0)
    with pytest.raises(ValueError, match=r"no metric to change: make it on speed_operators"):
        pull_back.by_speed(np.ones(mesh.n_vertices))
    with pytest.raises(ValueError, match=r"no metric to change: make it on metric_operators"):
        pull_back.by_metric(np.ones(mesh.n_vertices))
    jumping = heat_igl.speed_operators(mesh, np.where(mesh.V[mesh.F, 0].mean(axis=1) > 0.5, 2.0, 1.0))
    with pytest.raises(heat_igl.MeshError, match="derivatives are those of paths on triangles that fit together"):
        GeodesicSolver(jumping).distance_vjp(0)


def test_faces_that_are_there_twice_count_once() -> None:
    mesh = MESHES["grid"]()
    doubled = Mesh(mesh.V, np.concatenate([mesh.F, mesh.F[40:60, [1, 2, 0]], mesh.F[7:9, [1, 0, 2]]]))
    g, direction = np.random.default_rng(6).standard_normal((2, mesh.n_vertices, 1)) * [1, 0.5, 0.3]
    for options in ({"method": "exact"}, DELAUNAY):
        _, once = SolverChoice.of(**options).on(mesh).distance_vjp(150)
        _, twice = SolverChoice.of(**options).on(doubled).distance_vjp(150)
        np.testing.assert_allclose(twice(g[:, 0]), once(g[:, 0]), atol=1e-9)
        np.testing.assert_allclose(twice.push_forward(direction), once.push_forward(direction), atol=1e-9)


def test_points_on_a_cover_are_refused() -> None:
    solver = HeatMethodSolver(MESHES["book"](), **DELAUNAY)
    with pytest.raises(ValueError, match="the triangles are a cover of the surface: take a GeodesicSolver"):
        solver.distance_vjp(POINTS)
    assert GeodesicSolver(MESHES["book"](), method="exact").distance_vjp(POINTS)[1](np.ones(solver.n_vertices)).any()
