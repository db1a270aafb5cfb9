"""Meshes of polygons, validated on construction, and their triangles around a virtual vertex inside each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import igl
import numpy as np

from heat_igl.errors import MeshError, shown
from heat_igl.mesh.connectivity import enumerate_runs, mask_of, next_in_run
from heat_igl.mesh.mesh import Mesh, checked_positions
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# A triangle whose height over a side is below this share of that side has no orientation, and its polygon gets no fan.
_FLAT = 1e-12


@dataclass(frozen=True, eq=False, repr=False)
class PolygonMesh:
    """A mesh of polygons in space, each with three corners or more.

    Parameters
    ----------
    V : (n, 3) array_like of real numbers
        Vertex positions, in any unit of length.
    polygons : sequence of m sequences of int, or (m, d) array_like of int
        Vertex indices of each polygon, counted from 0, in order around the polygon.

    Attributes
    ----------
    V : (n, 3) float64
        Positions.
    corners : (sum of degree,) int64
        Vertices of the polygons, one polygon after the other.
    degree : (m,) int64
        Number of corners of each polygon.
    triangles : Mesh
        The same vertices. Each polygon is cut into the fan of triangles around the first corner, or, if it is
        concave and the fan would leave it, by clipping ears.

    Raises
    ------
    MeshError
        As for `Mesh`; also if a polygon has fewer than three corners. The message names the first offender.

    Warns
    -----
    AccuracyWarning
        If sides of a polygon cross each other: it has no inside, and is measured on the fan. The message names the
        first; `triangles.crossed_polygons` are all of them.

    Notes
    -----
    Polygons need be neither planar nor convex, and may have corners on a straight side, as beside smaller neighbours.
    On polygons that are not planar, paths and exact distances are measured on `triangles`, and heat on the
    triangles around a virtual vertex in each polygon, see `PolygonFans`.

    Examples
    --------
    >>> import heat_igl
    >>> V = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [0, 1, 0]]
    >>> mesh = heat_igl.PolygonMesh(V, [[0, 1, 4, 5], [1, 2, 3, 4]])
    >>> mesh.n_faces, mesh.triangles.n_faces
    (2, 4)
    >>> float(mesh.triangles.measures.sum())
    2.0
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
        triangles = Mesh.of_polygons(positions, corners, degree, partial(_named, corners, degree))
        vars(self).update(V=triangles.V, corners=corners, degree=degree, triangles=triangles)

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
        """The vertex (sum of degree,) after each of `corners` around the polygon."""
        return next_in_run(self.corners, self.degree)


def which_repeat_a_vertex(corners: IntArray, degree: IntArray) -> BoolArray:
    """Mask (m,) of the polygons in which a vertex occurs twice."""
    if len(degree) and (degree == degree[0]).all():
        rows = np.sort(corners.reshape(len(degree), -1), axis=1)
        return np.asarray((rows[:, 1:] == rows[:, :-1]).any(axis=1))
    owner = np.repeat(np.arange(len(degree)), degree)
    order = np.lexsort((corners, owner))
    same = (owner[order[1:]] == owner[order[:-1]]) & (corners[order[1:]] == corners[order[:-1]])
    return mask_of(owner[order[1:][same]], len(degree))


def _flattened(polygons: Sequence[Sequence[int] | IntArray] | IntArray) -> tuple[IntArray, IntArray]:
    """The corners of all polygons, one polygon after the other, and the number of corners of each."""
    if not isinstance(polygons, Iterable) or getattr(polygons, "ndim", 1) == 0:
        raise MeshError(f"polygons must be a sequence of polygons, not {shown(polygons)}")
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


def _named(corners: IntArray, degree: IntArray, i: int) -> str:
    begin = int(degree[:i].sum())
    return f"polygons[{i}] = {corners[begin : begin + degree[i]].tolist()}"


def _check(corners: IntArray, degree: IntArray, n: int) -> None:
    name = partial(_named, corners, degree)
    short = degree < 3
    if short.any():
        raise MeshError(
            f"{name(int(np.argmax(short)))} needs three corners or more ({int(short.sum())} of {len(degree)} "
            "polygons have fewer)"
        )
    outside = (corners < 0) | (corners >= n)
    if outside.any():
        owner = np.repeat(np.arange(len(degree)), degree)[outside]
        hint = "; the indices look 1-based, subtract 1" if corners.min() == 1 and corners.max() == n else ""
        raise MeshError(
            f"{name(int(owner[0]))} holds {corners[outside][0]}, which is no vertex ({len(np.unique(owner))} of "
            f"{len(degree)} polygons are affected): V has {n} rows, so indices run from 0 to {n - 1}{hint}"
        )
    repeated = which_repeat_a_vertex(corners, degree)
    if repeated.any():
        raise MeshError(
            f"{name(int(np.argmax(repeated)))} repeats a vertex ({int(repeated.sum())} of {len(degree)} polygons do): "
            "split such polygons, or remove them if they have no area"
        )


