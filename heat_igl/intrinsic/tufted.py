"""The tufted cover: a manifold double cover of a non-manifold mesh (Sharp and Crane 2020).

An edge of more than two faces cannot be flipped. It may keep a negative weight, and then heat may be negative. The
cover has two copies of each face, a front and a back, on the same vertices. Around an edge, the copy that looks towards
the next face is glued to the copy of that face which looks back; at a boundary edge, the front is glued to the back.
The result is a closed oriented surface of triangles, and all edges can be flipped.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.intrinsic.gluing import intrinsic_triangulation
from heat_igl.intrinsic.history import BACK_CORNERS, Covered
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.mesh import Mesh, connectivity
from heat_igl.typing import BoolArray, FloatArray, IntArray


def has_nonmanifold_edges(mesh: Mesh) -> bool:
    """Whether a triangle mesh has an edge of more than two faces."""
    return bool((mesh.facets.n_faces > 2).any())


def tufted_cover(mesh: Mesh) -> IntrinsicTriangulation:
    """The tufted cover of `mesh`: two copies of each triangle, glued to a closed oriented surface on the same vertices.

    Parameters
    ----------
    mesh : Mesh
        Any triangle mesh of m faces.

    Returns
    -------
    IntrinsicTriangulation
        2 m triangles, with twice the area and no boundary: row f is the front of face f, row m + f the back.
        Degenerate triangles are mollified. Not yet Delaunay, see `intrinsic_delaunay`.

    Notes
    -----
    The cover of a closed, manifold, oriented mesh is two copies that meet only in the vertices; one half of their
    Laplacian is the Laplacian of the mesh. Around an edge, faces are joined in the order of their angles, like the
    boundary of a thin solid around the faces; Sharp and Crane show that any order gives a manifold.
    """
    triangulation = intrinsic_triangulation(mesh)
    edge = mesh.facets.of_face.ravel()
    along = triangulation.tail(np.arange(mesh.F.size)) == mesh.facets.vertices[edge, 0]
    return _cover(triangulation, np.lexsort((_angles(mesh), edge)), mesh.facets.n_faces, along)


def closed_cover(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """The tufted cover of triangles that meet two by two at their edges, without positions; see `tufted_cover`.

    Inner edges are glued front to front and back to back, or front to back if the two faces are not aligned, and
    boundary edges front to back.
    """
    # One half-edge of each edge is first; the other runs against it, unless the two faces are not aligned.
    twin, half_edge = triangulation.twin, np.arange(triangulation.F.size)
    first = np.where(twin < 0, half_edge, np.minimum(half_edge, twin))
    order = np.lexsort((half_edge, first))
    count = np.bincount(first, minlength=len(first))
    return _cover(triangulation, order, count[count > 0], (first == half_edge) | ~triangulation.aligned)


def _cover(
    triangulation: IntrinsicTriangulation, order: IntArray, counts: IntArray, along: BoolArray
) -> IntrinsicTriangulation:
    """Two copies of each triangle, each glued to the next around its edge.

    `order` (3 m,) are the half-edges, edge after edge and counterclockwise around each; `counts` (k,) how many each
    edge has; `along` (3 m,) marks those that run along the edge, where the others run against it.
    """
    F, m = triangulation.F, len(triangulation.F)
    front = np.arange(F.size)
    back = 3 * (m + front // 3) + BACK_CORNERS[front % 3]
    # Seen along the edge: the copy of the face that faces counterclockwise.
    counterclockwise, clockwise = np.where(along, front, back), np.where(along, back, front)
    a, b = counterclockwise[order], clockwise[connectivity.next_in_run(order, counts)]
    twin = np.empty(2 * F.size, np.int64)
    twin[a], twin[b] = b, a
    return replace(
        triangulation,
        F=np.concatenate([F, F[:, BACK_CORNERS]]),
        l=np.concatenate([triangulation.l, triangulation.l[:, BACK_CORNERS]]),
        twin=twin,
        aligned=np.ones(2 * F.size, bool),
        history=(*triangulation.history, Covered(m)),
    )


def _angles(mesh: Mesh) -> FloatArray:
    """Angle (3 m,) of the face of each half-edge around the edge, from a direction that the faces of the edge share."""
    ends = mesh.V[mesh.facets.vertices]
    edge = ends[:, 1] - ends[:, 0]
    edge /= np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), np.finfo(float).tiny)
    least = np.eye(3)[np.argmin(np.abs(edge), axis=1)]
    x = np.cross(edge, least)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), np.finfo(float).tiny)
    y = np.cross(edge, x)
    of_half_edge = mesh.facets.of_face.ravel()
    opposite = mesh.V[mesh.F].reshape(-1, 3) - ends[of_half_edge, 0]
    along_x, along_y = (np.einsum("hk,hk->h", opposite, axis[of_half_edge]) for axis in (x, y))
    return np.asarray(np.arctan2(along_y, along_x))
