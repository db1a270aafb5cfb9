"""Delaunay refinement of an intrinsic triangulation: circumcenters of bad triangles become vertices.

Sharp, Soliman and Crane (2019, section 4.2): the worst triangle's circumcenter is found by walking straight across the
surface from that triangle, the triangle it lies in is split there, and edges are flipped until the triangulation is
Delaunay again. Only for surfaces without a boundary: there the walk cannot leave.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.refinement import (
    FLIP,
    LEAST,
    MOST_STEPS,
    SHARPEST,
    SPLIT,
    Exit,
    Location,
    Walk,
)
from cython.cimports.heat_igl.kernels.mesh.triangles import area, foot
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.heat_igl.kernels.signals import ASK, is_interrupted
from cython.cimports.libc.math import atan2, sqrt

from heat_igl.kernels.signals import raise_caught


@cython.final
@cython.cclass
class GrowingTriangulation:
    """A closed triangulation that grows: faces are split and edges flipped in place, and the moves are recorded.

    Faces F (m, 3), the lengths l (m, 3) of their sides and the twins (3 m,), and the list of moves.

    Rows up to `n_faces` and `n_moves` are in use. Half-edge 3 f + c is the side of face f opposite corner c. A move is
    a row of `kind` and one of `numbers`, as `heat_igl.intrinsic.history.Refined` has them. Every half-edge has an
    aligned twin. Two sides of one face may be twins.
    """

    def __init__(self, F, l, twin, n_vertices, most_new):
        """Copy the triangulation, with room for `most_new` more vertices."""
        m, rows = len(F), len(F) + 2 * most_new
        self.F, self.l, self.twin = np.empty((rows, 3), np.int64), np.empty((rows, 3)), np.empty(3 * rows, np.int64)
        np.asarray(self.F)[:m], np.asarray(self.l)[:m], np.asarray(self.twin)[: 3 * m] = F, l, twin
        moves = 16 * most_new + 64
        self.kind, self.numbers = np.empty((moves, 3), np.int64), np.empty((moves, 5))
        self.n_faces, self.n_vertices, self.n_moves = m, n_vertices, 0

    def faces(self):
        """Copies of F, l and twin, as far as they are in use."""
        m = self.n_faces
        return (
            np.asarray(self.F)[:m].copy(),
            np.asarray(self.l)[:m].copy(),
            np.asarray(self.twin)[: 3 * m].copy(),
        )

    def moves(self):
        """Copies of `kind` and `numbers`, as far as they are in use."""
        return np.asarray(self.kind)[: self.n_moves].copy(), np.asarray(self.numbers)[: self.n_moves].copy()

    def is_full(self) -> cython.bint:
        """Whether there is no room for another move."""
        return self.n_moves == self.kind.shape[0]

    def is_delaunay(self, h: cython.longlong) -> cython.bint:
        """Whether the cotangents opposite the edge of half-edge h sum to 0 or more, up to rounding.

        An edge between two sides of one face cannot be flipped, and counts as Delaunay.
        """
        t: cython.longlong = self.twin[h]
        f: cython.longlong = h // 3
        g: cython.longlong = t // 3
        if f == g:
            return True
        c: cython.int = h % 3
        e: cython.int = t % 3
        ab: cython.double = self.l[f, c]
        bp: cython.double = self.l[f, (c + 1) % 3]
        pa: cython.double = self.l[f, (c + 2) % 3]
        aq: cython.double = self.l[g, (e + 1) % 3]
        qb: cython.double = self.l[g, (e + 2) % 3]
        one: cython.double = area(ab, bp, pa)
        other: cython.double = area(ab, aq, qb)
        cotangents: cython.double = (bp * bp + pa * pa - ab * ab) / (4.0 * one) + (aq * aq + qb * qb - ab * ab) / (
            4.0 * other
        )
        rounding: cython.double = 1e-12 * ((ab * ab + bp * bp + pa * pa) / one + (ab * ab + aq * aq + qb * qb) / other)
        return not cotangents < -1e-7 - rounding

    def flip(self, h: cython.longlong) -> cython.void:
        """Flip edge ab, half-edge h: its faces f = (p, a, b) and g = (q, b, a) become (p, a, q) and (q, b, p)."""
        t: cython.longlong = self.twin[h]
        f: cython.longlong = h // 3
        g: cython.longlong = t // 3
        c: cython.int = h % 3
        e: cython.int = t % 3
        c1: cython.int = (c + 1) % 3
        c2: cython.int = (c + 2) % 3
        e1: cython.int = (e + 1) % 3
        e2: cython.int = (e + 2) % 3
        ab: cython.double = self.l[f, c]
        bp: cython.double = self.l[f, c1]
        pa: cython.double = self.l[f, c2]
        aq: cython.double = self.l[g, e1]
        qb: cython.double = self.l[g, e2]
        xp: cython.double = foot(ab, pa, bp)
        xq: cython.double = foot(ab, aq, qb)
        height: cython.double = 2.0 * (area(ab, pa, bp) + area(ab, aq, qb)) / ab
        pq: cython.double = sqrt((xp - xq) * (xp - xq) + height * height)
        i: cython.longlong = self._append_move(FLIP, h, t)
        self.numbers[i, 0] = ab
        self.numbers[i, 1] = pa
        self.numbers[i, 2] = bp
        self.numbers[i, 3] = aq
        self.numbers[i, 4] = qb
        p: cython.longlong = self.F[f, c]
        q: cython.longlong = self.F[g, e]
        self.F[f, c2] = q
        self.F[g, e2] = p
        beyond_aq: cython.longlong = self.twin[3 * g + e1]
        beyond_bp: cython.longlong = self.twin[3 * f + c1]
        # A side of one of the two faces may be glued to another side of them.
        if beyond_aq == 3 * f + c1:
            beyond_aq = 3 * g + e
            beyond_bp = 3 * f + c
        self.l[f, c], self.l[f, c1] = aq, pq
        self.l[g, e], self.l[g, e1] = bp, pq
        self._glue(3 * f + c, beyond_aq)
        self._glue(3 * g + e, beyond_bp)
        self._glue(3 * f + c1, 3 * g + e1)

    def split(self, f: cython.longlong, u: cython.double, v: cython.double, w: cython.double) -> cython.void:
        """Split face f at barycentric coordinates u, v, w, which sum to 1: a new vertex, and two faces at the end."""
        a: cython.double = self.l[f, 0]
        b: cython.double = self.l[f, 1]
        c: cython.double = self.l[f, 2]
        # From the new vertex to the corners: |sum of weights times edges|, without coordinates.
        to_0: cython.double = sqrt(max(v * v * c * c + w * w * b * b + v * w * (c * c + b * b - a * a), 0.0))
        to_1: cython.double = sqrt(max(u * u * c * c + w * w * a * a + u * w * (c * c + a * a - b * b), 0.0))
        to_2: cython.double = sqrt(max(u * u * b * b + v * v * a * a + u * v * (b * b + a * a - c * c), 0.0))
        i: cython.longlong = self._append_move(SPLIT, f, self.n_faces)
        self.numbers[i, 0], self.numbers[i, 1], self.numbers[i, 2] = u, v, w
        g: cython.longlong = self.n_faces
        k: cython.longlong = self.n_faces + 1
        self.n_faces += 2
        p: cython.longlong = self.n_vertices
        self.n_vertices += 1
        v0: cython.longlong = self.F[f, 0]
        v1: cython.longlong = self.F[f, 1]
        v2: cython.longlong = self.F[f, 2]
        beyond_1: cython.longlong = self.twin[3 * f + 1]
        beyond_2: cython.longlong = self.twin[3 * f + 2]
        # f = (p, 1, 2), g = (0, p, 2), k = (0, 1, p): each keeps one side of the old face at the same corner.
        self.F[f, 0] = p
        self.F[g, 0], self.F[g, 1], self.F[g, 2] = v0, p, v2
        self.F[k, 0], self.F[k, 1], self.F[k, 2] = v0, v1, p
        self.l[f, 1], self.l[f, 2] = to_2, to_1
        self.l[g, 0], self.l[g, 1], self.l[g, 2] = to_2, b, to_0
        self.l[k, 0], self.l[k, 1], self.l[k, 2] = to_1, to_0, c
        # Sides 1 and 2 of the old face may be glued to each other, or each to itself.
        if beyond_1 == 3 * f + 2:
            self._glue(3 * g + 1, 3 * k + 2)
        else:
            if beyond_1 == 3 * f + 1:
                beyond_1 = 3 * g + 1
            if beyond_2 == 3 * f + 2:
                beyond_2 = 3 * k + 2
            self._glue(3 * g + 1, beyond_1)
            self._glue(3 * k + 2, beyond_2)
        self._glue(3 * f + 1, 3 * g + 0)
        self._glue(3 * f + 2, 3 * k + 0)
        self._glue(3 * g + 2, 3 * k + 1)

    def _glue(self, h: cython.longlong, t: cython.longlong) -> cython.void:
        """Make two half-edges twins."""
        self.twin[h] = t
        self.twin[t] = h

    def _append_move(self, kind: cython.longlong, h: cython.longlong, mate: cython.longlong) -> cython.longlong:
        """Append a move and return the row of it; the caller fills in the numbers."""
        i: cython.longlong = self.n_moves
        self.kind[i, 0] = kind
        self.kind[i, 1] = h
        self.kind[i, 2] = mate
        self.n_moves += 1
        return i


@cython.final
@cython.cclass
class _Refinement:
    """A triangulation that is being refined, its bad triangles by priority, and edges that may have to be flipped."""

    def run(self, most_vertices: cython.longlong) -> cython.void:
        """Refine until no triangle is bad, there are `most_vertices`, or there is no more room."""
        f: cython.longlong
        for f in range(self.triangles.n_faces):
            self.judge(f)
        while self.bad.count > 0 and self.triangles.n_vertices < most_vertices:
            if self.triangles.n_vertices % ASK == 0 and is_interrupted():
                break
            f = self.bad.first()
            center: Location = _circumcenter(self.triangles, f)
            if center.face < 0:
                self.bad.set_key(f, 0.0)
            elif not self.insert(center):
                break

    def judge(self, f: cython.longlong) -> cython.void:
        """Move a triangle that has changed to the right place in the queue, or out of it."""
        self.bad.set_key(f, self.badness(f))

    def badness(self, f: cython.longlong) -> cython.double:
        """Circumradius of a bad triangle in the unit of the face, 0 of another."""
        a: cython.double = self.triangles.l[f, 0]
        b: cython.double = self.triangles.l[f, 1]
        c: cython.double = self.triangles.l[f, 2]
        size: cython.double = area(a, b, c)
        if not size > 0.0:
            return 0.0
        radius: cython.double = a * b * c / (4.0 * size)
        badness: cython.double = radius / self.unit[f]
        if badness > self.largest_radius:
            return badness
        shortest: cython.int = 0
        if self.triangles.l[f, 1] < self.triangles.l[f, shortest]:
            shortest = 1
        if self.triangles.l[f, 2] < self.triangles.l[f, shortest]:
            shortest = 2
        # The sine of the smallest angle is the side opposite over the diameter of the circumcircle.
        if self.triangles.l[f, shortest] >= 2.0 * radius * self.least_sine:
            return 0.0
        # The angle at the tip of a sharp cone stays as it is.
        tip: cython.longlong = self.triangles.F[f, shortest]
        return 0.0 if tip < self.is_sharp.shape[0] and self.is_sharp[tip] else badness

    def insert(self, at: Location) -> cython.bint:
        """Make a location a vertex and flip edges until all are Delaunay; false if there is no more room."""
        if self.triangles.is_full():
            return False
        u: cython.double = max(at.u, LEAST)
        v: cython.double = max(at.v, LEAST)
        w: cython.double = max(at.w, LEAST)
        total: cython.double = u + v + w
        f: cython.longlong = at.face
        g: cython.longlong = self.triangles.n_faces
        k: cython.longlong = self.triangles.n_faces + 1
        self.triangles.split(f, u / total, v / total, w / total)
        self.unit[g] = self.unit[k] = self.unit[f]
        self.judge(f)
        self.judge(g)
        self.judge(k)
        self.stack[0], self.stack[1], self.stack[2] = 3 * f, 3 * g + 1, 3 * k + 2
        return self.make_delaunay(3)

    def make_delaunay(self, n_stack: cython.longlong) -> cython.bint:
        """Flip edges, beginning with those on the stack, until all are Delaunay; false if there is no more room."""
        k: cython.int
        while n_stack > 0:
            n_stack -= 1
            h: cython.longlong = self.stack[n_stack]
            if self.triangles.is_delaunay(h):
                continue
            if self.triangles.is_full() or n_stack + 4 > self.stack.shape[0]:
                return False
            f: cython.longlong = h // 3
            c: cython.int = h % 3
            g: cython.longlong = self.triangles.twin[h] // 3
            e: cython.int = self.triangles.twin[h] % 3
            self.triangles.flip(h)
            self.judge(f)
            self.judge(g)
            # The four sides around the new edge.
            for k in range(3):
                if k != (c + 1) % 3:
                    self.stack[n_stack] = 3 * f + k
                    n_stack += 1
                if k != (e + 1) % 3:
                    self.stack[n_stack] = 3 * g + k
                    n_stack += 1
        return True


def _find_sharp(t: GrowingTriangulation, seen: cython.uchar[::1], is_sharp: cython.uchar[::1]) -> cython.void:
    """Mark vertices with a fan of faces whose angles sum to less than `SHARPEST`: no split or flip changes that."""
    first: cython.longlong
    for first in range(3 * t.n_faces):
        at: cython.longlong = first
        total: cython.double = 0.0
        while not seen[at]:
            seen[at] = True
            f: cython.longlong = at // 3
            i: cython.int = (at + 1) % 3
            a: cython.double = t.l[f, at % 3]
            b: cython.double = t.l[f, i]
            d: cython.double = t.l[f, (at + 2) % 3]
            total += atan2(4.0 * area(a, b, d), b * b + d * d - a * a)
            h: cython.longlong = t.twin[3 * f + i]
            at = 3 * (h // 3) + (h % 3 + 1) % 3
        if 0.0 < total < SHARPEST:
            is_sharp[t.F[first // 3, first % 3]] = True


def _circumcenter(t: GrowingTriangulation, f: cython.longlong) -> Location:
    """Locate the circumcenter of a triangle, in the triangle or straight on from it; face -1 if it is not found."""
    a: cython.double = t.l[f, 0]
    b: cython.double = t.l[f, 1]
    c: cython.double = t.l[f, 2]
    u: cython.double = a * a * (b * b + c * c - a * a)
    v: cython.double = b * b * (c * c + a * a - b * b)
    w: cython.double = c * c * (a * a + b * b - c * c)
    total: cython.double = u + v + w
    u, v, w = u / total, v / total, w / total
    if u >= 0.0 and v >= 0.0 and w >= 0.0:
        return Location(f, u, v, w)
    # Laid out with corner 0 in the origin and corner 1 on the first axis; the walk begins in the centroid.
    px: cython.double[3]
    py: cython.double[3]
    px[0], py[0], px[1], py[1] = 0.0, 0.0, c, 0.0
    px[2], py[2] = foot(c, b, a), 2.0 * area(a, b, c) / c
    ray: Walk
    ray.ox, ray.oy = (c + px[2]) / 3.0, py[2] / 3.0
    ray.tx, ray.ty = v * c + w * px[2], w * py[2]
    ray.dx, ray.dy = ray.tx - ray.ox, ray.ty - ray.oy
    # The ray leaves by the side whose ends lie to the right and to the left of it.
    side: cython.int = 2
    i: cython.int
    j: cython.int
    corner: cython.int
    for corner in range(3):
        i, j = (corner + 1) % 3, (corner + 2) % 3
        if (
            ray.dx * (py[i] - ray.oy) - ray.dy * (px[i] - ray.ox) <= 0.0
            and ray.dx * (py[j] - ray.oy) - ray.dy * (px[j] - ray.ox) > 0.0
        ):
            side = corner
    i, j = (side + 1) % 3, (side + 2) % 3
    return _walk(t, ray, Exit(3 * f + side, px[i], py[i], px[j], py[j]))


def _walk(t: GrowingTriangulation, ray: Walk, way: Exit) -> Location:
    """Locate the end of a ray that leaves a face, by unfolding the faces that it crosses into the plane."""
    for _ in range(MOST_STEPS):
        h: cython.longlong = t.twin[way.h]
        if h < 0:
            break
        g: cython.longlong = h // 3
        e: cython.int = h % 3
        # Seen from g, the side runs from s to r; the apex q lies beyond.
        base: cython.double = t.l[g, e]
        along: cython.double = foot(base, t.l[g, (e + 2) % 3], t.l[g, (e + 1) % 3]) / base
        across: cython.double = 2.0 * area(base, t.l[g, (e + 1) % 3], t.l[g, (e + 2) % 3]) / (base * base)
        ex: cython.double = way.rx - way.sx
        ey: cython.double = way.ry - way.sy
        qx: cython.double = way.sx + along * ex - across * ey
        qy: cython.double = way.sy + along * ey + across * ex
        # Barycentric coordinates of the target in g: at corner e (the apex), after it (s) and before it (r).
        area2: cython.double = ex * (qy - way.sy) - ey * (qx - way.sx)
        at_q: cython.double = (ex * (ray.ty - way.sy) - ey * (ray.tx - way.sx)) / area2
        at_s: cython.double = ((qx - way.rx) * (ray.ty - way.ry) - (qy - way.ry) * (ray.tx - way.rx)) / area2
        at_r: cython.double = 1.0 - at_q - at_s
        if at_s >= 0.0 and at_r >= 0.0:
            if e == 0:
                return Location(g, at_q, at_s, at_r)
            if e == 1:
                return Location(g, at_r, at_q, at_s)
            return Location(g, at_s, at_r, at_q)
        if ray.dx * (qy - ray.oy) - ray.dy * (qx - ray.ox) > 0.0:
            # The apex lies to the left: leave between r and the apex.
            way.sx, way.sy, way.h = qx, qy, 3 * g + (e + 1) % 3
        else:
            way.rx, way.ry, way.h = qx, qy, 3 * g + (e + 2) % 3
    return Location(-1, 0.0, 0.0, 0.0)


def refine(
    F,
    l,
    twin,
    n: cython.longlong,
    unit,
    least_angle: cython.double,
    largest_radius: cython.double,
    most_vertices,
):
    """Refine triangles without a boundary until none is bad.

    Parameters
    ----------
    F, l, twin : (m, 3) int64, (m, 3) float64, (3 m,) int64
        The triangles, as `IntrinsicTriangulation` has them: intrinsic Delaunay, closed and oriented.
    n : int
        Number of vertices.
    unit : (m,) float64
        A length for each face, which the faces that are made of it inherit.
    least_angle : float
        A triangle with a smaller angle, in radians, is bad.
    largest_radius : float
        A triangle with a larger circumradius, in the unit of the face, is bad.
    most_vertices : int
        No vertex is added when there are so many.

    Returns
    -------
    F, l, twin, n
        The result.
    kind, numbers : (k, 3) int64, (k, 5) float64
        The moves, as `Refined` has them.
    """
    triangles: GrowingTriangulation = GrowingTriangulation(F, l, twin, n, max(int(most_vertices) - int(n), 0))
    rows = triangles.F.shape[0]
    units = np.empty(rows)
    units[: len(F)] = unit
    one = _Refinement()
    one.triangles, one.bad, one.unit = triangles, PriorityQueue(rows), units
    one.stack = np.empty(3 * rows + 64, np.int64)
    one.is_sharp = np.zeros(n, np.uint8)
    one.least_sine, one.largest_radius = np.sin(least_angle), largest_radius
    limit: cython.longlong = most_vertices
    seen: cython.uchar[::1] = np.zeros(3 * len(F), np.uint8)
    with cython.nogil:
        _find_sharp(triangles, seen, one.is_sharp)
        one.run(limit)
    raise_caught()
    return *triangles.faces(), int(triangles.n_vertices), *triangles.moves()
