"""Sweeps in the order of their own front, and solvers on points that make nothing for heat until it is asked for."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from heat_igl import HeatMethodSolver, Mesh, OffsetSources, PointCloud, Refinement, shapes
from heat_igl.heat_method import parts, point_parts
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.operators import operators


def sphere(n: int, seed: int = 0) -> np.ndarray:
    P = np.random.default_rng(seed).standard_normal((n, 3))
    return P / np.linalg.norm(P, axis=1, keepdims=True)


def refinement(mesh: Mesh) -> Refinement:
    return Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))


def rectangle(x: np.ndarray, y: np.ndarray) -> Mesh:
    """A grid of vertices at x[i], y[j]."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(len(x) - 1), np.arange(len(y) - 1), indexing="ij"))
    a, b, c, d = (k * len(y) + m for k, m in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
    X, Y = (g.ravel() for g in np.meshgrid(x, y, indexing="ij"))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(np.stack([X, Y, 0 * X], axis=1), F)


def straight(mesh: Mesh, i: int) -> np.ndarray:
    return np.linalg.norm(mesh.V - mesh.V[i], axis=1)


# The order of the front.


def test_in_a_plane_a_front_finds_straight_lines() -> None:
    points = np.random.default_rng(0).random((3000, 2))
    mesh = PointCloud(np.append(points, np.zeros((3000, 1)), axis=1)).triangles
    found = refinement(mesh).sweep(None, np.array([17]))
    # Outer triangles that points do not fill leave a boundary with notches.
    inside = (np.abs(points - 0.5) < 0.4).all(axis=1)
    line = straight(mesh, 17)
    assert np.abs(found - line)[inside].max() < 1e-9


@pytest.mark.parametrize("growth", [1.02, 1.1, 1.2])
def test_a_front_takes_edges_of_very_different_lengths(growth: float) -> None:
    """Edges are up to 1e5 times as long as the median: then the ring of bands is empty, and the front leaps ahead."""
    x = np.cumsum(growth ** np.arange(60.0))
    mesh = rectangle(np.concatenate([np.linspace(0, 1e-3, 80), x]), np.linspace(0, 3, 12))
    for source in (0, 400, mesh.n_vertices - 1):
        found = refinement(mesh).sweep(None, np.array([source]))
        np.testing.assert_allclose(found, straight(mesh, source), rtol=1e-6, atol=1e-4)  # triangles are mollified


def test_a_front_visits_few_vertices_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """As few as in the order of the exact distance, to within a tenth."""
    from heat_igl.unfolding import refinement as module

    visits = []
    kernel = module.sweep
    monkeypatch.setattr(module, "sweep", lambda *given: visits.append(kernel(*given)))
    P = sphere(4000)
    surface = refinement(PointCloud(P).triangles)
    for source in range(5):
        surface.sweep(None, np.array([source]))
        surface.sweep(-P @ P[source], np.array([source]))
    front, exact = np.reshape(visits, (-1, 2)).mean(axis=0)
    assert front < 1.1 * exact


def test_orders_change_a_sweep_by_less_than_the_error_of_it() -> None:
    P = sphere(3000)
    surface = refinement(PointCloud(P).triangles)
    angle = 2 * np.arcsin(np.linalg.norm(P - P[5], axis=1) / 2)
    found = surface.sweep(None, np.array([5]))
    error = np.abs(found - angle)[angle > 0] / angle[angle > 0]
    assert error.mean() < 0.003
    assert np.abs(found - surface.sweep(angle, np.array([5]))).mean() < 0.001 * angle.max()


def test_a_front_from_several_sources_has_cells_and_offsets() -> None:
    mesh = rectangle(np.linspace(0, 2, 41), np.linspace(0, 1, 21))
    surface, sources, offsets = refinement(mesh), np.array([0, 400, 800]), np.array([0.3, 0.0, 0.1])
    labels = np.empty(mesh.n_vertices, np.int64)
    found = surface.sweep(None, sources, offsets=offsets, labels=labels)
    lines = np.stack([straight(mesh, i) for i in sources]) + offsets[:, None]
    assert np.abs(found - lines.min(axis=0)).max() < 0.02
    second = np.sort(lines, axis=0)[1]
    clear = second - lines.min(axis=0) > 0.1
    np.testing.assert_array_equal(labels[clear], lines.argmin(axis=0)[clear])


def test_what_no_front_reaches_is_infinite() -> None:
    one = shapes.grid(12)
    both = Mesh(np.concatenate([one.V, one.V + 9]), np.concatenate([one.F, one.F + one.n_vertices]))
    found = refinement(both).sweep(None, np.array([3]))
    assert np.isinf(found[one.n_vertices :]).all()
    np.testing.assert_allclose(found[: one.n_vertices], straight(one, 3), atol=1e-12)


# Nothing for heat until it is asked for.


def forbid(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise RuntimeError("made although nobody asked")

    monkeypatch.setattr(point_parts, "operators", refuse)
    monkeypatch.setattr(parts, "HeatFlow", refuse)
    monkeypatch.setattr(parts, "analysis", refuse)


def test_distances_on_points_need_neither_operators_nor_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    forbid(monkeypatch)
    P = sphere(2500)
    solver = HeatMethodSolver(PointCloud(P))
    angle = np.arccos(np.clip(P @ P[:3].T, -1, 1)).T
    one = solver.distance(0)
    assert np.abs(one - angle[0]).mean() < 0.01
    np.testing.assert_array_equal(solver.distances([0, [0, 1]])[0], one)
    cells = solver.voronoi([0, 1, 2])
    assert np.abs(cells.distance - angle.min(axis=0)).mean() < 0.01
    late = solver.distance([OffsetSources([0], [0.5]), 1])
    assert np.abs(late - np.minimum(angle[0] + 0.5, angle[1])).mean() < 0.02
    assert solver.n_vertices == 2500
    moved = solver.with_vertices(2 * P)
    np.testing.assert_allclose(moved.distance(0), 2 * one, rtol=1e-12)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(solver)).distance(0), one)
    for read in (lambda: solver.t, lambda: solver.operators, lambda: solver.solve(0), lambda: repr(solver)):
        with pytest.raises(RuntimeError, match="nobody asked"):
            read()


