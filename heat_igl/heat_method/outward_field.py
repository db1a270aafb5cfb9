"""The unit vectors that point away from a vertex, integrated over the triangles around it."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import Adjacency, carried_angles, polar_angles, transport_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.operators import Surface
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["OutwardField"]

# Points of Gauss's rule over the angle of a corner.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(16)


class OutwardField:
    """Radial fields around the vertices of an oriented manifold of triangles.

    Parameters
    ----------
    surface : Surface
        Triangles, and the faces that they were flipped from.

    Raises
    ------
    ValueError
        If the faces are not known.
    """

    def __init__(self, surface: Surface) -> None:
        if surface.faces is None:
            raise ValueError("a radial field needs the faces of the mesh, which this domain does not have")
        self._triangulation = surface.triangulation
        self._angles = carried_angles(polar_angles(surface.faces), surface.triangulation)
        self._turn = transport_angles(self._triangulation, self._angles)
        self._adjacency = Adjacency(self._triangulation)

    def ring(self, vertex: int) -> tuple[IntArray, FloatArray]:
        """The neighbours (k,) of a vertex, and the directions (k,) at the vertex of the edges to them.

        Those only that one edge joins with the vertex.
        """
        tri = self._triangulation
        corner, _ = self._adjacency.corners_at(np.array([vertex]))
        out = previous_half_edge(corner)
        last = next_half_edge(corner)
        last = last[tri.twin[last] < 0]
        ends = np.append(tri.head(out), tri.tail(last))
        directions = np.append(self._angles.leaving[out], np.full(len(last), np.pi))
        found, first, counts = np.unique(ends, return_index=True, return_counts=True)
        once = (counts == 1) & (found != vertex)
        return found[once], directions[first[once]]

    def integrals(self, vertex: int) -> tuple[IntArray, AnyArray]:
        """The integrals of the radial unit field times the hat functions of the corners of all triangles at a vertex.

        In polar coordinates around the vertex, a triangle of angle A is r < R(a), and the hat function of an outer
        corner is r g(a). Its integral is that of g(a) R(a)^3 / 3 exp(i a) over the angle, and for the vertex itself
        that of R(a)^2 / 6 exp(i a).

        Returns
        -------
        vertices : (3 k,) int64
            The corners of k triangles: a vertex comes once for each.
        values : (3 k,) complex128
            In the frames of these vertices.
        """
        tri, angles = self._triangulation, self._angles
        corner, _ = self._adjacency.corners_at(np.array([vertex]))
        out, back = previous_half_edge(corner), next_half_edge(corner)
        one, other = tri.l.ravel()[out], tri.l.ravel()[back]
        whole = angles.corners.ravel()[corner]
        a = whole[:, None] * (1 + _POINTS) / 2
        weights = whole[:, None] * _WEIGHTS / 2
        # Hat functions of the outer corners per length along the direction a: sin over the height of the corner.
        with np.errstate(divide="ignore", invalid="ignore"):
            g_one = np.sin(whole[:, None] - a) / (one * np.sin(whole))[:, None]
            g_other = np.sin(a) / (other * np.sin(whole))[:, None]
            radius = 1 / (g_one + g_other)
            direction = np.exp(1j * a)
            parts = [g_one * radius**3 / 3, g_other * radius**3 / 3, radius**2 / 6]
            at_one, at_other, at_vertex = (np.einsum("kp,kp,kp->k", weights, part, direction) for part in parts)
        start, scale = angles.leaving[out], angles.scale[vertex]
        at_one = at_one * np.exp(1j * (start + self._turn[out]))
        at_other = at_other * np.exp(1j * (start + scale * whole - self._turn[back] - whole))
        at_vertex = at_vertex * np.exp(1j * start)
        values = np.concatenate([at_one, at_other, at_vertex])
        vertices = np.concatenate([tri.head(out), tri.tail(back), np.full(len(corner), vertex)])
        good = np.isfinite(values)
        return vertices[good], values[good]
