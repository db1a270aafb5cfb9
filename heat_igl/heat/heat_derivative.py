"""The derivative of the heat method by the sides of the triangles that are solved on, in both directions.

Backwards the steps run in the opposite order: levels, Poisson problem, normalized field, heat flow, time step. The
matrices are symmetric, so either direction is two more solves with the same factors; all else is local to a face or an
edge.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.heat.field_derivative import FieldDerivative
from heat_igl.heat.integration import imposed_faces
from heat_igl.heat.known_values import KnownValues
from heat_igl.heat.levels import FlowChange, LevelSlopes, PinnedLevels
from heat_igl.heat.parts import SolverParts
from heat_igl.heat.several_sources import drop_overtaken
from heat_igl.heat.source_terms import right_hand_side
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels.heat import heat_adjoint as kernels
from heat_igl.kernels.heat import heat_tangent as tangent
from heat_igl.operators import ElementChange
from heat_igl.sources import SourceSet
from heat_igl.steps import FlowDerivative, MatrixSlopes
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows import Change, SideChange

__all__ = ["HeatDerivative"]

_REMEDY = ": take a GeodesicSolver, which differentiates paths"


class HeatDerivative:
    """The derivative of one answer of the heat method.

    Parameters
    ----------
    parts : SolverParts
        Of the solver.
    sources : SourceSet
        Vertices and points in faces.

    Raises
    ------
    ValueError
        For the iterative backend, points on a surface with edges of more than two faces, and heat that is damped
        without being fitted.

    Notes
    -----
    The derivative is that of the numbers that the solver returns: of the fitted weights, of the damping, of the time
    step t = t_coef h^2 with h the mean edge length (fixed if `t` was given), and of the lines around the sources. A
    time step that was raised for the heat to cross the mesh counts as fixed.
    """

    def __init__(self, parts: SolverParts, sources: SourceSet) -> None:
        domain, surface, last_steps = parts.operators, parts.operators.surface, parts.last_steps
        if surface is None:
            raise ValueError("the heat method is differentiated on triangles")
        self.triangulation: IntrinsicTriangulation = surface.triangulation
        _check(parts, sources, self.triangulation)
        self._poisson, self._parts, self._domain = last_steps.poisson, parts, domain
        self._elements = parts.slopes.elements
        self._term = term = drop_overtaken(parts.assembler.term(sources), parts.heat_flow, domain.n)
        self._flow = FlowDerivative(parts.heat_flow, domain, right_hand_side(domain.n, [term])[:, 0])
        heat = self._flow.u[:, None]
        phi = np.ascontiguousarray(last_steps.poisson.solve(last_steps.divergence([term], heat))[:, 0])
        self._values = KnownValues(surface, parts.assembler, term)
        self._levels = PinnedLevels(parts, term, self._values, phi, self._flow.u)
        self._field = FieldDerivative(
            parts, surface, self._flow.u, phi, imposed_faces(domain, term), self._at_vertices(self._values.value)
        )

    def lengths(self) -> FloatArray:
        """The distances (n,) that are differentiated."""
        distance = self._levels.distance.copy()
        n_near = len(self._term.near.vertex)
        distance[self._values.vertex[:n_near]] = self._values.lengths()[:n_near]
        return distance[: self._domain.n_given]

    def pull_back(self, g: FloatArray) -> Change:
        """The derivative of the sum of distances times g (n,)."""
        parts, term = self._parts, self._term
        levels = self._levels.pull_back(g)
        # L is symmetric. Rounding aside, each component's sum is 0, as a right-hand side of L needs.
        field = self._field.pull_back(self._poisson.solve(levels.by_phi))
        by_vertex, by_matrix = self._flow.pull_back(levels.by_heat + field.by_heat)
        by_initial = by_vertex[term.vertex] + levels.by_part[term.vertex] * levels.relative[term.label]
        if levels.by_matrix is not None:
            by_matrix = by_matrix.joined(levels.by_matrix)
        n_near = len(term.near.vertex)
        by_value = levels.by_value.copy()
        by_value[:n_near] += field.by_known[self._values.vertex[:n_near]]
        by_side, by_t = levels.by_side, field.by_t
        given = self._values.pull_back(by_value, by_side)
        self._add_elements(by_matrix, field.by_weight, field.by_area, by_side, by_t)
        # An initial heat falls by exp(-delay), and a delay is an offset over sqrt(t).
        delayed = by_initial * term.heat_of(term.share) * term.delay
        component = self._domain.components[term.vertex]
        by_t += np.bincount(component, delayed, len(by_t)) / (2 * parts.time_steps)
        by_h = by_t * self._steps_by_h
        if by_h.any():
            # In the memory of an array that is read no more.
            by_side += np.multiply(
                self._domain.expand_to_faces(by_h)[:, None], parts.slopes.mean_length, out=field.by_weight
            )
        by_place = self._by_place(by_vertex, levels)
        return Change(by_side, by_place, given.by_side, float(by_t.sum()), given.by_place)

    def push_forward(self, change: SideChange) -> FloatArray:
        """How the distances (n,) change with the sides and the places of points, after and before any flip."""
        parts, domain, by_side = self._parts, self._domain, change.by_side
        if change.by_given is None:
            raise ValueError("known distances change with the sides of the faces before any flip")
        elements = self._elements.push_forward(by_side)
        of_face = domain.components[self.triangulation.F[:, 0]]
        of_h = np.bincount(of_face, (parts.slopes.mean_length * by_side).sum(axis=1), domain.n_components)
        by_t = self._steps_by_h * of_h
        flow = self._flow_change(elements, change, by_t)
        initial = np.asarray(np.bincount(flow.vertex, flow.initial, domain.n), np.float64)
        by_heat = self._flow.push_forward(initial, flow.product, flow.diagonal)
        by_value = self._values.push_forward(by_side, SideChange(change.by_given, change.by_given_place))
        by_phi = self._poisson.solve(self._field.push_forward(elements, by_heat, self._at_vertices(by_value), by_t))
        return self._levels.push_forward(by_phi, by_heat, by_value, by_side, flow)[: domain.n_given]

    def _add_elements(
        self, matrix: MatrixSlopes, by_weight: FloatArray, by_area: FloatArray, by_side: FloatArray, by_t: FloatArray
    ) -> None:
        """Add the derivative by the sides (m, 3) and the time steps, from those by the elements and the heat flow."""
        e = self._elements
        by_mass = matrix.diagonal - np.einsum("kn,kn->n", matrix.x, matrix.u)
        pairs = [column for pair in zip(matrix.x, matrix.u, strict=True) for column in pair]
        of_vertex = np.stack([matrix.diagonal, by_mass, *pairs], axis=1)
        kernels.elements(
            self.triangulation.F, e.l, e.weight, e.area, e.share, of_vertex, self._parts.slopes.flow,
            self._domain.components, by_weight, by_area, by_side, by_t,
        )  # fmt: skip

    def _flow_change(self, elements: ElementChange, change: SideChange, by_t: FloatArray) -> FlowChange:
        """How the matrix of the heat flow and the initial heat change."""
        e, n, term, parts = self._elements, self._domain.n, self._term, self._parts
        of_weight, of_length, of_t = parts.slopes.flow
        entry = of_weight * elements.weight + of_length * change.by_side
        entry += of_t * self._domain.expand_to_faces(by_t)[:, None]
        F = self.triangulation.F

        def product(v: FloatArray) -> FloatArray:
            result = elements.mass * v
            tangent.multiply(F, entry, v, result)
            return np.asarray(result)

        diagonal = elements.mass
        if parts.heat_flow.boundary != "neumann":
            ends = np.concatenate([e.i.ravel(), e.j.ravel()])
            diagonal = diagonal + np.bincount(ends, np.tile(entry.ravel(), 2), n)
        of_component = self._domain.components[term.vertex]
        vertex, label = term.vertex, term.label
        initial = term.heat_of(term.share) * term.delay * (by_t / (2 * parts.time_steps))[of_component]
        if change.by_place is not None:
            corners, heat = self._points
            vertex, label = np.append(vertex, corners), np.append(label, np.repeat(term.sources.points.label, 3))
            initial = np.append(initial, heat[:, None] * change.by_place)
        return FlowChange(vertex, label, initial, product, diagonal)

    @cached_property
    def _points(self) -> tuple[IntArray, FloatArray]:
        """The vertices (p, 3) that source points put heat on, and the heat (p,) of each."""
        points, term = self._term.sources.points, self._term
        of_label = np.zeros(term.sources.n_labels)
        of_label[term.label] = term.heat_of(np.ones(len(term.label)))
        faces, _ = self.triangulation.locate(points.faces, points.barycentric)
        return self.triangulation.F[faces], of_label[points.label]

    def _by_place(self, by_vertex: FloatArray, levels: LevelSlopes) -> FloatArray | None:
        """The derivative (p, 3) by the coordinates of source points in the triangles that are solved on."""
        points = self._term.sources.points
        if not len(points.faces):
            return None
        corners, heat = self._points
        by_heat = by_vertex[corners] + levels.by_part[corners] * levels.relative[points.label, None]
        return np.asarray(heat[:, None] * by_heat)

    @property
    def _steps_by_h(self) -> FloatArray:
        """The derivative of the time step (n_components,) of each component by the mean edge length h."""
        parts = self._parts
        if parts.options.t is not None:
            return np.zeros(self._domain.n_components)
        # t = t_coef h^2.
        return np.where(parts.step_raised, 0.0, 2 * parts.time_steps / self._domain.mean_edge_lengths)

    def _at_vertices(self, by_value: FloatArray) -> FloatArray:
        """The values (n,) at all vertices, from those known beside the sources; 0 elsewhere."""
        n_near = len(self._term.near.vertex)
        result = np.zeros(self._domain.n)
        result[self._term.near.vertex] = by_value[:n_near]
        return result


def _check(parts: SolverParts, sources: SourceSet, triangulation: IntrinsicTriangulation) -> None:
    """Raise a ValueError for what has no derivative here."""
    if len(sources.points.faces) and triangulation.is_cover:
        raise ValueError(
            "the heat method is differentiated from points where no edge has more than two faces, and here the "
            f"triangles are a cover of the surface{_REMEDY}"
        )
    if parts.heat_flow.backend == "iterative":
        raise ValueError(
            f"backend='iterative' cannot solve the adjoint system: take 'multifrontal' or 'scipy'{_REMEDY}"
        )
    if parts.t_damping is not None and not parts.fitted:
        raise ValueError(f"magnitude='damped' is differentiated where heat is fitted to the lengths of edges{_REMEDY}")
