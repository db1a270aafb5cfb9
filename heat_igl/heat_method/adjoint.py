"""The adjoint of the heat method: from a gradient by the distances to that by the sides of the triangles solved on.

The steps of the method backwards: levels, Poisson problem, normalized field, heat flow, time step. The two systems are
symmetric, so their adjoints are two more solves with the same factors; all else is local to a face or an edge.
"""

from __future__ import annotations

import numpy as np

from heat_igl.heat_method.integration import Integration
from heat_igl.heat_method.levels import PinnedLevels
from heat_igl.heat_method.parts import SolverParts
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels import heat_adjoint as kernels
from heat_igl.sources import SourceSet, right_hand_side
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
        #: The logarithm of the heat, of which the normalized field is made, or the heat.
        self._v = np.log(self._u, out=np.zeros_like(self._u), where=self._u > 0) if parts.fitted else self._u
        phi = last_steps.poisson.solve(last_steps.divergence([term], heat))[:, 0]
        self._phi = np.ascontiguousarray(phi)
        self._levels = PinnedLevels(parts, term, phi, self._u)

    def lengths(self) -> FloatArray:
        """The distances (n,) that are differentiated."""
        return self._levels.distance[: self._domain.n_given]

    def pull_back(self, g: FloatArray) -> Change:
        """The derivative of the sum of distances times g (n,)."""
        e, parts, components = self._elements, self._parts, self._domain.components
        by_t = np.zeros(self._domain.n_components)
        levels = self._levels.pull_back(g)
        # L is symmetric. Rounding aside, each component's sum is 0, as a right-hand side of L needs.
        p = self._poisson.solve(levels.by_phi)
        by_weight, by_area, by_heat = self._fields(p, by_t)
        pairs = [(parts.heat_flow.solve(levels.by_heat + by_heat), self._u)]
        if levels.pair is not None:
            pairs.append(levels.pair)
        x, u = np.stack([x for x, _ in pairs]), np.stack([u / parts.heat_flow.mean_mass for _, u in pairs])
        by_mass, by_side = -np.einsum("kn,kn->n", x, u), levels.by_side
        slopes, F = parts.flow_slopes, self.triangulation.F
        kernels.elements(
            F, e.l, e.weight, e.area, e.share, x, u, slopes, components, by_weight, by_area, by_mass, by_side, by_t
        )
        if parts.options.t is None:
            # t = t_coef h^2, with h the mean edge length of the component.
            by_h = np.where(parts.step_raised, 0.0, 2 * parts.time_steps / self._domain.mean_edge_lengths * by_t)
            if by_h.any():
                # In the memory of an array that is read no more.
                by_side += np.multiply(
                    self._domain.expand_to_faces(by_h)[:, None], parts.mean_length_slopes, out=by_weight
                )
        return Change(by_side, None, levels.by_given, float(by_t.sum()))

    def push_forward(self, by_side: FloatArray) -> FloatArray:  # noqa: ARG002
        """Refused: the heat method's derivative is there in one direction only."""
        raise ValueError(
            "directional derivatives are there for distances by paths: take refine='unfold' or 'exact', or multiply "
            "with the gradient"
        )

    def _fields(self, p: FloatArray, by_t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The derivative of p . (b - L phi), with b the divergence of the normalized field; that by t is added.

        On each face b is s K v, with K the cotangent matrix of the face, v the logarithm of the heat (or the heat) and
        s = 1 / |grad v|, at most one over the full rate; and |grad v|^2 is v . K v over the area.

        Returns
        -------
        by_weight, by_area, by_heat : (m, 3), (m,), (n,) float64
            By the weights and areas of the triangles, and by the heat.
        """
        e, parts, u, components = self._elements, self._parts, self._u, self._domain.components
        by_weight, by_area, by_v, by_log_t = np.empty_like(e.l), np.empty_like(e.area), np.zeros_like(u), 0 * by_t
        p, full_rate, F = np.ascontiguousarray(p), parts.full_rate, self.triangulation.F
        kernels.normalized(
            F, e.weight, e.area, self._v, self._phi, p, full_rate, components, by_weight, by_area, by_log_t, by_v
        )
        # The full rate is a multiple of t^(-1/2).
        by_t += by_log_t / parts.time_steps
        return by_weight, by_area, np.divide(by_v, u, out=np.zeros_like(u), where=u > 0) if parts.fitted else by_v


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
