"""`GeodesicSolver`: one interface for all domains, the same bits alone, in batches, in threads and pickled."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import igl
import numpy as np
import pytest

import heat_igl
from heat_igl import GeodesicSolver, OffsetSources, SurfacePoints, edge_curve, shapes

TORUS = shapes.torus(60, 40)
DOMAINS = {
    "windows": lambda: GeodesicSolver(TORUS),
    "exact": lambda: GeodesicSolver(TORUS, method="exact"),
    "sweep": lambda: GeodesicSolver(TORUS, method="sweep"),
    "points": lambda: GeodesicSolver(heat_igl.PointCloud(TORUS.V)),
    "tetrahedra": lambda: GeodesicSolver(shapes.box(4)),
    "metric": lambda: GeodesicSolver(heat_igl.speed_operators(TORUS, np.linspace(1, 1.05, TORUS.n_faces))),
}


@pytest.mark.parametrize("name", DOMAINS)
def test_the_same_bits_alone_in_batches_in_threads_and_pickled(name):
    solver = DOMAINS[name]()
    vertices = [0, 5, 17, 40]
    alone = [solver.distance(v) for v in vertices]
    assert all(d[v] == 0 and d.min() == 0 and not np.isnan(d).any() for d, v in zip(alone, vertices, strict=True))
    np.testing.assert_array_equal(solver.distances(vertices), alone)
    np.testing.assert_array_equal(list(solver.iter_distances(vertices)), alone)
    again = pickle.loads(pickle.dumps(solver))
    with ThreadPoolExecutor(4) as threads:
        np.testing.assert_array_equal(list(threads.map(again.distance, vertices)), alone)
    cells = solver.voronoi(vertices)
    near = np.stack(alone).argmin(axis=0)
    np.testing.assert_allclose(cells.distance, np.min(alone, axis=0), rtol=0.05)
    assert (cells.labels == near).mean() > 0.9
    assert repr(solver).startswith(f"GeodesicSolver({solver.n_vertices} vertices, {solver.plan.engine}")


@pytest.mark.parametrize("name", DOMAINS)
def test_a_cutoff_leaves_what_is_nearer(name):
    solver = DOMAINS[name]()
    whole = solver.distance(3)
    cutoff = float(np.median(whole))
    expected = np.where(whole <= cutoff, whole, np.inf)
    np.testing.assert_allclose(solver.distance(3, cutoff), expected, rtol=1e-12)
    np.testing.assert_allclose(solver.distances([3], cutoff=cutoff)[0], expected, rtol=1e-12)
    labels = solver.voronoi([3, 9], cutoff=cutoff).labels
    assert (labels[np.isinf(solver.distance([3, 9], cutoff))] == -1).all()


def test_every_kind_of_source_against_the_single_sources():
    solver = GeodesicSolver(TORUS, tolerance=0)
    point = SurfacePoints([40], [[0.2, 0.5, 0.3]])
    curve = edge_curve(TORUS, TORUS.F[300, :2])
    parts = [solver.distance(each) for each in (7, point, curve)]
    np.testing.assert_allclose(solver.distance([7, point, curve]), np.min(parts, axis=0), rtol=1e-12, atol=1e-12)
    late = solver.distance(OffsetSources([7, 900], [3.0, 2.5]))
    expected = np.minimum(parts[0] + 3.0, solver.distance(900) + 2.5)
    np.testing.assert_allclose(late, expected, rtol=1e-12)


def test_directions_are_those_of_the_distance():
    solver = GeodesicSolver(TORUS, tolerance=0)
    found = solver.directions([3, 500])
    np.testing.assert_allclose(found.distance, solver.distance([3, 500]), rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(found.labels, solver.voronoi([3, 500]).labels)
    along = np.linalg.norm(found.gradient, axis=1)
    np.testing.assert_allclose(np.delete(along, [3, 500]), 1, rtol=1e-12)


def test_moved_vertices_are_a_new_solver():
    solver = GeodesicSolver(TORUS, method="sweep")
    moved = solver.with_vertices(2 * TORUS.V)
    np.testing.assert_allclose(moved.distance(3), 2 * solver.distance(3), rtol=1e-12)
    with pytest.raises(ValueError, match="made from operators and has no vertices to move"):
        DOMAINS["metric"]().with_vertices(TORUS.V)


def test_edge_lengths_alone_are_the_mesh():
    by_lengths = GeodesicSolver.from_edge_lengths(TORUS.F, igl.edge_lengths(TORUS.V, TORUS.F), tolerance=0)
    np.testing.assert_allclose(by_lengths.distance(3), GeodesicSolver(TORUS, tolerance=0).distance(3), rtol=1e-12)
    with pytest.raises(ValueError, match="directions need the positions of a mesh"):
        by_lengths.directions(3)


def test_what_has_no_paths():
    with pytest.raises(ValueError, match="directions follow paths, which a sweep does not find"):
        DOMAINS["sweep"]().directions(0)
    with pytest.raises(heat_igl.MeshError, match="derivatives are those of paths on triangles that fit together"):
        DOMAINS["tetrahedra"]().distance_vjp(0)
    assert DOMAINS["windows"]().distance_vjp(0)[1](np.ones(TORUS.n_vertices)).shape == (TORUS.n_vertices, 3)
