"""Preparation of a solver before the first query: operators, options resolved on them, and factors."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.heat.assembly import SourceAssembler
from heat_igl.heat.checking import Checker, Comparisons
from heat_igl.heat.integration import Integration
from heat_igl.heat.options import SolverOptions
from heat_igl.heat.solution import Diagnostics
from heat_igl.heat.time_step import check_large_step, time_step
from heat_igl.linear import Analysis
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh
from heat_igl.operators import (
    Operators,
    fan_operators,
    operators,
    point_cloud_operators,
)
from heat_igl.plan import RANDOM_SIDES, T_COEF_EVEN_POINTS, T_COEF_RANDOM_POINTS, Plan, heat_plan
from heat_igl.runtime import in_order, n_threads, pool
from heat_igl.steps import HeatFlow, NormalizedDivergence, PoissonProblem, analysis
from heat_igl.typing import FloatArray, IntArray

__all__ = ["SolverParts", "prepare", "prepare_mesh", "prepare_polygons"]


@dataclass(frozen=True, eq=False)
class SolverParts:
    """The parts of a heat method solver.

    Attributes
    ----------
    options : SolverOptions
        As the user gave them.
    operators : Operators
        The domain.
    analysis : Analysis
        The order of elimination that all matrices share.
    assembler : SourceAssembler
        From sources to right-hand sides.
    heat_flow : HeatFlow
        Step 1, factored.
    last_steps : Integration
        Steps 2 and 3.
    time_steps : (n_components,) float64
        Time step of each component.
    t_damping : float, (n_components,) float64 or None
        Time step for `damping`; None for a field of length 1.
    fitted : bool
        Whether the heat flow is fitted to the lengths of edges.
    checker : Checker
        Checks answers against bounds that need no reference.
    comparisons : Comparisons or None
        Compares the first answers with those of another engine; None if answers are not held to bounds.
    plan : Plan
        For the user.
    diagnostics : Diagnostics
        For the user.
    """

    options: SolverOptions
    operators: Operators
    analysis: Analysis
    assembler: SourceAssembler
    heat_flow: HeatFlow
    last_steps: Integration
    time_steps: FloatArray
    t_damping: float | FloatArray | None
    fitted: bool
    checker: Checker
    comparisons: Comparisons | None
    plan: Plan
    diagnostics: Diagnostics

    @property
    def is_default(self) -> bool:
        """Whether answers are held to bounds: neither the paper's field, a time step nor a boundary was asked for."""
        return _is_default(self.options)

    @property
    def n_vertices(self) -> int:
        """Length of a distance array."""
        return self.operators.n_given

    @property
    def n_faces(self) -> int:
        """Faces of the domain."""
        return len(self.operators.weights)

    @property
    def is_surface(self) -> bool:
        """Whether the domain has two dimensions."""
        return self.operators.is_surface

    @property
    def given_faces(self) -> IntArray | None:
        """Vertices (m, 3) of the triangles that points and curves refer to."""
        surface = self.operators.source_surface
        return None if surface is None else surface.given_faces


def prepare_mesh(mesh: Mesh | PointCloud, options: SolverOptions, known: Analysis | None = None) -> SolverParts:
    """The parts of a solver on `mesh`; a `known` order of elimination is taken if it fits."""
    start = time.perf_counter()
    begun: list[Future[Analysis]] = []
    with pool(1) as beside:

        def analyse(L: sp.csc_matrix) -> None:
            begun.append(beside.submit(analysis, L, options.backend, None))

        # The order of elimination takes a third of the time and needs no more than the pattern of L.
        on_laplacian = analyse if known is None and n_threads() > 1 else None
        if isinstance(mesh, PointCloud):
            domain = point_cloud_operators(mesh, options.laplacian, on_laplacian)
            if options.default_time_step:
                options = replace(options, t_coef=_t_coef_of_points(mesh.triangles))
        else:
            domain = operators(mesh, options.laplacian, on_laplacian)
        seconds = time.perf_counter() - start
        return prepare(domain, options, begun[0].result if begun else lambda: known, seconds, mesh.V)


def _t_coef_of_points(triangles: Mesh) -> float:
    sides = np.sort(igl.edge_lengths(triangles.V, triangles.F), axis=1)
    ratio = np.median(sides[:, 2] / np.maximum(sides[:, 0], np.finfo(float).tiny))
    return T_COEF_RANDOM_POINTS if ratio > RANDOM_SIDES else T_COEF_EVEN_POINTS


