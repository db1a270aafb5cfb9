"""A closed triangulation, known by edge lengths, that grows: faces are split and edges flipped in place.

The moves are recorded, so that points can be carried to the new faces.
"""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.growing_triangulation import FLIP, SPLIT
from cython.cimports.heat_igl.kernels.mesh.triangles import area, foot
from cython.cimports.libc.math import sqrt

__all__ = ["GrowingTriangulation"]


@cython.final
@cython.cclass
class GrowingTriangulation:
    """Faces F (m, 3), the lengths l (m, 3) of their sides and the twins (3 m,), and the list of moves that made them.

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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_full(self) -> cython.bint:
        """Whether there is no room for another move."""
        return self.n_moves == self.kind.shape[0]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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
    def _append_move(self, kind: cython.longlong, h: cython.longlong, mate: cython.longlong) -> cython.longlong:
        """Append a move and return the row of it; the caller fills in the numbers."""
        i: cython.longlong = self.n_moves
        self.kind[i, 0] = kind
        self.kind[i, 1] = h
        self.kind[i, 2] = mate
        self.n_moves += 1
        return i
