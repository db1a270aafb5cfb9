"""Exact polyhedral distance by windows, from all kinds of sources; `heat_igl.kernels.windows` has the algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels import windows
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.unfolding.half_edges import HalfEdges, Located, from_mesh, from_triangulation

__all__ = ["TOLERANCE", "ExactSolution", "ExactSurface", "Origin", "exact_distance"]

#: What another way must be shorter by, as a fraction of the distance, before a window is cut: more than rounding adds
#: up to. A larger number keeps a few windows more and changes no result.
TOLERANCE = 1e-11
_NO_VERTICES = np.empty(0, np.int64)


class Origin(NamedTuple):
    """Where the shortest paths to k places come from.

    Attributes
    ----------
    label : (k,) int64
        The source that the distance is measured from, counted vertices first, then points; -1 for none.
    root : (k,) int64
        The last vertex at which the path bends, or its source: n + p for source point p; -1 for none.
    entered : (k,) int64
        The half-edge of the triangulation over which the straight last part of the path enters its last face; -1 where
        the path starts in the place or runs inside one face.
    crossing : (k,) float64
        How far from the tail of that half-edge, in the mesh's unit.
    """

    label: IntArray
    root: IntArray
    entered: IntArray
    crossing: FloatArray


@dataclass(frozen=True, eq=False)
class ExactSolution:
    """Distances of one query, and where the shortest paths come from.

    Attributes
    ----------
    distance : (n,) float64
        Distance of every vertex; ``inf`` where no source is reached, or none within the cutoff.
    origin : Origin
        Of the paths to the vertices, (n,) each. The half-edge that is entered by lies opposite the vertex.
    target_distance : (t,) float64
        Distance of the target points; ``inf`` as for vertices.
    target_origin : Origin
        Of the paths to the target points, (t,) each.
    n_windows : int
        Windows that were carried over an edge.
    n_crossings : int
        Lists of windows that crossed a face together.
    """

    distance: FloatArray
    origin: Origin
    target_distance: FloatArray
    target_origin: Origin
    n_windows: int
    n_crossings: int


class ExactSurface:
    """Exact distance on one triangulated surface, for any number of queries.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation or HalfEdges
        m triangles on n vertices; of an intrinsic Delaunay one fewest edges are crossed.

    Raises
    ------
    MeshError
        If there are too many triangles for 32-bit indices.

    Notes
    -----
    Boundaries, holes, edges of more than two faces, surfaces that cannot be oriented, vertices whose faces are several
    fans, and components are all allowed. Immutable; threads may share it, and a query releases the interpreter's lock.
    """

    def __init__(self, triangulation: IntrinsicTriangulation | HalfEdges) -> None:
        if isinstance(triangulation, IntrinsicTriangulation):
            triangulation = from_triangulation(triangulation)
        self._half_edges = triangulation
        self.n = self._half_edges.n

    def solve(
        self,
        sources: IntArray = _NO_VERTICES,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        *,
        cutoff: float = np.inf,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
    ) -> ExactSolution:
        """Distances from vertices and points.

        Parameters
        ----------
        sources : (k,) int64
            Vertices that distance starts from.
        offsets : (k,) float64, optional
            The distance at which each of them starts, not negative; 0 if not given.
        points : SurfacePoints, optional
            p sources in the faces that the triangulation was made from.
        point_offsets : (p,) float64, optional
            The distance at which each of them starts; 0 if not given.
        cutoff : float
            What is farther is ``inf``, and the search ends there.
        targets : SurfacePoints, optional
            t points in the faces that the triangulation was made from, whose distance is asked for.
        goals : (g,) int64, optional
            If given, the search ends once the distances of these vertices and of the targets are known; those of other
            vertices may then be too large or ``inf``.

        Returns
        -------
        ExactSolution
            Distances are exact on the polyhedral surface, to rounding.

        Raises
        ------
        MemoryError
            If the windows do not fit into memory.
        """
        edges = self._half_edges
        starts = self._starts(sources, offsets, points, point_offsets)
        place = edges.located(targets)
        n, p, t = self.n, len(starts.points.faces), len(place.faces)
        found, at_targets = _Found.of(n, n + p), _Found.of(t, 0)
        statistics = np.zeros(3, np.int64)
        front = windows.Front(
            *edges.tables,
            found.distance,
            np.full(n, np.inf),
            found.root,
            found.label,
            found.entered,
            found.crossing,
            np.empty(n, np.int32),
            np.full(len(edges.tables.vertex), -1, np.int32),
            TOLERANCE,
        )
        done = windows.search(
            front,
            starts.vertices,
            starts.offset,
            starts.points.faces,
            np.ascontiguousarray(starts.points.barycentric).ravel(),
            starts.point_offset,
            edges.number[_NO_VERTICES if goals is None else goals],
            *edges.by_face(place),
            place.faces,
            np.ascontiguousarray(place.barycentric).ravel(),
            at_targets.distance,
            at_targets.root,
            at_targets.entered,
            at_targets.crossing,
            edges.largest_circle(place),
            goals is not None,
            float(edges.scaled(cutoff)),
            statistics,
        )
        if not done:
            raise MemoryError("the windows of the exact distance do not fit into memory")
        which = _nearest(place, at_targets.distance, 0 if targets is None else len(targets))
        return ExactSolution(
            *self._result(found, found.label, starts, edges.number, cutoff),
            *self._result(at_targets, found.label, starts, which, cutoff),
            *(int(count) for count in statistics[1:]),
        )

    def located(self, points: SurfacePoints) -> tuple[IntArray, FloatArray, IntArray]:
        """Triangles that hold points of the mesh, coordinates in them, and which point each is.

        A point on a side is there once for each triangle.
        """
        place = self._half_edges.located(points)
        return self._half_edges.face[place.faces].astype(np.int64), place.barycentric, place.point

    def _starts(
        self,
        sources: IntArray,
        offsets: FloatArray | None,
        points: SurfacePoints | None,
        point_offsets: FloatArray | None,
    ) -> _Starts:
        """Source vertices and source points for the kernel; points at corners become vertices."""
        edges, k = self._half_edges, len(sources)
        place = edges.located(points)
        begin = np.zeros(k) if offsets is None else edges.scaled(np.asarray(offsets, np.float64))
        late = np.zeros(len(place.point))
        if point_offsets is not None:
            late = edges.scaled(np.asarray(point_offsets, np.float64))[place.point]
        is_corner = (place.barycentric == 0).sum(axis=1) == 2
        inside = Located(*(column[~is_corner] for column in place))
        corner = 3 * place.faces[is_corner] + place.barycentric[is_corner].argmax(axis=1)
        return _Starts(
            np.concatenate([edges.number[sources], edges.tables.vertex[corner]]),
            np.concatenate([begin, late[is_corner]]),
            inside,
            late[~is_corner],
            np.concatenate([np.arange(k), k + place.point[is_corner], k + inside.point, [-1]]),
        )

    def _result(
        self, found: _Found, label: AnyArray, starts: _Starts, which: AnyArray, cutoff: float
    ) -> tuple[FloatArray, Origin]:
        """Distance and origin of some of the places that the kernel found, in the caller's numbers and unit."""
        edges = self._half_edges
        distance = edges.unscaled(found.distance[which])
        within: BoolArray = (distance <= cutoff) & (found.root[which] >= 0)
        root = np.where(within, found.root[which], -1)
        # Copies of a source point on a side are one point.
        names = np.concatenate([edges.old_vertex, self.n + starts.points.point, [-1]])
        # Roots are labelled as vertices are.
        first = found.label[which] if len(found.label) else label[root]
        origin = Origin(
            starts.label[np.where(within, first, -1)],
            names[root],
            edges.old_half_edge(np.where(within, found.entered[which], -1)),
            edges.unscaled(found.crossing[which]),
        )
        return np.where(within, distance, np.inf), origin


