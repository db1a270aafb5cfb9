"""Tables of a surface for windows: shapes of faces, corners of vertices, and whether paths may bend at a vertex.

Half-edge ``3 f + c`` is the side of face f opposite its corner c; the corner carries the same number.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import area, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.structures import (
    BENDS,
    ENDS,
    FLAT,
    FLATNESS,
    JOINS,
    PASSED,
    Direction,
    twice_product,
)
from cython.cimports.libc.math import fabs

#: The kind of a vertex whose faces are several fans, or at an edge of more than two faces.
SEVERAL_FANS = cython.cast(cython.int, JOINS)
#: The kind of an inner vertex whose angles sum to 2 pi.
FLAT_VERTEX = cython.cast(cython.int, FLAT)


def shapes(tables) -> bool:
    """Fill the arrays of `heat_igl.windows.tables.Tables` from its half-edges; whether it is intrinsic Delaunay.

    A ValueError if the gluing of two half-edges is not symmetric: windows could circulate between them forever.

    Of n vertices and m faces:

    - `double_area` (m,): twice the area of each face;
    - `bulge` (3 m,): the length of each half-edge times the cotangent of the opposite angle: the point (x, -y) in the
      frame of the half-edge has the power ``x (x - length) + y (y + bulge)`` with respect to the circumcircle;
    - `corner_of_vertex` (n,), `next_corner` (3 m,): the corners of each vertex as linked lists that end with -1; the
      first must come full of -1;
    - `n_corners` (n,): the number of corners of each vertex; must come full of 0;
    - `kind` (n,): JOINS at the ends of edges of more than two faces; must come as UNKNOWN.
    """
    vertex: cython.int[::1] = tables.edges.vertex
    length: cython.double[::1] = tables.edges.length
    twin: cython.int[::1] = tables.edges.twin
    aligned: cython.uchar[::1] = tables.edges.aligned
    kind: cython.uchar[::1] = tables.kind
    n_corners: cython.int[::1] = tables.n_corners
    double_area: cython.double[::1] = tables.double_area
    bulge: cython.double[::1] = tables.bulge
    corner_of_vertex: cython.int[::1] = tables.corner_of_vertex
    next_corner: cython.int[::1] = tables.next_corner
    m: cython.int = double_area.shape[0]
    h: cython.int
    is_delaunay: cython.bint = True
    broken: cython.int = -1
    with cython.nogil:
        for f in range(m):
            h = 3 * f
            a, b, d = length[h], length[h + 1], length[h + 2]
            # The lower bound gives a degenerate face a circumcircle.
            twice: cython.double = max(2.0 * area(a, b, d), 1e-20 * a * a)
            double_area[f] = twice
            bulge[h] = a * twice_product(b, d, a) / (2.0 * twice)
            bulge[h + 1] = b * twice_product(a, d, b) / (2.0 * twice)
            bulge[h + 2] = d * twice_product(a, b, d) / (2.0 * twice)
            for c in range(3):
                v: cython.int = vertex[h + c]
                next_corner[h + c] = corner_of_vertex[v]
                corner_of_vertex[v] = h + c
                n_corners[v] += 1
        for h in range(3 * m):
            t: cython.int = twin[h]
            if t == -2:
                kind[vertex[next_half_edge(h)]] = kind[vertex[previous_half_edge(h)]] = JOINS
                is_delaunay = False
            elif t >= 0:
                tail: cython.int = previous_half_edge(t) if aligned[h] else next_half_edge(t)
                if twin[t] != h or aligned[t] != aligned[h] or vertex[tail] != vertex[next_half_edge(h)]:
                    broken = h
                elif bulge[h] + bulge[t] < -1e-6 * length[h]:
                    is_delaunay = False
    if broken >= 0:
        raise ValueError(f"half-edges {broken} and {twin[broken]} are not glued alike: twin or aligned is wrong there")
    return is_delaunay


def third(k, side):
    """The third half-edge of the face of half-edges k and side."""
    return 9 * (k // 3) + 3 - k - side


def beyond(s, k, side):
    """The corner of the same vertex in the face across a side of corner k; -1 if there is none or more than one."""
    t: cython.int = s.twin[side]
    is_tail: cython.bint = side == previous_half_edge(k)
    if t < 0:
        return -1
    if s.aligned[side]:
        is_tail = not is_tail
    return next_half_edge(t) if is_tail else previous_half_edge(t)


def turn(s, k, side, ray):
    """Rotate a direction by the angle of corner k, one of whose sides is `side`."""
    p: cython.double = s.length[side]
    q: cython.double = s.length[third(k, side)]
    scale: cython.double = 0.5 / (p * q)
    cosine: cython.double = twice_product(p, q, s.length[k]) * scale
    sine: cython.double = 2.0 * s.double_area[k // 3] * scale
    ray.cosine, ray.sine = ray.cosine * cosine - ray.sine * sine, ray.cosine * sine + ray.sine * cosine


def classify(s, v):
    """The kind of vertex v, by a walk around it: whether the faces are one fan, and whether the angles exceed 2 pi."""
    start: cython.int = s.corner_of_vertex[v]
    k: cython.int = start
    side: cython.int = previous_half_edge(start)
    n_corners: cython.int = s.n_corners[v]
    n_seen: cython.int = 0
    n_half_turns: cython.int = 0
    ray: Direction
    ray.cosine, ray.sine = 1.0, 0.0
    while n_seen < n_corners:
        n_seen += 1
        was_below: cython.bint = ray.sine < 0.0
        turn(s, k, side, cython.address(ray))
        n_half_turns += was_below != (ray.sine < 0.0)
        if side == previous_half_edge(k) and s.aligned[next_half_edge(k)]:
            # The usual case, with a shorter chain of dependent instructions.
            side = s.twin[next_half_edge(k)]
            if side < 0:
                break
            k = next_half_edge(side)
        else:
            side = third(k, side)
            ahead: cython.int = beyond(s, k, side)
            if ahead < 0:
                break
            k = ahead
            side = s.twin[side]
        if k == start:
            if n_seen < n_corners:
                return JOINS
            if n_half_turns < 2 or (n_half_turns == 2 and ray.cosine > 0.0 and ray.sine < FLATNESS):
                return FLAT if ray.cosine > 0.0 and fabs(ray.sine) < FLATNESS else PASSED
            return BENDS
    # An open fan: from the start to its other end.
    k = start
    side = previous_half_edge(start)
    while n_seen < n_corners:
        k = beyond(s, k, side)
        if k < 0:
            return JOINS
        n_seen += 1
        side = third(k, s.twin[side])
    return ENDS
