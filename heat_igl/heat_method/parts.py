"""What a solver prepares before its first query: operators, options resolved on them, and all that is factored."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any

import scipy.sparse as sp

from heat_igl.heat_method.integration import Integration
from heat_igl.heat_method.options import SolverOptions
from heat_igl.heat_method.solution import Diagnostics
from heat_igl.heat_method.time_step import time_step
from heat_igl.linear import Analysis
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.operators import Operators, operators, point_cloud_operators
from heat_igl.runtime import in_order, n_threads, pool
from heat_igl.sources import SourceAssembler
from heat_igl.steps import HeatFlow, NormalizedDivergence, PoissonProblem, analysis
from heat_igl.typing import IntArray
from heat_igl.unfolding import UnfoldingSolver

__all__ = ["SolverParts", "prepare", "prepare_mesh"]

# For scattered points, whose triangles differ more in size than those of a mesh: between two aims, see docs/clouds.md.
_T_COEF_OF_POINTS = 1.0


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
        Step 1.
    last_steps : Integration or UnfoldingSolver
        Steps 2 and 3, or what takes their place with ``refine``.
    t_damping : float or None
        Time step for `damping`; None for a field of length 1.
    fitted : bool
        Whether the heat flow is fitted to the lengths of edges.
    diagnostics : Diagnostics
        For the user.
    """

    options: SolverOptions
    operators: Operators
    analysis: Analysis
    assembler: SourceAssembler
    heat_flow: HeatFlow
    last_steps: Integration | UnfoldingSolver
    t_damping: float | None
    fitted: bool
    diagnostics: Diagnostics

    @property
    def given_faces(self) -> IntArray | None:
        """Vertices (m, 3) of the triangles that points and curves refer to."""
        return None if self.operators.surface is None else self.operators.surface.given_faces


def prepare_mesh(mesh: Mesh | PointCloud, options: SolverOptions, known: Analysis | None = None) -> SolverParts:
    """The parts of a solver on `mesh`; a `known` order of elimination is taken if it fits."""
    start = time.perf_counter()
    if isinstance(mesh, PointCloud) and options.t_coef is None:
        options = replace(options, t_coef=_T_COEF_OF_POINTS)
    begun: list[Future[Analysis]] = []
    with pool(1) as beside:

        def analyse(L: sp.csc_matrix) -> None:
            begun.append(beside.submit(analysis, L, options.backend))

        # The order of elimination takes a third of the time and needs no more than the pattern of L.
        on_laplacian = analyse if known is None and n_threads() > 1 else None
        if isinstance(mesh, PointCloud):
            domain = point_cloud_operators(mesh, options.laplacian, on_laplacian)
        else:
            domain = operators(mesh, options.laplacian, on_laplacian)
        seconds = time.perf_counter() - start
        known = begun[0].result() if begun else known
    waited = time.perf_counter() - start - seconds
    return prepare(domain, options, known, seconds, waited)


def prepare(
    domain: Operators,
    options: SolverOptions,
    known: Analysis | None = None,
    seconds_operators: float = 0.0,
    seconds_analysis: float = 0.0,
) -> SolverParts:
    """The parts of a solver on `domain`: resolve the options, then factor what they ask for.

    Parameters
    ----------
    domain : Operators
        The domain.
    options : SolverOptions
        What is asked for.
    known : Analysis, optional
        An order of elimination, taken if it fits.
    seconds_operators, seconds_analysis : float
        Time spent before, for the diagnostics.
    """
    start = time.perf_counter()
    damped = options.damps(domain)
    fitted = damped and domain.lengths is not None
    step, requested = time_step(options, domain, fitted)
    t_damping = step if damped else None
    found = analysis(domain.L, options.backend, known)
    analysed = time.perf_counter()
    makers: list[Callable[[], Any]] = [
        lambda: HeatFlow(domain, step, options.boundary, options.backend, found, fitted),
    ]
    if options.refine is None:
        makers.append(lambda: PoissonProblem(domain, options.backend, found))
    # Both matrices at once: the backends run without the interpreter's lock.
    heat_flow, *poisson = in_order(lambda make: make(), makers, min(len(makers), n_threads()))
    factored = time.perf_counter()
    assembler = SourceAssembler(domain, step, plain=not damped, unfolds=options.refine is not None)
    last_steps: Integration | UnfoldingSolver
    if options.refine is not None:
        last_steps = UnfoldingSolver(domain, options.refine)
    else:
        divergence = NormalizedDivergence(domain, t_damping, found.order, fitted)
        last_steps = Integration(domain, heat_flow, divergence, poisson[0], t_damping, fitted, assembler.edges)
    triangulation = None if domain.surface is None else domain.surface.triangulation
    factors = heat_flow.factors + [problem.factor for problem in poisson]
    diagnostics = Diagnostics(
        t=step,
        t_requested=requested,
        mean_edge_length=domain.mean_edge_length,
        edges_across=domain.longest_distance / domain.mean_edge_length,
        n_flips=triangulation.n_flips if triangulation else 0,
        lengthening=triangulation.lengthening if triangulation else 0.0,
        backend=heat_flow.backend,
        seconds_operators=seconds_operators,
        factor_nonzeros=sum(factor.nonzeros for factor in factors),
        factor_bytes=sum(factor.n_bytes for factor in factors),
        seconds_analysis=seconds_analysis + analysed - start,
        seconds_factorization=factored - analysed,
    )
    return SolverParts(options, domain, found, assembler, heat_flow, last_steps, t_damping, fitted, diagnostics)
