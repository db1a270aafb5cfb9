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

    def forward(
        self,
        x: cython.double[:, ::1],
        first: cython.Py_ssize_t,
        until: cython.Py_ssize_t,
        sums: cython.double[:, :, ::1],
    ):
        """Eliminate the columns of the pieces `first` to `until` from x, (n, 1) or (n, WIDTH).

        ``sums[piece]`` takes the amount that a piece subtracts from the rows above all pieces.
        """
        room: cython.double[::1] = np.empty(self.most_rows * x.shape[1])
        below: numbers = cython.address(room[0])
        with cython.nogil:
            for piece in range(first, until):
                # With the width as a number, loops over the columns of a block become vectors, or vanish.
                if x.shape[1] == 1:
                    _forward(self, 1, piece, cython.address(x[0, 0]), below, sums)
                else:
                    _forward(self, WIDTH, piece, cython.address(x[0, 0]), below, sums)

    def back(self, x: cython.double[:, ::1], first: cython.Py_ssize_t, until: cython.Py_ssize_t):
        """Solve for the columns of some pieces in x, (n, 1) or (n, WIDTH), given those above."""
        room: cython.double[::1] = np.empty(self.most_rows * x.shape[1])
        below: numbers = cython.address(room[0])
        with cython.nogil:
            if x.shape[1] == 1:
                _back(self, 1, first, until, cython.address(x[0, 0]), below)
            else:
                _back(self, WIDTH, first, until, cython.address(x[0, 0]), below)


@cython.cfunc
@cython.inline
@cython.nogil
def _forward(
    s: TriangularSolves,
    width: cython.Py_ssize_t,
    piece: cython.Py_ssize_t,
    x: numbers,
    below: numbers,
    sums: cython.double[:, :, ::1],
) -> cython.void:
    """`TriangularSolves.forward` for one piece."""
    c: cython.Py_ssize_t
    for p in range(s.piece_end[piece], s.piece_end[piece + 1]):
        b: cython.Py_ssize_t = s.pieces[p]
        columns: cython.Py_ssize_t = s.start[b + 1] - s.start[b]
        row: cython.Py_ssize_t = s.first_row[b]
        left: cython.Py_ssize_t = s.first_row[b + 1] - row
        own: numbers = x + s.start[b] * width
        # Of a source's heat, most fronts have none on the way forward.
        if _all_zero(own, columns * width):
            continue
        panel: entries = cython.address(s.L[s.first_entry[b]])
        for i in range(left * width):
            below[i] = 0.0
        _eliminate(panel, columns, left, own, below, width)
        for i in range(s.own_rows[b]):
            for c in range(width):
                x[s.rows[row + i] * width + c] += below[i * width + c]
        for i in range(s.own_rows[b], left):
            for c in range(width):
                sums[piece, s.above[s.rows[row + i]], c] -= below[i * width + c]


@cython.cfunc
@cython.inline
@cython.nogil
def _back(
    s: TriangularSolves,
    width: cython.Py_ssize_t,
    first: cython.Py_ssize_t,
    until: cython.Py_ssize_t,
    x: numbers,
    below: numbers,
) -> cython.void:
    """`TriangularSolves.back`."""
    c: cython.Py_ssize_t
    for p in range(s.piece_end[until] - 1, s.piece_end[first] - 1, -1):
        b: cython.Py_ssize_t = s.pieces[p]
        columns: cython.Py_ssize_t = s.start[b + 1] - s.start[b]
        row: cython.Py_ssize_t = s.first_row[b]
        left: cython.Py_ssize_t = s.first_row[b + 1] - row
        size: cython.Py_ssize_t = columns + left
        own: numbers = x + s.start[b] * width
        panel: entries = cython.address(s.L[s.first_entry[b]])
        for i in range(left):
            for c in range(width):
                below[i * width + c] = x[s.rows[row + i] * width + c]
        for j in range(columns):
            pivot: cython.double = panel[in_panel(j, j, size)]
            for c in range(width):
                own[j * width + c] /= pivot
            _subtract_rows(panel + in_panel(j, columns, size), left, below, own + j * width, width)
        for j in range(columns - 1, -1, -1):
            behind: cython.Py_ssize_t = columns - j - 1
            _subtract_rows(panel + in_panel(j, j + 1, size), behind, own + (j + 1) * width, own + j * width, width)


@cython.cfunc
@cython.nogil
def _all_zero(x: entries, n: cython.Py_ssize_t) -> cython.bint:
    for i in range(n):
        if x[i] != 0.0:
            return False
    return True


@cython.cfunc
@cython.inline
@cython.nogil
def _subtract_from_rows(
    rows: numbers, n: cython.Py_ssize_t, column: entries, own: entries, width: cython.Py_ssize_t
) -> cython.void:
    """Subtract `own`, times the entries of a column, from the n rows of the column."""
    c: cython.Py_ssize_t
    for i in range(n):
        for c in range(width):
            rows[i * width + c] -= column[i] * own[c]


@cython.cfunc
@cython.inline
@cython.nogil
def _eliminate(
    panel: entries,
    columns: cython.Py_ssize_t,
    left: cython.Py_ssize_t,
    own: numbers,
    below: numbers,
    width: cython.Py_ssize_t,
) -> cython.void:
    """Eliminate the columns of a front from `own`, and add the rows below them to `below`; four columns per turn."""
    c: cython.Py_ssize_t
    j: cython.Py_ssize_t = 0
    column: entries = panel  # from the diagonal on
    ahead: cython.p_char = cython.cast(cython.p_char, panel) - AHEAD
    while j < columns:
        together: cython.Py_ssize_t = 4 if j + 4 <= columns else 1
        c0: entries = column + (columns - j)
        x: entries = own + j * width
        for _ in range(together):
            j += 1
            rest: cython.Py_ssize_t = columns + left - j
            for i in range(0, 8 * rest, 64):
                prefetch(ahead - i)
            ahead -= 8 * (rest + 1)
            _subtract_from_rows(own + j * width, columns - j, column + 1, own + (j - 1) * width, width)
            column += rest + 1
        if together == 1:
            _subtract_from_rows(below, left, c0, x, width)
            continue
        c3: entries = column - left
        c2: entries = c3 - (rest + 1)
        c1: entries = c2 - (rest + 2)
        for i in range(left):
            for c in range(width):
                below[i * width + c] -= (c0[i] * x[c] + c1[i] * x[width + c]) + (
                    c2[i] * x[2 * width + c] + c3[i] * x[3 * width + c]
                )


@cython.cfunc
@cython.inline
@cython.nogil
def _subtract_rows(
    column: entries, n: cython.Py_ssize_t, rows: entries, own: numbers, width: cython.Py_ssize_t
) -> cython.void:
    """Subtract the n rows of a column, times the entries of the column, from `own`; four rows of a block per turn."""
    c: cython.Py_ssize_t
    i: cython.Py_ssize_t = 0
    while width > 1 and i + 4 <= n:
        r: entries = rows + i * width
        for c in range(width):
            own[c] -= (column[i] * r[c] + column[i + 1] * r[width + c]) + (
                column[i + 2] * r[2 * width + c] + column[i + 3] * r[3 * width + c]
            )
        i += 4
    for k in range(i, n):
        for c in range(width):
            own[c] -= column[k] * rows[k * width + c]
