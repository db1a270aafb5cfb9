"""Distance through tetrahedra, or triangles that do not fit together, by fronts that pass from one to the next."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.bends import bend_around
from heat_igl.kernels.fronts import advance
from heat_igl.kernels.sight import look_around
from heat_igl.mesh import connectivity
from heat_igl.operators import MetricSimplices
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.reflex_edges import reflex_edges
from heat_igl.unfolding.solver import UnfoldingSolver

__all__ = ["FrontSolver"]


class FrontSolver(UnfoldingSolver):
    """Distance by fronts that pass through simplices, each with edge lengths of its own; no heat is read.

    A vertex gets its distance from the other corners of a simplex: from each alone along an edge, and from two or three
    by the point behind the edge or triangle between them that lies at their distances, if the straight line from it
    crosses there. A straight way is found to rounding, in tetrahedra of any shape. Behind an edge of the body around
    which ways bend, the point is an approximation of second order.

    Where a front passes into a simplex of another slowness, it is refracted: its values along the facet stay, which is
    Snell's law, and its radius is divided by the square of the ratio of speeds, as that of a paraxial ray.

    Parameters
    ----------
    simplices : MetricSimplices
        The domain. Where `V` is known, no distance is below the straight line from its source.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        self.is_exact = True
        self._simplices = simplices
        self._corners = np.ascontiguousarray(simplices.corners, np.int32)
        used = simplices.corners.ravel()
        self._incident = np.argsort(used, kind="stable").astype(np.int32)
        self._first = np.concatenate([[0], np.cumsum(np.bincount(used, minlength=simplices.n))]).astype(np.int32)
        self._lengths = np.ascontiguousarray(simplices.lengths)
        self._slowness = np.ascontiguousarray(simplices.slowness)
        self._V = np.empty((0, 3)) if simplices.V is None else np.ascontiguousarray(simplices.V)

    @cached_property
    def _bends(self) -> tuple[AnyArray, FloatArray, FloatArray]:
        """Edges around which ways bend (e, 2), their directions out of the body (e, 3), longest edges at vertices (n,)."""
        edges, outward = reflex_edges(self._simplices.corners, self._V)
        reach = np.zeros(self._simplices.n)
        pairs, lengths = self._simplices.edges
        np.maximum.at(reach, pairs.ravel(), np.repeat(lengths, 2))
        return edges.astype(np.int32), outward, reach

    @cached_property
    def _edge_graph(self) -> sp.csr_array:
        return connectivity.shortest_edge_graph(*self._simplices.edges, self._simplices.n)

    def _order(self, vertices: IntArray, straight: bool = False) -> AnyArray:
        """All vertices, from near to far: by the straight line from the only source, or by edges."""
        if straight:
            far = np.linalg.norm(self._V - self._V[vertices[0]], axis=1)
        else:
            far = connectivity.edge_distance(self._edge_graph, vertices)
        return np.argsort(far, kind="stable").astype(np.int32)

    def _distance(self, sources: SourceSet, u: FloatArray, labels: IntArray | None = None) -> FloatArray:
        del u  # the order is that of straight lines or of Dijkstra's algorithm
        n = self._simplices.n
        vertices, offset = sources.vertices.astype(np.int32), sources.vertex_offset
        distance = np.full(n, np.inf)
        distance[vertices] = offset
        begin = distance.copy()
        label: AnyArray = np.full(n, -1, np.int32)
        label[vertices] = np.arange(len(vertices))
        mesh, of_vertices = (self._corners, self._first, self._incident), (distance, begin, label)
        is_stale = np.ones(n, np.uint8)
        order = self._order(sources.vertices, straight=len(self._V) > 0 and len(vertices) == 1)
        if len(self._V):
            is_stale = self._follow_lines(order, vertices, offset, *of_vertices)
        if is_stale.any():
            order = self._order(sources.vertices)
            advance(order, *mesh, self._lengths, self._slowness, *of_vertices, is_stale, self._V, vertices)
        if labels is not None:
            labels[:] = np.concatenate([sources.vertex_label, [-1]])[label]
        return distance

    def _follow_lines(
        self,
        order: AnyArray,
        vertices: AnyArray,
        offset: FloatArray,
        distance: FloatArray,
        begin: FloatArray,
        label: AnyArray,
    ) -> AnyArray:
        """Lower distance to straight lines and to ways that bend around edges; returns what was not reached (n,)."""
        mesh, of_vertices = (self._corners, self._first, self._incident, self._V), (distance, begin, label)
        look_around(order, *mesh, vertices, offset, *of_vertices)
        edges, outward, reach = self._bends
        k=0
        if len(edges):
            rank = np.empty(self._simplices.n, np.int64)
            rank[self._order(vertices)] = np.arange(self._simplices.n)
            near = np.argsort(rank[edges].max(axis=1), kind="stable")
            way = np.where(label >= 0, -1, -2).astype(np.int32)
            k = bend_around(
                edges[near], outward[near], *mesh, reach, vertices, offset, *of_vertices, way
            )
        import os
        if os.environ.get("SAY"): print(len(edges), k, np.isinf(distance).sum())
        return np.isinf(distance).astype(np.uint8)
