"""One report that says how far each method is from a reference, and what it costs."""

from __future__ import annotations

import inspect
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from heat_igl import metrics, reference
from heat_igl.errors import (
    AccuracyWarning,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
)
from heat_igl.guarded import MEMORY, TIMEOUT
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh
from heat_igl.metrics import BoundViolations
from heat_igl.peak_memory import PeakMemory
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray
from heat_igl.validation_report import ValidationReport, ValidationRow

__all__ = ["METHODS", "Method", "Progress", "Solver", "draw_sources", "validate"]


class Solver(Protocol):
    """What a method of one's own has to look like: `HeatMethodSolver` is one."""

    def distance(self, sources: IntArray, /) -> FloatArray:
        """Distance (n,) from a set of sources."""
        ...


Method = str | tuple[str, Callable[[Mesh], Solver]]
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
class _Run:
    distances: FloatArray
    precompute_seconds: float
    solve_seconds: float
    peak_memory: int | None
    parameters: Mapping[str, Any]
    notes: tuple[str, ...] = ()


def validate(
    mesh: Mesh,
    sources: Sources | Sequence[Sources],
    methods: Sequence[Method] = ("heat", "sweep", "unfold", "meshlab", "igl"),
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None = "exact",
    *,
    name: str = "mesh",
    timeout: float = TIMEOUT,
    memory: float = MEMORY,
    progress: Progress | None = None,
) -> ValidationReport:
    """Compare methods with a reference on one mesh.

    Parameters
    ----------
    mesh : Mesh
        Triangles; for tetrahedra, give a `reference` of your own.
    sources : sources, or sequence of sources
        One set of sources (an index, a sequence of indices, a mask), or a sequence of several such sets, from each of
        which a distance is measured: ``[3, 7]`` is one set of two vertices, ``[[3], [7]]`` are two sets of one.
    methods : sequence of str or (str, callable)
        Of `METHODS`: "heat", "sweep" and "unfold" are `HeatMethodSolver` without and with ``refine``; "igl" and
        "potpourri3d" the heat methods of these libraries; "meshlab" and "meshlab_heat" MeshLab's filters; "exact" the
        polyhedral distance. A method of one's own is a pair of its name and a function from the mesh to an object
        with a ``distance(sources)``.
    reference : str, array, callable or None
        "exact" or another name of `METHODS`; distances (k, n) or (n,); a function of mesh and sources, such as those
        of `heat_igl.closed_forms`; or None to check only what needs no reference.
    name : str
        Of the mesh, for the report.
    timeout, memory : float
        Bounds for native solvers, see `heat_igl.reference.exact`.
    progress : callable, optional
        Called with the name of what comes next, the number of distances done, and their total.

    Returns
    -------
    ValidationReport
        A method that fails is a row that says why.

    Raises
    ------
    ReferenceSolverError, MissingExtraError
        If the reference itself fails.
    SourceError
        If the sources do not name vertices of the mesh.
    ValueError
        If a method is unknown, or two have one name; if the reference has the wrong shape.
    """
    sets = _source_sets(sources, mesh.n_vertices)
    named = [_named(method) for method in methods]
    if len({label for label, _ in named}) < len(named):
        raise ValueError(f"methods must have different names, not {', '.join(label for label, _ in named)}")
    counter = _Counter(progress, len(sets) * (len(named) + (reference is not None)))
    bounds = {"timeout": timeout, "memory": memory}
    label, truths = _truths(mesh, sets, reference, bounds, counter)
    rows, distances = [], {}
    for method, prepare in named:
        try:
            run = _run(mesh, sets, method, prepare, bounds, counter)
        except (ReferenceSolverError, MissingExtraError, FactorizationError, MeshError) as error:
            counter.skip_to_next()
            rows.append(ValidationRow(method, failure=str(error)))
            continue
        distances[method] = run.distances
        rows.append(_row(mesh, sets, method, run, truths))
    counter.finish()
    return ValidationReport(name, mesh, label, tuple(sets), tuple(rows), truths, distances)


def draw_sources(mesh: Mesh, count: int, seed: int = 0) -> list[list[int]]:
    """Single sources for `validate`: `count` different vertices of the component with the most faces, by a seed.

    Raises
    ------
    SourceError
        If that component has fewer vertices than `count`, or `count` is not positive.
    """
    label = np.bincount(mesh.components[mesh.F[:, 0]]).argmax()
    candidates = np.flatnonzero(mesh.components == label)
    if not 1 <= count <= len(candidates):
        raise SourceError(f"{count} sources cannot be drawn from a component of {len(candidates)} vertices")
    return [[int(vertex)] for vertex in np.random.default_rng(seed).choice(candidates, count, replace=False)]


