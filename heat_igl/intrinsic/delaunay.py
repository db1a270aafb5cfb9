"""Intrinsic Delaunay triangulation by edge flips."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np

from heat_igl.intrinsic.gluing import oriented
from heat_igl.intrinsic.history import Flipped
from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.mesh import DELAUNAY_TOLERANCE
from heat_igl.typing import FloatArray, IntArray

# Relative rounding of the numerator of a cotangent, a difference of squares that for a needle are much larger than the
# result. An edge is flipped only if the cotangents say so beyond their rounding; else two flips could undo each other
# for ever.
_ROUNDING = 1e-12

# A last bound on the work; all meshes measured so far take less than one flip per face.
_MOST_FLIPS_PER_FACE = 100


def intrinsic_delaunay(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """Flip edges until the triangulation is intrinsic Delaunay (Fisher, Springborn, Bobenko, Schroeder 2007).

    An edge is flipped when the two cotangents opposite it sum to less than zero. Each round flips many edges at once,
    no two in one face, those with the smallest sums first; the next round checks only the faces that changed. Edges
    stay on the boundary, at edges of more than two faces, and along the seam of a surface that cannot be oriented.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        As `intrinsic_triangulation` makes it; left untouched.

    Returns
    -------
    IntrinsicTriangulation
        The same surface on the same vertices; `triangulation` itself if no edge is flipped.
    """
    flips = _Flips(triangulation)
    bad = flips.bad(triangulation.edges)
    if not len(bad):
        return triangulation
    if not triangulation.aligned.all():
        triangulation = oriented(triangulation)
        flips = _Flips(triangulation)
        bad = flips.bad(triangulation.edges)
    most = triangulation.n_flips + _MOST_FLIPS_PER_FACE * len(triangulation.F)
    while len(bad) and flips.n_flips < most:
        changed = flips.flip(flips.independent(bad))
        around = (3 * changed[:, None] + np.arange(3)).ravel()
        bad = flips.bad(np.concatenate([bad, around]))
    return replace(
        triangulation,
        F=flips.F,
        l=flips.l,
        twin=flips.twin,
        aligned=flips.aligned,
        n_flips=flips.n_flips,
        history=tuple(flips.history),
    )


class _Flips:
    """The arrays of a triangulation while edges are being flipped."""

    def __init__(self, start: IntrinsicTriangulation) -> None:
        self.F, self.l = start.F.copy(), start.l.copy()
        self.twin, self.aligned = start.twin.copy(), start.aligned.copy()
        self.cotangent, self.rounding = _cotangents(self.l)
        self.n_flips = start.n_flips
        self.history = list(start.history)
        self._moved_to = np.arange(self.F.size)
        self._best_of_face = np.full(len(self.F), self.F.size)

    def _cotangent_sum(self, half_edge: IntArray) -> FloatArray:
        cotangent = self.cotangent.ravel()
        return cotangent[half_edge] + cotangent[self.twin[half_edge]]

    def bad(self, half_edges: IntArray) -> IntArray:
        """The edges among `half_edges` to be flipped: the smaller half-edge of each, once."""
        half_edges = half_edges[(self.twin[half_edges] >= 0) & self.aligned[half_edges]]
        rounding = self.rounding[half_edges // 3] + self.rounding[self.twin[half_edges] // 3]
        half_edges = half_edges[self._cotangent_sum(half_edges) < DELAUNAY_TOLERANCE - rounding]
        smaller = np.minimum(half_edges, self.twin[half_edges])
        # An edge along which a face is glued to itself is opposite two equal acute angles: a negative sum is rounding.
        return np.asarray(np.unique(smaller[smaller // 3 != self.twin[smaller] // 3]))

    def independent(self, bad: IntArray) -> IntArray:
        """The edges with a smaller sum of cotangents than all other bad edges of their faces: at most one per face."""
        bad = bad[np.argsort(self._cotangent_sum(bad), kind="stable")]
        rank = np.arange(len(bad))
        f, g = bad // 3, self.twin[bad] // 3
        best = self._best_of_face
        np.minimum.at(best, f, rank)
        np.minimum.at(best, g, rank)
        chosen = np.asarray(bad[(best[f] == rank) & (best[g] == rank)])
        best[f] = best[g] = len(self._moved_to)
        return chosen

    def flip(self, half_edge: IntArray) -> IntArray:
        """Flip these edges, which share no face; return the faces that changed.

        Before: f = (p, a, b) and g = (q, b, a), with corner 0 opposite the shared edge ab. After: f = (p, a, q) and
        g = (q, b, p), at the same corners, with the new edge pq opposite a in f and opposite b in g.
        """
        f, c = np.divmod(half_edge, 3)
        g, e = np.divmod(self.twin[half_edge], 3)
        c1, c2, e1, e2 = (c + 1) % 3, (c + 2) % 3, (e + 1) % 3, (e + 2) % 3
        F, lengths = self.F, self.l
        bp, pa, aq, qb = lengths[f, c1], lengths[f, c2], lengths[g, e1], lengths[g, e2]
        pq = _diagonal(lengths[f, c], pa, bp, aq, qb)
        self.history.append(Flipped(half_edge, 3 * g + e, np.stack([lengths[f, c], pa, bp, aq, qb])))
        p, q = F[f, c], F[g, e]
        F[f, c2], F[g, e2] = q, p
        lengths[f, c], lengths[f, c1], lengths[g, e], lengths[g, e1] = aq, pq, bp, pq

        # aq moves from (g, e1) to (f, c), and bp from (f, c1) to (g, e); their twins may move in the same round.
        twin, moved_to = self.twin, self._moved_to
        new, old = np.concatenate([3 * f + c, 3 * g + e]), np.concatenate([3 * g + e1, 3 * f + c1])
        mate, aligned = twin[old], self.aligned[old]
        moved_to[old] = new
        mate = np.where(mate >= 0, moved_to[mate], mate)
        moved_to[old] = old
        twin[new], self.aligned[new] = mate, aligned
        twin[mate[mate >= 0]] = new[mate >= 0]
        f_new, g_new = 3 * f + c1, 3 * g + e1
        twin[f_new], twin[g_new] = g_new, f_new
        self.aligned[f_new] = self.aligned[g_new] = True

        changed = np.concatenate([f, g])
        self.cotangent[changed], self.rounding[changed] = _cotangents(lengths[changed])
        self.n_flips += len(half_edge)
        return np.asarray(changed)


def _cotangents(l: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cotangent (k, 3) at each corner of triangles with edge lengths `l` (k, 3), and a bound (k,) on the rounding."""
    square = l * l
    total = np.asarray(sum(square.T))
    four_areas = 2 * igl.doublearea(l, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cotangent = (total[:, None] - 2 * square) / four_areas[:, None]
        return np.asarray(cotangent), np.asarray(_ROUNDING * total / four_areas)


def _diagonal(ab: FloatArray, pa: FloatArray, bp: FloatArray, aq: FloatArray, qb: FloatArray) -> FloatArray:
    """Length of pq, with the triangles pab and qba laid out in the plane on either side of the edge ab."""
    x_p, y_p = apex(ab, pa, bp)
    x_q, y_q = apex(ab, aq, qb)
    return np.asarray(np.hypot(x_p - x_q, y_p + y_q))
