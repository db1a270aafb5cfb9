"""Straight ways to a source, from the distances at vertices ahead: for paths that descent makes too long."""

import cython
from cython.cimports.heat_igl.kernels.paths.aiming import Aim, Apex
from cython.cimports.heat_igl.kernels.paths.descent import Departure, nowhere
from cython.cimports.heat_igl.kernels.paths.surfaces import (
    SNAP,
    Place,
    Surface,
    at_corner,
    between,
    corner_of,
    only_corner,
)
from cython.cimports.libc.math import INFINITY, fabs, hypot, isfinite, sqrt


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def aim(
    s: Surface,
    f: cython.int,
    x: cython.pointer[cython.const[Place]],
    left: cython.double,
    best: cython.double,
    out: cython.pointer[Place],
) -> cython.double:
    """Of ways to a source, from point x of face f over a side of it, the one whose length is nearest to `left`.

    They go straight to a corner, or straight over a side to the far corner of a face beyond it, and are as long as the
    distance says from there; or straight over a side to the point at which the distances at both ends place the source,
    in the plane of the face. If the length differs from `left` by less than `best`, the difference is returned and
    `out` set to the point at which the way leaves the face; `best` otherwise.
    """
    t = cython.address(s.triangle[f])
    one: Aim
    c: cython.int
    k: cython.int
    for c in range(3):
        a: cython.int = (c + 1) % 3
        b: cython.int = (c + 2) % 3
        da: cython.double = s.d[t.vertex[a]]
        db: cython.double = s.d[t.vertex[b]]
        side: cython.double = t.length[c]
        if x.c[c] <= 0.0 or not (isfinite(da) and isfinite(db)):
            continue
        # The side along the axis from a to b, the face above it.
        apex: Apex = _apex(t.length[b], t.length[a], side)
        px: cython.double = x.c[b] * side + x.c[c] * apex.along
        py: cython.double = x.c[c] * apex.height
        one.share, one.length = 0.0, hypot(px, py) + da
        best = _nearer(one, left, best, a, b, out)
        one.share, one.length = 1.0, hypot(px - side, py) + db
        best = _nearer(one, left, best, a, b, out)
        best = _nearer(_over(px, py, _apex(da, db, side), side), left, best, a, b, out)
        for k in range(s.first_side[t.edge[c]], s.first_side[t.edge[c] + 1]):
            g: cython.int = s.side[k]
            if g == 3 * f + c:
                continue
            e = cython.address(s.triangle[g // 3])
            at_a: cython.int = corner_of(s, g // 3, t.vertex[a])
            at_b: cython.int = corner_of(s, g // 3, t.vertex[b])
            one = _over(px, py, _apex(e.length[at_b], e.length[at_a], side), side)
            one.length += s.d[e.vertex[g % 3]]
            best = _nearer(one, left, best, a, b, out)
    return best


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def aim_from_vertex(s: Surface, v: cython.int) -> Departure:
    """The start of the way from vertex v with the length nearest to the distance there."""
    best: Departure = nowhere()
    out: Place = best.at
    off: cython.double = INFINITY
    k: cython.int
    for k in range(s.first_corner[v], s.first_corner[v + 1]):
        at: Place = at_corner(s.corner[k] % 3)
        nearer: cython.double = aim(s, s.corner[k] // 3, cython.address(at), s.d[v], off, cython.address(out))
        if nearer < off:
            best.face, best.at, off = s.corner[k] // 3, out, nearer
    if best.face >= 0 and only_corner(cython.address(best.at)) >= 0:
        best.vertex = s.triangle[best.face].vertex[only_corner(cython.address(best.at))]
    return best


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _nearer(
    one: Aim, left: cython.double, best: cython.double, a: cython.int, b: cython.int, out: cython.pointer[Place]
) -> cython.double:
    """How far the length of a way over the side ab is from `left`, if that is less than `best`, and `out` set to it."""
    off: cython.double = fabs(one.length - left)
    if off < best:
        out[0] = between(a, b, one.share)
        return off
    return best


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _apex(a: cython.double, b: cython.double, side: cython.double) -> Apex:
    """The third corner of a triangle on a side along the axis, from the distances to both ends."""
    found: Apex
    found.along = 0.5 * ((a - b) * (a + b) / side + side)
    found.height = sqrt(max(a * a - found.along * found.along, 0.0))
    return found


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _over(px: cython.double, py: cython.double, q: Apex, side: cython.double) -> Aim:
    """A straight line over a side, from p above it to q below; the length is inf if it passes the side by."""
    found: Aim
    found.share = (px + (q.along - px) * py / (py + q.height)) / side if py + q.height > 0.0 else 0.0
    found.length = hypot(q.along - px, q.height + py) if SNAP < found.share < 1.0 - SNAP else INFINITY
    return found
