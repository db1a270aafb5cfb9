"""What every distance keeps: no longer than paths along edges, no shorter than straight lines through space."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels.mesh import bounds as kernels
from heat_igl.operators import Surface
from heat_igl.sources import SourcePoints, SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Less than this fraction is rounding.
_ROUNDING = 1e-12
_NO_LABELS = np.empty(0, np.int64)


class Bounds:
    """The two bounds on a surface that take no search.

    Parameters
    ----------
    surface : Surface
        The triangles: along the edges of all of them there are paths.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface = surface

    @cached_property
    def _edges(self) -> tuple[AnyArray, FloatArray]:
        """Ends (e, 2) and lengths (e,) of the edges unfolded in, and of the given ones if some were flipped."""
        unfolding, given = self._surface.unfolding, self._surface.faces
        if given is None or not unfolding.n_flips:
            return _sides(unfolding)
        # Most edges are there twice then, which costs less than to find out which.
        ends, length = zip(_sides(unfolding), _sides(given), strict=True)
        return np.concatenate(ends), np.concatenate(length)

    @cached_property
    def _incident(self) -> tuple[IntArray, AnyArray]:
        """Edges by vertex, see `kernels.incident_edges`: only distances that are too long ask for them."""
        first, incident = kernels.incident_edges(self._edges[0], self._surface.unfolding.n)
        return first, incident

    def shorten(self, distance: FloatArray, labels: IntArray | None = None, share: float = 0.0) -> None:
        """Lower distances (n,) to the paths along edges, in place; labels (n,) are handed on with them.

        With a `share`, only from edges on which they are too long by more than that share of the length.
        """
        if kernels.is_longer(*self._edges, distance, share):
            kernels.shorten(*self._edges, *self._incident, distance, _NO_LABELS if labels is None else labels, share)

    def lengthen(self, distance: FloatArray, sources: SourceSet, points: SourcePoints) -> None:
        """Raise distances (n,) to the straight lines from the nearest source, in place.

        Where sources begin at different distances, or are curves, or positions are not known, nothing is raised.
        """
        V, F = self._surface.V, self._surface.given_faces
        offset = np.concatenate([sources.vertex_offset, points.offset])
        if V is None or len(sources.segments.faces) or offset.any() or (len(points.faces) and F is None):
            return
        places = V[sources.vertices]
        if F is not None and len(points.faces):
            inside = np.einsum("pc,pcx->px", points.barycentric, V[F[points.faces]])
            places = np.concatenate([places, inside])
        if len(places) == 1:
            kernels.lengthen(V, places[0], distance)
        else:
            from scipy.spatial import KDTree  # takes as long to import as the rest of the package

            straight = np.asarray(KDTree(places).query(V)[0])
            np.maximum(distance, straight * (1 - _ROUNDING), out=distance)


def _sides(triangulation: IntrinsicTriangulation) -> tuple[AnyArray, FloatArray]:
    """Ends (e, 2) and lengths (e,) of edges, each once."""
    F, lengths = np.ascontiguousarray(triangulation.F), np.ascontiguousarray(triangulation.l)
    ends, length = kernels.glued_edges(F, lengths.ravel(), triangulation.twin)
    return ends, length
