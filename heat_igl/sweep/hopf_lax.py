"""`HopfLaxEngine`: distance through simplices in a metric that changes from one to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.operators import MetricSimplices
from heat_igl.operators.metric_simplices import inverse_root, symmetric
from heat_igl.plan import HALVED_AROUND, MOST_CHANGE, MOST_CHANGE_AT_WORST, MOST_TURNING, MOST_VARIATION
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import FixedPointDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray, IntArray

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

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """As of all engines; the first answers come with a warning where the mesh does not resolve the metric."""
        distance, labels = super().labelled(sources, cutoff, threads)
        self._doubted -= 1
        if self._doubted >= 0 and (complaint := self._complaint(sources, distance)):
            self._doubted = 0
            warn_caller(
                f"the metric changes farther than the mesh resolves: {complaint}, and distance may be wrong by several "
                "percent, and by tens at single vertices: take a finer mesh",
                AccuracyWarning,
            )
        return distance, labels

    def _complaint(self, sources: SourceSet, distance: FloatArray) -> str | None:
        """How it shows that the mesh does not resolve the metric; None if it does."""
        n, size, start, beyond = len(distance), self._corners.shape[1], sources.vertex_offset.min(), distance.copy()
        if size == 4:
            # Between the first corners of some tetrahedra, and others that these meet in.
            chosen = np.arange(0, len(self._corners), len(self._corners) // _SAMPLE + 1)
            other, corner = np.divmod(self._incident[self._first[self._corners[chosen]]].ravel(), 4)
            first, two = self._simplices.metric(np.repeat(chosen, 4), 0), self._simplices.metric(other, corner)
            root = symmetric(inverse_root(first)[0])
            low, high = np.maximum(inverse_root(root @ two @ root)[2].T, _ROUNDING)
            turns = np.quantile(np.sqrt(high / low).reshape(-1, 4).max(axis=1), 0.9)
            if turns > MOST_TURNING:
                return f"the ratio of two lengths changes by a factor of {turns:.2g} over edges at a tenth of them"
            if (varies := np.sqrt(self._simplices.measured[-1])) > MOST_VARIATION:
                return f"lengths of edges differ between the corners of a face by {100 * varies:.0f} % in the mean"
            if n > HALVED_AROUND:
                return None
        # Shortest paths to the nearest vertices lie in the simplices around these and the sources.
        beyond[sources.vertices] = np.inf
        near = np.argpartition(beyond, min(HALVED_AROUND, n) - 1)[:HALVED_AROUND]
        around = (*near, *sources.vertices[:HALVED_AROUND])
        corners = np.concatenate([self._incident[self._first[v] : self._first[v + 1]] for v in around])
        halved = HopfLaxEngine(self._simplices.halved(np.unique(corners // size)))
        finer = SimplexEngine.labelled(halved, sources)[0][near]
        near, finer = (x[np.isfinite(finer) & (finer > start)] for x in (near, finer))
        change = 100 * np.append(np.abs(distance[near] - finer) / (finer - start), 0.0)
        if change.mean() <= MOST_CHANGE and change.max() <= MOST_CHANGE_AT_WORST:
            return None
        by = f"{change.mean():.2g} % in the mean, and by {change.max():.2g} % at vertex {near[change.argmax()]}"
        return f"if edges are halved, distance near the sources changes by {by}"

    def _lower(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> Any:  # noqa: ARG002
        """Lower distance to that of second order; returns the rest of what `HopfLax.settle` finds."""
        return self._scheme.settle(distance, label, offset)

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
        found = self._lower(sources.vertices, sources.vertex_offset, distance, label)
        answer = distance.copy()
        self._keep_bounds(sources, answer, label.copy())
        return FixedPointDerivative(self._simplices, sources, answer, distance, label, *found)
