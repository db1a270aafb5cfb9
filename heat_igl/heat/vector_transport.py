"""Values and tangent vectors carried from sources to all vertices: by diffusion, along shortest paths, on two sides.

Sharp, Soliman and Crane (2019): a short time step of the heat equation for vectors transports them along the shortest
geodesics, up to their lengths, which two scalar heat flows give.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning, MeshError
from heat_igl.heat.directions import axis_of_second_side, carried
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.intrinsic import PolarAngles, TangentFrames, carried_angles, polar_angles, transport_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.operators import Surface
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, warn_caller
from heat_igl.sources import source_set
from heat_igl.steps import VectorHeatFlow
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows import PathAngles, WindowEngine

# Vectors shorter than this share of the longest at a neighbour are rounding: those that arrive cancel.
_CANCELLED = 1e-10
# The time step of vectors in that of heat, for t = h^2. At h^2 / 2, transport on spheres is wrong by 1.5 to 2 times as
# much; vectors are farther from their shortest paths with longer steps.
_VECTOR_STEP = 2.0


class HeatTransport:
    """Extension, transport and the logarithmic map by heat flows, factored when made.

    `rotations` are the connection, see `VectorHeatSolver.from_operators`, and `mass` (n,) is that of each vertex for
    the flow of vectors, by default that of the operators. `outward` is needed for `log_map`.
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
        """Vectors (n, 2) from `vertex`, by the angle between the radial field and a transported axis."""
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


class OutwardField:
    """Radial fields around the vertices of an oriented manifold of triangles, whose faces are known."""

    def __init__(self, surface: Surface) -> None:
        if surface.faces is None:
            raise ValueError("a radial field needs the faces of the mesh, which this domain does not have")
        self._triangulation = surface.triangulation
        self._angles = carried_angles(polar_angles(surface.faces), surface.triangulation)
        self._turn = transport_angles(self._triangulation, self._angles)

    def ring(self, vertex: int) -> tuple[IntArray, FloatArray]:
        """The neighbours (k,) that one edge alone joins with a vertex, and the directions (k,) of these edges there."""
        tri = self._triangulation
        corner, _ = tri.corners_at(np.array([vertex]))
        out = previous_half_edge(corner)
        last = next_half_edge(corner)
        last = last[tri.twin[last] < 0]
        ends = np.append(tri.head(out), tri.tail(last))
        directions = np.append(self._angles.outgoing[out], np.full(len(last), np.pi))
        found, first, counts = np.unique(ends, return_index=True, return_counts=True)
        once = (counts == 1) & (found != vertex)
        return found[once], directions[first[once]]

    def to_polar(self, vertex: int, directions: AnyArray) -> AnyArray:
        """Unit numbers (n,) with the polar angles of directions at a vertex, given as transport has them; 0 stays."""
        if not self._angles.on_boundary[vertex]:
            return directions
        angle = self._angles.to_polar(np.full(len(directions), vertex), np.angle(directions))
        return np.asarray(np.abs(directions) * np.exp(1j * angle))

    def dipole(self, vertex: int) -> tuple[IntArray, AnyArray]:
        """Vectors whose heat flow points away from a vertex, on the corners (3 k,) of the k triangles around it.

        They sum to 0, and the sum of their products with the positions in the tangent plane of the vertex is a multiple
        of the identity: vectors b_j in positions x_j give the sum of b_j G(x_j) = grad G for a linear function G. Taken
        for G the heat that a vertex far away sends, which rises in the direction in which the shortest geodesic to that
        vertex departs. The b_j are the gradients of the hat functions times the areas of the triangles. Returns the
        vertices, each once for each of its triangles, and complex numbers in their frames.
        """
        tri, angles = self._triangulation, self._angles
        corner, _ = tri.corners_at(np.array([vertex]))
        out, back = previous_half_edge(corner), next_half_edge(corner)
        leaving, scale = angles.rigid(tri.tail(np.arange(tri.F.size)))
        wide = scale[vertex] * angles.corners.ravel()[corner]
        x_one = tri.l.ravel()[out] * np.exp(1j * leaving[out])
        x_other = tri.l.ravel()[back] * np.exp(1j * (leaving[out] + wide))
        # Twice the area times the gradient is the side opposite, turned by a right angle into the triangle; as the
        # angle of a corner may be scaled to more than pi, the sign is that of the area.
        sign = np.sign(np.sin(wide))
        at_one, at_other = -1j * sign * x_other, 1j * sign * x_one
        vertices = np.concatenate([tri.head(out), tri.tail(back), np.full(len(corner), vertex)])
        values = [at_one * np.exp(1j * self._turn[out]), at_other * np.exp(-1j * self._turn[back]), -at_one - at_other]
        return vertices, np.concatenate(values)


