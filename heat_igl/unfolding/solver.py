"""Steps 2 and 3 replaced: distance by unfolding triangles in the order of the heat, from all kinds of sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import NamedTuple, Protocol

import igl
import numpy as np

from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.operators import Surface, unfolding_surface
from heat_igl.sources import NearField, Seeds, SourcePoints, SourceSegments, SourceSet, take_shorter
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.bounds import Bounds
from heat_igl.unfolding.directions import PathAngles, PathDirections
from heat_igl.unfolding.exact import ExactSurface
from heat_igl.unfolding.half_edges import MARGIN
from heat_igl.unfolding.path_lengths import PathLengths, from_walks, from_windows
from heat_igl.unfolding.refinement import TOLERANCE, Known, Refine, Refinement, WalkStarts

__all__ = ["UnfoldingDomain", "UnfoldingSolver", "UnfoldingTerm"]

# Curves are unfolded from as points, at most so many mean edge lengths s apart. At a distance d that is wrong by the
# fraction (s / d)^2 / 8 at most: by 0.005 % beyond the 6 edges within which straight lines from the curve itself count.
_SPACING = 0.125
# If a sweep gives less than a straight line by less than this, it is the sweep that is wrong, and no shorter path is
# there: sweeps are off by 0.06 to 0.4 % in the mean and by 1.6 % at most (cow, fandisk, camel's head).
_SWEEP_ERROR = 0.01
# In components of up to so many vertices distance is found by exact windows, whatever was asked for.
_FEW = 1000
# So it is with so much curvature at each vertex (radians, in the mean). There walks pass vertices on the wrong side:
# 0.7 to 3.4 % of the largest distance on plates, beams, voxels and terrain, most with 0.5 to 3 radians, and up to
# 0.46 % on a coarse cow with 0.14, which is too much for them but not for a sweep. Scanned surfaces have 0.005 to 0.05.
_ROUGH = {"sweep": 0.25, "unfold": 0.1}
# Up to so many vertices directions are found by windows, if the tolerance is smaller than the default. Walks of the
# tolerance 1e-6 take 0.8 times as long there, and at some vertices depart to the other side of a hill.
_FEW_FOR_DIRECTIONS = 10_000
# With this share of flat vertices, and holes that keep walks from proving flatness, windows are as fast as walks.
_FLAT = 0.5
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
    def n_components(self) -> int:
        """Number of components."""

    @property
    def mean_edge_length(self) -> float:
        """H."""

    def expand_to_vertices(self, of_component: AnyArray) -> AnyArray:
        """The value (n,) of each vertex's component."""


class UnfoldingTerm(Protocol):
    """A set of sources, and the straight lines from its points and curves; `SourceTerm` is one."""

    @property
    def sources(self) -> SourceSet:
        """The sources."""

    @property
    def near_seen(self) -> Seeds:
        """Vertices near points and curves, at the lengths of straight lines."""

    @property
    def far(self) -> Seeds:
        """Corners of the sources' own faces that are farther away."""


def _costs_little_to_be_exact(refinement: Refinement, rough: float) -> bool:
    """Whether the mesh is small or rough, or flat with holes."""
    return (
        refinement.n <= _FEW or refinement.curvature > rough or (refinement.flatness > _FLAT and refinement.has_holes)
    )


def _require_share(tolerance: float | None) -> None:
    if tolerance is not None and not 0 <= tolerance <= 1:
        raise ValueError(f"tolerance must lie between 0 and 1, not {tolerance!r}")


