"""The radial field around a vertex: vectors in the triangles around it whose heat flow points away from it."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import carried_angles, polar_angles, transport_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.operators import Surface
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["OutwardField"]


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

    def ring(self, vertex: int) -> tuple[IntArray, FloatArray]:
        """The neighbours (k,) of a vertex, and the directions (k,) at the vertex of the edges to them.

        Those only that one edge joins with the vertex.
        """
        tri = self._triangulation
        corner, _ = tri.corners_at(np.array([vertex]))
        out = previous_half_edge(corner)
        last = next_half_edge(corner)
        last = last[tri.twin[last] < 0]
        ends = np.append(tri.head(out), tri.tail(last))
        directions = np.append(self._angles.leaving[out], np.full(len(last), np.pi))
        found, first, counts = np.unique(ends, return_index=True, return_counts=True)
        once = (counts == 1) & (found != vertex)
        return found[once], directions[first[once]]

    def to_polar(self, vertex: int, directions: AnyArray) -> AnyArray:
        """Unit numbers (n,) with the polar angles of directions at a vertex, given as transport has them; 0 stays."""
        if not self._angles.on_boundary[vertex]:
            return directions
        angle = self._angles.to_polar(np.full(len(directions), vertex), np.angle(directions))
        return np.asarray(np.abs(directions) * np.exp(1j * angle))

    def dipole(self, vertex: int) -> tuple[IntArray, AnyArray]:
        """Vectors whose heat flow points away from a vertex, on the corners of the triangles around it.

        They sum to 0, and the sum of their products with the positions in the tangent plane of the vertex is a multiple
        of the identity: vectors b_j in positions x_j give the sum of b_j G(x_j) = grad G for a linear function G. Taken
        for G the heat that a vertex far away sends, which rises in the direction in which the shortest geodesic to that
        vertex departs. The b_j are the gradients of the hat functions times the areas of the triangles.

        Returns
        -------
        vertices : (3 k,) int64
            The corners of k triangles: a vertex comes once for each.
        values : (3 k,) complex128
            In the frames of these vertices.
        """
        tri, angles = self._triangulation, self._angles
        corner, _ = tri.corners_at(np.array([vertex]))
        out, back = previous_half_edge(corner), next_half_edge(corner)
        leaving, scale = angles.rigid(tri.tail(np.arange(tri.F.size)))
        wide = scale[vertex] * angles.corners.ravel()[corner]
        x_one = tri.l.ravel()[out] * np.exp(1j * leaving[out])
        x_other = tri.l.ravel()[back] * np.exp(1j * (leaving[out] + wide))
        # Twice the area times the gradient is the side opposite, turned by a right angle into the triangle; as the
        # angle of a corner may be scaled to more than pi, the sign is that of the area.
        sign = np.sign(np.sin(wide))
        at_one, at_other = -1j * sign * x_other, 1j * sign * x_one
        vertices = np.concatenate([tri.head(out), tri.tail(back), np.full(len(corner), vertex)])
        values = [at_one * np.exp(1j * self._turn[out]), at_other * np.exp(-1j * self._turn[back]), -at_one - at_other]
        return vertices, np.concatenate(values)
