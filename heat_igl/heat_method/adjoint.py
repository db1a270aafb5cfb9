"""The adjoint of the heat method: from a gradient by the distances to that by the sides of the triangles solved on.

The steps of the method backwards: levels, Poisson problem, normalized field, heat flow, time step. The two systems are
symmetric, so their adjoints are two more solves with the same factors; all else is local to a face or an edge.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from heat_igl.heat_method.integration import Integration
from heat_igl.heat_method.levels import PinnedLevels
from heat_igl.heat_method.parts import SolverParts
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels import heat_adjoint as kernels
from heat_igl.operators import ElementSlopes
from heat_igl.sources import SourceSet, right_hand_side
from heat_igl.steps.normalization import lowest_full_rate
from heat_igl.typing import FloatArray
from heat_igl.unfolding import Change

__all__ = ["HeatAdjoint"]

_REMEDY = ": take refine='unfold' or 'exact', which differentiate paths"


class HeatAdjoint:
    """The derivative of one answer of the heat method from source vertices.

    Parameters
    ----------
    parts : SolverParts
        Of the solver, without ``refine``.
    sources : SourceSet
        Vertices, all starting at 0.

    Raises
    ------
    ValueError
        For points and curves as sources, offsets, a boundary condition, the iterative backend, or added vertices.

    Notes
    -----
    The derivative is that of the numbers that the solver returns: of the fitted weights, of the damping, of the time
    step t = t_coef h^2 with h the mean edge length (fixed if `t` was given), and of the edges around the sources. A
    time step that was raised for the heat to cross the mesh counts as fixed.
    """

    def __init__(self, parts: SolverParts, sources: SourceSet) -> None:
        domain, surface, last_steps = parts.operators, parts.operators.surface, parts.last_steps
        _check(parts, sources)
        if surface is None or not isinstance(last_steps, Integration):
            raise ValueError("the adjoint is that of the heat method on triangles")
        self._poisson = last_steps.poisson
        self._parts, self._domain = parts, domain
        self.triangulation: IntrinsicTriangulation = surface.triangulation
        self._elements = parts.elements
        term = parts.assembler.term(sources)
        if term.seen.any():
            raise ValueError(
                "the heat method is not differentiated from a source next to an edge of more than two faces, where "
                f"distances are straight lines{_REMEDY}"
            )
        heat = parts.heat_flow.solve(right_hand_side(domain.n, [term]))
        self._u = np.ascontiguousarray(heat[:, 0])
        phi = last_steps.poisson.solve(last_steps.divergence([term], heat))[:, 0]
        self._phi = np.ascontiguousarray(phi)
        self._levels = PinnedLevels(parts, term, phi, self._u)

    def lengths(self) -> FloatArray:
        """The distances (n,) that are differentiated."""
        return self._levels.distance[: self._domain.n_given]

    def pull_back(self, g: FloatArray) -> Change:
        """The derivative of the sum of distances times g (n,)."""
        domain, slopes = self._domain, ElementSlopes(self._elements)
        by_t = np.zeros(domain.n_components)
        levels = self._levels.pull_back(g)
        # L is symmetric. Rounding aside, each component's sum is 0, as a right-hand side of L needs.
        p = self._poisson.solve(levels.by_phi)
        by_heat = levels.by_heat + self._fields(p, slopes, by_t)
        pairs = [(self._parts.heat_flow.solve(by_heat), self._u)]
        if levels.pair is not None:
            pairs.append(levels.pair)
        self._heat_flow(pairs, slopes, by_t)
        by_side = levels.by_side + slopes.total() + self._time_step(by_t)
        return Change(by_side, None, levels.by_given, float(by_t.sum()))

    def push_forward(self, by_side: FloatArray) -> FloatArray:  # noqa: ARG002
        """Refused: the heat method's derivative is there in one direction only."""
        raise ValueError(
            "directional derivatives are there for distances by paths: take refine='unfold' or 'exact', or multiply "
            "with the gradient"
        )

    def _fields(self, p: FloatArray, slopes: ElementSlopes, by_t: FloatArray) -> FloatArray:
        """The derivative (n,) by the heat of p . (b - L phi), with b the divergence of the normalized field.

        On each face b is s K v, with K the cotangent matrix of the face, v the logarithm of the heat (or the heat) and
        s = 1 / |grad v|, at most one over the full rate; and |grad v|^2 is v . K v over the area.
        """
        e, parts, u = self._elements, self._parts, self._u
        full_rate = np.zeros(len(e.area))
        if parts.t_damping is not None:
            full_rate = lowest_full_rate(self._domain, parts.t_damping, parts.fitted)
        v = np.log(u, out=np.zeros_like(u), where=u > 0) if parts.fitted else u
        by_step, by_v = np.zeros(len(e.area)), np.zeros(self._domain.n)
        kernels.normalized(
            self.triangulation.F,
            e.weight,
            e.area,
            np.ascontiguousarray(v),
            self._phi,
            np.ascontiguousarray(p),
            full_rate,
            slopes.by_weight,
            slopes.by_area,
            by_step,
            by_v,
        )
        # The full rate is a multiple of t^(-1/2).
        of_face = self._domain.components[self.triangulation.F[:, 0]]
        by_t += np.bincount(of_face, by_step, len(by_t)) / self._parts.time_steps
        return np.divide(by_v, u, out=np.zeros_like(u), where=u > 0) if parts.fitted else by_v

    def _heat_flow(
        self, pairs: Sequence[tuple[FloatArray, FloatArray]], slopes: ElementSlopes, by_t: FloatArray
    ) -> None:
        """Add - x . dA u for pairs of an adjoint x and a solution u, where A = M - t L."""
        flow, components = self._parts.heat_flow, self._domain.components
        F, t = self.triangulation.F, self._parts.time_steps
        of_face = components[F[:, 0]]
        unit = np.full(self._domain.n, flow.mean_mass)
        by_mass, by_weight = np.zeros(self._domain.n), np.zeros(F.shape)
        for x, u in pairs:
            by_mass -= x * (u / unit)
            kernels.heat_flow(F, np.ascontiguousarray(x), np.ascontiguousarray(u), unit, by_weight)
        slopes.by_mass += by_mass[F]
        if not self._parts.fitted:
            slopes.by_weight += t[of_face][:, None] * by_weight
            by_t += np.bincount(of_face, np.einsum("fc,fc->f", self._elements.weight, by_weight), len(by_t))
            return
        # L has one entry for all sides between the same two vertices: its weight is the sum of theirs, not below 0,
        # times the factor of the shortest.
        first = self._elements.pairs[1]
        weight, x, factor, slope, of_side = self._parts.fitted_weights
        of_pair = of_face[first // 3]
        by_fitted, t_of_pair = by_weight.ravel()[first], t[of_pair]
        slopes.by_weight += by_weight * of_side
        by_factor = t_of_pair * by_fitted * weight * slope
        slopes.by_side.ravel()[first] += by_factor / np.sqrt(t_of_pair)
        by_t += np.bincount(of_pair, by_fitted * weight * factor - by_factor * x / (2 * t_of_pair), len(by_t))

    def _time_step(self, by_t: FloatArray) -> FloatArray:
        """The derivative (m, 3) by the sides through t = t_coef h^2, h the mean edge length of each component."""
        options, domain, T = self._parts.options, self._domain, self.triangulation
        result = np.zeros(T.l.size)
        t = self._parts.time_steps
        if options.t is not None:
            return result.reshape(-1, 3)
        edges = self._elements.edges
        if domain.n_components == 1 and not np.isclose(T.l.ravel()[edges].mean(), domain.mean_edge_length, rtol=1e-12):
            # On the mesh's own faces an edge of more than two faces counts once.
            edges = self._elements.pairs[1]
        component = domain.components[T.F[edges // 3, 0]]
        h = domain.mean_edge_lengths
        by_h = np.where(self._parts.step_raised, 0.0, 2 * t / h * by_t)
        count = np.bincount(component, minlength=domain.n_components)
        result[edges] = (by_h / np.maximum(count, 1))[component]
        return result.reshape(-1, 3)


def _check(parts: SolverParts, sources: SourceSet) -> None:
    """Raise a ValueError for what has no derivative here."""
    if not sources.on_vertices_alone:
        raise ValueError(
            f"the heat method is differentiated for source vertices, and points are among the sources{_REMEDY}"
        )
    if sources.offsets.any():
        raise ValueError(
            f"the heat method is differentiated for sources that start at 0, and some have offsets{_REMEDY}"
        )
    if parts.heat_flow.boundary != "neumann":
        raise ValueError(
            f"the heat method is differentiated for boundary='neumann', not {parts.heat_flow.boundary!r}{_REMEDY}"
        )
    if parts.heat_flow.backend == "iterative":
        raise ValueError(
            f"backend='iterative' cannot solve the adjoint system: take 'multifrontal' or 'scipy'{_REMEDY}"
        )
    if parts.t_damping is not None and not parts.fitted:
        raise ValueError(f"magnitude='damped' is differentiated where heat is fitted to the lengths of edges{_REMEDY}")
