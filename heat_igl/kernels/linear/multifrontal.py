"""Multifrontal LDL^T: assemble the front of every block, eliminate the columns, and keep the update for the parent."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.linear.panels import entries, in_panel, numbers
from cython.cimports.heat_igl.kernels.signals import is_interrupted


def factor(
    ends: cython.const[cython.int][::1],
    neighbours: cython.const[cython.int][::1],
    data: cython.const[cython.double][::1],
    free: cython.const[cython.uchar][::1],
    fronts,
    L: cython.double[::1],
    singular: cython.double,
):
    """Factor a matrix of the pattern that `fronts` was made for, into L.

    Vertices that are not free keep an identity row. Returns -1, or the vertex whose pivot is not positive, or has
    shrunk to less than the share `singular` of its diagonal; or after a signal the one that is next.
    """
    e = Elimination(ends, neighbours, data, free, fronts, L, singular)
    failed: cython.Py_ssize_t = -1
    work: cython.double = 0.0
    with cython.nogil:
        for b in range(e.parent.shape[0]):
            rows: cython.double = e.start[b + 1] - e.start[b] + e.first_row[b + 1] - e.first_row[b]
            work += rows * rows
            if work > ASK:
                work = 0.0
                if is_interrupted():
                    failed = e.start[b]
                    break
            failed = _front(e, b)
            if failed >= 0:
                break
    return failed if failed < 0 else int(fronts.order[failed])


@cython.cclass
class Elimination:
    """State of the elimination. `heat_igl.linear.multifrontal.Fronts` describes the arrays of the factor.

    Updates wait on a stack until their parent takes them, each a full square by columns with the lower half in use.
    """

    ends: cython.const[cython.int][::1]
    neighbours: cython.const[cython.int][::1]
    data: cython.const[cython.double][::1]
    free: cython.const[cython.uchar][::1]
    singular: cython.double
    order: cython.const[cython.int][::1]
    place: cython.const[cython.int][::1]
    start: cython.const[cython.longlong][::1]
    parent: cython.const[cython.longlong][::1]
    first_row: cython.const[cython.longlong][::1]
    rows: cython.const[cython.int][::1]
    first_entry: cython.const[cython.longlong][::1]
    L: cython.double[::1]
    diagonal: cython.double[::1]  # of the front at hand, before the elimination
    local: cython.int[::1]  # rows of the front at hand, numbered
    child_rows: cython.int[::1]  # rows of a child in that numbering
    stack: cython.double[::1]
    top: cython.Py_ssize_t  # the end of the stack
    waiting: cython.longlong[::1]  # fronts whose updates are on the stack, in order
    n_waiting: cython.Py_ssize_t
    n_children: cython.int[::1]  # of those, the children of each front

    def __init__(self, ends, neighbours, data, free, fronts, L, singular):
        self.ends, self.neighbours, self.data, self.free = ends, neighbours, data, free
        self.singular = singular
        self.order, self.place, self.start, self.parent = fronts.order, fronts.place, fronts.start, fronts.parent
        self.first_row, self.rows, self.first_entry = fronts.first_row, fronts.rows, fronts.first_entry
        self.L = L
        n, k = len(fronts.order), len(fronts.parent)
        self.diagonal = np.empty(np.diff(fronts.start).max(initial=1))
        self.local = np.empty(n, np.int32)
        self.child_rows = np.empty(np.diff(fronts.first_row).max(initial=1), np.int32)
        # How many entries of updates wait at the same time.
        largest: cython.longlong = 1
        waiting: cython.longlong = 0
        waiting_for: cython.longlong[::1] = np.zeros(k, np.int64)
        for b in range(self.parent.shape[0]):
            left: cython.longlong = self.first_row[b + 1] - self.first_row[b]
            largest = max(largest, waiting + left * left)
            waiting += left * left - waiting_for[b]
            if self.parent[b] >= 0:
                waiting_for[self.parent[b]] += left * left
        self.stack = np.empty(largest)
        self.waiting, self.n_children = np.empty(k, np.int64), np.zeros(k, np.int32)
        self.top = self.n_waiting = 0


@cython.cfunc
@cython.nogil
def _front(e: Elimination, b: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Assemble and eliminate front b; -1, or the place in the order of the pivot that failed."""
    start: cython.Py_ssize_t = e.start[b]
    columns: cython.Py_ssize_t = e.start[b + 1] - start
    row: cython.Py_ssize_t = e.first_row[b]
    left: cython.Py_ssize_t = e.first_row[b + 1] - row
    size: cython.Py_ssize_t = columns + left
    for j in range(columns):
        e.local[start + j] = j
    for i in range(left):
        e.local[e.rows[row + i]] = columns + i
    panel: numbers = cython.address(e.L[e.first_entry[b]])
    # Above the children's updates while these are added.
    update: numbers = cython.address(e.stack[e.top]) if left else panel
    for i in range(in_panel(columns - 1, size, size)):
        panel[i] = 0.0
    for i in range(left * left):
        update[i] = 0.0
    for j in range(columns):
        v: cython.Py_ssize_t = e.order[start + j]
        if not e.free[v]:
            panel[in_panel(j, j, size)] = 1.0
            continue
        for p in range(e.ends[v], e.ends[v + 1]):
            w: cython.Py_ssize_t = e.neighbours[p]
            if e.place[w] >= start + j and e.free[w]:
                panel[in_panel(j, e.local[e.place[w]], size)] += e.data[p]
    for j in range(columns):
        e.diagonal[j] = panel[in_panel(j, j, size)]
    below: cython.Py_ssize_t = e.top
    while e.n_children[b] > 0:
        e.n_children[b] -= 1
        e.n_waiting -= 1
        below = _add_child(e, e.waiting[e.n_waiting], below, columns, left, panel, update)
    if not _eliminate_columns(panel, columns, size):
        return start
    for j in range(columns):
        if panel[in_panel(j, j, size)] < e.singular * e.diagonal[j]:
            return start + j
    _subtract_from_update(update, left, panel, columns)
    if below < e.top:
        for i in range(left * left):
            e.stack[below + i] = update[i]
    e.top = below + left * left
    if e.parent[b] >= 0:
        e.n_children[e.parent[b]] += 1
        e.waiting[e.n_waiting] = b
        e.n_waiting += 1
    return -1


