"""Derivatives of the lengths of straight lines over triangles by the lengths of the edges.

A shortest path consists of straight lines from a vertex to the next vertex that it passes, or to a source point;
`paths` follows them. In a triangle with sides l, the piece of a line between two places whose barycentric coordinates
differ by delta has length s, and

    s^2 = - sum over pairs i < k of delta_i delta_k l_ik^2.

By the envelope theorem the places on the edges count as fixed, so the derivative of s by l_ik is
- delta_i delta_k l_ik / s. The rest of a path, behind the end of its last line, is added by visiting the vertices in
the order of distance.
"""

import cython
from cython.cimports.heat_igl.kernels.windows.paths import AT_SOURCE, LOST, PathTracer
from cython.cimports.heat_igl.kernels.windows.structures import apart


@cython.cfunc
@cython.nogil
def _piece(
    side: cython.pointer[cython.const[cython.double]],
    one: cython.p_double,
    other: cython.p_double,
    weight: cython.double,
    slope: cython.pointer[cython.double],
    tangent: cython.pointer[cython.const[cython.double]],
    at_end: cython.pointer[cython.double],
    end_moves: cython.pointer[cython.const[cython.double]],
) -> cython.double:
    """One piece of a line in a face with sides `side`, from one place to another: the derivative of its length.

    Added to `slope` (3,) by the sides, times `weight`, and to `at_end` (3,) by the coordinates of the other place, if
    they are given; returned for changes of the sides, `tangent` (3,), and of these coordinates, `end_moves` (3,), if
    they are given.
    """
    d: cython.double[3]
    i: cython.int
    k: cython.int
    total: cython.double = 0.0
    for c in range(3):
        d[c] = other[c] - one[c]
    length: cython.double = apart(side, one, other)
    if not length > 0.0:
        return 0.0
    per_length: cython.double = 1.0 / length
    for c in range(3):
        i, k = (c + 1) % 3, (c + 2) % 3
        by_side: cython.double = -d[i] * d[k] * side[c] * per_length
        if slope != cython.NULL:
            slope[c] += weight * by_side
        if tangent != cython.NULL:
            total += by_side * tangent[c]
        if at_end != cython.NULL:
            at_end[c] -= 0.5 * weight * per_length * (d[i] * side[k] ** 2 + d[k] * side[i] ** 2)
        if end_moves != cython.NULL:
            total -= 0.5 * per_length * (d[i] * side[k] ** 2 + d[k] * side[i] ** 2) * end_moves[c]
    return total


@cython.cfunc
@cython.nogil
@cython.exceptval(-4)
def _follow(tracer: PathTracer, v: cython.int) -> cython.int:
    """Follow the straight last part of the path to vertex v: the row of its root, -1 at a source or if it is lost."""
    if tracer.root[v] == v:
        return -1
    tracer.n_steps = tracer.segments.n = 0
    end: cython.int = tracer.from_vertex(v)
    return tracer.root[v] if end == AT_SOURCE else -1 if end == LOST else end


@cython.cfunc
@cython.nogil
def _along(
    tracer: PathTracer,
    weight: cython.double,
    slope: cython.p_double,
    tangent: cython.pointer[cython.const[cython.double]],
    at_end: cython.p_double,
    end_moves: cython.pointer[cython.const[cython.double]],
) -> cython.double:
    """All pieces of the line that was followed; as `_piece`, with the arrays of all sides."""
    total: cython.double = 0.0
    of_face: cython.p_double = cython.NULL
    tangent_of_face: cython.pointer[cython.const[cython.double]] = cython.NULL
    for j in range(tracer.segments.n):
        f: cython.int = 3 * tracer.segments.face[j]
        is_last: cython.bint = j == tracer.segments.n - 1
        place: cython.p_double = cython.address(tracer.segments.place[j, 0, 0])
        if slope != cython.NULL:
            of_face = slope + f
        if tangent != cython.NULL:
            tangent_of_face = tangent + f
        total += _piece(
            cython.address(tracer.length[f]),
            place,
            place + 3,
            weight,
            of_face,
            tangent_of_face,
            at_end if is_last else cython.NULL,
            end_moves if is_last else cython.NULL,
        )
    return total


def pull_back(
    tables,
    found,
    starts,
    order: cython.const[cython.longlong][::1],
    weight: cython.double[::1],
    by_side: cython.double[::1],
    by_place: cython.double[:, ::1],
) -> None:
    """Add up the derivative of the weighted sum of distances by the sides (3 m,), and by the places of source points.

    Parameters
    ----------
    tables, found, starts
        As for `paths.trace_back`; e source points.
    order : (n,)
        Vertices by ascending distance.
    weight : (n + e,)
        Of each vertex; it is handed on along the paths, in descending order of distance, and behind those of the
        vertices it becomes the sum of the weights of all paths to each source point.
    by_side, by_place : (3 m,), (e, 3)
        Take the derivatives.
    """
    tracer: PathTracer = PathTracer(tables, found, starts)
    n: cython.int = order.shape[0]
    with cython.nogil:
        for i in range(n - 1, -1, -1):
            v: cython.int = cython.cast(cython.int, order[i])
            row: cython.int = _follow(tracer, v) if weight[v] != 0.0 else -1
            if row < 0:
                continue
            at_end: cython.p_double = cython.NULL
            if row >= n:
                at_end = cython.address(by_place[row - n, 0])
            _along(tracer, weight[v], cython.address(by_side[0]), cython.NULL, at_end, cython.NULL)
            weight[row] += weight[v]


def push_forward(
    tables,
    found,
    starts,
    order: cython.const[cython.longlong][::1],
    tangent: cython.const[cython.double][::1],
    moves: cython.const[cython.double][:, ::1],
    change: cython.double[::1],
) -> None:
    """The derivative of all distances, `change` (n + e,), for sides that change by `tangent` (3 m,).

    The coordinates of source points change by `moves` (e, 3). On entry, `change` holds the changes of the offsets of
    sources. Other arguments as for `pull_back`.
    """
    tracer: PathTracer = PathTracer(tables, found, starts)
    n: cython.int = order.shape[0]
    with cython.nogil:
        for i in range(n):
            v: cython.int = cython.cast(cython.int, order[i])
            row: cython.int = _follow(tracer, v)
            if row < 0:
                continue
            end_moves: cython.pointer[cython.const[cython.double]] = cython.NULL
            if row >= n:
                end_moves = cython.address(moves[row - n, 0])
            change[v] = change[row]
            change[v] += _along(tracer, 1.0, cython.NULL, cython.address(tangent[0]), cython.NULL, end_moves)
