"""Points and curves on a triangle mesh, given by faces and barycentric coordinates, and closest points to positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import igl
import numpy as np

from heat_igl.errors import SourceError, as_array, raise_at_first, real_numbers, truth
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices, as_triangles
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# A point lies on a side of the face if a barycentric coordinate is below this. For given coordinates: numbers of
# order 1, rounded by some 1e-16 in each operation; 1e-12 allows for thousands of these.
ON_SIDE = 1e-12
# The same for coordinates computed from positions or lengths. A position at the distance R from the origin is rounded
# by 1e-16 R, and that is 1e-9 of the height of a face as small as 1e-7 R. A user may have computed coordinates like
# that, so they may also be negative, or miss a sum of 1, by this much.
ON_SIDE_COMPUTED = 1e-9

# A face is flat when twice its area is at most this share of the square of the longest side.
_FLAT = 1e-12
# The square of a larger coordinate, summed over three, may overflow; libigl then returns a face that is none.
_FARTHEST = 1e150


@dataclass(frozen=True, eq=False, repr=False)
class SurfacePoints:
    """Points on a triangle mesh.

    Parameters
    ----------
    faces : (k,) array_like of int
        The face of each point; the point may lie on a side or corner of it.
    barycentric : (k, 3) array_like
        Weights of the three corners: not negative, sum 1.

    Raises
    ------
    SourceError
        If an array has the wrong shape, a coordinate is not finite or negative, or a sum is not 1 to 1e-9; the message
        names the first such point.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.Mesh([[0, 0, 0], [6, 0, 0], [0, 8, 0]], [[0, 1, 2]])
    >>> point = heat_igl.SurfacePoints([0], [[0, 0.5, 0.5]])
    >>> point.positions(mesh).tolist()
    [[3.0, 4.0, 0.0]]
    >>> heat_igl.geodesic_distance(mesh, point).tolist()
    [5.0, 5.0, 5.0]
    """

    faces: IntArray
    barycentric: FloatArray

    def __post_init__(self) -> None:
        faces = _face_indices("faces", self.faces)
        vars(self).update(faces=faces, barycentric=_coordinates("barycentric", self.barycentric, len(faces)))

    def __len__(self) -> int:
        return len(self.faces)

    def __repr__(self) -> str:
        return f"SurfacePoints({len(self)} points)"

    def positions(self, mesh: MeshLike) -> FloatArray:
        """Positions (k, 3) of the points in space.

        Raises
        ------
        SourceError
            If a face is not one of the mesh, or the mesh is tetrahedral.
        """
        return _in_space(mesh, self, self.barycentric)[0]


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceCurve:
    """A polyline on a triangle mesh, each straight segment inside one face; errors are those of `SurfacePoints`.

    Parameters
    ----------
    faces : (s,) array_like of int
        The face of each segment.
    start, end : (s, 3) array_like
        Barycentric coordinates, in that face, of the ends of the segment. Each segment starts at the point at which the
        segment before it ends, though mostly in another face.
    is_closed : bool
        Whether the last segment ends at the start of the first.
    mesh : mesh, optional
        The mesh that the curve lies on, for `length` and `points`. Curves made by functions of this package have it.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.Mesh([[0, 0, 0], [6, 0, 0], [0, 8, 0]], [[0, 1, 2]])
    >>> middle = heat_igl.SurfaceCurve([0], [[0.5, 0.5, 0]], [[0.5, 0, 0.5]], mesh=mesh)
    >>> middle.length, middle.points.tolist()
    (5.0, [[3.0, 0.0, 0.0], [0.0, 4.0, 0.0]])
    >>> heat_igl.geodesic_distance(mesh, middle).round(6).tolist()
    [2.4, 3.0, 4.0]
    """

    faces: IntArray
    start: FloatArray
    end: FloatArray
    is_closed: bool = False
    mesh: Mesh | None = None

    def __post_init__(self) -> None:
        faces = _face_indices("faces", self.faces)
        ends = {name: _coordinates(name, getattr(self, name), len(faces)) for name in ("start", "end")}
        mesh, is_closed = self.mesh, truth("is_closed", self.is_closed)
        vars(self).update(ends, faces=faces, is_closed=is_closed, mesh=None if mesh is None else as_simplices(mesh))

    def __len__(self) -> int:
        return len(self.faces)

    def __repr__(self) -> str:
        return f"SurfaceCurve({len(self)} segments, {'closed' if self.is_closed else 'open'})"

    def positions(self, mesh: MeshLike | None = None) -> FloatArray:
        """Positions (s + 1, 3) of the corners of the polyline on `mesh`; on a closed curve the last is the first again.

        Without `mesh`, on the curve's own. Errors are those of `SurfacePoints.positions`, and a ValueError if the curve
        does not know its mesh.
        """
        mesh = self.mesh if mesh is None else mesh
        if mesh is None:
            raise ValueError("this curve does not know its mesh: name it, as in curve.positions(mesh)")
        start, end = _in_space(mesh, self, self.start, self.end)
        return np.concatenate([start[:1], end])

    def lengths(self, mesh: MeshLike | None = None) -> FloatArray:
        """Length (s,) of each segment on `mesh`, in the unit of the mesh; mesh and errors as for `positions`."""
        return np.asarray(np.linalg.norm(np.diff(self.positions(mesh), axis=0), axis=1))

    @property
    def points(self) -> FloatArray:
        """Positions (s + 1, 3) of the corners on the curve's own mesh, see `positions`."""
        return self.positions()

    @property
    def length(self) -> float:
        """Length on the curve's own mesh, in the unit of the mesh."""
        return float(self.lengths().sum())

    def reversed(self) -> SurfaceCurve:
        """The same curve in the other direction; what was on the left is on the right."""
        return unchecked_curve(
            self.faces[::-1].copy(), self.end[::-1].copy(), self.start[::-1].copy(), self.is_closed, self.mesh
        )

    def on(self, mesh: Mesh) -> SurfaceCurve:
        """The same curve with `mesh` as its own."""
        return unchecked_curve(self.faces, self.start, self.end, self.is_closed, mesh)


