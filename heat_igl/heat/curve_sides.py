"""The sides of oriented curves on which vertices lie, gaps in the curves, and the segments that close them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import Mesh, SurfaceCurve, connectivity, level_segments
from heat_igl.mesh.connectivity import next_in_run
from heat_igl.sources import OrientedSet
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Ends of curves nearer to each other than this share of the mean edge length meet.
_SAME_PLACE = 1e-6
#: The zero curve of an integrated distance runs within a quarter of an edge of the curves. It counts as the closing of
#: a gap where it is farther than this from all of them, in mean edge lengths.
IN_GAP = 1.0
# Farther than any distance, and not infinite, so that none of it is 0.
_FAR = 1e300
# If a vertex sees the nearest place of a segment almost along the segment, rounding decides the side.
_LEAST_SINE = 1e-6
# Straight lines in one face are as long as the distance, but for rounding.
_SAME_DISTANCE = 1e-6
# Share by which the sides seen from the vertices of a region have to agree. A curve that does not separate, as around
# the handle of a torus, is seen from both sides.
_AGREED = 0.5


def has_gaps(mesh: Mesh, sources: OrientedSet) -> bool:
    """Whether a curve ends, inside the mesh, at no place at which one begins; points always have gaps."""
    if len(sources.point_faces):
        return True
    begin, end = _ends(mesh, sources)
    tolerance = _SAME_PLACE * float(mesh.edge_lengths.mean())
    # Most segments are followed by the next of their curve, and the last by the first.
    following = next_in_run(np.arange(len(begin)), np.unique(sources.label, return_counts=True)[1])
    apart = np.linalg.norm(begin[following] - end, axis=1) > tolerance
    ends, begins = np.flatnonzero(apart), following[apart]
    loose_ends = ends[~_on_boundary(mesh, sources.faces[ends], sources.end[ends])]
    loose_begins = begins[~_on_boundary(mesh, sources.faces[begins], sources.start[begins])]
    if len(loose_ends) != len(loose_begins):
        return True
    if not len(loose_ends):
        return False
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    to_begin = cKDTree(begin[loose_begins]).query(end[loose_ends])[0]
    to_end = cKDTree(end[loose_ends]).query(begin[loose_begins])[0]
    return bool(max(to_begin.max(), to_end.max()) > tolerance)


def total_length(mesh: Mesh, curves: OrientedSet | SurfaceCurve) -> float:
    """Length of all segments, whether or not each begins where the one before ends."""
    return float(np.linalg.norm(np.subtract(*_ends(mesh, curves)), axis=1).sum())


def _ends(mesh: Mesh, curves: OrientedSet | SurfaceCurve) -> tuple[FloatArray, FloatArray]:
    """Positions (s, 3) in space at which the segments begin and end."""
    corners = mesh.V[mesh.F[curves.faces]]
    return np.einsum("sc,scx->sx", curves.start, corners), np.einsum("sc,scx->sx", curves.end, corners)


def _on_boundary(mesh: Mesh, faces: IntArray, barycentric: FloatArray) -> BoolArray:
    """Which points (k,) lie on the boundary of the mesh."""
    on_side = (barycentric == 0) & (mesh.facets.n_faces[mesh.facets.of_face[faces]] == 1)
    in_corner = (barycentric == 1) & mesh.boundary[mesh.F[faces]]
    return np.asarray((on_side | in_corner).any(axis=1))


def zero_curve_in_gaps(mesh: Mesh, phi: FloatArray, distance: FloatArray, h: float) -> SurfaceCurve | None:
    """The zero curve of `phi` (n,) where it is far from the curves that `distance` (n,) is from; None if nowhere.

    Distances may be ``inf`` beyond `IN_GAP` edges and the longest edge: no corner of a face near the curves is farther.
    """
    faces, start, end, _ = level_segments(mesh, phi, 0.0)
    # Where no distance is known, it is large.
    middle = np.einsum("sc,sc->s", (start + end) / 2, np.minimum(distance, _FAR)[mesh.F[faces]])
    kept = (middle > IN_GAP * h) & (start != end).any(axis=1)
    return SurfaceCurve(faces[kept], start[kept], end[kept]) if kept.any() else None


def vertices_on(mesh: Mesh, sources: OrientedSet) -> BoolArray:
    """Which vertices (n,) are corners of the curves."""
    on_curve = np.zeros(mesh.n_vertices, bool)
    for barycentric in (sources.start, sources.end):
        in_vertex = (barycentric == 0).sum(axis=1) == 2
        on_curve[mesh.F[sources.faces[in_vertex], barycentric[in_vertex].argmax(axis=1)]] = True
    return on_curve


def left_of_closed(
    mesh: Mesh, triangulation: IntrinsicTriangulation, sources: OrientedSet
) -> tuple[BoolArray, BoolArray]:
    """Which vertices (n,) are on the left of curves without gaps, and of which vertices (n,) that is known.

    The surface without the curves falls into regions. Vertices are in one if an edge joins them that no curve meets; so
    are a face that no curve crosses and its vertices off the curves, and two such faces if no curve runs along the edge
    between them. A region is on the side of the segments that are seen from inside. Nothing is known of vertices on
    curves, of regions that see both sides, and of components without a curve. `triangulation` is the faces of the mesh.
    """
    n, m, twin = mesh.n_vertices, mesh.n_faces, triangulation.twin
    edge = mesh.facets.of_face
    is_met, is_divided = np.zeros((2, len(mesh.edges)), bool)
    for barycentric in (sources.start, sources.end):
        on_edge = (barycentric == 0).sum(axis=1) == 1
        is_met[edge[sources.faces[on_edge], barycentric[on_edge].argmin(axis=1)]] = True
    along = (sources.start == 0) & (sources.end == 0)
    is_along, opposite = along.any(axis=1), along.argmax(axis=1)
    is_divided[edge[sources.faces[is_along], opposite[is_along]]] = True
    is_whole = np.ones(m, bool)
    is_whole[sources.faces[~is_along]] = False
    # Regions: faces are numbered after the vertices. Whole ones away from the curves add nothing to their edges.
    free, is_beside = ~vertices_on(mesh, sources), np.zeros(n, bool)
    is_beside[mesh.F[sources.faces]] = True
    a, b, c = mesh.F.T
    near = np.flatnonzero(is_whole & (is_beside[a] | is_beside[b] | is_beside[c]))
    at, corner = np.nonzero(free[mesh.F[near]])
    half_edge = (3 * near[:, None] + np.arange(3)).ravel()
    half_edge = half_edge[(twin[half_edge] > half_edge) & ~is_divided[edge[near].ravel()]]
    half_edge = half_edge[is_whole[twin[half_edge] // 3]]
    tail, head = mesh.edges.T
    joined = np.concatenate(
        [
            mesh.edges[~is_met & free[tail] & free[head]],
            np.column_stack([n + near[at], mesh.F[near[at], corner]]),
            n + np.column_stack([half_edge, twin[half_edge]]) // 3,
        ]
    )
    region = connectivity.connected_components(joined, n + m)
    # What each region sees: from corners, of the segments in the face the nearest, and of equally near ones that under
    # the largest angle; from the middles of sides of divided faces, on behalf of whole ones beyond.
    seen = _seen(triangulation, sources)
    angle = np.abs(seen.sine)
    order = np.lexsort((-angle, seen.away, seen.place))
    places, first = np.unique(seen.place[order], return_index=True)
    nearest = order[first][np.searchsorted(places, seen.place)]
    # Several, if curves run along each other.
    is_seen = (seen.away <= seen.away[nearest] * (1 + _SAME_DISTANCE)) & (angle >= angle[nearest] - _LEAST_SINE)
    # A whole face lies on one side of the segments along its sides.
    faces, start, end = _in_both_faces(triangulation, sources)
    along = (start == 0) & (end == 0)
    beside = np.flatnonzero(along.any(axis=1) & is_whole[faces])
    opposite = along[beside].argmax(axis=1)
    at_head = (opposite + 2) % 3
    place, which = np.unique(np.append(seen.place[is_seen], 6 * m + 3 * faces[beside] + opposite), return_inverse=True)
    sine = np.append(seen.sine[is_seen], np.sign(end[beside, at_head] - start[beside, at_head]))
    # Segments that run along each other in opposite directions cancel.
    net = np.clip(np.bincount(which, sine), -1, 1)
    face, k = np.divmod(place[: np.searchsorted(place, 6 * m)], 6)
    vertex, beyond = mesh.F[face, k % 3], twin[3 * face + k % 3] // 3
    is_open = ~(is_met | is_divided)[edge[face, k % 3]] & (beyond >= 0) & ~is_whole[face] & is_whole[beyond]
    net[: len(face)] *= np.where(k < 3, free[vertex], is_open)
    node = np.append(np.where(k < 3, vertex, n + beyond), n + (place[len(face) :] - 6 * m) // 3)
    total, most = (np.bincount(region[node], w, int(region.max()) + 1) for w in (net, np.abs(net)))
    decided = np.abs(total) > _AGREED * most
    return total[region[:n]] > 0, decided[region[:n]] & free


def left_of_nearest(
    triangulation: IntrinsicTriangulation, sources: OrientedSet, distance: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """Which vertices (n,) are on the left of the nearest segment, and which (n,) have that in one of their faces.

    Nothing is known of vertices that see the segment almost along it, nor of vertices on it. `triangulation` is the
    faces of the mesh, and `distance` (n,) that from the curves.
    """
    seen = _seen(triangulation, sources)
    face, place = np.divmod(seen.place, 6)
    vertex = triangulation.F[face, place % 3]
    nearest = np.flatnonzero(
        (place < 3) & (seen.away <= distance[vertex] * (1 + _SAME_DISTANCE)) & (np.abs(seen.sine) > _LEAST_SINE)
    )
    # Of segments that meet in the nearest place, the one seen under the largest angle is written last.
    nearest = nearest[np.argsort(np.abs(seen.sine[nearest]), kind="stable")]
    left, is_known = np.zeros((2, len(distance)), bool)
    left[vertex[nearest]], is_known[vertex[nearest]] = seen.sine[nearest] > 0, True
    return left, is_known


class _Seen(NamedTuple):
    """Segments (q,) as they are seen from places of their faces: distance and sine of the angle, positive on the left.

    Place 6 f + c is corner c of face f, 6 f + 3 + c the middle of the side opposite.
    """

    place: IntArray
    away: FloatArray
    sine: FloatArray


def _seen(triangulation: IntrinsicTriangulation, sources: OrientedSet) -> _Seen:
    faces, start, end = _in_both_faces(triangulation, sources)
    flat = lay_out(triangulation.l[faces]) @ np.array([1, 1j])
    begin, finish = np.einsum("sc,sc->s", start, flat), np.einsum("sc,sc->s", end, flat)
    along = finish - begin
    length = np.abs(along)
    # Places relative to the start of the segment, in its direction.
    turn = np.divide(along.conj(), length, out=np.zeros_like(along), where=length > 0)
    middles = (np.roll(flat, -1, axis=1) + np.roll(flat, -2, axis=1)) / 2
    relative = (np.concatenate([flat, middles], axis=1) - begin[:, None]) * turn[:, None]
    beyond = relative.real - np.clip(relative.real, 0, length[:, None])
    away = np.hypot(beyond, relative.imag)
    sine = np.divide(relative.imag, away, out=np.zeros_like(away), where=away > 0)
    place = 6 * faces[:, None] + np.arange(6)
    return _Seen(place.ravel(), away.ravel(), sine.ravel())


def _in_both_faces(
    triangulation: IntrinsicTriangulation, sources: OrientedSet
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Segments (faces, start, end), and those along a side of their face in the face on the other side, too."""
    faces, start, end = sources.faces, sources.start, sources.end
    segment, corner = np.nonzero((start == 0) & (end == 0))
    twin = triangulation.twin[3 * faces[segment] + corner]
    segment, corner, twin = segment[twin >= 0], corner[twin >= 0], twin[twin >= 0]
    other, opposite = np.divmod(twin, 3)
    rows = np.arange(len(segment))
    copies = []
    for barycentric in (start, end):
        copied = np.zeros((len(segment), 3))
        copied[rows, (opposite + 1) % 3] = barycentric[segment, (corner + 2) % 3]
        copied[rows, (opposite + 2) % 3] = barycentric[segment, (corner + 1) % 3]
        copies.append(copied)
    return np.concatenate([faces, other]), np.concatenate([start, copies[0]]), np.concatenate([end, copies[1]])
