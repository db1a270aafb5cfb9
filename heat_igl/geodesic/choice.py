"""`SolverChoice`: which solver to make on a mesh, with its options, as commands, views and batches pass it on."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any, get_args

from heat_igl.errors import require_choice
from heat_igl.geodesic.solver import GeodesicSolver
from heat_igl.heat import HeatMethodSolver, SolverOptions
from heat_igl.mesh import MeshLike
from heat_igl.operators import Operators
from heat_igl.plan import DistanceMethod
from heat_igl.typing import ArrayLike

Solver = GeodesicSolver | HeatMethodSolver


@dataclass(frozen=True)
class SolverChoice:
    """A method of distance with its options; hashable.

    "heat" is `HeatMethodSolver`, with the options `heat`; the others are methods of `GeodesicSolver`, as `tolerance` is
    its.
    """

    method: DistanceMethod = "auto"
    tolerance: float = 1e-5
    heat: SolverOptions = field(default_factory=SolverOptions)

    def __post_init__(self) -> None:
        require_choice("method", self.method, get_args(DistanceMethod))

    @classmethod
    def of(cls, method: str | None = None, tolerance: float = 1e-5, **options: Any) -> SolverChoice:
        """A choice by options as users give them: those of heat ask for heat.

        Raises
        ------
        ValueError
            If an option has no meaning, or is one of heat and another method is named.
        TypeError
            If there is no such option.
        """
        heat = SolverOptions(**options)
        given = [option.name for option in fields(heat) if getattr(heat, option.name) != option.default]
        if given and method not in (None, "heat"):
            raise ValueError(f"{given[0]} is an option of the heat method, but the method is {method}: leave one away")
        return cls(method or ("heat" if given else "auto"), tolerance, heat)  # type: ignore[arg-type]

    def on(self, mesh: MeshLike | Operators, region: ArrayLike | None = None) -> Solver:
        """The solver on a mesh, or on operators."""
        if self.method == "heat":
            return HeatMethodSolver(mesh, region=region, **vars(self.heat))
        return GeodesicSolver(mesh, method=self.method, tolerance=self.tolerance, region=region)
