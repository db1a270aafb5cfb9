"""Windows of parallel lines from segments inside faces, every point of which is a source.

Lines at a right angle to the segment leave it on both sides (Bommes and Kobbelt 2007). Around its ends lines leave in
all directions: the ends are source points as well.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.window_distances import relax, take
from cython.cimports.heat_igl.kernels.windows.window_lists import add
from cython.cimports.heat_igl.kernels.windows.window_structures import (
    NARROW,
    Search,
    Window,
    apart,
    at_corner,
    nearest_on,
)
from cython.cimports.libc.math import fabs, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def emit_segment(s: cython.pointer(Search), i: cython.int) -> cython.void:
    """Distances from source segment i inside its face, and windows over the sides of the face."""
    f: cython.int = s.segment_face[i]
    root: cython.int = s.n + s.n_points + i
    ends: cython.p_double = s.segment + 6 * i
    corner: cython.double[3]
    c: cython.int
    j: cython.int
    for c in range(3):
        at_corner(c, corner)
        relax(s, s.vertex[3 * f + c], _distance(s, i, corner), root, -1, 0.0, 3 * f, 0.0, 0.0)
        # On the side itself, the segment belongs to the face beyond it too.
        if ends[c] > 0.0 or ends[3 + c] > 0.0:
            _emit(s, 3 * f + c, ends, root, s.segment_offset[i])
    j = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        take(s, j, _distance(s, i, s.target + 3 * j), root)
        j = s.next_target[j]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _distance(s: cython.pointer(Search), i: cython.int, point: cython.p_double) -> cython.double:
    """Distance of a point in the face of segment i from the segment."""
    found: cython.double[3]
    nearest_on(s.length + 3 * s.segment_face[i], s.segment + 6 * i, point, found)
    return s.segment_offset[i] + apart(s.length + 3 * s.segment_face[i], point, found)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _emit(
    s: cython.pointer(Search), h: cython.int, ends: cython.p_double, root: cython.int, offset: cython.double
) -> cython.void:
    """The window over half-edge h, out of the face; its frame runs from the head of h to the tail."""
    c: cython.int = h % 3
    head: cython.int = previous_half_edge(h) % 3
    length: cython.double = s.length[h]
    height: cython.double = s.double_area[h // 3] / length
    apex_x: cython.double = foot(length, s.length[previous_half_edge(h)], s.length[next_half_edge(h)])
    x: cython.double = length - (ends[c] * apex_x + ends[head] * length)
    depth: cython.double = ends[c] * height
    along: cython.double = length - (ends[3 + c] * apex_x + ends[3 + head] * length) - x
    rise: cython.double = depth - ends[3 + c] * height
    norm: cython.double = sqrt(along * along + rise * rise)
    one: Window
    if fabs(along) <= NARROW * norm or norm <= 0.0:
        return  # at a right angle to the half-edge: nothing leaves over it
    one.depth = fabs(along) / norm
    one.x = (-rise if along > 0.0 else rise) / norm
    one.start = x + depth * one.x / one.depth
    one.stop = x + along + (depth - rise) * one.x / one.depth
    if along < 0.0:
        one.start, one.stop = one.stop, one.start
    one.start = max(one.start, 0.0)
    one.stop = min(one.stop, length)
    one.offset = offset - one.x * x + one.depth * depth
    one.root = root
    one.corner = h - c
    one.turn_x, one.turn_y = (depth * rise - x * along) / norm, 1.0 if along > 0.0 else -1.0
    one.side = 0
    one.is_plane = True
    if one.stop - one.start > NARROW * length:
        add(s, h, cython.address(one), 1, False)
