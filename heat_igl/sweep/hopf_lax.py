"""`HopfLaxEngine`: distance through simplices in a metric that changes from one to the next."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.operators import MetricSimplices
from heat_igl.typing import AnyArray, FloatArray
from heat_igl.windows.engine import SimplexEngine

__all__ = ["HopfLaxEngine"]


class HopfLaxEngine(SimplexEngine):
    """Distance by the Hopf-Lax formula: on each simplex until nothing changes, then of second order on facets.

    Parameters
    ----------
    simplices : MetricSimplices
        Triangles or tetrahedra with `tensors`; `heat_igl.kernels.sweep.hopf_lax` describes the scheme.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        super().__init__(simplices)
        place = np.ascontiguousarray(simplices.place)
        X = place[simplices.corners]
        is_solid = X.shape[1] == 4
        E = X[:, 1:] - X[:, :1]
        others = np.swapaxes(np.linalg.inv(E) if is_solid else np.linalg.pinv(E), 1, 2)
        gradient = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
        # What `HopfLax` reads: squared lengths, gradients of coordinates, and positions.
        self._in_metric = simplices.squared_lengths(), np.ascontiguousarray(gradient), place

    def _lower(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> None:  # noqa: ARG002
        """Lower distance to that of second order."""
        kernel: Any = HopfLax
        scheme = kernel(self._corners, self._first, self._incident, *self._in_metric)
        scheme.first_order(distance, label, offset)
        scheme.second_order()
