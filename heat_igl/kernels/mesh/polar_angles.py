"""Angles of half-edges around the vertices of an oriented manifold triangulation."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.mesh.triangles import area, foot, next_half_edge, previous_half_edge
from cython.cimports.libc.math import atan2


def polar_angles(
    angle: cython.double[::1], twin: cython.longlong[::1], first: cython.longlong[::1], outgoing: cython.double[::1]
):
    """Fill `outgoing` (3 m,) with the angle from the reference edge of the tail to each half-edge, counterclockwise.

    `angle` (3 m,) are the angles at the corners, `first` (n,) is one corner at each vertex, -1 if there is none. The
    reference edge of an inner vertex leaves from that corner. On the boundary it is the edge at which the faces begin.

    Returns the sum of the angles (n,), the number of corners that were visited (n,), and whether the faces close up
    around the vertex (n,).
    """
    n: cython.Py_ssize_t = first.shape[0]
    sums, counts, closes = np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    total: cython.double[::1] = sums
    count: cython.longlong[::1] = counts
    closed: cython.uchar[::1] = closes
    most: cython.longlong = twin.shape[0]
    t: cython.longlong = -1
    with cython.nogil:
        for v in range(n):
            if first[v] < 0:
                continue
            start: cython.longlong = first[v]
            # Clockwise to the boundary, if there is one: across the half-edge that leaves from the corner.
            for _k in range(most):
                t = twin[start + 2 if start % 3 == 0 else start - 1]
                if t < 0:
                    break
                start = t + 2 if t % 3 == 0 else t - 1
                if start == first[v]:
                    break
            at: cython.longlong = start
            for _k in range(most):
                outgoing[at + 2 if at % 3 == 0 else at - 1] = total[v]
                total[v] += angle[at]
                count[v] += 1
                # Counterclockwise: across the half-edge that arrives at the corner.
                t = twin[at - 2 if at % 3 == 2 else at + 1]
                if t < 0:
                    break
                at = t - 2 if t % 3 == 2 else t + 1
                if at == start:
                    break
            closed[v] = t >= 0
    return sums, counts, closes.astype(bool)


def vertices_before(kind: cython.const[cython.longlong][:, ::1], F: cython.longlong[::1]) -> None:
    """Turn the vertices F (3 m,) at the corners of faces after flips, as `Moved` has them, into those before."""
    for i in range(kind.shape[0] - 1, -1, -1):
        h: cython.int = kind[i, 1]
        t: cython.int = kind[i, 2]
        F[previous_half_edge(h)], F[previous_half_edge(t)] = F[next_half_edge(t)], F[next_half_edge(h)]


def carry_angles(
    kind: cython.const[cython.longlong][:, ::1],
    numbers: cython.const[cython.double][:, ::1],
    scale: cython.const[cython.double][::1],
    F: cython.longlong[::1],
    outgoing: cython.double[::1],
) -> None:
    """Carry polar angles (3 m,) of half-edges, and the vertices F (3 m,) at corners, over flips of `Moved`, in place.

    `scale` (n,) are the polar angles at a vertex over those in faces.
    """
    for i in range(kind.shape[0]):
        ab: cython.int = kind[i, 1]
        ba: cython.int = kind[i, 2]
        bp: cython.int = next_half_edge(ab)
        pa: cython.int = previous_half_edge(ab)
        aq: cython.int = next_half_edge(ba)
        qb: cython.int = previous_half_edge(ba)
        p: cython.longlong = F[ab]
        q: cython.longlong = F[ba]
        # a in the origin, b on the first axis, p above it and q below: the angles at p and q beside the new edge.
        base: cython.double = numbers[i, 0]
        px: cython.double = foot(base, numbers[i, 1], numbers[i, 2])
        py: cython.double = 2.0 * area(base, numbers[i, 1], numbers[i, 2]) / base
        qx: cython.double = foot(base, numbers[i, 3], numbers[i, 4])
        qy: cython.double = 2.0 * area(base, numbers[i, 3], numbers[i, 4]) / base
        dx: cython.double = px - qx
        dy: cython.double = py + qy
        at_p: cython.double = atan2(px * dy - py * dx, px * dx + py * dy)
        at_q: cython.double = atan2((base - qx) * dy - qy * dx, (base - qx) * dx + qy * dy)
        to_q: cython.double = outgoing[pa] + scale[p] * max(at_p, 0.0)
        to_p: cython.double = outgoing[qb] + scale[q] * max(at_q, 0.0)
        outgoing[ab], outgoing[ba] = outgoing[aq], outgoing[bp]
        outgoing[bp], outgoing[aq] = to_p, to_q
        F[pa], F[qb] = q, p
