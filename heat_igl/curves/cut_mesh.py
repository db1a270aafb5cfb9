"""A mesh that was cut along curves: values on it, the faces beside the curves, and the pieces."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.errors import MeshError, as_array
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.typing import AnyArray, ArrayLike, IntArray


@dataclass(frozen=True, eq=False)
class MeshPiece:
    """A piece of a cut mesh.

    Attributes
    ----------
    mesh : Mesh
        The faces of the piece, on the vertices that they use.
    vertices : (n,) int64
        The vertex of the cut mesh that each vertex is.
    faces : (m,) int64
        The face of the cut mesh that each face is.
    """

    mesh: Mesh
    vertices: IntArray
    faces: IntArray

    def __repr__(self) -> str:
        return f"MeshPiece({self.mesh.n_vertices} vertices, {self.mesh.n_faces} triangles)"

    def boundary_loops(self) -> list[IntArray]:
        """The vertices along each loop of the boundary, with the piece on the left, from the smallest on.

        Raises
        ------
        MeshError
            If more than two faces meet at an edge, or neighbours are oriented differently.
        """
        F = self.mesh.F
        tail, head, apex = F[:, [1, 2, 0]].ravel(), F[:, [2, 0, 1]].ravel(), F.ravel()
        third = {(a, b): c for a, b, c in zip(tail.tolist(), head.tolist(), apex.tolist(), strict=True)}
        if len(third) < len(tail):
            raise MeshError("loops need an oriented manifold: two faces run along an edge in the same direction")
        left = sorted(edge for edge in third if edge[::-1] not in third)
        loops, seen = [], set()
        for first in left:
            edge, loop = first, []
            while edge not in seen:
                seen.add(edge)
                loop.append(edge[0])
                # Around the head, through the faces of one fan, to the next edge of the boundary.
                a, b = edge[1], third[edge]
                while (b, a) in third:
                    b = third[b, a]
                edge = (a, b)
            if loop:
                loops.append(np.array(loop))
        return loops


@dataclass(frozen=True, eq=False)
class CutMesh:
    """A mesh cut along curves.

    Attributes
    ----------
    mesh : Mesh
        The new mesh. Its first vertices are those of the old one, in their order.
    old_faces : (m,) int64
        The old face that each new face is a part of; ascending.
    places : SurfacePoints
        The place of each new vertex on the old mesh. A vertex that no face uses has the face -1.
    edges : (k, 2) int64
        The edges on the curves, each in the direction of its curve; one for each curve that runs along it.
    curve : (k,) int64
        The curve of each, by its position in the list.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.icosphere(3)
    >>> equator = heat_igl.isolines(mesh, mesh.V[:, 2], 0.1)[0]
    >>> halves = heat_igl.cut(mesh, equator).split()
    >>> [half.mesh.report().euler_characteristic for half in halves]  # of disks
    [1, 1]
    """

    mesh: Mesh
    old_faces: IntArray
    places: SurfacePoints
    edges: IntArray
    curve: IntArray
    _old_corners: IntArray

    def __repr__(self) -> str:
        counts = f"{self.mesh.n_vertices} vertices, {self.mesh.n_faces} triangles"
        return f"CutMesh({counts}, {len(self.edges)} edges on curves)"

    def carry(self, values: ArrayLike) -> AnyArray:
        """Values at the vertices of the new mesh, from values (n, ...) at those of the old one, linear in its faces."""
        given = as_array("values", values)
        n = len(self.places) - len(self._old_corners)
        if given.shape[:1] != (n,):
            raise ValueError(f"values must have {n} rows, one for each vertex of the old mesh, not shape {given.shape}")
        weight, corners = self.places.barycentric[n:], given[self._old_corners]
        # A corner without weight may be infinitely far away, and 0 times infinity is NaN.
        counts = (weight > 0).reshape(*weight.shape, *(1,) * (given.ndim - 1))
        added = np.einsum("kc,kc...->k...", weight, np.where(counts, corners, 0))
        return np.concatenate([given, added])

    @cached_property
    def sides(self) -> IntArray:
        """The faces (k, 2) on the left and on the right of each of `edges`; -1 if there is none.

        If more than two faces meet, or neighbours are oriented differently: one of the faces that run along the edge in
        the direction of the curve, and one of those that run in the other.
        """
        F, n = self.mesh.F, self.mesh.n_vertices
        key = (F[:, [1, 2, 0]] * n + F[:, [2, 0, 1]]).ravel()
        order = np.argsort(key, kind="stable")
        found = np.full((len(self.edges), 2), -1)
        for side, (tail, head) in enumerate((self.edges.T, self.edges.T[::-1])):
            wanted = tail * n + head
            at = np.minimum(np.searchsorted(key[order], wanted), len(key) - 1)
            has = key[order[at]] == wanted
            found[has, side] = order[at[has]] // 3
        return found

    @cached_property
    def pieces(self) -> IntArray:
        """The piece (m,) that each face belongs to: neighbours are in one piece unless a curve runs between them."""
        facets, n = self.mesh.facets, self.mesh.n_vertices
        ascending = np.sort(self.edges, axis=1)
        is_cut = np.isin(facets.vertices @ [n, 1], ascending @ [n, 1])
        face, corner = np.nonzero(~is_cut[facets.of_face])
        m, k = self.mesh.n_faces, len(facets.vertices)
        pairs = (face, m + facets.of_face[face, corner])
        graph = sp.coo_array((np.ones(len(face), np.int8), pairs), shape=(m + k, m + k))
        label = csgraph.connected_components(graph, directed=False)[1][:m]
        return np.asarray(np.unique(label, return_inverse=True)[1], np.int64)

    def split(self) -> list[MeshPiece]:
        """The pieces, each a mesh of its own; vertices on the curves are in every piece that they border."""
        found = []
        for piece in range(int(self.pieces.max()) + 1):
            faces = np.flatnonzero(self.pieces == piece)
            vertices, corners = np.unique(self.mesh.F[faces], return_inverse=True)
            found.append(MeshPiece(Mesh(self.mesh.V[vertices], corners.reshape(-1, 3)), vertices, faces))
        return found
