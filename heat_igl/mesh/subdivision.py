"""More vertices where triangles are large, on the same surface.

The heat method's error is one of resolution: where edges are much longer than the mean, which the time step follows,
one direction has to do for a large triangle.
"""

from __future__ import annotations

import math

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["split_long_edges"]

# More would not fit into memory, and lengths near rounding could never be reached by halving.
_MOST_PIECES = 1e8


def split_long_edges(mesh: Mesh, longest: float | None = None) -> Mesh:
    """Halve edges until none is longer than `longest`; the surface stays as it is.

    Parameters
    ----------
    mesh : Mesh
        Triangles, manifold or not.
    longest : float, optional
        In the mesh's unit; ``mesh.edge_lengths.mean()`` by default. Where triangles are of very different size, heat's
        error falls by up to a fifth at twice the mean already (docs/refinement.md).

    Returns
    -------
    Mesh
        Its first `mesh.n_vertices` vertices are those of `mesh`, so that sources keep their indices and
        ``distance[: mesh.n_vertices]`` is the distance on `mesh`. The same object where nothing is too long.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    ValueError
        If `longest` is not a positive number, or so short that the edges would be cut into more than 1e8 pieces.

    Notes
    -----
    Every face of an edge is given the same new vertex, so what was joined stays joined. Triangles next to a split edge
    become worse; the intrinsic Delaunay triangulation that the solver makes of them does not.
    """
    if mesh.is_tetrahedral:
        raise MeshError("split_long_edges wants triangles, and F holds tetrahedra")
    longest = float(mesh.edge_lengths.mean()) if longest is None else longest
    if not (math.isfinite(longest) and longest > 0):
        raise ValueError(f"longest must be a positive length, not {longest!r}")
    pieces = float(np.ceil(mesh.edge_lengths / longest).sum())
    if pieces > _MOST_PIECES:
        raise ValueError(f"longest = {longest:.3g} would cut the edges into {pieces:.3g} pieces: make it longer")
    while (long := mesh.edge_lengths > longest).any():
        mesh = _halved(mesh, long)
    return mesh


def _halved(mesh: Mesh, chosen: BoolArray) -> Mesh:
    """The mesh with a vertex in the middle of each of the `chosen` edges (k,)."""
    middle = np.cumsum(chosen) - 1 + mesh.n_vertices
    V = np.concatenate([mesh.V, mesh.V[mesh.edges[chosen]].mean(axis=1)])
    of_face = mesh.facets.of_face
    split = chosen[of_face]
    n_split = split.sum(axis=1)
    faces = [mesh.F[n_split == 0]]
    # Corners are taken in a cyclic order in which the one side that differs from the others is opposite the first.
    for count, odd in ((1, split), (2, ~split), (3, split)):
        rows = np.flatnonzero(n_split == count)
        corner = (odd[rows].argmax(axis=1)[:, None] + np.arange(3)) % 3
        corners = np.take_along_axis(mesh.F[rows], corner, axis=1)
        faces.append(_pieces(count, V, corners, middle[np.take_along_axis(of_face[rows], corner, axis=1)]))
    return Mesh(V, np.concatenate(faces))


def _pieces(count: int, V: FloatArray, corners: IntArray, middles: IntArray) -> IntArray:
    """The 2, 3 or 4 triangles that are left of triangles abc with `count` sides split, p, q, r opposite a, b, c."""
    a, b, c = corners.T
    p, q, r = middles.T
    if count == 1:
        return _rows([[a, b, p], [a, p, c]])
    if count == 3:
        return _rows([[a, r, q], [b, p, r], [c, q, p], [p, q, r]])
    # What is left of the corner a is the quadrilateral r b c q; its shorter diagonal makes the better triangles.
    by_rc = np.linalg.norm(V[r] - V[c], axis=1) < np.linalg.norm(V[q] - V[b], axis=1)
    return _rows([[a, r, q], [r, b, np.where(by_rc, c, q)], [np.where(by_rc, r, b), c, q]])


def _rows(triangles: list[list[IntArray]]) -> IntArray:
    return np.concatenate([np.stack(corners, axis=1) for corners in triangles])
