"""The derivative of the right-hand side of step 3, less L phi: of the normalized field that the heat gives.

On a face the divergence is s K v, with K the cotangent matrix of the face, v the logarithm of the heat (or the heat)
and s = 1 / |grad v|, at most one over the full rate; and |grad v|^2 is v . K v over the area. Where the field is the
gradient of known distances, they take the place of v, and s = -1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.heat.parts import SolverParts
from heat_igl.kernels.heat import heat_adjoint as kernels
from heat_igl.kernels.heat import heat_tangent as tangent
from heat_igl.operators import ElementChange, Surface
from heat_igl.runtime import LOWEST_HEAT
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["FieldDerivative", "FieldSlopes"]


class FieldSlopes(NamedTuple):
    """The derivative of a number by what the right-hand side of step 3 is made of.

    Attributes
    ----------
    by_weight, by_area : (m, 3), (m,) float64
        By the weights and areas of the triangles.
    by_heat, by_known : (n,) float64
        By the heat, and by the known distances at the corners of the imposed faces.
    by_t : (n_components,) float64
        By the time step of each component.
    """

    by_weight: FloatArray
    by_area: FloatArray
    by_heat: FloatArray
    by_known: FloatArray
    by_t: FloatArray


class FieldDerivative:
    """The field of one answer, to be differentiated.

    Parameters
    ----------
    parts : SolverParts
        Of the solver.
    surface : Surface
        The triangles.
    u, phi : (n,) float64
        The heat, and the integrated phi.
    imposed : (k,) int64
        Faces on which the field is the gradient of known distances.
    known : (n,) float64
        Those distances; any number at other vertices.
    """

    def __init__(
        self,
        parts: SolverParts,
        surface: Surface,
        u: FloatArray,
        phi: FloatArray,
        imposed: IntArray,
        known: FloatArray,
    ) -> None:
        self._parts, self._elements, self._u, self._phi = parts, parts.slopes.elements, u, phi
        self._F = F = surface.triangulation.F
        self._imposed, self._known = imposed, known
        # Faces with a cold corner follow the gradient of the heat itself, and are not damped.
        is_log: BoolArray = np.zeros(len(F), bool)
        if parts.fitted:
            is_log |= (u[F] >= LOWEST_HEAT).all(axis=1)
        is_plain: BoolArray = ~is_log
        is_plain[imposed] = is_log[imposed] = False
        self._plain = np.flatnonzero(is_plain)
        #: The rate that the field is compared with; negative on faces of another kind.
        self._rate_of_log = np.where(is_log, parts.slopes.full_rate, -1.0)
        self._log_u = np.log(u, out=np.zeros_like(u), where=u > 0)

    def pull_back(self, p: FloatArray) -> FieldSlopes:
        """The derivative of p . (b - L phi), with b the divergence of the field."""
        e, F, domain = self._elements, self._F, self._parts.operators
        zeros = np.zeros_like(self._u)
        by_weight, by_area, by_log_t = np.empty_like(e.l), np.empty_like(e.area), np.zeros(domain.n_components)
        by_log, by_heat, by_known = zeros.copy(), zeros.copy(), zeros.copy()
        of_vertex = np.stack([self._log_u, p, self._phi], axis=1)
        kernels.normalized(
            F, e.weight, e.area, of_vertex, self._rate_of_log, domain.components, by_weight, by_area, by_log_t, by_log
        )
        if len(self._plain):
            k = self._plain
            of_weight, of_area = np.empty((len(k), 3)), np.empty(len(k))
            of_vertex, any_rate = np.stack([self._u, p, zeros], axis=1), np.zeros(len(k))
            kernels.normalized(
                F[k],
                e.weight[k],
                e.area[k],
                of_vertex,
                any_rate,
                domain.components,
                of_weight,
                of_area,
                by_log_t,
                by_heat,
            )
            by_weight[k] += of_weight
            by_area[k] += of_area
        by_heat += np.divide(by_log, self._u, out=zeros, where=self._u > 0)
        for c in range(3):
            k = self._imposed
            i, j = e.i[k, c], e.j[k, c]
            across = p[i] - p[j]
            by_weight[k, c] -= across * (self._known[i] - self._known[j])
            np.add.at(by_known, i, -across * e.weight[k, c])
            np.add.at(by_known, j, across * e.weight[k, c])
        # The full rate is a multiple of t^(-1/2).
        return FieldSlopes(by_weight, by_area, by_heat, by_known, by_log_t / self._parts.time_steps)

    def push_forward(
        self, elements: ElementChange, by_heat: FloatArray, by_known: FloatArray, by_t: FloatArray
    ) -> FloatArray:
        """How b - L phi (n,) changes with the elements, the heat (n,), the known values (n,) and the time steps."""
        e, F, domain = self._elements, self._F, self._parts.operators
        relative = np.divide(by_heat, self._u, out=np.zeros_like(by_heat), where=self._u > 0)
        log_t, change = by_t / self._parts.time_steps, np.zeros(domain.n)
        # -L phi, whose entries between the ends of sides are the weights.
        tangent.multiply(F, elements.weight, self._phi, change)
        tangent.normalized(
            F, e.weight, e.area, self._log_u, relative, self._rate_of_log, domain.components, log_t, elements.weight,
            elements.area, change,
        )  # fmt: skip
        k = self._plain
        tangent.normalized(
            F[k], e.weight[k], e.area[k], self._u, by_heat, np.zeros(len(k)), domain.components, log_t,
            elements.weight[k], elements.area[k], change,
        )  # fmt: skip
        k = self._imposed
        tangent.multiply(F[k], -elements.weight[k], self._known, change)
        tangent.multiply(F[k], -e.weight[k], by_known, change)
        return change
