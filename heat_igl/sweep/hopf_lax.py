"""`HopfLaxEngine`: distance through simplices in a metric that changes from one to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.plan import MOST_DOUBT, MOST_DOUBT_AT_WORST
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import FixedPointDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray
from heat_igl.windows.engine import Answer

_GOLDEN = 0.618033988749895  # multiples of it, modulo 1, are spread evenly


class HopfLaxEngine(SimplexEngine):
    """Distance by the Hopf-Lax formula on each simplex, of second order, until nothing changes.

    Parameters
    ----------
    simplices : MetricSimplices
        Triangles or tetrahedra with `tensors`; `heat_igl.kernels.sweep.hopf_lax` describes the scheme.
    """

    def answer(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> Answer:  # noqa: ARG002
        """What `labelled` returns, and how it shows that the mesh does not resolve the metric, if it does."""
        distance, label, doubt = self._solved(sources)
        far = distance - sources.vertex_offset[label]
        away = np.flatnonzero(np.isfinite(distance) & (far > 0))
        wrong, complaint = 100 * np.append(doubt[away] / far[away], 0.0), None
        if wrong.mean() > MOST_DOUBT or wrong.max() > MOST_DOUBT_AT_WORST:
            complaint = (
                "the metric changes farther than the mesh resolves: slopes contradict distances, which may be wrong by "
                f"{wrong.mean():.2g} % in the mean, and by {wrong.max():.2g} % at vertex {away[wrong.argmax()]}: "
                "take a finer mesh"
            )
        return distance, np.concatenate([sources.vertex_label, [-1]])[label], complaint

    def _lower(
        self,
        vertices: AnyArray,
        offset: FloatArray,
        distance: FloatArray,
        label: AnyArray,
        fronts: list[tuple[AnyArray, ...]] | None = None,
    ) -> FloatArray:
        """Lower distance to the least of those of second order from each source alone, and add these to `fronts`.

        Returns by how much each may be wrong.
        """
        scheme, limit, doubt = self._scheme, np.full(len(distance), np.inf), np.zeros(len(distance))
        if len(vertices) > 1:
            limit = distance.copy()
            self._along_edges(limit, label.copy())
        # The order of sources, on which rounding depends, is not that of the numbers of vertices. One after the other
        # they are far apart, so that the first ones limit the others.
        order = np.lexsort((*self._simplices.place[vertices].T, offset))
        for k in order[np.argsort(np.arange(len(order)) * _GOLDEN % 1)]:
            found, far = scheme.spread(vertices[k], offset[k], limit)
            nearer = far < distance[found]
            distance[found[nearer]], label[found[nearer]] = far[nearer], k
            limit[found] = np.minimum(limit[found], far)
            doubt[found[nearer]] = scheme.doubts(found[nearer])
            if fronts is not None:
                fronts.append((np.full(len(found), k), found, far, *scheme.record(found)))
        return doubt

    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        self._scheme.shorten(distance, label)

    @property
    def _scheme(self) -> Any:
        kernel: Any = HopfLax
        velocity = self._simplices.velocity, self._simplices.rows, *self._simplices.measured[:-1]
        return kernel(self._corners, self._first, self._incident, *velocity, self._simplices.place)

    def derivative(self, sources: SourceSet) -> FixedPointDerivative:
        """The distance from source vertices with its derivative."""
        fronts: list[tuple[AnyArray, ...]] = []
        distance = self._solved(sources, fronts)[0]
        record = (np.concatenate(part) for part in zip(*fronts, strict=True))
        return FixedPointDerivative(self._simplices, sources, distance, *record)
