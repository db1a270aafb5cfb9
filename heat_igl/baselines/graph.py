"""Distance along the edges of a graph, and theorem 3.1, by which heat ends there as t tends to 0."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl.mesh import Mesh, connectivity
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray

__all__ = ["graph_distance", "graph_limit"]

# Entries of A below this fraction of the largest are rounding (the two right angles opposite the diagonal of a square
# have cotangents of 1e-17), not edges of its graph.
_ROUNDING = 1e-12


def graph_distance(mesh: Mesh, sources: Sources, *, count_edges: bool = False) -> FloatArray:
    """Length of the shortest path along edges, by Dijkstra's algorithm: an upper bound of the distance.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    count_edges : bool
        Return the least number of edges instead, the distance of theorem 3.1.

    Returns
    -------
    (n,) float64
        In the mesh's unit, or a count; 0 at the sources, ``inf`` where none is reached.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    """
    chosen = vertex_sources(sources, mesh.n_vertices)
    return connectivity.edge_distance(mesh.edge_graph, chosen, count_edges=count_edges)


def graph_limit(A: sp.spmatrix, sources: Sources, log_t: float) -> FloatArray:
    """``log u_t / log t`` for (Id - t A) u_t = delta: theorem 3.1 at a time t that no double can hold.

    The theorem says that this tends to the number of edges n_v from the source as t tends to 0: whatever the
    Laplacian, its smallest time steps measure nothing but edges. For ``u_v = t^n_v y_v`` the system reads
    ``y_v - sum_w A_vw t^(1 + n_w - n_v) y_w = delta_v``. Neighbours differ by at most one edge, so that only the powers
    t^0, t and t^2 occur: a system in ordinary numbers, in which t may underflow without harm, and from whose y
    ``log u_v = n_v log t + log y_v`` has an unlimited range. In the limit ``y_v = (A^n_v delta)_v``, hence

        ``log u_t / log t = n_v + log|(A^n_v delta)_v| / log t + O(t / log t)``:

    convergence goes like 1 / log t, and doubles, in which t^n must stay above 1e-308, end before one is near.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Real and symmetric, for instance `Operators.L`. Entries below 1e-12 of the largest do not count as edges.
    sources : int, sequence of int, or (n,) mask of bool
        Where delta is 1.
    log_t : float
        Natural logarithm of t, negative; -1e6 is fine.

    Returns
    -------
    (n,) float64
        0 edges at the sources up to the theorem's O(t / log t), ``inf`` where none is reached, or where the leading
        terms cancel (the theorem holds for generic A; they cannot where no entry off the diagonal is negative).

    Raises
    ------
    SourceError
        If the sources name no row of A.
    ValueError
        If A is not a symmetric matrix, or `log_t` is not negative.
    """
    matrix = sp.csr_array(A, dtype=np.float64)
    if matrix.shape[0] != matrix.shape[1] or abs(matrix - matrix.T).max() > _ROUNDING * abs(matrix).max():
        raise ValueError(f"A must be a symmetric matrix, but the one of shape {matrix.shape} is not")
    if not (np.isfinite(log_t) and log_t < 0):
        raise ValueError(f"log_t must be a negative number, the logarithm of t < 1, not {log_t!r}")
    chosen = vertex_sources(sources, matrix.shape[0])
    matrix.data[np.abs(matrix.data) <= _ROUNDING * np.abs(matrix.data).max(initial=0.0)] = 0.0
    matrix.eliminate_zeros()
    edges = connectivity.edge_distance(abs(matrix), chosen, count_edges=True)
    reached = np.flatnonzero(np.isfinite(edges))
    graph = sp.coo_array(matrix[reached][:, reached])
    n = edges[reached]
    with np.errstate(under="ignore"):
        power = np.exp(log_t * (1 + n[graph.col] - n[graph.row]))
        scaled = sp.csc_array((graph.data * power, (graph.row, graph.col)), shape=graph.shape)
    # No pivoting: where no entry of A off the diagonal is negative, elimination in place only ever adds. y grows like
    # the number of paths, and among 1e40 of them a pivoted factorization loses the values near the source.
    factor = spl.splu(sp.eye_array(len(n), format="csc") - scaled, diag_pivot_thresh=0.0)
    y = factor.solve(np.isin(reached, chosen).astype(np.float64))
    limit = np.full(matrix.shape[0], np.inf)
    with np.errstate(divide="ignore"):
        limit[reached] = n + np.log(np.abs(y)) / log_t
    return limit
