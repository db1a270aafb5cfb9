"""Solves with a multifrontal factor, piece by piece of the tree: forward from the leaves, and back from the roots."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.linear.panels import entries, in_panel, numbers
from cython.cimports.heat_igl.kernels.prefetch import prefetch

width = WIDTH


@cython.cclass
class TriangularSolves:
    """A factor and the index arrays of it, which `heat_igl.linear.multifrontal.Fronts` describes.

    `L` (entries,) is the factor that belongs to the `fronts`.
    """

    L: cython.double[::1]
    start: cython.longlong[::1]
    first_row: cython.longlong[::1]
    rows: cython.int[::1]
    first_entry: cython.longlong[::1]
    pieces: cython.longlong[::1]
    piece_end: cython.longlong[::1]
    own_rows: cython.longlong[::1]
    above: cython.int[::1]
    most_rows: cython.Py_ssize_t

    def __init__(self, fronts, L):
        self.L = L
        self.start, self.first_row, self.rows = (fronts.start, fronts.first_row, fronts.rows)
        self.first_entry = fronts.first_entry
        self.pieces, self.piece_end = fronts.pieces, fronts.piece_end
        self.own_rows, self.above = fronts.own_rows, fronts.above
        self.most_rows = int(np.diff(fronts.first_row).max(initial=1))

    def forward_one(
        self, x: cython.double[::1], first: cython.Py_ssize_t, until: cython.Py_ssize_t, sums: cython.double[:, ::1]
    ):
        """Eliminate the columns of the pieces `first` to `until` from x (n,).

        ``sums[piece]`` takes the amount that a piece subtracts from the rows above all pieces.
        """
        room: cython.double[::1] = np.empty(self.most_rows)
        below: numbers = cython.address(room[0])
        with cython.nogil:
            for piece in range(first, until):
                for p in range(self.piece_end[piece], self.piece_end[piece + 1]):
                    b: cython.Py_ssize_t = self.pieces[p]
                    start: cython.Py_ssize_t = self.start[b]
                    columns: cython.Py_ssize_t = self.start[b + 1] - start
                    row: cython.Py_ssize_t = self.first_row[b]
                    left: cython.Py_ssize_t = self.first_row[b + 1] - row
                    own: numbers = cython.address(x[start])
                    # Of a source's heat, most fronts have none on the way forward.
                    if _all_zero(own, columns):
                        continue
                    column: entries = cython.address(self.L[self.first_entry[b]])  # from the diagonal on
                    ahead: cython.p_char = cython.cast(cython.p_char, column) - AHEAD
                    for i in range(left):
                        below[i] = 0.0
                    for j in range(columns):
                        y: cython.double = own[j]
                        for i in range(0, 8 * (columns - j + left), 64):
                            prefetch(ahead - i)
                        ahead -= 8 * (columns - j + left)
                        for i in range(1, columns - j):
                            own[j + i] -= column[i] * y
                        column += columns - j
                        for i in range(left):
                            below[i] += column[i] * y
                        column += left
                    for i in range(self.own_rows[b]):
                        x[self.rows[row + i]] -= below[i]
                    for i in range(self.own_rows[b], left):
                        sums[piece, self.above[self.rows[row + i]]] += below[i]

    def back_one(self, x: cython.double[::1], first: cython.Py_ssize_t, until: cython.Py_ssize_t):
        """Solve for the columns of some pieces in x (n,), given those above."""
        room: cython.double[::1] = np.empty(self.most_rows)
        below: numbers = cython.address(room[0])
        with cython.nogil:
            for p in range(self.piece_end[until] - 1, self.piece_end[first] - 1, -1):
                b: cython.Py_ssize_t = self.pieces[p]
                start: cython.Py_ssize_t = self.start[b]
                columns: cython.Py_ssize_t = self.start[b + 1] - start
                row: cython.Py_ssize_t = self.first_row[b]
                left: cython.Py_ssize_t = self.first_row[b + 1] - row
                own: numbers = cython.address(x[start])
                column: entries = cython.address(self.L[self.first_entry[b]])
                for i in range(left):
                    below[i] = x[self.rows[row + i]]
                for j in range(columns):
                    pivot: cython.double = column[0]
                    column += columns - j
                    total = 0.0
                    for i in range(left):
                        total += column[i] * below[i]
                    own[j] = own[j] / pivot - total
                    column += left
                for j in range(columns - 1, -1, -1):
                    column -= columns - j + left
                    total = 0.0
                    for i in range(1, columns - j):
                        total += column[i] * own[j + i]
                    own[j] -= total

    def forward_block(
        self,
        x: cython.double[:, ::1],
        first: cython.Py_ssize_t,
        until: cython.Py_ssize_t,
        sums: cython.double[:, :, ::1],
    ):
        """As `forward_one`, for x (n, WIDTH)."""
        c: cython.Py_ssize_t
        room: cython.double[:, ::1] = np.empty((self.most_rows, WIDTH))
        below: numbers = cython.address(room[0, 0])
        with cython.nogil:
            for piece in range(first, until):
                for p in range(self.piece_end[piece], self.piece_end[piece + 1]):
                    b: cython.Py_ssize_t = self.pieces[p]
                    start: cython.Py_ssize_t = self.start[b]
                    columns: cython.Py_ssize_t = self.start[b + 1] - start
                    row: cython.Py_ssize_t = self.first_row[b]
                    left: cython.Py_ssize_t = self.first_row[b + 1] - row
                    size: cython.Py_ssize_t = columns + left
                    own: numbers = cython.address(x[start, 0])
                    if _all_zero(own, columns * WIDTH):
                        continue
                    panel: entries = cython.address(self.L[self.first_entry[b]])
                    for j in range(columns):
                        for i in range(j + 1, columns):
                            _subtract_row(own + i * WIDTH, panel[in_panel(j, i, size)], own + j * WIDTH)
                    for i in range(left * WIDTH):
                        below[i] = 0.0
                    _add_below(panel, columns, left, own, below)
                    for i in range(self.own_rows[b]):
                        for c in range(WIDTH):
                            x[self.rows[row + i], c] -= below[i * WIDTH + c]
                    for i in range(self.own_rows[b], left):
                        for c in range(WIDTH):
                            sums[piece, self.above[self.rows[row + i]], c] += below[i * WIDTH + c]

    def back_block(self, x: cython.double[:, ::1], first: cython.Py_ssize_t, until: cython.Py_ssize_t):
        """As `back_one`, for x (n, WIDTH)."""
        c: cython.Py_ssize_t
        room: cython.double[:, ::1] = np.empty((self.most_rows, WIDTH))
        below: numbers = cython.address(room[0, 0])
        with cython.nogil:
            for p in range(self.piece_end[until] - 1, self.piece_end[first] - 1, -1):
                b: cython.Py_ssize_t = self.pieces[p]
                start: cython.Py_ssize_t = self.start[b]
                columns: cython.Py_ssize_t = self.start[b + 1] - start
                row: cython.Py_ssize_t = self.first_row[b]
                left: cython.Py_ssize_t = self.first_row[b + 1] - row
                size: cython.Py_ssize_t = columns + left
                own: numbers = cython.address(x[start, 0])
                panel: entries = cython.address(self.L[self.first_entry[b]])
                for i in range(left):
                    for c in range(WIDTH):
                        below[i * WIDTH + c] = x[self.rows[row + i], c]
                for j in range(columns):
                    pivot: cython.double = panel[in_panel(j, j, size)]
                    for c in range(WIDTH):
                        own[j * WIDTH + c] /= pivot
                    _subtract_below(panel + in_panel(j, columns, size), left, below, own + j * WIDTH)
                for j in range(columns - 1, -1, -1):
                    for i in range(j + 1, columns):
                        _subtract_row(own + j * WIDTH, panel[in_panel(j, i, size)], own + i * WIDTH)


@cython.cfunc
@cython.nogil
def _all_zero(x: entries, n: cython.Py_ssize_t) -> cython.bint:
    for i in range(n):
        if x[i] != 0.0:
            return False
    return True


@cython.cfunc
@cython.nogil
def _subtract_row(target: numbers, entry: cython.double, row: entries) -> cython.void:
    """Subtract a row, times an entry of the factor, from another."""
    c: cython.Py_ssize_t
    for c in range(WIDTH):
        target[c] -= entry * row[c]


@cython.cfunc
@cython.nogil
def _add_below(
    panel: entries, columns: cython.Py_ssize_t, left: cython.Py_ssize_t, own: entries, below: numbers
) -> cython.void:
    """Add the rows below the columns of a front, times `own`, to `below`; four columns per turn."""
    size: cython.Py_ssize_t = columns + left
    c: cython.Py_ssize_t
    j: cython.Py_ssize_t = 0
    while j + 4 <= columns:
        c0: entries = panel + in_panel(j, columns, size)
        c1: entries = panel + in_panel(j + 1, columns, size)
        c2: entries = panel + in_panel(j + 2, columns, size)
        c3: entries = panel + in_panel(j + 3, columns, size)
        x: entries = own + j * WIDTH
        for i in range(left):
            for c in range(WIDTH):
                below[i * WIDTH + c] += (c0[i] * x[c] + c1[i] * x[WIDTH + c]) + (
                    c2[i] * x[2 * WIDTH + c] + c3[i] * x[3 * WIDTH + c]
                )
        j += 4
    while j < columns:
        column: entries = panel + in_panel(j, columns, size)
        for i in range(left):
            for c in range(WIDTH):
                below[i * WIDTH + c] += column[i] * own[j * WIDTH + c]
        j += 1


@cython.cfunc
@cython.nogil
def _subtract_below(column: entries, left: cython.Py_ssize_t, below: entries, own: numbers) -> cython.void:
    """Subtract the rows below one column of a front, times `below`, from `own`; four rows per turn."""
    c: cython.Py_ssize_t
    i: cython.Py_ssize_t = 0
    while i + 4 <= left:
        b: entries = below + i * WIDTH
        for c in range(WIDTH):
            own[c] -= (column[i] * b[c] + column[i + 1] * b[WIDTH + c]) + (
                column[i + 2] * b[2 * WIDTH + c] + column[i + 3] * b[3 * WIDTH + c]
            )
        i += 4
    while i < left:
        for c in range(WIDTH):
            own[c] -= column[i] * below[i * WIDTH + c]
        i += 1
