"""Polygon meshes: their faces checked once, and the operators of Bunge, Herholz, Kazhdan and Botsch (2020) on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl import connectivity
from heat_igl.errors import MeshError
from heat_igl.mesh import Mesh, checked_positions
from heat_igl.operators import Operators
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["PolygonMesh", "polygon_operators", "triangle_fans", "which_repeat_a_vertex"]


@dataclass(frozen=True, eq=False, repr=False)
class PolygonMesh:
    """A mesh of polygons in space, each with three corners or more.

    Parameters
    ----------
    V : (n, 3) array_like of real numbers
        Vertex positions, in any unit of length.
    polygons : sequence of m sequences of int, or (m, d) array_like of int
        Vertex indices of each polygon in the order of its rim, counted from 0.

    Attributes
    ----------
    V : (n, 3) float64
        Positions.
    corners : (sum of degree,) int64
        Vertices of the polygons, one polygon after the other.
    degree : (m,) int64
        Number of corners of each polygon.
    triangles : Mesh
        The same vertices, each polygon cut into the fan of triangles around its first corner.

    Raises
    ------
    MeshError
        As `Mesh`; also if a polygon has fewer than three corners. The message names the first offender.

    Notes
    -----
    Polygons need be neither planar nor convex, but the virtual vertex inside (see `polygon_operators`) should see every
    corner. Corners on a straight line, such as those where smaller neighbours meet a larger polygon, are fine.
    """

    V: FloatArray
    corners: IntArray
    degree: IntArray
    triangles: Mesh

    def __init__(self, V: ArrayLike, polygons: Sequence[Sequence[int] | IntArray] | IntArray) -> None:
        positions = checked_positions(V)
        corners, degree = _flattened(polygons)
        _check(corners, degree, len(positions))
        for array in (corners, degree):
            array.setflags(write=False)
        triangles = Mesh(positions, triangle_fans(corners, degree))
        object.__setattr__(self, "V", triangles.V)
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "degree", degree)
        object.__setattr__(self, "triangles", triangles)

    def __repr__(self) -> str:
        return f"PolygonMesh({self.n_vertices} vertices, {self.n_faces} polygons)"

    def __reduce__(self) -> tuple[type[PolygonMesh], tuple[FloatArray, list[IntArray]]]:
        return PolygonMesh, (self.V, self.polygons)

    @property
    def n_vertices(self) -> int:
        """Number of vertices n."""
        return len(self.V)

    @property
    def n_faces(self) -> int:
        """Number of polygons m."""
        return len(self.degree)

    @property
    def polygons(self) -> list[IntArray]:
        """The vertices of each polygon."""
        return list(np.split(self.corners, np.cumsum(self.degree)[:-1]))

    @property
    def following(self) -> IntArray:
        """The vertex (sum of degree,) after each of `corners` on the rim of its polygon."""
        last = np.cumsum(self.degree) - 1
        following = np.roll(self.corners, -1)
        following[last] = self.corners[last - self.degree + 1]
        return following


def triangle_fans(corners: IntArray, degree: IntArray) -> IntArray:
    """Triangles (sum of degree - 2, 3): each polygon as a fan around its first corner, see `PolygonMesh`."""
    if (degree == 3).all():
        return corners.reshape(-1, 3)
    begin = np.repeat(np.cumsum(degree) - degree, degree)
    position = np.arange(len(corners))
    second = position[(position > begin) & (position < begin + np.repeat(degree, degree) - 1)]
    return np.stack([corners[begin[second]], corners[second], corners[second + 1]], axis=1)


def which_repeat_a_vertex(corners: IntArray, degree: IntArray) -> BoolArray:
    """The polygons (m,) that have a vertex twice."""
    if len(degree) and (degree == degree[0]).all():
        rows = np.sort(corners.reshape(len(degree), -1), axis=1)
        return np.asarray((rows[:, 1:] == rows[:, :-1]).any(axis=1))
    owner = np.repeat(np.arange(len(degree)), degree)
    order = np.lexsort((corners, owner))
    same = (owner[order[1:]] == owner[order[:-1]]) & (corners[order[1:]] == corners[order[:-1]])
    found = np.zeros(len(degree), bool)
    found[owner[order[1:][same]]] = True
    return found


def _flattened(polygons: Sequence[Sequence[int] | IntArray] | IntArray) -> tuple[IntArray, IntArray]:
    """All corners, polygon after polygon, and the number of each."""
    if not hasattr(polygons, "__len__") or not len(polygons):
        raise MeshError("polygons is empty: a mesh needs at least one")
    rows: list[AnyArray] = []
    for i, polygon in enumerate(polygons):
        try:
            row = np.asarray(polygon)
        except ValueError:
            row = np.empty((0, 0))
        if row.ndim != 1 or (row.dtype.kind not in "iu" and row.size):
            raise MeshError(f"polygons[{i}] must be a sequence of vertex indices (integers), not {polygon!r:.60}")
        rows.append(row)
    return np.concatenate(rows).astype(np.int64), np.array([len(row) for row in rows])


def _check(corners: IntArray, degree: IntArray, n: int) -> None:
    def shown(i: int) -> str:
        begin = int(degree[:i].sum())
        return f"polygons[{i}] = {corners[begin : begin + degree[i]].tolist()}"

    short = degree < 3
    if short.any():
        raise MeshError(
            f"{shown(int(np.argmax(short)))} needs three corners or more ({int(short.sum())} of {len(degree)} "
            "polygons have fewer)"
        )
    outside = (corners < 0) | (corners >= n)
    if outside.any():
        owner = np.repeat(np.arange(len(degree)), degree)[outside]
        hint = "; the indices look 1-based, subtract 1" if corners.min() == 1 and corners.max() == n else ""
        raise MeshError(
            f"{shown(int(owner[0]))} holds {corners[outside][0]}, which is no vertex ({len(np.unique(owner))} of "
            f"{len(degree)} polygons are affected): V has {n} rows, so indices run from 0 to {n - 1}{hint}"
        )
    repeated = which_repeat_a_vertex(corners, degree)
    if repeated.any():
        raise MeshError(
            f"{shown(int(np.argmax(repeated)))} repeats a vertex ({int(repeated.sum())} of {len(degree)} polygons do): "
            "split such polygons, or remove them if they have no area"
        )


def polygon_operators(mesh: PolygonMesh) -> Operators:
    """The operators of a polygon mesh, for `HeatMethodSolver.from_operators`.

    Each polygon gets a virtual vertex, the affine combination of its corners with the least sum of squared areas of the
    triangles between it and the rim. P, which gives it that combination of the values at the corners, takes the usual
    operators on these triangles back to the vertices of the mesh: L = P^T L' P, M the lumped P^T M' P, and G = G' P
    with a row block for each triangle, so that L = D G holds (Bunge et al. 2020, section 3).

    Parameters
    ----------
    mesh : PolygonMesh
        n vertices.

    Returns
    -------
    Operators
        With n vertices, the faces those triangles, d = 3. h is the mean distance between two vertices of one polygon,
        which is what L couples: edges alone are too short for hexagons. No `triangulation`, since its vertices are not
        those of the mesh: nothing to refine by unfolding.

    Raises
    ------
    MeshError
        If a polygon has no area, or one so concave that its virtual vertex leaves a vertex of the mesh without mass.

    Examples
    --------
    >>> import numpy as np
    >>> from heat_igl import HeatMethodSolver, PolygonMesh, polygon_operators
    >>> hexagon = [[np.cos(a), np.sin(a), 0.0] for a in np.arange(6) * np.pi / 3]
    >>> mesh = PolygonMesh([*hexagon, [1.75, 3**0.5 / 2, 0]], [[0, 1, 2, 3, 4, 5], [0, 6, 1]])
    >>> distance = HeatMethodSolver.from_operators(polygon_operators(mesh)).distance(3)
    >>> int(distance.argmax())
    6
    """
    corners, following, m = mesh.corners, mesh.following, mesh.n_faces
    owner = np.repeat(np.arange(m), mesh.degree)
    sides = np.linalg.norm(mesh.V[corners] - mesh.V[following], axis=1)
    first, _, n_polygons = connectivity.unique_rows(
        np.sort(np.stack([corners, following], axis=1), axis=1), mesh.n_vertices
    )
    h = _mean_distance(mesh, owner)
    unit = 2.0 ** round(np.log2(h))  # see `cotan_operators`
    V = mesh.V / unit
    L, M, P = igl.cotmatrix(V, corners, np.concatenate([[0], np.cumsum(mesh.degree)]))
    refined = P @ V
    F = np.stack([corners, following, mesh.n_vertices + owner], axis=1)
    areas = igl.doublearea(refined, F) / 2 if np.isfinite(refined).all() else np.zeros(len(F))
    _check_areas(mesh, areas, owner, sides / unit)
    boundary = np.zeros(mesh.n_vertices, bool)
    outer = first[n_polygons == 1]
    boundary[corners[outer]] = boundary[following[outer]] = True
    triangles = mesh.triangles
    _check_mass(M.diagonal(), triangles.referenced)
    graph = sp.csr_array((sides[first], (corners[first], following[first])), shape=(mesh.n_vertices, mesh.n_vertices))
    begin = np.cumsum(mesh.degree) - mesh.degree
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
        longest_distance=connectivity.longest_path(graph, triangles.components),
        chords=_chords(mesh.V, L),
    )


def _chords(V: FloatArray, L: sp.csc_matrix) -> sp.csc_matrix:
    """Distances in space (n, n) of the vertices that L couples: all pairs of a polygon."""
    columns = np.repeat(np.arange(L.shape[1]), np.diff(L.indptr))
    return sp.csc_matrix((np.linalg.norm(V[L.indices] - V[columns], axis=1), L.indices, L.indptr), shape=L.shape)


def _mean_distance(mesh: PolygonMesh, owner: IntArray) -> float:
    """Mean distance between two vertices of one polygon, each pair counted once."""
    size = (mesh.n_vertices, mesh.n_faces)
    incidence = sp.csr_array((np.ones(len(owner), np.int8), (mesh.corners, owner)), shape=size)
    pairs = sp.triu(incidence @ incidence.T, 1).tocoo()
    return float(np.linalg.norm(mesh.V[pairs.row] - mesh.V[pairs.col], axis=1).mean())


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