class _Asked(NamedTuple):
    """What distance starts from, and when; `labels` and `angles` are filled if given.

    Without `segments`, points stand for curves.
    """

    vertices: IntArray
    offsets: FloatArray | None
    points: SurfacePoints | None
    point_offsets: FloatArray | None
    segments: SourceSegments | None
    labels: IntArray | None
    angles: FloatArray | None
    tolerance: float | None


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
        points and curves. For the other two, a curve stands for points at most an eighth of a mean edge length apart,
        and straight lines from the curve itself count up to 6 edges from it: beyond, distance is too long by 0.005 % at
        most.
    tolerance : float, optional
        As for `Refinement.unfold`, with the same default.
    cutoff : float
        With "exact", what is farther is ``inf``, and the search ends there.

    Raises
    ------
    ValueError
        If the domain has no triangles, or `tolerance` is not a number from 0 to 1.
    """

    def __init__(
        self, domain: UnfoldingDomain, refine: Refine, tolerance: float | None = None, cutoff: float = np.inf
    ) -> None:
        surface = domain.surface
        if surface is None:
            raise ValueError(f"refine={refine!r} unfolds triangles by their edge lengths, and this domain has none")
        if refine == "exact":
            surface = _as_thin_as_given(surface)
        self._refinement = None if refine == "exact" else Refinement(surface.unfolding)
        #: Whether distances do not depend on the heat.
        self.is_exact = self._refinement is None or _costs_little_to_be_exact(self._refinement, _ROUGH[refine])
        _require_share(tolerance)
        self._tolerance, self._cutoff = tolerance, cutoff
        self._sweeps = refine == "sweep" and not self.is_exact
        self._error = _SWEEP_ERROR if self._sweeps else 0.0
        self._surface = surface
        self._domain = domain
        self._given_faces = np.empty((0, 3), np.int64) if surface.given_faces is None else surface.given_faces
        self._spacing = _SPACING * domain.mean_edge_length

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

    def distances(self, terms: Sequence[UnfoldingTerm], u: FloatArray) -> FloatArray:
        """Distances (k, n) for heat (n, k).

        If the heat has underflowed the order is arbitrary, which the unfolding corrects.
        """
        return np.stack([self._distance(term, one) for term, one in zip(terms, u.T, strict=True)])

    def labelled(self, term: UnfoldingTerm, u: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance (n,) for heat (n,), and the source (n,) that it is measured from, -1 if none is reached."""
        labels = np.empty(len(u), np.int64)
        return self._distance(term, u, labels), labels

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
        self, term: UnfoldingTerm, u: FloatArray, tolerance: float | None = None
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
        _require_share(tolerance)
        labels, angles = np.empty((2, len(u)), np.int64), np.empty((3, len(u)))
        distance = self._measured(term, u, labels[0], angles, tolerance, labels[1])
        return distance, labels[0], PathAngles(*angles), self._places(term, labels[1])

    def _places(self, term: UnfoldingTerm, origin: IntArray) -> SurfacePoints:
        """Sources (n,), counted vertices first; a corner of face 0 where there is none."""
        F, points, vertices = self._given_faces, self._points(term, sampled=True), term.sources.vertices
        corner_at = np.zeros(self._domain.components.size, np.int64)
        corner_at[F.ravel()[::-1]] = np.arange(F.size)[::-1]
        corner = np.append(corner_at[vertices], 0)
        # After the vertices, points and nothing: the last one is nothing for an origin of -1.
        faces = np.concatenate([corner[:-1] // 3, points.faces, corner[-1:] // 3])
        barycentric = np.concatenate([np.eye(3)[corner[:-1] % 3], points.barycentric, np.eye(3)[:1]])
        return SurfacePoints(faces[origin], barycentric[origin])

    def _distance(self, term: UnfoldingTerm, u: FloatArray, labels: IntArray | None = None) -> FloatArray:
        return self._measured(term, u, labels)

    def _measured(
        self,
        term: UnfoldingTerm,
        u: FloatArray,
        labels: IntArray | None = None,
        angles: FloatArray | None = None,
        tolerance: float | None = None,
        origin: IntArray | None = None,
    ) -> FloatArray:
        sources, components = term.sources, self._domain.components
        points = self._points(term, sampled=angles is not None)
        places = SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None
        # Tolerances are relative to the distance: the common part is added afterwards.
        earliest = np.full(self._domain.n_components, np.inf)
        segments = sources.segments if self.is_exact and angles is None and len(sources.segments.faces) else None
        faces = points.faces if segments is None else np.concatenate([points.faces, segments.faces])
        in_faces = components[self._given_faces[faces, 0]] if len(faces) else np.empty(0, np.int64)
        component = np.concatenate([components[sources.vertices], in_faces])
        offset = np.concatenate([sources.vertex_offset, points.offset, [] if segments is None else segments.offset])
        np.minimum.at(earliest, component, offset)
        late = offset - earliest[component]
        k, p = len(sources.vertices), len(points.faces)
        asked = _Asked(
            sources.vertices,
            late[:k] if late.any() else None,
            places,
            late[k : k + p] if late.any() and places else None,
            None if segments is None else replace(segments, offset=late[k + p :]),
            labels,
            angles,
            self._tolerance if tolerance is None else tolerance,
        )
        by_windows = self._takes_windows(component) or self._is_straight(asked)
        distance = self._unfolded(u, asked, term, points, earliest, by_windows)
        start = self._domain.expand_to_vertices(earliest)
        if offset.any():
            distance += start
        if origin is not None and labels is not None:
            origin[:] = labels
        if labels is not None:
            of_places = points.label if segments is None else np.concatenate([points.label, segments.label])
            labels[:] = np.concatenate([sources.vertex_label, of_places, [-1]])[labels]
        for seeds in (term.near_seen, term.far):
            if not len(seeds.vertex):
                continue
            taken = take_shorter(distance, seeds, 0.0 if by_windows else self._error, start)
            if labels is not None:
                labels[seeds.vertex[taken]] = seeds.label[taken]
        if not by_windows:
            self._bounds.shorten(distance, labels)
            if self._sweeps:
                self._bounds.lengthen(distance, sources, points)
        return distance

    def _takes_windows(self, component: IntArray) -> bool:
        """Whether distance from sources in these components is found by exact windows."""
        return self.is_exact or bool((self._component_sizes[component] <= _FEW).all())

    @cached_property
    def _component_sizes(self) -> IntArray:
        return np.bincount(self._domain.components)

    def _unfolded(
        self,
        u: FloatArray,
        asked: _Asked,
        term: UnfoldingTerm,
        points: SourcePoints,
        earliest: FloatArray,
        by_windows: bool,
    ) -> FloatArray:
        """Distances (n,) from vertices and points, each component's from where it begins."""
        if self._refinement is None or by_windows:
            surface = self._exact if asked.segments is None else self._exact_on_given_faces
            found = surface.solve(
                asked.vertices, asked.offsets, asked.points, asked.point_offsets, asked.segments, cutoff=self._cutoff
            )
            if asked.labels is not None:
                asked.labels[:] = found.origin.label
            if asked.angles is not None:
                asked.angles[:] = self.path_directions.of_windows(found, self._starts(asked), asked.points)
            return found.distance
        if asked.angles is not None:
            return self._directed_walks(u, asked)
        unfolded = self._refinement.unfold
        if self._sweeps:
            known, groups = self._known(term, points, earliest, asked), self._groups(term, points)
            unfolded = partial(self._refinement.sweep, known=known, groups=groups)
        elif asked.tolerance is not None:
            unfolded = partial(unfolded, tolerance=asked.tolerance)
        return unfolded(
            -u,
            asked.vertices,
            offsets=asked.offsets,
            points=asked.points,
            point_offsets=asked.point_offsets,
            labels=asked.labels,
        )

    def _is_straight(self, asked: _Asked) -> bool:
        """Whether directions are found by windows, as walks of a small tolerance would take as long."""
        if asked.angles is None or asked.tolerance is None or asked.tolerance >= TOLERANCE:
            return False
        return asked.tolerance == 0 or self._walking.n <= _FEW_FOR_DIRECTIONS

    def _directed_walks(self, u: FloatArray, asked: _Asked) -> FloatArray:
        refinement, starts = self._walking, self._starts(asked)
        walk = refinement.walks(-u, starts, TOLERANCE if asked.tolerance is None else asked.tolerance)
        row = refinement.number
        if asked.labels is not None:
            asked.labels[:] = walk["label"][row]
        if asked.angles is not None:
            asked.angles[:] = self.path_directions.of_walks(walk, asked.points)
        return np.asarray(walk["distance"][row])

    def _starts(self, asked: _Asked) -> WalkStarts:
        return self._walking.starts(asked.vertices, asked.offsets, asked.points, asked.point_offsets)

    @cached_property
    def _walking(self) -> Refinement:
        return Refinement(self._surface.unfolding) if self._refinement is None else self._refinement

    @cached_property
    def path_directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        return PathDirections(self._surface, self._walking)

    def _groups(self, term: UnfoldingTerm, points: SourcePoints) -> IntArray | None:
        """For each source, which curve it is a point of, or itself."""
        segments = term.sources.segments
        if not len(segments.faces):
            return None
        k = len(term.sources.vertices)
        groups = np.arange(k + len(points.faces))
        of_curve = np.isin(points.label, segments.label)
        groups[k:][of_curve] = len(groups) + points.label[of_curve]
        return groups

    def _known(self, term: UnfoldingTerm, points: SourcePoints, earliest: FloatArray, asked: _Asked) -> Known | None:
        """Vertices that straight lines from points reach, and exact windows near several sources."""
        near = term.near_seen
        if len(asked.vertices) + len(points.faces) > 1 and not len(term.sources.segments.faces):
            radius = _KNOWN_RADIUS * self._domain.mean_edge_length
            latest = max((late.max() for late in (asked.offsets, asked.point_offsets) if late is not None), default=0.0)
            found = self._exact.solve(
                asked.vertices, asked.offsets, asked.points, asked.point_offsets, cutoff=latest + radius
            )
            is_found = np.isfinite(found.distance)
            is_found[asked.vertices] = False
            vertex = np.flatnonzero(is_found)
            return Known(vertex, found.distance[vertex], found.origin.label[vertex])
        if not len(near.vertex):
            return None
        # A curve has many sources of one label, and which of them a line comes from is not known.
        label = np.concatenate([term.sources.vertex_label, points.label])
        which, first, count = np.unique(label, return_index=True, return_counts=True)
        at = np.searchsorted(which, near.label)
        near, source = near.at(count[at] == 1), first[at][count[at] == 1]
        return Known(near.vertex, near.value - earliest[self._domain.components[near.vertex]], source)

    def _points(self, term: UnfoldingTerm, sampled: bool = False) -> SourcePoints:
        """The points of a term, and those that stand for curves, unless windows take curves as they are."""
        points, segments = term.sources.points, term.sources.segments
        if not len(segments.faces) or self._faces is None or (self.is_exact and not sampled):
            return points
        return points.joined(self._faces.samples(segments, self._spacing)[0]).joined(segments.ends())
