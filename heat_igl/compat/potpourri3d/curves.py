"""Curves: isolines, and distance from curves that are given as lists of nodes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Literal

import numpy as np

from heat_igl.compat.potpourri3d.meshes import proper
from heat_igl.curves import GeodesicPathSolver, isolines
from heat_igl.curves.geodesics import as_curve
from heat_igl.curves.places import CommonFaces
from heat_igl.geodesic import geodesic_distance
from heat_igl.heat import HeatMethodSolver, SignedHeatSolver
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints
from heat_igl.sources import OffsetSources
from heat_igl.typing import ArrayLike, FloatArray

_LEVELS: dict[str, Literal["zero", "none", "constant"]] = {"zeroset": "zero", "none": "none", "multiple": "constant"}
# This package's own factors for potpourri3d's default of 1: with the fitted heat flow, and of signed distance.
TIME_STEP, _SIGNED_TIME_STEP = 0.5, 0.25

# Curves, each a list of points: a face, and the barycentric coordinates in it.
Curves = list[list[tuple[int, list[float]]]]
# A vertex and (), an edge and its share of the way to the second end, or a face and two or three coordinates.
Node = tuple[int, Sequence[float]]


def t_coef_here(t_coef: float, own: float = _SIGNED_TIME_STEP) -> float | None:
    """The time step for that of potpourri3d: the default for its default, otherwise in proportion to `own`."""
    return None if t_coef == 1 else own * t_coef


class MeshMarchingTrianglesSolver:
    """Isolines of values at vertices: `isolines`."""

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        self._mesh = proper(V, F)

    def marching_triangles(self, u: ArrayLike, isoval: float = 0.0) -> Curves:
        """The curves on which the values u (n,) are `isoval`; every point is one of a face."""
        curves: Curves = []
        for curve in isolines(self._mesh, u, float(isoval))[0]:
            faces = [int(curve.faces[0]), *curve.faces.tolist()]
            points = [curve.start[0].tolist(), *curve.end.tolist()]
            curves.append(list(zip(faces, points, strict=True)))
        return curves


def marching_triangles(V: ArrayLike, F: ArrayLike, u: ArrayLike, isoval: float = 0.0) -> Curves:
    """The curves on which the values u (n,) are `isoval`, in one call."""
    return MeshMarchingTrianglesSolver(V, F).marching_triangles(u, isoval)


class _CurveReader:
    """Reads the curves of potpourri3d, lists of nodes, as curves and points of this package."""

    def __init__(self, mesh: Mesh) -> None:
        self._mesh, self._faces, self._solver = mesh, CommonFaces(mesh), GeodesicPathSolver(mesh)

    def points(self, name: str, nodes: Sequence[Node]) -> SurfacePoints:
        """The nodes as points in faces."""
        found = [self._place(f"{name}[{i}]", *node) for i, node in enumerate(nodes)]
        faces, barycentric = zip(*found, strict=True)
        return SurfacePoints(np.array(faces), np.array(barycentric))

    def curve(self, name: str, nodes: Sequence[Node]) -> SurfaceCurve:
        """The curve from node to node: straight in a face that has both, and along a geodesic otherwise."""
        if len(nodes) < 2:
            raise ValueError(f"{name} has {len(nodes)} points: a curve needs two or more")
        at = self.points(name, nodes)
        return as_curve(self._solver.pieces(at.faces, at.barycentric), is_closed=False)

    def _place(self, name: str, index: int, coordinates: Sequence[float]) -> tuple[int, FloatArray]:
        """The first face that holds a node, and the coordinates (3,) of the node in it."""
        given = np.asarray(coordinates, np.float64).ravel()
        if len(given) > 3:
            raise ValueError(
                f"{name} has {len(given)} coordinates: a face has two or three, an edge one, a vertex none"
            )
        kind = ("vertex", "edge", "face", "face")[len(given)]
        table = {"vertex": np.arange(self._mesh.n_vertices)[:, None], "edge": self._mesh.edges, "face": self._mesh.F}
        elements = table[kind]
        if not 0 <= index < len(elements):
            raise ValueError(f"{name} = {index} is no {kind}: indices run from 0 to {len(elements) - 1}")
        if kind == "edge":
            given = np.array([1 - given[0], given[0]])
        elif len(given) != 3:
            given = np.append(given, 1 - given.sum())
        vertices = elements[index]
        face = self._faces.of(vertices[given != 0])
        if face < 0:
            raise ValueError(f"vertex {vertices[0]} is in no face, so no curve goes through it")
        return face, ((self._mesh.F[face][:, None] == vertices) * given).sum(axis=1)


def _signed_distance(
    solver: SignedHeatSolver,
    curves: Sequence[SurfaceCurve],
    constraint: str,
    unsigned: Sequence[SurfaceCurve | SurfacePoints] = (),
) -> FloatArray:
    """Signed distance (n,) with potpourri3d's word for the level."""
    level = _LEVELS.get(str(constraint).lower())
    if level is None:
        raise ValueError(f"level_set_constraint must be 'ZeroSet', 'None' or 'Multiple', not {constraint!r}")
    return solver.distance(list(curves), unsigned=list(unsigned) or None, level=level)


