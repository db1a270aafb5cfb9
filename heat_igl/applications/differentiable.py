"""What the adapters have in common: positions as the solver takes them, and one solver per call."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.geodesic import GeodesicSolver
from heat_igl.mesh import Mesh


def check_positions(shape: tuple[int, ...], is_floating: bool, kind: str) -> None:
    """Raise an error if positions cannot be differentiated: a TypeError by their type, a ValueError by their shape."""
    if not is_floating:
        raise TypeError(f"V must hold floating-point numbers to be differentiated, not {kind}: convert it to float64")
    if len(shape) != 2 or shape[1] != 3:
        raise ValueError(f"V must have shape (n, 3), but it has shape {tuple(shape)}")


def solver_on(V: Any, F: Any, solver: GeodesicSolver | None, options: dict[str, Any]) -> GeodesicSolver:
    """A solver on positions V (n, 3) and faces F, made from `solver` by moving its vertices if it is given."""
    positions = np.asarray(V, np.float64)
    if solver is None:
        return GeodesicSolver(Mesh(positions, F), **options)
    if not isinstance(solver, GeodesicSolver):
        raise TypeError(f"solver must be a GeodesicSolver, which has derivatives, not {type(solver).__name__}")
    if options:
        raise ValueError(f"{', '.join(options)} cannot be changed: the solver that was passed has its options")
    return solver.with_vertices(positions)
