"""Fill gaps of a triangulated point cloud: ears are clipped from the loops of boundary edges in space."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.cloud.agreeing import circumradius
from cython.cimports.heat_igl.kernels.cloud.loop_filling import BEYOND, POINT
from cython.cimports.libc.math import INFINITY, sqrt

from heat_igl.kernels.mesh.incidence import corners_by_vertex


def torn_points(
    F: cython.const[cython.int][:, ::1],
    nearest: cython.const[cython.int][:, ::1],
    is_part: cython.const[cython.uchar][::1],
    edges_away: cython.Py_ssize_t,
):
    """The first points of those rows of `nearest` (k, j) of which another point is more than `edges_away` edges away.

    Next to another sheet, thin parts are torn there. Other points outside all parts (`is_part` (n,)) are ignored.
    """
    n: cython.Py_ssize_t = is_part.shape[0]
    torn = np.zeros(nearest.shape[0], np.bool_)
    is_torn: cython.uchar[::1] = torn.view(np.uint8)
    corners_at = corners_by_vertex(F, n)
    first: cython.const[cython.int][::1] = corners_at[0]
    incident: cython.const[cython.int][::1] = corners_at[1]
    # The last row whose search reached each point, and the points that the search of this row reached.
    row_of: cython.int[::1] = np.full(n, -1, np.int32)
    reached: cython.int[::1] = np.empty(n + 1, np.int32)
    with cython.nogil:
        for row in range(nearest.shape[0]):
            reached[0], row_of[nearest[row, 0]] = nearest[row, 0], row
            begin: cython.Py_ssize_t = 0
            end: cython.Py_ssize_t = 1
            for step in range(edges_away + 1):
                is_torn[row] = 0
                for j in range(1, nearest.shape[1]):
                    is_torn[row] |= row_of[nearest[row, j]] != row and is_part[nearest[row, j]]
                if not is_torn[row] or step == edges_away:
                    break
                last: cython.Py_ssize_t = end
                for at in range(begin, last):
                    for place in range(first[reached[at]], first[reached[at] + 1]):
                        for c in range(3):
                            v: cython.int = F[incident[place] // 3, c]
                            # Without a branch: either is true at random.
                            reached[end] = v
                            end += row_of[v] != row
                            row_of[v] = row
                begin = last
    return np.asarray(nearest)[torn, 0]


def filling_triangles(
    P: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    twin: cython.const[cython.int][::1],
    is_gap: cython.const[cython.uchar][::1],
    largest: cython.const[cython.double][::1],
    most_bent: cython.double,
    most_folded: cython.double,
):
    """Triangles between the fans of a point, and in the loops of boundary edges.

    The ear with the smallest circumcircle is clipped from a loop repeatedly, as long as an ear is admissible: this
    fills small gaps, and notches of holes and of the boundary. Ears that join two fans of a point come first, whatever
    their size, in ascending order of the third side. Ears that fold back, as in creases, or whose third side is longer
    than the largest admissible circumradius, come last, and are kept only if they close the loop.

    Parameters
    ----------
    P : (n, 3) float64
        Points.
    F : (m, 3) int32
        All triangles at the points of gaps.
    twin : (3 m,) int32
        The half-edge glued to each half-edge ``3 f + c``, which is opposite to corner c; negative on the boundary.
    is_gap : (n,) bool
        The points of gaps, ends of boundary edges.
    largest : (n,) float64
        Largest admissible circumradius of triangles at each point.
    most_bent, most_folded : float
        Largest admissible cosine of the dihedral angle to a neighbour, 1 for triangles folded onto each other: for
        ears that are clipped first, and for ears that close a loop.

    Returns
    -------
    triangles : (t, 3) int32
    is_whole : (t,) bool
        Whether the triangle is in a loop that was filled completely, and joins no fans.
    """
    n_sides: cython.Py_ssize_t = twin.shape[0]
    k: cython.Py_ssize_t = np.count_nonzero(np.asarray(twin) < 0)
    found, whole = np.empty((k, 3), np.int32), np.empty(k, np.bool_)
    is_whole: cython.uchar[::1] = whole.view(np.uint8)
    triangles: cython.int[:, ::1] = found
    # The end at which a loop continues after end 2 h + d of the boundary side h (d = 0 at its tail); -1 if nowhere.
    partner: cython.int[::1] = np.full(2 * n_sides, -1, np.int32)
    # The number of fans at each point minus one, decreased by each triangle between two fans.
    joints: cython.int[::1] = np.zeros(P.shape[0], np.int32)
    seen: cython.uchar[::1] = np.zeros(n_sides, np.uint8)
    ring: cython.int[:, ::1] = np.empty((2, k), np.int32)
    fans: cython.int[:, ::1] = np.empty((3, k), np.int32)
    cost: cython.double[::1] = np.empty(k)
    # Linked lists of the edges, each at the end with the lower index.
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    link: cython.int[:, ::1] = np.empty((n_sides + k, 2), np.int32)
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        _find_loops(P, F, twin, is_gap, partner, joints, head, link, fans)
        for h in range(n_sides):
            if twin[h] < h and is_gap[_at_end(F, 2 * h)] and is_gap[_at_end(F, 2 * h + 1)]:
                _enter(head, link, h, _at_end(F, 2 * h), _at_end(F, 2 * h + 1))
        for h in range(n_sides):
            if partner[2 * h] >= 0 and not seen[h]:
                size: cython.Py_ssize_t = _loop(h, F, partner, seen, ring)
                if size >= 3:
                    cut: cython.Py_ssize_t = _fill(
                        P,
                        ring,
                        cost,
                        size,
                        joints,
                        largest,
                        head,
                        link,
                        n_sides + count,
                        most_bent,
                        most_folded,
                        triangles[count:],
                        is_whole[count:],
                    )
                    if cut < size - 2:
                        is_whole[count : count + cut] = 0
                    count += cut
    return found[:count], whole[:count]


@cython.cfunc
@cython.inline
@cython.nogil
def _at_end(F: cython.const[cython.int][:, ::1], end: cython.Py_ssize_t) -> cython.int:
    """The point at end 2 h + d of side h."""
    h: cython.Py_ssize_t = end // 2
    return F[h // 3, (h % 3 + 1 + end % 2) % 3]


@cython.cfunc
@cython.nogil
def _find_loops(
    P: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    twin: cython.const[cython.int][::1],
    is_gap: cython.const[cython.uchar][::1],
    partner: cython.int[::1],
    joints: cython.int[::1],
    head: cython.int[::1],
    link: cython.int[:, ::1],
    fans: cython.int[:, ::1],
) -> cython.void:
    """Find the partner of each end of a boundary side: in the same fan if its point has one fan, else in the next fan.

    `joints` takes the number of further fans. `head` is restored.
    """
    for end in range(partner.shape[0]):
        v: cython.int = _at_end(F, end)
        side: cython.int = end // 2
        if twin[side] >= 0 or not (is_gap[v] and is_gap[_at_end(F, end ^ 1)]):
            continue
        at: cython.int = end
        while True:
            # Go to the other side of the triangle at the same point, and to the same edge in the neighbour.
            side = 3 * (at // 6) + (at // 2 % 3 + 2 - at % 2) % 3
            at = 2 * side + 1 - at % 2
            if twin[side] < 0:
                break
            at = 2 * twin[side]
            at += _at_end(F, at) != v
        partner[end] = at
        if end % 2 == 0 and at % 2 == 1:
            # An open fan, whose boundary runs through the point. The fans of a point are linked.
            joints[v] += head[v] >= 0
            link[end // 2, 0], head[v] = head[v], end
    for v in range(head.shape[0]):
        k: cython.Py_ssize_t = 0
        while head[v] >= 0:
            fans[0, k], fans[1, k], fans[2, k] = head[v], partner[head[v]], k
            head[v] = link[head[v] // 2, 0]
            k += 1
        if k > 1:
            _in_one_round(P, F, partner, fans, k)


@cython.cfunc
@cython.nogil
def _in_one_round(
    P: cython.const[cython.double][:, ::1],
    F: cython.const[cython.int][:, ::1],
    partner: cython.int[::1],
    fans: cython.int[:, ::1],
    k: cython.Py_ssize_t,
) -> cython.void:
    """Join k fans of a point into one cycle by setting `partner`, the nearest ends first.

    Rows of `fans` are the two ends of each fan and the chain to which the fan belongs.
    """
    first: cython.Py_ssize_t = 0
    second: cython.Py_ssize_t = 0
    for left in range(k, 0, -1):
        shortest: cython.double = INFINITY
        for i in range(k):
            for j in range(k):
                is_free: cython.bint = fans[0, i] >= 0 and fans[1, j] >= 0
                if is_free and (left == 1 or fans[2, i] != fans[2, j]):
                    a: cython.int = _at_end(F, fans[0, i] ^ 1)
                    b: cython.int = _at_end(F, fans[1, j] ^ 1)
                    square: cython.double = 0.0
                    for x in range(3):
                        square += (P[a, x] - P[b, x]) * (P[a, x] - P[b, x])
                    if square < shortest:
                        shortest, first, second = square, i, j
        partner[fans[0, first]], partner[fans[1, second]] = fans[1, second], fans[0, first]
        fans[0, first] = fans[1, second] = -1
        chain: cython.int = fans[2, second]
        for i in range(k):
            if fans[2, i] == chain:
                fans[2, i] = fans[2, first]


@cython.cfunc
@cython.nogil
def _loop(
    start: cython.Py_ssize_t,
    F: cython.const[cython.int][:, ::1],
    partner: cython.int[::1],
    seen: cython.uchar[::1],
    ring: cython.int[:, ::1],
) -> cython.Py_ssize_t:
    """Collect the points of the loop from a boundary side on, and the opposite corners; their number, 0 if not closed.

    The loop runs against the orientation of the first side's triangle, so new triangles are oriented like those around.
    """
    size: cython.Py_ssize_t = 0
    at: cython.Py_ssize_t = 2 * start + 1
    while not seen[at // 2]:
        h: cython.Py_ssize_t = at // 2
        seen[h] = 1
        ring[POINT, size], ring[BEYOND, size] = _at_end(F, at), F[h // 3, h % 3]
        size += 1
        at = partner[at ^ 1]
    return size if at == 2 * start + 1 else 0


@cython.cfunc
@cython.nogil
def _fill(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[:, ::1],
    cost: cython.double[::1],
    size: cython.Py_ssize_t,
    joints: cython.int[::1],
    largest: cython.const[cython.double][::1],
    head: cython.int[::1],
    link: cython.int[:, ::1],
    n_edges: cython.Py_ssize_t,
    most_bent: cython.double,
    most_folded: cython.double,
    triangles: cython.int[:, ::1],
    is_whole: cython.uchar[::1],
) -> cython.Py_ssize_t:
    """Clip admissible ears from a ring of points; returns their number. The third side of each is added as an edge."""
    count: cython.Py_ssize_t = 0
    flat: cython.Py_ssize_t = -1
    limit: cython.double = most_bent
    for i in range(size):
        cost[i] = _ear(P, ring, size, i, joints, largest, head, link, limit, flat)
    while size > 2:
        best: cython.Py_ssize_t = 0
        for i in range(1, size):
            if cost[i] < cost[best]:
                best = i
        if cost[best] == INFINITY:
            if flat >= 0:
                # The folded ears do not close the loop: remove them and their edges.
                for i in range(count - 1, flat - 1, -1):
                    head[min(triangles[i, 0], triangles[i, 2])] = link[n_edges + i, 1]
                return flat
            flat, limit = count, most_folded
            for i in range(size):
                cost[i] = _ear(P, ring, size, i, joints, largest, head, link, limit, flat)
            continue
        before: cython.Py_ssize_t = size - 1 if best == 0 else best - 1
        after: cython.Py_ssize_t = 0 if best == size - 1 else best + 1
        # Since its cost was computed, its third side may have become an edge, or all fans there may have been joined.
        is_edge: cython.bint = size > 3 and _is_edge(head, link, ring[POINT, before], ring[POINT, after])
        if is_edge or (cost[best] < 0.0 and joints[ring[POINT, best]] == 0):
            cost[best] = _ear(P, ring, size, best, joints, largest, head, link, limit, flat)
            continue
        is_whole[count] = cost[best] >= 0.0
        joints[ring[POINT, best]] -= joints[ring[POINT, best]] > 0
        triangles[count, 0], triangles[count, 1] = ring[POINT, before], ring[POINT, best]
        triangles[count, 2] = ring[POINT, after]
        _enter(head, link, n_edges + count, ring[POINT, before], ring[POINT, after])
        count += 1
        ring[BEYOND, before] = ring[POINT, best]
        size -= 1
        for i in range(best, size):
            ring[POINT, i], ring[BEYOND, i], cost[i] = ring[POINT, i + 1], ring[BEYOND, i + 1], cost[i + 1]
        # The ears of the two neighbours have changed.
        for i in range(best - 1, best + 1):
            j: cython.Py_ssize_t = (i + size) % size
            cost[j] = _ear(P, ring, size, j, joints, largest, head, link, limit, flat)
        if size == 3:  # one triangle is left
            cost[0] = cost[1] = cost[2] = _ear(P, ring, size, 0, joints, largest, head, link, limit, flat)
    return count


@cython.cfunc
@cython.nogil
def _ear(
    P: cython.const[cython.double][:, ::1],
    ring: cython.int[:, ::1],
    size: cython.Py_ssize_t,
    i: cython.Py_ssize_t,
    joints: cython.int[::1],
    largest: cython.const[cython.double][::1],
    head: cython.int[::1],
    link: cython.int[:, ::1],
    most_folded: cython.double,
    flat: cython.Py_ssize_t,
) -> cython.double:
    """Circumradius of the ear at point i of a ring; infinite if the ear is not admissible.

    Negative if the ear joins two fans: minus the inverse square of the third side, so shorter sides come first. As long
    as `flat` is negative, the loop may stay open.
    """
    before: cython.Py_ssize_t = size - 1 if i == 0 else i - 1
    after: cython.Py_ssize_t = 0 if i == size - 1 else i + 1
    a: cython.int = ring[POINT, before]
    b: cython.int = ring[POINT, i]
    c: cython.int = ring[POINT, after]
    if a in (b, c) or b == c or (size > 3 and _is_edge(head, link, a, c)):
        return INFINITY
    square: cython.double = 0.0
    for x in range(3):
        square += (P[c, x] - P[a, x]) * (P[c, x] - P[a, x])
    if joints[b] > 0:
        return -1.0 / square if square > 0.0 else -INFINITY
    radius: cython.double = circumradius(P, a, b, c)
    most: cython.double = min(largest[a], min(largest[b], largest[c]))
    # The last triangle adds no edge, and closes the gap even if its corners are collinear.
    if size > 3 and (radius >= most or (flat < 0 and square > most * most)):
        return INFINITY
    folded: cython.double = max(_fold(P, a, b, c, ring[BEYOND, before]), _fold(P, b, c, a, ring[BEYOND, i]))
    if size == 3:
        folded = max(folded, _fold(P, c, a, b, ring[BEYOND, after]))
    return INFINITY if folded > most_folded else radius


@cython.cfunc
@cython.nogil
def _enter(
    head: cython.int[::1], link: cython.int[:, ::1], e: cython.Py_ssize_t, a: cython.int, b: cython.int
) -> cython.void:
    link[e, 0], link[e, 1] = max(a, b), head[min(a, b)]
    head[min(a, b)] = cython.cast(cython.int, e)


@cython.cfunc
@cython.nogil
def _is_edge(head: cython.int[::1], link: cython.int[:, ::1], a: cython.int, b: cython.int) -> cython.bint:
    e: cython.int = head[min(a, b)]
    while e >= 0 and link[e, 0] != max(a, b):
        e = link[e, 1]
    return e >= 0


@cython.cfunc
@cython.nogil
def _fold(
    P: cython.const[cython.double][:, ::1],
    a: cython.Py_ssize_t,
    b: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    d: cython.Py_ssize_t,
) -> cython.double:
    """Cosine of the angle at edge ab between the triangles with corners c and d: 1 if folded onto each other."""
    square: cython.double = 0.0
    of_c: cython.double = 0.0
    of_d: cython.double = 0.0
    for x in range(3):
        square += (P[b, x] - P[a, x]) * (P[b, x] - P[a, x])
        of_c += (P[c, x] - P[a, x]) * (P[b, x] - P[a, x])
        of_d += (P[d, x] - P[a, x]) * (P[b, x] - P[a, x])
    size_c: cython.double = 0.0
    size_d: cython.double = 0.0
    alike: cython.double = 0.0
    for x in range(3):
        along: cython.double = (P[b, x] - P[a, x]) / square if square > 0.0 else 0.0
        across_c: cython.double = P[c, x] - P[a, x] - of_c * along
        across_d: cython.double = P[d, x] - P[a, x] - of_d * along
        size_c += across_c * across_c
        size_d += across_d * across_d
        alike += across_c * across_d
    size: cython.double = sqrt(size_c) * sqrt(size_d)
    return alike / size if size > 0.0 else -1.0
