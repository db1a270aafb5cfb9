"""`SolverOptions`: the options of a heat method solver, checked once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, get_args

from heat_igl.errors import positive, require_choice
from heat_igl.linear import Backend
from heat_igl.mesh import PointCloud
from heat_igl.operators import Laplacian, Operators, check_laplacian
from heat_igl.steps import Boundary
from heat_igl.unfolding import Refine

__all__ = ["Backend", "Boundary", "Laplacian", "Magnitude", "Refine", "SolverOptions"]

Magnitude = Literal["auto", "unit", "damped"]


@dataclass(frozen=True)
class SolverOptions:
    """The options of `HeatMethodSolver`, with their meanings and defaults; checked when they are put together.

    Attributes
    ----------
    t_coef, t, laplacian, boundary, magnitude, refine, backend
        As for `HeatMethodSolver`.

    Raises
    ------
    ValueError
        If an option has no meaning.
    """

    t_coef: float | None = None
    t: float | None = None
    laplacian: Laplacian = "auto"
    boundary: Boundary = "neumann"
    magnitude: Magnitude = "auto"
    refine: Refine | None = None
    backend: Backend = "auto"

    def __post_init__(self) -> None:
        for name in ("t_coef", "t"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, positive(name, value))
        check_laplacian(self.laplacian)
        require_choice("boundary", self.boundary, get_args(Boundary))
        require_choice("magnitude", self.magnitude, get_args(Magnitude))
        require_choice("refine", self.refine, (None, *get_args(Refine)))
        require_choice("backend", self.backend, get_args(Backend))

        if self.refine is not None and self.laplacian == "intrinsic-delaunay-refined":
            raise ValueError(
                f"refine={self.refine!r} unfolds the triangles of the mesh, and takes no more than an order from the "
                "heat: leave laplacian='intrinsic-delaunay-refined' away"
            )

    @property
    def triangulation(self) -> Laplacian:
        """The `laplacian` for `operators`: if heat is needed for an order alone, any Delaunay one does."""
        return "intrinsic-delaunay" if self.laplacian == "auto" and self.refine is not None else self.laplacian

    @property
    def n_factors(self) -> int:
        """How many matrices are factored: with `refine`, no Poisson problem."""
        return 2 if self.refine is None else 1

    @property
    def default_time_step(self) -> bool:
        """Whether the time step is left to the solver."""
        return self.t_coef is None and self.t is None

    @property
    def leaves_heat(self) -> bool:
        """Whether fronts may take the place of heat: where no magnitude, time step, boundary or Laplacian is named."""
        is_default = self.magnitude == "auto" and self.boundary == "neumann" and self.laplacian != "cotan"
        return self.refine == "sweep" or (self.refine is None and is_default and self.default_time_step)

    @property
    def leaves_points(self) -> bool:
        """Whether a sweep may take the place of heat on points: where nothing of the heat method is named."""
        return self.refine is None and self.leaves_heat and self.laplacian == "auto"

    @property
    def names_no_heat(self) -> bool:
        """Whether nothing of the heat method is named, so that a sweep of points may do without heat."""
        is_default = self.magnitude == "auto" and self.boundary == "neumann" and self.default_time_step
        return self.refine == "sweep" and is_default and self.laplacian in ("auto", "intrinsic-delaunay")

    def by_heat_on(self, mesh: object) -> SolverOptions:
        """The options with which a solver on `mesh` takes heat, where they leave that open: points are swept."""
        return replace(self, magnitude="damped") if isinstance(mesh, PointCloud) and self.leaves_points else self

    def damps(self, domain: Operators) -> bool:
        """Whether the field is damped on faces with heat from several sides: ``magnitude="auto"`` resolved."""
        if self.magnitude == "auto":
            return domain.is_surface and self.laplacian != "cotan"
        return self.magnitude == "damped"