class _Starts(NamedTuple):
    """Sources by the numbers of the tables; `label` names vertices, then points, then nothing."""

    vertices: AnyArray
    offset: FloatArray
    points: Located
    point_offset: FloatArray
    label: IntArray


class _Found(NamedTuple):
    """What the kernel fills for each of some places."""

    distance: FloatArray
    root: AnyArray
    label: AnyArray
    entered: AnyArray
    crossing: FloatArray

    @classmethod
    def of(cls, k: int, n_labels: int) -> _Found:
        """Nothing found yet, at k places."""
        nothing = np.full((2, k), -1, np.int32)
        return cls(np.full(k, np.inf), nothing[0], np.full(n_labels, -1, np.int32), nothing[1], np.zeros(k))


def _nearest(place: Located, distance: FloatArray, n_points: int) -> IntArray:
    """Of the copies of each point, the one with the smallest distance."""
    order = np.lexsort((-distance, place.point))
    which = np.empty(n_points, np.int64)
    which[place.point[order]] = order
    return which


def exact_distance(V: ArrayLike, F: ArrayLike, sources: Sources, *, cutoff: float = np.inf) -> FloatArray:
    """Exact geodesic distance on a polyhedral surface, in one call.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) array_like
        Triangles.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    cutoff : float
        What is farther is ``inf``, and the search ends there.

    Returns
    -------
    (n,) float64
        In the unit of V: 0 at the sources, ``inf`` at vertices that no source reaches.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name vertices.
    """
    mesh = Mesh(V, F)
    if mesh.is_tetrahedral:
        raise MeshError("exact distance needs triangles, but F has 4 columns")
    chosen = vertex_sources(sources, mesh.n_vertices)
    return ExactSurface(from_mesh(mesh, int(chosen[0]))).solve(chosen, cutoff=cutoff).distance
