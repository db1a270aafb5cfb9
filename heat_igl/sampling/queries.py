"""Distances from single vertices, the queries that all of the room is made of."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.sources import vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, IntArray

__all__ = ["checked_vertices", "distance_rows"]

# Rows of distances in memory at a time.
_BLOCK = 8


def checked_vertices(name: str, vertices: ArrayLike, n: int, distinct: bool = True) -> IntArray:
    """Indices of `vertices`, in the given order.

    Parameters
    ----------
    name : str
        Name of the argument, for messages.
    vertices : (k,) array_like of int, or (n,) mask of bool
        Vertices, validated like sources.
    n : int
        Number of vertices of the domain.
    distinct : bool
        Whether a vertex may come only once.

    Raises
    ------
    SourceError
        If an entry is no vertex, or comes twice though it should not.
    """
    array: AnyArray = np.atleast_1d(np.asarray(vertices))
    if array.dtype.kind == "b":
        return vertex_sources(array, n)
    try:
        sorted_once = vertex_sources(array, n)
    except SourceError as error:
        raise SourceError(f"{name}: {error}") from None
    if distinct and len(sorted_once) < len(array):
        values, counts = np.unique(array, return_counts=True)
        raise SourceError(f"{name} must be distinct, but vertex {values[counts > 1][0]} is there twice")
    return array.astype(np.int64)


def distance_rows(solver: HeatMethodSolver, vertices: IntArray) -> Iterator[AnyArray]:
    """Distances (n,) from each of `vertices`, solved in blocks."""
    for start in range(0, len(vertices), _BLOCK):
        yield from solver.distances([[int(v)] for v in vertices[start : start + _BLOCK]])
