"""Triangulations known by their edge lengths: gluing, mollification, Delaunay flips, the intrinsic gradient.

Half-edge ``3 * f + c`` is the side of face ``f`` opposite its corner ``c``; ``l[f, c]`` is its length, as in libigl.
A flipped triangulation may hold an edge from a vertex to itself and several edges between the same two vertices, so
the gluing of the faces (`IntrinsicTriangulation.twin`) is carried along; it cannot be recovered from the vertices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.intrinsic.history import Flipped, Merged, Turned, apex
from heat_igl.mesh import DELAUNAY_TOLERANCE, Mesh, connectivity
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray

__all__ = [
    "IntrinsicTriangulation",
    "from_edge_lengths",
    "intrinsic_delaunay",
    "intrinsic_gradient",
    "intrinsic_triangulation",
    "mollify",
    "oriented",
]

# The cotangents of a needle are differences of much larger numbers; an edge beside one is flipped only when they say so
# beyond their own rounding, or two flips would undo each other for ever.
_ROUNDING = 1e-12

# A last bound on the work; meshes measured so far take less than one flip per face.
_MOST_FLIPS_PER_FACE = 100

# Triangles are kept at least this far, in mean edge lengths, from violating the triangle inequality.
_MOLLIFICATION = 1e-8


@dataclass(frozen=True, eq=False)
class IntrinsicTriangulation:
    """Triangles given by their edge lengths and the way they are glued.

    Attributes
    ----------
    F : (m, 3) int64
        Vertices of each triangle; may repeat a vertex and may hold equal rows.
    l : (m, 3) float64
        ``l[f, c]`` is the length of the edge opposite corner ``c``, in the mesh's unit.
    twin : (3 m,) int64
        The half-edge glued to half-edge ``3 f + c``; -1 on the boundary, -2 where more than two faces meet.
    aligned : (3 m,) bool
        Whether the two faces at a glued half-edge run along it in opposite directions, as on an oriented surface.
    n : int
        Number of vertices, unreferenced ones included.
    n_flips : int
        How many edges were flipped to arrive here.
    lengthening : float
        What `mollify` added to every edge; 0 unless a triangle was degenerate.
    history : tuple of Merged, Turned or Flipped
        How these faces came from those of the mesh.
    """

    F: IntArray
    l: FloatArray  # noqa: E741 - the literature's name
    twin: IntArray
    aligned: BoolArray
    n: int
    n_flips: int = 0
    lengthening: float = 0.0
    history: tuple[Merged | Turned | Flipped, ...] = ()

    @property
    def boundary(self) -> BoolArray:
        """Vertices (n,) on the boundary."""
        outer = np.flatnonzero(self.twin == -1)
        mask = np.zeros(self.n, bool)
        mask[self.tail(outer)] = mask[self.head(outer)] = True
        return mask

    def tail(self, half_edge: IntArray) -> IntArray:
        """Vertex at which each half-edge starts, in the direction in which its face runs."""
        return _tail(self.F, half_edge)

    def head(self, half_edge: IntArray) -> IntArray:
        """Vertex at which each half-edge ends."""
        return _head(self.F, half_edge)

    @property
    def edges(self) -> IntArray:
        """One half-edge (k,) of each edge; where more than two faces meet, one per face."""
        return np.flatnonzero((self.twin < 0) | (self.twin > np.arange(len(self.twin))))

    @property
    def mean_edge_length(self) -> float:
        """Mean length of `edges`."""
        return float(self.l.ravel()[self.edges].mean())

    @property
    def areas(self) -> FloatArray:
        """Area (m,) of each triangle, by Heron's formula in Kahan's order."""
        return np.asarray(igl.doublearea(self.l, 0.0) / 2)

    def locate(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Where points of the mesh lie in these triangles.

        Parameters
        ----------
        faces : (k,) int64
            Faces that the triangulation was made from.
        barycentric : (k, 3) float64
            Coordinates in them.

        Returns
        -------
        faces : (k,) int64
            Triangle of each point.
        barycentric : (k, 3) float64
            Coordinates in it.
        """
        for move in self.history:
            faces, barycentric = move.carry(faces, barycentric)
        return faces, barycentric


def mollify(l: FloatArray) -> float:  # noqa: E741
    """By how much to lengthen all edges alike until every triangle is one (Sharp and Crane 2020, section 4.5).

    Parameters
    ----------
    l : (m, 3) float64
        Edge lengths, opposite each corner.

    Returns
    -------
    float
        The smallest ``e >= 0`` for which the triangle inequalities of ``l + e`` hold by 1e-8 of the mean edge length;
        0 where they already do, so that a good mesh is left alone to the last bit.
    """
    # By columns: sums and maxima over rows of three take ten times as long.
    total = sum(l.T)
    slack = min(float((total - 2 * side).min()) for side in l.T)
    return max(0.0, _MOLLIFICATION * float(l.mean()) - slack)


