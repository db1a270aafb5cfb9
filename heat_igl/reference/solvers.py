"""Solvers by name: their distances, checked against bounds that need no reference, and their cost.

A vertex that no source reaches is ``inf``, whatever number the solver would write there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError, ReferenceSolverError
from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.reference import guarded
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.runtime import PeakMemory
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows import exact_distance

#: The exact solver of this package, which `exact` takes unless told otherwise.
WINDOWS = "windows"
#: The exact solvers of other packages, for a second opinion; the last one needs no extra.
EXACT_SOLVERS = ("pygeodesic", "gdist", "igl")

# An exact distance outside the bounds by more than this fraction is wrong. Rounding is near 1e-15.
_OUTSIDE = 1e-9
# At needles, rounded lengths move distances by about 1e-8 of themselves.
_AT_NEEDLES = 1e-7


@dataclass(frozen=True)
class _Solver:
    """A native solver: the function in `native`, and the package and the extra that it needs."""

    function: str
    module: str
    package: str = ""
    extra: str = "validate"
    is_exact: bool = False


_SOLVERS = {
    "gdist": _Solver("gdist_exact", "gdist", "tvb-gdist", is_exact=True),
    "pygeodesic": _Solver("pygeodesic_exact", "pygeodesic", "pygeodesic", is_exact=True),
    "igl": _Solver("igl_exact", "igl", is_exact=True),
    "igl_heat": _Solver("igl_heat", "igl"),
    "meshlab": _Solver("meshlab_front", "pymeshlab", "pymeshlab"),
    "meshlab_border": _Solver("meshlab_border", "pymeshlab", "pymeshlab"),
    "meshlab_heat": _Solver("meshlab_heat", "pymeshlab", "pymeshlab"),
    "potpourri3d_heat": _Solver("potpourri3d_heat", "potpourri3d", "potpourri3d", "bench"),
}


def straight_lines(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length (n,) of the straight line from each vertex to the nearest source, never above the geodesic distance."""
    mesh = as_simplices(mesh)
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    seeds = vertex_sources(sources, mesh.n_vertices)
    distance, _ = cKDTree(mesh.V[seeds]).query(mesh.V)
    return np.asarray(distance, dtype=np.float64)


def edge_paths(mesh: MeshLike, sources: Sources, *, count_edges: bool = False) -> FloatArray:
    """Length (n,) of the shortest path along edges from each vertex to the sources (Dijkstra 1959).

    Never below the geodesic distance; ``inf`` at vertices that no path joins with a source. With `count_edges` the
    smallest number of edges instead, the distance of the paper's theorem 3.1.
    """
    mesh = as_simplices(mesh)
    chosen = vertex_sources(sources, mesh.n_vertices)
    from scipy.sparse import csgraph  # takes as long to import as the rest of the package

    found = csgraph.dijkstra(mesh.edge_graph, directed=False, indices=chosen, unweighted=count_edges, min_only=True)
    return np.asarray(found, np.float64)


@dataclass(frozen=True, eq=False)
class Measured:
    """A distance and the cost of it.

    Attributes
    ----------
    distance : (n,) float64
        In the mesh's unit.
    precompute_seconds : float
        Time for the part that depends on the mesh alone.
    solve_seconds : float
        Time for the rest.
    peak_memory : int or None
        Bytes by which the process grew at most, for native solvers the child; None if the system cannot tell.
    """

    distance: FloatArray
    precompute_seconds: float
    solve_seconds: float
    peak_memory: int | None


