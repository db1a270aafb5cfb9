"""Bounds of geodesic distance without a reference: straight lines from below, paths along edges from above."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import MeshLike, as_simplices, connectivity
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray


def straight_lines(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length (n,) of the straight line from each vertex to the nearest source, never above the geodesic distance."""
    mesh = as_simplices(mesh)
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    seeds = vertex_sources(sources, mesh.n_vertices)
    distance, _ = cKDTree(mesh.V[seeds]).query(mesh.V)
    return np.asarray(distance, dtype=np.float64)


def edge_paths(mesh: MeshLike, sources: Sources, *, count_edges: bool = False) -> FloatArray:
    """Length (n,) of the shortest path along edges from each vertex to the sources (Dijkstra 1959).

    Never below the geodesic distance; ``inf`` at vertices that no path joins with a source. With `count_edges` the
    smallest number of edges instead, the distance of the paper's theorem 3.1.
    """
    mesh = as_simplices(mesh)
    chosen = vertex_sources(sources, mesh.n_vertices)
    return connectivity.edge_distance(mesh.edge_graph, chosen, count_edges=count_edges)
