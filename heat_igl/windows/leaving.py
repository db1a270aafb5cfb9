"""Where paths leave sources inside faces: the place on a segment, and the direction there."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import lay_out
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows.tables import Tables
from heat_igl.windows.window_search import Leaving, Searched

__all__ = ["with_places", "with_turns"]


def with_turns(tables: Tables, done: Searched, leaving: Leaving) -> Leaving:
    """How paths leave their roots, with the turns to the first triangles of source points.

    Which triangle a path leaves through does not say by which side of it, if two of them are glued to each other.
    """
    point = done.found.root.astype(np.int64) - tables.n
    row = np.flatnonzero((leaving.corner >= 0) & (point >= 0))
    turn = np.zeros(len(point))
    turn[row] = done.starts.points.turn[point[row]]
    return leaving._replace(turn=turn)


def with_places(tables: Tables, done: Searched, leaving: Leaving) -> Leaving:
    """How the straight last parts of the paths leave their roots, with the places of these.

    Parameters
    ----------
    tables : Tables
        The surface.
    done : Searched
        A search on it.
    leaving : Leaving
        What the search noted.

    Returns
    -------
    Leaving
        By the numbers of the tables. Paths from segments have directions as well. Where there is no path, the place
        is 0.
    """
    root, starts, n = done.found.root.astype(np.int64), done.starts, tables.n
    first_segment = n + len(starts.points.faces)
    has_path, place = leaving.corner >= 0, np.zeros((n, 3))
    row = np.flatnonzero(has_path & (root < n))
    place[row, leaving.corner[row] % 3] = 1.0
    row = np.flatnonzero(has_path & (root >= n) & (root < first_segment))
    place[row] = starts.points.barycentric[root[row] - n]
    row = np.flatnonzero(has_path & (root >= first_segment))
    direction = leaving.direction.copy()
    place[row], direction[row] = _from_segments(tables, done, leaving, row, root[row] - first_segment)
    return Leaving(leaving.corner, direction, place)


def _from_segments(
    tables: Tables, done: Searched, leaving: Leaving, row: IntArray, which: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Places (k, 3) and directions (k, 2) of the paths to vertices (k,) from segments (k,)."""
    segments = done.starts.segments
    sides = tables.edges.length.reshape(-1, 3)[segments.faces]
    # Of each segment, in the plane of the face, as complex numbers.
    corners = lay_out(sides) @ np.array([1, 1j])
    start, end = np.einsum("qec,qc->eq", segments.barycentric, corners)
    length = np.maximum(np.abs(end - start), np.finfo(float).tiny)
    unit = (end - start) / length
    along, side = leaving.direction[row].T
    way = 1j * side * unit[which]
    # Corners of the same face: the nearest place.
    inside = np.flatnonzero(done.found.entered[row] < 0)
    if len(inside):
        i = which[inside]
        at = tables.edges.vertex.reshape(-1, 3)[segments.faces[i]] == row[inside, None]
        ahead = corners[i, at.argmax(axis=1)]
        along[inside] = np.clip(((ahead - start[i]) * unit[i].conj()).real, 0.0, length[i])
        way[inside] = ahead - start[i] - along[inside] * unit[i]
    share = np.clip(along / length[which], 0.0, 1.0)[:, None]
    ends = segments.barycentric[which]
    return (1 - share) * ends[:, 0] + share * ends[:, 1], np.stack([way.real, way.imag], axis=1)
