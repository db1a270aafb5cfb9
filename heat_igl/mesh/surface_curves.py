"""Curves on a mesh from polylines in space."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import SourceError, positive, truth
from heat_igl.mesh.grouping import Groups, enumerate_runs, group_by_label
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.mesh.projection import Projector, checked_points
from heat_igl.mesh.surface_points import SurfaceCurve
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["curve_on"]

# A piece of a polyline is halved until its ends lie in one face or in two neighbours, but not below this share of h:
# there the curve goes through a vertex.
_SMALLEST_PIECE = 1e-6


class _Place(NamedTuple):
    """A point in a face, by barycentric coordinates (3,)."""

    face: int
    barycentric: FloatArray


class _Piece(NamedTuple):
    """A straight segment in a face, by the barycentric coordinates (3,) of both ends."""

    face: int
    start: FloatArray
    end: FloatArray


def curve_on(
    mesh: MeshLike, positions: ArrayLike, *, closed: bool = False, tolerance: float | None = None
) -> SurfaceCurve:
    """Project a polyline in space onto a triangle mesh.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    positions : (k, 3) array_like
        Corners of the polyline, in the mesh's unit. Each straight line between two corners is sampled at steps of at
        most half a mean edge length; the closest points to the samples are joined across edges.
    closed : bool
        Whether a last line leads back to the first corner.
    tolerance : float, optional
        Largest distance of the polyline from the surface, at the corners and between them; a mean edge length if not
        given.

    Returns
    -------
    SurfaceCurve
        With a segment for each piece inside a face.

    Raises
    ------
    SourceError
        If the polyline is farther from the surface than `tolerance`, or the closest points jump from one part of it to
        another; if there are fewer than two different corners, or a position is not finite.
    ValueError
        If `tolerance` is not a positive number, or `closed` is no truth value.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(4)
    >>> curve = heat_igl.curve_on(mesh, [[0.1, 0.2, 0.01], [0.4, 0.6, 0.01]])
    >>> round(float(curve.lengths(mesh).sum()), 6)
    0.5
    """
    mesh, closed = as_simplices(mesh), truth("closed", closed)
    corners = checked_points(positions)
    if len(corners) < 2:
        raise SourceError(f"positions must be two corners of a curve or more, not {len(corners)}")
    h = float(mesh.edge_lengths.mean())
    tolerance = h if tolerance is None else positive("tolerance", tolerance)
    ends = np.concatenate([corners, corners[:1]]) if closed else corners
    lengths = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    if not lengths.any():
        raise SourceError("positions are all in one place: a curve needs two different ones")
    counts = np.maximum(np.ceil(lengths / (h / 2)).astype(int), 1)
    line, step = enumerate_runs(counts)
    share = step / counts[line]
    samples = ends[line] + share[:, None] * (ends[line + 1] - ends[line])
    joiner = _PolylineJoiner(mesh, tolerance, _SMALLEST_PIECE * h)
    pieces = joiner.join(np.concatenate([samples, ends[-1:]]), np.append(line, len(counts) - 1))
    faces, start, end = (np.array(column) for column in zip(*pieces, strict=True))
    return SurfaceCurve(faces, start, end, is_closed=closed, mesh=mesh)


class _Samples:
    """Samples of a polyline, of which there may be more later: positions, projections, and the line of each."""

    def __init__(self, positions: FloatArray, places: list[_Place], lines: IntArray) -> None:
        self.positions, self.places, self.lines = list(positions), places, list(lines)

    def add(self, position: FloatArray, place: _Place, line: int) -> int:
        """Add a sample; return the number of it."""
        self.positions.append(position)
        self.places.append(place)
        self.lines.append(line)
        return len(self.places) - 1


class _PolylineJoiner:
    """Joins the projected samples of a polyline by pieces, each inside a face.

    `tolerance` bounds the distance of samples from the surface, `smallest` is the length below which nothing is halved.
    """

    def __init__(self, mesh: Mesh, tolerance: float, smallest: float) -> None:
        self._mesh = mesh
        self._projector = Projector(mesh)
        self._tolerance = tolerance
        self._smallest = smallest
        half_edges = group_by_label(mesh.facets.of_face.ravel(), len(mesh.facets.vertices))
        corners = group_by_label(mesh.F.ravel(), mesh.n_vertices)
        self._faces_at_edge = Groups(half_edges.first, half_edges.members // 3)
        self._faces_at_vertex = Groups(corners.first, corners.members // 3)

    def join(self, positions: FloatArray, lines: IntArray) -> list[_Piece]:
        """Pieces through the projections of samples (k, 3); `lines` (k,) are the numbers of their lines."""
        samples = _Samples(positions, self._project(positions, lines), lines)
        joined: dict[tuple[int, int], list[_Piece]] = {}
        middle: dict[tuple[int, int], int] = {}
        pairs = neighbours = [(i, i + 1) for i in range(len(positions) - 1)]
        while pairs:
            found = {pair: self._joined(samples, *pair) for pair in pairs}
            joined |= {pair: pieces for pair, pieces in found.items() if pieces is not None}
            halved = self._halved(samples, [pair for pair in pairs if found[pair] is None])
            middle |= halved
            pairs = [half for (a, b), m in halved.items() for half in ((a, m), (m, b))]

        def between(a: int, b: int) -> list[_Piece]:
            m = middle.get((a, b))
            return joined[a, b] if m is None else between(a, m) + between(m, b)

        pieces = [piece for a, b in neighbours for piece in between(a, b)]
        return [piece for piece in pieces if (piece.start != piece.end).any()]

    def _project(self, positions: FloatArray, lines: IntArray) -> list[_Place]:
        points, gap = self._projector.project(positions)
        if gap.max() > self._tolerance:
            worst = int(gap.argmax())
            raise SourceError(
                f"the polyline leaves the surface by {gap[worst]:.6g} on the line from positions[{lines[worst]}], at "
                f"{positions[worst].tolist()}; tolerance is {self._tolerance:.6g}"
            )
        return [_Place(int(face), at) for face, at in zip(points.faces, points.barycentric, strict=True)]

    def _halved(self, samples: _Samples, pairs: list[tuple[int, int]]) -> dict[tuple[int, int], int]:
        """Add a sample in the middle of each of these pairs of samples."""
        if not pairs:
            return {}
        positions = np.array([(samples.positions[a] + samples.positions[b]) / 2 for a, b in pairs])
        lines = np.array([samples.lines[a] for a, _ in pairs])
        places = self._project(positions, lines)
        new = zip(positions, places, lines, strict=True)
        return {pair: samples.add(*sample) for pair, sample in zip(pairs, new, strict=True)}

    def _joined(self, samples: _Samples, a: int, b: int) -> list[_Piece] | None:
        """The pieces between two samples; None if another sample is needed between them."""
        p, q = samples.places[a], samples.places[b]
        direct = self._direct(p, q)
        if direct is not None:
            return direct
        is_short = bool(np.linalg.norm(samples.positions[b] - samples.positions[a]) <= self._smallest)
        found = self._by_vertex(p, q, np.inf if is_short else self._smallest)
        if found is None and is_short:
            raise SourceError(
                f"the line from positions[{samples.lines[a]}] jumps from face {p.face} to face {q.face} at "
                f"{samples.positions[a].tolist()}, where another part of the surface is closer: draw it closer to the "
                "surface"
            )
        return found

    def _direct(self, p: _Place, q: _Place) -> list[_Piece] | None:
        """One piece if both places lie in one face; two over the edge of two neighbours if straight; else None."""
        in_p, in_q = self._copies(p), self._copies(q)
        common = in_p.keys() & in_q.keys()
        if common:
            face = min(common)
            return [_Piece(face, in_p[face], in_q[face])]
        for f, p_in_f in in_p.items():
            for g, q_in_g in in_q.items():
                crossing = self._crossing(_Place(f, p_in_f), _Place(g, q_in_g))
                if crossing is not None:
                    return [_Piece(f, p_in_f, crossing[0]), _Piece(g, crossing[1], q_in_g)]
        return None

    def _copies(self, place: _Place) -> dict[int, FloatArray]:
        """The barycentric coordinates of a place in every face that it lies in."""
        face, barycentric = place
        mesh = self._mesh
        held = np.flatnonzero(barycentric)
        if len(held) == 3:
            return {face: barycentric}
        if len(held) == 2:
            others, _ = self._faces_at_edge.of(mesh.facets.of_face[face, [3 - held.sum()]])
        else:
            others, _ = self._faces_at_vertex.of(mesh.F[face, held])
        weight = dict(zip(mesh.F[face].tolist(), barycentric.tolist(), strict=True))
        return {int(g): np.array([weight.get(v, 0.0) for v in mesh.F[g].tolist()]) for g in others}

    def _crossing(self, p: _Place, q: _Place) -> tuple[FloatArray, FloatArray] | None:
        """The point at which a straight line crosses the edge between two faces laid flat, in either face."""
        mesh = self._mesh
        shared = set(mesh.facets.of_face[p.face].tolist()) & set(mesh.facets.of_face[q.face].tolist())
        if len(shared) != 1:
            return None
        tail, head = mesh.facets.vertices[shared.pop()]
        origin, along = mesh.V[tail], mesh.V[head] - mesh.V[tail]
        squared = float(along @ along)
        if squared == 0:
            return None
        at, height = [], []
        for face, barycentric in (p, q):
            relative = barycentric @ mesh.V[mesh.F[face]] - origin
            at.append(float(relative @ along) / squared)
            height.append(float(np.linalg.norm(relative - at[-1] * along)))
        total = height[0] + height[1]
        share = at[0] if total == 0 else at[0] + (at[1] - at[0]) * height[0] / total
        if not 0 <= share <= 1:
            return None
        first, second = (np.zeros(3), np.zeros(3))
        for barycentric, face in ((first, p.face), (second, q.face)):
            barycentric[mesh.F[face] == tail] = 1 - share
            barycentric[mesh.F[face] == head] = share
        return first, second

    def _by_vertex(self, p: _Place, q: _Place, detour: float) -> list[_Piece] | None:
        """Two pieces that meet in a vertex of both faces, if they are at most `detour` longer than a straight line."""
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
                            _Piece(f, p_in_f, (mesh.F[f] == v).astype(float)),
                            _Piece(g, (mesh.F[g] == v).astype(float), q_in_g),
                        ]
        return found
