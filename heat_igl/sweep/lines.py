"""`LineEngine`: distance through tetrahedra in space, along straight lines that bend around edges of the body."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic.frames import unit_vectors
from heat_igl.kernels.bodies.bends import bend_around
from heat_igl.kernels.bodies.sight import look_around
from heat_igl.operators import MetricSimplices
from heat_igl.plan import SMALL_BODY
from heat_igl.sources import SourceSet
from heat_igl.sweep.bodies import OrderedBody, with_long_edges_cut
from heat_igl.sweep.simplex_derivative import SimplexDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Of the places nearest in space so many are compared by their offsets; so many vertices at a time.
_MOST_NEAR, _ROWS = 64, 16384
# Sources that a vertex looks for first, nearest first. With one, single vertices of 200 bodies with 2 to 5 sources were
# up to 5 % too far.
_MOST_FIRST = 8
# What the kernel of bends knows of the way to a vertex.
_STRAIGHT, _UNKNOWN = -1, -2
# The most edges that a way is followed around, sweeps over their places, and steps of Newton's method after these.
_MOST_BENDS, _SWEEPS, _STEPS = 16, 30, 6
# A distance that differs from the length of the way by more than this share of it is not that length.
_SAME = 1e-9


class LineEngine(SimplexEngine):
    """Distance through tetrahedra in space: straight lines from the sources, and lines that bend around edges.

    A body bends lines at edges with more than half a turn inside: once its ends know their distances, such an edge is a
    source itself. Tetrahedra that `is_halved` says were halved are not halved again.

    Long ones of these edges are cut first: distance along an edge is known at five points, and what comes to a long one
    may come from many others. The vertices of the given simplices come first.
    """

    def __init__(self, simplices: MetricSimplices, is_halved: bool = False) -> None:
        body, is_small = OrderedBody(simplices), simplices.sizes <= SMALL_BODY
        self._given, self._small, self._weights = simplices, simplices.part(is_small), None
        cut = with_long_edges_cut(simplices, body.reflex_edges[0])
        if cut is not None:
            simplices, self._weights = cut
            body, is_small = OrderedBody(simplices), self._weights @ is_small > 0
        super().__init__(simplices)
        self._body, self._is_small = body, is_small
        is_refined = len(self._small.corners) > 0 and not is_halved and self._is_small[body.reflex_edges[0]].any()
        self._finer = LineEngine(self._small.halved(), is_halved=True) if is_refined else None

    def _from_near(self, vertices: AnyArray, offset: FloatArray) -> tuple[AnyArray, AnyArray]:
        """All vertices from near to far in space, and the sources (n, k) that each looks for first, or -1."""
        body, nearest = self._body, np.where(self._is_small[self._body.order, None], 0, -1)
        if len(vertices) == 1:
            far = np.sqrt(sum((x - x[vertices[0]]) ** 2 for x in body.V.T))
        else:
            apart = body.apart
            # Where another arrives before a source begins, no line comes from the source.
            first = np.unique(nearest_in_value(apart[vertices], apart[vertices], offset)[1])
            # A wall may hide the nearest one, and the next one be seen between vertices that belong to others.
            count = min(_MOST_FIRST if len(body.reflex_edges[0]) else 1, len(first))
            far, which = nearest_in_value(apart, apart[vertices[first]], offset[first], count)
            nearest = first[which]
        # No line comes from another component.
        nearest[body.component[vertices[nearest]] != body.component[:, None]] = -1
        return np.argsort(far, kind="stable").astype(np.int32), nearest.astype(np.int32)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from; on small bodies also by halved tetrahedra."""
        distance, labels = super().labelled(sources, cutoff, threads)
        distance, labels = distance[: self._given.n], labels[: self._given.n]
        if self._finer is not None and self._is_small[sources.vertices].any():
            found, other = (values[: len(distance)] for values in self._finer.labelled(sources))
            # Longer by rounding alone, a distance stays as it is.
            shorter = found < distance * (1 - _SAME)
            distance[shorter] = found[shorter]
            labels[shorter] = other[shorter]
        return distance, labels

    def derivative(self, sources: SourceSet) -> LineDerivative:
        """The distance from source vertices with its derivative."""
        distance, label, length, slopes = self._differentiated(sources)
        return LineDerivative(self._given, sources, distance, label, length, slopes)

    def _differentiated(self, sources: SourceSet) -> tuple[FloatArray, IntArray, FloatArray, sp.csr_array]:
        """Distances and source vertices (n,) by number, lengths of ways (n,), and their slopes (n, 3 n)."""
        distance, label, (edges, way) = self._solved(sources)
        ends = np.where(label >= 0, sources.vertices[label], np.arange(len(label)))
        length, slopes = line_slopes(self._simplices.place, ends, edges, way, distance)
        length += np.append(sources.vertex_offset, 0)[label]
        n = self._given.n
        distance, label, length, slopes = distance[:n], label[:n], length[:n], slopes[:n]
        if self._weights is not None:
            slopes @= sp.kron(self._weights, sp.eye_array(3), format="csr")
        if self._finer is not None and self._is_small[sources.vertices].any():
            found, other, finer_length, finer_slopes = self._finer._differentiated(sources)
            finer_slopes = finer_slopes[:n] @ sp.kron(self._small.halfway(), sp.eye_array(3), format="csr")
            is_shorter = found[:n] < distance * (1 - _SAME)
            distance, label, length = (
                np.where(is_shorter, x[:n], y) for x, y in ((found, distance), (other, label), (finer_length, length))
            )
            chosen = sp.diags_array(is_shorter.astype(float))
            slopes = sp.csr_array(chosen @ finer_slopes + (sp.eye_array(n) - chosen) @ slopes)
        return distance, label, length, slopes

    def _lower(
        self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray
    ) -> tuple[AnyArray, AnyArray]:
        """Lower distance to straight lines, and to ways of straight lines that bend around edges of the body.

        Returns these edges (e, 2), and the edge (n,) around which the way to each vertex bends last.
        """
        # Values are compared by shares of them.
        least = offset.min()
        vertices, offset = self._body.number[vertices], offset - least
        d, labels = distance[self._body.order] - least, label[self._body.order]
        order, nearest = self._from_near(vertices, offset)
        edges, outward, wall = self._body.reflex_edges
        edges = np.concatenate([edges, self._body.later_edges])
        way: AnyArray = np.full(len(order), _UNKNOWN, np.int32)
        way[vertices] = _STRAIGHT
        before, numbered = d.copy(), self._body.number[edges]
        look_around(order, self._body.body, vertices, offset, numbered, nearest, d, labels)
        way[d < before] = _STRAIGHT
        bend_around(numbered, outward, wall, self._body.body, vertices, offset, d, labels, way)
        distance[self._body.order], label[self._body.order] = d + least, labels
        return edges, way[self._body.number]

    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        """As of all engines, without a list of edges: voxels have seven times as many as vertices."""
        d, labels = distance[self._body.order], label[self._body.order]
        self._body.body.along_edges(d, labels)
        distance[self._body.order], label[self._body.order] = d, labels


