"""A triangulated surface in the layout of the window kernels: renumbered half-edges, and points in them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np

from heat_igl.intrinsic import (
    HalfEdges,
    IntrinsicTriangulation,
    Merged,
    each_face_once,
    intrinsic_triangulation,
    lay_out,
)
from heat_igl.intrinsic.half_edges import mean_exponent
from heat_igl.intrinsic.triangulation import next_half_edge
from heat_igl.kernels.mesh import gluing
from heat_igl.kernels.windows.surface import shapes
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.sources import SourcePoints, SourceSegments
from heat_igl.typing import AnyArray, FloatArray, IntArray

#: Mollification for windows, in mean edge lengths: just more than rounding. With the default margin of `mollify`, paths
#: across needles were too long by up to 3e-4 of their length.
MARGIN = 1e-12
# A point with a barycentric coordinate below this lies on the side of its face.
_ON_SIDE = 1e-13
# Up to _FEW_FACES faces, the tables fit into the caches, and stay as they are if the numbers of most adjacent faces
# differ by at most _NEAR. From 10 to 5000 a search takes the same time, within 5 %, on six shapes of 3600 to 10k faces.
_FEW_FACES, _NEAR = 30_000, 768
# Two to the power of this, and its inverse, are normal floating-point numbers.
_LARGEST_EXPONENT = 1000


class Located(NamedTuple):
    """Points in renumbered triangles. A point on a side has a copy in every triangle there. Arrays are contiguous.

    Attributes
    ----------
    faces : (q,) int32
        Triangle of each copy.
    barycentric : (q, 3) float64
        Barycentric coordinates in it; exactly 0 on a side.
    point : (q,) int64
        Index of the point.
    turn : (q,) float64
        Angle to be added to the angle of a direction in this triangle to get the angle in the first triangle of the
        point; both are measured from the side of corners 0 and 1. Requires consistently oriented faces.
    """

    faces: AnyArray
    barycentric: FloatArray
    point: IntArray
    turn: FloatArray


#: No points, and no segments, in any triangles.
NO_POINTS = Located(np.empty(0, np.int32), np.empty((0, 3)), np.empty(0, np.int64), np.empty(0))
NO_SEGMENTS = NO_POINTS._replace(barycentric=np.empty((0, 2, 3)))


class Tables:
    """The arrays that a window search reads of a surface, with renumbered vertices and faces.

    Parameters
    ----------
    edges : HalfEdges
        The renumbered triangles. Their lengths are scaled in place.
    number : (n,) int32
        The new number of each of the caller's vertices.
    face : (m,) int32
        The caller's number of each face.
    exponent : int
        Lengths are in units of ``2 ** exponent``.
    triangulation : IntrinsicTriangulation, optional
        The triangulation from which the tables were made, to locate points.

    Attributes
    ----------
    double_area, bulge, corner_of_vertex, next_corner, n_corners, kind, is_delaunay
        See `heat_igl.kernels.windows.surface.shapes`.
    """

    def __init__(
        self,
        edges: HalfEdges,
        number: AnyArray,
        face: AnyArray,
        exponent: int = 0,
        triangulation: IntrinsicTriangulation | None = None,
    ) -> None:
        self.edges, self.number, self.face = edges, number, face
        m, n = len(face), len(number)
        # Scaling by a power of two is exact, and keeps squares within the range of doubles.
        shift = mean_exponent(edges.length)
        _times_power(edges.length, -shift, out=edges.length)
        self.n, self.exponent = n, exponent + shift
        self._triangulation = triangulation
        self.double_area, self.bulge = np.empty(m), np.empty(3 * m)
        self.corner_of_vertex, self.next_corner = np.full(n, -1, np.int32), np.empty(3 * m, np.int32)
        self.n_corners, self.kind = np.zeros(n, np.int32), np.zeros(n, np.uint8)
        self.is_delaunay = shapes(self)

    @cached_property
    def old_vertex(self) -> IntArray:
        """The caller's number of each vertex (n,)."""
        vertex = np.empty(self.n, np.int64)
        vertex[self.number] = np.arange(self.n)
        return vertex

    def scaled(self, lengths: FloatArray | float) -> FloatArray:
        """Lengths of the caller in the unit of the tables."""
        return _times_power(lengths, -self.exponent)

    def unscaled(self, lengths: FloatArray) -> FloatArray:
        """Lengths of the tables in the caller's unit."""
        return _times_power(lengths, self.exponent)

    def old_half_edge(self, half_edge: AnyArray) -> IntArray:
        """Half-edges in the caller's numbering; -1 stays."""
        old = 3 * self.face[half_edge // 3].astype(np.int64) + half_edge % 3
        return np.asarray(np.where(half_edge >= 0, old, -1))

    def located(self, points: SurfacePoints | SourcePoints | None, turned: bool = False) -> Located:
        """Points of the mesh in the triangles; a ValueError for tables without history, as those of `from_mesh`.

        The turns of copies are 0 unless asked for by `turned`.
        """
        if points is None or not len(points.faces):
            return NO_POINTS
        if self._triangulation is None:
            raise ValueError("this surface knows vertices only: make it from a triangulation")
        faces, barycentric = self._triangulation.locate(points.faces, points.barycentric)
        located = self._on_all_faces(faces, barycentric[:, None], turned)
        return located._replace(barycentric=located.barycentric[:, 0])

    def located_segments(self, segments: SourceSegments) -> Located:
        """Segments in the triangles, as `located`, with coordinates (q, 2, 3) of both ends.

        A ValueError if the triangles are not those in which the segments were given.
        """
        if not len(segments.faces):
            return NO_SEGMENTS
        if self._triangulation is None or self._triangulation.n_flips:
            raise ValueError("segments need triangles that were not flipped: make this surface from those of the mesh")
        ends = [self._triangulation.locate(segments.faces, end) for end in (segments.start, segments.end)]
        return self._on_all_faces(ends[0][0], np.stack([end[1] for end in ends], axis=1))

    def _on_all_faces(self, faces: IntArray, barycentric: FloatArray, turned: bool = False) -> Located:
        """Sets of e points each (k, e, 3) in renumbered faces, with a copy for every further face at a side."""
        t = self.edges
        faces = self._new_face[faces]
        barycentric = np.where(barycentric < _ON_SIDE, 0.0, barycentric)
        barycentric /= barycentric.sum(axis=-1, keepdims=True)
        point = np.arange(len(faces))
        rows = [(faces, barycentric, point, np.zeros(len(faces)))]
        is_zero = (barycentric == 0).all(axis=1)
        i, c = np.nonzero(is_zero & (is_zero.sum(axis=1) == 1)[:, None])
        start = here = 3 * faces[i] + c
        while len(here):
            # Go to the other triangle at the side, or to the next of several, until all have been visited.
            there = np.where(t.twin[here] >= 0, t.twin[here], t.ring[here]).astype(np.int64)
            go_on = there != start
            i, c, start, here = i[go_on], c[go_on], start[go_on], there[go_on]
            same_vertex = t.vertex[next_half_edge(start)] == t.vertex[next_half_edge(here)]
            same_way = np.where(t.twin[start] >= 0, t.aligned[start] == 0, same_vertex)[:, None]
            tail, head = barycentric[i, :, (c + 1) % 3], barycentric[i, :, (c + 2) % 3]
            other, k = np.zeros((len(i), *barycentric.shape[1:])), np.arange(len(i))
            other[k, :, (here + 1) % 3] = np.where(same_way, tail, head)
            other[k, :, (here + 2) % 3] = np.where(same_way, head, tail)
            # The direction of the side is reversed there.
            turn = np.angle(-self._along(start) * self._along(here).conj()) if turned else np.zeros(len(i))
            rows.append((here // 3, other, point[i], turn))
        faces, barycentric, point, turn = (np.concatenate(column) for column in zip(*rows, strict=True))
        return Located(faces.astype(np.int32), np.ascontiguousarray(barycentric), point, turn)

    @cached_property
    def _new_face(self) -> IntArray:
        """The number of each face of the caller."""
        number = np.empty(self.face.max() + 1, np.int64)
        number[self.face] = np.arange(len(self.face))
        return number

    def _along(self, half_edge: IntArray) -> AnyArray:
        """Half-edges (k,) as complex numbers in their triangles, in which the side of corners 0 and 1 is real."""
        corners = lay_out(self.edges.length.reshape(-1, 3)[half_edge // 3]) @ np.array([1, 1j])
        k = np.arange(len(half_edge))
        return np.asarray(corners[k, (half_edge + 2) % 3] - corners[k, (half_edge + 1) % 3])

    def by_face(self, located: Located) -> tuple[AnyArray, AnyArray]:
        """The first point of each triangle, and the next point of the same triangle; -1 for none."""
        faces = located.faces
        if not len(faces):
            return faces, faces
        first = np.full(len(self.face), -1, np.int32)
        following = np.full(len(faces), -1, np.int32)
        order = np.argsort(faces, kind="stable")
        first[faces[order][::-1]] = order[::-1]
        same = faces[order][1:] == faces[order][:-1]
        following[order[:-1][same]] = order[1:][same]
        return first, following

    def largest_circle(self, located: Located) -> float:
        """Diameter of the largest circumcircle of a triangle with a point; 0 without points."""
        if not len(located.faces):
            return 0.0
        sides = self.edges.length.reshape(-1, 3)[located.faces]
        return float((sides.prod(axis=1) / self.double_area[located.faces]).max())


def from_triangulation(triangulation: IntrinsicTriangulation) -> Tables:
    """The tables of a triangulation; a MeshError if there are too many triangles for 32-bit indices."""
    # Windows would be propagated in every copy of a face, and multiply.
    once, kept = each_face_once(triangulation)
    edges, number, face = HalfEdges.of(once).numbered(once.n)
    if once is not triangulation:
        merged = cast(Merged, once.history[-1])
        in_given = merged._replace(face=kept[merged.face])
        triangulation = replace(triangulation, history=(*triangulation.history, in_given))
    return Tables(edges, number, kept[face], triangulation=triangulation)


def from_mesh(mesh: Mesh, start: int) -> Tables:
    """The tables of the intrinsic Delaunay triangulation of a mesh without a history, for distances from vertices.

    Faces are sorted in memory by their distance from vertex `start`, unless the mesh is small and most adjacent faces
    have close numbers: then the numbering is kept.
    """
    edges, exponent = HalfEdges.of_mesh(mesh)
    if (edges.twin == -2).any():
        _, kept = each_face_once(intrinsic_triangulation(mesh))
        if len(kept) < mesh.n_faces:
            return from_mesh(Mesh(mesh.V, mesh.F[kept]), start)
    if not edges.aligned.all():
        from heat_igl.operators import unfolding_surface

        return from_triangulation(unfolding_surface(mesh, MARGIN).triangulation)
    edges.flip(MARGIN)
    m, n = mesh.n_faces, mesh.n_vertices
    if m <= _FEW_FACES and gluing.n_near(edges.twin, _NEAR) > 3 * m // 2:
        return Tables(edges, np.arange(n, dtype=np.int32), np.arange(m, dtype=np.int32), exponent)
    edges, number, face = edges.numbered(n, int(np.argmax(edges.vertex == start)) // 3)
    return Tables(edges, number, face, exponent)


def _times_power(lengths: FloatArray | float, exponent: int, out: FloatArray | None = None) -> FloatArray:
    """Lengths times ``2 ** exponent``, in place of `out` if that is given."""
    if abs(exponent) > _LARGEST_EXPONENT:
        return np.asarray(np.ldexp(lengths, exponent, out=out))
    return np.asarray(np.multiply(lengths, 2.0**exponent, out=out))  # the same bits as ldexp, ten times as fast
