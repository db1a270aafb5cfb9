"""The functions of this room that find a distance: the exact one, and those of MeshLab, libigl and geometry-central."""

from __future__ import annotations

from heat_igl.errors import ReferenceSolverError
from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.reference.measurement import EXACT_SOLVERS, WINDOWS, measured
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray


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


def meshlab(mesh: MeshLike, sources: Sources, *, timeout: float = TIMEOUT, memory: float = MEMORY) -> FloatArray:
    """MeshLab's geodesic distance from selected vertices: a front that unfolds one triangle per step (pymeshlab).

    Neither exact nor a bound; 0.05 to 1 % from exact in the mean on ordinary meshes. The time explodes on some
    meshes with slivers. Parameters, result and errors are those of `exact`, but the result is not checked, and the
    surface need not be manifold.
    """
    return measured("meshlab", mesh, sources, timeout=timeout, memory=memory).distance


def meshlab_border(mesh: MeshLike, *, timeout: float = TIMEOUT, memory: float = MEMORY) -> FloatArray:
    """MeshLab's distance to the boundary (n,), through pymeshlab; ``inf`` on components without boundary.

    The sources are all boundary vertices, each with a front of its own; at vertices at which fronts of different
    sources meet, it falls back to lengths of edges. Compare with ``exact(mesh, mesh.boundary)``. Errors are those of
    `meshlab`.
    """
    mesh = as_simplices(mesh)
    return measured("meshlab_border", mesh, mesh.boundary, timeout=timeout, memory=memory).distance


def meshlab_heat(
    mesh: MeshLike, sources: Sources, *, m: float = 1.0, timeout: float = TIMEOUT, memory: float = MEMORY
) -> FloatArray:
    """MeshLab's heat method, through pymeshlab: single precision, extrinsic, minimum shifted to 0.

    `m` is the scale-free factor in t = m h^2. Parameters, result and errors are otherwise those of `meshlab`.
    """
    return measured("meshlab_heat", mesh, sources, m=m, timeout=timeout, memory=memory).distance


def igl_heat(
    mesh: MeshLike,
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
    mesh: MeshLike,
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
