"""Operators of meshes and points: on their triangles or others made of these, on edge lengths and on tetrahedra."""

from __future__ import annotations

from dataclasses import replace
from functools import partial, reduce

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError, shown
from heat_igl.intrinsic import (
    Change,
    IntrinsicTriangulation,
    each_face_once,
    from_edge_lengths,
    from_gluing,
    has_nonmanifold_edges,
    intrinsic_delaunay,
    intrinsic_triangulation,
    mollify,
    tufted_cover,
)
from heat_igl.kernels.linear import assembling
from heat_igl.mesh import Mesh, PointCloud, PolygonFans, PolygonMesh, connectivity
from heat_igl.mesh.mesh import checked_faces
from heat_igl.operators.matrices import (
    Laplacian,
    OnLaplacian,
    Operators,
    Surface,
    TriangleElements,
    check_laplacian,
    laplacian_of_gradient,
)
from heat_igl.operators.metric_simplices import MetricSimplices
from heat_igl.operators.suitability import fit_for_heat
from heat_igl.typing import ArrayLike, FloatArray, IntArray


def cotangent_laplacian(cotangents: FloatArray, F: IntArray, n: int) -> sp.csc_matrix:
    """L (n, n) of triangles, zeros stored: that of `igl.cotmatrix`, assembled in a third of the time and memory.

    From half the cotangents (m, 3) of the angles opposite each side, as `igl.cotmatrix_entries` gives them. A vertex
    that no triangle uses has an empty row.
    """
    indptr, indices, data = assembling.laplacian(F.astype(np.int32), np.ascontiguousarray(cotangents).ravel(), n)
    return sp.csc_matrix((data, indices, indptr), shape=(n, n))


def _assembled(
    mesh: Mesh,
    L: sp.csc_matrix,
    gradient: sp.csc_matrix | TriangleElements,
    lengths: TriangleElements | None = None,
    surface: Surface | None = None,
) -> Operators:
    """The operators with given L and G, the rest by the positions of the vertices."""
    unit, measure_dimension = _unit(mesh), mesh.F.shape[1] - 1
    return Operators(
        L=L,
        M=padded(igl.massmatrix(mesh.V / unit, mesh.F), mesh.n_vertices) * unit**measure_dimension,
        gradient=gradient,
        weights=mesh.measures,
        face_sizes=longest_sides(igl.edge_lengths(mesh.V, mesh.F)),
        mean_edge_length=float(mesh.edge_lengths.mean()),
        components=mesh.components,
        boundary=mesh.boundary,
        referenced=mesh.referenced,
        longest_distance=mesh.longest_distance,
        longest_distances=mesh.longest_distances,
        is_surface=not mesh.is_tetrahedral,
        lengths=lengths,
        surface=surface,
    )


def check_measures(mesh: Mesh) -> None:
    """Raise a MeshError if a triangle has no area, or a tetrahedron no volume."""
    flat = mesh.measures <= 0
    if flat.any():
        first = int(np.flatnonzero(flat)[0])
        raise MeshError(
            f"F[{first}] = {mesh.F[first].tolist()} has no {'volume' if mesh.is_tetrahedral else 'area'} "
            f"({int(flat.sum())} of {mesh.n_faces} faces): remove these faces"
        )


def _unit(mesh: Mesh) -> float:
    """A unit of length near h.

    libigl multiplies up to six lengths before it divides; in this unit that cannot leave the double range, and as a
    power of two it changes no digit.
    """
    return float(2.0 ** round(np.log2(float(mesh.edge_lengths.mean()))))


def _gradient(V: FloatArray, F: IntArray, unit: float) -> sp.csc_matrix:
    """G (3 m, n) in space."""
    return igl.grad(V / unit, F) / unit


def longest_sides(lengths: FloatArray) -> FloatArray:
    """Maximum of each row; by columns, which for short rows takes a tenth of the time."""
    return np.asarray(reduce(np.maximum, lengths.T))


def padded(matrix: sp.csc_matrix, n: int) -> sp.csc_matrix:
    """The matrix with n rows and columns: libigl stops at the last vertex that a face uses; the rest is empty."""
    if matrix.shape[0] < n:
        matrix.resize((n, n))
    return matrix


