"""`GuardedEngine`: an engine whose answers are checked, and replaced where they contradict themselves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourceSet
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding.engine import Engine
from heat_igl.unfolding.invariants import Invariants

__all__ = ["GuardedEngine"]

_REPORT = "please report this as a bug, with the mesh and the sources"


class GuardedEngine(Engine):
    """An engine with a check of every answer. A contradiction never leaves it.

    Parameters
    ----------
    engine : Engine
        Asked first.
    invariants : Invariants
        What its answers keep.
    tolerance : float
        Violations by this share of the largest distance are no contradiction.
    others : sequence of callables
        Engines to ask instead, each made when it is needed.

    Raises
    ------
    RuntimeError
        On a query, if the answers of all engines contradict the invariants.

    Warns
    -----
    AccuracyWarning
        On a query that another engine answered.
    """

    def __init__(
        self, engine: Engine, invariants: Invariants, tolerance: float, others: tuple[Callable[[], Engine], ...]
    ) -> None:
        self._engine, self._invariants, self._tolerance, self._others = engine, invariants, tolerance, others

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        found = self._engine.distance(sources, cutoff, threads)
        problem = self.problem(found, sources, cutoff)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)[0]

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from."""
        found = self._engine.labelled(sources, cutoff, threads)
        problem = self.problem(found[0], sources, cutoff)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)

    def problem(self, distance: FloatArray, sources: SourceSet, cutoff: float = np.inf) -> str | None:
        """How an answer (n,) contradicts the invariants; None if it does not."""
        return self._invariants.contradiction(distance, sources, cutoff, self._tolerance)

    def require(self, distance: FloatArray, sources: SourceSet) -> None:
        """Refuse an answer (n,) with paths that contradicts the invariants: there is no other engine for it."""
        problem = self.problem(distance, sources)
        if problem is not None:
            raise RuntimeError(f"the distance contradicts itself ({problem}): {_REPORT}")

    def _replacement(
        self, problem: str, sources: SourceSet, cutoff: float, threads: int
    ) -> tuple[FloatArray, IntArray]:
        for make in self._others:
            found = make().labelled(sources, cutoff, threads)
            if self.problem(found[0], sources, cutoff) is None:
                warn_caller(
                    f"the distance contradicted itself ({problem}) and was replaced by that of another method, which "
                    f"is less accurate: {_REPORT}",
                    AccuracyWarning,
                )
                return found
        raise RuntimeError(f"the distance contradicts itself ({problem}), whatever method finds it: {_REPORT}")
