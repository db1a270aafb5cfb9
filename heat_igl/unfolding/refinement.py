"""Near-exact distance by planar unfolding, in an order that heat (or Dijkstra) gives for nothing.

A vertex gets its distance from neighbours that are nearer to the source, by laying triangles out in the plane: two at a
time (`Refinement.sweep`), or a strip of them, followed until the path is straight (`Refinement.unfold`). Heat
gives the order alone; no Poisson problem is solved. docs/refinement.md derives the update.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation, double_cover, oriented
from heat_igl.intrinsic.fans import Tables, breadth_first, tables
from heat_igl.intrinsic.history import BACK_CORNERS
from heat_igl.mesh import SurfacePoints
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.located_points import LocatedPoints, located_points
from heat_igl.unfolding.numbered import TOLERANCE, NumberedTriangles, WalkStarts
from heat_igl.unfolding.path_derivatives import Paths, Places, Starts, Triangles, Ways, half_edge_arrays
from heat_igl.unfolding.walks import Begins, sweep, unknown, views

__all__ = ["Known", "Refine", "Refinement"]

Refine = Literal["sweep", "unfold", "exact"]

# In units of the median edge, and the edges that are looked at for that. Wider bands let a front go back more often,
# of narrower ones many are empty.
_BAND = 0.1
_SAMPLE = 10_000


class Known(NamedTuple):
    """Distances that are known before a sweep, at vertices that are no sources.

    Attributes
    ----------
    vertex : (e,) int64
        Vertices, each once.
    distance : (e,) float64
        Length of a path to each; another way may be shorter.
    source : (e,) int64
        The source that it comes from, as `Refinement.sweep` labels them.
    """

    vertex: IntArray
    distance: FloatArray
    source: IntArray


class Refinement(NumberedTriangles):
    """Distance on one triangulated surface by planar unfolding, for any number of queries.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        n vertices; an intrinsic Delaunay one, since long thin triangles hide the way from their neighbours.

    Attributes
    ----------
    face : (m,) int32
        Rows of the tables of the faces.

    Notes
    -----
    Paths end at the boundary and at edges of more than two faces: they run along such edges, not across. A surface that
    cannot be oriented is replaced by the oriented double cover, with each source on both sheets. Immutable; threads may
    share it, and the kernels release the interpreter's lock.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> surface = heat_igl.Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    >>> rough = abs(mesh.V).sum(axis=1)  # in this order
    >>> surface.unfold(rough, np.array([0]))[[4, 15, 19]].round(6).tolist()
    [4.0, 3.0, 5.0]
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        if not triangulation.aligned.all():
            triangulation = oriented(triangulation)
        self.triangulation = triangulation
        n_sheets = 1 if triangulation.aligned.all() else 2
        number, self.face, made = _numbered_tables(triangulation, n_sheets)
        super().__init__(made, number, n_sheets)

    @cached_property
    def tables(self) -> Tables:  # type: ignore[override]
        """What the kernels read; made again after `keep_for_sweeps`, if sources in faces or walks ask for it."""
        return _numbered_tables(self.triangulation, self._n_sheets)[2]

    def keep_for_sweeps(self) -> None:
        """Let go of the tables that sweeps from vertices do not read: six tenths of all."""
        t = self.tables
        self._swept = t._replace(turn=np.empty(0, t.turn.dtype), step=np.empty(0, t.step.dtype))
        del self.tables

    def sweep(
        self,
        key: FloatArray | None,
        sources: IntArray,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        labels: IntArray | None = None,
        known: Known | None = None,
        groups: IntArray | None = None,
    ) -> FloatArray:
        """Distance by unfolding two triangles at a time, until nothing gives less.

        Parameters
        ----------
        key : (n,) float64 or None
            Vertices are visited in ascending order of this: ``-heat``, or a rough distance. A wrong order costs
            time; the change is smaller than the sweep's error. None for the order in which a front meets them, by the
            distance of the neighbours that it has passed and the edges from there.
        sources : (k,) int64
            Vertices that distance starts from.
        offsets : (k,) float64, optional
            The distance at which each of them starts, not negative; 0 if not given. One that another source undercuts
            gets the distance from that one.
        points : SurfacePoints, optional
            p sources inside the faces (or on their rims) that the triangulation was made from: the mesh's, before they
            were flipped.
        point_offsets : (p,) float64, optional
            The distance at which each of them starts; 0 if not given.
        labels : (n,) int64, optional
            Filled with the source that each distance is measured from (geodesic Voronoi cells): 0 to k - 1 for
            vertices, k to k + p - 1 for points, -1 if none is reached.
        known : Known, optional
            Distances to begin with, besides those of the sources.

        Returns
        -------
        (n,) float64
            ``inf`` if no source is reached. Neither an upper nor a lower bound on a curved surface; on a flat
            convex one exact to rounding.
        """
        starts = self.starts(sources, offsets, points, point_offsets)
        n = len(self.number)
        distance = np.full(n + starts.n_points, np.inf)
        distance[starts.row] = starts.walk["distance"]
        label = None
        if len(sources) + starts.n_points > 1 or labels is not None or offsets is not None or point_offsets is not None:
            label = np.full(len(distance), -1, np.int32)
            label[starts.row] = starts.walk["label"]
        is_stale = np.ones(n, bool)
        if known is not None:
            row = self.number[np.concatenate([known.vertex + self.n * sheet for sheet in range(self._n_sheets)])]
            distance[row], is_stale[row] = np.tile(known.distance, self._n_sheets), False
            if label is not None:
                label[row] = np.tile(known.source, self._n_sheets)
        group = np.arange(len(starts.offset)) if groups is None else np.ascontiguousarray(groups, np.int64)
        order = None if key is None else self.order(key)
        sweep(order, self._swept, distance[:n], label, starts.offset, group, is_stale, self._band)
        return _on_base(self.number, self._n_sheets, distance, label, labels)

    @cached_property
    def _band(self) -> float:
        """Width of the bands of distance in which a front takes the next vertex."""
        lengths = self._swept.spoke["length"]
        return _BAND * float(np.median(lengths[:: len(lengths) // _SAMPLE + 1]))

    def unfold(
        self,
        key: FloatArray,
        sources: IntArray,
        tolerance: float = TOLERANCE,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        labels: IntArray | None = None,
    ) -> FloatArray:
        """Distance by following straight lines through strips of triangles.

        Parameters
        ----------
        key, sources
            As for `sweep`.
        tolerance : float
            A path is taken as it is once straightening it further would shorten it by less than this fraction of the
            length, and by less than one and a half times this fraction of the way to the next bend. 0 follows every
            path to the last bend or the source.
        offsets, points, point_offsets, labels
            As for `sweep`.

        Returns
        -------
        (n,) float64
            ``inf`` if no source is reached. Every value is the length of a path on the surface (to rounding, 1e-9
            of it), so none is shorter than the exact distance. On a flat convex domain exact to rounding.

        Raises
        ------
        ValueError
            If `tolerance` is not a number from 0 to 1, or `key` has another length.
        """
        if not 0 <= tolerance <= 1:
            raise ValueError(f"tolerance must lie between 0 and 1, not {tolerance!r}")
        walk = self.walks(self.order(key), self.starts(sources, offsets, points, point_offsets), tolerance)
        return _on_base(self.number, self._n_sheets, walk["distance"], walk["label"], labels)

    def paths(self, key: FloatArray, sources: Starts, tolerance: float = TOLERANCE) -> Paths:
        """The paths whose lengths `unfold` returns, on the triangles by the numbers of the tables.

        Of a surface that cannot be oriented, on both sheets.
        """
        vertices, offsets, points, point_offsets = sources
        starts = self.starts(vertices, offsets if offsets.any() else None, points, point_offsets)
        n = len(self.number)
        begins = Begins(np.full(n, -1, np.int32), np.zeros(n), np.zeros(n))
        walk = self.walks(self.order(key), starts, tolerance, begins=begins)
        found = Ways(walk["distance"][:n].copy(), begins.entered.astype(np.int64), begins.share, begins.reach)
        places = Places.none()
        if points is not None:
            at = self._located(points)
            late = np.zeros(len(points)) if point_offsets is None else np.asarray(point_offsets, np.float64)
            places = Places(at.faces, at.barycentric, at.point, late[at.point])
        is_source = np.zeros(n, bool)
        on_sheets = self.number[np.concatenate([vertices + self.n * sheet for sheet in range(self._n_sheets)])]
        is_source[on_sheets] = walk["distance"][on_sheets] >= np.tile(offsets, self._n_sheets)
        return Paths(self._triangles, places, found, is_source)

    @cached_property
    def _triangles(self) -> Triangles:
        F, twin = self.faces.astype(np.int64), self._twin.astype(np.int64).ravel()
        lengths, is_aligned = self.on_tables(self.triangulation.l), np.ones(F.size, bool)
        return half_edge_arrays(IntrinsicTriangulation(F, lengths, twin, is_aligned, len(self.number)))

    def by_given_sides(self, by_side: FloatArray) -> FloatArray:
        """Derivatives by the sides (m, 3) of `triangulation`, from those by the numbers of the tables."""
        sheets = by_side[self.face].reshape(self._n_sheets, -1, 3)
        return np.asarray(sheets[0] if self._n_sheets == 1 else sheets[0] + sheets[1][:, BACK_CORNERS])

    def on_tables(self, sides: FloatArray) -> FloatArray:
        """Values by the numbers of the tables, from those on the sides (m, 3) of `triangulation`."""
        if self._n_sheets == 2:
            sides = np.concatenate([sides, sides[:, BACK_CORNERS]])
        ordered = np.empty_like(sides)
        ordered[self.face] = sides
        return ordered

    def rows_of(self, distance: FloatArray) -> AnyArray:
        """The number (n,) in the tables of each vertex, on the sheet on which `distance` by these numbers is less."""
        on_sheets = self.number.reshape(self._n_sheets, -1)
        nearer = distance[on_sheets].argmin(axis=0)
        return np.asarray(on_sheets[nearer, np.arange(self.n)])

    def vertex_of(self, rows: AnyArray) -> IntArray:
        """The vertices that have some numbers in the tables."""
        vertex = np.empty(len(self.number), np.int64)
        vertex[self.number] = np.tile(np.arange(self.n), self._n_sheets)
        return np.asarray(vertex[rows])

    def starts(
        self,
        sources: IntArray,
        offsets: FloatArray | None,
        points: SurfacePoints | None,
        point_offsets: FloatArray | None,
    ) -> WalkStarts:
        """Initial values of the kernels, on all sheets and by the numbers of the tables."""
        at_vertices = self.starts_at(sources, offsets)
        if points is None:
            return at_vertices
        n, k = len(self.number), len(sources)
        row, walk, begin = at_vertices.row, at_vertices.walk, at_vertices.offset
        at = self._located(points)
        vertex, seen = views(at.faces, at.barycentric, self.faces, self.tables)
        place = unknown(len(points))
        walk["distance"] = place["distance"] = 0.0
        seen["label"], place["label"] = k + np.repeat(at.point, 3), k + np.arange(len(points))
        seen["departure"] += np.repeat(at.turn, 3)
        seen["root"], place["root"] = n + np.repeat(at.point, 3), n + np.arange(len(points))
        row, walk = np.concatenate([row, vertex, n + np.arange(len(points))]), np.concatenate([walk, seen, place])
        begin = np.concatenate([begin, np.zeros(len(points)) if point_offsets is None else point_offsets])
        walk["offset"] = begin[walk["label"]]
        walk["distance"] += walk["offset"]
        return WalkStarts.ascending(row, walk, begin, len(points), at.listed(len(self.face), n))

    def _located(self, points: SurfacePoints) -> LocatedPoints:
        return located_points(self.triangulation, self.face, self.tables, self._n_sheets, points)


def _on_base(
    number: AnyArray, n_sheets: int, distance: FloatArray, label: AnyArray | None, labels: IntArray | None
) -> FloatArray:
    """The smaller of the distances on the sheets, by the vertices of the mesh; `labels`, if given, are filled."""
    on_sheets = distance[number].reshape(n_sheets, -1)
    if n_sheets == 1:
        if labels is not None and label is not None:
            labels[:] = label[number]
        return np.asarray(on_sheets[0])
    if labels is not None and label is not None:
        nearest = on_sheets.argmin(axis=0)[None]
        labels[:] = np.take_along_axis(label[number].reshape(n_sheets, -1), nearest, axis=0)[0]
    return np.asarray(on_sheets.min(axis=0))


def _numbered_tables(triangulation: IntrinsicTriangulation, n_sheets: int) -> tuple[AnyArray, AnyArray, Tables]:
    """Numbers of the vertices, rows of the faces and the tables, of a surface or the double cover of it."""
    F, lengths, twin = triangulation.F, triangulation.l, triangulation.twin
    if n_sheets == 2:
        F, lengths, twin = double_cover(triangulation)
    number, face, F, lengths, twin = breadth_first(F, lengths, twin, n_sheets * triangulation.n)
    return number, face, tables(F, lengths, twin, len(number))
