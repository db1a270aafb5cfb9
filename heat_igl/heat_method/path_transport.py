"""Values and tangent vectors carried along shortest paths: each vertex takes those of its nearest source."""

from __future__ import annotations

import numpy as np

from heat_igl.heat_method.directions import carried
from heat_igl.heat_method.solver import HeatMethodSolver
from heat_igl.intrinsic import PolarAngles, TangentFrames
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["PathTransport"]

# Tolerance of the walks, for directions.
_STRAIGHT = 1e-6


class PathTransport:
    """Extension, transport and the logarithmic map by the shortest paths that a solver finds.

    Parameters
    ----------
    solver : HeatMethodSolver
        With ``refine="unfold"`` or ``"exact"``.
    polar : PolarAngles
        Around the vertices, of the frames in which vectors are given.
    """

    def __init__(self, solver: HeatMethodSolver, polar: PolarAngles) -> None:
        self._solver, self._polar = solver, polar

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """The value (n,) of the nearest source; 0 without one. `values` (k,) are those at `vertices` (k,)."""
        _, labels, _, _ = self._solver._paths(vertices, _STRAIGHT)
        return np.asarray(_of_nearest(vertices, values, labels))

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Complex numbers (n,), the vector of the nearest source, turned on the way; `vectors` (k, 2) are given."""
        _, labels, angles, _ = self._solver._paths(vertices, _STRAIGHT)
        return _of_nearest(vertices, vectors @ [1, 1j], labels) * carried(angles, labels, vertices, self._polar)

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) as long as the distance, in the direction in which the path departs from `vertex`."""
        distance, _, angles, _ = self._solver._paths(vertex, _STRAIGHT)
        return TangentFrames.from_angles(np.nan_to_num(angles.departure), np.where(np.isfinite(distance), distance, 0))


def _of_nearest(vertices: IntArray, numbers: AnyArray, labels: IntArray) -> AnyArray:
    """The number of the source of each label (n,), 0 for -1; a source named twice has the mean of the numbers."""
    _, which, count = np.unique(vertices, return_inverse=True, return_counts=True)
    total = np.zeros(len(count), numbers.dtype)
    np.add.at(total, which, numbers)
    return np.where(labels < 0, 0.0, (total / count)[which][labels])
