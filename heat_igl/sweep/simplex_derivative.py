"""Derivatives of a Hopf-Lax distance with respect to offsets, positions and tensors.

The distance and slope y_v of a vertex follow from those of the corners of one facet: y_v = F_v(y, positions, tensors).
The distance is the fixed point y = F(y) for the facets that the search chose. Its gradient is computed by the adjoint
method: solve (1 - dF/dy)^T x = g once, then multiply x by the derivatives of F by positions and tensors.

dF is computed by complex-step differentiation: except at its clips, F is analytic, so Im F(y + i h) / h with h = 1e-100
is exact to rounding. The minimizer of f on a facet, with Hessian H, moves by -H^-1 times the change of the gradient.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from functools import reduce
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from heat_igl.errors import real_numbers
from heat_igl.operators import MetricSimplices
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# Size of the complex step: its square underflows, so no second-order term remains.
_STEP = 1e-100
# Largest number of Newton steps, and the relative change below which the iteration has converged.
_MOST_STEPS, _SETTLED = 12, 1e-12
# Relative difference between the fixed point and the result of the search above which the search had not converged (the
# derivative is then taken at its result), and above which a vertex counts as inexact.
_UNSETTLED, _SAME = 1e-2, 1e-3
# Barycentric coordinates, ratios of second differences and relative changes of the velocity below this are zero.
_ROUNDING = 1e-9


class _Inputs(NamedTuple):
    """The arguments of F for k vertices with facets of p corners.

    Attributes
    ----------
    distance, slope : (k, p) float64, (k, p, 3) float64
        At the corners of the facet.
    X : (k, p + 1, 3) float64
        Positions of the vertex and of the corners.
    tensors : (k, q, 3, 3) float64
        One metric for the simplex (q = 1), or the metrics at the vertex and at the corners (q = p + 1).
    start : (k,) float64
        The offset of the source.

    If paths come from a facet K beyond, its corners follow in `distance`, `slope` and `X`, the metric there in
    `tensors`, and then in `X` the corners opposite K and the facet. The vertex may be a corner of the facet.
    """

    distance: AnyArray
    slope: AnyArray
    X: AnyArray
    tensors: AnyArray
    start: AnyArray


class _FacetUpdate:
    """The second-order Hopf-Lax update of k vertices, each from its own facet; it accepts complex arguments.

    Parameters
    ----------
    is_sloped : (k, p) or (k, 2 p) bool
        Whether the slope at a corner is known.
    weight : (k,) float64
        How far second-order terms are used.
    share : (k, p) or (k, 2 p) float64
        Barycentric coordinates of the minimizer on the facet, and on K; coordinates that are 0 stay 0.
    crosses : (k,) bool
        Whether the path comes from K. Elsewhere K is the facet, and its coordinates are 0.
    """

    def __init__(self, is_sloped: BoolArray, weight: FloatArray, share: FloatArray, crosses: BoolArray) -> None:
        self._crosses, self._is_sloped, self._weight = crosses, is_sloped, weight
        self._any, self._p = bool(crosses.any()), share.shape[1] // (1 + crosses.any())
        self.share = share.copy()
        self._of: _Inputs | None = None
        self._of_W: AnyArray | None = None

    def place(self, at: _Inputs) -> None:
        """Move each point to the minimizer on its facet by Newton's method; coordinates that reach 0 stay 0."""
        (k, n), p = self.share.shape, self._p
        groups = n // p
        M = np.zeros((k, n + groups, n + groups))
        one = np.arange(n) // p == np.arange(groups)[:, None]
        for _ in range(_MOST_STEPS):
            stays = self.share < _ROUNDING
            self.share[stays] = 0.0
            sums = self.share @ one.T
            self.share /= np.where(sums > 0, sums, 1) @ one
            self._is_corner = np.where(self._crosses, *((~stays[:, i : i + p]).sum(axis=1) for i in (n - p, 0))) == 1
            for i in range(n):
                M[:, :n, i] = np.imag(self._value(at, self.share + 1j * _STEP * np.eye(n)[i])[2]) / _STEP
            # The coordinates sum to 1, if there are any.
            M[:, n:, :n] = one & (sums > 0)[:, :, None]
            M[:, :n, n:] = np.swapaxes(M[:, n:, :n], 1, 2)
            M[:, n:, n:] = np.eye(groups) * (sums == 0)[:, :, None]
            M[:, :n] = np.where(stays[:, :, None], np.eye(n, n + groups), M[:, :n])
            self.moves = np.where(stays[:, None] | stays[:, :, None], 0.0, -_inverse(M)[:, :n, :n])
            step = np.einsum("kij,kj->ki", self.moves, self._value(at, self.share)[2])
            # The step ends at the boundary of the facet.
            room = np.min(np.where(step < 0, -self.share / np.minimum(step, -1e-300), 1.0), axis=1)
            step = np.where(np.isfinite(step), np.minimum(room, 1.0)[:, None] * step, 0.0)
            # Half a step where the value rises, so that no two places alternate.
            before, after = (sum(self._value(at, x)[:2]) for x in (self.share, self.share + step))
            self.share += np.where(after > before * (1 + _SETTLED), 0.5, 1.0)[:, None] * step
            if not (np.abs(step) >= _SETTLED).any():
                break

    def values(self, at: _Inputs) -> AnyArray:
        """The distance and slope (k, 4) of the vertices; complex inputs also move the minimizers."""
        share, p = self.share, self._p
        change = np.imag(self._value(at, share)[2])
        if change.any():
            share = share + 1j * np.einsum("kij,kj->ki", self.moves, change)
        T, length, _, lean = self._value(at, share)
        e = at.X[:, 1 : p + 1] - at.X[:, :1]
        if self._any:
            straight = np.einsum("kxy,ki,kiy->kx", at.tensors[:, 0], -share[:, :p] / length[:, None], e)
            # Along the facet, the corner opposite it stands for the vertex.
            stands = self._crosses[:, None, None] & ~np.real(e).any(axis=2, keepdims=True)
            e = np.where(stands, at.X[:, -1:] - at.X[:, :1], e)
            lean = np.where(self._crosses[:, None], np.einsum("kpx,kx->kp", e, straight), lean)
        slope = np.einsum("kpx,kpq,kq->kx", e, _inverse(e @ np.swapaxes(e, 1, 2)), lean)
        return np.concatenate([(at.start + T + length)[:, None], slope], axis=1)

    def _value(self, at: _Inputs, x: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray]:
        """Interpolated distance T and path length at the point x (k, p) of the facet, with two derivatives (k, p).

        These are the gradient of T + length by x, and the derivative of the length when the vertex moves towards each
        corner. The formulas are those of `Facet.value` and `Facet.length`. For x (k, 2 p), T is that on K and the way
        from there where paths come from K.
        """
        if self._of is not at:
            self._of, self._fixed = at, self._anywhere(at)
        D, product, sag, W, e = self._fixed
        t, p, crosses = x, self._p, self._crosses[:, None]
        if self._any:
            x, t = x[:, :p], np.where(crosses, x[:, p:], x[:, :p])
        hang = 0.5 * np.einsum("kij,kj->ki", sag, t)
        mean = (t * D).sum(axis=1)
        # At a corner T is the distance there. At a source it is 0, where the square root has no derivative.
        T = np.where(self._is_corner, mean, np.sqrt(np.where(self._is_corner, 1.0, mean**2 - (t * hang).sum(axis=1))))
        to_T = np.where(self._is_corner[:, None], D, (mean[:, None] * D - hang) / np.where(T == 0, 1, T)[:, None])
        by = np.einsum("kij,kj->ki", product[:, 0], x)
        even_length = np.sqrt((x * by).sum(axis=1))
        even_g = by / even_length[:, None]
        length, g, lean = even_length, even_g, -even_g
        if product.shape[1] > 1:
            # Beside K, the simplex has one metric, and may have a corner of the facet for the vertex.
            bent = self._bent(W, e, x)
            length = np.where(self._crosses, even_length, bent[0])
            g, lean = (np.where(crosses, *both) for both in ((even_g, bent[1]), (-even_g, bent[2])))
        if not self._any:
            return T, length, to_T + g, lean
        X = at.X[:, 1:-1] - at.X[:, -2:-1]
        back = np.einsum("kj,kjx->kx", t, X[:, p:-1]) - np.einsum("kj,kjx->kx", x, X[:, :p])
        by = np.einsum("kxy,ky->kx", at.tensors[:, -1], back)
        leg = np.sqrt(np.where(self._crosses, (back * by).sum(axis=1), 1.0))
        by = np.einsum("kx,kjx->kj", by / leg[:, None], X[:, :-1])
        g = np.concatenate([g + np.where(crosses, -by[:, :p], to_T), np.where(crosses, to_T + by[:, p:], 0)], axis=1)
        return T + np.where(self._crosses, leg, 0.0), length, g, lean

    def _bent(self, W: AnyArray, e: AnyArray, x: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray]:
        """The length in a velocity that is linear, its gradient by x, and the derivative when the vertex moves."""
        mean = np.trace(W, axis1=2, axis2=3) / e.shape[2]
        one, two = mean[:, 0], (x * mean[:, 1:]).sum(axis=1)
        middle = _inverse((W[:, 0] + np.einsum("kj,kjab->kab", x, W[:, 1:])) / 2)
        w = np.einsum("kab,kjb,kj->ka", middle, e, x)
        near = np.sqrt((w**2).sum(axis=1))
        u = np.einsum("kab,kb->ka", middle, w) / near[:, None]
        # The gradient of the mean velocity, in the metric at the centroid of the simplex.
        centre = W.mean(axis=1)
        steep = np.einsum("kab,kbc,kc->ka", centre, _inverse(e), mean[:, 1:] - mean[:, :1])
        root, growth = np.sqrt(one * two), np.sqrt((steep**2).sum(axis=1)) / mean.mean(axis=1)
        growth = _smaller(growth, self._most_growth(e, centre, mean / mean.mean(axis=1)[:, None]))
        even = near * (one + two) / (2 * root)
        half = growth * even / 2
        is_even = np.abs(half) < _ROUNDING
        length = even * np.where(is_even, 1 - half**2 / 6, np.arcsinh(half) / np.where(is_even, 1, half))
        bent = 1 / np.sqrt(1 + half**2)
        factor, longer = bent * (one + two) / (2 * root), bent * near * (two - one) / (4 * root)
        by = np.einsum("ka,kjab,kb->kj", u, W, w) / 2
        along = np.einsum("ka,kja->kj", u, e)
        g = factor[:, None] * (along - by[:, 1:]) + (longer / two)[:, None] * mean[:, 1:]
        lean = factor[:, None] * (by[:, :1] - along - by[:, 1:]) - longer[:, None] * (mean[:, 1:] / one[:, None] - 1)
        return length, g, lean

    def _most_growth(self, e: AnyArray, centre: AnyArray, speed: AnyArray) -> AnyArray:
        """The largest gradient (k,) of the mean velocity that is used, as in `lengths_in_velocity`."""
        sides = np.concatenate([e, e - np.roll(e, 1, axis=1)], axis=1) @ _inverse(centre)
        longest, fastest = (reduce(_larger, x.T) for x in ((sides**2).sum(axis=2), speed))
        return np.asarray(4 * np.sqrt(_larger(fastest**2 - 1, 0) / longest))

    def _anywhere(self, at: _Inputs) -> tuple[AnyArray, ...]:
        """What the value takes that is the same at all places on the facet."""
        p, X, tensors = self._p, at.X, at.tensors[:, :-1] if self._any else at.tensors
        D, e = at.distance - at.start[:, None], X[:, 1 : p + 1] - X[:, :1]
        product = np.einsum("kix,kqxy,kjy->kqij", e, tensors, e, optimize=True)
        sag = self._sag(at.slope[:, :p], self._is_sloped[:, :p], D[:, :p], e, product)
        if self._any:
            back = X[:, p + 1 : -2] - X[:, -2:-1]
            square = np.einsum("kix,kqxy,kjy->kqij", back, at.tensors[:, -1:], back, optimize=True)
            beyond = self._sag(at.slope[:, p:], self._is_sloped[:, p:], D[:, p:], back, square)
            D = np.where(self._crosses[:, None], D[:, p:], D[:, :p])
            sag = np.where(self._crosses[:, None, None], beyond, sag)
        in_metric = (e, e) if product.shape[1] == 1 else self._velocity(tensors, e)
        return D, product, sag, *in_metric

    def _velocity(self, tensors: AnyArray, e: AnyArray) -> tuple[AnyArray, AnyArray]:
        """The tensors to the power -1/2 (k, q, p, p) and the edge vectors (k, p, p), of triangles in their planes."""
        if e.shape[1] == 3:
            if self._of_W is not tensors:
                self._of_W, self._W = tensors, _inverse_root(tensors)
            return self._W, e
        x, y = e[:, 0], e[:, 1]
        x = x / np.sqrt((x**2).sum(axis=1, keepdims=True))
        y = y - (x * y).sum(axis=1, keepdims=True) * x
        axes = np.stack([x, y / np.sqrt((y**2).sum(axis=1, keepdims=True))], axis=1)
        W = _inverse_root(axes[:, None] @ tensors @ np.swapaxes(axes, 1, 2)[:, None])
        return W, e @ np.swapaxes(axes, 1, 2)

    def _sag(self, slope: AnyArray, is_sloped: BoolArray, D: AnyArray, e: AnyArray, product: AnyArray) -> AnyArray:
        """Second difference of the squared distance between two corners (k, p, p), as `SimplexUpdate.sag_between`."""
        k, p = D.shape
        metric = product if product.shape[1] == 1 else product[:, 1:]
        w = np.einsum("kix,kjx->kij", slope, e)
        square = np.einsum("kij,kijl,kil->ki", w, _inverse(np.broadcast_to(metric, (k, p, p, p))), w)
        is_known = is_sloped & (np.real(square) > 0)
        trust = _larger(1 - np.log(np.where(is_known, square, 1.0)) ** 2, 0.0) * is_known
        result = np.zeros((k, p, p), D.dtype if np.iscomplexobj(D) else np.result_type(D, w, product))
        for i in range(p):
            for j in range(i):
                Di, Dj = D[:, i], D[:, j]
                at_i, at_j = 2 * Di * (w[:, i, j] - w[:, i, i]), 2 * Dj * (w[:, j, j] - w[:, j, i])
                rise, more = Dj**2 - Di**2, trust[:, i] - trust[:, j]
                other_j, other_i = 2 * rise - at_i, 2 * rise - at_j
                other_j = np.where(np.real(rise) > 0, other_j, -_larger(-other_j, 0))
                other_i = np.where(np.real(rise) < 0, other_i, _larger(other_i, 0))
                i_is_better = np.real(more) > 0
                at_j = at_j + np.where(i_is_better, more * (other_j - at_j), 0)
                at_i = at_i - np.where(i_is_better, 0, more * (other_i - at_i))
                level = (Dj - Di) ** 2
                sag, doubt = 0.5 * (at_j - at_i) - level, rise - 0.5 * (at_i + at_j)
                doubted = np.abs(np.real(doubt)) >= np.abs(np.real(sag))
                ratio = doubt / np.where(np.real(sag) == 0, 1, sag)
                share = _larger(_size(ratio), 1 - _smaller(trust[:, i], trust[:, j]))
                # The doubt is 0 for the distance from one point, and stays 0 when vertices move.
                size = np.where(np.abs(np.real(ratio)) < _ROUNDING, 0, _size(doubt))
                sag = sag - size * share * np.sign(np.real(sag))
                is_doubted = (np.real(sag) < 0) & (np.real(trust[:, [i, j]]) < 1).all(axis=1)
                sag = np.where(is_doubted, sag * _smaller(trust[:, i], trust[:, j]), sag)
                squares = metric[:, :, i, i] + metric[:, :, j, j] - 2 * metric[:, :, i, j]
                from_i, from_j = (2 * D[:, m] * np.sqrt(squares[:, m % squares.shape[1]]) for m in (i, j))
                sag = _smaller(sag, _smaller(rise + from_i, from_j - rise) - level)
                sag = _larger(sag, _larger(rise - from_i, -from_j - rise) - level)
                is_used = is_sloped[:, i] & is_sloped[:, j] & ~doubted
                result[:, i, j] = result[:, j, i] = np.where(is_used, self._weight * sag, 0)
        return result


