"""Compare methods with a reference on one mesh: errors and costs in one report."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from heat_igl.errors import (
    FactorizationError,
    MeshError,
    MissingExtraError,
    ReferenceSolverError,
    SourceError,
    names_guessed,
    real_numbers,
    shown,
)
from heat_igl.mesh import Mesh, MeshLike, as_mesh, as_simplices
from heat_igl.reference import MEMORY, TIMEOUT, edge_paths, straight_lines
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray
from heat_igl.validation import metrics
from heat_igl.validation.methods import METHODS, Method, Progress, Run, resolved, run
from heat_igl.validation.metrics import BoundViolations
from heat_igl.validation.report import ValidationReport, ValidationRow


@names_guessed
def validate(
    mesh: MeshLike,
    sources: Sources | Sequence[Sources],
    methods: Sequence[Method] = ("heat", "sweep", "windows", "meshlab", "igl"),
    *,
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None = "exact",
    name: str = "mesh",
    timeout: float = TIMEOUT,
    memory: float = MEMORY,
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
        Names from `METHODS`: "heat" is `HeatMethodSolver`, "sweep" and "windows" are `GeodesicSolver`; "igl" and
        "potpourri3d" are the heat methods of these libraries; "meshlab" and "meshlab_heat" are MeshLab's filters;
        "exact" is the polyhedral distance. Any other method is a pair of a name and a function from the mesh to an
        object with a method ``distance(sources)``.
    reference : str, array, callable or None
        "exact" or another name from `METHODS`; distances (k, n) or (n,); a function of mesh and sources, such as those
        of `heat_igl.validation.closed_forms`; or None for only the checks that need no reference.
    name : str
        Name of the mesh in the report.
    timeout, memory : float
        Bounds for native solvers, see `heat_igl.reference.exact`.
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
    >>> report = heat_igl.validate(mesh, 0, methods=["heat", "windows"], reference=closed_forms.plane)
    >>> [(row.method, round(row.errors.mean, 2)) for row in report.rows]
    [('heat', 0.0), ('windows', 0.0)]
    """
    given = as_mesh(mesh)
    mesh = as_simplices(given)
    domain = mesh if isinstance(given, Mesh) else given
    sets = _source_sets(sources, mesh.n_vertices)
    if not isinstance(methods, Iterable) or isinstance(methods, str) or getattr(methods, "ndim", 1) == 0:
        raise ValueError(f"methods must be a sequence of methods, not {shown(methods)}")
    chosen = [resolved(method) for method in methods]
    if not chosen:
        raise ValueError(f"methods is empty: choose from {', '.join(METHODS)}, or leave it out for the default")
    if len({label for label, _ in chosen}) < len(chosen):
        raise ValueError(f"methods must have different names, not {', '.join(label for label, _ in chosen)}")
    total = len(sets) * (len(chosen) + (reference is not None))
    done = 0

    def begun(label: str, index: int) -> None:
        if progress is not None:
            progress(label, done + index, total)

    bounds = {"timeout": timeout, "memory": memory}
    failure = None
    try:
        label, truths, known = _truths(mesh, sets, reference, bounds, begun)
    except ReferenceSolverError as error:
        # The rest of the report needs no reference.
        label, truths, known, failure = str(reference), None, None, str(error)
    limits = [(straight_lines(mesh, sources), edge_paths(mesh, sources)) for sources in sets]
    rows, distances = [], {}
    for i, (method, prepare) in enumerate(chosen, start=int(reference is not None)):
        done = i * len(sets)
        try:
            if known is not None and method == label:
                found = known
            elif failure is not None and method == label:
                raise ReferenceSolverError(failure)
            else:
                found = run(domain, sets, method, prepare, bounds, begun)
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

    Raises
    ------
    SourceError
        If that component has fewer vertices than `count`, or `count` is not positive.
    """
    mesh = as_simplices(mesh)
    label = np.bincount(mesh.components[mesh.F[:, 0]]).argmax()
    candidates = np.flatnonzero(mesh.components == label)
    if not 1 <= count <= len(candidates):
        raise SourceError(f"{count} sources cannot be drawn from a component of {len(candidates)} vertices")
    return [[int(vertex)] for vertex in np.random.default_rng(seed).choice(candidates, count, replace=False)]


def _source_sets(sources: Sources | Sequence[Sources], n: int) -> list[IntArray]:
    several = isinstance(sources, (list, tuple)) and any(np.ndim(entry) > 0 for entry in sources)
    if not several:
        return [vertex_sources(sources, n)]
    return [vertex_sources(entry, n) for entry in sources]  # type: ignore[union-attr]


def _truths(
    mesh: Mesh,
    sets: list[IntArray],
    reference: str | ArrayLike | Callable[[Mesh, IntArray], FloatArray] | None,
    bounds: Mapping[str, float],
    begun: Callable[[str, int], None],
) -> tuple[str | None, FloatArray | None, Run | None]:
    """Name and distances of the reference, and the run if it is a method."""
    if reference is None:
        return None, None, None
    if isinstance(reference, str):
        found = run(mesh, sets, *resolved(reference), bounds, begun)
        return reference, found[0], found
    if callable(reference):
        begun("reference", 0)
        given: AnyArray = np.stack([reference(mesh, sources) for sources in sets])
        label = getattr(reference, "__name__", "function")
    else:
        given, label = np.atleast_2d(real_numbers("reference", reference)), "given distances"
    if given.shape != (len(sets), mesh.n_vertices):
        raise ValueError(f"reference must have shape ({len(sets)}, {mesh.n_vertices}), not {given.shape}")
    if np.isnan(given).any():
        case, vertex = np.argwhere(np.isnan(given))[0].tolist()
        raise ValueError(f"reference[{case}, {vertex}] is NaN: vertices that no source reaches are inf")
    return label, given, None


def _row(
    mesh: Mesh,
    sets: list[IntArray],
    label: str,
    distances: FloatArray,
    truths: FloatArray | None,
    limits: list[tuple[FloatArray, FloatArray]],
    cost: Mapping[str, Any],
) -> ValidationRow:
    residuals = np.stack([metrics.eikonal_residual(mesh, distance) for distance in distances])
    known = np.isfinite(residuals)
    weights = np.broadcast_to(mesh.measures, residuals.shape)[known]
    checks = [
        metrics.bound_violations(mesh, d, sources, pair)
        for d, sources, pair in zip(distances, sets, limits, strict=True)
    ]
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
        bounds=BoundViolations(
            sum(check.n_below for check in checks),
            sum(check.n_above for check in checks),
            max(check.largest_below for check in checks),
            max(check.largest_above for check in checks),
        ),
        asymmetry=asymmetry,
        triangle_excess=triangle,
        **cost,
    )
