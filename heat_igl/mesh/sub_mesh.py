"""The part of a mesh that paths may enter, as a mesh of its own, and where its vertices and faces are in the whole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.errors import MeshError, SourceError, as_array
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, IntArray

__all__ = ["SubMesh", "sub_mesh"]


@dataclass(frozen=True, eq=False)
class SubMesh:
    """Some faces of a mesh of n vertices and m faces, made by `sub_mesh`.

    Attributes
    ----------
    mesh : Mesh
        These faces, with k vertices.
    vertices : (k,) int64
        The vertex of the whole mesh that each is, ascending.
    vertex_number : (n,) int64
        The vertex of the part that each vertex of the whole mesh is; -1 outside.
    face_number : (m,) int64
        The same for faces.
    """

    mesh: Mesh
    vertices: IntArray
    vertex_number: IntArray
    face_number: IntArray

    @property
    def n_whole(self) -> int:
        """Vertices of the whole mesh."""
        return len(self.vertex_number)

    def spread(self, values: AnyArray, outside: float = np.inf) -> AnyArray:
        """Values (..., k) per vertex of the part as values (..., n) of the whole mesh, `outside` elsewhere."""
        whole = np.full((*values.shape[:-1], self.n_whole), outside, np.result_type(values, type(outside)))
        whole[..., self.vertices] = values
        return whole

    def vertices_inside(self, vertices: IntArray, name: str = "sources") -> IntArray:
        """Vertices (j,) of the whole mesh as those of the part; a SourceError names the first outside."""
        return _inside(self.vertex_number, vertices, name, "vertex")

    def faces_inside(self, faces: IntArray, name: str = "sources") -> IntArray:
        """Faces (j,) of the whole mesh as those of the part; a SourceError names the first outside."""
        return _inside(self.face_number, faces, name, "face")


def sub_mesh(mesh: Mesh, region: ArrayLike) -> SubMesh:
    """The part of a mesh that a mask selects.

    Parameters
    ----------
    mesh : Mesh
        n vertices, m faces.
    region : (n,) or (m,) array_like of bool
        Of vertices, for the faces all of whose vertices are selected; or of faces. Where n is m, of vertices.

    Raises
    ------
    MeshError
        If `region` is no such mask, or selects no face.
    """
    mask = as_array("region", region, MeshError)
    n, m = mesh.n_vertices, mesh.n_faces
    if mask.dtype.kind != "b" or mask.shape not in ((n,), (m,)):
        raise MeshError(
            f"region must be a mask of bool, with {n} entries for vertices or {m} for faces, not {mask.dtype} of shape "
            f"{mask.shape}"
        )
    of_vertices = len(mask) == n
    is_kept = mask[mesh.F].all(axis=1) if of_vertices else mask
    if not is_kept.any():
        raise MeshError(f"region selects {int(mask.sum())} {'vertices' if of_vertices else 'faces'}, and no whole face")
    inside = mask.copy() if of_vertices else np.zeros(n, bool)
    inside[mesh.F[is_kept]] = True
    numbers = [np.where(kept, np.cumsum(kept) - 1, -1) for kept in (inside, is_kept)]
    return SubMesh(Mesh(mesh.V[inside], numbers[0][mesh.F[is_kept]]), np.flatnonzero(inside), *numbers)


def _inside(number: IntArray, places: IntArray, name: str, kind: str) -> IntArray:
    found = number[places]
    if (found < 0).any():
        first = int(np.argmax(found < 0))
        raise SourceError(
            f"{name}[{first}]: {kind} {places[first]} lies outside the region ({int((found < 0).sum())} of "
            f"{len(places)} do): leave it out, or add it to the region"
        )
    return np.asarray(found)
