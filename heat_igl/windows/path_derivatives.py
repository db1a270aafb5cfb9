"""Derivatives of the lengths of the paths that a query found, by the lengths of the edges.

`heat_igl.kernels.windows.derivatives` derives them. A path is known by how it begins at each vertex, its *way*:
along an edge, or straight across the opposite side of a face, as far as the next vertex on the path;
from there on it is that vertex's own path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import HalfEdges
from heat_igl.kernels.windows import derivatives as kernels
from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["Change", "Paths", "Places", "Starts", "Ways"]

_AT_SOURCE, _ALONG_EDGE, _IN_FACE, _ACROSS = range(4)


class Places(NamedTuple):
    """Source points in the triangles, one on a side once for each triangle there.

    Attributes
    ----------
    faces, barycentric, point : (e,) int64, (e, 3) float64, (e,) int64
        Triangle, coordinates, and which source point it is.
    offset : (e,) float64
        The distance at which the point starts.
    """

    faces: IntArray
    barycentric: FloatArray
    point: IntArray
    offset: FloatArray

    @classmethod
    def none(cls) -> Places:
        """No points."""
        return cls(np.empty(0, np.int64), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0))


class Starts(NamedTuple):
    """What paths start from: vertices and points, and the distance at which each starts."""

    vertices: IntArray
    offsets: FloatArray
    points: SurfacePoints | None
    point_offsets: FloatArray | None

    @classmethod
    def of(cls, sources: SourceSet) -> Starts:
        """Those of a set of sources."""
        points = sources.points
        places = SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None
        return cls(sources.vertices, sources.vertex_offset, places, points.offset if places is not None else None)


class Ways(NamedTuple):
    """How the path of each of n vertices begins.

    Attributes
    ----------
    distance : (n,) float64
        Length of the path, ``inf`` where there is none.
    entered : (n,) int64
        The half-edge opposite the vertex that the path crosses first, or -1.
    share : (n,) float64
        How far from the tail of that half-edge, as a share of its length.
    reach : (n,) float64
        Length of the straight line to the next vertex on the path, or to the source point.
    """

    distance: FloatArray
    entered: IntArray
    share: FloatArray
    reach: FloatArray


class Change(NamedTuple):
    """The derivative of a weighted sum of distances.

    Attributes
    ----------
    by_side : (m, 3) float64
        By the length of the side opposite each corner; an edge of two faces changes both of its sides.
    by_place : (e, 3) float64 or None
        By the coordinates of each entry of `Places`, up to a constant in each row; None without points.
    by_given : (m', 3) float64 or None
        By the sides of the faces before any flip, directly.
    by_t : float
        By the time step.
    by_given_place : (p, 3) float64 or None
        By the coordinates of source points in the faces before any flip, directly.
    """

    by_side: FloatArray
    by_place: FloatArray | None = None
    by_given: FloatArray | None = None
    by_t: float = 0.0
    by_given_place: FloatArray | None = None


class Paths:
    """The shortest paths of one query.

    Parameters
    ----------
    triangles : HalfEdges
        m triangles on n vertices.
    places : Places
        The source points.
    ways : Ways
        How each path begins; those that run along an edge, or to a point in a face of the vertex, are found here.
    is_source : (n,) bool
        Vertices whose paths end there.

    Attributes
    ----------
    is_lost : (n,) bool
        Vertices that are reached and whose path was not found. Their derivative is 0.
    """

    def __init__(self, triangles: HalfEdges, places: Places, ways: Ways, is_source: BoolArray) -> None:
        n, e = len(ways.distance), len(places.faces)
        self.n = n
        distance = np.concatenate([ways.distance, places.offset])
        kind = np.full(n, _ACROSS, np.uint8)
        entered, share = ways.entered.astype(np.int32), ways.share.copy()
        starts = is_source | np.isinf(ways.distance)
        kind[starts] = _AT_SOURCE
        short = np.flatnonzero((entered < 0) & ~starts)
        side, self.is_lost = _along_edges(triangles, distance, short), np.zeros(n, bool)
        entry, corner = _in_faces(triangles, places, ways.distance, short)
        kind[short] = np.where(side >= 0, _ALONG_EDGE, np.where(entry >= 0, _IN_FACE, _AT_SOURCE))
        entered[short] = np.where(side >= 0, side, entry)
        share[short] = corner
        self.is_lost[short] = (side < 0) & (entry < 0)
        first = np.full(len(triangles.vertex) // 3 if e else 0, -1, np.int32)
        following = np.full(e, -1, np.int32)
        by_face = np.argsort(places.faces, kind="stable")
        first[places.faces[by_face][::-1]] = by_face[::-1]
        same = places.faces[by_face][1:] == places.faces[by_face][:-1]
        following[by_face[:-1][same]] = by_face[1:][same]
        self._triangles, self.places = triangles, places
        self._points = first, following, np.ascontiguousarray(places.barycentric)
        self._ways = distance, kind, entered, np.ascontiguousarray(share), np.ascontiguousarray(ways.reach)
        self._order = np.argsort(ways.distance, kind="stable").astype(np.int32)

    @property
    def distance(self) -> FloatArray:
        """Length (n,) of each path."""
        return self._ways[0][: self.n]

    def corners(self, faces: IntArray) -> AnyArray:
        """Vertices (k, 3) of some faces."""
        return self._triangles.vertex.reshape(-1, 3)[faces]

    def pull_back(self, weight: FloatArray) -> Change:
        """The derivative of the sum of all distances times `weight` (n,)."""
        e, size = len(self.places.faces), len(self._triangles.vertex)
        handed_on = np.concatenate([weight, np.zeros(e)])
        by_side, by_place = np.zeros(size), np.zeros((e, 3))
        kernels.pull_back(
            self._triangles,
            self._points,
            self._ways,
            self._order,
            handed_on,
            by_side,
            by_place,
            self.is_lost.view(np.uint8),
        )
        return Change(by_side.reshape(-1, 3), by_place if e else None)

    def push_forward(self, by_side: FloatArray, by_place: FloatArray | None = None) -> FloatArray:
        """The derivative (n,) of all distances when the sides (m, 3) change, and the coordinates (e, 3) of `places`."""
        return self._summed(by_side, by_place, np.zeros(self.n + len(self.places.faces)))

    def lengths(self) -> FloatArray:
        """Distances (n,) summed along the paths; 0 where there is none."""
        # A line is homogeneous in the sides (Euler); to it comes the distance at which the source starts.
        distance, kind = self._ways[:2]
        starts = np.where(np.append(kind == _AT_SOURCE, np.ones(len(self.places.faces), bool)), distance, 0.0)
        return self._summed(self._triangles.length, None, np.where(np.isfinite(starts), starts, 0.0))

    def _summed(self, by_side: FloatArray, by_place: FloatArray | None, change: FloatArray) -> FloatArray:
        """Changes of distances (n,) when sides and places change, and distances at the sources by `change` (n + e,)."""
        kernels.push_forward(
            self._triangles,
            self._points,
            self._ways,
            self._order,
            np.ascontiguousarray(by_side).ravel(),
            np.empty((0, 3)) if by_place is None else by_place,
            change,
            self.is_lost.view(np.uint8),
        )
        return change[: self.n]


def _along_edges(triangles: HalfEdges, distance: FloatArray, vertices: IntArray) -> IntArray:
    """The half-edge (k,) along which the path of each of k vertices begins; -1 where none leads to its distance."""
    side = np.full(len(vertices), -1)
    if not len(vertices):
        return side
    place = np.full(len(distance), -1)
    place[vertices] = np.arange(len(vertices))
    half_edge = np.arange(len(triangles.vertex))
    following, preceding = half_edge + 1 - 3 * (half_edge % 3 == 2), half_edge - 1 + 3 * (half_edge % 3 == 0)
    tail, head = triangles.vertex[following], triangles.vertex[preceding]
    best = np.full(len(vertices), np.inf)
    for one, other in ((tail, head), (head, tail)):
        which = np.flatnonzero(place[one] >= 0)
        at, length = place[one[which]], distance[other[which]] + triangles.length[which]
        order = np.argsort(-length, kind="stable")
        found = np.full(len(vertices), np.inf)
        chosen = np.full(len(vertices), -1)
        found[at[order]], chosen[at[order]] = length[order], which[order]
        better = found < best
        best[better], side[better] = found[better], chosen[better]
    side[best > distance[vertices] * (1 + 1e-7)] = -1
    return side


def _in_faces(
    triangles: HalfEdges, places: Places, distance: FloatArray, vertices: IntArray
) -> tuple[IntArray, FloatArray]:
    """The entry of `places` (k,) that the path of each of k vertices ends at inside a face, and the corner there."""
    entry, corner = np.full(len(vertices), -1), np.zeros(len(vertices))
    place = np.full(len(distance), -1)
    place[vertices] = np.arange(len(vertices))
    best = np.full(len(vertices), np.inf)
    for c in range(3):
        at = place[triangles.vertex[3 * places.faces + c]]
        sides = triangles.length.reshape(-1, 3)[places.faces] ** 2
        d = places.barycentric - np.eye(3)[c]
        i, k = d[:, [1, 2, 0]], d[:, [2, 0, 1]]
        length = places.offset + np.sqrt(np.maximum(-(i * k * sides).sum(axis=1), 0.0))
        for j in np.flatnonzero(at >= 0):
            if length[j] < best[at[j]]:
                best[at[j]], entry[at[j]], corner[at[j]] = length[j], j, 3 * places.faces[j] + c
    entry[best > distance[vertices] * (1 + 1e-7)] = -1
    return entry, corner
