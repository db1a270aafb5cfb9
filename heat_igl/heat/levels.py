"""The level of the integrated distance and the values known beside the sources, with their derivatives.

The steps of `Integration.pin_levels`, with a record of the value that decided at each vertex.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from heat_igl.heat.assembly import take_shorter
from heat_igl.heat.integration import HEAT_ERROR
from heat_igl.heat.known_values import KnownValues, spokes
from heat_igl.heat.parts import SolverParts
from heat_igl.heat.source_terms import SourceTerm, right_hand_side
from heat_igl.steps import FlowDerivative, MatrixSlopes
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["FlowChange", "LevelSlopes", "PinnedLevels"]


class FlowChange(NamedTuple):
    """How the heat flow changes: initial heat (e,) at vertices of sources, the matrix A, and its diagonal (n,)."""

    vertex: IntArray
    label: IntArray
    initial: FloatArray
    product: Callable[[FloatArray], FloatArray]
    diagonal: FloatArray


class LevelSlopes(NamedTuple):
    """The derivative of a number by what the levels are made of.

    Attributes
    ----------
    by_phi, by_heat : (n,) float64
        By the integrated phi, before its level is known, and by the heat.
    by_value : (k,) float64
        By the known values.
    by_side : (m, 3) float64
        By the sides of the triangles that are solved on.
    by_matrix : MatrixSlopes or None
        By the matrix of the heat flow directly, with several sources.
    by_part : (n,) float64
        By the initial heat of a further heat flow: that of each source times its share of `relative`.
    relative : (n_labels,) float64
        The level of each source above the lowest.
    """

    by_phi: FloatArray
    by_heat: FloatArray
    by_value: FloatArray
    by_side: FloatArray
    by_matrix: MatrixSlopes | None
    by_part: FloatArray
    relative: FloatArray


class _Bound(NamedTuple):
    """Vertices (k,) that a side ties to a known value, and whether the length of the side is added or subtracted."""

    end: IntArray
    side: IntArray
    which: IntArray
    sign: float


class PinnedLevels:
    """Distance from phi, as `Integration.pin_levels` finds it.

    Parameters
    ----------
    parts : SolverParts
        Of the solver.
    term : SourceTerm
        Vertices and points, without those that others overtake.
    values : KnownValues
        Of the same term.
    phi, u : (n,) float64
        The integrated phi, and the heat.

    Attributes
    ----------
    distance : (n,) float64
        The answer, 0 where no source is reached.
    """

    def __init__(
        self, parts: SolverParts, term: SourceTerm, values: KnownValues, phi: FloatArray, u: FloatArray
    ) -> None:
        domain, surface = parts.operators, parts.operators.surface
        if surface is None:
            raise ValueError("levels are differentiated on triangles")
        self._parts, self._term, self._u, self._triangulation = parts, term, u, surface.triangulation
        self._components, self._n_components = domain.components, domain.n_components
        anchors, near, n_near = term.anchors, term.near, len(term.near.vertex)
        self._anchor_component = self._components[anchors.vertex]
        self._count = np.maximum(np.bincount(self._anchor_component, minlength=self._n_components), 1)
        place = np.full(len(phi), -1)
        place[near.vertex] = np.arange(n_near)
        self._place, self._n_values = place, len(values.vertex)
        excess = phi[anchors.vertex] - anchors.value
        of_source = self._levels_of_sources(excess)
        rest = np.bincount(self._anchor_component, excess - of_source[anchors.vertex], self._n_components) / self._count
        reached = np.isin(self._components, self._components[near.vertex])
        start = np.full(self._n_components, np.inf)
        np.minimum.at(start, self._components[near.vertex], near.value)
        begin = np.where(reached, start[self._components], 0.0)
        distance = np.where(reached, phi - of_source - rest[self._components], 0.0)
        #: The known value that a vertex takes over, and the vertices whose distance is decided by phi.
        self._taken = np.full(len(phi), -1)
        lowest = np.full(self._n_components, -1)
        order = np.argsort(-near.value, kind="stable")
        lowest[self._components[near.vertex[order]]] = order
        below = reached & (distance <= begin)
        self._taken[below] = lowest[self._components[below]]
        np.maximum(distance, begin, out=distance)
        shorter = np.flatnonzero(take_shorter(distance, term.far, HEAT_ERROR, begin))
        self._taken[term.far.vertex[shorter]] = n_near + shorter
        self._bounds: list[_Bound] = []
        if parts.t_damping is not None or not term.sources.on_vertices_alone:
            self._bound(distance)
        distance[near.vertex] = near.value
        self._taken[near.vertex] = np.arange(n_near)
        self._bounds = [self._without(bound, near.vertex) for bound in self._bounds]
        self._is_free: BoolArray = reached & (self._taken < 0)
        self._takers = np.flatnonzero(self._taken >= 0)
        for bound in self._bounds:
            self._is_free[bound.end] = False
        self.distance = distance

    def _levels_of_sources(self, excess: FloatArray) -> FloatArray:
        """The level (n,) of the source that the heat at a vertex comes from; 0 with one source."""
        term = self._term
        self._weighted: FlowDerivative | None = None
        self._relative = np.zeros(term.sources.n_labels)
        count = np.bincount(term.anchors.label, minlength=term.sources.n_labels)
        if np.count_nonzero(count) < 2:
            return np.zeros_like(self._u)
        self._of_label = np.maximum(count, 1)
        level = np.bincount(term.anchors.label, excess, len(count)) / self._of_label
        # Relative to the lowest, the only level where no heat arrives.
        self._heat = np.where(count > 0, 1.0, 0.0)[term.label] * term.heat_of(term.share)
        self._lowest = int(np.argmin(np.where(count > 0, level, np.inf)))
        self._relative = np.where(count > 0, level - level[self._lowest], 0.0)
        domain = self._parts.operators
        heat = right_hand_side(domain.n, [term], [term.share * self._relative[term.label]])[:, 0]
        self._weighted = FlowDerivative(self._parts.heat_flow, domain, heat)
        self._is_warm = self._u > 0
        self._share = np.divide(self._weighted.u, self._u, out=np.zeros_like(self._u), where=self._is_warm)
        return np.asarray(level[self._lowest] + self._share)

    def _bound(self, distance: FloatArray) -> None:
        """Limit differences from known distances to the lengths of edges; note the vertices that this decides."""
        near = self._term.near
        side, which, end, length = spokes(self._triangulation, near.vertex)
        for sign in (-1.0, 1.0):
            bound = sign * near.value[which] + length
            order = np.argsort(-bound, kind="stable")
            best = np.full(len(distance), -1)
            best[end[order]] = order
            ends = np.flatnonzero(best >= 0)
            chosen = best[ends]
            limit = sign * bound[chosen]
            beyond = sign * (distance[ends] - limit) > 0
            ends, chosen = ends[beyond], chosen[beyond]
            distance[ends] = limit[beyond]
            self._taken[ends] = -1
            self._bounds = [self._without(other, ends) for other in self._bounds]
            self._bounds.append(_Bound(ends, side[chosen], which[chosen], sign))

    @staticmethod
    def _without(bound: _Bound, vertices: IntArray) -> _Bound:
        """A bound where none of some vertices is tied."""
        kept = ~np.isin(bound.end, vertices)
        return _Bound(bound.end[kept], bound.side[kept], bound.which[kept], bound.sign)

    def pull_back(self, g: FloatArray) -> LevelSlopes:
        """The derivative of the sum of distances times g (n,)."""
        term, anchors = self._term, self._term.anchors
        by_side = np.zeros(self._triangulation.l.size)
        taken = self._takers
        by_value = np.asarray(np.bincount(self._taken[taken], g[taken], self._n_values), np.float64)
        for end, side, which, sign in self._bounds:
            np.add.at(by_value, which, g[end])
            np.add.at(by_side, side, sign * g[end])
        by_phi = np.where(self._is_free, g, 0.0)
        of_component = np.asarray(np.bincount(self._components, by_phi, self._n_components), np.float64)
        share = -of_component[self._anchor_component]
        share /= self._count[self._anchor_component]
        by_excess, by_heat, by_matrix = share, np.zeros(len(g)), None
        by_part = np.zeros(len(g))
        if self._weighted is not None:
            by_source = -by_phi
            np.add.at(by_source, anchors.vertex, -share)
            of_share = np.divide(by_source, self._u, out=np.zeros(len(g)), where=self._is_warm)
            by_heat = -of_share * self._share
            by_part, by_matrix = self._weighted.pull_back(of_share)
            by_level = np.bincount(term.label, by_part[term.vertex] * self._heat, term.sources.n_labels)
            # A level that is common to all sources is taken out by the mean over the anchors.
            by_level[self._lowest] -= by_level.sum()
            by_excess = share + (by_level / self._of_label)[anchors.label]
        np.add.at(by_phi, anchors.vertex, by_excess)
        np.add.at(by_value, self._place[anchors.vertex], -by_excess)
        return LevelSlopes(by_phi, by_heat, by_value, by_side.reshape(-1, 3), by_matrix, by_part, self._relative)

    def push_forward(
        self, by_phi: FloatArray, by_heat: FloatArray, by_value: FloatArray, by_side: FloatArray, flow: FlowChange
    ) -> FloatArray:
        """How the distances (n,) change with phi, the heat (n,), the known values (k,), sides (m, 3) and the flow."""
        term, anchors = self._term, self._term.anchors
        excess = by_phi[anchors.vertex] - by_value[self._place[anchors.vertex]]
        of_source = np.zeros_like(by_phi)
        if self._weighted is not None:
            level = np.bincount(anchors.label, excess, len(self._of_label)) / self._of_label
            relative = (level - level[self._lowest])[term.label]
            initial = np.asarray(np.bincount(term.vertex, self._heat * relative, len(by_phi)), np.float64)
            initial += np.bincount(flow.vertex, flow.initial * self._relative[flow.label], len(by_phi))
            weighted = self._weighted.push_forward(initial, flow.product, flow.diagonal)
            of_source = np.divide(
                weighted - self._share * by_heat, self._u, out=np.zeros_like(by_phi), where=self._is_warm
            )
        rest = np.bincount(self._anchor_component, excess - of_source[anchors.vertex], self._n_components)
        change = np.where(self._is_free, by_phi - of_source - (rest / self._count)[self._components], 0.0)
        change[self._takers] = by_value[self._taken[self._takers]]
        for end, side, which, sign in self._bounds:
            change[end] = by_value[which] + sign * by_side.ravel()[side]
        return np.asarray(change)
