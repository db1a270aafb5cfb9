"""`GeodesicSolver`: one interface for all domains, the same bits alone, in batches, in threads and pickled."""

from __future__ import annotations

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
