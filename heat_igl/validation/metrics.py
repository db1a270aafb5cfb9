"""Measures of a distance: errors against the truth, and violations of properties that every distance has.

Relative errors are fractions, not percent. A row of a (k, n) array is the distance from one set of sources, as
`HeatMethodSolver.distances` returns it.

Examples
--------
>>> import heat_igl
>>> heat_igl.validation.metrics.relative_error([0.0, 1.1, 2.0], [0.0, 1.0, 2.0]).round(6).tolist()  # nan at the source
[nan, 0.1, 0.0]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import igl
import numpy as np

from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.mesh.connectivity import mask_of
from heat_igl.reference import edge_paths, straight_lines
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray

__all__ = [
    "BoundViolations",
    "ErrorSummary",
    "TriangleViolations",
    "asymmetry",
    "bound_violations",
    "eikonal_residual",
    "error_summary",
    "relative_error",
    "triangle_violations",
]

# Below this fraction a bound counts as held: sums of some thousand lengths round to about 1e-13.
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class ErrorSummary:
    """Errors of distances against the truth, over all vertices and sets of sources.

    Attributes
    ----------
    mean, median, percentile_95, maximum : float
        Statistics of the relative error |d - truth| / truth, over vertices at a positive finite distance.
    l1, l2, l_infinity : float
        Norms of d - truth, divided by the largest distance from the same sources. L1 and L2 are weighted by vertex area
        and normalized by the total area.
    near_field : float
        Mean relative error over the neighbours of the sources.
    n_compared : int
        Number of vertices in these statistics, summed over the sets of sources.
    n_wrong_reach : int
        Number of vertices that are unreachable (infinite or NaN) in one of the two and not in the other. If only the
        truth is finite, the error counts as infinite.
    """

    mean: float
    median: float
    percentile_95: float
    maximum: float
    l1: float
    l2: float
    l_infinity: float
    near_field: float
    n_compared: int
    n_wrong_reach: int


def relative_error(distance: ArrayLike, truth: ArrayLike) -> FloatArray:
    """Relative error |d - truth| / truth of distances (n,) or (k, n), entry by entry; a ValueError for other shapes.

    NaN if the truth is 0 or infinite; ``inf`` if only the distance is not finite.
    """
    d, x = _same_shape(distance, truth)
    error = np.full(x.shape, np.nan)
    away = np.isfinite(x) & (x > 0)
    error[away] = np.where(np.isfinite(d[away]), np.abs(_finite_or_zero(d)[away] - x[away]) / x[away], np.inf)
    return error


def error_summary(
    mesh: MeshLike, distances: ArrayLike, truths: ArrayLike, source_sets: Sequence[Sources]
) -> ErrorSummary:
    """All error norms of distances (k, n), a row for each set of sources, on a mesh that gives areas and neighbours.

    A ValueError if the shapes do not fit each other, and a SourceError if an entry does not name vertices of the mesh.
    """
    mesh = as_simplices(mesh)
    d, x = _same_shape(distances, truths)
    if d.shape != (len(source_sets), mesh.n_vertices):
        raise ValueError(
            f"distances must have shape ({len(source_sets)}, {mesh.n_vertices}), one row per set of sources, not "
            f"{d.shape}"
        )
    away = np.isfinite(x) & (x > 0)
    relative = relative_error(d, x)[away]
    # The one-rings of the sources; the sources themselves have no relative error.
    is_source = np.stack([mask_of(vertex_sources(sources, d.shape[1]), d.shape[1]) for sources in source_sets])
    near = np.stack([mask_of(mesh.edges[row[mesh.edges].any(axis=1)], d.shape[1]) for row in is_source]) & away
    norms = np.array([_norms(mesh, d[row], x[row]) for row in range(len(d))])
    return ErrorSummary(
        mean=_of(np.mean, relative),
        median=_of(np.median, relative),
        # Interpolation between two infinite errors would be NaN.
        percentile_95=_of(lambda e: np.percentile(e, 95, method="higher"), relative),
        maximum=_of(np.max, relative),
        l1=float(norms[:, 0].mean()),
        l2=float(np.sqrt((norms[:, 1] ** 2).mean())),
        l_infinity=float(norms[:, 2].max()),
        near_field=_of(np.mean, relative_error(d, x)[near]),
        n_compared=int(away.sum()),
        n_wrong_reach=int((np.isfinite(d) != np.isfinite(x)).sum()),
    )


def _finite_or_zero(values: FloatArray) -> FloatArray:
    """The values, with 0 for those that are not finite."""
    return np.where(np.isfinite(values), values, 0.0)


def _same_shape(distance: ArrayLike, truth: ArrayLike) -> tuple[FloatArray, FloatArray]:
    d, x = np.asarray(distance, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    if d.shape != x.shape:
        raise ValueError(f"distance and truth must have one shape, not {d.shape} and {x.shape}")
    return d, x


def _of(statistic: Callable[[FloatArray], Any], values: FloatArray) -> float:
    return float(statistic(values)) if len(values) else float("nan")


def _norms(mesh: Mesh, distance: FloatArray, truth: FloatArray) -> tuple[float, float, float]:
    """L1, L2 and L-infinity of the error over the largest distance, weighted by each vertex's share of the area."""
    compared = np.isfinite(truth)
    if not (truth[compared] > 0).any():
        return 0.0, 0.0, 0.0
    if not np.isfinite(distance[compared]).all():
        return np.inf, np.inf, np.inf
    corners = mesh.F.shape[1]
    area = np.bincount(mesh.F.ravel(), np.repeat(mesh.measures / corners, corners), mesh.n_vertices)[compared]
    error = np.abs(distance[compared] - truth[compared]) / truth[compared].max()
    weight = area / area.sum() if area.any() else np.full(len(area), 1 / len(area))
    return float(weight @ error), float(np.sqrt(weight @ error**2)), float(error.max())


