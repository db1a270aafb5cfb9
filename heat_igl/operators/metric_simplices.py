"""`MetricSimplices`: triangles or tetrahedra with edge lengths of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.sweep import hopf_lax
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray

# Differences between tensors that are taken for rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class MetricSimplices:
    """Simplices that need not fit together: two of them may see the edge between them at different lengths.

    Attributes
    ----------
    corners : (m, p + 1) int64
        Vertices of each triangle (p = 2) or tetrahedron (p = 3).
    lengths : (m, pairs) float64
        Distances between the corners of each, in its own metric, pairs in the order of `np.tril_indices`; empty if they
        are those between positions `V`.
    n : int
        Number of vertices.
    V : (n, 3) float64 or None
        Positions, if lengths are the distances between them.
    place : (n, 3) float64 or None
        Positions in the space in which the metric is given.
    least : float
        Smallest length in any metric per length in that space: no path is shorter than a straight line times this.
    tensors : (m, q, 3, 3) float64 or None
        A metric that is not the same everywhere: of each simplex (q = 1), or at each of its corners (q = p + 1), with
        logarithms of lengths that are linear in between.
    is_given : bool
        Whether tensors, or positions without tensors, are those that the user gave in space: then distance has
        derivatives by them.
    """

    corners: IntArray
    lengths: FloatArray
    n: int
    V: FloatArray | None = None
    place: FloatArray | None = None
    least: float = 1.0
    tensors: FloatArray | None = None
    is_given: bool = False

    @classmethod
    def in_space(cls, mesh: Mesh) -> MetricSimplices:
        """The faces of a mesh, by the positions of its vertices."""
        return cls(mesh.F, np.empty(0), mesh.n_vertices, mesh.V, mesh.V, is_given=True)

    @classmethod
    def in_metric(cls, mesh: Mesh, tensors: FloatArray, least: float) -> MetricSimplices:
        """The faces of a mesh with a metric (m, q, 3, 3) on each, or at each of its corners, and its `least` length.

        Where it is the same everywhere, distance is that in space after a linear map.
        """
        p = mesh.F.shape[1] - 1
        first = tensors[0, 0]
        if p == 3 and np.abs(tensors - first).max() <= _ROUNDING * np.abs(first).max():
            # |e|^2 = e^T g e = |C^T e|^2 with g = C C^T; relative to a vertex, as digits are lost far from the origin.
            mapped = cls.in_space(Mesh((mesh.V - mesh.V[mesh.F[0, 0]]) @ np.linalg.cholesky(first), mesh.F))
            return replace(mapped, is_given=False)
        is_given = tensors.shape[1] > 1
        if p == 3 and not is_given:
            tensors, fitted = _at_corners(mesh, tensors[:, 0])
            is_given, least = tensors.shape[1] == 1, min(least, fitted)
        simplices = cls(mesh.F, np.empty(0), mesh.n_vertices, None, mesh.V, least, tensors, is_given)
        squares = simplices.squared_lengths()
        lengths = np.sqrt(squares[:, 0])
        if tensors.shape[1] > 1:
            # Along an edge, the logarithm of the squared length is linear: Simpson's rule of an exponential function.
            a, b = (np.sqrt(squares[:, end, np.arange(len(end))]) for end in np.tril_indices(p + 1, -1))
            lengths = (a + 4 * np.sqrt(a * b) + b) / 6
        return replace(simplices, lengths=lengths)

    @classmethod
    def of_sides(cls, V: FloatArray, F: IntArray, sides: FloatArray, least: float) -> MetricSimplices:
        """Triangles (m, 3) whose sides (m, 3), opposite each corner, have lengths of their own."""
        # The tensor E^+ P E^+^T for edges E from the first corner with scalar products P.
        across = np.linalg.pinv(V[F[:, 1:]] - V[F[:, :1]])
        a, b, c = sides.T**2
        products = np.stack([c, (b + c - a) / 2, (b + c - a) / 2, b], axis=1).reshape(-1, 2, 2)
        tensors = across @ products @ np.swapaxes(across, 1, 2)
        return cls(F, sides[:, ::-1], len(V), None, V, least, tensors[:, None])

    def squared_lengths(self) -> FloatArray:
        """Squared distances (m, q, pairs) between the corners, in each of the `tensors`; pairs as in `lengths`."""
        if self.place is None or self.tensors is None:
            raise ValueError("these simplices have lengths, and no tensors")
        if self.tensors.shape[1] == 1 and len(self.lengths):
            return np.ascontiguousarray(self.lengths[:, None] ** 2)
        corners, V = np.ascontiguousarray(self.corners, np.int32), np.ascontiguousarray(self.place)
        return np.asarray(hopf_lax.squared_lengths(corners, V, np.ascontiguousarray(self.tensors)))

    @property
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Edges (e, 2) of each simplex one after the other, and their lengths (e,) there."""
        ends = self.corners[:, np.stack(np.tril_indices(self.corners.shape[1], -1), axis=1)].reshape(-1, 2)
        if self.V is not None:
            return ends, np.linalg.norm(self.V[ends[:, 0]] - self.V[ends[:, 1]], axis=1)
        return ends, self.lengths.ravel()

    def halved(self) -> MetricSimplices:
        """Tetrahedra in space, each cut into eight at the middles of the edges; the vertices keep their numbers.

        Raises
        ------
        ValueError
            If these are triangles, or their positions are not known.
        """
        if self.V is None or self.corners.shape[1] != 4:
            raise ValueError("only tetrahedra in space can be halved: give their positions V")
        ends, middle = self._middles()
        ab, ac, bc, ad, bd, cd = self.n + middle.reshape(-1, 6).T
        a, b, c, d = self.corners.T
        # Four at the corners, and the octahedron between them around its diagonal from ac to bd.
        around = [(ab, ad), (ad, cd), (cd, bc), (bc, ab)]
        parts = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
        parts += [(ac, bd, one, other) for one, other in around]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
        return MetricSimplices.in_space(Mesh(np.concatenate([self.V, self.V[ends].mean(axis=1)]), corners))

    def halfway(self) -> sp.csr_array:
        """The weights (n + e, n) of the vertices in those of `halved`."""
        ends, _ = self._middles()
        e, column = len(ends), np.concatenate([np.arange(self.n), ends.ravel()])
        row = np.concatenate([np.arange(self.n), self.n + np.repeat(np.arange(e), 2)])
        return sp.csr_array((np.repeat([1, 0.5], [self.n, 2 * e]), (row, column)), shape=(self.n + e, self.n))

    def _middles(self) -> tuple[IntArray, IntArray]:
        """The ends (e, 2) of each edge, and the edge of each of six sides of the tetrahedra."""
        return np.unique(np.sort(self.edges[0], axis=1), axis=0, return_inverse=True)


