"""The operators of polygon meshes: Bunge, Herholz, Kazhdan and Botsch (2020)."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.mesh import Mesh, MeshLike, PolygonFans, PolygonMesh, as_mesh, connectivity
from heat_igl.operators.matrices import Laplacian, Operators
from heat_igl.operators.surface import Surface
from heat_igl.operators.triangles import operators
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["fan_operators", "polygon_operators"]

# Share of the weights of L that may be negative while the heat flow is still fitted to lengths, which leaves these out.
_NEGATIVE = 0.03


def polygon_operators(mesh: MeshLike) -> Operators:
    """The operators of a polygon mesh, for `HeatMethodSolver`.

    Each polygon gets a virtual vertex, the affine combination of its corners with the least sum of squared areas of the
    triangles between it and the rim. P, which gives it that combination of the values at the corners, takes the usual
    operators on these triangles back to the vertices of the mesh: L = P^T L' P, M the lumped P^T M' P, and G = G' P
    with a row block for each triangle, so that L = D G holds (Bunge et al. 2020, section 3).

    Of a polygon so concave, or so far from planar, that the virtual vertex does not see every side, those triangles
    would overlap. Such a polygon is replaced by its triangles in ``mesh.triangles``.

    Parameters
    ----------
    mesh : mesh
        Polygons with n vertices, triangles among them, as `as_mesh` takes them.

    Returns
    -------
    Operators
        With n vertices, the faces those triangles, d = 3. h is the mean distance between two vertices of one polygon,
        the same pairs as in L: edges alone are too short for hexagons. No `surface`, since the vertices of those
        triangles are not those of the mesh: nothing to refine by unfolding. Points and curves as sources lie on
        ``mesh.triangles``. No `lengths` if more than 3 % of the weights of L are negative, as with concave
        polygons: `fitted_laplacian` leaves these out, and heat would be too fast.

    Raises
    ------
    MeshError
        If a polygon has no area, or a side on one line with the virtual vertex.

    Examples
    --------
    >>> import numpy as np
    >>> from heat_igl import HeatMethodSolver, PolygonMesh
    >>> from heat_igl.operators import polygon_operators
    >>> hexagon = [[np.cos(a), np.sin(a), 0.0] for a in np.arange(6) * np.pi / 3]
    >>> mesh = PolygonMesh([*hexagon, [1.75, 3**0.5 / 2, 0]], [[0, 1, 2, 3, 4, 5], [0, 6, 1]])
    >>> distance = HeatMethodSolver(polygon_operators(mesh)).distance(3)
    >>> int(distance.argmax())
    6
    """
    mesh = _polygons(mesh)
    corners, following, m = mesh.corners, mesh.following, mesh.n_faces
    owner = np.repeat(np.arange(m), mesh.degree)
    sides = np.linalg.norm(mesh.V[corners] - mesh.V[following], axis=1)
    first, _, n_polygons = connectivity.unique_rows(
        np.sort(np.stack([corners, following], axis=1), axis=1), mesh.n_vertices
    )
    h = _mean_distance(mesh, owner)
    unit = 2.0 ** round(np.log2(h))  # libigl multiplies lengths before it divides
    V = mesh.V / unit
    L, M, P = igl.cotmatrix(V, corners, np.concatenate([[0], np.cumsum(mesh.degree)]))
    refined = P @ V
    F = np.stack([corners, following, mesh.n_vertices + owner], axis=1)
    areas = igl.doublearea(refined, F) / 2 if np.isfinite(refined).all() else np.zeros(len(F))
    _check_areas(mesh, areas, owner, sides / unit)
    hidden = (mesh.degree > 3) & _is_unseen(refined, F, owner)
    if hidden.any():
        return polygon_operators(_with_triangles(mesh, hidden))
    boundary = np.zeros(mesh.n_vertices, bool)
    outer = first[n_polygons == 1]
    boundary[corners[outer]] = boundary[following[outer]] = True
    triangles = mesh.triangles
    _check_mass(M.diagonal(), triangles.referenced)
    graph = sp.csr_array((sides[first], (corners[first], following[first])), shape=(mesh.n_vertices, mesh.n_vertices))
    begin = np.cumsum(mesh.degree) - mesh.degree
    longest = connectivity.longest_paths(graph, triangles.components)
    fans = intrinsic_triangulation(triangles)
    return Operators(
        L=L,
        M=M * unit**2,
        gradient=(igl.grad(refined, F) @ P).tocsc() / unit,
        weights=areas * unit**2,
        face_sizes=np.repeat(np.maximum.reduceat(sides, begin), mesh.degree),
        mean_edge_length=h,
        components=triangles.components,
        boundary=boundary,
        referenced=triangles.referenced,
        longest_distance=float(longest.max()),
        longest_distances=longest,
        lengths=None if _negative_share(L) > _NEGATIVE else _chords(mesh.V, L),
        drawn_on=Surface(fans, fans, V=mesh.V),
    )


def fan_operators(mesh: PolygonMesh, laplacian: Laplacian = "auto") -> Operators:
    """The operators on the triangles between the sides and the virtual vertices of polygons (see `PolygonFans`).

    The virtual vertices follow the n of the polygons, as added vertices. Edges are flipped as `laplacian` says.
    """
    fans, drawn = PolygonFans.of(mesh), intrinsic_triangulation(mesh.triangles)
    return replace(operators(fans.mesh, laplacian), drawn_on=Surface(drawn, drawn, V=mesh.V), fans=fans)


def _negative_share(L: sp.csc_matrix) -> float:
    """Sum of the negative entries of L off the diagonal over that of the positive ones."""
    weights = L.data[L.indices != np.repeat(np.arange(L.shape[1]), np.diff(L.indptr))]
    return float(-weights[weights < 0].sum() / weights[weights > 0].sum())


def _chords(V: FloatArray, L: sp.csc_matrix) -> sp.csc_matrix:
    """Distances in space (n, n) of the vertices that L couples: all pairs of a polygon."""
    columns = np.repeat(np.arange(L.shape[1]), np.diff(L.indptr))
    return sp.csc_matrix((np.linalg.norm(V[L.indices] - V[columns], axis=1), L.indices, L.indptr), shape=L.shape)


def _polygons(mesh: MeshLike) -> PolygonMesh:
    found = as_mesh(mesh)
    if isinstance(found, Mesh) and not found.is_tetrahedral:
        return PolygonMesh(found.V, list(found.F))
    if not isinstance(found, PolygonMesh):
        raise MeshError(f"polygon_operators needs polygons, not {found!r}: see operators and point_cloud_operators")
    return found


def _mean_distance(mesh: PolygonMesh, owner: IntArray) -> float:
    """Mean distance between two vertices of one polygon, each pair counted once."""
    size = (mesh.n_vertices, mesh.n_faces)
    incidence = sp.csr_array((np.ones(len(owner), np.int8), (mesh.corners, owner)), shape=size)
    pairs = sp.triu(incidence @ incidence.T, 1).tocoo()
    return float(np.linalg.norm(mesh.V[pairs.row] - mesh.V[pairs.col], axis=1).mean())


def _is_unseen(refined: FloatArray, F: IntArray, owner: IntArray) -> BoolArray:
    """Which polygons (m,) have a triangle that is turned over against the polygon."""
    a, b, c = (refined[F[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    begin = np.flatnonzero(np.diff(owner, prepend=-1))
    vector_area = np.add.reduceat(normals, begin)
    turned = np.einsum("tx,tx->t", normals, vector_area[owner]) < 0
    return np.asarray(np.logical_or.reduceat(turned, begin))


def _with_triangles(mesh: PolygonMesh, chosen: BoolArray) -> PolygonMesh:
    """The mesh with triangles in place of the chosen polygons."""
    end = np.cumsum(mesh.degree - 2)
    found: list[IntArray] = []
    for i, polygon in enumerate(mesh.polygons):
        found += list(mesh.triangles.F[end[i] - len(polygon) + 2 : end[i]]) if chosen[i] else [polygon]
    return PolygonMesh(mesh.V, found)


def _check_areas(mesh: PolygonMesh, areas: FloatArray, owner: IntArray, sides: FloatArray) -> None:
    """Areas and sides are in one unit of length."""
    flat = np.unique(owner[areas <= 1e-12 * sides**2])
    if len(flat):
        raise MeshError(
            f"polygons[{flat[0]}] = {mesh.polygons[flat[0]].tolist()} has no area, or a side that its middle does not "
            f"see ({len(flat)} of {mesh.n_faces} polygons): remove or split these polygons"
        )


def _check_mass(mass: FloatArray, referenced: BoolArray) -> None:
    bad = referenced & (mass <= 0)
    if bad.any():
        raise MeshError(
            f"vertex {int(np.argmax(bad))} has no area around it ({int(bad.sum())} vertices have none): polygons there "
            "are far from convex; split them"
        )
