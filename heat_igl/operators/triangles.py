"""The discrete Laplacian, mass, gradient and divergence, from libigl.

`Operators` is all that the three steps of the heat method know of a domain. A new kind of domain is a new function that
returns one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from typing import Literal

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    Merged,
    from_edge_lengths,
    has_nonmanifold_edges,
    intrinsic_delaunay,
    intrinsic_gradient,
    intrinsic_triangulation,
    tufted_cover,
)
from heat_igl.mesh import connectivity
from heat_igl.mesh.mesh import Mesh, checked_faces
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["Laplacian", "Operators", "cotan_operators", "intrinsic_operators", "operators", "tufted_operators"]

Laplacian = Literal["intrinsic-delaunay", "cotan"]
OnLaplacian = Callable[[sp.csc_matrix], None]


@dataclass(frozen=True, eq=False)
class Operators:
    """The operators of a domain with n vertices and m faces (triangles, or tetrahedra).

    Lengths are in the domain's own unit, d is the number of gradient components per face: 3 where faces lie in space,
    2 where each has a plane of its own.

    Attributes
    ----------
    L : (n, n) csc_matrix
        Cotangent Laplacian, symmetric, negative semidefinite, integrated: rows sum to 0. Unit 1 for triangles, length
        for tetrahedra. L = D G.
    M : (n, n) csc_matrix
        Lumped mass, diagonal: the area (volume) of each vertex's cell. Sums to the area of the domain.
    gradient : (d m, n) csc_matrix, or a function that makes it
        G, or how to make it: with compiled kernels, triangles that are known by their edge lengths do without.
    G : (d m, n) csc_matrix
        Gradient of piecewise linear functions, constant per face, stacked by coordinate: row ``k * m + f`` is
        component k on face f. Unit 1 / length. Made on first use, as D is.
    D : (n, d m) csc_matrix
        Integrated divergence, D = -G^T W with W the face areas repeated d times.
    weights : (m,) float64
        Area (volume) of each face.
    face_sizes : (m,) float64
        Longest edge of each face.
    mean_edge_length : float
        h, over the distinct edges of the triangulation that the operators belong to.
    components : (n,) int64
        Component label of each vertex.
    boundary : (n,) bool
        Vertices on the boundary.
    referenced : (n,) bool
        Vertices that a face uses; on the others M is 0.
    longest_distance : float
        Length of a longest shortest path along edges; heat has to last that far.
    triangulation : IntrinsicTriangulation or None
        The triangles that the operators belong to; None for tetrahedra, and where distance is not measured along them:
        their lengths make straight lines from sources, are unfolded, stand for a G that is not made yet, and heat is
        fitted to them (`fitted_laplacian`). L, M and G may be others.
    surface : IntrinsicTriangulation or None
        Triangles of the surface itself, each once, where `triangulation` is its tufted cover and goes over it twice.
        Paths are to be unfolded in these: on the cover a path over an edge of five faces goes on in one of them only.
    faces : IntrinsicTriangulation or None
        The triangles before any flip, but each once: what points and curves on faces are carried to. None where
        `triangulation` is.
    is_surface : bool
        Whether the domain has two dimensions; tetrahedra have three.
    chords : (n, n) csc_matrix or None
        How far apart the vertices are that an entry of L couples, symmetric, where the edges of `triangulation` do not
        say so; None where they do, and where that is not known.
    """

    L: sp.csc_matrix
    M: sp.csc_matrix
    gradient: sp.csc_matrix | Callable[[], sp.csc_matrix]
    weights: FloatArray
    face_sizes: FloatArray
    mean_edge_length: float
    components: IntArray
    boundary: BoolArray
    referenced: BoolArray
    longest_distance: float
    triangulation: IntrinsicTriangulation | None = None
    surface: IntrinsicTriangulation | None = None
    faces: IntrinsicTriangulation | None = None
    is_surface: bool = True
    chords: sp.csc_matrix | None = None

    @property
    def n(self) -> int:
        """Number of vertices."""
        return int(self.L.shape[0])

    @property
    def given_faces(self) -> IntArray | None:
        """Vertices (m, 3) of the triangles that points and curves refer to; None without `faces`."""
        if self.faces is None:
            return None
        F = self.faces.F
        for move in self.faces.history:
            if isinstance(move, Merged):
                F = move.before(F)
        return F

    @property
    def has_lengths(self) -> bool:
        """Whether the lengths of what L couples are known, so that heat is fitted to them (`fitted_laplacian`)."""
        return self.triangulation is not None or self.chords is not None

    @property
    def dimension(self) -> int:
        """Number d of gradient components per face."""
        return int(self.G.shape[0]) // len(self.weights)

    @cached_property
    def n_components(self) -> int:
        """Number of components, vertices without faces among them."""
        return int(self.components.max()) + 1

    def on_vertices(self, of_component: AnyArray) -> AnyArray:
        """What each vertex (n,) has by its component."""
        return np.broadcast_to(of_component, self.n) if self.n_components == 1 else of_component[self.components]

    @cached_property
    def G(self) -> sp.csc_matrix:
        """Gradient (d m, n)."""
        return self.gradient() if callable(self.gradient) else self.gradient

    @cached_property
    def gradient_rows(self) -> sp.csr_matrix:
        """G by rows, as it is used."""
        return self.G.tocsr()

    @cached_property
    def boundary_faces(self) -> IntArray:
        """Faces (k,) with a vertex on the boundary."""
        if self.triangulation is not None:
            return np.flatnonzero(self.boundary[self.triangulation.F].any(axis=1))
        return np.asarray(np.unique(self.G[:, self.boundary].indices % len(self.weights)))

    @cached_property
    def D(self) -> sp.csc_matrix:
        """Integrated divergence (n, d m)."""
        rows = self.gradient_rows
        scale = np.repeat(np.tile(-self.weights, self.dimension), np.diff(rows.indptr))
        return sp.csc_matrix((scale * rows.data, rows.indices, rows.indptr), shape=rows.shape[::-1])


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
        Called with L, or a multiple of it, as soon as it is there, so that what needs no more can begin.

    Raises
    ------
    ValueError
        If `laplacian` is neither.
    """
    if laplacian not in ("intrinsic-delaunay", "cotan"):
        raise ValueError(f"laplacian must be 'intrinsic-delaunay' or 'cotan', not {laplacian!r}")
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
    if triangulation.n_flips or triangulation.lengthening:
        return replace(intrinsic_operators(triangulation, mesh, on_laplacian), faces=faces)
    return replace(cotan_operators(mesh, on_laplacian), triangulation=triangulation, faces=faces)


