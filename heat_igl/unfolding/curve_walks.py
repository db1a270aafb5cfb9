"""Distance from curves by walks that begin at exact distances: windows find these up to some edges from the curves.

A walk from farther away ends between two vertices that it can pass, as soon as the distance on the line between both is
smooth: distances and directions at the ends give the distance there, as a cubic polynomial (docs/refinement.md).
"""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.mesh.grouping import next_in_run
from heat_igl.operators import Surface
from heat_igl.runtime import both
from heat_igl.sources import SourceSegments, SourceSet
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.unfolding.directions import PathDirections
from heat_igl.unfolding.exact import ExactSolution, ExactSurface
from heat_igl.unfolding.halves import first_half
from heat_igl.unfolding.numbered import WalkStarts
from heat_igl.unfolding.refinement import Refinement
from heat_igl.unfolding.walks import unknown

__all__ = ["CurveWalks", "are_only_closed_curves"]

# How large the cubic part of the distance between two vertices may be, as a share of the way to the nearer one. With
# ten times as much the mean error of circles on a plane is 0.023 instead of 0.008 %, with half 0.005 %.
_ROUGHNESS = 1e-3
# Straight lines in one face are as long as the distance, but for rounding.
_SAME_DISTANCE = 1e-6
# Places on a segment whose triangles no walk passes, as shares of its length.
_PLACES = (0.02, 0.5, 0.98)
# Ends of segments nearer to each other than this share of the longest segment meet.
_SAME_PLACE = 1e-6


def are_only_closed_curves(sources: SourceSet, surface: Surface, reach: float) -> bool:
    """Whether walks can begin near these sources: closed curves alone, in faces with sides no longer than `reach`.

    Distance must be known up to `reach`, so that it is known at all corners of the faces in which curves run.
    """
    segments, faces, V = sources.segments, surface.faces, surface.V
    has_others = len(sources.vertices) or len(sources.points.faces) or not len(segments.faces)
    if has_others or faces is None or V is None:
        return False
    return bool(faces.l[segments.faces].max() <= reach) and _are_closed(segments, V, faces.F)


def _are_closed(segments: SourceSegments, V: FloatArray, F: IntArray) -> bool:
    """Whether each segment ends at the beginning of the next of the same source, and the last at the first.

    Around the ends of open curves fronts are round, and points that stand for curves give smaller errors.
    """
    start, end = (np.einsum("sc,scx->sx", at, V[F[segments.faces]]) for at in (segments.start, segments.end))
    label = segments.label
    first = np.flatnonzero(np.concatenate([[True], label[1:] != label[:-1]]))
    following = next_in_run(np.arange(len(label)), np.diff(first, append=len(label)))
    apart = np.linalg.norm(start[following] - end, axis=1)
    return bool(apart.max() <= _SAME_PLACE * np.linalg.norm(end - start, axis=1).max())


