"""What engines that measure distance along simplices have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.engine import Engine
from heat_igl.windows.invariants import raise_to_lines

if TYPE_CHECKING:
    from heat_igl.operators import MetricSimplices
    from heat_igl.sweep.simplex_derivative import SimplexDerivative


class SimplexEngine(Engine):
    """Distance from vertices through simplices that need not fit together, held between two bounds.

    Parameters
    ----------
    simplices : MetricSimplices
        The domain.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        self._simplices = simplices
        self._corners = np.ascontiguousarray(simplices.corners, np.int32)

    @abstractmethod
    def _lower(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> Any:
        """Lower distance (n,), which begins with the offsets of the vertices and ``inf``; label (n,) counts these."""

    @abstractmethod
    def derivative(self, sources: SourceSet) -> SimplexDerivative:
        """The distance from source vertices with its derivative."""

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:  # noqa: ARG002
        """Distance (n,), and the source (n,) that it is measured from."""
        distance, label, _ = self._solved(sources)
        return distance, np.concatenate([sources.vertex_label, [-1]])[label]

    def _solved(self, sources: SourceSet, *more: Any) -> tuple[FloatArray, AnyArray, Any]:
        """Distance (n,), the number (n,) of the source vertex of each, -1 for none, and what `_lower` returns.

        No path is shorter than a straight line, or longer than along edges.
        """
        distance, label = np.full(self._simplices.n, np.inf), np.full(self._simplices.n, -1, np.int32)
        distance[sources.vertices], label[sources.vertices] = sources.vertex_offset, np.arange(len(sources.vertices))
        found = self._lower(sources.vertices.astype(np.int32), sources.vertex_offset, distance, label, *more)
        # In place of a value that is no number, a path along edges is found.
        distance[np.isnan(distance)] = np.inf
        raise_to_lines(distance, self._simplices.lines, None, sources)
        self._along_edges(distance, label)
        return distance, label, found

    @abstractmethod
    def _along_edges(self, distance: FloatArray, label: AnyArray) -> None:
        """Lower distance to paths along edges."""
