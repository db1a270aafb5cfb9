"""The queue of a search by windows: a binary heap of half-edges, vertices, points and segments by their keys."""

import cython
from cython.cimports.heat_igl.kernels.windows.window_structures import Entry, Search
from cython.cimports.libc.stdlib import realloc


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def push(s: cython.pointer(Search), key: cython.double, what: cython.int) -> cython.void:
    """Add to the queue, a binary heap."""
    i: cython.int
    above: cython.int
    if s.n_heap == s.n_all_heap:
        more: cython.pointer(Entry) = cython.cast(
            cython.pointer(Entry), realloc(s.heap, 2 * s.n_all_heap * cython.sizeof(Entry))
        )
        if more == cython.NULL:
            s.failed = True
            return
        s.heap = more
        s.n_all_heap *= 2
    i = s.n_heap
    s.n_heap += 1
    while i > 0:
        above = (i - 1) // 2
        if s.heap[above].key <= key:
            break
        s.heap[i] = s.heap[above]
        i = above
    s.heap[i].key = key
    s.heap[i].what = what


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def pop(s: cython.pointer(Search)) -> Entry:
    """Take the entry with the smallest key."""
    heap: cython.pointer(Entry) = s.heap
    top: Entry = heap[0]
    last: Entry
    i: cython.int = 0
    above: cython.int
    below: cython.int = 1
    s.n_heap -= 1
    last = heap[s.n_heap]
    # From below: the gap goes down to a leaf, without a branch that depends on keys, and the last entry seldom rises.
    while below + 1 < s.n_heap:
        below += heap[below + 1].key < heap[below].key
        heap[i] = heap[below]
        i = below
        below = 2 * i + 1
    if below < s.n_heap:
        heap[i] = heap[below]
        i = below
    while i > 0:
        above = (i - 1) // 2
        if heap[above].key <= last.key:
            break
        heap[i] = heap[above]
        i = above
    heap[i] = last
    return top
