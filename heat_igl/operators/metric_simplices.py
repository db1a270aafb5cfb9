"""`MetricSimplices`: triangles or tetrahedra with edge lengths of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.sweep import hopf_lax
from heat_igl.mesh import Mesh
from heat_igl.operators.metric_derivatives import plane_axes
from heat_igl.typing import FloatArray, IntArray

# Differences between tensors that are taken for rounding.
_ROUNDING = 1e-9
# Rows and columns of the entries of a symmetric matrix on and above the diagonal.
_ABOVE = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class MetricSimplices:
    """Simplices that need not fit together: two of them may see the edge between them at different lengths.

    Attributes
    ----------
    corners : (m, p + 1) int64
        Vertices of each triangle (p = 2) or tetrahedron (p = 3).
    lengths : (m, pairs) float64
        Distances between the corners of each, pairs in the order of `np.tril_indices`; empty if they are those between
        positions `V` or in a metric.
    n : int
        Number of vertices.
    V : (n, 3) float64 or None
        Positions, if lengths are the distances between them.
    place : (n, 3) float64 or None
        Positions in the space in which the metric is given.
    least : float
        Smallest length in any metric per length in that space: no path is shorter than a straight line times this.
    tensors : (m, 1, 3, 3) float64 or None
        A metric of each simplex, unless there are velocities.
    velocity : (m, p + 1, 6) float64 or None
        The inverse root of a metric at each corner, linear in between; across a triangle it is the mean in its plane.
        Of the symmetric matrix the entries on and above the diagonal, row by row.
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
    velocity: FloatArray | None = None
    is_given: bool = False

    @classmethod
    def in_space(cls, mesh: Mesh) -> MetricSimplices:
        """The faces of a mesh, by the positions of its vertices."""
        return cls(mesh.F, np.empty(0), mesh.n_vertices, mesh.V, mesh.V, is_given=True)

    @classmethod
    def in_metric(cls, mesh: Mesh, g: FloatArray, least: float, at_vertices: bool = False) -> MetricSimplices:
        """The faces of a mesh with a metric (m, 3, 3) on each, or (n, 3, 3) at each vertex, and its `least` length.

        Where it is the same everywhere, distance is that in space after a linear map.
        """
        p = mesh.F.shape[1] - 1
        if p == 3 and np.abs(g - g[0]).max() <= _ROUNDING * np.abs(g[0]).max():
            # |e|^2 = e^T g e = |C^T e|^2 with g = C C^T; relative to a vertex, as digits are lost far from the origin.
            mapped = cls.in_space(Mesh((mesh.V - mesh.V[mesh.F[0, 0]]) @ np.linalg.cholesky(g[0]), mesh.F))
            return replace(mapped, is_given=False)
        across = None
        if p == 2:
            axes = plane_axes(mesh)[:, None]
            inside = inverse_root(axes @ (g[mesh.F] if at_vertices else g[:, None]) @ np.swapaxes(axes, 2, 3))
            normal = np.cross(axes[..., 0, :], axes[..., 1, :])
            across = normal[..., None] * normal[..., None, :]
            W = _with_normal(np.swapaxes(axes, 2, 3) @ inside @ axes, across)
        else:
            W = inverse_root(g)[:, None]
        velocity: FloatArray | None
        if at_vertices:
            velocity = W[:, 0][:, *_ABOVE][mesh.F] if across is None else W[..., *_ABOVE]
        else:
            planes = None if across is None else across[:, 0][:, *_ABOVE]
            velocity, fitted = _at_corners(mesh, W[:, 0][:, *_ABOVE], planes)
            least = min(least, fitted)
            if velocity is not None and across is not None:
                inside = (np.eye(3) - across) @ _symmetric(velocity) @ (np.eye(3) - across)
                velocity = _with_normal(inside, across)[..., *_ABOVE]
        velocity = None if velocity is None else np.ascontiguousarray(velocity)
        tensors = g[:, None] if velocity is None else None
        is_given = at_vertices or (p == 3 and velocity is None)
        return cls(mesh.F, np.empty(0), mesh.n_vertices, None, mesh.V, least, tensors, velocity, is_given)

    @classmethod
    def of_sides(cls, V: FloatArray, F: IntArray, sides: FloatArray, least: float) -> MetricSimplices:
        """Triangles (m, 3) whose sides (m, 3), opposite each corner, have lengths of their own."""
        # The tensor E^+ P E^+^T for edges E from the first corner with scalar products P.
        across = np.linalg.pinv(V[F[:, 1:]] - V[F[:, :1]])
        a, b, c = sides.T**2
        products = np.stack([c, (b + c - a) / 2, (b + c - a) / 2, b], axis=1).reshape(-1, 2, 2)
        tensors = across @ products @ np.swapaxes(across, 1, 2)
        return cls(F, sides[:, ::-1], len(V), None, V, least, tensors[:, None])

    @cached_property
    def measured(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """What `lengths_in_velocity` returns; in one metric for each simplex all squares agree, and the slack is 1."""
        if self.velocity is not None:
            corners, V = np.ascontiguousarray(self.corners, np.int32), np.ascontiguousarray(self.place)
            found: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
            found = hopf_lax.lengths_in_velocity(corners, V, self.velocity)
            return found
        lengths = self.lengths
        if not len(lengths):
            if self.tensors is None or self.place is None:
                raise ValueError("these simplices have neither lengths nor a metric")
            one, other = np.tril_indices(self.corners.shape[1], -1)
            e = self.place[self.corners[:, one]] - self.place[self.corners[:, other]]
            lengths = np.sqrt(((e @ self.tensors[:, 0]) * e).sum(axis=2))
        mean = np.ascontiguousarray(lengths**2)
        return mean[:, None], mean, lengths, np.ones(len(mean))

    @property
    def variation(self) -> float:
        """How far lengths of edges differ between the metrics of the corners of a simplex: mean square of the share."""
        squares, mean, _, _ = self.measured
        return float((np.ptp(np.sqrt(squares), axis=1) ** 2 / mean).mean())

    def metric(self, chosen: IntArray, corner: IntArray | int) -> FloatArray:
        """The tensors (..., 3, 3) of chosen simplices (...) at corners (...)."""
        if self.tensors is not None:
            return np.asarray(self.tensors[chosen, 0])
        if self.velocity is None:
            raise ValueError("these simplices have lengths, and no tensors")
        W = _symmetric(self.velocity[chosen, corner])
        return np.asarray(np.linalg.inv(W @ W))

    @cached_property
    def spread(self) -> FloatArray | None:
        """Positions (n, 3) so far apart that no path is shorter than the line; None if none are known."""
        return None if self.place is None else np.ascontiguousarray(self.least * self.place, np.float64)

    @property
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Edges (e, 2) of each simplex one after the other, and their lengths (e,) there."""
        ends = self.corners[:, np.stack(np.tril_indices(self.corners.shape[1], -1), axis=1)].reshape(-1, 2)
        if self.V is not None:
            return ends, np.linalg.norm(self.V[ends[:, 0]] - self.V[ends[:, 1]], axis=1)
        return ends, self.measured[2].ravel()

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


def inverse_root(g: FloatArray) -> FloatArray:
    """The symmetric matrices g^(-1/2), for g (..., p, p)."""
    sizes, axes = np.linalg.eigh(g)
    return np.asarray((axes / np.sqrt(sizes)[..., None, :]) @ np.swapaxes(axes, -1, -2))


def _with_normal(W: FloatArray, across: FloatArray) -> FloatArray:
    """Velocities W (..., 3, 3) in the planes of triangles, as fast across as in the mean: trust in slopes asks it."""
    return np.asarray(W + np.trace(W, axis1=-2, axis2=-1)[..., None, None] / 2 * across)


def _symmetric(above: FloatArray) -> FloatArray:
    """Symmetric matrices (..., 3, 3) by their entries (..., 6) on and above the diagonal."""
    full = np.empty((*above.shape[:-1], 3, 3))
    full[..., *_ABOVE] = full[..., *_ABOVE[::-1]] = above
    return full


def _at_corners(mesh: Mesh, W: FloatArray, across: FloatArray | None) -> tuple[FloatArray | None, float]:
    """The velocities W (m, 6) of simplices as samples of a smooth field: (m, p + 1, 6) at their corners.

    Around each vertex, a linear function is fitted. The velocity at the vertex is taken from it if it explains all of
    the variance and is positive definite there, and is that of each simplex if it leaves a quarter or more, as it
    leaves of a step: jumps stay where they are. What varies since triangles, with the projections `across` (m, 6) on
    their normals, have other planes, counts as left. None if the field is smooth nowhere. The second result is the
    least length of a unit vector at vertices.
    """
    (m, size), n = mesh.F.shape, mesh.n_vertices
    off = np.where(_ABOVE[0] == _ABOVE[1], 1, np.sqrt(2))  # for the norm of symmetric matrices
    level = (W * off).mean(axis=0)
    values = W * off - level
    X = mesh.V - mesh.V.mean(axis=0)
    centre = X[mesh.F].mean(axis=1)
    products = [(centre[:, :, None] * part[:, None]).reshape(m, -1) for part in (centre, values)]
    planes = np.zeros((m, 0)) if across is None else across * off
    parts = [np.ones((m, 1)), centre, values, *products, (values**2).sum(axis=1, keepdims=True), planes]
    moments = np.concatenate(parts, axis=1)
    of_corners = sp.csr_array((np.ones(size * m), mesh.F.ravel(), np.arange(0, size * m + 1, size)), shape=(m, n))
    at = of_corners.T.tocsr()
    # Around a vertex: the simplices at it and at the other corners of these.
    sums = at @ (of_corners @ (at @ moments))
    sums /= np.maximum(sums[:, :1], 1)
    middle, mean = sums[:, 1:4], sums[:, 4:10]
    spread = sums[:, 10:19].reshape(n, 3, 3) - middle[:, :, None] * middle[:, None]
    slope = sums[:, 19:37].reshape(n, 3, 6) - middle[:, :, None] * mean[:, None]
    variance = sums[:, 37] - (mean**2).sum(axis=1)
    fitted = np.linalg.pinv(spread, hermitian=True) @ slope
    explained = (fitted * slope).sum(axis=(1, 2))
    is_constant = variance <= _ROUNDING * ((level**2).sum() + sums[:, 37])
    if across is not None:
        explained -= (1 - (sums[:, 38:] ** 2).sum(axis=1)) * ((mean + level) ** 2).sum(axis=1)
    share = np.clip(1 - 4 * (1 - explained / np.where(is_constant, 1, variance)), 0, 1) * ~is_constant
    if not (share > _ROUNDING).any():
        return None, np.inf
    found = mean + np.einsum("nk,nkl->nl", X - middle, fitted)
    count = np.maximum(at.sum(axis=1), 1)[:, None]
    least = share[mesh.F].min(axis=1)[:, None]
    for _ in range(3):
        # A mean over neighbours flattens curves: until the means over the corners are the given velocities.
        found += at @ ((values - of_corners @ found / size) * least) / count
    at_vertex = (found + level) / off
    sizes = np.linalg.eigvalsh(_symmetric(at_vertex))
    share[sizes[:, 0] <= 0] = 0
    part = share[mesh.F][..., None]
    return np.asarray((1 - part) * W[:, None] + part * at_vertex[mesh.F]), float(1 / sizes.max())
