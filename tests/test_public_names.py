"""What the package exports, and what users read from its objects."""

from __future__ import annotations

import heat_igl


def test_a_solver_shows_its_time_step_and_operators() -> None:
    solver = heat_igl.HeatMethodSolver(heat_igl.shapes.grid(8))
    assert solver.t > 0
    n, m = 81, 128
    shapes = {name: getattr(solver.operators, name).shape for name in "LMGD"}
    assert shapes["L"] == shapes["M"] == (n, n)
    assert shapes["G"][1] == shapes["D"][0] == n
    assert shapes["G"][0] == shapes["D"][1] in (2 * m, 3 * m)
    assert {getattr(solver.operators, name).format for name in "LMGD"} == {"csc"}


def test_a_mesh_shows_its_parts() -> None:
    mesh = heat_igl.Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert (mesh.V.shape, mesh.F.shape, mesh.n_vertices, mesh.n_faces) == ((3, 3), (1, 3), 3, 1)
    assert mesh.components.tolist() == [0, 0, 0]
    assert isinstance(mesh.report(), heat_igl.MeshReport)
