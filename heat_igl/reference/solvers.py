"""Distances to compare with: exact polyhedral ones, MeshLab's filters, and the heat methods of other libraries.

Every native solver runs in a child process (`heat_igl.reference.guarded`), on one connected component at a time, so
that sources in several components work and what no source reaches is ``inf``, whichever number the solver would write
there. `docs/references.md` says how far each can be trusted. Closed forms are in `heat_igl.closed_forms`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import Any

import numpy as np

from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.mesh import Mesh, connectivity
from heat_igl.reference import guarded
from heat_igl.reference.bounds import edge_paths, straight_lines
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import FloatArray, IntArray

__all__ = [
    "EXACT_SOLVERS",
    "Measured",
    "close",
    "exact",
    "exact_solver",
    "igl_heat",
    "measured",
    "meshlab",
    "meshlab_border",
    "meshlab_heat",
    "potpourri3d_heat",
]

#: The exact solvers, fastest first; the last one needs no extra.
EXACT_SOLVERS = ("pygeodesic", "gdist", "igl")

# An exact distance outside its bounds by more than this fraction is no distance. Rounding is near 1e-15.
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class _Solver:
    function: str
    module: str
    package: str = ""
    extra: str = "validate"
    is_exact: bool = False
    options: Mapping[str, Any] = field(default_factory=dict)


_SOLVERS = {
    "gdist": _Solver("gdist_exact", "gdist", "tvb-gdist", is_exact=True),
    "pygeodesic": _Solver("pygeodesic_exact", "pygeodesic", "pygeodesic", is_exact=True),
    "igl": _Solver("igl_exact", "igl", is_exact=True),
    "igl_heat": _Solver("igl_heat", "igl", options={"t": None, "intrinsic_delaunay": False}),
    "meshlab": _Solver("meshlab_front", "pymeshlab", "pymeshlab"),
    "meshlab_border": _Solver("meshlab_border", "pymeshlab", "pymeshlab"),
    "meshlab_heat": _Solver("meshlab_heat", "pymeshlab", "pymeshlab", options={"m": 1.0}),
    "potpourri3d_heat": _Solver(
        "potpourri3d_heat", "potpourri3d", "potpourri3d", "bench", options={"t_coef": 1.0, "use_robust": True}
    ),
}


@dataclass(frozen=True, eq=False)
class Measured:
    """A distance and what it cost.

    Attributes
    ----------
    distance : (n,) float64
        In the mesh's unit.
    precompute_seconds : float
        What depends on the mesh alone.
    solve_seconds : float
        The rest.
    peak_memory : int or None
        Bytes by which the child process grew at most; None where the system cannot tell.
    """

    distance: FloatArray
    precompute_seconds: float
    solve_seconds: float
    peak_memory: int | None


def exact(
    mesh: Mesh, sources: Sources, *, solver: str = "auto", timeout: float = TIMEOUT, memory: float = MEMORY
) -> FloatArray:
    """Exact geodesic distance on the polyhedral surface, the truth that all else is compared with.

    Parameters
    ----------
    mesh : Mesh
        Triangles; the components of the sources must be manifold, with or without boundary.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices; the distance is that to the nearest of them.
    solver : {"auto", "pygeodesic", "gdist", "igl"}
        ``"auto"`` takes the first of `EXACT_SOLVERS` that is installed. All three are the same implementation
        of Mitchell, Mount and Papadimitriou (1987) by Kirsanov and agree to rounding; libigl's traces a path from
        every vertex and takes its length, which makes it slow, and a check of the others.
    timeout : float
        Seconds after which the solver is stopped.
    memory : float
        Bytes by which the child process may grow (on Linux).

    Returns
    -------
    (n,) float64
        In the mesh's unit; ``inf`` where no source can be reached.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    ReferenceSolverError
        If the mesh is not of triangles, or not manifold around the sources; if the solver dies, takes too long or
        too much memory; or if its result is not between the straight line and the shortest path along edges.
    MissingExtraError
        If the chosen solver is not installed.
    """
    if solver == "auto":
        solver = "exact"
    elif solver not in EXACT_SOLVERS:
        raise ReferenceSolverError(f"solver must be 'auto' or one of {', '.join(EXACT_SOLVERS)}, not {solver!r}")
    return measured(solver, mesh, sources, timeout=timeout, memory=memory).distance


def exact_solver() -> str:
    """The one of `EXACT_SOLVERS` that `exact` takes by itself: the first that is installed."""
    return next(name for name in EXACT_SOLVERS if name == "igl" or find_spec(_SOLVERS[name].module) is not None)


def meshlab(mesh: Mesh, sources: Sources, *, timeout: float = TIMEOUT, memory: float = MEMORY) -> FloatArray:
    """MeshLab's geodesic distance from selected vertices: a front that unfolds one triangle per step (pymeshlab).

    Neither exact nor a bound; 0.05 to 1 % from exact in the mean on ordinary meshes. Its time explodes on some
    meshes with slivers. Parameters, result and errors are those of `exact`, without its check of the result and its
    demand for manifold surfaces.
    """
    return measured("meshlab", mesh, sources, timeout=timeout, memory=memory).distance


def meshlab_border(mesh: Mesh, *, timeout: float = TIMEOUT, memory: float = MEMORY) -> FloatArray:
    """MeshLab's distance to the boundary (n,), through pymeshlab; ``inf`` on components without boundary.

    The sources are all boundary vertices, each with a front of its own; where fronts of different sources meet, it
    falls back to lengths of edges. Compare with ``exact(mesh, mesh.boundary)``. Errors are those of `meshlab`.
    """
    return measured("meshlab_border", mesh, mesh.boundary, timeout=timeout, memory=memory).distance


def meshlab_heat(
    mesh: Mesh, sources: Sources, *, m: float = 1.0, timeout: float = TIMEOUT, memory: float = MEMORY
) -> FloatArray:
    """MeshLab's heat method, through pymeshlab: single precision, extrinsic, minimum shifted to 0.

    `m` is the scale-free factor in t = m h^2. Parameters, result and errors are otherwise those of `meshlab`.
    """
    return measured("meshlab_heat", mesh, sources, m=m, timeout=timeout, memory=memory).distance


def igl_heat(
    mesh: Mesh,
    sources: Sources,
    *,
    t: float | None = None,
    intrinsic_delaunay: bool = False,
    timeout: float = TIMEOUT,
    memory: float = MEMORY,
) -> FloatArray:
    """The heat method of libigl exactly as it comes, for parity.

    On a mesh with boundary it averages the heat of Neumann and Dirichlet conditions; it shifts by the mean over the
    sources, so that of several sources none need read 0; `t` (a squared length) defaults to the square of the mean
    edge length. Parameters, result and errors are otherwise those of `meshlab`.
    """
    options = {"t": t, "intrinsic_delaunay": intrinsic_delaunay}
    return measured("igl_heat", mesh, sources, **options, timeout=timeout, memory=memory).distance


def potpourri3d_heat(
    mesh: Mesh,
    sources: Sources,
    *,
    t_coef: float = 1.0,
    use_robust: bool = True,
    timeout: float = TIMEOUT,
    memory: float = MEMORY,
) -> FloatArray:
    """geometry-central's heat method through potpourri3d, exactly as it comes, for comparison.

    It shifts by the mean over the sources; `use_robust` solves on an intrinsic Delaunay tufted cover. Parameters,
    result and errors are otherwise those of `meshlab`.
    """
    options = {"t_coef": t_coef, "use_robust": use_robust}
    return measured("potpourri3d_heat", mesh, sources, **options, timeout=timeout, memory=memory).distance


def close() -> None:
    """End the child process that serves the references; it ends by itself when Python does."""
    guarded.close()


def measured(
    solver: str, mesh: Mesh, sources: Sources, *, timeout: float = TIMEOUT, memory: float = MEMORY, **options: Any
) -> Measured:
    """Distance by a named native solver, with what it cost.

    Parameters
    ----------
    solver : str
        One of `EXACT_SOLVERS`, or the name of another function of this module.
    mesh, sources, timeout, memory
        As for `exact`.
    **options
        As for the function of that name.

    Returns
    -------
    Measured
        Seconds and memory over all components that hold a source.

    Raises
    ------
    SourceError, ReferenceSolverError, MissingExtraError
        As for `exact`.
    """
    if solver == "exact":
        solver = exact_solver()
    chosen = _SOLVERS.get(solver)
    if chosen is None:
        raise ReferenceSolverError(f"solver {solver!r} is unknown: choose one of exact, {', '.join(_SOLVERS)}")
    if mesh.is_tetrahedral:
        raise ReferenceSolverError(
            f"{solver} works on triangles, and the mesh holds tetrahedra: use heat_igl.closed_forms.convex_solid"
        )
    if find_spec(chosen.module) is None:
        raise MissingExtraError.of(f"the reference {solver}", chosen.package, chosen.extra)
    # A closed surface has no boundary to start from, and everything is infinitely far from it.
    to_boundary = solver == "meshlab_border"
    seeds = np.flatnonzero(mesh.boundary) if to_boundary else vertex_sources(sources, mesh.n_vertices)

    if chosen.is_exact:
        _require_manifold(mesh, seeds)

    def run(part: Mesh, part_seeds: IntArray) -> guarded.Reply:
        arrays = {"V": part.V, "F": part.F}
        if not to_boundary:
            arrays["sources"] = part_seeds
        reply = guarded.call(
            f"heat_igl.reference.native:{chosen.function}",
            arrays,
            {**chosen.options, **options},
            timeout=timeout,
            memory=memory,
        )
        _check(solver, chosen, part, part_seeds, reply.values["distance"])
        return reply

    return _over_components(mesh, seeds, run)


def _over_components(mesh: Mesh, seeds: IntArray, run: Callable[[Mesh, IntArray], guarded.Reply]) -> Measured:
    """Run on each component that holds a seed: solvers stop at vertices without faces and at components they miss."""
    distance = np.full(mesh.n_vertices, np.inf)
    distance[seeds] = 0.0  # also where no face uses the seed
    costs = np.zeros(2)
    peaks: list[int | None] = [0]
    labels = np.unique(mesh.components[seeds])
    for label in labels:
        inside = mesh.components == label
        part, index = mesh, seeds
        if not inside.all():
            faces = mesh.F[inside[mesh.F[:, 0]]]
            if not len(faces):
                continue
            renumbered = np.cumsum(inside) - 1
            part = Mesh(mesh.V[inside], renumbered[faces])
            index = renumbered[seeds[inside[seeds]]]
        reply = run(part, index)
        distance[inside] = reply.values["distance"]
        costs += reply.values["precompute_seconds"], reply.values["solve_seconds"]
        peaks.append(reply.peak_memory)
    known = [peak for peak in peaks if peak is not None]
    return Measured(distance, float(costs[0]), float(costs[1]), max(known) if len(known) == len(peaks) else None)


def _require_manifold(mesh: Mesh, seeds: IntArray) -> None:
    """Refuse what makes the exact solvers crash or return too long a distance; elsewhere the mesh may be bad."""
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


def _check(name: str, solver: _Solver, mesh: Mesh, seeds: IntArray, distance: FloatArray) -> None:
    """Refuse what is not a distance; what is one but inaccurate is for the caller to see."""
    if distance.shape != (mesh.n_vertices,):
        raise ReferenceSolverError(
            f"{name} returned an array of shape {distance.shape} for {mesh.n_vertices} vertices: report this as a bug"
        )
    n_bad = int((~np.isfinite(distance)).sum())
    if n_bad:
        raise ReferenceSolverError(
            f"{name} returned {n_bad} of {mesh.n_vertices} distances that are not finite on one connected component: "
            "look for slivers and zero areas with mesh.report()"
        )
    if not solver.is_exact:
        return
    too_short = distance < straight_lines(mesh, seeds) * (1 - _TOLERANCE)
    too_long = distance > edge_paths(mesh, seeds) * (1 + _TOLERANCE)
    if too_short.any() or too_long.any():
        raise ReferenceSolverError(
            f"{name} is wrong on this mesh: {int(too_short.sum())} vertices are nearer than a straight line and "
            f"{int(too_long.sum())} farther than a path along edges; look for zero areas with mesh.report()"
        )
