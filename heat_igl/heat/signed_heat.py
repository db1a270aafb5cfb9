"""`SignedHeatSolver`: distance with a sign from curves that have a left and a right, broken or not.

Where curves have gaps, and from points, it is integrated from diffused normals: the signed heat method of Feng and
Crane (2024), and a level.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property, reduce
from typing import Literal, get_args

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError, SourceError, names_guessed, require_choice
from heat_igl.heat.checking import naming_thinnest
from heat_igl.heat.curve_sides import (
    closing_of_gaps,
    faces_at_gaps,
    left_beside,
    left_of_closed,
    same_place,
    total_length,
    uncancelled,
    vertices_on,
)
from heat_igl.heat.parts import SolverOptions, SolverParts, prepare
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.heat.steps import VectorHeatFlow, unit_numbers
from heat_igl.intrinsic import IntrinsicTriangulation, Merged, lay_out, oriented
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, one_sided
from heat_igl.operators import Operators, TriangleElements, divergence_matrix, edge_rotations, face_rotations, operators
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT, both, n_threads, warn_caller
from heat_igl.sources import Oriented, OrientedSet, Sources, SourceSet, oriented_set, require_resolved, source_set
from heat_igl.sweep import SweepEngine
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.windows import MeshTriangles, guarded_windows

# Normals diffuse over half an edge: the best of 0.25, 0.5 and 1 along closed curves, and across gaps all three are
# alike (docs/signed_theory.md).
_T_COEF = 0.25
# Share of the border between the sides that heat may close without a warning. On 840 broken levels of eleven meshes the
# sign is wrong at 0.6 % of the vertices below it, and at 6 % above.
_CLOSED_BY_HEAT = 0.5
# Share of the vertices beside curves that may be on the other side for the heat, whose zero curve is up to half an edge
# off. It is 4 % at most on 48 broken levels (docs/signed_theory.md).
_CONTRADICTED = 0.05

# Normals that sum to less than this share of the length of the curves have cancelled: those of 64 levels with their
# opposites to 6e-16, of others to 1.2 and more.
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


class SignedHeatSolver:
    """The signed heat method (Feng and Crane 2024): factor once, ask many times.

    Closed curves have sides, and the distance from them is exact. Heat closes the gaps of broken ones, and gives the
    sign there. From points with normals, and if a time step is given, the distance is the integrated one of the paper.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold and oriented alike; whatever `as_mesh` takes.
    t_coef : float, optional
        t = t_coef h^2, with h the mean edge length of the intrinsic Delaunay triangulation; 0.25 by default. Larger
        values close wide gaps with rounder curves, and smooth noisy ones. If it is given, the distance is the
        integrated one.
    t : float, optional
        Time step as a squared length; overrides `t_coef`, and counts like it. It is raised if heat would not cross the
        mesh.
    backend : {"auto", "scipy", "multifrontal"}
        Linear solver, see `factorize`.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral, not manifold, not oriented, or cannot be oriented.
    FactorizationError, ValueError
        As for `HeatMethodSolver`.

    Notes
    -----
    The paper diffuses vectors at edges. Here they are at vertices, with weights fitted to the lengths of edges
    (`fitted_laplacian`): a third of the unknowns, and no more error (docs/signed_theory.md). The solver is immutable,
    and threads may share it.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(20)
    >>> line = heat_igl.isolines(mesh, mesh.V[:, 0], 0.5)[0]  # x = 1/2
    >>> phi = heat_igl.SignedHeatSolver(mesh).distance(line)
    >>> phi[:21:5].round(6).tolist()
    [-0.5, -0.25, 0.0, 0.25, 0.5]
    """

    @names_guessed
    def __init__(
        self, mesh: MeshLike, *, t_coef: float | None = None, t: float | None = None, backend: Backend = "auto"
    ) -> None:
        is_default = t_coef is None and t is None
        options = SolverOptions(_T_COEF if is_default else t_coef, t, backend=backend)
        self._mesh = one_sided(mesh, "the left and the right of a curve need")
        domain, self._faces, triangulation = _oriented_domain(self._mesh)
        parts = prepare(domain, options, V=self._mesh.V)
        self._domain = parts.operators
        self._integration = NormalIntegration(self._mesh, self._faces, triangulation, parts)
        self._unsigned = HeatMethodSolver._of(parts)
        self._exact = guarded_windows(MeshTriangles(self._mesh), self._mesh.V, SweepEngine)
        self._integrates = not is_default

    def __repr__(self) -> str:
        return repr(self._unsigned).replace("HeatMethodSolver", "SignedHeatSolver", 1)

    @property
    def operators(self) -> Operators:
        """L and M of the triangulation that is solved on."""
        return self._domain

    @property
    def t(self) -> float:
        """The time step in use, a squared length."""
        return self._unsigned.t

    @property
    def n_vertices(self) -> int:
        """Length of a distance array."""
        return self._mesh.n_vertices

    def distance(self, curves: Oriented, *, unsigned: Sources | None = None, level: Level | None = None) -> FloatArray:
        """Distance from the nearest curve, negative on the left of the curves.

        Seen from outside, a counter-clockwise loop is negative inside.

        Parameters
        ----------
        curves : oriented sources
            A directed `SurfaceCurve`; a mask of bool of the faces (m,) or vertices (n,) of a region, which is negative
            inside; `OrientedPoints`; or a list of these kinds, of any depth, such as the result of `isolines`. Curves
            may have gaps.
        unsigned : sources, optional
            More sources, as for `HeatMethodSolver.distance`, without a sign: near them the size of the distance is
            that from them, and the sign is the one that the curves give.
        level : {"zero", "constant", "none"}, optional
            Asks for the integrated distance, with this level. "zero" subtracts from each vertex the
            value at the place on the curves that its heat comes from, so that all curves are near 0: within 0.03 mean
            edge lengths (root mean square) on coarse meshes, and exactly at vertices on them
            (docs/signed_theory.md). "constant" makes the value nearly constant along each curve, with a different
            level for each, and 0 in the mean over all. "none" only makes the mean 0. Where the integrated distance is
            meant and no level is given, it is "zero".

        Returns
        -------
        (n,) float64
            In the mesh's unit; ``inf`` on components without a curve. Never NaN.

        Raises
        ------
        SourceError
            If `curves` or `unsigned` does not describe places on the mesh, a curve has no length, or the normals of
            all curves cancel: the same curve twice, in opposite directions.
        ValueError
            If there is no such `level`.

        Warns
        -----
        AccuracyWarning
            If more than half of the border between the sides runs through gaps, or the heat that closes them
            contradicts the sides at more than 5 % of the vertices beside the curves; the sides are kept.

        Notes
        -----
        Regions between curves have one sign each, that of the side on which the curves lie, but for those with a gap. A
        region on both sides, as around a handle, is closed like gaps. The levels "constant" and
        "none" keep the sign of the integrated value. The diffused normals of all curves are added: where they differ,
        longer ones decide.
        """
        if level is not None:
            require_choice("level", level, get_args(Level))
        chosen = oriented_set(curves, self._mesh)
        # Points are samples with noise, over which heat takes the mean.
        integrates = self._integrates or level is not None or len(chosen.point_faces) > 0
        size, left = (self._from_heat if integrates else self._measured)(chosen, level or "zero")
        reached = np.isfinite(size)
        if not reached.any():
            raise SourceError("curves reach no vertex: the components that they lie on have no area")
        if unsigned is not None:
            size = np.minimum(size, self._from(unsigned), out=size, where=reached)
        # Adding 0 makes 0 of -0.
        return np.asarray((np.where(left, -size, size) + 0.0)[self._mesh.originals])

    def _from_heat(self, chosen: OrientedSet, level: Level) -> tuple[FloatArray, BoolArray]:
        """Distance (n,) by integration, and which vertices (n,) are on the left."""
        chosen = uncancelled(self._mesh, chosen)
        phi = self._integration.distance(chosen, level)
        if level != "zero":
            return np.abs(phi), phi < 0
        phi[vertices_on(self._mesh, chosen)] = 0.0
        left, is_known = left_of_closed(self._mesh, self._faces, chosen, faces_at_gaps(self._mesh, chosen))
        return np.abs(phi), np.where(is_known, left, phi < 0)

    def _measured(self, chosen: OrientedSet, level: Level) -> tuple[FloatArray, BoolArray]:
        """Distance (n,) from the curves, with their gaps closed, and which vertices (n,) are on the left."""
        sources, size = chosen.unoriented(), None
        chosen = uncancelled(self._mesh, chosen)
        gaps = faces_at_gaps(self._mesh, chosen)
        if len(gaps):
            left, is_known = left_of_closed(self._mesh, self._faces, chosen, gaps)
        else:
            size, (left, is_known) = both(
                lambda: self._from(sources), lambda: left_of_closed(self._mesh, self._faces, chosen, gaps)
            )
            if (is_known | (size <= same_place(self._mesh)) | np.isinf(size)).all():
                return size, left & np.isfinite(size)
        phi = self._integration.distance(chosen, level)
        of_nearest, is_beside, on_curve = left_beside(self._mesh, self._faces, chosen)
        left = np.where(is_known, left, np.where(is_beside, of_nearest, phi < 0))
        closing = closing_of_gaps(self._mesh, chosen, phi, left, on_curve)
        is_beside &= ~is_known
        self._warn_if_unsure(chosen, closing, np.flatnonzero(is_beside & (left != (phi < 0))), int(is_beside.sum()))
        if size is None:
            return self._from(sources if closing is None else [sources, closing]), left
        if closing is not None:
            size = np.minimum(size, self._exact.nearer(self._places(closing), size, n_threads()))
        return size, left

    def _warn_if_unsure(
        self, chosen: OrientedSet, closing: SurfaceCurve | None, contradicted: IntArray, n_beside: int
    ) -> None:
        """Warn if most of the border is the `closing`, or heat contradicts the sides at many vertices beside curves."""
        closed = 0.0 if closing is None else total_length(self._mesh, closing)
        share = closed / (closed + total_length(self._mesh, chosen))
        if share > _CLOSED_BY_HEAT:
            warn_caller(
                f"{share:.0%} of the border between the two sides runs through gaps of the curves, where heat alone "
                "decides the sign: give more of the curves where the sign matters",
                AccuracyWarning,
            )
        if len(contradicted) > _CONTRADICTED * n_beside:
            warn_caller(
                f"at {len(contradicted)} of the {n_beside} vertices beside the curves, first at vertex "
                f"{contradicted[0]}, the heat that closes the gaps has the other sign than the side of the nearest "
                "curve, which is taken: direct all pieces alike, and refine the mesh where curves in opposite "
                "directions are nearer to each other than an edge",
                AccuracyWarning,
            )

    def _from(self, sources: Sources) -> FloatArray:
        """Exact distance (n,) from sources without a side."""
        return self._exact.distance(self._places(sources), threads=n_threads())

    def _places(self, sources: Sources) -> SourceSet:
        """Sources without a side, checked."""
        places = source_set(sources, self.n_vertices, self._mesh.F, originals=self._mesh.originals)
        return require_resolved(places, self._domain.mean_edge_length)


def _oriented_domain(mesh: Mesh) -> tuple[Operators, IntrinsicTriangulation, IntrinsicTriangulation]:
    """The operators of a mesh on which a curve has a left and a right, its faces, and the triangles solved on."""
    if mesh.is_tetrahedral:
        raise MeshError("curves have a left and a right on triangles, but the mesh is tetrahedral")
    domain = operators(mesh, "intrinsic-delaunay")
    surface = domain.surface
    if surface is None or surface.uncovered is not None:
        facets = mesh.facets
        crowded = np.flatnonzero(facets.n_faces > 2)
        edge = "" if not len(crowded) else " {} - {}".format(*facets.vertices[crowded[0]].tolist())
        count = f" ({len(crowded)} edges are like that)" if len(crowded) > 1 else ""
        raise MeshError(
            f"more than two faces meet at the edge{edge}{count}: a curve that crosses it has no one left and right, "
            "and a sign no meaning beyond; separate the sheets, or take the sides of closed curves from "
            "cut(mesh, curves).sides"
        )
    faces = surface.faces
    if isinstance(copies := next(iter(faces.history), None), Merged):
        first = int(np.argmin(np.diff(copies.face) > 0)) + 1
        raise MeshError(
            f"F[{first}] has the corners of F[{copies.face[first]}] ({mesh.n_faces - len(faces.F)} faces are copies of "
            "others): a curve across them has no one left and right; remove the copies"
        )
    if not faces.aligned.all():
        first = int(np.argmin(faces.aligned)) // 3
        if not oriented(faces).aligned.all():
            raise MeshError(
                "the surface cannot be oriented, as a Moebius strip cannot: along a loop left becomes right, so a sign "
                "has no meaning; cut the surface open, or take a distance without a sign"
            )
        raise MeshError(
            f"face {first} and a neighbour are oriented differently: left and right change between them; orient the "
            "faces alike, as igl.bfs_orient does"
        )
    return domain, faces, surface.triangulation


class NormalIntegration:
    """Diffuses the normals of oriented sources, and integrates the field of unit vectors (Feng and Crane 2024).

    `faces` are the triangles of the mesh by the lengths of their edges, and `triangulation` those that are solved on,
    by the flows of `parts`.
    """

    def __init__(
        self, mesh: Mesh, faces: IntrinsicTriangulation, triangulation: IntrinsicTriangulation, parts: SolverParts
    ) -> None:
        domain, backend = parts.operators, parts.options.backend
        self._V, self._F = mesh.V, mesh.F
        self._faces, self._triangulation = faces, triangulation
        with naming_thinnest(domain.source_surface):
            self._vector_flow = VectorHeatFlow(domain, edge_rotations(domain), parts.heat_flow.t, backend, parts.fitted)
        self._to_faces, self._to_triangles = face_rotations(domain)
        gradient = TriangleElements(triangulation).matrix().tocsr()
        self._D = divergence_matrix(gradient, triangulation.areas)
        self._domain, self._heat_flow, self._poisson = domain, parts.heat_flow, parts.poisson

    def distance(self, chosen: OrientedSet, level: Level) -> FloatArray:
        """The signed distance (n,): steps 1 to 3 of the method, less the level.

        A `SourceError` if the normals of all curves cancel, or one of a point is that of the face.
        """
        pieces = self._pieces(chosen)

        def integrated() -> tuple[FloatArray, FloatArray]:
            phi = self._integrated(pieces)
            smooth, rest = self._level(phi, pieces, level)
            return phi - smooth, rest

        # The level needs that heat as well.
        heat, (phi, rest) = both(lambda: self._heat(pieces), integrated)
        return phi if level == "none" else phi - self._extended(rest, pieces, heat)

    def _integrated(self, pieces: Pieces) -> FloatArray:
        """The signed distance (n,) up to a level."""
        # Step 1: diffuse the normals, integrated against the hat functions.
        share = pieces.weight[:, None] * pieces.barycentric
        at_corners = share * pieces.normal[:, None] * self._to_faces[pieces.faces].conj()
        b = pieces.summed(at_corners.real) + 1j * pieces.summed(at_corners.imag)
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
        turned = zip(self._to_triangles.T, self._triangulation.F.T, strict=True)
        X = unit_numbers(reduce(np.add, (rotation * (scale * Y[corner]) for rotation, corner in turned)))
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
            self._domain,
            self._F[np.concatenate([chosen.faces, chosen.point_faces])],
            np.concatenate([chosen.faces, chosen.point_faces]),
            np.concatenate([(chosen.start + chosen.end) / 2, chosen.point_barycentric]),
            # To the right of a segment is its direction turned by -90 degrees.
            np.concatenate([-1j * unit_numbers(along), unit_numbers(normal)]),
            np.concatenate([length, np.full(len(normal), self._domain.mean_edge_length)]),
            np.concatenate([chosen.label, chosen.point_label]),
            np.arange(len(chosen.faces) + len(normal)) >= len(chosen.faces),
        )

    def _level(self, phi: FloatArray, pieces: Pieces, level: Level) -> tuple[FloatArray, FloatArray]:
        """The part (n,) of the level that varies little, and the values (q,) on the pieces that it leaves.

        These belong to the level as well, extended to all vertices, unless it is "none".
        """
        value = pieces.values(phi)
        mean = pieces.mean(value)
        at_vertices = self._domain.expand_to_vertices(np.where(pieces.length > 0, mean, -np.inf))
        rest = value - mean[pieces.component]
        if level == "constant":
            _, group = np.unique(np.stack([pieces.label, pieces.component]), axis=1, return_inverse=True)
            group = group.ravel()
            rest -= (np.bincount(group, pieces.weight * rest) / np.bincount(group, pieces.weight))[group]
        lines = ~pieces.is_point
        if lines.any() and level != "none":
            # Of points only the mean of many counts.
            smooth = _SMOOTH_SHARE * self._smooth(rest[lines], pieces.at(lines))
            at_vertices = at_vertices + smooth
            rest = rest - pieces.values(smooth)
        return np.asarray(at_vertices), rest

    def _smooth(self, values: FloatArray, pieces: Pieces) -> FloatArray:
        """The function g (n,) with the least sum of |grad g|^2 over the surface and (g - values)^2 / h over the curves.

        With B the values on the curves and W their lengths, s = (values - g) / h is a source: -L g = B^T W s. So
        (h - B L^+ B^T W) s = values up to constants, by conjugate gradients in the inner product of W, on each
        component by itself.
        """
        h = self._domain.mean_edge_lengths[pieces.component]
        expand, at = self._domain.expand_to_vertices, pieces.component
        rest = values - pieces.mean(values)[at]
        direction, g = rest, np.zeros(self._domain.n)
        size = pieces.total(rest**2)
        for _ in range(_SMOOTH_STEPS):
            of_direction = self._poisson.solve(-pieces.integrals(direction))
            applied = pieces.values(of_direction)
            applied += h * direction - pieces.mean(applied)[at]
            step = _ratio(size, pieces.total(direction * applied))
            g += expand(step) * of_direction
            rest = rest - step[at] * applied
            before, size = size, pieces.total(rest**2)
            direction = rest + _ratio(size, before)[at] * direction
        return np.asarray(g - expand(pieces.mean(pieces.values(g) - values)))

    def _heat(self, pieces: Pieces, values: FloatArray | None = None) -> FloatArray:
        """Heat (n,) that starts along the pieces with the strengths `values` (q,), 1 everywhere if not given.

        A factor for all is left out.
        """
        ones = np.ones(len(pieces.faces))
        start = pieces.integrals(ones if values is None else values) / pieces.integrals(ones).max()
        return self._heat_flow.solve(SOURCE_HEAT * start[:, None])[:, 0]

    def _extended(self, values: FloatArray, pieces: Pieces, heat: FloatArray) -> FloatArray:
        """A function (n,) that takes `values` (q,) on the curves, and elsewhere that at the nearest place on them.

        `heat` (n,) is that of the pieces.
        """
        extended, is_point = np.zeros(self._domain.n), pieces.is_point
        # Heat of the values over heat of ones is their mean over some edges. What that leaves of the values on segments
        # is extended in turn, but not of those at points: samples are off by noise, which the mean removes.
        for k, factor in enumerate(_LEVEL_FACTORS[:1] if is_point.all() else _LEVEL_FACTORS):
            rest = values - pieces.values(extended)
            rest[is_point] *= k == 0
            largest = max(float(np.abs(rest).max()), np.finfo(float).tiny)
            ratio = np.divide(
                self._heat(pieces, rest / largest), heat, out=np.zeros_like(heat), where=heat > LOWEST_HEAT
            )
            extended += factor * largest * np.clip(ratio, -1, 1)
        return extended


@dataclass(frozen=True, eq=False)
class Pieces:
    """The middles of segments, and points, as they are diffused: q of both, which `is_point` tells apart.

    A unit normal to the right is complex, in the plane of the face. The weight of a segment is its length, that of a
    point the mean edge length. `corners` (q, 3) are the vertices of the faces.
    """

    domain: Operators
    corners: IntArray
    faces: IntArray
    barycentric: FloatArray
    normal: AnyArray
    weight: FloatArray
    label: IntArray
    is_point: BoolArray

    def at(self, chosen: BoolArray) -> Pieces:
        """Some of the pieces, by a mask (q,)."""
        return replace(self, **{field.name: getattr(self, field.name)[chosen] for field in fields(self)[1:]})

    @cached_property
    def component(self) -> IntArray:
        """The component (q,) that each piece is on."""
        return self.domain.components[self.corners[:, 0]]

    @cached_property
    def length(self) -> FloatArray:
        """The sum (n_components,) of the weights on each component."""
        return self.total(np.ones(len(self.corners)))

    def values(self, of_vertices: FloatArray) -> FloatArray:
        """Values (q,) of a function (n,), linear in each face."""
        return np.asarray(np.einsum("qc,qc->q", self.barycentric, of_vertices[self.corners]))

    def integrals(self, values: FloatArray) -> FloatArray:
        """Integrals (n,) of values (q,) times the hat functions of the vertices."""
        return self.summed(self.barycentric * (self.weight * values)[:, None])

    def summed(self, at_corners: FloatArray) -> FloatArray:
        """The sums (n,) over the pieces at each vertex of values (q, 3) at their corners."""
        return np.asarray(np.bincount(self.corners.ravel(), at_corners.ravel(), self.domain.n), np.float64)

    def total(self, values: FloatArray) -> FloatArray:
        """Integral (n_components,) of values (q,) over the pieces on each component."""
        return np.asarray(np.bincount(self.component, self.weight * values, self.domain.n_components), np.float64)

    def mean(self, values: FloatArray) -> FloatArray:
        """Mean (n_components,) of values (q,) on each component; 0 without pieces."""
        return _ratio(self.total(values), self.length)


def _ratio(above: FloatArray, below: FloatArray) -> FloatArray:
    """Quotients, 0 where `below` is not positive."""
    return np.divide(above, below, out=np.zeros_like(above), where=below > 0)