def from_edge_lengths(
    l: ArrayLike,  # noqa: E741
    F: IntArray,
    n: int,
    facets: connectivity.Facets | None = None,
) -> IntrinsicTriangulation:
    """Triangles with given edge lengths, glued where they share two vertices, degenerate ones mollified.

    Parameters
    ----------
    l : (m, 3) array_like
        ``l[f, c]`` is the length of the edge opposite corner ``c`` of face ``f``.
    F : (m, 3) int64
        Faces, valid as those of a `Mesh` are.
    n : int
        Number of vertices.
    facets : Facets, optional
        Those of F, where they are known.

    Raises
    ------
    MeshError
        If `l` has the wrong shape or an entry that is not a positive number, or gives an edge two lengths.
    """
    found = connectivity.facets(F, n) if facets is None else facets
    lengths = np.array(l, dtype=np.float64)
    if lengths.shape != F.shape:
        raise MeshError(f"l must have one length per side of F, shape {F.shape}, but it has shape {lengths.shape}")
    bad = ~(np.isfinite(lengths) & (lengths >= 0))
    if bad.any():
        f, c = (int(i) for i in np.argwhere(bad)[0])
        raise MeshError(f"l[{f}, {c}] = {lengths[f, c]} is not a length ({int(bad.sum())} entries are not)")
    half_edge = np.arange(F.size)
    first, last = np.empty((2, len(found.n_faces)), np.int64)
    # Of what is written to one place several times, the last stays.
    last[found.of_face.ravel()] = half_edge
    first[found.of_face.ravel()[::-1]] = half_edge[::-1]
    a, b = first[found.n_faces == 2], last[found.n_faces == 2]
    differs = np.abs(lengths.ravel()[a] - lengths.ravel()[b]) > 1e-9 * lengths.ravel()[a]
    if differs.any():
        one, other = int(a[differs][0]), int(b[differs][0])
        raise MeshError(
            f"l gives the edge between faces {one // 3} and {other // 3} two lengths, {lengths.flat[one]} and "
            f"{lengths.flat[other]} ({int(differs.sum())} edges differ)"
        )
    twin = np.where(found.n_faces[found.of_face.ravel()] == 1, -1, -2)
    twin[a], twin[b] = b, a
    aligned = np.ones(F.size, bool)
    aligned[a] = aligned[b] = _tail(F, a) == _head(F, b)
    lengthening = mollify(lengths)
    return IntrinsicTriangulation(F, lengths + lengthening, twin, aligned, n, lengthening=lengthening)


def intrinsic_triangulation(mesh: Mesh) -> IntrinsicTriangulation:
    """The triangles of `mesh` by their edge lengths, degenerate ones mollified."""
    return from_edge_lengths(igl.edge_lengths(mesh.V, mesh.F), mesh.F, mesh.n_vertices, mesh.facets)


def _tail(F: IntArray, half_edge: IntArray) -> IntArray:
    # The next of three in a row; by face and corner this takes twice as long.
    return np.asarray(F.ravel()[half_edge + 1 - 3 * (half_edge % 3 == 2)])


def _head(F: IntArray, half_edge: IntArray) -> IntArray:
    return np.asarray(F.ravel()[half_edge - 1 + 3 * (half_edge % 3 == 0)])


