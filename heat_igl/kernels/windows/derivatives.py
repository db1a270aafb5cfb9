"""Derivatives of the lengths of straight lines over triangles by the lengths of the edges.

A shortest path consists of straight lines from a vertex to the next vertex that it passes, or to a source point. In a
triangle with sides l, the piece of a line between two places with barycentric coordinates that differ by delta has
length s, and

    s^2 = - sum over pairs i < k of delta_i delta_k l_ik^2.

By the envelope theorem the places on the edges count as fixed, so the derivative of s by l_ik is
- delta_i delta_k l_ik / s. The rest of a path, behind the end of its last line, is added by visiting the vertices in
the order of distance.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.lines import AT_SOURCE, Gate, Lines, Place
from cython.cimports.libc.math import sqrt

__all__ = ["pull_back", "push_forward"]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _squared(side: cython.pointer[cython.const[cython.double]], d: cython.pointer[Place]) -> cython.double:
    """Squared length of a line in a face with these sides; d is the difference of the coordinates of the ends."""
    return -(d.c[1] * d.c[2] * side[0] ** 2 + d.c[2] * d.c[0] * side[1] ** 2 + d.c[0] * d.c[1] * side[2] ** 2)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _piece(
    side: cython.pointer[cython.const[cython.double]],
    one: cython.pointer[Place],
    other: cython.pointer[Place],
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
    d: Place
    c: cython.int
    i: cython.int
    k: cython.int
    total: cython.double = 0.0
    for c in range(3):
        d.c[c] = other.c[c] - one.c[c]
    squared: cython.double = _squared(side, cython.address(d))
    if not squared > 0.0:
        return 0.0
    per_length: cython.double = 1.0 / sqrt(squared)
    for c in range(3):
        i, k = (c + 1) % 3, (c + 2) % 3
        by_side: cython.double = -d.c[i] * d.c[k] * side[c] * per_length
        if slope != cython.NULL:
            slope[c] += weight * by_side
        if tangent != cython.NULL:
            total += by_side * tangent[c]
        if at_end != cython.NULL:
            at_end[c] -= 0.5 * weight * per_length * (d.c[i] * side[k] ** 2 + d.c[k] * side[i] ** 2)
        if end_moves != cython.NULL:
            total -= 0.5 * per_length * (d.c[i] * side[k] ** 2 + d.c[k] * side[i] ** 2) * end_moves[c]
    return total


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _along(
    lines: Lines,
    weight: cython.double,
    slope: cython.pointer[cython.double],
    at_end: cython.pointer[cython.double],
    tangent: cython.pointer[cython.const[cython.double]],
    end_moves: cython.pointer[cython.const[cython.double]],
) -> cython.double:
    """All pieces of the line that was followed; as `_piece`, with the arrays of all sides and source points."""
    one: Place
    other: Place
    total: cython.double = 0.0
    none: cython.pointer[cython.double] = cython.NULL
    nowhere: cython.pointer[cython.const[cython.double]] = cython.NULL
    of_face: cython.pointer[cython.double] = cython.NULL
    tangent_of_face: cython.pointer[cython.const[cython.double]] = cython.NULL
    j: cython.int
    f: cython.int
    one.c[0] = one.c[1] = one.c[2] = 0.0
    one.c[lines.corner] = 1.0
    for j in range(lines.n_gates):
        gate = cython.address(lines.gate[j])
        share: cython.double = lines.place_at(j)
        other.c[0] = other.c[1] = other.c[2] = 0.0
        other.c[gate.right], other.c[gate.left] = 1.0 - share, share
        f = gate.leave - gate.leave % 3
        if slope != cython.NULL:
            of_face = slope + f
        if tangent != cython.NULL:
            tangent_of_face = tangent + f
        sides = cython.address(lines.length[f])
        total += _piece(
            sides, cython.address(one), cython.address(other), weight, of_face, tangent_of_face, none, nowhere
        )
        # The same point by coordinates in the next face.
        f = gate.enter - gate.enter % 3
        one.c[0] = one.c[1] = one.c[2] = 0.0
        tail_is_left: cython.bint = _tail_is_left(lines, gate)
        one.c[next_half_edge(gate.enter) - f] = share if tail_is_left else 1.0 - share
        one.c[previous_half_edge(gate.enter) - f] = 1.0 - share if tail_is_left else share
    f = lines.end.face
    if slope != cython.NULL:
        of_face = slope + f
    if tangent != cython.NULL:
        tangent_of_face = tangent + f
    place = at_end
    if at_end != cython.NULL:
        place = at_end + 3 * lines.end.entry
        if lines.end.entry < 0:
            place = none
    moves = end_moves
    if end_moves != cython.NULL:
        moves = end_moves + 3 * lines.end.entry
        if lines.end.entry < 0:
            moves = nowhere
    sides = cython.address(lines.length[f])
    return total + _piece(
        sides, cython.address(one), cython.address(lines.end.at), weight, of_face, tangent_of_face, place, moves
    )


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _tail_is_left(lines: Lines, gate: cython.pointer[Gate]) -> cython.bint:
    """Whether the left end of a gate is the tail of the half-edge by which the face behind it is entered."""
    opposite: cython.bint = lines.aligned[gate.leave]
    if lines.twin[gate.leave] == -2:
        opposite = lines.vertex[next_half_edge(gate.leave)] != lines.vertex[next_half_edge(gate.enter)]
    return gate.turns_left == opposite


def pull_back(
    triangles,
    points,
    ways,
    order: cython.const[cython.int][::1],
    weight: cython.double[::1],
    by_side: cython.double[::1],
    by_place: cython.double[:, ::1],
    is_lost: cython.uchar[::1],
):
    """Add up the derivative of the weighted sum of path lengths by the sides (3 m,), and by the source points' places.

    `weight` (n + e,) is handed on along the paths, in descending `order` of distance; at the sources it ends as the sum
    of the weights of all paths to them. Vertices whose line does not meet its end are marked in `is_lost` (n,). Other
    arguments as `heat_igl.windows.path_derivatives.Paths` makes them.
    """
    lines = Lines(triangles, points, ways)
    at_end: cython.pointer[cython.double] = cython.NULL
    i: cython.Py_ssize_t
    v: cython.int
    with cython.nogil:
        if by_place.shape[0] > 0:
            at_end = cython.address(by_place[0, 0])
        for i in range(order.shape[0] - 1, -1, -1):
            v = order[i]
            if lines.kind[v] == AT_SOURCE or weight[v] == 0.0:
                continue
            if not lines.follow(v):
                is_lost[v] = True
                continue
            _along(lines, weight[v], cython.address(by_side[0]), at_end, cython.NULL, cython.NULL)
            weight[lines.end.row] += weight[v]


def push_forward(
    triangles,
    points,
    ways,
    order: cython.const[cython.int][::1],
    tangent: cython.const[cython.double][::1],
    moves: cython.const[cython.double][:, ::1],
    change: cython.double[::1],
    is_lost: cython.uchar[::1],
):
    """The derivative of all path lengths, `change` (n + e,), for sides that change by `tangent` (3 m,).

    The source points' coordinates change by `moves` (e, 3). On entry, `change` holds the changes of the sources'
    offsets. Other arguments as for `pull_back`.
    """
    lines = Lines(triangles, points, ways)
    end_moves: cython.pointer[cython.const[cython.double]] = cython.NULL
    i: cython.Py_ssize_t
    v: cython.int
    with cython.nogil:
        if moves.shape[0] > 0:
            end_moves = cython.address(moves[0, 0])
        for i in range(order.shape[0]):
            v = order[i]
            if lines.kind[v] == AT_SOURCE:
                continue
            if not lines.follow(v):
                is_lost[v] = True
                continue
            change[v] = _along(lines, 1.0, cython.NULL, cython.NULL, cython.address(tangent[0]), end_moves)
            change[v] += change[lines.end.row]
