"""From sources to right-hand sides: initial heat, the exact distances near the sources, and which others overtake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from heat_igl.heat.steps import HeatFlow
from heat_igl.mesh.connectivity import mask_of
from heat_igl.operators import Operators, Surface
from heat_igl.operators.matrices import edge_paths
from heat_igl.plan import NEAR_RADIUS
from heat_igl.runtime import SOURCE_HEAT
from heat_igl.runtime.threads import BLOCK
from heat_igl.sources import SourceSegments, SourceSet, nearest_first, samples
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows import ExactSurface

# So many mean edge lengths of a curve give as much heat as a point, so that both are equally warm some edges away. What
# matters is the order of magnitude: from 1 to 16, errors from a point and a curve change by less than 0.06 points.
_EDGES_PER_POINT = 4.0
# A curve is integrated by points at most so many mean edge lengths apart. Hat functions vary over one edge; with a
# sixteenth of it, errors change by less than 0.001 points.
_SPACING = 0.25
# A source is overtaken if heat there is more than so many times the heat there if all began as late as this one. A
# front that has come before the source by a time x, as long as its way of x, is exp(x / sqrt(t)) times as warm as one
# that comes with it: 5 times after 1.1 mean edge lengths at the default t = h^2 / 2, and 2 or so since heat also falls
# as it spreads. Up to there the distance from either source is the same to within the error of the method.
_OVERTAKEN = 5.0
# Distances that differ by a smaller share are equal.
_ROUNDING = 1e-12


class Seeds(NamedTuple):
    """Exactly known distances: `value` (k,) at distinct vertices `vertex` (k,), from the source `label` (k,)."""

    vertex: IntArray
    value: FloatArray
    label: IntArray

    def nearest(self) -> Seeds:
        """The smallest of several values at each vertex."""
        return self.at(nearest_first(*self))

    def of_one_source(self, nearest: Seeds) -> Seeds:
        """The `nearest` at vertices to which no two sources are equally near; of a source without such, all."""
        if (self.label == self.label[:1]).all():
            return nearest
        chosen = self.at(np.lexsort((self.value, self.label, self.vertex)))
        least = nearest.value[np.searchsorted(nearest.vertex, chosen.vertex)]
        is_new = (np.diff(chosen.vertex, prepend=-1) != 0) | (np.diff(chosen.label, prepend=-1) != 0)
        chosen = chosen.at(is_new & (chosen.value <= least * (1 + _ROUNDING)))
        is_tied = np.bincount(chosen.vertex)[chosen.vertex] > 1
        return chosen.at(~is_tied | ~np.isin(chosen.label, chosen.label[~is_tied]))

    @classmethod
    def joined(cls, *parts: Seeds) -> Seeds:
        """Several seeds, at vertices that need not be distinct."""
        return cls(*(np.concatenate(each) for each in zip(*parts, strict=True)))

    def at(self, chosen: BoolArray | IntArray) -> Seeds:
        """Some of the seeds, by a mask (k,) or their positions."""
        return Seeds._make(field[chosen] for field in self)


_NONE = Seeds(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))


@dataclass(frozen=True, eq=False)
class SourceTerm:
    """One set of sources on a domain: a right-hand side of step 1, and the distances that are known beside it.

    Initial heat of ``unit * share * exp(-delay)`` is put on each `vertex` (e,), of a `mass` in units of the mean mass,
    for the source `label`; heat reaches `largest_heat` at most. `anchors` fix the level of phi. The result takes over
    `near`, of which those `seen` have their distance by windows: on faces with such corners the field is the gradient
    of these. `far` are corners of the sources' own faces beyond these.
    """

    sources: SourceSet
    vertex: IntArray
    label: IntArray
    share: FloatArray
    delay: FloatArray
    mass: FloatArray
    largest_heat: float
    anchors: Seeds
    near: Seeds
    seen: BoolArray
    far: Seeds

    @cached_property
    def unit(self) -> float:
        """The heat that a share of 1 stands for: as much as cannot exceed `largest_heat`.

        Rows of L sum to zero, so the maximum principle bounds the heat by the largest initial heat over mass.
        """
        at_vertex = self.share
        if len(at_vertex) > 1:
            _, which = np.unique(self.vertex, return_inverse=True)
            at_vertex = np.asarray(np.bincount(which, self.share), np.float64)[which]
        held = (self.mass > 0) & (at_vertex > 0)
        return self.largest_heat * float((self.mass[held] / at_vertex[held]).min(initial=1.0))

    def restricted(self, labels: IntArray, anchors: Seeds, kept: BoolArray) -> SourceTerm:
        """The term of the sources in `labels` alone, with other anchors and those of `near` that are `kept` (g,)."""
        alive = np.isin(self.label, labels)
        heat = {name: getattr(self, name)[alive] for name in ("vertex", "label", "share", "delay", "mass")}
        return replace(self, **heat, anchors=anchors, near=self.near.at(kept), seen=self.seen[kept])


def right_hand_side(n: int, terms: Sequence[SourceTerm], shares: Sequence[FloatArray] | None = None) -> FloatArray:
    """Right-hand sides (n, k) of `HeatFlow.solve` for k terms, or for other `shares` of their units."""
    heat = np.zeros((n, len(terms)))
    shares = [term.share for term in terms] if shares is None else shares
    # The unit is inside the exponential, since exp(-delay) alone would underflow.
    with np.errstate(under="ignore"):
        for column, term, share in zip(heat.T, terms, shares, strict=True):
            np.add.at(column, term.vertex, share * np.exp(np.log(term.unit) - term.delay))
    return heat


class SourceAssembler:
    """Makes the `SourceTerm` of each set of sources on one domain, for the time step t of the heat flow.

    `mass_unit` is the mean mass by which the flow divides. If `plain`, every distance around source vertices comes from
    heat, as in the paper, and none from edges.
    """

    def __init__(
        self, domain: Operators, t: float | FloatArray, mass_unit: float | FloatArray, plain: bool = False
    ) -> None:
        self._domain, self._t = domain, t
        self._plain = plain
        self._mass = domain.M.diagonal() / mass_unit
        self._h = domain.mean_edge_lengths
        surface = domain.surface
        self._radius = NEAR_RADIUS * self._h
        if surface is not None and surface.faces.n < domain.n:
            # In edges of the mesh where vertices were added, since the operators have shorter ones.
            half_edge, refined = surface.faces.edges, np.unique(domain.components[surface.faces.n :])
            component, length = domain.components[surface.faces.tail(half_edge)], surface.faces.l.ravel()[half_edge]
            total, count = (np.bincount(component, of, domain.n_components)[refined] for of in (length, None))
            self._radius[refined] = NEAR_RADIUS * np.maximum(self._h[refined], total / count)

    @cached_property
    def edges(self) -> Any:
        """The edges that are straight lines: of all triangulations, and on polygons of their triangles."""
        surface = self._domain.surface
        if surface is None or surface.uncovered is None:
            return surface and surface.paths
        return edge_paths(surface.faces, surface.triangulation, surface.uncovered)

    @cached_property
    def windows(self) -> ExactSurface:
        """Exact distance on the faces before any flip, in which points and curves lie."""
        return ExactSurface(cast(Surface, self._domain.surface).faces)

    def term(self, sources: SourceSet) -> SourceTerm:
        """Initial heat of `sources`, and the distances known around them."""
        sources = self._carried(sources)
        rim = self._rim(sources)
        ring = self._ring(sources, rim)
        found, far = self._known_by_windows(sources, rim)
        known = Seeds.joined(ring, found)
        near = known.nearest()
        anchors = known.of_one_source(near)
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
            anchors=anchors if rim.all() else anchors.at(~np.isin(anchors.vertex, sources.vertices[~rim])),
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
            points=points._replace(faces=faces, barycentric=barycentric),
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
        is_source = mask_of(vertices, self._domain.n)
        neighbours = self._domain.L[:, vertices]
        outward = np.repeat(np.arange(len(vertices)), np.diff(neighbours.indptr))[~is_source[neighbours.indices]]
        return mask_of(outward, len(vertices)) if len(outward) else everyone

    def _ring(self, sources: SourceSet, rim: BoolArray) -> Seeds:
        """Source vertices, and around those at the rim their neighbours at the lengths of edges."""
        itself = Seeds(sources.vertices, sources.vertex_offset, sources.vertex_label)
        if self._plain or self.edges is None:
            return itself
        vertices, offset, label = sources.vertices[rim], sources.vertex_offset[rim], sources.vertex_label[rim]
        which, ends, lengths = self.edges.around(vertices)
        return Seeds.joined(itself, Seeds(ends, offset[which] + lengths, label[which]))

    def _known_by_windows(self, sources: SourceSet, rim: BoolArray) -> tuple[Seeds, Seeds]:
        """Exact distance of the vertices within the radius, and of the corners of the sources' own faces beyond.

        Only if there are points or curves; for vertices alone, the ring of edges is enough, but beside an edge of
        more than two faces it is not: the tufted cover leads over it from a face to two of the others alone.
        """
        surface = self._domain.surface
        if surface is None:
            return _NONE, _NONE
        faces = surface.faces
        if sources.on_vertices_alone:
            if surface.uncovered is None or self._plain:
                return _NONE, _NONE
            corner, _ = faces.corners_at(sources.vertices[rim])
            if (faces.twin.reshape(-1, 3)[corner // 3] > -2).all():
                return _NONE, _NONE
        begin = sources.offsets.min()
        radius = self._radius[self._domain.components[: faces.n]]
        # The corners of the sources' own faces are known, too, however far they are.
        places = sources.points.joined(sources.segments.ends())
        own, _ = faces.locate(places.faces, places.barycentric)
        reach = max(float(radius.max()), float(faces.l[own].max(initial=0.0)))
        started = sources.among(mask_of(sources.vertices[rim], self._domain.n))
        found = self.windows.solve(
            started.with_offsets(started.offsets - begin), cutoff=reach + float(sources.offsets.max() - begin)
        )
        offset, label = started.offsets[found.origin.label], started.labels[found.origin.label]
        value = found.distance + begin
        is_near = value - offset <= radius
        is_far = mask_of(faces.F[own], len(value)) & np.isfinite(value) & ~is_near
        all_of_them = Seeds(np.arange(len(value)), value, label)
        return all_of_them.at(is_near), all_of_them.at(is_far)

    def _initial_heat(self, sources: SourceSet, rim: BoolArray) -> tuple[IntArray, FloatArray, IntArray, FloatArray]:
        """Vertices, shares, labels and offsets of the initial heat: the hat functions at points, and along curves."""
        vertices = sources.vertices[rim]
        of_vertices = vertices, np.ones(len(vertices)), sources.vertex_label[rim], sources.vertex_offset[rim]
        surface = self._domain.surface
        if sources.on_vertices_alone or surface is None:
            return of_vertices
        h = self._h_at(surface.given_faces[sources.segments.faces, 0])
        along, lengths = samples(surface.faces, sources.segments, h * _SPACING)
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


def drop_overtaken(term: SourceTerm, heat_flow: HeatFlow, n: int) -> SourceTerm:
    """`term` without the sources that others overtake before they begin, and the values that others come before.

    Two solves tell: there the heat is many times the heat there if all began as late as this source does.
    """
    offsets = term.sources.offsets
    if offsets.min() == offsets.max():
        return term
    at_once = replace(term, delay=np.zeros_like(term.delay))
    u, u_at_once = heat_flow.solve(right_hand_side(n, [term, at_once])).T
    delay = np.zeros(term.sources.n_labels)
    delay[term.label] = term.delay

    def is_on_time(vertex: IntArray, label: IntArray) -> BoolArray:
        with np.errstate(divide="ignore", invalid="ignore"):
            late = np.log(u[vertex]) >= np.log(u_at_once[vertex]) - delay[label] + np.log(_OVERTAKEN)
        # No heat comes to a vertex that no face uses. On the triangles of the mesh heat may be negative, and then says
        # nothing; the first source is never overtaken.
        return np.asarray(~late | (u_at_once[vertex] == 0) | (delay[label] == 0))

    anchors = term.anchors.at(is_on_time(term.anchors.vertex, term.anchors.label))
    return term.restricted(anchors.label, anchors, kept=is_on_time(term.near.vertex, term.near.label))


def warmest_sources(term: SourceTerm, heat_flow: HeatFlow, n: int) -> IntArray:
    """The source (n,) from which each vertex gets most heat, -1 if it gets none; a solve for each source."""
    labels = np.full(n, -1)
    most = np.full(n, -np.inf)
    present = np.unique(term.label)
    for block in np.split(present, range(BLOCK, len(present), BLOCK)):
        shares: list[FloatArray] = [term.share * (term.label == label) for label in block]
        parts = heat_flow.solve(right_hand_side(n, [term] * len(block), shares))
        parts[parts == 0] = -np.inf  # no heat; far away in obtuse cells all of it may be below 0
        warmest = parts.argmax(axis=1)
        heat = np.take_along_axis(parts, warmest[:, None], axis=1)[:, 0]
        labels = np.where(heat > most, block[warmest], labels)
        np.maximum(most, heat, out=most)
    labels[term.near.vertex] = term.near.label
    return labels