def intrinsic_operators(
    triangulation: IntrinsicTriangulation,
    paths: Mesh | Operators | None = None,
    on_laplacian: OnLaplacian | None = None,
) -> Operators:
    """The operators of triangles that are known by their edge lengths, gradients in the plane of each (d = 2).

    `paths` gives the components and the longest path along edges, on the same vertices or the first of them; without it
    both are found along the edges of the triangulation. `on_laplacian` is called with L as soon as it is known. In the
    `surface`, points refer to these triangles.
    """
    F, lengths, n = triangulation.F, triangulation.l, triangulation.n
    L = cotangent_laplacian(igl.cotmatrix_entries(lengths), F, n)
    if on_laplacian is not None:
        on_laplacian(L)
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
        referenced=connectivity.mask_of(F, n),
        longest_distance=float(longest.max()),
        longest_distances=longest,
        lengths=elements,
        surface=Surface(triangulation, triangulation),
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

    `faces` are those before any flip, and `uncovered` their intrinsic Delaunay triangulation on the same vertices;
    `paths` and `on_laplacian` are as for `intrinsic_operators`, but of a cover `on_laplacian` gets twice L.
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
    F: ArrayLike, lengths: ArrayLike, n: int | None = None, laplacian: Laplacian = "auto", twin: ArrayLike | None = None
) -> Operators:
    """The operators of triangles that are known by their edge lengths alone; positions are not needed.

    Parameters
    ----------
    F : (m, 3) array_like of int
        Vertices of each triangle.
    lengths : (m, 3) array_like
        ``lengths[f, c]`` is that of the side of triangle f opposite corner c, as `igl.edge_lengths` gives it; both
        triangles at an edge give it the same length.
    n : int, optional
        Number of vertices; one more than the largest in `F` if not given.
    laplacian : {"auto", "intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan"}
        As for `operators`. Where more than two faces meet at an edge, nothing is refined, and no tufted cover is made.
    twin : (m, 3) array_like of int, optional
        ``twin[f, c]`` is ``3 g + d`` where side c of triangle f is glued to side d of triangle g, and -1 on the
        boundary. By default sides with the same ends are glued. It is needed where several edges join the same two
        vertices, or a vertex with itself, as in intrinsic triangulations; then a triangle may repeat a vertex.

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
        - "auto", for each component: refined if triangles with an angle below 20 degrees cover more than 0.3 of the
          area, if triangles much larger than the mean cover more than 0.55, or if it has fewer than 64 vertices, but
          not if all such components have fewer than 0.01 of the faces; else the tufted cover if boundary edges have
          large negative weights; else "intrinsic-delaunay".
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
        check_measures(mesh)
        G = _gradient(mesh.V, mesh.F, _unit(mesh))
        # The cotangents of dihedral angles lose digits on flat tetrahedra, 1e-5 of the largest entry on a scanned
        # volume; the gradient does not, and D G is the same matrix.
        L = laplacian_of_gradient(G, mesh.measures)
        if on_laplacian is not None:
            on_laplacian(L)
        return replace(_assembled(mesh, L, G), simplices=MetricSimplices.in_space(mesh))
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
    check_measures(mesh)
    surface = Surface(triangulation, faces, V=mesh.V)
    elements = TriangleElements(triangulation, partial(_gradient, mesh.V, mesh.F, _unit(mesh)))
    L = cotangent_laplacian(igl.cotmatrix_entries(mesh.V / _unit(mesh), mesh.F), mesh.F, mesh.n_vertices)
    if on_laplacian is not None:
        on_laplacian(L)
    return _assembled(mesh, L, elements, elements, surface)


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
    faces = intrinsic_triangulation(mesh, margin)
    if (faces.twin == -2).any():
        mesh, history = _without_duplicates(mesh)
        faces = replace(intrinsic_triangulation(mesh, margin), history=history)
    triangulation = faces
    if faces.lengthening:
        # As `HalfEdges.flip`: what lies flat is flipped away before edges are lengthened.
        flat = intrinsic_delaunay(replace(faces, l=igl.edge_lengths(mesh.V, mesh.F)), orients=orients)
        triangulation = replace(flat, l=flat.l + mollify(flat.l, flat.F, margin))
    return Surface(intrinsic_delaunay(triangulation, orients=orients), faces, V=mesh.V)


def _without_duplicates(mesh: Mesh) -> tuple[Mesh, tuple[Change, ...]]:
    """The mesh with each face once, and which faces became which."""
    faces, kept = each_face_once(intrinsic_triangulation(mesh))
    if len(kept) == mesh.n_faces:
        return mesh, ()
    return Mesh(mesh.V, mesh.F[kept]), faces.history


def point_cloud_operators(
    cloud: PointCloud, laplacian: Laplacian = "intrinsic-delaunay", on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of a point cloud: those of `PointCloud.triangles`, made intrinsic Delaunay.

    If the triangles have a boundary, they are glued to a copy of themselves there, to their tufted cover. At the
    boundary of scattered points, triangles are long and thin; on the cover their outer edges are flipped, too.

    Parameters
    ----------
    cloud : PointCloud
        n points.
    laplacian : {"intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan", "auto"}
        As for `operators`; "cotan" keeps the triangles as they are, and "auto" is "intrinsic-delaunay".
    on_laplacian : callable, optional
        Called with L, or a multiple of it, as soon as it is known.

    Raises
    ------
    MeshError
        If `cloud` is none, or no three points are near enough to one another to make a triangle.
    ValueError
        If `laplacian` is neither.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> domain = heat_igl.operators.point_cloud_operators(heat_igl.PointCloud(heat_igl.shapes.icosphere(4).V))
    >>> round(float(domain.M.sum() / (4 * np.pi)), 2)  # the area of the unit sphere
    1.0
    >>> bool(np.allclose(domain.L @ np.ones(domain.n), 0))
    True
    """
    if not isinstance(cloud, PointCloud):
        raise MeshError(f"cloud must be a PointCloud, not {shown(cloud)}: PointCloud(P) makes one of points")
    check_laplacian(laplacian)
    mesh = cloud.triangles
    # The triangles of scattered points are even enough.
    laplacian = "intrinsic-delaunay" if laplacian == "auto" else laplacian
    if laplacian == "intrinsic-delaunay" and mesh.boundary.any():
        return tufted_operators(mesh, (), on_laplacian, laplacian)
    return operators(mesh, laplacian, on_laplacian)
