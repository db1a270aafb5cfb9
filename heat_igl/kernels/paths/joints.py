"""The joints of a loop: vertices in a ring, each with the straight part of the loop that leads to the next one."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.straightening import NEARLY_STRAIGHT
from cython.cimports.heat_igl.kernels.paths.strips import Strip
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.libc.math import M_PI, fabs

__all__ = ["Joints"]

_JOINT = np.dtype(
    [
        *((name, "f8") for name in ("length", "leave", "arrive")),
        *((name, "i4") for name in ("vertex", "face", "first", "count", "before", "after")),
    ],
    align=True,
)
_CROSSING = np.dtype([("leave", "i4"), ("enter", "i4")])
# Joints for which there is room at first.
_ROOM = 512


@cython.final
@cython.cclass
class Joints:
    """Joints that are linked in a ring, and a queue of those at which the loop can be shortened.

    `total` (n,) is the sum of the angles around each vertex, negative on the boundary.
    """

    def __init__(self, total):
        self.total = total
        self.crossing = np.empty(2 * _ROOM, _CROSSING)
        self.joint, self.free, self.queue = np.empty(_ROOM, _JOINT), np.empty(_ROOM, np.int32), PriorityQueue(_ROOM)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def clear(self, count: cython.int) -> cython.int:
        """Forget the last loop, and make room for more than so many joints."""
        i: cython.int
        if 2 * count > self.joint.shape[0]:
            with cython.gil:
                self.joint, self.free = np.empty(4 * count, _JOINT), np.empty(4 * count, np.int32)
                self.queue = PriorityQueue(4 * count)
        while self.sharpest() >= 0:
            pass
        self.n_crossings = self.count = self.some = 0
        self.n_free = cython.cast(cython.int, self.joint.shape[0])
        for i in range(self.n_free):
            self.free[i] = self.n_free - 1 - i
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def make(self, v: cython.int) -> cython.int:
        """A new joint at vertex v, the first with number 0."""
        self.n_free -= 1
        self.count += 1
        k: cython.int = self.free[self.n_free]
        self.joint[k].vertex = v
        return k

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def remove(self, k: cython.int) -> cython.void:
        """Forget a joint."""
        self.queue.set_key(k, 0.0)
        self.free[self.n_free] = k
        self.n_free += 1
        self.count -= 1
        if self.some == k:
            self.some = self.joint[k].before

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def remove_spur(self, p: cython.int, k: cython.int, q: cython.int) -> cython.bint:
        """Take away the way from joint p to joint k and back to joint q at the vertex of p.

        Returns whether p alone is left: the loop has contracted to a point.
        """
        self.remove(k)
        after: cython.int = self.joint[q].after
        before: cython.int = self.joint[p].before
        if p == q:
            self.joint[p].before = self.joint[p].after = p
            self.joint[p].count, self.joint[p].length = 0, 0.0
            return True
        self.joint[p] = self.joint[q]
        self.remove(q)
        if after == p:
            before = after = p
        self.joint[p].before, self.joint[p].after = before, after
        self.joint[before].after = self.joint[after].before = p
        self.some = p
        self.check(p)
        return False

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def sharpest(self) -> cython.int:
        """Take the joint with the smallest angle out of the queue; -1 if that is empty."""
        if self.queue.count == 0:
            return -1
        k: cython.int = cython.cast(cython.int, self.queue.first())
        self.queue.set_key(k, 0.0)
        return k

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def angle(self, k: cython.int, on_left: cython.pointer[cython.bint]) -> cython.double:
        """The smaller angle at joint k, and on which side it is."""
        total: cython.double = self.total[self.joint[k].vertex]
        # Counterclockwise from where the loop leaves to where it comes from.
        left: cython.double = self.joint[self.joint[k].before].arrive - self.joint[k].leave
        if total < 0.0:
            # On the boundary there is one side.
            on_left[0] = left > 0.0
            return fabs(left)
        if left < 0.0:
            left += total
        on_left[0] = left < 0.5 * total
        return left if on_left[0] else total - left

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def check(self, k: cython.int) -> cython.void:
        """Put joint k into the queue if the angle there is below pi, or else take it out."""
        on_left: cython.bint = False
        self.queue.set_key(k, max(M_PI - NEARLY_STRAIGHT - self.angle(k, cython.address(on_left)), 0.0))

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def set_crossings(self, k: cython.int, strip: Strip, begin: cython.int, end: cython.int) -> cython.int:
        """Let the part after joint k cross what a strip does from crossing `begin` to crossing `end`, exclusive."""
        j: cython.int
        count: cython.int = end - begin
        self.joint[k].first, self.joint[k].count = self.n_crossings, count
        if self.n_crossings + count > self.crossing.shape[0]:
            with cython.gil:
                self.crossing = np.concatenate([self.crossing, np.empty(self.n_crossings + count, _CROSSING)])
        for j in range(begin, end):
            self.crossing[self.n_crossings] = strip.crossing[j]
            self.n_crossings += 1
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def push(self, k: cython.int, strip: Strip) -> cython.int:
        """Add the crossings of the part after joint k to a strip."""
        j: cython.int
        for j in range(self.joint[k].first, self.joint[k].first + self.joint[k].count):
            strip.push(self.crossing[j].leave, self.crossing[j].enter)
        return 0
