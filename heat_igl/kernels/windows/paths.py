"""Sources inside faces, points and segments, by their roots: n + i for source i of a surface with n vertices."""

import cython
from cython.cimports.heat_igl.kernels.mesh.triangles import foot, next_half_edge, previous_half_edge
from cython.cimports.heat_igl.kernels.windows.structures import apart, at_corner, nearest_on
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["InnerSources", "PathSegments", "trace_back"]


@cython.final
@cython.cclass
class InnerSources:
    """Source points and, after them, source segments of a search by windows.

    `n` is the number of vertices, and `starts` are the sources, see `heat_igl.windows.window_search.Starts`.
    """

    def __init__(self, n, starts):
        points, segments = starts.points, starts.segments
        self.n, self.n_points = n, len(points.faces)
        self.point_face, self.point, self.point_offset = points.faces, points.barycentric, starts.point_offset
        self.segment_face, self.segment = segments.faces, segments.barycentric
        self.segment_offset = starts.segment_offset

    def face(self, root: cython.int) -> cython.int:
        """The face that holds a source; -1 if the root is a vertex."""
        i: cython.int = root - self.n
        if i < 0:
            return -1
        return self.point_face[i] if i < self.n_points else self.segment_face[i - self.n_points]

    def nearest(
        self,
        side: cython.pointer[cython.const[cython.double]],
        root: cython.int,
        here: cython.p_double,
        found: cython.p_double,
    ) -> cython.double:
        """Find the point of a source that is nearest to a point of its face with these sides; the source's offset."""
        k: cython.int
        i: cython.int = root - self.n
        if i < self.n_points:
            for k in range(3):
                found[k] = self.point[i, k]
            return self.point_offset[i]
        i -= self.n_points
        nearest_on(side, cython.address(self.segment[i, 0, 0]), here, found)
        return self.segment_offset[i]


@cython.final
@cython.cclass
class PathSegments:
    """Segments, path after path: `face` (r,) int32, and barycentric coordinates `place` (r, 2, 3) of both ends.

    `n` is how many there are so far.
    """

    def __init__(self, face, place):
        self.face, self.place = face, place

    def append(self, f: cython.int, start: cython.p_double, end: cython.p_double) -> cython.bint:
        """Add a segment in face f; whether there was room."""
        k: cython.int
        if self.n == self.face.shape[0]:
            return False
        self.face[self.n] = f
        for k in range(3):
            self.place[self.n, 0, k] = start[k]
            self.place[self.n, 1, k] = end[k]
        self.n += 1
        return True


def trace_back(
    tables,
    found,
    sources,
    begin,
    face: cython.int[::1],
    place: cython.double[:, :, ::1],
    end: cython.longlong[::1],
) -> int:
    """Paths from vertices and points to the sources of a search; how many were traced before room ran out.

    Parameters
    ----------
    tables : Tables
        As for `windows.Front`, of triangles that were not flipped: no face has a vertex twice.
    found : Found
        What `windows.search` found for the vertices.
    sources : Starts
        Its sources.
    begin : PathStarts
        Where the k paths begin; see `heat_igl.windows.traced_paths.PathStarts`.
    face, place : (r,), (r, 2, 3)
        Take the segments, path after path: face, and barycentric coordinates of both ends.
    end : (k,)
        Takes where the segments of each path end; nothing is added for a path that was lost.
    """
    segments: PathSegments = PathSegments(face, place)
    tracer: _PathTracer = _PathTracer(tables, found, InnerSources(len(found.distance), sources), segments)
    vertex: cython.const[cython.int][::1] = begin.vertex
    from_face: cython.const[cython.int][::1] = begin.face
    from_place: cython.const[cython.double][:, ::1] = begin.barycentric
    from_distance: cython.const[cython.double][::1] = begin.distance
    from_root: cython.const[cython.int][::1] = begin.root
    from_entered: cython.const[cython.int][::1] = begin.entered
    from_crossing: cython.const[cython.double][::1] = begin.crossing
    i: cython.Py_ssize_t
    v: cython.int
    bend: Bend
    n_done: cython.int = 0
    with cython.nogil:
        for i in range(end.shape[0]):
            tracer.n_steps = 0
            first: cython.longlong = segments.n
            v = vertex[i]
            bend.x, bend.y, bend.z = from_place[i, 0], from_place[i, 1], from_place[i, 2]
            bend.face, bend.distance, bend.root = from_face[i], from_distance[i], from_root[i]
            bend.entered, bend.crossing = from_entered[i], from_crossing[i]
            if v < 0:
                v = tracer.along_bends(tracer.straight(cython.address(bend)))
            elif tracer.root[v] == v:
                v = tracer.stay(cython.address(bend))
            else:
                v = tracer.along_bends(v)
            if v == NO_ROOM:
                break
            if v == LOST:
                segments.n = first
            end[i] = segments.n
            n_done += 1
    return n_done