@dataclass(frozen=True)
class TriangleViolations:
    """Violations of the triangle inequality: d(a, v) > d(a, b) + d(b, v), for sources a, b and vertices v.

    Attributes
    ----------
    count : int
        Triples with an excess above rounding.
    fraction : float
        Share of all triples that were tried.
    largest : float
        Largest excess, divided by d(a, v).
    """

    count: int
    fraction: float
    largest: float


@dataclass(frozen=True)
class BoundViolations:
    """Vertices whose distance is outside the bounds that hold on every mesh.

    Attributes
    ----------
    n_below, n_above : int
        Number of vertices nearer than the straight line, and farther than the shortest path along edges, beyond
        rounding.
    largest_below, largest_above : float
        Largest violations, as fractions of the bound.
    """

    n_below: int
    n_above: int
    largest_below: float
    largest_above: float


def eikonal_residual(mesh: MeshLike, distance: ArrayLike) -> FloatArray:
    """Residual (m,) of the eikonal equation |grad d| = 1 on each triangle or tetrahedron: | |grad d| - 1 |.

    NaN on faces that are degenerate or not reached. It does not vanish at the sources and across the cut locus for any
    discrete distance (n,), so its mean tends to 0 with the edge length, and its maximum does not.
    """
    mesh = as_simplices(mesh)
    d = np.asarray(distance, dtype=np.float64)
    reached = np.isfinite(d)[mesh.F].all(axis=1) & (mesh.measures > 0)
    gradient = igl.grad(mesh.V, mesh.F[reached]) @ _finite_or_zero(d)
    residual = np.full(mesh.n_faces, np.nan)
    residual[reached] = np.abs(np.linalg.norm(gradient.reshape(3, -1), axis=0) - 1)
    return residual


def asymmetry(distances: ArrayLike, sources: ArrayLike) -> FloatArray:
    """The matrix (k, k) of d(a, b) - d(b, a) over pairs of sources; 0 for an exact distance, and between components.

    Row i of the distances (k, n) is that from the one vertex ``sources[i]``.
    """
    between = np.asarray(distances, dtype=np.float64)[:, np.asarray(sources)]
    difference: FloatArray = np.where(np.isfinite(between) & np.isfinite(between.T), _finite_or_zero(between), 0.0)
    return difference - difference.T


def triangle_violations(distances: ArrayLike, sources: ArrayLike) -> TriangleViolations:
    """Count violations of the triangle inequality, arguments as for `asymmetry`."""
    d, vertices = np.asarray(distances, dtype=np.float64), np.asarray(sources)
    count, n_tried, largest = 0, 0, 0.0
    for a in range(len(vertices)):
        for b in range(len(vertices)):
            known = np.isfinite(d[a]) & np.isfinite(d[b]) & (d[a] > 0)
            if a == b or not known.any() or not np.isfinite(d[a, vertices[b]]):
                continue
            excess = (d[a, known] - d[a, vertices[b]] - d[b, known]) / d[a, known]
            count += int((excess > _TOLERANCE).sum())
            n_tried += int(known.sum())
            largest = max(largest, float(excess.max()))
    return TriangleViolations(count, count / max(n_tried, 1), largest)


def bound_violations(mesh: MeshLike, distance: ArrayLike, sources: Sources) -> BoundViolations:
    """Check a distance (n,) against the straight line from below and paths along edges from above.

    Vertices at which it is not finite are left out.
    """
    mesh = as_simplices(mesh)
    return beyond(np.asarray(distance, dtype=np.float64), straight_lines(mesh, sources), edge_paths(mesh, sources))


def beyond(d: FloatArray, lower: FloatArray, upper: FloatArray) -> BoundViolations:
    """The violations of bounds by distances, all of one shape."""
    inside = np.isfinite(d) & np.isfinite(upper) & (upper > 0)
    d, lower, upper = d[inside], lower[inside], upper[inside]
    # Two vertices in one place: the straight line is 0 and cannot be undercut.
    below = (lower - d) / np.where(lower > 0, lower, np.inf)
    above = (d - upper) / upper
    return BoundViolations(
        int((below > _TOLERANCE).sum()),
        int((above > _TOLERANCE).sum()),
        float(below.max(initial=0.0)),
        float(above.max(initial=0.0)),
    )
