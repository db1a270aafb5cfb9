"""Short ways from vertex to vertex along edges and straight across them, found best first (Hart and others 1968)."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.routes import Entry
from cython.cimports.heat_igl.kernels.paths.surfaces import Surface
from cython.cimports.libc.math import INFINITY, sqrt

__all__ = ["Roads"]

_ENTRY = np.dtype([("key", "f8"), ("vertex", "i4")], align=True)


@cython.final
@cython.cclass
class Roads:
    """The graph of a surface: edges, and straight lines between the two corners across an edge, each with its length.

    `across` and `opposite` (3 m,) are the length of the line over each half-edge, inf if there is none, and the
    half-edge on the other side; `position` (n, 3) are those of the vertices.
    """

    s: Surface
    across: cython.const[cython.double][::1]
    opposite: cython.const[cython.int][::1]
    position: cython.const[cython.double][:, ::1]
    # Of each vertex: the length of the best way to it, where this comes from, the face of the last part, and the
    # half-edge that this part crosses, -1 along an edge.
    length: cython.double[::1]
    before: cython.int[::1]
    face: cython.int[::1]
    over: cython.int[::1]
    done: cython.uchar[::1]
    # All vertices with a length, to forget them.
    touched: cython.int[::1]
    n_touched: cython.int
    heap: Entry[::1]
    n_heap: cython.int
    goal: cython.double[3]
    crosses: cython.bint

    def __init__(self, surface, across, opposite, position):
        self.s = Surface(surface, np.empty(0))
        self.across, self.opposite, self.position = across, opposite, position
        n = len(position)
        self.length, self.before, self.face = np.full(n, np.inf), np.empty(n, np.int32), np.empty(n, np.int32)
        self.over, self.done, self.touched = np.empty(n, np.int32), np.zeros(n, np.uint8), np.empty(n, np.int32)
        self.heap = np.empty(1024, _ENTRY)

    def route(self, start, start_cost, goal, goal_cost, point, crosses):
        """The best way from one of the vertices `start` to one of `goal`; the costs there are added.

        Returns the faces (k,) that it runs in, and the joins (k + 1, 3) before, between and after them: the half-edge
        that is left, the one that is entered, and the vertex to turn around; -1 for none. None if there is no way.
        `point` is the place in space that `goal_cost` counts from. Without `crosses`, the way follows edges only.
        """
        first: cython.const[cython.int][::1] = np.ascontiguousarray(start, np.int32)
        before: cython.const[cython.double][::1] = np.ascontiguousarray(start_cost, np.float64)
        last: cython.const[cython.int][::1] = np.ascontiguousarray(goal, np.int32)
        after: cython.const[cython.double][::1] = np.ascontiguousarray(goal_cost, np.float64)
        self.goal[0], self.goal[1], self.goal[2] = point
        self.crosses = crosses
        v: cython.int
        with cython.nogil:
            v = self.search(first, before, last, after)
        found = None if v < 0 else self.steps(v)
        self.forget()
        return found

    @cython.cfunc
    def steps(self, v: cython.int):
        """Faces and joins of the way to v."""
        faces = []
        joins = [(-1, -1, v)]
        while self.before[v] >= 0:
            h: cython.int = self.over[v]
            if h >= 0:
                faces.append(self.opposite[h] // 3)
                joins.append((h, self.opposite[h], -1))
            faces.append(self.face[v])
            v = self.before[v]
            joins.append((-1, -1, v))
        return np.array(faces[::-1], np.int32), np.array(joins[::-1], np.int32)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-2, check=False)
    def search(
        self,
        start: cython.const[cython.int][::1],
        start_cost: cython.const[cython.double][::1],
        goal: cython.const[cython.int][::1],
        goal_cost: cython.const[cython.double][::1],
    ) -> cython.int:
        """The goal of the best way, -1 if there is none."""
        i: cython.int
        k: cython.int
        best: cython.double = INFINITY
        found: cython.int = -1
        for i in range(start.shape[0]):
            self.reach(start[i], start_cost[i], -1, -1, -1)
        while self.n_heap > 0 and self.heap[0].key < best:
            v: cython.int = self.pop()
            if self.done[v]:
                continue
            self.done[v] = 1
            for i in range(goal.shape[0]):
                if goal[i] == v and self.length[v] + goal_cost[i] < best:
                    best, found = self.length[v] + goal_cost[i], v
            for k in range(self.s.first_corner[v], self.s.first_corner[v + 1]):
                h: cython.int = self.s.corner[k]
                f: cython.int = h // 3
                c: cython.int = h - 3 * f
                t = cython.address(self.s.triangle[f])
                a: cython.int = (c + 1) % 3
                b: cython.int = (c + 2) % 3
                here: cython.double = self.length[v]
                self.reach(t.vertex[a], here + t.length[b], v, f, -1)
                self.reach(t.vertex[b], here + t.length[a], v, f, -1)
                if self.crosses and self.across[h] < INFINITY:
                    g: cython.int = self.opposite[h]
                    self.reach(self.s.triangle[g // 3].vertex[g % 3], here + self.across[h], v, f, h)
        return found

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def reach(
        self, v: cython.int, length: cython.double, before: cython.int, face: cython.int, over: cython.int
    ) -> cython.int:
        """Take a way to v if it is the best so far."""
        if not length < self.length[v]:
            return 0
        if self.length[v] == INFINITY:
            self.touched[self.n_touched] = v
            self.n_touched += 1
        self.length[v], self.before[v], self.face[v], self.over[v] = length, before, face, over
        # No way to the goal is shorter than the straight line.
        dx: cython.double = self.position[v, 0] - self.goal[0]
        dy: cython.double = self.position[v, 1] - self.goal[1]
        dz: cython.double = self.position[v, 2] - self.goal[2]
        return self.push(length + sqrt(dx * dx + dy * dy + dz * dz), v)

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def push(self, key: cython.double, v: cython.int) -> cython.int:
        """Put a vertex on the heap."""
        if self.n_heap == self.heap.shape[0]:
            with cython.gil:
                self.heap = np.concatenate([self.heap, np.empty(self.n_heap, _ENTRY)])
        i: cython.int = self.n_heap
        self.n_heap += 1
        while i > 0 and self.heap[(i - 1) // 2].key > key:
            self.heap[i] = self.heap[(i - 1) // 2]
            i = (i - 1) // 2
        self.heap[i].key, self.heap[i].vertex = key, v
        return 0

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(-1, check=False)
    def pop(self) -> cython.int:
        """Take the vertex of the smallest key from the heap."""
        v: cython.int = self.heap[0].vertex
        self.n_heap -= 1
        last: Entry = self.heap[self.n_heap]
        i: cython.int = 0
        while 2 * i + 1 < self.n_heap:
            child: cython.int = 2 * i + 1
            if child + 1 < self.n_heap and self.heap[child + 1].key < self.heap[child].key:
                child += 1
            if not self.heap[child].key < last.key:
                break
            self.heap[i] = self.heap[child]
            i = child
        self.heap[i] = last
        return v

    @cython.cfunc
    @cython.nogil
    @cython.exceptval(check=False)
    def forget(self) -> cython.void:
        """Make ready for the next search."""
        i: cython.int
        for i in range(self.n_touched):
            self.length[self.touched[i]] = INFINITY
            self.done[self.touched[i]] = 0
        self.n_touched = self.n_heap = 0
