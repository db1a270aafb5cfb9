"""Exact distance by windows: continuous Dijkstra over the faces of an intrinsic triangulation.

A *window* is the part of a half-edge that straight lines from one root cross, all through the same faces; the root laid
out in the plane before the half-edge gives the distance of every point of the window (Mitchell, Mount, Papadimitriou
1987). Windows that enter a face over the same side wait there in one list and cross the face together, as in Qin et al.
2016; the order of the lists is different here, see `window_lists`. Before a list crosses its face, windows are cut to
the points that no other path reaches sooner (`window_trimming`), and to the lines that cross no shorter path to the
corner ahead (`window_crossing`). Windows begin at sources (`window_sources`, `window_segments`), and at vertices at
which shortest paths can bend (`window_bends`).

`search` finds the distances of all vertices for one set of sources. With `window_pairs` two threads share it.
`local_windows` has many local searches.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.windows.window_memory import allocate, empty_front, free_front
from cython.cimports.heat_igl.kernels.windows.window_queue import push
from cython.cimports.heat_igl.kernels.windows.window_search import run
from cython.cimports.heat_igl.kernels.windows.window_sharing import run_beside
from cython.cimports.heat_igl.kernels.windows.window_sources import start_at
from cython.cimports.heat_igl.kernels.windows.window_structures import Search

__all__ = ["Front", "search"]


class Front:
    """A surface, and the arrays that searches on it write, for `search` or `search_each`.

    Parameters
    ----------
    tables : Tables
        m triangles on n vertices, see `heat_igl.unfolding.half_edges.Tables`. The kinds of vertices are filled further,
        the same by every search.
    found : Found
        Takes distances, and where the shortest paths come from, see `heat_igl.unfolding.window_search.Found`: nothing
        found yet at n vertices, with labels for as many source points and segments as there will be.
    tolerance : float
        A window is cut where another path is shorter by more than this fraction of the distance.
    leaving : Leaving, optional
        Takes in which direction the straight last parts of the paths leave their roots, see `window_distances.relax`:
        on surfaces whose faces are oriented alike.
    position : (3 n,), optional
        Positions of the vertices, in the unit of the lengths. With one goal for a source, `search_each` uses them to
        leave out vertices that are too far from the goal along straight lines.
    """

    def __init__(
        self,
        tables,
        found,
        tolerance: cython.double,
        leaving=None,
        position: cython.const[cython.double][::1] = None,
    ) -> None:
        s: cython.pointer(Search) = cython.address(self.state)
        n = len(tables.corner_of_vertex)
        emitted, touched = np.full(n, np.inf), np.empty(n, np.int32)
        slot = np.full(len(tables.vertex), -1, np.int32)
        # The pointers hold as long as the arrays do.
        self.arrays = (tables, found, leaving, position, emitted, touched, slot)
        _take_surface(s, tables)
        s.distance, s.root, s.label = _doubles(found.distance), _ints(found.root), _ints(found.label)
        s.entered, s.crossing = _ints(found.entered), _doubles(found.crossing)
        s.emitted, s.touched, s.slot = _doubles(emitted), _ints(touched), _ints(slot)
        s.upper, s.other = s.distance, cython.NULL
        s.corner = cython.NULL
        if leaving is not None:
            s.corner, s.leaving = _ints(leaving.corner), _doubles(leaving.direction.ravel())
        s.position = cython.NULL
        if position is not None:
            s.position = cython.cast(cython.p_double, cython.address(position[0]))
        s.aim = -1
        s.tolerance = tolerance
        s.n_points = s.n_segments = s.n_targets = s.n_goals = 0
        s.first_target = cython.NULL


@cython.cfunc
def _take_surface(s: cython.pointer(Search), tables) -> cython.void:
    s.vertex, s.twin, s.ring = _ints(tables.vertex), _ints(tables.twin), _ints(tables.ring)
    s.aligned, s.kind = _bytes(tables.aligned), _bytes(tables.kind)
    s.length, s.double_area, s.bulge = _doubles(tables.length), _doubles(tables.double_area), _doubles(tables.bulge)
    s.corner_of_vertex, s.next_corner = _ints(tables.corner_of_vertex), _ints(tables.next_corner)
    s.n_corners = _ints(tables.n_corners)
    s.is_delaunay = tables.is_delaunay
    s.n, s.n_half_edges = len(tables.corner_of_vertex), len(tables.vertex)


@cython.cfunc
def _ints(array: cython.int[::1]) -> cython.p_int:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


@cython.cfunc
def _doubles(array: cython.double[::1]) -> cython.p_double:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


@cython.cfunc
def _bytes(array: cython.uchar[::1]) -> cython.p_uchar:
    return cython.NULL if array.shape[0] == 0 else cython.address(array[0])


def search(
    front: Front,
    starts,
    goal: cython.int[::1],
    targets,
    stops_early: bool,
    cutoff: cython.double,
    statistics: cython.longlong[::1],
) -> bool:
    """Exact distances from vertices, points and segments; false if memory runs out.

    Parameters
    ----------
    front : Front
        Used for one search only; its labels have room for the source points and segments. Of a pair (see
        `window_pairs`), one gets all sources and the other none.
    starts : Starts
        The sources, see `heat_igl.unfolding.window_search.Starts`. A source on a side is listed once for every face
        there, and the ends of segments must be among the points.
    goal : (g,)
        With `stops_early`, the search ends when the distances of these vertices and of all targets are known.
    targets : Targets
        Points whose distance is asked for, see `heat_igl.unfolding.window_search.Targets`.
    cutoff : float
        Distances up to here are exact, larger ones may be too large.
    statistics : (3,)
        Takes the numbers of vertices that were reached, of windows, and of lists that crossed a face.
    """
    s: cython.pointer(Search) = cython.address(front.state)
    source: cython.int[::1] = starts.vertices
    offset: cython.double[::1] = starts.offset
    i: cython.int
    _take_sources(s, starts)
    _take_targets(s, targets)
    s.n_goals = goal.shape[0]
    s.goal = _ints(goal)
    s.stops_early = stops_early
    s.cutoff = cutoff
    with cython.nogil:
        allocate(s)
        for i in range(source.shape[0]):
            start_at(s, source[i], offset[i], i)
        for i in range(s.n_points + s.n_segments):
            if not s.failed:
                s.label[s.n + i] = source.shape[0] + i
                begin: cython.double = s.point_offset[i] if i < s.n_points else s.segment_offset[i - s.n_points]
                push(s, begin, s.n_half_edges + s.n + i)
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


@cython.cfunc
def _take_sources(s: cython.pointer(Search), starts) -> cython.void:
    """Sources inside faces."""
    point: cython.double[:, ::1] = starts.points.barycentric
    segment: cython.double[:, :, ::1] = starts.segments.barycentric
    s.n_points, s.n_segments = point.shape[0], segment.shape[0]
    s.point_face, s.point_offset = _ints(starts.points.faces), _doubles(starts.point_offset)
    s.point = cython.NULL if s.n_points == 0 else cython.address(point[0, 0])
    s.segment_face, s.segment_offset = _ints(starts.segments.faces), _doubles(starts.segment_offset)
    s.segment = cython.NULL if s.n_segments == 0 else cython.address(segment[0, 0, 0])


@cython.cfunc
def _take_targets(s: cython.pointer(Search), targets) -> cython.void:
    found = targets.found
    target: cython.double[:, ::1] = targets.place.barycentric
    s.n_targets = target.shape[0]
    s.target = cython.NULL if s.n_targets == 0 else cython.address(target[0, 0])
    s.first_target, s.next_target = _ints(targets.first), _ints(targets.following)
    s.target_face = _ints(targets.place.faces)
    s.target_distance, s.target_root = _doubles(found.distance), _ints(found.root)
    s.target_entered, s.target_crossing = _ints(found.entered), _doubles(found.crossing)
    s.slack = targets.largest_circle
