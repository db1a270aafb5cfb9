"""Operators of triangles that are known by the lengths of their edges."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import IntrinsicTriangulation, from_edge_lengths, from_gluing, intrinsic_delaunay
from heat_igl.mesh import Mesh, connectivity
from heat_igl.mesh.mesh import checked_faces
from heat_igl.operators.elements import TriangleElements
from heat_igl.operators.matrices import Laplacian, OnLaplacian, Operators, check_laplacian
from heat_igl.operators.simplices import cotangent_laplacian, longest_sides, padded
from heat_igl.operators.suitability import fit_for_heat
from heat_igl.operators.surface import Surface
from heat_igl.typing import ArrayLike


def intrinsic_operators(
    triangulation: IntrinsicTriangulation,
    paths: Mesh | Operators | None = None,
    on_laplacian: OnLaplacian | None = None,
) -> Operators:
    """The operators of triangles that are known by their edge lengths, gradients in the plane of each (d = 2).

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        The triangles.
    paths : Mesh or Operators, optional
        Gives the components and the longest path along edges, on the same vertices or the first of them; without it
        both are found along the edges of the triangulation.
    on_laplacian : callable, optional
        Called with L as soon as it is known.
    """
    F, lengths, n = triangulation.F, triangulation.l, triangulation.n
    L = cotangent_laplacian(igl.cotmatrix_entries(lengths), F, n)
    if on_laplacian is not None:
        on_laplacian(L)
    referenced = np.zeros(n, bool)
    referenced[F] = True
    elements = TriangleElements(triangulation)
    components = connectivity.connected_components(F, n) if paths is None or paths.n_vertices < n else paths.components
    if paths is not None:
        of_given = paths.longest_distances
        longest = np.zeros(int(components.max()) + 1)
        longest[components[: paths.n_vertices]] = (
            paths.longest_distance if of_given is None else of_given[paths.components]
        )
    else:
        i, j, length = elements.edge_lengths()
        graph = connectivity.shortest_edge_graph(np.stack([i, j], axis=1), length, n)
        longest = connectivity.longest_paths(graph, components)
    return Operators(
        L=L,
        M=padded(igl.massmatrix_intrinsic(lengths, F), n),
        gradient=elements,
        weights=triangulation.areas,
        face_sizes=longest_sides(lengths),
        mean_edge_length=triangulation.mean_edge_length,
        components=components,
        boundary=triangulation.boundary,
        referenced=referenced,
        longest_distance=float(longest.max()),
        longest_distances=longest,
        lengths=elements,
        surface=Surface(triangulation, faces=None if triangulation.history else triangulation),
    )


def changed_operators(
    triangulation: IntrinsicTriangulation,
    faces: IntrinsicTriangulation,
    uncovered: IntrinsicTriangulation,
    paths: Mesh | Operators,
    on_laplacian: OnLaplacian | None = None,
) -> Operators:
    """The operators on triangles that were made from the faces of a surface by flips, a cover or refinement (d = 2).

    A cover goes over the surface twice, so L, M and the weights are one half of its own: a face of the mesh counts
    once, and L = D G holds. No weight is negative, not even on the boundary, which the cover does not have; `boundary`
    is that of the surface.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        The triangles to solve on.
    faces : IntrinsicTriangulation
        Those before any flip.
    uncovered : IntrinsicTriangulation
        The intrinsic Delaunay triangulation of `faces` on the same vertices.
    paths, on_laplacian
        As for `intrinsic_operators`; of a cover, `on_laplacian` gets twice L.
    """
    domain = intrinsic_operators(triangulation, paths, on_laplacian)
    V = paths.V if isinstance(paths, Mesh) else None
    if triangulation is uncovered:
        return replace(domain, surface=Surface(triangulation, faces, V=V))
    boundary = np.zeros(triangulation.n, bool)
    boundary[: faces.n] = faces.boundary
    domain = replace(domain, boundary=boundary, surface=Surface(triangulation, faces, uncovered, V))
    if not triangulation.is_cover:
        return domain
    return replace(domain, L=domain.L / 2, M=domain.M / 2, weights=domain.weights / 2)


def edge_length_operators(
    F: ArrayLike,
    lengths: ArrayLike,
    n: int | None = None,
    laplacian: Laplacian = "intrinsic-delaunay",
    twin: ArrayLike | None = None,
) -> Operators:
    """The operators of triangles that are given by their edge lengths.

    Parameters
    ----------
    F : (m, 3) array_like of int
        Vertices of each triangle.
    lengths : (m, 3) array_like
        ``lengths[f, c]`` is that of the side of triangle f opposite corner c.
    n : int, optional
        Number of vertices; one more than the largest in `F` if not given.
    laplacian : {"intrinsic-delaunay", "intrinsic-delaunay-refined", "auto", "cotan"}
        As for `operators`. If more than two faces meet at an edge, nothing is refined.
    twin : (m, 3) array_like of int, optional
        Which sides are glued, as for `intrinsic.from_gluing`; by default those that have both ends in common.

    Raises
    ------
    MeshError
        If `F`, `lengths` or `twin` cannot be used.
    ValueError
        If `laplacian` is unknown.
    """
    check_laplacian(laplacian)
    triangles = checked_faces(F, n, may_repeat=twin is not None)
    if triangles.shape[1] != 3:
        raise MeshError(f"F must have shape (m, 3), triangles, but it has shape {triangles.shape}")
    n = int(triangles.max()) + 1 if n is None else n
    faces = from_edge_lengths(lengths, triangles, n) if twin is None else from_gluing(lengths, triangles, n, twin)
    given = intrinsic_operators(faces)
    if laplacian == "cotan":
        return given
    uncovered = intrinsic_delaunay(faces)
    triangulation = uncovered
    if not (faces.twin == -2).any():
        triangulation = fit_for_heat(uncovered, laplacian, given.components)
    if triangulation is faces:
        return given
    return changed_operators(triangulation, faces, uncovered, given)
