"""Oriented curves near by: on which side of them vertices are, whether they have gaps, and what closes these."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import Mesh, SurfaceCurve, level_segments
from heat_igl.operators import Surface
from heat_igl.sources import OrientedSet
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["has_gaps", "is_left", "zero_curve_in_gaps"]

# Ends of curves nearer to each other than this share of the mean edge length meet.
_SAME_PLACE = 1e-6
# The zero curve of an integrated distance runs within a quarter of an edge of the curves, and counts as the closing of a
# gap where it is farther than this from all of them, in mean edge lengths.
_IN_GAP = 1.0
# A segment that a vertex sees under the angle a is at the distance sin a of its line: near the line, the side is that of
# rounding.
_LEAST_SINE = 1e-6
# Straight lines in one face are as long as the distance, but for rounding.
_SAME_DISTANCE = 1e-6


def has_gaps(mesh: Mesh, sources: OrientedSet) -> bool:
    """Whether a curve ends, inside the mesh, at no place at which one begins; points always have gaps."""
    if len(sources.point_faces):
        return True
    begin, end = (
        np.einsum("sc,scx->sx", barycentric, mesh.V[mesh.F[sources.faces]])
        for barycentric in (sources.start, sources.end)
    )
    tolerance = _SAME_PLACE * float(mesh.edge_lengths.mean())
    for places, barycentric, others in ((begin, sources.start, end), (end, sources.end, begin)):
        nearest, _ = cKDTree(others).query(places)
        loose = nearest > tolerance
        if (loose & ~_on_boundary(mesh, sources.faces, barycentric)).any():
            return True
    return False


def _on_boundary(mesh: Mesh, faces: IntArray, barycentric: FloatArray) -> BoolArray:
    """Which points (k,) lie on the boundary of the mesh."""
    zero = barycentric == 0
    on_side = zero & (mesh.facets.n_faces[mesh.facets.of_face[faces]] == 1)
    in_corner = (barycentric == 1) & mesh.boundary[mesh.F[faces]]
    return np.asarray((on_side | in_corner).any(axis=1))


def zero_curve_in_gaps(mesh: Mesh, phi: FloatArray, distance: FloatArray, h: float) -> SurfaceCurve | None:
    """The parts of the zero curve of `phi` (n,) far from the curves that `distance` (n,) is measured from.

    Returns
    -------
    SurfaceCurve or None
        Its segments, in the order of faces; None if there is none.
    """
    faces, start, end, _ = level_segments(mesh, phi, 0.0)
    middle = np.einsum("sc,sc->s", (start + end) / 2, distance[mesh.F[faces]])
    kept = (middle > _IN_GAP * h) & (start != end).any(axis=1)
    return SurfaceCurve(faces[kept], start[kept], end[kept]) if kept.any() else None


def is_left(surface: Surface, sources: OrientedSet, distance: FloatArray, otherwise: BoolArray) -> BoolArray:
    """Which vertices (n,) are on the left of the curves.

    Parameters
    ----------
    surface : Surface
        Triangles, and the faces that the curves refer to.
    sources : OrientedSet
        Curves.
    distance : (n,) float64
        Distance from them.
    otherwise : (n,) bool
        The answer at vertices that are no corner of a face with their nearest segment.
    """
    triangulation = surface.faces
    if triangulation is None or not len(sources.faces):
        return otherwise
    faces, start, end = _in_both_faces(triangulation, sources)
    flat = lay_out(triangulation.l[faces]) @ np.array([1, 1j])
    begin, finish = np.einsum("sc,sc->s", start, flat), np.einsum("sc,sc->s", end, flat)
    along = finish - begin
    length = np.abs(along)
    faces, flat, begin, along, length = (x[length > 0] for x in (faces, flat, begin, along, length))
    # Corners relative to the start of the segment, in its direction.
    relative = (flat - begin[:, None]) * (along.conj() / length)[:, None]
    beyond = relative.real - np.clip(relative.real, 0, length[:, None])
    away = np.hypot(beyond, relative.imag)
    vertex = triangulation.F[faces]
    is_nearest = away <= distance[vertex] * (1 + _SAME_DISTANCE)
    sine = np.divide(relative.imag, away, out=np.zeros_like(away), where=away > 0)
    is_nearest &= np.abs(sine) > _LEAST_SINE
    # Of segments that meet in the nearest place, the one seen under the largest angle decides.
    order = np.argsort(np.abs(sine[is_nearest]), kind="stable")
    left = otherwise.copy()
    left[vertex[is_nearest][order]] = sine[is_nearest][order] > 0
    return left


def _in_both_faces(
    triangulation: IntrinsicTriangulation, sources: OrientedSet
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Segments (faces, start, end), and those along a side of their face in the face on the other side, too."""
    faces, start, end = sources.faces, sources.start, sources.end
    segment, corner = np.nonzero((start == 0) & (end == 0))
    half_edge = 3 * faces[segment] + corner
    twin = triangulation.twin[half_edge]
    segment, corner, twin = segment[twin >= 0], corner[twin >= 0], twin[twin >= 0]
    other, opposite = np.divmod(twin, 3)
    rows = np.arange(len(segment))
    copies = []
    for barycentric in (start, end):
        copied = np.zeros((len(segment), 3))
        copied[rows, (opposite + 1) % 3] = barycentric[segment, (corner + 2) % 3]
        copied[rows, (opposite + 2) % 3] = barycentric[segment, (corner + 1) % 3]
        copies.append(copied)
    return (
        np.concatenate([faces, other]),
        np.concatenate([start, copies[0]]),
        np.concatenate([end, copies[1]]),
    )
