"""What every distance keeps: no longer than paths along edges, no shorter than straight lines through space."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.kernels.mesh import bounds as kernels
from heat_igl.kernels.mesh import checking
from heat_igl.operators import Surface
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Less than this fraction is rounding.
_ROUNDING = 1e-12
# With more sources, a tree finds the nearest sooner than a loop over all.
_FEW = 32
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

    def lengthen(self, distance: FloatArray, sources: SourceSet) -> None:
        """Raise distances (n,) to the straight lines from the nearest source, in place, where positions are known."""
        places = source_places(self._surface.V, self._surface.given_faces, sources)
        if places is not None and self._surface.V is not None:
            raise_to_lines(distance, self._surface.V, *places)


def source_places(V: FloatArray | None, F: IntArray | None, sources: SourceSet) -> tuple[FloatArray, FloatArray] | None:
    """Positions (k, 3) and offsets (k,) of the sources; None for curves, which have no one position."""
    points = sources.points
    if V is None or len(sources.segments.faces) or (len(points.faces) and F is None):
        return None
    places = V[sources.vertices]
    if F is not None and len(points.faces):
        places = np.concatenate([places, np.einsum("pc,pcx->px", points.barycentric, V[F[points.faces]])])
    return np.ascontiguousarray(places), np.ascontiguousarray(sources.offsets, np.float64)


def raise_to_lines(distance: FloatArray, V: FloatArray, places: FloatArray, offsets: FloatArray) -> bool:
    """Raise distances (n,) to the straight lines from the nearest place, in place; returns whether that was done.

    Nothing is done for many places with different offsets.
    """
    if len(places) <= _FEW:
        line = checking.straight_lines(V, places, offsets)
    elif np.ptp(offsets) == 0:
        from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

        line = cKDTree(places).query(V)[0] + offsets[0]
    else:
        return False
    # Less rounding, which is a share of the lines without the offsets.
    np.maximum(distance, line - _ROUNDING * (line - offsets.min()), out=distance)
    return True


def _sides(triangulation: IntrinsicTriangulation) -> tuple[AnyArray, FloatArray]:
    """Ends (e, 2) and lengths (e,) of edges, each once."""
    F, lengths = np.ascontiguousarray(triangulation.F), np.ascontiguousarray(triangulation.l)
    ends, length = kernels.glued_edges(F, lengths.ravel(), triangulation.twin)
    return ends, length
