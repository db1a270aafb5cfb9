"""`SweepEngine`: distance by unfolding two triangles at a time, in an order of the vertices that is found on the way.

A vertex gets its distance from neighbours that are nearer to the source, by laying triangles out in the plane.
docs/engines_theory.md has the update and its error.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.intrinsic import HalfEdges, IntrinsicTriangulation, lay_out
from heat_igl.kernels.mesh.checking import largest_finite
from heat_igl.kernels.sweep import spokes, sweeping
from heat_igl.operators import share_on_large_triangles
from heat_igl.plan import NEAR_RADIUS, SurfaceMeasures
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourcePoints, SourceSet, samples
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.windows.engine import Query, TriangleEngine, Triangles
from heat_igl.windows.exact import ExactSolution
from heat_igl.windows.invariants import raise_to_lines

_SPOKE = np.dtype(
    [(name, "f8") for name in ("length", "along", "height", "base", "beyond_along", "beyond_depth")]
    + [(name, "i4") for name in ("neighbour", "next_neighbour", "beyond", "next")]
)
# A curve is swept from as points, at most so many mean edge lengths s apart. At a distance d that is wrong by the
# fraction (s / d)^2 / 8 at most: by 0.005 % beyond the 6 edges within which windows take the curve itself.
_SPACING = 0.125
# Sweeps from several sources start with the exact distance up to so many mean edge lengths: next to a border of cells
# they know no source from both ends of a side.
_KNOWN_RADIUS = 4.0
# Width of the bands of distance in which the next vertex is taken, in units of the median edge. Wider bands
# make a sweep go back more often, of narrower ones many are empty.
_BAND = 0.1
# Edges that are looked at for that median.
_SAMPLE = 10_000
# Share of the largest distance by which bounds move no answer on surfaces that a plan leaves to a sweep: they move it
# by up to .0055 (120 answers over the zoo and random members of its kinds).
_MOVED = 0.02


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


class SweepEngine(TriangleEngine):
    """Distance by planar unfolding over the triangles at each vertex, for any number of queries.

    Paths end at the boundary and at edges of more than two faces: they run along such edges, not across. Around points,
    curves and several vertices the sweep begins with exact distances. Triangles are those of an intrinsic Delaunay
    triangulation, since long thin ones hide the way from their neighbours.
    """

    def __init__(self, triangles: Triangles) -> None:
        super().__init__(triangles)
        self._triangulation = triangles.surface.unfolding
        self._number, self._spokes = numbered_spokes(self._triangulation)
        lengths = self._spokes.spoke["length"]
        self._band = _BAND * float(np.median(lengths[:: len(lengths) // _SAMPLE + 1]))

    @property
    def measures(self) -> SurfaceMeasures:
        """What tells whether a sweep is accurate here."""
        used = np.diff(self._spokes.first) > 0
        total = self._spokes.total
        excess = np.abs(2 * np.pi - total)
        # On the boundary, a notch with more than half a turn counts.
        is_open = total <= 0
        excess[is_open] = np.maximum(-total[is_open] - np.pi, 0.0)
        flatness = float(self._spokes.is_flat[used].mean())
        large = share_on_large_triangles(self._triangulation, self._triangles.components)
        return SurfaceMeasures(self._triangulation.n_used, float(excess.mean()), flatness, self._has_holes(), large)

    def _has_holes(self) -> bool:
        """Whether some component is neither a disk nor a sphere, by its Euler characteristic."""
        t, components = self._triangulation, self._triangles.components
        of_face = components[t.F[:, 0]]
        faces = np.bincount(of_face)
        # Where more than two faces meet, they are cut apart: an edge is shared by two faces, or belongs to one.
        shared = np.bincount(of_face[np.flatnonzero(t.twin >= 0) // 3], minlength=len(faces))
        used = np.zeros(t.n, bool)
        used[t.F] = True
        vertices = np.bincount(components[used], minlength=len(faces))
        return bool(((vertices - (3 * faces - shared / 2) + faces)[faces > 0] < 1).any())

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from."""
        query = Query.of(sources, self._triangles)
        points = self._points(query)
        near = self._near(query)
        if near is not None:
            # A vertex where others come before it begins wins nowhere, and leaves no trace.
            wins = near.distance[sources.vertices] >= query.sources.vertex_offset
            if not wins.all():
                kept = {name: getattr(sources, name)[wins] for name in ("vertices", "vertex_offset", "vertex_label")}
                return self.labelled(replace(sources, **kept), cutoff, threads)
        distance, origin = self._swept(query, points, near)
        distance = query.with_begin(distance)
        labels = replace(sources, points=points).labels[origin]
        if near is not None:
            at = np.flatnonzero(np.isfinite(near.distance))
            distance[at] = query.with_begin(near.distance)[at]
            labels[at] = sources.labels[near.origin.label[at]]
        swept = distance.copy()
        distance[np.isnan(distance)] = np.inf
        distance[sources.vertices] = np.minimum(distance[sources.vertices], sources.vertex_offset)
        self._triangles.surface.paths.shorten(distance, labels)
        raise_to_lines(distance, self._triangles.surface.V, self._triangles.surface.given_faces, sources)
        _warn_if_moved(swept, distance, self._triangles.mean_edge_length)
        return distance, labels

    def _points(self, query: Query) -> SourcePoints:
        """The points of a query, and those that stand for its curves."""
        sources = query.sources
        if not len(query.sources.segments.faces):
            return sources.points
        spacing = _SPACING * self._triangles.mean_edge_length
        along, _ = samples(self._triangles.faces, sources.segments, spacing)
        return sources.points.joined(along).joined(sources.segments.ends())

    def _near(self, query: Query) -> ExactSolution | None:
        """Exact distance up to some edges around points, curves and several vertices; None for one vertex."""
        sources = query.sources
        if sources.on_vertices_alone and len(sources.vertices) == 1:
            return None
        edges = _KNOWN_RADIUS if sources.on_vertices_alone else NEAR_RADIUS
        cutoff = edges * self._triangles.mean_edge_length + float(sources.offsets.max())
        surface = self.on_faces if len(sources.segments.faces) else self.on_delaunay
        return surface.solve(sources, cutoff=cutoff)

    def _swept(self, query: Query, points: SourcePoints, near: ExactSolution | None) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the vertex or point (n,) that it is measured from, counted one after the other."""
        sources, n = query.sources, len(self._number)
        k = len(sources.vertices)
        distance, label, is_stale = np.full(n, np.inf), np.full(n, -1, np.int32), np.ones(n, bool)

        def begin(vertex: IntArray, value: FloatArray, source: IntArray) -> AnyArray:
            """Set values, the smallest of each vertex last."""
            order = np.argsort(-value, kind="stable")
            at = self._number[vertex[order]]
            distance[at], label[at] = value[order], source[order]
            return at

        if len(points.faces):
            begin(*self._corners_of(points, k))
        if near is not None and not len(query.sources.segments.faces):  # which point of a curve is nearest is not known
            known = np.flatnonzero(np.isfinite(near.distance))
            known = known[~np.isin(known, sources.vertices)]
            is_stale[begin(known, near.distance[known], near.origin.label[known])] = False
        begin(sources.vertices, sources.vertex_offset, np.arange(k))
        offset = np.concatenate([sources.vertex_offset, points.offset])
        has_labels = len(offset) > 1 or bool(offset.any()) or len(points.label) > 0
        sweeping.sweep(
            self._spokes,
            distance,
            label if has_labels else None,
            offset,
            self._groups(query, points),
            is_stale.view(np.uint8),
            self._band,
        )
        if not has_labels:
            label[np.isfinite(distance)] = 0
        return distance[self._number], label[self._number].astype(np.int64)

    def _corners_of(self, points: SourcePoints, k: int) -> tuple[IntArray, FloatArray, IntArray]:
        """Corners (3 p,) of the triangles of points, the lengths of the straight lines there, and their sources."""
        triangulation = self._triangulation
        faces, barycentric = triangulation.locate(points.faces, points.barycentric)
        corners = lay_out(triangulation.l[faces])
        place = np.einsum("pc,pcx->px", barycentric, corners)
        length = points.offset[:, None] + np.linalg.norm(corners - place[:, None], axis=2)
        return triangulation.F[faces].ravel(), length.ravel(), np.repeat(k + np.arange(len(faces)), 3)

    def _groups(self, query: Query, points: SourcePoints) -> IntArray:
        """For each source, which curve it is a point of, or itself."""
        k = len(query.sources.vertices)
        groups = np.arange(k + len(points.label))
        if len(query.sources.segments.faces):
            of_curve = np.isin(points.label, query.sources.segments.label)
            groups[k:][of_curve] = len(groups) + points.label[of_curve]
        return groups


def _warn_if_moved(swept: FloatArray, distance: FloatArray, h: float) -> None:
    """Warn if bounds moved an answer (n,) by more than a sweep is wrong by, and than the mean edge length h."""
    with np.errstate(invalid="ignore"):  # no distance at all is no difference
        moved = np.abs(swept - distance)
    is_moved = ~(moved <= max(_MOVED * largest_finite(distance), h)) & np.isfinite(distance)
    if is_moved.any():
        at = int(np.argmax(is_moved))
        warn_caller(
            f"the sweep contradicted straight lines or the lengths of edges by far, as {swept[at]:.6g} at vertex {at}, "
            "and was moved inside these bounds: please report this as a bug, with the mesh and the sources",
            AccuracyWarning,
        )