def prepare_polygons(mesh: PolygonMesh, options: SolverOptions) -> SolverParts:
    """The parts of a solver on the triangles around the virtual vertices of polygons."""
    start = time.perf_counter()
    domain = fan_operators(mesh, options.laplacian)
    return prepare(domain, options, seconds_operators=time.perf_counter() - start, V=mesh.V)


def prepare(
    domain: Operators,
    options: SolverOptions,
    known: Callable[[], Analysis | None] = lambda: None,
    seconds_operators: float = 0.0,
    V: FloatArray | None = None,
) -> SolverParts:
    """The parts of a solver on `domain`: resolve the options, then factor the matrices.

    Parameters
    ----------
    domain : Operators
        The domain.
    options : SolverOptions
        The options.
    known : callable
        An order of elimination, taken if it fits; called when it is needed.
    seconds_operators : float
        Time spent before, for the diagnostics.
    V : (n, 3) float64, optional
        Positions, to check answers against straight lines.
    """
    damped = options.damps(domain)
    fitted = damped and domain.lengths is not None
    step, requested = time_step(options, domain, fitted)
    check_large_step(options, domain)
    t_damping = step if damped else None
    begun = time.perf_counter()
    found = analysis(domain.L, options.backend, known())
    analysed = time.perf_counter()
    heat_flow, poisson, divergence = _factored(domain, options, step, found, t_damping, fitted)
    factored = time.perf_counter()
    assembler = SourceAssembler(domain, step, heat_flow.mean_mass, plain=not damped)
    last_steps = Integration(domain, heat_flow, divergence, poisson, t_damping, fitted, assembler.edges)
    triangulation = None if domain.surface is None else domain.surface.triangulation
    factors = [*heat_flow.factors, poisson.factor]
    diagnostics = Diagnostics(
        t=_of_largest(step, domain),
        t_requested=_of_largest(requested, domain),
        mean_edge_length=domain.mean_edge_length,
        edges_across=domain.longest_distance / domain.mean_edge_length,
        n_vertices=domain.n,
        n_flips=triangulation.n_flips if triangulation else 0,
        lengthening=triangulation.lengthening if triangulation else 0.0,
        backend=heat_flow.backend,
        seconds_operators=seconds_operators,
        factor_nonzeros=sum(factor.nonzeros for factor in factors),
        factor_bytes=sum(factor.n_bytes for factor in factors),
        seconds_analysis=analysed - begun,
        seconds_factorization=factored - analysed,
    )
    is_triangles = domain.surface is not None and domain.fans is None
    return SolverParts(
        options=options,
        operators=domain,
        analysis=found,
        assembler=assembler,
        heat_flow=heat_flow,
        last_steps=last_steps,
        time_steps=np.broadcast_to(step, domain.n_components),
        t_damping=t_damping,
        fitted=fitted,
        checker=Checker(domain.source_surface, domain.referenced[: domain.n_given], V),
        comparisons=Comparisons(domain) if is_triangles and _is_default(options) else None,
        plan=heat_plan(domain.n_given, domain.n, domain.is_surface, diagnostics.t, domain.mean_edge_length),
        diagnostics=diagnostics,
    )


def _factored(
    domain: Operators,
    options: SolverOptions,
    step: float | FloatArray,
    found: Analysis,
    t_damping: float | FloatArray | None,
    fitted: bool,
) -> tuple[HeatFlow, PoissonProblem, NormalizedDivergence]:
    """The heat flow, the Poisson problem and the divergence."""

    def flow() -> HeatFlow:
        return HeatFlow(domain, step, options.boundary, options.backend, found, fitted)

    # Both matrices at once: the backends run without the interpreter's lock. The Poisson problem is done first, and
    # the divergence follows on that thread.
    makers: list[Callable[[], Any]] = [
        lambda: PoissonProblem(domain, options.backend, found),
        flow,
        lambda: NormalizedDivergence(domain, t_damping, found.order, fitted),
    ]
    # scipy's SuperLU keeps the memory of a factor that is made on one thread and dropped on another, as a solver is.
    threads = 1 if found.backend == "scipy" else min(2, n_threads())
    poisson, heat_flow, divergence = in_order(lambda make: make(), makers, threads)
    return heat_flow, poisson, divergence


def _is_default(options: SolverOptions) -> bool:
    asked_for_unit = options.magnitude == "unit" or (options.magnitude == "auto" and options.laplacian == "cotan")
    return not asked_for_unit and options.default_time_step and options.boundary == "neumann"


def _of_largest(step: float | FloatArray, domain: Operators) -> float:
    """Of one number for each component, that of the component with most vertices."""
    return float(step[np.bincount(domain.components).argmax()]) if isinstance(step, np.ndarray) else step
