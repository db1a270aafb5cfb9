"""Signed distance integrated from the normals of curves and points: the three steps of the signed heat method."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import TypeVar

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.heat.curve_levels import CurveLevels, Level, Pieces
from heat_igl.heat.parts import SolverParts
from heat_igl.intrinsic import IntrinsicTriangulation, intrinsic_gradient, lay_out
from heat_igl.mesh import Mesh
from heat_igl.operators import divergence_matrix, edge_rotations, face_rotations
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, both
from heat_igl.sources import OrientedSet
from heat_igl.steps import VectorHeatFlow
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["NormalIntegration"]

Other = TypeVar("Other")

# Normals that sum to less than this share of the length of the curves have cancelled.
_CANCELLED = 1e-9


class NormalIntegration:
    """Diffuses the normals of oriented sources, and integrates the field of unit vectors (Feng and Crane 2024).

    Parameters
    ----------
    mesh : Mesh
        Triangles that are oriented alike.
    faces : IntrinsicTriangulation
        The same triangles by the lengths of their edges.
    triangulation : IntrinsicTriangulation
        The triangles that are solved on.
    parts : SolverParts
        The heat flow on these, the options, and the Poisson problem.
    """

    def __init__(
        self, mesh: Mesh, faces: IntrinsicTriangulation, triangulation: IntrinsicTriangulation, parts: SolverParts
    ) -> None:
        domain, backend = parts.operators, parts.options.backend
        self._V, self._F, self._n = mesh.V, mesh.F, mesh.n_vertices
        self._faces, self._triangulation = faces, triangulation
        self._mean_edge_length = domain.mean_edge_length
        self._poisson = parts.last_steps.poisson
        self._vector_flow = VectorHeatFlow(
            domain, edge_rotations(domain), _one_or_all(parts.time_steps), backend, parts.fitted
        )
        self._rotations = face_rotations(domain)
        gradient = intrinsic_gradient(triangulation).tocsr()
        self._D = divergence_matrix(gradient, triangulation.areas)
        self._levels = CurveLevels(domain, mesh.F, parts.heat_flow, self._poisson)

    def distance(self, chosen: OrientedSet, level: Level) -> FloatArray:
        """The signed distance (n,): steps 1 to 3 of the method, less the level.

        Raises
        ------
        SourceError
            If the normals of all curves cancel, or one of a point is that of the face.
        """
        pieces = self._pieces(chosen)
        phi = self._integrated(pieces)
        return phi - self._levels.of(phi, pieces, level)

    def distance_beside(
        self, other: Callable[[], Other], chosen: OrientedSet, level: Level
    ) -> tuple[Other, FloatArray]:
        """The result of a shorter computation, which runs on a thread of its own, and `distance`."""
        pieces = self._pieces(chosen)

        def integrated() -> tuple[FloatArray, FloatArray]:
            phi = self._integrated(pieces)
            smooth, rest = self._levels.smooth(phi, pieces, level)
            return phi - smooth, rest

        # The level needs that heat as well, and the other thread has less to do.
        (found, heat), (phi, rest) = both(lambda: (other(), self._levels.heat(pieces)), integrated)
        return found, phi if level == "none" else phi - self._levels.extended(rest, pieces, heat)

    def _integrated(self, pieces: Pieces) -> FloatArray:
        """The signed distance (n,) up to a level."""
        # Step 1: diffuse the normals, integrated against the hat functions.
        corners = self._F[pieces.faces]
        share = pieces.weight[:, None] * pieces.barycentric
        at_corners = share * pieces.normal[:, None] * self._rotations.of_faces[pieces.faces].conj()
        b = np.zeros(self._n, complex)
        np.add.at(b, corners, at_corners)
        largest = np.abs(b).max()
        if largest <= _CANCELLED * share.max():
            raise SourceError(
                "the normals of the curves cancel: two curves run along each other in opposite directions"
            )
        Y = self._vector_flow.solve(b / largest * SOURCE_HEAT)
        # Step 2: the unit field in faces.
        # Dividing by the largest first keeps squares in range. Corner by corner is faster than along an axis of three.
        at_vertices = np.abs(Y)
        size = reduce(np.maximum, (at_vertices[corner] for corner in self._triangulation.F.T))
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > LOWEST_HEAT)
        turned = zip(self._rotations.of_triangulation.T, self._triangulation.F.T, strict=True)
        X = _unit(reduce(np.add, (rotation * (scale * Y[corner]) for rotation, corner in turned)))
        # Step 3: L phi = D X.
        return self._poisson.solve(self._D @ np.concatenate([X.real, X.imag]))

    def _pieces(self, chosen: OrientedSet) -> Pieces:
        """Segments and points with their normals in the planes of their faces."""
        flat = lay_out(self._faces.l[chosen.faces]) @ np.array([1, 1j])
        along = np.einsum("sc,sc->s", chosen.end - chosen.start, flat)
        length = np.abs(along)
        corners = self._V[self._F[chosen.point_faces]]
        x, other = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        y = np.cross(np.cross(x, other), x)
        at_points = [np.einsum("kx,kx->k", axis, chosen.normals) / np.linalg.norm(axis, axis=1) for axis in (x, y)]
        normal = at_points[0] + 1j * at_points[1]
        across = np.abs(normal) <= _CANCELLED * np.linalg.norm(chosen.normals, axis=1)
        if across.any():
            first = int(np.argmax(across))
            raise SourceError(
                f"normals[{first}] is that of the face, and has no direction on the surface "
                f"({int(across.sum())} normals are like that): give the normals of the curve that the points sample"
            )
        return Pieces(
            np.concatenate([chosen.faces, chosen.point_faces]),
            np.concatenate([(chosen.start + chosen.end) / 2, chosen.point_barycentric]),
            # To the right of a segment is its direction turned by -90 degrees.
            np.concatenate([-1j * _unit(along), _unit(normal)]),
            np.concatenate([length, np.full(len(normal), self._mean_edge_length)]),
            np.concatenate([chosen.label, chosen.point_label]),
            np.arange(len(chosen.faces) + len(normal)) >= len(chosen.faces),
        )


def _one_or_all(steps: FloatArray) -> float | FloatArray:
    """Time steps (n_components,) as one number if they are equal."""
    return float(steps[0]) if (steps == steps[0]).all() else np.array(steps)


def _unit(numbers: AnyArray) -> AnyArray:
    """Complex numbers divided by their size; 0 stays."""
    size = np.abs(numbers)
    return np.divide(numbers, size, out=np.zeros_like(numbers), where=size > 0)