def measured(
    solver: str, mesh: MeshLike, sources: Sources, *, timeout: float = TIMEOUT, memory: float = MEMORY, **options: Any
) -> Measured:
    """Distance by a named solver, with the cost in time and memory; mesh, sources and errors are those of `exact`.

    Parameters
    ----------
    solver : str
        "windows" for the windows of this package, one of `EXACT_SOLVERS`, one of MeshLab's, "meshlab",
        "meshlab_border" or "meshlab_heat", or the heat method of libigl, "igl_heat", or of geometry-central,
        "potpourri3d_heat". The last two shift by the mean over the sources, so that of several none need read 0.
    timeout, memory
        Bounds for native solvers; windows need neither.
    **options
        `m` of "meshlab_heat", the factor in t = m h^2; `t` (a squared length, by default h^2) and `intrinsic_delaunay`
        of "igl_heat"; `t_coef` and `use_robust` of "potpourri3d_heat".

    Returns
    -------
    Measured
        Seconds are sums over the components that hold a source.
    """
    mesh = as_simplices(mesh)
    chosen = _SOLVERS.get(solver)
    if chosen is None and solver != WINDOWS:
        raise ReferenceSolverError(f"solver {solver!r} is unknown: choose one of {', '.join((WINDOWS, *_SOLVERS))}")
    if mesh.is_tetrahedral:
        raise ReferenceSolverError(
            f"{solver} works on triangles, and the mesh holds tetrahedra: use validation.closed_forms.convex_solid"
        )
    if chosen is None:
        return _by_windows(mesh, vertex_sources(sources, mesh.n_vertices))
    if find_spec(chosen.module) is None:
        raise MissingExtraError.of(f"the reference {solver}", chosen.package, chosen.extra)
    # A closed surface has no boundary to start from, and everything is infinitely far from it.
    to_boundary = solver == "meshlab_border"
    seeds = np.flatnonzero(mesh.boundary) if to_boundary else vertex_sources(sources, mesh.n_vertices)
    if chosen.is_exact:
        _require_manifold(mesh, seeds)

    reply = guarded.call(
        f"heat_igl.reference.native:{chosen.function}",
        {"V": mesh.V, "F": mesh.F, "sources": seeds, "components": mesh.components, **options},
        library=chosen.module,
        timeout=timeout,
        memory=memory,
    )
    found = Measured(**reply.values, peak_memory=reply.peak_memory)
    _require_finite(solver, mesh, seeds, found.distance)
    if chosen.is_exact:
        _require_between_bounds(solver, mesh, seeds, found.distance)
    return found


def _by_windows(mesh: Mesh, seeds: IntArray) -> Measured:
    """Distance by the windows of this package: any number of components, no child process."""
    start = time.perf_counter()
    with PeakMemory() as peak:
        try:
            distance = exact_distance(mesh.V, mesh.F, seeds)
        except MeshError as error:
            raise ReferenceSolverError(f"{WINDOWS}: {error}") from error
    seconds = time.perf_counter() - start
    _require_finite(WINDOWS, mesh, seeds, distance)
    # Where triangles have hardly any height, edges were rounded or made longer.
    slack = _AT_NEEDLES * float(mesh.edge_lengths.mean())
    _require_between_bounds(WINDOWS, mesh, seeds, distance, tolerance=_AT_NEEDLES, slack=slack)
    return Measured(distance, 0.0, seconds, peak.bytes)


def _require_manifold(mesh: Mesh, seeds: IntArray) -> None:
    """Refuse defects by which the exact solvers crash or return too long a distance, in the components of the seeds.

    They are edges of more than two triangles or of length 0, and vertices in which two surfaces touch.
    """
    around = np.isin(mesh.components, mesh.components[seeds])
    faces = mesh.F[around[mesh.F[:, 0]]]
    if not len(faces):
        return
    report = Mesh(mesh.V, faces).report()
    collapsed = mesh.edges[(mesh.edge_lengths == 0) & around[mesh.edges[:, 0]]]
    for places, problem in (
        (report.nonmanifold_edges, "{} edges connected with the sources belong to more than two triangles"),
        (report.nonmanifold_vertices, "at {} vertices connected with the sources two surfaces touch in a point"),
        (collapsed, "{} edges connected with the sources have length zero"),
    ):
        if len(places):
            raise ReferenceSolverError(
                f"{problem.format(len(places))} (first: {places[0].tolist()}), and exact solvers crash on such "
                "meshes or find no path: repair the mesh (mesh.report() lists the places), or take reference.meshlab"
            )


def _require_finite(name: str, mesh: Mesh, seeds: IntArray, distance: FloatArray) -> None:
    """Refuse a distance that has the wrong shape, or is not finite exactly on the components of the seeds."""
    if distance.shape != (mesh.n_vertices,):
        raise ReferenceSolverError(
            f"{name} returned an array of shape {distance.shape} for {mesh.n_vertices} vertices: report this as a bug"
        )
    there = np.isin(mesh.components, mesh.components[seeds])
    n_bad = int((np.isfinite(distance) != there).sum())
    if n_bad:
        raise ReferenceSolverError(
            f"{name} returned {n_bad} of {mesh.n_vertices} distances that are not finite on the components of the "
            "sources, or finite elsewhere: look for slivers and zero areas with mesh.report()"
        )


