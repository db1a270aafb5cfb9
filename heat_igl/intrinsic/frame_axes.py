"""The tangent frames of a mesh: normals that are means over faces, and axes that fit the polar angles of edges."""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic.frames import TangentFrames
from heat_igl.intrinsic.gluing import intrinsic_triangulation
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, next_half_edge, previous_half_edge
from heat_igl.intrinsic.vertex_angles import PolarAngles, polar_angles
from heat_igl.mesh import Mesh, MeshLike, as_mesh, as_simplices, tangent_surface
from heat_igl.typing import FloatArray

# Edges are at least this long, in mean edge lengths: directions are divided by lengths.
_SHORTEST = 1e-12


def tangent_frames(mesh: MeshLike) -> TangentFrames:
    """Orthonormal frames at the vertices of a triangle mesh, and their polar angles.

    Angles around a vertex are those of the faces times one factor per vertex, so that they sum to 2 pi, and to pi on
    the boundary. They count counterclockwise from the reference edge of the vertex. For an inner vertex it is the edge
    to the next corner in the first face (of the lowest index) that uses the vertex. For a boundary vertex it is the
    boundary edge at which the faces begin, counterclockwise; the other boundary edge has the angle pi.

    The normal is the mean of the normals of the faces, weighted by their angles. The axis x lies in the plane across
    the normal, in the direction that fits the polar angles of all edges best: the sum of the edges as vectors, each
    turned back by the angle; on the boundary by the angle in the faces, with the middle of the faces at pi / 2.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles (those of polygons, too), manifold and oriented alike, with or without
        boundary.

    Returns
    -------
    TangentFrames
        Frames, and conversions between components, vectors in space, vectors in faces, and angles. Vertices that no
        face uses have the axes of space.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral, more than two faces meet at an edge, neighbours are oriented differently (on a
        Moebius strip any orientation has such neighbours), or the faces at a vertex are not one fan. The message names
        the first offender.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> frames = heat_igl.tangent_frames(heat_igl.shapes.grid(2))
    >>> frames.normal[4].tolist()  # of a flat mesh
    [0.0, 0.0, 1.0]
    >>> x, y = frames.x[4], frames.y[4]
    >>> bool(np.allclose(np.cross(frames.normal[4], x), y))
    True
    """
    given = as_mesh(mesh)
    mesh, n = tangent_surface(given), as_simplices(given).n_vertices
    if mesh.is_tetrahedral:
        raise MeshError("tangent frames need triangles, but the mesh is tetrahedral")
    # Not mollified: mollification gives a flat triangle some height, and would bend lines across it.
    lengths = np.maximum(igl.edge_lengths(mesh.V, mesh.F), _SHORTEST * mesh.edge_lengths.mean())
    triangulation = replace(intrinsic_triangulation(mesh), l=lengths, lengthening=0.0)
    angles = polar_angles(triangulation)
    sides = _unit(mesh.V[np.roll(mesh.F, -1, axis=1)] - mesh.V[mesh.F])
    face_normals = _unit(
        np.cross(mesh.V[mesh.F[:, 1]] - mesh.V[mesh.F[:, 0]], mesh.V[mesh.F[:, 2]] - mesh.V[mesh.F[:, 0]])
    )
    normal = _vertex_normals(mesh, angles, face_normals)
    x, normal = (axes[mesh.originals] for axes in (_first_axes(mesh, triangulation, angles, normal), normal))
    y = np.cross(normal, x)
    return TangentFrames(x[:n], y[:n], normal[:n], angles, triangulation, sides, face_normals)


def _unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) divided by their lengths; 0 stays 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))


def _vertex_normals(mesh: Mesh, angles: PolarAngles, face_normals: FloatArray) -> FloatArray:
    weighted = angles.corners[:, :, None] * face_normals[:, None]
    columns = [np.bincount(mesh.F.ravel(), weighted[..., k].ravel(), mesh.n_vertices) for k in range(3)]
    normal: FloatArray = np.stack(columns, axis=1)
    # Normals that cancel, or only faces without area: that of one face, or any.
    lost = np.linalg.norm(normal, axis=1) <= 1e-12 * angles.sums
    normal[lost] = [0.0, 0.0, 1.0]
    of_one = np.zeros_like(normal)
    of_one[mesh.F[::-1].ravel()] = np.repeat(face_normals[::-1], 3, axis=0)
    lost &= of_one.any(axis=1)
    normal[lost] = of_one[lost]
    return _unit(normal)


def _first_axes(
    mesh: Mesh, triangulation: IntrinsicTriangulation, angles: PolarAngles, normal: FloatArray
) -> FloatArray:
    """The direction (n, 3) that the polar angles of the edges around each vertex agree on best."""
    n = mesh.n_vertices
    # Any axis across the normal, to begin with.
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    across: FloatArray = np.cross(np.cross(normal, least), normal)
    any_x = _unit(across)
    any_y = np.cross(normal, any_x)
    corner = np.arange(mesh.F.size)
    vertex, edge = mesh.F.ravel(), (mesh.V[np.roll(mesh.F, -1, axis=1)] - mesh.V[mesh.F]).reshape(-1, 3)
    angle = angles.rigid(triangulation.tail(corner))[0][previous_half_edge(corner)]
    # The last edge of a boundary vertex leaves from no corner: it arrives.
    last = np.flatnonzero(triangulation.twin[next_half_edge(corner)] < 0)
    vertex = np.append(vertex, vertex[last])
    edge = np.concatenate([edge, -edge[previous_half_edge(last)]])
    angle = np.append(angle, (np.pi + angles.sums[mesh.F.ravel()[last]]) / 2)
    along = np.einsum("kx,kx->k", edge, any_x[vertex]) + 1j * np.einsum("kx,kx->k", edge, any_y[vertex])
    back = along * np.exp(-1j * angle)
    total = np.bincount(vertex, back.real, n) + 1j * np.bincount(vertex, back.imag, n)
    size = np.abs(total)
    total = np.divide(total, size, out=np.ones(n, complex), where=size > 1e-12 * mesh.edge_lengths.mean())
    used = mesh.referenced[:, None]
    return np.where(used, _unit(total.real[:, None] * any_x + total.imag[:, None] * any_y), [1.0, 0.0, 0.0])
