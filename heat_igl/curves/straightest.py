"""Straightest geodesics: lines that go straight on over the faces of a mesh, and the exponential map."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from heat_igl.curves.places import checked_places
from heat_igl.errors import MeshError, SourceError, is_number, real_numbers, shown
from heat_igl.intrinsic import TangentFrames, checked_vectors, tangent_frames
from heat_igl.kernels.paths import straightest
from heat_igl.mesh import MeshLike, SurfaceCurve, SurfacePoints, as_mesh, as_simplices, tangent_surface
from heat_igl.mesh.cloud_orientation import on_one_side
from heat_igl.runtime import over_rows
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# The compiled module, whose signatures are those of Cython.
kernel: Any = straightest
# Fewer geodesics than this, which take some 10 ms, are traced on one thread.
_FEW = 500
# Lines of more edges are refused: a tenth of a second each, and half a gigabyte if they are stored.
_MOST_EDGES = 1e7
_LOST = "is lost among faces without area: repair these faces"


def trace_geodesic(mesh: MeshLike, start: Sources, direction: ArrayLike, length: float) -> SurfaceCurve:
    """The straightest geodesic from a point in a direction (Polthier and Schmies 1998).

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles, manifold and oriented alike.
    start : int or SurfacePoints
        A vertex, or one point in a face.
    direction : (2,) or (3,) array_like
        A vector of any length. Two components are in the tangent frame: at a vertex that of `tangent_frames`; in a face
        the first axis points from corner 0 to corner 1, the second towards corner 2; a point at a vertex has the frame
        of the vertex. Three components are a vector in space, which is projected to the tangent plane of the vertex or
        face.
    length : float
        In the mesh's unit, 0 or more.

    Returns
    -------
    SurfaceCurve
        One segment for each face that is crossed. The curve ends earlier on the boundary:
        ``curve.lengths(mesh).sum()`` is the length in any case.

    Raises
    ------
    MeshError
        If the mesh has no tangent frames, see `tangent_frames`, or the line is lost among faces without area.
    SourceError
        If `start` is not one vertex of a face or one point of the mesh.
    ValueError
        If `direction` has another shape, is not finite or is 0 in the tangent plane; if `length` is negative or not
        finite.

    Notes
    -----
    The geodesic is straight in each face, and across each edge with the two faces unfolded into a plane. At an inner
    vertex it continues so that the sums of the face angles on both sides are equal, which is unique even if the angles
    do not sum to 2 pi. A geodesic that would pass a vertex by less than 1e-10 of its distance, and of the length of the
    side that it would cross there, meets this vertex. It ends when it meets the boundary, and has length 0 if it starts
    on the boundary and points off the surface. At a boundary vertex it continues if the sum of the face angles is pi or
    more on exactly one side of it: it leaves at the angle pi on this side, as a straight line in the plane does along a
    straight boundary or past a corner. It is not the shortest path in general.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(4)
    >>> around = heat_igl.trace_geodesic(mesh, 0, (1, 0), 2 * np.pi)  # a great circle of the unit sphere
    >>> start, end = around.positions(mesh)[[0, -1]]
    >>> bool(np.linalg.norm(end - start) < 0.05)
    True
    """
    tracer = Tracer(mesh)
    vector = real_numbers("direction", direction)
    begin = tracer.starts("start", start, vector.shape != (3,))
    if len(begin.faces) != 1:
        raise SourceError(f"start must be one vertex or point, not {len(begin.faces)}")
    if vector.ndim != 1:
        raise ValueError(f"direction must be one vector (2,) or (3,), but it has shape {vector.shape}")
    if not is_number(length) or not 0 <= length < np.inf:
        raise ValueError(f"length must be a finite number of at least 0, not {shown(length)}")
    distance = np.array([float(length)])
    tracer.refuse_endless("length", begin.faces, distance)
    turn, size = tracer.directions("direction", begin, vector)
    if not size[0] > 0:
        raise ValueError(f"direction = {np.asarray(direction).tolist()} is 0 in the tangent plane: it needs a length")
    return tracer.curve(begin, turn, distance)


def exp_map(mesh: MeshLike, source: Sources, vectors: ArrayLike) -> SurfacePoints:
    """The exponential map: the ends of straightest geodesics from a point along tangent vectors.

    Parameters
    ----------
    mesh : mesh
        Whatever `as_mesh` takes, with triangles, manifold and oriented alike.
    source : int, sequence of int or SurfacePoints
        A vertex or point for all vectors, or one for each.
    vectors : (k, 2) or (k, 3) array_like
        In the frame of the source, or in space, as the directions of `trace_geodesic`; the length of a vector in the
        tangent plane is that of the geodesic. The vector 0 leads to the source itself. Errors are those of
        `trace_geodesic`.

    Returns
    -------
    SurfacePoints
        k points. A geodesic that meets the boundary ends there.

    Notes
    -----
    Traced on all processors (`HEAT_IGL_NUM_THREADS`), with the same bits for any number of them.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.icosphere(4)
    >>> ends = heat_igl.exp_map(mesh, 0, [[np.pi, 0], [0, np.pi]]).positions(mesh)  # halfway around the unit sphere
    >>> bool(np.linalg.norm(ends + mesh.V[0], axis=1).max() < 0.05)  # both are at the antipode
    True
    """
    return Tracer(mesh).exp(source, vectors)


class _Starts(NamedTuple):
    """Points (k,) in faces; for vertices, which (k,), else -1."""

    faces: IntArray
    barycentric: FloatArray
    vertices: IntArray


class Tracer:
    """Straightest geodesics of one mesh: its frames, and the tables of the kernel.

    On a cloud without an orientation they are traced on the cover, from the first side, and seen from one side.
    """

    def __init__(self, mesh: MeshLike) -> None:
        given = as_mesh(mesh)
        self._mesh, self._surface = as_simplices(given), tangent_surface(given)
        self._frames: TangentFrames = tangent_frames(given)
        triangulation, polar = self._frames.triangulation, self._frames.angles
        half = np.ascontiguousarray(np.where(polar.on_boundary, -1.0, polar.sums / 2)[self._surface.F])
        self._triangles = triangulation.l, triangulation.areas, polar.corners, triangulation.twin, half

    def exp(self, source: Sources, vectors: ArrayLike) -> SurfacePoints:
        """The exponential map; see `exp_map`."""
        array = real_numbers("vectors", vectors)
        begin = self.starts("source", source, array.shape[-1:] != (3,))
        k = len(array) if array.ndim == 2 else 1
        if not k:
            raise ValueError(f"vectors must be one vector or more, but it has shape {array.shape}")
        if len(begin.faces) == 1:
            again = np.zeros(k, np.int64)
            begin = _Starts(begin.faces[again], begin.barycentric[again], begin.vertices[again])
        elif len(begin.faces) != k:
            raise SourceError(f"source must be one point, or one for each of the {k} vectors, not {len(begin.faces)}")
        turn, size = self.directions("vectors", begin, array)
        self.refuse_endless("vectors", begin.faces, size)
        faces, barycentric, lengths = np.empty(k, np.int64), np.empty((k, 3)), np.empty(k)

        def work(part: slice) -> None:
            given = (begin.faces[part], begin.barycentric[part], turn[part], size[part])
            kernel.trace(self._triangles, *given, faces[part], barycentric[part], lengths[part])

        over_rows(work, k, k) if k >= _FEW else work(slice(k))
        if (lengths < 0).any():
            raise MeshError(f"the line along vectors[{np.argmax(lengths < 0)}] {_LOST}")
        return SurfacePoints(*on_one_side(faces, barycentric, self._mesh.n_faces))

    def refuse_endless(self, name: str, faces: IntArray, lengths: FloatArray) -> None:
        """Raise ValueError for lengths (k,) that would take minutes to trace, which another unit is the reason of."""
        F, l = self._surface.F, self._triangles[0]
        component = self._surface.components[F[:, 0]]
        mean = np.bincount(component, l.mean(axis=1)) / np.maximum(np.bincount(component), 1)
        edges = lengths / mean[component[faces]]
        if (edges > _MOST_EDGES).any():
            first = int(np.argmax(edges > _MOST_EDGES))
            raise ValueError(
                f"{name if len(edges) == 1 else f'{name}[{first}]'} is too long: {lengths[first]:.4g} is "
                f"{edges[first]:.2g} mean edge lengths, and a line may have {_MOST_EDGES:.0e}: give it in the unit of "
                "the mesh"
            )

    def starts(self, name: str, points: Sources, in_frame: bool = True) -> _Starts:
        """Starts of geodesics: vertices in the order given, or points in faces.

        A point in a vertex is the vertex for components `in_frame`; a vector in space is in the plane of its face.
        """
        faces, weights = checked_places(name, self._mesh, points, self._frames.angles.first)
        is_vertex = (weights.max(axis=1) == 1) & (in_frame or not isinstance(points, SurfacePoints))
        corner = self._surface.F[faces, weights.argmax(axis=1)]
        return _Starts(faces.copy(), np.ascontiguousarray(weights), np.where(is_vertex, corner, -1))

    def directions(self, name: str, starts: _Starts, vectors: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Angle (k,) of each vector in the face of the start, from corner 0 to corner 1, and length.

        At vertices the start is moved to the face into which the vector points.
        """
        frames, k = self._frames, len(starts.faces)
        in_space = np.shape(vectors)[-1:] == (3,)
        found = checked_vectors(name, vectors, k, 3 if in_space else 2)
        at_vertex = starts.vertices >= 0
        at, components = starts.vertices[at_vertex], found
        if in_space:
            along = frames.sides[starts.faces, 0]
            across = np.cross(frames.face_normals[starts.faces], along)
            components = np.stack([np.einsum("kx,kx->k", found, axis) for axis in (along, across)], axis=1)
            components[at_vertex] = frames.from_world(found[at_vertex], at)
        size = np.hypot(*components.T)
        turn = np.arctan2(components[:, 1], components[:, 0])
        if at_vertex.any():
            angle = frames.to_angles(components[at_vertex])
            corner, inside = frames.corner_towards(at, frames.angles.to_polar(at, angle) if in_space else angle)
            face, c = np.divmod(corner, 3)
            starts.faces[at_vertex], starts.barycentric[at_vertex] = face, np.eye(3)[c]
            # The direction in which the side leaves from the corner, from that of corner 0 to corner 1.
            angles = frames.angles.corners[face]
            turn[at_vertex] = inside + np.choose(c, [np.zeros(len(c)), np.pi - angles[:, 1], angles[:, 0] - np.pi])
        return turn, size

    def curve(self, start: _Starts, turn: FloatArray, length: FloatArray) -> SurfaceCurve:
        """Trace one geodesic."""
        ends: tuple[Any, ...] = np.empty(1, np.int64), np.empty((1, 3)), np.empty(1)
        faces, points = kernel.trace(self._triangles, start.faces, start.barycentric, turn, length, *ends, True)
        if ends[2] < 0:
            raise MeshError(f"the line from start {_LOST}")
        faces, points = on_one_side(faces, points, self._mesh.n_faces)
        return SurfaceCurve(faces, points[:, 0], points[:, 1], mesh=self._mesh)
