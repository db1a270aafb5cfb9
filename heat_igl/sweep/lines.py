"""`LineEngine`: distance through tetrahedra in space, along straight lines that bend around edges of the body."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.kernels.bodies.bends import bend_around
from heat_igl.kernels.bodies.bodies import Body
from heat_igl.kernels.bodies.sight import look_around
from heat_igl.mesh import connectivity
from heat_igl.operators import MetricSimplices
from heat_igl.plan import SMALL_BODY
from heat_igl.sources import SourceSet
from heat_igl.sweep.line_derivative import LineDerivative, line_slopes
from heat_igl.sweep.reflex_edges import reflex_edges
from heat_igl.sweep.simplex_engine import ROUNDING, SimplexEngine
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Rounds of lines, ways that bend, and edges; two, unless the body touches itself.
_MOST_ROUNDS = 5
# How far the search for ways that bend goes beside what an edge hides, in longest edges of a vertex.
_BESIDE, _BESIDE_OF_FEW = 0.5, 2.0
# What the kernel of bends knows of the way to a vertex.
_STRAIGHT, _UNKNOWN = -1, -2


class LineEngine(SimplexEngine):
    """Distance through tetrahedra in space: straight lines from the sources, and lines that bend around edges.

    A body bends lines at edges with more than half a turn inside: once its ends know their distances, such an edge is a
    source itself.

    Parameters
    ----------
    simplices : MetricSimplices
        Tetrahedra with positions `V`.
    is_halved : bool
        Whether they are not to be halved again.
    """

    def __init__(self, simplices: MetricSimplices, is_halved: bool = False) -> None:
        super().__init__(simplices)
        self._V = np.ascontiguousarray(simplices.place)
        self._is_small = simplices.n <= SMALL_BODY
        is_refined = self._is_small and not is_halved and len(self.reflex_edges[0]) > 0
        self._finer = LineEngine(simplices.halved(), is_halved=True) if is_refined else None

    @cached_property
    def reflex_edges(self) -> tuple[AnyArray, FloatArray, FloatArray]:
        """Edges around which ways bend (e, 2), directions out of the body (e, 3), and cosines to the walls (e,)."""
        edges, outward, wall = reflex_edges(self._corners, self._body.sides_behind(), self._V)
        return edges.astype(np.int32), outward, wall

    @cached_property
    def _body(self) -> Any:
        body: Any = Body
        return body(self._corners, self._first, self._incident, self._V)

    @cached_property
    def _edges(self) -> tuple[AnyArray, FloatArray]:
        """Each edge once."""
        ends = self._body.edges()
        # By coordinate: voxels have seven times as many edges as vertices.
        return ends, np.sqrt(sum((x[ends[:, 0]] - x[ends[:, 1]]) ** 2 for x in self._V.T))

    @cached_property
    def _edge_graph(self) -> sp.csr_array:
        ends, lengths = self._edges
        return sp.csr_array((lengths, tuple(ends.T)), shape=(self._simplices.n, self._simplices.n))

    def _order(self, vertices: AnyArray, straight: bool = False) -> AnyArray:
        """All vertices, from near to far: by the straight line from the only source, or by edges."""
        if straight:
            far = np.linalg.norm(self._V - self._V[vertices[0]], axis=1)
        else:
            far = connectivity.edge_distance(self._edge_graph, vertices)
        return np.argsort(far, kind="stable").astype(np.int32)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from; on small bodies also by halved tetrahedra."""
        distance, labels = super().labelled(sources, cutoff, threads)
        if self._finer is not None:
            found, other = (values[: len(distance)] for values in self._finer.labelled(sources))
            # Longer by rounding alone, a distance stays as it is.
            shorter = found < distance * (1 - ROUNDING)
            distance[shorter] = found[shorter]
            labels[shorter] = other[shorter]
        return distance, labels

    def derivative(self, sources: SourceSet) -> LineDerivative:
        """The distance from source vertices with its derivative."""
        distance, label, length, slopes = self._differentiated(sources)
        return LineDerivative(self._simplices, sources, distance, label, length, slopes)

    def _differentiated(self, sources: SourceSet) -> tuple[FloatArray, IntArray, FloatArray, sp.csr_array]:
        """Distances and source vertices (n,) by number, lengths of ways (n,), and their slopes (n, 3 n)."""
        distance, label = self._begun(sources)
        vertices, offset = sources.vertices.astype(np.int32), sources.vertex_offset
        edges, way = self._ways(vertices, offset, distance, label)
        self._keep_bounds(vertices, offset, distance, label)
        ends = np.where(label >= 0, vertices[label], np.arange(len(label)))
        length, slopes = line_slopes(self._V, ends, edges, way, distance)
        length += np.append(offset, 0)[label]
        if self._finer is not None:
            n = len(distance)
            found, other, finer_length, finer_slopes = self._finer._differentiated(sources)
            finer_slopes = finer_slopes[:n] @ sp.kron(self._simplices.halfway(), sp.eye_array(3), format="csr")
            is_shorter = found[:n] < distance * (1 - ROUNDING)
            distance, label, length = (
                np.where(is_shorter, x[:n], y) for x, y in ((found, distance), (other, label), (finer_length, length))
            )
            chosen = sp.diags_array(is_shorter.astype(float))
            slopes = sp.csr_array(chosen @ finer_slopes + (sp.eye_array(n) - chosen) @ slopes)
        return distance, label, length, slopes

    def _lower(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> None:
        """Lower distance to straight lines, and to ways of straight lines that bend around edges of the body."""
        self._ways(vertices, offset, distance, label)

    def _ways(
        self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray
    ) -> tuple[AnyArray, AnyArray]:
        """As `_lower`; returns edges (e, 2), and the edge (n,) around which the way to each vertex bends last."""
        begin = distance.copy()
        order = self._order(vertices, straight=len(vertices) == 1)
        edges, outward, wall = self.reflex_edges
        if len(edges):
            rank = np.empty(len(order), np.int64)
            rank[self._order(vertices)] = np.arange(len(order))
            near = np.argsort(rank[edges].max(axis=1), kind="stable")
            edges, outward, wall = edges[near], outward[near], wall[near]
        way: AnyArray = np.full(len(order), _UNKNOWN, np.int32)
        way[vertices] = _STRAIGHT
        turns = np.isin(vertices, edges).astype(np.uint8)
        beside = _BESIDE_OF_FEW if self._is_small else _BESIDE
        is_continued = False
        for round_ in range(_MOST_ROUNDS):
            before = distance.copy()
            guess = self._nearest(vertices)
            look_around(order, self._body, vertices, offset, turns, len(edges) > 0, guess, distance, begin, label)
            is_seen = distance < before
            way[is_seen] = _STRAIGHT
            if round_ and not is_seen.any() and not is_continued:
                break
            if len(edges):
                bend_around(edges, outward, wall, self._body, beside, vertices, offset, distance, begin, label, way)
            # Behind a point or an edge at which tetrahedra touch, no line continues.
            is_continued = self._continue_along_edges(distance, begin, label)
            if not is_continued and not (self._is_small and len(edges) and len(vertices) > 1):
                break
        return edges, way

    def _nearest(self, vertices: AnyArray) -> AnyArray:
        """The source (n,) that each vertex looks for first: the nearest in space, or -1 for those of its neighbours."""
        if len(vertices) == 1:
            return np.full(self._simplices.n, 0 if self._is_small else -1, np.int32)
        from scipy.spatial import cKDTree

        return np.asarray(cKDTree(self._V[vertices]).query(self._V)[1], np.int32)

    def _continue_along_edges(self, distance: FloatArray, begin: FloatArray, label: AnyArray) -> bool:
        """Give vertices that nothing has reached a distance along edges; returns whether there were any."""
        if np.isfinite(distance).all():
            return False
        pairs, lengths = self._edges
        start, end = np.concatenate([pairs, pairs[:, ::-1]]).T
        lengths = np.concatenate([lengths, lengths])
        reached = len(distance) - np.count_nonzero(np.isinf(distance))
        while len(rows := np.flatnonzero(np.isinf(distance[end]) & np.isfinite(distance[start]))):
            # The smallest value of each vertex is written last.
            rows = rows[np.argsort(-(distance[start[rows]] + lengths[rows]), kind="stable")]
            distance[end[rows]] = distance[start[rows]] + lengths[rows]
            begin[end[rows]], label[end[rows]] = distance[start[rows]], label[start[rows]]
        return bool(len(distance) - np.count_nonzero(np.isinf(distance)) > reached)
