"""From a set of sources to a `SourceTerm`: initial heat, and the exact distances near the sources."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from heat_igl.heat.source_terms import Seeds, SourceTerm
from heat_igl.intrinsic import Adjacency
from heat_igl.mesh import SurfacePoints
from heat_igl.operators import Operators
from heat_igl.plan import NEAR_RADIUS
from heat_igl.runtime import SOURCE_HEAT
from heat_igl.sources import SourceSegments, SourceSet, samples
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows import ExactSurface

__all__ = ["SourceAssembler", "take_shorter"]

# So many mean edge lengths of a curve give as much heat as a point, so that both are equally warm some edges away. What
# matters is the order of magnitude: from 1 to 16, errors from a point and a curve change by less than 0.06 points.
_EDGES_PER_POINT = 4.0
# A curve is integrated by points at most so many mean edge lengths apart. Hat functions vary over one edge; with a
# sixteenth of it, errors change by less than 0.001 points.
_SPACING = 0.25
_NONE = Seeds(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))


class SourceAssembler:
    """Makes the `SourceTerm` of each set of sources on one domain.

    Parameters
    ----------
    domain : Operators
        The domain.
    t : float or (n_components,) float64
        Time step of the heat flow.
    mass_unit : float or (n,) float64
        The mean mass by which the heat flow divides.
    plain : bool
        Around source vertices take every distance from heat, as the paper does, and none from edges.

    Attributes
    ----------
    edges : Adjacency or None
        The edges of the triangulation that is solved on.
    """

    def __init__(
        self,
        domain: Operators,
        t: float | FloatArray,
        mass_unit: float | FloatArray,
        plain: bool = False,
    ) -> None:
        self._domain, self._t = domain, t
        self._plain = plain
        self._mass = domain.M.diagonal() / mass_unit
        # Of each component, if each has a time step.
        self._h = domain.mean_edge_lengths if np.ndim(t) else np.full(domain.n_components, domain.mean_edge_length)
        surface = domain.surface
        self.edges = None if surface is None else Adjacency(surface.triangulation)
        given = domain.given_surface
        self._faces = None if given is None else given.faces
        # In edges of the mesh: if vertices were added, the operators have shorter ones.
        self._radius = NEAR_RADIUS
        if surface is not None and surface.faces is not None and surface.faces.n < domain.n:
            self._radius *= max(1.0, surface.faces.mean_edge_length / domain.mean_edge_length)
        # Triangulations on which the edges are straight lines: one, if none was flipped; on polygons, their triangles.
        straight = [] if self._faces is None else [self._faces]
        if surface is not None:
            straight += [each for each in (surface.triangulation, surface.uncovered) if each is not None]
        different = {id(each): each for each in straight}
        self._straight = [Adjacency(each) for each in different.values()]

    @cached_property
    def windows(self) -> ExactSurface:
        """Exact distance on the faces before any flip, in which points and curves lie."""
        if self._faces is None:
            raise ValueError("windows need triangles")
        return ExactSurface(self._faces)

    def term(self, sources: SourceSet) -> SourceTerm:
        """Initial heat of `sources`, and the distances known around them."""
        sources = self._carried(sources)
        rim = self._rim(sources)
        ring = self._ring(sources, rim)
        found, far = self._known_by_windows(sources, rim)
        near = Seeds.nearest(_joined(ring, found))
        seen = np.zeros(len(near.vertex), bool)
        if len(found.vertex):
            seen = np.isin(near.vertex, found.vertex) & ~np.isin(near.vertex, sources.vertices)
        vertex, share, label, offset = self._initial_heat(sources, rim)
        return SourceTerm(
            sources=sources,
            vertex=vertex,
            label=label,
            share=share,
            delay=self._delay(vertex, offset),
            mass=self._mass[vertex],
            # Heat is measured in units of h, so that the gradient has none.
            largest_heat=SOURCE_HEAT * min(self._h_at(vertex).min(initial=1e10), 1e10),
            # Inside a region of sources there is no heat flow, and phi says nothing.
            anchors=near.at(~np.isin(near.vertex, sources.vertices[~rim])),
            near=near,
            seen=seen,
            far=far,
        )

    def _carried(self, sources: SourceSet) -> SourceSet:
        """The sources with their points and curves in the triangles that are solved on, before any flip."""
        fans, points, segments = self._domain.fans, sources.points, sources.segments
        if fans is None or sources.on_vertices_alone:
            return sources
        faces, barycentric = fans.carry(points.faces, points.barycentric)
        which, inside, start, end = fans.carry_segments(segments.faces, segments.start, segments.end)
        return replace(
            sources,
            points=replace(points, faces=faces, barycentric=barycentric),
            segments=SourceSegments(inside, start, end, segments.label[which], segments.offset[which]),
        )

    def _rim(self, sources: SourceSet) -> BoolArray:
        """The source vertices that have a neighbour which is none.

        Heat starts from these alone: inside a region of sources it would be level, and its gradient rounding noise
        that is then normalized to length 1 and integrated.
        """
        vertices = sources.vertices
        # From a vertex that no face uses no heat goes anywhere.
        everyone = self._domain.referenced[vertices]
        if not everyone.any():
            everyone = np.ones(len(vertices), bool)
        if len(vertices) < 2 or np.ptp(sources.vertex_offset) > 0:
            return everyone
        is_source = np.zeros(self._domain.n, bool)
        is_source[vertices] = True
        neighbours = self._domain.L[:, vertices]
        outward = np.repeat(np.arange(len(vertices)), np.diff(neighbours.indptr))[~is_source[neighbours.indices]]
        if not len(outward):
            return everyone
        rim = np.zeros(len(vertices), bool)
        rim[outward] = True
        return rim

    def _ring(self, sources: SourceSet, rim: BoolArray) -> Seeds:
        """Source vertices, and around those at the rim their neighbours at the lengths of edges."""
        itself = Seeds(sources.vertices, sources.vertex_offset, sources.vertex_label)
        if self._plain:
            return itself
        vertices, offset, label = sources.vertices[rim], sources.vertex_offset[rim], sources.vertex_label[rim]
        found = [itself]
        for field in self._straight:
            which, ends, lengths = field.spokes(vertices)
            found.append(Seeds(ends, offset[which] + lengths, label[which]))
        return _joined(*found)

    def _known_by_windows(self, sources: SourceSet, rim: BoolArray) -> tuple[Seeds, Seeds]:
        """Exact distance of the vertices within the radius, and of the corners of the sources' own faces beyond.

        Only if there are points or curves; for vertices alone, the ring of edges is enough, but beside an edge of
        more than two faces it is not: the tufted cover leads over it from a face to two of the others alone.
        """
        surface = self._domain.given_surface
        if surface is None or self._faces is None:
            return _NONE, _NONE
        if sources.on_vertices_alone:
            is_covered = surface.uncovered is not None and not self._plain
            if not (is_covered and self._straight[0].meets_shared_edge(sources.vertices[rim])):
                return _NONE, _NONE
        vertices, points, segments = sources.vertices[rim], sources.points, sources.segments
        begin = sources.offsets.min()
        radius = self._radius * self._h_at(np.arange(self._faces.n))
        # The corners of the sources' own faces are known, too, however far they are.
        places = points.joined(segments.ends())
        own, _ = self._faces.locate(places.faces, places.barycentric)
        reach = max(float(radius.max()), float(self._faces.l[own].max(initial=0.0)))
        found = self.windows.solve(
            vertices,
            sources.vertex_offset[rim] - begin,
            SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None,
            points.offset - begin if len(points.faces) else None,
            replace(segments, offset=segments.offset - begin) if len(segments.faces) else None,
            cutoff=reach + float(sources.offsets.max() - begin),
        )
        offset = np.concatenate([sources.vertex_offset[rim], points.offset, segments.offset])[found.origin.label]
        label = np.concatenate([sources.vertex_label[rim], points.label, segments.label])[found.origin.label]
        value = found.distance + begin
        is_near = value - offset <= radius
        is_far = np.zeros(len(value), bool)
        is_far[self._faces.F[own]] = True
        is_far &= np.isfinite(value) & ~is_near
        all_of_them = Seeds(np.arange(len(value)), value, label)
        return all_of_them.at(is_near), all_of_them.at(is_far)

    def _initial_heat(self, sources: SourceSet, rim: BoolArray) -> tuple[IntArray, FloatArray, IntArray, FloatArray]:
        """Vertices, shares, labels and offsets of the initial heat: the hat functions at points, and along curves."""
        vertices = sources.vertices[rim]
        of_vertices = vertices, np.ones(len(vertices)), sources.vertex_label[rim], sources.vertex_offset[rim]
        surface = self._domain.given_surface
        if sources.on_vertices_alone or surface is None or surface.given_faces is None or self._faces is None:
            return of_vertices
        h = self._h_at(surface.given_faces[sources.segments.faces, 0])
        along, lengths = samples(self._faces, sources.segments, h * _SPACING)
        h = self._h_at(surface.given_faces[along.faces, 0])
        amount = np.concatenate([np.ones(len(sources.points.faces)), lengths / (h * _EDGES_PER_POINT)])
        points = sources.points.joined(along)
        # On a cover, half of the heat goes to the back.
        sides = (False, True) if surface.triangulation.is_cover else (False,)
        parts = [of_vertices]
        for on_back in sides:
            faces, barycentric = surface.triangulation.locate(points.faces, points.barycentric, on_back)
            parts.append(
                (
                    surface.triangulation.F[faces].ravel(),
                    (amount[:, None] * barycentric).ravel() / len(sides),
                    np.repeat(points.label, 3),
                    np.repeat(points.offset, 3),
                )
            )
        vertex, share, label, offset = (np.concatenate(column) for column in zip(*parts, strict=True))
        used = share > 0
        return vertex[used], share[used], label[used], offset[used]

    def _delay(self, vertex: IntArray, offset: FloatArray) -> FloatArray:
        """Heat falls by exp(-d / sqrt(t)) over a distance d, so a later source has less heat by this factor."""
        if offset.min(initial=np.inf) == offset.max(initial=0.0):
            return np.zeros(len(offset))
        components = self._domain.components
        earliest = np.full(self._domain.n_components, np.inf)
        np.minimum.at(earliest, components[vertex], offset)
        t = self._t[components[vertex]] if isinstance(self._t, np.ndarray) else self._t
        return np.asarray((offset - earliest[components[vertex]]) / np.sqrt(t))

    def _h_at(self, vertex: IntArray) -> FloatArray:
        """Mean edge length (k,) of the components of some vertices."""
        return np.asarray(self._h[self._domain.components[vertex]])


def take_shorter(distance: FloatArray, seeds: Seeds, error: float, start: FloatArray) -> BoolArray:
    """Set known values if they are shorter, or longer by less than the error of `distance`; which were.

    The error is relative to the distance from `start` (n,), the value at the source.
    """
    begin = start[seeds.vertex]
    taken = seeds.value - begin < (distance[seeds.vertex] - begin) * (1 + error)
    distance[seeds.vertex[taken]] = seeds.value[taken]
    return np.asarray(taken)


def _joined(*parts: Seeds) -> Seeds:
    parts = tuple(part for part in parts if len(part.vertex)) or parts[:1]
    if len(parts) == 1:
        return parts[0]
    return Seeds(
        np.concatenate([part.vertex for part in parts]),
        np.concatenate([part.value for part in parts]),
        np.concatenate([part.label for part in parts]),
    )
