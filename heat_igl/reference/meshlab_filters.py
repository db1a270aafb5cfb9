"""MeshLab's three filters for geodesic distance, through pymeshlab."""

from __future__ import annotations

from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.reference.guarded import MEMORY, TIMEOUT
from heat_igl.reference.measurement import measured
from heat_igl.sources import Sources
from heat_igl.typing import FloatArray

__all__ = ["meshlab", "meshlab_border", "meshlab_heat"]


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
