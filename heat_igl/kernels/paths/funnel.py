"""The shortest path in a strip of faces, found by a funnel (Lee and Preparata 1984)."""

import cython
import numpy as np
from cython.cimports.libc.math import hypot

_GATE = np.dtype([("x", "f8", 2), ("y", "f8", 2), ("vertex", "i4", 2)])
_BEND = np.dtype([("x", "f8"), ("y", "f8"), ("side", "i4"), ("first", "i4"), ("last", "i4")], align=True)


@cython.final
@cython.cclass
class Funnel:
    """The crossings of a strip in the plane, `gate`, and the corners of the shortest path through them, `bend`.

    Side "left" is the side of the second of a half-edge's ends for the first crossing, and carried along from there.
    (x, y) is the start of the path.
    """

    def __init__(self):
        self.gate, self.bend = np.empty(64, _GATE), np.empty(66, _BEND)

    def lay_out(self, s, face, start, strip):
        """Lay out the strip that begins in a face, for paths from `start` there."""
        if strip.count > self.gate.shape[0]:
            with cython.gil:
                self.gate, self.bend = np.empty(2 * strip.count, _GATE), np.empty(2 * strip.count + 2, _BEND)
        p: Corners
        f: cython.int = face
        first = cython.address(s.triangle[f])
        base: cython.double = first.length[2]
        p.x[0], p.y[0], p.x[1], p.y[1] = 0.0, 0.0, base, 0.0
        p.x[2], p.y[2] = base * (1.0 - first.along[2]), base * first.above[2]
        self.first = p
        self.x, self.y = weighted(start, p.x), weighted(start, p.y)
        entered: cython.int = -1
        left: cython.int = -1
        right: cython.int = -1
        for j in range(strip.count):
            corner: cython.int = strip.crossing[j].leave % 3
            if entered < 0:
                left, right = (corner + 2) % 3, (corner + 1) % 3
            elif corner == left:
                left = entered
            else:
                right = entered
            gate = cython.address(self.gate[j])
            gate.x[0], gate.y[0], gate.x[1], gate.y[1] = p.x[left], p.y[left], p.x[right], p.y[right]
            here = cython.address(s.triangle[f])
            gate.vertex[0], gate.vertex[1] = here.vertex[left], here.vertex[right]
            f, entered = strip.crossing[j].enter // 3, strip.crossing[j].enter % 3
            left, right = corner_of(s, f, gate.vertex[0]), corner_of(s, f, gate.vertex[1])
            there = cython.address(s.triangle[f])
            # The far corner over the crossing, from the right end.
            x: cython.double = there.along[entered]
            if right != (entered + 2) % 3:
                x = 1.0 - x
            y: cython.double = there.above[entered]
            ux: cython.double = gate.x[0] - gate.x[1]
            uy: cython.double = gate.y[0] - gate.y[1]
            p.x[left], p.y[left], p.x[right], p.y[right] = gate.x[0], gate.y[0], gate.x[1], gate.y[1]
            p.x[entered], p.y[entered] = gate.x[1] + x * ux + y * uy, gate.y[1] + x * uy - y * ux
        self.n_gates = strip.count
        self.last = p
        return 0

    def pull_tight(self, x, y):
        """The shortest path to (x, y): `bend` 0 is the start and the last one the end."""
        k: cython.int = self.n_gates
        count: cython.int = 1
        ax: cython.double = self.x
        ay: cython.double = self.y
        # For each side the limit of the apex's view, and the crossing that set it; -1 for none yet.
        limit_x: cython.double[2]
        limit_y: cython.double[2]
        by: cython.int[2]
        by[0] = by[1] = -1
        self.bend[0] = FunnelCorner(ax, ay, -1, -1, -1)
        j: cython.int = 0
        while j <= k:
            is_turned: cython.bint = False
            for side in range(1, -1, -1):
                px: cython.double = (self.gate[j].x[side] if j < k else x) - ax
                py: cython.double = (self.gate[j].y[side] if j < k else y) - ay
                sign: cython.double = 1.0 if side == 0 else -1.0
                if by[side] >= 0 and sign * (limit_x[side] * py - limit_y[side] * px) > 0.0:
                    continue  # opens the funnel
                opposite: cython.int = 1 - side
                if by[opposite] >= 0 and sign * (limit_x[opposite] * py - limit_y[opposite] * px) < 0.0:
                    bend: FunnelCorner = self.corner(by[opposite], opposite)
                    # Crossings before the last bend come before it, though this vertex may be in sight already.
                    bend.first = max(bend.first, self.bend[count - 1].last)
                    ax, ay, j = bend.x, bend.y, bend.last + 1
                    self.bend[count] = bend
                    count += 1
                    by[0] = by[1] = -1
                    is_turned = True
                    break
                limit_x[side], limit_y[side], by[side] = px, py, j
            if not is_turned:
                j += 1
        self.bend[count] = FunnelCorner(x, y, -1, k, k)
        self.n_bends = count + 1

    def corner(self, at, side):
        """An end of the crossing `at`, with all crossings there that share it."""
        gate = cython.address(self.gate[at])
        first: cython.int = at
        last: cython.int = at
        while first > 0 and self.gate[first - 1].vertex[side] == gate.vertex[side]:
            first -= 1
        while last + 1 < self.n_gates and self.gate[last + 1].vertex[side] == gate.vertex[side]:
            last += 1
        return FunnelCorner(gate.x[side], gate.y[side], side, first, last)

    def length(self):
        """Length of the shortest path."""
        total: cython.double = 0.0
        for i in range(1, self.n_bends):
            total += hypot(self.bend[i].x - self.bend[i - 1].x, self.bend[i].y - self.bend[i - 1].y)
        return total

    def share(self, j, i):
        """The share from right end (0) to left end (1) at which the path passes crossing j on the way to bend i."""
        gate = cython.address(self.gate[j])
        if self.bend[i].side >= 0 and self.bend[i].first <= j:
            return 1.0 - self.bend[i].side
        p = cython.address(self.bend[i - 1])
        q = cython.address(self.bend[i])
        ux: cython.double = q.x - p.x
        uy: cython.double = q.y - p.y
        to_left: cython.double = ux * (gate.y[0] - p.y) - uy * (gate.x[0] - p.x)
        to_right: cython.double = ux * (gate.y[1] - p.y) - uy * (gate.x[1] - p.x)
        share: cython.double = to_right / (to_right - to_left) if to_right != to_left else 0.5
        # Between the feet of p and q, the only choice left if the line runs along the crossing.
        ex: cython.double = gate.x[0] - gate.x[1]
        ey: cython.double = gate.y[0] - gate.y[1]
        squared: cython.double = ex * ex + ey * ey
        foot_p: cython.double = ((p.x - gate.x[1]) * ex + (p.y - gate.y[1]) * ey) / squared
        foot_q: cython.double = ((q.x - gate.x[1]) * ex + (q.y - gate.y[1]) * ey) / squared
        share = min(max(share, min(foot_p, foot_q)), max(foot_p, foot_q))
        return min(max(share, 0.0), 1.0)
