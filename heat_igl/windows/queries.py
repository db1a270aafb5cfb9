"""One query of an engine: a set of sources with the offsets of each component taken away, as searches take it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.sources import SourcePoints, SourceSet
from heat_igl.typing import FloatArray, IntArray

if TYPE_CHECKING:
    from heat_igl.windows.engine import Triangles
    from heat_igl.windows.exact import ExactSolution, ExactSurface


@dataclass(frozen=True, eq=False)
class Query:
    """Sources whose offsets count from the earliest source of their component, since tolerances are relative.

    Attributes
    ----------
    sources : SourceSet
        With these offsets.
    begin : (n,) float64 or None
        The offset of the earliest source at each vertex; None if all are 0.
    """

    sources: SourceSet
    begin: FloatArray | None

    @classmethod
    def of(cls, sources: SourceSet, triangles: Triangles) -> Query:
        """The query for a set of sources."""
        points, segments = sources.points, sources.segments
        if not sources.offsets.any():
            return cls(sources, None)
        components, F = triangles.components, triangles.given_faces
        places = [components[at] for at in (sources.vertices, F[points.faces, 0], F[segments.faces, 0])]
        offsets = [sources.vertex_offset, points.offset, segments.offset]
        # On components without sources any value will do.
        earliest = np.full(int(components.max()) + 1, np.inf)
        np.minimum.at(earliest, np.concatenate(places), np.concatenate(offsets))
        of_vertices, of_points, of_segments = (
            offset - earliest[place] for offset, place in zip(offsets, places, strict=True)
        )
        late = replace(
            sources,
            vertex_offset=of_vertices,
            points=replace(points, offset=of_points),
            segments=replace(segments, offset=of_segments),
        )
        return cls(late, earliest[components])

    @property
    def points(self) -> SurfacePoints | None:
        """Points in faces; None if there are none."""
        points = self.sources.points
        return SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None

    @property
    def has_curves(self) -> bool:
        """Whether a curve is among the sources."""
        return len(self.sources.segments.faces) > 0

    def cutoff(self, cutoff: float) -> float:
        """Where a search may end, in distances of this query."""
        return cutoff if self.begin is None else cutoff - float(self.begin[np.isfinite(self.begin)].min())

    def solve(self, surface: ExactSurface, *, cutoff: float = np.inf, **options: Any) -> ExactSolution:
        """Exact distance from the sources on triangles that hold them; options as for `ExactSurface.solve`."""
        sources = self.sources
        return surface.solve(
            sources.vertices,
            sources.vertex_offset,
            self.points,
            None if self.points is None else sources.points.offset,
            sources.segments if self.has_curves else None,
            cutoff=cutoff,
            **options,
        )

    def with_begin(self, distance: FloatArray) -> FloatArray:
        """Distances (n,) of the sources as they were given."""
        return distance if self.begin is None else distance + np.where(np.isfinite(distance), self.begin, 0.0)


def labels_of(sources: SourceSet, points: SourcePoints | None = None) -> IntArray:
    """The sources as the user counts them: of vertices, points and segments one after another; -1 for nothing."""
    points = sources.points if points is None else points
    return np.concatenate([sources.vertex_label, points.label, sources.segments.label, [-1]])


def starting_points(corner: IntArray, points: SourcePoints, origin: IntArray) -> SurfacePoints:
    """The places (n,) at which paths start.

    Parameters
    ----------
    corner : (k,) int64
        A corner ``3 f + c`` of a face at each source vertex.
    points : SourcePoints
        p further sources.
    origin : (n,) int64
        The source of each path: a vertex below k, a point below k + p; a corner of face 0 stands for -1, no path.
    """
    # After vertices and points comes nothing, at which the index -1 looks.
    corner, nothing = corner.astype(np.int64), np.zeros(1, np.int64)
    faces = np.concatenate([corner // 3, points.faces, nothing])
    barycentric = np.concatenate([np.eye(3)[corner % 3], points.barycentric, np.eye(3)[:1]])
    return unchecked_points(faces[origin], barycentric[origin])
