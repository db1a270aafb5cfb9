"""Surfaces with texture seams joined into one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, without_warning
from heat_igl.mesh.seams import seam_pairs
from heat_igl.typing import IntArray

__all__ = ["MergedSeams", "merge_seams"]


class MergedSeams(NamedTuple):
    """A mesh whose seams are closed.

    Attributes
    ----------
    mesh : Mesh
        The surface as one, with the faces in the same order.
    vertex : (n,) int64
        The vertex of `mesh` that each given vertex became: ``distance[vertex]`` are values at the given vertices.
    """

    mesh: Mesh
    vertex: IntArray


def merge_seams(mesh: MeshLike) -> MergedSeams:
    """Join the boundary edges of a triangle mesh that lie on each other.

    Loaders of textured models split vertices where the texture has a seam, so that distance across the seam is inf, or
    goes around it.

    Parameters
    ----------
    mesh : mesh
        Triangles: whatever `as_mesh` takes.

    Returns
    -------
    MergedSeams
        With the same mesh if nothing is to be joined.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.

    Notes
    -----
    Two boundary edges are joined if their ends have the same positions, bit for bit, if the faces on both sides have
    the same orientation, and if no third boundary edge lies there. Cuts with a gap, however small, T-junctions, and a
    sheet that lies on another are left alone. A cut without a gap cannot be told from a seam.

    Examples
    --------
    >>> import heat_igl
    >>> V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> mesh = heat_igl.Mesh(V, [[0, 1, 2], [3, 4, 5]])  # a square, split along the diagonal
    >>> heat_igl.geodesic_distance(mesh, 0).round(3).tolist()
    [0.0, 1.0, 1.0, inf, inf, inf]
    >>> joined = heat_igl.merge_seams(mesh)
    >>> heat_igl.geodesic_distance(joined.mesh, joined.vertex[0])[joined.vertex].round(3).tolist()
    [0.0, 1.0, 1.0, 1.0, 1.414, 1.0]
    """
    found = without_warning(mesh)
    given = found if isinstance(found, Mesh) else found.triangles
    if given.is_tetrahedral:
        raise MeshError("mesh is tetrahedral: seams are those of surfaces, so pass triangles")
    pairs = seam_pairs(given)
    n = given.n_vertices
    if not len(pairs):
        return MergedSeams(given, np.arange(n))
    a, b = np.concatenate([pairs[:, [0, 3]], pairs[:, [1, 2]]]).T
    _, label = sp.csgraph.connected_components(sp.coo_array((np.ones(len(a)), (a, b)), shape=(n, n)), directed=False)
    # Vertices keep their order, each group at the place of its first.
    first = np.unique(label, return_index=True)[1]
    order = np.argsort(first)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    vertex: IntArray = number[label].astype(np.int64)
    return MergedSeams(Mesh(given.V[first[order]], vertex[given.F]), vertex)
