"""Groups of triangles or points, joined two at a time in the relative orientation that their pairs want."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs


def turned_groups(
    pairs: cython.const[cython.int][:, ::1],
    weights: cython.const[cython.double][::1],
    sizes: cython.const[cython.longlong][::1],
):
    """Which (n,) of n groups to turn, for pairs with weights that are negative if just one of both groups should be.

    The weights (k,) of all pairs (k, 2) int32 between two groups add up. In a round each group is joined to the one to
    which its join is strongest for the sizes (n,) of both, if that one is larger, or of the same size and a lower
    number, until nothing is joined.
    """
    n: cython.Py_ssize_t = sizes.shape[0]
    k: cython.Py_ssize_t = pairs.shape[0]
    turned = np.zeros(n, np.bool_)
    turns: cython.uchar[::1] = turned.view(np.uint8)
    # The group to which each was joined, itself at first, and whether one of the two is turned in `turns`.
    root: cython.int[::1] = np.arange(n, dtype=np.int32)
    ends: cython.int[:, ::1] = np.array(pairs)
    weight: cython.double[::1] = np.array(weights)
    size: cython.longlong[::1] = np.array(sizes)
    # Linked lists of the ends 2 e + d of the pairs of each group.
    head: cython.int[::1] = np.empty(n, np.int32)
    link: cython.int[::1] = np.empty(2 * k, np.int32)
    total: cython.double[::1] = np.zeros(n)
    is_joined: cython.bint = True
    is_turned: cython.bint = False
    with cython.nogil:
        while is_joined:
            kept: cython.Py_ssize_t = 0
            head[:] = -1
            for e in range(k):
                a: cython.int = ends[e, 0]
                b: cython.int = ends[e, 1]
                if root[a] != root[b]:
                    weight[kept] = -weight[e] if turns[a] != turns[b] else weight[e]
                    ends[kept, 0], ends[kept, 1] = root[a], root[b]
                    for d in range(2):
                        link[2 * kept + d], head[ends[kept, d]] = head[ends[kept, d]], 2 * kept + d
                    kept += 1
            k, is_joined = kept, False
            for g in range(n):
                at: cython.int = head[g]
                while at >= 0:
                    total[ends[at // 2, 1 - at % 2]] += weight[at // 2]
                    at = link[at]
                strongest: cython.double = 0.0
                to: cython.Py_ssize_t = g
                at = head[g]
                while at >= 0:
                    other: cython.Py_ssize_t = ends[at // 2, 1 - at % 2]
                    # Of equal joins an arbitrary one: with the lowest, groups would be joined one after the other.
                    share: cython.double = (1.0 + 1e-6 * ((g + other) * 7919 % 1009)) / (size[g] + size[other])
                    if share * fabs(total[other]) > strongest:
                        strongest, to, is_turned = share * fabs(total[other]), other, total[other] < 0.0
                    total[other] = 0.0
                    at = link[at]
                if size[to] > size[g] or (size[to] == size[g] and to < g):
                    root[g], turns[g], is_joined = to, is_turned, True
            for g in range(n):
                while root[root[g]] != root[g]:
                    turns[g], root[g] = turns[g] ^ turns[root[g]], root[root[g]]
                if root[g] != g:
                    size[root[g]], size[g] = size[root[g]] + size[g], 0
    return turned
