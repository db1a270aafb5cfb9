"""Large and elongated meshes, where heat in double precision runs out of range unless something is done about it."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import HeatMethodSolver, Mesh, shapes
from heat_igl.operators import operators
from heat_igl.steps import HeatFlow


@pytest.mark.parametrize("laplacian", ["intrinsic-delaunay", "cotan"])
def test_strip_4000_long(laplacian):
    mesh = shapes.strip(4000, 3)
    solver = HeatMethodSolver(mesh, laplacian=laplacian)
    distance = solver.distance(0)
    assert distance[4000] == pytest.approx(4000, rel=0.01)
    assert (np.diff(distance[:4001]) > 0).all()


@pytest.mark.parametrize("backend", ["scipy", "multifrontal"])
def test_heat_keeps_its_relative_accuracy_over_500_decades(backend):
    """Four vertices wide, 4000 cells long: the heat per cell falls by the closed form acosh(1 + h^2 / 2 t)."""
    domain = operators(shapes.strip(4000, 3))
    t = 10.0
    b = np.zeros((domain.n, 9))
    b[::4001, 0] = 1e290  # a row of sources across the end: one-dimensional
    b[:, 1:] = b[:, :1]
    u = HeatFlow(domain, t, backend=backend).solve(b)
    rate = -np.diff(np.log(u[:4001]), axis=0)[100:3900]
    assert u[3900].max() < 1e-200
    np.testing.assert_allclose(rate, np.arccosh(1 + 1 / (2 * t)), rtol=1e-9)


def test_backends_agree_on_the_strip():
    mesh = shapes.strip(4000, 3)
    one, other = (HeatMethodSolver(mesh, backend=name) for name in ("scipy", "multifrontal"))
    for sources in (0, [17, 9000]):
        np.testing.assert_allclose(one.distance(sources), other.distance(sources), rtol=0, atol=1e-9 * 4000)


def test_grid_450_from_a_corner():
    unit = shapes.grid(449)
    mesh = Mesh(unit.V * 449, unit.F)
    exact = np.linalg.norm(mesh.V, axis=1)
    distance = HeatMethodSolver(mesh).distance(0)
    assert (np.abs(distance - exact)[1:] / exact[1:]).mean() < 0.01
    # Along diagonals heat falls faster than along rows, the more so the smaller t is.
    assert distance[-1] == pytest.approx(449 * np.sqrt(2), rel=0.015)
    at_the_papers_time = HeatMethodSolver(mesh, t_coef=1).distance(0)
    assert (np.abs(at_the_papers_time - exact)[1:] / exact[1:]).mean() < 0.006
    assert at_the_papers_time[-1] == pytest.approx(449 * np.sqrt(2), rel=0.01)


@pytest.mark.slow
def test_icosphere_of_655362_vertices():
    mesh = shapes.icosphere(8)
    assert mesh.n_vertices == 655_362
    exact = np.arccos(np.clip(mesh.V @ mesh.V[0], -1, 1))
    distance = HeatMethodSolver(mesh).distance(0)
    assert (np.abs(distance - exact)[1:] / exact[1:]).mean() < 0.004
    assert np.abs(distance - exact).max() < 0.01 * np.pi
