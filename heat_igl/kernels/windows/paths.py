"""Shortest paths, traced back as straight lines over triangles from the ends of windows to the sources.

On a surface with n vertices, source i among the points and segments inside faces has the root n + i. The derivatives of
distances by edge lengths follow from the segments of these lines.
"""

import cython
from cython.cimports.heat_igl.kernels.mesh.segments import SegmentList
from cython.cimports.heat_igl.kernels.mesh.straight import OVER_SIDE, Exit, Heading, cross
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.structures import apart, at_corner, nearest_on
from cython.cimports.libc.math import INFINITY, fabs, sqrt

# A path through a vertex near the line is taken if its length is the distance up to this fraction of it: more than
# rounding, and too little to matter.
_ON_LINE = cython.declare(cython.double, 1e-13)
# The same for the root, at which the line is known to start. Of 6000 paths on 106 shapes none changes a bit with 1e-6,
# and one on a needle is lost with 1e-12.
_AT_ROOT = cython.declare(cython.double, 1e-9)
# A line is abandoned if it is too far from the source by more than this fraction of the distance. With 1e-11 and 1e-3
# none of these paths changes.
_ASTRAY = cython.declare(cython.double, 1e-6)
# Largest number of faces that one path crosses: its segments take 200 MB.
_MOST_STEPS = cython.declare(cython.int, 4000000)