def _inverse_root(g: AnyArray) -> AnyArray:
    """The matrices g^(-1/2) (..., p, p), with the derivative where g is complex (Daleckii and Krein 1965)."""
    sizes, axes = np.linalg.eigh(np.real(g))
    root, back = np.sqrt(sizes), np.swapaxes(axes, -1, -2)
    W = (axes / root[..., None, :]) @ back
    if not np.iscomplexobj(g):
        return np.asarray(W)
    change = np.imag(g) + np.swapaxes(np.imag(g), -1, -2)
    rows, columns = root[..., None], root[..., None, :]
    return np.asarray(W - 1j * (axes @ (back @ change @ axes / (2 * rows * columns * (rows + columns))) @ back))


def _size(x: AnyArray) -> AnyArray:
    """|x| of real parts, with its derivative."""
    return np.where(np.real(x) < 0, -x, x)


def _larger(x: AnyArray, y: Any) -> AnyArray:
    """The one with the larger real part; x if both are equal to rounding."""
    a, b = np.real(x), np.real(y)
    return np.where(a >= b - 1e-12 * np.abs(b), x, y)


def _smaller(x: AnyArray, y: AnyArray) -> AnyArray:
    return -_larger(-x, -y)


def _inverse(A: AnyArray) -> AnyArray:
    """The inverses of matrices (..., n, n); NaN for singular ones, for which there is no Newton step."""
    is_regular = (np.abs(np.linalg.slogdet(A)[0]) > 0)[..., None, None]
    return np.where(is_regular, np.linalg.inv(np.where(is_regular, A, np.eye(A.shape[-1]))), np.nan)


