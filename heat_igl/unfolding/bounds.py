"""What every distance keeps: no longer than paths along edges, no shorter than straight lines through space."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.operators import Surface
from heat_igl.sources import SourcePoints, SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["Bounds"]

# Less than this fraction is rounding.
_ROUNDING = 1e-12


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
    def _edges(self) -> tuple[AnyArray, AnyArray, FloatArray]:
        given, solved = self._surface.faces, self._surface.unfolding
        triangulations = [solved] if given is None or given is solved else [solved, given]
        sides = [_sides(triangulation) for triangulation in triangulations]
        i, j, length = (np.concatenate(column) for column in zip(*sides, strict=True))
        return i, j, length

    def shorten(self, distance: FloatArray, labels: IntArray | None = None) -> None:
        """Lower distances (n,) to the paths along edges, in place; labels (n,) are handed on with them."""
        i, j, length = self._edges
        a, b = distance[i], distance[j]
        # With a finite distance at one end only, the other end is on another component, and none is.
        with np.errstate(invalid="ignore"):
            is_wrong = np.abs(a - b) > length + _ROUNDING * np.minimum(a, b)
        while is_wrong.any():
            # The same edge in both directions: what was wrong, and what that changes.
            tail, head, span = i[is_wrong], j[is_wrong], length[is_wrong]
            swapped = distance[tail] > distance[head]
            tail, head = np.where(swapped, head, tail), np.where(swapped, tail, head)
            shorter = distance[tail] + span
            order = np.lexsort((shorter, head))
            head, tail, shorter = head[order], tail[order], shorter[order]
            first = np.flatnonzero(np.append(True, head[1:] != head[:-1]))
            head, tail, shorter = head[first], tail[first], shorter[first]
            distance[head] = np.minimum(distance[head], shorter)
            if labels is not None:
                labels[head] = labels[tail]
            a, b = distance[i], distance[j]
            with np.errstate(invalid="ignore"):
                is_wrong = np.abs(a - b) > length + _ROUNDING * np.minimum(a, b)

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
            straight = np.linalg.norm(V - places[0], axis=1)
        else:
            straight = np.asarray(KDTree(places).query(V)[0])
        np.maximum(distance, straight * (1 - _ROUNDING), out=distance)


def _sides(triangulation: IntrinsicTriangulation) -> tuple[AnyArray, AnyArray, FloatArray]:
    """Ends and lengths of edges, each once."""
    twin = triangulation.twin
    half_edges = np.flatnonzero((twin < 0) | (np.arange(len(twin)) < twin))
    return triangulation.tail(half_edges), triangulation.head(half_edges), triangulation.l.ravel()[half_edges]
