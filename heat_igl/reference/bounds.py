"""Bounds of geodesic distance that need no reference: the straight line from below, paths along edges from above."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.mesh import Mesh
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray

__all__ = ["edge_paths", "straight_lines"]


def straight_lines(mesh: Mesh, sources: Sources) -> FloatArray:
    """Length (n,) of the straight line from each vertex to the nearest source, never above the geodesic distance."""
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    seeds = vertex_sources(sources, mesh.n_vertices)
    distance, _ = cKDTree(mesh.V[seeds]).query(mesh.V)
    return np.asarray(distance, dtype=np.float64)


def edge_paths(mesh: Mesh, sources: Sources) -> FloatArray:
    """Length (n,) of the shortest path along edges from each vertex to the sources (Dijkstra 1959).

    Never below the geodesic distance; ``inf`` where no path leads.
    """
    seeds = vertex_sources(sources, mesh.n_vertices)
    i, j = mesh.edges.T
    # A stored zero would count as no edge, so that two vertices in one place would be far apart.
    lengths = np.maximum(mesh.edge_lengths, np.finfo(np.float64).tiny)
    graph = sp.csr_array((lengths, (i, j)), shape=(mesh.n_vertices, mesh.n_vertices))
    distance = csgraph.dijkstra(graph, directed=False, indices=seeds, min_only=True)
    return np.asarray(distance, dtype=np.float64)
