"""Graphs as scipy stores symmetric matrices: the neighbours of v are ``neighbours[ends[v]:ends[v + 1]]``."""

import cython
import numpy as np


def breadth_first(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    skip: cython.const[cython.uchar][::1],
):
    """All vertices but those to skip, int32, in breadth-first order: neighbours are near in memory."""
    n: cython.Py_ssize_t = skip.shape[0]
    order = np.empty(n, np.int32)
    queue: cython.int[::1] = order
    seen: cython.uchar[::1] = np.array(skip)
    head: cython.Py_ssize_t = 0
    tail: cython.Py_ssize_t = 0
    with cython.nogil:
        for root in range(n):
            if not seen[root]:
                seen[root] = True
                queue[tail] = root
                tail += 1
            while head < tail:
                v: cython.Py_ssize_t = queue[head]
                head += 1
                for p in range(ends[v], ends[v + 1]):
                    w: cython.int = neighbours[p]
                    if not seen[w]:
                        seen[w] = True
                        queue[tail] = w
                        tail += 1
    return order[:tail]


def subgraph(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    some: cython.const[cython.int][::1],
):
    """The graph among some vertices, numbered as they come: `ends` and `neighbours`, int32."""
    n: cython.Py_ssize_t = some.shape[0]
    number: cython.int[::1] = np.full(ends.shape[0] - 1, -1, np.int32)
    v: cython.Py_ssize_t
    most: cython.Py_ssize_t = 0
    count: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(n):
            v = some[i]
            number[v] = i
            most += ends[v + 1] - ends[v]
    new_ends, new_neighbours = np.zeros(n + 1, np.int32), np.empty(most, np.int32)
    into_ends: cython.int[::1] = new_ends
    into: cython.int[::1] = new_neighbours
    with cython.nogil:
        for i in range(n):
            v = some[i]
            for p in range(ends[v], ends[v + 1]):
                if number[neighbours[p]] >= 0:
                    into[count] = number[neighbours[p]]
                    count += 1
            into_ends[i + 1] = count
    return new_ends, new_neighbours[:count]
