"""Relaxation: Gauss-Seidel on a band of unknowns that moves outward from the right-hand side."""

import cython
import numpy as np


def relax(
    indptr: cython.const[cython.int][::1],
    indices: cython.const[cython.int][::1],
    data: cython.const[cython.double][::1],
    b: cython.const[cython.double][::1],
    tolerance: cython.double,
    most_sweeps: cython.Py_ssize_t,
):
    """Solve A x = b >= 0 by Gauss-Seidel in breadth-first order from the entries b > 0, with x zero at first.

    A sweep goes over a band of levels, outward. The outer end moves on by one level per sweep; the inner end follows,
    one level behind the first unknown that changed by more than `tolerance` of itself. The result is accepted by a
    sweep over all unknowns that changes none. Returns x (n,) and the number of sweeps, -1 if they did not suffice.
    """
    n: cython.Py_ssize_t = b.shape[0]
    order: cython.int[::1] = np.empty(n, np.int32)
    place: cython.int[::1] = np.full(n, -1, np.int32)
    start: cython.int[::1] = np.empty(n + 2, np.int32)
    solution = np.zeros(n)
    x: cython.double[::1] = solution
    p: cython.Py_ssize_t
    n_levels: cython.Py_ssize_t
    n_sweeps: cython.Py_ssize_t
    with cython.nogil:
        n_levels = _breadth_first(indptr, indices, b, order, start, place)
    if n_levels == 0:
        return solution, 0
    size: cython.Py_ssize_t = start[n_levels]
    rows = Rows(size, indices.shape[0])
    y: cython.double[::1] = np.zeros(size)
    with cython.nogil:
        _arrange(rows, indptr, indices, data, b, order, place)
        n_sweeps = _relax(rows, start, n_levels, tolerance, most_sweeps, y)
        for p in range(size):
            x[order[p]] = y[p]
    return solution, n_sweeps


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _breadth_first(
    indptr: cython.const[cython.int][::1],
    indices: cython.const[cython.int][::1],
    b: cython.const[cython.double][::1],
    order: cython.int[::1],
    start: cython.int[::1],
    place: cython.int[::1],
) -> cython.Py_ssize_t:
    """Order the unknowns that b reaches outward from the entries of b; return the number of levels, none for b = 0.

    Level i is ``order[start[i]:start[i + 1]]``; `place`, -1 at first, is the inverse of `order`.
    """
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    p: cython.Py_ssize_t
    end: cython.int = 0
    for i in range(b.shape[0]):
        if b[i] > 0.0:
            order[end], place[i] = i, end
            end += 1
    n_levels: cython.Py_ssize_t = 0
    start[0], start[1] = 0, end
    while start[n_levels + 1] > start[n_levels]:
        for p in range(start[n_levels], start[n_levels + 1]):
            i = order[p]
            for k in range(indptr[i], indptr[i + 1]):
                j: cython.int = indices[k]
                if place[j] < 0:
                    order[end], place[j] = j, end
                    end += 1
        n_levels += 1
        start[n_levels + 1] = end
    return n_levels


@cython.cclass
class Rows:
    """Jacobi's form y = C y + c of A x = b, rows in the order of visits, so that a sweep reads memory forward."""

    end: cython.longlong[::1]
    column: cython.int[::1]
    C: cython.double[::1]
    c: cython.double[::1]

    def __init__(self, n, n_entries):
        self.end, self.c = np.zeros(n + 1, np.int64), np.empty(n)
        self.column, self.C = np.empty(n_entries, np.int32), np.empty(n_entries)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _arrange(
    rows: Rows,
    indptr: cython.const[cython.int][::1],
    indices: cython.const[cython.int][::1],
    data: cython.const[cython.double][::1],
    b: cython.const[cython.double][::1],
    order: cython.int[::1],
    place: cython.int[::1],
) -> cython.void:
    p: cython.Py_ssize_t
    k: cython.Py_ssize_t
    end: cython.Py_ssize_t = 0
    for p in range(rows.c.shape[0]):
        i: cython.Py_ssize_t = order[p]
        diagonal: cython.double = 1.0
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] == i:
                diagonal = data[k]
        for k in range(indptr[i], indptr[i + 1]):
            if indices[k] != i:
                rows.column[end] = place[indices[k]]
                rows.C[end] = -data[k] / diagonal
                end += 1
        rows.end[p + 1] = end
        rows.c[p] = b[i] / diagonal


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def _relax(
    rows: Rows,
    start: cython.int[::1],
    n_levels: cython.Py_ssize_t,
    tolerance: cython.double,
    most_sweeps: cython.Py_ssize_t,
    y: cython.double[::1],
) -> cython.Py_ssize_t:
    """Sweep until nothing changes; return the number of sweeps, or -1."""
    p: cython.Py_ssize_t
    k: cython.Py_ssize_t
    sweep: cython.Py_ssize_t
    level: cython.Py_ssize_t = 0
    reached: cython.Py_ssize_t = 1
    for sweep in range(most_sweeps):
        inner: cython.Py_ssize_t = start[max(level - 1, 0)]
        outer: cython.Py_ssize_t = start[reached]
        first: cython.Py_ssize_t = outer
        for p in range(inner, outer):
            new: cython.double = rows.c[p]
            for k in range(rows.end[p], rows.end[p + 1]):
                new += rows.C[k] * y[rows.column[k]]
            if first == outer and abs(new - y[p]) > tolerance * abs(new):
                first = p
            y[p] = new
        if reached < n_levels:
            reached += 1
        elif first == outer:
            if inner == 0:
                return sweep + 1
            level = 0
            continue
        while level < n_levels - 1 and start[level + 1] <= first:
            level += 1
    return -1
