"""Linear elements on triangles, by the lengths of their sides: the gradient in three numbers per face."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic import IntrinsicTriangulation, apex, intrinsic_gradient
from heat_igl.typing import FloatArray, IntArray

__all__ = ["EdgeLengths", "TriangleElements"]


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
    make_matrix : callable
        Makes the gradient as a matrix (d m, n).
    """

    triangulation: IntrinsicTriangulation
    make_matrix: Callable[[], sp.csc_matrix]

    @classmethod
    def in_planes(cls, triangulation: IntrinsicTriangulation) -> TriangleElements:
        """Elements whose gradients have two components, in the plane of each triangle (`intrinsic_gradient`)."""
        return cls(triangulation, partial(intrinsic_gradient, triangulation))

    def matrix(self) -> sp.csc_matrix:
        """The gradient G (d m, n), made anew."""
        return self.make_matrix()

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
