"""Windows: the intervals of edges that a source sees through unfolded triangles.

A window is an interval of an edge, with the position of the source when all triangles on the way are laid out in the
plane of the next. Rays from a point meet in the point; rays from a segment are parallel, as if from a point at
infinity. One homogeneous point describes both. docs/sources.md derives the steps.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import Adjacency, apex
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["ROUNDING", "SeenVertices", "Windows", "cross", "enter", "joined"]

# Rounding of positions in unfolded triangles, as a share of an edge: a ray that misses a vertex by less goes through
# the vertex, and a narrower window has no rays. Each triangle on the way adds some roundings of 1e-16, on slivers times
# the ratio of their sides.
ROUNDING = 1e-10
# Straight lines that are not the shortest paths are dropped once they are longer by this factor than by way of a
# vertex. With 1 half of the time that remains is saved too, but some lines are lost that are too long by 1 % only.
_DETOUR = 1.05


class SeenVertices(NamedTuple):
    """Vertices that see a source in a straight line; a vertex may come several times.

    Attributes
    ----------
    vertex : (k,) int64
        The vertices.
    distance : (k,) float64
        Length of the line.
    offset : (k,) float64
        Value at which distance begins at the source.
    label : (k,) int64
        The source.
    entered, share : (k,) int64, (k,) float64, or None
        The half-edge opposite the vertex that the line crosses, and how far from its tail as a share of its length;
        None for lines inside a face.
    """

    vertex: IntArray
    distance: FloatArray
    offset: FloatArray
    label: IntArray
    entered: IntArray | None = None
    share: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows on half-edges, each in the frame of the face that it enters.

    In this frame the edge runs from the origin along the first axis, and the face lies above it. The source is below or
    on the axis, at (x, y) / w. For w = 0 it is a line in the direction (x, y), and the distance of a position P is
    ``-(x, y) P - level``. Arrays of shape (k,).

    Attributes
    ----------
    half_edge : int64
        The half-edge of the face that the window enters.
    x, y, w : float64
        Homogeneous coordinates of the source; w is 0 or 1.
    level : float64
        Offset of the line of sources; 0 for a point.
    low, high : float64
        Ends of the interval, from 0 to the length of the edge.
    label : int64
        The source.
    offset : float64
        Value at which distance begins at the source.
    """

    half_edge: IntArray
    x: FloatArray
    y: FloatArray
    w: FloatArray
    level: FloatArray
    low: FloatArray
    high: FloatArray
    label: IntArray
    offset: FloatArray

    def __len__(self) -> int:
        return len(self.half_edge)

    def at(self, chosen: AnyArray) -> Windows:
        """Some of the windows, by a mask or by indices."""
        return Windows(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def nearest(self) -> FloatArray:
        """Distance (k,) of the nearest point of each window."""
        beside = np.where(self.x < self.low, self.low - self.x, np.where(self.x > self.high, self.x - self.high, 0.0))
        to_point = np.hypot(beside, self.y)
        to_line = np.minimum(-self.x * self.low, -self.x * self.high) - self.level
        return np.asarray(np.where(self.w > 0, to_point, to_line))

    def distance(self, px: FloatArray, py: FloatArray) -> FloatArray:
        """Distance (k,) of a position in the frame of each window."""
        to_point = np.hypot(px - self.x, py - self.y)
        return np.asarray(np.where(self.w > 0, to_point, -self.x * px - self.y * py - self.level))

    def are_nearer_than(self, tail: FloatArray, head: FloatArray, base: FloatArray) -> BoolArray:
        """Which windows (k,) hold a place to which a line is not much longer than the way along the edge from an end.

        Distance grows by no more than the way along the edge, so that one comparison for each end is enough (Xin and
        Wang 2009). `tail` and `head` (k,) are the values at the ends, and `base` (k,) the length of the edge.
        """
        on_edge = np.zeros(len(self))
        by_tail = _DETOUR * (tail + self.high) < self.offset + self.distance(self.high, on_edge)
        by_head = _DETOUR * (head + base - self.low) < self.offset + self.distance(self.low, on_edge)
        return np.asarray(~(by_tail | by_head))


def joined(parts: list[Windows]) -> Windows:
    """All windows of several parts."""
    return Windows(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Windows)))


