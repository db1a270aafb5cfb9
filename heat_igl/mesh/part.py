"""The part of a mesh that paths may enter, with the vertices of the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heat_igl.errors import MeshError, SourceError, as_array
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_triangles
from heat_igl.typing import ArrayLike, BoolArray, IntArray


@dataclass(frozen=True, eq=False)
class MeshPart:
    """Some faces of a mesh of n vertices, made by `MeshPart.of`.

    `mesh` has the faces of the part and all n vertices. `inside` (n,) marks the vertices of the part; others may not
    be sources. `faces` (k,) are the numbers of its faces in the `whole` mesh (m, 3) or (m, 4).
    """

    mesh: Mesh
    inside: BoolArray
    faces: IntArray
    whole: IntArray

    @classmethod
    def of(cls, mesh: object, region: ArrayLike) -> MeshPart:
        """The faces that a mask (m,) selects, or a mask (n,) of all their vertices.

        If n equals m, the mask is of vertices. A MeshError if `mesh` is no `Mesh`, if `region` is no such
        mask, or if it selects no face.
        """
        if not isinstance(mesh, Mesh):
            raise MeshError(
                f"region selects faces of a mesh, not of {type(mesh).__name__}: pass a mesh of triangles, or of a "
                "cloud the points inside"
            )
        mask = as_array("region", region, MeshError)
        n, m = mesh.n_vertices, mesh.n_faces
        if mask.dtype.kind != "b" or mask.shape not in ((n,), (m,)):
            raise MeshError(
                f"region must be a mask of bool, with {n} entries for vertices or {m} for faces, not {mask.dtype} of "
                f"shape {mask.shape}"
            )
        of_vertices = len(mask) == n
        faces = np.flatnonzero(mask[mesh.F].all(axis=1) if of_vertices else mask)
        if not len(faces):
            kind = "vertices" if of_vertices else "faces"
            raise MeshError(f"region selects {int(mask.sum())} {kind}, and no whole face: there is nowhere to go")
        inside = mask.copy() if of_vertices else np.zeros(n, bool)
        inside[mesh.F[faces]] = True
        part = Mesh(mesh.V, mesh.F[faces])
        return cls(part.with_originals(mesh.originals), inside[mesh.originals], faces, mesh.F)

    def require_vertices(self, vertices: IntArray, name: str = "sources", position: IntArray | None = None) -> None:
        """Raise a `SourceError` that names the first of some vertices (j,) outside, by its position if given."""
        _require(self.inside[vertices], vertices, name, "vertex", position)

    def numbers_of(self, faces: IntArray, name: str = "sources", position: IntArray | None = None) -> IntArray:
        """Faces (j,) of the whole mesh as those of `mesh`; a `SourceError` names the first outside, as for vertices."""
        at = np.minimum(np.searchsorted(self.faces, faces), len(self.faces) - 1)
        _require(self.faces[at] == faces, faces, name, "face", position)
        return np.asarray(at)


def triangles_inside(mesh: MeshLike, region: ArrayLike | None, what: str) -> tuple[Mesh, MeshPart | None]:
    """The triangles, which `what` needs, on all vertices; only those of the part that a region, if any, selects."""
    triangles = as_triangles(mesh, what)
    part = None if region is None else MeshPart.of(triangles, region)
    return triangles if part is None else part.mesh, part


def _require(is_inside: BoolArray, places: IntArray, name: str, kind: str, position: IntArray | None) -> None:
    if not is_inside.all():
        first = int(np.argmin(is_inside))
        at = first if position is None else int(position[first])
        raise SourceError(
            f"{name}[{at}]: {kind} {places[first]} lies outside the region ({int((~is_inside).sum())} of "
            f"{len(places)} do): leave it out, or widen the region"
        )
