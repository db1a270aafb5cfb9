"""Sources inside faces, points and segments, by their roots: n + i for source i of a surface with n vertices."""

import cython
from cython.cimports.heat_igl.kernels.windows.window_structures import nearest_on

__all__ = ["InnerSources"]


@cython.final
@cython.cclass
class InnerSources:
    """Source points and, after them, source segments of a search by windows.

    `n` is the number of vertices, and `starts` are the sources, see `heat_igl.unfolding.window_starts.Starts`.
    """

    def __init__(self, n, starts):
        points, segments = starts.points, starts.segments
        self.n, self.n_points = n, len(points.faces)
        self.point_face, self.point, self.point_offset = points.faces, points.barycentric, starts.point_offset
        self.segment_face, self.segment = segments.faces, segments.barycentric
        self.segment_offset = starts.segment_offset

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def face(self, root: cython.int) -> cython.int:
        """The face that holds a source; -1 if the root is a vertex."""
        i: cython.int = root - self.n
        if i < 0:
            return -1
        return self.point_face[i] if i < self.n_points else self.segment_face[i - self.n_points]

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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
