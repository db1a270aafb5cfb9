"""`VectorHeatSolver`: the vector heat method, for values and tangent vectors carried along shortest geodesics."""

from __future__ import annotations

from functools import cached_property
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError, SourceError, names_guessed, real_numbers, require_choice
from heat_igl.heat.parts import SolverOptions, prepare
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.heat.vector_transport import HeatTransport, OutwardField, PathTransport, TwoSidedTransport
from heat_igl.intrinsic import TangentFrames, checked_vectors, tangent_frames
from heat_igl.linear import Backend
from heat_igl.mesh import MeshLike, as_mesh, as_simplices, tangent_surface
from heat_igl.operators import Operators, edge_rotations, operators
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows import MeshTriangles, WindowEngine

VectorMethod = Literal["heat", "windows"]


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
        self._frames: TangentFrames | None = tangent_frames(triangles)
        # Angles are carried over flips, not to added vertices.
        domain = operators(triangles, "intrinsic-delaunay")
        if domain.surface is None:
            raise MeshError("tangent vectors need triangles, and the mesh holds tetrahedra")
        require_choice("method", method, get_args(VectorMethod))
        self._domain, self._options = domain, SolverOptions(t_coef, t, backend=backend)
        #: How values and vectors travel from the sources: by diffusion, or along the shortest paths.
        self._transport: HeatTransport | PathTransport | TwoSidedTransport
        if method == "windows":
            self._transport = PathTransport(WindowEngine(MeshTriangles(triangles)), self._frames.angles)
        else:
            triangulation = domain.surface.triangulation
            # Thirds of the triangles: with Voronoi areas, transport on spheres is wrong by 5 to 10 % more.
            mass = np.bincount(triangulation.F.ravel(), np.repeat(triangulation.areas / 3, 3), domain.n)
            self._transport = HeatTransport(
                self._distance_solver, edge_rotations(domain), mass.astype(np.float64), OutwardField(domain.surface)
            )
        if has_two_sides:
            self._transport = TwoSidedTransport(self._transport, self._frames, self.n_vertices)
            self._frames = self._transport.frames

    @classmethod
    def from_operators(
        cls,
        domain: Operators,
        rotations: sp.csc_matrix,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        backend: Backend = "auto",
    ) -> VectorHeatSolver:
        """A solver on any domain that has operators and a connection.

        Parameters
        ----------
        domain : Operators
            The domain.
        rotations : (n, n) csc_matrix of complex128
            Entry (j, i), where L has one, is exp(i rho), with rho the angle by which the components of a vector turn
            when it is transported from i to j; Hermitian, with 1 on the diagonal.
        t_coef, t, backend
            As for the class.

        Raises
        ------
        ValueError
            If `rotations` has another shape than L.
        """
        if rotations.shape != domain.L.shape:
            raise ValueError(f"rotations must have the shape of L, {domain.L.shape}, not {rotations.shape}")
        solver = cls.__new__(cls)
        solver._frames, solver.n_vertices, solver._originals = None, domain.n, None
        solver._domain, solver._options = domain, SolverOptions(t_coef, t, backend=backend)
        solver._transport = HeatTransport(solver._distance_solver, rotations)
        return solver

    @cached_property
    def _distance_solver(self) -> HeatMethodSolver:
        """Distance by heat, and its flow; nothing is factored if paths are followed."""
        return HeatMethodSolver._of(prepare(self._domain, self._options))

    def __repr__(self) -> str:
        return f"VectorHeatSolver({self.n_vertices} vertices, {type(self._transport).__name__})"

    @property
    def frames(self) -> TangentFrames:
        """The frames in which vectors are given."""
        if self._frames is None:
            raise ValueError("this solver was made from operators, and their frames are not known to it")
        return self._frames

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
        The ratio u / phi of two heat flows, that of the values and that of ones (equation 5 of the paper).
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
        MeshError
            If the solver was made from operators without triangles.

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
