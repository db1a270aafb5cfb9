"""What unfolding and fronts have in common: distance from sources and an order of the vertices, without factors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from heat_igl.operators import Surface
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["OrderedSolver", "UnfoldingDomain"]


class UnfoldingDomain(Protocol):
    """The part of a domain that unfolding uses; `Operators` is one."""

    @property
    def surface(self) -> Surface | None:
        """The triangles."""

    @property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex."""

    @property
    def mean_edge_length(self) -> float:
        """Mean length of the edges."""

    def expand_to_vertices(self, of_component: AnyArray) -> AnyArray:
        """The value (n,) of each vertex's component."""


class OrderedSolver(ABC):
    """Distance for which no Poisson problem is solved: it takes the place of steps 2 and 3.

    Attributes
    ----------
    is_exact : bool
        Whether distances do not depend on the heat. If they do, only the order of the vertices by their heat is read.
    """

    is_exact: bool

    @property
    def reads_heat(self) -> bool:
        """Whether the order of the heat is read."""
        return not self.is_exact

    def distances(self, source_sets: Sequence[SourceSet], u: FloatArray) -> FloatArray:
        """Distances (k, n) for heat (n, k).

        If the heat has underflowed the order is arbitrary, which the unfolding corrects.
        """
        return np.stack([self._distance(sources, one) for sources, one in zip(source_sets, u.T, strict=True)])

    def labelled(self, sources: SourceSet, u: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance (n,) for heat (n,), and the source (n,) that it is measured from, -1 if none is reached."""
        labels = np.empty(len(u), np.int64)
        return self._distance(sources, u, labels), labels

    @abstractmethod
    def _distance(self, sources: SourceSet, u: FloatArray, labels: IntArray | None = None) -> FloatArray:
        """Distance (n,) for heat (n,); `labels` (n,), if given, are filled as `labelled` returns them."""
