"""Compare methods with a reference on one mesh: run and measure each, with errors and costs in one report."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from heat_igl import reference
from heat_igl.errors import (
    AccuracyWarning,
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
    names_guessed,
    raise_at_first,
    real_numbers,
    shown,
)
from heat_igl.geodesic import DistanceMethod, SolverChoice
from heat_igl.mesh import Mesh, MeshLike, PointCloud, PolygonMesh, as_mesh, as_simplices
from heat_igl.reference import TIMEOUT, edge_paths, straight_lines
from heat_igl.runtime import PeakMemory
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray
from heat_igl.validation import metrics
from heat_igl.validation.report import ValidationReport, ValidationRow

Progress = Callable[[str, int, int], None]
Run = tuple[FloatArray, dict[str, Any]]
"""Distances (k, n) of a method, and their cost: fields of `ValidationRow` by name."""
# Methods that run in this process, as `geodesic_distance` names them; the others are native references.
_OWN: tuple[DistanceMethod, ...] = ("heat", "sweep")
_NATIVE = {
    "meshlab": "meshlab",
    "meshlab_heat": "meshlab_heat",
    "igl": "igl_heat",
    "potpourri3d": "potpourri3d_heat",
    "exact": "windows",
}
#: The names of methods that `validate` takes.
METHODS = (*_OWN, *_NATIVE)


Prepare = Callable[[Any], Any]
"""From a mesh to an object with a method ``distance(sources)``, as `GeodesicSolver` has it."""
Method = str | tuple[str, Prepare]


def _resolved(method: Method) -> tuple[str, Prepare | None]:
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


def _run(
    mesh: Mesh | PolygonMesh | PointCloud,
    sets: list[IntArray],
    label: str,
    prepare: Prepare | None,
    timeout: float,
    begun: Callable[[str, int], None],
) -> Run:
    """Distances from each set of sources by a method from `_resolved`.

    `begun` is called before each distance, with the name of the method and the index of the set.
    """
    if prepare is None:
        results = []
        for i, sources in enumerate(sets):
            begun(label, i)
            results.append(reference.measured(_NATIVE[label], as_simplices(mesh), sources, timeout=timeout))
        memory = (result.peak_memory for result in results if result.peak_memory is not None)
        return np.stack([result.distance for result in results]), {
            "parameters": {"solver": _NATIVE[label]},
            "precompute_seconds": float(np.median([result.precompute_seconds for result in results])),
            "solve_seconds": float(np.median([result.solve_seconds for result in results])),
            "peak_memory": max(memory, default=None),
        }
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


@names_guessed
def validate(
    mesh: MeshLike,
    sources: Sources | Sequence[Sources],
    methods: Sequence[Method] = ("heat", "sweep", "exact", "meshlab", "igl"),
    *,
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None = "exact",
    name: str = "mesh",
    timeout: float = TIMEOUT,
    progress: Progress | None = None,
) -> ValidationReport:
    """Compare methods with a reference on one mesh.

    Parameters
    ----------
    mesh : mesh
        Triangles; for tetrahedra, give a `reference` of your own, such as `closed_forms.convex_solid`. Of a
        `PointCloud` or `PolygonMesh`, own methods take the points or polygons, and native ones and the reference the
        triangles.
    sources : sources, or sequence of sources
        One set of sources (an index, a sequence of indices, a mask), or a sequence of sets, with one distance for each:
        ``[3, 7]`` is one set of two vertices, ``[[3], [7]]`` are two sets of one vertex.
    methods : sequence of str or (str, callable)
        Names from `METHODS`: "heat" is `HeatMethodSolver`, "sweep" is `GeodesicSolver`; "igl" and
        "potpourri3d" are the heat methods of these libraries; "meshlab" and "meshlab_heat" are MeshLab's filters;
        "exact" is `reference.exact`. Any other method is a pair of a name and a function from the mesh to an
        object with a method ``distance(sources)``.
    reference : str, array, callable or None
        "exact" or another name from `METHODS`; distances (k, n) or (n,); a function of mesh and sources, such as those
        of `heat_igl.validation.closed_forms`; or None for only the checks that need no reference.
    name : str
        Name of the mesh in the report.
    timeout : float
        Seconds after which a native solver is stopped.
    progress : callable, optional
        Called before each distance with the name of the method, the number of distances done, and their total; at the
        end with "done" and the total twice.

    Returns
    -------
    ValidationReport
        A method that fails is a row with the reason.

    Raises
    ------
    MissingExtraError
        If the reference needs a library that is not installed. A reference that fails on this mesh only leaves the
        errors empty: `ValidationReport.failure` has the reason.
    SourceError
        If the sources do not name vertices of the mesh.
    ValueError
        If there are no methods, one is unknown, or two have one name; if the reference has the wrong shape.

    Examples
    --------
    >>> import heat_igl
    >>> from heat_igl.validation import closed_forms
    >>> mesh = heat_igl.shapes.disk(20)
    >>> report = heat_igl.validate(mesh, 0, methods=["heat", "exact"], reference=closed_forms.plane)
    >>> [(row.method, round(row.errors.mean, 2)) for row in report.rows]
    [('heat', 0.0), ('exact', 0.0)]
    """
    given = as_mesh(mesh)
    mesh = as_simplices(given)
    domain = mesh if isinstance(given, Mesh) else given
    several = isinstance(sources, (list, tuple)) and any(np.ndim(entry) > 0 for entry in sources)
    sets = [vertex_sources(entry, mesh.n_vertices) for entry in (sources if several else [sources])]  # type: ignore[union-attr]
    if not isinstance(methods, Iterable) or isinstance(methods, str) or getattr(methods, "ndim", 1) == 0:
        raise ValueError(f"methods must be a sequence of methods, not {shown(methods)}")
    chosen = [_resolved(method) for method in methods]
    if not chosen:
        raise ValueError(f"methods is empty: choose from {', '.join(METHODS)}, or leave it out for the default")
    if len({label for label, _ in chosen}) < len(chosen):
        raise ValueError(f"methods must have different names, not {', '.join(label for label, _ in chosen)}")
    total = len(sets) * (len(chosen) + (reference is not None))
    done = 0

    def begun(label: str, index: int) -> None:
        if progress is not None:
            progress(label, done + index, total)

    failure = None
    try:
        label, truths, known = _truths(mesh, sets, reference, timeout, begun)
    except ReferenceSolverError as error:
        # The rest of the report needs no reference.
        label, truths, known, failure = str(reference), None, None, str(error)
    limits = [np.stack([bound(mesh, sources) for sources in sets]) for bound in (straight_lines, edge_paths)]
    rows, distances = [], {}
    for i, (method, prepare) in enumerate(chosen, start=int(reference is not None)):
        done = i * len(sets)
        try:
            if known is not None and method == label:
                found = known
            elif failure is not None and method == label:
                raise ReferenceSolverError(failure)
            else:
                found = _run(domain, sets, method, prepare, timeout, begun)
        except (ReferenceSolverError, MissingExtraError, FactorizationError, MeshError) as error:
            rows.append(ValidationRow(method, failure=str(error)))
            continue
        distances[method], cost = found
        rows.append(_row(mesh, sets, method, distances[method], truths, limits, cost))
    if progress is not None:
        progress("done", total, total)
    return ValidationReport(name, mesh, label, tuple(sets), tuple(rows), truths, distances, failure)


def draw_sources(mesh: MeshLike, count: int, seed: int = 0) -> list[list[int]]:
    """Single sources for `validate`: `count` random vertices of the component with the most faces, all different.

    A SourceError if that component has fewer vertices than `count`, or `count` is not positive.
    """
    mesh = as_simplices(mesh)
    label = np.bincount(mesh.components[mesh.F[:, 0]]).argmax()
    candidates = np.flatnonzero(mesh.components == label)
    if not 1 <= count <= len(candidates):
        raise SourceError(f"{count} sources cannot be drawn from a component of {len(candidates)} vertices")
    return [[int(vertex)] for vertex in np.random.default_rng(seed).choice(candidates, count, replace=False)]


def _truths(
    mesh: Mesh,
    sets: list[IntArray],
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None,
    timeout: float,
    begun: Callable[[str, int], None],
) -> tuple[str | None, FloatArray | None, Run | None]:
    """Name and distances of the reference, and the run if it is a method."""
    if reference is None:
        return None, None, None
    if isinstance(reference, str):
        found = _run(mesh, sets, *_resolved(reference), timeout, begun)
        return reference, found[0], found
    if callable(reference):
        begun("reference", 0)
        given: AnyArray = np.stack([reference(mesh, sources) for sources in sets])
        label = getattr(reference, "__name__", "function")
    else:
        given, label = np.atleast_2d(real_numbers("reference", reference)), "given distances"
    if given.shape != (len(sets), mesh.n_vertices):
        raise ValueError(f"reference must have shape ({len(sets)}, {mesh.n_vertices}), not {given.shape}")
    raise_at_first(np.isnan(given), "reference", given, "must be a distance", "vertices out of reach are at inf")
    return label, given, None


def _row(
    mesh: Mesh,
    sets: list[IntArray],
    label: str,
    distances: FloatArray,
    truths: FloatArray | None,
    limits: list[FloatArray],
    cost: Mapping[str, Any],
) -> ValidationRow:
    residuals = np.stack([metrics.eikonal_residual(mesh, distance) for distance in distances])
    known = np.isfinite(residuals)
    weights = np.broadcast_to(mesh.measures, residuals.shape)[known]
    asymmetry = triangle = None
    if len(sets) > 1 and all(len(sources) == 1 for sources in sets):
        single = np.array([sources[0] for sources in sets])
        difference, between = metrics.asymmetry(distances, single), distances[:, single]
        # If both ways are 0 or infinite, their difference is 0.
        mean = np.where(np.isfinite(between + between.T) & (between + between.T > 0), (between + between.T) / 2, 1.0)
        asymmetry = float(np.abs(difference / mean).max())
        triangle = metrics.triangle_violations(distances, single).largest
    return ValidationRow(
        label,
        errors=None if truths is None else metrics.error_summary(mesh, distances, truths, sets),
        eikonal=float(residuals[known] @ weights / weights.sum()) if len(weights) else None,
        bounds=metrics.beyond(distances, *limits),
        asymmetry=asymmetry,
        triangle_excess=triangle,
        **cost,
    )
