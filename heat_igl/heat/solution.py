"""Results of a solver: a frozen solution with diagnostics, in place of printed status."""

from __future__ import annotations

from dataclasses import dataclass

from heat_igl.heat.checking import AnswerCheck, Comparison
from heat_igl.typing import FloatArray


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
    factor_nonzeros, factor_bytes : int
        Entries of all factors, and the memory that a query reads twice, indices included.
    seconds_operators, seconds_analysis, seconds_factorization : float
        Wall-clock time of the stages of the constructor: operators; order of elimination, which begins beside them, as
        far as it takes longer; factors.
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
    factor_nonzeros: int
    factor_bytes: int
    seconds_operators: float
    seconds_analysis: float
    seconds_factorization: float
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
        Time step.
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
