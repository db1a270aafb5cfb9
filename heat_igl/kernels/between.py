"""Kernel of the unfolding: the path through a place between two vertices whose distances and directions are known."""

import cython
from cython.cimports.heat_igl.kernels.between import LEAST_COSINE
from cython.cimports.heat_igl.kernels.walks import BETWEEN, Limit, Query, take
from cython.cimports.libc.math import cos, fabs, sin, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take_between(
    q: Query, right: cython.pointer[cython.const[Limit]], left: cython.pointer[cython.const[Limit]], k: cython.int
) -> cython.bint:
    """Note the path between the limits of the cone at spoke k, if the distances on the line between them are smooth."""
    if right.saving <= 0.0 or left.saving <= 0.0:
        return False
    if right.saving + left.saving > 1.5:
        return False
    ex: cython.double = left.x - right.x
    ey: cython.double = left.y - right.y
    c: cython.double = sqrt(ex * ex + ey * ey)
    if not c > 0.0:
        return False
    ex, ey = ex / c, ey / c
    # The directions in which the paths of both go on, away from v: turned towards the inside of the cone.
    co: cython.double = cos(right.saving) / right.length
    si: cython.double = sin(right.saving) / right.length
    rx: cython.double = right.x * co - right.y * si
    ry: cython.double = right.x * si + right.y * co
    co = cos(left.saving) / left.length
    si = -sin(left.saving) / left.length
    lx: cython.double = left.x * co - left.y * si
    ly: cython.double = left.x * si + left.y * co
    differ: cython.double = rx * ly - ry * lx
    cosine: cython.double = rx * lx + ry * ly
    length: cython.double = min(right.length, left.length)
    if cosine < LEAST_COSINE or c * fabs(differ) > 100.0 * q.roughness * length:
        return False
    # Distance along the line falls in those directions.
    at_right: cython.double = -(rx * ex + ry * ey) * c
    at_left: cython.double = -(lx * ex + ly * ey) * c
    one: cython.double = q.walk[right.vertex].distance
    rise: cython.double = q.walk[left.vertex].distance - one
    # Distance is one + s (at_right + s (a + s b)) at a share s of the line.
    a: cython.double = 3.0 * rise - 2.0 * at_right - at_left
    b: cython.double = at_right + at_left - 2.0 * rise
    if fabs(b) > q.roughness * length:
        return False
    along: cython.double = right.x * ex + right.y * ey
    # The derivative of the length is negative at the right end, positive at the left.
    first: cython.double = c * along / right.length + at_right
    last: cython.double = c * (along + c) / left.length + at_left
    if first >= 0.0 or last <= 0.0:
        return False
    s: cython.double = first / (first - last)
    x: cython.double = 0.0
    y: cython.double = 0.0
    r: cython.double = 0.0
    for _ in range(3):
        x, y = right.x + s * c * ex, right.y + s * c * ey
        r = sqrt(x * x + y * y)
        p: cython.double = (along + s * c) / r
        slope: cython.double = c * p + at_right + s * (2.0 * a + 3.0 * b * s)
        bend: cython.double = c * c * (1.0 - p * p) / r + 2.0 * a + 6.0 * b * s
        if not bend > 0.0:
            return False
        s -= slope / bend
        s = min(max(s, 0.0), 1.0)
    x, y = right.x + s * c * ex, right.y + s * c * ey
    r = sqrt(x * x + y * y)
    distance: cython.double = r + one + s * (at_right + s * (a + s * b))
    reach: cython.double = (1.0 - s) * q.walk[right.vertex].reach + s * q.walk[left.vertex].reach
    spoke = cython.address(q.t.spoke[k])
    end: cython.int = right.vertex if s < 0.5 else left.vertex
    take(q, distance, end, x, y, BETWEEN, k, -spoke.along, -spoke.height, reach)
    return True
