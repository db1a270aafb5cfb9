"""The derivative of distance along straight lines that bend around edges of a body."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.operators import MetricSimplices
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import SimplexDerivative
from heat_igl.typing import AnyArray, FloatArray, IntArray

# The most edges that a way is followed around, sweeps over their places, and steps of Newton's method after these.
_MOST_BENDS, _SWEEPS, _STEPS = 16, 30, 6
# A distance that differs from the length of the way by more than this share of it is not that length.
_SAME = 1e-9


class LineDerivative(SimplexDerivative):
    """The derivative of lengths of ways, whose matrix is known.

    Parameters
    ----------
    simplices, sources, distance
        The domain, the sources, and the answer (n,).
    label : (n,) int
        The number of the source vertex of each vertex.
    length : (n,) float64
        Of the ways, with the offset of the source.
    slopes : (n, 3 n) csr_array
        The derivative of `length` by positions.
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
    """The lengths (n,) of shortest ways around edges, and their derivatives (n, 3 n) by positions.

    The places at which a way bends make it shortest, so that they count as fixed on their edges.

    Parameters
    ----------
    V : (n, 3) float64
        Positions.
    ends : (n,) int
        The vertex at which each way ends; the vertex itself if there is none.
    edges, way : (e, 2) int, (n,) int
        Edges around which ways bend, and the last one on the way to each vertex; negative for none.
    distance : (n,) float64
        Their lengths as found, from which the order of the vertices is taken.
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
    long = np.linalg.norm(e, axis=2)
    return e / np.where(long > 0, long, 1)[..., None], long


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
