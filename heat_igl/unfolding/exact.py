"""Exact polyhedral distance: windows, carried over the faces in the order in which distance grows.

A *window* is the part of an edge that straight lines from one *root* cross, all through the same faces: the root is a
source or a vertex at which shortest paths bend. Laid out in the plane before the edge, the root gives the distance of
every point of the edge (Mitchell, Mount, Papadimitriou 1987). docs/exact.md has the algorithm.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import IntrinsicTriangulation, intrinsic_delaunay, intrinsic_triangulation, mollify
from heat_igl.kernels import gluing, windows
from heat_igl.mesh import DELAUNAY_TOLERANCE, Mesh, SurfacePoints
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["ExactSolution", "ExactSurface", "exact_distance"]

# What another way must be shorter by, as a fraction of the distance, before a window is cut: more than rounding adds up
# to. A larger number keeps a few windows more and changes no result.
_TOLERANCE = 1e-11
# A point whose barycentric coordinate is below this lies on the side of its face.
_ON_SIDE = 1e-13
# A last bound on the work; meshes measured so far take less than one flip per face.
_MOST_FLIPS_PER_FACE = 100
_NO_VERTICES = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class ExactSolution:
    """Distances of one query, and where the shortest paths come from.

    Attributes
    ----------
    distance : (n,) float64
        Distance of every vertex; ``inf`` where no source is reached, or none within the cutoff.
    labels : (n,) int64
        The source that the distance is measured from: 0 to k - 1 for vertices, k to k + p - 1 for points, -1 for none.
    root : (n,) int64
        The last vertex at which the path to each vertex bends, or its source: n + p for source point p; -1 for none.
    entered : (n,) int64
        The half-edge of the triangulation, opposite the vertex, over which the straight last part of the path comes;
        -1 where the path starts in the vertex or runs inside one face.
    crossing : (n,) float64
        How far from the tail of that half-edge, in the mesh's unit.
    target_distance : (t,) float64
        Distance of the target points; ``inf`` as for vertices.
    target_labels, target_root, target_entered : (t,) int64
    target_crossing : (t,) float64
        The same as for vertices.
    n_windows : int
        Windows that were carried over an edge.
    n_crossings : int
        Faces that were crossed, counted once for all windows that crossed together.
    """

    distance: FloatArray
    labels: IntArray
    root: IntArray
    entered: IntArray
    crossing: FloatArray
    target_distance: FloatArray
    target_labels: IntArray
    target_root: IntArray
    target_entered: IntArray
    target_crossing: FloatArray
    n_windows: int
    n_crossings: int


class _Surface(NamedTuple):
    """What the kernel reads: half-edge by half-edge, lengths in the unit `ExactSurface.scale`."""

    vertex: AnyArray
    length: FloatArray
    twin: AnyArray
    aligned: AnyArray
    ring: AnyArray
    double_area: FloatArray
    bulge: FloatArray
    corner_of_vertex: AnyArray
    next_corner: AnyArray
    kind: AnyArray
    is_delaunay: bool


class _Points(NamedTuple):
    """Points in the triangles, those on a side once for every triangle there: (q,), (q, 3), and which point each is."""

    faces: AnyArray
    barycentric: FloatArray
    point: IntArray


class ExactSurface:
    """Exact distance on one triangulated surface, for any number of queries.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices; of an intrinsic Delaunay one fewest edges are crossed.

    Raises
    ------
    MeshError
        If there are too many triangles for 32-bit indices.

    Notes
    -----
    Boundaries, holes, edges of more than two faces, surfaces that cannot be oriented, vertices whose faces are several
    fans, and components are all allowed. Immutable; threads may share it, and a query releases the interpreter's lock.
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        self._triangulation: IntrinsicTriangulation | None = triangulation
        exponent = _exponent(triangulation.l)
        self._prepare(
            triangulation.F.ravel().astype(np.int32),
            triangulation.twin.astype(np.int32),
            _rings(triangulation),
            triangulation.aligned.astype(np.uint8),
            np.ldexp(triangulation.l.ravel(), -exponent),
            triangulation.n,
            exponent,
        )

    @classmethod
    def _of_mesh(cls, mesh: Mesh, start: int) -> ExactSurface:
        """The surface of a mesh that is asked once, for distances from vertices: no point can be located on it.

        The triangulation is intrinsic Delaunay, but nothing says which edges were flipped; near vertex `start` comes
        first in memory.
        """
        extent = _exponent(np.ptp(mesh.V[mesh.F[:, 0]], axis=0))
        vertex, twin, ring, aligned, length, n_across = gluing.glue(mesh.F, mesh.V, np.ldexp(1.0, -extent))
        if n_across:
            return cls(intrinsic_delaunay(intrinsic_triangulation(mesh)))
        length += mollify(length.reshape(-1, 3))
        gluing.flip(vertex, twin, ring, length, -DELAUNAY_TOLERANCE, _MOST_FLIPS_PER_FACE * mesh.n_faces)
        exponent = _exponent(length)
        surface = object.__new__(cls)
        surface._triangulation = None
        first_face = int(np.argmax(vertex == start)) // 3
        surface._prepare(
            vertex, twin, ring, aligned, np.ldexp(length, -exponent), mesh.n_vertices, exponent + extent, first_face
        )
        return surface

    def _prepare(
        self,
        vertex: AnyArray,
        twin: AnyArray,
        ring: AnyArray,
        aligned: AnyArray,
        length: FloatArray,
        n: int,
        exponent: int,
        first_face: int = 0,
    ) -> None:
        """Number vertices and faces anew, and derive what the kernel reads; lengths are in units of 2^exponent."""
        m = len(vertex) // 3
        if 3 * m + n >= 2**30:
            raise MeshError(f"{m} faces are too many for exact distances: split the mesh")
        self.n, self._exponent = n, exponent
        *tables, self._number, self._face = gluing.breadth_first(vertex, twin, ring, aligned, length, n, first_face)
        derived = (
            np.empty(m),
            np.empty(3 * m),
            np.full(n, -1, np.int32),
            np.empty(3 * m, np.int32),
            np.zeros(n, np.uint8),
        )
        vertex, twin, ring, aligned, length = tables
        is_delaunay = windows.shapes(vertex, length, twin, *derived)
        self._surface = _Surface(vertex, length, twin, aligned, ring, *derived, is_delaunay)

    def solve(
        self,
        sources: IntArray = _NO_VERTICES,
        offsets: FloatArray | None = None,
        points: SurfacePoints | None = None,
        point_offsets: FloatArray | None = None,
        *,
        cutoff: float = np.inf,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
    ) -> ExactSolution:
        """Distances from vertices and points.

        Parameters
        ----------
        sources : (k,) int64
            Vertices that distance starts from.
        offsets : (k,) float64, optional
            The distance at which each of them starts, not negative; 0 if not given.
        points : SurfacePoints, optional
            p sources in the faces that the triangulation was made from.
        point_offsets : (p,) float64, optional
            The distance at which each of them starts; 0 if not given.
        cutoff : float
            What is farther is ``inf``, and the search ends there.
        targets : SurfacePoints, optional
            t points in the faces that the triangulation was made from, whose distance is asked for.
        goals : (g,) int64, optional
            If given, the search ends once the distances of these vertices and of the targets are known; those of other
            vertices may then be too large or ``inf``.

        Returns
        -------
        ExactSolution
            Distances are exact on the polyhedral surface, to rounding.

        Raises
        ------
        MemoryError
            If the windows do not fit into memory.
        """
        n, surface = self.n, self._surface
        vertices, begin, label, inside, inside_begin, inside_label = self._starts(
            sources, offsets, points, point_offsets
        )
        place = self._located(targets)
        first, following = self._by_face(place)
        t, q = len(place.faces), len(inside.faces)
        distance, emitted = np.full((2, n), np.inf)
        root, entered = np.full((2, n), -1, np.int32)
        labels = np.full(n + q, -1, np.int32)
        crossing = np.zeros(n)
        target_distance, target_crossing = np.full(t, np.inf), np.zeros(t)
        target_root, target_entered = np.full((2, t), -1, np.int32)
        statistics = np.zeros(5, np.int64)
        ends_early = goals is not None
        done = windows.search(
            *surface,
            self._number[vertices],
            begin,
            inside.faces,
            np.ascontiguousarray(inside.barycentric).ravel(),
            inside_begin,
            distance,
            emitted,
            root,
            labels,
            entered,
            crossing,
            np.empty(n, np.int32),
            np.full(len(surface.vertex), -1, np.int32),
            self._number[_NO_VERTICES if goals is None else goals],
            first,
            following,
            place.faces,
            np.ascontiguousarray(place.barycentric).ravel(),
            target_distance,
            target_root,
            target_entered,
            target_crossing,
            self._slack(place),
            ends_early,
            np.ldexp(cutoff, -self._exponent),
            _TOLERANCE,
            statistics,
        )
        if not done:
            raise MemoryError("the windows of the exact distance do not fit into memory")
        within = distance <= np.ldexp(cutoff, -self._exponent)
        target_within = target_distance <= np.ldexp(cutoff, -self._exponent)
        which = self._nearest_of(place, target_distance, 0 if targets is None else len(targets))
        all_labels = np.concatenate([label, inside_label, [-1]])
        return ExactSolution(
            self._lengths(distance, within)[self._number],
            all_labels[np.where(within, labels[:n], -1)[self._number]],
            self._origins(root, within, inside)[self._number],
            self._half_edges(entered, within)[self._number],
            np.ldexp(crossing, self._exponent)[self._number],
            self._lengths(target_distance, target_within)[which],
            all_labels[np.where(target_within, labels[target_root], -1)[which]],
            self._origins(target_root, target_within, inside)[which],
            self._half_edges(target_entered, target_within)[which],
            np.ldexp(target_crossing, self._exponent)[which],
            int(statistics[1]),
            int(statistics[2]),
        )

    def _lengths(self, distance: FloatArray, within: BoolArray) -> FloatArray:
        """Distances in the unit of the mesh, ``inf`` beyond the cutoff."""
        return np.where(within, np.ldexp(distance, self._exponent), np.inf)

    def _origins(self, root: AnyArray, within: BoolArray, inside: _Points) -> IntArray:
        """Roots by the caller's numbers; copies of a source point on a side are one point."""
        old = np.empty(self.n + len(inside.faces) + 1, np.int64)
        old[self._number] = np.arange(self.n)
        old[self.n : -1], old[-1] = self.n + inside.point, -1
        return old[np.where(within, root, -1)]

    def _half_edges(self, entered: AnyArray, within: BoolArray) -> IntArray:
        """Half-edges by the caller's numbers."""
        old = 3 * self._face[entered // 3].astype(np.int64) + entered % 3
        return np.where(within & (entered >= 0), old, -1)

    def _starts(
        self,
        sources: IntArray,
        offsets: FloatArray | None,
        points: SurfacePoints | None,
        point_offsets: FloatArray | None,
    ) -> tuple[IntArray, FloatArray, IntArray, _Points, FloatArray, IntArray]:
        """Source vertices, with offsets and labels, and source points that are no vertices, with theirs."""
        k = len(sources)
        begin = np.zeros(k) if offsets is None else np.ldexp(np.asarray(offsets, np.float64), -self._exponent)
        label = np.arange(k)
        place = self._located(points)
        late = np.zeros(0 if points is None else len(points))
        if point_offsets is not None:
            late = np.ldexp(np.asarray(point_offsets, np.float64), -self._exponent)
        late = late[place.point]
        at_corner = (place.barycentric == 0).sum(axis=1) == 2
        corner = place.barycentric[at_corner].argmax(axis=1)
        named = np.empty(self.n, np.int64)
        named[self._number] = np.arange(self.n)
        at_corners = named[self._surface.vertex[3 * place.faces[at_corner] + corner]]
        vertices = np.concatenate([sources, at_corners]).astype(np.int64)
        rest = _Points(*(a[~at_corner] for a in place))
        return (
            vertices,
            np.concatenate([begin, late[at_corner]]),
            np.concatenate([label, k + place.point[at_corner]]),
            rest,
            late[~at_corner],
            k + rest.point,
        )

    def _located(self, points: SurfacePoints | None) -> _Points:
        """Points in the triangles; those on a side in each triangle there."""
        if points is None:
            return _Points(np.empty(0, np.int32), np.empty((0, 3)), _NO_VERTICES)
        if self._triangulation is None:
            raise ValueError("this surface was made for distances from vertices: make it from a triangulation")
        faces, barycentric = self._triangulation.locate(points.faces, points.barycentric)
        new_face = np.empty(len(self._face), np.int64)
        new_face[self._face] = np.arange(len(self._face))
        faces = new_face[faces]
        barycentric = np.where(barycentric < _ON_SIDE, 0.0, barycentric)
        barycentric /= barycentric.sum(axis=1, keepdims=True)
        point = np.arange(len(faces))
        rows = [(faces, barycentric, point)]
        on_side = (barycentric == 0) & ((barycentric == 0).sum(axis=1) == 1)[:, None]
        i, c = np.nonzero(on_side)
        start = here = 3 * faces[i] + c
        s = self._surface
        while len(here):
            # To the next triangle at the side: the other one, or the next of many, until all have been met.
            there = np.where(s.twin[here] >= 0, s.twin[here], s.ring[here]).astype(np.int64)
            go_on = there != start
            i, c, start, here = i[go_on], c[go_on], start[go_on], there[go_on]
            is_glued = s.twin[start] >= 0
            same_way = s.vertex[_following(start)] == s.vertex[_following(here)]
            same_way = np.where(is_glued, s.aligned[start] == 0, same_way)
            tail, head = barycentric[i, (c + 1) % 3], barycentric[i, (c + 2) % 3]
            other, k = np.zeros((len(i), 3)), np.arange(len(i))
            other[k, (here + 1) % 3] = np.where(same_way, tail, head)
            other[k, (here + 2) % 3] = np.where(same_way, head, tail)
            rows.append((here // 3, other, point[i]))
        faces, barycentric, point = (np.concatenate(column) for column in zip(*rows, strict=True))
        return _Points(faces.astype(np.int32), barycentric, point)

    def _by_face(self, place: _Points) -> tuple[AnyArray, AnyArray]:
        """The first point of each triangle and the next point of the same triangle; -1 for none."""
        first = np.full(len(self._surface.double_area) if len(place.faces) else 0, -1, np.int32)
        following = np.full(len(place.faces), -1, np.int32)
        order = np.argsort(place.faces, kind="stable")
        first[place.faces[order][::-1]] = order[::-1]
        same = place.faces[order][1:] == place.faces[order][:-1]
        following[order[:-1][same]] = order[1:][same]
        return first, following

    def _slack(self, place: _Points) -> float:
        """Twice the largest circumradius of triangles that hold targets; 0 without targets."""
        if not len(place.faces):
            return 0.0
        length = self._surface.length.reshape(-1, 3)[place.faces]
        return float((length.prod(axis=1) / self._surface.double_area[place.faces]).max())

    @staticmethod
    def _nearest_of(place: _Points, distance: FloatArray, n_points: int) -> IntArray:
        """Of the copies of each point, the one with the smallest distance."""
        order = np.lexsort((-distance, place.point))
        which = np.empty(n_points, np.int64)
        which[place.point[order]] = order
        return which


def _following(half_edge: IntArray) -> IntArray:
    """The next half-edge of the same face."""
    return half_edge + 1 - 3 * (half_edge % 3 == 2)


def _exponent(lengths: FloatArray) -> int:
    """The power of two by which lengths are divided: no digit changes, and no square leaves the range of doubles."""
    return int(np.frexp(lengths.mean())[1])


def _rings(triangulation: IntrinsicTriangulation) -> AnyArray:
    """For a half-edge where more than two faces meet, the next of those there; elsewhere itself."""
    ring = np.arange(len(triangulation.twin), dtype=np.int32)
    many = np.flatnonzero(triangulation.twin == -2)
    if len(many):
        # Such edges were never flipped: the two vertices tell them apart.
        ends = np.sort(np.stack([triangulation.tail(many), triangulation.head(many)]), axis=0)
        order = np.lexsort((many, *ends))
        many, ends = many[order], ends[:, order]
        is_first: BoolArray = np.ones(len(many), bool)
        is_first[1:] = (ends[:, 1:] != ends[:, :-1]).any(axis=0)
        first = np.flatnonzero(is_first)
        following = np.roll(many, -1)
        following[np.append(first[1:], len(many)) - 1] = many[first]
        ring[many] = following
    return ring


def exact_distance(V: ArrayLike, F: ArrayLike, sources: Sources, *, cutoff: float = np.inf) -> FloatArray:
    """Exact geodesic distance on a polyhedral surface.

    Parameters
    ----------
    V : (n, 3) array_like
        Vertex positions.
    F : (m, 3) array_like
        Triangles.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    cutoff : float
        What is farther is ``inf``, and the search ends there.

    Returns
    -------
    (n,) float64
        In the unit of V: 0 at the sources, ``inf`` at vertices that no source reaches.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or is tetrahedral.
    SourceError
        If `sources` does not name vertices.
    """
    mesh = Mesh(V, F)
    if mesh.is_tetrahedral:
        raise MeshError("exact distance needs triangles, but F has 4 columns")
    chosen = vertex_sources(sources, mesh.n_vertices)
    return ExactSurface._of_mesh(mesh, int(chosen[0])).solve(chosen, cutoff=cutoff).distance
