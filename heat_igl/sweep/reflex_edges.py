"""Edges of a body of tetrahedra around which shortest ways bend."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh.connectivity import unique_rows
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Sine of the angle by which a body must exceed half a turn at an edge.
_FLAT = 1e-6


def reflex_edges(corners: AnyArray, behind: AnyArray, V: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Boundary edges at which the inside takes more than half a turn, and edges where more than two walls meet.

    Parameters
    ----------
    corners : (m, 4) int
        Tetrahedra.
    behind : (m, 4) int
        The tetrahedron behind the side opposite each corner, -1 on the boundary.
    V : (n, 3) float64
        Positions of the vertices.

    Returns
    -------
    edges : (e, 2) int64
        Vertices of each edge.
    outward : (e, 3) float64
        Unit vector out of the body, halfway between the two walls; zero where more than two meet.
    wall : (e,) float64
        Cosine of the angle between that vector and the walls.
    """
    n = len(V)
    tetrahedron, corner = np.nonzero(behind < 0)
    walls = np.sort(corners[tetrahedron[:, None], (corner[:, None] + [1, 2, 3]) % 4].astype(np.int64), axis=1)
    inner = V[corners[tetrahedron, corner]]
    # The sides of all walls, each with the wall's third corner and its normal that points inside.
    normal = np.cross(V[walls[:, 1]] - V[walls[:, 0]], V[walls[:, 2]] - V[walls[:, 0]])
    normal *= np.sign(np.einsum("ij,ij->i", normal, inner - V[walls[:, 0]]))[:, None]
    sides = np.concatenate([walls[:, [0, 1]], walls[:, [0, 2]], walls[:, [1, 2]]])
    third = np.concatenate([walls[:, 2], walls[:, 1], walls[:, 0]])
    wall = np.tile(np.arange(len(walls)), 3)
    first, of_side, counts = unique_rows(sides, n)
    edges = sides[first]
    tangent = _unit(V[edges[:, 1]] - V[edges[:, 0]])[of_side]
    along_wall = V[third] - V[sides[:, 0]]
    along_wall = _unit(along_wall - np.einsum("ij,ij->i", along_wall, tangent)[:, None] * tangent)
    order = np.argsort(of_side, kind="stable")
    begins = np.concatenate([[0], np.cumsum(counts)[:-1]])
    one, other = order[begins], order[begins + np.minimum(counts - 1, 1)]
    sine = np.einsum("ij,ij->i", _unit(normal[wall[one]]), along_wall[other])
    outward = _unit(along_wall[one] + along_wall[other])
    outward[counts != 2] = 0
    # The sides of a slit coincide, at a whole turn.
    cosine = np.einsum("ij,ij->i", along_wall[one], along_wall[other])
    bends = (counts > 2) | ((counts == 2) & ((sine < -_FLAT) | ((sine < _FLAT) & (cosine > 0))))
    return edges[bends], outward[bends], np.einsum("ij,ij->i", along_wall[one], outward)[bends]


def _unit(vectors: FloatArray) -> FloatArray:
    """Rows of length 1; rows of zeros stay."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1)
