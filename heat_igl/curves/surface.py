"""The triangles of a mesh as the kernels of paths read them."""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np

from heat_igl.intrinsic import corner_angles
from heat_igl.mesh import Mesh
from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import AnyArray

__all__ = ["Surface", "opposite_sides", "surface"]

# Edges are at least this long, in mean edge lengths: the kernel divides by lengths.
_SHORTEST = 1e-12
_TRIANGLE = np.dtype(
    [*((name, "f8", 3) for name in ("length", "angle", "along", "above")), ("vertex", "i4", 3), ("edge", "i4", 3)]
)


class Surface(NamedTuple):
    """Triangles for the kernels; see `surface`.

    Attributes
    ----------
    triangle : (m,) structures
        Of each face its edge `length` opposite each corner, the `angle` at each, its `vertex` and `edge` numbers.
        Corner c lies `along` of the way from corner c + 2 to c + 1, and `above` this edge, in lengths of the edge.
    first_side, side : (k + 1,), (3 m,) int32
        Half-edges of edge e are ``side[first_side[e]:first_side[e + 1]]``.
    first_corner, corner : (n + 1,), (3 m,) int32
        Corners at vertex v are ``corner[first_corner[v]:first_corner[v + 1]]``, numbered like half-edges.
    """

    triangle: AnyArray
    first_side: AnyArray
    side: AnyArray
    first_corner: AnyArray
    corner: AnyArray


def surface(mesh: Mesh) -> Surface:
    """The tables of a triangle mesh."""
    # Not mollified: mollification gives a flat triangle some height, and would bend the paths across it.
    lengths = np.maximum(igl.edge_lengths(mesh.V, mesh.F), _SHORTEST * mesh.edge_lengths.mean())
    triangle = np.empty(mesh.n_faces, _TRIANGLE)
    triangle["length"], triangle["angle"] = lengths, corner_angles(lengths)
    base, left, right = lengths, np.roll(lengths, -1, axis=1), np.roll(lengths, -2, axis=1)
    half = (base + left + right) / 2
    # By Heron's formula. `left` is the side from corner c to corner c + 2.
    triangle["along"] = ((left - right) * (left + right) / base + base) / (2 * base)
    triangle["above"] = 2 * np.sqrt(np.maximum(half * (half - base) * (half - left) * (half - right), 0)) / base**2
    triangle["vertex"], triangle["edge"] = mesh.F, mesh.facets.of_face
    sides = group_by_label(mesh.facets.of_face.ravel(), len(mesh.facets.n_faces))
    corners = group_by_label(mesh.F.ravel(), mesh.n_vertices)
    return Surface(triangle, *(array.astype(np.int32) for array in (*sides, *corners)))


def opposite_sides(surface: Surface) -> AnyArray:
    """The half-edge (3 m,) int32 on the other side of each, -1 where the edge has not two faces."""
    opposite = np.full(len(surface.side), -1, np.int32)
    inner = surface.first_side[:-1][np.diff(surface.first_side) == 2]
    one, other = surface.side[inner], surface.side[inner + 1]
    opposite[one], opposite[other] = other, one
    return opposite
