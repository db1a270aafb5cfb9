"""What is known of the path of each vertex, and the compiled loops that find it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.fans import Tables, aligned
from heat_igl.kernels import sweeping, unfolding
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = [
    "INSIDE",
    "NOT_ASKED",
    "NO_BARRIER",
    "NO_POINTS",
    "WALK",
    "Begins",
    "Points",
    "Rules",
    "sweep",
    "unfold",
    "unknown",
    "views",
]

# What is known of the path of a vertex: its `distance`; the distance of the last bend (or source), `offset`; how far
# that is away in a straight line, `reach`; the direction in which it lies, `angle` in the `fan` of the vertex (-1:
# none, at a source), whose angles sum to `total` (negative: open); the `label` of the source that the path ends at;
# the `root`, the row of that bend or source; and the direction in which the path leaves it, `departure`: an angle in
# the fan of a vertex, and in the face of a source point from the side of corners 0 and 1.
WALK = np.dtype(
    [(name, "f8") for name in ("distance", "offset", "reach", "angle", "total")]
    + [("fan", "i4"), ("label", "i4"), ("departure", "f8"), ("root", "i4"), ("spare", "i4")]
)
# A source inside a face: the next one in the same face, `following` (-1 after the last), and the `row` of the walks
# that stands for it. On a side it is in the face beyond, too, whose side of corners 0 and 1 is turned by `turn` from
# that of the first face.
INSIDE = np.dtype([("barycentric", "f8", 3), ("turn", "f8"), ("following", "i4"), ("row", "i4")])

NO_BARRIER = np.empty(0, np.uint8)


class Points(NamedTuple):
    """Sources inside faces, for walks to end at. One on an edge is listed in the faces on both sides.

    Attributes
    ----------
    first : (m,) int32
        First entry of each face, -1 if it has none; no entries at all where no face has any.
    inside : (e,) `INSIDE`
        The entries.
    """

    first: AnyArray = np.empty(0, np.int32)
    inside: AnyArray = np.empty(0, INSIDE)


class Rules(NamedTuple):
    """When walks accept a path, and bounds of the search.

    Attributes
    ----------
    tolerance : float
        Relative gain below which a path is not straightened further.
    shortfall : float
        A vertex that is by more than this fraction farther than a neighbour promised is searched for a better path.
    max_steps : int
        Triangles that one search may cross.
    max_passes : int
        Passes over vertices that a later one may have improved.
    has_holes : bool
        Whether a closed curve on some component encloses no piece of surface.
    roughness : float
        A path through a place between two vertices is taken if the cubic part of the distance there is at most so large
        as a share of the way to them, see `heat_igl.kernels.between`; it may then be shorter than any on the surface.
        0 takes none.
    """

    tolerance: float
    shortfall: float
    max_steps: int
    max_passes: int
    has_holes: bool
    roughness: float


class Begins(NamedTuple):
    """How the path of each row begins, see `heat_igl.unfolding.path_derivatives.Ways`; empty if that is not asked for.

    Attributes
    ----------
    entered : (n,) int32
        The half-edge over which the path leaves the first face, -1 along an edge.
    share : (n,) float64
        How far along that half-edge, as a share of its length.
    reach : (n,) float64
        Length of the straight part.
    """

    entered: AnyArray = np.empty(0, np.int32)
    share: FloatArray = np.empty(0)
    reach: FloatArray = np.empty(0)


NO_POINTS = Points()
NOT_ASKED = Begins()


def unknown(n: int) -> AnyArray:
    """Walks (n,) of vertices that no path is known of."""
    walk = aligned(n, WALK)
    walk["distance"], walk["fan"], walk["label"] = np.inf, -1, -1
    return walk


def sweep(
    order: AnyArray | None,
    t: Tables,
    d: FloatArray,
    label: AnyArray | None,
    offset: FloatArray,
    group: IntArray,
    is_stale: AnyArray,
    band: float,
) -> float:
    """Lower `d` (n,) to the best planar unfolding over the triangles of each vertex; returns the visits per vertex.

    Parameters
    ----------
    order : (n,) int32 or None
        Vertices, near ones first. None to find them on the way: those next to visited vertices, nearest first.
    t : Tables
        The triangulation.
    d : (n,) float64
        Distances known, ``inf`` where none is; changed in place.
    label : (n,) int32 or None
        The source that each is measured from, -1 for none; None if there is only one. Changed in place.
    offset : (k,) float64
        The distance at which each source begins.
    group : (k,) int64
        What each source is a point of: of one curve, or of nothing else.
    is_stale : (n,) bool
        Vertices to be visited; others only if what they depend on changes.
    band : float
        Without `order`, vertices whose distance differs by less than this may be visited in any order.
    """
    visits: float = sweeping.sweep(order, t, d, label, offset, group, is_stale.view(np.uint8), band)
    return visits


def unfold(
    order: AnyArray,
    t: Tables,
    walk: AnyArray,
    points: Points,
    rules: Rules,
    barrier: AnyArray = NO_BARRIER,
    begins: Begins = NOT_ASKED,
) -> None:
    """Distance by straight paths through strips of triangles, to be read from `walk`.

    Parameters
    ----------
    order : (n,) int32
        Vertices, near ones first. One that comes too early is visited again.
    t : Tables
        The triangulation.
    walk : (n + p,) `WALK`
        What is known of each vertex and of each of p sources inside faces; changed in place. Distance is ``inf`` where
        nothing is known, and where no source is reached.
    points : Points
        The sources inside faces.
    rules : Rules
        When paths are accepted, and bounds of the search.
    barrier : (m,) uint8
        Triangles that no walk passes, since they hold sources that walks do not end at; empty for none.
    begins : Begins
        Filled with how each path begins, unless the arrays are empty.
    """
    unfolding.unfold(order, t, walk, points, rules, barrier, begins)


def views(faces: IntArray, barycentric: FloatArray, F: AnyArray, t: Tables) -> tuple[AnyArray, AnyArray]:
    """How the corners (3 k,) of faces see points in them: their vertices, and their walks to a source of distance 0."""
    vertex, walk = np.empty(3 * len(faces), np.int32), np.zeros(3 * len(faces), WALK)
    unfolding.views(faces.astype(np.int64), np.ascontiguousarray(barycentric), F, t, vertex, walk)
    return vertex, walk
