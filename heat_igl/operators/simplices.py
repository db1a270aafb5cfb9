"""Operators by the positions of the vertices: triangles in space, and tetrahedra."""

from __future__ import annotations

from dataclasses import replace
from functools import partial, reduce

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.kernels.linear import assembling
from heat_igl.mesh import Mesh
from heat_igl.operators.matrices import OnLaplacian, Operators, Surface, TriangleElements, laplacian_of_gradient
from heat_igl.operators.metric_simplices import MetricSimplices
from heat_igl.typing import FloatArray, IntArray


def cotan_operators(mesh: Mesh, on_laplacian: OnLaplacian | None = None) -> Operators:
    """The operators on the mesh's own triangles or tetrahedra, gradients in space (d = 3).

    Triangles come without `Operators.surface` and `Operators.lengths`; ``operators(mesh, "cotan")`` has both.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    on_laplacian : callable, optional
        Called with L as soon as it is known.

    Raises
    ------
    MeshError
        If a triangle has no area, or a tetrahedron no volume.
    """
    check_measures(mesh)
    G = _gradient(mesh.V, mesh.F, _unit(mesh))
    if not mesh.is_tetrahedral:
        return _assembled(mesh, _cotangent_laplacian(mesh, on_laplacian), G)
    # The cotangents of dihedral angles lose digits on flat tetrahedra, 1e-5 of the largest entry on a scanned volume;
    # the gradient does not, and D G is the same matrix.
    L = laplacian_of_gradient(G, mesh.measures)
    if on_laplacian is not None:
        on_laplacian(L)
    return replace(_assembled(mesh, L, G), simplices=MetricSimplices.in_space(mesh))


def surface_operators(mesh: Mesh, surface: Surface, on_laplacian: OnLaplacian | None = None) -> Operators:
    """The operators on the mesh's own triangles as for `cotan_operators`, and `surface` with the same triangles."""
    check_measures(mesh)
    elements = TriangleElements(surface.triangulation, partial(_gradient, mesh.V, mesh.F, _unit(mesh)))
    return _assembled(mesh, _cotangent_laplacian(mesh, on_laplacian), elements, elements, surface)


def _cotangent_laplacian(mesh: Mesh, on_laplacian: OnLaplacian | None) -> sp.csc_matrix:
    """L of triangles."""
    L = cotangent_laplacian(igl.cotmatrix_entries(mesh.V / _unit(mesh), mesh.F), mesh.F, mesh.n_vertices)
    if on_laplacian is not None:
        on_laplacian(L)
    return L


def cotangent_laplacian(cotangents: FloatArray, F: IntArray, n: int) -> sp.csc_matrix:
    """L (n, n) of triangles, zeros stored: that of `igl.cotmatrix`, assembled in a third of the time and memory.

    Parameters
    ----------
    cotangents : (m, 3) float64
        Half the cotangent of the angle opposite each side, as `igl.cotmatrix_entries` gives it.
    F : (m, 3) int64
        Vertices of each triangle.
    n : int
        Number of vertices; one that no triangle uses has an empty row.
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
