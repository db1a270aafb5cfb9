"""One check of a kind of domain: what is measured, the exact distance, and the errors that each method may have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from heat_igl.geodesic import DistanceMethod, Solver, SolverChoice
from heat_igl.mesh import MeshLike
from heat_igl.operators import Operators
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["METHODS", "DomainCase", "Problem", "solver_for"]

#: Methods in the rows; "default" is what `GeodesicSolver` takes by itself.
METHODS: Mapping[str, DistanceMethod] = {
    "default": "auto",
    "heat": "heat",
    "sweep": "sweep",
    "windows": "windows",
    "exact": "exact",
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
        The largest mean relative error that a method may have, by the names in `METHODS`.
    problem : callable
        Makes the `Problem` from a random generator.
    """

    domain: str
    name: str
    against: str
    bounds: Mapping[str, float]
    problem: Callable[[np.random.Generator], Problem]


def solver_for(domain: MeshLike | Operators, method: str) -> Solver:
    """The solver of a method, on a mesh or on operators."""
    return SolverChoice(METHODS[method]).on(domain)
