"""The command ``heat-igl demo``: exact distance on one mesh, heat and MeshLab compared with it, files and a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from heat_igl.errors import MissingExtraError
from heat_igl.io import read_mesh, write_mesh
from heat_igl.validation import ValidationRow, shapes, validate
from heat_igl.validation.shapes import bunny_path as sample_mesh

__all__ = ["demonstrate", "sample_mesh"]  # the notebooks begin with the file

_SOURCE = 1234  # on the bunny's haunch: most of the surface is visible from there


def demonstrate(out: Path) -> list[tuple[str, str]]:
    """Compute distance on the bunny, compare heat and MeshLab with it, and write a PLY and a PNG file to a directory.

    Without pymeshlab, which ships the bunny, the mesh is a sphere. Returns rows for printing: timings, errors, paths.
    """
    from heat_igl.drawing import plot

    path = sample_mesh()
    name = "bunny" if path else "sphere"
    ply, png = out / f"{name}.ply", out / f"{name}.png"
    mesh = read_mesh(path) if path else shapes.icosphere(5)
    rows = [(name, f"{mesh.n_vertices} vertices, {mesh.n_faces} triangles")]
    if path is None:
        rows.append(("note", "no bunny, since pymeshlab is missing (pip install pymeshlab); taking a sphere"))
    report = validate(mesh, _SOURCE, ["exact", "heat", "meshlab"])
    phi = report.distances["exact"][0]
    rows.append(("farthest", f"{phi.max():.4f} from vertex {_SOURCE}"))
    rows += [(row.method, _described(row)) for row in report.rows]
    write_mesh(ply, mesh, distance=phi)
    rows.append(("wrote", f"{ply} (distance as vertex attribute)"))
    try:
        plot(mesh, phi, sources=_SOURCE).save(png)
    except MissingExtraError as error:
        return [*rows, ("picture", f"left out: {error}")]
    return [*rows, ("wrote", f"{png} (isolines)")]


def _described(row: ValidationRow) -> str:
    """What a method costs, and its error if it has one."""
    if row.errors is None:
        return f"left out: {row.failure}"
    text = f"{row.precompute_seconds:.3f} s once, {row.solve_seconds:.3f} s per distance"
    if not row.errors.maximum:
        return f"{text}, exact"
    error, largest = 100 * np.array([row.errors.mean, row.errors.l_infinity])
    return f"{text}, error {error:.3f} % in the mean, at most {largest:.2f} % of the largest distance"
