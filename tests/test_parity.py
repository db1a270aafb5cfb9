"""The same numbers as libigl's own heat method, where both do the same."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from conftest import wheel_path

from heat_igl import HeatMethodSolver, Mesh, read_mesh


def libigl_distance(mesh: Mesh, t: float, source: int) -> np.ndarray:
    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(mesh.V, mesh.F, t, data)
    return np.asarray(igl.heat_geodesics_solve(data, np.array([source], np.int64)))


@pytest.mark.parametrize("name", ["cow.obj", "bunny.obj"])
@pytest.mark.parametrize("seed", [0, 1])
def test_cotan_agrees_with_libigl(name, seed):
    """To 1e-6 of the diameter; libigl averages both boundary conditions, and leaves the source at the mean, 0."""
    mesh = read_mesh(wheel_path(name))
    inner = np.flatnonzero(mesh.referenced & ~mesh.boundary)
    source = int(np.random.default_rng(seed).choice(inner))
    solver = HeatMethodSolver(mesh, laplacian="cotan", boundary="average")
    expected = libigl_distance(mesh, solver.t, source)
    expected = np.maximum(expected - expected[source], 0)
    difference = np.abs(solver.distance(source) - expected)
    assert difference.max() <= 1e-6 * mesh.longest_distance
