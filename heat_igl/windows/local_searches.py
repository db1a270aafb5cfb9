"""Searches by windows from one vertex after the other, on all processors. Each ends when the question is answered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from heat_igl.kernels.mesh import checking
from heat_igl.kernels.signals import raise_caught
from heat_igl.kernels.windows import windows
from heat_igl.runtime import n_threads, side_by_side
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.windows.engine import ROUNDING
from heat_igl.windows.exact import TOLERANCE, Found, Leaving
from heat_igl.windows.tables import Tables

#: Sources that a thread takes at a time: so few that all threads end at about the same time.
CHUNK = 64
# Initial number of results that a thread has room for.
_ROOM = 2**16
_NO_VERTICES = np.empty(0, np.int32)
_NONE_WRONG = np.empty(0, bool)
_NO_WAYS, _NO_LINES = np.empty((0, 3), np.int32), np.empty((0, 3))


class Chunk(NamedTuple):
    """Consecutive sources: their range, and their numbers in the tables."""

    start: int
    stop: int
    vertices: AnyArray


class Near(NamedTuple):
    """The number of vertices found from each source, and the vertices and their distances, source after source.

    From a directed search, `way` and `line` (r, 3) say how the path to each runs, see `windows.search_each`.
    What was found from a source `is_wrong` if it contradicts straight lines or the lengths of edges.
    """

    counts: IntArray
    vertex: AnyArray
    distance: FloatArray
    way: AnyArray = _NO_WAYS
    line: FloatArray = _NO_LINES
    is_wrong: BoolArray = _NONE_WRONG


class Workspace:
    """The arrays that searches of one thread write. Every search leaves them in their initial state.

    With `directed`, searches find in which directions paths leave; the faces must be oriented alike.
    """

    def __init__(self, tables: Tables, position: FloatArray, directed: bool = False) -> None:
        self._tables, self.names, self.is_directed = tables, tables.old_vertex, directed
        self._found, self._position, self._scratch = Found.of(tables.n, tables.n), position, np.full(tables.n, np.inf)
        leaving = Leaving.of(tables.n) if directed else None
        self._front = windows.Front(tables, self._found, TOLERANCE, leaving, position.ravel())

    def checked(self, part: Chunk, near: Near, limit: FloatArray | float) -> Near:
        """The answers of `part` with those that are wrong marked; each holds all vertices up to its limit."""
        tables, limits = self._tables, np.broadcast_to(limit, len(near.counts)).astype(np.float64)
        found = tables.number[near.vertex]
        answers = part.vertices, near.counts, found, near.distance, limits
        wrong = checking.wrong_rows(tables, self._position, *answers, self._scratch, ROUNDING)
        return near._replace(is_wrong=wrong)

    def search(
        self,
        sources: AnyArray,
        found: AnyArray,
        value: FloatArray,
        *,
        goals: AnyArray = _NO_VERTICES,
        first_goal: AnyArray | None = None,
        cutoff: float = np.inf,
        n_nearest: int = 0,
        way: AnyArray = _NO_WAYS,
        line: FloatArray = _NO_LINES,
    ) -> IntArray:
        """Search from each of `sources`; returns the end of the results of each source whose results fitted."""
        ends = np.zeros(len(sources), np.int64)
        n_done = windows.search_each(
            self._front,
            sources,
            goals,
            np.zeros(len(sources) + 1, np.int64) if first_goal is None else first_goal,
            cutoff,
            n_nearest,
            self.names,
            found,
            value,
            ends,
            way,
            line,
        )
        if n_done < 0:
            raise_caught()
            raise MemoryError("the windows of the exact distance do not fit into memory")
        return ends[:n_done]


def within(work: Workspace, part: Chunk, radius: float) -> Near:
    """All vertices up to a radius; the arrays are doubled until the results of the next source fit."""
    rows, done, room = [], 0, _ROOM
    while done < len(part.vertices):
        found, value = np.empty(room, np.int32), np.empty(room)
        way, line = np.empty((room, 3), np.int32), np.empty((room, 3))
        if not work.is_directed:
            way, line = _NO_WAYS, _NO_LINES
        ends = work.search(part.vertices[done:], found, value, cutoff=radius, way=way, line=line)
        if not len(ends):
            room *= 2
            continue
        done += len(ends)
        n = ends[-1]
        rows.append(Near(np.diff(ends, prepend=0), found[:n].copy(), value[:n].copy(), way[:n].copy(), line[:n].copy()))
    return work.checked(part, Near(*(np.concatenate(column) for column in zip(*rows, strict=True))), radius)


def nearest(work: Workspace, part: Chunk, k: int) -> Near:
    """The k nearest vertices of each source."""
    found, value = np.empty(k * len(part.vertices), np.int32), np.empty(k * len(part.vertices))
    ends = work.search(part.vertices, found, value, n_nearest=k)
    near = Near(np.diff(ends, prepend=0), found[: ends[-1]], value[: ends[-1]])
    return work.checked(part, near, np.where(near.counts < k, np.inf, value[ends - 1]))


def to_goals(work: Workspace, part: Chunk, goals: AnyArray, ends: IntArray) -> Near:
    """Distances of the goals (g,) of some sources; those of source i are ``ends[i]`` to ``ends[i + 1]`` of all."""
    first = ends[part.start : part.stop + 1] - ends[part.start]
    value = np.empty(len(goals))
    work.search(part.vertices, np.empty(1, np.int32), value, goals=goals, first_goal=first)
    return work.checked(part, Near(np.diff(first), work.names[goals], value), 0.0)


def in_chunks(
    tables: Tables,
    sources: AnyArray,
    search: Callable[[Workspace, Chunk], Near],
    V: FloatArray,
    directed: bool = False,
) -> list[Near]:
    """The results of `search` for chunks of consecutive sources, on all processors, in the order of the sources.

    Sources are numbers in the tables. In ascending order, a search often finds its data in the processor's cache. V are
    the positions (n, 3) of the vertices.
    """
    position = np.ascontiguousarray(tables.scaled(V[tables.old_vertex]))
    starts = range(0, len(sources), CHUNK)
    waiting = deque(enumerate(starts))
    parts: list[Any] = [None] * len(starts)

    def run(workspace: Workspace) -> None:
        while waiting:
            try:
                i, start = waiting.popleft()
            except IndexError:  # another thread took the last one
                return
            stop = min(start + CHUNK, len(sources))
            try:
                parts[i] = search(workspace, Chunk(start, stop, sources[start:stop]))
            except BaseException:
                waiting.clear()  # for a Ctrl-C, other threads end with the chunk at hand
                raise

    side_by_side(run, [Workspace(tables, position, directed) for _ in range(min(n_threads(), len(starts)))])
    return parts
