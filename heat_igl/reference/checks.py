"""The demands on a mesh before an exact solver runs, and on a distance after any solver has run."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import ReferenceSolverError
from heat_igl.mesh import Mesh, connectivity
from heat_igl.reference.bounds import edge_paths, straight_lines
from heat_igl.typing import FloatArray, IntArray

__all__ = ["require_between_bounds", "require_finite", "require_manifold"]

# An exact distance outside the bounds by more than this fraction is wrong. Rounding is near 1e-15.
_TOLERANCE = 1e-9


def require_manifold(mesh: Mesh, seeds: IntArray) -> None:
    """Refuse defects by which the exact solvers crash or return too long a distance.

    Only the components of the seeds must be free of them.

    Raises
    ------
    ReferenceSolverError
        If an edge has more than two triangles or no length, or two surfaces touch in a vertex.
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


def require_finite(name: str, mesh: Mesh, distance: FloatArray) -> None:
    """Refuse a distance that has the wrong shape, or is not finite on a connected mesh.

    Raises
    ------
    ReferenceSolverError
        With the name of the solver.
    """
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


def require_between_bounds(
    name: str, mesh: Mesh, seeds: IntArray, distance: FloatArray, *, tolerance: float = _TOLERANCE, slack: float = 0.0
) -> None:
    """Refuse a distance that claims to be exact and is outside the bounds that hold on every mesh.

    By more than the fraction `tolerance` of the bound and the length `slack`.

    Raises
    ------
    ReferenceSolverError
        With the name of the solver.
    """
    too_short = distance < straight_lines(mesh, seeds) * (1 - tolerance) - slack
    too_long = distance > edge_paths(mesh, seeds) * (1 + tolerance) + slack
    if too_short.any() or too_long.any():
        raise ReferenceSolverError(
            f"{name} is wrong on this mesh: {int(too_short.sum())} vertices are nearer than a straight line and "
            f"{int(too_long.sum())} farther than a path along edges; look for zero areas with mesh.report()"
        )
