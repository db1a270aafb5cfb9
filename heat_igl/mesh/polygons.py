"""Meshes of polygons, validated on construction."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from heat_igl.errors import MeshError, shown
from heat_igl.mesh.grouping import next_in_run
from heat_igl.mesh.mesh import Mesh, checked_positions
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray


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
    On polygons that are not planar, paths and near-exact distances are measured on `triangles`, and heat on the
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
    found = np.zeros(len(degree), bool)
    found[owner[order[1:][same]]] = True
    return found


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
