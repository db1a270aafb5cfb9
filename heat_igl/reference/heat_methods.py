"""The heat methods of libigl and of geometry-central."""

from __future__ import annotations

from heat_igl.mesh import MeshLike
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.reference.measurement import measured
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["igl_heat", "potpourri3d_heat"]


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
