"""`HopfLaxEngine`: distance through simplices in a metric that changes from one to the next."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.sweep.hopf_lax import HopfLax
from heat_igl.mesh import Mesh
from heat_igl.operators import MetricSimplices
from heat_igl.operators.metric_derivatives import plane_axes
from heat_igl.operators.metric_simplices import inverse_root, symmetric
from heat_igl.plan import MOST_TURNING, MOST_VARIATION
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourceSet
from heat_igl.sweep.simplex_derivative import FixedPointDerivative
from heat_igl.sweep.simplex_engine import SimplexEngine
from heat_igl.typing import AnyArray, FloatArray

# Simplices of which it is asked how far the metric turns.
_SAMPLE = 250
_ROUNDING = 1e-12
# Determinants of singular tensors over their squared traces are rounding.
_FLAT = 1e-15


class HopfLaxEngine(SimplexEngine):
    """Distance by the Hopf-Lax formula on each simplex, of second order, until nothing changes.

    Parameters
    ----------
    simplices : MetricSimplices
        Triangles or tetrahedra with `tensors`; `heat_igl.kernels.sweep.hopf_lax` describes the scheme.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        super().__init__(simplices)
        varies = 100 * float(np.sqrt(simplices.measured[-1]))
        turns = "the metric turns farther than the mesh resolves: over an edge, the ratio of its lengths in two "
        turns += f"directions changes by a factor of {self.turning:.2g} or more at a tenth of the faces"
        grows = "the metric varies farther than the mesh resolves: lengths of edges differ between the corners of a "
        grows += f"face by {varies:.0f} % in the mean"
        if self.turning > MOST_TURNING or varies > 100 * MOST_VARIATION:
            warn_caller(
                f"{turns if self.turning > MOST_TURNING else grows}, and distance may be wrong by several percent, and "
                "by tens at single vertices: take a finer mesh",
                AccuracyWarning,
            )

    @cached_property
    def turning(self) -> float:
        """By how much the ratio of lengths in two directions changes over an edge, at a tenth of the simplices.

        From a sample of the simplices: between the first corner of one, and a simplex that it meets in another, with
        planes of triangles turned into each other. It is 1 where tensors differ by a factor alone, as those of speeds.
        """
        corners, place = self._simplices.corners, self._simplices.place
        size = corners.shape[1]
        chosen = np.arange(0, len(corners), len(corners) // _SAMPLE + 1)
        one = np.repeat(chosen, size)
        other, corner = np.divmod(self._incident[self._first[corners[chosen]]].ravel(), size)
        first, two = self._simplices.metric(one, 0), self._simplices.metric(other, corner)
        if size == 3:
            x, y = (plane_axes(Mesh(place, corners[k])) for k in (one, other))
            here, there = (np.cross(axes[:, 0], axes[:, 1]) for axes in (x, y))
            w, cosine = np.cross(here, there), (here * there).sum(axis=1)
            # Rodrigues' formula for the rotation that takes one normal to the other.
            once = np.cross(w[:, None], x)
            turned = x + once + np.cross(w[:, None], once) / np.maximum(1 + cosine, _ROUNDING)[:, None, None]
            first, two = (axes @ g @ np.swapaxes(axes, 1, 2) for axes, g in ((x, first), (turned, two)))
            # Triangles without area know no metric in their plane.
            flat = ~np.all(
                [np.linalg.det(g) > _FLAT * np.trace(g, axis1=1, axis2=2) ** 2 for g in (first, two)], axis=0
            )
            first[flat] = two[flat] = np.eye(2)
            low, high = np.sort(np.linalg.eigvals(np.linalg.solve(first, two)).real).T
        else:
            root = symmetric(inverse_root(first)[0])
            low, high = inverse_root(root @ two @ root)[2].T
        ratio = np.sqrt(np.maximum(high, _ROUNDING) / np.maximum(low, _ROUNDING))
        return float(np.quantile(ratio.reshape(-1, size).max(axis=1), 0.9))

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
