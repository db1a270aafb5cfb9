"""Steps 2 and 3 replaced: distance by unfolding triangles in the order of the heat, from all kinds of sources."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Protocol

import igl
import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.operators import Surface, unfolding_surface
from heat_igl.runtime import both, n_threads
from heat_igl.sources import NEAR_RADIUS, NearField, SourcePoints, SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.asked import (
    Asked,
    asked_of,
    from_earliest,
    groups_of,
    known_of,
    labels_of,
    require_share,
    with_samples,
)
from heat_igl.unfolding.bounds import Bounds
from heat_igl.unfolding.curve_walks import CurveWalks, are_closed
from heat_igl.unfolding.directions import PathAngles, PathDirections
from heat_igl.unfolding.exact import ExactSolution, ExactSurface
from heat_igl.unfolding.half_edges import MARGIN
from heat_igl.unfolding.numbered import TOLERANCE
from heat_igl.unfolding.path_lengths import PathLengths, from_walks, from_windows
from heat_igl.unfolding.refinement import Refine, Refinement
from heat_igl.unfolding.when_exact import FEW, costs_little_to_be_exact, directions_by_windows

__all__ = ["UnfoldingDomain", "UnfoldingSolver"]

# Curves are unfolded from as points, at most so many mean edge lengths s apart. At a distance d that is wrong by the
# fraction (s / d)^2 / 8 at most: by 0.005 % beyond the 6 edges within which windows take the curve itself.
_SPACING = 0.125
# Sweeps from several sources start with the exact distance up to so many mean edge lengths: next to a border of cells
# they know no source from both ends of a side.
_KNOWN_RADIUS = 4.0


class UnfoldingDomain(Protocol):
    """The part of a domain that unfolding uses; `Operators` is one."""

    @property
    def surface(self) -> Surface | None:
        """The triangles."""

    @property
    def components(self) -> IntArray:
        """Component label (n,) of each vertex."""

    @property
    def mean_edge_length(self) -> float:
        """Mean length of the edges."""

    def expand_to_vertices(self, of_component: AnyArray) -> AnyArray:
        """The value (n,) of each vertex's component."""


def _as_thin_as_given(surface: Surface) -> Surface:
    """Of triangles that were mollified for the heat, those that windows cross: paths over them are not made longer."""
    given, faces = surface.given_faces, surface.faces
    if given is None or faces is None or surface.V is None or faces.lengthening == 0:
        return surface
    added = faces.l - igl.edge_lengths(surface.V, faces.F)
    if np.abs(added - 0.5 * faces.lengthening).max() > 0.51 * faces.lengthening:
        return surface  # lengths of another metric
    return unfolding_surface(Mesh(surface.V, given), MARGIN)


