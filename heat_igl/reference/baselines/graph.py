"""Shortest paths along edges, and theorem 3.1: the limit of the heat for t tending to 0."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl.mesh import MeshLike, as_simplices, connectivity
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray

# Entries of A below this fraction of the largest are rounding errors, not edges of the graph. For example, the two
# right angles opposite the diagonal of a square have cotangents of 1e-17.
_ROUNDING = 1e-12


def graph_distance(mesh: MeshLike, sources: Sources, *, count_edges: bool = False) -> FloatArray:
    """Length of the shortest path along edges by Dijkstra's algorithm, an upper bound of geodesic distance.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    count_edges : bool
        Return the smallest number of edges instead of the length; this is the distance of theorem 3.1.

    Returns
    -------
    (n,) float64
        Length in the unit of the mesh, or number of edges; 0 at the sources, ``inf`` at unreachable vertices.

    Raises
    ------
    SourceError
        If the sources are not vertices of the mesh.
    """
    mesh = as_simplices(mesh)
    chosen = vertex_sources(sources, mesh.n_vertices)
    return connectivity.edge_distance(mesh.edge_graph, chosen, count_edges=count_edges)


def graph_limit(A: sp.spmatrix, sources: Sources, log_t: float) -> FloatArray:
    """``log u_t / log t`` for (Id - t A) u_t = delta, for times t far below the range of doubles (theorem 3.1).

    By the theorem this tends to the number of edges n_v from the source as t tends to 0, for every Laplacian. With
    ``u_v = t^n_v y_v`` the system reads ``y_v - sum_w A_vw t^(1 + n_w - n_v) y_w = delta_v``. The numbers of edges of
    adjacent vertices differ by at most 1, so only the powers t^0, t and t^2 occur, which may underflow without harm.
    The range of ``log u_v = n_v log t + log y_v`` is unlimited. In the limit ``y_v = (A^n_v delta)_v``, hence

        ``log u_t / log t = n_v + log|(A^n_v delta)_v| / log t + O(t / log t)``:

    The convergence is like 1 / log t. Without the scaling, t^n underflows at 1e-308 long before the limit is near.

    Parameters
    ----------
    A : (n, n) sparse matrix
        Real and symmetric, for instance `Operators.L`. Entries below 1e-12 of the largest do not count as edges.
    sources : int, sequence of int, or (n,) mask of bool
        Rows in which delta is 1.
    log_t : float
        Natural logarithm of t, negative, for example -1e6.

    Returns
    -------
    (n,) float64
        ``log u_t / log t``, which is O(t / log t) at the sources. The value is ``inf`` at unreachable rows and if the
        leading terms cancel: the theorem holds for generic A, and for all A without negative off-diagonal entries.

    Raises
    ------
    SourceError
        If the sources are not rows of A.
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
    # Without pivoting, and with nonnegative off-diagonal entries of A, elimination only adds nonnegative numbers. y
    # grows like the number of paths; with 1e40 paths a pivoted factorization loses the values near the source.
    factor = spl.splu(sp.eye_array(len(n), format="csc") - scaled, diag_pivot_thresh=0.0)
    y = factor.solve(np.isin(reached, chosen).astype(np.float64))
    limit = np.full(matrix.shape[0], np.inf)
    with np.errstate(divide="ignore"):
        limit[reached] = n + np.log(np.abs(y)) / log_t
    return limit
