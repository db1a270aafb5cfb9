"""Steps 2 and 3 replaced: distance by unfolding triangles in the order of the heat, from all kinds of sources."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.runtime import both
from heat_igl.sources import NEAR_RADIUS, NearField, SourcePoints, SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.asked import (
    Asked,
    asked_of,
    from_earliest,
    labels_of,
    require_share,
    starting_points,
    with_samples,
)
from heat_igl.unfolding.bounds import Bounds
from heat_igl.unfolding.curve_walks import CurveWalks, are_only_closed_curves
from heat_igl.unfolding.directions import PathAngles
from heat_igl.unfolding.exact import ExactSolution
from heat_igl.unfolding.ordered import OrderedSolver, UnfoldingDomain
from heat_igl.unfolding.path_lengths import PathLengths, from_walks, from_windows
from heat_igl.unfolding.refinement import Refine, Refinement
from heat_igl.unfolding.surface_searches import SurfaceSearches, as_thin_as_given
from heat_igl.unfolding.when_exact import (
    FEW,
    costs_little_to_be_exact,
    curve_directions_by_windows,
    directions_by_windows,
)

__all__ = ["UnfoldingSolver"]

# Curves are unfolded from as points, at most so many mean edge lengths s apart. At a distance d that is wrong by the
# fraction (s / d)^2 / 8 at most: by 0.005 % beyond the 6 edges within which windows take the curve itself.
_SPACING = 0.125
# Sweeps from several sources start with the exact distance up to so many mean edge lengths: next to a border of cells
# they know no source from both ends of a side.
_KNOWN_RADIUS = 4.0


class UnfoldingSolver(OrderedSolver):
    """`Refinement` of a domain, asked by sets of sources and their heat.

    Parameters
    ----------
    domain : UnfoldingDomain
        Triangles.
    refine : {"sweep", "unfold", "exact"}
        Which update. "exact" is the polyhedral distance by windows, see `ExactSurface`; the heat is not read. The other
        two take it as well if the mesh is rough or flat with holes, and in small components. It is exact from vertices,
        points and curves. For the other two, a curve stands for points at most an eighth of a mean edge length apart;
        up to 6 edges from points and curves windows give the exact distance, and beyond, distance from a curve is too
        long by 0.005 % at most. With "unfold", walks from closed curves alone begin at that distance, see `CurveWalks`.
    tolerance : float, optional
        As for `Refinement.unfold`, with the same default.
    cutoff : float
        With "exact", what is farther is ``inf``, and the search ends there.
    originals : (n,) int64, optional
        The vertex whose values each takes: itself, or that of which it is a copy, see `PointCloud.originals`.
    orders_itself : bool
        Whether sweeps go through the vertices in the order in which their own front meets them, and not in that of the
        heat, which is not read then.

    Raises
    ------
    ValueError
        If the domain has no triangles, or `tolerance` is not a number from 0 to 1.
    """

    def __init__(
        self,
        domain: UnfoldingDomain,
        refine: Refine,
        tolerance: float | None = None,
        cutoff: float = np.inf,
        originals: IntArray | None = None,
        orders_itself: bool = False,
    ) -> None:
        surface = domain.surface
        if surface is None:
            raise ValueError(f"refine={refine!r} unfolds triangles by their edge lengths, and this domain has none")
        if refine == "exact":
            surface = as_thin_as_given(surface)
        self._refinement = None if refine == "exact" else Refinement(surface.unfolding)
        self.is_exact = self._refinement is None or costs_little_to_be_exact(self._refinement, refine)
        require_share(tolerance)
        self._tolerance, self._cutoff = tolerance, cutoff
        self._sweeps = refine == "sweep" and not self.is_exact
        self._orders_itself = orders_itself and self._sweeps
        if self._refinement is not None and self._sweeps:
            self._refinement.keep_for_sweeps()
        self._surface = surface
        self._searches = SurfaceSearches(surface, self._refinement)
        self._domain = domain
        self._originals = originals
        self._spacing = _SPACING * domain.mean_edge_length
        self._given_faces = np.empty((0, 3), np.int64) if surface.given_faces is None else surface.given_faces

    @cached_property
    def _bounds(self) -> Bounds:
        return Bounds(self._surface)

    @cached_property
    def _near_field(self) -> NearField | None:
        return None if self._surface.faces is None else NearField(self._surface.faces)

    @property
    def reads_heat(self) -> bool:
        """Whether the order of the heat is read."""
        return super().reads_heat and not self._orders_itself

    def paths(self, sources: SourceSet, u: FloatArray) -> PathLengths:
        """The paths whose lengths are the distances from vertices and points, for heat (n,).

        Raises
        ------
        ValueError
            With ``refine="sweep"``, whose distances are not the lengths of paths.
        """
        if self._sweeps:
            raise ValueError('refine="sweep" finds no paths to differentiate: take refine="unfold" or "exact"')
        if self._refinement is None or self.is_exact:
            return from_windows(self._searches.on_triangles, self._surface.unfolding, sources)
        return from_walks(self._refinement, sources, u)

    def directed(
        self, sources: SourceSet, u: FloatArray, tolerance: float | None = None
    ) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """As `labelled`, and of each path the directions and the place at which it starts.

        Where walks find the directions, points stand for curves, see `curve_directions_by_windows`. With a smaller
        `tolerance` than that of the solver the directions are more accurate.
        Windows give them, which are exact, if it is 0, or if it is smaller than the default and the mesh has at most
        50 000 vertices.

        Raises
        ------
        MeshError
            If vertices have no tangent plane, see `polar_angles`.
        ValueError
            If `tolerance` is not a number from 0 to 1.
        """
        require_share(tolerance)
        if len(sources.segments.faces) and self._follows_curves(
            sources, self._tolerance if tolerance is None else tolerance
        ):
            return self._directed_from_curves(sources)
        labels, angles = np.empty((2, len(u)), np.int64), np.empty((3, len(u)))
        distance = self._measured(sources, u, labels[0], angles, tolerance, labels[1])
        starts = starting_points(self._corner_at[sources.vertices], self._points(sources), labels[1])
        return distance, labels[0], PathAngles(*angles), starts

    def _follows_curves(self, sources: SourceSet, tolerance: float | None) -> bool:
        """Whether windows find the directions from curves; otherwise points stand for these."""
        n, are_closed = len(self._domain.components), self._walks_of(sources) is not None
        return self._takes_windows(sources) or curve_directions_by_windows(n, tolerance, are_closed)

    def _directed_from_curves(self, sources: SourceSet) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        earliest, relative = from_earliest(sources, self._domain.components, self._given_faces)
        asked = asked_of(relative, relative.points)
        found, angles, places = self._searches.directed_from_curves(asked, self._cutoff)
        distance = found.distance
        if sources.offsets.any():
            distance += self._domain.expand_to_vertices(earliest)
        return distance, labels_of(sources, sources.points)[found.origin.label], angles, places

    @cached_property
    def _corner_at(self) -> IntArray:
        """The first corner (n,) of the given faces at each vertex."""
        F, corner_at = self._given_faces, np.zeros(self._domain.components.size, np.int64)
        corner_at[F.ravel()[::-1]] = np.arange(F.size)[::-1]
        return corner_at

    def _distance(self, sources: SourceSet, u: FloatArray, labels: IntArray | None = None) -> FloatArray:
        return self._measured(sources, u, labels)

    def _measured(
        self,
        sources: SourceSet,
        u: FloatArray,
        labels: IntArray | None = None,
        angles: FloatArray | None = None,
        tolerance: float | None = None,
        origin: IntArray | None = None,
    ) -> FloatArray:
        """Distance (n,) for heat u (n,); arrays that are given are filled.

        Parameters
        ----------
        labels : (n,) int64, optional
            The sources as the user counts them, see `labelled`.
        angles : (3, n) float64, optional
            The columns of `PathAngles`. Points then stand for curves.
        tolerance : float, optional
            Instead of that of the solver.
        origin : (n,) int64, optional
            The places where paths start: vertices, then points, then points that stand for curves. Needs `labels`.
        """
        # Tolerances are relative to the distance: the common part is added afterwards.
        earliest, relative = from_earliest(sources, self._domain.components, self._given_faces)
        by_windows = self._takes_windows(sources)
        walks = None if by_windows or angles is not None else self._walks_of(relative)
        near: ExactSolution | None = None
        if walks is not None:
            points = relative.points
            distance = walks.distance(-u, relative.segments, self._around(relative), labels)
        else:
            takes_curves = by_windows and angles is None
            points = relative.points if takes_curves else self._points(relative)
            asked = asked_of(relative, points, takes_curves)._replace(
                labels=labels, angles=angles, tolerance=self._tolerance if tolerance is None else tolerance
            )
            by_windows = by_windows or (angles is not None and directions_by_windows(len(u), asked.tolerance))
            near, distance = self._with_near(u, asked, relative, by_windows)
        if sources.offsets.any():
            distance += self._domain.expand_to_vertices(earliest)
        if origin is not None and labels is not None:
            origin[:] = labels
        if labels is not None:
            labels[:] = labels_of(sources, points)[labels]
        if near is not None:
            at = np.flatnonzero(np.isfinite(near.distance))
            start = self._domain.expand_to_vertices(earliest)
            distance[at] = start[at] + near.distance[at]
            if labels is not None:
                labels[at] = labels_of(sources, sources.points)[near.origin.label[at]]
        if not by_windows:
            self._bounds.shorten(distance, labels)
            if self._sweeps:
                self._bounds.lengthen(distance, sources, points)
        return self._with_copies(distance, labels, angles, origin)

    def _with_near(
        self, u: FloatArray, asked: Asked, sources: SourceSet, by_windows: bool
    ) -> tuple[ExactSolution | None, FloatArray]:
        """Exact distance near the sources, None if it is not needed, and distance (n,) from them everywhere."""
        if asked.segments is not None:
            return None, self._unfolded(u, asked, None, by_windows)
        if len(sources.segments.faces) and not (by_windows or self._sweeps):
            # Walks along curves do not need the distance near them.
            return both(lambda: self._near(sources, by_windows), lambda: self._unfolded(u, asked, None, by_windows))
        near = self._near(sources, by_windows)
        return near, self._unfolded(u, asked, near, by_windows)

    def _with_copies(self, distance: FloatArray, *others: AnyArray | None) -> FloatArray:
        """The same array; there and in others, copies of points take the values of their originals."""
        if self._originals is not None:
            for values in (distance, *others):
                if values is not None:
                    values[...] = values[..., self._originals]
        return distance

    def _walks_of(self, sources: SourceSet) -> CurveWalks | None:
        """The walks that begin at exact distances near closed curves; None for other sources, or another tolerance."""
        if self._sweeps or self._tolerance is not None:
            return None
        reach = NEAR_RADIUS * self._domain.mean_edge_length
        return self._searches.curve_walks if are_only_closed_curves(sources, self._surface, reach) else None

    def _near(self, sources: SourceSet, by_windows: bool) -> ExactSolution | None:
        """Exact distance around points and curves; None if windows find it anyway, or if there are none.

        Sweeps begin with that around several vertices as well.
        """
        has_curves = len(sources.segments.faces) > 0
        is_known = self._sweeps and len(sources.vertices) > 1
        if not has_curves and (by_windows or (sources.on_vertices_alone and not is_known)):
            return None
        return self._around(sources)

    def _around(self, sources: SourceSet) -> ExactSolution:
        """Exact distance up to some edges from the sources, ``inf`` elsewhere."""
        edges = _KNOWN_RADIUS if sources.on_vertices_alone else NEAR_RADIUS
        cutoff = edges * self._domain.mean_edge_length + float(sources.offsets.max())
        return self._searches.solution(asked_of(sources, sources.points), cutoff)

    def _takes_windows(self, sources: SourceSet) -> bool:
        """Whether distance from these sources is found by exact windows."""
        if self.is_exact:
            return True
        of_places = (self._given_faces[places.faces, 0] for places in (sources.points, sources.segments))
        component = self._domain.components[np.concatenate([sources.vertices, *of_places])]
        return bool((self._component_sizes[component] <= FEW).all())

    @cached_property
    def _component_sizes(self) -> IntArray:
        return np.bincount(self._domain.components)

    def _unfolded(self, u: FloatArray, asked: Asked, near: ExactSolution | None, by_windows: bool) -> FloatArray:
        """Distances (n,), on each component from the first of its sources."""
        if by_windows:
            return self._searches.by_windows(asked, self._cutoff)
        if self._sweeps:
            return self._searches.by_sweep(None if self._orders_itself else -u, asked, near)
        return self._searches.by_walks(u, asked)

    def _points(self, sources: SourceSet) -> SourcePoints:
        """The points of a set, and those that stand for its curves."""
        if not len(sources.segments.faces) or self._near_field is None:
            return sources.points
        return with_samples(sources, self._near_field, self._spacing)
