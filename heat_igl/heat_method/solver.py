"""`HeatMethodSolver`: the three steps put together, factored once, asked many times."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import AccuracyWarning
from heat_igl.heat_method.batches import BatchedSolver, checked_cutoff, cut_off
from heat_igl.heat_method.checking import AnswerCheck, Checker
from heat_igl.heat_method.integration import Integration, damped_field
from heat_igl.heat_method.options import Magnitude, SolverOptions
from heat_igl.heat_method.several_sources import drop_overtaken, warmest_sources
from heat_igl.heat_method.solution import Diagnostics, HeatSolution, LabelledDistance
from heat_igl.heat_method.time_step import time_step
from heat_igl.linear import Analysis, Backend
from heat_igl.mesh import Mesh
from heat_igl.operators import Laplacian, Operators, edge_length_operators, operators
from heat_igl.runtime import in_order, n_threads, pool, warn_caller
from heat_igl.sources import SourceAssembler, Sources, SourceSet, SourceTerm, right_hand_side, source_set
from heat_igl.steps import Boundary, HeatFlow, NormalizedDivergence, PoissonProblem, analysis
from heat_igl.typing import ArrayLike, FloatArray
from heat_igl.unfolding import Refine, UnfoldingSolver

__all__ = ["HeatMethodSolver", "heat_method_distance"]


@dataclass(frozen=True)
class _Prepared:
    """What is known before anything is factored, and the seconds that it took."""

    seconds_operators: float = 0.0
    seconds_analysis: float = 0.0
    analysis: Analysis | None = None


class HeatMethodSolver(BatchedSolver):
    """Geodesic distance by the heat method (Crane, Weischedel, Wardetzky 2013): factor once, ask many times.

    Parameters
    ----------
    mesh : Mesh or (n, 3) array_like
        A mesh, or the positions V of one whose faces are `F`.
    F : (m, 3) or (m, 4) array_like, optional
        Faces, when `mesh` is V.
    t_coef : float, optional
        Scale-free time step, t = t_coef h^2 with h the mean edge length of the triangulation that is solved on. Larger
        values smooth the distance across the cut locus. 0.5 where heat is fitted to the lengths of edges (see
        `magnitude`), else the paper's 1.
    t : float, optional
        Time step as a squared length; overrides `t_coef`.
    laplacian : {"auto", "intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan"}
        Triangulation to solve on, see `operators`; "cotan" is the paper's. "auto" is the intrinsic Delaunay one where
        triangles are even, and has more vertices where they are not: `operators` then has more rows than there are
        answers, the first ones for the vertices of the mesh. With `refine`, "auto" adds no vertices. Tetrahedra always
        keep their own.
    boundary : {"neumann", "dirichlet", "average"}
        What the heat does at the boundary, see `HeatFlow`.
    magnitude : {"auto", "unit", "damped"}
        Length of the field X that is integrated: 1 as in the paper, or less where heat arrives from several sides, see
        `damping`. "auto" damps on surfaces, where it was measured to pay, but not for "cotan", where heat may be
        negative and the paper's method is wanted. "unit" is the paper's method throughout: otherwise the heat flow is
        fitted to the lengths of edges (`fitted_laplacian`), X follows the gradient of log u, and the vertices next to a
        source vertex get the lengths of the edges.
    refine : {"sweep", "unfold"}, optional
        Integrate nothing, and find the distance in the order of the heat by unfolding triangles, two at a time or in
        strips: 0.06 to 0.3 % and 0.0005 to 0.003 % mean error on common meshes, see `Refinement`. Needs triangles, and
        numba (extra ``fast``); no Poisson problem is factored.
    backend : {"auto", "scipy", "multifrontal", "iterative"}
        Linear solver, see `factorize`.

    Raises
    ------
    MeshError
        If the mesh cannot be used; the message names the first offender.
    FactorizationError
        If a matrix is not positive definite.
    MissingExtraError
        If a library asked for is not installed.
    ValueError
        If an option has no meaning.

    Warns
    -----
    AccuracyWarning
        If an explicit `t` had to be raised for the heat to cross the mesh.

    Notes
    -----
    A time step too small for the heat to cross the mesh in double precision is raised, and `t` and `diagnostics` say
    so. The solver is immutable; threads may share it, and a pickled copy gives the same bits.
    """

    _mesh: Mesh | None = None
    _heat_flow: HeatFlow
    _options: SolverOptions

    def __init__(
        self,
        mesh: Mesh | ArrayLike,
        F: ArrayLike | None = None,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "auto",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> None:
        options = SolverOptions(t_coef, t, laplacian, boundary, magnitude, refine, backend)
        self._set_up_mesh(_as_mesh(mesh, F), options)

    @classmethod
    def from_options(cls, mesh: Mesh, options: SolverOptions) -> HeatMethodSolver:
        """A solver on `mesh` with options that were put together before."""
        solver = cls.__new__(cls)
        solver._set_up_mesh(mesh, options)
        return solver

    @classmethod
    def from_operators(
        cls,
        domain: Operators,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> HeatMethodSolver:
        """A solver on any domain that has operators; parameters as for the class."""
        solver = cls.__new__(cls)
        options = SolverOptions(t_coef, t, "intrinsic-delaunay", boundary, magnitude, refine, backend)
        solver._set_up(domain, options, _Prepared())
        return solver

    @classmethod
    def from_edge_lengths(
        cls,
        F: ArrayLike,
        lengths: ArrayLike,
        *,
        n: int | None = None,
        t_coef: float | None = None,
        t: float | None = None,
        laplacian: Laplacian = "auto",
        boundary: Boundary = "neumann",
        magnitude: Magnitude = "auto",
        refine: Refine | None = None,
        backend: Backend = "auto",
    ) -> HeatMethodSolver:
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
        **options
            As for the class. Where more than two triangles meet at an edge no tufted cover is made, which takes
            positions: such edges are not flipped.

        Raises
        ------
        MeshError
            If `F` or `lengths` cannot be used; the message names the first offender.
        """
        options = SolverOptions(t_coef, t, laplacian, boundary, magnitude, refine, backend)
        start = time.perf_counter()
        domain = edge_length_operators(F, lengths, n, options.triangulation)
        solver = cls.__new__(cls)
        solver._set_up(domain, options, _Prepared(time.perf_counter() - start))
        return solver

    def with_vertices(self, V: ArrayLike) -> HeatMethodSolver:
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
            raise ValueError(
                "this solver was made from operators and has no vertices to move: use from_operators again"
            )
        solver = HeatMethodSolver.__new__(HeatMethodSolver)
        solver._set_up_mesh(self._mesh.with_vertices(V), self._options, self._analysis)
        return solver

    def _set_up_mesh(self, mesh: Mesh, options: SolverOptions, known: Analysis | None = None) -> None:
        """Assemble the operators of `mesh`, with the order of elimination beside them, then as `_set_up`."""
        self._mesh = mesh
        start = time.perf_counter()
        begun: list[Future[Analysis]] = []
        with pool(1) as beside:

            def analyse(L: sp.csc_matrix) -> None:
                begun.append(beside.submit(analysis, L, options.backend))

            # The order of elimination takes a third of the time and needs no more than the pattern of L.
            domain = operators(mesh, options.triangulation, analyse if known is None and n_threads() > 1 else None)
            seconds = time.perf_counter() - start
            known = begun[0].result() if begun else known
        waited = time.perf_counter() - start - seconds
        self._set_up(domain, options, _Prepared(seconds, waited, known))

    def _set_up(self, domain: Operators, options: SolverOptions, prepared: _Prepared) -> None:
        """Resolve the options on `domain`, then factor what they ask for."""
        start = time.perf_counter()
        self._operators, self._options = domain, options
        damped = options.damps(domain)
        fitted = self._fitted = damped and domain.lengths is not None
        step, requested = time_step(options, domain, fitted)
        self._t_damping = step if damped else None
        self._time_steps = np.broadcast_to(step, domain.n_components)
        known = self._analysis = analysis(domain.L, options.backend, prepared.analysis)
        analysed = time.perf_counter()
        makers: list[Callable[[], Any]] = [
            lambda: HeatFlow(domain, step, options.boundary, options.backend, known, fitted)
        ]
        if options.refine is None:
            makers.append(lambda: PoissonProblem(domain, options.backend, known))
        # Both matrices at once: the backends run without the interpreter's lock.
        self._heat_flow, *poisson = in_order(lambda make: make(), makers, min(len(makers), n_threads()))
        factored = time.perf_counter()
        self._assembler = SourceAssembler(
            domain, step, self._heat_flow.mean_mass, plain=not damped, unfolds=options.refine is not None
        )
        self._given_faces = None if domain.surface is None else domain.surface.given_faces
        self._from_heat: Integration | UnfoldingSolver
        if options.refine is not None:
            self._from_heat = UnfoldingSolver(domain, options.refine)
        else:
            divergence = NormalizedDivergence(domain, self._t_damping, known.order, fitted)
            self._from_heat = Integration(
                domain, self._heat_flow, divergence, poisson[0], self._t_damping, fitted, self._assembler.edges
            )
        self._checker: Checker | None = None
        if options.refine != "unfold":
            self._checker = Checker(domain, None if self._mesh is None else self._mesh.V)
        triangulation = None if domain.surface is None else domain.surface.triangulation
        factors = self._heat_flow.factors + [problem.factor for problem in poisson]
        self._diagnostics = Diagnostics(
            t=_of_largest(step, domain),
            t_requested=_of_largest(requested, domain),
            mean_edge_length=domain.mean_edge_length,
            edges_across=domain.longest_distance / domain.mean_edge_length,
            n_vertices=domain.n,
            n_flips=triangulation.n_flips if triangulation else 0,
            lengthening=triangulation.lengthening if triangulation else 0.0,
            backend=self._heat_flow.backend,
            seconds_operators=prepared.seconds_operators,
            factor_nonzeros=sum(factor.nonzeros for factor in factors),
            factor_bytes=sum(factor.n_bytes for factor in factors),
            seconds_analysis=prepared.seconds_analysis + analysed - start,
            seconds_factorization=factored - analysed,
        )

    @property
    def operators(self) -> Operators:
        """L, M, G and D of the triangulation that is solved on."""
        return self._operators

    @property
    def t(self) -> float:
        """The time step in use, a squared length; of several (`time_steps`), that of the largest component."""
        return self._diagnostics.t

    @property
    def time_steps(self) -> FloatArray:
        """The time step of each component, by their labels in ``operators.components``."""
        return self._time_steps

    @property
    def diagnostics(self) -> Diagnostics:
        """What the solver did and rests on."""
        return self._diagnostics

    @property
    def n_vertices(self) -> int:
        """Length of a distance array: the vertices of the mesh. The operators may have more."""
        return self._operators.n_given

    @property
    def _n_faces(self) -> int:
        return len(self._operators.weights)

    def distance(self, sources: Sources, *, cutoff: float | None = None) -> FloatArray:
        """Distance from the nearest source.

        Parameters
        ----------
        sources : sources
            A vertex, a sequence of vertices, a mask (n,) of bool, `SurfacePoints`, a `SurfaceCurve`, `OffsetSources`
            where distance begins at other values than 0, or a list of such.
        cutoff : float, optional
            Distances beyond this are ``inf``.

        Returns
        -------
        (n,) float64
            In the mesh's unit: 0 at the sources (their offset where they have one, unless another source is nearer),
            ``inf`` at vertices that no source reaches, never negative or NaN.

        Raises
        ------
        SourceError
            If `sources` does not describe places on the mesh.
        ValueError
            If `cutoff` is not positive.

        Warns
        -----
        AccuracyWarning
            If heat underflowed on the way, so that distances beyond are too short, or if the answer leaves bounds that
            need no reference by so much that it is wrong (see `AnswerCheck`).
        """
        beyond = checked_cutoff(cutoff)
        chosen = self._source_set(sources)
        (distance,), (complaint,) = self._answers([chosen])
        _warn(complaint)
        return np.asarray(cut_off(distance, beyond))

    def _source_set(self, sources: Sources) -> SourceSet:
        return source_set(sources, self.n_vertices, self._given_faces)

    def _distances(self, source_sets: list[SourceSet]) -> FloatArray:
        return self._answers(source_sets)[0]

    def _answers(self, source_sets: list[SourceSet]) -> tuple[FloatArray, list[str | None]]:
        """Distances (k, n) from k sets of sources, and what is wrong with them: the method from end to end."""
        terms = self._source_terms(source_sets)
        distances = self._distances_from_heat(terms, self._heat(terms))
        checks = [self._check(*pair) for pair in zip(distances, source_sets, strict=True)]
        return distances, [None if check is None else check.complaint(self._operators.is_surface) for check in checks]

    def _check(self, distance: FloatArray, sources: SourceSet) -> AnswerCheck | None:
        """Check one answer (n,), and raise it to straight lines where it is far below them.

        A field of length 1 is the paper's method, and a time step that was asked for may be meant to smooth: their
        answers are left as they are.
        """
        if self._checker is None:
            return None
        check = self._checker.check(distance, sources)
        if check.is_short and self._t_damping is not None and self._options.default_time_step:
            return check._replace(raised=self._checker.raise_to_lines(distance, sources))
        return check

    def _source_terms(self, source_sets: list[SourceSet]) -> list[SourceTerm]:
        """Initial heat of each set, and what is known near it."""
        terms = [self._assembler.term(sources) for sources in source_sets]
        if isinstance(self._from_heat, UnfoldingSolver):
            return terms
        return [drop_overtaken(term, self._heat_flow, self._operators.n) for term in terms]

    def _heat(self, terms: list[SourceTerm]) -> FloatArray:
        """Heat at all vertices of the operators, for k terms: step 1."""
        return self._heat_flow.solve(right_hand_side(self._operators.n, terms))

    def _distances_from_heat(self, terms: list[SourceTerm], u: FloatArray) -> FloatArray:
        """Distances (k, n) from the heat of `_heat`: steps 2 and 3, or unfolding in the order of the heat."""
        if isinstance(self._from_heat, UnfoldingSolver):
            return self._from_heat.distances(terms, u)
        divergence = self._from_heat.divergence(terms, u)
        phi = self._from_heat.poisson.solve(divergence)
        return self._from_heat.pin_levels(terms, phi, u)[:, : self.n_vertices]

    def voronoi(self, sources: Sources, *, cutoff: float | None = None) -> LabelledDistance:
        """Distance, and which source is nearest: a geodesic Voronoi diagram.

        Parameters
        ----------
        sources, cutoff
            As for `distance`, with its errors. Sources are counted as they are given: each vertex of a sequence, each
            set entry of a mask, each point, a curve as one; over the entries of a list one after another.

        Returns
        -------
        LabelledDistance
            Without `refine`, labels say from which source most of the heat comes: a solve for each source, and right
            but for vertices less than an edge from the border of two cells. With it, they come with the distance.
        """
        beyond = checked_cutoff(cutoff)
        chosen = self._source_set(sources)
        terms = self._source_terms([chosen])
        u = self._heat(terms)
        if isinstance(self._from_heat, UnfoldingSolver):
            distance, labels = self._from_heat.labelled(terms[0], u[:, 0])
        else:
            distance = self._distances_from_heat(terms, u)[0]
            labels = warmest_sources(terms[0], self._heat_flow, self._operators.n)[: self.n_vertices]
        check = self._check(distance, chosen)
        _warn(check and check.complaint(self._operators.is_surface))
        distance = cut_off(distance, beyond)
        labels[np.isinf(distance)] = -1
        return LabelledDistance(distance, labels)

    def solve(self, sources: Sources) -> HeatSolution:
        """All three steps from `sources`, for a closer look; arguments and errors as for `distance`."""
        chosen = self._source_set(sources)
        terms = self._source_terms([chosen])
        u = self._heat(terms)
        X, magnitude = damped_field(self._operators, terms, u, self._t_damping, self._fitted)
        distance = self._distances_from_heat(terms, u)[0]
        check = self._check(distance, chosen)
        _warn(check and check.complaint(self._operators.is_surface))
        with np.errstate(under="ignore"):
            heat = (u[:, 0] / terms[0].unit / self._heat_flow.mean_mass)[: self.n_vertices]
        return HeatSolution(
            heat=heat,
            direction=np.ascontiguousarray(X[:, 0].reshape(self._operators.dimension, -1).T),
            magnitude=np.ascontiguousarray(magnitude[:, 0]),
            distance=distance,
            t=self.t,
            diagnostics=replace(self.diagnostics, check=check),
        )


def _warn(complaint: str | None) -> None:
    if complaint is not None:
        warn_caller(complaint, AccuracyWarning)


def _of_largest(step: float | FloatArray, domain: Operators) -> float:
    """Of one number for each component, that of the component with most vertices."""
    return float(step[np.bincount(domain.components).argmax()]) if isinstance(step, np.ndarray) else step


def _as_mesh(mesh: Mesh | ArrayLike, F: ArrayLike | None) -> Mesh:
    if isinstance(mesh, Mesh):
        if F is not None:
            raise TypeError("pass a Mesh alone, or positions V and faces F")
        return mesh
    if F is None:
        raise TypeError("faces F are missing: pass a Mesh, or positions V and faces F")
    return Mesh(mesh, F)


def heat_method_distance(V: ArrayLike, F: ArrayLike, sources: Sources, **options: Any) -> FloatArray:
    """Geodesic distance from `sources` in one call; to ask more than once, keep a `HeatMethodSolver`.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) or (m, 4) array_like
        Triangles or tetrahedra.
    sources : sources
        As for `HeatMethodSolver.distance`.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    (n,) float64
        See `HeatMethodSolver.distance`, for errors too.
    """
    return HeatMethodSolver(V, F, **options).distance(sources)
