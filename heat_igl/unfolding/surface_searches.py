"""The searches for distance on one surface, each for the sources of one query: windows, sweeps and walks."""

from __future__ import annotations

from functools import cached_property

import igl
import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.operators import Surface, unfolding_surface
from heat_igl.typing import FloatArray
from heat_igl.unfolding.asked import Asked, known_of
from heat_igl.unfolding.curve_directions import CurveDirections
from heat_igl.unfolding.curve_walks import CurveWalks
from heat_igl.unfolding.directions import PathAngles, PathDirections
from heat_igl.unfolding.exact import ExactSolution, ExactSurface
from heat_igl.unfolding.half_edges import MARGIN
from heat_igl.unfolding.numbered import TOLERANCE
from heat_igl.unfolding.refinement import Refinement

__all__ = ["SurfaceSearches", "as_thin_as_given"]


class SurfaceSearches:
    """Windows, sweeps and walks on a surface; what each of them needs is prepared when it is first asked for.

    Searches return distance (n,), and fill the labels and angles of a query if it has them. The heat u (n,) gives the
    order of the vertices.

    Parameters
    ----------
    surface : Surface
        The triangles to unfold paths in, and the faces to which curves refer.
    refinement : Refinement or None
        Of the same triangles, for sweeps and walks.
    """

    def __init__(self, surface: Surface, refinement: Refinement | None) -> None:
        self._surface, self._refinement = surface, refinement

    @cached_property
    def on_triangles(self) -> ExactSurface:
        """Windows on the triangles to unfold in, which cross the fewest edges."""
        return ExactSurface(self._surface.unfolding)

    @cached_property
    def _on_given_faces(self) -> ExactSurface:
        """Windows on the faces before any flip, to which curves refer."""
        return ExactSurface(self._surface.unfolding if self._surface.faces is None else self._surface.faces)

    @cached_property
    def _directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        return PathDirections(self._surface, self._refinement)

    @cached_property
    def curve_walks(self) -> CurveWalks | None:
        """Walks from closed curves; None unless the surface is an oriented manifold."""
        faces, refinement = self._surface.faces, self._refinement
        if faces is None or refinement is None:
            return None
        try:
            directions = self._directions
        except MeshError:
            return None
        return CurveWalks(faces, refinement, directions, self._on_given_faces)

    @cached_property
    def _curve_directions(self) -> CurveDirections:
        return CurveDirections(self._surface)

    @property
    def refinement(self) -> Refinement:
        """The tables of sweeps and walks."""
        if self._refinement is None:
            raise ValueError("sweeps and walks need a refinement, and these searches were made without one")
        return self._refinement

    def solution(self, asked: Asked, cutoff: float) -> ExactSolution:
        """Exact distance up to a cutoff, and the paths, see `ExactSurface.solve`."""
        windows = self.on_triangles if asked.segments is None else self._on_given_faces
        return windows.solve(*asked.starts, cutoff=cutoff, directed=asked.angles is not None)

    def by_windows(self, asked: Asked, cutoff: float) -> FloatArray:
        """Exact distance up to a cutoff."""
        found = self.solution(asked, cutoff)
        if asked.labels is not None:
            asked.labels[:] = found.origin.label
        if asked.angles is not None:
            asked.angles[:] = self._directions.of_windows(found, asked.points)
        return found.distance

    def directed_from_curves(self, asked: Asked, cutoff: float) -> tuple[ExactSolution, PathAngles, SurfacePoints]:
        """Exact distance up to a cutoff from sources with curves; the angles of the paths, and where they start."""
        directions = self._curve_directions
        found = self._on_given_faces.solve(*asked.starts, cutoff=cutoff, directed=True)
        return found, *directions.of_windows(found)

    def by_sweep(self, key: FloatArray | None, asked: Asked, near: ExactSolution | None) -> FloatArray:
        """Distance by `Refinement.sweep` in the order of a key (n,), or None for that of the front.

        It begins with the exact distance near the sources if that is given.
        """
        # Which point of a curve is nearest is not known.
        known = None if near is None or asked.groups is not None else known_of(asked, near)
        return self.refinement.sweep(
            key,
            asked.vertices,
            offsets=asked.offsets,
            points=asked.points,
            point_offsets=asked.point_offsets,
            labels=asked.labels,
            known=known,
            groups=asked.groups,
        )

    def by_walks(self, u: FloatArray, asked: Asked) -> FloatArray:
        """Distance by `Refinement.unfold`."""
        tolerance = TOLERANCE if asked.tolerance is None else asked.tolerance
        if asked.angles is not None:
            return self._by_directed_walks(u, asked, asked.angles, tolerance)
        return self.refinement.unfold(
            -u,
            asked.vertices,
            tolerance,
            offsets=asked.offsets,
            points=asked.points,
            point_offsets=asked.point_offsets,
            labels=asked.labels,
        )

    def _by_directed_walks(self, u: FloatArray, asked: Asked, angles: FloatArray, tolerance: float) -> FloatArray:
        directions = self._directions  # refuses surfaces without tangent planes, before there are walks
        refinement = self.refinement
        starts = refinement.starts(asked.vertices, asked.offsets, asked.points, asked.point_offsets)
        walk = refinement.walks(refinement.order(-u), starts, tolerance)
        row = refinement.number
        if asked.labels is not None:
            asked.labels[:] = walk["label"][row]
        angles[:] = directions.of_walks(walk, asked.points)
        return np.asarray(walk["distance"][row])


def as_thin_as_given(surface: Surface) -> Surface:
    """The surface without the lengthening that mollified edges got for the heat; it would lengthen paths as well.

    Mollified as little as windows need. A surface whose lengths are those of another metric is returned as it is.
    """
    given, faces = surface.given_faces, surface.faces
    if given is None or faces is None or surface.V is None or faces.lengthening == 0:
        return surface
    added = faces.l - igl.edge_lengths(surface.V, faces.F)
    if np.abs(added - 0.5 * faces.lengthening).max() > 0.51 * faces.lengthening:
        return surface  # lengths of another metric
    return unfolding_surface(Mesh(surface.V, given), MARGIN)
