"""The faces that hold sources: the corners that points and segments see in them, and windows on their sides."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import Adjacency, lay_out
from heat_igl.sources.source_sets import SourcePoints, SourceSegments
from heat_igl.sources.windows import ROUNDING, SeenVertices, Windows, enter
from heat_igl.typing import FloatArray

__all__ = ["seen_from_points", "seen_from_segments"]

# Places in one face are the same if their coordinates agree to half of one over this.
_SAME_PLACE = 1e9


def seen_from_points(points: SourcePoints, adjacency: Adjacency) -> tuple[list[Windows], list[SeenVertices]]:
    """Windows on the sides of each point's face, and the corners of the face."""
    points = _once(_in_all_faces(points, adjacency))
    f = points.faces
    corners = lay_out(adjacency.triangulation.l[f])
    p = np.einsum("kc,kcx->kx", points.barycentric, corners)
    distance = np.linalg.norm(corners - p[:, None], axis=2)
    F = adjacency.triangulation.F
    seen = [SeenVertices(F[f, c], distance[:, c], points.offset, points.label) for c in range(3)]
    one = np.ones(len(f))
    windows = []
    for c in range(3):
        facing = points.barycentric[:, c] > 0
        leaving = Windows(3 * f + c, p[:, 0], p[:, 1], one, 0 * one, 0 * one, one, points.label, points.offset)
        windows.append(enter(leaving.at(facing), corners[facing], adjacency))
    return windows, seen


def _once(points: SourcePoints) -> SourcePoints:
    """The points, each once in each face: a segment of a curve begins at the end of another."""
    keys = np.column_stack([points.faces, np.rint(points.barycentric * _SAME_PLACE), points.label, points.offset])
    _, first = np.unique(keys, axis=0, return_index=True)
    return SourcePoints(points.faces[first], points.barycentric[first], points.label[first], points.offset[first])


def _in_all_faces(points: SourcePoints, adjacency: Adjacency) -> SourcePoints:
    """The points, those on an edge in each face of the edge, and those in a vertex in each face around it."""
    zero = points.barycentric == 0
    n_zero = zero.sum(axis=1)
    inner = n_zero == 0
    parts = [(points.faces[inner], points.barycentric[inner], np.flatnonzero(inner))]
    on_edge = np.flatnonzero(n_zero == 1)
    if len(on_edge):
        c = np.argmax(zero[on_edge], axis=1)
        parts.append((points.faces[on_edge], points.barycentric[on_edge], on_edge))
        glued, other, aligned = adjacency.behind(3 * points.faces[on_edge] + c)
        on_edge, c = on_edge[glued], c[glued]
        at_tail = points.barycentric[on_edge, (c + 1) % 3]
        at_head = points.barycentric[on_edge, (c + 2) % 3]
        there = np.zeros((len(other), 3))
        rows = np.arange(len(other))
        there[rows, (other + 1) % 3] = np.where(aligned, at_head, at_tail)
        there[rows, (other + 2) % 3] = np.where(aligned, at_tail, at_head)
        parts.append((other // 3, there, on_edge))
    in_vertex = np.flatnonzero(n_zero == 2)
    if len(in_vertex):
        vertex = adjacency.triangulation.F[points.faces[in_vertex], np.argmax(points.barycentric[in_vertex], axis=1)]
        corner, which = adjacency.corners_at(vertex)
        parts.append((corner // 3, np.eye(3)[corner % 3], in_vertex[which]))
    faces, barycentric, which = (np.concatenate(column) for column in zip(*parts, strict=True))
    return SourcePoints(faces, barycentric, points.label[which], points.offset[which])


def seen_from_segments(segments: SourceSegments, adjacency: Adjacency) -> tuple[list[Windows], list[SeenVertices]]:
    """Windows on the sides of each segment's face, in both directions across the segment, and the corners beside it."""
    f = segments.faces
    if not len(f):
        return [], []
    corners = lay_out(adjacency.triangulation.l[f])
    start = np.einsum("kc,kcx->kx", segments.start, corners)
    end = np.einsum("kc,kcx->kx", segments.end, corners)
    along = end - start
    length = np.linalg.norm(along, axis=1)
    along = along / np.maximum(length, np.finfo(float).tiny)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    u = np.einsum("kx,kcx->kc", along, corners - start[:, None])
    v = np.einsum("kx,kcx->kc", across, corners - start[:, None])
    room = ROUNDING * length
    F = adjacency.triangulation.F
    seen = []
    for c in range(3):
        beside = (u[:, c] >= -room) & (u[:, c] <= length + room) & (length > 0)
        seen.append(
            SeenVertices(F[f[beside], c], np.abs(v[beside, c]), segments.offset[beside], segments.label[beside])
        )
    windows = []
    for side in (1.0, -1.0):
        S = -side * across
        for c in range(3):
            low, high = _strip_through(c, side, u, v, length)
            leaving = Windows(
                half_edge=3 * f + c,
                x=S[:, 0],
                y=S[:, 1],
                w=np.zeros(len(f)),
                level=-np.einsum("kx,kx->k", S, start),
                low=low,
                high=high,
                label=segments.label,
                offset=segments.offset,
            )
            lit = (length > 0) & (high > low)
            windows.append(enter(leaving.at(lit), corners[lit], adjacency))
    return windows, seen


def _strip_through(
    c: int, side: float, u: FloatArray, v: FloatArray, length: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Interval of the edge opposite corner `c` through which the strip on one `side` of a segment leaves the face.

    As shares of the edge; the interval is empty if the edge does not face the strip. `u` and `v` (k, 3) are the
    coordinates of the corners along the segment, from the start, and across.
    """
    tail, head = (c + 1) % 3, (c + 2) % 3
    span = u[:, head] - u[:, tail]
    turn = span * (v[:, c] - v[:, tail]) - (v[:, head] - v[:, tail]) * (u[:, c] - u[:, tail])
    outward = side * span * turn < 0
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-u[:, tail] / span, (length - u[:, tail]) / span])
    low, high = np.clip(ends.min(axis=0), 0, 1), np.clip(ends.max(axis=0), 0, 1)
    return low, np.where(outward, high, low)