def unchecked_curve(
    faces: IntArray, start: FloatArray, end: FloatArray, is_closed: bool, mesh: Mesh | None = None
) -> SurfaceCurve:
    """A `SurfaceCurve` of int64 faces (s,), and float64 coordinates (s, 3) that are known to be right."""
    curve = object.__new__(SurfaceCurve)
    vars(curve).update(faces=faces, start=start, end=end, is_closed=is_closed, mesh=mesh)
    return curve


def unchecked_points(faces: IntArray, barycentric: FloatArray) -> SurfacePoints:
    """`SurfacePoints` of int64 faces (k,), and float64 coordinates (k, 3) that are known to be right."""
    points = object.__new__(SurfacePoints)
    vars(points).update(faces=faces, barycentric=barycentric)
    return points


# A curve, or curves in lists of any depth.
NestedCurves = SurfaceCurve | Sequence["NestedCurves"]


def named_entries(nested: object, name: str) -> list[tuple[str, Any]]:
    """The entries of nested lists, one after another, each with the name that an error gives it.

    A text and a list that begins with a bool, which is a mask, are entries.
    """
    if not isinstance(nested, Sequence) or isinstance(nested, str):
        return [(name, nested)]
    if len(nested) and isinstance(nested[0], (bool, np.bool_)):
        return [(name, nested)]
    return [entry for i, part in enumerate(nested) for entry in named_entries(part, f"{name}[{i}]")]


def flat_curves(curves: NestedCurves, place: str = "curves") -> list[SurfaceCurve]:
    """The curves of nested lists at `place`, one after another; a TypeError names the first entry that is none."""
    entries = named_entries(curves, place)
    for name, entry in entries:
        if not isinstance(entry, SurfaceCurve):
            raise TypeError(f"{name} must be a SurfaceCurve or a list of such, not {type(entry).__name__}")
    return [entry for _, entry in entries]


def _face_indices(name: str, faces: ArrayLike) -> IntArray:
    given = np.atleast_1d(as_array(name, faces, SourceError))
    if given.ndim != 1 or given.dtype.kind not in "iu" or not len(given):
        raise SourceError(f"{name} must be one face index or more, not {given.dtype} of shape {given.shape}")
    return np.array(given, dtype=np.int64)


def _coordinates(name: str, barycentric: ArrayLike, k: int) -> FloatArray:
    array = np.atleast_2d(real_numbers(name, barycentric, SourceError))
    if array.shape != (k, 3):
        raise SourceError(f"{name} must have shape ({k}, 3), a row for each face, not {array.shape}")
    # By columns: along rows of three numbers, numpy takes ten times as long.
    a, b, c = array.T
    wrong = ~(np.isfinite(a + b + c) & (np.minimum(np.minimum(a, b), c) >= -ON_SIDE_COMPUTED))
    raise_at_first(wrong, name, array, "must be finite and not negative", error=SourceError)
    missed = np.abs(a + b + c - 1) > ON_SIDE_COMPUTED
    remedy = f"it sums to {array[missed.argmax()].sum():.12g}"
    raise_at_first(missed, name, array, "must sum to 1", remedy, SourceError)
    array = np.maximum(array, 0.0)
    a, b, c = array.T
    return np.asarray(array / (a + b + c)[:, None])


