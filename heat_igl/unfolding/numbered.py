"""Walks from vertices on the tables of a triangulation: the part of `Refinement` that a single query needs, too."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic.fans import Tables
from heat_igl.kernels.ordering import ascending
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.unfolding.walks import NO_BARRIER, NO_POINTS, NOT_ASKED, Begins, Points, Rules, unfold, unknown

__all__ = ["TOLERANCE", "NumberedTriangles", "WalkStarts"]

# Relative gain below which a path is not straightened further. The loss adds up to 0.0003 to 0.003 % on average; 0
# loses nothing and takes up to twice the time.
TOLERANCE = 4e-5
# The search starts at vertices with distances longer than a neighbour promised by this many tolerances: by more than
# the paths that the promise rests on may have been cut short.
_SHORTFALL = 15.0
# Passes over vertices whose neighbours turned out to be nearer than the order said. They are few, and ever fewer.
_MAX_PASSES = 50
# Steps that the search from one vertex may take; a walk takes 20 to 50.
_MAX_SEARCH = 500


class WalkStarts(NamedTuple):
    """Rows of the walks that are known and these, (k,) each, the nearest last; then by label where it begins."""

    row: AnyArray
    walk: AnyArray
    offset: FloatArray
    n_points: int = 0
    points: Points = NO_POINTS

    @classmethod
    def ascending(
        cls, row: AnyArray, walk: AnyArray, offset: FloatArray, n_points: int = 0, points: Points = NO_POINTS
    ) -> WalkStarts:
        """Far ones first, so that of several for one vertex the nearest is written last."""
        order = np.argsort(-walk["distance"], kind="stable")
        return cls(row[order], walk[order], offset, n_points, points)


class NumberedTriangles:
    """Oriented triangles, numbered in the order in which a front meets them, and the tables that walks read.

    Parameters
    ----------
    tables : Tables
        What the kernels read.
    number : (s n,) int32
        Rows of the tables of the n vertices, on each of s sheets.
    n_sheets : int
        1, or 2 for the double cover of a surface that cannot be oriented.

    Attributes
    ----------
    n : int
        Number of vertices of the surface.
    """

    def __init__(self, tables: Tables, number: AnyArray, n_sheets: int = 1) -> None:
        self.tables = self._swept = tables
        self.number = number
        self.n, self._n_sheets = len(number) // n_sheets, n_sheets

    @property
    def faces(self) -> AnyArray:
        """Vertices (m, 3) of the triangles, by the numbers of the tables."""
        return np.ascontiguousarray(self.tables.step["vertex"].reshape(-1, 3))

    @property
    def _twin(self) -> AnyArray:
        """The half-edge (m, 3) glued to each; -1 on the boundary, -2 at edges of more than two triangles."""
        # The step through a half-edge knows the twin of the next one as the way to the right.
        return self.tables.step["to_right"].reshape(-1, 3)[:, [2, 0, 1]]

    @cached_property
    def has_holes(self) -> bool:
        """Whether some component is neither a disk nor a sphere, so that a closed curve may enclose no surface."""
        return _has_holes(self.faces, self._twin, len(self.number))

    @cached_property
    def flatness(self) -> float:
        """The share of vertices without curvature, those on the boundary included."""
        return float(self.tables.is_flat.mean())

    @cached_property
    def curvature(self) -> float:
        """Mean over the fans of vertices of how far their angles are from a plane's, in radians.

        The sum inside the surface is compared with two pi; on the boundary, a notch with more than pi counts.
        """
        total = self.tables.total
        excess = np.abs(2 * np.pi - total)
        is_open = total <= 0
        excess[is_open] = np.maximum(-total[is_open] - np.pi, 0.0)
        return float(excess.mean())

    def starts_at(self, sources: IntArray, offsets: FloatArray | None = None) -> WalkStarts:
        """Initial values of the kernels for sources that are vertices (k,), on all sheets."""
        row = self.number[np.concatenate([sources + self.n * sheet for sheet in range(self._n_sheets)])]
        begin = np.zeros(len(sources)) if offsets is None else np.asarray(offsets, np.float64)
        walk = unknown(len(row))
        walk["label"], walk["root"] = np.tile(np.arange(len(sources)), self._n_sheets), row
        walk["distance"] = walk["offset"] = begin[walk["label"]]
        return WalkStarts.ascending(row, walk, begin)

    def walks(
        self,
        order: AnyArray,
        starts: WalkStarts,
        tolerance: float = TOLERANCE,
        *,
        roughness: float = 0.0,
        barrier: AnyArray = NO_BARRIER,
        begins: Begins = NOT_ASKED,
    ) -> AnyArray:
        """What is known of the path of each row after `Refinement.unfold`, of the rows in `order`.

        `roughness` is one of the `Rules`; `barrier` and `begins` are arguments of `heat_igl.unfolding.walks.unfold`.
        """
        # The walks are large: what is needed for a moment comes before. Below 1e-5, forecasts are wrong by as much
        # because of the curvature on the way.
        shortfall = max(_SHORTFALL * tolerance, 1e-5)
        rules = Rules(tolerance, shortfall, _MAX_SEARCH, _MAX_PASSES, self.has_holes, roughness)
        walk = unknown(len(self.number) + starts.n_points)
        walk[starts.row] = starts.walk
        unfold(order, self.tables, walk, starts.points, rules, barrier, begins)
        return walk

    def order(self, key: FloatArray) -> AnyArray:
        """Vertices of all sheets in ascending order, by the numbers of the tables."""
        if np.shape(key) != (self.n,):
            raise ValueError(f"key must have a number for each of {self.n} vertices, but its shape is {np.shape(key)}")
        on_sheets = np.tile(key, self._n_sheets) if self._n_sheets > 1 else np.ascontiguousarray(key)
        return np.asarray(self.number[ascending(on_sheets)])


def _has_holes(F: AnyArray, twin: AnyArray, n: int) -> bool:
    """Whether some component of m faces in breadth-first order is neither a disk nor a sphere."""
    m = len(F)
    is_first, side = np.ones(m, bool), np.arange(0, 3 * m, 3, dtype=np.int32)
    n_shared = np.zeros(m, np.int8)
    for beyond in twin.T:
        # In breadth-first order a face without an earlier neighbour begins a component.
        is_first &= (beyond < 0) | (beyond >= side)
        n_shared += beyond >= 0
    start = np.flatnonzero(is_first)
    of_face = np.cumsum(is_first, dtype=np.int32) - np.int32(1)
    of_vertex = np.full(n, -1, np.int32)
    of_vertex[F] = of_face[:, None]
    faces = np.diff(start, append=m)
    # Where more than two faces meet, they are cut apart: an edge is shared by two faces, or belongs to one.
    edges = 3 * faces - np.add.reduceat(n_shared, start, dtype=np.int64) / 2
    vertices = np.bincount(of_vertex[of_vertex >= 0], minlength=len(start))
    return bool((vertices - edges + faces < 1).any())