@cython.cfunc
@cython.nogil
def _add_child(
    e: Elimination,
    child: cython.Py_ssize_t,
    end: cython.Py_ssize_t,
    columns: cython.Py_ssize_t,
    left: cython.Py_ssize_t,
    panel: numbers,
    update: numbers,
) -> cython.Py_ssize_t:
    """Add a child's update, which ends at `end` of the stack, to a front; return the start of it."""
    size: cython.Py_ssize_t = columns + left
    row: cython.Py_ssize_t = e.first_row[child]
    m: cython.Py_ssize_t = e.first_row[child + 1] - row
    if m == 0:
        return end
    to: cython.p_int = cython.address(e.child_rows[0])
    for i in range(m):
        to[i] = e.local[e.rows[row + i]]
    column: entries = cython.address(e.stack[end - m * m])
    for j in range(m):
        target: numbers = panel + in_panel(to[j], 0, size)
        if to[j] >= columns:
            target = update + (to[j] - columns) * left - columns
        for i in range(j, m):
            target[to[i]] += column[i]
        column += m
    return end - m * m


@cython.cfunc
@cython.nogil
def _eliminate_columns(panel: numbers, columns: cython.Py_ssize_t, size: cython.Py_ssize_t) -> cython.bint:
    """LDL^T of the columns of a front in place; false if a pivot is not positive.

    Pivots stay on the diagonal. Taking their roots, as in Cholesky's form, would round once more.
    """
    j: cython.Py_ssize_t = 0
    while j < columns:
        column: numbers = panel + in_panel(j, j, size)
        if j + 1 == columns:
            _subtract(column, size - j, panel, size, j, j, 0, j)
            return _divide(column, size - j)
        following: numbers = column + (size - j)
        _subtract(column, 1, panel, size, j, j, 0, j)
        _subtract_two(column + 1, following, size - j - 1, panel, size, j + 1, j, j)
        if not _divide(column, size - j):
            return False
        _subtract(following, size - j - 1, panel, size, j + 1, j + 1, j, j + 1)
        if not _divide(following, size - j - 1):
            return False
        j += 2
        # The largest fronts take seconds.
        if size > 1000 and j % 64 == 0 and is_interrupted():
            return False
    return True


