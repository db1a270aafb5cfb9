"""Oriented sources: directed curves with a left and a right, boundaries of regions, and points with normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heat_igl.errors import SourceError, errors_at, raise_at_first
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints, named_entries, region_boundary
from heat_igl.mesh.surface_points import require_faces, rows_in_space
from heat_igl.sources.source_sets import NO_POINTS, NO_SEGMENTS, concatenated, on_simplex
from heat_igl.typing import AnyArray, FloatArray, IntArray

_ACCEPTED = (
    "a SurfaceCurve, OrientedPoints, a mask of the faces or of the vertices of a region, or a list of these kinds"
)


@dataclass(frozen=True, eq=False, repr=False)
class OrientedPoints:
    """Points on a triangle mesh with normals: samples of a curve that has a left and a right.

    Parameters
    ----------
    points : SurfacePoints
        The k points.
    normals : (k, 3) or (k, 2) array_like
        Vectors in space that point to the positive side, of any length but 0; the part along the normal of the face is
        left out. Two columns are x and y of vectors in the plane z = 0.

    Raises
    ------
    SourceError
        If `normals` has another shape, or a row is 0 or not finite; the message names the first such row.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.grid(16)
    >>> places = heat_igl.closest_points(mesh, [[0.5, y, 0] for y in np.linspace(0, 1, 17)]).points
    >>> wall = heat_igl.OrientedPoints(places, [[1, 0, 0]] * 17)  # the positive side is on the right
    >>> phi = heat_igl.SignedHeatSolver(mesh).distance(wall)
    >>> bool(np.array_equal(phi > 0.05, mesh.V[:, 0] > 0.51))
    True
    """

    points: SurfacePoints
    normals: FloatArray

    def __post_init__(self) -> None:
        if not isinstance(self.points, SurfacePoints):
            raise SourceError(
                f"points must be SurfacePoints, not {type(self.points).__name__}: closest_points(mesh, P).points finds "
                "those of positions"
            )
        normals = rows_in_space("normals", self.normals)
        if len(normals) != len(self.points):
            raise SourceError(f"normals must have shape ({len(self.points)}, 3), not {np.shape(self.normals)}")
        wrong = ~(np.isfinite(normals).all(axis=1) & normals.any(axis=1))
        raise_at_first(wrong, "normals", normals, "must be finite and not 0", error=SourceError)
        object.__setattr__(self, "normals", normals)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        return f"OrientedPoints({len(self)} points)"


# A list may hold several kinds, and lists.
Oriented = SurfaceCurve | OrientedPoints | Sequence[Any] | AnyArray


@dataclass(frozen=True, eq=False)
class OrientedSet:
    """Oriented sources, checked: directed segments (s,) in faces, negative on their left, and points (k,) with normals.

    Labels count curves, regions and sets of points.
    """

    faces: IntArray
    start: FloatArray
    end: FloatArray
    label: IntArray
    point_faces: IntArray
    point_barycentric: FloatArray
    point_label: IntArray
    normals: FloatArray

    def unoriented(self) -> list[SurfaceCurve | SurfacePoints]:
        """The same places as sources of a distance without a sign."""
        places: list[SurfaceCurve | SurfacePoints] = []
        if len(self.faces):
            places.append(SurfaceCurve(self.faces, self.start, self.end))
        if len(self.point_faces):
            places.append(SurfacePoints(self.point_faces, self.point_barycentric))
        return places


def oriented_set(curves: Oriented, mesh: Mesh) -> OrientedSet:
    """The oriented sources of a user as one checked object; a `SourceError` names the first that is wrong.

    A source is a `SurfaceCurve` with a length, `OrientedPoints`, a bool mask of the faces (m,) or vertices (n,) of a
    region, or a list of these, which may be nested.
    """
    parts = named_entries(curves, "curves")
    if not parts:
        raise SourceError(f"curves is empty: pass {_ACCEPTED}")
    segments = [NO_SEGMENTS[:4]]
    points = [(*NO_POINTS[:3], np.empty((0, 3)))]
    for i, (name, part) in enumerate(parts):
        if isinstance(part, OrientedPoints):
            require_faces(part.points, mesh.F, mesh.V, f"{name}: ")
            label = np.full(len(part), i)
            points.append((part.points.faces, on_simplex(part.points.barycentric), label, part.normals))
        else:
            faces, start, end = _segments(name, part, mesh)
            segments.append((faces, start, end, np.full(len(faces), i)))
    return OrientedSet(*concatenated(segments), *concatenated(points))


def _segments(name: str, part: object, mesh: Mesh) -> tuple[IntArray, FloatArray, FloatArray]:
    """The segments of positive length of a curve, or of the boundary of a region."""
    if isinstance(part, SurfaceCurve):
        require_faces(part, mesh.F, mesh.V, f"{name}: ")
        start, end = on_simplex(part.start), on_simplex(part.end)
        kept = (start != end).any(axis=1)
        if not kept.any():
            raise SourceError(f"{name} has no length, and so neither left nor right: give points with normals instead")
        return part.faces[kept], start[kept], end[kept]
    mask = np.asarray(part) if isinstance(part, (np.ndarray, list, tuple)) else None
    if mask is None or mask.dtype.kind != "b":
        raise SourceError(f"{name} must be {_ACCEPTED}, not {type(part).__name__}")
    n, m = mesh.n_vertices, mesh.n_faces
    if mask.shape not in ((n,), (m,)) or n == m:
        why = "which is both here: pass region_boundary(mesh, faces=mask) or (mesh, vertices=mask)"
        raise SourceError(
            f"{name} is a mask of shape {mask.shape}; it must have {n} entries for vertices or {m} for faces"
            + (f", {why}" if n == m else "")
        )
    with errors_at(name):
        loops = region_boundary(mesh, vertices=mask) if len(mask) == n else region_boundary(mesh, faces=mask)
    faces, start, end = concatenated([(loop.faces, loop.start, loop.end) for loop in loops])
    return faces, start, end