def _require_between_bounds(
    name: str, mesh: Mesh, seeds: IntArray, distance: FloatArray, *, tolerance: float = _OUTSIDE, slack: float = 0.0
) -> None:
    """Refuse a distance that claims to be exact and is outside the bounds that hold on every mesh.

    By more than the fraction `tolerance` of the bound and the length `slack`.
    """
    too_short = distance < straight_lines(mesh, seeds) * (1 - tolerance) - slack
    too_long = distance > edge_paths(mesh, seeds) * (1 + tolerance) + slack
    if too_short.any() or too_long.any():
        raise ReferenceSolverError(
            f"{name} is wrong on this mesh: {int(too_short.sum())} vertices are nearer than a straight line and "
            f"{int(too_long.sum())} farther than a path along edges; look for zero areas with mesh.report()"
        )


def exact(
    mesh: Mesh, sources: Sources, *, solver: str = WINDOWS, timeout: float = TIMEOUT, memory: float = MEMORY
) -> FloatArray:
    """Exact geodesic distance on the polyhedral surface, the truth that all else is compared with.

    Parameters
    ----------
    mesh : Mesh
        Triangles, manifold or not.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices; the distance is that to the nearest of them.
    solver : {"windows", "pygeodesic", "gdist", "igl"}
        The windows of this package, or for a second opinion one of `EXACT_SOLVERS`. Those
        three are one implementation of Mitchell, Mount and Papadimitriou (1987) by Kirsanov and agree to rounding;
        libigl's traces a path from every vertex and takes the length, which makes it slow, and a check of the others.
        They need components of the sources that are manifold.
    timeout : float
        Seconds after which a solver of another package is stopped.
    memory : float
        Bytes by which the child process may grow (on Linux).

    Returns
    -------
    (n,) float64
        In the mesh's unit; ``inf`` if no source can be reached.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    ReferenceSolverError
        If the mesh is not of triangles; if the result is not between the straight line and the shortest path along
        edges. Of a solver of another package, also if the mesh is not manifold around the sources, or if it dies, takes
        too long or too much memory.
    MissingExtraError
        If the chosen solver is not installed.
    """
    if solver not in (WINDOWS, *EXACT_SOLVERS):
        raise ReferenceSolverError(f"solver must be one of {', '.join((WINDOWS, *EXACT_SOLVERS))}, not {solver!r}")
    return measured(solver, mesh, sources, timeout=timeout, memory=memory).distance


def meshlab(mesh: MeshLike, sources: Sources) -> FloatArray:
    """MeshLab's geodesic distance from selected vertices: a front that unfolds one triangle per step (pymeshlab).

    Neither exact nor a bound; 0.05 to 1 % from exact in the mean on ordinary meshes. The time explodes on some
    meshes with slivers: `measured` has a timeout. Mesh, sources, result and errors are those of `exact`, but the result
    is not checked, and the surface need not be manifold.
    """
    return measured("meshlab", mesh, sources).distance


def meshlab_border(mesh: MeshLike) -> FloatArray:
    """MeshLab's distance to the boundary (n,), through pymeshlab; ``inf`` on components without boundary.

    The sources are all boundary vertices, each with a front of its own; at vertices at which fronts of different
    sources meet, it falls back to lengths of edges. Compare with ``exact(mesh, mesh.boundary)``. Errors are those of
    `meshlab`.
    """
    mesh = as_simplices(mesh)
    return measured("meshlab_border", mesh, mesh.boundary).distance


def meshlab_heat(mesh: MeshLike, sources: Sources, *, m: float = 1.0) -> FloatArray:
    """MeshLab's heat method, through pymeshlab: single precision, extrinsic, minimum shifted to 0.

    `m` is the scale-free factor in t = m h^2. Parameters, result and errors are otherwise those of `meshlab`.
    """
    return measured("meshlab_heat", mesh, sources, m=m).distance