class _Counter:
    """Tells the caller which distance comes next."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0
        self._block_end = 0

    def start(self, n_distances: int) -> None:
        self._block_end = self._done + n_distances

    def step(self, label: str) -> None:
        if self._progress is not None:
            self._progress(label, self._done, self._total)
        self._done += 1

    def skip_to_next(self) -> None:
        self._done = self._block_end

    def finish(self) -> None:
        if self._progress is not None:
            self._progress("done", self._total, self._total)


def _source_sets(sources: Sources | Sequence[Sources], n: int) -> list[IntArray]:
    several = isinstance(sources, (list, tuple)) and any(np.ndim(entry) > 0 for entry in sources)
    if not several:
        return [vertex_sources(sources, n)]  # type: ignore[arg-type]
    return [vertex_sources(entry, n) for entry in sources]  # type: ignore[union-attr]


def _named(method: Method) -> tuple[str, Callable[[Mesh], Solver] | None]:
    if not isinstance(method, str):
        return method
    if method in _OPTIONS:
        return method, lambda mesh: _heat_solver(mesh, _OPTIONS[method])
    if method not in _NATIVE:
        raise ValueError(f"method {method!r} is unknown: choose from {', '.join(METHODS)}")
    return method, None


def _heat_solver(mesh: Mesh, options: Mapping[str, Any]) -> Solver:
    for option in options:
        if option not in inspect.signature(HeatMethodSolver).parameters:
            raise ReferenceSolverError(f"this version's HeatMethodSolver has no option {option!r}")
    return HeatMethodSolver(mesh, **options)


def _truths(
    mesh: Mesh,
    sets: list[IntArray],
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None,
    bounds: Mapping[str, float],
    counter: _Counter,
) -> tuple[str | None, FloatArray | None]:
    if reference is None:
        return None, None
    if isinstance(reference, str):
        return reference, _run(mesh, sets, *_named(reference), bounds, counter).distances
    counter.start(len(sets))
    if callable(reference):
        counter.step("reference")
        given: AnyArray = np.stack([reference(mesh, sources) for sources in sets])
        label = getattr(reference, "__name__", "function")
    else:
        given, label = np.atleast_2d(np.asarray(reference, dtype=np.float64)), "given distances"
    counter.skip_to_next()
    if given.shape != (len(sets), mesh.n_vertices):
        raise ValueError(f"reference must have shape ({len(sets)}, {mesh.n_vertices}), not {given.shape}")
    return label, given


def _run(
    mesh: Mesh,
    sets: list[IntArray],
    label: str,
    prepare: Callable[[Mesh], Solver] | None,
    bounds: Mapping[str, float],
    counter: _Counter,
) -> _Run:
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
    return _Run(np.stack(distances), ready - start, float(np.median(seconds)), peak.bytes, parameters, tuple(notes))


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


def _run_native(mesh: Mesh, sets: list[IntArray], label: str, bounds: Mapping[str, float], counter: _Counter) -> _Run:
    solver = _NATIVE[label]
    results = []
    for sources in sets:
        counter.step(label)
        results.append(reference.measured(solver, mesh, sources, **bounds))
    peaks = [result.peak_memory for result in results if result.peak_memory is not None]
    return _Run(
        np.stack([result.distance for result in results]),
        float(np.median([result.precompute_seconds for result in results])),
        float(np.median([result.solve_seconds for result in results])),
        max(peaks) if peaks else None,
        {"solver": reference.exact_solver() if solver == "exact" else solver},
    )


def _row(mesh: Mesh, sets: list[IntArray], label: str, run: _Run, truths: FloatArray | None) -> ValidationRow:
    residuals = np.stack([metrics.eikonal_residual(mesh, distance) for distance in run.distances])
    known = np.isfinite(residuals)
    weights = np.broadcast_to(mesh.measures, residuals.shape)[known]
    checks = [metrics.bound_violations(mesh, d, sources) for d, sources in zip(run.distances, sets, strict=True)]
    asymmetry = triangle = None
    if len(sets) > 1 and all(len(sources) == 1 for sources in sets):
        single = np.array([sources[0] for sources in sets])
        difference, between = metrics.asymmetry(run.distances, single), run.distances[:, single]
        # Where both ways are 0 or infinite, their difference is 0.
        mean = np.where(np.isfinite(between + between.T) & (between + between.T > 0), (between + between.T) / 2, 1.0)
        asymmetry = float(np.abs(difference / mean).max())
        triangle = metrics.triangle_violations(run.distances, single).largest
    return ValidationRow(
        label,
        run.parameters,
        errors=None if truths is None else metrics.error_summary(mesh, run.distances, truths, sets),
        eikonal=float(residuals[known] @ weights / weights.sum()) if len(weights) else None,
        bounds=BoundViolations(
            sum(check.n_below for check in checks),
            sum(check.n_above for check in checks),
            max(check.largest_below for check in checks),
            max(check.largest_above for check in checks),
        ),
        asymmetry=asymmetry,
        triangle_excess=triangle,
        precompute_seconds=run.precompute_seconds,
        solve_seconds=run.solve_seconds,
        peak_memory=run.peak_memory,
        notes=run.notes,
    )