def enter(leaving: Windows, corners: FloatArray, adjacency: Adjacency) -> Windows:
    """Take windows from the faces that they leave to the faces behind; none at the boundary.

    Parameters
    ----------
    leaving : Windows
        With the half-edges of the faces left, in the frames of `corners`; `low` and `high` are shares of the edge, from
        0 at the tail of the half-edge to 1 at the head.
    corners : (k, 3, 2) float64
        Corners of the faces left.
    adjacency : Adjacency
        Of the triangulation.
    """
    which, entered, aligned = adjacency.behind(leaving.half_edge)
    leaving, corners = leaving.at(which), corners[which]
    rows, c = np.arange(len(which)), leaving.half_edge % 3
    tail, head, opposite = corners[rows, (c + 1) % 3], corners[rows, (c + 2) % 3], corners[rows, c]
    length = adjacency.triangulation.l.ravel()[leaving.half_edge]
    origin = np.where(aligned[:, None], head, tail)
    other = np.where(aligned[:, None], tail, head)
    e = (other - origin) / np.maximum(length, np.finfo(float).tiny)[:, None]
    normal = np.stack([-e[:, 1], e[:, 0]], axis=1)
    inward = np.einsum("kx,kx->k", normal, opposite - origin) > 0
    normal[inward] *= -1
    S = np.stack([leaving.x, leaving.y], axis=1)
    relative = S - leaving.w[:, None] * origin
    low, high = leaving.low, leaving.high
    windows = replace(
        leaving,
        half_edge=entered,
        x=np.einsum("kx,kx->k", relative, e),
        y=np.minimum(np.einsum("kx,kx->k", relative, normal), 0.0),
        level=np.where(leaving.w > 0, 0.0, leaving.level + np.einsum("kx,kx->k", S, origin)),
        low=length * np.where(aligned, 1 - high, low),
        high=length * np.where(aligned, 1 - low, high),
    )
    # A ray along the edge reaches only the vertices at the ends, and the corners already see those.
    return windows.at((high - low > ROUNDING) & (windows.y < 0))


def cross(windows: Windows, adjacency: Adjacency) -> tuple[Windows, SeenVertices]:
    """Take windows through the faces that they enter.

    Returns
    -------
    windows : Windows
        In the faces behind the other two sides.
    seen : SeenVertices
        The corners opposite the windows that lie between their outermost rays.
    """
    tri = adjacency.triangulation
    g, k = np.divmod(windows.half_edge, 3)
    rows = np.arange(len(windows))
    base = tri.l[g, k]
    ax, ay = apex(base, tri.l[g, (k + 2) % 3], tri.l[g, (k + 1) % 3])
    corners = np.zeros((len(rows), 3, 2))
    corners[rows, k, 0], corners[rows, k, 1] = ax, ay
    corners[rows, (k + 2) % 3, 0] = base
    # The line from the source to the far corner crosses the edge at x.
    x = ax - ay * (windows.x - windows.w * ax) / (windows.y - windows.w * ay)
    room = ROUNDING * base
    is_seen = (x >= windows.low - room) & (x <= windows.high + room)
    seen = SeenVertices(
        tri.F[g[is_seen], k[is_seen]],
        windows.distance(ax, ay)[is_seen],
        windows.offset[is_seen],
        windows.label[is_seen],
        windows.half_edge[is_seen],
        (x / base)[is_seen],
    )
    behind = []
    # Rays left of x leave through the side from the far corner to the origin, rays right of x through the other side.
    for c, low, high in (
        ((k + 2) % 3, windows.low, np.minimum(windows.high, x)),
        ((k + 1) % 3, np.maximum(windows.low, x), windows.high),
    ):
        tail, head = corners[rows, (c + 1) % 3], corners[rows, (c + 2) % 3]
        ends = [_crossing(windows, at, tail, head) for at in (low, high)]
        first, last = np.minimum(*ends), np.maximum(*ends)
        lit = (high > low) & np.isfinite(first) & np.isfinite(last)
        leaving = replace(windows, half_edge=3 * g + c, low=first, high=last).at(lit)
        behind.append(enter(leaving, corners[lit], adjacency))
    return joined(behind), seen


def _crossing(windows: Windows, at: FloatArray, tail: FloatArray, head: FloatArray) -> FloatArray:
    """Share (k,) of a side, from `tail` to `head`, at which the ray through (`at`, 0) crosses it."""
    dx, dy = windows.w * at - windows.x, -windows.y
    ex, ey = head[:, 0] - tail[:, 0], head[:, 1] - tail[:, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        # (at, 0) + r d = tail + share e, solved for the share.
        share = ((at - tail[:, 0]) * dy + tail[:, 1] * dx) / (ex * dy - ey * dx)
    return np.asarray(np.clip(share, 0, 1))
