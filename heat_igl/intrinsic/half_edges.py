"""Triangles by half-edges, the record that rooms and kernels read; mollification, and flips without a history."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.kernels.mesh import flipping, gluing
from heat_igl.mesh import DELAUNAY_TOLERANCE, Mesh, connectivity
from heat_igl.typing import AnyArray, FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.intrinsic.triangulation import IntrinsicTriangulation

# The triangle inequality holds with this margin, in mean edge lengths. With 1e-9 heat gives the same on 95 shapes, with
# 1e-6 it is 160 % wrong on a needle.
_MARGIN = 1e-8
# Edges around corners that coincide, in mean edge lengths: `mollify` says why.
_SHORTEST = 1e-10
# Half-edges and vertices that indices of 32 bits tell apart, with room for two bits of the kernels' own.
_TOO_MANY = 2**29
# A last bound on the work; meshes measured so far take less than one flip per face.
_MOST_FLIPS_PER_FACE = 100
# Areas are made of fourth powers of lengths, which are normal numbers up to here, far below 1 too.
_LARGEST_LENGTH = 1e30


class HalfEdges(NamedTuple):
    """m triangles by their half-edges. Half-edge ``3 f + c`` is the side of face f opposite its corner c.

    Attributes
    ----------
    vertex : (3 m,) int32
        Vertex of each corner.
    twin : (3 m,) int32
        The half-edge glued to each: -1 on the boundary, -2 where more than two faces meet.
    ring : (3 m,) int32
        Where more than two faces meet, the next half-edge of the same edge; elsewhere the half-edge itself.
    aligned : (3 m,) uint8
        Whether the faces at a glued half-edge run along it in opposite directions.
    length : (3 m,) float64
        Of each half-edge, of glued ones the same.
    """

    vertex: AnyArray
    twin: AnyArray
    ring: AnyArray
    aligned: AnyArray
    length: FloatArray

    @classmethod
    def of_mesh(cls, mesh: Mesh) -> tuple[HalfEdges, int]:
        """The triangles of a mesh, with lengths in units of ``2 ** exponent``, and the exponent.

        It is 0, but for very large or small meshes the power of two just above the mean extent. A MeshError if there
        are too many triangles for 32-bit indices.
        """
        require_room(mesh.n_faces, mesh.n_vertices)
        exponent = 0
        found = cls(*gluing.glue(mesh.F, mesh.V, 1.0))
        if not 1 / _LARGEST_LENGTH < found.length.max() < _LARGEST_LENGTH:
            # Once more in a unit in which no square leaves the range of doubles.
            exponent = mean_exponent(np.array([np.ptp(x[mesh.F[:, :2]]) for x in mesh.V.T]))
            found = cls(*gluing.glue(mesh.F, mesh.V, np.ldexp(1.0, -exponent)))
        return found, exponent

    @classmethod
    def of(cls, triangulation: IntrinsicTriangulation) -> HalfEdges:
        """Those of a triangulation; a MeshError if there are too many triangles for 32-bit indices."""
        require_room(len(triangulation.F), triangulation.n)
        ring = np.arange(len(triangulation.twin), dtype=np.int32)
        many = np.flatnonzero(triangulation.twin == -2)
        if len(many):
            # Such edges were never flipped: the two vertices tell them apart.
            ends = np.sort(np.stack([triangulation.tail(many), triangulation.head(many)]), axis=0)
            order = np.lexsort((many, *ends))
            many, ends = many[order], ends[:, order]
            first = np.flatnonzero(np.append(True, (ends[:, 1:] != ends[:, :-1]).any(axis=0)))
            following = np.roll(many, -1)
            following[np.append(first[1:], len(many)) - 1] = many[first]
            ring[many] = following
        return cls(
            triangulation.F.ravel().astype(np.int32),
            triangulation.twin.astype(np.int32),
            ring,
            triangulation.aligned.astype(np.uint8),
            triangulation.l.ravel(),
        )

    def flip(self, margin: float) -> None:
        """Mollify and flip in place to the intrinsic Delaunay triangulation."""
        sides, F = self.length.reshape(-1, 3), self.vertex.reshape(-1, 3)
        if mollify(sides, F, margin).any():
            # A corner on the side opposite it is flipped away first: longer edges would raise it above that side.
            self.make_delaunay()
            sides += mollify(sides, F, margin)
        self.make_delaunay()

    def make_delaunay(self, *, records: bool = False) -> tuple[IntArray, FloatArray]:
        """Flip edges in place until the triangles are intrinsic Delaunay; all glued faces must be aligned.

        Returns the moves in order, if they are recorded: kind (k, 3) and numbers (k, 5), see `Moved`.
        """
        found: tuple[IntArray, FloatArray] = flipping.flip(
            self, -DELAUNAY_TOLERANCE, _MOST_FLIPS_PER_FACE * (len(self.twin) // 3), records
        )
        return found

    def replacing(self, given: IntrinsicTriangulation, **changes: Any) -> IntrinsicTriangulation:
        """A copy of the triangulation `given` with these triangles, and with `changes` of other fields."""
        return replace(
            given,
            F=self.vertex.reshape(-1, 3).astype(np.int64),
            l=self.length.reshape(-1, 3),
            twin=self.twin.astype(np.int64),
            aligned=self.aligned.astype(bool),
            **changes,
        )

    def numbered(self, n: int, start: int = 0) -> tuple[HalfEdges, AnyArray, AnyArray]:
        """The triangles numbered breadth-first from face `start` on, so that neighbours lie near each other in memory.

        Returns them by the new numbers, with corners in place; the new number (n,) of each of the n vertices; and the
        old number (m,) of each face.
        """
        *edges, number, face = gluing.breadth_first(self, n, start)
        return HalfEdges(*edges), number, face


def mean_exponent(lengths: FloatArray) -> int:
    """The power of two just above the mean."""
    return int(np.frexp(lengths.mean())[1])


def require_room(m: int, n: int) -> None:
    """Raise a `MeshError` if m faces on n vertices are too many for 32-bit indices."""
    if 3 * m + n >= _TOO_MANY:
        raise MeshError(f"{m} faces are too many for 32-bit indices: split the mesh")


def mollify(l: FloatArray, F: IntArray, margin: float | None = None) -> FloatArray:
    """The length (m, 3) to add to the edges so that no triangle is degenerate (Sharp and Crane 2020, section 4.5).

    It is the smallest ``e >= 0``, one for each component of the faces F (m, 3), for which the triangle inequalities of
    ``l + e`` hold there by `margin` (1e-8 if not given) times the mean edge length; exactly 0 if they already do, so
    that the lengths of a good mesh keep every bit. In components with faces whose corners all coincide, by that margin,
    ``max(l, 1e-10 mean)`` takes the place of l, which keeps every triangle inequality.

    A triangle with a base b between sides of length 1 knows its angles at the base to 1e-16 / b, and the base lengthens
    paths by b at most: both are small with b = 1e-10. With b = 1e-12 around three corners in one place, exact windows
    leave out a vertex in 1 of 900 queries.
    """
    least_slack = _MARGIN if margin is None else margin
    if not gluing.has_needles(np.ascontiguousarray(l).ravel(), least_slack):
        return np.zeros_like(l)
    # By columns: sums and maxima over rows of three take ten times as long.
    total = sum(l.T)
    component = connectivity.connected_components(F, int(F.max()) + 1)[F[:, 0]]
    n_faces = np.maximum(np.bincount(component), 1)
    mean = np.bincount(component, total) / (3 * n_faces)
    floor = np.zeros(len(mean))
    point = component[np.max([*l.T], axis=0) <= least_slack * mean[component]]
    floor[point] = _SHORTEST * mean[point]
    raised = np.maximum(l, floor[component, None])
    total = sum(raised.T)
    least = np.full(len(n_faces), np.inf)
    np.minimum.at(least, component, np.min([total - 2 * side for side in raised.T], axis=0))
    return np.asarray(raised - l + np.maximum(0.0, least_slack * mean - least)[component, None])
