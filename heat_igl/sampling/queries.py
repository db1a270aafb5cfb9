"""Distances from single vertices, the queries that all of the room is made of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.geodesic import GeodesicSolver, Solver
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.runtime import TimeLeft
from heat_igl.sources import named_vertices
from heat_igl.typing import AnyArray, ArrayLike, IntArray


def checked_vertices(name: str, vertices: ArrayLike, n: int) -> IntArray:
    """Indices of distinct `vertices`, in the given order; a `SourceError` that calls them `name` for any others."""
    named = named_vertices(cast(Any, vertices), n, name)
    values, counts = np.unique(named, return_counts=True)
    if len(values) < len(named):
        raise SourceError(f"{name} must be distinct, but vertex {values[counts > 1][0]} is there twice")
    return named


def as_solver(solver: Solver | MeshLike) -> Solver:
    """The solver itself, or an object with the same methods; on a mesh a `GeodesicSolver`."""
    if hasattr(solver, "distance") and hasattr(solver, "n_vertices"):
        return cast(GeodesicSolver, solver)
    return GeodesicSolver(as_simplices(cast(MeshLike, solver)))


def distance_rows(solver: Solver, vertices: IntArray) -> Iterator[AnyArray]:
    """Distances (n,) from each of `vertices`, solved in blocks."""
    left = TimeLeft("queries are done", len(vertices))
    for row in solver.iter_distances([[int(v)] for v in vertices]):
        left()
        yield row