def nearest_in_value(
    V: FloatArray, places: FloatArray, offset: FloatArray, count: int = 1
) -> tuple[FloatArray, IntArray]:
    """The least sum of an offset (k,) and the distance from its place (k, d) in space, at each V (n, d).

    Returns also which place that is, and which ones of those near to V follow: (n, count).
    """
    from scipy.spatial import cKDTree

    tree, least = cKDTree(places), offset - offset.min()
    value, which = np.empty(len(V)), np.empty((len(V), count), np.int64)
    for begin in range(0, len(V), _ROWS):
        left, k = np.arange(begin, min(begin + _ROWS, len(V))), count
        while len(left) and k <= _MOST_NEAR:
            far, near = tree.query(V[left], np.arange(1, min(k, len(places)) + 1))
            found = far + least[near]
            value[left], best = found.min(axis=1), found.argsort(axis=1, kind="stable")[:, :count]
            which[left] = np.take_along_axis(near, best, axis=1)
            # All other places are farther.
            left, k = left[(value[left] > far[:, -1]) & (k < len(places))], 2 * k
    return value, which


class LineDerivative(SimplexDerivative):
    """The derivative of lengths of ways (n,), with the offsets of their sources, by a matrix `slopes` (n, 3 n).

    `label` (n,) is the number of the source vertex of each vertex.
    """

    def __init__(
        self,
        simplices: MetricSimplices,
        sources: SourceSet,
        distance: FloatArray,
        label: IntArray,
        length: FloatArray,
        slopes: sp.csr_array,
    ) -> None:
        super().__init__(simplices, sources)
        self.distance, self._label, self._slopes = distance, label, slopes
        reached = np.flatnonzero(np.isfinite(distance))
        off = np.abs(length - distance)[reached] > _SAME * np.abs(distance[reached])
        self.inexact = reached[off]

    def _by_positions(self, rows: FloatArray) -> FloatArray:
        return np.asarray(rows @ self._slopes).reshape(len(rows), -1, 3)

    def _by_starts(self, row: FloatArray) -> FloatArray:
        reached = self._label >= 0
        return np.asarray(np.bincount(self._label[reached], row[reached], len(self._sources.vertices)), np.float64)

    def _moved(self, dV: FloatArray) -> FloatArray:
        return np.asarray(self._slopes @ dV.ravel())


