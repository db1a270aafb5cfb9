"""The derivative of a function of edge lengths in a metric, by the metric and by the positions of the vertices."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["MetricSides", "plane_axes"]


def plane_axes(mesh: Mesh) -> FloatArray:
    """Axes (m, 2, 3) of triangles: along the edge from corner 0 to corner 1, and towards corner 2."""
    corners = mesh.V[mesh.F]
    x = corners[:, 1] - corners[:, 0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = corners[:, 2] - corners[:, 0]
    y -= np.einsum("mk,mk->m", x, y)[:, None] * x
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return np.stack([x, y], axis=1)


class MetricSides:
    """The lengths of sides s = sqrt(e^T g e), e along a side; an edge has the mean of what the faces at it say.

    Parameters
    ----------
    mesh : Mesh
        m triangles.
    metric : (m, 3, 3) or (m, 2, 2) array_like
        As for `metric_operators`.
    along : (m, 3, 3) or (m, 3, 2) float64
        The vector e along the side opposite each corner, from the next corner to the one after, as `metric` takes it.
    """

    def __init__(self, mesh: Mesh, metric: ArrayLike, along: FloatArray) -> None:
        self.mesh, self._along = mesh, along
        given = np.asarray(metric, np.float64)
        self._metric = (given + np.swapaxes(given, 1, 2)) / 2
        # g e over s: the derivative of s by e.
        self._slopes = np.einsum("mij,mcj->mci", self._metric, along)
        self._own = np.sqrt(np.einsum("mci,mci->mc", self._slopes, along))
        self._slopes /= self._own[..., None]

    @classmethod
    def of(cls, mesh: Mesh, metric: ArrayLike) -> MetricSides:
        """Those in a checked metric (m, 3, 3) or (m, 2, 2)."""
        corners = mesh.V[mesh.F]
        if np.shape(metric)[1] == 2:
            corners = np.einsum("mkx,mcx->mck", plane_axes(mesh), corners - corners[:, :1])
        return cls(mesh, metric, np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1))

    def by_metric(self, by_side: FloatArray) -> FloatArray:
        """The derivative by the metric, in the shape in which it was given, from that by the lengths (m, 3)."""
        own = self._mean(by_side) / (2 * self._own)
        return np.asarray(np.einsum("mc,mci,mcj->mij", own, self._along, self._along))

    def by_speed(self, by_side: FloatArray) -> FloatArray:
        """The derivative (m,) by the speeds of which the metric is the inverse square."""
        # Sides are inversely proportional to the speed.
        own = (self._mean(by_side) * self._own).sum(axis=1)
        return np.asarray(-own * np.sqrt(self._metric[:, 0, 0]))

    def by_positions(self, by_side: FloatArray) -> FloatArray:
        """The derivative (n, 3) by the positions of the vertices, the metric fixed in space."""
        self._check_in_space()
        pull = self._mean(by_side)[..., None] * self._slopes
        on_corners = np.roll(pull, -1, axis=1) - np.roll(pull, 1, axis=1)
        result = np.zeros_like(self.mesh.V)
        np.add.at(result, self.mesh.F, on_corners)
        return result

    def push_positions(self, dV: FloatArray) -> FloatArray:
        """How the lengths (m, 3) change when the vertices move by dV (n, 3), the metric fixed in space."""
        self._check_in_space()
        corners = dV[self.mesh.F]
        along = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)
        return self._mean(np.einsum("mci,mci->mc", self._slopes, along))

    def _mean(self, by_side: FloatArray) -> FloatArray:
        """The mean (m, 3) over the faces at each edge."""
        of_side = self.mesh.facets.of_face
        count = np.bincount(of_side.ravel())
        return np.asarray((np.bincount(of_side.ravel(), by_side.ravel()) / count)[of_side])

    def _check_in_space(self) -> None:
        if self._metric.shape[1] == 2:
            raise ValueError(
                "a metric (m, 2, 2) turns with the planes of the triangles, and the positions are not differentiated: "
                "give it in space (m, 3, 3), or use by_metric and by_lengths"
            )
