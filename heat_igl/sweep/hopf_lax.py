"""`HopfLaxEngine`: distance through simplices in a metric that changes from one to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.operators import MetricSimplices
from heat_igl.operators.metric_simplices import inverse_root, symmetric
from heat_igl.plan import (
    HALVED_AROUND,
    HALVED_AROUND_IN_BODIES,
    MOST_CHANGE,
    MOST_CHANGE_AT_WORST,
    MOST_TURNING,
    MOST_VARIATION,
)
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import FixedPointDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray

_SAMPLE = 250  # tetrahedra of which it is asked how far the metric turns
_ROUNDING = 1e-12


class HopfLaxEngine(SimplexEngine):
    """Distance by the Hopf-Lax formula on each simplex, of second order, until nothing changes.

    Parameters
    ----------
    simplices : MetricSimplices
        Triangles or tetrahedra with `tensors`; `heat_igl.kernels.sweep.hopf_lax` describes the scheme.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        super().__init__(simplices)
        self._doubted = 3  # so many of the next answers are checked

    def complaint(self, sources: SourceSet, distance: FloatArray) -> str | None:
        """How it shows in one of the first answers that the mesh does not resolve the metric, once."""
        self._doubted -= 1
        if self._doubted < 0 or not (found := self._unresolved(sources, distance)):
            return None
        self._doubted = 0
        return (
            f"the metric changes farther than the mesh resolves: {found}, and distance may be wrong by several "
            "percent, and by tens at single vertices: take a finer mesh"
        )

    def _unresolved(self, sources: SourceSet, distance: FloatArray) -> str | None:
        """How it shows that the mesh does not resolve the metric; None if it does."""
        n, size, start = len(distance), self._corners.shape[1], sources.vertex_offset.min()
        count = HALVED_AROUND
        if size == 4 and (varies := np.sqrt(self._simplices.measured[-1])) > MOST_VARIATION:
            return f"lengths of edges differ between the corners of a face by {100 * varies:.0f} % in the mean"
        if size == 4 and n > count:
            # Between the first corners of some tetrahedra, and others that these meet in.
            chosen = np.arange(0, len(self._corners), len(self._corners) // _SAMPLE + 1)
            other, corner = np.divmod(self._incident[self._first[self._corners[chosen]]].ravel(), 4)
            first, two = self._simplices.metric(np.repeat(chosen, 4), 0), self._simplices.metric(other, corner)
            root = symmetric(inverse_root(first)[0])
            low, high = np.maximum(inverse_root(root @ two @ root)[2].T, _ROUNDING)
            if np.quantile(np.sqrt(high / low).reshape(-1, 4).max(axis=1), 0.9) <= MOST_TURNING:
                return None
            count = HALVED_AROUND_IN_BODIES
        # Shortest paths to the nearest vertices lie in the simplices around these and the sources.
        beyond = distance.copy()
        beyond[sources.vertices] = np.inf
        near = np.argpartition(beyond, min(count, n) - 1)[:count]
        around = (*near, *sources.vertices[:count])
        corners = np.concatenate([self._incident[self._first[v] : self._first[v + 1]] for v in around])
        halved = HopfLaxEngine(self._simplices.halved(np.unique(corners // size)))
        finer = halved.distance(sources)[near]
        near, finer = (x[np.isfinite(finer) & (finer > start)] for x in (near, finer))
        change = 100 * np.append(np.abs(distance[near] - finer) / (finer - start), 0.0)
        if change.mean() <= MOST_CHANGE and change.max() <= MOST_CHANGE_AT_WORST:
            return None
        by = f"{change.mean():.2g} % in the mean, and by {change.max():.2g} % at vertex {near[change.argmax()]}"
        return f"if edges are halved, distance near the sources changes by {by}"

    def _lower(
        self,
        vertices: AnyArray,
        offset: FloatArray,
        distance: FloatArray,
        label: AnyArray,
        fronts: list[tuple[AnyArray, ...]] | None = None,
    ) -> None:
        """Lower distance to the least of those of second order from each source alone, and add these to `fronts`."""
        scheme, limit = self._scheme, np.full(len(distance), np.inf)
        if len(vertices) > 1:
            limit = distance.copy()
            self._along_edges(limit, label.copy())
        # The order of sources, on which rounding depends, is not that of the numbers of vertices.
        for k in np.lexsort((*self._simplices.place[vertices].T, offset)):
            found, far = scheme.spread(vertices[k], offset[k], limit)
            nearer = far < distance[found]
            distance[found[nearer]], label[found[nearer]] = far[nearer], k
            limit[found] = np.minimum(limit[found], far)
            if fronts is not None:
                fronts.append((np.full(len(found), k), found, far, *scheme.record(found)))

    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        self._scheme.shorten(distance, label)

    @property
    def _scheme(self) -> Any:
        kernel: Any = HopfLax
        velocity = self._simplices.velocity, self._simplices.rows, *self._simplices.measured[:-1]
        return kernel(self._corners, self._first, self._incident, *velocity, self._simplices.place)

    def derivative(self, sources: SourceSet) -> FixedPointDerivative:
        """The distance from source vertices with its derivative."""
        distance, label = self._begun(sources)
        fronts: list[tuple[AnyArray, ...]] = []
        self._lower(sources.vertices.astype(np.int32), sources.vertex_offset, distance, label, fronts)
        self._keep_bounds(sources, distance, label)
        record = (np.concatenate(part) for part in zip(*fronts, strict=True))
        return FixedPointDerivative(self._simplices, sources, distance, *record)
