"""From positions in space, and from vertices, to points and curves on a mesh."""

from __future__ import annotations

from typing import NamedTuple

import igl
import numpy as np

from heat_igl.errors import SourceError
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.surface_points import SurfaceCurve, SurfacePoints
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["ClosestPoints", "closest_points", "curve_on", "edge_curve"]

# Coordinates below this are on the rim of a face.
_ON_RIM = 1e-9
# Pieces of a polyline are halved until both ends lie in one face or in two neighbours, but not below this share of h:
# there the curve goes through a vertex.
_SMALLEST_PIECE = 1e-6

Place = tuple[int, FloatArray]
"""A face and barycentric coordinates in it."""


class ClosestPoints(NamedTuple):
    """Points on a mesh, and how far from them the positions are that they stand for.

    Attributes
    ----------
    points : SurfacePoints
        k points.
    gap : (k,) float64
        Distance of each from its position, in space.
    """

    points: SurfacePoints
    gap: FloatArray


def closest_points(mesh: Mesh, positions: ArrayLike) -> ClosestPoints:
    """The points of a triangle mesh that are closest to positions in space.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    positions : (k, 3) or (3,) array_like
        Positions in the mesh's unit.

    Returns
    -------
    ClosestPoints
        The points, and the gap between each and its position.

    Raises
    ------
    SourceError
        If positions have the wrong shape or are not finite, or the mesh is tetrahedral.
    """
    return _Projector(mesh).project(_positions(positions))


def curve_on(mesh: Mesh, positions: ArrayLike, *, closed: bool = False, tolerance: float | None = None) -> SurfaceCurve:
    """The curve on a triangle mesh below a polyline in space.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    positions : (k, 3) array_like
        Corners of the polyline, in the mesh's unit. Between them each straight line is projected to the closest points
        of the surface, half a mean edge length at a time or less, and joined across edges.
    closed : bool
        Whether a last line leads back to the first corner.
    tolerance : float, optional
        How far from the surface the polyline may be, corners and lines; a mean edge length if not given.

    Returns
    -------
    SurfaceCurve
        One segment for each piece inside a face.

    Raises
    ------
    SourceError
        If the polyline is farther from the surface than `tolerance`, or the closest points jump from one part of it to
        another; if there are fewer than two different corners, or a position is not finite.
    """
    corners = _positions(positions)
    if len(corners) < 2:
        raise SourceError(f"positions must be two corners of a curve or more, not {len(corners)}")
    h = float(mesh.edge_lengths.mean())
    if tolerance is None:
        tolerance = h
    elif not (np.isfinite(tolerance) and tolerance > 0):
        raise SourceError(f"tolerance must be a positive length, not {tolerance!r}")
    ends = np.concatenate([corners, corners[:1]]) if closed else corners
    lengths = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    if not lengths.any():
        raise SourceError("positions are all in one place: a curve needs two different ones")
    counts = np.maximum(np.ceil(lengths / (h / 2)).astype(int), 1)
    line = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(line)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[line]
    samples = ends[line] + share[:, None] * (ends[line + 1] - ends[line])
    tracer = _Tracer(mesh, tolerance, _SMALLEST_PIECE * h)
    pieces = tracer.join(np.concatenate([samples, ends[-1:]]), np.append(line, len(counts) - 1))
    faces, start, end = (np.array(column) for column in zip(*pieces, strict=True))
    return SurfaceCurve(faces, start, end, is_closed=closed)


def edge_curve(mesh: Mesh, vertices: ArrayLike, *, closed: bool = False) -> SurfaceCurve:
    """The curve along edges of a triangle mesh from vertex to vertex.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    vertices : (k,) array_like of int
        Each joined with the next by an edge.
    closed : bool
        Whether an edge leads from the last back to the first.

    Raises
    ------
    SourceError
        If two vertices that follow one another are not joined by an edge; the message names the first such.
    """
    _require_triangles(mesh)
    path = np.atleast_1d(np.asarray(vertices))
    if path.ndim != 1 or path.dtype.kind not in "iu" or len(path) < 2:
        raise SourceError(f"vertices must be two vertex indices or more, not {path.dtype} of shape {path.shape}")
    path = np.append(path, path[0]) if closed else path
    edges, n = mesh.facets.vertices, mesh.n_vertices
    pairs = np.sort(np.stack([path[:-1], path[1:]], axis=1).astype(np.int64), axis=1)
    # Rows of `edges` are in lexicographic order.
    at = np.searchsorted(edges[:, 0] * n + edges[:, 1], pairs[:, 0] * n + pairs[:, 1])
    at = np.minimum(at, len(edges) - 1)
    missing = (edges[at] != pairs).any(axis=1)
    if missing.any():
        first = int(np.flatnonzero(missing)[0])
        raise SourceError(
            f"vertices[{first}] = {path[first]} and the next, {path[first + 1]}, are not joined by an edge: "
            "name neighbours, or project the polyline with curve_on"
        )
    face_of = np.empty(len(edges), np.int64)
    face_of[mesh.facets.of_face.ravel()] = np.repeat(np.arange(mesh.n_faces), 3)
    faces = face_of[at]
    start, end = ((mesh.F[faces] == ends[:, None]).astype(float) for ends in (path[:-1], path[1:]))
    return SurfaceCurve(faces, start, end, is_closed=closed)


