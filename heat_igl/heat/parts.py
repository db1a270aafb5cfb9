"""Preparation of a solver before the first query: options, operators, the time step, factors; and its results."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl import plan
from heat_igl.errors import AccuracyWarning, positive, require_choice
from heat_igl.heat.checking import AnswerCheck, Checker, Comparison, Comparisons, naming_thinnest
from heat_igl.heat.source_terms import SourceAssembler
from heat_igl.heat.steps import (
    Boundary,
    HeatFlow,
    NormalizedDivergence,
    PoissonProblem,
    analysis,
    smallest_time_step,
    smallest_time_steps,
)
from heat_igl.linear import Analysis, Backend
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh
from heat_igl.operators import (
    Laplacian,
    Operators,
    check_laplacian,
    fan_operators,
    is_rough_or_narrow,
    operators,
    point_cloud_operators,
)
from heat_igl.plan import Plan, heat_plan
from heat_igl.runtime import Pool, in_order, n_threads, warn_caller
from heat_igl.typing import FloatArray

Magnitude = Literal["auto", "unit", "damped"]


@dataclass(frozen=True)
class Diagnostics:
    """Choices and measurements of a solver.

    Attributes
    ----------
    t : float
        Time step used, a squared length.
    t_requested : float
        As requested: `t`, or ``t_coef * h**2``.
    mean_edge_length : float
        h, of the triangulation that was solved on.
    edges_across : float
        Longest shortest path along edges, in units of h.
    n_vertices : int
        Vertices that were solved on: those of the mesh, and those that refinement added.
    n_flips : int
        Edges flipped to make the triangulation intrinsic Delaunay.
    lengthening : float
        The most that was added to an edge length because of degenerate triangles; 0 on other meshes.
    backend : str
        Storage of the factors.
    check : AnswerCheck or None
        Of a `HeatSolution`, by how much the distance left bounds that need no reference. None for the solver.
    compared : Comparison or None
        How far the answer that was farthest off on average is from that of a sweep; None before the first answer, and
        where answers are not compared, see `AnswerCheck`.

    Examples
    --------
    >>> import heat_igl
    >>> diagnostics = heat_igl.HeatMethodSolver(heat_igl.shapes.grid(20), t_coef=1).diagnostics
    >>> round(diagnostics.t / diagnostics.mean_edge_length**2, 6), diagnostics.t_raised
    (1.0, False)
    """

    t: float
    t_requested: float
    mean_edge_length: float
    edges_across: float
    n_vertices: int
    n_flips: int
    lengthening: float
    backend: str
    check: AnswerCheck | None = None
    compared: Comparison | None = None

    @property
    def t_raised(self) -> bool:
        """Whether t was raised to keep the heat inside the double range."""
        return self.t > self.t_requested


@dataclass(frozen=True, eq=False)
class HeatSolution:
    """All three steps of one answer.

    Attributes
    ----------
    heat : (n,) float64
        u of step 1 for a unit of heat on each source (of a region of sources: on those at its rim), per area. If it
        falls below 1e-308 it reads 0; the steps themselves run on a multiple that does not.
    direction : (m, d) float64
        Unit vectors X of step 2, per face of the triangulation that was solved on, d = 3 components in space or
        d = 2 in the face's own frame (`TriangleElements`); 0 on faces without heat.
    magnitude : (m,) float64
        Length that X was given for step 3: 1, or `damping` if heat arrives from several sides.
    distance : (n,) float64
        As `HeatMethodSolver.distance` returns it.
    t : float
        Time step; of several, see `HeatMethodSolver.time_steps`, that of the largest component.
    diagnostics : Diagnostics
        The solver's.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.disk(30)
    >>> solution = heat_igl.HeatMethodSolver(mesh).solve(0)
    >>> bool(np.allclose(np.linalg.norm(solution.direction, axis=1), 1))
    True
    >>> int(solution.heat.argmax()), int(solution.distance.argmin())
    (0, 0)
    """

    heat: FloatArray
    direction: FloatArray
    magnitude: FloatArray
    distance: FloatArray
    t: float
    diagnostics: Diagnostics

    def __repr__(self) -> str:
        return f"HeatSolution({len(self.distance)} vertices, t={self.t:.4g})"


@dataclass(frozen=True)
class SolverOptions:
    """The options of `HeatMethodSolver`, with their meanings and defaults; a ValueError where one has no meaning."""

    t_coef: float | None = None
    t: float | None = None
    laplacian: Laplacian = "auto"
    boundary: Boundary = "neumann"
    magnitude: Magnitude = "auto"
    backend: Backend = "auto"

    def __post_init__(self) -> None:
        for name in ("t_coef", "t"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, positive(name, value))
        check_laplacian(self.laplacian)
        require_choice("boundary", self.boundary, get_args(Boundary))
        require_choice("magnitude", self.magnitude, get_args(Magnitude))
        require_choice("backend", self.backend, get_args(Backend))

    @property
    def default_time_step(self) -> bool:
        """Whether the time step is left to the solver."""
        return self.t_coef is None and self.t is None

    @property
    def holds_to_bounds(self) -> bool:
        """Whether answers are held to bounds: neither the paper's field, a time step nor a boundary was asked for."""
        asked_for_unit = self.magnitude == "unit" or (self.magnitude == "auto" and self.laplacian == "cotan")
        return not asked_for_unit and self.default_time_step and self.boundary == "neumann"

    def damps(self, domain: Operators) -> bool:
        """Whether the field is damped on faces with heat from several sides: ``magnitude="auto"`` resolved."""
        if self.magnitude == "auto":
            return domain.is_surface and self.laplacian != "cotan"
        return self.magnitude == "damped"


