"""`VectorHeatSolver`: the vector heat method, for values and tangent vectors carried along shortest geodesics.

Sharp, Soliman and Crane (2019): a short time step of the heat equation for vectors transports them along the shortest
geodesics, up to their lengths, which two scalar heat flows give. Exact shortest paths carry them as well.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning, MeshError, SourceError, names_guessed, real_numbers, require_choice
from heat_igl.heat.checking import naming_thinnest
from heat_igl.heat.parts import SolverOptions, prepare
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.heat.steps import VectorHeatFlow, unit_numbers
from heat_igl.intrinsic import (
    PolarAngles,
    TangentFrames,
    carried_angles,
    checked_vectors,
    polar_angles,
    tangent_frames,
    transport_angles,
)
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.linear import Backend
from heat_igl.mesh import MeshLike, as_mesh, as_simplices, tangent_surface
from heat_igl.operators import Operators, Surface, edge_rotations, operators
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, warn_caller
from heat_igl.sources import Sources, named_vertices, source_set
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows import MeshTriangles, PathAngles, WindowEngine
from heat_igl.windows.directions import axis_of_second_side, carried

VectorMethod = Literal["heat", "windows"]
# Vectors shorter than this share of the longest at a neighbour are rounding: those that arrive cancel. Between opposite
# vectors on a grid the share is 8e-16 in the middle and 8e-10 beside it; of 32 random transports it is at least 3e-3.
_CANCELLED = 1e-10
# The time step of vectors in that of heat, for t = h^2. At h^2 / 2, transport on spheres is wrong by 1.5 to 2 times as
# much; vectors are farther from their shortest paths with longer steps.
_VECTOR_STEP = 2.0


class VectorHeatSolver:
    """The vector heat method (Sharp, Soliman, Crane 2019): factor once, ask many times.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles, manifold and oriented alike. The triangles of a `PointCloud` may be
        neither: heat then flows on both sides of them, see `TwoSidedTransport`.
    t_coef : float, optional
        t = t_coef h^2, with h the mean edge length of the intrinsic Delaunay triangulation; by default 1 for vectors as
        in the paper, and 0.5 for values as for `HeatMethodSolver`. Larger ones blend the sources more smoothly, and are
        farther from transport along the shortest geodesic.
    t : float, optional
        Time step as a squared length; overrides `t_coef`. It is raised where heat would not cross the mesh.
    method : {"heat", "windows"}
        With "windows" nothing flows: every vertex takes the value or the vector of the nearest source, along the exact
        shortest path, and `log_map` has the direction in which that path departs; see `GeodesicSolver.directions`.
    backend : {"auto", "scipy", "multifrontal"}
        Linear solver, see `factorize`.

    Raises
    ------
    MeshError
        If the mesh has no tangent frames, see `tangent_frames`.
    FactorizationError, MissingExtraError, ValueError
        As for `HeatMethodSolver`.

    Warns
    -----
    AccuracyWarning
        If an explicit `t` had to be raised.

    Notes
    -----
    Vectors are given and returned by two components in the frames of `tangent_frames`, which `frames` holds. The solver
    is immutable, and threads may share it. No result is NaN. Vertices on components without a source, which
    `reaches` tells apart, get 0.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.grid(12)
    >>> solver = heat_igl.VectorHeatSolver(mesh)
    >>> given = solver.frames.from_world([[1, 0, 0]], [84])  # along x, at the middle of a square
    >>> found = solver.frames.to_world(solver.transport(84, given))
    >>> bool(np.allclose(found, [1, 0, 0]))
    True
    """

    @names_guessed
    def __init__(
        self,
        mesh: MeshLike,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        method: VectorMethod = "heat",
        backend: Backend = "auto",
    ) -> None:
        mesh = as_mesh(mesh)
        triangles = as_simplices(mesh)
        #: Vertices that vectors are given at and returned for.
        self.n_vertices = triangles.n_vertices
        self._originals: IntArray | None = triangles.originals if triangles.has_copies else None
        triangles = tangent_surface(mesh)
        has_two_sides = triangles.n_vertices > self.n_vertices
        #: The frames in which vectors are given.
        self.frames: TangentFrames = tangent_frames(triangles)
        # Angles are carried over flips, not to added vertices.
        domain = operators(triangles, "intrinsic-delaunay")
        if domain.surface is None:
            raise MeshError("tangent vectors need triangles, and the mesh holds tetrahedra")
        require_choice("method", method, get_args(VectorMethod))
        self._domain, self._options = domain, SolverOptions(t_coef, t, backend=backend)
        #: How values and vectors travel from the sources: by diffusion, or along the shortest paths.
        self._transport: HeatTransport | PathTransport | TwoSidedTransport
        if method == "windows":
            self._transport = PathTransport(WindowEngine(MeshTriangles(triangles)), self.frames.angles)
        else:
            triangulation = domain.surface.triangulation
            # Thirds of the triangles: with Voronoi areas, transport on spheres is wrong by 5 to 10 % more.
            mass = np.bincount(triangulation.F.ravel(), np.repeat(triangulation.areas / 3, 3), domain.n)
            self._transport = HeatTransport(
                self._distance_solver, edge_rotations(domain), mass.astype(np.float64), OutwardField(domain.surface)
            )
        if has_two_sides:
            self._transport = TwoSidedTransport(self._transport, self.frames, self.n_vertices)
            self.frames = self._transport.frames

    @cached_property
    def _distance_solver(self) -> HeatMethodSolver:
        """Distance by heat, and its flow; nothing is factored if paths are followed."""
        return HeatMethodSolver._of(prepare(self._domain, self._options))

    def __repr__(self) -> str:
        return f"VectorHeatSolver({self.n_vertices} vertices, {type(self._transport).__name__})"

    @property
    def operators(self) -> Operators:
        """L and M of the triangulation that is solved on; of both sides of a cloud without an orientation."""
        return self._domain

    @property
    def t(self) -> float:
        """The time step in use, a squared length."""
        return self._distance_solver.t

    def reaches(self, sources: Sources) -> BoolArray:
        """Mask (n,) of the vertices on the components of the sources: all others get 0.

        `sources` and errors are those of `transport`.
        """
        components, vertices = self.operators.components, self._vertices(sources)
        if isinstance(self._transport, TwoSidedTransport):
            vertices = self._transport.on_both(vertices)
        return self._with_copies(np.isin(components, components[vertices])[: self.n_vertices])

    def extend(self, sources: Sources, values: ArrayLike) -> FloatArray:
        """Values at vertices, extended to all: each vertex gets about the value of the nearest source.

        Parameters
        ----------
        sources : int, sequence of int or (n,) mask of bool
            Vertices; where one is repeated, its values are averaged.
        values : float or (k,) array_like
            One for each source, in the order in which they are named.

        Returns
        -------
        (n,) float64
            Between the smallest and the largest of the values; 0 where no source `reaches`.

        Raises
        ------
        SourceError
            If `sources` are not vertices of the mesh.
        ValueError
            If there is not one finite value for each source.

        Notes
        -----
        The result is the ratio u / phi of two heat flows: u starts from the values and phi from ones (equation 5 of the
        paper).
        """
        vertices = self._vertices(sources)
        given = np.atleast_1d(real_numbers("values", values))
        if given.shape != (len(vertices),):
            raise ValueError(
                f"values must be one number for each of the {len(vertices)} sources, but the shape is {given.shape}"
            )
        checked = checked_vectors("values", given[:, None], len(vertices), 1)[:, 0]
        return self._with_copies(self._transport.extend(vertices, checked))

    def transport(self, sources: Sources, vectors: ArrayLike) -> FloatArray:
        """Tangent vectors at vertices, transported to all along shortest geodesics.

        Parameters
        ----------
        sources : int, sequence of int or (n,) mask of bool
            Vertices; the vectors of one that is repeated are averaged.
        vectors : (k, 2) array_like
            Components in the frame of each source, in the order in which they are named.

        Returns
        -------
        (n, 2) float64
            Components in the frame of each vertex. Directions are those of vectors from all sources, which the nearest
            sources dominate, and lengths are extended as by `extend`. 0 where no source `reaches`, and where vectors
            that arrive on different ways cancel to rounding, as at the antipode on a sphere.

        Raises
        ------
        SourceError
            If `sources` are not vertices of the mesh.
        ValueError
            If there is not one vector of two finite components for each source.

        Notes
        -----
        Algorithm 1 of the paper: the direction of one step of vector heat flow, the length of `extend`.
        """
        vertices = self._vertices(sources)
        given = checked_vectors("vectors", vectors, len(vertices), 2)
        found = self._with_copies(self._transport.transport(vertices, given))
        return np.stack([found.real, found.imag], axis=1)

    def log_map(self, source: int) -> FloatArray:
        """The logarithmic map: the vector from a vertex to each other along the shortest geodesic.

        Parameters
        ----------
        source : int
            A vertex.

        Returns
        -------
        (n, 2) float64
            Components in the frame of the source: as long as the distance, and in the direction in which the geodesic
            departs. 0 where the source does not `reach`.

        Raises
        ------
        SourceError
            If `source` is not one vertex of the mesh.

        Notes
        -----
        The angle between the radial field and a transported axis, which both come from vector heat flow, and the
        distance by heat. The paper's radial field starts from a circle around the source, ours from
        vectors with the sum 0, which irregular triangles there do not bias (`OutwardField.dipole`). The neighbours of
        the source get the directions of their edges. Near the cut locus the angle is least accurate: heat that arrives
        from both sides is blended.
        """
        vertices = self._vertices(source)
        if len(vertices) != 1:
            raise SourceError(f"source must be one vertex, not {len(vertices)}")
        return self._with_copies(self._transport.log_map(int(vertices[0])))

    def _vertices(self, sources: Sources) -> IntArray:
        return self._with_copies(np.arange(self.n_vertices))[named_vertices(sources, self.n_vertices)]

    def _with_copies(self, values: AnyArray) -> AnyArray:
        """Values at n vertices, in which copies have those of their originals."""
        return values if self._originals is None else values[self._originals]


class HeatTransport:
    """Extension, transport and the logarithmic map by heat flows, factored when made.

    `rotations` are the connection, as of `edge_rotations`, and `mass` (n,) is that of each vertex for the flow of
    vectors.
    """

    def __init__(
        self, solver: HeatMethodSolver, rotations: sp.csc_matrix, mass: FloatArray, outward: OutwardField
    ) -> None:
        parts = solver._parts
        t = parts.heat_flow.t * (_VECTOR_STEP if parts.options.default_time_step else 1.0)
        self._solver, self._outward, self._heat_flow = solver, outward, parts.heat_flow
        with naming_thinnest(solver.operators.source_surface):
            self._vector_flow = VectorHeatFlow(solver.operators, rotations, t, parts.options.backend, mass=mass)
        self._pattern = abs(rotations).tocsr()

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """Values (k,) at `vertices` (k,), extended to all (n,): the ratio u / phi of two heat flows (equation 5)."""
        largest, domain = float(np.abs(values).max()), self._solver.operators
        b = np.zeros((domain.n, 2))
        np.add.at(b[:, 0], vertices, values / largest if largest > 0 else values)
        np.add.at(b[:, 1], vertices, 1.0)
        unit = SOURCE_HEAT / b[:, 1].max()
        u, phi = self._heat_flow.solve(b * unit).T
        warm = phi > LOWEST_HEAT
        cold = np.isin(domain.components, domain.components[vertices]) & ~warm
        if cold.any():
            remedy = "raise t" if domain.referenced[cold].any() else "no face uses them"
            warn_caller(
                f"heat does not reach {int(cold.sum())} vertices in double precision, vertex {int(np.argmax(cold))} "
                f"first: they get 0; {remedy}",
                AccuracyWarning,
            )
        ratio = np.divide(u, phi, out=np.zeros_like(u), where=warm) * largest
        # A mean of the values: what is beyond them is rounding.
        return np.where(warm, np.clip(ratio, values.min(), values.max()), 0.0)

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Vectors (k, 2) at `vertices` (k,), transported to all: complex numbers (n,) (Algorithm 1)."""
        lengths = self.extend(vertices, np.hypot(*vectors.T))
        b, numbers = np.zeros(self._solver.operators.n, complex), vectors @ [1, 1j]
        largest = float(np.abs(numbers).max())
        np.add.at(b, vertices, numbers / largest if largest > 0 else numbers)
        b *= SOURCE_HEAT / np.bincount(vertices).max()
        Y = self._vector_flow.solve(b) * self._vector_flow.sign(b)
        size = np.abs(Y)
        # The diagonal is in every row, so that none is empty.
        nearby = np.maximum.reduceat(size[self._pattern.indices], self._pattern.indptr[:-1])
        return unit_numbers(np.where(size > _CANCELLED * nearby, Y, 0.0)) * lengths

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) from `vertex`, by the angle between the radial field and a transported axis."""
        at, outward = self._outward.dipole(vertex)
        b = np.zeros((self._solver.operators.n, 2), complex)
        largest = np.abs(outward).max(initial=0.0)
        np.add.at(b[:, 0], at, SOURCE_HEAT * (outward / largest if largest > 0 else outward))
        b[vertex, 1] = SOURCE_HEAT
        radial, axis = (unit_numbers(Y) for Y in self._vector_flow.solve(b).T)
        direction = self._outward.to_polar(vertex, unit_numbers(radial * axis.conj()))
        neighbour, exact = self._outward.ring(vertex)
        direction[neighbour] = np.exp(1j * exact)
        distance = self._solver.distance(vertex)
        length = np.where(np.isfinite(distance), distance, 0.0)
        return np.stack([length * direction.real, length * direction.imag], axis=1)


class OutwardField:
    """Radial fields around the vertices of an oriented manifold of triangles."""

    def __init__(self, surface: Surface) -> None:
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
        """Vectors (n, 2) from `vertex` to each vertex, of whose two copies in the cover the nearer one counts."""
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
