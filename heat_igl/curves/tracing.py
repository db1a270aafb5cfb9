"""Paths down a distance over a triangulation: the arguments of the kernels that trace and straighten them.

A path follows the steepest descent. If it becomes too long, it is aimed at points ahead by their distances. It is first
a *strip*: a sequence of crossings, each from a half-edge of one face to a half-edge of the next on the same edge. Laid
out in the plane the strip is a polygon, in which a funnel finds the shortest path; where that bends at a vertex which
can be passed another way, the strip is led there.
"""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np

from heat_igl.intrinsic import corner_angles
from heat_igl.kernels.paths import tracing
from heat_igl.mesh import Mesh
from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

__all__ = ["Goals", "Surface", "goals", "opposite_sides", "surface", "trace"]

# Edges are at least this long, in mean edge lengths: the kernel divides by lengths.
_SHORTEST = 1e-12
_TRIANGLE = np.dtype(
    [*((name, "f8", 3) for name in ("length", "angle", "along", "above")), ("vertex", "i4", 3), ("edge", "i4", 3)]
)
_GOAL = np.dtype([("start", "f8", 3), ("end", "f8", 3), ("offset", "f8")])


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


class Goals(NamedTuple):
    """Sources at which paths may end; see `goals`.

    Attributes
    ----------
    is_source : (n,) bool
        The vertices that are sources.
    first_inside : (m + 1,) int32
        Sources inside face f are rows ``first_inside[f]`` to ``first_inside[f + 1]`` of `inside`.
    inside : (p,) structures
        The segments, `start` and `end`, and the `offset` of each.
    escape : (n,) int32
        The next vertex on a path along edges to a source, taken if the descent ends too early; -1 if there is none.
    """

    is_source: BoolArray
    first_inside: AnyArray
    inside: AnyArray
    escape: AnyArray


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


def goals(
    is_source: BoolArray, first_inside: IntArray, inside: FloatArray, offset: FloatArray, escape: IntArray
) -> Goals:
    """Sources at which paths may end: segments with ends `inside` (p, 2, 3), equal for a point, and offsets (p,)."""
    segment = np.empty(len(inside), _GOAL)
    segment["start"], segment["end"], segment["offset"] = inside[:, 0], inside[:, 1], offset
    return Goals(is_source, first_inside.astype(np.int32), segment, escape.astype(np.int32))


def trace(
    s: Surface, d: FloatArray, goals: Goals, face: IntArray, barycentric: FloatArray, max_steps: int
) -> tuple[IntArray, FloatArray, IntArray]:
    """Paths from points down to sources.

    Parameters
    ----------
    s : Surface
        Triangles.
    d : (n,) float64
        The distance to descend.
    goals : Goals
        Sources at which to end.
    face, barycentric : (k,) int64, (k, 3) float64
        Where to begin.
    max_steps : int
        After this many steps without an end, the path follows `Goals.escape`.

    Returns
    -------
    faces : (s,) int64
        Of all segments, path after path.
    points : (s, 2, 3) float64
        Barycentric coordinates of their starts and ends.
    first : (k + 1,) int64
        Segments of path i are ``first[i]`` to ``first[i + 1]``; none where no way was found.
    """
    faces, points, first = tracing.trace(
        s, d, goals, np.ascontiguousarray(face, np.int64), np.ascontiguousarray(barycentric), max_steps
    )
    return faces, points, first
