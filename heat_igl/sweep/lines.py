"""`LineEngine`: distance through tetrahedra in space, along straight lines that bend around edges of the body."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic.frames import unit_vectors
from heat_igl.kernels.bodies.bends import bend_around
from heat_igl.kernels.bodies.rays import Body
from heat_igl.kernels.bodies.sight import look_around
from heat_igl.mesh.connectivity import group_by_label, unique_rows
from heat_igl.operators import MetricSimplices
from heat_igl.plan import SMALL_BODY
from heat_igl.sources import SourceSet
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
# Sine of the angle by which a body must exceed half a turn at an edge.
_FLAT = 1e-6
# The most edges that a way is followed around, sweeps over their places, and steps of Newton's method after these.
_MOST_BENDS, _SWEEPS, _STEPS = 16, 30, 6
# A distance that differs from the length of the way by more than this share of it is not that length.
_SAME = 1e-9


class LineEngine(SimplexEngine):
    """Distance through tetrahedra in space: straight lines from the sources, and lines that bend around edges.

    A body bends lines at edges with more than half a turn inside: once its ends know their distances, such an edge is a
    source itself. Tetrahedra that `is_halved` says were halved are not halved again.

    Inside, vertices are in an `_order` (n,) in which neighbours are near each other in memory as well.
    """

    def __init__(self, simplices: MetricSimplices, is_halved: bool = False) -> None:
        super().__init__(simplices)
        # A query takes .89 to .97 of the time on 13 bodies of 10 000 vertices, .70 to .86 on three of 50 000 to 70 000.
        self._order = along_curve(simplices.place, simplices.components)
        self._number = np.argsort(self._order).astype(np.int32)
        self._V, corners = simplices.place[self._order], self._number[self._corners]
        self._corners = corners[np.argsort(corners.min(axis=1), kind="stable")]
        self._is_small = simplices.sizes <= SMALL_BODY
        # A further coordinate, by which no body is near another one.
        component = simplices.components[self._order, None]
        self._apart = np.hstack([self._V, 2 * np.ptp(self._V, axis=0).sum() * component])
        self._small = simplices.part(self._is_small)
        is_refined = len(self._small.corners) > 0 and not is_halved and self._is_small[self.reflex_edges[0]].any()
        self._finer = LineEngine(self._small.halved(), is_halved=True) if is_refined else None

    @cached_property
    def reflex_edges(self) -> tuple[AnyArray, FloatArray, FloatArray]:
        """Boundary edges at which the inside takes more than half a turn, and edges where more than two walls meet.

        A vertex at which parts of the body touch, or only one of these edges ends, is an edge from itself to itself:
        where the place at which a way would bend is hidden, its end may be seen. Returns the edges (e, 2) int32; unit
        vectors (e, 3) out of the body, halfway between the two walls, zero where more than two meet; and cosines (e,)
        of the angles between these vectors and the walls.
        """
        from scipy.sparse import csgraph

        V, corners = self._V, self._corners
        tetrahedron, corner = np.nonzero(self._body.sides_behind() < 0)
        walls = np.sort(corners[tetrahedron[:, None], (corner[:, None] + [1, 2, 3]) % 4].astype(np.int64), axis=1)
        inner = V[corners[tetrahedron, corner]]
        # The sides of all walls, each with the wall's third corner and its normal that points inside.
        normal = np.cross(V[walls[:, 1]] - V[walls[:, 0]], V[walls[:, 2]] - V[walls[:, 0]])
        normal *= np.sign(np.einsum("ij,ij->i", normal, inner - V[walls[:, 0]]))[:, None]
        sides = np.concatenate([walls[:, [0, 1]], walls[:, [0, 2]], walls[:, [1, 2]]])
        third = np.concatenate([walls[:, 2], walls[:, 1], walls[:, 0]])
        wall = np.tile(np.arange(len(walls)), 3)
        first, of_side, counts = unique_rows(sides, len(V))
        edges = sides[first]
        tangent = unit_vectors(V[edges[:, 1]] - V[edges[:, 0]])[of_side]
        along_wall = V[third] - V[sides[:, 0]]
        along_wall = unit_vectors(along_wall - np.einsum("ij,ij->i", along_wall, tangent)[:, None] * tangent)
        order = np.argsort(of_side, kind="stable")
        begins = np.concatenate([[0], np.cumsum(counts)[:-1]])
        one, other = order[begins], order[begins + np.minimum(counts - 1, 1)]
        sine = np.einsum("ij,ij->i", unit_vectors(normal[wall[one]]), along_wall[other])
        outward = unit_vectors(along_wall[one] + along_wall[other])
        outward[counts != 2] = 0
        # The sides of a slit coincide, at a whole turn.
        cosine = np.einsum("ij,ij->i", along_wall[one], along_wall[other])
        bends = (counts > 2) | ((counts == 2) & ((sine < -_FLAT) | ((sine < _FLAT) & (cosine > 0))))
        # The walls around a vertex, from edge to edge; at edges where more than two meet, ways bend anyway.
        corner = 3 * wall[:, None] + np.repeat([[0, 1], [0, 2], [1, 2]], len(walls), axis=0)
        pairs = np.stack([corner[one[counts == 2]], corner[other[counts == 2]]]).reshape(2, -1)
        fan = csgraph.connected_components(sp.coo_array((np.ones(pairs.shape[1]), pairs), shape=2 * (walls.size,)))[1]
        n_fans = np.bincount(walls.ravel()[np.unique(fan, return_index=True)[1]])
        touching = np.setdiff1d(np.flatnonzero(n_fans > 1), edges[counts > 2])
        # Without them, ways were up to 12 % too long on rough walls.
        lone = np.flatnonzero(np.bincount(edges[bends].ravel(), minlength=len(V)) == 1)
        touching = np.union1d(touching, lone)
        found = self._order[np.concatenate([edges[bends], np.stack([touching, touching], axis=1)])].astype(np.int32)
        cosine = np.einsum("ij,ij->i", along_wall[one], outward)[bends]
        return found, np.pad(outward[bends], ((0, len(touching)), (0, 0))), np.pad(cosine, (0, len(touching)))

    @cached_property
    def _body(self) -> Any:
        body: Any = Body
        return body(self._corners, *self._incident, self._V)

    def _from_near(self, vertices: AnyArray, offset: FloatArray) -> tuple[AnyArray, AnyArray]:
        """All vertices from near to far in space, and the sources (n, k) that each looks for first, or -1."""
        if len(vertices) == 1:
            far = np.sqrt(sum((x - x[vertices[0]]) ** 2 for x in self._V.T))
            nearest = np.where(self._is_small[self._order, None], 0, -1)
        else:
            # Where another arrives before a source begins, no line comes from the source.
            first = np.unique(nearest_in_value(self._apart[vertices], self._apart[vertices], offset)[1])
            # A wall may hide the nearest one, and the next one be seen between vertices that belong to others.
            count = min(_MOST_FIRST if len(self.reflex_edges[0]) else 1, len(first))
            far, which = nearest_in_value(self._apart, self._apart[vertices[first]], offset[first], count)
            nearest = first[which]
        return np.argsort(far, kind="stable").astype(np.int32), nearest.astype(np.int32)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from; on small bodies also by halved tetrahedra."""
        distance, labels = super().labelled(sources, cutoff, threads)
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
        return LineDerivative(self._simplices, sources, distance, label, length, slopes)

    def _differentiated(self, sources: SourceSet) -> tuple[FloatArray, IntArray, FloatArray, sp.csr_array]:
        """Distances and source vertices (n,) by number, lengths of ways (n,), and their slopes (n, 3 n)."""
        distance, label, (edges, way) = self._solved(sources)
        ends = np.where(label >= 0, sources.vertices[label], np.arange(len(label)))
        length, slopes = line_slopes(self._simplices.place, ends, edges, way, distance)
        length += np.append(sources.vertex_offset, 0)[label]
        if self._finer is not None and self._is_small[sources.vertices].any():
            n = len(distance)
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
        vertices, offset = self._number[vertices], offset - least
        d, labels = distance[self._order] - least, label[self._order]
        order, nearest = self._from_near(vertices, offset)
        edges, outward, wall = self.reflex_edges
        way: AnyArray = np.full(len(order), _UNKNOWN, np.int32)
        way[vertices] = _STRAIGHT
        before, numbered = d.copy(), self._number[edges]
        look_around(order, self._body, vertices, offset, numbered, nearest, d, labels)
        way[d < before] = _STRAIGHT
        bend_around(numbered, outward, wall, self._body, vertices, offset, d, labels, way)
        distance[self._order], label[self._order] = d + least, labels
        return edges, way[self._number]

    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        """As of all engines, without a list of edges: voxels have seven times as many as vertices."""
        d, labels = distance[self._order], label[self._order]
        self._body.along_edges(d, labels)
        distance[self._order], label[self._order] = d, labels


def along_curve(places: FloatArray, component: IntArray) -> IntArray:
    """The order (n,) of places (n, 3) along a curve through the space (Morton 1966) of one component after another."""
    begins, order = group_by_label(component, component.max() + 1)
    low, high = (extreme.reduceat(places[order], begins[:-1]) for extreme in (np.minimum, np.maximum))
    size = np.maximum((high - low).max(axis=1), 1e-300)[component, None]
    cell = ((places - low[component]) / size * (2**20 - 1)).astype(np.int64)
    order = np.argsort(sum((cell >> b & 1) @ [4 << 3 * b, 2 << 3 * b, 1 << 3 * b] for b in range(20)), kind="stable")
    return order[np.argsort(component[order], kind="stable")]


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
