"""Triangles of a point cloud: Delaunay stars in tangent planes, and triangles that fit together."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.local_delaunay import ALIKE, STEEP, InPlane
from cython.cimports.libc.math import INFINITY, atan2, fabs, sqrt

__all__ = ["delaunay_stars", "fitting_triangles"]


def delaunay_stars(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    neighbours: cython.const[cython.int][:, ::1],
    largest: cython.const[cython.double][::1],
    least_cosine: cython.double,
    begin: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
):
    """The Delaunay triangles at the points from `begin` to `end` among their neighbours, in tangent planes.

    `axes` (n, 3, 3) are the tangents and the normal of each of the points P (n, 3); rows of `neighbours` (n, k) ascend
    by distance. Triangles with a circumscribed circle of a radius above `largest` (n,) are left out, and neighbours
    whose normals have a product below `least_cosine`.

    Returns
    -------
    triangles : (s, 3) int32
        Star by star, the point itself first, and around each point counterclockwise.
    radii : (s,) float64
        Of the circumscribed circles.
    sizes : (end - begin,) int32
        Number of triangles of each star.
    is_closed : (end - begin,) uint8
        Whether a star goes all the way around its point.
    """
    n: cython.Py_ssize_t = end - begin
    k: cython.Py_ssize_t = neighbours.shape[1]
    corners, radii = np.empty((n * k, 3), np.int32), np.empty(n * k)
    sizes, closed = np.empty(n, np.int32), np.zeros(n, np.uint8)
    size: cython.int[::1] = sizes
    is_closed: cython.uchar[::1] = closed
    found: cython.int[:, ::1] = corners
    radius: cython.double[::1] = radii
    star: cython.double[:, ::1] = np.empty((k + 1, 5))
    members: cython.int[::1] = np.empty(k + 1, np.int32)
    stack: cython.int[::1] = np.empty(k + 2, np.int32)
    m: cython.Py_ssize_t = 0
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(begin, end):
            before: cython.Py_ssize_t = m
            count: cython.Py_ssize_t = _neighbours_around(i, P, axes, neighbours, least_cosine, star, members, stack)
            if count >= 2:
                top: cython.Py_ssize_t = _visible_hull(count, star, stack)
                m = _triangles(i, top, star, members, stack, largest[i], found, radius, m)
                is_closed[i - begin] = m - before == top
            size[i - begin] = cython.cast(cython.int, m - before)
    return corners[:m].copy(), radii[:m].copy(), sizes, closed


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _neighbours_around(
    i: cython.Py_ssize_t,
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    neighbours: cython.const[cython.int][:, ::1],
    least_cosine: cython.double,
    star: cython.double[:, ::1],
    members: cython.int[::1],
    stack: cython.int[::1],
) -> cython.Py_ssize_t:
    """Put the neighbours of point i into `star` and `members`, sorted by angle and inverted; return how many there are.

    The inversion p / |p|^2 takes circles through the point to straight lines: the star of the point is the part of the
    convex hull of the inverted neighbours that it sees, found by Graham's scan. Neighbours inside the hull of the
    nearest ones are left out.
    """
    a: cython.Py_ssize_t
    b: cython.Py_ssize_t
    size: cython.Py_ssize_t = 0
    n_sides: cython.Py_ssize_t = 0
    reach: cython.double = INFINITY  # squared: twice the largest radius of the circles of the star
    for a in range(neighbours.shape[1]):
        j: cython.Py_ssize_t = neighbours[i, a]
        if j < 0 or j == i:
            continue
        if least_cosine > -1.0 and (
            axes[i, 2, 0] * axes[j, 2, 0] + axes[i, 2, 1] * axes[j, 2, 1] + axes[i, 2, 2] * axes[j, 2, 2] < least_cosine
        ):
            continue
        flat: InPlane = _in_plane(P, axes, i, j)
        x, y = flat.x, flat.y
        square: cython.double = x * x + y * y
        # A point above the centre has no direction in the plane.
        if square <= 0.0:
            continue
        if size == FEW and n_sides == 0:
            n_sides = _sides(_visible_hull(size, star, stack), star, stack)
            reach = _reach(n_sides, star)
        if square > reach or _is_inside(n_sides, star, x / square, y / square):
            continue
        # Grows with the angle, and needs no arctangent.
        angle: cython.double = y / (fabs(x) + fabs(y))
        if x < 0.0:
            angle = 2.0 - angle
        b = size
        while b > 0 and star[b - 1, ANGLE] > angle:
            _copy(star, members, b - 1, b)
            b -= 1
        star[b, ANGLE], star[b, X], star[b, Y] = angle, x / square, y / square
        members[b] = cython.cast(cython.int, j)
        size += 1
    return size


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _copy(
    star: cython.double[:, ::1], members: cython.int[::1], source: cython.Py_ssize_t, target: cython.Py_ssize_t
) -> cython.void:
    star[target, ANGLE], star[target, X], star[target, Y] = star[source, ANGLE], star[source, X], star[source, Y]
    members[target] = members[source]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _visible_hull(size: cython.Py_ssize_t, star: cython.double[:, ::1], stack: cython.int[::1]) -> cython.Py_ssize_t:
    """The scan around the point, from the neighbour that is nearest in the plane: `stack` gets the corners of the hull.

    Returns how many sides there are; the last corner is the first.
    """
    a: cython.Py_ssize_t
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _sides(top: cython.Py_ssize_t, star: cython.double[:, ::1], stack: cython.int[::1]) -> cython.Py_ssize_t:
    """Fill the columns of the sides in `star`; return how many there are, -1 if the hull is not around the point."""
    a: cython.Py_ssize_t
    for a in range(top):
        p: cython.Py_ssize_t = stack[a]
        q: cython.Py_ssize_t = stack[a + 1]
        turn: cython.double = star[p, X] * star[q, Y] - star[p, Y] * star[q, X]
        if turn <= 0.0:
            return -1
        star[a, ACROSS_X] = (star[p, Y] - star[q, Y]) / turn
        star[a, ACROSS_Y] = (star[q, X] - star[p, X]) / turn
    return top


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _reach(n_sides: cython.Py_ssize_t, star: cython.double[:, ::1]) -> cython.double:
    """Squared distance beyond which neighbours, inverted, are inside all sides; infinite if there are none."""
    a: cython.Py_ssize_t
    largest: cython.double = 0.0
    for a in range(n_sides):
        largest = max(largest, star[a, ACROSS_X] * star[a, ACROSS_X] + star[a, ACROSS_Y] * star[a, ACROSS_Y])
    return largest / (INSIDE * INSIDE) if n_sides > 0 else INFINITY


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_inside(
    n_sides: cython.Py_ssize_t, star: cython.double[:, ::1], x: cython.double, y: cython.double
) -> cython.bint:
    """Whether a point is inside all sides of a hull, of which there are some."""
    a: cython.Py_ssize_t
    for a in range(n_sides):
        if star[a, ACROSS_X] * x + star[a, ACROSS_Y] * y < -INSIDE:
            return False
    return n_sides > 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _triangles(
    i: cython.Py_ssize_t,
    top: cython.Py_ssize_t,
    star: cython.double[:, ::1],
    members: cython.int[::1],
    stack: cython.int[::1],
    largest: cython.double,
    found: cython.int[:, ::1],
    radius: cython.double[::1],
    m: cython.Py_ssize_t,
) -> cython.Py_ssize_t:
    """Append the triangles of point i on the sides of the hull to the m that are found; return how many there are."""
    a: cython.Py_ssize_t
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
            radius[m] = 0.5 * side / turn
            m += 1
    return m


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _square(star: cython.double[:, ::1], a: cython.Py_ssize_t) -> cython.double:
    return star[a, X] * star[a, X] + star[a, Y] * star[a, Y]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _is_hidden(
    star: cython.double[:, ::1], p: cython.Py_ssize_t, q: cython.Py_ssize_t, r: cython.Py_ssize_t
) -> cython.bint:
    """Whether q lies behind the line from p to r, less than half a turn apart."""
    if star[p, X] * star[r, Y] - star[p, Y] * star[r, X] <= 0.0:
        return False
    ax: cython.double = star[q, X] - star[p, X]
    ay: cython.double = star[q, Y] - star[p, Y]
    bx: cython.double = star[r, X] - star[p, X]
    by: cython.double = star[r, Y] - star[p, Y]
    return ax * by - ay * bx <= 0.0


def fitting_triangles(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    triangles: cython.const[cython.int][:, ::1],
    n_accepted: cython.Py_ssize_t,
):
    """Mask (m,) of `triangles` that overlap none before them: the first `n_accepted`, and those accepted one by one.

    Two triangles overlap if they have a corner in common and, in the tangent plane of that corner, their angles
    do. So no edge keeps more than two triangles.
    """
    m: cython.Py_ssize_t = triangles.shape[0]
    accepted = np.zeros(m, np.bool_)
    keep: cython.uchar[::1] = accepted.view(np.uint8)
    head: cython.int[::1] = np.full(P.shape[0], -1, np.int32)
    following: cython.int[:, ::1] = np.empty((m, 3), np.int32)
    sector: cython.double[:, :, ::1] = np.empty((m, 3, 2))
    f: cython.Py_ssize_t
    c: cython.Py_ssize_t
    with cython.nogil:
        for f in range(m):
            fits: cython.bint = True
            for c in range(3):
                if not _find_sector(P, axes, triangles, f, c, sector) and f >= n_accepted:
                    fits = False
                    break
                if f >= n_accepted and _overlaps(triangles[f, c], f, c, head, following, sector):
                    fits = False
                    break
            if fits:
                keep[f] = 1
                for c in range(3):
                    following[f, c] = head[triangles[f, c]]
                    head[triangles[f, c]] = 3 * f + c
    return accepted


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _find_sector(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    triangles: cython.const[cython.int][:, ::1],
    f: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    sector: cython.double[:, :, ::1],
) -> cython.bint:
    """Start of the angle of triangle f at corner c, counterclockwise, and size; False if it has none."""
    at: cython.Py_ssize_t = triangles[f, c]
    begin: cython.double = _direction(P, axes, at, triangles[f, (c + 1) % 3])
    end: cython.double = _direction(P, axes, at, triangles[f, (c + 2) % 3])
    width: cython.double = end - begin
    if width < 0.0:
        width += TURN
    if width > 0.5 * TURN:
        begin, width = end, TURN - width
    sector[f, c, 0], sector[f, c, 1] = begin, width
    return width > ROUNDING and width < 0.5 * TURN - ROUNDING


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _direction(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
) -> cython.double:
    """Angle of point j around point i in the tangent plane of i."""
    flat: InPlane = _in_plane(P, axes, i, j)
    return atan2(flat.y, flat.x)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _in_plane(
    P: cython.const[cython.double][:, ::1],
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
) -> InPlane:
    """Point j in the tangent plane of i, projected, or unrolled if it is steeply above or below; 0 right above it."""
    dx: cython.double = P[j, 0] - P[i, 0]
    dy: cython.double = P[j, 1] - P[i, 1]
    dz: cython.double = P[j, 2] - P[i, 2]
    found: InPlane
    found.x = dx * axes[i, 0, 0] + dy * axes[i, 0, 1] + dz * axes[i, 0, 2]
    found.y = dx * axes[i, 1, 0] + dy * axes[i, 1, 1] + dz * axes[i, 1, 2]
    height: cython.double = dx * axes[i, 2, 0] + dy * axes[i, 2, 1] + dz * axes[i, 2, 2]
    square: cython.double = found.x * found.x + found.y * found.y
    if height * height > STEEP * square:
        if square <= 1e-12 * height * height:
            found.x = found.y = 0.0
        else:
            found = _unrolled(axes, i, j, found.x, found.y, height)
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _unrolled(
    axes: cython.const[cython.double][:, :, ::1],
    i: cython.Py_ssize_t,
    j: cython.Py_ssize_t,
    x: cython.double,
    y: cython.double,
    height: cython.double,
) -> InPlane:
    """Point j in the tangent plane of i at its distance, turned about the line in which their planes meet.

    Around a sharp edge projection makes the far side too short.
    """
    # The normal of j, in the tangent plane of i.
    nx: cython.double = axes[j, 2, 0] * axes[i, 0, 0] + axes[j, 2, 1] * axes[i, 0, 1] + axes[j, 2, 2] * axes[i, 0, 2]
    ny: cython.double = axes[j, 2, 0] * axes[i, 1, 0] + axes[j, 2, 1] * axes[i, 1, 1] + axes[j, 2, 2] * axes[i, 1, 2]
    size: cython.double = sqrt(nx * nx + ny * ny)
    found: InPlane
    scale: cython.double
    if size < ALIKE:
        scale = sqrt(1.0 + height * height / (x * x + y * y))
        found.x, found.y = scale * x, scale * y
        return found
    nx, ny = nx / size, ny / size
    across: cython.double = nx * x + ny * y
    along: cython.double = nx * y - ny * x
    longer: cython.double = sqrt(across * across + height * height)
    if across < 0.0:
        longer = -longer
    found.x = longer * nx - along * ny
    found.y = longer * ny + along * nx
    return found


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _overlaps(
    vertex: cython.Py_ssize_t,
    f: cython.Py_ssize_t,
    c: cython.Py_ssize_t,
    head: cython.int[::1],
    following: cython.int[:, ::1],
    sector: cython.double[:, :, ::1],
) -> cython.bint:
    """Whether the angle of triangle f at corner c overlaps one that was accepted at the same vertex."""
    other: cython.Py_ssize_t = head[vertex]
    while other >= 0:
        g: cython.Py_ssize_t = other // 3
        e: cython.Py_ssize_t = other % 3
        ahead: cython.double = sector[g, e, 0] - sector[f, c, 0]
        if ahead < 0.0:
            ahead += TURN
        if ahead < sector[f, c, 1] - ROUNDING or TURN - ahead < sector[g, e, 1] - ROUNDING:
            return True
        other = following[g, e]
    return False
