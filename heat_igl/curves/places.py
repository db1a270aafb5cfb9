"""Points and vertices as places in faces, for the kernels of paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from heat_igl.errors import SourceError, raise_at_first
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.mesh.connectivity import group_by_label
from heat_igl.mesh.surface_points import points_beside, require_faces
from heat_igl.sources import Sources, are_positions, named_vertices
from heat_igl.sources.source_sets import on_simplex
from heat_igl.typing import FloatArray, IntArray

# Vertices, points, or a sequence of both.
Waypoints = Sources | Sequence[int | SurfacePoints]


def checked_places(
    name: str, mesh: Mesh, points: Waypoints, corner_at: IntArray | None = None
) -> tuple[IntArray, FloatArray]:
    """Faces (k,) and barycentric coordinates (k, 3) of points, of vertices in their order, or of a sequence of both.

    `name` is the name of the argument, for messages; `corner_at`, the result of `corners`, saves time in many calls.
    """
    if isinstance(points, SurfacePoints):
        require_faces(points, mesh.F, mesh.V, f"{name}: ")
        return points.faces, on_simplex(points.barycentric)
    if isinstance(points, Sequence) and any(isinstance(point, SurfacePoints) for point in points):
        parts = []
        for i, point in enumerate(points):
            if not isinstance(point, SurfacePoints | int | np.integer):
                raise SourceError(f"{name}[{i}] must be a vertex or SurfacePoints, not {type(point).__name__}")
            parts.append(checked_places(f"{name}[{i}]", mesh, point, corner_at))
        return np.concatenate([faces for faces, _ in parts]), np.concatenate([weights for _, weights in parts])
    rows = isinstance(points, np.ndarray | list | tuple) and len(points) > 0 and np.ndim(points[0]) == 1
    if rows or are_positions(points):
        return checked_places(name, mesh, points_beside(mesh, points, name))  # type: ignore[arg-type]
    vertex = mesh.originals[named_vertices(cast(Sources, points), mesh.n_vertices, name)]
    corner = (corners(mesh) if corner_at is None else corner_at)[vertex]
    raise_at_first(corner < 0, name, vertex, "is no vertex that a face uses", "no path starts there", SourceError)
    return corner // 3, np.eye(3)[corner % 3]


def corners(mesh: Mesh) -> IntArray:
    """A corner (n,) at each vertex, -1 if no face uses it."""
    corner_at = np.full(mesh.n_vertices, -1)
    corner_at[mesh.F.ravel()] = np.arange(mesh.F.size)
    return corner_at


class CommonFaces:
    """Finds faces of a mesh that hold several vertices."""

    def __init__(self, mesh: Mesh) -> None:
        self._mesh, self._around = mesh, group_by_label(mesh.F.ravel(), mesh.n_vertices)

    def of(self, vertices: IntArray) -> int:
        """The first face that has all these vertices, or -1."""
        first, corner = self._around
        found = [set((corner[first[v] : first[v + 1]] // 3).tolist()) for v in np.unique(vertices).tolist()]
        return min(set.intersection(*found), default=-1)

    def around(self, faces: IntArray, barycentric: FloatArray) -> tuple[int, FloatArray]:
        """The first face that holds two places, by faces (2,) and coordinates (2, 3), and those in it; or face -1."""
        corners = self._mesh.F[faces]
        face = int(faces[0]) if faces[0] == faces[1] else self.of(corners[barycentric > 0])
        here = self._mesh.F[face][None, :, None] == corners[:, None]
        return face, np.einsum("kij,kj->ki", here, barycentric)
