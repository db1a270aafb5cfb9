"""Subdivision of long edges, on the same surface.

The heat method has one direction per triangle, and a time step that follows the mean edge length. Triangles with edges
much longer than the mean are too coarse for both.
"""

from __future__ import annotations

import numpy as np

from heat_igl.errors import MeshError, positive
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["split_long_edges"]

# More pieces would not fit into memory, and halving could never reach a length near rounding.
_MOST_PIECES = 1e8


def split_long_edges(mesh: MeshLike, longest: float | None = None) -> Mesh:
    """Halve edges until none is longer than `longest`; the surface stays as it is.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold or not.
    longest : float, optional
        In the mesh's unit; ``mesh.edge_lengths.mean()`` by default. On meshes with triangles of very different size,
        twice the mean already reduces the error of the heat method by up to a fifth.

    Returns
    -------
    Mesh
        The first `mesh.n_vertices` vertices are those of `mesh`: sources keep their indices, and
        ``distance[: mesh.n_vertices]`` is the distance on `mesh`. The same object if no edge is too long.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    ValueError
        If `longest` is not a positive number, or so short that the edges would be cut into more than 1e8 pieces.

    Notes
    -----
    All faces at an edge share the new vertex, so they stay joined. Triangles next to a split edge get worse; the
    intrinsic Delaunay triangulation on which the solver works does not.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.strip(4, 1)
    >>> finer = heat_igl.mesh.split_long_edges(mesh, 0.5)
    >>> float(finer.edge_lengths.max())
    0.5
    >>> np.array_equal(finer.V[: mesh.n_vertices], mesh.V)
    True
    """
    surface = as_simplices(mesh)
    if surface.is_tetrahedral:
        raise MeshError("split_long_edges needs triangles, but F holds tetrahedra")
    longest = float(surface.edge_lengths.mean()) if longest is None else positive("longest", longest)
    pieces = float(np.ceil(surface.edge_lengths / longest).sum())
    if pieces > _MOST_PIECES:
        raise ValueError(f"longest = {longest:.3g} would cut the edges into {pieces:.3g} pieces: make it longer")
    while (long := surface.edge_lengths > longest).any():
        surface = _halved(surface, long)
    return surface


def _halved(mesh: Mesh, chosen: BoolArray) -> Mesh:
    """The mesh with a vertex in the middle of each of the `chosen` edges (k,)."""
    middle = np.cumsum(chosen) - 1 + mesh.n_vertices
    V = np.concatenate([mesh.V, mesh.V[mesh.edges[chosen]].mean(axis=1)])
    of_face = mesh.facets.of_face
    split = chosen[of_face]
    n_split = split.sum(axis=1)
    faces = [mesh.F[n_split == 0]]
    # The corners are rotated so that the side that differs from the other two is opposite the first corner.
    for count, odd in ((1, split), (2, ~split), (3, split)):
        rows = np.flatnonzero(n_split == count)
        corner = (odd[rows].argmax(axis=1)[:, None] + np.arange(3)) % 3
        corners = np.take_along_axis(mesh.F[rows], corner, axis=1)
        faces.append(_pieces(count, V, corners, middle[np.take_along_axis(of_face[rows], corner, axis=1)]))
    return Mesh(V, np.concatenate(faces))


def _pieces(count: int, V: FloatArray, corners: IntArray, middles: IntArray) -> IntArray:
    """The 2, 3 or 4 triangles that replace triangles abc with `count` sides split; p, q, r lie opposite a, b, c."""
    a, b, c = corners.T
    p, q, r = middles.T
    if count == 1:
        return _rows([[a, b, p], [a, p, c]])
    if count == 3:
        return _rows([[a, r, q], [b, p, r], [c, q, p], [p, q, r]])
    # Without the corner a the quadrilateral r b c q remains; the shorter diagonal makes the better triangles.
    by_rc = np.linalg.norm(V[r] - V[c], axis=1) < np.linalg.norm(V[q] - V[b], axis=1)
    return _rows([[a, r, q], [r, b, np.where(by_rc, c, q)], [np.where(by_rc, r, b), c, q]])


def _rows(triangles: list[list[IntArray]]) -> IntArray:
    return np.concatenate([np.stack(corners, axis=1) for corners in triangles])
