"""Short ways between places on a mesh, along edges and straight across them: the first course of a path."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.curves.shortening import Course
from heat_igl.curves.tracing import Surface, opposite_sides
from heat_igl.errors import SourceError
from heat_igl.kernels.paths import routes
from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["Router"]

# The compiled module, whose signatures are those of Cython.
kernel: Any = routes


def _straight_across(surface: Surface) -> tuple[FloatArray, AnyArray]:
    """The straight line from each corner of a triangulation to the corner across the edge opposite.

    Returns
    -------
    length : (3 m,) float64
        ``inf`` if the line misses the edge, or the edge has not two faces.
    opposite : (3 m,) int32
        The half-edge on the other side, -1 if the edge has not two faces.
    """
    triangle, opposite = surface.triangle, opposite_sides(surface)
    one = np.flatnonzero(opposite > np.arange(len(opposite)))
    other = opposite[one]
    length = np.full(len(opposite), np.inf)
    (x, y), (u, v), base = _apex(surface, one, one), _apex(surface, other, one), triangle["length"].reshape(-1)[one]
    with np.errstate(invalid="ignore"):
        crossing = (x * v + u * y) / (y + v)
        straight = np.where((crossing > 0) & (crossing < base), np.hypot(x - u, y + v), np.inf)
    length[one] = length[other] = straight
    return length, opposite


def _apex(surface: Surface, half_edge: AnyArray, base: AnyArray) -> tuple[FloatArray, FloatArray]:
    """The corner of each half-edge in the plane: along the edge from the first end of half-edge `base`, and above."""
    face, corner = np.divmod(half_edge, 3)
    begin = surface.triangle["vertex"][base // 3, (base % 3 + 1) % 3]
    lengths = surface.triangle["length"][face]
    rows = np.arange(len(face))
    after, before = (corner + 1) % 3, (corner + 2) % 3
    is_turned = surface.triangle["vertex"][face, after] != begin
    c = lengths[rows, corner]
    # Lengths are opposite the corners.
    to_begin = lengths[rows, np.where(is_turned, after, before)]
    to_end = lengths[rows, np.where(is_turned, before, after)]
    x = ((to_begin - to_end) * (to_begin + to_end) / c + c) / 2
    return x, np.sqrt(np.maximum((to_begin - x) * (to_begin + x), 0))


class Router:
    """Finds courses through places on a mesh; the tables are made once. Each thread needs an object of its own."""

    def __init__(self, mesh: Mesh, surface: Surface) -> None:
        self._mesh = mesh
        self._surface = surface
        self._roads = kernel.Roads(surface, *_straight_across(surface), mesh.V)

    def legs(self, faces: IntArray, barycentric: FloatArray, *, crosses: bool = True) -> list[Course]:
        """The k - 1 courses between places (k,), each from one to the next; without `crosses` along edges only.

        Raises
        ------
        SourceError
            If no path leads from a place to the next.
        """
        found = []
        for i in range(len(faces) - 1):
            between, joins = self._leg(faces, barycentric, i, crosses)
            ends = faces[i : i + 2].astype(np.int32)
            found.append(Course(np.concatenate([ends[:1], between, ends[1:]]), joins, barycentric[i : i + 2]))
        return found

    def _leg(self, faces: IntArray, barycentric: FloatArray, i: int, crosses: bool) -> tuple[AnyArray, AnyArray]:
        """Faces and joins from place i to the next."""
        if faces[i] == faces[i + 1]:
            return np.empty(0, np.int32), np.full((1, 3), -1, np.int32)
        mesh = self._mesh
        corners, costs, points = [], [], []
        for j in (i, i + 1):
            vertices = mesh.F[faces[j]]
            point = barycentric[j] @ mesh.V[vertices]
            held = barycentric[j] > 0
            corners.append(vertices[held])
            costs.append(np.linalg.norm(mesh.V[vertices[held]] - point, axis=1))
            points.append(point)
        found = self._roads.route(corners[0], costs[0], corners[1], costs[1], points[1], crosses)
        if found is None:
            raise SourceError(
                f"no path leads from waypoints[{i}] to waypoints[{i + 1}]: they lie on different components of the mesh"
            )
        between, joins = found
        return between, joins
