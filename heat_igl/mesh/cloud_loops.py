"""Small gaps between the triangles of a cloud, filled in space: in creases no tangent plane shows them."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.cloud.loop_filling import filling_triangles
from heat_igl.mesh.connectivity import connected_components, facets
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["with_loops_filled"]

# Largest radius of a circle around a gap, in shares of the distance of the farthest neighbour, as for gaps in planes.
_LARGEST_GAP = 0.9
# Cosine of the angle to the next triangle above which the two lie on each other.
_MOST_FOLDED = 0.99
# Triangles of a part for each one that fills its gaps: with fewer, it is the border of the part that was filled.
_PER_FILLED = 10


def with_loops_filled(P: FloatArray, F: IntArray, reach: FloatArray, is_settled: BoolArray) -> IntArray:
    """The triangles F (m, 3) int32, and others in small gaps all around which points have two outer edges.

    Parameters
    ----------
    P : (n, 3) float64
        The points.
    F : (m, 3) int32
        Triangles that are a surface.
    reach : (n,) float64
        See `Neighbourhoods`.
    is_settled : (n,) bool
        Points without gaps around them.
    """
    n = len(P)
    near_gaps = F[~is_settled[F].all(axis=1)]
    found = facets(near_gaps, n)
    is_outer = (found.n_faces == 1) & ~is_settled[found.vertices].any(axis=1)
    if not is_outer.any():
        return F
    number = np.cumsum(is_outer) - 1
    ends = found.vertices[is_outer].astype(np.int32)
    opposite = np.empty(len(ends), np.int32)
    is_side = is_outer[found.of_face]
    opposite[number[found.of_face[is_side]]] = near_gaps[is_side]
    filled = filling_triangles(
        P,
        ends,
        opposite,
        _two_edges_at(ends, n),
        _LARGEST_GAP * reach,
        found.vertices[:, 0] * n + found.vertices[:, 1],
        _MOST_FOLDED,
    )
    if not len(filled):
        return F
    part = connected_components(F, n)
    sizes, gains = (np.bincount(part[of[:, 0]], minlength=n) for of in (F, filled))
    return np.concatenate([F, filled[(sizes >= _PER_FILLED * gains)[part[filled[:, 0]]]]])


def _two_edges_at(ends: AnyArray, n: int) -> AnyArray:
    """The edges (n, 2) int32 at points that have two of the edges (k, 2), and -1 at others."""
    order = np.argsort(ends.ravel(), kind="stable")
    point = ends.ravel()[order]
    has_two = np.bincount(point, minlength=n) == 2
    at = np.full((n, 2), -1, np.int32)
    at[has_two] = order[has_two[point]].reshape(-1, 2) // 2
    return at
