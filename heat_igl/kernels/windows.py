"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is the part of a half-edge that straight lines from one root cross, all through the same faces; the root laid
out in the plane before the half-edge gives the distance of every point of the window (Mitchell, Mount, Papadimitriou
1987). Windows that enter a face over the same side wait there in one list and cross the face together, as in Qin et al.
2016; the order of the lists is different here, see `window_lists`. Before a list crosses its face, windows lose what
another path reaches sooner (`window_trimming`), and what would cross a shorter way to the corner ahead
(`window_crossing`). A vertex gets windows of its own where shortest paths can bend (`window_sources`).

`search` is for one question about all vertices; `window_pairs` lets two threads share it, and `local_windows` has a
search for many local ones.
"""

import cython
from cython.cimports.heat_igl.kernels.window_lists import allocate, empty_front, free_front, push
from cython.cimports.heat_igl.kernels.window_search import run
from cython.cimports.heat_igl.kernels.window_sharing import run_beside
from cython.cimports.heat_igl.kernels.window_sources import start_at
from cython.cimports.heat_igl.kernels.window_structures import Search

__all__ = ["Front", "search"]


class Front:
    """A surface, and what searches on it write; `search` and `search_each` say in which state.

    Parameters
    ----------
    vertex, length, twin, double_area, bulge, corner_of_vertex, next_corner, n_corners, kind
        As `window_surface.shapes` takes and fills them. `kind` is filled further, the same by every search.
    aligned : (3 m,)
        Whether the faces at a glued half-edge run along it in opposite directions.
    ring : (3 m,)
        Where more than two faces meet, the next half-edge of the same edge.
    is_delaunay : bool
        What `shapes` returned.
    distance, emitted : (n,)
        Must come full of infinity; the first takes distances.
    root, label, entered, crossing : (n,), (n + p + q,), (n,), (n,)
        Take where the shortest paths come from; see `heat_igl.unfolding.exact.Origin`. They must come full of -1.
    touched : (n,)
        Takes the vertices that were reached.
    slot : (3 m,)
        Must come full of -1, and is again after a search.
    corner, leaving : (n,), (2 n,), optional
        Take in which direction the straight last parts of the paths leave their roots, see `window_sources.relax`: on
        surfaces whose faces are oriented alike.
    tolerance : float
        The fraction of a distance by which another way must be shorter before a window is cut.
    position : (3 n,), optional
        Of the vertices in space, in the unit of the lengths. With one goal for a source, `search_each` then leaves out
        what is too far from it along straight lines.
    """

    def __init__(
        self,
        vertex: cython.int[::1],
        length: cython.double[::1],
        twin: cython.int[::1],
        aligned: cython.uchar[::1],
        ring: cython.int[::1],
        double_area: cython.double[::1],
        bulge: cython.double[::1],
        corner_of_vertex: cython.int[::1],
        next_corner: cython.int[::1],
        n_corners: cython.int[::1],
        kind: cython.uchar[::1],
        is_delaunay: bool,
        distance: cython.double[::1],
        emitted: cython.double[::1],
        root: cython.int[::1],
        label: cython.int[::1],
        entered: cython.int[::1],
        crossing: cython.double[::1],
        touched: cython.int[::1],
        slot: cython.int[::1],
        tolerance: cython.double,
        corner: cython.int[::1] = None,
        leaving: cython.double[::1] = None,
        position: cython.const[cython.double][::1] = None,
    ) -> None:
        s: cython.pointer(Search) = cython.address(self.state)
        # The pointers hold as long as the arrays do.
        self.arrays = (
            vertex.base,
            length.base,
            twin.base,
            aligned.base,
            ring.base,
            double_area.base,
            bulge.base,
            corner_of_vertex.base,
            next_corner.base,
            n_corners.base,
            kind.base,
            distance.base,
            emitted.base,
            root.base,
            label.base,
            entered.base,
            crossing.base,
            touched.base,
            slot.base,
            corner,
            leaving,
            position,
        )
        s.vertex = cython.address(vertex[0])
        s.length = cython.address(length[0])
        s.twin = cython.address(twin[0])
        s.aligned = cython.address(aligned[0])
        s.ring = cython.address(ring[0])
        s.double_area = cython.address(double_area[0])
        s.bulge = cython.address(bulge[0])
        s.corner_of_vertex = cython.address(corner_of_vertex[0])
        s.next_corner = cython.address(next_corner[0])
        s.n_corners = cython.address(n_corners[0])
        s.kind = cython.address(kind[0])
        s.distance = cython.address(distance[0])
        s.upper = s.distance
        s.other = cython.NULL
        s.emitted = cython.address(emitted[0])
        s.root = cython.address(root[0])
        s.label = cython.address(label[0])
        s.entered = cython.address(entered[0])
        s.crossing = cython.address(crossing[0])
        s.touched = cython.address(touched[0])
        s.slot = cython.address(slot[0])
        s.corner = cython.NULL
        if corner is not None:
            s.corner = cython.address(corner[0])
            s.leaving = cython.address(leaving[0])
        s.position = cython.NULL
        if position is not None:
            s.position = cython.cast(cython.p_double, cython.address(position[0]))
        s.aim = -1
        s.is_delaunay = is_delaunay
        s.n = corner_of_vertex.shape[0]
        s.n_half_edges = vertex.shape[0]
        s.tolerance = tolerance
        s.n_points = s.n_segments = s.n_targets = s.n_goals = 0
        s.first_target = cython.NULL


def search(
    front: Front,
    source: cython.int[::1],
    offset: cython.double[::1],
    point_face: cython.int[::1],
    point: cython.double[::1],
    point_offset: cython.double[::1],
    segment_face: cython.int[::1],
    segment: cython.double[::1],
    segment_offset: cython.double[::1],
    goal: cython.int[::1],
    first_target: cython.int[::1],
    next_target: cython.int[::1],
    target_face: cython.int[::1],
    target: cython.double[::1],
    target_distance: cython.double[::1],
    target_root: cython.int[::1],
    target_entered: cython.int[::1],
    target_crossing: cython.double[::1],
    slack: cython.double,
    stops_early: bool,
    cutoff: cython.double,
    statistics: cython.longlong[::1],
) -> bool:
    """Exact distances from vertices and points; false where memory runs out.

    Parameters
    ----------
    front : Front
        For one search alone, whose `label` has room for p source points and q segments.
    source, offset : (k,)
        Vertices that distance starts from, and the distance at which each starts.
    point_face, point, point_offset : (p,), (3 p,), (p,)
        Sources inside faces: face, barycentric coordinates, distance. A source on a side, with a coordinate of 0, comes
        once for every face there.
    segment_face, segment, segment_offset : (q,), (6 q,), (q,)
        Source segments inside faces, likewise: face, coordinates of one end and the other, distance. The ends must be
        among the points.
    goal : (g,)
        With `stops_early`, the search ends when the distances of these vertices and of all targets are known.
    first_target, next_target, target_face, target : (m,), (t,), (t,), (3 t,)
        Points whose distance is asked for, as linked lists by face, with their barycentric coordinates.
    target_distance, target_root, target_entered, target_crossing : (t,)
        As for vertices.
    slack : float
        Diameter of the largest circle around a face with targets.
    cutoff : float
        Distances up to here are exact, larger ones may be too large.
    statistics : (3,)
        Takes the numbers of vertices that were reached, of windows, and of lists that crossed a face.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    i: cython.int
    s.n_points = point_face.shape[0]
    if s.n_points > 0:
        s.point_face = cython.address(point_face[0])
        s.point = cython.address(point[0])
        s.point_offset = cython.address(point_offset[0])
    s.n_segments = segment_face.shape[0]
    if s.n_segments > 0:
        s.segment_face = cython.address(segment_face[0])
        s.segment = cython.address(segment[0])
        s.segment_offset = cython.address(segment_offset[0])
    s.n_goals = goal.shape[0]
    if s.n_goals > 0:
        s.goal = cython.address(goal[0])
    s.n_targets = target_face.shape[0]
    if s.n_targets > 0:
        s.first_target = cython.address(first_target[0])
        s.next_target = cython.address(next_target[0])
        s.target_face = cython.address(target_face[0])
        s.target = cython.address(target[0])
        s.target_distance = cython.address(target_distance[0])
        s.target_root = cython.address(target_root[0])
        s.target_entered = cython.address(target_entered[0])
        s.target_crossing = cython.address(target_crossing[0])
    s.stops_early = stops_early
    s.slack = slack
    s.cutoff = cutoff
    with cython.nogil:
        allocate(s)
        for i in range(source.shape[0]):
            start_at(s, source[i], offset[i], i)
        for i in range(s.n_points):
            if not s.failed:
                s.label[s.n + i] = source.shape[0] + i
                push(s, point_offset[i], s.n_half_edges + s.n + i)
        for i in range(s.n_segments):
            if not s.failed:
                s.label[s.n + s.n_points + i] = source.shape[0] + s.n_points + i
                push(s, segment_offset[i], s.n_half_edges + s.n + s.n_points + i)
        if s.other != cython.NULL:
            run_beside(s)
        elif not s.failed:
            run(s)
        empty_front(s)
        free_front(s)
    statistics[0] = s.n_touched
    statistics[1] = s.n_windows
    statistics[2] = s.n_lists_done
    return not s.failed
