"""Near-exact distance for one query, without a factorization: strips unfolded in the order of Dijkstra's algorithm."""

from __future__ import annotations

from heat_igl.errors import MeshError
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.mesh import Mesh, connectivity
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray
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
    """
    mesh = Mesh(V, F)
    if mesh.is_tetrahedral:
        raise MeshError("unfolding needs triangles, but F has 4 columns")
    chosen = vertex_sources(sources, mesh.n_vertices)
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    return refinement.unfold(connectivity.edge_distance(mesh.edge_graph, chosen), chosen, tolerance)
