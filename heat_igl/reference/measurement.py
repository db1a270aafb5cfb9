"""Run a solver on a mesh: choose it by name, check the distance, measure the cost; native ones in a child process.

A vertex that no source reaches is ``inf``, whatever number the solver would write there.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, MissingExtraError, ReferenceSolverError
from heat_igl.mesh import Mesh, MeshLike, as_simplices, connectivity
from heat_igl.reference import guarded
from heat_igl.reference.bounds import edge_paths, straight_lines
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
    "potpourri3d_marching": _Solver("potpourri3d_marching", "potpourri3d", "potpourri3d", "bench"),
}


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
    """Distance by a named solver, with the cost in time and memory.

    Parameters
    ----------
    solver : str
        "exact" or "windows" for the windows of this package, one of `EXACT_SOLVERS`, or the name of another function of
        `heat_igl.reference`: "meshlab", "meshlab_border", "meshlab_heat", "igl_heat", "potpourri3d_heat"; or
        "potpourri3d_marching" for fast marching by potpourri3d.
    mesh, sources
        As for `exact`.
    timeout, memory
        Bounds for native solvers; windows need neither.
    **options
        As for the function of that name.

    Returns
    -------
    Measured
        Seconds are sums over the components that hold a source.

    Raises
    ------
    SourceError, ReferenceSolverError, MissingExtraError
        As for `exact`.
    """
    mesh = as_simplices(mesh)
    if solver == "exact":
        solver = WINDOWS
    chosen = _SOLVERS.get(solver)
    if chosen is None and solver != WINDOWS:
        names = ", ".join(("exact", WINDOWS, *_SOLVERS))
        raise ReferenceSolverError(f"solver {solver!r} is unknown: choose one of {names}")
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
        {"V": mesh.V, "F": mesh.F, "sources": seeds, "components": mesh.components},
        options,
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
    remedy = "repair the mesh (mesh.report() lists the places), or compare with reference.meshlab"
    found = connectivity.facets(faces, mesh.n_vertices)
    crowded = found.vertices[found.n_faces > 2]
    if len(crowded):
        raise ReferenceSolverError(
            f"{len(crowded)} edges connected with the sources belong to more than two triangles (first: "
            f"{crowded[0].tolist()}), and exact solvers crash on such meshes: {remedy}"
        )
    pinched = connectivity.nonmanifold_vertices(faces, found, mesh.n_vertices)
    if len(pinched):
        raise ReferenceSolverError(
            f"at {len(pinched)} vertices connected with the sources two surfaces touch in a point (first: "
            f"{pinched[0]}), and exact solvers find no path through it: {remedy}"
        )
    collapsed = mesh.edges[(mesh.edge_lengths == 0) & around[mesh.edges[:, 0]]]
    if len(collapsed):
        raise ReferenceSolverError(
            f"{len(collapsed)} edges connected with the sources have length zero (first: {collapsed[0].tolist()}), "
            "by which exact solvers divide: merge vertices that lie in one place"
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
