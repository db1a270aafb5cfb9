"""Half-edge tables for walks over a triangulation: faces across edges, and directions of edges at vertices.

The faces are oriented alike. Half-edge ``3 f + c`` is the side of face ``f`` opposite corner ``c``, and a *corner*
carries the same number. A *fan* is a set of corners around a vertex that are glued to one another; directions at a
vertex are angles in the fan, counted counter-clockwise from the first spoke.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.kernels import half_edges, numbering
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["Tables", "aligned", "breadth_first", "tables"]


def _record(lengths: str, numbers: str) -> np.dtype[np.void]:
    """A structure of float64, then int32 fields."""
    return np.dtype([(name, "f8") for name in lengths.split()] + [(name, "i4") for name in numbers.split()])


_SPOKE = _record("length along height base beyond_along beyond_depth", "neighbour next_neighbour beyond next")
_TURN = _record("here there", "fan_here fan_there corner across")
_STEP = np.dtype([*_record("x y direction angle", "vertex fan to_right to_left").descr, ("spare", "f8", 2)])


class Tables(NamedTuple):
    """Data that a walk reads: one structure for each visit of a spoke and one for each step, to read little memory.

    Attributes
    ----------
    first : (n + 1,) int32
        Spokes of vertex v are ``first[v]`` to ``first[v + 1]``, counter-clockwise, fan after fan.
    spoke : (s,) structures
        `length`. Of the triangle to the left of the spoke: v's place over the opposite side, `along` it from the
        spoke's end and in `height`; the length of that side, `base`; and the place of the vertex beyond it,
        `beyond_along` it and in `beyond_depth`. Past the end of an open fan, without a triangle, these are 0
        and the height is nan, so that whatever is computed from them compares false. The `neighbour`; the one at the
        next spoke, `next_neighbour`; the vertex `beyond` the side between them, -1 if none; the `next` spoke, on the
        other side of that triangle (or the spoke itself).
    turn : (s,) structures
        Direction of the spoke at v, `here`, and of the same edge at the neighbour, `there` (angles in their fans). v's
        fan, `fan_here`; the neighbour's, `fan_there`; the half-edge opposite v in the triangle to the left, `corner`,
        -1 if none; the half-edge `across` that one, -1 if none, -2 if more than one.
    step : (3 m,) structures
        For a half-edge through which a triangle is entered, the position of the far `vertex`, `x` and `y` in units of
        the half-edge; in its `fan` the `direction` of the edge to the right end of the half-edge (seen in the walk: to
        b), and the `angle` of the corner. The half-edge to enter the next triangle by when passing right of it,
        `to_right`, and when passing left of it, `to_left`; -1 on the boundary, -2 at edges of more than two faces.
    total : (k,) float64
        Sum of the angles of each fan, negative for a fan that is open.
    is_flat : (n,) bool
        Whether a vertex, or the first fan of it, has no curvature; true on the boundary.
    """

    first: AnyArray
    spoke: AnyArray
    turn: AnyArray
    step: AnyArray
    total: FloatArray
    is_flat: BoolArray

    def across(self, faces: IntArray, corners: IntArray) -> IntArray:
        """Half-edges (k,) on the other side of those opposite the corners of faces (k,); negative if there are none."""
        return np.asarray(self.step["to_right"][3 * faces + (corners + 2) % 3].astype(np.int64))


def breadth_first(
    F: IntArray,
    l: FloatArray,
    twin: IntArray,
    n: int,
) -> tuple[AnyArray, AnyArray, AnyArray, FloatArray, AnyArray]:
    """Vertices and faces numbered breadth-first, see `heat_igl.kernels.numbering`.

    Returns the new number of each vertex (n,) and of each face (m,), and F, l and twin by the new numbers, all integers
    int32. Neighbours on the surface become neighbours in memory: nothing on most meshes, a fifth of the time where
    vertices come in an arbitrary order.
    """
    vertex, new_twin, _, _, length, number, old_face = numbering.breadth_first(
        F.ravel().astype(np.int32), twin.astype(np.int32), None, None, np.ascontiguousarray(l).ravel(), n, 0
    )
    face = np.empty_like(old_face)
    face[old_face] = np.arange(len(F), dtype=np.int32)
    return number, face, vertex.reshape(-1, 3), length.reshape(-1, 3), new_twin


def tables(F: AnyArray, l: FloatArray, twin: AnyArray, n: int) -> Tables:
    """The tables of m oriented triangles on n vertices; `twin` is -1 on the boundary, -2 at edges of more than two.

    Faces and half-edges as `breadth_first` returns them.
    """
    first = half_edges.first_spokes(F, twin, n)
    spoke, turn, step = aligned(first[-1], _SPOKE), aligned(first[-1], _TURN), aligned(F.size, _STEP)
    total, is_flat = half_edges.fill(F, l, twin, first, spoke, turn, step)
    return Tables(first, spoke, turn, step, total, is_flat)


def aligned(n: int, record: np.dtype[np.void]) -> AnyArray:
    """Structures of zeros whose first address is a multiple of a cache line, 64 bytes."""
    size = int(n) * record.itemsize  # beyond 32 bits from 11 million vertices on, unlike n
    room = np.zeros(size + 64, np.uint8)
    start = -room.ctypes.data % 64
    return room[start : start + size].view(record)