def _require_triangles(mesh: Mesh) -> None:
    if mesh.is_tetrahedral:
        raise SourceError("points on faces need triangles, but the mesh is tetrahedral")


def _positions(positions: ArrayLike) -> FloatArray:
    try:
        array = np.atleast_2d(np.array(positions, dtype=np.float64))
    except (TypeError, ValueError):
        raise SourceError("positions must be real numbers of shape (k, 3)") from None
    if array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise SourceError(f"positions must have shape (k, 3), a row for each, not {array.shape}")
    wrong = ~np.isfinite(array).all(axis=1)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise SourceError(f"positions[{first}] = {array[first].tolist()} is not finite")
    return array


class _Projector:
    """Closest points, many times on one mesh."""

    def __init__(self, mesh: Mesh) -> None:
        _require_triangles(mesh)
        self._mesh = mesh
        self._tree = igl.AABB()
        self._tree.init(mesh.V, mesh.F)

    def project(self, positions: FloatArray) -> ClosestPoints:
        mesh = self._mesh
        _, faces, closest = self._tree.squared_distance(mesh.V, mesh.F, np.ascontiguousarray(positions))
        faces = np.asarray(faces, np.int64).ravel()
        points = SurfacePoints(faces, _barycentric(mesh.V[mesh.F[faces]], np.atleast_2d(closest)))
        return ClosestPoints(points, np.linalg.norm(points.positions(mesh) - positions, axis=1))


def _barycentric(corners: FloatArray, p: FloatArray) -> FloatArray:
    """Coordinates (k, 3) of points in or on triangles (k, 3, 3), those without area too."""
    rows = np.arange(len(p))
    following, preceding = np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)
    doubled = np.linalg.norm(np.cross(following - p[:, None], preceding - p[:, None]), axis=2)
    edge = preceding - following  # opposite each corner
    lengths = np.linalg.norm(edge, axis=2)
    total = doubled.sum(axis=1)
    flat = total <= 1e-12 * lengths.max(axis=1) ** 2
    inside = doubled / np.where(flat, 1, total)[:, None]
    # Without area, a point lies on the longest side.
    c = lengths.argmax(axis=1)
    tail, along = following[rows, c], edge[rows, c]
    share = np.clip(np.einsum("kx,kx->k", p - tail, along) / np.maximum(lengths[rows, c] ** 2, 1e-300), 0, 1)
    on_side = np.zeros((len(p), 3))
    on_side[rows, (c + 1) % 3], on_side[rows, (c + 2) % 3] = 1 - share, share
    barycentric = np.where(flat[:, None], on_side, inside)
    barycentric[barycentric < _ON_RIM] = 0
    return np.asarray(barycentric / barycentric.sum(axis=1, keepdims=True))


