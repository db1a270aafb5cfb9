"""Linear elements on triangles, by the lengths of their sides: the gradient in three numbers per face."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic import IntrinsicTriangulation, apex
from heat_igl.typing import FloatArray, IntArray


class EdgeLengths(NamedTuple):
    """Edges, each with the vertices `i`, `j` (k,) at the ends and the `length` (k,).

    Several edges may join the same two vertices, and one may join a vertex to itself.
    """

    i: IntArray
    j: IntArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class TriangleElements:
    """Linear elements on m triangles: all that the operators and the steps take of a triangulation.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        The triangles.
    in_space : callable, optional
        Makes the gradient in space (3 m, n).
    """

    triangulation: IntrinsicTriangulation
    in_space: Callable[[], sp.csc_matrix] | None = None

    def matrix(self) -> sp.csc_matrix:
        """The gradient G (d m, n), made anew: in space, or d = 2 in the plane of each triangle (paper, equation 5).

        Then row f is the component along the edge from corner 0 to corner 1 of triangle f, and row m + f the one
        across it, towards corner 2. Unit 1 / length.
        """
        if self.in_space is not None:
            return self.in_space()
        (per_base, foot, per_height), zero = self.frames(), np.zeros(len(self.corners))
        along = -per_base, per_base, zero
        across = (foot - 1) * per_height, -foot * per_height, per_height
        values = np.stack([np.stack(part, axis=1) for part in (along, across)])
        columns = np.tile(self.corners.astype(np.int32), (2, 1)).ravel()
        starts = np.arange(0, values.size + 1, 3, dtype=np.int32)
        rows = sp.csr_matrix((values.ravel(), columns, starts), shape=(len(starts) - 1, self.triangulation.n))
        if (self.corners[:, [1, 2, 0]] == self.corners).any():
            rows.sum_duplicates()  # an edge from a vertex to itself
        return rows.tocsc()

    @property
    def corners(self) -> IntArray:
        """Vertices (m, 3) whose values the gradient on each face depends on."""
        return self.triangulation.F

    def frames(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The gradient in the plane of each triangle, in three numbers (m,).

        With corner 0 at the origin and corner 1 on the first axis, the gradient of u is ``x = per_base (u_1 - u_0)``,
        ``y = per_height (u_2 - u_0 - foot (u_1 - u_0))``.

        Returns
        -------
        per_base, foot, per_height : (m,) float64
            One over the length of the side from corner 0 to corner 1; the foot of corner 2 on that side, from 0 to 1
            between the ends; one over the height of corner 2.
        """
        lengths = self.triangulation.l
        base = lengths[:, 2]
        x, y = apex(base, lengths[:, 1], lengths[:, 0])
        with np.errstate(divide="ignore"):
            return 1 / base, x / base, 1 / y

    def edge_lengths(self) -> EdgeLengths:
        """The edges of the triangles."""
        triangulation = self.triangulation
        edges = triangulation.edges
        return EdgeLengths(triangulation.tail(edges), triangulation.head(edges), triangulation.l.ravel()[edges])
