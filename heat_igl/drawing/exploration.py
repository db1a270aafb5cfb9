"""A mesh that is explored: sources and options change, and the distance follows. No window is involved."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from heat_igl import reference
from heat_igl.errors import FactorizationError, MissingExtraError, ReferenceSolverError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh
from heat_igl.sources import Sources, vertex_sources
from heat_igl.steps import Boundary
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding import Refine

__all__ = ["Exploration", "Options"]

# Factored solvers to keep, since going back and forth between two settings is what one does.
_KEPT_SOLVERS = 4


@dataclass(frozen=True)
class Options:
    """What can be changed in the window, as `HeatMethodSolver` takes it."""

    t_coef: float | None = None
    boundary: Boundary = "neumann"
    refine: Refine | None = None


class Exploration:
    """A mesh, the sources chosen on it and the distance from them, always in step.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    sources : int, sequence of int, or (n,) mask of bool
        To start with.
    options : Options
        To start with.

    Attributes
    ----------
    mesh, options
        As given; `change` changes the options.
    sources : (k,) int64
        `choose` changes them.
    distance : (n,) float64
        From `sources` with `options`.
    t_coef : float
        The time step in use, in squared mean edge lengths.
    error : (n,) float64 or None
        Of `distance`, in percent of the exact distance, 0 at the sources and ``inf`` out of reach; None until
        `compare`, and again after any change.
    message : str
        One line for the user on what was done last, or what went wrong.

    Raises
    ------
    MeshError, SourceError, FactorizationError, MissingExtraError, ValueError
        As for `HeatMethodSolver`.
    """

    def __init__(self, mesh: Mesh, sources: Sources = 0, options: Options | None = None) -> None:
        self.mesh = mesh
        self.options = options or Options()
        self.sources: IntArray = vertex_sources(sources, mesh.n_vertices)
        self.error: FloatArray | None = None
        self._solvers: dict[Options, HeatMethodSolver] = {}
        self._solve(self.sources, self.options)

    def choose(self, vertex: int, add: bool = False) -> None:
        """Make `vertex` the source; with `add`, one more source, or none any more if it was one and not the last."""
        chosen = {vertex}
        if add:
            chosen = set(self.sources.tolist()) ^ {vertex} or {vertex}
        self._solve(vertex_sources(sorted(chosen), self.mesh.n_vertices), self.options)

    def change(self, **options: Any) -> None:
        """Change some of the options; what cannot be solved leaves all as it was, and `message` says why."""
        changed = replace(self.options, **options)
        try:
            self._solve(self.sources, changed)
        except (ValueError, FactorizationError, MissingExtraError) as error:
            self.message = str(error)

    def compare(self) -> None:
        """Find the error against exact distance, which takes seconds; `message` has its mean, or why there is none."""
        try:
            exact = reference.exact(self.mesh, self.sources)
        except (ReferenceSolverError, MissingExtraError) as problem:
            self.message = f"no exact distance: {problem}"
            return
        error = np.where(np.isfinite(exact), 0.0, np.inf)
        away = (exact > 0) & np.isfinite(exact)
        error[away] = 100 * (self.distance[away] / exact[away] - 1)
        self.error = error
        mean, largest = (float(of(np.abs(error[away]), initial=0.0)) for of in (np.sum, np.max))
        self.message = f"error {mean / max(int(away.sum()), 1):.3g} % in the mean, {largest:.3g} % at most"

    def _solve(self, sources: IntArray, options: Options) -> None:
        start = time.perf_counter()
        solver = self._solvers.pop(options, None)
        is_new = solver is None
        if solver is None:
            solver = HeatMethodSolver(
                self.mesh, t_coef=options.t_coef, boundary=options.boundary, refine=options.refine
            )
        self._solvers[options] = solver  # the last one used comes last
        while len(self._solvers) > _KEPT_SOLVERS:
            del self._solvers[next(iter(self._solvers))]
        self.distance = solver.distance(sources)
        self.t_coef = solver.t / solver.diagnostics.mean_edge_length**2
        self.sources, self.options, self.error = sources, options, None
        finite = np.where(np.isfinite(self.distance), self.distance, -1.0)
        self.message = (
            f"{1000 * (time.perf_counter() - start):.0f} ms{', factored anew' if is_new else ''}; farthest "
            f"{finite.max():.6g} at vertex {int(finite.argmax())}"
        )
        lost = int((finite < 0).sum())
        if lost:
            self.message += f"; {lost} vertices are out of reach"
