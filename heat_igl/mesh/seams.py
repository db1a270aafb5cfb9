"""Texture seams: boundary edges of a surface that lie on each other, where a loader has split vertices."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from heat_igl.mesh.connectivity import connected_components, first_copies, unique_rows
from heat_igl.typing import IntArray

if TYPE_CHECKING:
    from heat_igl.mesh.mesh import Mesh


def seam_pairs(mesh: Mesh) -> IntArray:
    """Pairs (k, 4) of boundary edges that lie on each other: ends a, b of one and c, d of the other, a on d, b on c.

    Their ends have the same positions, bit for bit, the faces on both sides have the same orientation, and no third
    boundary edge lies there. So cuts with a gap, however small, T-junctions, and a sheet that lies on another are none.
    """
    face, corner = np.nonzero(mesh.facets.n_faces[mesh.facets.of_face] == 1)
    if mesh.is_tetrahedral or not len(face):
        return np.empty((0, 4), np.int64)
    F = mesh.F
    a, b, apex = F[face, (corner + 1) % 3], F[face, (corner + 2) % 3], F[face, corner]
    at_boundary = F[mesh.boundary[F].any(axis=1)]
    place = _places(mesh, np.unique(at_boundary))
    ends = np.stack([place[a], place[b]], axis=1)
    _, edge, count = unique_rows(np.sort(ends, axis=1), mesh.n_vertices)
    twice = np.flatnonzero((count[edge] == 2) & (ends[:, 0] != ends[:, 1]))
    one, other = twice[np.argsort(edge[twice], kind="stable")].reshape(-1, 2).T
    fit = ends[one, 0] == ends[other, 1]  # with the same orientation
    fit &= place[apex[one]] != place[apex[other]]  # a face is not joined to one that lies on it
    one, other = one[fit], other[fit]
    pairs = np.stack([a[one], b[one], a[other], b[other]], axis=1)
    # A face with two corners in one place would lose one of them.
    corners = place[at_boundary]
    folded = at_boundary[(corners == np.roll(corners, 1, axis=1)).any(axis=1)]
    return pairs[~np.isin(pairs, folded).any(axis=1)]


def seam_originals(mesh: Mesh) -> IntArray:
    """The first vertex (n,) of those that become one with each when all `seam_pairs` are joined."""
    pairs, n = seam_pairs(mesh), mesh.n_vertices
    label = connected_components(np.concatenate([pairs[:, [0, 3]], pairs[:, [1, 2]]]), n)
    _, first = np.unique(label, return_index=True)
    return np.asarray(first[label], np.int64)


def copies_apart(mesh: Mesh, originals: IntArray) -> int:
    """The number of places where vertices at the boundary have several `originals`."""
    at_boundary = np.flatnonzero(mesh.boundary)
    place = _places(mesh, at_boundary)[at_boundary]
    pairs = np.unique(np.stack([place, originals[at_boundary]], axis=1), axis=0)
    return int((np.bincount(pairs[:, 0], minlength=1) > 1).sum())


def _places(mesh: Mesh, vertices: IntArray) -> IntArray:
    """A number (n,) for the position of each of some vertices, the same for equal ones; 0 for all others."""
    place = np.zeros(mesh.n_vertices, np.int64)
    place[vertices] = first_copies(mesh.V[vertices])
    return place
