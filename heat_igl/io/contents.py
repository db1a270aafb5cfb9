"""The contents of a mesh file: tokens and numbers of text, and checks whose errors name the position in the file.

`Text` stores the positions of lines and tokens as arrays, without a Python object per token, and parses the numbers of
many lines in one call. Files of a million lines take seconds. Errors name the line of the first bad token.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError, errors_at
from heat_igl.mesh import Mesh, which_repeat_a_vertex
from heat_igl.runtime import warn_caller
from heat_igl.typing import AnyArray, FloatArray, IntArray

_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE)
_SPACE, _SLASH = 32, 47


def ragged(start: IntArray, length: IntArray) -> IntArray:
    """The concatenation of ``range(start[i], start[i] + length[i])``."""
    before = np.cumsum(length) - length
    return np.repeat(start - before, length) + np.arange(length.sum())


def format_rows(row: str, values: AnyArray) -> str:
    """Format each row of `values` by the %-format `row`. A float written with ``%r`` is read back exactly."""
    return (row * len(values)) % tuple(values.ravel().tolist())


class Text:
    """The nonblank lines of a text file, split into tokens at white space.

    `comment` begins a comment, which extends to the end of the line; `continued` says whether a backslash at the end of
    a line continues it. `first` (k,) is the index of the first token of each nonblank line, and `count` (k,) the number
    of its tokens. A MeshError if the file is empty or not text.
    """

    def __init__(self, path: Path, data: bytes, comment: str = "", continued: bool = False) -> None:
        self.path = path
        if b"\0" in data:
            line = data.count(b"\n", 0, data.index(b"\0")) + 1
            raise MeshError(
                f"{path}, line {line}: a zero byte, so this is not the plain text its name promises: "
                "check how the file was made, or save it as UTF-8 text"
            )
        if data.startswith(b"\xef\xbb\xbf"):  # the byte order mark of UTF-8
            data = b"   " + data[3:]
        if b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        self._lines = data  # with all line breaks, for line numbers
        # Comments are overwritten by blanks, so that positions in the file do not change.
        if comment and comment.encode() in data:
            data = re.sub(re.escape(comment).encode() + rb"[^\n]*", _blank, data)
        if continued and b"\\" in data:
            data = re.sub(rb"\\[ \t]*\r?\n", _blank, data)
        self._data = data
        self._codes = np.frombuffer(data, np.uint8)
        edge = np.diff((self._codes > _SPACE).view(np.int8), prepend=np.int8(0), append=np.int8(0))
        self._start = np.flatnonzero(edge == 1)
        self._end = np.flatnonzero(edge == -1)
        if not len(self._start):
            raise MeshError(f"{path}: the file is empty" + (" but for comments" if self._lines.strip() else ""))
        line_start = np.concatenate([[0], np.flatnonzero(self._codes == ord("\n")) + 1])
        first = np.searchsorted(self._start, line_start)
        count = np.diff(first, append=len(self._start))
        self.first: IntArray = first[count > 0]
        self.count: IntArray = count[count > 0]

    def __len__(self) -> int:
        return len(self.first)

    def tokens(self, line: int) -> list[bytes]:
        """The tokens of a line."""
        last = self.first[line] + self.count[line] - 1
        return self._data[self._start[self.first[line]] : self._end[last]].split()

    def where(self, line: int) -> str:
        """Path, line number (counted from 1) and text of a line, for errors."""
        start = int(self._start[self.first[line]])
        shown = b" ".join(self.tokens(line)).decode("utf-8", "backslashreplace")
        shown = shown if len(shown) <= 60 else shown[:57] + "..."
        return f"{self.path}, line {self._lines.count(10, 0, start) + 1} ({shown})"

    def error(self, line: int, message: str) -> MeshError:
        """A `MeshError` with `message` that names the line."""
        return MeshError(f"{self.where(line)}: {message}")

    def refuse(self, lines: IntArray, bad: AnyArray, message: str) -> None:
        """Raise an `error` that names the first of some lines that are bad, if any is."""
        if bad.any():
            raise self.error(lines[np.argmax(bad)], message)

    def words(self, width: int) -> AnyArray:
        """The first token of each line, cut to `width` bytes, as byte strings."""
        start, length = self._start[self.first], self._end[self.first] - self._start[self.first]
        letters = np.zeros((len(start), width), np.uint8)
        for i in range(min(width, int(length.max(initial=0)))):
            long = length > i
            letters[long, i] = self._codes[start[long] + i]
        return letters.view(f"S{width}").ravel()

    def numbers(self, lines: IntArray, skip: int = 0, up_to_slash: bool = False) -> tuple[FloatArray, IntArray]:
        """All numbers (t,) in ascending lines (r,), and the index (r,) of the first number of each line.

        `skip` leading tokens of each line are left out; `up_to_slash` reads ``12/3/4`` as 12. A MeshError names the
        first token that is not a number.
        """
        count = np.maximum(self.count[lines] - skip, 0)
        start = np.cumsum(count) - count
        filled = lines[count > 0]
        if not len(filled):
            return np.empty(0), start
        # All other tokens are overwritten by blanks; then one call parses the numbers.
        begin = self._start[self.first[filled] + skip]
        end = self._end[self.first[filled] + self.count[filled] - 1]
        codes = self._codes[begin[0] : end[-1]]
        change = np.zeros(len(codes) + 1, np.int8)
        change[begin - begin[0]] = 1
        change[end - begin[0]] = -1
        codes = np.where(np.cumsum(change[:-1], dtype=np.int8), codes, np.uint8(_SPACE))
        if up_to_slash and (codes == _SLASH).any():
            # From the first slash of a token to its end.
            stop = np.flatnonzero((codes == _SLASH) | (codes <= _SPACE))
            turn = np.diff((codes[stop] == _SLASH).view(np.int8), prepend=np.int8(0))
            change = np.zeros(len(codes), np.int8)
            change[stop] = turn
            codes[np.cumsum(change, dtype=np.int8).view(bool)] = _SPACE
        for kind in (np.int64, np.float64)[not up_to_slash :]:  # integers are read in an eighth of the time
            try:
                values = np.fromstring(codes.tobytes(), kind, sep=" ")
            except (ValueError, DeprecationWarning):  # the exception depends on the version of numpy
                continue
            if len(values) == count.sum():
                return values.astype(np.float64, copy=False), start
        for line in filled.tolist():
            for token in self.tokens(line)[skip:]:
                number = token.split(b"/")[0] if up_to_slash else token
                if not _NUMBER.fullmatch(number):
                    raise self.error(line, f"'{token[:40].decode('utf-8', 'backslashreplace')}' is not a number")
        raise self.error(int(filled[0]), "this line, or one below, holds something that is not a number")

    def positions(self, lines: IntArray, skip: int = 0) -> FloatArray:
        """The first three numbers of each line (r, 3), after `skip` tokens."""
        short = self.count[lines] < skip + 3
        self.refuse(lines, short, f"a vertex needs three coordinates ({int(short.sum())} lines have fewer)")
        values, start = self.numbers(lines, skip)
        return np.asarray(values[start[:, None] + np.arange(3)])


def _blank(match: re.Match[bytes]) -> bytes:
    return b" " * len(match.group())


class Cells(NamedTuple):
    """Polygons or tetrahedra: vertex indices from 0, cell after cell, and the number of corners of each cell (m,)."""

    corners: IntArray
    degree: IntArray
    tetrahedra: bool = False


class Contents(NamedTuple):
    """Positions (n, 3), polygons or tetrahedra, and arrays per vertex (n,) or (n, k) by name."""

    V: FloatArray
    cells: Cells
    attributes: dict[str, AnyArray]

    def mesh(self, path: Path) -> Mesh:
        """The mesh of the file; polygons are cut into triangles. A MeshError if the positions cannot be used."""
        corners, degree, tetrahedra = self.cells
        with errors_at(str(path)):
            if tetrahedra:
                return Mesh(self.V, corners.reshape(-1, 4))
            return Mesh.of_polygons(self.V, corners, degree, numbered(path, "face", 0))


def integers(values: FloatArray, where: Callable[[int], str], what: str = "index") -> IntArray:
    """`values` as integers; `where(i)` is the position of the i-th value in the file, for errors."""
    bad = ~(np.abs(values) < 2.0**53) | (values != np.rint(values))
    if bad.any():
        i = int(np.argmax(bad))
        raise MeshError(f"{where(i)}: {values[i]:g} is no {what}, which must be a whole number below 2**53")
    return values.astype(np.int64)


def of_corner(degree: IntArray, cell_at: Callable[[int], str]) -> Callable[[int], str]:
    """Where the cell of the i-th corner stands in a file, by the number of corners (m,) and the place of each cell."""
    end = np.cumsum(degree)
    return lambda i: cell_at(int(np.searchsorted(end, i, side="right")))


def numbered(path: Path, kind: str, base: int) -> Callable[[int], str]:
    """Where the i-th vertex or cell stands in a file, for errors."""
    return lambda i: f"{path}, {kind} {i + base} (counted from {base})"


def check(
    V: FloatArray, cells: Cells, vertex_at: Callable[[int], str], cell_at: Callable[[int], str], base: int = 0
) -> None:
    """Check positions (n, 3) and indices from 0; `base` is the first index in the file format.

    `vertex_at` and `cell_at` say where a vertex or a cell stands in the file. A MeshError names the first place, and
    how many there are, where a position is not finite, an index is out of range, or a cell repeats a vertex.
    """
    corners, degree = cells.corners, cells.degree
    n = len(V)
    bad = ~np.isfinite(V).all(axis=1)
    if bad.any():
        where = vertex_at(int(np.argmax(bad)))
        raise MeshError(f"{where}: a coordinate is not finite ({int(bad.sum())} of {n} vertices): repair or remove it")
    bad = (corners < 0) | (corners >= n)
    if bad.any():
        first = int(np.argmax(bad))
        raise MeshError(
            f"{of_corner(degree, cell_at)(first)}: there is no vertex {corners[first] + base}, the file has {n} "
            f"vertices, counted from {base} ({int(bad.sum())} such indices): the file is damaged or written by another "
            "convention"
        )
    bad = which_repeat_a_vertex(corners, degree)
    if bad.any():
        where = cell_at(int(np.argmax(bad)))
        raise MeshError(
            f"{where}: a face repeats a vertex ({int(bad.sum())} of {len(degree)} faces do): "
            "remove these faces, they have no area"
        )


def warn_if_cut(path: Path, data: bytes, last: int, n: int) -> None:
    """Warn if the last line of a text file is not terminated, and a longer line could be another valid face.

    `last` is the last index in the file. If a digit is missing, the whole index is at least 10 `last`, which must be
    one of n vertices. Pass 0 if the file has no counts, so that whole lines may be missing.
    """
    if 10 * last <= n and not data.endswith((b"\n", b"\r")):
        line = data.rsplit(b"\n", 1)[-1].strip()[:60].decode("utf-8", "backslashreplace")
        warn_caller(
            f"{path}, last line ({line}): no line break ends it, so the file may be cut short there: add one if the "
            "line is complete",
            AccuracyWarning,
        )


def select(path: Path, blocks: list[tuple[str, IntArray]]) -> Cells:
    """Select the cells of the domain from blocks of cells, named as in meshio ("triangle", "tetra10", ...).

    If there are tetrahedra, they are the domain, since the triangles in such files are the boundary. Otherwise the
    domain consists of triangles, quadrilaterals and polygons. Points and lines are ignored. Cells of other kinds are a
    MeshError, since without them the domain would have holes.
    """
    blocks = [(kind, rows) for kind, rows in blocks if len(rows) and not kind.startswith(("vertex", "line"))]
    for kind, rows in blocks:
        if kind not in ("triangle", "quad", "polygon", "tetra"):
            raise MeshError(
                f"{path}: {len(rows)} cells are of kind {kind}; distances are computed on triangles and "
                "four-node tetrahedra only: convert the cells (and lower their order) in the program that made them"
            )
    solid = [rows for kind, rows in blocks if kind == "tetra"]
    chosen = solid or [rows for _, rows in blocks]
    if not chosen:
        raise MeshError(f"{path}: the file holds neither triangles nor tetrahedra, so there is no domain to work on")
    corners = np.concatenate([rows.ravel() for rows in chosen]).astype(np.int64)
    degree = np.concatenate([np.full(len(rows), rows.shape[1], np.int64) for rows in chosen])
    return Cells(corners, degree, bool(solid))