def cotan_operators(mesh: Mesh, on_laplacian: OnLaplacian | None = None) -> Operators:
    """The operators on the mesh's own triangles or tetrahedra, gradients in space (d = 3); `on_laplacian` as above.

    Raises
    ------
    MeshError
        If a tetrahedron has no volume.
    """
    flat = mesh.measures <= 0
    if flat.any():
        first = int(np.flatnonzero(flat)[0])
        raise MeshError(
            f"F[{first}] = {mesh.F[first].tolist()} has no {'volume' if mesh.is_tetrahedral else 'area'} "
            f"({int(flat.sum())} of {mesh.n_faces} faces): remove these faces"
        )
    # Libigl multiplies up to six lengths before it divides; in a unit near h that cannot leave the double range, and a
    # power of two changes no digit.
    h = float(mesh.edge_lengths.mean())
    unit = 2.0 ** round(np.log2(h))
    V = mesh.V / unit
    simplex_dimension = mesh.F.shape[1] - 1
    L = _padded(igl.cotmatrix(V, mesh.F), mesh.n_vertices) * unit ** (simplex_dimension - 2)
    if on_laplacian is not None and not mesh.is_tetrahedral:
        on_laplacian(L)
    domain = Operators(
        L=L,
        M=_padded(igl.massmatrix(V, mesh.F), mesh.n_vertices) * unit**simplex_dimension,
        gradient=partial(_gradient_in_space, V, mesh.F, unit),
        weights=mesh.measures,
        face_sizes=_largest(igl.edge_lengths(mesh.V, mesh.F)),
        mean_edge_length=h,
        components=mesh.components,
        boundary=mesh.boundary,
        referenced=mesh.referenced,
        longest_distance=mesh.longest_distance,
        is_surface=not mesh.is_tetrahedral,
    )
    if not mesh.is_tetrahedral:
        return domain
    # The cotangents of dihedral angles lose digits on flat tetrahedra, 1e-5 of the largest entry on a scanned volume;
    # the gradient does not, and D G is the same matrix.
    L = (domain.D @ domain.G).tocsc()
    L.sort_indices()
    if on_laplacian is not None:
        on_laplacian(L)
    return replace(domain, L=L)


def _gradient_in_space(V: FloatArray, F: IntArray, unit: float) -> sp.csc_matrix:
    return igl.grad(V, F) / unit


