"""Cut a triangle mesh along curves: curves become edges, and only the faces that they meet are split."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import igl
import numpy as np

from heat_igl.curves.face_cutting import Point, cut_triangle
from heat_igl.curves.places import corners
from heat_igl.errors import MeshError, SourceError, as_array
from heat_igl.intrinsic import lay_out, lengths_to_divide_by
from heat_igl.mesh import (
    Mesh,
    MeshLike,
    NestedCurves,
    SurfaceCurve,
    SurfacePoints,
    as_triangles,
    connectivity,
    named_entries,
)
from heat_igl.mesh.surface_points import require_faces
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray

# Corners of curves are put on a grid of this many steps along each side of a face, so that integers hold them exactly.
_STEPS = 2**50
# Corners nearer than this to a vertex, an edge or each other, as a share of the face, are the same point. With 1e-12
# 400 random cuts keep areas, lengths and distances to 1e-14 as well; with 1e-5 lengths change by 7e-6.
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class MeshPiece:
    """A piece of a cut mesh, on the vertices that it uses; which vertices and faces of the cut mesh these are."""

    mesh: Mesh
    vertices: IntArray
    faces: IntArray

    def __repr__(self) -> str:
        return f"MeshPiece({self.mesh.n_vertices} vertices, {self.mesh.n_faces} triangles)"

    def boundary_loops(self) -> list[IntArray]:
        """The vertices along each loop of the boundary, with the piece on the left, from the smallest on.

        A MeshError if more than two faces meet at an edge, or neighbours are oriented differently.
        """
        F, n = self.mesh.F, self.mesh.n_vertices
        if len(np.unique(F[:, [1, 2, 0]] * n + F[:, [2, 0, 1]])) < F.size:
            raise MeshError("loops need an oriented manifold: two faces run along an edge in the same direction")
        # Where the piece touches itself in a vertex, each fan around the vertex gets a copy of it.
        fan, vertex = connectivity.fans(F, n)
        loops = [vertex[loop] for loop in igl.boundary_loop_all(fan.reshape(-1, 3))]
        return sorted((np.roll(loop, -loop.argmin()) for loop in loops), key=np.ndarray.tolist)


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

        If more than two faces meet at an edge, or neighbours are oriented differently, it is one of the faces with the
        direction of the curve, and one of those with the opposite direction.
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
        pairs = np.column_stack([face, m + facets.of_face[face, corner]])
        label = connectivity.connected_components(pairs, m + k)[:m]
        return np.asarray(np.unique(label, return_inverse=True)[1], np.int64)

    def split(self) -> list[MeshPiece]:
        """The pieces, each a mesh of its own; vertices on the curves are in every piece that they border."""
        found = []
        for piece in range(int(self.pieces.max()) + 1):
            faces = np.flatnonzero(self.pieces == piece)
            vertices, corners = np.unique(self.mesh.F[faces], return_inverse=True)
            found.append(MeshPiece(Mesh(self.mesh.V[vertices], corners.reshape(-1, 3)), vertices, faces))
        return found


def cut(mesh: MeshLike, curves: NestedCurves) -> CutMesh:
    """Cut a triangle mesh along curves, so that they become edges.

    Curves may run through faces, along edges and through vertices, touch the boundary, cross themselves and each other,
    and end inside a face.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold or not.
    curves : SurfaceCurve or sequence of such of any depth
        Paths, boundaries of regions, or isolines as `isolines` returns them, a list for each level.

    Returns
    -------
    CutMesh
        The surface is the same: area and distances do not change. Faces without a curve stay.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there is no curve, or a face of one is not a face of the mesh.

    Notes
    -----
    Corners of the curves nearer than 1e-9 of a face to a vertex, an edge or each other are put there. All that follows
    is decided in integers (`cut_triangle`), so the new mesh is a triangulation whatever the curves.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(3)
    >>> found = heat_igl.cut(mesh, heat_igl.isolines(mesh, mesh.V[:, 0], 0.5)[0])
    >>> found.mesh
    Mesh(23 vertices, 30 triangles)
    >>> round(float(found.mesh.measures.sum()), 6), int(found.pieces.max()) + 1
    (1.0, 2)
    """
    triangles = as_triangles(mesh, "curves cut")
    entries = named_entries(curves, "curves")
    if not entries:
        raise SourceError("curves is empty: give one curve or more")
    for name, curve in entries:
        if not isinstance(curve, SurfaceCurve):
            raise SourceError(f"{name} must be a SurfaceCurve, not {type(curve).__name__}")
        require_faces(curve, triangles.F, triangles.V, f"{name}: ")
    return _Cut(triangles, [curve for _, curve in entries]).result()


class _Cut:
    """The faces and vertices of a mesh while it is being cut."""

    def __init__(self, mesh: Mesh, curves: list[SurfaceCurve]) -> None:
        self._mesh = mesh
        self._faces = np.concatenate([curve.faces for curve in curves])
        self._label = np.repeat(np.arange(len(curves)), [len(curve) for curve in curves])
        count = len(self._faces)
        # On the grid, and on an edge or vertex that is near; the largest coordinate takes the rest of rounding.
        ends = np.concatenate([curve.start for curve in curves] + [curve.end for curve in curves])
        ends = np.where(ends < _SAME, 0.0, ends)
        ends = np.rint(ends / ends.sum(axis=1, keepdims=True) * _STEPS).astype(np.int64)
        ends[np.arange(2 * count), ends.argmax(axis=1)] += _STEPS - ends.sum(axis=1)
        self._ends = ends.reshape(2, count, 3)
        # Of new vertices, which are numbered in this order: a face, and the barycentric coordinates in it.
        self._place: list[tuple[int, list[float]]] = []
        self._on_edge: dict[int, list[tuple[int, int]]] = {}
        self._node = self._nodes_on_edges(np.tile(self._faces, 2), ends).reshape(2, count)
        self._edges: list[tuple[int, int]] = []
        self._curve: list[int] = []

    def result(self) -> CutMesh:
        """The cut mesh."""
        mesh = self._mesh
        is_touched = connectivity.mask_of(self._faces, mesh.n_faces)
        is_touched |= np.isin(mesh.facets.of_face, list(self._on_edge)).any(axis=1)
        touched = np.flatnonzero(is_touched)
        order = np.argsort(self._faces, kind="stable")
        first = np.searchsorted(self._faces[order], [touched, touched + 1])
        new_faces: list[tuple[int, int, int]] = []
        old_of_new: list[int] = []
        flat = lay_out(lengths_to_divide_by(mesh)[touched])
        for face, plane, low, high in zip(touched.tolist(), flat, *first.tolist(), strict=True):
            parts = self._cut_face(face, plane, order[low:high])
            new_faces += parts
            old_of_new += [face] * len(parts)
        whole = np.flatnonzero(~is_touched)
        old_faces = np.concatenate([whole, np.array(old_of_new, np.int64)])
        ascending = np.argsort(old_faces, kind="stable")
        F = np.concatenate([mesh.F[whole], np.array(new_faces, np.int64).reshape(-1, 3)])[ascending]
        places = self._places()
        old_corners = mesh.F[places.faces[mesh.n_vertices :]]
        added = np.einsum("kc,kcx->kx", places.barycentric[mesh.n_vertices :], mesh.V[old_corners])
        V = np.concatenate([mesh.V, added])
        return CutMesh(
            Mesh(V, F).with_originals(np.append(mesh.originals, np.arange(mesh.n_vertices, len(V)))),
            old_faces[ascending],
            places,
            np.array(self._edges, np.int64).reshape(-1, 2),
            np.array(self._curve, np.int64),
            old_corners,
        )

    def _nodes_on_edges(self, faces: IntArray, ends: IntArray) -> IntArray:
        """The vertex (p,) that each end of a segment is, new ones on edges; -1 for ends inside faces."""
        mesh, n = self._mesh, self._mesh.n_vertices
        held = (ends > 0).sum(axis=1)
        node = np.full(len(faces), -1)
        node[held == 1] = mesh.F[faces[held == 1], ends[held == 1].argmax(axis=1)]
        on = np.flatnonzero(held == 2)
        edge = mesh.facets.of_face[faces[on], ends[on].argmin(axis=1)]
        larger = mesh.F[faces[on]] == mesh.facets.vertices[edge, 1][:, None]
        step = ends[on][larger]
        order = np.lexsort((step, edge))
        edge, step = edge[order], step[order]
        is_new = np.ones(len(on), bool)
        is_new[1:] = (edge[1:] != edge[:-1]) | (step[1:] - step[:-1] > _SAME * _STEPS)
        node[on[order]] = n + np.cumsum(is_new) - 1
        # In the first face of the edge.
        first = np.empty(len(mesh.facets.vertices), np.int64)
        first[mesh.facets.of_face.ravel()[::-1]] = np.arange(mesh.F.size)[::-1]
        edge, step = edge[is_new], step[is_new]
        face = first[edge] // 3
        corner = mesh.F[face][:, :, None] == mesh.facets.vertices[edge][:, None]
        weights = np.einsum("kce,ke->kc", corner, np.stack([_STEPS - step, step], axis=1) / _STEPS)
        self._place += zip(face.tolist(), weights.tolist(), strict=True)
        for i, (e, s) in enumerate(zip(edge.tolist(), step.tolist(), strict=True)):
            self._on_edge.setdefault(e, []).append((s, n + i))
        return node

    def _cut_face(self, face: int, flat: FloatArray, segments: IntArray) -> list[tuple[int, int, int]]:
        """The parts of a face with its corners at `flat` (3, 2); its new vertices and edges on curves are noted."""
        mesh = self._mesh
        vertices: list[int] = mesh.F[face].tolist()
        points: list[Point] = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
        for edge in mesh.facets.of_face[face].tolist():
            smaller, larger = (vertices.index(v) for v in mesh.facets.vertices[edge].tolist())
            for step, number in self._on_edge.get(edge, ()):
                at = [0, 0, 0]
                at[smaller], at[larger] = _STEPS - step, step
                points.append((at[0], at[1], at[2]))
                vertices.append(number)
        pairs, labels = self._inside(face, segments, points, vertices)
        points, triangles, chains = cut_triangle(points, pairs, flat)
        for point in points[len(vertices) :]:
            vertices.append(self._added(face, point))
        for chain, label in zip(chains, labels, strict=True):
            for a, b in pairwise(chain):
                self._edges.append((vertices[a], vertices[b]))
                self._curve.append(label)
        return [(vertices[a], vertices[b], vertices[c]) for a, b, c in triangles]

    def _inside(
        self, face: int, segments: IntArray, points: list[Point], vertices: list[int]
    ) -> tuple[list[tuple[int, int]], list[int]]:
        """The segments as pairs of points, without those of no length, and their curves; points inside are appended."""
        local = {vertex: i for i, vertex in enumerate(vertices)}
        inner: list[tuple[IntArray, int]] = []
        pairs, labels = [], []
        for segment in segments.tolist():
            pair = []
            for which in (0, 1):
                known = int(self._node[which, segment])
                if known >= 0:
                    pair.append(local[known])
                    continue
                at = self._ends[which, segment]
                near = [i for other, i in inner if np.abs(other - at).max() <= _SAME * _STEPS]
                if not near:
                    points.append((int(at[0]), int(at[1]), int(at[2])))
                    vertices.append(self._added(face, points[-1]))
                    inner.append((at, len(points) - 1))
                    near = [len(points) - 1]
                pair.append(near[0])
            if pair[0] != pair[1]:
                pairs.append((pair[0], pair[1]))
                labels.append(int(self._label[segment]))
        return pairs, labels

    def _added(self, face: int, point: Point) -> int:
        """A new vertex inside a face."""
        total = sum(point)
        self._place.append((face, [weight / total for weight in point]))
        return self._mesh.n_vertices + len(self._place) - 1

    def _places(self) -> SurfacePoints:
        """The place of each vertex, old and new."""
        mesh, n = self._mesh, self._mesh.n_vertices
        faces = np.full(n + len(self._place), -1)
        barycentric = np.zeros((len(faces), 3))
        corner = corners(mesh)
        used = np.flatnonzero(corner >= 0)
        faces[used] = corner[used] // 3
        barycentric[:n, 0] = 1
        barycentric[used] = np.eye(3)[corner[used] % 3]
        for i, (face, weights) in enumerate(self._place, n):
            faces[i], barycentric[i] = face, weights
        return SurfacePoints(faces, barycentric)
