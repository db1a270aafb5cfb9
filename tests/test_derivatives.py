"""Derivatives of distance: against central differences, identities and closed forms; one-sided cases; bad input."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from conftest import flat_perturbed
from surfaces import moebius_strip, nearest_vertex, twice, two_arms

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, OffsetSources, SurfacePoints, shapes
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.operators import edge_length_operators


def moved(mesh: Mesh, amount: float = 0.15) -> Mesh:
    """All vertices moved at random, the outer ones too: no two paths are equally long, and no edges are cocircular."""
    h = mesh.edge_lengths.mean()
    return Mesh(mesh.V + amount * h * np.random.default_rng(7).uniform(-1, 1, mesh.V.shape), mesh.F)


MESHES = {
    "sphere": lambda: moved(shapes.icosphere(3)),
    "grid": lambda: moved(shapes.grid(16)),
    "torus": lambda: moved(shapes.torus(40, 20)),
    "moebius": lambda: moved(moebius_strip(40, 4, 0.2)),
    "book": lambda: moved(shapes.book(3, 8), 0.1),
    "fine sphere": lambda: moved(shapes.icosphere(4), 0.05),
}


def differences(
    solver: GeodesicSolver, V: np.ndarray, sources: Any, direction: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Central differences (n,) of the distance, and where they cross no kink: a second difference would show it."""
    ahead, behind = (solver.with_vertices(V + sign * step * direction).distance(sources) for sign in (1, -1))
    here = solver.distance(sources)
    with np.errstate(invalid="ignore"):
        smooth = np.abs(ahead - 2 * here + behind) <= 1e-4 * step + 1e-12 * here
        return np.where(np.isfinite(here), (ahead - behind) / (2 * step), 0.0), smooth


def pulled(solver: GeodesicSolver, sources: Any, rng: np.random.Generator) -> tuple[np.ndarray, Any, np.ndarray]:
    """The distance, its derivative, and random weights of vertices, 0 where it is not exact."""
    distance, pull_back = solver.distance_vjp(sources)
    g = rng.standard_normal(len(distance))
    g[pull_back.inexact] = 0
    return distance, pull_back, g