class PathTransport:
    """Extension, transport and the logarithmic map by exact shortest paths, in frames with these polar angles."""

    def __init__(self, engine: WindowEngine, polar: PolarAngles) -> None:
        self._engine, self._polar = engine, polar

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """The value (n,) of the nearest source; 0 without one. `values` (k,) are those at `vertices` (k,)."""
        _, labels, _ = self._paths(vertices)
        return np.asarray(_of_nearest(vertices, values, labels))

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Complex numbers (n,), the vector of the nearest source, turned on the way; `vectors` (k, 2) are given."""
        _, labels, angles = self._paths(vertices)
        return _of_nearest(vertices, vectors @ [1, 1j], labels) * carried(angles, labels, vertices, self._polar)

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) as long as the distance, in the direction in which the path departs from `vertex`."""
        distance, _, angles = self._paths(np.array([vertex]))
        return TangentFrames.from_angles(np.nan_to_num(angles.departure), np.where(np.isfinite(distance), distance, 0))

    def _paths(self, vertices: IntArray) -> tuple[FloatArray, IntArray, PathAngles]:
        sources = source_set(vertices, len(self._polar.sums), None)
        return self._engine.directed(sources)[:3]


def _of_nearest(vertices: IntArray, numbers: AnyArray, labels: IntArray) -> AnyArray:
    """The number of the source of each label (n,), 0 for -1; a source named twice has the mean of the numbers."""
    _, which, count = np.unique(vertices, return_inverse=True, return_counts=True)
    total = np.zeros(len(count), numbers.dtype)
    np.add.at(total, which, numbers)
    return np.where(labels < 0, 0.0, (total / count)[which][labels])


class TwoSidedTransport:
    """Extension, transport and the logarithmic map on a surface of n vertices, by those on the cover.

    Vertex v of the surface is v and v + n on the cover, see `two_sided_cover`. A source sends its vector from both: a
    mirror image from the second, so that at each vertex the two copies get mirror images, too. This is the vector heat
    method with a connection that reflects where neighbours are oriented differently, as Sharp, Soliman and Crane (2019)
    have it for points.
    """

    def __init__(self, on_cover: HeatTransport | PathTransport, frames: TangentFrames, n: int) -> None:
        self._on_cover, self._n = on_cover, n
        #: Of the vertices on the first side.
        self.frames = replace(frames, x=frames.x[:n], y=frames.y[:n], normal=frames.normal[:n])
        self._turn = axis_of_second_side(frames, n)

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """Values (n,) from values (k,) at `vertices` (k,)."""
        return self._on_cover.extend(self.on_both(vertices), np.tile(values, 2))[: self._n]

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Vectors as complex numbers (n,), from vectors (k, 2) at `vertices` (k,)."""
        mirrored = self._turn[vertices] * (vectors @ [1, -1j])
        both = np.concatenate([vectors, np.stack([mirrored.real, mirrored.imag], axis=1)])
        return self._on_cover.transport(self.on_both(vertices), both)[: self._n]

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) from `vertex`: to that of the two copies of each other vertex which is nearer."""
        found = self._on_cover.log_map(vertex)
        sides = found[: self._n], found[self._n : 2 * self._n]
        length = np.stack([np.hypot(*side.T) for side in sides])
        # 0 where the copy is not reached.
        length[length == 0] = np.inf
        nearer = np.where((length[1] < length[0])[:, None], sides[1], sides[0])
        nearer[vertex] = 0
        return np.asarray(nearer)

    def on_both(self, vertices: IntArray) -> IntArray:
        """The vertices (2 k,) of the cover that are `vertices` (k,)."""
        return np.concatenate([vertices, vertices + self._n])