def trace_back(
    tables,
    found,
    sources,
    targets,
    vertex: cython.const[cython.int][::1],
    target: cython.const[cython.longlong][::1],
    end: cython.longlong[::1],
):
    """Paths from vertices and points to the sources of a search.

    `tables`, `found`, `sources` and `targets` are those of the search, as for `windows.Front`, on triangles without
    flips, so that no face has a vertex twice. Path i ends at ``vertex[i]``, or if that is -1, at target ``target[i]``.

    Returns the segments, path after path: the faces (r,), and the barycentric coordinates (r, 2, 3) of both ends. `end`
    (k,) takes the index after the last segment of each path; a path that was lost has no segments.
    """
    tracer: PathTracer = PathTracer(tables, found, sources)
    segments: SegmentList = tracer.segments
    corner_of_vertex: cython.const[cython.int][::1] = tables.corner_of_vertex
    face: cython.const[cython.int][::1] = targets.place.faces
    place: cython.const[cython.double][:, ::1] = targets.place.barycentric
    distance: cython.const[cython.double][::1] = targets.found.distance
    root: cython.const[cython.int][::1] = targets.found.root
    entered: cython.const[cython.int][::1] = targets.found.entered
    crossing: cython.const[cython.double][::1] = targets.found.crossing
    line_end: LineEnd
    here: cython.double[3]
    with cython.nogil:
        for i in range(end.shape[0]):
            tracer.n_steps = 0
            first: cython.longlong = segments.n
            v: cython.int = vertex[i]
            if v < 0:
                j: cython.longlong = target[i]
                line_end.x, line_end.y, line_end.z = place[j, 0], place[j, 1], place[j, 2]
                line_end.face, line_end.distance, line_end.root = face[j], distance[j], root[j]
                line_end.entered, line_end.crossing = entered[j], crossing[j]
                v = tracer.along_bends(tracer.straight(cython.address(line_end)))
            elif tracer.root[v] == v:
                # A segment without length, at a source.
                at_corner(corner_of_vertex[v] % 3, here)
                segments.append(corner_of_vertex[v] // 3, here, here)
            else:
                v = tracer.along_bends(v)
            if v == LOST:
                segments.n = first
            end[i] = segments.n
    return segments.arrays()


@cython.final
@cython.cclass
class PathTracer:
    """Traces paths back to the sources of a search; `segments` takes their segments."""

    def __init__(self, tables, found, sources):
        self.vertex, self.twin, self.ring, self.aligned, self.length = tables.edges
        self.double_area = tables.double_area
        self.distance, self.root = found.distance, found.root
        self.entered, self.crossing = found.entered, found.crossing
        self.segments = SegmentList()
        points, segments = sources.points, sources.segments
        self.n, self.n_points = tables.n, len(points.faces)
        self.point_face, self.point, self.point_offset = points.faces, points.barycentric, sources.point_offset
        self.segment_face, self.segment = segments.faces, segments.barycentric
        self.segment_offset = sources.segment_offset

    def source_face(self, root):
        """The face of a source inside a face; -1 if the root is a vertex."""
        i: cython.int = root - self.n
        if i < 0:
            return -1
        return self.point_face[i] if i < self.n_points else self.segment_face[i - self.n_points]

    def nearest_source(self, side, root, here, found):
        """Find the point of a source that is nearest to a point of its face; returns the offset of the source."""
        i: cython.int = root - self.n
        if i < self.n_points:
            for k in range(3):
                found[k] = self.point[i, k]
            return self.point_offset[i]
        i -= self.n_points
        nearest_on(side, cython.address(self.segment[i, 0, 0]), here, found)
        return self.segment_offset[i]

    def along_bends(self, v):
        """Trace the path from vertex v to a source; AT_SOURCE or LOST."""
        while v >= 0:
            if self.root[v] == v:
                return AT_SOURCE
            v = self.from_vertex(v)
        return v

    def from_vertex(self, v):
        """The vertex at which the last straight part of the path to v starts, AT_SOURCE for one in a face, or LOST."""
        begin: LineEnd
        h: cython.int = self.entered[v]
        corner: cython.double[3]
        there: cython.double[3]
        least: cython.double = INFINITY
        if self.root[v] < 0:
            return LOST
        begin.distance, begin.root, begin.entered, begin.crossing = self.distance[v], self.root[v], h, self.crossing[v]
        if h < 0:
            # A source inside a face at this vertex, which may be two corners of the face.
            begin.face = self.source_face(begin.root)
            sides = cython.address(self.length[3 * begin.face])
            for c in range(3):
                at_corner(c, corner)
                self.nearest_source(sides, begin.root, corner, there)
                if self.vertex[3 * begin.face + c] == v and apart(sides, corner, there) < least:
                    least = apart(sides, corner, there)
                    h = 3 * begin.face + c
        begin.face = h // 3
        begin.x, begin.y, begin.z = h % 3 == 0, h % 3 == 1, h % 3 == 2
        return self.straight(cython.address(begin))

    def straight(self, begin):
        """The vertex at which the straight part of a path that ends at `begin` starts, or as `along_bends`."""
        h: cython.int = begin.entered
        f: cython.int = begin.face
        here: cython.double[3]
        corner: cython.double[3]
        line: Line
        here[0], here[1], here[2] = begin.x, begin.y, begin.z
        for c in range(3):
            v = self.vertex[3 * f + c]
            at_corner(c, corner)
            left: cython.double = apart(cython.address(self.length[3 * f]), here, corner)
            if here[c] != 1.0 and ((h < 0 and v == begin.root) or self.leads(begin, v, left)):
                self.segments.append(f, here, corner)
                return v
        if h < 0:
            return self.add_to_source(f, here, begin.root)
        length: cython.double = self.length[h]
        x: cython.double = foot(length, self.length[previous_half_edge(h)], self.length[next_half_edge(h)])
        y: cython.double = here[h % 3] * self.double_area[f] / length
        # The outward frame of h begins at its head.
        x = length - (here[previous_half_edge(h) % 3] * length + here[h % 3] * x)
        at: cython.double = length - begin.crossing
        line.walked = sqrt((at - x) * (at - x) + y * y)
        if line.walked <= 0.0:
            return LOST
        line.ray = Heading(h, OVER_SIDE, at, 0.0, (at - x) / line.walked, y / line.walked)
        self.add(f, here, h, at)
        self.n_lines = 0
        self.go_over(cython.address(line))
        while self.n_lines > 0:
            self.n_lines -= 1
            v = self.go_through(begin, cython.address(self.line[self.n_lines]))
            if v != GO_ON:
                return v
        return LOST

    def leads(self, begin, v, left):
        """Whether the distance of v plus the length `left` equals the distance at `begin`."""
        tolerance: cython.double = _AT_ROOT if v == begin.root else _ON_LINE
        d: cython.double = self.distance[v]
        return d < begin.distance and d + left - begin.distance <= tolerance * begin.distance

    def go_through(self, begin, line):
        """Continue a line through the face that it enters: a vertex at which it starts, GO_ON, AT_SOURCE or LOST."""
        t: cython.int = line.ray.h
        g: cython.int = t // 3
        here: cython.double[3]
        corner: cython.double[3]
        out: Line
        share: cython.double = line.ray.x / self.length[t]
        self.segments.n = line.n_segments
        self.n_steps += 1
        if self.n_steps > _MOST_STEPS:
            return LOST
        here[t % 3], here[next_half_edge(t) % 3], here[previous_half_edge(t) % 3] = 0.0, 1.0 - share, share
        at_corner(t % 3, corner)
        if self.is_at_source(begin, g, here, line.walked):
            return self.add_to_source(g, here, begin.root)
        if self.leads(begin, self.vertex[t], line.walked + apart(cython.address(self.length[3 * g]), here, corner)):
            self.segments.append(g, here, corner)
            return self.vertex[t]
        way: Exit = cross(cython.address(self.length[0]), self.double_area[g], cython.address(line.ray))
        across: cython.double = way.left + way.right
        if across <= 0.0:
            return GO_ON  # given up
        share = way.left / across
        out.ray = Heading(way.h, OVER_SIDE, share * self.length[way.h], 0.0, way.dx, way.dy)
        out.walked = line.walked + max(way.head_ahead + share * (way.tail_ahead - way.head_ahead), 0.0)
        if self.is_too_far(begin, cython.address(out)):
            return GO_ON
        self.add(g, here, way.h, out.ray.x)
        self.go_over(cython.address(out))
        return GO_ON

    def is_too_far(self, begin, line):
        """Whether an end of the half-edge that a line crosses is too far from the source for the line to be a path.

        If the search ended at the distance of `begin`, larger distances are only known to be larger.
        """
        h: cython.int = line.ray.h
        left: cython.double = begin.distance - line.walked + _ASTRAY * begin.distance
        at_head: cython.double = min(self.distance[self.vertex[previous_half_edge(h)]], begin.distance)
        at_tail: cython.double = min(self.distance[self.vertex[next_half_edge(h)]], begin.distance)
        return at_head > left + line.ray.x or at_tail > left + self.length[h] - line.ray.x

    def go_over(self, line):
        """Store a line, in the outward frame of the half-edge that it crosses, for each face on the other side."""
        h: cython.int = line.ray.h
        t: cython.int = self.twin[h]
        if t >= 0:
            self.note(t, line, not self.aligned[h])
        elif t == -2:
            t = self.ring[h]
            while t != h:
                self.note(t, line, self.vertex[next_half_edge(t)] == self.vertex[next_half_edge(h)])
                t = self.ring[t]

    def note(self, t, line, mirrored):
        """Store a line that enters a face over half-edge t, with its frame mirrored if the faces are not aligned."""
        if self.n_lines == MOST_LINES:
            return
        to = cython.address(self.line[self.n_lines])
        to.ray, to.n_segments, to.walked = line.ray, self.segments.n, line.walked
        to.ray.h = t
        if mirrored:
            to.ray.x, to.ray.dx = self.length[t] - line.ray.x, -line.ray.dx
        self.n_lines += 1

    def is_at_source(self, begin, f, here, walked):
        """Whether the source of the path lies inside face f, at the distance that is left."""
        there: cython.double[3]
        side: cython.pointer[cython.const[cython.double]] = cython.address(self.length[3 * f])
        if self.source_face(begin.root) != f:
            return False
        walked += self.nearest_source(side, begin.root, here, there)
        return fabs(walked + apart(side, here, there) - begin.distance) <= _AT_ROOT * begin.distance

    def add(self, f, here, h, x):
        """Add a segment that ends at x in the outward frame of half-edge h."""
        there: cython.double[3]
        share: cython.double = x / self.length[h]
        there[h % 3], there[previous_half_edge(h) % 3], there[next_half_edge(h) % 3] = 0.0, 1.0 - share, share
        return self.segments.append(f, here, there)

    def add_to_source(self, f, here, root):
        """Add a segment that ends at a source inside face f."""
        there: cython.double[3]
        if self.source_face(root) != f:
            return LOST
        self.nearest_source(cython.address(self.length[3 * f]), root, here, there)
        self.segments.append(f, here, there)
        return AT_SOURCE


@cython.cfunc
@cython.nogil
@cython.exceptval(-4)
def _follow(tracer: PathTracer, v: cython.int) -> cython.int:
    """Trace the last straight part of the path to vertex v: the row of its root, -1 at a source or if it is lost."""
    if tracer.root[v] == v:
        return -1
    tracer.n_steps = tracer.segments.n = 0
    end: cython.int = tracer.from_vertex(v)
    return tracer.root[v] if end == AT_SOURCE else -1 if end == LOST else end


@cython.cfunc
@cython.nogil
def _derivative(
    tracer: PathTracer, j: cython.longlong, weight: cython.double, by_side: cython.p_double, by_end: cython.p_double
) -> cython.int:
    """The derivative of the length of segment j, times `weight`, by the sides of its face and by its end.

    In a triangle with sides l, a segment between points whose barycentric coordinates differ by delta has the length s,
    s^2 = - sum over pairs i < k of delta_i delta_k l_ik^2. By the envelope theorem, the points on the edges are treated
    as fixed, so the derivative by l_ik is - delta_i delta_k l_ik / s. Returns the first side of the face.
    """
    h: cython.int = 3 * tracer.segments.face[j]
    d: cython.double[3]
    side = cython.address(tracer.length[h])
    one = cython.address(tracer.segments.place[j, 0, 0])
    length: cython.double = apart(side, one, one + 3)
    per_length: cython.double = 1.0 / length if length > 0.0 else 0.0
    for c in range(3):
        d[c] = one[3 + c] - one[c]
    for c in range(3):
        i: cython.int = (c + 1) % 3
        k: cython.int = (c + 2) % 3
        by_side[c] = weight * (-d[i] * d[k] * side[c] * per_length)
        by_end[c] = -0.5 * weight * per_length * (d[i] * side[k] ** 2 + d[k] * side[i] ** 2)
    return h


def pull_back(
    tables,
    found,
    starts,
    order: cython.const[cython.longlong][::1],
    weight: cython.double[::1],
    by_side: cython.double[::1],
    by_place: cython.double[:, ::1],
) -> None:
    """Add up the derivative of the weighted sum of distances by the sides (3 m,), and by the coordinates of sources.

    A path consists of straight lines from a vertex to the next one that it passes, or to a source point. The weight of
    each vertex is added to that of the vertex at which its last line starts, so each line is traced once.

    `tables`, `found` and `starts` are those of `trace_back`, with e source points, and `order` (n,) has the vertices by
    ascending distance. The `weight` (n + e,) of the vertices is propagated along the paths in descending order of
    distance; its last e entries become the sums of the weights of all paths to each source point.
    `by_side` (3 m,) and `by_place` (e, 3) take the derivatives.
    """
    tracer: PathTracer = PathTracer(tables, found, starts)
    n: cython.int = order.shape[0]
    of_sides: cython.double[3]
    of_end: cython.double[3]
    with cython.nogil:
        for i in range(n - 1, -1, -1):
            v: cython.int = cython.cast(cython.int, order[i])
            row: cython.int = _follow(tracer, v) if weight[v] != 0.0 else -1
            if row < 0:
                continue
            for j in range(tracer.segments.n):
                h: cython.int = _derivative(tracer, j, weight[v], of_sides, of_end)
                for c in range(3):
                    by_side[h + c] += of_sides[c]
            if row >= n:
                for c in range(3):
                    by_place[row - n, c] += of_end[c]
            weight[row] += weight[v]


def push_forward(
    tables,
    found,
    starts,
    order: cython.const[cython.longlong][::1],
    tangent: cython.const[cython.double][::1],
    moves: cython.const[cython.double][:, ::1],
    change: cython.double[::1],
) -> None:
    """The derivative of all distances, `change` (n + e,), for sides that change by `tangent` (3 m,).

    The coordinates of source points change by `moves` (e, 3). On entry, `change` holds the changes of the offsets of
    sources. Other arguments as for `pull_back`.
    """
    tracer: PathTracer = PathTracer(tables, found, starts)
    n: cython.int = order.shape[0]
    of_sides: cython.double[3]
    of_end: cython.double[3]
    with cython.nogil:
        for i in range(n):
            v: cython.int = cython.cast(cython.int, order[i])
            row: cython.int = _follow(tracer, v)
            if row < 0:
                continue
            change[v] = change[row]
            total: cython.double = 0.0
            for j in range(tracer.segments.n):
                h: cython.int = _derivative(tracer, j, 1.0, of_sides, of_end)
                of_segment: cython.double = 0.0
                for c in range(3):
                    of_segment += of_sides[c] * tangent[h + c]
                    if row >= n and j == tracer.segments.n - 1:
                        of_segment += of_end[c] * moves[row - n, c]
                total += of_segment
            change[v] += total
