"""Triangles of a point cloud: the Delaunay star of each point among its neighbours, in its tangent plane."""

import cython
import numpy as np
from cython.cimports.libc.math import INFINITY, fabs, sqrt

# Squared distance, in shares of that of the largest circle, beyond which a point is outside of it beyond doubt.
_OUTSIDE = cython.declare(cython.double, 1 + 2e-9)


def delaunay_stars(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    neighbours: cython.const[cython.int][:, ::1],
    largest: cython.const[cython.double][::1],
    least_cosine: cython.const[cython.double][::1],
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
):
    """The Delaunay triangles at the points from `begin` to `end` among their neighbours, in tangent planes.

    `axes` (n, 3, 3) are the tangents and the normal of each of the points P (n, 3); rows of `neighbours` (n, k) ascend
    by distance. Triangles with a circumscribed circle of a radius above `largest` (n,) are left out, and neighbours
    whose normals have a product below `least_cosine` (n,).

    Returns the triangles (s, 3) int32, star by star, the point itself first and counterclockwise around it; and whether
    each star goes all the way around its point.
    """
    n: cython.Py_ssize_t = end - begin
    k: cython.Py_ssize_t = neighbours.shape[1]
    corners, closed = np.empty((n * k, 3), np.int32), np.zeros(n, np.bool_)
    is_closed: cython.uchar[::1] = closed.view(np.uint8)
    found: cython.int[:, ::1] = corners
    star: cython.double[:, ::1] = np.empty((k + 1, 3))
    members: cython.int[::1] = np.empty(k + 1, np.int32)
    stack: cython.int[::1] = np.empty(k + 2, np.int32)
    m: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(begin, end):
            before: cython.Py_ssize_t = m
            count: cython.Py_ssize_t = _neighbours_around(i, P, axes, neighbours, least_cosine, star, members, stack)
            if count >= 2:
                top: cython.Py_ssize_t = _visible_hull(count, star, stack)
                m = _triangles(i, top, star, members, stack, largest[i], found, m)
                is_closed[i - begin] = m - before == top
    return corners[:m].copy(), closed


def _neighbours_around(i, P, axes, neighbours, least_cosine, star, members, stack):
    """Put the neighbours of point i into `star` and `members`, sorted by angle and inverted; return how many there are.

    The inversion p / |p|^2 takes circles through the point to straight lines: the star of the point is the part of the
    convex hull of the inverted neighbours that it sees, found by Graham's scan. Neighbours beyond the circles of the
    nearest ones are left out.
    """
    size: cython.Py_ssize_t = 0
    reach: cython.double = INFINITY  # squared: twice the largest radius of the circles of the star
    for a in range(neighbours.shape[1]):
        j: cython.Py_ssize_t = neighbours[i, a]
        if j < 0 or j == i:
            continue
        if least_cosine[i] > -1.0 and (
            axes[i, 2, 0] * axes[j, 2, 0] + axes[i, 2, 1] * axes[j, 2, 1] + axes[i, 2, 2] * axes[j, 2, 2]
            < least_cosine[i]
        ):
            continue
        if size == FEW and reach == INFINITY:
            reach = _reach(_visible_hull(size, star, stack), star, stack)
        dx: cython.double = P[j, 0] - P[i, 0]
        dy: cython.double = P[j, 1] - P[i, 1]
        dz: cython.double = P[j, 2] - P[i, 2]
        square: cython.double = dx * dx + dy * dy + dz * dz
        if square > reach:
            break
        x: cython.double = dx * axes[i, 0, 0] + dy * axes[i, 0, 1] + dz * axes[i, 0, 2]
        y: cython.double = dx * axes[i, 1, 0] + dy * axes[i, 1, 1] + dz * axes[i, 1, 2]
        # A point above the centre has no direction in the plane.
        if x * x + y * y <= 1e-12 * square:
            continue
        # The direction is that of the projection, and the distance that in space.
        scale: cython.double = 1.0 / sqrt((x * x + y * y) * square)
        # Grows with the angle, and needs no arctangent.
        angle: cython.double = y / (fabs(x) + fabs(y))
        if x < 0.0:
            angle = 2.0 - angle
        b: cython.Py_ssize_t = size
        while b > 0 and star[b - 1, ANGLE] > angle:
            star[b, ANGLE], star[b, X], star[b, Y] = star[b - 1, ANGLE], star[b - 1, X], star[b - 1, Y]
            members[b] = members[b - 1]
            b -= 1
        star[b, ANGLE], star[b, X], star[b, Y] = angle, scale * x, scale * y
        members[b] = cython.cast(cython.int, j)
        size += 1
    return size


def _visible_hull(size, star, stack):
    """The scan around the point, from the neighbour that is nearest in the plane: `stack` gets the corners of the hull.

    Returns how many sides there are; the last corner is the first.
    """
    first: cython.Py_ssize_t = 0
    for a in range(size):
        if _square(star, a) > _square(star, first):
            first = a
    top: cython.Py_ssize_t = 0
    stack[0] = cython.cast(cython.int, first)
    for a in range(1, size + 1):
        # The last round comes back to the first, which stays in any case.
        following: cython.Py_ssize_t = first + a
        if following >= size:
            following -= size
        while top > 0 and _is_hidden(star, stack[top - 1], stack[top], following):
            top -= 1
        top += 1
        stack[top] = cython.cast(cython.int, following)
    return top


def _reach(top, star, stack):
    """Squared distance beyond which neighbours are in no circle of the star; infinite if it is not around the point."""
    largest: cython.double = 0.0
    for a in range(top):
        p: cython.Py_ssize_t = stack[a]
        q: cython.Py_ssize_t = stack[a + 1]
        turn: cython.double = star[p, X] * star[q, Y] - star[p, Y] * star[q, X]
        if turn <= 0.0:
            return INFINITY
        dx: cython.double = star[q, X] - star[p, X]
        dy: cython.double = star[q, Y] - star[p, Y]
        largest = max(largest, (dx * dx + dy * dy) / (turn * turn))
    return _OUTSIDE * largest


def _triangles(i, top, star, members, stack, largest, found, m):
    """Append the triangles of point i on the sides of the hull to the m that are found; return how many there are."""
    for a in range(top):
        p: cython.Py_ssize_t = stack[a]
        q: cython.Py_ssize_t = stack[a + 1]
        turn: cython.double = star[p, X] * star[q, Y] - star[p, Y] * star[q, X]
        dx: cython.double = star[q, X] - star[p, X]
        dy: cython.double = star[q, Y] - star[p, Y]
        side: cython.double = sqrt(dx * dx + dy * dy)
        # The line through two inverted points is 1 / (2 R) away from the point; beyond half a turn there is no face.
        if turn > 0.0 and side <= 2.0 * largest * turn:
            found[m, 0], found[m, 1], found[m, 2] = cython.cast(cython.int, i), members[p], members[q]
            m += 1
    return m


def _square(star, a):
    return star[a, X] * star[a, X] + star[a, Y] * star[a, Y]


def _is_hidden(star, p, q, r):
    """Whether q lies behind the line from p to r, less than half a turn apart."""
    if star[p, X] * star[r, Y] - star[p, Y] * star[r, X] <= 0.0:
        return False
    ax: cython.double = star[q, X] - star[p, X]
    ay: cython.double = star[q, Y] - star[p, Y]
    bx: cython.double = star[r, X] - star[p, X]
    by: cython.double = star[r, Y] - star[p, Y]
    return ax * by - ay * bx <= 0.0