class CurveWalks:
    """Walks from the exact distances near curves, on a manifold that is oriented.

    Parameters
    ----------
    faces : IntrinsicTriangulation
        The faces that curves refer to.
    refinement : Refinement
        The triangles to walk on.
    directions : PathDirections
        Of that refinement.
    exact : ExactSurface
        Windows on `faces`.
    """

    def __init__(
        self,
        faces: IntrinsicTriangulation,
        refinement: Refinement,
        directions: PathDirections,
        exact: ExactSurface,
    ) -> None:
        self._faces, self._refinement, self._directions, self._exact = faces, refinement, directions, exact
        self._faces_of_rows = refinement.faces

    def distance(
        self, key: FloatArray, segments: SourceSegments, near: ExactSolution, labels: IntArray | None = None
    ) -> FloatArray:
        """Distance (n,) from segments.

        Parameters
        ----------
        key : (n,) float64
            Vertices are visited in ascending order of this.
        segments : SourceSegments
            The sources.
        near : ExactSolution
            Distances from them up to some edges, ``inf`` elsewhere.
        labels : (n,) int64, optional
            Filled with the segment that each distance is measured from, -1 if none is reached.
        """
        refinement, number = self._refinement, self._refinement.number
        starts, barrier = self._starts(segments, near), self._barrier(segments)
        is_known = np.zeros(len(number), bool)
        is_known[starts.row] = True
        # Walks from one half do not need the paths of the other, but for the rows that are known.
        group, order = first_half(self._faces_of_rows, is_known), refinement.order(key)

        def walks(rows: BoolArray) -> AnyArray:
            some = order[rows[order]]
            return refinement.walks(some, starts, barrier=barrier, roughness=_ROUGHNESS)

        # Two arrays of walks, so that it does not matter which thread comes first.
        walk, others = both(lambda: walks(group), lambda: walks(~group))
        walk[~group] = others[~group]
        if labels is not None:
            labels[:] = walk["label"][number]
        return np.asarray(walk["distance"][number])

    def _barrier(self, segments: SourceSegments) -> AnyArray:
        """Which triangles (m,) of the tables hold parts of segments: nothing beyond is nearer than these."""
        barrier = np.zeros(len(self._refinement.face), np.uint8)
        places = [(1 - share) * segments.start + share * segments.end for share in _PLACES]
        faces, _ = self._refinement.triangulation.locate(np.tile(segments.faces, len(places)), np.concatenate(places))
        barrier[self._refinement.face[faces]] = 1
        return barrier

    def _starts(self, segments: SourceSegments, near: ExactSolution) -> WalkStarts:
        """The exact paths of vertices as walks."""
        vertex = np.flatnonzero(np.isfinite(near.distance))
        corner, seen = self._back(segments, near, vertex)
        row = self._refinement.number[vertex]
        walk = unknown(len(vertex))
        label = near.origin.label[vertex]
        walk["distance"], walk["label"], walk["root"] = near.distance[vertex], label, row
        walk["offset"] = segments.offset[label]
        walk["reach"] = walk["distance"] - walk["offset"]
        has_way = (corner >= 0) & (walk["reach"] > 0)
        walk["angle"][has_way], walk["fan"][has_way], walk["total"][has_way] = self._directions.in_fans(
            row[has_way], corner[has_way], seen[has_way]
        )
        return WalkStarts.ascending(row, walk, segments.offset)

    def _back(self, segments: SourceSegments, near: ExactSolution, vertex: IntArray) -> tuple[IntArray, FloatArray]:
        """Corners (k,) of the faces at vertices (k,) in which the paths begin, -1 if unknown; and at which angle.

        The angle is that from the side to the next corner.
        """
        entered, crossing = near.origin.entered[vertex], near.origin.crossing[vertex]
        corner, seen = entered.copy(), np.zeros(len(vertex))
        over = entered >= 0
        half_edge, l = entered[over], self._faces.l.ravel()
        fx, fy = apex(l[half_edge], l[previous_half_edge(half_edge)], l[next_half_edge(half_edge)])
        seen[over] = np.arctan2(fy * crossing[over], fx * (fx - crossing[over]) + fy * fy)
        # In the same face.
        place = np.full(self._faces.n, -1)
        place[vertex[~over]] = np.flatnonzero(~over)
        faces, ends = self._exact.located_segments(segments)
        flat = lay_out(self._faces.l[faces]) @ np.array([1, 1j])
        start, end = np.einsum("sec,sc->es", ends, flat)
        away = _nearest(start[:, None], end[:, None], flat) - flat
        v = self._faces.F[faces]
        s, c = np.nonzero((place[v] >= 0) & (np.abs(away) <= near.distance[v] * (1 + _SAME_DISTANCE)))
        side = flat[s, (c + 1) % 3] - flat[s, c]
        which = place[v[s, c]]
        corner[which], seen[which] = 3 * faces[s] + c, np.angle(away[s, c] / side)
        return corner, seen


def _nearest(start: AnyArray, end: AnyArray, places: AnyArray) -> AnyArray:
    """The places on segments that are nearest to other places, all as complex numbers."""
    along = end - start
    squared = np.maximum(np.abs(along) ** 2, np.finfo(float).tiny)
    share = ((places - start) * along.conj()).real / squared
    return np.asarray(start + np.clip(share, 0, 1) * along)
