"""Construction of a heat method solver from a mesh, operators or edge lengths, and the state that it keeps."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TypeVar

from heat_igl.heat_method.batches import BatchedSolver
from heat_igl.heat_method.options import Magnitude, SolverOptions
from heat_igl.heat_method.parts import SolverParts, prepare, prepare_mesh, prepare_polygons
from heat_igl.heat_method.solution import Diagnostics
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, MeshLike, MeshPart, PointCloud, PolygonMesh, as_mesh
from heat_igl.operators import Laplacian, Operators, edge_length_operators
from heat_igl.plan import Plan
from heat_igl.steps import Boundary
from heat_igl.typing import ArrayLike, BoolArray, FloatArray

__all__ = ["PreparedSolver"]

Solver = TypeVar("Solver", bound="PreparedSolver")


class PreparedSolver(BatchedSolver):
    """A solver that has prepared operators and factors; `HeatMethodSolver` adds the method."""

    _mesh: Mesh | PointCloud | None = None
    _parts: SolverParts
    _part: MeshPart | None = None

    @classmethod
    def from_options(
        cls: type[Solver], mesh: MeshLike | Operators, options: SolverOptions, region: ArrayLike | None = None
    ) -> Solver:
        """A solver on `mesh` with options that were put together before."""
        solver = cls.__new__(cls)
        solver._set_up(mesh if isinstance(mesh, Operators) else as_mesh(mesh), options, region)
        return solver

    @classmethod
    def from_edge_lengths(
        cls: type[Solver],
        F: ArrayLike,
        lengths: ArrayLike,
        *,
        n: int | None = None,
        twin: ArrayLike | None = None,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "auto",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        backend: Backend = "auto",
    ) -> Solver:
        """A solver on triangles that are known by their edge lengths alone; positions are not needed.

        Parameters
        ----------
        F : (m, 3) array_like of int
            Vertices of each triangle.
        lengths : (m, 3) array_like
            ``lengths[f, c]`` is that of the side of triangle f opposite its corner c, as `igl.edge_lengths` gives it;
            both triangles at an edge give it the same length.
        n : int, optional
            Number of vertices; one more than the largest in `F` if not given.
        twin : (m, 3) array_like of int, optional
            ``twin[f, c]`` is ``3 g + d`` where side c of triangle f is glued to side d of triangle g, and -1 on the
            boundary. By default sides with the same ends are glued. It is needed where several edges join the same two
            vertices, or a vertex with itself, as in intrinsic triangulations; then a triangle may repeat a vertex.
        **options
            As for the class. Where more than two triangles meet at an edge no tufted cover is made, which takes
            positions: such edges are not flipped.

        Raises
        ------
        MeshError
            If `F`, `lengths` or `twin` cannot be used; the message names the first offender.
        """
        options = SolverOptions(t_coef, t, laplacian, boundary, magnitude, backend)
        start = time.perf_counter()
        domain = edge_length_operators(F, lengths, n, options.laplacian, twin)
        return cls._of(prepare(domain, options, seconds_operators=time.perf_counter() - start))

    def with_vertices(self: Solver, V: ArrayLike) -> Solver:
        """A new solver after the vertices have moved; this one stays as it is.

        Parameters
        ----------
        V : (n, 3) array_like
            New positions of all vertices.

        Returns
        -------
        HeatMethodSolver
            With the same faces and options, and the same results as one made anew. The time step follows `t_coef`,
            unless `t` was given. What the faces alone say is shared: they are not validated, and edges, boundary and
            components not found again; nor is the order of elimination, unless other edges are flipped.

        Raises
        ------
        MeshError
            If `V` cannot be used; the message names the first offender.
        ValueError
            If the solver was made from operators.
        """
        if self._mesh is None:
            fans = self.operators.fans
            if fans is None:
                raise ValueError("this solver was made from operators and has no vertices to move: make it again")
            positions = fans.polygons.triangles.with_vertices(V).V
            return self._of(prepare_polygons(PolygonMesh(positions, fans.polygons.polygons), self._parts.options))
        moved = self._mesh.with_vertices(V)
        options, known = self._parts.options, self._parts.analysis
        solver = self._of(prepare_mesh(moved, options, known), moved)
        if self._part is not None and isinstance(moved, Mesh):
            solver._part = replace(self._part, mesh=moved)
        return solver

    def _set_up(
        self,
        mesh: Mesh | PolygonMesh | PointCloud | Operators,
        options: SolverOptions,
        region: ArrayLike | None = None,
    ) -> None:
        if region is not None:
            self._part = MeshPart.of(mesh, region)
            mesh = self._part.mesh
        if isinstance(mesh, Operators):
            if options.laplacian != "auto":
                raise ValueError(f"laplacian={options.laplacian!r} is for meshes: operators have a Laplacian already")
            # Whoever made the operators chose the triangulation.
            chosen = replace(options, laplacian="intrinsic-delaunay")
            self._mesh, self._parts = None, prepare(mesh, chosen)
        elif isinstance(mesh, PolygonMesh):
            self._mesh, self._parts = None, prepare_polygons(mesh, options)
        else:
            self._mesh, self._parts = mesh, prepare_mesh(mesh, options)

    @classmethod
    def _of(cls: type[Solver], parts: SolverParts, mesh: Mesh | PointCloud | None = None) -> Solver:
        solver = cls.__new__(cls)
        solver._mesh, solver._parts = mesh, parts
        return solver

    def __repr__(self) -> str:
        backend = self.diagnostics.backend
        return f"{type(self).__name__}({self.n_vertices} vertices, t={self.t:.4g}, backend={backend!r})"

    @property
    def plan(self) -> Plan:
        """The engine, which is heat, and what it runs on."""
        return self._parts.plan

    @property
    def operators(self) -> Operators:
        """L, M, G and D of the triangulation that is solved on."""
        return self._parts.operators

    @property
    def t(self) -> float:
        """The time step in use, a squared length; of several (`time_steps`), that of the largest component."""
        return self.diagnostics.t

    @property
    def time_steps(self) -> FloatArray:
        """The time step of each component, by their labels in ``operators.components``."""
        return self._parts.time_steps

    @property
    def diagnostics(self) -> Diagnostics:
        """What the solver did and rests on."""
        comparisons = self._parts.comparisons
        return replace(self._parts.diagnostics, compared=None if comparisons is None else comparisons.worst)

    @property
    def n_vertices(self) -> int:
        """Length of a distance array: the vertices of the mesh. The operators may have more."""
        return self._parts.n_vertices

    @property
    def referenced(self) -> BoolArray:
        """Mask (n,) of the vertices that a face uses."""
        return self.operators.referenced[: self.n_vertices]

    @property
    def _n_faces(self) -> int:
        return self._parts.n_faces