class _Tracer:
    """Joins projected samples of a polyline to pieces, each inside a face."""

    def __init__(self, mesh: Mesh, tolerance: float, smallest: float) -> None:
        self._mesh = mesh
        self._projector = _Projector(mesh)
        self._tolerance = tolerance
        self._smallest = smallest
        order = np.argsort(mesh.facets.of_face.ravel(), kind="stable")
        self._faces_by_edge = order // 3
        self._first_of_edge = np.concatenate([[0], np.cumsum(mesh.facets.n_faces)])
        corner = np.argsort(mesh.F.ravel(), kind="stable")
        self._faces_by_vertex = corner // 3
        self._first_of_vertex = np.concatenate([[0], np.cumsum(np.bincount(mesh.F.ravel(), minlength=mesh.n_vertices))])

    def join(self, samples: FloatArray, line: IntArray) -> list[tuple[int, FloatArray, FloatArray]]:
        """Pieces (face, start, end) through the projections of `samples`; `line` says which line each lies on."""
        places = self._project(samples, line)
        waiting = [(i, i + 1) for i in range(len(samples) - 1)]
        samples_list, lines = list(samples), list(line)
        joined: dict[tuple[int, int], list[tuple[int, FloatArray, FloatArray]]] = {}
        middle: dict[tuple[int, int], int] = {}
        pairs = waiting
        while pairs:
            halved = []
            for a, b in pairs:
                found = self._direct(places[a], places[b])
                if found is None:
                    is_short = bool(np.linalg.norm(samples_list[b] - samples_list[a]) <= self._smallest)
                    found = self._by_vertex(places[a], places[b], np.inf if is_short else self._smallest)
                    if found is None and is_short:
                        raise SourceError(
                            f"the line from positions[{lines[a]}] jumps from face {places[a][0]} to face "
                            f"{places[b][0]} at {samples_list[a].tolist()}, where another part of the surface is "
                            "closer: draw it closer to the surface"
                        )
                if found is None:
                    halved.append((a, b))
                else:
                    joined[a, b] = found
            if not halved:
                break
            between = np.array([(samples_list[a] + samples_list[b]) / 2 for a, b in halved])
            of_line = np.array([lines[a] for a, _ in halved])
            new = self._project(between, of_line)
            pairs = []
            for (a, b), place, position in zip(halved, new, between, strict=True):
                m = len(places)
                places.append(place)
                samples_list.append(position)
                lines.append(lines[a])
                middle[a, b] = m
                pairs += [(a, m), (m, b)]
        pieces: list[tuple[int, FloatArray, FloatArray]] = []
        stack = waiting[::-1]
        while stack:
            a, b = stack.pop()
            if (a, b) in joined:
                pieces += joined[a, b]
            else:
                m = middle[a, b]
                stack += [(m, b), (a, m)]
        return [piece for piece in pieces if (piece[1] != piece[2]).any()]

    def _project(self, positions: FloatArray, line: IntArray) -> list[Place]:
        points, gap = self._projector.project(positions)
        if gap.max() > self._tolerance:
            worst = int(gap.argmax())
            raise SourceError(
                f"the polyline leaves the surface by {gap[worst]:.6g} on the line from positions[{line[worst]}], at "
                f"{positions[worst].tolist()}; tolerance is {self._tolerance:.6g}"
            )
        return [(int(face), barycentric) for face, barycentric in zip(points.faces, points.barycentric, strict=True)]

    def _direct(self, p: Place, q: Place) -> list[tuple[int, FloatArray, FloatArray]] | None:
        """One piece where both lie in one face, two where they lie in neighbours and see each other; else None."""
        in_p, in_q = self._copies(p), self._copies(q)
        common = in_p.keys() & in_q.keys()
        if common:
            face = min(common)
            return [(face, in_p[face], in_q[face])]
        for f, p_in_f in in_p.items():
            for g, q_in_g in in_q.items():
                cut = self._across(f, p_in_f, g, q_in_g)
                if cut is not None:
                    return [(f, p_in_f, cut[0]), (g, cut[1], q_in_g)]
        return None

    def _copies(self, p: Place) -> dict[int, FloatArray]:
        """The same place in every face that it lies in."""
        face, barycentric = p
        mesh = self._mesh
        held = np.flatnonzero(barycentric)
        if len(held) == 3:
            return {face: barycentric}
        if len(held) == 2:
            edge = mesh.facets.of_face[face, 3 - held.sum()]
            others = self._faces_by_edge[self._first_of_edge[edge] : self._first_of_edge[edge + 1]]
        else:
            vertex = mesh.F[face, held[0]]
            others = self._faces_by_vertex[self._first_of_vertex[vertex] : self._first_of_vertex[vertex + 1]]
        weight = dict(zip(mesh.F[face].tolist(), barycentric.tolist(), strict=True))
        return {int(g): np.array([weight.get(v, 0.0) for v in mesh.F[g].tolist()]) for g in others}

    def _across(self, f: int, p: FloatArray, g: int, q: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Where the straight line over the edge between two faces, laid flat, crosses it: in either face."""
        mesh = self._mesh
        shared = set(mesh.facets.of_face[f].tolist()) & set(mesh.facets.of_face[g].tolist())
        if len(shared) != 1:
            return None
        tail, head = mesh.facets.vertices[shared.pop()]
        origin, along = mesh.V[tail], mesh.V[head] - mesh.V[tail]
        squared = float(along @ along)
        if squared == 0:
            return None
        at, height = [], []
        for face, barycentric in ((f, p), (g, q)):
            relative = barycentric @ mesh.V[mesh.F[face]] - origin
            at.append(float(relative @ along) / squared)
            height.append(float(np.linalg.norm(relative - at[-1] * along)))
        total = height[0] + height[1]
        share = at[0] if total == 0 else at[0] + (at[1] - at[0]) * height[0] / total
        if not 0 <= share <= 1:
            return None
        first, second = (np.zeros(3), np.zeros(3))
        for barycentric, face in ((first, f), (second, g)):
            barycentric[mesh.F[face] == tail] = 1 - share
            barycentric[mesh.F[face] == head] = share
        return first, second

    def _by_vertex(self, p: Place, q: Place, detour: float) -> list[tuple[int, FloatArray, FloatArray]] | None:
        """Two pieces that meet in a vertex of both faces, if that is longer than straight by at most `detour`."""
        mesh = self._mesh
        start, end = (barycentric @ mesh.V[mesh.F[face]] for face, barycentric in (p, q))
        best = float(np.linalg.norm(end - start)) + detour
        found = None
        for f, p_in_f in self._copies(p).items():
            for g, q_in_g in self._copies(q).items():
                for v in set(mesh.F[f].tolist()) & set(mesh.F[g].tolist()):
                    length = float(np.linalg.norm(mesh.V[v] - start) + np.linalg.norm(end - mesh.V[v]))
                    if length < best:
                        best = length
                        found = [
                            (f, p_in_f, (mesh.F[f] == v).astype(float)),
                            (g, (mesh.F[g] == v).astype(float), q_in_g),
                        ]
        return found
