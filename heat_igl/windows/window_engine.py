"""`WindowEngine`: distance and paths by windows from all kinds of sources, on the triangles that each kind needs."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.sources import SourceSet
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows.engine import TriangleEngine, Triangles
from heat_igl.windows.exact import ExactSolution, ExactSurface
from heat_igl.windows.queries import Query, labels_of, starting_points

if TYPE_CHECKING:
    from heat_igl.windows.curve_directions import CurveDirections
    from heat_igl.windows.directions import PathAngles, PathDirections
    from heat_igl.windows.path_lengths import PathLengths

__all__ = ["WindowEngine"]


class WindowEngine(TriangleEngine):
    """Distance by windows, directions and paths: all exact, which holds every tolerance."""

    def __init__(self, triangles: Triangles, originals: IntArray | None = None) -> None:
        super().__init__(triangles, originals)
        # Made at once, since nearly every query needs it; what points, curves and paths need is made on request.
        self._from_vertices = ExactSurface(triangles.tables())

    @cached_property
    def _directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        from heat_igl.windows.directions import PathDirections

        return PathDirections(self._triangles.surface)

    @cached_property
    def _curve_directions(self) -> CurveDirections:
        from heat_igl.windows.curve_directions import CurveDirections

        return CurveDirections(self._triangles.surface)

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        if not sources.on_vertices_alone or sources.vertex_offset.any():
            return super().distance(sources, cutoff, threads)
        return self._with_copies(self._from_vertices.distance(sources.vertices, None, cutoff, threads))

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from."""
        query = Query.of(sources, self._triangles)
        found = self.solution(query, query.cutoff(cutoff), threads=threads)
        labels = labels_of(sources)[found.origin.label]
        return self._with_copies(query.with_begin(found.distance)), self._with_copies(labels)

    def solution(
        self,
        query: Query,
        cutoff: float = np.inf,
        *,
        directed: bool = False,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
        threads: int = 1,
    ) -> ExactSolution:
        """Distance and the paths from the sources of a query; see `ExactSurface.solve`."""
        if query.has_curves:
            surface = self._on_faces
        elif query.points is not None or targets is not None or directed:
            surface = self._on_delaunay
        else:
            surface = self._from_vertices
        return query.solve(surface, cutoff=cutoff, directed=directed, targets=targets, goals=goals, threads=threads)

    def to_targets(self, sources: SourceSet, targets: SurfacePoints | IntArray) -> FloatArray:
        """Distance (t,) of points or vertices; the search ends when all are known."""
        query = Query.of(sources, self._triangles)
        places = targets if isinstance(targets, SurfacePoints) else None
        goals = np.empty(0, np.int64) if isinstance(targets, SurfacePoints) else targets
        found = self.solution(query, targets=places, goals=goals)
        if not isinstance(targets, SurfacePoints):
            return query.with_begin(found.distance)[targets]
        if query.begin is None:
            return found.target_distance
        begin = query.begin[self._triangles.given_faces[targets.faces, 0]]
        return found.target_distance + np.where(np.isfinite(found.target_distance), begin, 0.0)

    def directed(self, sources: SourceSet) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """Distance (n,), labels (n,), and of each path the directions and the place at which it starts; all exact.

        Raises
        ------
        MeshError
            If vertices have no tangent plane, see `polar_angles`.
        """
        query = Query.of(sources, self._triangles)
        if query.has_curves:
            of_curves = self._curve_directions
            found = self.solution(query, directed=True)
            angles, starts = of_curves.of_windows(found)
        else:
            of_points = self._directions
            found = self.solution(query, directed=True)
            angles = of_points.of_windows(found, query.points)
            starts = starting_points(self._corner_at[sources.vertices], sources.points, found.origin.label)
        labels = labels_of(sources)[found.origin.label]
        distance = query.with_begin(found.distance)
        distance, labels = self._with_copies(distance), self._with_copies(labels)
        if self._originals is not None:
            starts = unchecked_points(starts.faces[self._originals], starts.barycentric[self._originals])
            angles = type(angles)(*(angle[self._originals] for angle in angles))
        return distance, labels, angles, starts

    @cached_property
    def _corner_at(self) -> IntArray:
        """The first corner (n,) of the given faces at each vertex."""
        F, corner_at = self._triangles.given_faces, np.zeros(self._triangles.components.size, np.int64)
        corner_at[F.ravel()[::-1]] = np.arange(F.size)[::-1]
        return corner_at

    def paths(self, sources: SourceSet) -> PathLengths:
        """The paths whose lengths are the exact distances from vertices and points."""
        from heat_igl.windows.path_lengths import PathLengths

        return PathLengths(self._on_delaunay, self._triangles.surface.unfolding, sources)
