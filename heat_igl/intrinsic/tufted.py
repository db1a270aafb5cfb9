"""The tufted cover: a manifold in place of a mesh that is none (Sharp and Crane 2020).

Where more than two faces share an edge, no edge flip is defined: the edge stays, and with it the negative weights that
spoil the heat. The cover has two copies of each face, a front and a back, on the same vertices, glued like the outer
skin of the mesh inflated a little: around an edge, the side of each face that looks at the next face is glued to the
side of the next that looks back, and at a boundary edge the front is glued to the back. That is a closed oriented
surface of triangles, every edge of which can be flipped.
"""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, mollify
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray

__all__ = ["has_nonmanifold_edges", "tufted_cover"]

# The back of a face runs around it the other way, so that its corners 1 and 2 change places.
_TURNED = np.array([0, 2, 1])


def has_nonmanifold_edges(mesh: Mesh) -> bool:
    """Whether more than two faces of a triangle mesh meet at some edge."""
    return bool((mesh.facets.n_faces > 2).any())


def tufted_cover(mesh: Mesh) -> IntrinsicTriangulation:
    """Two copies of each triangle of `mesh`, glued to a closed oriented surface on the same vertices.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh of m faces.

    Returns
    -------
    IntrinsicTriangulation
        2 m triangles: row f is the front of face f, row m + f its back. It has no boundary and twice the area.
        Degenerate triangles are mollified. Not yet Delaunay: see `intrinsic_delaunay`.

    Notes
    -----
    Of a closed mesh that is manifold and oriented the cover is two copies that meet in the vertices alone; one half of
    their Laplacian is the Laplacian of the mesh. Faces are taken in the order of the angle at which they stand around
    the edge, which is how the skin of a solid of the same shape would join them; Sharp and Crane show that any order
    gives a manifold.
    """
    F, m = mesh.F, mesh.n_faces
    lengths = igl.edge_lengths(mesh.V, F)
    front = np.arange(F.size)
    face, corner = np.divmod(front, 3)
    back = 3 * (m + face) + _TURNED[corner]
    edge = mesh.facets.of_face.ravel()
    along = F[face, (corner + 1) % 3] == mesh.facets.vertices[edge, 0]
    # Seen along the edge from its lower to its higher vertex, the side of a face that looks counterclockwise.
    counterclockwise, clockwise = np.where(along, front, back), np.where(along, back, front)

    order = np.lexsort((_angles(mesh), edge))
    following = _next_in_group(order, mesh.facets.n_faces)
    a, b = counterclockwise[order], clockwise[following]
    twin = np.empty(2 * F.size, np.int64)
    twin[a], twin[b] = b, a
    lengthening = mollify(lengths)
    return IntrinsicTriangulation(
        F=np.concatenate([F, F[:, _TURNED]]),
        l=np.concatenate([lengths, lengths[:, _TURNED]]) + lengthening,
        twin=twin,
        aligned=np.ones(2 * F.size, bool),
        n=mesh.n_vertices,
        lengthening=lengthening,
    )


def _angles(mesh: Mesh) -> FloatArray:
    """The angle (3 m,) at which the face of each half-edge stands around its edge, from a direction per edge."""
    ends = mesh.V[mesh.facets.vertices]
    edge = ends[:, 1] - ends[:, 0]
    edge /= np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), np.finfo(float).tiny)
    least = np.eye(3)[np.argmin(np.abs(edge), axis=1)]
    x = np.cross(edge, least)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), np.finfo(float).tiny)
    y = np.cross(edge, x)
    of_half_edge = mesh.facets.of_face.ravel()
    apex = mesh.V[mesh.F].reshape(-1, 3) - ends[of_half_edge, 0]
    along_x, along_y = (np.einsum("hk,hk->h", apex, axis[of_half_edge]) for axis in (x, y))
    return np.asarray(np.arctan2(along_y, along_x))


def _next_in_group(order: IntArray, sizes: IntArray) -> IntArray:
    """The element after each of `order`, which lists groups of the given `sizes` one after another, cyclically."""
    following = np.roll(order, -1)
    last = np.cumsum(sizes) - 1
    following[last] = order[last - sizes + 1]
    return following
