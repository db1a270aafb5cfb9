"""Tables of the spokes around vertices, and their triangles, as a sweep reads them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import HalfEdges, IntrinsicTriangulation
from heat_igl.kernels.sweep import spokes
from heat_igl.typing import AnyArray, BoolArray, FloatArray

_SPOKE = np.dtype(
    [(name, "f8") for name in ("length", "along", "height", "base", "beyond_along", "beyond_depth")]
    + [(name, "i4") for name in ("neighbour", "next_neighbour", "beyond", "next")]
)


class Spokes(NamedTuple):
    """The edges around n vertices, each with the triangle to the left of it.

    Attributes
    ----------
    first : (n + 1,) int32
        Spokes of vertex v are ``first[v]`` to ``first[v + 1]``, fan after fan, each counter-clockwise as the face of
        the lowest number there has it.
    spoke : (s,) structures
        `length`. Of the triangle to the left of the spoke: v's place over the opposite side, `along` it from the
        spoke's end and in `height`; the length of that side, `base`; and the place of the vertex beyond it,
        `beyond_along` it and in `beyond_depth`. Past the end of an open fan, without a triangle, these are 0
        and the height is nan, so that whatever is computed from them compares false. The `neighbour`; the one at the
        next spoke, `next_neighbour`; the vertex `beyond` the side between them, -1 if none; the `next` spoke, on the
        other side of that triangle (or the spoke itself).
    total : (k,) float64
        Sum of the angles of each fan, negative for a fan that is open.
    is_flat : (n,) bool
        Whether a vertex, or the first fan of it, has no curvature; true on the boundary.
    """

    first: AnyArray
    spoke: AnyArray
    total: FloatArray
    is_flat: BoolArray


def numbered_spokes(triangulation: IntrinsicTriangulation) -> tuple[AnyArray, Spokes]:
    """The rows (n,) of the vertices, which are numbered breadth-first, and their spokes.

    Neighbours on the surface become neighbours in memory: nothing on most meshes, a fifth of the time where vertices
    come in an arbitrary order. Faces need no common orientation.
    """
    edges, number, _ = HalfEdges.of(triangulation).numbered(triangulation.n)
    first = spokes.first_spokes(edges, len(number))
    spoke = aligned(first[-1], _SPOKE)
    total, is_flat = spokes.fill(edges, first, spoke)
    return number, Spokes(first, spoke, total, is_flat)


def aligned(n: int, record: np.dtype[np.void]) -> AnyArray:
    """Structures of zeros whose first address is a multiple of a cache line, 64 bytes."""
    size = int(n) * record.itemsize  # beyond 32 bits from 11 million vertices on, unlike n
    room = np.zeros(size + 64, np.uint8)
    start = -room.ctypes.data % 64
    return room[start : start + size].view(record)
