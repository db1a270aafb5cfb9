"""What a source is: where the distance is zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.typing import AnyArray, IntArray

__all__ = ["Sources", "vertex_sources"]

Sources = int | np.integer[Any] | Sequence[int] | Sequence[bool] | AnyArray

_ACCEPTED = "a vertex index, a sequence of vertex indices, or a boolean mask with one entry per vertex"


def vertex_sources(sources: Sources, n: int) -> IntArray:
    """The vertices that `sources` names, ascending, each once.

    Parameters
    ----------
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices; repeated ones count once.
    n : int
        Number of vertices of the mesh.

    Returns
    -------
    (k,) int64
        At least one vertex index in ``range(n)``.

    Raises
    ------
    SourceError
        If there is no source, an index is not in ``range(n)``, the mask has the wrong length, or `sources` is not
        made of integers or booleans.
    """
    try:
        array = np.atleast_1d(np.asarray(sources))
    except ValueError:
        raise SourceError(f"sources must be {_ACCEPTED}, not a ragged sequence") from None
    if array.ndim != 1:
        raise SourceError(f"sources must be {_ACCEPTED}, but it has shape {array.shape}")
    if not len(array):
        raise SourceError("sources is empty: name at least one vertex")
    if array.dtype.kind == "b":
        if len(array) != n:
            raise SourceError(f"the mask sources has {len(array)} entries, but the mesh has {n} vertices")
        if not array.any():
            raise SourceError("the mask sources selects no vertex: set at least one entry")
        return np.flatnonzero(array)
    if array.dtype.kind not in "iu":
        raise SourceError(f"sources must be {_ACCEPTED}, not {_first_of_wrong_type(array)}")
    outside = (array < 0) | (array >= n)
    if outside.any():
        first = int(np.flatnonzero(outside)[0])
        raise SourceError(
            f"sources[{first}] = {array[first]} is no vertex ({int(outside.sum())} of {len(array)} are not): the mesh "
            f"has {n} vertices, so indices run from 0 to {n - 1}"
        )
    return np.asarray(np.unique(array), dtype=np.int64)


def _first_of_wrong_type(array: AnyArray) -> str:
    if array.dtype.kind == "f":
        return f"floats such as {array[0]}; convert with int()"
    return f"{array.dtype} such as {array.ravel()[0]!r}"
