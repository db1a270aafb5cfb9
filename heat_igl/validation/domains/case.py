"""One check of a kind of domain: what is measured, the exact distance, and the errors that each method may have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import MeshLike
from heat_igl.operators import Operators
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["OPTIONS", "DomainCase", "Problem", "solver_for"]

#: Options of `HeatMethodSolver` for each method in the rows.
OPTIONS: Mapping[str, Mapping[str, Any]] = {
    "default": {},
    "heat": {"magnitude": "damped"},
    "sweep": {"refine": "sweep"},
    "unfold": {"refine": "unfold"},
    "exact": {"refine": "exact"},
}


class Problem(NamedTuple):
    """A domain, sources on it, and the exact distance (n,) from them."""

    domain: MeshLike | Operators
    sources: Sources
    exact: FloatArray


class DomainCase(NamedTuple):
    """A problem with a known answer.

    Attributes
    ----------
    domain : str
        Kind of domain, one of `DOMAINS`.
    name : str
        The problem, in a few words.
    against : str
        Where the exact distance comes from.
    bounds : mapping of str to float
        The largest mean relative error that a method may have, by the names in `OPTIONS`.
    problem : callable
        Makes the `Problem` from a random generator.
    """

    domain: str
    name: str
    against: str
    bounds: Mapping[str, float]
    problem: Callable[[np.random.Generator], Problem]


def solver_for(domain: MeshLike | Operators, method: str) -> HeatMethodSolver:
    """The solver of a method, on a mesh or on operators."""
    if isinstance(domain, Operators):
        return HeatMethodSolver.from_operators(domain, **OPTIONS[method])
    return HeatMethodSolver(domain, **OPTIONS[method])