def time_step(options: SolverOptions, domain: Operators, fitted: bool) -> tuple[float | FloatArray, float | FloatArray]:
    """The time step for `domain`, and the one that was asked for: ``options.t``, or ``t_coef * h**2``.

    Each is a number, or one (n_components,) for each component if their mean edge lengths h differ. Warns if an
    explicit t had to be raised for the heat to cross the domain.
    """
    if options.t is not None:
        step = max(options.t, smallest_time_step(domain.longest_distance, domain.mean_edge_length, fitted))
        if step > options.t:
            warn_caller(
                f"t = {options.t:.4g} is too small for heat to cross the mesh in double precision; using {step:.4g}",
                AccuracyWarning,
            )
        return step, options.t
    t_coef: float | FloatArray | None = options.t_coef
    if t_coef is None:
        t_coef = plan.T_COEF
        if fitted:
            t_coef = np.where(is_rough_or_narrow(domain), plan.T_COEF_ROUGH, plan.T_COEF_FITTED)
    requested = t_coef * domain.mean_edge_lengths**2
    steps = np.maximum(requested, smallest_time_steps(domain, fitted))
    used = np.unique(domain.components[domain.referenced])
    if len(used) == 1:
        return float(steps[used[0]]), float(requested[used[0]])
    return steps, requested


def check_large_step(options: SolverOptions, domain: Operators) -> None:
    """Warn if the step that was asked for is so large that heat is nearly level over the whole domain.

    Raise ValueError if M - t L would be singular in double precision.

    Heat falls like exp(-d / sqrt(t)). With sqrt(t) above the longest distance it falls by less than a factor of e
    altogether, and distances follow the shape of the domain more than the way to the source.
    """
    step = options.t
    if step is None and options.t_coef is not None:
        step = options.t_coef * domain.mean_edge_length**2
    name, value = ("t", options.t) if options.t is not None else ("t_coef", options.t_coef)
    if step is not None and np.sqrt(step) > plan.FARTHEST_SPREAD * domain.longest_distance:
        raise ValueError(
            f"{name} = {value:.4g} is too large: heat spreads over sqrt(t) = {np.sqrt(step):.4g}, and the longest "
            f"distance on the mesh is {domain.longest_distance:.4g}, so heat is level; t is a squared length"
        )
    if step is not None and np.sqrt(step) > domain.longest_distance:
        warn_caller(
            f"{name} = {value:.4g} is very large: heat spreads over sqrt(t) = {np.sqrt(step):.4g}, more than the "
            f"longest distance on the mesh, {domain.longest_distance:.4g}, and distances are smoothed by as much; "
            "t_coef from 0.5 to 10 is usual, and t is a squared length",
            AccuracyWarning,
        )


@dataclass(frozen=True, eq=False)
class SolverParts:
    """The parts of a heat method solver.

    `analysis` is the order of elimination that all matrices share, `time_steps` (n_components,) has a step for each
    component, and `t_damping` is the step for `damping`, None for a field of length 1. `comparisons` is None if answers
    are not held to bounds.
    """

    options: SolverOptions
    operators: Operators
    analysis: Analysis
    assembler: SourceAssembler
    heat_flow: HeatFlow
    divergence: NormalizedDivergence
    poisson: PoissonProblem
    time_steps: FloatArray
    t_damping: float | FloatArray | None
    fitted: bool
    checker: Checker
    comparisons: Comparisons | None
    plan: Plan
    diagnostics: Diagnostics


