"""Delaunay refinement of an intrinsic triangulation: circumcenters of bad triangles become vertices.

Sharp, Soliman and Crane (2019, section 4.2): the worst triangle's circumcenter is found by walking straight across the
surface from that triangle, the triangle it lies in is split there, and edges are flipped until the triangulation is
Delaunay again. Only for surfaces without a boundary: there the walk cannot leave.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.triangles import foot
from cython.cimports.libc.math import atan2, sqrt

__all__ = ["refine"]


@cython.cclass
class _Queue:
    """Numbers in a binary heap by their keys, the largest first; one of key 0 is not in it."""

    key: cython.double[::1]
    heap: cython.longlong[::1]
    place: cython.longlong[::1]
    n_heap: cython.longlong

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _set_key(self, f: cython.longlong, key: cython.double) -> cython.void:
        """Give f another key: put it in, move it, or take it out."""
        i: cython.longlong = self.place[f]
        if i < 0:
            if key > 0.0:
                self.key[f] = key
                self.heap[self.n_heap] = f
                self.n_heap += 1
                self._lift(self.n_heap - 1)
            return
        if key > 0.0:
            grows: cython.bint = key > self.key[f]
            self.key[f] = key
            if grows:
                self._lift(i)
            else:
                self._sink(i)
            return
        self.n_heap -= 1
        self.place[f] = -1
        last: cython.longlong = self.heap[self.n_heap]
        if last != f:
            self.heap[i] = last
            self.place[last] = i
            self._lift(i)
            self._sink(self.place[last])

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _lift(self, i: cython.longlong) -> cython.void:
        """Restore the heap upwards from place i."""
        f: cython.longlong = self.heap[i]
        while i > 0:
            parent: cython.longlong = (i - 1) // 2
            if self.key[self.heap[parent]] >= self.key[f]:
                break
            self.heap[i] = self.heap[parent]
            self.place[self.heap[i]] = i
            i = parent
        self.heap[i] = f
        self.place[f] = i

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _sink(self, i: cython.longlong) -> cython.void:
        """Restore the heap downwards from place i."""
        f: cython.longlong = self.heap[i]
        while True:
            child: cython.longlong = 2 * i + 1
            if child >= self.n_heap:
                break
            if child + 1 < self.n_heap and self.key[self.heap[child + 1]] > self.key[self.heap[child]]:
                child += 1
            if self.key[self.heap[child]] <= self.key[f]:
                break
            self.heap[i] = self.heap[child]
            self.place[self.heap[i]] = i
            i = child
        self.heap[i] = f
        self.place[f] = i


@cython.cclass
class _Triangulation(_Queue):
    """A triangulation that grows, and its bad triangles in the queue: rows up to `n_faces` are in use."""

    F: cython.longlong[:, ::1]
    l: cython.double[:, ::1]  # noqa: E741 - the literature's name
    twin: cython.longlong[::1]
    unit: cython.double[::1]
    stack: cython.longlong[::1]
    kind: cython.longlong[:, ::1]
    numbers: cython.double[:, ::1]
    n_faces: cython.longlong
    n_vertices: cython.longlong
    n_moves: cython.longlong
    n_given: cython.longlong
    least_sine: cython.double
    largest_radius: cython.double

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _judge(self, f: cython.longlong) -> cython.void:
        """Put a triangle that has changed in the right place in the heap, or out of it."""
        self._set_key(f, self._shape(f))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _shape(self, f: cython.longlong) -> cython.double:
        """Priority of a triangle: the circumradius if the triangle is bad, else 0."""
        a: cython.double = self.l[f, 0]
        b: cython.double = self.l[f, 1]
        c: cython.double = self.l[f, 2]
        area: cython.double = _area(a, b, c)
        if not area > 0.0:
            return 0.0
        radius: cython.double = a * b * c / (4.0 * area)
        priority: cython.double = radius / self.unit[f]
        if priority > self.largest_radius:
            return priority
        shortest: cython.int = 0
        if self.l[f, 1] < self.l[f, shortest]:
            shortest = 1
        if self.l[f, 2] < self.l[f, shortest]:
            shortest = 2
        if self.l[f, shortest] >= 2.0 * radius * self.least_sine:
            return 0.0
        # The angle at the tip of a sharp cone stays as it is.
        if self.F[f, shortest] < self.n_given and self._total_angle(3 * f + shortest) < SHARPEST:
            return 0.0
        return priority

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _total_angle(self, corner: cython.longlong) -> cython.double:
        """Sum of the angles around the vertex at a corner, over the triangles that are glued to one another there."""
        total: cython.double = 0.0
        at: cython.longlong = corner
        while True:
            f: cython.longlong = at // 3
            c: cython.int = at % 3
            i: cython.int = (c + 1) % 3
            j: cython.int = (c + 2) % 3
            a: cython.double = self.l[f, c]
            b: cython.double = self.l[f, i]
            d: cython.double = self.l[f, j]
            total += atan2(4.0 * _area(a, b, d), b * b + d * d - a * a)
            t: cython.longlong = self.twin[3 * f + i]
            at = 3 * (t // 3) + (t % 3 + 1) % 3
            if at == corner or total > SHARPEST:
                return total

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _glue(self, h: cython.longlong, t: cython.longlong) -> cython.void:
        """Make two half-edges twins."""
        self.twin[h] = t
        self.twin[t] = h

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _note(self, kind: cython.int, h: cython.longlong, mate: cython.longlong) -> cython.longlong:
        """A new entry in the list of moves."""
        i: cython.longlong = self.n_moves
        self.kind[i, 0] = kind
        self.kind[i, 1] = h
        self.kind[i, 2] = mate
        self.n_moves += 1
        return i

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _make_delaunay(self, n_stack: cython.longlong) -> cython.bint:
        """Flip edges, beginning with those on the stack, until all are Delaunay; false if there is no more room."""
        while n_stack > 0:
            n_stack -= 1
            h: cython.longlong = self.stack[n_stack]
            t: cython.longlong = self.twin[h]
            f: cython.longlong = h // 3
            g: cython.longlong = t // 3
            if f == g:
                continue
            c: cython.int = h % 3
            e: cython.int = t % 3
            ab: cython.double = self.l[f, c]
            bp: cython.double = self.l[f, (c + 1) % 3]
            pa: cython.double = self.l[f, (c + 2) % 3]
            aq: cython.double = self.l[g, (e + 1) % 3]
            qb: cython.double = self.l[g, (e + 2) % 3]
            one: cython.double = _area(ab, bp, pa)
            other: cython.double = _area(ab, aq, qb)
            cotangents: cython.double = (bp * bp + pa * pa - ab * ab) / (4.0 * one) + (aq * aq + qb * qb - ab * ab) / (
                4.0 * other
            )
            rounding: cython.double = 1e-12 * (
                (ab * ab + bp * bp + pa * pa) / one + (ab * ab + aq * aq + qb * qb) / other
            )
            if not cotangents < -1e-7 - rounding:
                continue
            if self.n_moves == self.kind.shape[0] or n_stack + 4 > self.stack.shape[0]:
                return False
            self._flip(h, t)
            k: cython.int
            for k in range(3):
                if k != (c + 1) % 3:
                    self.stack[n_stack] = 3 * f + k
                    n_stack += 1
                if k != (e + 1) % 3:
                    self.stack[n_stack] = 3 * g + k
                    n_stack += 1
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _flip(self, h: cython.longlong, t: cython.longlong) -> cython.void:
        """Flip the edge ab of f = (p, a, b) and g = (q, b, a): f becomes (p, a, q) and g becomes (q, b, p)."""
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
        height: cython.double = 2.0 * (_area(ab, pa, bp) + _area(ab, aq, qb)) / ab
        pq: cython.double = sqrt((xp - xq) * (xp - xq) + height * height)
        i: cython.longlong = self._note(1, h, t)
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
        self._judge(f)
        self._judge(g)


@cython.cclass
class _Refinement(_Triangulation):
    """New vertices at circumcenters."""

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def run(self, most_vertices: cython.longlong) -> cython.void:
        """Refine until no triangle is bad, there are `most_vertices`, or there is no more room."""
        f: cython.longlong
        for f in range(self.n_faces):
            self._judge(f)
        while self.n_heap > 0 and self.n_vertices < most_vertices:
            if not self._split_worst():
                break

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _split_worst(self) -> cython.bint:
        """Insert the circumcenter of the first triangle of the heap; false if there is no more room."""
        f: cython.longlong = self.heap[0]
        a: cython.double = self.l[f, 0]
        b: cython.double = self.l[f, 1]
        c: cython.double = self.l[f, 2]
        u: cython.double = a * a * (b * b + c * c - a * a)
        v: cython.double = b * b * (c * c + a * a - b * b)
        w: cython.double = c * c * (a * a + b * b - c * c)
        total: cython.double = u + v + w
        u, v, w = u / total, v / total, w / total
        if u >= 0.0 and v >= 0.0 and w >= 0.0:
            return self._insert(f, u, v, w)
        # Laid out with corner 0 in the origin and corner 1 on the first axis; the walk begins in the centroid.
        x2: cython.double = foot(c, b, a)
        y2: cython.double = 2.0 * _area(a, b, c) / c
        ox: cython.double = (c + x2) / 3.0
        oy: cython.double = y2 / 3.0
        tx: cython.double = v * c + w * x2
        ty: cython.double = w * y2
        dx: cython.double = tx - ox
        dy: cython.double = ty - oy
        h: cython.longlong = 3 * f + 2
        # The side by which the ray leaves: the ends of that side lie on either side of the ray.
        px: cython.double[3]
        py: cython.double[3]
        px[0], py[0], px[1], py[1], px[2], py[2] = 0.0, 0.0, c, 0.0, x2, y2
        corner: cython.int
        for corner in range(3):
            i: cython.int = (corner + 1) % 3
            j: cython.int = (corner + 2) % 3
            if dx * (py[i] - oy) - dy * (px[i] - ox) <= 0.0 and dx * (py[j] - oy) - dy * (px[j] - ox) > 0.0:
                h = 3 * f + corner
        # In a face, a half-edge runs from the right (r) to the left (s) of the ray.
        rx: cython.double
        ry: cython.double
        sx: cython.double
        sy: cython.double
        i = (h % 3 + 1) % 3
        j = (h % 3 + 2) % 3
        rx, ry, sx, sy = px[i], py[i], px[j], py[j]
        steps: cython.int = 0
        while steps < MOST_STEPS:
            steps += 1
            t: cython.longlong = self.twin[h]
            if t < 0:
                return self._give_up(f)
            g: cython.longlong = t // 3
            e: cython.int = t % 3
            # Seen from g, the side runs from s to r; the apex lies beyond.
            base: cython.double = self.l[g, e]
            along: cython.double = foot(base, self.l[g, (e + 2) % 3], self.l[g, (e + 1) % 3]) / base
            across: cython.double = 2.0 * _area(base, self.l[g, (e + 1) % 3], self.l[g, (e + 2) % 3]) / (base * base)
            ex: cython.double = rx - sx
            ey: cython.double = ry - sy
            qx: cython.double = sx + along * ex - across * ey
            qy: cython.double = sy + along * ey + across * ex
            # Barycentric coordinates of the target in g: at corner e (the apex), after it (s) and before it (r).
            area2: cython.double = ex * (qy - sy) - ey * (qx - sx)
            at_q: cython.double = (ex * (ty - sy) - ey * (tx - sx)) / area2
            at_s: cython.double = ((qx - rx) * (ty - ry) - (qy - ry) * (tx - rx)) / area2
            at_r: cython.double = 1.0 - at_q - at_s
            if at_s >= 0.0 and at_r >= 0.0:
                if e == 0:
                    return self._insert(g, at_q, at_s, at_r)
                if e == 1:
                    return self._insert(g, at_r, at_q, at_s)
                return self._insert(g, at_s, at_r, at_q)
            if dx * (qy - oy) - dy * (qx - ox) > 0.0:
                # The apex lies to the left: leave between r and the apex.
                sx, sy = qx, qy
                h = 3 * g + (e + 1) % 3
            else:
                rx, ry = qx, qy
                h = 3 * g + (e + 2) % 3
        return self._give_up(f)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _give_up(self, f: cython.longlong) -> cython.bint:
        """Leave a triangle as it is."""
        self._set_key(f, 0.0)
        return True

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def _insert(self, f: cython.longlong, u: cython.double, v: cython.double, w: cython.double) -> cython.bint:
        """Split face f at barycentric coordinates u, v, w; false if there is no more room."""
        if self.n_moves == self.kind.shape[0]:
            return False
        u, v, w = max(u, LEAST), max(v, LEAST), max(w, LEAST)
        total: cython.double = u + v + w
        u, v, w = u / total, v / total, w / total
        a: cython.double = self.l[f, 0]
        b: cython.double = self.l[f, 1]
        c: cython.double = self.l[f, 2]
        # From the new vertex to the corners: |sum of weights times edges|, without coordinates.
        to_0: cython.double = sqrt(max(v * v * c * c + w * w * b * b + v * w * (c * c + b * b - a * a), 0.0))
        to_1: cython.double = sqrt(max(u * u * c * c + w * w * a * a + u * w * (c * c + a * a - b * b), 0.0))
        to_2: cython.double = sqrt(max(u * u * b * b + v * v * a * a + u * v * (b * b + a * a - c * c), 0.0))
        i: cython.longlong = self._note(0, f, self.n_faces)
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
        self.unit[g] = self.unit[k] = self.unit[f]
        self.F[f, 0] = p
        self.F[g, 0], self.F[g, 1], self.F[g, 2] = v0, p, v2
        self.F[k, 0], self.F[k, 1], self.F[k, 2] = v0, v1, p
        self.l[f, 1], self.l[f, 2] = to_2, to_1
        self.l[g, 0], self.l[g, 1], self.l[g, 2] = to_2, b, to_0
        self.l[k, 0], self.l[k, 1], self.l[k, 2] = to_1, to_0, c
        # A face may be glued to itself.
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
        self._judge(f)
        self._judge(g)
        self._judge(k)
        self.stack[0], self.stack[1], self.stack[2] = 3 * f, 3 * g + 1, 3 * k + 2
        return self._make_delaunay(3)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def _area(a: cython.double, b: cython.double, c: cython.double) -> cython.double:
    """Area of a triangle from the sides, in Kahan's order."""
    if a < b:
        a, b = b, a
    if b < c:
        b, c = c, b
    if a < b:
        a, b = b, a
    product: cython.double = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))
    return 0.25 * sqrt(product) if product > 0.0 else 0.0