class SimplexDerivative(ABC):
    """Reverse-mode derivative of a distance through simplices: maps gradients by distances to gradients by positions.

    Where several shortest paths end, the derivative is that of the path that the engine found.

    Attributes
    ----------
    distance : (n,) float64
        The distance that is differentiated.
    unreachable : (k,) int64
        Vertices at distance ``inf``. Their derivative is 0.
    inexact : (k,) int64
        Vertices at which `distance` differs from the distance of the engine.
    """

    distance: FloatArray
    inexact: IntArray

    def __init__(self, simplices: MetricSimplices, sources: SourceSet) -> None:
        self._simplices, self._sources = simplices, sources

    @property
    def unreachable(self) -> IntArray:
        """Vertices at distance ``inf``."""
        return np.flatnonzero(np.isinf(self.distance))

    def __call__(self, g: ArrayLike) -> FloatArray:
        """The gradient (n, 3) or (k, n, 3) by positions, for a gradient g (n,) or (k, n) by distances; fixed tensors.

        Raises
        ------
        ValueError
            If g has another shape or is not finite at a reachable vertex, or if the solver does not use the given
            tensors directly: tensors per tetrahedron that sample a smooth field, and tensors per triangle. Give the
            metric at the vertices then.
        """
        rows = gradient_rows(g, self.distance)
        self._require_given()
        result = self._by_positions(rows)
        return result if np.ndim(g) == 2 else result[0]

    def by_offsets(self, g: ArrayLike) -> FloatArray:
        """The gradient (s,) by the offset of each source, as they were listed; `g` (n,) as for a call."""
        (row,), sources = gradient_rows(g, self.distance, 1), self._sources
        return np.asarray(np.bincount(sources.vertex_label, self._by_starts(row), sources.n_labels), np.float64)

    def by_metric(self, g: ArrayLike) -> FloatArray:  # noqa: ARG002
        """The gradient by the tensors given to `metric_operators`; a ValueError if there are none."""
        raise ValueError("the solver knows no metric to change: make it on metric_operators or speed_operators")

    by_speed = by_metric

    def push_forward(self, dV: ArrayLike) -> FloatArray:
        """Change of the distances (n,) when vertices move by dV (n, 3) and tensors are fixed; 0 if unreachable."""
        moved = velocities("dV", dV, (self._simplices.n, 3), "vertex")
        self._require_given()
        return self._moved(moved)

    def _require_given(self) -> None:
        if not self._simplices.is_given:
            raise ValueError(
                "the solver does not use the given tensors directly, so only derivatives by offsets are known: "
                "give metric_operators the metric at the vertices, (n, 3, 3)"
            )

    @abstractmethod
    def _by_positions(self, rows: FloatArray) -> FloatArray:
        """The gradients (k, n, 3) by positions, for checked gradients (k, n) by distances."""

    @abstractmethod
    def _by_starts(self, row: FloatArray) -> FloatArray:
        """The gradient (s,) by the offset of each source vertex, for a checked gradient (n,) by distances."""

    @abstractmethod
    def _moved(self, dV: FloatArray) -> FloatArray:
        """Change of the distances (n,) when the vertices move by dV (n, 3)."""


