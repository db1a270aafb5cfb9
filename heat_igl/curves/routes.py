"""Shortest ways along edges between places on a mesh: the first course of a path."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.curves.shortening import FaceSequence
from heat_igl.errors import SourceError
from heat_igl.kernels.paths import routes
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

# The compiled module, whose signatures are those of Cython.
kernel: Any = routes


class Router:
    """Finds courses through places on a mesh; the tables are made once. Each thread needs an object of its own."""

    def __init__(self, mesh: Mesh, faces: Any) -> None:
        self._mesh = mesh
        self._routes = kernel.EdgeRoutes(faces, mesh.V)

    def legs(self, faces: IntArray, barycentric: FloatArray) -> list[FaceSequence]:
        """The k - 1 courses between places (k,), each from one to the next; a `SourceError` if no path leads there."""
        found = []
        for i in range(len(faces) - 1):
            vertices, between = self._leg(faces, barycentric, i)
            joins = np.full((len(vertices), 3), -1, np.int32)
            joins[:, 2] = vertices
            ends = faces[i : i + 2].astype(np.int32)
            found.append(FaceSequence(np.concatenate([ends[:1], between, ends[1:]]), joins, barycentric[i : i + 2]))
        return found

    def _leg(self, faces: IntArray, barycentric: FloatArray, i: int) -> tuple[AnyArray, AnyArray]:
        """Vertices on the way from place i to the next, and the faces between them; vertex -1 within one face."""
        if faces[i] == faces[i + 1]:
            return np.array([-1], np.int32), np.empty(0, np.int32)
        mesh = self._mesh
        corners, costs, points = [], [], []
        for j in (i, i + 1):
            vertices = mesh.F[faces[j]]
            point = barycentric[j] @ mesh.V[vertices]
            held = barycentric[j] > 0
            corners.append(vertices[held])
            costs.append(np.linalg.norm(mesh.V[vertices[held]] - point, axis=1))
            points.append(point)
        found = self._routes.route(corners[0], costs[0], corners[1], costs[1], points[1])
        if found is None:
            raise SourceError(
                f"no path leads from waypoints[{i}] to waypoints[{i + 1}]: they lie on different components of the mesh"
            )
        vertices, between = found
        return vertices, between
