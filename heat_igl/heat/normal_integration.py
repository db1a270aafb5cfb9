"""Signed distance integrated from the normals of curves and points: the signed heat method's steps, and the level."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import Literal, NamedTuple, TypeVar

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import SourceError
from heat_igl.heat.parts import SolverParts
from heat_igl.intrinsic import IntrinsicTriangulation, lay_out
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators, TriangleElements, divergence_matrix, edge_rotations, face_rotations
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, both
from heat_igl.sources import OrientedSet
from heat_igl.steps import HeatFlow, PoissonProblem, VectorHeatFlow
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray

Other = TypeVar("Other")

# Normals that sum to less than this share of the length of the curves have cancelled.
_CANCELLED = 1e-9

Level = Literal["zero", "constant", "none"]

# Values on the curves are extended in so many rounds, each time what is left of them, times this factor: what a round
# leaves is rough, and the heat takes a mean of it. On random levels of five meshes one round leaves at most 0.047 mean
# edge lengths (root mean square), two 0.029 and four 0.016 without factors; with them two leave 0.023 and three 0.014.
# Each round takes a thirtieth of a query.
_LEVEL_FACTORS = (1.0, 1.4, 1.8)
# This share of the values on the curves is extended by a function of small gradient, the rest from the nearest place.
# On 40 broken curves (docs/signed_theory.md), 31, 37, 38, 38 and 35 have at most the error of potpourri3d's better
# answer for shares of 0, 1/2, 2/3, 0.8 and 1.
_SMOOTH_SHARE = 2 / 3
# The smooth function after so many steps of conjugate gradients; with eight, errors differ by 1 % at most.
_SMOOTH_STEPS = 3


class NormalIntegration:
    """Diffuses the normals of oriented sources, and integrates the field of unit vectors (Feng and Crane 2024).

    `faces` are the triangles of the mesh by the lengths of their edges, and `triangulation` those that are solved on,
    by the flows of `parts`.
    """

    def __init__(
        self, mesh: Mesh, faces: IntrinsicTriangulation, triangulation: IntrinsicTriangulation, parts: SolverParts
    ) -> None:
        domain, backend = parts.operators, parts.options.backend
        self._V, self._F, self._n = mesh.V, mesh.F, mesh.n_vertices
        self._faces, self._triangulation = faces, triangulation
        self._mean_edge_length = domain.mean_edge_length
        self._poisson = parts.poisson
        self._vector_flow = VectorHeatFlow(
            domain, edge_rotations(domain), _one_or_all(parts.time_steps), backend, parts.fitted
        )
        self._rotations = face_rotations(domain)
        gradient = TriangleElements(triangulation).matrix().tocsr()
        self._D = divergence_matrix(gradient, triangulation.areas)
        self._levels = CurveLevels(domain, mesh.F, parts.heat_flow, self._poisson)

    def distance(self, chosen: OrientedSet, level: Level) -> FloatArray:
        """The signed distance (n,): steps 1 to 3 of the method, less the level.

        A `SourceError` if the normals of all curves cancel, or one of a point is that of the face.
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


class Pieces(NamedTuple):
    """The middles of segments, and points, as they are diffused: q of both, which `is_point` tells apart.

    A unit normal to the right is complex, in the plane of the face. The weight of a segment is its length, that of a
    point the mean edge length.
    """

    faces: IntArray
    barycentric: FloatArray
    normal: AnyArray
    weight: FloatArray
    label: IntArray
    is_point: BoolArray

    def at(self, chosen: BoolArray) -> Pieces:
        """Some of the pieces, by a mask (q,)."""
        return Pieces._make(field[chosen] for field in self)


