"""Exact geodesic distance on polyhedral surfaces."""

from __future__ import annotations

from heat_igl.errors import ReferenceSolverError
from heat_igl.mesh import Mesh
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.reference.measurement import EXACT_SOLVERS, measured
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["exact"]


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
        In the mesh's unit; ``inf`` if no source can be reached.

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
