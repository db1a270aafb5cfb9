"""A mesh that everybody has."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from heat_igl.mesh import Mesh, as_simplices
from heat_igl.validation import shapes


def bunny_path() -> Path | None:
    """Path of the bunny in the pymeshlab wheel, or None without pymeshlab. pymeshlab is not imported."""
    found = importlib.util.find_spec("pymeshlab")
    for folder in (found.submodule_search_locations or []) if found else []:
        for path in (Path(folder, "tests/sample_meshes/bunny.obj"), Path(folder, "sample_meshes/bunny.obj")):
            if path.is_file():
                return path
    return None


def sample_mesh() -> Mesh:
    """A closed surface to try things on: the Stanford bunny, or without pymeshlab, which ships it, a generated shape.

    Returns
    -------
    Mesh
        Connected triangles, over 2500 vertices; without pymeshlab `shapes.blob`.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.sample_mesh()
    >>> report = mesh.report()
    >>> report.n_components, report.n_boundary_loops, mesh.n_vertices > 2500
    (1, 0, True)
    """
    path = bunny_path()
    return shapes.blob(4) if path is None else as_simplices(path)