class FixedPointDerivative(SimplexDerivative):
    """The derivative of a Hopf-Lax distance, for the facet that the search chose at each vertex.

    `distance` is the fixed point of the updates to rounding; the engine stops when distances change by less than 1e-4.
    A vertex is `inexact` if `answer` differs from `distance` there by more than a thousandth, as after the engine
    applied its bounds; all vertices are, if the search did not converge.

    Parameters
    ----------
    simplices : MetricSimplices
        With tensors.
    sources : SourceSet
        Source vertices.
    answer : (n,) float64
        The distance that the engine returns.
    source, vertex : (k,) int64, (k,) int32
        Each vertex that the distance from a source was followed to. Such a pair is called a node below.
    distance, *record
        Of each node, and what `HopfLax.record` returns for it.
    """

    def __init__(
        self,
        simplices: MetricSimplices,
        sources: SourceSet,
        answer: FloatArray,
        source: IntArray,
        vertex: AnyArray,
        distance: FloatArray,
        *record: AnyArray,
    ) -> None:
        super().__init__(simplices, sources)
        facet, beyond, place, slope, is_sloped, weight = record
        n, size, key = simplices.n, simplices.corners.shape[1], source * simplices.n + vertex
        others = np.array([[j for j in range(size) if j != c] for c in range(size)])
        # The node of each vertex that is the nearest.
        order = np.lexsort((distance, vertex))
        self._reached, first = np.unique(vertex[order], return_index=True)
        self._nearest, self._source, self._facet = order[first], source, facet
        at = np.flatnonzero(facet >= 0)
        simplex, corner = np.divmod(facet[at, None], size)
        corner = np.concatenate([corner, others[corner[:, 0]]], axis=1)
        # The vertex, and the corners of its facet.
        self._vertices = np.concatenate([vertex[at, None], simplices.corners[simplex, corner[:, 1:]]], axis=1)
        q, crosses, known = 1 if simplices.velocity is None else size, beyond[at] >= 0, self._vertices
        self._simplex, self._corner = simplex.repeat(q, axis=1), corner[:, :q]
        if crosses.any():
            # Those of K and the corner opposite, or the same once more, and that opposite the facet.
            opposite = simplices.corners[simplex, corner[:, :1]]
            simplex, corner = np.divmod(np.where(crosses, beyond[at], facet[at])[:, None], size)
            corner = np.concatenate([others[corner[:, 0]], corner], axis=1)
            self._simplex = np.concatenate([self._simplex, simplex], axis=1)
            self._corner = np.concatenate([self._corner, corner[:, :1]], axis=1)
            self._vertices = np.concatenate([self._vertices, simplices.corners[simplex, corner], opposite], axis=1)
            # Distance counts at the corners of K that have a share.
            known = self._vertices[:, :-2].copy()
            known[crosses, 1:size] = known[crosses, :1]
            known[:, size:] = np.where(place[at, size - 1 :] > 0, known[:, size:], known[:, :1])
        by_key = np.argsort(key)
        self._nodes = by_key[np.searchsorted(key, source[at, None] * n + known, sorter=by_key)]
        is_known, share = is_sloped[self._nodes[:, 1:]].astype(bool), place[at, : known.shape[1] - 1]
        self._update = _FacetUpdate(is_known, weight[at], share, crosses)
        self._rank = np.empty(len(key), np.int64)
        self._rank[np.argsort(distance, kind="stable")] = np.arange(len(key))
        self._state = np.concatenate([distance[:, None], slope], axis=1)
        found = self._state
        for _ in range(_MOST_STEPS):
            change = self._linearized()
            self._state = self._state + change
            if (np.abs(change[:, 0]) <= _SETTLED * distance).all():
                break
        off = np.abs(self._state - found)[self._nearest, 0] > _UNSETTLED * distance[self._nearest]
        if off.any():
            self._state, off = found, np.ones(len(off), bool)
            self._linearized()
        off |= np.isin(self._nearest, self._nodes[~self._is_known, 0])
        self.distance = self._at_vertices(self._state[:, 0], np.inf)
        near, far = self.distance[self._reached], answer[self._reached]
        self.inexact = self._reached[off | (np.abs(near - far) > _SAME * far)]

    def _at_vertices(self, of_nodes: FloatArray, elsewhere: float) -> FloatArray:
        """Values (n,) at vertices, from those of nodes (k,)."""
        result = np.full(self._simplices.n, elsewhere)
        result[self._reached] = of_nodes[self._nearest]
        return result

    def _linearized(self) -> FloatArray:
        """Linearize the updates at the current state, and return the Newton step (n, 4) to the fixed point."""
        self._at, v = self._inputs(), self._nodes[:, 0]
        # During the iteration T^2 may be negative on a facet. Its vertex keeps its distance in this step.
        with np.errstate(invalid="ignore", divide="ignore"):
            self._update.place(self._at)
            rest = self._update.values(self._at) - self._state[v]
            self._is_known = np.isfinite(rest).all(axis=1) & np.isfinite(self._update.moves).all(axis=(1, 2))
            self._factor = self._factored()
        result = np.zeros_like(self._state)
        result[v] = np.where(self._is_known[:, None], rest, 0.0)
        return self._solved(result)

    def _by_positions(self, rows: FloatArray) -> FloatArray:
        adjoint = np.stack([self._adjoint(row) for row in rows])
        result = np.zeros((len(rows), self._simplices.n, 3))
        for (i, x), by in self._derivatives("X"):
            for into, row in zip(result, adjoint, strict=True):
                into[:, x] += self._summed(self._vertices[:, i], row, by, len(into))
        return result

    def _by_starts(self, row: FloatArray) -> FloatArray:
        adjoint, n_sources, begins = self._adjoint(row), len(self._sources.vertices), self._facet < 0
        ((_, by),) = self._derivatives("start")
        own = np.bincount(self._source[begins], adjoint[begins, 0], n_sources)
        return np.asarray(own + self._summed(self._source[self._nodes[:, 0]], adjoint, by, n_sources))

    def by_metric(self, g: ArrayLike) -> FloatArray:
        """The gradient (n, 3, 3) or (m, 3, 3) by the tensors given to `metric_operators`; `g` is (n,).

        Raises
        ------
        ValueError
            As for a call.
        """
        (row,) = map(self._adjoint, gradient_rows(g, self.distance, 1))
        self._require_given()
        simplices = self._simplices
        is_at_vertices = simplices.velocity is not None
        result = np.zeros((simplices.n if is_at_vertices else len(simplices.corners), 3, 3))
        for (i, x, y), by in self._derivatives("tensors"):
            where = self._vertices[:, i] if is_at_vertices else self._simplex[:, i]
            result[:, x, y] += self._summed(where, row, by, len(result))
        return (result + np.swapaxes(result, 1, 2)) / 2

    def by_speed(self, g: ArrayLike) -> FloatArray:
        """The gradient (m,) by the speeds given to `speed_operators`; `g` (n,), errors as for `by_metric`."""
        by_metric, simplices = self.by_metric(g), self._simplices
        if simplices.tensors is None:
            raise ValueError("the solver knows no speeds, but a metric at the vertices: use by_metric")
        return np.asarray(-2 * np.trace(by_metric, axis1=1, axis2=2) * simplices.tensors[simplices.group, 0, 0] ** 1.5)

    def _moved(self, dV: FloatArray) -> FloatArray:
        change = np.zeros_like(self._state)
        for (i, x), by in self._derivatives("X"):
            change[self._nodes[:, 0]] += by * dV[self._vertices[:, i], x][:, None]
        return self._at_vertices(self._solved(change)[:, 0], 0.0)

    def _summed(self, where: IntArray, row: FloatArray, by: FloatArray, size: int) -> FloatArray:
        """The adjoint `row` (nodes, 4) times the derivatives (k, 4), added up by entry (k,) of an input."""
        return np.asarray(np.bincount(where, (row[self._nodes[:, 0]] * by).sum(axis=1), size), np.float64)

    def _inputs(self) -> _Inputs:
        simplices, facet, distance = self._simplices, self._nodes[:, 1:], self._state[:, 0]
        tensors = simplices.metric(self._simplex, self._corner)
        start = self._sources.vertex_offset[self._source[self._nodes[:, 0]]]
        return _Inputs(distance[facet], self._state[facet, 1:], simplices.place[self._vertices], tensors, start)

    def _derivatives(self, name: str) -> Iterator[tuple[tuple[int, ...], FloatArray]]:
        """For each entry of an input: its index, and the derivative (k, 4) of distances and slopes by this entry."""
        given = getattr(self._at, name)
        for entry in np.ndindex(given.shape[1:]):
            moved = given.astype(complex)
            moved[(slice(None), *entry)] += 1j * _STEP
            with np.errstate(invalid="ignore", divide="ignore"):
                by = np.imag(self._update.values(self._at._replace(**{name: moved}))) / _STEP
            yield entry, np.where(self._is_known[:, None], by, 0.0)

    def _factored(self) -> Any:
        """LU factors of 1 - dF/dy. With vertices sorted by distance, the matrix is nearly triangular."""
        row, column, value = [np.arange(self._state.size)], [np.arange(self._state.size)], [np.ones(self._state.size)]
        for name in ("distance", "slope"):
            for (i, *x), by in self._derivatives(name):
                row.append((4 * self._rank[self._nodes[:, :1]] + np.arange(4)).ravel())
                column.append(np.repeat(4 * self._rank[self._nodes[:, i + 1]] + (1 + x[0] if x else 0), 4))
                value.append(-by.ravel())
        A = sp.csc_array((np.concatenate(value), (np.concatenate(row), np.concatenate(column))))
        try:
            return splu(A, permc_spec="NATURAL", diag_pivot_thresh=0.0)
        except RuntimeError as error:
            raise ValueError(
                "the distance has no derivative: vertices have their distances from each other, as the metric changes "
                "too much within single triangles or tetrahedra: refine the mesh"
            ) from error

    def _solved(self, right: FloatArray, way: str = "N") -> FloatArray:
        ordered = np.empty_like(right)
        ordered[self._rank] = right
        return np.asarray(self._factor.solve(ordered.ravel(), way).reshape(-1, 4)[self._rank])

    def _adjoint(self, row: FloatArray) -> FloatArray:
        """The adjoint state x (nodes, 4) of (1 - dF/dy)^T x = g, for a gradient g (n,) by distances."""
        right = np.zeros_like(self._state)
        right[self._nearest, 0] = row[self._reached]
        return self._solved(right, "T")