class UnfoldingSolver:
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
            surface = _as_thin_as_given(surface)
        self._refinement = None if refine == "exact" else Refinement(surface.unfolding)
        #: Whether distances do not depend on the heat.
        self.is_exact = self._refinement is None or costs_little_to_be_exact(self._refinement, refine)
        require_share(tolerance)
        self._tolerance, self._cutoff = tolerance, cutoff
        self._sweeps = refine == "sweep" and not self.is_exact
        self._orders_itself = orders_itself and self._sweeps
        if self._refinement is not None and self._sweeps:
            self._refinement.keep_for_sweeps()
        self._surface = surface
        self._domain = domain
        self._originals = originals
        self._spacing = _SPACING * domain.mean_edge_length
        self._given_faces = np.empty((0, 3), np.int64) if surface.given_faces is None else surface.given_faces

    @cached_property
    def _exact(self) -> ExactSurface:
        return ExactSurface(self._surface.unfolding)

    @cached_property
    def _exact_on_given_faces(self) -> ExactSurface:
        return ExactSurface(self._surface.unfolding if self._surface.faces is None else self._surface.faces)

    @cached_property
    def _bounds(self) -> Bounds:
        return Bounds(self._surface)

    @cached_property
    def _faces(self) -> NearField | None:
        return None if self._surface.faces is None else NearField(self._surface.faces)

    @property
    def reads_heat(self) -> bool:
        """Whether the order of the heat is read."""
        return not (self.is_exact or self._orders_itself)

    def distances(self, source_sets: Sequence[SourceSet], u: FloatArray) -> FloatArray:
        """Distances (k, n) for heat (n, k).

        If the heat has underflowed the order is arbitrary, which the unfolding corrects.
        """
        return np.stack([self._distance(sources, one) for sources, one in zip(source_sets, u.T, strict=True)])

    def labelled(self, sources: SourceSet, u: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance (n,) for heat (n,), and the source (n,) that it is measured from, -1 if none is reached."""
        labels = np.empty(len(u), np.int64)
        return self._distance(sources, u, labels), labels

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
            return from_windows(self._exact, self._surface.unfolding, sources)
        return from_walks(self._refinement, sources, u)

    def directed(
        self, sources: SourceSet, u: FloatArray, tolerance: float | None = None
    ) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """As `labelled`, and of each path the directions and the place at which it starts.

        Points stand for curves. With a smaller `tolerance` than that of the solver the directions are more accurate.
        Windows give them, which are exact, if it is 0, or if it is smaller than the default and the mesh has at most
        10 000 vertices.

        Raises
        ------
        MeshError
            If vertices have no tangent plane, see `polar_angles`.
        ValueError
            If `tolerance` is not a number from 0 to 1.
        """
        require_share(tolerance)
        labels, angles = np.empty((2, len(u)), np.int64), np.empty((3, len(u)))
        distance = self._measured(sources, u, labels[0], angles, tolerance, labels[1])
        return distance, labels[0], PathAngles(*angles), self._places(sources, labels[1])

    def _places(self, sources: SourceSet, origin: IntArray) -> SurfacePoints:
        """Sources (n,), counted vertices first; a corner of face 0 where there is none."""
        points = self._points(sources)
        corner = np.append(self._corner_at[sources.vertices], 0)
        # After the vertices, points and nothing: the last one is nothing for an origin of -1.
        faces = np.concatenate([corner[:-1] // 3, points.faces, corner[-1:] // 3])
        barycentric = np.concatenate([np.eye(3)[corner[:-1] % 3], points.barycentric, np.eye(3)[:1]])
        return unchecked_points(faces[origin], barycentric[origin])

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
        # Tolerances are relative to the distance: the common part is added afterwards.
        earliest, relative = from_earliest(sources, self._domain.components, self._given_faces)
        by_windows = self._takes_windows(sources)
        walks = None if by_windows or angles is not None else self._walks_of(relative)
        if walks is not None:
            distance = self._from_curves(walks, relative, u, labels, self._domain.expand_to_vertices(earliest))
            return self._with_copies(distance, labels)
        takes_curves = by_windows and angles is None
        points = relative.points if takes_curves else self._points(relative)
        asked = asked_of(relative, points, takes_curves)._replace(
            labels=labels, angles=angles, tolerance=self._tolerance if tolerance is None else tolerance
        )
        by_windows = by_windows or (angles is not None and directions_by_windows(len(u), asked.tolerance))
        groups = groups_of(relative, points)
        if len(relative.segments.faces) and not (by_windows or self._sweeps) and n_threads() > 1:
            # Walks along curves do not need the distance near them.
            near, distance = both(
                lambda: self._near(relative, by_windows), lambda: self._unfolded(u, asked, None, groups, by_windows)
            )
        else:
            near = None if takes_curves else self._near(relative, by_windows)
            distance = self._unfolded(u, asked, near, groups, by_windows)
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

    def _with_copies(self, distance: FloatArray, *others: AnyArray | None) -> FloatArray:
        """The same array; there and in others, copies of points take the values of their originals."""
        if self._originals is not None:
            for values in (distance, *others):
                if values is not None:
                    values[...] = values[..., self._originals]
        return distance

    def _walks_of(self, sources: SourceSet) -> CurveWalks | None:
        """The walks that begin at exact distances near closed curves; None for other sources, or another tolerance.

        None, too, if a corner of a face in which a curve runs may be farther away than those distances are known.
        """
        has_others = len(sources.vertices) or len(sources.points.faces) or not len(sources.segments.faces)
        faces, V, h = self._surface.faces, self._surface.V, self._domain.mean_edge_length
        if has_others or self._sweeps or self._tolerance is not None or faces is None or V is None:
            return None
        is_near = faces.l[sources.segments.faces].max() <= NEAR_RADIUS * h
        return self._curve_walks if is_near and are_closed(sources.segments, V, faces.F) else None

    @cached_property
    def _curve_walks(self) -> CurveWalks | None:
        """None unless the surface is an oriented manifold."""
        faces, refinement = self._surface.faces, self._refinement
        if faces is None or refinement is None:
            return None
        try:
            directions = self.path_directions
        except MeshError:
            return None
        return CurveWalks(faces, refinement, directions, self._exact_on_given_faces)

    def _from_curves(
        self, walks: CurveWalks, sources: SourceSet, u: FloatArray, labels: IntArray | None, start: FloatArray
    ) -> FloatArray:
        """Distance (n,) from segments, whose offsets count from `start` (n,) on."""
        near = self._near(sources, by_windows=False)
        if near is None:
            raise ValueError("walks from curves need curves")
        distance = walks.distance(-u, sources.segments, near, labels) + start
        if labels is not None:
            labels[:] = labels_of(sources, sources.points)[labels]
        self._bounds.shorten(distance, labels)
        return distance

    def _near(self, sources: SourceSet, by_windows: bool) -> ExactSolution | None:
        """Exact distance around points and curves; None if windows find it anyway, or if there are none.

        Sweeps begin with that around several vertices as well.
        """
        has_curves = len(sources.segments.faces) > 0
        is_known = self._sweeps and len(sources.vertices) > 1
        if not has_curves and (by_windows or (sources.on_vertices_alone and not is_known)):
            return None
        edges = _KNOWN_RADIUS if sources.on_vertices_alone else NEAR_RADIUS
        cutoff = edges * self._domain.mean_edge_length + float(sources.offsets.max())
        surface, asked = self._exact_on_given_faces if has_curves else self._exact, asked_of(sources, sources.points)
        return surface.solve(*asked.starts, cutoff=cutoff)

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

    def _unfolded(
        self,
        u: FloatArray,
        asked: Asked,
        near: ExactSolution | None,
        groups: IntArray | None,
        by_windows: bool,
    ) -> FloatArray:
        """Distances (n,) from vertices and points, each component's from where it begins."""
        if self._refinement is None or by_windows:
            surface = self._exact if asked.segments is None else self._exact_on_given_faces
            found = surface.solve(*asked.starts, cutoff=self._cutoff, directed=asked.angles is not None)
            if asked.labels is not None:
                asked.labels[:] = found.origin.label
            if asked.angles is not None:
                asked.angles[:] = self.path_directions.of_windows(found, asked.points)
            return found.distance
        if asked.angles is not None:
            return self._directed_walks(self._refinement, u, asked)
        starts = asked.vertices, asked.offsets, asked.points, asked.point_offsets, asked.labels
        if self._sweeps:
            # Which point of a curve is nearest is not known.
            known = None if groups is not None else known_of(asked, near)
            key = None if self._orders_itself else -u
            return self._refinement.sweep(key, *starts, known=known, groups=groups)
        tolerance = TOLERANCE if asked.tolerance is None else asked.tolerance
        return self._refinement.unfold(-u, starts[0], tolerance, *starts[1:])

    def _directed_walks(self, refinement: Refinement, u: FloatArray, asked: Asked) -> FloatArray:
        directions = self.path_directions  # refuses surfaces without tangent planes, before there are walks
        starts = refinement.starts(asked.vertices, asked.offsets, asked.points, asked.point_offsets)
        walk = refinement.walks(refinement.order(-u), starts, TOLERANCE if asked.tolerance is None else asked.tolerance)
        row = refinement.number
        if asked.labels is not None:
            asked.labels[:] = walk["label"][row]
        if asked.angles is not None:
            asked.angles[:] = directions.of_walks(walk, asked.points)
        return np.asarray(walk["distance"][row])

    @cached_property
    def path_directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        return PathDirections(self._surface, self._refinement)

    def _points(self, sources: SourceSet) -> SourcePoints:
        """The points of a set, and those that stand for its curves."""
        if not len(sources.segments.faces) or self._faces is None:
            return sources.points
        return with_samples(sources, self._faces, self._spacing)
