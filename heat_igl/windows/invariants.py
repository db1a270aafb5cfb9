"""What every answer keeps, whatever engine gave it, and without a reference to compare with."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.kernels.mesh import checking
from heat_igl.mesh import SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["ROUNDING", "Invariants"]

#: Violations by less than this share of the largest distance are rounding. Answers that are exact to rounding violate
#: the bounds by up to 1e-9 of it, with coordinates far from the origin.
ROUNDING = 1e-7
# Lines to so many sources are measured at every vertex; with k times as many, at every k-th.
_SOURCES_AT_ALL = 8
_NO_LENGTHS = np.empty((0, 3))


class Invariants:
    """Bounds of a distance on triangles or tetrahedra that are known by the positions of their vertices.

    An answer keeps four of them: it is 0 (or the offset) at the sources, finite exactly on their components, differs
    along an edge by no more than the length of the edge, and is nowhere below the straight line to the nearest source.

    Parameters
    ----------
    F : (m, 3) or (m, 4) int64
        Triangles or tetrahedra, to which points and curves refer.
    components : (n,) int64
        Component label of each vertex.
    V : (n, 3) float64, optional
        Positions of the vertices.
    lengths : (m, 3) float64, optional
        Lengths of the sides of triangles, each opposite its corner, in place of positions; there are no straight lines
        then.
    """

    def __init__(
        self, F: IntArray, components: IntArray, V: FloatArray | None = None, lengths: FloatArray | None = None
    ) -> None:
        self._F = np.ascontiguousarray(F, np.int64)
        self._components = components
        self._V = None if V is None else np.ascontiguousarray(V, np.float64)
        self._l = _NO_LENGTHS if lengths is None else np.ascontiguousarray(lengths, np.float64)

    def contradiction(
        self, distance: FloatArray, sources: SourceSet, cutoff: float = np.inf, tolerance: float = 0.0
    ) -> str | None:
        """How an answer contradicts the bounds, and where; None if it does not.

        Parameters
        ----------
        distance : (n,) float64
            The answer.
        sources : SourceSet
            What it is measured from.
        cutoff : float
            Beyond it distances may be ``inf``.
        tolerance : float
            Violations by this share of the largest distance are no contradiction.
        """
        distance = np.ascontiguousarray(distance, np.float64)
        slack = (ROUNDING + tolerance) * checking.largest_finite(distance)
        return (
            self._at_sources(distance, sources, cutoff, slack)
            or self._elsewhere(distance, sources)
            or self._along_edges(distance, cutoff, slack)
            or self._below_lines(distance, sources, slack)
        )

    def _at_sources(self, distance: FloatArray, sources: SourceSet, cutoff: float, slack: float) -> str | None:
        """Above what a source itself, or a straight line in its face, gives the vertices there."""
        vertices, bound = sources.vertices, sources.vertex_offset
        if not sources.on_vertices_alone and self._V is not None:
            places, offsets, faces = self._places(sources)
            corners = self._F[faces]
            line = np.linalg.norm(self._V[corners] - places[:, None], axis=2) + offsets[:, None]
            vertices = np.concatenate([vertices, corners.ravel()])
            bound = np.concatenate([bound, line.ravel()])
        above = ~(distance[vertices] <= bound + slack) & (bound <= cutoff)
        if above.any():
            at = int(np.argmax(above))
            return f"{distance[vertices[at]]:.6g} at vertex {vertices[at]}, where a source gives {bound[at]:.6g}"
        return None

    def contradiction_at(
        self, distance: FloatArray, sources: SourceSet, targets: SurfacePoints | IntArray
    ) -> str | None:
        """How distances (t,) of vertices or points contradict lines and components; None if they do not."""
        vertices = self._F[targets.faces, 0] if isinstance(targets, SurfacePoints) else targets
        if self._n_components == 1:
            stray = ~np.isfinite(distance)
        else:
            stray = np.isfinite(distance) != self._has_source(sources)[self._components[vertices]]
        if stray.any():
            at = int(np.argmax(stray))
            return f"{distance[at]:.6g} at target {at}, where sources and components say otherwise"
        if self._V is None:
            return None
        places = self._V[vertices]
        if isinstance(targets, SurfacePoints):
            places = np.einsum("kc,kcx->kx", targets.barycentric, self._V[self._F[targets.faces]])
        return self._below_lines(distance, sources, ROUNDING * checking.largest_finite(distance), places)

    def _elsewhere(self, distance: FloatArray, sources: SourceSet) -> str | None:
        """Finite where no source is."""
        if self._n_components == 1:
            return None
        stray = np.isfinite(distance) & ~self._has_source(sources)[self._components]
        if stray.any():
            return f"finite at vertex {int(np.argmax(stray))}, whose component holds no source"
        return None

    def _has_source(self, sources: SourceSet) -> BoolArray:
        """Mask of the components that hold a source."""
        has_source = np.zeros(self._n_components, bool)
        has_source[self._components[sources.vertices]] = True
        for faces in (sources.points.faces, sources.segments.faces):
            has_source[self._components[self._F[faces, 0]]] = True
        return has_source

    @cached_property
    def _n_components(self) -> int:
        return int(self._components.max(initial=0)) + 1

    def _along_edges(self, distance: FloatArray, cutoff: float, slack: float) -> str | None:
        V = _NO_LENGTHS if self._V is None else self._V
        far, near = checking.steepest_edge(distance, self._F, V, self._l, cutoff, slack)
        if far < 0:
            return None
        return f"{distance[far]:.6g} at vertex {far} and {distance[near]:.6g} at its neighbour {near}, which is nearer"

    def _below_lines(
        self, distance: FloatArray, sources: SourceSet, slack: float, at: FloatArray | None = None
    ) -> str | None:
        """Below the lines to vertices, or to positions `at` (t, 3)."""
        if self._V is None:
            return None
        places, offsets, faces = self._places(sources)
        places = np.concatenate([self._V[sources.vertices], places])
        offsets = np.concatenate([sources.vertex_offset, offsets - self._half_length(sources, len(faces))])
        step = -(-len(offsets) // _SOURCES_AT_ALL)
        found = checking.below_line(distance, self._V if at is None else at, step, places, offsets, slack)
        if found < 0:
            return None
        what = "vertex" if at is None else "target"
        return f"{distance[found]:.6g} at {what} {found}, which is farther from every source along a straight line"

    def _places(self, sources: SourceSet) -> tuple[FloatArray, FloatArray, IntArray]:
        """Positions (k, 3) of points and of both ends of segments, their offsets, and the faces that they are in."""
        points = sources.points.joined(sources.segments.ends())
        if self._V is None or not len(points.faces):
            return np.empty((0, 3)), points.offset, points.faces
        inside = np.einsum("kc,kcx->kx", points.barycentric, self._V[self._F[points.faces]])
        return inside, points.offset, points.faces

    def _half_length(self, sources: SourceSet, k: int) -> FloatArray:
        """Half the length of the segment that a place (k,) is an end of: no point of it is farther from both ends."""
        segments, half = sources.segments, np.zeros(k)
        if len(segments.faces) and self._V is not None:
            along = np.einsum("kc,kcx->kx", segments.end - segments.start, self._V[self._F[segments.faces]])
            half[k - 2 * len(along) :] = np.tile(0.5 * np.linalg.norm(along, axis=1), 2)
        return half
