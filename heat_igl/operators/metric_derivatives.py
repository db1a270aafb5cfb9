"""Derivatives of a function of edge lengths by the positions of the vertices, and by a metric."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import ArrayLike, FloatArray


def plane_axes(mesh: Mesh) -> FloatArray:
    """Axes (m, 2, 3) of triangles: along the edge from corner 0 to corner 1, and towards corner 2; 0 without area."""
    axes, least = mesh.V[mesh.F[:, 1:]], np.finfo(float).tiny
    axes -= mesh.V[mesh.F[:, :1]]
    x, y = axes[:, 0], axes[:, 1]
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), least)
    y -= np.einsum("mk,mk->m", x, y)[:, None] * x
    y /= np.maximum(np.linalg.norm(y, axis=1, keepdims=True), least)
    return axes


class SideLengths:
    """The lengths of the sides of a mesh's faces as functions of the positions of the vertices, in space.

    Parameters
    ----------
    mesh : Mesh
        m triangles on n vertices.
    """

    def __init__(self, mesh: Mesh) -> None:
        tail, head = mesh.edges.T
        length = mesh.edge_lengths
        # The derivative (3, k) of the length of each edge by the vector along it; 0 for edges without length.
        along = np.stack([x[head] - x[tail] for x in mesh.V.T])
        self.mesh, self._by_edge = mesh, np.divide(along, length, out=along, where=length > 0)

    @property
    def _slopes(self) -> FloatArray:
        return np.asarray(self._by_edge)

    def by_positions(self, by_side: FloatArray) -> FloatArray:
        """The derivative (n, 3) by the positions, from that by the lengths (m, 3)."""
        (tail, head), n = self.mesh.edges.T, self.mesh.n_vertices
        pull = np.bincount(self.mesh.facets.of_face.ravel(), by_side.ravel()) * self._slopes
        return np.stack([np.bincount(head, part, n) - np.bincount(tail, part, n) for part in pull], axis=1)

    def push_positions(self, dV: FloatArray) -> FloatArray:
        """How the lengths (m, 3) change when the vertices move by dV (n, 3)."""
        tail, head = self.mesh.edges.T
        change = sum(slope * (x[head] - x[tail]) for slope, x in zip(self._slopes, dV.T, strict=True))
        return np.asarray(change)[self.mesh.facets.of_face]


class MetricSides(SideLengths):
    """The lengths of sides s = sqrt(e^T g e), e along a side; an edge has the mean of what the faces at it say.

    Derivatives by positions have the metric fixed in space.

    Parameters
    ----------
    mesh : Mesh
        m triangles.
    metric : (m, 3, 3) or (m, 2, 2) array_like
        A checked metric, as for `metric_operators`.
    """

    def __init__(self, mesh: Mesh, metric: ArrayLike) -> None:
        self.mesh, given = mesh, np.asarray(metric, np.float64)
        self._metric = (given + np.swapaxes(given, 1, 2)) / 2
        along = self._along()
        self._own = np.sqrt((along @ self._metric * along).sum(axis=2))
        self._n_faces = np.bincount(mesh.facets.of_face.ravel())

    def _along(self) -> FloatArray:
        """The sides (m, 3, p) as vectors in the axes of the metric, from the next corner to the one after."""
        corners = self.mesh.V[self.mesh.F]
        if self._metric.shape[1] == 2:
            corners = np.einsum("mkx,mcx->mck", plane_axes(self.mesh), corners - corners[:, :1])
        return np.asarray(np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1))

    @property
    def lengths(self) -> FloatArray:
        """Of the sides (m, 3)."""
        return self._mean(self._own)

    @property
    def _slopes(self) -> FloatArray:
        if self._metric.shape[1] == 2:
            raise ValueError(
                "a metric (m, 2, 2) turns with the planes of the triangles, and the positions are not differentiated: "
                "give it in space (m, 3, 3), or use by_metric and by_lengths"
            )
        is_ascending = self.mesh.F[:, [1, 2, 0]] < self.mesh.F[:, [2, 0, 1]]
        slopes = self._along() @ self._metric / np.where(is_ascending, self._own, -self._own)[..., None]
        of_side = self.mesh.facets.of_face.ravel()
        return np.stack([np.bincount(of_side, x) / self._n_faces for x in slopes.reshape(len(of_side), -1).T])

    def by_metric(self, by_side: FloatArray) -> FloatArray:
        """The derivative by the metric, in the shape in which it was given, from that by the lengths (m, 3)."""
        own, along = self._mean(by_side) / (2 * self._own), self._along()
        return np.asarray(np.einsum("mc,mci,mcj->mij", own, along, along))

    def by_speed(self, by_side: FloatArray) -> FloatArray:
        """The derivative (m,) by the speeds of which the metric is the inverse square."""
        # Sides are inversely proportional to the speed.
        own = (self._mean(by_side) * self._own).sum(axis=1)
        return np.asarray(-own * np.sqrt(self._metric[:, 0, 0]))

    def _mean(self, by_side: FloatArray) -> FloatArray:
        """The mean (m, 3) over the faces at each edge."""
        of_side = self.mesh.facets.of_face
        return np.asarray((np.bincount(of_side.ravel(), by_side.ravel()) / self._n_faces)[of_side])
