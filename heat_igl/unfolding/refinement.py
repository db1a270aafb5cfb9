"""Near-exact distance by planar unfolding, in an order that heat (or Dijkstra) gives for nothing.

A vertex gets its distance from neighbours that are nearer to the source, by laying triangles out in the plane: two at a
time (`Refinement.sweep`), or a strip of them, followed until the path is straight (`Refinement.unfold`). What heat is
needed for is the order alone; no Poisson problem is solved. docs/refinement.md derives the update.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    double_cover,
    intrinsic_delaunay,
    intrinsic_triangulation,
    oriented,
)
from heat_igl.mesh import Mesh, SurfacePoints, connectivity
from heat_igl.runtime import compiled_kernels_for
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.intrinsic.fans import Tables
    from heat_igl.unfolding.unfolding import Points

__all__ = ["Known", "Refine", "Refinement", "unfolded_distance"]

Refine = Literal["sweep", "unfold"]

# Relative gain below which a path is not straightened further. What is lost adds up to 0.0003 to 0.003 % on average; 0
# loses nothing and takes up to twice the time.
_TOLERANCE = 4e-5
# The search starts at vertices that fall short of what a neighbour promised by this many tolerances: by more than the
# paths that the promise rests on may have been cut short.
_SHORTFALL = 15.0
# Passes over vertices whose neighbours turned out to be nearer than the order said. They are few, and ever fewer.
_MAX_PASSES = 50
# Steps that the search from one vertex may take; a walk takes 20 to 50.
_MAX_SEARCH = 500
# A point whose barycentric coordinate is below this lies on the side of its face.
_ON_SIDE = 1e-8


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


class Refinement:
    """Distance on one triangulated surface by planar unfolding, for any number of queries.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        n vertices; an intrinsic Delaunay one, since long thin triangles hide the way from their neighbours.

    Raises
    ------
    MissingExtraError
        If numba is not installed.

    Notes
    -----
    Paths end at the boundary and where more than two faces meet: they run along such edges, not across. A surface that
    cannot be oriented is replaced by its oriented double cover, with each source on both sheets. Immutable; threads may
    share it, and the kernels release the interpreter's lock.
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        fans, _, _ = _kernels()
        self.n = triangulation.n
        if not triangulation.aligned.all():
            triangulation = oriented(triangulation)
        F, lengths, twin = triangulation.F, triangulation.l, triangulation.twin
        self._n_sheets = 1
        if not triangulation.aligned.all():
            self._n_sheets = 2
            F, lengths, twin = double_cover(triangulation)
        self._triangulation = triangulation
        self._number, self._face, F, lengths, twin = fans.breadth_first(F, lengths, twin, self._n_sheets * self.n)
        self._F = F
        self._tables: Tables = fans.tables(F, lengths, twin, len(self._number))

    def sweep(
        self,
        key: FloatArray,
        sources: IntArray,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        labels: IntArray | None = None,
        known: Known | None = None,
    ) -> FloatArray:
        """Distance by unfolding two triangles at a time, until nothing gives less.

        Parameters
        ----------
        key : (n,) float64
            Vertices are visited in ascending order of this: ``-heat``, or a rough distance. A wrong order costs
            time; what it changes is smaller than the sweep's error.
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
            vertices, k to k + p - 1 for points, -1 where none is reached.
        known : Known, optional
            Distances to begin with, besides those of the sources.

        Returns
        -------
        (n,) float64
            ``inf`` where no source is reached. Neither an upper nor a lower bound on a curved surface; on a flat
            convex one exact to rounding.
        """
        _, sweeping, _ = _kernels()
        starts = self._starts(sources, offsets, points, point_offsets)
        n = len(self._number)
        distance = np.full(n + starts.n_points, np.inf)
        distance[starts.row] = starts.state[:, 0]
        label = None
        if len(sources) + starts.n_points > 1 or labels is not None or offsets is not None or point_offsets is not None:
            label = np.full(len(distance), -1)
            label[starts.row] = starts.label
        is_stale = np.ones(n, bool)
        if known is not None:
            row = self._number[np.concatenate([known.vertex + self.n * sheet for sheet in range(self._n_sheets)])]
            distance[row], is_stale[row] = np.tile(known.distance, self._n_sheets), False
            if label is not None:
                label[row] = np.tile(known.source, self._n_sheets)
        sweeping.sweep(self._order(key), self._tables, distance[:n], label, starts.offset, is_stale)
        return self._on_base(distance, label, labels)

    def unfold(
        self,
        key: FloatArray,
        sources: IntArray,
        tolerance: float = _TOLERANCE,
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
            A path is taken as it is once straightening it further would shorten it by less than this fraction of its
            length, and by less than one and a half times this fraction of the way to the next bend. 0 follows every
            path to its last bend or its source.
        offsets, points, point_offsets, labels
            As for `sweep`.

        Returns
        -------
        (n,) float64
            ``inf`` where no source is reached. Every value is the length of a path on the surface (to rounding, 1e-9
            of it), so none is shorter than the exact distance. On a flat convex domain exact to rounding.

        Raises
        ------
        ValueError
            If `tolerance` is not a number from 0 to 1.
        """
        if not 0 <= tolerance <= 1:
            raise ValueError(f"tolerance must lie between 0 and 1, not {tolerance!r}")
        _, _, unfolding = _kernels()
        # Below 1e-5, forecasts are wrong by as much because of the curvature on the way.
        shortfall = max(_SHORTFALL * tolerance, 1e-5)
        starts = self._starts(sources, offsets, points, point_offsets)
        state = np.zeros((len(self._number) + starts.n_points, 6))
        state[:, 0], state[:, 4] = np.inf, unfolding.NO_FAN
        state[starts.row] = starts.state
        label = inside = None
        if labels is not None or points is not None:
            label = np.full(len(state), -1)
            label[starts.row] = starts.label
            inside = starts.points
        order = self._order(key)
        unfolding.unfold(order, self._tables, state, label, inside, tolerance, shortfall, _MAX_SEARCH, _MAX_PASSES)
        return self._on_base(state[:, 0], label, labels)

    def _order(self, key: FloatArray) -> IntArray:
        """Vertices of all sheets in ascending order, by the numbers of the tables."""
        from heat_igl.unfolding.ordering import ascending

        on_sheets = np.tile(key, self._n_sheets) if self._n_sheets > 1 else np.ascontiguousarray(key)
        return np.asarray(self._number[ascending(on_sheets)])

    def _starts(
        self,
        sources: IntArray,
        offsets: FloatArray | None,
        points: SurfacePoints | None,
        point_offsets: FloatArray | None,
    ) -> _Starts:
        """What the kernels start from, on all sheets and by the numbers of the tables."""
        n, k, sheets = len(self._number), len(sources), range(self._n_sheets)
        row = self._number[np.concatenate([sources + self.n * sheet for sheet in sheets])]
        state = np.zeros((len(row), 6))
        state[:, 4] = -1
        label = np.tile(np.arange(k), self._n_sheets)
        begin = np.zeros(k) if offsets is None else np.asarray(offsets, np.float64)
        if points is None:
            state[:, 0] = state[:, 1] = begin[label]
            return _ascending(row, state, label, begin)
        _, _, unfolding = _kernels()
        faces, barycentric, point = self._faces_of(points)
        vertex, seen = unfolding.views(faces, barycentric, self._F, self._tables)
        place = np.zeros((len(points), 6))
        place[:, 4] = -1
        row = np.concatenate([row, vertex, n + np.arange(len(points))])
        state = np.concatenate([state, seen, place])
        label = np.concatenate([label, k + np.repeat(point, 3), k + np.arange(len(points))])
        begin = np.concatenate([begin, np.zeros(len(points)) if point_offsets is None else point_offsets])
        state[:, 0] += begin[label]
        state[:, 1] = begin[label]
        by_face = np.argsort(faces, kind="stable")
        first = np.full(len(self._F), -1)
        first[faces[by_face][::-1]] = by_face[::-1]
        following = np.full(len(faces), -1)
        same = faces[by_face][1:] == faces[by_face][:-1]
        following[by_face[:-1][same]] = by_face[1:][same]
        inside = unfolding.Points(first, following, np.ascontiguousarray(barycentric), n + point)
        return _ascending(row, state, label, begin, len(points), inside)

    def _faces_of(self, points: SurfacePoints) -> tuple[IntArray, FloatArray, IntArray]:
        """Triangles of the tables that hold points, coordinates in them, and which point each is."""
        fans, _, _ = _kernels()
        faces, barycentric = self._triangulation.locate(points.faces, points.barycentric)
        point = np.arange(len(faces))
        if self._n_sheets == 2:
            # On the other sheet faces are turned over: their corners 1 and 2 change places.
            faces = np.concatenate([faces, faces + len(self._triangulation.F)])
            barycentric = np.concatenate([barycentric, barycentric[:, [0, 2, 1]]])
            point = np.tile(point, 2)
        faces = self._face[faces]
        # A point on a side also lies in the face beyond it.
        i, c = np.nonzero(barycentric < _ON_SIDE)
        beyond = self._tables.step_id[3 * faces[i] + c]
        there = np.flatnonzero(beyond[:, fans.FAR] >= 0)
        i, c, following = i[there], c[there], beyond[there, fans.TO_RIGHT].astype(np.int64)
        other = np.zeros((len(i), 3))
        # Its corner after the far one is at the end, as seen from here, of the side that starts after corner c.
        other[np.arange(len(i)), following % 3] = barycentric[i, (c + 2) % 3]
        other[np.arange(len(i)), (following + 1) % 3] = barycentric[i, (c + 1) % 3]
        return (
            np.concatenate([faces, following // 3]),
            np.concatenate([barycentric, other]),
            np.concatenate([point, point[i]]),
        )

    def _on_base(self, distance: FloatArray, label: IntArray | None, labels: IntArray | None) -> FloatArray:
        on_sheets = distance[self._number].reshape(self._n_sheets, -1)
        if self._n_sheets == 1:
            if labels is not None and label is not None:
                labels[:] = label[self._number]
            return np.asarray(on_sheets[0])
        if labels is not None and label is not None:
            nearest = on_sheets.argmin(axis=0)[None]
            labels[:] = np.take_along_axis(label[self._number].reshape(self._n_sheets, -1), nearest, axis=0)[0]
        return np.asarray(on_sheets.min(axis=0))


class _Starts(NamedTuple):
    """Rows of the state that are known, the nearest last: (k,), (k, 6), (k,); then by label where it begins."""

    row: IntArray
    state: FloatArray
    label: IntArray
    offset: FloatArray
    n_points: int = 0
    points: Points | None = None


def _ascending(
    row: IntArray,
    state: FloatArray,
    label: IntArray,
    offset: FloatArray,
    n_points: int = 0,
    points: Points | None = None,
) -> _Starts:
    """Far ones first, so that of several for one vertex the nearest is written last."""
    order = np.argsort(-state[:, 0], kind="stable")
    return _Starts(row[order], state[order], label[order], offset, n_points, points)


def _kernels() -> tuple[ModuleType, ModuleType, ModuleType]:
    """The modules of compiled kernels, loaded when they are first needed."""
    with compiled_kernels_for("refinement"):
        from heat_igl.intrinsic import fans
        from heat_igl.unfolding import sweeping, unfolding
    return fans, sweeping, unfolding


def unfolded_distance(V: ArrayLike, F: ArrayLike, sources: Sources, *, tolerance: float = _TOLERANCE) -> FloatArray:
    """Near-exact geodesic distance without a factorization: strip unfolding in the order of Dijkstra's algorithm.

    For one or two queries on a mesh; from the third on, ``HeatMethodSolver(mesh, refine="unfold")`` is faster.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) array_like
        Triangles.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    tolerance : float
        See `Refinement.unfold`.

    Returns
    -------
    (n,) float64
        In the unit of V: 0 at the sources, ``inf`` at vertices that no source reaches. Every value is the length of a
        path on the surface.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name vertices.
    MissingExtraError
        If numba is not installed.
    """
    mesh = Mesh(V, F)
    if mesh.is_tetrahedral:
        raise MeshError("unfolding needs triangles, but F has 4 columns")
    chosen = vertex_sources(sources, mesh.n_vertices)
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    return refinement.unfold(connectivity.edge_distance(mesh.edge_graph, chosen), chosen, tolerance)
