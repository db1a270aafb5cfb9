"""`MetricSimplices`: triangles or tetrahedra with edge lengths of their own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.mesh import incidence
from heat_igl.kernels.sweep.simplex_metrics import add_misses, inverses, lengths_in_velocity, sums_around
from heat_igl.mesh import Mesh
from heat_igl.operators.metric_derivatives import plane_axes
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Differences between tensors that are taken for rounding.
_ROUNDING = 1e-9
# The same between velocities at one vertex.
_SAME = 1e-14
# Rows and columns of the entries of a symmetric matrix on and above the diagonal.
_ABOVE = np.triu_indices(3)


@dataclass(frozen=True, eq=False)
class MetricSimplices:
    """Simplices that need not fit together: two of them may see the edge between them at different lengths.

    Attributes
    ----------
    corners : (m, p + 1) int64 or int32
        Vertices of each triangle (p = 2) or tetrahedron (p = 3).
    n : int
        Number of vertices.
    place : (n, 3) float64
        Positions in the space in which the metric is given.
    least : float
        Smallest length in any metric per length in that space: no path is shorter than a straight line times this.
    lengths : (m, pairs) float64 or None
        Distances between the corners, pairs in the order of `np.tril_indices`, if not those in `tensors`.
    tensors, group : (k, 3, 3) float64, (m,) int32, or None
        Metrics, and which of them each simplex has; lengths are distances in space if there are neither these nor
        velocities.
    velocity : (k, 6) float64 or None
        Inverse roots of metrics; across a triangle it is the mean in its plane. Of the symmetric matrix the entries on
        and above the diagonal, row by row.
    rows : (m, p + 1) int32 or None
        The row of `velocity` at each corner; it is linear in between.
    is_given : bool
        Whether tensors, or positions without tensors, are those that the user gave in space: then distance has
        derivatives by them.
    """

    corners: AnyArray
    n: int
    place: FloatArray
    least: float = 1.0
    lengths: FloatArray | None = None
    tensors: FloatArray | None = None
    group: AnyArray | None = None
    velocity: FloatArray | None = None
    rows: AnyArray | None = None
    is_given: bool = False

    @classmethod
    def in_space(cls, mesh: Mesh) -> MetricSimplices:
        """The faces of a mesh, by the positions of its vertices."""
        return cls(mesh.F, mesh.n_vertices, mesh.V, is_given=True)

    @classmethod
    def in_metric(
        cls, mesh: Mesh, g: FloatArray, least: float, at_vertices: bool = False, root: Any = None, group: Any = None
    ) -> MetricSimplices:
        """The faces of a mesh with a metric (m, 3, 3) on each, or (n, 3, 3) at each vertex, and its `least` length.

        Where it is the same everywhere, distance is that in space after a linear map. The inverse root may be given,
        for triangles in the plane of each, (m, 2, 2) or (m, 3, 2, 2). Tetrahedra may have metrics (k, 3, 3) by `group`.
        """
        p, corners = mesh.F.shape[1] - 1, mesh.F.astype(np.int32)
        if p == 3 and np.abs(g - g[0]).max() <= _ROUNDING * np.abs(g[0]).max():
            # |e|^2 = e^T g e = |C^T e|^2 with g = C C^T; relative to a vertex, as digits are lost far from the origin.
            return cls(mesh.F, mesh.n_vertices, (mesh.V - mesh.V[mesh.F[0, 0]]) @ np.linalg.cholesky(g[0]))
        across = None
        if p == 2:
            axes = plane_axes(mesh)[:, None]
            if root is None:
                root = inverse_root(axes @ (g[mesh.F] if at_vertices else g[:, None]) @ np.swapaxes(axes, 2, 3))[0]
            inside = root.reshape(len(root), -1, 2, 2)
            normal = np.cross(axes[..., 0, :], axes[..., 1, :])
            across = normal[..., None] * normal[..., None, :]
            W = _with_normal(np.swapaxes(axes, 2, 3) @ inside @ axes, across)
        else:
            W = (inverse_root(g)[0] if root is None else root)[:, None]
        velocity: Any = W[..., *_ABOVE]
        del W, root
        rows: AnyArray = corners
        if not at_vertices:
            group = np.arange(len(corners), dtype=np.int32) if group is None else group
            planes = None if across is None else across[:, 0][:, *_ABOVE]
            velocity, rows, fitted = _at_corners(mesh.V, corners, velocity[:, 0], group, planes)
            least = min(least, fitted)
        if velocity is None:
            return cls(corners, mesh.n_vertices, mesh.V, least, None, g, group, is_given=p == 3)
        if across is not None:
            if not at_vertices:
                inside = (np.eye(3) - across) @ _symmetric(velocity[rows]) @ (np.eye(3) - across)
                velocity = _with_normal(inside, across)[..., *_ABOVE]
            velocity, rows = _shared(corners, mesh.n_vertices, velocity.reshape(-1, 6))
        velocity = np.ascontiguousarray(velocity).reshape(-1, 6)
        return cls(corners, mesh.n_vertices, mesh.V, least, None, None, None, velocity, rows, at_vertices)

    @classmethod
    def of_sides(cls, V: FloatArray, F: IntArray, sides: FloatArray, least: float) -> MetricSimplices:
        """Triangles (m, 3) whose sides (m, 3), opposite each corner, have lengths of their own."""
        # The tensor E^+ P E^+^T for edges E from the first corner with scalar products P.
        across = np.linalg.pinv(V[F[:, 1:]] - V[F[:, :1]])
        a, b, c = sides.T**2
        products = np.stack([c, (b + c - a) / 2, (b + c - a) / 2, b], axis=1).reshape(-1, 2, 2)
        tensors = across @ products @ np.swapaxes(across, 1, 2)
        return cls(F, len(V), V, least, sides[:, ::-1], tensors, np.arange(len(F)))

    @cached_property
    def measured(self) -> tuple[Any, ...]:
        """What `lengths_in_velocity` returns, or the same of one metric for each simplex."""
        if self.velocity is not None:
            corners = np.ascontiguousarray(self.corners, np.int32)
            return tuple(lengths_in_velocity(corners, self.place, self.velocity, self.rows))
        lengths = self.lengths
        if lengths is None:
            one, other = np.tril_indices(self.corners.shape[1], -1)
            e = self.place[self.corners[:, one]] - self.place[self.corners[:, other]]
            lengths = np.sqrt(((e if self.tensors is None else e @ self.tensors[self.group]) * e).sum(axis=2))
        mean, one_each = np.ascontiguousarray(lengths**2), np.ones(len(lengths))
        return None, mean, mean.max(axis=1), one_each, 0 * one_each, 0.0

    def metric(self, chosen: IntArray, corner: IntArray | int) -> FloatArray:
        """The tensors (..., 3, 3) of chosen simplices (...) at corners (...)."""
        if self.tensors is not None and self.group is not None:
            return np.asarray(self.tensors[self.group[chosen]])
        if self.velocity is None or self.rows is None:
            raise ValueError("these simplices have lengths, and no tensors")
        W = _symmetric(self.velocity[self.rows[chosen, corner]])
        return np.asarray(np.linalg.inv(W @ W))

    @property
    def is_in_space(self) -> bool:
        """Whether lengths are distances between the positions."""
        return self.tensors is None and self.velocity is None

    @property
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Edges (e, 2) of each simplex one after the other, and their lengths (e,) there."""
        one, other = np.tril_indices(self.corners.shape[1], -1)
        ends = self.corners[:, np.stack([one, other], axis=1)]
        e = self.place[ends[:, :, 0]] - self.place[ends[:, :, 1]]
        if self.is_in_space:
            lengths = np.linalg.norm(e, axis=2)
        elif self.velocity is None or self.rows is None:
            lengths = np.sqrt(self.measured[1])
        else:
            # Simpson's rule, with the geometric mean of both ends in the middle.
            inverse = self.measured[0]
            a, b = (np.empty(e.shape[:2]) for _ in range(2))
            for end, k in ((a, one), (b, other)):
                for pair, corner in enumerate(k):
                    w = _symmetric(inverse[self.rows[:, corner]]) @ e[:, pair, :, None]
                    end[:, pair] = np.linalg.norm(w[..., 0], axis=1)
            lengths = (a + 4 * np.sqrt(a * b) + b) / 6
        return ends.reshape(-1, 2), lengths.ravel()

    def halved(self) -> MetricSimplices:
        """Tetrahedra in space, each cut into eight at the middles of the edges; the vertices keep their numbers.

        Raises
        ------
        ValueError
            If these are triangles, or in a metric.
        """
        if not self.is_in_space or self.corners.shape[1] != 4:
            raise ValueError("only tetrahedra in space can be halved")
        ends, middle = self._middles()
        ab, ac, bc, ad, bd, cd = self.n + middle.reshape(-1, 6).T
        a, b, c, d = self.corners.T
        # Four at the corners, and the octahedron between them around its diagonal from ac to bd.
        around = [(ab, ad), (ad, cd), (cd, bc), (bc, ab)]
        parts = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
        parts += [(ac, bd, one, other) for one, other in around]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
        return MetricSimplices.in_space(Mesh(np.concatenate([self.place, self.place[ends].mean(axis=1)]), corners))

    def halfway(self) -> sp.csr_array:
        """The weights (n + e, n) of the vertices in those of `halved`."""
        ends, _ = self._middles()
        e, column = len(ends), np.concatenate([np.arange(self.n), ends.ravel()])
        row = np.concatenate([np.arange(self.n), self.n + np.repeat(np.arange(e), 2)])
        return sp.csr_array((np.repeat([1, 0.5], [self.n, 2 * e]), (row, column)), shape=(self.n + e, self.n))

    def _middles(self) -> tuple[IntArray, IntArray]:
        """The ends (e, 2) of each edge, and the edge of each of six sides of the tetrahedra."""
        return np.unique(np.sort(self.edges[0], axis=1), axis=0, return_inverse=True)


