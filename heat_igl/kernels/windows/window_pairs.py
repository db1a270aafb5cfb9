"""One exact search that two fronts share, each on a thread of its own; the algorithm is in `window_sharing`."""

import cython
from cython.cimports.cpython.pythread import (
    WAIT_LOCK,
    PyThread_acquire_lock,
    PyThread_allocate_lock,
    PyThread_free_lock,
)
from cython.cimports.heat_igl.kernels.windows.window_structures import Search
from cython.cimports.heat_igl.kernels.windows.windows import Front
from cython.cimports.libc.stdlib import free

__all__ = ["pair", "part"]


def pair(
    first: Front,
    second: Front,
    upper: cython.double[::1],
    other_upper: cython.double[::1],
    round_length: cython.double,
    plenty: cython.longlong,
) -> None:
    """Prepare two fronts to share a search: `search` is called on both, on one with all sources, on the other with
    none.

    Parameters
    ----------
    first, second : Front
        The two fronts. Each has result arrays of its own; they share `kind` only. The distance of a vertex is the
        smaller of the two that they find.
    upper, other_upper : (n,)
        Upper bounds on distances; infinity at first.
    round_length : float
        How far the search goes before the threads exchange distances.
    plenty : int
        With about this many windows on the front there is work for two threads. With less than a third, one goes on
        alone.
    """
    _join(first, upper, second)
    _join(second, other_upper, first)
    first.state.round_length = second.state.round_length = round_length
    first.state.plenty = second.state.plenty = plenty
    first.state.few = second.state.few = plenty // 3
    first.state.is_first, second.state.is_first = True, False


@cython.cfunc
def _join(one: Front, upper: cython.double[::1], other: Front) -> None:
    s: cython.pointer(Search) = cython.address(one.state)
    i: cython.int
    one.arrays += (upper.base,)
    s.other = cython.address(other.state)
    s.upper = cython.address(upper[0])
    s.parity = 0
    for i in range(2):
        s.news[i] = cython.NULL
        s.n_news[i] = s.n_all_news[i] = 0
    for i in range(4):
        s.arrived[i] = PyThread_allocate_lock()
        if s.arrived[i] == cython.NULL:
            raise MemoryError("there is no room for a lock")
        PyThread_acquire_lock(s.arrived[i], WAIT_LOCK)


def part(first: Front, second: Front) -> bool:
    """Free what `pair` allocated; false if one thread must search again to get the bits of a search on one thread."""
    one: Front
    s: cython.pointer(Search)
    i: cython.int
    for one in (first, second):
        s = cython.address(one.state)
        s.other = cython.NULL
        for i in range(2):
            free(s.news[i])
        for i in range(4):
            PyThread_free_lock(s.arrived[i])
    return not (first.state.is_shared and (first.state.meets_flat or second.state.meets_flat))
