"""Operators of a mesh: on its intrinsic Delaunay triangulation, refined or not, on the faces, or on the tetrahedra."""

from __future__ import annotations

from dataclasses import replace

from heat_igl.intrinsic import (
    Change,
    each_face_once,
    has_nonmanifold_edges,
    intrinsic_delaunay,
    intrinsic_triangulation,
    tufted_cover,
)
from heat_igl.mesh import Mesh, PolygonFans, PolygonMesh
from heat_igl.operators.intrinsic import changed_operators, intrinsic_operators
from heat_igl.operators.matrices import Laplacian, OnLaplacian, Operators, check_laplacian
from heat_igl.operators.simplices import cotan_operators, surface_operators
from heat_igl.operators.suitability import fit_for_heat
from heat_igl.operators.surface import Surface


def operators(
    mesh: Mesh, laplacian: Laplacian = "intrinsic-delaunay", on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of `mesh`.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    laplacian : {"intrinsic-delaunay", "intrinsic-delaunay-refined", "auto", "cotan"}
        On which triangulation of a triangle mesh. Tetrahedra always keep their own.

        - "intrinsic-delaunay": on the mesh's vertices, no inner edge with a negative weight. If more than two faces
          meet at an edge, faces that are there twice are taken once, and if such edges remain, the tufted cover.
        - "intrinsic-delaunay-refined": with more vertices, until no angle is below 25 degrees (`delaunay_refinement`),
          at most four times as many and 4000 more; of a surface with a boundary or without an orientation, on the
          tufted cover. Meshes of fewer than 1000 vertices get about a thousand. `Operators.n_given` are the mesh's.
        - "auto": refined if triangles with an angle below 20 degrees cover more than 0.3 of the area, if triangles much
          larger than the mean cover more than 0.55, or if the mesh has fewer than 64 vertices; else the tufted cover if
          boundary edges have large negative weights; else "intrinsic-delaunay".
        - "cotan": the mesh's own faces, as in the paper.
    on_laplacian : callable, optional
        Called with L, or a multiple of it, as soon as it is known.

    Raises
    ------
    MeshError
        If a tetrahedron has no volume.
    ValueError
        If `laplacian` is none of these.
    """
    check_laplacian(laplacian)
    if mesh.is_tetrahedral:
        return cotan_operators(mesh, on_laplacian)
    history: tuple[Change, ...] = ()
    if laplacian != "cotan" and has_nonmanifold_edges(mesh):
        # A face that is there twice is one piece of surface; often that is all that keeps a mesh from being manifold.
        mesh, history = _without_duplicates(mesh)
        if has_nonmanifold_edges(mesh):
            return tufted_operators(mesh, history, on_laplacian, laplacian)
    faces = triangulation = replace(intrinsic_triangulation(mesh), history=history)
    if laplacian != "cotan":
        uncovered = intrinsic_delaunay(faces)
        triangulation = fit_for_heat(uncovered, laplacian, mesh.components)
        if triangulation is not faces or triangulation.lengthening:
            return changed_operators(triangulation, faces, uncovered, mesh, on_laplacian)
    if triangulation.lengthening:
        return replace(
            intrinsic_operators(triangulation, mesh, on_laplacian), surface=Surface(triangulation, faces, V=mesh.V)
        )
    return surface_operators(mesh, Surface(triangulation, faces, V=mesh.V), on_laplacian)


def tufted_operators(
    mesh: Mesh,
    history: tuple[Change, ...] = (),
    on_laplacian: OnLaplacian | None = None,
    laplacian: Laplacian = "intrinsic-delaunay",
) -> Operators:
    """The operators of any triangle mesh by way of the tufted cover, made intrinsic Delaunay (see `changed_operators`).

    `history` tells how the faces of `mesh` came from those that points refer to; `on_laplacian` is called with twice L;
    `laplacian`, other than "cotan", says whether the cover is refined, see `operators`.
    """
    cover = tufted_cover(mesh)
    triangulation = intrinsic_delaunay(replace(cover, history=(*history, *cover.history)))
    triangulation = fit_for_heat(triangulation, laplacian, mesh.components)
    faces = replace(intrinsic_triangulation(mesh), history=history)
    return changed_operators(triangulation, faces, intrinsic_delaunay(faces), mesh, on_laplacian)


def fan_operators(mesh: PolygonMesh, laplacian: Laplacian = "auto") -> Operators:
    """The operators on the triangles between the sides and the virtual vertices of polygons (see `PolygonFans`).

    The virtual vertices follow the n of the polygons, as added vertices. Edges are flipped as `laplacian` says.
    """
    fans, drawn = PolygonFans.of(mesh), intrinsic_triangulation(mesh.triangles)
    return replace(operators(fans.mesh, laplacian), drawn_on=Surface(drawn, drawn, V=mesh.V), fans=fans)


def unfolding_surface(mesh: Mesh, margin: float | None = None, *, orients: bool = True) -> Surface:
    """The triangles of a triangle mesh in which paths are unfolded, as `operators` has them, without any operator.

    Triangles thinner than `margin` are mollified, see `mollify`; `orients` is that of `intrinsic_delaunay`.
    """
    history: tuple[Change, ...] = ()
    if has_nonmanifold_edges(mesh):
        mesh, history = _without_duplicates(mesh)
    faces = replace(intrinsic_triangulation(mesh, margin), history=history)
    return Surface(intrinsic_delaunay(faces, orients=orients), faces, V=mesh.V)


def _without_duplicates(mesh: Mesh) -> tuple[Mesh, tuple[Change, ...]]:
    """The mesh with each face once, and which faces became which."""
    faces, kept = each_face_once(intrinsic_triangulation(mesh))
    if len(kept) == mesh.n_faces:
        return mesh, ()
    return Mesh(mesh.V, mesh.F[kept]), faces.history
