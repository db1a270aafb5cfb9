"""The connection Laplacian: differences of tangent vectors after transport along the edges, in complex numbers.

A tangent vector with components (a, b) is the number a + i b, and transport along an edge multiplies it by
exp(i rho) (Knoeppel, Crane, Pinkall, Schroeder 2013; Sharp, Soliman, Crane 2019, section 5).
"""

from __future__ import annotations

import igl
import numpy as np
import scipy.sparse as sp

from heat_igl.errors import MeshError
from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    PolarAngles,
    carried_angles,
    polar_angles,
    tangent_frames,
    transport_angles,
)
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.operators.matrices import Laplacian, Operators
from heat_igl.operators.triangles import operators
from heat_igl.typing import AnyArray


def connection_laplacian(mesh: MeshLike, laplacian: Laplacian = "intrinsic-delaunay") -> sp.csc_matrix:
    """The connection Laplacian of a triangle mesh, in the frames of `tangent_frames`.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles, manifold and oriented alike.
    laplacian : {"intrinsic-delaunay", "cotan"}
        The triangulation whose edges carry the weights, as for `operators`.

    Returns
    -------
    (n, n) csc_matrix of complex128
        Hermitian, integrated like L; negative semidefinite if no weight is negative, so always with the default.
        Entry (j, i) of an edge is the weight in L times exp(i rho), with rho the angle by which components turn
        from i to j. Applied to the numbers a + i b of tangent vectors, row j is the sum over the edges of weight times
        (the vector at i, transported to j, less the vector at j).

    Raises
    ------
    MeshError
        If the mesh has no tangent frames, see `tangent_frames`.
    ValueError
        If `laplacian` is neither.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> L = heat_igl.operators.connection_laplacian(heat_igl.shapes.icosphere(2)).toarray()
    >>> bool(np.allclose(L, L.conj().T))
    True
    >>> bool(np.linalg.eigvalsh(L).max() < 0)  # no vector field on a sphere is parallel
    True
    """
    mesh = as_simplices(mesh)
    tangent_frames(mesh)  # which checks the mesh
    domain = operators(mesh, laplacian)
    return with_rotations(domain.L, edge_rotations(domain))


def with_rotations(L: sp.csc_matrix, rotations: sp.csc_matrix) -> sp.csc_matrix:
    """Any Laplacian `L` (n, n) on the edges of a domain, entry by entry times its `rotations`."""
    return sp.csc_matrix(rotations.multiply(L))


def edge_rotations(domain: Operators) -> sp.csc_matrix:
    """Factors (n, n) of the entries of L for the connection Laplacian of triangles, Hermitian and in the pattern of L.

    Entry (j, i) is exp(i rho), with rho the angle by which components turn from i to j; of several edges between the
    same two vertices, the mean by weight. The diagonal is 1, and more by the amount that edges from a vertex to itself
    cost. A MeshError if the domain has no triangles, or they are no oriented manifold.
    """
    triangulation, angles = _triangles(domain)
    half_edge = np.arange(triangulation.F.size)
    tail, head = triangulation.tail(half_edge), triangulation.head(half_edge)
    rho = transport_angles(triangulation, angles)
    # Half the cotangent opposite each half-edge, the face's part of the weight; faces without area have none.
    weight = np.nan_to_num(igl.cotmatrix_entries(triangulation.l), posinf=0.0, neginf=0.0).ravel()
    turn = np.exp(1j * rho)
    n = triangulation.n
    loop = tail == head
    rows, columns = np.concatenate([head, tail]), np.concatenate([tail, head])
    off = ~np.concatenate([loop, loop])
    places, shape = (rows[off], columns[off]), (n, n)
    turned = sp.csc_matrix((np.concatenate([weight * turn, weight * turn.conj()])[off], places), shape=shape)
    weights = sp.csc_matrix((np.concatenate([weight, weight])[off], places), shape=shape)
    plain = sp.csc_matrix((np.concatenate([turn, turn.conj()])[off], places), shape=shape)
    # Weights that cancel, as opposite a right angle, leave no mean by weight: the plain mean then.
    size, mean = np.abs(plain.data), np.ones(len(plain.data), complex)
    np.divide(plain.data, size, out=mean, where=size > 0)
    trusted = np.abs(weights.data) > 1e-9 * np.abs(weights.data).max(initial=0.0)
    np.divide(turned.data, weights.data, out=mean, where=trusted)
    turned.data = mean
    cost = np.bincount(tail[loop], 2 * weight[loop] * (np.cos(rho[loop]) - 1), n)
    diagonal = domain.L.diagonal()
    extra = np.divide(cost, diagonal, out=np.zeros(n), where=diagonal != 0)
    return sp.csc_matrix(turned + sp.diags_array(1 + extra))


def face_rotations(domain: Operators) -> tuple[AnyArray, AnyArray]:
    """By what the numbers a + i b of vectors at corners are multiplied to give those of vectors in faces.

    A vector in a face has its components along the side from corner 0 to corner 1, and across it, towards corner 2.
    Angles around a vertex are scaled and those in a face are not: of the directions between the two sides of a corner,
    the middle one keeps its place, and the plane of the face is turned by one angle.

    Returns factors (m, 3) for the faces of the mesh, and for the triangles that the operators belong to. A MeshError as
    for `edge_rotations`.
    """
    triangulation, angles = _triangles(domain)
    surface = domain.surface
    if surface is None or surface.faces is triangulation:
        both = _corner_rotations(triangulation, angles)
        return both, both
    of_faces = _corner_rotations(surface.faces, polar_angles(surface.faces))
    return of_faces, _corner_rotations(triangulation, angles)


def _corner_rotations(triangulation: IntrinsicTriangulation, angles: PolarAngles) -> AnyArray:
    F, inside = triangulation.F, angles.corners
    half_edge = np.arange(F.size)
    leaving, scale = angles.rigid(triangulation.tail(half_edge))
    # Half-edge 3 f + c leaves from corner c + 1.
    at_corner = np.roll(leaving.reshape(-1, 3), 1, axis=1)
    in_face = np.stack([np.zeros(len(F)), np.pi - inside[:, 1], 2 * np.pi - inside[:, 1] - inside[:, 2]], axis=1)
    return np.asarray(np.exp(1j * (in_face + inside / 2 - at_corner - scale[F] * inside / 2)))


def _triangles(domain: Operators) -> tuple[IntrinsicTriangulation, PolarAngles]:
    surface = domain.surface
    if surface is None or surface.uncovered is not None:
        raise MeshError("tangent vectors need the triangles of an oriented manifold, which this domain does not have")
    angles = polar_angles(surface.faces)
    return surface.triangulation, carried_angles(angles, surface.triangulation)
