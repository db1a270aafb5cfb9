"""The sparse Laplacian from a weight on each side of each triangle, assembled by counting."""

import cython
import numpy as np


def laplacian(F: cython.const[cython.int][:, ::1], weight: cython.const[cython.double][::1], n: cython.Py_ssize_t):
    """L of triangles F (m, 3): sums of weights off the diagonal, on it minus the sum of the row.

    The weights (3 m,) are those of the side opposite each corner. A vertex of n that no triangle uses has an empty row.
    Returns pointers (n + 1,) and row indices, ascending, both int32, and the entries, of which zeros are stored. Those
    of the diagonal are summed in the order of libigl's `cotmatrix`, for the same bits.
    """
    size: cython.Py_ssize_t = 6 * F.shape[0]
    by_row: cython.uint[::1] = np.empty(size, np.uint32)
    by_column: cython.uint[::1] = np.empty(size, np.uint32)
    begin: cython.longlong[::1] = np.zeros(n + 1, np.int64)
    diagonal: cython.double[::1] = np.zeros(n)
    pointers, rows, values = np.zeros(n + 1, np.int32), np.empty(size + n, np.int32), np.empty(size + n)
    indptr: cython.int[::1] = pointers
    indices: cython.int[::1] = rows
    data: cython.double[::1] = values
    count: cython.int = 0
    with cython.nogil:
        for e in range(size):
            by_column[e] = e
            j = _column(F, e)
            diagonal[j] += weight[e >> 1]
            begin[j + 1] += 1
        for j in range(n):
            begin[j + 1] += begin[j]
        # By row, which is the column of the other entry of the side; then, rows remaining in order, by column.
        _distribute(F, by_column, by_row, begin, 1)
        _distribute(F, by_row, by_column, begin, 0)
        for j in range(n):
            last: cython.int = -1
            for i in range(begin[j], begin[j + 1]):
                row: cython.int = _column(F, by_column[i] ^ 1)
                if last < j <= row:
                    indices[count], data[count] = j, -diagonal[j]
                    last = j
                    count += 1
                if row != last:
                    indices[count], data[count] = row, 0.0
                    last = row
                    count += 1
                data[count - 1] += weight[by_column[i] >> 1]
            if -1 < last < j:
                indices[count], data[count] = j, -diagonal[j]
                count += 1
            indptr[j + 1] = count
    return pointers, rows[:count].copy(), values[:count].copy()


@cython.cfunc
@cython.nogil
def _column(F: cython.const[cython.int][:, ::1], entry: cython.Py_ssize_t) -> cython.int:
    """The column of an entry: entry 2 h of side h is in that of its tail, 2 h + 1 in that of its head."""
    side: cython.Py_ssize_t = entry >> 1
    f: cython.Py_ssize_t = side // 3
    c: cython.Py_ssize_t = side - 3 * f + 1 + (entry & 1)
    return F[f, c - 3 if c > 2 else c]


@cython.cfunc
@cython.nogil
def _distribute(
    F: cython.const[cython.int][:, ::1],
    entries: cython.uint[::1],
    sorted_entries: cython.uint[::1],
    begin: cython.longlong[::1],
    other: cython.uint,
) -> cython.void:
    """Sort entries by column, or by the column of the other one of the side; `begin` is the same before and after."""
    for i in range(entries.shape[0]):
        j: cython.Py_ssize_t = _column(F, entries[i] ^ other)
        sorted_entries[begin[j]] = entries[i]
        begin[j] += 1
    for i in range(begin.shape[0] - 1, 0, -1):
        begin[i] = begin[i - 1]
    begin[0] = 0
