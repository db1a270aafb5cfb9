"""A curve on faces as the strip that it runs through, and the shortest curve of its class."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from heat_igl.curves.places import snapped
from heat_igl.curves.tracing import Surface, surface
from heat_igl.curves.words import crossing_letters
from heat_igl.errors import SourceError
from heat_igl.kernels import shortening
from heat_igl.mesh import Mesh, SurfaceCurve
from heat_igl.mesh.surface_points import unchecked_curve
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["Course", "Shortened", "Shortener", "as_curve", "course_of"]

# The compiled module, whose signatures are those of Cython.
kernel: Any = shortening
_AHEAD = np.dtype([("along", "f8"), ("above", "f8"), ("after", "i4", 2), ("vertex", "i4")], align=True)
# Segments are joined if their ends are no farther apart than this, in mean edge lengths.
_GAP = 1e-6


class Course(NamedTuple):
    """The faces that a curve runs through, one after another.

    Attributes
    ----------
    faces : (s,) int32
        A face may follow upon itself.
    joins : (s - 1, 3) int32, for loops (s, 3)
        From each face to the next: the half-edges on both sides of the edge between them, or else the vertex to turn
        around, the shorter way; -1 for none.
    ends : (2, 3) float64
        Barycentric coordinates of the start in the first face and of the end in the last; a loop begins and ends in the
        first.
    """

    faces: AnyArray
    joins: AnyArray
    ends: FloatArray


class Shortened(NamedTuple):
    """A shortened curve: its length, faces (s,), and barycentric coordinates (s, 2, 3) of both ends of each segment."""

    length: float
    faces: IntArray
    points: FloatArray


def course_of(mesh: Mesh, curve: SurfaceCurve) -> Course:
    """The course of a curve, whose segments are checked to be joined.

    Raises
    ------
    SourceError
        If a face is not one of the mesh, a segment does not start where the one before it ends, or a closed curve has
        no length.
    """
    ends = curve.positions(mesh)  # which checks the faces
    count = len(curve) if curve.is_closed else len(curve) - 1
    begins = np.einsum("kc,kcx->kx", curve.start, mesh.V[mesh.F[curve.faces]])
    following = (np.arange(count) + 1) % len(curve)
    if curve.is_closed and (ends[1:] == begins).all():
        raise SourceError("curve is closed and has no length: a loop needs two different points")
    apart = ends[1 : count + 1] - begins[following]
    gap = np.einsum("kx,kx->k", apart, apart)
    faces, end = curve.faces, snapped(curve.end)
    joins, share = _joins(mesh, faces[:count], faces[following], end[:count])
    wrong = np.flatnonzero((gap > (_GAP * mesh.edge_lengths.mean()) ** 2 if gap.any() else False) | (share > _GAP))
    if len(wrong):
        i = int(wrong[0])
        raise SourceError(
            f"curve does not hold together: segment {i} ends in face {faces[i]} at {ends[i + 1].tolist()}, and segment "
            f"{following[i]} starts in face {faces[following[i]]} at {begins[following[i]].tolist()}: each segment "
            "must start where the one before it ends"
        )
    first = snapped(curve.start[:1])[0]
    return Course(faces.astype(np.int32), joins, np.stack([first, first if curve.is_closed else end[-1]]))


def _joins(mesh: Mesh, f: IntArray, g: IntArray, at: FloatArray) -> tuple[AnyArray, FloatArray]:
    """Joins (k, 3) from faces f to faces g at points `at` (k, 3) of f, and how far each is from edge or vertex."""
    joins = np.full((len(f), 3), -1, np.int32)
    share = np.zeros(len(f))
    rows = np.flatnonzero(f != g)
    f, g, at = f[rows], g[rows], at[rows]
    edges = mesh.facets.of_face
    # A point lies on the edge opposite a corner if the coordinate of this corner is 0.
    off_edge = np.where((edges[f][:, :, None] == edges[g][:, None, :]), at[:, :, None], np.inf).reshape(len(f), 9)
    here, there = np.divmod(off_edge.argmin(axis=1), 3)
    by_edge = off_edge.min(axis=1, initial=np.inf) <= _GAP
    corner = at.argmax(axis=1)
    vertex = mesh.F[f, corner]
    off_vertex = np.where((mesh.F[g] == vertex[:, None]).any(axis=1), 1 - at.max(axis=1, initial=0), np.inf)
    joins[rows[by_edge], 0], joins[rows[by_edge], 1] = (3 * f + here)[by_edge], (3 * g + there)[by_edge]
    joins[rows[~by_edge], 2] = vertex[~by_edge]
    share[rows] = np.where(by_edge, 0.0, off_vertex)
    return joins, share


class Shortener:
    """Shortens curves on a triangle mesh, one after another.

    Attributes
    ----------
    surface : Surface
        The triangles.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.surface = surface(mesh)
        triangle = self.surface.triangle
        sums = np.bincount(triangle["vertex"].ravel(), triangle["angle"].ravel(), mesh.n_vertices)
        # A path that is shortest on one side of a vertex is shortest of all if the angles sum to 2 pi or more, and on
        # the boundary. On edges of more than two faces there are more than two sides.
        sums[mesh.facets.vertices[mesh.facets.n_faces != 2]] = np.inf
        half_turn = np.cos(np.minimum(sums, 2 * np.pi) / 2)
        most_corners = int(np.diff(self.surface.first_corner).max())
        letters = crossing_letters(mesh)
        if letters is None:
            ahead, letters = np.empty(0, _AHEAD), np.empty(0, np.int32)
        else:
            ahead = _faces_ahead(self.surface)
        self._kernel = kernel.Shortener(self.surface, half_turn, most_corners, ahead, letters)

    def shortest(self, course: Course, *, is_closed: bool = False) -> Shortened:
        """The locally shortest curve of the class of a course: between the ends, or as a loop."""
        faces, joins, ends = course
        stuck, *found = self._kernel.shorten(faces, joins, ends, is_closed)
        if stuck >= 0:
            # A vertex alone joins two faces: the loop passes there in any case, so it is a path from there to there.
            vertex = joins[stuck, 2]
            faces, joins = np.roll(faces, -stuck - 1), np.roll(joins, -stuck - 1, axis=0)[:-1]
            at = (self.surface.triangle["vertex"][faces[[0, -1]]] == vertex).astype(float)
            _, *found = self._kernel.shorten(faces, np.ascontiguousarray(joins), at, False)
        return Shortened(*found)

    def shorter(self, one: Course, other: Course) -> Shortened:
        """The shorter of the locally shortest paths of two courses with the same first and last place."""
        found = self._kernel.shorter(one.faces, one.joins, other.faces, other.joins, one.ends)
        if found is None:
            return min(self.shortest(one), self.shortest(other), key=lambda path: path.length)
        return Shortened(*found[1:])


def _faces_ahead(surface: Surface) -> AnyArray:
    """The face behind each half-edge (3 m,) of an oriented manifold, for lines that enter there: `Ahead` in fans."""
    triangle, first = surface.triangle, surface.first_side
    opposite = np.full(3 * len(triangle), -1, np.int32)
    inner = first[:-1][np.diff(first) == 2]
    one, other = surface.side[inner], surface.side[inner + 1]
    opposite[one], opposite[other] = other, one
    ahead = np.empty((len(triangle), 3), _AHEAD)
    ahead["along"], ahead["above"], ahead["vertex"] = triangle["along"], triangle["above"], triangle["vertex"]
    across = opposite.reshape(-1, 3)
    ahead["after"] = np.stack([np.roll(across, -2, axis=1), np.roll(across, -1, axis=1)], axis=2)
    return ahead.ravel()


def as_curve(parts: Sequence[Shortened], *, is_closed: bool) -> SurfaceCurve:
    """One curve of parts that follow one another."""
    points = np.concatenate([part.points for part in parts])
    faces = np.concatenate([part.faces for part in parts])
    return unchecked_curve(faces, points[:, 0].copy(), points[:, 1].copy(), is_closed)
