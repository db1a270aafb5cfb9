"""Points and vertices as places in faces, for the kernels of paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.mesh import ON_SIDE, Mesh, SurfacePoints
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import FloatArray, IntArray

# Vertices, points, or a sequence of both.
Waypoints = Sources | Sequence[int | SurfacePoints]


def places(name: str, mesh: Mesh, points: Sources, corner_at: IntArray | None = None) -> tuple[IntArray, FloatArray]:
    """Faces (k,) and barycentric coordinates (k, 3) of points, or of vertices in the order given.

    `name` is the name of the argument, for messages; `corner_at`, the result of `corners`, saves time in many calls.
    """
    if isinstance(points, SurfacePoints):
        try:
            points.positions(mesh)  # which checks the faces
        except SourceError as error:
            raise SourceError(f"{name}: {error}") from None
        return points.faces, snapped(points.barycentric)
    vertex = mesh.originals[named_vertices(points, mesh.n_vertices, name)]
    corner = (corners(mesh) if corner_at is None else corner_at)[vertex]
    if (corner < 0).any():
        first = int(np.argmax(corner < 0))
        raise SourceError(f"{name}[{first}] = {vertex[first]} is a vertex that no face uses: no path starts there")
    return corner // 3, np.eye(3)[corner % 3]


def corners(mesh: Mesh) -> IntArray:
    """A corner (n,) at each vertex, -1 if no face uses it."""
    corner_at = np.full(mesh.n_vertices, -1)
    corner_at[mesh.F.ravel()] = np.arange(mesh.F.size)
    return corner_at


def mixed_places(
    name: str, mesh: Mesh, points: Waypoints, corner_at: IntArray | None = None
) -> tuple[IntArray, FloatArray]:
    """The same for a sequence that holds both vertices and `SurfacePoints`."""
    if not isinstance(points, Sequence) or not any(isinstance(point, SurfacePoints) for point in points):
        return places(name, mesh, cast(Sources, points), corner_at)
    parts = []
    for i, point in enumerate(points):
        if not isinstance(point, SurfacePoints | int | np.integer):
            raise SourceError(f"{name}[{i}] must be a vertex or SurfacePoints, not {type(point).__name__}")
        parts.append(places(f"{name}[{i}]", mesh, cast(Sources, point), corner_at))
    return np.concatenate([faces for faces, _ in parts]), np.concatenate([weights for _, weights in parts])


def snapped(barycentric: FloatArray) -> FloatArray:
    """Barycentric coordinates with those below `ON_SIDE` set to 0."""
    weights = np.where(barycentric < ON_SIDE, 0.0, barycentric)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
