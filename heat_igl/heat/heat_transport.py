"""Values and tangent vectors carried by diffusion: the three algorithms of the vector heat method.

Sharp, Soliman and Crane (2019): a short time step of the heat equation for vectors transports them along the shortest
geodesics, up to their lengths, which two scalar heat flows give.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning, MeshError
from heat_igl.heat.outward_field import OutwardField
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, warn_caller
from heat_igl.steps import VectorHeatFlow
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["HeatTransport"]

# Vectors shorter than this share of the longest at a neighbour are rounding: those that arrive cancel.
_CANCELLED = 1e-10
# The time step of vectors in that of heat, for t = h^2. At h^2 / 2, transport on spheres is wrong by 1.5 to 2 times as
# much; vectors are farther from their shortest paths with longer steps.
_VECTOR_STEP = 2.0


class HeatTransport:
    """Extension, transport and the logarithmic map by heat flows, factored when made.

    Parameters
    ----------
    solver : HeatMethodSolver
        The distance, the flow of scalar heat, and the time step.
    rotations : (n, n) csc_matrix of complex128
        The connection, see `VectorHeatSolver.from_operators`.
    mass : (n,) float64, optional
        Mass of each vertex for the flow of vectors; the default is that of the operators.
    outward : OutwardField, optional
        Needed for `log_map`.
    """

    def __init__(
        self,
        solver: HeatMethodSolver,
        rotations: sp.csc_matrix,
        mass: FloatArray | None = None,
        outward: OutwardField | None = None,
    ) -> None:
        parts = solver._parts
        t = parts.diagnostics.t * (_VECTOR_STEP if parts.options.default_time_step else 1.0)
        self._solver, self._outward, self._heat_flow = solver, outward, parts.heat_flow
        self._vector_flow = VectorHeatFlow(solver.operators, rotations, t, parts.options.backend, mass=mass)
        self._pattern = abs(rotations).tocsr()

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """Values (k,) at `vertices` (k,), extended to all (n,): the ratio u / phi of two heat flows (equation 5)."""
        largest = float(np.abs(values).max())
        n = self._solver.operators.n
        b = np.zeros((n, 2))
        np.add.at(b[:, 0], vertices, values / largest if largest > 0 else values)
        np.add.at(b[:, 1], vertices, 1.0)
        unit = SOURCE_HEAT / b[:, 1].max()
        u, phi = self._heat_flow.solve(b * unit).T
        warm = phi > LOWEST_HEAT
        components = self._solver.operators.components
        cold = np.isin(components, components[vertices]) & ~warm
        if cold.any():
            warn_caller(
                f"heat does not reach {int(cold.sum())} vertices in double precision, vertex {int(np.argmax(cold))} "
                "first: they get 0; raise t",
                AccuracyWarning,
            )
        ratio = np.divide(u, phi, out=np.zeros_like(u), where=warm) * largest
        # A mean of the values: what is beyond them is rounding.
        return np.where(warm, np.clip(ratio, values.min(), values.max()), 0.0)

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Vectors (k, 2) at `vertices` (k,), transported to all: complex numbers (n,) (Algorithm 1)."""
        lengths = self.extend(vertices, np.hypot(*vectors.T))
        return self._directions(vertices, vectors @ [1, 1j]) * lengths

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) from `vertex`, by the angle between the radial field and a transported axis.

        Raises
        ------
        MeshError
            Without the triangles around the source.
        """
        if self._outward is None:
            raise MeshError("the log map needs the triangles around the source, which this domain does not have")
        at, outward = self._outward.dipole(vertex)
        b = np.zeros((self._solver.operators.n, 2), complex)
        largest = np.abs(outward).max(initial=0.0)
        np.add.at(b[:, 0], at, SOURCE_HEAT * (outward / largest if largest > 0 else outward))
        b[vertex, 1] = SOURCE_HEAT
        radial, axis = (_unit(Y) for Y in self._vector_flow.solve(b).T)
        direction = self._outward.to_polar(vertex, _unit(radial * axis.conj()))
        neighbour, exact = self._outward.ring(vertex)
        direction[neighbour] = np.exp(1j * exact)
        distance = self._solver.distance(vertex)
        length = np.where(np.isfinite(distance), distance, 0.0)
        return np.stack([length * direction.real, length * direction.imag], axis=1)

    def _directions(self, vertices: IntArray, vectors: AnyArray) -> AnyArray:
        """Unit numbers (n,), the directions of vectors that flow from the sources, or 0."""
        b = np.zeros(self._solver.operators.n, complex)
        largest = float(np.abs(vectors).max())
        np.add.at(b, vertices, vectors / largest if largest > 0 else vectors)
        most = np.bincount(vertices).max()
        Y = self._vector_flow.solve(b * (SOURCE_HEAT / most))
        size = np.abs(Y)
        # The diagonal is in every row, so that none is empty.
        nearby = np.maximum.reduceat(size[self._pattern.indices], self._pattern.indptr[:-1])
        return _unit(np.where(size > _CANCELLED * nearby, Y, 0.0))


def _unit(Y: AnyArray) -> AnyArray:
    """Complex numbers divided by their size; 0 where that is too small for a direction."""
    size = np.abs(Y)
    return np.divide(Y, size, out=np.zeros_like(Y), where=size > LOWEST_HEAT)
