"""The level of the integrated distance and the values known beside the sources, with their derivatives.

`Integration.pin_levels` for sources that are vertices, step by step, remembering which value decided at each vertex.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from heat_igl.heat_method.parts import SolverParts
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.sources import SourceTerm, right_hand_side
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["LevelSlopes", "PinnedLevels"]


class _Spokes(NamedTuple):
    """Sides (k,) at known vertices: the position of the vertex among the known, the other end, the length."""

    side: IntArray
    which: IntArray
    end: IntArray
    length: FloatArray


class LevelSlopes(NamedTuple):
    """The derivative of a number by what the levels are made of.

    Attributes
    ----------
    by_phi : (n,) float64
        By the integrated phi, before its level is known.
    by_heat : (n,) float64
        By the heat.
    pair : tuple of two (n,) float64, or None
        The adjoint and the solution of one more heat solve, with several sources.
    by_side, by_given : (m, 3), (m', 3) float64
        By the sides of the triangles that are solved on, and of the faces before any flip, or None where those do not
        count.
    """

    by_phi: FloatArray
    by_heat: FloatArray
    pair: tuple[FloatArray, FloatArray] | None
    by_side: FloatArray
    by_given: FloatArray | None


class PinnedLevels:
    """Distance from phi, as `Integration.pin_levels` finds it from source vertices.

    Parameters
    ----------
    parts : SolverParts
        Of the solver.
    term : SourceTerm
        Source vertices without offsets.
    phi, u : (n,) float64
        The integrated phi, and the heat.

    Attributes
    ----------
    distance : (n,) float64
        The answer, 0 where no source is reached.
    """

    def __init__(self, parts: SolverParts, term: SourceTerm, phi: FloatArray, u: FloatArray) -> None:
        domain = parts.operators
        surface = domain.surface
        if surface is None or surface.faces is None:
            raise ValueError("levels are differentiated on triangles whose faces before any flip are known")
        self._triangulations = surface.triangulation, surface.faces
        self._parts, self._term, self._u = parts, term, u
        self._components, self._n_components = domain.components, domain.n_components
        anchors = term.anchors
        component = self._components[anchors.vertex]
        self._count = np.maximum(np.bincount(component, minlength=self._n_components), 1)
        excess = phi[anchors.vertex] - anchors.value
        self._weighted, of_source = self._levels_of_sources(excess), np.zeros(len(phi))
        if self._weighted is not None:
            of_source = self._weighted / u
        rest = np.bincount(component, excess - of_source[anchors.vertex], self._n_components) / self._count
        reached = np.isin(self._components, self._components[term.near.vertex])
        distance = np.where(reached, phi - of_source - rest[self._components], 0.0)
        self._is_free = reached & (distance > 0)
        np.maximum(distance, 0.0, out=distance)
        self._bounded: list[tuple[IntArray, IntArray, IntArray, float]] = []
        if parts.t_damping is not None:
            self._bound(distance)
        distance[term.near.vertex] = term.near.value
        self._is_free[term.near.vertex] = False
        self.distance = distance

    def _levels_of_sources(self, excess: FloatArray) -> FloatArray | None:
        """Heat (n,) weighted by the level of the source that it comes from; None with one source."""
        term = self._term
        count = np.bincount(term.anchors.label, minlength=term.sources.n_labels)
        if np.count_nonzero(count) < 2:
            return None
        level = np.bincount(term.anchors.label, excess, len(count)) / np.maximum(count, 1)
        heat = right_hand_side(len(self._u), [term], [term.share * level[term.label]])
        return np.asarray(self._parts.heat_flow.solve(heat)[:, 0])

    def _bound(self, distance: FloatArray) -> None:
        """Change distances by no more than the lengths of edges from the known ones; remember where that decides."""
        near = self._term.near
        spokes = _spokes(self._triangulations[0], near.vertex)
        for sign in (-1.0, 1.0):
            bound = sign * near.value[spokes.which] + spokes.length
            order = np.argsort(-bound, kind="stable")
            best = np.full(len(distance), -1)
            best[spokes.end[order]] = order
            ends = np.flatnonzero(best >= 0)
            chosen = best[ends]
            limit = sign * bound[chosen]
            beyond = sign * (distance[ends] - limit) > 0
            distance[ends[beyond]] = limit[beyond]
            self._is_free[ends[beyond]] = False
            self._bounded = [(e[k], s[k], w[k], g) for e, s, w, g in self._bounded for k in [~np.isin(e, ends[beyond])]]
            self._bounded.append((ends[beyond], spokes.side[chosen[beyond]], spokes.which[chosen[beyond]], sign))

    def pull_back(self, g: FloatArray) -> LevelSlopes:
        """The derivative of the sum of distances times g (n,)."""
        term, anchors = self._term, self._term.anchors
        sides = np.zeros(self._triangulations[0].l.size)
        by_value = g[term.near.vertex].copy()
        is_near = np.zeros(len(g), bool)
        is_near[term.near.vertex] = True
        for ends, side, which, sign in self._bounded:
            of_end = np.where(is_near[ends], 0.0, g[ends])
            np.add.at(by_value, which, of_end)
            np.add.at(sides, side, sign * of_end)
        free = np.where(self._is_free, g, 0.0)
        component = self._components[anchors.vertex]
        share = -np.bincount(self._components, free, self._n_components)[component] / self._count[component]
        by_phi, by_excess = free.copy(), share
        by_heat, pair = np.zeros(len(g)), None
        if self._weighted is not None:
            by_source = -free
            np.add.at(by_source, anchors.vertex, -share)
            with np.errstate(over="ignore"):
                adjoint = self._parts.heat_flow.solve(by_source / self._u)
            by_heat = -by_source * (self._weighted / self._u) / self._u
            pair = adjoint, self._weighted
            heat = right_hand_side(len(g), [term])[:, 0]
            by_level = np.bincount(term.label, adjoint[term.vertex] * heat[term.vertex], term.sources.n_labels)
            count = np.maximum(np.bincount(anchors.label, minlength=term.sources.n_labels), 1)
            by_excess = share + (by_level / count)[anchors.label]
        np.add.at(by_phi, anchors.vertex, by_excess)
        place = np.full(len(g), -1)
        place[term.near.vertex] = np.arange(len(term.near.vertex))
        np.add.at(by_value, place[anchors.vertex], -by_excess)
        # The edges whose lengths the known distances are.
        (on_triangles, place), (on_faces, place_before) = self._sides_of_values
        np.add.at(sides, on_triangles, by_value[place])
        by_given = None
        if len(on_faces):
            by_given = np.zeros(self._triangulations[1].l.shape)
            np.add.at(by_given.ravel(), on_faces, by_value[place_before])
        return LevelSlopes(by_phi, by_heat, pair, sides.reshape(-1, 3), by_given)

    @cached_property
    def _sides_of_values(self) -> list[tuple[IntArray, IntArray]]:
        """In either triangulation, sides from sources whose lengths are known distances, and which of these."""
        near, sources = self._term.near, self._term.sources
        n = len(self._u)
        value = np.full(n, np.nan)
        value[near.vertex] = near.value
        value[sources.vertices] = np.nan
        place = np.full(n, -1)
        place[near.vertex] = np.arange(len(near.vertex))
        found: BoolArray = np.zeros(len(near.vertex), bool)
        result = []
        for triangulation in self._triangulations:
            spokes = _spokes(triangulation, sources.vertices)
            is_it = np.abs(spokes.length - value[spokes.end]) <= 1e-12 * spokes.length
            at, first = np.unique(place[spokes.end[is_it]], return_index=True)
            new = ~found[at]
            result.append((spokes.side[is_it][first[new]], at[new]))
            found[at] = True
        return result


def _spokes(triangulation: IntrinsicTriangulation, vertices: IntArray) -> _Spokes:
    """All sides with one end among some vertices, an edge once for each of its sides and such ends."""
    place = np.full(triangulation.n, -1)
    place[vertices] = np.arange(len(vertices))
    of_corner = place[triangulation.F.ravel()]
    corner = np.flatnonzero(of_corner >= 0)
    following, preceding = next_half_edge(corner), previous_half_edge(corner)
    # The side opposite the next corner joins this one and the previous.
    side, across = np.concatenate([following, preceding]), np.concatenate([preceding, following])
    which = np.tile(of_corner[corner], 2)
    return _Spokes(side, which, triangulation.F.ravel()[across], triangulation.l.ravel()[side])
