"""Texture seams: boundary edges of a surface that lie on each other, where a loader has split vertices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heat_igl.mesh.connectivity import unique_rows
from heat_igl.typing import FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.mesh.mesh import Mesh

__all__ = ["seam_pairs"]


def seam_pairs(mesh: Mesh) -> IntArray:
    """Pairs (k, 4) of boundary edges that lie on each other: ends a, b of one and c, d of the other, a on d, b on c."""
    if mesh.is_tetrahedral:
        return np.empty((0, 4), np.int64)
    F = mesh.F
    face, corner = np.nonzero(mesh.facets.n_faces[mesh.facets.of_face] == 1)
    a, b, apex = F[face, (corner + 1) % 3], F[face, (corner + 2) % 3], F[face, corner]
    place = _places(mesh.V)
    ends = np.stack([place[a], place[b]], axis=1)
    _, edge, count = unique_rows(np.sort(ends, axis=1), len(mesh.V))
    twice = np.flatnonzero((count[edge] == 2) & (ends[:, 0] != ends[:, 1]))
    one, other = twice[np.argsort(edge[twice], kind="stable")].reshape(-1, 2).T
    fit = ends[one, 0] == ends[other, 1]  # with the same orientation
    fit &= place[apex[one]] != place[apex[other]]  # a face is not joined to one that lies on it
    one, other = one[fit], other[fit]
    pairs = np.stack([a[one], b[one], a[other], b[other]], axis=1)
    # A face with two corners in one place would lose one of them.
    corners = place[F]
    folded = F[(corners == np.roll(corners, 1, axis=1)).any(axis=1)]
    return pairs[~np.isin(pairs, folded).any(axis=1)]


def _places(V: FloatArray) -> IntArray:
    """A number (n,) for each position, the same for equal ones."""
    rank = np.stack([np.unique(column, return_inverse=True)[1].ravel() for column in V.T], axis=1)
    return unique_rows(rank, int(rank.max()) + 1)[1]
