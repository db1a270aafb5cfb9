"""Exact polyhedral distance by windows, from all kinds of sources; the algorithm is in `heat_igl.kernels.windows`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.runtime import n_threads
from heat_igl.sources import Sources, SourceSegments, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.windows.leaving import with_places, with_turns
from heat_igl.windows.tables import Tables, from_mesh, from_triangulation
from heat_igl.windows.window_search import Found, Leaving, Searched, search, starts_at

__all__ = ["ExactSolution", "ExactSurface", "Origin", "exact_distance"]

_NO_VERTICES = np.empty(0, np.int64)


class Origin(NamedTuple):
    """Where the shortest paths to k places come from.

    Attributes
    ----------
    label : (k,) int64
        The source that the distance is measured from, counted vertices first, then points, then segments; -1 for none.
    root : (k,) int64
        The last vertex at which the path bends, or its source: n + i for source point i, and after all points likewise
        for segments; -1 for none.
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
    leaving : Leaving or None
        How the paths to the vertices leave the roots, if that was asked for: corners ``3 f + c`` of the triangulation.
    """

    distance: FloatArray
    origin: Origin
    target_distance: FloatArray
    target_origin: Origin
    n_windows: int
    n_crossings: int
    leaving: Leaving | None


class ExactSurface:
    """Exact distance on one triangulated surface, for any number of queries.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation or Tables
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

    def __init__(self, triangulation: IntrinsicTriangulation | Tables) -> None:
        if isinstance(triangulation, IntrinsicTriangulation):
            triangulation = from_triangulation(triangulation)
        self.tables = triangulation
        self.n = self.tables.n

    def solve(
        self,
        sources: IntArray = _NO_VERTICES,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        segments: SourceSegments | None = None,
        *,
        cutoff: float = np.inf,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
        directed: bool = False,
        threads: int = 1,
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
        segments : SourceSegments, optional
            Segments with their offsets, every point of which is a source; their labels are not read. They need a
            triangulation that was not flipped.
        cutoff : float
            What is farther is ``inf``, and the search ends there.
        targets : SurfacePoints, optional
            t points in the faces that the triangulation was made from, whose distance is asked for.
        goals : (g,) int64, optional
            If given, the search ends once the distances of these vertices and of the targets are known; those of other
            vertices may then be too large or ``inf``.
        directed : bool
            Whether `ExactSolution.leaving` is asked for, on faces that are oriented alike.
        threads : int
            With more than one, two threads share the search for distances of all vertices, on large surfaces. The
            distances are the same; of paths that are equally long, another may be found.

        Returns
        -------
        ExactSolution
            Distances are exact on the polyhedral surface, to rounding.

        Raises
        ------
        MemoryError
            If the windows do not fit into memory.
        ValueError
            If there are segments or points, and the surface does not know the faces that they refer to.
        """
        starts = starts_at(self.tables, sources, offsets, points, point_offsets, segments)
        done = search(
            self.tables,
            starts,
            cutoff=cutoff,
            targets=targets,
            goals=goals,
            directed=directed,
            threads=threads,
        )
        which = done.nearest_copy(0 if targets is None else len(targets))
        return ExactSolution(
            *self._result(done.found, done, self.tables.number, cutoff),
            *self._result(done.targets.found, done, which, cutoff),
            done.n_windows,
            done.n_crossings,
            self._leaving(done),
        )

    def distance(
        self,
        sources: IntArray,
        offsets: FloatArray | None = None,
        cutoff: float = np.inf,
        threads: int = 1,
    ) -> FloatArray:
        """Distance (n,) from vertices alone, as `solve` finds it, without the origins of the paths."""
        tables = self.tables
        starts = starts_at(tables, sources, offsets, None, None, None)
        done = search(tables, starts, cutoff=cutoff, threads=threads)
        distance = tables.unscaled(done.found.distance[tables.number])
        if cutoff < np.inf:
            distance[distance > cutoff] = np.inf
        return distance

    def located(self, points: SurfacePoints) -> tuple[IntArray, FloatArray, IntArray]:
        """Triangles that hold points of the mesh, coordinates in them, and which point each is.

        A point on a side is there once for each triangle.
        """
        place = self.tables.located(points)
        return self.tables.face[place.faces].astype(np.int64), place.barycentric, place.point

    def located_segments(self, segments: SourceSegments) -> tuple[IntArray, FloatArray]:
        """Triangles (q,) that hold segments, and coordinates (q, 2, 3) of both ends; one on a side is there twice.

        Raises
        ------
        ValueError
            If the triangles are not those that the segments were given in.
        """
        place = self.tables.located_segments(segments)
        return self.tables.face[place.faces].astype(np.int64), place.barycentric

    def _leaving(self, done: Searched) -> Leaving | None:
        """How paths leave the roots, in the caller's numbers."""
        if done.leaving is None:
            return None
        tables = self.tables
        leaving = (with_places if len(done.starts.segments.faces) else with_turns)(tables, done, done.leaving)
        corner, direction = leaving.corner[tables.number], leaving.direction[tables.number]
        place, turn = (None if of is None else of[tables.number] for of in (leaving.place, leaving.turn))
        return Leaving(tables.old_half_edge(corner), direction, place, turn)

    def _result(self, found: Found, done: Searched, which: AnyArray, cutoff: float) -> tuple[FloatArray, Origin]:
        """Distance and origin of some of the places that the kernel found, in the caller's numbers and unit."""
        tables, starts, label = self.tables, done.starts, done.found.label
        distance = tables.unscaled(found.distance[which])
        within: BoolArray = (distance <= cutoff) & (found.root[which] >= 0)
        root = np.where(within, found.root[which], -1)
        # Copies of a point or segment on a side are one, and the ends of a segment belong to it.
        names = np.concatenate([tables.old_vertex, np.where(starts.place < 0, -1, self.n + starts.place)])
        # Roots are labelled as vertices are.
        first = found.label[which] if len(found.label) else label[root]
        origin = Origin(
            starts.label[np.where(within, first, -1)],
            names[root],
            tables.old_half_edge(np.where(within, found.entered[which], -1)),
            tables.unscaled(found.crossing[which]),
        )
        return np.where(within, distance, np.inf), origin


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
    return ExactSurface(from_mesh(mesh, int(chosen[0]))).distance(chosen, cutoff=cutoff, threads=n_threads())
