"""Curves on triangles, as segments in faces."""

import cython
import numpy as np


@cython.final
@cython.cclass
class SegmentList:
    """`n` segments so far: `face`, and the barycentric coordinates `place` of both ends; there may be room for more."""

    def __init__(self):
        self.face, self.place = np.empty(64, np.int32), np.empty((64, 2, 3))

    def arrays(self):
        """Faces (n,) int64, and barycentric coordinates (n, 2, 3)."""
        return np.array(self.face[: self.n], np.int64), np.array(self.place[: self.n])

    def append(self, f, start, end):
        """Add a segment in face f."""
        if self.n == self.face.shape[0]:
            with cython.gil:  # twice the room
                self.face = np.concatenate([self.face, self.face])
                self.place = np.concatenate([self.place, self.place])
        self.face[self.n] = f
        for k in range(3):
            self.place[self.n, 0, k] = start[k]
            self.place[self.n, 1, k] = end[k]
        self.n += 1
        return 0