@cython.final
@cython.cclass
class _PathTracer:
    """A surface, what a search found on it, and the segments so far."""

    vertex: cython.const[cython.int][::1]
    length: cython.const[cython.double][::1]
    twin: cython.const[cython.int][::1]
    aligned: cython.const[cython.uchar][::1]
    ring: cython.const[cython.int][::1]
    double_area: cython.const[cython.double][::1]
    distance: cython.const[cython.double][::1]
    root: cython.const[cython.int][::1]
    entered: cython.const[cython.int][::1]
    crossing: cython.const[cython.double][::1]
    sources: InnerSources
    segments: PathSegments
    n_steps: cython.longlong
    # Lines to be tried, the next one last.
    line: Line[MOST_LINES]
    n_lines: cython.int

    def __init__(self, tables, found, sources: InnerSources, segments: PathSegments):
        self.vertex, self.twin, self.ring, self.aligned, self.length = tables.edges
        self.double_area = tables.double_area
        self.distance, self.root = found.distance, found.root
        self.entered, self.crossing = found.entered, found.crossing
        self.sources, self.segments = sources, segments

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def along_bends(self, v: cython.int) -> cython.int:
        """From vertex v to a source; AT_SOURCE, LOST or NO_ROOM."""
        begin: Bend
        h: cython.int
        while v >= 0:
            if self.root[v] == v:
                return AT_SOURCE
            if self.root[v] < 0:
                return LOST
            h = self.entered[v]
            begin.distance, begin.root, begin.entered, begin.crossing = (
                self.distance[v],
                self.root[v],
                h,
                self.crossing[v],
            )
            if h < 0:
                # A source inside a face with this vertex.
                h = 3 * self.sources.face(begin.root)
                while self.vertex[h] != v:
                    h += 1
            begin.face = h // 3
            begin.x, begin.y, begin.z = h % 3 == 0, h % 3 == 1, h % 3 == 2
            v = self.straight(cython.address(begin))
        return v

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def stay(self, begin: cython.pointer[cython.const[Bend]]) -> cython.int:
        """A segment without length, at a source; AT_SOURCE or NO_ROOM."""
        here: cython.double[3]
        here[0], here[1], here[2] = begin.x, begin.y, begin.z
        return AT_SOURCE if self.segments.append(begin.face, here, here) else NO_ROOM

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def straight(self, begin: cython.pointer[cython.const[Bend]]) -> cython.int:
        """The vertex at which the straight part of a path that ends at `begin` starts, or as `along_bends`."""
        h: cython.int = begin.entered
        f: cython.int = begin.face
        here: cython.double[3]
        corner: cython.double[3]
        line: Line
        v: cython.int
        c: cython.int
        here[0], here[1], here[2] = begin.x, begin.y, begin.z
        for c in range(3):
            v = self.vertex[3 * f + c]
            at_corner(c, corner)
            left: cython.double = apart(cython.address(self.length[3 * f]), here, corner)
            if here[c] != 1.0 and ((h < 0 and v == begin.root) or self.leads(begin, v, left)):
                return v if self.segments.append(f, here, corner) else NO_ROOM
        if h < 0:
            return self.add_to_source(f, here, begin.root)
        length: cython.double = self.length[h]
        x: cython.double = foot(length, self.length[previous_half_edge(h)], self.length[next_half_edge(h)])
        y: cython.double = here[h % 3] * self.double_area[f] / length
        # The outward frame of h begins at its head.
        x = length - (here[previous_half_edge(h) % 3] * length + here[h % 3] * x)
        line.x = length - begin.crossing
        line.walked = sqrt((line.x - x) * (line.x - x) + y * y)
        if line.walked <= 0.0:
            return LOST
        line.dx, line.dy = (line.x - x) / line.walked, y / line.walked
        if not self.add(f, here, h, line.x):
            return NO_ROOM
        self.n_lines = 0
        self.go_over(h, line)
        while self.n_lines > 0:
            self.n_lines -= 1
            v = self.go_through(begin, self.line[self.n_lines])
            if v != GO_ON:
                return v
        return LOST

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def leads(self, begin: cython.pointer[cython.const[Bend]], v: cython.int, left: cython.double) -> cython.bint:
        """Whether a path of length `left` from vertex v makes up the distance at `begin`."""
        tolerance: cython.double = AT_ROOT if v == begin.root else ON_LINE
        d: cython.double = self.distance[v]
        return d < begin.distance and d + left - begin.distance <= tolerance * begin.distance

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def go_through(self, begin: cython.pointer[cython.const[Bend]], line: Line) -> cython.int:
        """Carry a line through the face that it enters: a vertex it leads to, GO_ON, AT_SOURCE, LOST or NO_ROOM."""
        t: cython.int = line.half_edge
        g: cython.int = t // 3
        left: cython.int = previous_half_edge(t)
        right: cython.int = next_half_edge(t)
        length: cython.double = self.length[t]
        apex_x: cython.double = foot(length, self.length[left], self.length[right])
        apex_y: cython.double = self.double_area[g] / length
        here: cython.double[3]
        corner: cython.double[3]
        side: cython.int
        ux: cython.double
        uy: cython.double
        across: cython.double
        out: Line
        self.segments.n = line.n_segments
        self.n_steps += 1
        if self.n_steps > MOST_STEPS:
            return LOST
        here[t % 3], here[right % 3], here[left % 3] = 0.0, 1.0 - line.x / length, line.x / length
        x: cython.double = apex_x - line.x
        if self.is_at_source(begin, g, here, line.walked):
            return self.add_to_source(g, here, begin.root)
        if self.leads(begin, self.vertex[t], line.walked + sqrt(x * x + apex_y * apex_y)):
            at_corner(t % 3, corner)
            return self.vertex[t] if self.segments.append(g, here, corner) else NO_ROOM
        # Out over the side between the tail of t and the apex, or over the one between the apex and the head.
        if x * line.dy - apex_y * line.dx > 0.0:
            side = left
            ux, uy = apex_x / self.length[side], apex_y / self.length[side]
            x = line.x
        else:
            side = right
            ux, uy = (length - apex_x) / self.length[side], -apex_y / self.length[side]
            x = line.x - length
        # The outward frame of the side has the axes (ux, uy) and (-uy, ux).
        across = ux * line.dy - uy * line.dx
        if across <= 0.0:
            return GO_ON  # given up
        out.x = x * line.dy / across + (0.0 if side == left else self.length[side])
        out.x = min(max(out.x, 0.0), self.length[side])
        out.dx, out.dy = ux * line.dx + uy * line.dy, across
        out.walked = line.walked + max(x * uy / across, 0.0)
        if self.is_too_far(begin, side, out):
            return GO_ON
        if not self.add(g, here, side, out.x):
            return NO_ROOM
        self.go_over(side, out)
        return GO_ON

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_too_far(self, begin: cython.pointer[cython.const[Bend]], h: cython.int, line: Line) -> cython.bint:
        """Whether the ends of a half-edge are farther from the source than the rest of the path allows."""
        left: cython.double = begin.distance - line.walked + ASTRAY * begin.distance
        at_head: cython.double = self.distance[self.vertex[previous_half_edge(h)]]
        at_tail: cython.double = self.distance[self.vertex[next_half_edge(h)]]
        return at_head > left + line.x or at_tail > left + self.length[h] - line.x

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def go_over(self, h: cython.int, line: Line) -> cython.void:
        """Note a line, in the outward frame of h, for each face beyond h."""
        t: cython.int = self.twin[h]
        if t >= 0:
            self.note(t, line, not self.aligned[h])
        elif t == -2:
            t = self.ring[h]
            while t != h:
                self.note(t, line, self.vertex[next_half_edge(t)] == self.vertex[next_half_edge(h)])
                t = self.ring[t]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def note(self, t: cython.int, line: Line, mirrored: cython.bint) -> cython.void:
        if self.n_lines == MOST_LINES:
            return
        line.half_edge, line.n_segments = t, self.segments.n
        if mirrored:
            line.x, line.dx = self.length[t] - line.x, -line.dx
        self.line[self.n_lines] = line
        self.n_lines += 1

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def is_at_source(
        self, begin: cython.pointer[cython.const[Bend]], f: cython.int, here: cython.p_double, walked: cython.double
    ) -> cython.bint:
        """Whether the source inside a face that the path comes from lies ahead in face f."""
        there: cython.double[3]
        side: cython.pointer[cython.const[cython.double]] = cython.address(self.length[3 * f])
        if self.sources.face(begin.root) != f:
            return False
        walked += self.sources.nearest(side, begin.root, here, there)
        return fabs(walked + apart(side, here, there) - begin.distance) <= AT_ROOT * begin.distance

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def add(self, f: cython.int, here: cython.p_double, h: cython.int, x: cython.double) -> cython.bint:
        """A segment to the point of half-edge h that lies at x in its outward frame; whether there was room."""
        there: cython.double[3]
        share: cython.double = x / self.length[h]
        there[h % 3], there[previous_half_edge(h) % 3], there[next_half_edge(h) % 3] = 0.0, 1.0 - share, share
        return self.segments.append(f, here, there)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def add_to_source(self, f: cython.int, here: cython.p_double, root: cython.int) -> cython.int:
        """A segment to a source inside face f."""
        there: cython.double[3]
        if self.sources.face(root) != f:
            return LOST
        self.sources.nearest(cython.address(self.length[3 * f]), root, here, there)
        return AT_SOURCE if self.segments.append(f, here, there) else NO_ROOM