@cython.cfunc
@cython.nogil
def _divide(column: numbers, n: cython.Py_ssize_t) -> cython.bint:
    """Divide a column by the pivot on top of it; false if that is not positive."""
    pivot: cython.double = column[0]
    if not pivot > 0.0:
        return False
    for i in range(1, n):
        column[i] /= pivot
    return True


@cython.cfunc
@cython.nogil
def _subtract_from_update(
    update: numbers, left: cython.Py_ssize_t, panel: entries, columns: cython.Py_ssize_t
) -> cython.void:
    """Subtract the contribution of the eliminated columns of a front from the other rows."""
    size: cython.Py_ssize_t = columns + left
    low: cython.Py_ssize_t = 0
    while low < left:
        high: cython.Py_ssize_t = min(low + ROWS, left)
        for j in range(0, high - 1, 2):
            # The entry above the second column's diagonal is written too, and never read.
            top = max(j, low)
            column: numbers = update + j * left + top
            _subtract_two(column, column + left, high - top, panel, size, columns + top, columns + j, columns)
        if high % 2:
            top = max(high - 1, low)
            column = update + (high - 1) * left + top
            _subtract(column, high - top, panel, size, columns + top, columns + high - 1, 0, columns)
        low = high


@cython.cfunc
@cython.nogil
def _sum_of_eight(a: cython.pointer(entries), f: entries, i: cython.Py_ssize_t) -> cython.double:
    """Row i of eight columns times their factors, in an order that suits vectors."""
    return ((a[0][i] * f[0] + a[1][i] * f[1]) + (a[2][i] * f[2] + a[3][i] * f[3])) + (
        (a[4][i] * f[4] + a[5][i] * f[5]) + (a[6][i] * f[6] + a[7][i] * f[7])
    )


@cython.cfunc
@cython.nogil
def _subtract(
    c: numbers,
    length: cython.Py_ssize_t,
    panel: entries,
    size: cython.Py_ssize_t,
    row: cython.Py_ssize_t,
    factor_row: cython.Py_ssize_t,
    first: cython.Py_ssize_t,
    count: cython.Py_ssize_t,
) -> cython.void:
    """Subtract from c the columns `first` to `count` of a front, from `row` on, as much as eliminates `factor_row`."""
    t: cython.Py_ssize_t = first
    a: entries[8]
    f: cython.double[8]
    while t + 8 <= count:
        for k in range(8):
            f[k] = panel[in_panel(t + k, factor_row, size)] * panel[in_panel(t + k, t + k, size)]
            a[k] = panel + in_panel(t + k, row, size)
        for i in range(length):
            c[i] -= _sum_of_eight(a, f, i)
        t += 8
    while t < count:
        column: entries = panel + in_panel(t, row, size)
        factor_t: cython.double = panel[in_panel(t, factor_row, size)] * panel[in_panel(t, t, size)]
        for i in range(length):
            c[i] -= column[i] * factor_t
        t += 1


@cython.cfunc
@cython.nogil
def _subtract_two(
    c: numbers,
    d: numbers,
    length: cython.Py_ssize_t,
    panel: entries,
    size: cython.Py_ssize_t,
    row: cython.Py_ssize_t,
    factor_row: cython.Py_ssize_t,
    count: cython.Py_ssize_t,
) -> cython.void:
    """As `_subtract`, from c for `factor_row` and from d for the row after it: the columns are read once for both."""
    t: cython.Py_ssize_t = 0
    a: entries[8]
    f: cython.double[8]
    g: cython.double[8]
    while t + 8 <= count:
        for k in range(8):
            pivot: cython.double = panel[in_panel(t + k, t + k, size)]
            f[k] = panel[in_panel(t + k, factor_row, size)] * pivot
            g[k] = panel[in_panel(t + k, factor_row + 1, size)] * pivot
            a[k] = panel + in_panel(t + k, row, size)
        for i in range(length):
            c[i] -= _sum_of_eight(a, f, i)
            d[i] -= _sum_of_eight(a, g, i)
        t += 8
    _subtract(c, length, panel, size, row, factor_row, t, count)
    _subtract(d, length, panel, size, row, factor_row + 1, t, count)
