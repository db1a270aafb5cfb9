"""Sources of a search by windows: vertices, and points inside faces; `window_segments` has segments."""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.window_distances import relax, take, tell
from cython.cimports.heat_igl.kernels.windows.window_lists import add
from cython.cimports.heat_igl.kernels.windows.window_queue import push
from cython.cimports.heat_igl.kernels.windows.window_structures import Search, Window, apart, at_corner, twice_product
from cython.cimports.libc.math import INFINITY


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def start_at(s: cython.pointer(Search), v: cython.int, offset: cython.double, label: cython.int) -> cython.void:
    """Let distance start at vertex v."""
    if s.failed or offset >= s.distance[v]:
        return
    if s.distance[v] == INFINITY:
        s.touched[s.n_touched] = v
        s.n_touched += 1
    s.distance[v] = s.upper[v] = offset
    s.root[v] = v
    s.label[v] = label
    s.entered[v] = -1
    if s.other != cython.NULL:
        tell(s, v, offset)
    push(s, offset, s.n_half_edges + v)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def emit_point(s: cython.pointer(Search), p: cython.int) -> cython.void:
    """Windows from a source inside a face over its three sides."""
    f: cython.int = s.point_face[p]
    root: cython.int = s.n + p
    offset: cython.double = s.point_offset[p]
    at: cython.p_double = s.point + 3 * p
    one: Window
    c: cython.int
    h: cython.int
    j: cython.int
    corner: cython.double[3]
    length: cython.double
    left_length: cython.double
    right_length: cython.double
    distance: cython.double
    place_x: cython.double[3]
    place_y: cython.double[3]
    place_x[0] = place_y[0] = place_y[1] = 0.0
    place_x[1] = s.length[3 * f + 2]
    place_x[2] = foot(place_x[1], s.length[3 * f + 1], s.length[3 * f])
    place_y[2] = s.double_area[f] / place_x[1]
    x: cython.double = at[1] * place_x[1] + at[2] * place_x[2]
    y: cython.double = at[2] * place_y[2]
    for c in range(3):
        h = 3 * f + c
        at_corner(c, corner)
        distance = offset + apart(s.length + 3 * f, corner, at)
        relax(s, s.vertex[h], distance, root, -1, 0.0, 3 * f, place_x[c] - x, place_y[c] - y)
        if at[c] <= 0.0:
            continue  # on the side itself, the source belongs to the face beyond it too
        length = s.length[h]
        left_length = s.length[previous_half_edge(h)]
        right_length = s.length[next_half_edge(h)]
        one.x = at[c] * 0.5 * twice_product(length, left_length, right_length) / length
        one.x = length - (one.x + at[previous_half_edge(h) % 3] * length)
        one.depth = at[c] * s.double_area[f] / length
        one.start = 0.0
        one.stop = length
        one.offset = offset
        one.root = root
        one.corner = 3 * f
        one.turn_x = (place_x[(c + 1) % 3] - place_x[(c + 2) % 3]) / length
        one.turn_y = (place_y[(c + 1) % 3] - place_y[(c + 2) % 3]) / length
        if s.merging > 0.0:
            one.turn_x = 0.0
        one.side = one.is_plane = 0
        if one.depth > 0.0:
            add(s, h, cython.address(one), 1, False)
    j = s.first_target[f] if s.first_target != cython.NULL else -1
    while j >= 0:
        take(s, j, offset + apart(s.length + 3 * f, s.target + 3 * j, at), root)
        j = s.next_target[j]
