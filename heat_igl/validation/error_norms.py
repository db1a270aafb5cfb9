"""Errors of distances against the truth: relative ones and their statistics, and norms over the surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, BoolArray, FloatArray

__all__ = ["ErrorSummary", "error_summary", "finite_or_zero", "relative_error"]


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
    """Relative error |d - truth| / truth, entry by entry.

    Parameters
    ----------
    distance, truth : (n,) or (k, n) array_like
        In the same unit.

    Returns
    -------
    (n,) or (k, n) float64
        NaN if the truth is 0 or infinite; ``inf`` if only the distance is not finite.

    Raises
    ------
    ValueError
        If the shapes differ.
    """
    d, x = _same_shape(distance, truth)
    error = np.full(x.shape, np.nan)
    away = _comparable(x)
    error[away] = np.where(np.isfinite(d[away]), np.abs(finite_or_zero(d)[away] - x[away]) / x[away], np.inf)
    return error


def error_summary(
    mesh: MeshLike, distances: ArrayLike, truths: ArrayLike, source_sets: Sequence[Sources]
) -> ErrorSummary:
    """All error norms of some distances.

    Parameters
    ----------
    mesh : mesh
        Gives the areas and neighbours of vertices.
    distances, truths : (k, n) array_like
        One row per set of sources.
    source_sets : sequence of sources
        k entries.

    Returns
    -------
    ErrorSummary

    Raises
    ------
    ValueError
        If the shapes do not fit each other.
    SourceError
        If an entry does not name vertices of the mesh.
    """
    mesh = as_simplices(mesh)
    d, x = _same_shape(distances, truths)
    if d.shape != (len(source_sets), mesh.n_vertices):
        raise ValueError(
            f"distances must have shape ({len(source_sets)}, {mesh.n_vertices}), one row per set of sources, not "
            f"{d.shape}"
        )
    away = _comparable(x)
    relative = relative_error(d, x)[away]
    near = np.stack([_neighbours(mesh, sources) for sources in source_sets]) & away
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


def finite_or_zero(values: FloatArray) -> FloatArray:
    """The values, with 0 for those that are not finite."""
    return np.where(np.isfinite(values), values, 0.0)


def _same_shape(distance: ArrayLike, truth: ArrayLike) -> tuple[FloatArray, FloatArray]:
    d, x = np.asarray(distance, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    if d.shape != x.shape:
        raise ValueError(f"distance and truth must have one shape, not {d.shape} and {x.shape}")
    return d, x


def _comparable(truth: FloatArray) -> BoolArray:
    return np.isfinite(truth) & (truth > 0)


def _of(statistic: Callable[[FloatArray], Any], values: FloatArray) -> float:
    return float(statistic(values)) if len(values) else float("nan")


def _neighbours(mesh: Mesh, sources: Sources) -> BoolArray:
    """The one-rings of the sources, themselves included: these have no relative error."""
    is_source = np.zeros(mesh.n_vertices, bool)
    is_source[vertex_sources(sources, mesh.n_vertices)] = True
    near = np.zeros(mesh.n_vertices, bool)
    near[mesh.edges[is_source[mesh.edges].any(axis=1)]] = True
    return near


def _norms(mesh: Mesh, distance: FloatArray, truth: FloatArray) -> tuple[float, float, float]:
    """L1, L2 and L-infinity of the error over the largest distance, weighted by each vertex's share of the area."""
    compared = np.isfinite(truth)
    if not _comparable(truth).any():
        return 0.0, 0.0, 0.0
    if not np.isfinite(distance[compared]).all():
        return np.inf, np.inf, np.inf
    corners = mesh.F.shape[1]
    area = np.bincount(mesh.F.ravel(), np.repeat(mesh.measures / corners, corners), mesh.n_vertices)[compared]
    error = np.abs(distance[compared] - truth[compared]) / truth[compared].max()
    weight = area / area.sum()
    return float(weight @ error), float(np.sqrt(weight @ error**2)), float(error.max())
