"""Agreement of the stars of a point cloud: how many of them have a triangle."""

import cython
import numpy as np
from cython.cimports.libc.math import sqrt


def agreement(
    P: cython.const[cython.double][:, ::1],
    first: cython.const[cython.longlong][::1],
    triangles: cython.const[cython.int][:, ::1],
    is_closed: cython.const[cython.uchar][::1],
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
):
    """In how many stars the triangles are, for the stars of the points P (n, 3) from `begin` to `end`.

    The star of point i is the rows ``first[i]`` to ``first[i + 1]`` of `triangles` (s, 3), the point itself first in
    each; `is_closed` (n,) tells whether it goes all the way around the point.

    Returns, for the b rows of these stars, `count` (b,) uint8, the number of stars that have the triangle (1 to 3; 0 in
    all rows of it but the one in the star of its lowest point that has it), and the `radius` (b,) of the circle around
    a triangle with a count of 1 or 2 (0 in other rows). Then, for each of these points, whether it is settled: its star
    is closed, and all triangles of the star are in three stars.
    """
    offset: cython.Py_ssize_t = first[begin]
    counts, settled = np.zeros(first[end] - offset, np.uint8), np.empty(end - begin, np.uint8)
    radii = np.zeros(len(counts))
    count: cython.uchar[::1] = counts
    radius: cython.double[::1] = radii
    is_settled: cython.uchar[::1] = settled
    with cython.nogil:
        for i in range(begin, end):
            is_settled[i - begin] = is_closed[i]
            for row in range(first[i], first[i + 1]):
                a: cython.int = triangles[row, 1]
                b: cython.int = triangles[row, 2]
                of_a: cython.Py_ssize_t = _row_of(first, triangles, a, b, triangles[row, 0])
                of_b: cython.Py_ssize_t = _row_of(first, triangles, b, a, triangles[row, 0])
                if of_a < 0 or of_b < 0:
                    is_settled[i - begin] = 0
                if (of_a >= 0 and a < i) or (of_b >= 0 and b < i):
                    continue
                count[row - offset] = 1 + (of_a >= 0) + (of_b >= 0)
                if count[row - offset] < 3:
                    radius[row - offset] = circumradius(P, i, a, b)
    return counts, radii, settled


@cython.cfunc
@cython.inline
@cython.nogil
def _row_of(
    first: cython.const[cython.longlong][::1],
    triangles: cython.const[cython.int][:, ::1],
    i: cython.int,
    a: cython.int,
    b: cython.int,
) -> cython.Py_ssize_t:
    """The row of the triangle of i, a and b in the star of i, or -1."""
    for row in range(first[i], first[i + 1]):
        p: cython.int = triangles[row, 1]
        q: cython.int = triangles[row, 2]
        if (p == a and q == b) or (p == b and q == a):
            return row
    return -1


@cython.cfunc
@cython.nogil
def circumradius(
    P: cython.const[cython.double][:, ::1], a: cython.Py_ssize_t, b: cython.Py_ssize_t, c: cython.Py_ssize_t
) -> cython.double:
    """Radius of the circle through three points: the same number in whatever order they are given."""
    first: cython.Py_ssize_t = min(a, min(b, c))
    last: cython.Py_ssize_t = max(a, max(b, c))
    middle: cython.Py_ssize_t = a + b + c - first - last
    x: cython.double = P[middle, 0] - P[first, 0]
    y: cython.double = P[middle, 1] - P[first, 1]
    z: cython.double = P[middle, 2] - P[first, 2]
    u: cython.double = P[last, 0] - P[first, 0]
    v: cython.double = P[last, 1] - P[first, 1]
    w: cython.double = P[last, 2] - P[first, 2]
    dx: cython.double = P[last, 0] - P[middle, 0]
    dy: cython.double = P[last, 1] - P[middle, 1]
    dz: cython.double = P[last, 2] - P[middle, 2]
    product: cython.double = sqrt(x * x + y * y + z * z) * sqrt(dx * dx + dy * dy + dz * dz)
    product *= sqrt(u * u + v * v + w * w)
    p: cython.double = y * w - z * v
    q: cython.double = z * u - x * w
    r: cython.double = x * v - y * u
    across: cython.double = sqrt(p * p + q * q + r * r)
    # The circle through collinear points is larger than any other.
    return 0.5 * product / across if across > 0.0 else 1e300
