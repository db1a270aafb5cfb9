"""`MetricSimplices`: triangles or tetrahedra with edge lengths of their own, for fronts that pass through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray

__all__ = ["MetricSimplices"]


@dataclass(frozen=True, eq=False)
class MetricSimplices:
    """Simplices that need not fit together: two of them may see the edge between them at different lengths.

    Attributes
    ----------
    corners : (m, p + 1) int64
        Vertices of each triangle (p = 2) or tetrahedron (p = 3).
    lengths : (m, p + 1, p + 1) float64
        Distances between the corners of each, in its own metric.
    slowness : (m,) float64
        Length in the metric per length in space, the geometric mean over all directions.
    n : int
        Number of vertices.
    V : (n, 3) float64 or None
        Positions, if lengths are those of space.
    """

    corners: IntArray
    lengths: FloatArray
    slowness: FloatArray
    n: int
    V: FloatArray | None = None

    @classmethod
    def in_space(cls, mesh: Mesh) -> MetricSimplices:
        """The faces of a mesh, by the positions of its vertices."""
        X = mesh.V[mesh.F]
        lengths = np.linalg.norm(X[:, :, None] - X[:, None], axis=3)
        return cls(mesh.F, lengths, np.ones(mesh.n_faces), mesh.n_vertices, mesh.V)

    @property
    def edges(self) -> tuple[IntArray, FloatArray]:
        """Edges (e, 2) of each simplex one after the other, and their lengths (e,) there."""
        i, j = np.triu_indices(self.corners.shape[1], 1)
        return self.corners[:, np.stack([i, j], axis=1)].reshape(-1, 2), self.lengths[:, i, j].ravel()

    def halved(self) -> MetricSimplices:
        """Tetrahedra in space, each cut into eight at the middles of the edges; the vertices keep their numbers.

        Raises
        ------
        ValueError
            If these are triangles, or their positions are not known.
        """
        if self.V is None or self.corners.shape[1] != 4:
            raise ValueError("only tetrahedra in space can be halved: give their positions V")
        pairs, _ = self.edges
        ends, middle = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
        ab, ac, ad, bc, bd, cd = self.n + middle.reshape(-1, 6).T
        a, b, c, d = self.corners.T
        # Four at the corners, and the octahedron between them around its diagonal from ac to bd.
        around = [(ab, ad), (ad, cd), (cd, bc), (bc, ab)]
        parts = [(a, ab, ac, ad), (ab, b, bc, bd), (ac, bc, c, cd), (ad, bd, cd, d)]
        parts += [(ac, bd, one, other) for one, other in around]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
        return MetricSimplices.in_space(Mesh(np.concatenate([self.V, self.V[ends].mean(axis=1)]), corners))
