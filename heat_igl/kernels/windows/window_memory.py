"""Memory of a search by windows: what a front takes at first, and gives back at the end."""

import cython
from cython.cimports.heat_igl.kernels.windows.window_structures import Entry, List, Search, Window
from cython.cimports.libc.stdlib import free, malloc


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def allocate(s: cython.pointer(Search)) -> cython.void:
    """Room for a front."""
    s.n_lists = s.n_made_lists = s.n_heap = s.n_touched = s.n_found = 0
    s.n_all_lists, s.n_all_heap, s.n_out = 256, 1024, 256
    s.free_list = -1
    s.failed = s.meets_flat = s.is_shared = False
    s.n_windows = s.n_lists_done = s.n_waiting = 0
    s.n_nearest = s.n_all_ranked = 0
    s.ranked = cython.NULL
    s.lists = cython.cast(cython.pointer(List), malloc(s.n_all_lists * cython.sizeof(List)))
    s.heap = cython.cast(cython.pointer(Entry), malloc(s.n_all_heap * cython.sizeof(Entry)))
    s.to_left = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    s.to_right = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    if s.lists == cython.NULL or s.heap == cython.NULL or s.to_left == cython.NULL or s.to_right == cython.NULL:
        s.failed = True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def more_room(s: cython.pointer(Search), n: cython.int) -> cython.void:
    """Room for n windows on each side of an apex."""
    s.n_out = 2 * n
    free(s.to_left)
    free(s.to_right)
    s.to_left = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    s.to_right = cython.cast(cython.pointer(Window), malloc(s.n_out * cython.sizeof(Window)))
    if s.to_left == cython.NULL or s.to_right == cython.NULL:
        s.failed = True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def empty_front(s: cython.pointer(Search)) -> cython.void:
    """Drop all that waits; lists and queue keep their room."""
    i: cython.int
    for i in range(s.n_lists):
        if s.lists[i].half_edge >= 0:
            s.slot[s.lists[i].half_edge] = -1
    s.n_lists = s.n_heap = 0
    s.n_waiting = 0
    s.free_list = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def free_front(s: cython.pointer(Search)) -> cython.void:
    """Return the memory of a front."""
    i: cython.int
    for i in range(s.n_made_lists):
        free(s.lists[i].windows)
    free(s.lists)
    free(s.heap)
    free(s.to_left)
    free(s.to_right)
    free(s.ranked)