def require_faces(places: SurfacePoints | SurfaceCurve, F: IntArray, V: FloatArray | None, place: str = "") -> None:
    """Raise a `SourceError` that begins with `place` if a face is none of F, or another one on a curve's own mesh.

    Faces are the same if their corners have the same numbers, or the same positions V, if these are known.
    """
    faces, n = places.faces, len(F)
    raise_at_first(
        (faces < 0) | (faces >= n),
        f"{place}faces",
        faces,
        "must be a face",
        f"indices run from 0 to {n - 1}",
        SourceError,
    )
    own = places.mesh if isinstance(places, SurfaceCurve) else None
    if own is not None and own.F is not F:
        theirs = np.take(own.F, faces, axis=0, mode="clip")
        other = (theirs != F[faces]).any(axis=1)
        if V is not None:
            other &= (own.V[theirs] != V[F[faces]]).any(axis=(1, 2))
        problem = "is not the triangle that it is on the curve's own mesh"
        raise_at_first(other, f"{place}faces", faces, problem, "curve_on(mesh, curve.points) puts it here", SourceError)


def _in_space(mesh: MeshLike, places: SurfacePoints | SurfaceCurve, *barycentric: FloatArray) -> list[FloatArray]:
    """Positions (k, 3) on the faces of `places` for each array of coordinates (k, 3)."""
    mesh = as_triangles(mesh, "points on faces need", SourceError)
    require_faces(places, mesh.F, mesh.V)
    corners = mesh.V[mesh.F[places.faces]]
    return [np.asarray(np.einsum("kc,kcx->kx", weights, corners)) for weights in barycentric]


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
    mesh = as_triangles(mesh, "points on faces need", SourceError)
    return Projector(mesh).project(checked_points("positions", positions))


def points_beside(mesh: Mesh, positions: ArrayLike, name: str = "positions") -> SurfacePoints:
    """The closest points of a triangle mesh to positions (k, 3) or (3,) near it, for instance of mouse clicks.

    Errors are those of `closest_points`, and a SourceError if one of the positions, called `name`, is farther from the
    surface than the mean length of an edge.
    """
    mesh = as_triangles(mesh, "points on faces need", SourceError)
    found, nearness = Projector(mesh).project(checked_points(name, positions)), float(mesh.edge_lengths.mean())
    far = np.flatnonzero(found.gap > nearness)
    if len(far):
        raise SourceError(
            f"{name}[{far[0]}] is {found.gap[far[0]]:.3g} away from the surface ({len(far)} of {len(found.gap)} are "
            f"farther than {nearness:.3g}, the mean length of an edge): pass closest_points(mesh, {name}).points"
        )
    return found.points


def checked_points(name: str, positions: ArrayLike) -> FloatArray:
    """`positions` as a new (k, 3) float64 array, k at least 1; errors are those of `closest_points` and say `name`."""
    array = rows_in_space(name, positions)
    if not len(array):
        raise SourceError(f"{name} must have shape (k, 3), a row for each, not {array.shape}")
    raise_at_first(~np.isfinite(array).all(axis=1), name, array, "must be finite", error=SourceError)
    far, remedy = (abs(array) > _FARTHEST).any(axis=1), "so that squares do not overflow"
    raise_at_first(far, name, array, f"must be within {_FARTHEST:.0e}", remedy, SourceError)
    return array


def rows_in_space(name: str, rows: ArrayLike) -> FloatArray:
    """Positions or vectors as a new (k, 3) float64 array: of shape (k, 3), (k, 2) in the plane z = 0, or one row.

    A SourceError if `rows`, called `name`, are no real numbers, or have another shape.
    """
    array = np.atleast_2d(real_numbers(name, rows, SourceError))
    if array.ndim != 2 or array.shape[1] not in (2, 3):
        raise SourceError(f"{name} must have shape (k, 3), a row for each, or (k, 2) in the plane, not {array.shape}")
    return np.pad(array, ((0, 0), (0, 3 - array.shape[1])))


class Projector:
    """Closest points on one mesh, for any number of queries."""

    def __init__(self, mesh: Mesh) -> None:
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
