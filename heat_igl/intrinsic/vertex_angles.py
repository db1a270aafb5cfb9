"""Polar angles around vertices: the direction of every half-edge in the tangent plane of the tail.

The faces around a vertex seldom have angles that sum to 2 pi. All angles there are multiplied by one factor, so that
they do (to pi on the boundary): this defines the tangent plane of the vertex (Knoeppel, Crane, Pinkall, Schroeder
2013).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, Moved, corner_angles, next_half_edge
from heat_igl.kernels.mesh import polar_angles as kernel
from heat_igl.typing import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class PolarAngles:
    """Angles around the vertices of a triangulation of n vertices and m faces.

    Attributes
    ----------
    outgoing : (3 m,) float64
        Angle of each half-edge in the tangent plane of the tail, counterclockwise from the reference edge.
    corners : (m, 3) float64
        Angle at each corner, as it is in the face.
    sums : (n,) float64
        Sum of `corners` around each vertex; 0 at a vertex without a face.
    scale : (n,) float64
        Angle in the tangent plane over angle in a face: 2 pi / sum, and pi / sum on the boundary; 1 without faces.
    on_boundary : (n,) bool
        Vertices whose faces do not close up around them.
    first : (n,) int64
        Corner with `outgoing` = 0, -1 at a vertex without a face.
    """

    outgoing: FloatArray
    corners: FloatArray
    sums: FloatArray
    scale: FloatArray
    on_boundary: BoolArray
    first: IntArray

    def rigid(self, tail: IntArray) -> tuple[FloatArray, FloatArray]:
        """The angle (3 m,) of each half-edge with that tail for transport, and the factor (n,) of angles in faces."""
        return self.from_polar(tail, self.outgoing), np.where(self.on_boundary, 1.0, self.scale)

    def from_polar(self, vertices: IntArray, angles: FloatArray) -> FloatArray:
        """The angle (k,) for transport of directions at vertices that have the given polar angles (k,).

        The same inside. The faces at a boundary vertex lie in a plane already: transport takes their angles as they
        are, so that a flat piece with corners has no curvature, and turns them until the middle between the two
        boundary edges is at pi / 2, as in `outgoing`.
        """
        flat = angles / self.scale[vertices] + (np.pi - self.sums[vertices]) / 2
        return np.where(self.on_boundary[vertices], flat, angles)

    def to_polar(self, vertices: IntArray, angles: FloatArray) -> FloatArray:
        """The polar angle (k,) of directions at vertices that have the given angles (k,) for transport.

        The same inside. Beyond the boundary, and if the faces have no angle, the angle stays.
        """
        sums = self.sums[vertices]
        whole = 2 * np.pi
        flat = np.mod(angles - (np.pi - sums) / 2, whole)
        # An angle that is rounded to just below 2 pi is 0.
        flat = np.where(flat > whole - 1e-12, 0.0, flat)
        inside = self.on_boundary[vertices] & (flat <= sums + 1e-12) & (sums > 0)
        return np.where(inside, np.minimum(flat * self.scale[vertices], np.pi), angles)


def polar_angles(triangulation: IntrinsicTriangulation) -> PolarAngles:
    """The polar angles of a triangulation without flips.

    The reference edge of an inner vertex leaves from the corner with the smallest number ``3 f + c``: it leads to the
    next corner of that face. On the boundary it is the boundary edge at which the faces begin counterclockwise, so that
    angles run from 0 to pi.

    A MeshError if more than two faces meet at an edge, two neighbours are oriented differently, or the faces at a
    vertex are not one fan; the message names the first offender.
    """
    F, n = triangulation.F, triangulation.n
    _require_oriented_manifold(triangulation)
    corners = corner_angles(triangulation.l)
    lowest = np.full(n, -1)
    lowest[F.ravel()[::-1]] = np.arange(F.size)[::-1]
    outgoing = np.zeros(F.size)
    sums, counts, closes = kernel.polar_angles(corners.ravel(), triangulation.twin, lowest, outgoing)
    fans = np.bincount(F.ravel(), minlength=n) != counts
    if fans.any():
        first = int(np.argmax(fans))
        raise MeshError(
            f"the faces at vertex {first} are not one fan ({int(fans.sum())} vertices are like that): a vertex like "
            "this has no tangent plane; give each fan a vertex of its own"
        )
    on_boundary = (counts > 0) & ~closes
    whole = np.where(on_boundary, np.pi, 2 * np.pi)
    scale = np.divide(whole, sums, out=np.ones(n), where=sums > 0)
    first_corner = np.full(n, -1)
    tail = triangulation.tail(np.arange(F.size))
    starts = np.flatnonzero((outgoing == 0) & (~on_boundary[tail] | (triangulation.twin < 0)))
    first_corner[tail[starts]] = next_half_edge(starts)
    inner = ~on_boundary
    first_corner[inner] = lowest[inner]
    return PolarAngles(outgoing * scale[tail], corners, sums, scale, on_boundary, first_corner)


def _require_oriented_manifold(triangulation: IntrinsicTriangulation) -> None:
    for wrong, what, remedy in (
        (triangulation.twin == -2, "is one of more than two faces", "remove faces or separate the sheets"),
        (
            ~triangulation.aligned,
            "has faces that are oriented differently",
            "orient them alike, as igl.bfs_orient does",
        ),
    ):
        if wrong.any():
            first = int(np.argmax(wrong))
            ends = [int(triangulation.tail(np.array([first]))[0]), int(triangulation.head(np.array([first]))[0])]
            raise MeshError(
                f"the edge {ends} of face {first // 3} {what} ({int(wrong.sum())} sides of faces are like that): "
                f"tangent vectors need an oriented manifold; {remedy}"
            )


def carried_angles(angles: PolarAngles, flipped: IntrinsicTriangulation) -> PolarAngles:
    """The polar angles of a triangulation after the flips of the history, which holds nothing else.

    `angles` are those before all flips; reference directions stay.
    """
    history = [change for change in flipped.history if isinstance(change, Moved) and change.kind[:, 0].all()]
    if len(history) < len(flipped.history):
        raise ValueError("polar angles are carried over flips only: pass a triangulation without added vertices")
    outgoing, F = angles.outgoing.copy(), flipped.F.ravel().copy()
    for flips in history[::-1]:
        kernel.vertices_before(flips.kind, F)
    for flips in history:
        kernel.carry_angles(flips.kind, flips.numbers, angles.scale, F, outgoing)
    first = np.full_like(angles.first, -1)
    return PolarAngles(outgoing, corner_angles(flipped.l), angles.sums, angles.scale, angles.on_boundary, first)


def transport_angles(triangulation: IntrinsicTriangulation, angles: PolarAngles) -> FloatArray:
    """The angle (3 m,) by which the components of a vector turn when it is transported along each half-edge.

    A vector of direction a at the tail has the direction a + angle at the head, each in the tangent plane there; on the
    boundary as `PolarAngles.rigid` has it.
    """
    half_edge = np.arange(triangulation.F.size)
    outgoing, scale = angles.rigid(triangulation.tail(half_edge))
    following = next_half_edge(half_edge)
    # At the head: the next half-edge leaves there, and the angle of the face lies between the two.
    back = (
        outgoing[following] + scale[triangulation.head(half_edge)] * angles.corners.ravel()[next_half_edge(following)]
    )
    twin = triangulation.twin
    glued = twin >= 0
    back[glued] = outgoing[twin[glued]]
    return np.asarray(back + np.pi - outgoing)
