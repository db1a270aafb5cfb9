"""Large and elongated meshes, where heat in double precision runs out of range unless something is done about it."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import HeatMethodSolver, Mesh, shapes


@pytest.mark.parametrize("laplacian", ["intrinsic-delaunay", "cotan"])
def test_strip_4000_long(laplacian):
    mesh = shapes.strip(4000, 3)
    solver = HeatMethodSolver(mesh, laplacian=laplacian)
    distance = solver.distance(0)
    assert distance[4000] == pytest.approx(4000, rel=0.01)
    assert (np.diff(distance[:4001]) > 0).all()


def test_grid_450_from_a_corner():
    unit = shapes.grid(449)
    mesh = Mesh(unit.V * 449, unit.F)
    exact = np.linalg.norm(mesh.V, axis=1)
    distance = HeatMethodSolver(mesh).distance(0)
    assert (np.abs(distance - exact)[1:] / exact[1:]).mean() < 0.01
    assert distance[-1] == pytest.approx(449 * np.sqrt(2), rel=0.01)


@pytest.mark.slow
def test_icosphere_of_655362_vertices():
    mesh = shapes.icosphere(8)
    assert mesh.n_vertices == 655_362
    exact = np.arccos(np.clip(mesh.V @ mesh.V[0], -1, 1))
    distance = HeatMethodSolver(mesh).distance(0)
    assert (np.abs(distance - exact)[1:] / exact[1:]).mean() < 0.004
    assert np.abs(distance - exact).max() < 0.01 * np.pi
