"""Values and tangent vectors carried along shortest paths: each vertex takes those of its nearest source."""

from __future__ import annotations

import numpy as np

from heat_igl.heat.directions import carried
from heat_igl.intrinsic import PolarAngles, TangentFrames
from heat_igl.sources import source_set
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows import PathAngles, WindowEngine

__all__ = ["PathTransport"]


class PathTransport:
    """Extension, transport and the logarithmic map by exact shortest paths.

    Parameters
    ----------
    engine : WindowEngine
        Finds the paths.
    polar : PolarAngles
        Around the vertices, of the frames in which vectors are given.
    """

    def __init__(self, engine: WindowEngine, polar: PolarAngles) -> None:
        self._engine, self._polar = engine, polar

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """The value (n,) of the nearest source; 0 without one. `values` (k,) are those at `vertices` (k,)."""
        _, labels, _ = self._paths(vertices)
        return np.asarray(_of_nearest(vertices, values, labels))

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Complex numbers (n,), the vector of the nearest source, turned on the way; `vectors` (k, 2) are given."""
        _, labels, angles = self._paths(vertices)
        return _of_nearest(vertices, vectors @ [1, 1j], labels) * carried(angles, labels, vertices, self._polar)

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) as long as the distance, in the direction in which the path departs from `vertex`."""
        distance, _, angles = self._paths(np.array([vertex]))
        return TangentFrames.from_angles(np.nan_to_num(angles.departure), np.where(np.isfinite(distance), distance, 0))

    def _paths(self, vertices: IntArray) -> tuple[FloatArray, IntArray, PathAngles]:
        sources = source_set(vertices, len(self._polar.sums), None)
        return self._engine.directed(sources)[:3]


def _of_nearest(vertices: IntArray, numbers: AnyArray, labels: IntArray) -> AnyArray:
    """The number of the source of each label (n,), 0 for -1; a source named twice has the mean of the numbers."""
    _, which, count = np.unique(vertices, return_inverse=True, return_counts=True)
    total = np.zeros(len(count), numbers.dtype)
    np.add.at(total, which, numbers)
    return np.where(labels < 0, 0.0, (total / count)[which][labels])
