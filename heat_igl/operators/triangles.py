"""Operators of a mesh: on its intrinsic Delaunay triangulation, its own faces, its tufted cover, or its tetrahedra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from heat_igl.intrinsic import (
    Merged,
    has_nonmanifold_edges,
    intrinsic_delaunay,
    intrinsic_triangulation,
    tufted_cover,
)
from heat_igl.mesh import Mesh, connectivity
from heat_igl.operators.intrinsic import intrinsic_operators
from heat_igl.operators.matrices import Laplacian, OnLaplacian, Operators, check_laplacian
from heat_igl.operators.simplices import cotan_operators, surface_operators
from heat_igl.operators.surface import Surface

__all__ = ["operators", "tufted_operators", "unfolding_surface"]


def operators(
    mesh: Mesh, laplacian: Laplacian = "intrinsic-delaunay", on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of `mesh`.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    laplacian : {"intrinsic-delaunay", "cotan"}
        On which triangulation of a triangle mesh: its intrinsic Delaunay triangulation, whose inner edges have no
        negative weight, or the mesh's own faces, as in the paper. Where more than two faces meet at an edge, the
        former takes faces that are there twice once, and goes by the tufted cover if such edges remain. Tetrahedra
        always keep their own.
    on_laplacian : callable, optional
        Called with L, or a multiple of it, as soon as it is known.

    Raises
    ------
    MeshError
        If a tetrahedron has no volume.
    ValueError
        If `laplacian` is neither.
    """
    check_laplacian(laplacian)
    if mesh.is_tetrahedral:
        return cotan_operators(mesh, on_laplacian)
    history: tuple[Merged, ...] = ()
    if laplacian == "intrinsic-delaunay" and has_nonmanifold_edges(mesh):
        # A face that is there twice is one piece of surface; often that is all that keeps a mesh from being manifold.
        mesh, history = _without_duplicates(mesh)
        if has_nonmanifold_edges(mesh):
            return tufted_operators(mesh, history, on_laplacian)
    faces = triangulation = replace(intrinsic_triangulation(mesh), history=history)
    if laplacian == "intrinsic-delaunay":
        triangulation = intrinsic_delaunay(faces)
    surface = Surface(triangulation, faces, V=mesh.V)
    if triangulation.n_flips or triangulation.lengthening:
        return replace(intrinsic_operators(triangulation, mesh, on_laplacian), surface=surface)
    return surface_operators(mesh, surface, on_laplacian)


def tufted_operators(
    mesh: Mesh, history: tuple[Merged, ...] = (), on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of any triangle mesh by way of its tufted cover, made intrinsic Delaunay (d = 2).

    The cover goes over the surface twice, so L, M and the weights are one half of its own: a face of the mesh counts
    once, and L = D G holds. No weight is negative, not even on the boundary, which the cover does not have; `boundary`
    is that of the mesh.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    history : tuple of Merged
        How the faces of `mesh` came from those that points refer to.
    on_laplacian : callable, optional
        Called with twice L as soon as it is known.
    """
    cover = replace(tufted_cover(mesh), history=history)
    faces = replace(intrinsic_triangulation(mesh), history=history)
    triangulation = intrinsic_delaunay(cover)
    domain = intrinsic_operators(triangulation, mesh, on_laplacian)
    return replace(
        domain,
        L=domain.L / 2,
        M=domain.M / 2,
        weights=domain.weights / 2,
        boundary=mesh.boundary,
        surface=Surface(triangulation, faces, uncovered=intrinsic_delaunay(faces), V=mesh.V),
    )


def unfolding_surface(mesh: Mesh) -> Surface:
    """The triangles of a triangle mesh in which paths are unfolded, as `operators` has them, without any operator."""
    history: tuple[Merged, ...] = ()
    if has_nonmanifold_edges(mesh):
        mesh, history = _without_duplicates(mesh)
    faces = replace(intrinsic_triangulation(mesh), history=history)
    return Surface(intrinsic_delaunay(faces), faces, V=mesh.V)


def _without_duplicates(mesh: Mesh) -> tuple[Mesh, tuple[Merged, ...]]:
    """The mesh with each face once, and which faces became which."""
    repeated = connectivity.duplicate_faces(mesh.F, mesh.n_vertices)
    if not len(repeated):
        return mesh, ()
    kept = np.delete(np.arange(mesh.n_faces), repeated)
    ascending = np.argsort(mesh.F, axis=1)
    first, inverse, _ = connectivity.unique_rows(np.take_along_axis(mesh.F, ascending, axis=1), mesh.n_vertices)
    copied = first[inverse]
    corner = np.empty_like(mesh.F)
    np.put_along_axis(corner, ascending, ascending[copied], axis=1)
    return Mesh(mesh.V, mesh.F[kept]), (Merged(np.searchsorted(kept, copied), corner),)
