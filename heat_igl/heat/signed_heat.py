"""`SignedHeatSolver`: distance with a sign from curves that have a left and a right, broken or not."""

from __future__ import annotations

from typing import get_args

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError, SourceError, names_guessed, require_choice
from heat_igl.heat.curve_sides import (
    has_gaps,
    left_of_closed,
    left_of_nearest,
    total_length,
    vertices_on,
    zero_curve_in_gaps,
)
from heat_igl.heat.normal_integration import Level, NormalIntegration
from heat_igl.heat.parts import SolverOptions, prepare
from heat_igl.heat.solver import HeatMethodSolver
from heat_igl.intrinsic import IntrinsicTriangulation, oriented
from heat_igl.linear import Backend
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, one_sided
from heat_igl.operators import Operators, operators
from heat_igl.runtime import both, n_threads, warn_caller
from heat_igl.sources import Oriented, OrientedSet, Sources, oriented_set, require_resolved, source_set
from heat_igl.sweep import SweepEngine
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.windows import MeshTriangles, guarded_windows

# Normals diffuse over half an edge: the best of 0.25, 0.5 and 1 along closed curves, and across gaps all three are
# alike (docs/signed_theory.md).
_T_COEF = 0.25
# Share of the border between the sides that heat may close without a warning: above it, most of that is not given.
_CLOSED_BY_HEAT = 0.5
# Share of the vertices beside curves that may be on the other side for the heat, whose zero curve is up to half an edge
# off. It is 4 % at most on 48 broken levels (docs/signed_theory.md).
_CONTRADICTED = 0.05


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
        self,
        mesh: MeshLike,
        *,
        t_coef: float | None = None,
        t: float | None = None,
        backend: Backend = "auto",
    ) -> None:
        is_default = t_coef is None and t is None
        options = SolverOptions(_T_COEF if is_default else t_coef, t, backend=backend)
        self._mesh = one_sided(mesh, "the left and the right of a curve need")
        domain, self._faces, triangulation = _oriented_domain(self._mesh)
        parts = prepare(domain, options, V=self._mesh.V)
        self._domain = parts.operators
        self._integration = NormalIntegration(self._mesh, self._faces, triangulation, parts)
        self._unsigned = HeatMethodSolver._of(parts)
        self._exact = guarded_windows(MeshTriangles(self._mesh), self._mesh.V, None, SweepEngine)
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
        If no curve has a gap, the regions between curves have one sign each, that of the side on which the curves lie.
        The levels "constant" and "none" keep the sign of the integrated value instead. The diffused normals of all
        curves are added: if curves contradict each other, the longer pieces decide.
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
        phi = self._integration.distance(chosen, level)
        if level == "zero":
            phi[vertices_on(self._mesh, chosen)] = 0.0
        if level == "zero" and not has_gaps(self._mesh, chosen):
            left, is_known = left_of_closed(self._mesh, self._faces, chosen)
            return np.abs(phi), np.where(is_known, left, phi < 0)
        return np.abs(phi), phi < 0

    def _measured(self, chosen: OrientedSet, level: Level) -> tuple[FloatArray, BoolArray]:
        """Distance (n,) from the curves, with their gaps closed, and which vertices (n,) are on the left."""
        sources = chosen.unoriented()
        if not has_gaps(self._mesh, chosen):
            size, (left, is_known) = both(
                lambda: self._from(sources), lambda: left_of_closed(self._mesh, self._faces, chosen)
            )
            if (is_known | (size == 0) | np.isinf(size)).all():
                return size, left & np.isfinite(size)
            return size, np.where(is_known, left, self._integration.distance(chosen, level) < 0)
        size, phi = self._integration.distance_beside(lambda: self._from(sources), chosen, level)
        left, is_known = left_of_nearest(self._faces, chosen, size)
        closing = zero_curve_in_gaps(self._mesh, phi, size, self._domain.mean_edge_length)
        self._warn_if_unsure(chosen, closing, np.flatnonzero(is_known & (left != (phi < 0))), int(is_known.sum()))
        left = np.where(is_known, left, phi < 0)
        return size if closing is None else np.minimum(size, self._from([closing])), left

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
        places = source_set(sources, self.n_vertices, self._mesh.F).with_vertices_moved(self._mesh.originals)
        require_resolved(places, self._domain.mean_edge_length)
        return self._exact.distance(places, threads=n_threads())


def _oriented_domain(mesh: Mesh) -> tuple[Operators, IntrinsicTriangulation, IntrinsicTriangulation]:
    """The operators of a mesh on which a curve has a left and a right, its faces, and the triangles solved on."""
    if mesh.is_tetrahedral:
        raise MeshError("curves have a left and a right on triangles, but the mesh is tetrahedral")
    domain = operators(mesh, "intrinsic-delaunay")
    surface = domain.surface
    if surface is None or surface.faces is None or surface.uncovered is not None:
        raise MeshError(_shared_edge(mesh))
    faces = surface.faces
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


def _shared_edge(mesh: Mesh) -> str:
    """What is wrong with a mesh that has an edge of more than two faces."""
    facets = mesh.facets
    crowded = np.flatnonzero(facets.n_faces > 2)
    first = "" if not len(crowded) else " {} - {}".format(*facets.vertices[crowded[0]].tolist())
    count = f" ({len(crowded)} edges are like that)" if len(crowded) > 1 else ""
    return (
        f"more than two faces meet at the edge{first}{count}: a curve that crosses it has no one left and right, and a "
        "sign no meaning beyond; separate the sheets, or take the sides of closed curves from cut(mesh, curves).sides"
    )
