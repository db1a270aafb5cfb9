"""potpourri3d's functions of triangles: areas, edges, the cotangent Laplacian."""

from __future__ import annotations

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

__all__ = ["cotan_laplacian", "edges", "face_areas", "proper", "vertex_areas"]


def proper(V: ArrayLike, F: ArrayLike) -> Mesh:
    """The mesh without the faces that repeat a vertex, which potpourri3d accepts: they have no area."""
    faces: AnyArray = np.asarray(F)
    if faces.ndim == 2 and faces.shape[1] == 3:
        repeats = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
        faces = faces[~repeats] if repeats.any() and not repeats.all() else faces
    return Mesh(V, faces)


def cotan_laplacian(V: ArrayLike, F: ArrayLike, denom_eps: float = 0.0) -> sp.csr_matrix:
    """The cotangent Laplacian (n, n), positive semidefinite as potpourri3d has it; `denom_eps` is added to twice the
    areas, by which cotangents are divided.
    """
    mesh = proper(V, F)
    half_cotangents = igl.cotmatrix_entries(mesh.V, mesh.F)  # opposite corners 0, 1, 2
    if denom_eps:
        double_area = 2 * mesh.measures
        half_cotangents *= (double_area / (double_area + denom_eps))[:, None]
    tail, head = np.roll(mesh.F, -1, axis=1).ravel(), np.roll(mesh.F, -2, axis=1).ravel()
    weights = sp.coo_array((half_cotangents.ravel(), (tail, head)), shape=(mesh.n_vertices, mesh.n_vertices))
    weights = weights + weights.T
    return sp.csr_matrix(sp.diags_array(weights.sum(axis=1)) - weights)


def face_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """The area (m,) of each triangle."""
    return np.asarray(igl.doublearea(np.asarray(V, np.float64), np.asarray(F, np.int64)) / 2)


def vertex_areas(V: ArrayLike, F: ArrayLike) -> FloatArray:
    """A third of the area of the triangles around each vertex, (n,)."""
    corners: IntArray = np.ravel(np.asarray(F, np.int64))
    return np.asarray(np.bincount(corners, np.repeat(face_areas(V, F) / 3, 3), minlength=len(np.asarray(V))))


def edges(V: ArrayLike, F: ArrayLike) -> IntArray:
    """The distinct edges (k, 2), each ascending, in lexicographic order."""
    return np.array(proper(V, F).edges)