def gradient_rows(g: ArrayLike, distance: FloatArray, most: int = 2) -> FloatArray:
    """Gradients of k functions by the distances, checked, as rows (k, n) that are 0 at unreachable vertices.

    Raises
    ------
    ValueError
        If `g` has another shape than (n,), or (k, n) if `most` is 2, or is not finite at a reachable vertex.
    """
    array = real_numbers("g", g)
    n = len(distance)
    if not 1 <= array.ndim <= most or array.shape[-1] != n:
        also = f" or (k, {n})" if most == 2 else ""
        raise ValueError(f"g must have shape ({n},){also}, one entry per vertex, but it has shape {array.shape}")
    rows = np.array(array.reshape(-1, n))
    rows[:, np.isinf(distance)] = 0.0
    if not np.isfinite(rows).all():
        row, vertex = np.argwhere(~np.isfinite(rows))[0]
        raise ValueError(f"g must be finite at reachable vertices, but is {rows[row, vertex]} at vertex {vertex}")
    return rows


def velocities(name: str, given: ArrayLike, shape: tuple[int, ...], of: str) -> FloatArray:
    """Velocities as finite float64 of the given shape."""
    array = real_numbers(name, given)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{name} must be {shape} finite numbers, one velocity per {of}; it has shape {array.shape}")
    return array
