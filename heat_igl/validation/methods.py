"""The methods that a validation compares, by name, and how one of them is run and its cost measured."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from heat_igl import reference
from heat_igl.errors import AccuracyWarning, shown
from heat_igl.geodesic import DistanceMethod, SolverChoice
from heat_igl.mesh import Mesh, PointCloud, PolygonMesh, as_simplices
from heat_igl.runtime import PeakMemory
from heat_igl.typing import FloatArray, IntArray


class Solver(Protocol):
    """The interface of a method; `GeodesicSolver` has it."""

    def distance(self, sources: IntArray, /) -> FloatArray:
        """Distance (n,) from a set of sources."""
        ...


Prepare = Callable[[Any], Solver]
Method = str | tuple[str, Prepare]
Progress = Callable[[str, int, int], None]
Run = tuple[FloatArray, dict[str, Any]]
"""Distances (k, n) of a method, and their cost: fields of `ValidationRow` by name."""

# Methods that run in this process, as `geodesic_distance` names them; the others are native references.
_OWN: tuple[DistanceMethod, ...] = ("heat", "sweep", "windows")
_NATIVE = {
    "meshlab": "meshlab",
    "meshlab_heat": "meshlab_heat",
    "igl": "igl_heat",
    "potpourri3d": "potpourri3d_heat",
    "exact": "exact",
}

#: The names of methods that `validate` takes.
METHODS = (*_OWN, *_NATIVE)


def resolved(method: Method) -> tuple[str, Prepare | None]:
    """Name of a method, and the function that makes its solver; None for native references.

    A ValueError if the name is unknown, or if a pair has a name from `METHODS`.
    """
    if not isinstance(method, str):
        if not (isinstance(method, tuple) and len(method) == 2 and isinstance(method[0], str) and callable(method[1])):
            raise ValueError(f"a method is a name or a pair (name, function that makes a solver), not {shown(method)}")
        if method[0] in METHODS:
            raise ValueError(f"{method[0]!r} names a method of the package: give yours another name")
        return method
    if method in _OWN:
        return method, SolverChoice.of(method).on
    if method not in _NATIVE:
        raise ValueError(f"method {method!r} is unknown: choose from {', '.join(METHODS)}")
    return method, None


def run(
    mesh: Mesh | PolygonMesh | PointCloud,
    sets: list[IntArray],
    label: str,
    prepare: Prepare | None,
    bounds: Mapping[str, float],
    begun: Callable[[str, int], None],
) -> Run:
    """Distances from each set of sources by a method from `resolved`; `bounds` are timeout and memory.

    `begun` is called before each distance, with the name of the method and the index of the set.
    """
    if prepare is None:
        return _run_native(as_simplices(mesh), sets, label, bounds, begun)
    distances, seconds = [], []
    with PeakMemory() as peak, _accuracy_notes() as notes:
        start = time.perf_counter()
        solver = prepare(mesh)
        ready = time.perf_counter()
        for i, sources in enumerate(sets):
            begun(label, i)
            begin = time.perf_counter()
            distances.append(solver.distance(sources))
            seconds.append(time.perf_counter() - begin)
    diagnostics = getattr(solver, "diagnostics", None)
    parameters = {
        key: getattr(diagnostics, key)
        for key in ("t", "t_requested", "mean_edge_length", "backend")
        if hasattr(diagnostics, key)
    }
    if hasattr(solver, "plan"):
        parameters["plan"] = str(solver.plan)
    return np.stack(distances), {
        "parameters": parameters,
        "precompute_seconds": ready - start,
        "solve_seconds": float(np.median(seconds)),
        "peak_memory": peak.bytes,
        "notes": tuple(notes),
    }


@contextmanager
def _accuracy_notes() -> Iterator[list[str]]:
    """Collect the warnings about accuracy, each once, for the report; other warnings are issued again."""
    notes: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AccuracyWarning)
        yield notes
    for warning in caught:
        if not issubclass(warning.category, AccuracyWarning):
            warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)
        elif str(warning.message) not in notes:
            notes.append(str(warning.message))


def _run_native(
    mesh: Mesh, sets: list[IntArray], label: str, bounds: Mapping[str, float], begun: Callable[[str, int], None]
) -> Run:
    solver = _NATIVE[label]
    results = []
    for i, sources in enumerate(sets):
        begun(label, i)
        results.append(reference.measured(solver, mesh, sources, **bounds))
    return np.stack([result.distance for result in results]), {
        "parameters": {"solver": "windows" if solver == "exact" else solver},
        "precompute_seconds": float(np.median([result.precompute_seconds for result in results])),
        "solve_seconds": float(np.median([result.solve_seconds for result in results])),
        "peak_memory": max((result.peak_memory for result in results if result.peak_memory is not None), default=None),
    }
