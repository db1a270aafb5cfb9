"""Closest points of a mesh to positions in space."""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np

from heat_igl.errors import SourceError, real_numbers
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.mesh.surface_points import ON_SIDE_COMPUTED, SurfacePoints, require_triangles
from heat_igl.typing import ArrayLike, FloatArray

# A face is flat when twice its area is at most this share of the square of the longest side.
_FLAT = 1e-12
# The square of a larger coordinate, summed over three, may overflow; libigl then returns a face that is none.
_FARTHEST = 1e150


class ClosestPoints(NamedTuple):
    """Points on a mesh, and their distances from the positions that they are closest to.

    Attributes
    ----------
    points : SurfacePoints
        k points.
    gap : (k,) float64
        Distance in space between each point and the position found.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(4)  # the unit square
    >>> found = heat_igl.closest_points(mesh, [[0.3, 0.6, 2.0], [0.5, 4.0, 0.0]])
    >>> found.gap.tolist()
    [2.0, 3.0]
    >>> found.points.positions(mesh).round(6).tolist()
    [[0.3, 0.6, 0.0], [0.5, 1.0, 0.0]]
    """

    points: SurfacePoints
    gap: FloatArray


def closest_points(mesh: MeshLike, positions: ArrayLike) -> ClosestPoints:
    """The closest points of a triangle mesh to positions in space.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    positions : (k, 3) or (3,) array_like
        Positions in the mesh's unit; (k, 2) in the plane z = 0.

    Returns
    -------
    ClosestPoints
        A point for each position, and the gap between them.

    Raises
    ------
    SourceError
        If positions have the wrong shape or are not finite, or the mesh is tetrahedral.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(4)
    >>> found = heat_igl.closest_points(mesh, 3 * mesh.V[:5])  # straight above five vertices of the unit sphere
    >>> bool(np.allclose(found.points.positions(mesh), mesh.V[:5])), found.gap.round(6).tolist()
    (True, [2.0, 2.0, 2.0, 2.0, 2.0])
    """
    mesh = as_simplices(mesh)
    return Projector(mesh).project(checked_points(positions))


def points_beside(mesh: Mesh, positions: ArrayLike, name: str = "positions") -> SurfacePoints:
    """The closest points of a triangle mesh to positions (k, 3) or (3,) that lie beside it, such as clicked ones.

    Raises
    ------
    SourceError
        As for `closest_points`, or if one of the positions, called `name`, is farther from the surface than the mean
        length of an edge.
    """
    found, nearness = closest_points(mesh, positions), float(mesh.edge_lengths.mean())
    far = np.flatnonzero(found.gap > nearness)
    if len(far):
        raise SourceError(
            f"{name}[{far[0]}] is {found.gap[far[0]]:.3g} away from the surface ({len(far)} of {len(found.gap)} are "
            f"farther than {nearness:.3g}, the mean length of an edge): pass closest_points(mesh, {name}).points"
        )
    return found.points


def checked_points(positions: ArrayLike) -> FloatArray:
    """`positions` as a new (k, 3) float64 array, k at least 1; the errors are those of `closest_points`."""
    array = rows_in_space("positions", positions)
    if not len(array):
        raise SourceError(f"positions must have shape (k, 3), a row for each, not {array.shape}")
    wrong = ~np.isfinite(array).all(axis=1)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise SourceError(f"positions[{first}] = {array[first].tolist()} is not finite")
    far = (abs(array) > _FARTHEST).any(axis=1)
    if far.any():
        first = int(np.flatnonzero(far)[0])
        raise SourceError(
            f"positions[{first}] = {array[first].tolist()} is too far away: coordinates end at {_FARTHEST:.0e}, so "
            "that squares do not overflow"
        )
    return array


def rows_in_space(name: str, rows: ArrayLike) -> FloatArray:
    """Positions or vectors as a new (k, 3) float64 array: of shape (k, 3), (k, 2) in the plane z = 0, or one row.

    Raises
    ------
    SourceError
        If `rows`, called `name`, are no real numbers, or have another shape.
    """
    array = np.atleast_2d(real_numbers(name, rows, SourceError))
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise SourceError(f"{name} must have shape (k, 3), a row for each, or (k, 2) in the plane, not {array.shape}")
    return np.pad(array, ((0, 0), (0, 3 - array.shape[1])))


class Projector:
    """Closest points on one mesh, for any number of queries."""

    def __init__(self, mesh: Mesh) -> None:
        require_triangles(mesh)
        self._mesh = mesh
        self._tree = igl.AABB()
        self._tree.init(mesh.V, mesh.F)

    def project(self, positions: FloatArray) -> ClosestPoints:
        """The closest points to `positions` (k, 3)."""
        mesh = self._mesh
        _, faces, closest = self._tree.squared_distance(mesh.V, mesh.F, np.ascontiguousarray(positions))
        faces = np.asarray(faces, np.int64).ravel()
        points = SurfacePoints(faces, _barycentric(mesh.V[mesh.F[faces]], np.atleast_2d(closest)))
        return ClosestPoints(points, np.linalg.norm(points.positions(mesh) - positions, axis=1))


def _barycentric(corners: FloatArray, p: FloatArray) -> FloatArray:
    """Barycentric coordinates (k, 3) of points `p` (k, 3) in triangles (k, 3, 3), which may have no area."""
    rows = np.arange(len(p))
    following, preceding = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    doubled = np.linalg.norm(np.cross(following - p[:, None], preceding - p[:, None]), axis=2)
    edge = preceding - following  # opposite each corner
    lengths = np.linalg.norm(edge, axis=2)
    total = doubled.sum(axis=1)
    flat = total <= _FLAT * lengths.max(axis=1) ** 2
    inside = doubled / np.where(flat, 1, total)[:, None]
    # In a triangle without area, every point lies on the longest side.
    c = lengths.argmax(axis=1)
    tail, along = following[rows, c], edge[rows, c]
    share = np.clip(np.einsum("kx,kx->k", p - tail, along) / np.maximum(lengths[rows, c] ** 2, 1e-300), 0, 1)
    on_side = np.zeros((len(p), 3))
    on_side[rows, (c + 1) % 3], on_side[rows, (c + 2) % 3] = 1 - share, share
    barycentric = np.where(flat[:, None], on_side, inside)
    barycentric[barycentric < ON_SIDE_COMPUTED] = 0
    return np.asarray(barycentric / barycentric.sum(axis=1, keepdims=True))
