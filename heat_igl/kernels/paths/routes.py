"""Shortest ways from vertex to vertex along edges, found best first (Hart and others 1968)."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.paths.face_table import FaceTable
from cython.cimports.heat_igl.kernels.priority_queue import PriorityQueue
from cython.cimports.libc.math import INFINITY, sqrt


@cython.final
@cython.cclass
class EdgeRoutes:
    """The edges of a surface, and the state of a search; `position` (n, 3) are the places of the vertices."""

    s: FaceTable
    position: cython.const[cython.double][:, ::1]
    # Of each vertex: the length of the best way to it, where this comes from, and the face of the last part.
    length: cython.double[::1]
    before: cython.int[::1]
    face: cython.int[::1]
    # All vertices with a length, to forget them.
    touched: cython.int[::1]
    n_touched: cython.int
    # Vertices by the inverse of the length of a way to the goal through them, at least.
    queue: PriorityQueue
    goal: cython.double[3]

    def __init__(self, faces: FaceTable, position):
        self.s, self.position = faces, position
        n = len(position)
        self.length, self.before, self.face = np.full(n, np.inf), np.empty(n, np.int32), np.empty(n, np.int32)
        self.touched, self.queue = np.empty(n, np.int32), PriorityQueue(n)

    def route(self, start, start_cost, goal, goal_cost, point):
        """The shortest way from one of the vertices `start` to one of `goal`; the costs there are added.

        Returns its vertices (k,), and the faces (k - 1,) that the edges between them belong to; None if there is no
        way. `point` is the place in space that `goal_cost` counts from.
        """
        first: cython.const[cython.int][::1] = np.ascontiguousarray(start, np.int32)
        before: cython.const[cython.double][::1] = np.ascontiguousarray(start_cost, np.float64)
        last: cython.const[cython.int][::1] = np.ascontiguousarray(goal, np.int32)
        after: cython.const[cython.double][::1] = np.ascontiguousarray(goal_cost, np.float64)
        self.goal[0], self.goal[1], self.goal[2] = point
        with cython.nogil:
            v = self.search(first, before, last, after)
        found = None
        if v >= 0:
            vertices, faces = [v], []
            while self.before[v] >= 0:
                faces.append(self.face[v])
                v = self.before[v]
                vertices.append(v)
            found = np.array(vertices[::-1], np.int32), np.array(faces[::-1], np.int32)
        self.forget()
        return found

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
        """The goal of the shortest way, -1 if there is none."""
        best: cython.double = INFINITY
        found: cython.int = -1
        for i in range(start.shape[0]):
            self.reach(start[i], start_cost[i], -1, -1)
        while self.queue.count > 0:
            v: cython.int = cython.cast(cython.int, self.queue.first())
            if not self.queue.key[v] * best > 1.0:
                break
            self.queue.set_key(v, 0.0)
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
                self.reach(t.vertex[a], self.length[v] + t.length[b], v, f)
                self.reach(t.vertex[b], self.length[v] + t.length[a], v, f)
        return found

    @cython.cfunc
    @cython.nogil
    def reach(self, v: cython.int, length: cython.double, before: cython.int, face: cython.int) -> cython.void:
        """Take a way to v if it is the shortest so far."""
        if not length < self.length[v]:
            return
        if self.length[v] == INFINITY:
            self.touched[self.n_touched] = v
            self.n_touched += 1
        self.length[v], self.before[v], self.face[v] = length, before, face
        # No way to the goal is shorter than the straight line.
        dx: cython.double = self.position[v, 0] - self.goal[0]
        dy: cython.double = self.position[v, 1] - self.goal[1]
        dz: cython.double = self.position[v, 2] - self.goal[2]
        self.queue.set_key(v, 1.0 / (length + sqrt(dx * dx + dy * dy + dz * dz)))

    @cython.cfunc
    @cython.nogil
    def forget(self) -> cython.void:
        """Make ready for the next search."""
        for i in range(self.n_touched):
            self.length[self.touched[i]] = INFINITY
            self.queue.set_key(self.touched[i], 0.0)
        self.n_touched = 0
