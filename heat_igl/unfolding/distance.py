"""Near-exact distance for one query, without a factorization: strips unfolded in the order of Dijkstra's algorithm."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.errors import MeshError
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.mesh import Mesh
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray, IntArray
from heat_igl.unfolding.refinement import TOLERANCE, Refinement

__all__ = ["unfolded_distance"]


def unfolded_distance(V: ArrayLike, F: ArrayLike, sources: Sources, *, tolerance: float = TOLERANCE) -> FloatArray:
    """Near-exact geodesic distance without a factorization: strip unfolding in the order of Dijkstra's algorithm.

    For one or two queries on a mesh; from the third on, ``HeatMethodSolver(mesh, refine="unfold")`` is faster.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) array_like
        Triangles.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    tolerance : float
        See `Refinement.unfold`.

    Returns
    -------
    (n,) float64
        In the unit of V: 0 at the sources, ``inf`` at vertices that no source reaches. Every value is the length of a
        path on the surface.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name vertices.
    MissingExtraError
        If numba is not installed.
    """
    mesh = Mesh(V, F)
    if mesh.is_tetrahedral:
        raise MeshError("unfolding needs triangles, but F has 4 columns")
    chosen = vertex_sources(sources, mesh.n_vertices)
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    return refinement.unfold(_edge_distance(mesh, chosen), chosen, tolerance)


def _edge_distance(mesh: Mesh, sources: IntArray) -> FloatArray:
    """Distance (n,) along edges, ``inf`` where there is no way."""
    n = mesh.n_vertices
    graph = sp.csr_array((mesh.edge_lengths, tuple(mesh.edges.T)), shape=(n, n))
    return np.asarray(csgraph.dijkstra(graph, directed=False, indices=sources, min_only=True))
