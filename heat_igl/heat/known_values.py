"""The derivative of the distances known beside the sources: lengths of edges, and of exact paths."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from heat_igl.heat.assembly import SourceAssembler
from heat_igl.heat.source_terms import SourceTerm
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.operators import Surface
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows import PathLengths, SideChange

__all__ = ["GivenSlopes", "KnownValues", "Spokes", "spokes"]

# A value is the length of an edge, or of another shortest line, if it differs by less than this share of it.
_SAME = 1e-12


class Spokes(NamedTuple):
    """Sides (k,) at some vertices: the position of the vertex among these, the other end, the length."""

    side: IntArray
    which: IntArray
    end: IntArray
    length: FloatArray


def spokes(triangulation: IntrinsicTriangulation, vertices: IntArray) -> Spokes:
    """All sides with one end among some vertices, an edge once for each of its sides and such ends."""
    place = np.full(triangulation.n, -1)
    place[vertices] = np.arange(len(vertices))
    of_corner = place[triangulation.F.ravel()]
    corner = np.flatnonzero(of_corner >= 0)
    following, preceding = next_half_edge(corner), previous_half_edge(corner)
    # The side opposite the next corner joins this one and the previous.
    side, across = np.concatenate([following, preceding]), np.concatenate([preceding, following])
    which = np.tile(of_corner[corner], 2)
    return Spokes(side, which, triangulation.F.ravel()[across], triangulation.l.ravel()[side])


class GivenSlopes(NamedTuple):
    """The derivative of a number by the faces before any flip, or None where they do not count.

    Attributes
    ----------
    by_side : (m', 3) float64 or None
        By the sides.
    by_place : (p, 3) float64 or None
        By the coordinates of the source points.
    """

    by_side: FloatArray | None
    by_place: FloatArray | None


class KnownValues:
    """The distances that an answer takes over: at the sources and around them, and at far corners of their faces.

    Parameters
    ----------
    surface : Surface
        The triangles that are solved on, and those before any flip.
    assembler : SourceAssembler
        What made the term.
    term : SourceTerm
        Vertices and points in faces.

    Attributes
    ----------
    vertex, value : (k,) int64, (k,) float64
        Those `near`, and behind them those `far`.
    """

    def __init__(self, surface: Surface, assembler: SourceAssembler, term: SourceTerm) -> None:
        if surface.faces is None:
            raise ValueError("known distances are differentiated on triangles whose faces before any flip are known")
        self._triangulations = surface.triangulation, surface.faces
        self._assembler, self._term = assembler, term
        self.vertex = np.concatenate([term.near.vertex, term.far.vertex])
        self.value = np.concatenate([term.near.value, term.far.value])

    def pull_back(self, by_value: FloatArray, by_side: FloatArray) -> GivenSlopes:
        """The derivative of the sum of the values times `by_value` (k,).

        That by the sides (m, 3) of the triangles that are solved on is added to `by_side`.
        """
        (side, which), (side_of_face, which_of_face) = self._edges
        np.add.at(by_side.reshape(-1), side, by_value[which])
        by_given, by_place = None, None
        if len(which_of_face):
            by_given = np.zeros(self._triangulations[1].l.shape)
            np.add.at(by_given.reshape(-1), side_of_face, by_value[which_of_face])
        if self._lines is not None:
            weight = np.zeros(self._triangulations[1].n)
            np.add.at(weight, self.vertex[self._is_line], by_value[self._is_line])
            change = self._lines.pull_back(weight)
            by_given = change.by_side if by_given is None else by_given + change.by_side
            by_place = change.by_place
        return GivenSlopes(by_given, by_place)

    def push_forward(self, by_side: FloatArray, given: SideChange) -> FloatArray:
        """How the values (k,) change with the sides of the triangles, and with the faces before any flip."""
        change = np.zeros(len(self.value))
        for of_sides, (side, which) in zip((by_side, given.by_side), self._edges, strict=True):
            change[which] = of_sides.ravel()[side]
        if self._lines is not None:
            change[self._is_line] = self._lines.push_forward(given)[self.vertex[self._is_line]]
        return change

    def lengths(self) -> FloatArray:
        """The values (k,) as lengths of the lines that are differentiated."""
        if self._lines is None:
            return self.value
        return np.where(self._is_line, self._lines.lengths()[self.vertex], self.value)

    @cached_property
    def _is_constant(self) -> BoolArray:
        """Source vertices (k,), at which distance begins."""
        sources = self._term.sources
        offset = np.full(self._triangulations[0].n, np.nan)
        offset[sources.vertices] = sources.vertex_offset
        return np.asarray(self.value == offset[self.vertex])

    @cached_property
    def _edges(self) -> list[tuple[IntArray, IntArray]]:
        """In either triangulation, sides from source vertices whose lengths are known values, and which of these."""
        sources = self._term.sources
        n = len(self._term.near.vertex)
        value, place = np.full(self._triangulations[0].n, np.nan), np.full(self._triangulations[0].n, -1)
        value[self.vertex[:n]], place[self.vertex[:n]] = self.value[:n], np.arange(n)
        value[self.vertex[self._is_constant]] = np.nan
        found: BoolArray = np.zeros(len(self.value), bool)
        result = []
        for triangulation in self._triangulations:
            side, which, end, length = spokes(triangulation, sources.vertices)
            is_it = np.abs(sources.vertex_offset[which] + length - value[end]) <= _SAME * length
            at, first = np.unique(place[end[is_it]], return_index=True)
            new = ~found[at]
            result.append((side[is_it][first[new]], at[new]))
            found[at] = True
        return result

    @cached_property
    def _is_line(self) -> BoolArray:
        """Values (k,) that are lengths of lines over several triangles."""
        is_line = ~self._is_constant
        for _, which in self._edges:
            is_line[which] = False
        return is_line

    @cached_property
    def _lines(self) -> PathLengths | None:
        """The exact paths over the faces before any flip; None if no value needs one."""
        if not self._is_line.any():
            return None
        return PathLengths(self._assembler.windows, self._triangulations[1], self._term.sources)
