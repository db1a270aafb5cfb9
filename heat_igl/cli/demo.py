"""The command ``heat-igl demo``: exact distance on one mesh, heat and MeshLab compared with it, files and a picture."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from heat_igl import reference
from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.geodesic import GeodesicSolver
from heat_igl.heat import HeatMethodSolver
from heat_igl.io import read_mesh, write_mesh
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray
from heat_igl.validation import shapes
from heat_igl.validation.shapes import bunny_path as sample_mesh

__all__ = ["demonstrate", "sample_mesh"]

_SOURCE = 1234  # on the bunny's haunch: most of the surface is visible from there
_Rows = list[tuple[str, str]]


def demonstrate(out: Path) -> _Rows:
    """Compute distance on the bunny, compare heat and MeshLab with it, and write a PLY and a PNG file to a directory.

    Without pymeshlab, which ships the bunny, the mesh is a sphere. Returns rows for printing: timings, errors, paths.
    """
    path = sample_mesh()
    name = "bunny" if path else "sphere"
    ply, png = out / f"{name}.ply", out / f"{name}.png"
    rows: _Rows = []
    if path is None:
        rows.append(("note", "no bunny, since pymeshlab is missing (pip install pymeshlab); taking a sphere"))
    start = time.perf_counter()
    mesh = read_mesh(path) if path else shapes.icosphere(5)
    rows.append((name, f"{mesh.n_vertices} vertices, {mesh.n_faces} triangles ({_since(start)} to read or make)"))

    start = time.perf_counter()
    solver = GeodesicSolver(mesh)
    rows.append(("preparation", f"{_since(start)} ({solver.plan})"))
    start = time.perf_counter()
    phi = solver.distance(_SOURCE)
    rows.append(("one distance", f"{_since(start)} from vertex {_SOURCE}, farthest {phi.max():.4f}"))
    start = time.perf_counter()
    heat = HeatMethodSolver(mesh)
    rows.append(("preparation of heat", f"{_since(start)} ({heat.diagnostics.backend})"))
    start = time.perf_counter()
    by_heat = heat.distance(_SOURCE)
    rows.append(("one distance by heat", _since(start)))
    # By windows: exact.
    rows.append(("error of heat", _error(by_heat, phi)))
    try:
        rows.append(("error of MeshLab", _error(reference.meshlab(mesh, _SOURCE), phi)))
    except (MissingExtraError, ReferenceSolverError) as error:
        rows.append(("MeshLab", f"left out: {error}"))
    write_mesh(ply, mesh, distance=phi)
    rows.append(("wrote", f"{ply} (distance as vertex attribute)"))
    rows.append(_drawn(png, mesh, phi))
    return rows


def _since(start: float) -> str:
    return f"{time.perf_counter() - start:.3f} s"


def _error(distance: FloatArray, exact: FloatArray) -> str:
    away = exact > 0
    relative = np.abs(distance[away] / exact[away] - 1)
    largest = float(np.abs(distance - exact).max() / exact.max())
    return f"{100 * relative.mean():.3f} % in the mean, at most {100 * largest:.2f} % of the largest distance"


def _drawn(path: Path, mesh: Mesh, phi: FloatArray) -> tuple[str, str]:
    from heat_igl.drawing import plot

    try:
        plot(mesh, phi, sources=_SOURCE).save(path)
    except MissingExtraError as error:
        return "picture", f"left out: {error}"
    return "wrote", f"{path} (isolines)"
