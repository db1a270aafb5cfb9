"""What a set of sources gives to each step: heat to start from, exact values around it, the level to begin at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from heat_igl.operators import Operators
from heat_igl.sources.near_field import NearField, Seeds
from heat_igl.sources.specification import SourceSet
from heat_igl.steps import HeatFlow
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["Emission", "Emitter", "take_shorter"]

# Largest heat at a source, in units of h: leaves room for the gradient's 1 / length on slivers.
_SOURCE_HEAT = 1e290
# How far around points and curves distance is taken from straight lines, in mean edge lengths.
_RADIUS = 6.0
# Point and curve are equally warm some edges away if the heat of a point is spread over so many edges of the curve.
_EDGES_PER_POINT = 4.0
# Points that a curve is integrated by are at most so many edges apart.
_SPACING = 0.25
# A straight line longer than the integrated distance by more than this does not lead to the nearest source.
_HEAT_ERROR = 0.2
# A source is overtaken where heat is so many times what it would be if all began as late: after 2 edges or so.
_OVERTAKEN = 5.0
# Right-hand sides of labels solved together.
_BLOCK = 8
_NONE = Seeds(np.empty(0, np.int64), np.empty(0), np.empty(0, np.int64))


@dataclass(frozen=True, eq=False)
class Emission:
    """One set of sources, ready for the steps.

    Attributes
    ----------
    sources : SourceSet
        As the user gave it.
    vertex, share, delay, label : (e,) int64, float64, float64, int64
        Initial heat: a share of the unit at a vertex, less exp(-delay), and the source that it belongs to.
    anchors : Seeds
        Where the integrated phi is compared with known values.
    near : Seeds
        Vertices whose distance is known and set.
    guides : (g,) bool
        Which of `near` were found by straight lines from points and curves: on faces with such corners alone, the
        field is the gradient of these values.
    far : Seeds
        Corners of sources' faces that are too far away to be among `near`, by straight lines.
    """

    sources: SourceSet
    vertex: IntArray
    share: FloatArray
    delay: FloatArray
    label: IntArray
    anchors: Seeds
    near: Seeds
    guides: BoolArray
    far: Seeds


class Emitter:
    """Sources on one domain.

    Parameters
    ----------
    domain : Operators
        The domain.
    heat_flow : HeatFlow
        Step 1 on it.
    plain : bool
        Around source vertices take every distance from heat, as the paper does, and none from edges.
    unfolds : bool
        Distance will come by unfolding, which finds what is around source vertices by itself.
    """

    def __init__(self, domain: Operators, heat_flow: HeatFlow, plain: bool = False, unfolds: bool = False) -> None:
        self._domain = domain
        self._plain, self._unfolds = plain, unfolds
        self._heat_flow = heat_flow
        self._mass = domain.M.diagonal() / heat_flow.mean_mass
        self._on_solved = None if domain.triangulation is None else NearField(domain.triangulation)
        self._on_faces = None if domain.faces is None else NearField(domain.faces)
        # Triangulations on which the edges are straight lines: one, if none was flipped.
        self._fields = [field for field in (self._on_solved, self._on_faces) if field is not None]
        if domain.faces is domain.triangulation:
            self._fields = self._fields[:1]

    def emission(self, sources: SourceSet) -> Emission:
        """`sources` ready for step 1."""
        rim = self._rim(sources)
        near_vertices = self._near_vertices(sources, rim)
        lines, far = self._straight_lines(sources, rim)
        near = Seeds.nearest(_joined(near_vertices, lines))
        guides = np.zeros(len(near.vertex), bool)
        if len(lines.vertex):
            guides = np.isin(near.vertex, lines.vertex) & ~np.isin(near.vertex, sources.vertices)
        # Inside a region of sources there is no heat flow, and phi says nothing.
        anchors = near.at(~np.isin(near.vertex, sources.vertices[~rim]))
        vertex, share, label, offset = self._heat(sources, rim)
        return Emission(sources, vertex, share, self._delay(vertex, offset), label, anchors, near, guides, far)

    def on_time(self, found: Emission) -> Emission:
        """Less the sources that others overtake before they begin, and the values that others come before.

        Two solves tell: there the heat is many times what it would be if all began as late as this source does.
        """
        offsets = found.sources.offsets
        if offsets.min() == offsets.max():
            return found
        at_once = replace(found, delay=np.zeros_like(found.delay))
        u, u_at_once = self._heat_flow.solve(self.heat([found, at_once])).T
        delay = np.zeros(found.sources.n_labels)
        delay[found.label] = found.delay

        def is_on_time(vertex: IntArray, label: IntArray) -> BoolArray:
            with np.errstate(divide="ignore"):
                return np.asarray(np.log(u[vertex]) < np.log(u_at_once[vertex]) - delay[label] + np.log(_OVERTAKEN))

        anchors = found.anchors.at(is_on_time(found.anchors.vertex, found.anchors.label))
        kept = is_on_time(found.near.vertex, found.near.label)
        alive = np.isin(found.label, anchors.label)
        return replace(
            found,
            vertex=found.vertex[alive],
            share=found.share[alive],
            delay=found.delay[alive],
            label=found.label[alive],
            anchors=anchors,
            near=found.near.at(kept),
            guides=found.guides[kept],
        )

    def heat(self, emissions: Sequence[Emission]) -> FloatArray:
        """Right-hand sides (n, k) of `HeatFlow.solve`: as much heat as cannot overflow."""
        return self._heat_of(emissions, [emission.share for emission in emissions])

    def unit(self, emission: Emission) -> float:
        """The heat that a share of 1 stands for.

        Rows of L sum to zero, so the maximum principle bounds the heat by the largest initial heat over mass.
        """
        bound, largest = self._mass[emission.vertex], emission.share
        if len(largest) > 1:
            _, which = np.unique(emission.vertex, return_inverse=True)
            largest = np.asarray(np.bincount(which, emission.share), np.float64)[which]
        held = (bound > 0) & (largest > 0)
        smallest = float((bound[held] / largest[held]).min(initial=1.0))
        return _SOURCE_HEAT * min(self._domain.mean_edge_length, 1e10) * smallest

    def guide(self, emission: Emission, X: FloatArray, magnitude: FloatArray) -> None:
        """Near points and curves, replace the field X (d m,) of length `magnitude` (m,) by the exact gradient."""
        triangulation = self._domain.triangulation
        if triangulation is None or not emission.guides.any():
            return
        near, m = emission.near, len(magnitude)
        columns = self._domain.G[:, near.vertex]
        known = np.zeros(self._domain.n, np.int8)
        known[near.vertex] = 1
        known[near.vertex[emission.guides]] = 2
        around = np.unique(columns.indices % m)
        corners = known[triangulation.F[around]]
        faces = around[(corners > 0).all(axis=1) & (corners == 2).any(axis=1)]
        gradient = (columns @ near.value).reshape(-1, m)[:, faces]
        length = np.linalg.norm(gradient, axis=0)
        X.reshape(-1, m)[:, faces] = gradient / np.where(length > 0, length, 1)
        magnitude[faces] = length

    def settle(self, emission: Emission, phi: FloatArray, u: FloatArray) -> FloatArray:
        """Distance (n,) from the integrated phi: begun at the right level, exact where it is known."""
        domain, components = self._domain, self._domain.components
        anchors = emission.anchors
        misfit = phi[anchors.vertex] - anchors.value
        n_anchors = np.bincount(components[anchors.vertex], minlength=domain.n_components)
        if (n_anchors > 1).any():
            level = self._level(emission, misfit, u)
            phi = phi - level
            misfit = misfit - level[anchors.vertex]
        total = np.bincount(components[anchors.vertex], weights=misfit, minlength=len(n_anchors))
        shift = np.where(n_anchors > 0, total / np.maximum(n_anchors, 1), -np.inf)
        lowest = np.full(len(n_anchors), np.inf)
        np.minimum.at(lowest, components[emission.near.vertex], emission.near.value)
        start = domain.on_vertices(lowest)
        distance = phi - domain.on_vertices(shift)
        np.maximum(distance, start, out=distance)
        take_shorter(distance, emission.far, _HEAT_ERROR, start)
        if self._plain and emission.sources.on_vertices_alone:
            distance[emission.near.vertex] = emission.near.value
            return np.asarray(distance)
        return self._continued(emission.near, distance)

    def labels(self, emission: Emission) -> IntArray:
        """The source (n,) from which each vertex gets most of its heat, -1 where it gets none; a solve for each."""
        labels = np.full(self._domain.n, -1)
        most = np.zeros(self._domain.n)
        present = np.unique(emission.label)
        for block in np.split(present, range(_BLOCK, len(present), _BLOCK)):
            shares = [emission.share * (emission.label == label) for label in block]
            parts = self._heat_flow.solve(self._heat_of([emission] * len(block), shares))
            warmest = parts.argmax(axis=1)
            heat = np.take_along_axis(parts, warmest[:, None], axis=1)[:, 0]
            labels = np.where(heat > most, block[warmest], labels)
            np.maximum(most, heat, out=most)
        labels[emission.near.vertex] = emission.near.label
        return labels

    def _rim(self, sources: SourceSet) -> BoolArray:
        """The source vertices that have a neighbour which is none.

        Heat starts from these alone: inside a region of sources it would be level, and its gradient rounding noise
        that is then normalized to length 1 and integrated.
        """
        vertices = sources.vertices
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

    def _near_vertices(self, sources: SourceSet, rim: BoolArray) -> Seeds:
        """Source vertices, and with those at the rim their neighbours at the lengths of edges."""
        itself = Seeds(sources.vertices, sources.vertex_offset, sources.vertex_label)
        if self._plain or (self._unfolds and sources.on_vertices_alone):
            return itself
        vertices, offset, label = sources.vertices[rim], sources.vertex_offset[rim], sources.vertex_label[rim]
        found = [itself]
        for field in self._fields:
            which, ends, lengths = field.spokes(vertices)
            found.append(Seeds(ends, offset[which] + lengths, label[which]))
        return _joined(*found)

    def _straight_lines(self, sources: SourceSet, rim: BoolArray) -> tuple[Seeds, Seeds]:
        """Distance of the vertices that see a source in a straight line, as `NearField.seeds` has it.

        Only where there are points or curves; for vertices alone, the ring of edges is enough, but beside an edge of
        more than two faces it is not: the tufted cover leads over it from a face to two of the others alone.
        """
        if self._on_faces is None:
            return _NONE, _NONE
        if sources.on_vertices_alone:
            is_covered = self._domain.surface is not None and not (self._plain or self._unfolds)
            if not (is_covered and self._on_faces.meets_shared_edge(sources.vertices[rim])):
                return _NONE, _NONE
        vertices = Seeds(sources.vertices[rim], sources.vertex_offset[rim], sources.vertex_label[rim])
        points = sources.points.joined(sources.segments.ends())
        return self._on_faces.seeds(points, sources.segments, _RADIUS * self._domain.mean_edge_length, vertices)

    def _heat(self, sources: SourceSet, rim: BoolArray) -> tuple[IntArray, FloatArray, IntArray, FloatArray]:
        """Vertices, shares, labels and offsets of the initial heat: the hat functions at points, and along curves."""
        vertices = sources.vertices[rim]
        of_vertices = vertices, np.ones(len(vertices)), sources.vertex_label[rim], sources.vertex_offset[rim]
        if sources.on_vertices_alone:
            return of_vertices
        parts = [of_vertices]
        triangulation = self._domain.triangulation
        if self._on_faces is not None and triangulation is not None:
            h = self._domain.mean_edge_length
            samples, lengths = self._on_faces.samples(sources.segments, h * _SPACING)
            amount = np.concatenate([np.ones(len(sources.points.faces)), lengths / (h * _EDGES_PER_POINT)])
            points = sources.points.joined(samples)
            faces, barycentric = triangulation.locate(points.faces, points.barycentric)
            parts.append(
                (
                    triangulation.F[faces].ravel(),
                    (amount[:, None] * barycentric).ravel(),
                    np.repeat(points.label, 3),
                    np.repeat(points.offset, 3),
                )
            )
        vertex, share, label, offset = (np.concatenate(column) for column in zip(*parts, strict=True))
        used = share > 0
        return vertex[used], share[used], label[used], offset[used]

    def _delay(self, vertex: IntArray, offset: FloatArray) -> FloatArray:
        """Heat falls by exp(-d / sqrt(t)) over a distance d, so that is what a later source has less of."""
        if offset.min(initial=np.inf) == offset.max(initial=0.0):
            return np.zeros(len(offset))
        components = self._domain.components
        earliest = np.full(self._domain.n_components, np.inf)
        np.minimum.at(earliest, components[vertex], offset)
        return np.asarray((offset - earliest[components[vertex]]) / np.sqrt(self._heat_flow.t))

    def _heat_of(self, emissions: Sequence[Emission], shares: Sequence[FloatArray]) -> FloatArray:
        heat = np.zeros((self._domain.n, len(emissions)))
        for column, emission, share in zip(heat.T, emissions, shares, strict=True):
            # Together, since exp(-delay) alone would underflow.
            with np.errstate(under="ignore"):
                weights = share * np.exp(np.log(self.unit(emission)) - emission.delay)
            np.add.at(column, emission.vertex, weights)
        return heat

    def _level(self, emission: Emission, misfit: FloatArray, u: FloatArray) -> FloatArray:
        """The value that phi has at the source from which a vertex got its heat, less that source's offset.

        It is a little different at each source: the error of a path between them. Shifting by the mean would move
        the whole cell of each source by its difference. Here every vertex is shifted by the values of the sources
        weighted by its heat from each, one more solve; the weights change from 0 to 1 within sqrt(t) of the border
        between two cells.
        """
        n_labels = emission.sources.n_labels
        count = np.bincount(emission.anchors.label, minlength=n_labels)
        level = np.bincount(emission.anchors.label, misfit, minlength=n_labels) / np.maximum(count, 1)
        low, high = float(level[count > 0].min()), float(level[count > 0].max())
        if low == high:
            return np.full_like(u, low)
        relative = np.where(count > 0, (level - low) / (high - low), 0.0)
        part = self._heat_flow.solve(self._heat_of([emission], [emission.share * relative[emission.label]]))[:, 0]
        warm = u > 0  # always, but for noise under "cotan" and a cold boundary
        return low + (high - low) * np.clip(np.divide(part, u, out=np.zeros_like(u), where=warm), 0.0, 1.0)

    def _continued(self, near: Seeds, distance: FloatArray) -> FloatArray:
        """Set known values; across an edge from one, distance changes by no more than the edge's length."""
        if self._on_solved is not None:
            which, ends, lengths = self._on_solved.spokes(near.vertex)
            value = near.value[which]
            np.maximum.at(distance, ends, value - lengths)
            np.minimum.at(distance, ends, value + lengths)
        distance[near.vertex] = near.value
        return distance


def take_shorter(distance: FloatArray, seeds: Seeds, error: float, start: FloatArray) -> BoolArray:
    """Set known values where they are shorter, or longer by less than the error of `distance`; which were.

    The error is relative to the distance from where it begins, `start` (n,).
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
