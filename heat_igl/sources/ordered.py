"""Vertices to which values belong: in the order in which they are named, with repetitions."""

from __future__ import annotations

import numpy as np

from heat_igl.sources.specification import Sources, vertex_sources
from heat_igl.typing import AnyArray, IntArray

__all__ = ["ordered_vertices"]


def ordered_vertices(sources: Sources, n: int, name: str = "sources") -> IntArray:
    """The vertices (k,) that `sources` names, in their order; arguments and errors as for `vertex_sources`."""
    vertex_sources(sources, n, name)  # which checks them
    array: AnyArray = np.atleast_1d(np.asarray(sources))
    return np.flatnonzero(array) if array.dtype.kind == "b" else array.astype(np.int64)
