"""Curves as the faces that they run through, which is what the kernel of paths shortens."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import igl
import numpy as np

from heat_igl.errors import SourceError
from heat_igl.intrinsic import HalfEdges, corner_angles
from heat_igl.kernels.paths import shortening, strips
from heat_igl.mesh import Mesh, SurfaceCurve
from heat_igl.mesh.connectivity import group_by_label
from heat_igl.mesh.surface_points import require_faces, unchecked_curve
from heat_igl.sources.source_sets import on_simplex
from heat_igl.typing import AnyArray, FloatArray, IntArray

# The compiled module, whose signatures are those of Cython.
tables: Any = strips
# Edges are at least this long, in mean edge lengths: the kernel divides by lengths.
_SHORTEST = 1e-12
# Of each face the edge `length` opposite each corner, the `angle` at each, `vertex` and `edge` numbers. Corner c lies
# `along` of the way from corner c + 2 to c + 1, and `above` this edge, in lengths of the edge.
_FACE = np.dtype(
    [*((name, "f8", 3) for name in ("length", "angle", "along", "above")), ("vertex", "i4", 3)], align=True
)
# Segments are joined if their ends are no farther apart than this, in mean edge lengths.
_GAP = 1e-6


class FaceSequence(NamedTuple):
    """The faces (s,) that a curve runs through, one after another; a face may come twice in a row.

    A row of `joins`, s - 1 and of loops s, leads from each face to the next: the half-edges on both sides of the edge
    between them, or else the vertex to turn around, the shorter way; -1 for none. `ends` (2, 3) are barycentric
    coordinates of the start in the first face and of the end in the last; a loop begins and ends in the first.
    """

    faces: AnyArray
    joins: AnyArray
    ends: FloatArray


class Shortened(NamedTuple):
    """A shortened curve: its length, faces (s,), and barycentric coordinates (s, 2, 3) of both ends of each segment."""

    length: float
    faces: IntArray
    points: FloatArray


def course_of(mesh: Mesh, curve: SurfaceCurve) -> FaceSequence:
    """The course of a curve.

    A `SourceError` if its segments do not join, a face is none of the mesh, or a closed curve has no length.
    """
    faces = curve.faces
    require_faces(faces, mesh.n_faces)
    count = len(curve) if curve.is_closed else len(curve) - 1
    corner = mesh.V[mesh.F[faces]]
    begins, ends = (np.einsum("kc,kcx->kx", place, corner) for place in (curve.start, curve.end))
    if curve.is_closed and (begins == ends).all():
        raise SourceError("curve is closed and has no length: a loop needs two different points")
    following = np.append(np.arange(1, len(curve)), 0)[:count]
    apart = ends[:count] - begins[following]
    is_apart = np.einsum("kx,kx->k", apart, apart) > (_GAP * mesh.edge_lengths.mean()) ** 2 if apart.any() else False
    end = on_simplex(curve.end)
    joins, share = _joins(mesh, faces[:count], faces[following], end[:count])
    wrong = np.flatnonzero(is_apart | (share > _GAP))
    if len(wrong):
        i = int(wrong[0])
        raise SourceError(
            f"curve does not hold together: segment {i} ends in face {faces[i]} at {ends[i].tolist()}, and segment "
            f"{following[i]} starts in face {faces[following[i]]} at {begins[following[i]].tolist()}: each segment "
            "must start where the one before it ends"
        )
    first = on_simplex(curve.start[:1])[0]
    return FaceSequence(faces.astype(np.int32), joins, np.stack([first, first if curve.is_closed else end[-1]]))


def _joins(mesh: Mesh, f: IntArray, g: IntArray, at: FloatArray) -> tuple[AnyArray, FloatArray]:
    """Joins (k, 3) from faces f to faces g at points `at` (k, 3) of f, and how far each is from edge or vertex."""
    joins = np.full((len(f), 3), -1, np.int32)
    share = np.zeros(len(f))
    rows = np.flatnonzero(f != g)
    if len(rows) < len(f):
        f, g, at = f[rows], g[rows], at[rows]
    edges = mesh.facets.of_face
    # A point lies on the edge opposite a corner if the coordinate of this corner is 0.
    off_edge = np.where(edges[f][:, :, None] == edges[g][:, None, :], at[:, :, None], np.inf).reshape(len(f), 9)
    nearest, corner, each = off_edge.argmin(axis=1), at.argmax(axis=1), np.arange(len(f))
    by_edge = off_edge[each, nearest] <= _GAP
    vertex = mesh.F[f, corner]
    off_vertex = np.where((mesh.F[g] == vertex[:, None]).any(axis=1), 1 - at[each, corner], np.inf)
    # Column by column is faster: on small meshes these checks take half of the time.
    joins[rows, 0] = np.where(by_edge, 3 * f + nearest // 3, -1)
    joins[rows, 1] = np.where(by_edge, 3 * g + nearest % 3, -1)
    joins[rows, 2] = np.where(by_edge, -1, vertex)
    share[rows] = np.where(by_edge, 0.0, off_vertex)
    return joins, share


def shortener(mesh: Mesh) -> tuple[Any, Any]:
    """The table of the triangles of a mesh, and the kernel that shortens curves on them."""
    face, edge = _faces(mesh), mesh.facets
    edges, _ = HalfEdges.of_mesh(mesh)
    first_corner, corner = (rows.astype(np.int32) for rows in group_by_label(mesh.F.ravel(), mesh.n_vertices))
    table = tables.FaceTable(face, edges, first_corner, corner)
    sums = np.bincount(mesh.F.ravel(), face["angle"].ravel(), mesh.n_vertices)
    # At a vertex with angles of 2 pi or more, and on the boundary, at most one side is locally shortest. On edges of
    # more than two faces there are more than two sides.
    sums[edge.vertices[edge.n_faces != 2]] = np.inf
    half_turn = np.cos(np.minimum(sums, 2 * np.pi) / 2)
    return table, shortening.Shortener(table, half_turn, int(np.diff(first_corner).max()))


def _faces(mesh: Mesh) -> AnyArray:
    """The faces (m,) as the kernels read them, see `_FACE`."""
    # Not mollified: mollification gives a flat triangle some height, and would bend the paths across it.
    lengths = np.maximum(igl.edge_lengths(mesh.V, mesh.F), _SHORTEST * mesh.edge_lengths.mean())
    face = np.empty(mesh.n_faces, _FACE)
    face["length"], face["angle"] = lengths, corner_angles(lengths)
    base, left, right = lengths, np.roll(lengths, -1, axis=1), np.roll(lengths, -2, axis=1)
    half = (base + left + right) / 2
    # By Heron's formula. `left` is the side from corner c to corner c + 2.
    face["along"] = ((left - right) * (left + right) / base + base) / (2 * base)
    face["above"] = 2 * np.sqrt(np.maximum(half * (half - base) * (half - left) * (half - right), 0)) / base**2
    face["vertex"] = mesh.F
    return face


def as_curve(parts: Sequence[Shortened], *, is_closed: bool) -> SurfaceCurve:
    """One curve of parts that follow one another."""
    points = np.concatenate([part.points for part in parts])
    faces = np.concatenate([part.faces for part in parts])
    return unchecked_curve(faces, points[:, 0].copy(), points[:, 1].copy(), is_closed)
