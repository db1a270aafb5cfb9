"""Tangent frames: two axes and a normal at every vertex, and conversions of vectors between components and space.

Normals are means over faces, and axes fit the polar angles of edges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from heat_igl.errors import MeshError, as_array, raise_at_first, real_numbers
from heat_igl.intrinsic.gluing import intrinsic_triangulation, lengths_to_divide_by
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, next_half_edge, previous_half_edge
from heat_igl.intrinsic.vertex_angles import PolarAngles, polar_angles
from heat_igl.mesh import Mesh, MeshLike, as_mesh, as_triangles, tangent_surface
from heat_igl.typing import ArrayLike, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class TangentFrames:
    """An orthonormal frame at every vertex of a triangle mesh.

    A tangent vector at a vertex has two components, along `x` and `y`. The angle counts counterclockwise from x, seen
    from the side to which the normal points. Directions of edges, of vectors in faces and of geodesics have their polar
    angles: those of the faces, scaled to sum to 2 pi (to pi on the boundary), see `tangent_frames`. Vectors in space
    and transported vectors are turned without a scale; at a boundary vertex whose faces do not sum to pi, that gives
    another angle than the polar angle of the same direction (`PolarAngles.to_polar`).

    Attributes
    ----------
    x, y, normal : (n, 3) float64
        Unit vectors in space; ``y = normal x x``.
    angles : PolarAngles
        The angle of every half-edge in the frame of the tail.
    triangulation : IntrinsicTriangulation
        The faces of the mesh by their edge lengths.
    sides : (m, 3, 3) float64
        Unit vector in space along the half-edge that leaves from corner c of face f, to the next corner.
    face_normals : (m, 3) float64
        Unit normals of the faces, 0 for a face without area.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(2)
    >>> frames = heat_igl.tangent_frames(mesh)
    >>> round(float((frames.normal * mesh.V).sum(axis=1).min()), 2)  # the normals of a sphere are radii
    1.0
    >>> v = np.tile([0.6, 0.8], (mesh.n_vertices, 1))  # the same components at every vertex
    >>> bool(np.allclose(frames.from_world(frames.to_world(v)), v))
    True
    """

    x: FloatArray
    y: FloatArray
    normal: FloatArray
    angles: PolarAngles
    triangulation: IntrinsicTriangulation
    sides: FloatArray
    face_normals: FloatArray

    def __repr__(self) -> str:
        return f"TangentFrames({len(self.x)} vertices)"

    def from_world(self, vectors: ArrayLike, vertices: ArrayLike | None = None) -> FloatArray:
        """Components of vectors in space.

        Parameters
        ----------
        vectors : (k, 3) array_like
            Normal parts are left out.
        vertices : (k,) array_like of int, optional
            The vertices at which the vectors are; all n in order if not given.

        Returns
        -------
        (k, 2) float64
            Along x and y.

        Raises
        ------
        MeshError
            If an entry of `vertices` is no vertex.
        ValueError
            If `vectors` has another shape, or is not finite.
        """
        at = self._vertices(vertices)
        found = checked_vectors("vectors", vectors, len(at), 3)
        return np.stack([np.einsum("kx,kx->k", found, axis[at]) for axis in (self.x, self.y)], axis=1)

    def to_world(self, vectors: ArrayLike, vertices: ArrayLike | None = None) -> FloatArray:
        """Vectors in space from their components.

        Parameters
        ----------
        vectors : (k, 2) array_like
            Components along x and y.
        vertices : (k,) array_like of int, optional
            As for `from_world`, with its errors.

        Returns
        -------
        (k, 3) float64
        """
        at = self._vertices(vertices)
        found = checked_vectors("vectors", vectors, len(at), 2)
        return np.asarray(found[:, :1] * self.x[at] + found[:, 1:] * self.y[at])

    def from_faces(self, faces: ArrayLike, corners: ArrayLike, vectors: ArrayLike) -> FloatArray:
        """Components at a corner of vectors in the plane of a face.

        The angle from the side that leaves from the corner is scaled as the angles of the faces are, so that a vector
        along either side of the corner gets the angle of this edge. The length stays.

        Parameters
        ----------
        faces, corners : (k,) array_like of int
            A face, and one of the corners 0 to 2.
        vectors : (k, 3) array_like
            Parts along the normal of the face are left out.

        Returns
        -------
        (k, 2) float64
            In the frames of the vertices at these corners.

        Raises
        ------
        MeshError
            If there is no such face or corner.
        ValueError
            If `vectors` has another shape, or is not finite.
        """
        face, c = checked_indices("faces", faces, len(self.face_normals)), checked_indices("corners", corners, 3)
        if len(face) != len(c):
            raise MeshError(f"corners must be as many as faces, {len(face)}, not {len(c)}")
        found, corner = checked_vectors("vectors", vectors, len(face), 3), 3 * face + c
        along = self.sides[face, c]
        across = np.cross(self.face_normals[face], along)
        x, y = (np.einsum("kx,kx->k", found, axis) for axis in (along, across))
        # Between the two sides, or nearer to one of them: from -(2 pi - corner angle) / 2 on.
        inside = self.angles.corners.ravel()[corner]
        angle = np.arctan2(y, x)
        angle = np.where(angle < inside / 2 - np.pi, angle + 2 * np.pi, angle)
        outgoing = self.angles.outgoing[previous_half_edge(corner)]
        return self.from_angles(
            outgoing + self.angles.scale[self.triangulation.F.ravel()[corner]] * angle, np.hypot(x, y)
        )

    @staticmethod
    def to_angles(vectors: ArrayLike) -> FloatArray:
        """Angles (k,) in [0, 2 pi) of tangent vectors (k, 2), counterclockwise from x.

        A ValueError if `vectors` has another shape, or is not finite.
        """
        found = checked_vectors("vectors", vectors, None, 2)
        angle = np.arctan2(found[:, 1], found[:, 0])
        return np.asarray(np.where(angle < 0, np.maximum(angle + 2 * np.pi, 0.0) % (2 * np.pi), angle))

    @staticmethod
    def from_angles(angles: ArrayLike, lengths: ArrayLike = 1.0) -> FloatArray:
        """Tangent vectors (k, 2) of the given angles (k,), in radians, and lengths: one, or (k,).

        A ValueError if the shapes do not fit, or entries are no real numbers.
        """
        angle, length = real_numbers("angles", angles), real_numbers("lengths", lengths)
        if length.shape not in ((), angle.shape) and angle.shape:
            raise ValueError(f"lengths must be one number or {angle.shape} as angles, not of shape {length.shape}")
        return np.stack([length * np.cos(angle), length * np.sin(angle)], axis=-1)

    def corner_towards(self, vertices: IntArray, angles: FloatArray) -> tuple[IntArray, FloatArray]:
        """The corner ``3 f + c`` into which directions at vertices point, and the angle (k,) in that face.

        `angles` (k,) are in [0, 2 pi), at vertices (k,) that a face uses. The angle in the face counts from the side
        that leaves from the corner, and is not scaled. On the boundary it may be negative or larger than the angle of
        the corner: by up to half the angle that is missing there, on either side.
        """
        F, polar = self.triangulation.F, self.angles
        vertex = F.ravel()
        # Corners sorted by vertex, and by angle at each: one search finds all.
        outgoing = polar.outgoing[previous_half_edge(np.arange(F.size))]
        order = np.lexsort((outgoing, vertex))
        # Angles are below 2 pi, so this keeps the order of the vertices.
        key = vertex[order] * 8.0 + outgoing[order]
        first = np.searchsorted(vertex[order], vertices)
        place = np.maximum(np.searchsorted(key, vertices * 8.0 + angles, side="right") - 1, first)
        corner = order[place]
        turn = angles - outgoing[corner]
        # Off the boundary: nearer to the first face than to the last.
        off = polar.on_boundary[vertices] & (angles > 1.5 * np.pi)
        corner, turn = np.where(off, order[first], corner), np.where(off, angles - 2 * np.pi, turn)
        return corner, turn / polar.scale[vertices]

    def _vertices(self, vertices: ArrayLike | None) -> IntArray:
        n = len(self.x)
        return np.arange(n) if vertices is None else checked_indices("vertices", vertices, n)


def tangent_frames(mesh: MeshLike) -> TangentFrames:
    """Orthonormal frames at the vertices of a triangle mesh, and their polar angles.

    The polar angles around a vertex are the face angles times a factor per vertex, so that they sum to 2 pi, or to pi
    on the boundary. They are measured counterclockwise from the reference edge of the vertex. For an inner vertex this
    is the edge to the next corner in the face of the lowest index at the vertex; for a boundary vertex it is the first
    boundary edge in counterclockwise order, and the other boundary edge has the angle pi.

    The normal is the mean of the face normals, weighted by the face angles. The axis x is perpendicular to it, in the
    direction that fits the polar angles of all edges best: the sum of the edge vectors, each rotated back by its polar
    angle; on the boundary by the angle in the faces, with the middle of the faces at pi / 2.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles (those of polygons, too), manifold and oriented alike, with or without
        boundary.

    Returns
    -------
    TangentFrames
        Frames, and conversions between components, vectors in space, vectors in faces, and angles. Unreferenced
        vertices have the coordinate axes as frames.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral, more than two faces meet at an edge, neighbouring faces have opposite orientations
        (as is unavoidable on a Moebius strip), or the faces at a vertex are not one fan. The message names the first
        offender.

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
    mesh, n = tangent_surface(given), as_triangles(given, "tangent frames need").n_vertices
    triangulation = replace(intrinsic_triangulation(mesh), l=lengths_to_divide_by(mesh), lengthening=0.0)
    angles = polar_angles(triangulation)
    sides = unit_vectors(mesh.V[np.roll(mesh.F, -1, axis=1)] - mesh.V[mesh.F])
    face_normals = unit_vectors(
        np.cross(mesh.V[mesh.F[:, 1]] - mesh.V[mesh.F[:, 0]], mesh.V[mesh.F[:, 2]] - mesh.V[mesh.F[:, 0]])
    )
    normal = _vertex_normals(mesh, angles, face_normals)
    x, normal = (axes[mesh.originals] for axes in (_first_axes(mesh, triangulation, angles, normal), normal))
    y = np.cross(normal, x)
    return TangentFrames(x[:n], y[:n], normal[:n], angles, triangulation, sides, face_normals)


