"""Distance by unfolding triangles in the order of the heat, from all kinds of sources."""

from __future__ import annotations

from functools import partial

import numpy as np

from heat_igl.mesh import SurfacePoints
from heat_igl.operators import Operators
from heat_igl.sources import NearField, SourcePoints, SourceTerm, take_shorter
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding.refinement import Known, Refine, Refinement

__all__ = ["UnfoldingSolver"]

# Curves are unfolded from as points, at most so many mean edge lengths apart.
_SPACING = 0.125
# Mean error of a sweep: what it falls short of a straight line by less than this is no shorter path.
_SWEEP_ERROR = 0.01


class UnfoldingSolver:
    """`Refinement` of a domain, asked by sets of sources and their heat.

    Parameters
    ----------
    domain : Operators
        Triangles.
    refine : {"sweep", "unfold"}
        Which update.

    Raises
    ------
    ValueError
        If the domain has no triangles.
    MissingExtraError
        If numba is not installed.
    """

    def __init__(self, domain: Operators, refine: Refine) -> None:
        surface = domain.surface
        if surface is None:
            raise ValueError(f"refine={refine!r} unfolds triangles by their edge lengths, and this domain has none")
        if domain.n_given < domain.n:
            raise ValueError(f"refine={refine!r} unfolds the triangles of the mesh: pass operators without refinement")
        self._refinement = Refinement(surface.unfolding)
        self._sweeps = refine == "sweep"
        self._error = _SWEEP_ERROR if self._sweeps else 0.0
        self._faces = None if surface.faces is None else NearField(surface.faces)
        self._domain = domain
        self._given_faces = np.empty((0, 3), np.int64) if surface.given_faces is None else surface.given_faces
        self._spacing = _SPACING * domain.mean_edge_length

    def distances(self, terms: list[SourceTerm], u: FloatArray) -> FloatArray:
        """Distances (k, n) for heat (n, k).

        Where the heat has underflowed the order is arbitrary, which the unfolding makes up for.
        """
        return np.stack([self._distance(term, one) for term, one in zip(terms, u.T, strict=True)])

    def labelled(self, term: SourceTerm, u: FloatArray) -> tuple[FloatArray, IntArray]:
        """Distance (n,) for heat (n,), and the source (n,) that it is measured from, -1 where none is reached."""
        labels = np.empty(len(u), np.int64)
        return self._distance(term, u, labels), labels

    def _distance(self, term: SourceTerm, u: FloatArray, labels: IntArray | None = None) -> FloatArray:
        sources, points, components = term.sources, self._points(term), self._domain.components
        places = SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None
        # Tolerances are relative to the distance: what all have in common is added afterwards.
        earliest = np.full(self._domain.n_components, np.inf)
        component_of_point = components[self._given_faces[points.faces, 0]] if places else np.empty(0, np.int64)
        component = np.concatenate([components[sources.vertices], component_of_point])
        offset = np.concatenate([sources.vertex_offset, points.offset])
        np.minimum.at(earliest, component, offset)
        late = offset - earliest[component]
        k = len(sources.vertices)
        unfolded = self._refinement.unfold
        if self._sweeps:
            unfolded = partial(self._refinement.sweep, known=self._known(term, points, earliest))
        distance = unfolded(
            -u,
            sources.vertices,
            offsets=late[:k] if late.any() else None,
            points=places,
            point_offsets=late[k:] if late.any() and places else None,
            labels=labels,
        )
        start = self._domain.expand_to_vertices(earliest)
        if offset.any():
            distance += start
        if labels is not None:
            labels[:] = np.concatenate([sources.vertex_label, points.label, [-1]])[labels]
        for seeds in (term.near_seen, term.far):
            if not len(seeds.vertex):
                continue
            taken = take_shorter(distance, seeds, self._error, start)
            if labels is not None:
                labels[seeds.vertex[taken]] = seeds.label[taken]
        return distance

    def _known(self, term: SourceTerm, points: SourcePoints, earliest: FloatArray) -> Known | None:
        """What straight lines from points reach."""
        near = term.near_seen
        if not len(near.vertex):
            return None
        # A curve has many sources of one label, and which of them a line comes from is not known.
        label = np.concatenate([term.sources.vertex_label, points.label])
        which, first, count = np.unique(label, return_index=True, return_counts=True)
        at = np.searchsorted(which, near.label)
        near, source = near.at(count[at] == 1), first[at][count[at] == 1]
        return Known(near.vertex, near.value - earliest[self._domain.components[near.vertex]], source)

    def _points(self, term: SourceTerm) -> SourcePoints:
        points, segments = term.sources.points, term.sources.segments
        if self._faces is None or not len(segments.faces):
            return points
        return points.joined(self._faces.samples(segments, self._spacing)[0]).joined(segments.ends())
