"""From heat to distance: the field of step 2, the Poisson problem of step 3, and the level at which distance begins."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.heat.source_terms import Seeds, SourceTerm, right_hand_side, take_shorter
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.operators import Operators
from heat_igl.runtime import LOWEST_HEAT, warn_caller
from heat_igl.steps import HeatFlow, NormalizedDivergence, PoissonProblem, damping, normalize
from heat_igl.typing import FloatArray, IntArray

# A known distance that is longer than the integrated distance by more than this share of it comes from a source that is
# not the nearest: integrated distance is wrong by less, by 1 to 4 % in the mean. It decides on the far corners of faces
# much larger than the mean alone; from 0 to 1, errors on the cow, the fandisk and the camel's head are the same.
_HEAT_ERROR = 0.2


def damped_field(
    domain: Operators, terms: list[SourceTerm], u: FloatArray, t: float | FloatArray | None, fitted: bool
) -> tuple[FloatArray, FloatArray]:
    """The field of step 2: directions X (d m, k) and their magnitude (m, k), for heat (n, k) from k terms.

    The magnitude is that of `damping` at the time step `t`, or 1 if t is None. Near points and curves, the field is
    the gradient of the known distances.
    """
    X = normalize(domain, u, fitted)
    magnitude = np.ones((len(domain.weights), u.shape[1]))
    if t is not None:
        magnitude = damping(domain, u, t, fitted=fitted)
    for column, term in enumerate(terms):
        _impose_near_field(domain, term, X[:, column], magnitude[:, column])
    return X, magnitude


def _imposed_faces(domain: Operators, term: SourceTerm) -> IntArray:
    """The faces (k,) near points and curves on which the field is the gradient of the known distances."""
    if not term.seen.any():
        return np.empty(0, np.int64)
    known = np.zeros(domain.n, np.int8)
    known[term.near.vertex] = 1
    known[term.near.vertex[term.seen]] = 2
    if domain.surface is None:
        # Of polygons, those of which all corners are known: G has them in each triangle of the polygon.
        of_face = abs(domain.G.tocsr())
        unknown, seen = (of_face @ (known == kind) for kind in (0, 2))
        unknown, seen = (rows.reshape(domain.dimension, -1).sum(axis=0) for rows in (unknown, seen))
        return np.flatnonzero((unknown == 0) & (seen > 0))
    corners = known[domain.surface.triangulation.F]
    return np.flatnonzero((corners > 0).all(axis=1) & (corners == 2).any(axis=1))


def _impose_near_field(domain: Operators, term: SourceTerm, X: FloatArray, magnitude: FloatArray) -> None:
    """Near points and curves, replace the field X (d m,) of length `magnitude` (m,) by the exact gradient."""
    faces, m = _imposed_faces(domain, term), len(magnitude)
    if not len(faces):
        return
    gradient = (domain.G[:, term.near.vertex] @ term.near.value).reshape(-1, m)[:, faces]
    length = np.linalg.norm(gradient, axis=0)
    X.reshape(-1, m)[:, faces] = gradient / np.where(length > 0, length, 1)
    magnitude[faces] = length


class Integration:
    """Steps 2 and 3 on one domain, for heat from any sources.

    Parameters
    ----------
    domain : Operators
        The domain.
    heat_flow : HeatFlow
        Step 1 on it.
    divergence : NormalizedDivergence
        Step 2 on it, for the field without known distances near the sources.
    poisson : PoissonProblem
        Step 3 on it.
    t : float or (n_components,) float64, optional
        Time step for `damping`; the field has length 1 if it is None, and if sources are vertices, no distance but
        theirs is known beforehand, as in the paper.
    fitted : bool
        Whether the heat flow is fitted to the lengths of edges.
    triangulation : IntrinsicTriangulation, optional
        The triangles that are solved on.
    """

    def __init__(
        self,
        domain: Operators,
        heat_flow: HeatFlow,
        divergence: NormalizedDivergence,
        poisson: PoissonProblem,
        t: float | FloatArray | None,
        fitted: bool,
        triangulation: IntrinsicTriangulation | None,
    ) -> None:
        self._domain, self._heat_flow, self.poisson = domain, heat_flow, poisson
        self._normalized_divergence = divergence
        self._t, self._fitted, self._triangulation = t, fitted, triangulation

    def divergence(self, terms: list[SourceTerm], u: FloatArray) -> FloatArray:
        """The integrated divergence (n, k) of the normalized field, for heat (n, k) from k terms."""
        if not any(term.seen.any() for term in terms):
            return self._normalized_divergence.divergence(u)
        domain = self._domain
        X, magnitude = damped_field(domain, terms, u, self._t, self._fitted)
        return np.asarray(domain.D @ (X * np.tile(magnitude, (domain.dimension, 1))))

    def pin_levels(self, terms: list[SourceTerm], phi: FloatArray, u: FloatArray) -> FloatArray:
        """Distances (k, n) from the integrated phi (n, k), known up to constants, and the heat u (n, k).

        Warns
        -----
        AccuracyWarning
            If heat underflowed on the way, so that distances beyond are too short.
        """
        if u.min() < LOWEST_HEAT:
            for term, of_term in zip(terms, u.T, strict=True):
                self._warn_if_cold(term, of_term)
        rows = zip(terms, np.ascontiguousarray(phi.T), u.T, strict=True)
        return np.stack([self._pin_level(*row) for row in rows])

    def _pin_level(self, term: SourceTerm, phi: FloatArray, u: FloatArray) -> FloatArray:
        """Distance (n,) from phi (n,) and heat (n,): at the right level, and equal to known distances.

        The level of a component is the mean by which phi exceeds the known distances there. A component without a
        source gets ``inf``.
        """
        domain, components, anchors = self._domain, self._domain.components, term.anchors
        excess = phi[anchors.vertex] - anchors.value
        n_anchors = np.bincount(components[anchors.vertex], minlength=domain.n_components)
        if (n_anchors > 1).any():
            of_source = self._level_of_source(term, excess, u)
            phi = phi - of_source
            excess = excess - of_source[anchors.vertex]
        total = np.bincount(components[anchors.vertex], weights=excess, minlength=len(n_anchors))
        level = np.where(n_anchors > 0, total / np.maximum(n_anchors, 1), -np.inf)
        lowest = np.full(len(n_anchors), np.inf)
        np.minimum.at(lowest, components[term.near.vertex], term.near.value)
        start = domain.expand_to_vertices(lowest)
        distance = phi - domain.expand_to_vertices(level)
        np.maximum(distance, start, out=distance)
        take_shorter(distance, term.far, _HEAT_ERROR, start)
        if self._t is not None or not term.sources.on_vertices_alone:
            self._bound_by_edges(term.near, distance)
        distance[term.near.vertex] = term.near.value
        return np.asarray(distance)

    def _level_of_source(self, term: SourceTerm, excess: FloatArray, u: FloatArray) -> FloatArray:
        """The value (n,) that phi has at the source from which a vertex got heat, less that source's offset.

        It is a little different at each source: the error of a path between them. Shifting by the mean would move
        the whole cell of each source by the difference. Here every vertex is shifted by the values of the sources
        weighted by the heat from each, one more solve; the weights change from 0 to 1 within sqrt(t) of the border
        between two cells.
        """
        n_labels = term.sources.n_labels
        count = np.bincount(term.anchors.label, minlength=n_labels)
        level = np.bincount(term.anchors.label, excess, minlength=n_labels) / np.maximum(count, 1)
        low, high = float(level[count > 0].min()), float(level[count > 0].max())
        if low == high:
            return np.full_like(u, low)
        relative = np.where(count > 0, (level - low) / (high - low), 0.0)
        weighted = right_hand_side(self._domain.n, [term], [term.share * relative[term.label]])
        part = self._heat_flow.solve(weighted)[:, 0]
        warm = u > 0  # always, but for noise under "cotan" and a cold boundary
        return low + (high - low) * np.clip(np.divide(part, u, out=np.zeros_like(u), where=warm), 0.0, 1.0)

    def _bound_by_edges(self, near: Seeds, distance: FloatArray) -> None:
        """Across an edge from a known value, distance changes by no more than the length of the edge."""
        if self._triangulation is None:
            return
        which, ends, lengths = self._triangulation.spokes(near.vertex)
        value = near.value[which]
        np.maximum.at(distance, ends, value - lengths)
        np.minimum.at(distance, ends, value + lengths)

    def _warn_if_cold(self, term: SourceTerm, u: FloatArray) -> None:
        """Heat that has underflowed has no gradient, and distance does not grow on faces with X = 0: warn."""
        domain = self._domain
        components = domain.components
        cold = (np.abs(u) < LOWEST_HEAT) & np.isin(components, components[term.near.vertex])
        cold[term.near.vertex] = False
        remedy = "raise t_coef"
        if self._heat_flow.boundary == "dirichlet":
            cold &= ~domain.boundary
            remedy += ", or let heat pass the boundary with boundary='average'"
        if cold.any():
            warn_caller(
                f"no heat arrives at {int(cold.sum())} of {domain.n} vertices, where distances are too short: {remedy}",
                AccuracyWarning,
            )
