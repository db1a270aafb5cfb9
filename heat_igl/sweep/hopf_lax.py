"""`HopfLaxEngine`: distance in a metric that is given per simplex."""

from __future__ import annotations

from functools import cached_property, reduce
from typing import Any

import numpy as np

from heat_igl.kernels.mesh import incidence
from heat_igl.kernels.sweep.adjacent_updates import AdjacentUpdate
from heat_igl.kernels.sweep.error_estimate import estimated_errors
from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.kernels.sweep.simplex_updates import SimplexUpdate
from heat_igl.mesh.connectivity import group_by_label, unique_rows
from heat_igl.operators import MetricSimplices
from heat_igl.plan import MOST_DOUBT, MOST_DOUBT_AT_WORST
from heat_igl.sources import SourceSet
from heat_igl.sweep.lines import LineEngine
from heat_igl.sweep.simplex_derivative import FixedPointDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray
from heat_igl.windows.engine import Answer, ComponentEngine, Engine

# Relative differences of velocities below this are rounding.
_ROUNDING = 1e-9
_GOLDEN = 0.618033988749895  # multiples of it, modulo 1, are spread evenly


class HopfLaxEngine(SimplexEngine):
    """Second-order distance by the Hopf-Lax formula on each simplex, iterated to a fixed point.

    Parameters
    ----------
    simplices : MetricSimplices
        Triangles or tetrahedra with `tensors`; `heat_igl.kernels.sweep.hopf_lax` describes the scheme.
    """

    def answer(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> Answer:  # noqa: ARG002
        """Distances, labels, and a complaint if the error estimate shows that the mesh does not resolve the metric."""
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
        """Lower `distance` to the minimum over second-order distances from single sources; append these to `fronts`.

        Returns an error estimate (n,).
        """
        scheme, limit, doubt = self._scheme, np.full(len(distance), np.inf), np.zeros(len(distance))
        if len(vertices) > 1:
            limit = distance.copy()
            self._along_edges(limit, label.copy())
        # Rounding depends on the order of sources, which therefore does not depend on the numbering. Successive sources
        # are far apart, so that the first ones bound the propagation from the others.
        order = np.lexsort((*self._simplices.place[vertices].T, offset))
        for k in order[np.argsort(np.arange(len(order)) * _GOLDEN % 1)]:
            found, far = scheme.spread(vertices[k], offset[k], limit, self._simplices.sizes[vertices[k]])
            nearer = far < distance[found]
            distance[found[nearer]], label[found[nearer]] = far[nearer], k
            limit[found] = np.minimum(limit[found], far)
            doubt[found[nearer]] = estimated_errors(scheme, found[nearer])
            if fronts is not None:
                fronts.append((np.full(len(found), k), found, far, *scheme.record(found)))
        return doubt

    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        self._scheme.shorten(distance, label)

    @cached_property
    def _arguments(self) -> Any:
        """Arguments of `HopfLax`, including the paths across facets between two metrics."""
        of, corners = self._simplices, self._corners
        kernel: Any = SimplexUpdate
        between: Any = AdjacentUpdate
        metric = of.velocity, of.rows, *of.measured[:-1], of.place
        mark = self._marks()
        crossings: tuple[AnyArray, ...] = np.zeros(of.n + 1, np.int32), np.empty((0, 3), np.int32), np.empty(0), mark
        if (mark != 0).any():
            crossings = self._crossings(mark, between(kernel(corners, *metric), *self._incident, mark))
        return corners, *self._incident, crossings, *metric

    @cached_property
    def _incident(self) -> tuple[AnyArray, AnyArray]:
        """The corners that meet in each vertex, as `MetricSimplices.incident` has them."""
        found: tuple[AnyArray, AnyArray] | None = self._simplices.incident
        return found or incidence.corners_by_vertex(self._corners, self._simplices.n)

    def _marks(self) -> AnyArray:
        """Hash (m,) of the metric of each simplex, rounded to seven digits; 0 where the metric varies within it."""
        of = self._simplices
        if of.velocity is not None and of.rows is not None:
            mark = (of.velocity @ np.sqrt(np.arange(2, 8)))[of.rows[:, 0]]
            widest, slack, growth = of.measured[2:5]
            mark[(slack < 1 - _ROUNDING) | (growth**2 * widest > _ROUNDING**2)] = 0
        elif of.tensors is not None and of.group is not None:
            mark = (of.tensors.reshape(-1, 9) @ np.sqrt(np.arange(2, 11)))[of.group]
        else:
            mark = np.zeros(len(self._corners))
        return np.asarray(mark / max(np.abs(mark).max(initial=0), np.finfo(float).tiny), np.float32)

    def _crossings(self, mark: AnyArray, adjacent: Any) -> tuple[AnyArray, ...]:
        """Paths across facets at some of whose corners marks differ, as `HopfLax` takes them."""
        corners, size, n = self._corners, self._corners.shape[1], self._simplices.n
        others = np.array([[j for j in range(size) if j != c] for c in range(size)])
        at_vertex, is_mixed, some = np.zeros(n, np.float32), np.zeros(n, bool), np.flatnonzero(mark)
        at_vertex[corners[some]] = mark[some, None]
        is_mixed[corners[some][at_vertex[corners[some]] != mark[some, None]]] = True
        mixed = is_mixed[corners[some]]
        at = np.flatnonzero(np.count_nonzero(mixed, axis=1)[:, None] > mixed)
        rows = corners[some][:, others].reshape(-1, size - 1)[at].T
        at = (size * some[at // size] + at % size).astype(np.int32)
        low, high = reduce(np.minimum, rows), reduce(np.maximum, rows)
        _, facet, counts = unique_rows(np.stack([low, sum(rows) - low - high, high], axis=1), n)
        _, order = group_by_label(facet, len(counts))
        at, facet = at[order], facet[order]
        beside = [np.stack([at[k:], at[:-k]])[:, facet[k:] == facet[:-k]] for k in range(1, counts.max(initial=2))]
        pairs = np.concatenate(beside, axis=1).T
        # From the corner opposite a facet to the other one; between two metrics also to those of the facet, both ways.
        between = pairs[mark[pairs[:, 0] // size] != mark[pairs[:, 1] // size]]
        between = np.concatenate([between, between[:, ::-1]])
        at, start = np.concatenate([pairs, np.repeat(between, size - 1, axis=0)]).T
        turned = np.append(np.zeros(len(pairs), np.int32), np.tile(np.arange(1, size, dtype=np.int32), len(between)))
        paths: Any = np.stack([at, start, at - at % size + (at + turned) % size], axis=1)
        lengths = adjacent.crossings(paths)
        short = np.flatnonzero(np.isfinite(lengths))
        paths, lengths = paths[short], lengths[short]
        paths = np.concatenate([paths, paths[:, [1, 2, 1]]])
        begins, order = group_by_label(corners.ravel()[paths[:, 2]], n)
        paths[:, 2] = corners.ravel()[paths[:, 1]]
        return begins.astype(np.int32), paths[order], np.tile(lengths, 2)[order], mark

    @property
    def _scheme(self) -> Any:
        kernel: Any = HopfLax
        return kernel(*self._arguments)

    def derivative(self, sources: SourceSet) -> FixedPointDerivative:
        """The distance from source vertices with its derivative."""
        fronts: list[tuple[AnyArray, ...]] = []
        distance = self._solved(sources, fronts)[0]
        record = (np.concatenate(part) for part in zip(*fronts, strict=True))
        return FixedPointDerivative(self._simplices, sources, distance, *record)


def engine_through(simplices: MetricSimplices) -> Engine:
    """The engine that passes through simplices: along lines in space, else by the Hopf-Lax formula."""
    if not simplices.parts:
        return (LineEngine if simplices.is_in_space else HopfLaxEngine)(simplices)
    which = np.zeros(simplices.n, np.int64)
    for number, part in enumerate(simplices.parts):
        which[part.corners] = number
    return ComponentEngine([engine_through(part) for part in simplices.parts], which)
