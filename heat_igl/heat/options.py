"""`SolverOptions`: the options of a heat method solver, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from heat_igl.errors import positive, require_choice
from heat_igl.linear import Backend
from heat_igl.operators import Laplacian, Operators, check_laplacian
from heat_igl.steps import Boundary

__all__ = ["Backend", "Boundary", "Laplacian", "Magnitude", "SolverOptions"]

Magnitude = Literal["auto", "unit", "damped"]


@dataclass(frozen=True)
class SolverOptions:
    """The options of `HeatMethodSolver`, with their meanings and defaults; checked when they are put together.

    Attributes
    ----------
    t_coef, t, laplacian, boundary, magnitude, backend
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

    def damps(self, domain: Operators) -> bool:
        """Whether the field is damped on faces with heat from several sides: ``magnitude="auto"`` resolved."""
        if self.magnitude == "auto":
            return domain.is_surface and self.laplacian != "cotan"
        return self.magnitude == "damped"
