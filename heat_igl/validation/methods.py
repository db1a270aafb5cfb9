"""The methods that a validation compares: what each name stands for, and how one is run and measured."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from heat_igl import reference
from heat_igl.errors import AccuracyWarning, ReferenceSolverError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh
from heat_igl.runtime import PeakMemory
from heat_igl.typing import FloatArray, IntArray

__all__ = ["METHODS", "Counter", "Method", "Prepare", "Progress", "Run", "Solver", "named", "run"]


class Solver(Protocol):
    """What a method of one's own has to look like: `HeatMethodSolver` is one."""

    def distance(self, sources: IntArray, /) -> FloatArray:
        """Distance (n,) from a set of sources."""
        ...


Prepare = Callable[[Mesh], Solver]
Method = str | tuple[str, Prepare]
Progress = Callable[[str, int, int], None]

# Methods that run in this process, by the options of the solver; the others are native references.
_OPTIONS: Mapping[str, Mapping[str, Any]] = {"heat": {}, "sweep": {"refine": "sweep"}, "unfold": {"refine": "unfold"}}
_NATIVE = {
    "meshlab": "meshlab",
    "meshlab_heat": "meshlab_heat",
    "igl": "igl_heat",
    "potpourri3d": "potpourri3d_heat",
    "exact": "exact",
}

#: Names that `validate` knows.
METHODS = (*_OPTIONS, *_NATIVE)


@dataclass(frozen=True, eq=False)
class Run:
    """Distances (k, n) of a method and what they cost; the fields are those of `ValidationRow`."""

    distances: FloatArray
    precompute_seconds: float
    solve_seconds: float
    peak_memory: int | None
    parameters: Mapping[str, Any]
    notes: tuple[str, ...] = ()


class Counter:
    """Tells the caller which distance comes next."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0
        self._block_end = 0

    def start(self, n_distances: int) -> None:
        """A method begins that will take as many steps."""
        self._block_end = self._done + n_distances

    def step(self, label: str) -> None:
        """A distance begins."""
        if self._progress is not None:
            self._progress(label, self._done, self._total)
        self._done += 1

    def skip_to_next(self) -> None:
        """The method is over, wherever it was."""
        self._done = self._block_end

    def finish(self) -> None:
        """All is done."""
        if self._progress is not None:
            self._progress("done", self._total, self._total)


def named(method: Method) -> tuple[str, Prepare | None]:
    """Name of a method, and what prepares its solver; None for native references.

    Raises
    ------
    ValueError
        If the name is unknown, or taken where the method is one's own.
    """
    if not isinstance(method, str):
        if method[0] in METHODS:
            raise ValueError(f"{method[0]!r} names a method of the package: give yours another name")
        return method
    if method in _OPTIONS:
        return method, lambda mesh: _heat_solver(mesh, _OPTIONS[method])
    if method not in _NATIVE:
        raise ValueError(f"method {method!r} is unknown: choose from {', '.join(METHODS)}")
    return method, None


def _heat_solver(mesh: Mesh, options: Mapping[str, Any]) -> Solver:
    if mesh.is_tetrahedral and "refine" in options:
        raise ReferenceSolverError(f"refine={options['refine']!r} unfolds triangles, and the mesh holds tetrahedra")
    return HeatMethodSolver(mesh, **options)


def run(
    mesh: Mesh,
    sets: list[IntArray],
    label: str,
    prepare: Prepare | None,
    bounds: Mapping[str, float],
    counter: Counter,
) -> Run:
    """Distances from each set of sources by a method as `named` gives it; `bounds` are timeout and memory."""
    counter.start(len(sets))
    if prepare is None:
        return _run_native(mesh, sets, label, bounds, counter)
    distances, seconds = [], []
    with PeakMemory() as peak, _noted() as notes:
        start = time.perf_counter()
        solver = prepare(mesh)
        ready = time.perf_counter()
        for sources in sets:
            counter.step(label)
            begin = time.perf_counter()
            distances.append(solver.distance(sources))
            seconds.append(time.perf_counter() - begin)
    diagnostics = getattr(solver, "diagnostics", None)
    parameters = {
        key: getattr(diagnostics, key)
        for key in ("t", "t_requested", "mean_edge_length", "backend")
        if hasattr(diagnostics, key)
    }
    return Run(np.stack(distances), ready - start, float(np.median(seconds)), peak.bytes, parameters, tuple(notes))


@contextmanager
def _noted() -> Iterator[list[str]]:
    """Collect what is said about accuracy, each once, for the report; other warnings go their way."""
    notes: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AccuracyWarning)
        yield notes
    for warning in caught:
        if not issubclass(warning.category, AccuracyWarning):
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
        elif str(warning.message) not in notes:
            notes.append(str(warning.message))


def _run_native(mesh: Mesh, sets: list[IntArray], label: str, bounds: Mapping[str, float], counter: Counter) -> Run:
    solver = _NATIVE[label]
    results = []
    for sources in sets:
        counter.step(label)
        results.append(reference.measured(solver, mesh, sources, **bounds))
    peaks = [result.peak_memory for result in results if result.peak_memory is not None]
    return Run(
        np.stack([result.distance for result in results]),
        float(np.median([result.precompute_seconds for result in results])),
        float(np.median([result.solve_seconds for result in results])),
        max(peaks) if peaks else None,
        {"solver": reference.exact_solver() if solver == "exact" else solver},
    )