def intrinsic_operators(
    triangulation: IntrinsicTriangulation,
    paths: Mesh | Operators | None = None,
    on_laplacian: OnLaplacian | None = None,
) -> Operators:
    """The operators of triangles that are known by their edge lengths, gradients in the plane of each (d = 2).

    `paths` knows paths along edges of the same surface, and its components; without it they are found along the edges
    of the triangulation.
    """
    F, lengths, n = triangulation.F, triangulation.l, triangulation.n
    L = _padded(igl.cotmatrix_intrinsic(lengths, F), n)
    if on_laplacian is not None:
        on_laplacian(L)
    referenced = np.zeros(n, bool)
    referenced[F] = True
    if paths is not None:
        components, longest_distance = paths.components, paths.longest_distance
    else:
        components = connectivity.connected_components(F, n)
        edges = triangulation.edges
        ends = np.stack([triangulation.tail(edges), triangulation.head(edges)], axis=1)
        graph = connectivity.shortest_edge_graph(ends, lengths.ravel()[edges], n)
        longest_distance = connectivity.longest_path(graph, components)
    return Operators(
        L=L,
        M=_padded(igl.massmatrix_intrinsic(lengths, F), n),
        gradient=partial(intrinsic_gradient, triangulation),
        weights=triangulation.areas,
        face_sizes=_largest(lengths),
        mean_edge_length=triangulation.mean_edge_length,
        components=components,
        boundary=triangulation.boundary,
        referenced=referenced,
        longest_distance=longest_distance,
        triangulation=triangulation,
        faces=None if triangulation.history else triangulation,
    )


def edge_length_operators(
    F: ArrayLike, lengths: ArrayLike, n: int | None = None, laplacian: Laplacian = "intrinsic-delaunay"
) -> Operators:
    """The operators of triangles that are known by their edge lengths alone.

    Parameters
    ----------
    F : (m, 3) array_like of int
        Vertices of each triangle.
    lengths : (m, 3) array_like
        ``lengths[f, c]`` is that of the side of triangle f opposite its corner c.
    n : int, optional
        Number of vertices; one more than the largest in `F` if not given.
    laplacian : {"intrinsic-delaunay", "cotan"}
        As for `operators`.

    Raises
    ------
    MeshError
        If `F` or `lengths` cannot be used.
    ValueError
        If `laplacian` is neither.
    """
    if laplacian not in ("intrinsic-delaunay", "cotan"):
        raise ValueError(f"laplacian must be 'intrinsic-delaunay' or 'cotan', not {laplacian!r}")
    triangles = checked_faces(F, n)
    if triangles.shape[1] != 3:
        raise MeshError(f"F must have shape (m, 3), triangles, but it has shape {triangles.shape}")
    faces = from_edge_lengths(lengths, triangles, int(triangles.max()) + 1 if n is None else n)
    given = intrinsic_operators(faces)
    if laplacian == "cotan":
        return given
    triangulation = intrinsic_delaunay(faces)
    if triangulation is faces:
        return given
    return replace(intrinsic_operators(triangulation, given), faces=faces)


def tufted_operators(
    mesh: Mesh, history: tuple[Merged, ...] = (), on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of any triangle mesh by way of its tufted cover, made intrinsic Delaunay (d = 2).

    The cover goes over the surface twice, so L, M and the weights are one half of its own: a face of the mesh counts
    once, and L = D G holds. No weight is negative, not even on the boundary, which the cover does not have; `boundary`
    is that of the mesh. `history` says how its faces came from those that points refer to; `on_laplacian` as above.
    """
    cover = replace(tufted_cover(mesh), history=history)
    surface = replace(intrinsic_triangulation(mesh), history=history)
    domain = intrinsic_operators(intrinsic_delaunay(cover), mesh, on_laplacian)
    return replace(
        domain,
        L=domain.L / 2,
        M=domain.M / 2,
        weights=domain.weights / 2,
        boundary=mesh.boundary,
        surface=intrinsic_delaunay(surface),
        faces=surface,
    )


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


def _largest(rows: FloatArray) -> FloatArray:
    """Maximum of each row; by columns, which for short rows takes a tenth of the time."""
    return np.asarray(reduce(np.maximum, rows.T))


def _padded(matrix: sp.csc_matrix, n: int) -> sp.csc_matrix:
    """Pad: libigl stops at the last vertex that a face uses; the others get empty rows and columns."""
    if matrix.shape[0] < n:
        matrix.resize((n, n))
    return matrix