@pytest.mark.parametrize("name", MESHES)
def test_paths_against_central_differences(name):
    mesh, rng = MESHES[name](), np.random.default_rng(1)
    solver, sources = GeodesicSolver(mesh, method="exact"), OffsetSources([5, mesh.n_vertices // 2], [0.0, 0.1])
    distance, pull_back, g = pulled(solver, sources, rng)
    np.testing.assert_array_equal(distance, solver.distance(sources))
    assert len(pull_back.inexact) <= 0.01 * mesh.n_vertices
    for _ in range(20 if mesh.n_vertices < 700 else 4):
        direction = rng.standard_normal(mesh.V.shape)
        step = 1e-7 * mesh.edge_lengths.mean()
        expected, smooth = differences(solver, mesh.V, sources, direction, step)
        assert smooth.mean() > 0.97
        counted = np.where(smooth, g, 0.0)
        rate = (counted * expected).sum()
        assert (pull_back(counted) * direction).sum() == pytest.approx(
            rate, rel=1e-5, abs=1e-7 * np.abs(expected).sum()
        )
        np.testing.assert_allclose(
            (pull_back.push_forward(direction) * counted).sum(), (pull_back(counted) * direction).sum(), rtol=1e-9
        )


def test_offsets_against_central_differences():
    mesh, rng = MESHES["torus"](), np.random.default_rng(2)
    solver, places, offsets = GeodesicSolver(mesh), [40, SurfacePoints([7], [[0.2, 0.3, 0.5]]), 400], [0.1, 0.05, 0.3]
    _, pull_back, g = pulled(solver, OffsetSources(places, offsets), rng)
    for step, rate in zip(1e-6 * np.eye(3), pull_back.by_offsets(g), strict=True):
        ahead, behind = (solver.distance(OffsetSources(places, offsets + sign * step)) for sign in (1, -1))
        assert rate == pytest.approx(g @ (ahead - behind) / 2e-6, rel=1e-6)


@pytest.mark.parametrize("name", ["sphere", "grid", "moebius"])
def test_rigid_motions_change_nothing_and_scaling_gives_the_distance(name):
    mesh, rng = MESHES[name](), np.random.default_rng(4)
    distance, pull_back, g = pulled(GeodesicSolver(mesh, method="exact"), 5, rng)
    dV = pull_back(g)
    scale = np.abs(g * distance).sum()
    np.testing.assert_allclose(dV.sum(axis=0), 0, atol=1e-10 * np.abs(dV).sum())
    np.testing.assert_allclose(np.cross(mesh.V, dV).sum(axis=0), 0, atol=1e-10 * np.abs(dV).sum())
    assert (dV * mesh.V).sum() == pytest.approx((g * distance).sum(), abs=1e-10 * scale)


def test_scaling_gives_the_distance_where_faces_have_a_vertex_twice():
    """Double pyramids with far tips: their intrinsic Delaunay triangles fold around edges from a vertex to itself."""
    rng, n_folded = np.random.default_rng(3), 0
    for _ in range(20):
        k = int(rng.integers(3, 7))
        turn = np.sort(rng.random(k)) * 2 * np.pi
        rim = rng.uniform(0.02, 0.5) * np.stack([np.cos(turn), np.sin(turn), np.zeros(k)], axis=1)
        here, ahead = np.arange(k), np.roll(np.arange(k), -1)
        F = np.concatenate(
            [np.stack([*side, np.full(k, tip)], axis=1) for side, tip in (((here, ahead), k), ((ahead, here), k + 1))]
        )
        mesh = Mesh(np.vstack([rim, rng.standard_normal((2, 3)) * [3, 1, 0.3]]), F)
        corners = np.sort(intrinsic_delaunay(intrinsic_triangulation(mesh)).F, axis=1)
        n_folded += (np.diff(corners, axis=1) == 0).any()
        places = rng.dirichlet([1, 1, 1], 2)
        for sources in ([0], SurfacePoints(rng.integers(0, 2 * k, 2), places)):
            distance, pull_back, g = pulled(GeodesicSolver(mesh), sources, rng)
            assert not len(pull_back.inexact)
            assert (pull_back(g) * mesh.V).sum() == pytest.approx((g * distance).sum(), rel=1e-9, abs=1e-9)
    assert n_folded > 15


def test_on_a_flat_convex_mesh_the_ends_move_along_the_line():
    mesh = flat_perturbed(shapes.grid(20), 0.15)
    distance, pull_back = GeodesicSolver(mesh, method="exact").distance_vjp(110)
    others = [3, 50, 217, 399]
    assert HeatMethodSolver(mesh).diagnostics.n_flips > 0
    rows = pull_back(np.eye(mesh.n_vertices)[others])
    for vertex, dV in zip(others, rows, strict=True):
        unit = (mesh.V[vertex] - mesh.V[110]) / distance[vertex]
        expected = np.zeros_like(dV)
        expected[vertex], expected[110] = unit, -unit
        np.testing.assert_allclose(dV, expected, atol=1e-9)


def test_a_bend_moves_with_its_vertex():
    mesh = two_arms(6)
    start, end, bend = (nearest_vertex(mesh, place) for place in ([0.5, -0.25, 0], [-0.25, 0.5, 0], [0, 0, 0]))
    solver = GeodesicSolver(mesh, method="exact")
    _, pull_back = solver.distance_vjp(start)
    dV = pull_back(np.eye(mesh.n_vertices)[end])
    to_bend, from_bend = mesh.V[bend] - mesh.V[start], mesh.V[end] - mesh.V[bend]
    to_bend, from_bend = to_bend / np.linalg.norm(to_bend), from_bend / np.linalg.norm(from_bend)
    np.testing.assert_allclose(dV[bend], to_bend - from_bend, atol=1e-9)
    np.testing.assert_allclose(dV[start], -to_bend, atol=1e-9)


def test_by_edge_lengths_without_positions():
    mesh, rng = MESHES["sphere"](), np.random.default_rng(6)
    lengths = mesh.edge_lengths[mesh.facets.of_face]

    def made(F, lengths):
        return GeodesicSolver(edge_length_operators(F, lengths), method="exact")

    _, pull_back, g = pulled(made(mesh.F, lengths), 9, rng)
    by_lengths = pull_back.by_lengths(g)
    edge = np.sort(np.stack([mesh.F[:, [1, 2, 0]], mesh.F[:, [2, 0, 1]]], axis=-1), axis=-1)
    rate = rng.standard_normal(mesh.n_vertices)[edge].prod(axis=-1) * lengths  # the same on both sides of an edge
    ahead, behind = (made(mesh.F, lengths + e * rate).distance(9) for e in (1e-7, -1e-7))
    assert (by_lengths * rate).sum() == pytest.approx((g * (ahead - behind)).sum() / 2e-7, rel=1e-4)


def test_points_in_faces_as_sources():
    mesh, rng = moved(shapes.torus(50, 25), 0.3), np.random.default_rng(8)
    faces, barycentric = rng.integers(mesh.n_faces, size=4), rng.dirichlet([2, 2, 2], 4)
    solver, at = GeodesicSolver(mesh, method="exact"), partial(SurfacePoints, faces)
    _, pull_back, g = pulled(solver, at(barycentric), rng)
    direction, step = rng.standard_normal(mesh.V.shape), 1e-6 * mesh.edge_lengths.mean()
    expected, smooth = differences(solver, mesh.V, at(barycentric), direction, step)
    g = np.where(smooth, g, 0.0)
    assert (pull_back(g) * direction).sum() == pytest.approx((g * expected).sum(), rel=1e-5)

    change = rng.standard_normal((4, 3))
    change -= change.mean(axis=1, keepdims=True)
    ahead, behind = (solver.distance(at(barycentric + e * change)) for e in (1e-6, -1e-6))
    motion = np.einsum("pc,pcx->px", change, mesh.V[mesh.F[faces]])
    rate = (g * (ahead - behind)).sum() / 2e-6
    by_points = (pull_back.by_points(g) * motion).sum()
    assert by_points == pytest.approx(rate, rel=1e-5)
    both = (pull_back.push_forward(direction, motion) * g).sum()
    assert both == pytest.approx((pull_back(g) * direction).sum() + by_points, rel=1e-9)


def test_unreachable_vertices_have_no_derivative():
    one = MESHES["grid"]()
    n = one.n_vertices
    mesh = twice(one, 3.0)
    distance, pull_back = GeodesicSolver(mesh, method="exact").distance_vjp(5)
    np.testing.assert_array_equal(pull_back.unreachable, np.arange(n, 2 * n))
    g = np.where(np.isinf(distance), np.nan, 1.0)
    dV = pull_back(g)
    assert not dV[n:].any()
    np.testing.assert_array_equal(dV[:n], GeodesicSolver(mesh, method="exact").distance_vjp(5)[1](np.ones(2 * n))[:n])
    assert np.abs(dV[:n]).max() > 0.1


def metric_of(mesh: Mesh, kind: str) -> np.ndarray:
    """A speed or a metric that changes slowly from face to face."""
    x, y, _ = mesh.V[mesh.F].mean(axis=1).T
    if kind == "speed":
        return np.asarray(1 + 0.1 * np.sin(2 * x + y))
    # In planes, of which each has axes of its own, the same in all directions.
    constant = np.eye(2) if kind == "in planes" else np.diag([1.2, 1.0, 0.8]) + 0.1
    return np.asarray((1 + 0.1 * x**2)[:, None, None] * constant)


def solver_in(mesh: Mesh, kind: str, values: np.ndarray) -> GeodesicSolver:
    if kind == "speed":
        return GeodesicSolver(heat_igl.speed_operators(mesh, values), method="exact")
    return GeodesicSolver(heat_igl.metric_operators(mesh, values, laplacian="intrinsic-delaunay"), method="exact")


@pytest.mark.parametrize("kind", ["speed", "in space", "in planes"])
def test_speeds_and_metrics(kind):
    mesh, rng = MESHES["grid"](), np.random.default_rng(5)
    values = metric_of(mesh, kind)
    distance, pull_back, g = pulled(solver_in(mesh, kind, values), 150, rng)
    change = 0.1 * rng.standard_normal(values.shape)
    if kind != "speed":
        change += np.swapaxes(change, 1, 2)
    ahead, behind = (solver_in(mesh, kind, values + e * change).distance(150) for e in (1e-6, -1e-6))
    by_values = pull_back.by_speed(g) if kind == "speed" else pull_back.by_metric(g)
    assert by_values.shape == values.shape
    assert (by_values * change).sum() == pytest.approx((g * (ahead - behind)).sum() / 2e-6, rel=1e-5)
    # Twice as fast, half as long; four times the metric, twice as long.
    of_scale = (by_values * values).sum() * (-1 if kind == "speed" else 2)
    assert of_scale == pytest.approx((g * distance).sum(), abs=1e-10 * np.abs(g * distance).sum())
    if kind == "in planes":
        with pytest.raises(ValueError, match="turns with the planes of the triangles"):
            pull_back(g)
        return
    direction = rng.standard_normal(mesh.V.shape)
    ahead, behind = (
        solver_in(mesh.with_vertices(mesh.V + e * direction), kind, values).distance(150) for e in (1e-7, -1e-7)
    )
    assert (pull_back(g) * direction).sum() == pytest.approx((g * (ahead - behind)).sum() / 2e-7, rel=1e-4)
    assert (pull_back.push_forward(direction) * g).sum() == pytest.approx((pull_back(g) * direction).sum(), rel=1e-10)


def test_faces_that_are_there_twice_count_once():
    mesh = MESHES["grid"]()
    doubled = Mesh(mesh.V, np.concatenate([mesh.F, mesh.F[40:60, [1, 2, 0]], mesh.F[7:9, [1, 0, 2]]]))
    g, direction = np.random.default_rng(6).standard_normal((2, mesh.n_vertices, 1)) * [1, 0.5, 0.3]
    _, once = GeodesicSolver(mesh, method="exact").distance_vjp(150)
    _, twice = GeodesicSolver(doubled, method="exact").distance_vjp(150)
    np.testing.assert_allclose(twice(g[:, 0]), once(g[:, 0]), atol=1e-9)
    np.testing.assert_allclose(twice.push_forward(direction), once.push_forward(direction), atol=1e-9)