def test_heat_on_points_is_there_once_it_is_asked_for() -> None:
    """The same as of a solver on the operators that are made for this."""
    cloud = PointCloud(sphere(2500))
    solver = HeatMethodSolver(cloud)
    domain = operators(cloud.distinct_triangles, "intrinsic-delaunay")
    peer = HeatMethodSolver.from_operators(domain, refine="sweep")
    before = solver.distance(4)
    assert peer.diagnostics.backend != solver.diagnostics.backend == "none"
    assert solver.t == peer.t
    found, expected = solver.solve(4), peer.solve(4)
    np.testing.assert_allclose(found.heat, expected.heat, rtol=1e-9)
    np.testing.assert_allclose(found.direction, expected.direction, atol=1e-9)
    assert np.abs(found.distance - expected.distance).mean() < 0.002
    np.testing.assert_array_equal(found.distance, before)
    again = pickle.loads(pickle.dumps(solver))
    np.testing.assert_array_equal(again.solve(4).heat, found.heat)
    assert repr(again) == repr(solver)


def test_threads_that_ask_for_heat_at_once_get_the_same() -> None:
    solver = HeatMethodSolver(PointCloud(sphere(2000)))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda i: solver.solve(i).heat, [7] * 8))
    for heat in found:
        np.testing.assert_array_equal(heat, found[0])


@pytest.mark.parametrize("named", [{"t_coef": 2.0}, {"t": 0.01}, {"boundary": "dirichlet"}, {"laplacian": "cotan"}])
def test_a_sweep_in_the_order_of_heat_that_is_named_factors(named: dict[str, object]) -> None:
    cloud = PointCloud(sphere(1500))
    assert HeatMethodSolver(cloud, refine="sweep", **named).diagnostics.backend != "none"
    assert HeatMethodSolver(cloud, refine="sweep").diagnostics.backend == "none"


def test_an_unknown_part_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'elephants'"):
        _ = HeatMethodSolver(PointCloud(sphere(1500)))._parts.elephants
