"""Segments of paths on triangles, in arrays of a given length."""

import cython

__all__ = ["PathSegments"]


@cython.final
@cython.cclass
class PathSegments:
    """Segments, path after path: `face` (r,) int32, and barycentric coordinates `place` (r, 2, 3) of both ends.

    `n` is how many there are so far.
    """

    def __init__(self, face, place):
        self.face, self.place = face, place

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
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
