"""The lengths of the sides of a mesh's faces as functions of the positions of the vertices."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from heat_igl.kernels.mesh import side_derivatives as kernels
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray

__all__ = ["SideLengths", "SidesOfMesh"]


class SidesOfMesh(Protocol):
    """The lengths of the sides of a mesh's faces as functions of the positions of the vertices."""

    @property
    def mesh(self) -> Mesh:
        """The mesh."""

    def by_positions(self, by_side: FloatArray) -> FloatArray:
        """The derivative (n, 3) by the positions, from that by the lengths (m, 3)."""

    def push_positions(self, dV: FloatArray) -> FloatArray:
        """How the lengths (m, 3) change when the vertices move by dV (n, 3)."""


class SideLengths:
    """Distances of the ends of the sides in space.

    Parameters
    ----------
    mesh : Mesh
        m triangles on n vertices.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh

    def by_positions(self, by_side: FloatArray) -> FloatArray:
        """The derivative (n, 3) by the positions, from that by the lengths (m, 3)."""
        by_position = np.zeros((self.mesh.n_vertices, 3))
        kernels.pull_to_positions(self.mesh.F, self.mesh.V, by_side, by_position)
        return by_position

    def push_positions(self, dV: FloatArray) -> FloatArray:
        """How the lengths (m, 3) change when the vertices move by dV (n, 3); not at all for sides without length."""
        by_side = np.empty(self.mesh.F.shape)
        kernels.push_to_sides(self.mesh.F, self.mesh.V, np.ascontiguousarray(dV), by_side)
        return by_side