def refine(
    F,
    l,  # noqa: E741
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
        A triangle with a larger circumradius, in the unit of the component, is bad.
    most_vertices : int
        No vertex is added when there are so many.

    Returns
    -------
    F, l, twin, n
        The result.
    kind, numbers : (k, 3) int64, (k, 5) float64
        The moves, as `Refined` has them.
    """
    m = len(F)
    most_new = max(int(most_vertices) - int(n), 0)
    faces = m + 2 * most_new
    self: _Refinement = _Refinement()
    corners, lengths = np.empty((faces, 3), np.int64), np.empty((faces, 3))
    glued = np.empty(3 * faces, np.int64)
    corners[:m], lengths[:m], glued[: 3 * m] = F, l, twin
    self.F, self.l, self.twin = corners, lengths, glued
    units = np.empty(faces)
    units[:m] = unit
    self.unit = units
    self.key, self.heap = np.zeros(faces), np.empty(faces, np.int64)
    self.place = np.full(faces, -1)
    self.stack = np.empty(3 * faces + 64, np.int64)
    self.kind, self.numbers = np.empty((16 * most_new + 64, 3), np.int64), np.empty((16 * most_new + 64, 5))
    self.n_faces, self.n_vertices, self.n_heap, self.n_moves, self.n_given = m, n, 0, 0, n
    self.least_sine, self.largest_radius = np.sin(least_angle), largest_radius
    limit: cython.longlong = most_vertices
    with cython.nogil:
        self.run(limit)
    end = self.n_faces
    return (
        corners[:end].copy(),
        lengths[:end].copy(),
        glued[: 3 * end].copy(),
        int(self.n_vertices),
        np.asarray(self.kind)[: self.n_moves].copy(),
        np.asarray(self.numbers)[: self.n_moves].copy(),
    )