def _at_corners(mesh: Mesh, g: FloatArray) -> tuple[FloatArray, float]:
    """The tensors g (m, 3, 3) of tetrahedra as samples of a smooth field: (m, 4, 3, 3) at their corners.

    Around each vertex, a linear function is fitted to the logarithms of the tensors. The tensor at the vertex is taken
    from it if it explains all of their variance, and is that of each tetrahedron if it leaves a quarter or more, as it
    leaves of a step: jumps stay where they are. (m, 1, 3, 3) if the field is smooth nowhere. The second result is the
    least length of a unit vector in the tensors at vertices.
    """
    m, n = mesh.n_faces, mesh.n_vertices
    i, j = np.triu_indices(3)
    off = np.where(i == j, 1, np.sqrt(2))
    sizes, axes = np.linalg.eigh(g)
    logs = ((axes * np.log(sizes)[:, None]) @ np.swapaxes(axes, 1, 2))[:, i, j] * off
    level = logs.mean(axis=0)
    logs -= level
    X = mesh.V - mesh.V.mean(axis=0)
    centre = X[mesh.F].mean(axis=1)
    products = [centre[:, :, None] * values[:, None] for values in (centre, logs)]
    one = np.ones((m, 1))
    moments = np.concatenate(
        [one, centre, logs, *(x.reshape(m, -1) for x in products), (logs**2).sum(1, keepdims=True)], 1
    )
    of_corners = sp.csr_array((np.ones(4 * m), mesh.F.ravel(), np.arange(0, 4 * m + 1, 4)), shape=(m, n))
    at = of_corners.T.tocsr()
    # Around a vertex: the tetrahedra at it and at the other corners of these.
    sums = at @ (of_corners @ (at @ moments))
    sums /= np.maximum(sums[:, :1], 1)
    middle, mean = sums[:, 1:4], sums[:, 4:10]
    spread = sums[:, 10:19].reshape(n, 3, 3) - middle[:, :, None] * middle[:, None]
    slope = sums[:, 19:37].reshape(n, 3, 6) - middle[:, :, None] * mean[:, None]
    variance = sums[:, 37] - (mean**2).sum(axis=1)
    fitted = np.linalg.pinv(spread, hermitian=True) @ slope
    explained = (fitted * slope).sum(axis=(1, 2))
    is_constant = variance <= _ROUNDING * (1 + sums[:, 37])
    share = np.clip(1 - 4 * (1 - explained / np.where(is_constant, 1, variance)), 0, 1) * ~is_constant
    if not share.any():
        return g[:, None], np.inf
    found = mean + np.einsum("nk,nkl->nl", X - middle, fitted)
    count = np.maximum(at.sum(axis=1), 1)[:, None]
    least = share[mesh.F].min(axis=1)[:, None]
    for _ in range(10):
        # A mean over neighbours flattens curves: until the means over the corners are the given tensors.
        found += at @ ((logs - of_corners @ found / 4) * least) / count
    found += level
    log = np.empty((n, 3, 3))
    log[:, i, j] = log[:, j, i] = found / off
    sizes, axes = np.linalg.eigh(log)
    at_vertex = (axes * np.exp(sizes)[:, None]) @ np.swapaxes(axes, 1, 2)
    part = share[mesh.F][..., None, None]
    return np.asarray((1 - part) * g[:, None] + part * at_vertex[mesh.F]), float(np.exp(sizes.min() / 2))
