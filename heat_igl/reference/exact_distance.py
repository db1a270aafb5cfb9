"""Exact geodesic distance on polyhedral surfaces."""

from __future__ import annotations

from heat_igl.errors import ReferenceSolverError
from heat_igl.mesh import Mesh
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.reference.measurement import EXACT_SOLVERS, WINDOWS, measured
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["exact"]


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
        The windows of this package (``"auto"`` means them too), or for a second opinion one of `EXACT_SOLVERS`. Those
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
    if solver == "auto":
        solver = WINDOWS
    elif solver not in (WINDOWS, *EXACT_SOLVERS):
        names = ", ".join((WINDOWS, *EXACT_SOLVERS))
        raise ReferenceSolverError(f"solver must be 'auto' or one of {names}, not {solver!r}")
    return measured(solver, mesh, sources, timeout=timeout, memory=memory).distance