def unit_vectors(vectors: FloatArray) -> FloatArray:
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
    return unit_vectors(normal)


def _first_axes(
    mesh: Mesh, triangulation: IntrinsicTriangulation, angles: PolarAngles, normal: FloatArray
) -> FloatArray:
    """The direction (n, 3) that the polar angles of the edges around each vertex agree on best."""
    n = mesh.n_vertices
    # Any axis across the normal, to begin with.
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    across: FloatArray = np.cross(np.cross(normal, least), normal)
    any_x = unit_vectors(across)
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
    return np.where(used, unit_vectors(total.real[:, None] * any_x + total.imag[:, None] * any_y), [1.0, 0.0, 0.0])


def checked_vectors(name: str, vectors: ArrayLike, k: int | None, size: int) -> FloatArray:
    """`vectors` as (k, size) float64; one vector may come without a row.

    A ValueError if the shape is another, or a number is not finite; the message names the first offender.
    """
    given = real_numbers(name, vectors)
    found = np.atleast_2d(given)
    if found.ndim != 2 or found.shape[1] != size or (k is not None and len(found) != k):
        wanted = "k" if k is None else k
        raise ValueError(f"{name} must have shape ({wanted}, {size}), but it has shape {given.shape}")
    raise_at_first(~np.isfinite(found).all(axis=1), name, found, "must be finite")
    return found


def checked_indices(name: str, indices: ArrayLike, n: int) -> IntArray:
    """`indices` (k,) as int64; a MeshError if one is not from 0 to n - 1, or they are something else."""
    given = np.atleast_1d(as_array(name, indices, MeshError))
    if not given.size:
        return np.empty(0, np.int64)  # what is empty has no type
    if given.ndim != 1 or given.dtype.kind not in "iu":
        raise MeshError(f"{name} must be indices (k,), not {given.dtype} of shape {given.shape}")
    remedy = f"indices run from 0 to {n - 1}"
    raise_at_first((given < 0) | (given >= n), name, given, "must be in range", remedy, MeshError)
    return given.astype(np.int64)