class CurveLevels:
    """Extends values on curves to all vertices of one domain; pieces of curves refer to `faces` (m, 3).

    Each vertex finds the nearest place on the curves by `heat_flow`; `poisson` gives functions of small gradient.
    """

    def __init__(self, domain: Operators, faces: IntArray, heat_flow: HeatFlow, poisson: PoissonProblem) -> None:
        self._domain, self._faces = domain, faces
        self._heat_flow, self._poisson = heat_flow, poisson

    def of(self, phi: FloatArray, pieces: Pieces, level: Level) -> FloatArray:
        """The function (n,) that is subtracted from the integrated distance `phi` (n,) for this `level`."""
        smooth, rest = self.smooth(phi, pieces, level)
        return smooth if level == "none" else smooth + self.extended(rest, pieces, self.heat(pieces))

    def smooth(self, phi: FloatArray, pieces: Pieces, level: Level) -> tuple[FloatArray, FloatArray]:
        """The part (n,) of the level that varies little, and the values (q,) on the pieces that it leaves.

        These belong to the level as well, `extended` to all vertices, unless it is "none".
        """
        on_curves = _OnCurves(self._domain, self._faces, pieces)
        value = on_curves.values(phi)
        mean = on_curves.mean(value)
        at_vertices = self._domain.expand_to_vertices(np.where(on_curves.length > 0, mean, -np.inf))
        rest = value - mean[on_curves.component]
        if level == "constant":
            _, group = np.unique(np.stack([pieces.label, on_curves.component]), axis=1, return_inverse=True)
            group = group.ravel()
            rest -= (np.bincount(group, pieces.weight * rest) / np.bincount(group, pieces.weight))[group]
        lines = ~pieces.is_point
        if lines.any() and level != "none":
            # Of points only the mean of many counts.
            segments = _OnCurves(self._domain, self._faces, pieces.at(lines))
            smooth = _SMOOTH_SHARE * self._smooth(rest[lines], segments)
            at_vertices = at_vertices + smooth
            rest = rest - on_curves.values(smooth)
        return np.asarray(at_vertices), rest

    def _smooth(self, values: FloatArray, on_curves: _OnCurves) -> FloatArray:
        """The function g (n,) with the least sum of |grad g|^2 over the surface and (g - values)^2 / h over the curves.

        With B the values on the curves and W their lengths, s = (values - g) / h is a source: -L g = B^T W s. So
        (h - B L^+ B^T W) s = values up to constants, by conjugate gradients in the inner product of W, on each
        component by itself.
        """
        h = self._domain.mean_edge_lengths[on_curves.component]
        expand, at = self._domain.expand_to_vertices, on_curves.component
        rest = values - on_curves.mean(values)[at]
        direction, g = rest, np.zeros(self._domain.n)
        size = on_curves.total(rest**2)
        for _ in range(_SMOOTH_STEPS):
            of_direction = self._poisson.solve(-on_curves.integrals(direction))
            applied = on_curves.values(of_direction)
            applied += h * direction - on_curves.mean(applied)[at]
            step = _ratio(size, on_curves.total(direction * applied))
            g += expand(step) * of_direction
            rest = rest - step[at] * applied
            before, size = size, on_curves.total(rest**2)
            direction = rest + _ratio(size, before)[at] * direction
        return np.asarray(g - expand(on_curves.mean(on_curves.values(g) - values)))

    def heat(self, pieces: Pieces) -> FloatArray:
        """Heat (n,) that starts with the same strength all along the pieces."""
        return self._heat(_OnCurves(self._domain, self._faces, pieces), np.ones(len(pieces.faces)))

    def _heat(self, on_curves: _OnCurves, values: FloatArray) -> FloatArray:
        """Heat (n,) that starts along the pieces with the strengths `values` (q,), up to a factor for all."""
        scale = SOURCE_HEAT / on_curves.integrals(np.ones(len(values))).max()
        return self._heat_flow.solve((scale * on_curves.integrals(values))[:, None])[:, 0]

    def extended(self, values: FloatArray, pieces: Pieces, heat: FloatArray) -> FloatArray:
        """A function (n,) that takes `values` (q,) on the curves, and elsewhere that at the nearest place on them.

        `heat` (n,) is that of the pieces.
        """
        on_curves, extended = _OnCurves(self._domain, self._faces, pieces), np.zeros(self._domain.n)
        is_point = pieces.is_point
        # Heat of the values over heat of ones is their mean over some edges. What that leaves of the values on segments
        # is extended in turn, but not of those at points: samples are off by noise, which the mean removes.
        for k, factor in enumerate(_LEVEL_FACTORS[:1] if is_point.all() else _LEVEL_FACTORS):
            rest = values - on_curves.values(extended)
            rest[is_point] *= k == 0
            largest = max(float(np.abs(rest).max()), np.finfo(float).tiny)
            ratio = np.divide(
                self._heat(on_curves, rest / largest), heat, out=np.zeros_like(heat), where=heat > LOWEST_HEAT
            )
            extended += factor * largest * np.clip(ratio, -1, 1)
        return extended


class _OnCurves:
    """Values and integrals of functions on the pieces (q,) of curves, by components."""

    def __init__(self, domain: Operators, faces: IntArray, pieces: Pieces) -> None:
        corners = faces[pieces.faces]
        q = len(corners)
        entries = (pieces.barycentric.ravel(), corners.ravel(), np.arange(0, 3 * q + 1, 3))
        self._B = sp.csr_matrix(entries, shape=(q, domain.n))
        self._n_components = domain.n_components
        self.pieces = pieces
        self.component = domain.components[corners[:, 0]]
        self.length = self.total(np.ones(q))

    def values(self, of_vertices: FloatArray) -> FloatArray:
        """Values (q,) of a function (n,), linear in each face."""
        return np.asarray(self._B @ of_vertices)

    def integrals(self, values: FloatArray) -> FloatArray:
        """Integrals (n,) of values (q,) times the hat functions of the vertices."""
        return np.asarray(self._B.T @ (self.pieces.weight * values))

    def total(self, values: FloatArray) -> FloatArray:
        """Integral (n_components,) of values (q,) over the pieces on each component."""
        return np.asarray(np.bincount(self.component, self.pieces.weight * values, self._n_components), np.float64)

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean (n_components,) of values (q,) on each component; 0 without pieces."""
        return _ratio(self.total(values), self.length)


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    """Quotients, 0 where `below` is not positive."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)
