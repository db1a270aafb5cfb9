"""Kernel of the unfolding: the path through a place between two vertices whose distances and directions are known.

Distance on the line between two vertices is taken as the cubic polynomial with their distances and slopes, which are
the cosines of their paths' directions. It is right on smooth fronts to fourth order in the length of the line. Where
the paths of both ends pass different sides of vertices with curvature it has a large cubic part, by which it is judged.
"""

import cython
from cython.cimports.heat_igl.kernels.between import LEAST_COSINE, TURN, WIDEST
from cython.cimports.heat_igl.kernels.walks import BETWEEN, Limit, Query, take
from cython.cimports.libc.math import cos, fabs, sin, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take_between(
    q: Query,
    right: cython.pointer[cython.const[Limit]],
    left: cython.pointer[cython.const[Limit]],
    k: cython.int,
    roughness: cython.double,
) -> cython.bint:
    """Note the path between the limits of the cone at spoke k, if the distance on the line between them is smooth.

    Smooth if the cubic part is at most `roughness` times the way to the nearer of both; 0 takes none.
    """
    if not (roughness > 0.0 and right.saving > 0.0 and left.saving > 0.0 and right.saving + left.saving < WIDEST):
        return False
    ex: cython.double = left.x - right.x
    ey: cython.double = left.y - right.y
    c: cython.double = sqrt(ex * ex + ey * ey)
    if not c > 0.0:
        return False
    ex, ey = ex / c, ey / c
    # The directions in which the paths of both go on: turned towards the inside of the cone.
    cosine: cython.double = cos(right.saving) / right.length
    sine: cython.double = sin(right.saving) / right.length
    rx: cython.double = right.x * cosine - right.y * sine
    ry: cython.double = right.x * sine + right.y * cosine
    cosine, sine = cos(left.saving) / left.length, -sin(left.saving) / left.length
    lx: cython.double = left.x * cosine - left.y * sine
    ly: cython.double = left.x * sine + left.y * cosine
    most: cython.double = roughness * min(right.length, left.length)
    if rx * lx + ry * ly < LEAST_COSINE or c * fabs(rx * ly - ry * lx) > TURN * most:
        return False
    # Distance is one + s (first + s (square + s cube)) at a share s of the line; it falls in those directions.
    one: cython.double = q.walk[right.vertex].distance
    first: cython.double = -(rx * ex + ry * ey) * c
    last: cython.double = -(lx * ex + ly * ey) * c
    rise: cython.double = q.walk[left.vertex].distance - one
    square: cython.double = 3.0 * rise - 2.0 * first - last
    cube: cython.double = first + last - 2.0 * rise
    if fabs(cube) > most:
        return False
    # The shortest way over the line meets it at an angle with the cosine p. The mean slope gives a first place, which
    # is the right one on a straight front: directions that are wrong by little add up over many vertices.
    along: cython.double = right.x * ex + right.y * ey
    p: cython.double = min(max(-rise / c, -0.999), 0.999)
    s: cython.double = (p * fabs(right.x * ey - right.y * ex) / sqrt(1.0 - p * p) - along) / c
    s = min(max(s, 0.0), 1.0)
    for _ in range(2):
        x: cython.double = right.x + s * c * ex
        y: cython.double = right.y + s * c * ey
        length: cython.double = sqrt(x * x + y * y)
        p = (along + s * c) / length
        bend: cython.double = c * c * (1.0 - p * p) / length + 2.0 * square + 6.0 * cube * s
        if not bend > 0.0:
            return False
        s -= (c * p + first + s * (2.0 * square + 3.0 * cube * s)) / bend
        s = min(max(s, 0.0), 1.0)
    x, y = right.x + s * c * ex, right.y + s * c * ey
    reach: cython.double = (1.0 - s) * q.walk[right.vertex].reach + s * q.walk[left.vertex].reach
    distance: cython.double = sqrt(x * x + y * y) + one + s * (first + s * (square + s * cube))
    spoke = cython.address(q.t.spoke[k])
    nearer: cython.int = right.vertex if s < 0.5 else left.vertex
    take(q, distance, nearer, x, y, BETWEEN, k, -spoke.along, -spoke.height, reach)
    return True