def inverse_root(g: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The symmetric matrices g^(-1/2), for g (..., p, p), and the smallest eigenvalue (...) of each g.

    The roots are those of |g| where g is not positive definite.
    """
    p = g.shape[-1]
    root, sizes = inverses(np.ascontiguousarray(g).reshape(-1, p, p), True, 0.0)
    return root.reshape(g.shape), sizes.min(axis=1).reshape(g.shape[:-2])


def _with_normal(W: FloatArray, across: FloatArray) -> FloatArray:
    """Velocities W (..., 3, 3) in the planes of triangles, as fast across as in the mean: trust in slopes asks it."""
    return np.asarray(W + np.trace(W, axis1=-2, axis2=-1)[..., None, None] / 2 * across)


def _symmetric(above: FloatArray) -> FloatArray:
    """Symmetric matrices (..., 3, 3) by their entries (..., 6) on and above the diagonal."""
    full = np.empty((*above.shape[:-1], 3, 3))
    full[..., *_ABOVE] = full[..., *_ABOVE[::-1]] = above
    return full


def _shared(F: AnyArray, n: int, velocity: FloatArray) -> tuple[FloatArray, AnyArray]:
    """Velocities (r, 6) that corners in one plane share at their vertex, from (3 m, 6), and the rows (m, 3)."""
    first, incident = incidence.corners_by_vertex(F, n)
    velocity, is_new = velocity[incident], np.zeros(len(incident), bool)
    is_new[first[:-1][np.diff(first) > 0]] = True
    size = np.abs(velocity[:-1]).max(axis=1, keepdims=True)
    is_new[1:] |= (np.abs(np.diff(velocity, axis=0)) > _SAME * size).any(axis=1)
    rows = np.empty(F.size, np.int32)
    rows[incident] = np.cumsum(is_new, dtype=np.int32) - np.int32(1)
    return velocity[is_new], rows.reshape(F.shape)


def equal_runs(values: AnyArray) -> tuple[IntArray, AnyArray]:
    """The first (k,) of each run of equal rows (m, ...), as of the simplices of a voxel, and the run (m,) int32."""
    is_new = np.ones(len(values), bool)
    is_new[1:] = (values[1:] != values[:-1]).reshape(len(values) - 1, -1).any(axis=1)
    return np.flatnonzero(is_new), np.cumsum(is_new, dtype=np.int32) - np.int32(1)


def _at_corners(
    V: FloatArray, F: AnyArray, W: FloatArray, group: AnyArray, across: FloatArray | None
) -> tuple[FloatArray | None, AnyArray, float]:
    """The velocities W (k, 6) of groups (m,) of simplices as samples of a smooth field, with the row at each corner.

    Those at the corners of a simplex are `_fitted` if at each this explains all of the variance and is positive
    definite, and are those of the simplex if it leaves a quarter or more at one, as it leaves of a step: jumps stay
    where they are. None if the field is smooth nowhere. The third result is the least length of a unit vector at
    vertices.
    """
    first, incident = incidence.corners_by_vertex(F, len(V))
    at_vertex, share = _fitted(V, F, W, group, across, first, incident)
    if not (share > _ROUNDING).any():
        return None, F, np.inf
    sizes = inverses(_symmetric(at_vertex), False, 0.0)[1]
    share[sizes.min(axis=1) <= 0] = 0
    of_simplex = reduce(np.minimum, (share[corner] for corner in F.T))
    # Corners that meet in a vertex have a row together where their velocities are equal.
    v, simplex = np.repeat(np.arange(len(V), dtype=np.int32), np.diff(first)), incident // np.int32(F.shape[1])
    share, is_new = of_simplex[simplex], np.ones(len(v), bool)
    share[share >= 1 - _ROUNDING] = 1
    own = np.where(share < 1, group[simplex], np.int32(-1))
    is_new[1:] = (v[1:] != v[:-1]) | (own[1:] != own[:-1]) | (share[1:] != share[:-1])
    rows = np.empty(F.size, np.int32)
    rows[incident] = np.cumsum(is_new, dtype=np.int32) - np.int32(1)
    velocity, own, share = at_vertex[v[is_new]], own[is_new], share[is_new, None]
    del incident, simplex, v, is_new
    alone = W[own] * (share < 1)
    velocity -= alone
    velocity *= share
    velocity += alone
    return velocity, rows.reshape(F.shape), float(1 / sizes.max())


def _fitted(
    V: FloatArray, F: AnyArray, W: FloatArray, group: AnyArray, across: FloatArray | None, *incident: AnyArray
) -> tuple[FloatArray, FloatArray]:
    """The velocity (n, 6) at each vertex of a linear function fitted around it, and how far it holds there, up to 1.

    It holds as far as it explains the variance around the vertex. What varies since triangles, with the projections
    `across` (m, 6) on their normals, have other planes, counts as left. `incident` are the corners by vertex.
    """
    m, size = F.shape
    off = np.where(_ABOVE[0] == _ABOVE[1], 1, np.sqrt(2))  # for the norm of symmetric matrices
    level = np.bincount(group) @ (W * off) / m
    values = np.ascontiguousarray(W * off - level)
    X = V - V.mean(axis=0)
    square = np.einsum("mk,mk->m", values, values)
    columns = np.column_stack([values, square, *([] if across is None else [across * off])])
    # Around a vertex: the simplices at it and at the other corners of these.
    means, around = sums_around(F, X, columns, group, *incident)
    others = around / size - 1
    means /= np.maximum(means[:, :1, :1], 1)
    middle, mean, square = means[:, 0, 1:4], means[:, 0, 4:10], means[:, 0, 10]
    about = means[:, 1:, 1:10] - middle[:, :, None] * means[:, :1, 1:10]
    slope = about[..., 3:]
    variance = square - (mean**2).sum(axis=1)
    inverse = inverses(np.ascontiguousarray(about[..., :3]), False, 1e-15)[0]
    fitted = inverse @ slope
    explained = (fitted * slope).sum(axis=(1, 2))
    is_constant = variance <= _ROUNDING * ((level**2).sum() + square)
    if across is not None:
        explained -= (1 - (means[:, 0, 11:] ** 2).sum(axis=1)) * ((mean + level) ** 2).sum(axis=1)
    left = 1 - explained / np.where(is_constant, 1, variance)
    # Of no more simplices than it has coefficients, a function explains all: the adjusted coefficient of determination.
    free = others - np.einsum("nij,nji->n", inverse, about[..., :3])
    left = np.where(free > 0, left * others / np.where(free > 0, free, 1), 1)
    share = np.clip(1 - 4 * left, 0, 1) * ~is_constant
    found = mean + np.einsum("nk,nkl->nl", X - middle, fitted)
    del means, mean, about, slope, inverse, fitted
    # A mean over neighbours flattens curves: until the means over the corners are the given velocities.
    least = reduce(np.minimum, (share[corner] for corner in F.T))
    for _ in range(3):
        add_misses(found, F, values, group, least, incident[0])
    return (found + level) / off, share