def from_vertices(
    mesh: Mesh, curves: Sequence[Sequence[int]], constraint: str, t_coef: float | None = None
) -> FloatArray:
    """Signed distance (n,) from curves through vertices."""
    reader = _CurveReader(mesh)
    parts = [reader.curve(f"curves[{i}]", [(v, ()) for v in vertices]) for i, vertices in enumerate(curves)]
    return _signed_distance(SignedHeatSolver(mesh, t_coef=t_coef), parts, constraint)


class MeshSignedHeatSolver:
    """Distance with a sign from curves: that of `SignedHeatSolver`, with the opposite sign as in potpourri3d.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3), manifold and oriented alike.
    t_coef : float
        Time step relative to the default.
    """

    def __init__(self, V: ArrayLike, F: ArrayLike, t_coef: float = 1.0) -> None:
        self._mesh = Mesh(V, F)
        self._reader = _CurveReader(self._mesh)
        self._signed = SignedHeatSolver(self._mesh, t_coef=t_coef_here(t_coef))

    @cached_property
    def _unsigned(self) -> HeatMethodSolver:
        return HeatMethodSolver(self._mesh)

    def compute_distance(
        self,
        curves: Sequence[Sequence[Node]],
        curve_signs: Sequence[bool] = (),
        points: Sequence[Node] = (),
        preserve_source_normals: bool = False,
        level_set_constraint: str = "ZeroSet",
        soft_level_set_weight: float = -1,
    ) -> FloatArray:
        """Distance (n,) from the nearest curve or point, positive on the left of the curves.

        The other solvers of potpourri3d, and this package's, are negative there.

        Parameters
        ----------
        curves : list of lists of nodes
            A node is ``(vertex, [])``, ``(edge, [t])`` with an edge of `edges`, or ``(face, [a, b, c])``.
        curve_signs : list of bool
            Whether each curve gives a sign; those that are not named do.
        points : list of nodes
            More sources, without a sign.
        preserve_source_normals, soft_level_set_weight
            Not read.
        level_set_constraint : {"ZeroSet", "None", "Multiple"}
            The `level` "zero", "none" or "constant" of `SignedHeatSolver.distance`.
        """
        signed: list[SurfaceCurve] = []
        rest: list[SurfaceCurve] = []
        for i, nodes in enumerate(curves):
            has_sign = i >= len(curve_signs) or curve_signs[i]
            (signed if has_sign else rest).append(self._reader.curve(f"curves[{i}]", nodes))
        others: list[SurfaceCurve | SurfacePoints] = [*rest]
        if len(points):
            others.append(self._reader.points("points", points))
        if signed:
            # 0 is subtracted from, so that no -0 comes out.
            return 0.0 - _signed_distance(self._signed, signed, level_set_constraint, others)
        return self._unsigned.distance(others)


class MeshFastMarchingDistanceSolver:
    """Distance from points and curves without a linear system: `geodesic_distance`, or `SignedHeatSolver` with a sign.

    Parameters
    ----------
    V, F : array_like
        Positions (n, 3) and triangles (m, 3).
    """

    def __init__(self, V: ArrayLike, F: ArrayLike) -> None:
        self._mesh = Mesh(V, F)
        self._reader = _CurveReader(self._mesh)

    @cached_property
    def _signed(self) -> SignedHeatSolver:
        return SignedHeatSolver(self._mesh)

    def compute_distance(
        self, curves: Sequence[Sequence[Node]], distances: Sequence[Sequence[float]] = (), sign: bool = False
    ) -> FloatArray:
        """Distance (n,) from the nodes of all curves; with `sign` from the curves, negative on their left.

        Parameters
        ----------
        curves : list of lists of nodes
            As for `MeshSignedHeatSolver.compute_distance`.
        distances : list of lists of float
            The value at which distance begins at each node; 0 at those that are not named.
        sign : bool
            Whether curves have a left and a right. Then all `distances` must be 0.
        """
        begin = np.zeros(sum(map(len, curves)))
        first = 0
        for nodes, given in zip(curves, distances, strict=False):
            begin[first : first + min(len(given), len(nodes))] = given[: len(nodes)]
            first += len(nodes)
        if sign:
            if begin.any():
                raise ValueError("with sign=True, distances must be 0: a curve with a sign is where distance is 0")
            parts = [self._reader.curve(f"curves[{i}]", nodes) for i, nodes in enumerate(curves)]
            return self._signed.distance(parts)
        nodes = [node for curve in curves for node in curve]
        points = self._reader.points("curves", nodes)
        lowest = float(begin.min())
        return geodesic_distance(self._mesh, OffsetSources(points, begin - lowest)) + lowest
