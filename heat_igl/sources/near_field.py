"""Exact distance around sources: straight lines from a point or a segment, through unfolded triangles.

A window is what a source sees of an edge: an interval of it, and where the source lies when all triangles on the way
are laid out in the plane of the next. A point is seen along rays that meet in it, a segment along rays that are
parallel, as from a point at infinity; both are one homogeneous point here. docs/sources.md derives the steps.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic import IntrinsicTriangulation, apex
from heat_igl.mesh.connectivity import unique_rows
from heat_igl.sources.specification import SourcePoints, SourceSegments, nearest_first
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["NearField", "Seeds"]

# Levels of triangles that a window may cross. On ordinary meshes the radius ends it long before.
_MOST_LEVELS = 50
# A line that misses a vertex by less than this share of an edge goes through it.
_ROUNDING = 1e-10
# From a corner of a face to the others.
_FOLLOWING, _PRECEDING = np.array([1, 1, -2]), np.array([2, -1, -1])


@dataclass(frozen=True, eq=False)
class Seeds:
    """Distances known exactly: `value` (k,) at `vertex` (k,), each once, from the source `label` (k,)."""

    vertex: IntArray
    value: FloatArray
    label: IntArray

    @classmethod
    def nearest(cls, several: Seeds) -> Seeds:
        """Of several values at a vertex, the smallest."""
        kept = nearest_first(several.vertex, several.value, several.label)
        return cls(several.vertex[kept], several.value[kept], several.label[kept])

    def at(self, chosen: BoolArray) -> Seeds:
        """Some of them."""
        return Seeds(self.vertex[chosen], self.value[chosen], self.label[chosen])


@dataclass(frozen=True, eq=False)
class _Windows:
    """Windows on half-edges, each in the frame of the face that it enters.

    The edge runs from the origin along x, the face lies at y > 0 and the source at y <= 0: at (x, y) / w, or for
    w = 0 in the direction (x, y), and then a place P has the distance -(x, y) P - `level`.
    """

    half_edge: IntArray
    x: FloatArray
    y: FloatArray
    w: FloatArray
    level: FloatArray
    low: FloatArray
    high: FloatArray
    label: IntArray
    offset: FloatArray

    def __len__(self) -> int:
        return len(self.half_edge)

    def at(self, chosen: BoolArray) -> _Windows:
        return _Windows(*(getattr(self, field.name)[chosen] for field in fields(self)))

    def nearest(self) -> FloatArray:
        """Distance of the nearest point of each window."""
        beside = np.where(self.x < self.low, self.low - self.x, np.where(self.x > self.high, self.x - self.high, 0.0))
        to_point = np.hypot(beside, self.y)
        to_line = np.minimum(-self.x * self.low, -self.x * self.high) - self.level
        return np.asarray(np.where(self.w > 0, to_point, to_line))

    def distance(self, px: FloatArray, py: FloatArray) -> FloatArray:
        """Distance of a place in the frame of each window."""
        to_point = np.hypot(px - self.x, py - self.y)
        return np.asarray(np.where(self.w > 0, to_point, -self.x * px - self.y * py - self.level))


def _joined(parts: list[_Windows]) -> _Windows:
    return _Windows(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(_Windows)))


class NearField:
    """Exact distance around sources on one triangulated surface.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        The faces that points and curves refer to.
    """

    def __init__(self, triangulation: IntrinsicTriangulation) -> None:
        self.triangulation = triangulation

    @cached_property
    def _corners(self) -> tuple[IntArray, IntArray]:
        """Corners of faces by vertex: those of vertex v end where those of v + 1 begin, at ``ends[v + 1]``."""
        F = self.triangulation.F
        entries = (np.ones(F.size, np.int8), (F.ravel(), np.arange(F.size)))
        by_vertex = sp.csr_array(entries, shape=(self.triangulation.n, F.size))
        return by_vertex.indptr.astype(np.int64), by_vertex.indices.astype(np.int64)

    def corners_at(self, vertices: IntArray) -> tuple[IntArray, IntArray]:
        """The corners (k,) of faces at the given vertices, and for each the position of its vertex in `vertices`."""
        ends, corners = self._corners
        first = ends[vertices]
        counts = ends[vertices + 1] - first
        which = np.repeat(np.arange(len(vertices)), counts)
        return corners[np.arange(len(which)) + np.repeat(first - (counts.cumsum() - counts), counts)], which

    @cached_property
    def _shared(self) -> tuple[IntArray, IntArray, IntArray]:
        """Half-edges where more than two faces meet, edge by edge; for each half-edge, where its edge begins and ends.

        No such edge is ever flipped, so its vertices tell it.
        """
        tri = self.triangulation
        half_edge = np.flatnonzero(tri.twin == -2)
        tail, head = tri.tail(half_edge), tri.head(half_edge)
        ends = np.stack([np.minimum(tail, head), np.maximum(tail, head)], axis=1)
        _, edge, counts = unique_rows(ends, tri.n)
        end = np.zeros((2, len(tri.twin)), np.int64)
        end[1, half_edge] = np.cumsum(counts)[edge]
        end[0, half_edge] = end[1, half_edge] - counts[edge]
        return half_edge[np.argsort(edge, kind="stable")], *end

    def _behind(self, half_edge: IntArray) -> tuple[IntArray, IntArray, BoolArray]:
        """All that half-edges are glued to: position in `half_edge`, the other half-edge, and whether it is aligned.

        None on the boundary, one inside, and several where more than two faces meet.
        """
        tri = self.triangulation
        twin = tri.twin[half_edge]
        rows = np.flatnonzero(twin != -1)
        at_shared = rows[twin[rows] == -2]
        if not len(at_shared):
            return rows, twin[rows], tri.aligned[half_edge[rows]]
        others, begin, end = self._shared
        counts = end[half_edge[at_shared]] - begin[half_edge[at_shared]]
        which = np.repeat(at_shared, counts)
        place = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        other = others[begin[half_edge[which]] + place]
        which, other = which[other != half_edge[which]], other[other != half_edge[which]]
        rows = rows[twin[rows] >= 0]
        aligned = np.append(tri.aligned[half_edge[rows]], tri.tail(half_edge[which]) == tri.head(other))
        return np.append(rows, which), np.append(twin[rows], other), aligned

    def meets_shared_edge(self, vertices: IntArray) -> bool:
        """Whether a face at one of the vertices has a side where more than two faces meet."""
        corner, _ = self.corners_at(vertices)
        return bool((self.triangulation.twin.reshape(-1, 3)[corner // 3] == -2).any())

    def spokes(self, vertices: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
        """Edges from the given vertices: position of the vertex in `vertices`, the other end, and the length.

        Each inner edge comes twice.
        """
        tri = self.triangulation
        corner, which = self.corners_at(vertices)
        within = corner % 3
        following, preceding = corner + _FOLLOWING[within], corner + _PRECEDING[within]
        ends = tri.F.ravel()[np.concatenate([following, preceding])]
        lengths = tri.l.ravel()[np.concatenate([preceding, following])]
        return np.concatenate([which, which]), ends, lengths

    def seeds(
        self, points: SourcePoints, segments: SourceSegments, radius: float, vertices: Seeds | None = None
    ) -> tuple[Seeds, Seeds]:
        """Distance at the vertices that see a source in a straight line.

        Parameters
        ----------
        points, segments
            The sources. The ends of segments are no sources by themselves.
        radius : float
            How far to look.
        vertices : Seeds, optional
            Vertices that are sources too.

        Returns
        -------
        near : Seeds
            Vertices within `radius`, ascending. The length of a straight line, and as good as always the shortest way:
            not where a way around curvature is shorter, which only a detour by an edge reveals.
        far : Seeds
            Corners of the sources' own faces beyond `radius`, where another source may be nearer.
        """
        points, segments = self._carried(points, segments)
        if vertices is not None:
            points = points.joined(self._as_points(vertices))
        found = _Found(self.triangulation.n)
        windows = _joined([*self._of_points(points, found), *self._of_segments(segments, found)])
        own = found.seeds()
        base = self.triangulation.l.ravel()
        for _ in range(_MOST_LEVELS):
            nearest = windows.nearest()
            ends = self.triangulation.tail(windows.half_edge), self.triangulation.head(windows.half_edge)
            by_corner = np.minimum(*(found.at(vertex) for vertex in ends))
            useful = windows.offset + nearest < by_corner + base[windows.half_edge]
            windows = windows.at((nearest < radius) & useful)
            if not len(windows):
                break
            windows = self._cross(windows, found)
        near = self._shortest(found, radius)
        return near, own.at(~np.isin(own.vertex, near.vertex))

    def _shortest(self, found: _Found, radius: float) -> Seeds:
        """Less the vertices that a way along an edge from another serves better: there, straight is not shortest."""
        seeds = found.seeds(radius)
        which, ends, lengths = self.spokes(seeds.vertex)
        beaten = found.at(ends) > (seeds.value[which] + lengths) * (1 + _ROUNDING)
        return seeds.at(~np.isin(seeds.vertex, ends[beaten]))

    def samples(self, segments: SourceSegments, spacing: float) -> tuple[SourcePoints, FloatArray]:
        """Points along segments, at most `spacing` apart, and the length that each stands for.

        Each lies in the middle of its piece, where a linear function takes its mean.
        """
        _, carried = self._carried(segments.ends(), segments)
        along = np.einsum("kc,kcx->kx", carried.end - carried.start, self._layout(carried.faces))
        lengths = np.linalg.norm(along, axis=1)
        counts = np.ceil(lengths / spacing).astype(np.int64)
        which = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts) + 0.5) / counts[which]
        barycentric = (1 - share)[:, None] * segments.start[which] + share[:, None] * segments.end[which]
        points = SourcePoints(segments.faces[which], barycentric, segments.label[which], segments.offset[which])
        return points, lengths[which] / counts[which]

    def _carried(self, points: SourcePoints, segments: SourceSegments) -> tuple[SourcePoints, SourceSegments]:
        """The same in the faces of the triangulation, which may lack some that were given twice."""
        faces, barycentric = self.triangulation.locate(points.faces, points.barycentric)
        faces_of_segments, start = self.triangulation.locate(segments.faces, segments.start)
        _, end = self.triangulation.locate(segments.faces, segments.end)
        return (
            replace(points, faces=faces, barycentric=barycentric),
            replace(segments, faces=faces_of_segments, start=start, end=end),
        )

    def _of_points(self, points: SourcePoints, found: _Found) -> list[_Windows]:
        """Windows on the sides of each point's face, and its corners."""
        points = self._on_both_sides(points)
        f = points.faces
        corners = self._layout(f)
        p = np.einsum("kc,kcx->kx", points.barycentric, corners)
        distance = np.linalg.norm(corners - p[:, None], axis=2)
        for c in range(3):
            found.add(self.triangulation.F[f, c], distance[:, c], points.offset, points.label)
        windows = []
        one = np.ones(len(f))
        for c in range(3):
            facing = points.barycentric[:, c] > 0
            windows.append(
                self._enter(
                    3 * f[facing] + c,
                    corners[facing],
                    np.full(int(facing.sum()), c),
                    p[facing],
                    one[facing],
                    0 * one[facing],
                    0 * one[facing],
                    one[facing],
                    points.label[facing],
                    points.offset[facing],
                )
            )
        return windows

    def _as_points(self, vertices: Seeds) -> SourcePoints:
        """Vertices as points in the first of their faces; those without a face see nothing."""
        corner, which = self.corners_at(vertices.vertex)
        which, first = np.unique(which, return_index=True)
        corner = corner[first]
        return SourcePoints(corner // 3, np.eye(3)[corner % 3], vertices.label[which], vertices.value[which])

    def _on_both_sides(self, points: SourcePoints) -> SourcePoints:
        """The same, with points on an edge in both of its faces, and points in a vertex in all faces around it."""
        tri = self.triangulation
        zero = points.barycentric == 0
        n_zero = zero.sum(axis=1)
        inner = n_zero == 0
        parts = [(points.faces[inner], points.barycentric[inner], np.flatnonzero(inner))]
        on_edge = np.flatnonzero(n_zero == 1)
        if len(on_edge):
            c = np.argmax(zero[on_edge], axis=1)
            h = 3 * points.faces[on_edge] + c
            parts.append((points.faces[on_edge], points.barycentric[on_edge], on_edge))
            glued, t, aligned = self._behind(h)
            on_edge, c = on_edge[glued], c[glued]
            at_tail = points.barycentric[on_edge, (c + 1) % 3]
            at_head = points.barycentric[on_edge, (c + 2) % 3]
            there = np.zeros((len(t), 3))
            rows = np.arange(len(t))
            same = ~aligned
            there[rows, (t % 3 + 1) % 3] = np.where(same, at_tail, at_head)
            there[rows, (t % 3 + 2) % 3] = np.where(same, at_head, at_tail)
            parts.append((t // 3, there, on_edge))
        in_vertex = np.flatnonzero(n_zero == 2)
        if len(in_vertex):
            vertex = tri.F[points.faces[in_vertex], np.argmax(points.barycentric[in_vertex], axis=1)]
            corner, which = self.corners_at(vertex)
            parts.append((corner // 3, np.eye(3)[corner % 3], in_vertex[which]))
        faces, barycentric, which = (np.concatenate(column) for column in zip(*parts, strict=True))
        return SourcePoints(faces, barycentric, points.label[which], points.offset[which])

    def _of_segments(self, segments: SourceSegments, found: _Found) -> list[_Windows]:
        """Windows on the sides of each segment's face, in both directions across it, and the corners beside it."""
        f = segments.faces
        if not len(f):
            return []
        corners = self._layout(f)
        start = np.einsum("kc,kcx->kx", segments.start, corners)
        end = np.einsum("kc,kcx->kx", segments.end, corners)
        along = end - start
        length = np.linalg.norm(along, axis=1)
        along = along / np.maximum(length, np.finfo(float).tiny)[:, None]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        u = np.einsum("kx,kcx->kc", along, corners - start[:, None])
        v = np.einsum("kx,kcx->kc", across, corners - start[:, None])
        room = _ROUNDING * length
        windows = []
        for c in range(3):
            beside = (u[:, c] >= -room) & (u[:, c] <= length + room) & (length > 0)
            found.add(
                self.triangulation.F[f[beside], c],
                np.abs(v[beside, c]),
                segments.offset[beside],
                segments.label[beside],
            )
        for side in (1.0, -1.0):
            for c in range(3):
                tail, head = (c + 1) % 3, (c + 2) % 3
                # The strip leaves through this edge where the edge looks its way.
                span = u[:, head] - u[:, tail]
                turn = span * (v[:, c] - v[:, tail]) - (v[:, head] - v[:, tail]) * (u[:, c] - u[:, tail])
                outward = side * span * turn < 0
                with np.errstate(divide="ignore", invalid="ignore"):
                    ends = np.stack([-u[:, tail] / span, (length - u[:, tail]) / span])
                low, high = np.clip(ends.min(axis=0), 0, 1), np.clip(ends.max(axis=0), 0, 1)
                leaves = outward & (length > 0) & (high > low)
                S = -side * across[leaves]
                windows.append(
                    self._enter(
                        3 * f[leaves] + c,
                        corners[leaves],
                        np.full(int(leaves.sum()), c),
                        S,
                        np.zeros(len(S)),
                        -np.einsum("kx,kx->k", S, start[leaves]),
                        low[leaves],
                        high[leaves],
                        segments.label[leaves],
                        segments.offset[leaves],
                    )
                )
        return windows

    def _layout(self, f: IntArray) -> FloatArray:
        """Corners (k, 3, 2) of faces, each in a plane of its own."""
        l0, l1, l2 = self.triangulation.l[f].T
        x, y = apex(l2, l1, l0)
        corners = np.zeros((len(f), 3, 2))
        corners[:, 1, 0], corners[:, 2, 0], corners[:, 2, 1] = l2, x, y
        return corners

    def _enter(
        self,
        half_edge: IntArray,
        corners: FloatArray,
        c: IntArray,
        S: FloatArray,
        w: FloatArray,
        level: FloatArray,
        low: FloatArray,
        high: FloatArray,
        label: IntArray,
        offset: FloatArray,
    ) -> _Windows:
        """Windows that leave faces through `half_edge`, in the frame of each face behind it; none at the boundary.

        `corners` (k, 3, 2) are those of the face in its present frame, `c` the one opposite the edge; `low` and `high`
        run from 0 at the edge's tail to 1 at its head.
        """
        tri = self.triangulation
        rows, t, aligned = self._behind(half_edge)
        half_edge, c, label = half_edge[rows], c[rows], label[rows]
        S, w, level, low, high, offset = (array[rows] for array in (S, w, level, low, high, offset))
        tail, head, opposite = corners[rows, (c + 1) % 3], corners[rows, (c + 2) % 3], corners[rows, c]
        length = tri.l.ravel()[half_edge]
        origin = np.where(aligned[:, None], head, tail)
        other = np.where(aligned[:, None], tail, head)
        e = (other - origin) / np.maximum(length, np.finfo(float).tiny)[:, None]
        normal = np.stack([-e[:, 1], e[:, 0]], axis=1)
        inward = np.einsum("kx,kx->k", normal, opposite - origin) > 0
        normal[inward] *= -1
        relative = S - w[:, None] * origin
        windows = _Windows(
            half_edge=t,
            x=np.einsum("kx,kx->k", relative, e),
            y=np.minimum(np.einsum("kx,kx->k", relative, normal), 0.0),
            w=w,
            level=np.where(w > 0, 0.0, level + np.einsum("kx,kx->k", S, origin)),
            low=length * np.where(aligned, 1 - high, low),
            high=length * np.where(aligned, 1 - low, high),
            label=label,
            offset=offset,
        )
        # Grazing rays see nothing that the corners do not see.
        return windows.at((high - low > _ROUNDING) & (windows.y < 0))

    def _cross(self, windows: _Windows, found: _Found) -> _Windows:
        """The windows behind the two far sides of the faces that windows enter; their far corners, where seen."""
        tri = self.triangulation
        t = windows.half_edge
        g, k = t // 3, t % 3
        base = tri.l[g, k]
        rows = np.arange(len(t))
        ax, ay = apex(base, tri.l[g, (k + 2) % 3], tri.l[g, (k + 1) % 3])
        corners = np.zeros((len(t), 3, 2))
        corners[rows, k, 0], corners[rows, k, 1] = ax, ay
        corners[rows, (k + 2) % 3, 0] = base
        # Where the line from the source to the far corner crosses the edge.
        x = ax - ay * (windows.x - windows.w * ax) / (windows.y - windows.w * ay)
        room = _ROUNDING * base
        seen = (x >= windows.low - room) & (x <= windows.high + room)
        found.add(tri.F[g[seen], k[seen]], windows.distance(ax, ay)[seen], windows.offset[seen], windows.label[seen])

        S = np.stack([windows.x, windows.y], axis=1)
        new = []
        # Through the side at the origin, from the far corner to the origin; through the other, from its end to the far
        # corner.
        for side, c in ((0, (k + 2) % 3), (1, (k + 1) % 3)):
            low = windows.low if side == 0 else np.maximum(windows.low, x)
            high = np.minimum(windows.high, x) if side == 0 else windows.high
            lit = high > low
            tail, head = corners[rows, (c + 1) % 3], corners[rows, (c + 2) % 3]
            shares = []
            for b in (low, high):
                dx, dy = windows.w * b - windows.x, -windows.y
                ex, ey = head[:, 0] - tail[:, 0], head[:, 1] - tail[:, 1]
                with np.errstate(divide="ignore", invalid="ignore"):
                    # (b, 0) + r d = tail + s e, solved for s.
                    share = ((b - tail[:, 0]) * dy + tail[:, 1] * dx) / (ex * dy - ey * dx)
                shares.append(np.clip(share, 0, 1))
            s_low, s_high = np.minimum(*shares), np.maximum(*shares)
            lit &= np.isfinite(s_low) & np.isfinite(s_high)
            new.append(
                self._enter(
                    3 * g[lit] + c[lit],
                    corners[lit],
                    c[lit],
                    S[lit],
                    windows.w[lit],
                    windows.level[lit],
                    s_low[lit],
                    s_high[lit],
                    windows.label[lit],
                    windows.offset[lit],
                )
            )
        return _joined(new)


class _Found:
    """The smallest value at each vertex so far, whose it is, and how much of it is the source's offset."""

    def __init__(self, n: int) -> None:
        self._value = np.full(n, np.inf)
        self._label = np.full(n, -1)
        self._offset = np.zeros(n)

    def add(self, vertex: IntArray, distance: FloatArray, offset: FloatArray, label: IntArray) -> None:
        value = offset + distance
        order = np.argsort(-value, kind="stable")  # where a vertex comes twice, what is written last stays
        better = order[value[order] < self._value[vertex[order]]]
        at = vertex[better]
        self._value[at], self._label[at], self._offset[at] = value[better], label[better], offset[better]

    def at(self, vertex: IntArray) -> FloatArray:
        return np.asarray(self._value[vertex])

    def seeds(self, radius: float = np.inf) -> Seeds:
        vertex = np.flatnonzero((self._label >= 0) & (self._value - self._offset <= radius))
        return Seeds(vertex, self._value[vertex], self._label[vertex])