def line_slopes(
    V: FloatArray, ends: IntArray, edges: IntArray, way: AnyArray, distance: FloatArray
) -> tuple[FloatArray, sp.csr_array]:
    """The lengths (n,) of shortest ways around edges, and their derivatives (n, 3 n) by positions V (n, 3).

    The places at which a way bends make it shortest, so that they count as fixed on their edges. `ends` (n,) are the
    vertices at which ways end, the vertex itself if there is none, and `way` (n,) the last of the `edges` (e, 2) that
    each bends around; negative for none. The order of the vertices is that of their distances as found.
    """
    n = len(V)
    chains: dict[int, tuple[int, ...]] = {}
    order = np.argsort(distance, kind="stable")
    for v in order[way[order] >= 0].tolist():
        a, b = edges[way[v]].tolist()
        chains[v] = (int(way[v]), *chains.get(a if distance[a] <= distance[b] else b, ()))[:_MOST_BENDS]
    most = max(map(len, chains.values()), default=0)
    # Behind the last bend, edges from the end to the end.
    nodes = np.repeat(ends[:, None, None], 2, axis=2).repeat(most, axis=1)
    for v, chain in chains.items():
        nodes[v, : len(chain)] = edges[list(chain)]
    nodes = np.concatenate(
        [np.repeat(np.arange(n)[:, None, None], 2, axis=2), nodes, ends[:, None, None].repeat(2, axis=2)], axis=1
    )
    t = np.zeros((n, most + 2))
    bent = np.array(sorted(chains), np.int64)
    t[bent] = _shortest(V[nodes[bent]])
    weight = np.stack([1 - t, t], axis=2)
    x = np.einsum("njk,njkx->njx", weight, V[nodes])
    unit, long = _directions(x)
    pull = np.zeros_like(x)
    pull[:, :-1] += unit
    pull[:, 1:] -= unit
    columns = 3 * nodes[..., None] + np.arange(3)
    rows = np.broadcast_to(np.arange(n)[:, None, None, None], columns.shape)
    values = weight[..., None] * pull[:, :, None]
    slopes = sp.csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(n, 3 * n))
    return long.sum(axis=1), slopes


def _directions(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (k, c - 1, 3) back along lines through points (k, c, 3), 0 where two coincide, and lengths."""
    e = x[:, :-1] - x[:, 1:]
    return unit_vectors(e), np.linalg.norm(e, axis=2)


def _shortest(X: FloatArray) -> FloatArray:
    """The places (k, c), 0 to 1, on edges X (k, c, 2, 3) that make the line through them shortest."""
    A, E = X[:, :, 0], X[:, :, 1] - X[:, :, 0]
    size = np.linalg.norm(E, axis=2)
    u = E / np.where(size > 0, size, 1)[..., None]
    t = np.where(size > 0, 0.5, 0.0)
    for _ in range(_SWEEPS):
        for j in range(1, X.shape[1] - 1):
            # The neighbours, turned into one plane with the edge.
            off = A[:, [j - 1, j + 1]] + t[:, [j - 1, j + 1], None] * E[:, [j - 1, j + 1]] - A[:, j, None]
            along = np.einsum("kix,kx->ki", off, u[:, j])
            height = np.linalg.norm(off - along[..., None] * u[:, j, None], axis=2)
            both = height.sum(axis=1)
            place = (along * height[:, ::-1]).sum(axis=1) / np.where(both * size[:, j] > 0, both * size[:, j], np.inf)
            t[:, j] = np.where((size[:, j] > 0) & (both > 0), np.clip(place, 0, 1), t[:, j])
    inside = (t > 0) & (t < 1)
    for _ in range(_STEPS):
        unit, long = _directions(A + t[..., None] * E)
        slope, H = np.zeros_like(t), np.zeros((*t.shape, t.shape[1]))
        for j in range(X.shape[1] - 1):
            r, per_length = unit[:, j], 1 / np.where(long[:, j] > 0, long[:, j], np.inf)
            for i, sign in ((j, 1), (j + 1, -1)):
                slope[:, i] += sign * np.einsum("kx,kx->k", E[:, i], r)
                for m, other in ((j, 1), (j + 1, -1)):
                    across = (E[:, i] * E[:, m]).sum(1) - (E[:, i] * r).sum(1) * (E[:, m] * r).sum(1)
                    H[:, i, m] += sign * other * across * per_length
        keep = inside[:, :, None] & inside[:, None]
        H = np.where(keep, H, np.eye(t.shape[1]))
        flat = np.linalg.eigvalsh(H)[:, 0] < 1e-12
        H[flat] = np.eye(t.shape[1])
        step = np.linalg.solve(H, np.where(inside & ~flat[:, None], slope, 0)[..., None])[..., 0]
        t = np.clip(t - step, 0, 1)
    return t