def _cotangents(l: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: E741
    """Cotangent (k, 3) of the angle at each corner of triangles with edge lengths `l` (k, 3), and its rounding (k,)."""
    square = l * l
    total = np.asarray(sum(square.T))
    four_areas = 2 * igl.doublearea(l, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        cotangent = (total[:, None] - 2 * square) / four_areas[:, None]
        return np.asarray(cotangent), np.asarray(_ROUNDING * total / four_areas)


def oriented(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """The same with faces turned over until neighbours agree, which the flips need; a Moebius strip keeps a seam."""
    F = triangulation.F
    turned = (igl.bfs_orient(F)[0] != F).any(axis=1)
    # libigl turns a face over by reversing its row, so corner c becomes 2 - c.
    corner = np.where(turned[:, None], np.arange(3)[::-1], np.arange(3))
    new_of = (3 * np.arange(len(F))[:, None] + corner).ravel()  # an involution: new half-edge of old, and back
    twin = triangulation.twin[new_of]
    twin[twin >= 0] = new_of[twin[twin >= 0]]
    F, lengths = np.take_along_axis(F, corner, 1), np.take_along_axis(triangulation.l, corner, 1)
    aligned = np.ones(F.size, bool)
    inner = np.flatnonzero(twin >= 0)
    aligned[inner] = _tail(F, inner) == _head(F, twin[inner])
    history = (*triangulation.history, Turned(turned))
    return replace(triangulation, F=F, l=lengths, twin=twin, aligned=aligned, history=history)


def intrinsic_delaunay(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """Flip edges until the triangulation is intrinsic Delaunay (Fisher, Springborn, Bobenko, Schroeder 2007).

    An edge is flipped when the cotangents opposite it sum to less than zero. Many are flipped at once: each round
    takes edges that share no face, the worst first, and the next looks only at the faces that changed. On the
    boundary, where more than two faces meet, and along the seam of a surface that cannot be oriented, edges stay.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        As `intrinsic_triangulation` makes it; left untouched.

    Returns
    -------
    IntrinsicTriangulation
        The same surface on the same vertices. `triangulation` itself where there is nothing to flip.
    """
    flips = _Flips(triangulation)
    bad = flips.bad(triangulation.edges)
    if not len(bad):
        return triangulation
    if not triangulation.aligned.all():
        triangulation = oriented(triangulation)
        flips = _Flips(triangulation)
        bad = flips.bad(triangulation.edges)
    most = _MOST_FLIPS_PER_FACE * len(triangulation.F)
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
    """The arrays of a triangulation while its edges are being flipped."""

    def __init__(self, start: IntrinsicTriangulation) -> None:
        self.F, self.l = start.F.copy(), start.l.copy()
        self.twin, self.aligned = start.twin.copy(), start.aligned.copy()
        self.cotangent, self.rounding = _cotangents(self.l)
        self.n_flips = 0
        self.history = list(start.history)
        self._moved_to = np.arange(self.F.size)
        self._best_of_face = np.full(len(self.F), self.F.size)

    def _cotangent_sum(self, half_edge: IntArray) -> FloatArray:
        cotangent = self.cotangent.ravel()
        return cotangent[half_edge] + cotangent[self.twin[half_edge]]

    def bad(self, half_edges: IntArray) -> IntArray:
        """The edges among `half_edges` that are to be flipped, each once, by its smaller half-edge."""
        half_edges = half_edges[(self.twin[half_edges] >= 0) & self.aligned[half_edges]]
        rounding = self.rounding[half_edges // 3] + self.rounding[self.twin[half_edges] // 3]
        half_edges = half_edges[self._cotangent_sum(half_edges) < DELAUNAY_TOLERANCE - rounding]
        smaller = np.minimum(half_edges, self.twin[half_edges])
        # An edge along which a face is glued to itself lies between two equal acute angles; only rounding says else.
        return np.asarray(np.unique(smaller[smaller // 3 != self.twin[smaller] // 3]))

    def independent(self, bad: IntArray) -> IntArray:
        """Those edges that are worse than every other bad edge of their two faces: no face is in two flips."""
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

        Before: f = (p, a, b) and g = (q, b, a), corner 0 opposite the shared edge ab. After: f = (p, a, q) and
        g = (q, b, p), in the same places, with the new edge pq opposite a in f and opposite b in g.
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

        # aq moves from (g, e1) to (f, c) and bp from (f, c1) to (g, e); a mate may move in the same round.
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


def _diagonal(ab: FloatArray, pa: FloatArray, bp: FloatArray, aq: FloatArray, qb: FloatArray) -> FloatArray:
    """The distance between p and q, laid out in the plane on either side of the edge ab."""
    x_p, y_p = apex(ab, pa, bp)
    x_q, y_q = apex(ab, aq, qb)
    return np.asarray(np.hypot(x_p - x_q, y_p + y_q))


def intrinsic_gradient(triangulation: IntrinsicTriangulation) -> sp.csc_matrix:
    """Gradient of piecewise linear functions, each triangle in a frame of its own.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices.

    Returns
    -------
    (2 m, n) csc_matrix
        Row f is the component along the edge from corner 0 to corner 1 of triangle f, row m + f the one across it,
        towards corner 2. In units of 1 / length. Equation (5) of the paper, laid out in the plane.
    """
    F, lengths = triangulation.F, triangulation.l
    m = len(F)
    base = lengths[:, 2]
    x, y = apex(base, lengths[:, 1], lengths[:, 0])
    # Corners at (0, 0), (base, 0), (x, y): the gradient of the hat function of each corner.
    values = np.empty((2, m, 3))
    along, across = values
    np.divide(1, base, out=along[:, 1])
    np.negative(along[:, 1], out=along[:, 0])
    along[:, 2] = 0
    across[:, 0] = (x - base) / (base * y)
    across[:, 1] = -x / (base * y)
    np.divide(1, y, out=across[:, 2])
    vertices = np.tile(F.astype(np.int32), (2, 1))
    rows = sp.csr_matrix(
        (values.ravel(), vertices.ravel(), np.arange(0, 6 * m + 1, 3, dtype=np.int32)), shape=(2 * m, triangulation.n)
    )
    if (F[:, [1, 2, 0]] == F).any():
        rows.sum_duplicates()  # an edge from a vertex to itself
    return rows.tocsc()
