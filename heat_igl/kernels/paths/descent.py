"""The steepest descent of a distance that is linear in each face."""

import cython
from cython.cimports.heat_igl.kernels.paths.descent import Departure, Descent, nowhere
from cython.cimports.heat_igl.kernels.paths.surfaces import SNAP, Place, Surface, between
from cython.cimports.libc.math import INFINITY, isfinite, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def steepest(s: Surface, f: cython.int) -> Descent:
    """The steepest descent in face f; the slope is -1 if a corner has no finite value."""
    found: Descent
    t = cython.address(s.triangle[f])
    d0: cython.double = s.d[t.vertex[0]]
    d1: cython.double = s.d[t.vertex[1]]
    d2: cython.double = s.d[t.vertex[2]]
    if not (isfinite(d0) and isfinite(d1) and isfinite(d2)):
        found.slope = -1.0
        found.rate[0] = found.rate[1] = found.rate[2] = 0.0
        return found
    a: cython.double = t.length[0]
    b: cython.double = t.length[1]
    c: cython.double = t.length[2]
    half: cython.double = 0.5 * (a + b + c)
    area: cython.double = half * (half - a) * (half - b) * (half - c)  # squared
    # The scalar products of the gradients of two coordinates, times -4 area^2.
    dot01: cython.double = 0.5 * (a * a + b * b - c * c)
    dot12: cython.double = 0.5 * (b * b + c * c - a * a)
    dot20: cython.double = 0.5 * (c * c + a * a - b * b)
    found.rate[0] = (d1 - d0) * dot01 + (d2 - d0) * dot20
    found.rate[1] = (d0 - d1) * dot01 + (d2 - d1) * dot12
    found.rate[2] = (d0 - d2) * dot20 + (d1 - d2) * dot12
    squared: cython.double = (d0 - d1) * (d0 - d1) * dot01 + (d1 - d2) * (d1 - d2) * dot12
    squared += (d2 - d0) * (d2 - d0) * dot20
    found.slope = sqrt(max(squared, 0.0) / (4.0 * area)) if area > 0.0 else 0.0
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def leave_vertex(s: Surface, v: cython.int) -> Departure:
    """Start of the steepest descent from vertex v."""
    best: Departure = nowhere()
    steepest_slope: cython.double = 0.0
    k: cython.int
    i: cython.int
    for k in range(s.first_corner[v], s.first_corner[v + 1]):
        f: cython.int = s.corner[k] // 3
        c: cython.int = s.corner[k] % 3
        c1: cython.int = (c + 1) % 3
        c2: cython.int = (c + 2) % 3
        found: Descent = steepest(s, f)
        if found.slope > steepest_slope and found.rate[c1] > 0.0 and found.rate[c2] > 0.0:
            share: cython.double = found.rate[c2] / (found.rate[c1] + found.rate[c2])
            if SNAP < share < 1.0 - SNAP:
                best.face, best.vertex, steepest_slope = f, -1, found.slope
                best.at = between(c1, c2, share)
        for i in range(2):
            c_other: cython.int = c1 if i == 0 else c2
            w: cython.int = s.triangle[f].vertex[c_other]
            slope: cython.double = (s.d[v] - s.d[w]) / s.triangle[f].length[3 - c - c_other]
            if slope > steepest_slope:
                best.face, best.vertex, steepest_slope = f, w, slope
    return best


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def leave_face(x: cython.pointer[Place], rate: cython.pointer[cython.const[cython.double]]) -> cython.void:
    """Move x along `rate` to the border of the face."""
    out: cython.int = 0
    way: cython.double = INFINITY
    c: cython.int
    for c in range(3):
        if rate[c] < 0.0 and x.c[c] < way * -rate[c]:
            out, way = c, x.c[c] / -rate[c]
    for c in range(3):
        x.c[c] = max(x.c[c] + way * rate[c], 0.0)
    x.c[out] = 0.0
    total: cython.double = x.c[0] + x.c[1] + x.c[2]
    for c in range(3):
        x.c[c] /= total
