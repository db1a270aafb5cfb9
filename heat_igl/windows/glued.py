"""The triangles of a mesh that is asked once, glued along their sides and flipped, without a history of the flips."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import mollify
from heat_igl.kernels.mesh import flipping, gluing
from heat_igl.mesh import DELAUNAY_TOLERANCE, Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["TOO_MANY", "Glued", "glued", "mean_exponent"]

#: Half-edges and vertices that indices of 32 bits tell apart, with room for two bits of the kernels' own.
TOO_MANY = 2**29
# A last bound on the work; meshes measured so far take less than one flip per face.
_MOST_FLIPS_PER_FACE = 100
# Areas are made of fourth powers of lengths, which are normal numbers up to here, far below 1 too.
_LARGEST_LENGTH = 1e30


class Glued(NamedTuple):
    """The triangles of a mesh by their sides, as `heat_igl.kernels.mesh.gluing.glue` returns them.

    Attributes
    ----------
    vertex, twin, ring, aligned, length
        As for `HalfEdges`; lengths in units of ``2 ** exponent``.
    exponent : int
        0, but for very large or small meshes the power of two just above the mean extent.
    n_across : int
        Half-edges that are not aligned.
    """

    vertex: AnyArray
    twin: AnyArray
    ring: AnyArray
    aligned: AnyArray
    length: FloatArray
    exponent: int
    n_across: int

    def flip(self, F: IntArray, margin: float | None = None) -> None:
        """Mollify and flip in place to the intrinsic Delaunay triangulation; F (m, 3) are the faces before."""
        sides = self.length.reshape(-1, 3)
        added = mollify(sides, F, margin)
        if added.any():
            sides += added
        flipping.flip(
            self.vertex, self.twin, self.ring, self.length, -DELAUNAY_TOLERANCE, _MOST_FLIPS_PER_FACE * len(F)
        )


def glued(mesh: Mesh) -> Glued:
    """The triangles of a mesh by their sides, before any flip.

    Raises
    ------
    MeshError
        If there are too many triangles for 32-bit indices.
    """
    if 3 * mesh.n_faces + mesh.n_vertices >= TOO_MANY:
        raise MeshError(f"{mesh.n_faces} faces are too many for 32-bit indices: split the mesh")
    exponent = 0
    vertex, twin, ring, aligned, length, n_across = gluing.glue(mesh.F, mesh.V, 1.0)
    if not 1 / _LARGEST_LENGTH < length.max() < _LARGEST_LENGTH:
        # Once more in a unit in which no square leaves the range of doubles.
        exponent = mean_exponent(np.array([np.ptp(x[mesh.F[:, :2]]) for x in mesh.V.T]))
        vertex, twin, ring, aligned, length, n_across = gluing.glue(mesh.F, mesh.V, np.ldexp(1.0, -exponent))
    return Glued(vertex, twin, ring, aligned, length, exponent, n_across)


def mean_exponent(lengths: FloatArray) -> int:
    """The power of two just above the mean."""
    return int(np.frexp(lengths.mean())[1])
