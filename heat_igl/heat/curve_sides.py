"""The sides of oriented curves on which vertices lie, gaps in the curves, and the segments that close them."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import Mesh, SurfaceCurve, connectivity, level_segments
from heat_igl.mesh.connectivity import next_in_run
from heat_igl.sources import OrientedSet
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Places nearer to each other than this share of the mean edge length are the same. Of whole and broken level curves on
# twelve meshes, no bit of a signed distance changes from 1e-8 to 1e-4; nor with those below from 1e-9 to 1e-4.
_SAME_PLACE = 1e-6
# If a vertex sees the nearest place of a segment almost along the segment, rounding decides the side.
_LEAST_SINE = 1e-6
# Straight lines in one face are as long as the distance, but for rounding.
_SAME_DISTANCE = 1e-6
# Share by which the sides seen from the vertices of a region have to agree: 1 in all 680 regions of 200 levels. A curve
# that does not separate is seen from both sides: on 40 tori the share is at most 0.05.
_AGREED = 0.5


def same_place(mesh: Mesh) -> float:
    """The distance within which ends of curves meet, and vertices are on a curve."""
    return _SAME_PLACE * float(mesh.edge_lengths.mean())


def uncancelled(mesh: Mesh, sources: OrientedSet) -> OrientedSet:
    """The sources without segments along which as many run in the opposite direction: these have no left and right.

    A `SourceError` if nothing is left.
    """
    start, end, place = sources.start.copy(), sources.end.copy(), sources.faces.copy()
    at, opposite = np.nonzero((start == 0) & (end == 0))
    # On an edge, which belongs to two faces: the weights of its first vertex.
    edge = mesh.facets.of_face[place[at], opposite]
    is_first = mesh.F[place[at]] == mesh.edges[edge, :1]
    for ends in (start, end):
        ends[at] = np.where(is_first, ends[at], 0.0).sum(axis=1, keepdims=True)
    place[at] = mesh.n_faces + edge
    change = end - start
    sign = np.sign(change[np.arange(len(place)), (change != 0).argmax(axis=1)])
    forward = sign[:, None] > 0
    rows = np.column_stack([place, np.where(forward, start, end), np.where(forward, end, start)])
    order = np.lexsort(rows.T)
    group = np.cumsum((np.diff(rows[order], axis=0, prepend=rows[order[:1]]) != 0).any(axis=1))
    kept = np.zeros(len(place), bool)
    kept[order] = np.bincount(group, sign[order])[group] != 0
    if not kept.any() and not len(sources.point_faces):
        raise SourceError("the normals of the curves cancel: two curves run along each other in opposite directions")
    return replace(sources, **{name: getattr(sources, name)[kept] for name in ("faces", "start", "end", "label")})


def faces_at_gaps(mesh: Mesh, sources: OrientedSet) -> IntArray:
    """The faces (k,) in which a curve ends, inside the mesh, where none begins, or the reverse; and those of points."""
    ends, begins = _loose(mesh, sources)
    ends = ends[~_on_boundary(mesh, sources.faces[ends], sources.end[ends])]
    begins = begins[~_on_boundary(mesh, sources.faces[begins], sources.start[begins])]
    places = np.concatenate([_ends(mesh, sources)[1][ends], _ends(mesh, sources)[0][begins]])
    faces, sign = sources.faces[np.append(ends, begins)], np.repeat([1, -1], [len(ends), len(begins)])
    if len(ends) and len(begins):
        from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

        near = cKDTree(places).query_pairs(same_place(mesh), output_type="ndarray")
        place = connectivity.connected_components(near, len(places))
        faces = faces[np.bincount(place, sign)[place] != 0]
    return np.append(faces, sources.point_faces)


def _loose(mesh: Mesh, sources: OrientedSet) -> tuple[IntArray, IntArray]:
    """The segments at whose end, and those at whose start, no neighbour of the same curve goes on."""
    begin, end = _ends(mesh, sources)
    # Most segments are followed by the next of their curve, and the last by the first.
    following = next_in_run(np.arange(len(begin)), np.unique(sources.label, return_counts=True)[1])
    apart = np.linalg.norm(begin[following] - end, axis=1) > same_place(mesh)
    return np.flatnonzero(apart), following[apart]


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


def closing_of_gaps(
    mesh: Mesh, sources: OrientedSet, phi: FloatArray, left: BoolArray, on_curve: BoolArray
) -> SurfaceCurve | None:
    """A curve across every edge at which the side changes, but no source meets the edge; None if there is no such edge.

    It runs along the zero curve of `phi` (n,), a signed distance, with the signs of `left` (n,), to the loose ends of
    sources in its faces and to where sources meet edges. They meet the edges of the vertices `on_curve` (n,) there.
    """
    size = np.maximum(np.where(on_curve, 0.0, np.abs(phi)), np.finfo(float).tiny)
    faces, start, end, edges = level_segments(mesh, np.where(left, -size, size), 0.0)
    share = _crossed(mesh, sources)
    kept = ((share[edges] < 0) & ~on_curve[mesh.edges[edges]].any(axis=2)).any(axis=1)
    ends, begins = _loose(mesh, sources)
    # The last row is for faces without one.
    loose = np.concatenate([sources.end[ends], sources.start[begins], np.zeros((1, 3))])
    of_face = np.full(mesh.n_faces, -1)
    of_face[np.concatenate([sources.faces[ends], sources.faces[begins]])] = np.arange(len(loose) - 1)
    in_face = loose[of_face[faces]]
    for point, edge in zip((start, end), edges.T, strict=True):
        first, last = (mesh.F[faces] == mesh.edges[edge, i : i + 1] for i in (0, 1))
        crossed = first * share[edge, None] + last * (1 - share[edge, None])
        there = np.where((in_face > 0).all(axis=1, keepdims=True), in_face, crossed)
        np.copyto(point, there, where=share[edge, None] >= 0)
    kept &= (start != end).any(axis=1)
    return SurfaceCurve(faces[kept], start[kept], end[kept]) if kept.any() else None


def _crossed(mesh: Mesh, sources: OrientedSet) -> FloatArray:
    """The weight of the first vertex of each edge at a segment end inside the edge; -1 if no segment ends there."""
    share = np.full(len(mesh.edges), -1.0)
    for barycentric in (sources.start, sources.end):
        on_edge = (barycentric == 0).sum(axis=1) == 1
        faces, at = sources.faces[on_edge], barycentric[on_edge]
        edge = mesh.facets.of_face[faces, at.argmin(axis=1)]
        share[edge] = at[mesh.F[faces] == mesh.edges[edge, :1]]
    return share


def vertices_on(mesh: Mesh, sources: OrientedSet) -> BoolArray:
    """Which vertices (n,) are corners of the curves."""
    on_curve = np.zeros(mesh.n_vertices, bool)
    for barycentric in (sources.start, sources.end):
        in_vertex = (barycentric == 0).sum(axis=1) == 2
        on_curve[mesh.F[sources.faces[in_vertex], barycentric[in_vertex].argmax(axis=1)]] = True
    return on_curve


def left_of_closed(
    mesh: Mesh, triangulation: IntrinsicTriangulation, sources: OrientedSet, gaps: IntArray
) -> tuple[BoolArray, BoolArray]:
    """Which vertices (n,) are on the left of the curves around them, and of which vertices (n,) that is known.

    The surface without the curves falls into regions. Vertices are in one if an edge joins them that no curve meets; so
    are a face that no curve crosses and its vertices off the curves, and two such faces if no curve runs along the edge
    between them. A region is on the side of the segments that are seen from inside. Nothing is known of vertices on
    curves, of regions that see both sides, and of components without a curve. `triangulation` is the faces of the mesh.
    """
    n, m, twin, edge = mesh.n_vertices, mesh.n_faces, triangulation.twin, mesh.facets.of_face
    is_met, is_divided = _crossed(mesh, sources) >= 0, np.zeros(len(mesh.edges), bool)
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
            np.compress(~is_met & free[tail] & free[head], mesh.edges, axis=0),
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
    decided[region[np.append(mesh.F[gaps], n + gaps)]] = False
    return total[region[:n]] > 0, decided[region[:n]] & free


def left_beside(
    mesh: Mesh, triangulation: IntrinsicTriangulation, sources: OrientedSet
) -> tuple[BoolArray, BoolArray, BoolArray]:
    """Masks (n,): vertices on the left of the nearest segment in their faces, vertices where this is known, and on it.

    The side is known unless the vertex lies almost on the line of the segment. `triangulation` has the faces of the
    mesh.
    """
    seen = _seen(triangulation, sources)
    face, place = np.divmod(seen.place, 6)
    corner = np.flatnonzero(place < 3)
    vertex, away, angle = triangulation.F[face, place % 3][corner], seen.away[corner], np.abs(seen.sine[corner])
    nearest = np.full(triangulation.n, np.inf)
    np.minimum.at(nearest, vertex, away)
    told = np.flatnonzero((away <= nearest[vertex] * (1 + _SAME_DISTANCE)) & (angle > _LEAST_SINE))
    # Of segments that meet in the nearest place, the one seen under the largest angle is written last.
    told = told[np.argsort(angle[told], kind="stable")]
    left, is_known = np.zeros((2, len(nearest)), bool)
    left[vertex[told]], is_known[vertex[told]] = seen.sine[corner[told]] > 0, True
    return left, is_known, nearest <= same_place(mesh)


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
    copies = np.zeros((2, len(segment), 3))
    for barycentric, copied in zip((start, end), copies, strict=True):
        copied[rows, (opposite + 1) % 3] = barycentric[segment, (corner + 2) % 3]
        copied[rows, (opposite + 2) % 3] = barycentric[segment, (corner + 1) % 3]
    return np.concatenate([faces, other]), np.concatenate([start, copies[0]]), np.concatenate([end, copies[1]])
