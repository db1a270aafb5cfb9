"""Values and vectors on surfaces without an orientation: carried on the cover by both sides, seen from one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.heat.directions import Directions
from heat_igl.heat.heat_transport import HeatTransport
from heat_igl.heat.path_transport import PathTransport
from heat_igl.intrinsic import TangentFrames
from heat_igl.mesh.cloud_orientation import on_one_side
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows import in_circle

__all__ = ["TwoSidedTransport", "directions_from_one_side"]


class TwoSidedTransport:
    """Extension, transport and the logarithmic map on a surface of n vertices, by those on the cover.

    Vertex v of the surface is v and v + n on the cover, see `two_sided_cover`. A source sends its vector from both: a
    mirror image from the second, so that at each vertex the two copies get mirror images, too. This is the vector heat
    method with a connection that reflects where neighbours are oriented differently, as Sharp, Soliman and Crane
    (2019) have it for points.

    Parameters
    ----------
    on_cover : HeatTransport or PathTransport
        On the cover.
    frames : TangentFrames
        Of the cover.
    n : int
        Vertices of the surface.
    """

    def __init__(self, on_cover: HeatTransport | PathTransport, frames: TangentFrames, n: int) -> None:
        self._on_cover, self._n = on_cover, n
        #: Of the vertices on the first side.
        self.frames = replace(frames, x=frames.x[:n], y=frames.y[:n], normal=frames.normal[:n])
        self._turn = _axis_of_second_side(frames, n)

    def extend(self, vertices: IntArray, values: FloatArray) -> FloatArray:
        """Values (n,) from values (k,) at `vertices` (k,)."""
        return self._on_cover.extend(self.on_both(vertices), np.tile(values, 2))[: self._n]

    def transport(self, vertices: IntArray, vectors: FloatArray) -> AnyArray:
        """Vectors as complex numbers (n,), from vectors (k, 2) at `vertices` (k,)."""
        mirrored = self._turn[vertices] * (vectors @ [1, -1j])
        both = np.concatenate([vectors, np.stack([mirrored.real, mirrored.imag], axis=1)])
        return self._on_cover.transport(self.on_both(vertices), both)[: self._n]

    def log_map(self, vertex: int) -> FloatArray:
        """Vectors (n, 2) from `vertex`: to that of the two copies of each other vertex which is nearer."""
        found = self._on_cover.log_map(vertex)
        sides = found[: self._n], found[self._n : 2 * self._n]
        length = np.stack([np.hypot(*side.T) for side in sides])
        # 0 where the copy is not reached.
        length[length == 0] = np.inf
        nearer = np.where((length[1] < length[0])[:, None], sides[1], sides[0])
        nearer[vertex] = 0
        return np.asarray(nearer)

    def on_both(self, vertices: IntArray) -> IntArray:
        """The vertices (2 k,) of the cover that are `vertices` (k,)."""
        return np.concatenate([vertices, vertices + self._n])


def directions_from_one_side(found: Directions, frames: TangentFrames, n: int, m: int) -> Directions:
    """The directions of paths from the first side of a cover, see `two_sided_cover`, on the n vertices and m faces.

    Of the two copies of a vertex that which is nearer; arrivals on the second side are seen from the first.
    """
    is_other = found.distance[n : 2 * n] < found.distance[:n]
    seen = found.of(np.arange(n) + n * is_other)
    mirrored = in_circle(np.angle(_axis_of_second_side(frames, n)) - seen.arrival)
    start = unchecked_points(*on_one_side(seen.start.faces, seen.start.barycentric, m))
    return replace(seen, arrival=np.where(is_other, mirrored, seen.arrival), start=start)


def _axis_of_second_side(frames: TangentFrames, n: int) -> AnyArray:
    """The x axis (n,) of the second side, as complex numbers in the frame of the first."""
    x = frames.x[n : 2 * n]
    return np.asarray(np.einsum("nx,nx->n", x, frames.x[:n]) + 1j * np.einsum("nx,nx->n", x, frames.y[:n]))