def prepare_mesh(
    mesh: Mesh | PointCloud | PolygonMesh, options: SolverOptions, known: Analysis | None = None
) -> SolverParts:
    """The parts of a solver on `mesh`; a `known` order of elimination is taken if it fits."""
    if isinstance(mesh, PolygonMesh):
        return prepare(fan_operators(mesh, options.laplacian), options, V=mesh.V)
    begun: list[Future[Analysis]] = []
    with Pool(1) as beside:

        def analyse(L: sp.csc_matrix) -> None:
            begun.append(beside.submit(analysis, L, options.backend, None))

        # The order of elimination takes a third of the time and needs no more than the pattern of L.
        on_laplacian = analyse if known is None and n_threads() > 1 else None
        usual = None
        if isinstance(mesh, PointCloud):
            domain = point_cloud_operators(mesh, options.laplacian, on_laplacian)
            sides = np.sort(igl.edge_lengths(mesh.triangles.V, mesh.triangles.F), axis=1)
            ratio = np.median(sides[:, 2] / np.maximum(sides[:, 0], np.finfo(float).tiny))
            usual = plan.T_COEF_RANDOM_POINTS if ratio > plan.RANDOM_SIDES else plan.T_COEF_EVEN_POINTS
        else:
            domain = operators(mesh, options.laplacian, on_laplacian)
        return prepare(domain, options, begun[0].result if begun else lambda: known, mesh.V, usual)


def prepare(
    domain: Operators,
    options: SolverOptions,
    known: Callable[[], Analysis | None] = lambda: None,
    V: FloatArray | None = None,
    t_coef: float | None = None,
) -> SolverParts:
    """The parts of a solver on `domain`: resolve the options, then factor the matrices.

    `known` is called, when it is needed, for an order of elimination, which is taken if it fits. Positions V (n, 3) are
    for the check of answers against straight lines. `t_coef` is the default of the domain, if it has its own.
    """
    damped = options.damps(domain)
    fitted = damped and domain.lengths is not None
    chosen = replace(options, t_coef=t_coef) if options.default_time_step else options
    step, requested = time_step(chosen, domain, fitted)
    check_large_step(options, domain)
    t_damping = step if damped else None
    found = analysis(domain.L, options.backend, known())
    # Both matrices at once: the backends run without the interpreter's lock. The Poisson problem is done first, and
    # the divergence follows on that thread.
    makers: list[Callable[[], Any]] = [
        lambda: PoissonProblem(domain, options.backend, found),
        lambda: HeatFlow(domain, step, options.boundary, options.backend, found, fitted),
        lambda: NormalizedDivergence(domain, t_damping, found.order, fitted),
    ]
    # scipy's SuperLU keeps the memory of a factor that is made on one thread and dropped on another, as a solver is.
    threads = 1 if found.backend == "scipy" else min(2, n_threads())
    with naming_thinnest(domain.source_surface):
        poisson, heat_flow, divergence = in_order(lambda make: make(), makers, threads)
    assembler = SourceAssembler(domain, step, heat_flow.mean_mass, plain=not damped)
    triangulation = None if domain.surface is None else domain.surface.triangulation
    diagnostics = Diagnostics(
        t=_of_largest(step, domain),
        t_requested=_of_largest(requested, domain),
        mean_edge_length=domain.mean_edge_length,
        edges_across=domain.longest_distance / domain.mean_edge_length,
        n_vertices=domain.n,
        n_flips=triangulation.n_flips if triangulation else 0,
        lengthening=triangulation.lengthening if triangulation else 0.0,
        backend=heat_flow.backend,
    )
    is_comparable = domain.surface is not None or domain.simplices is not None
    return SolverParts(
        options=options,
        operators=domain,
        analysis=found,
        assembler=assembler,
        heat_flow=heat_flow,
        divergence=divergence,
        poisson=poisson,
        time_steps=np.broadcast_to(step, domain.n_components),
        t_damping=t_damping,
        fitted=fitted,
        checker=Checker(domain, V, options.holds_to_bounds),
        comparisons=Comparisons(domain) if is_comparable and options.holds_to_bounds else None,
        plan=heat_plan(domain.n_given, domain.n, domain.is_surface, diagnostics.t, domain.mean_edge_length),
        diagnostics=diagnostics,
    )


def _of_largest(step: float | FloatArray, domain: Operators) -> float:
    """The time step of the component with the most vertices, if there is one for each component."""
    return float(step[np.bincount(domain.components).argmax()]) if isinstance(step, np.ndarray) else step
