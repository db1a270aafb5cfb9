"""Invariants of distances: 0 at the sources, and between straight lines and paths along edges everywhere else.

A distance is 0 at the sources, finite exactly on their components, at most the length of paths along edges, and at
least the length of the straight line through space.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.kernels.mesh import checking
from heat_igl.mesh import SurfacePoints
from heat_igl.mesh.connectivity import mask_of
from heat_igl.sources import SourceSet
from heat_igl.typing import BoolArray, FloatArray, IntArray

#: Violations below this fraction of the largest distance are rounding. With coordinates far from the origin, results
#: that are exact to rounding violate the bounds by up to 1e-9 of it.
ROUNDING = 1e-7
# Lines to this number of sources are measured at every vertex; with k times as many sources, at every k-th vertex.
_SOURCES_AT_ALL = 8
_NO_LENGTHS = np.empty((0, 3))
# Distances shorter than the straight line by less than this fraction are left, as rounding.
_ROUNDING = 1e-12
# For more sources, a k-d tree is faster than a loop over all of them; it does not take offsets into account. The loop
# takes 0.4 to 1.0 of the time at 400 sources, and 1.9 to 3.0 at 1600 (a sphere, a scan, and points in a cube).
_MANY = 400


class Invariants:
    """Bounds of a distance on triangles or tetrahedra F with vertex positions V (n, 3).

    A distance is 0 (or the offset) at the sources, is finite exactly on their components, differs along an edge by at
    most the length of the edge, and is nowhere below the straight line to the nearest source. Triangles may have
    `lengths` (m, 3) of the sides opposite the corners instead of positions; the last bound is not checked then.
    """

    def __init__(
        self, F: IntArray, components: IntArray, V: FloatArray | None = None, lengths: FloatArray | None = None
    ) -> None:
        self._F = np.ascontiguousarray(F, np.int64)
        self._components = components
        self._V = None if V is None else np.ascontiguousarray(V, np.float64)
        self._l = _NO_LENGTHS if lengths is None else np.ascontiguousarray(lengths, np.float64)

    def contradiction(
        self, distance: FloatArray, sources: SourceSet, cutoff: float = np.inf, than: FloatArray | None = None
    ) -> str | None:
        """Which bound a distance (n,) violates, and where; None if it violates none.

        It may be ``inf`` beyond the cutoff, and where the distance `than` (n,) from other sources is not larger.
        """
        distance = np.ascontiguousarray(distance, np.float64)
        nearest = distance if than is None else np.minimum(distance, than)

        def found(slack: float) -> str | None:
            return (
                self._at_sources(nearest, sources, cutoff, slack)
                or self._elsewhere(distance, sources)
                or self._along_edges(nearest, cutoff, slack)
                or self._below_lines(distance, sources, slack)
            )

        slack = ROUNDING * checking.largest_finite(nearest)
        return found(slack) and found(slack + self._rounding_of_lengths(sources))

    def _at_sources(self, distance: FloatArray, sources: SourceSet, cutoff: float, slack: float) -> str | None:
        """Above the offset of a source, or above the straight line from a source to the corners of its face."""
        vertices, bound = sources.vertices, sources.vertex_offset
        if not sources.on_vertices_alone and self._V is not None:
            points = sources.points.joined(sources.segments.ends())
            corners = self._F[points.faces]
            places = np.einsum("kc,kcx->kx", points.barycentric, self._V[corners])
            line = np.linalg.norm(self._V[corners] - places[:, None], axis=2) + points.offset[:, None]
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
        """How distances (t,) of vertices or points violate the bounds of lines and components; None if they do not."""
        vertices = self._F[targets.faces, 0] if isinstance(targets, SurfacePoints) else targets
        stray = np.isfinite(distance) != self._has_source(sources)[self._components[vertices]]
        if stray.any():
            at = int(np.argmax(stray))
            return f"{distance[at]:.6g} at target {at}, where sources and components say otherwise"
        if self._V is None:
            return None
        places = self._V[vertices]
        if isinstance(targets, SurfacePoints):
            places = np.einsum("kc,kcx->kx", targets.barycentric, self._V[self._F[targets.faces]])
        slack = ROUNDING * checking.largest_finite(distance)
        return self._below_lines(distance, sources, slack, places) and self._below_lines(
            distance, sources, slack + self._rounding_of_lengths(sources), places
        )

    def _elsewhere(self, distance: FloatArray, sources: SourceSet) -> str | None:
        """Finite on a component without a source."""
        if self._n_components == 1:
            return None
        stray = np.isfinite(distance) & ~self._has_source(sources)[self._components]
        if stray.any():
            return f"finite at vertex {int(np.argmax(stray))}, whose component holds no source"
        return None

    def _rounding_of_lengths(self, sources: SourceSet) -> float:
        """Error of lengths in the components of the sources, from mollification and from rounding of coordinates."""
        searched = self._has_source(sources)[self._components[self._F[:, 0]]]
        if self._V is None:
            return ROUNDING * float(self._l[searched].mean())
        corners = self._V[self._F[searched]]
        edges = np.linalg.norm(np.diff(corners, axis=1), axis=2)
        return float(ROUNDING * edges.mean() + 4 * np.spacing(np.abs(corners).max()))

    def _has_source(self, sources: SourceSet) -> BoolArray:
        """Mask of the components that hold a source."""
        in_faces = self._F[np.append(sources.points.faces, sources.segments.faces), 0]
        return mask_of(self._components[np.append(sources.vertices, in_faces)], self._n_components)

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
        """Below the straight lines to the vertices, or to positions `at` (t, 3)."""
        places = source_places(self._V, self._F, sources, of_curves=True)
        if places is None:
            return None
        step = -(-len(places[1]) // _SOURCES_AT_ALL)
        at_all = np.arange(len(distance))
        _, most, found, _ = checking.shortfall(distance, at_all, step, self._V if at is None else at, *places)
        if most <= slack:
            return None
        what = "vertex" if at is None else "target"
        return f"{distance[found]:.6g} at {what} {found}, which is farther from every source along a straight line"


def source_places(
    V: FloatArray | None, F: IntArray | None, sources: SourceSet, *, of_curves: bool = False
) -> tuple[FloatArray, FloatArray] | None:
    """Positions (k, 3) and offsets (k,) of the sources; None if they are not known.

    With `of_curves`, a curve is represented by the ends of its segments, with offsets reduced by half the length of the
    segment: this gives a lower bound, since each point of a segment is within this length of one of its ends.
    """
    if V is None:
        return None
    if sources.on_vertices_alone:
        return np.ascontiguousarray(V[sources.vertices]), np.ascontiguousarray(sources.vertex_offset, np.float64)
    if F is None or (len(sources.segments.faces) and not of_curves):
        return None
    segments = sources.segments
    points = sources.points.joined(segments.ends())
    inside = np.einsum("kc,kcx->kx", points.barycentric, V[F[points.faces]])
    along = np.einsum("kc,kcx->kx", segments.end - segments.start, V[F[segments.faces]])
    offset = points.offset.copy()
    offset[len(offset) - 2 * len(along) :] -= np.tile(0.5 * np.linalg.norm(along, axis=1), 2)
    return np.concatenate([V[sources.vertices], inside]), np.concatenate([sources.vertex_offset, offset])


def raise_to_lines(distance: FloatArray, V: FloatArray | None, F: IntArray | None, sources: SourceSet) -> bool:
    """Raise distances (n,) in place to the straight line to the nearest source, if positions are known.

    For many sources with different offsets, the bound is weaker: the line to the nearest one plus the smallest offset.
    Returns whether no distance is below the lines afterwards.
    """
    places = source_places(V, F, sources)
    if V is None or places is None:
        return False
    if len(places[0]) <= _MANY:
        checking.raise_to_lines(distance, V, *places, _ROUNDING)
        return True
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    start = places[1].min()
    line = cKDTree(places[0]).query(V)[0] + start
    np.maximum(distance, line - _ROUNDING * (line - start), out=distance)
    return bool(np.ptp(places[1]) == 0)