@dataclass(frozen=True, eq=False)
class PolygonFans:
    """The triangles between the sides and the virtual vertex of each of m polygons.

    A triangle stays as it is. A polygon whose virtual vertex does not see every side, as a very concave one, or one
    without area, is taken as its triangles in ``polygons.triangles``. `mesh` has the triangles in the order of the
    polygons, those of polygon i from ``first[i]`` to ``first[i + 1]``, and virtual vertices after the given ones.
    """

    polygons: PolygonMesh
    mesh: Mesh
    first: IntArray

    @classmethod
    def of(cls, polygons: PolygonMesh) -> PolygonFans:
        """The fans of all polygons."""
        degree, points = polygons.degree, virtual_vertices(polygons)
        owner, begin = np.repeat(np.arange(len(degree)), degree), np.cumsum(degree) - degree
        one, other = (polygons.V[ends] - points[owner] for ends in (polygons.corners, polygons.following))
        # Whether all triangles of a fan are turned like the polygon.
        normals, side = np.cross(one, other), other - one
        total = np.add.reduceat(normals, begin)
        length = np.linalg.norm(total, axis=1)
        area = np.einsum("kx,kx->k", normals, (total / np.where(length > 0, length, 1)[:, None])[owner])
        sees_all = np.logical_and.reduceat(area > _FLAT * np.einsum("kx,kx->k", side, side), begin)
        has_fan = (degree > 3) & sees_all
        row = polygons.n_vertices + np.cumsum(has_fan) - 1
        owner_of_triangle, _ = enumerate_runs(degree - 2)
        in_fan, apart = has_fan[owner], ~has_fan[owner_of_triangle]
        fans = np.stack([polygons.corners, polygons.following, row[owner]], axis=1)[in_fan]
        F = np.concatenate([fans, polygons.triangles.F[apart]])
        order = np.argsort(np.concatenate([owner[in_fan], owner_of_triangle[apart]]), kind="stable")
        first = np.concatenate([[0], np.cumsum(np.where(has_fan, degree, degree - 2))])
        return cls(polygons, Mesh(np.concatenate([polygons.V, points[has_fan]]), F[order]), first)

    def carry(self, faces: IntArray, barycentric: FloatArray) -> tuple[IntArray, FloatArray]:
        """Points in faces (k,) of ``polygons.triangles``, with barycentric coordinates (k, 3), carried to `mesh`.

        Points of planar polygons and points on sides keep their places. Other points move to the triangle of the fan
        above or below them.
        """
        polygon, moved, is_fanned = self._kept(faces)
        at = np.flatnonzero(is_fanned)
        if not len(at):
            return moved, barycentric
        X = np.einsum("kc,kcx->kx", barycentric[at], self.polygons.V[self.polygons.triangles.F[faces[at]]])
        barycentric = barycentric.copy()
        moved[at], barycentric[at] = self._nearest(polygon[at], X)
        return moved, barycentric

    def carry_segments(
        self, faces: IntArray, start: FloatArray, end: FloatArray
    ) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
        """Segments (s,) in ``polygons.triangles``, cut where they pass from one triangle of `mesh` to the next.

        Returns the segment (k,) that each piece belongs to, and faces, start and end of the pieces in `mesh`.
        """
        polygon, moved, is_fanned = self._kept(faces)
        whole, cut = np.flatnonzero(~is_fanned), np.flatnonzero(is_fanned)
        corners = self.polygons.V[self.polygons.triangles.F[faces[cut]]]
        begin, along = (np.einsum("kc,kcx->kx", part[cut], corners) for part in (start, end - start))
        which, low, high = _pieces(begin, along, polygon[cut], self)
        middle, _ = self._nearest(polygon[cut][which], begin[which] + ((low + high) / 2)[:, None] * along[which])
        ends = [_barycentric(self.mesh, middle, begin[which] + at[:, None] * along[which]) for at in (low, high)]
        return (
            np.concatenate([whole, cut[which]]),
            np.concatenate([moved[whole], middle]),
            np.concatenate([start[whole], _inside(ends[0])]),
            np.concatenate([end[whole], _inside(ends[1])]),
        )

    def _kept(self, faces: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
        """Of triangles (k,) of the polygons: their polygons, the same in `mesh`, and whether a fan replaced them."""
        of_triangle, position = enumerate_runs(self.polygons.degree - 2)
        polygon = of_triangle[faces]
        is_fanned = np.diff(self.first)[polygon] == self.polygons.degree[polygon]
        return polygon, self.first[polygon] + position[faces], is_fanned

    def _nearest(self, polygon: IntArray, X: FloatArray) -> tuple[IntArray, FloatArray]:
        """Of each polygon (k,), the triangle that points X (k, 3) lie in, or are the least outside of."""
        which, position = enumerate_runs(self.first[polygon + 1] - self.first[polygon])
        triangle = self.first[polygon][which] + position
        barycentric = _barycentric(self.mesh, triangle, X[which])
        order = np.lexsort((-barycentric.min(axis=1), which))
        chosen = order[np.diff(which[order], prepend=-1) != 0]
        return triangle[chosen], _inside(barycentric[chosen])


def virtual_vertices(mesh: PolygonMesh) -> FloatArray:
    """The point (m, 3) of each polygon with the least sum of squared areas of the triangles to the sides.

    Twice the vector area of the triangle on a side e is a + e x p, with a that for p = 0, so p is the solution of three
    linear equations (Bunge et al. 2020, section 3.2). Any solution, if the polygon lies on a line.
    """
    begin = np.cumsum(mesh.degree) - mesh.degree
    centre = np.add.reduceat(mesh.V[mesh.corners], begin) / mesh.degree[:, None]
    here, there = (mesh.V[ends] - np.repeat(centre, mesh.degree, axis=0) for ends in (mesh.corners, mesh.following))
    e, a = there - here, np.cross(here, there)
    # The cross product with e, squared, is |e|^2 I - e e^T.
    squares = np.einsum("kx,kx->k", e, e)[:, None, None] * np.eye(3) - e[:, :, None] * e[:, None]
    inverse = np.linalg.pinv(np.add.reduceat(squares, begin), hermitian=True)
    return np.asarray(centre + np.einsum("mxy,my->mx", inverse, np.add.reduceat(np.cross(e, a), begin)))


def _pieces(
    begin: FloatArray, along: FloatArray, polygon: IntArray, fans: PolygonFans
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Pieces of segments (s, 3) between the edges of fans: which segment (k,), and shares (k,) at which they end.

    An edge is crossed if the segment crosses the plane through it that is normal to the triangle.
    """
    which, position = enumerate_runs(3 * np.diff(fans.first)[polygon])
    triangle, corner = fans.first[polygon][which] + position // 3, position % 3
    P = fans.mesh.V[fans.mesh.F[triangle]]
    a, b, c = (P[np.arange(len(which)), (corner + i) % 3] for i in range(3))
    outward = np.cross(b - a, np.cross(b - a, c - a))
    height, slope = (np.einsum("kx,kx->k", outward, part) for part in (a - begin[which], along[which]))
    share = np.divide(height, slope, out=np.full(len(which), -1.0), where=slope != 0)
    place = np.einsum("kx,kx->k", begin[which] + share[:, None] * along[which] - a, b - a)
    crossed = (share > _FLAT) & (share < 1 - _FLAT) & (place >= 0) & (place <= np.einsum("kx,kx->k", b - a, b - a))
    s = np.arange(len(begin))
    which = np.concatenate([s, which[crossed], s])
    share = np.concatenate([np.zeros(len(s)), share[crossed], np.ones(len(s))])
    order = np.lexsort((share, which))
    which, share = which[order], share[order]
    # Both triangles at an edge are crossed there.
    piece = np.flatnonzero((which[1:] == which[:-1]) & (np.diff(share) > _FLAT))
    return which[piece], share[piece], share[piece + 1]


def _barycentric(mesh: Mesh, faces: IntArray, X: FloatArray) -> FloatArray:
    """Coordinates (k, 3) in `faces` of the points below or above X (k, 3)."""
    return np.asarray(igl.barycentric_coordinates(X, *(mesh.V[mesh.F[faces, i]] for i in range(3))))


def _inside(barycentric: FloatArray) -> FloatArray:
    """Coordinates (k, 3) moved into their triangles."""
    inside = np.maximum(barycentric, 0)
    return np.asarray(inside / inside.sum(axis=1, keepdims=True))
