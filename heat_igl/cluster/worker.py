"""What runs on a worker: factor a mesh once, solve blocks of sources, write them to the store.

Tasks carry the mesh, never its factors. A worker holds the solver of one mesh at a time, and of several only while
several threads need them and the memory that they are estimated to take fits.
"""

from __future__ import annotations

import hashlib
import threading
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl.cluster.collection import Item, SourcePlan
from heat_igl.cluster.memory import PROCESS_MEMORY, physical_memory, solver_memory
from heat_igl.cluster.store import MeshGroup, Store
from heat_igl.errors import AccuracyWarning, BatchError
from heat_igl.heat_method import HeatMethodSolver, SolverOptions
from heat_igl.io import read_mesh
from heat_igl.mesh import Mesh
from heat_igl.runtime import release_free_memory
from heat_igl.sampling import farthest_points
from heat_igl.sources import vertex_sources
from heat_igl.typing import IntArray

__all__ = ["Outcome", "Task", "begin", "carry_on", "release"]

# A task solves about this many values, and at least this many rows: factoring takes as long as 50 to 100 rows, so that
# spreading a mesh over workers pays from a few hundred rows each.
_VALUES_PER_TASK = 5e7
_ROWS_PER_TASK = 512

TOPIC = "heat-igl-batch"


@dataclass(frozen=True, eq=False)
class Task:
    """Distances of one mesh to be found: all of them, or some blocks."""

    item: Item
    store: Path
    plan: SourcePlan
    dtype: str
    solver_options: SolverOptions
    blocks: tuple[int, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """What a task came to: blocks that are left for others, or the reason why there are no distances."""

    name: str
    remaining: tuple[tuple[int, ...], ...] = ()
    reason: str | None = None


def begin(tasks: Sequence[Task]) -> list[Outcome]:
    """Begin one mesh after the other, as far as the first that leaves blocks for others: its solver is at hand."""
    store = _opened(tasks[0].store)
    outcomes = []
    for task in tasks:
        outcomes.append(_begin(task, store))
        if outcomes[-1].remaining:
            break
        _SHELF.drop_idle()
    return outcomes


def _begin(task: Task, store: Store) -> Outcome:
    """Read and validate a mesh, factor it, make its group or continue the one that is there, and solve a first span."""
    try:
        mesh = _loaded(task.item)
        fingerprint = _fingerprint(mesh)
        known = store.attributes(task.item.name)
        if known.get("status") == "done" and known["fingerprint"] == fingerprint:
            return Outcome(task.item.name)
        with _SHELF.solver(mesh, fingerprint, task) as solver:
            made_of = {"fingerprint": fingerprint, "t": solver.t, "backend": solver.diagnostics.backend}
            if all(known.get(key) == value for key, value in made_of.items()):
                store.update(task.item.name, {"status": "running", "reason": ""})
                group = store.group(task.item.name)
                source_sets = group.source_sets()
            else:
                source_sets = _source_sets(task.plan, mesh, solver)
                report = {key: _plain(value) for key, value in asdict(mesh.report()).items()}
                attributes = {"mesh": task.item.label, **made_of, "versions": _versions(), "report": report}
                group = store.begin(task.item.name, source_sets, mesh.n_vertices, task.dtype, attributes)
            spans = _spans(group)
            _report("begun", task, blocks=sum(map(len, spans)))
            if spans:
                _solve(task, group, source_sets, solver, spans[0])
            return Outcome(task.item.name, remaining=tuple(spans[1:]))
    except BatchError:
        raise
    except Exception as error:
        # Whatever is wrong with one mesh is a row of the report; the others go on.
        return Outcome(task.item.name, reason=_reason(error))


def carry_on(tasks: Sequence[Task]) -> list[Outcome]:
    """Solve the blocks of tasks in groups that `begin` has made."""
    store = _opened(tasks[0].store)
    return [_carry_on(task, store) for task in tasks]


def _carry_on(task: Task, store: Store) -> Outcome:
    try:
        mesh = _loaded(task.item)
        fingerprint = _fingerprint(mesh)
        if store.attributes(task.item.name)["fingerprint"] != fingerprint:
            raise ValueError("the file changed while it was worked on")
        group = store.group(task.item.name)
        with _SHELF.solver(mesh, fingerprint, task) as solver:
            _solve(task, group, group.source_sets(), solver, task.blocks)
        return Outcome(task.item.name)
    except BatchError:
        raise
    except Exception as error:
        return Outcome(task.item.name, reason=_reason(error))


def release() -> None:
    """Free the solver that the worker still holds."""
    _SHELF.clear()


def _opened(path: Path) -> Store:
    try:
        return Store(path)
    except Exception as error:
        raise BatchError(
            f"a worker cannot open store {path}: {_reason(error)}. Name a folder that the client and all workers share"
        ) from None


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    message = " ".join(str(error).split())
    return message if isinstance(error, ValueError | RuntimeError | MemoryError) and message else repr(error)


def _loaded(item: Item) -> Mesh:
    if isinstance(item.mesh, Mesh):
        return item.mesh
    return read_mesh(item.mesh) if isinstance(item.mesh, Path) else Mesh(*item.mesh)


def _fingerprint(mesh: Mesh) -> str:
    digest = hashlib.sha256(f"{mesh.V.shape} {mesh.F.shape}".encode())
    digest.update(mesh.V.data)
    digest.update(mesh.F.data)
    return digest.hexdigest()


@cache
def _versions() -> dict[str, str]:
    return {"heat_igl": heat_igl.__version__} | {name: version(name) for name in ("libigl", "numpy", "scipy")}


def _source_sets(plan: SourcePlan, mesh: Mesh, solver: HeatMethodSolver) -> list[IntArray]:
    n = mesh.n_vertices
    if plan.source_sets is not None:
        # Each ascends: its last vertex tells whether all are there.
        return [
            vertex_sources(list(vertices), n) if vertices[-1] >= n else np.array(vertices)
            for vertices in plan.source_sets
        ]
    if plan.farthest is None:
        return list(np.arange(n).reshape(-1, 1))
    return list(farthest_points(solver, min(plan.farthest, n)).reshape(-1, 1))


def _plain(value: Any) -> Any:
    """A value that JSON has: numpy's numbers and arrays become Python's, infinity a word."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    return value if not isinstance(value, float) or np.isfinite(value) else str(value)


def _spans(group: MeshGroup) -> list[tuple[int, ...]]:
    """The missing blocks, as many together as make a task."""
    missing = group.missing()
    rows = group.rows(0).stop
    n = group.n_columns
    per_task = max(1, int(max(_ROWS_PER_TASK, _VALUES_PER_TASK / n) // rows))
    return [tuple(missing[start : start + per_task]) for start in range(0, len(missing), per_task)]


def _solve(
    task: Task, group: MeshGroup, source_sets: Sequence[IntArray], solver: HeatMethodSolver, blocks: Sequence[int]
) -> None:
    for block in blocks:
        start = time.perf_counter()
        rows = group.rows(block)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", AccuracyWarning)
            distances = solver.distances(source_sets[rows]).astype(task.dtype, copy=False)
        group.write(block, distances)
        said = sorted({str(warning.message) for warning in caught})
        _report("block", task, block=block, seconds=time.perf_counter() - start, warnings=said)


def _report(kind: str, task: Task, **facts: Any) -> None:
    """Tell the client, if it listens."""
    from distributed import get_worker

    try:
        get_worker().log_event(TOPIC, {"kind": kind, "mesh": task.item.name, **facts})
    except ValueError:  # not on a worker
        return


@dataclass(eq=False)
class _Place:
    """A solver, or room for one, and how many threads use it."""

    bytes: int
    users: int = 0
    solver: HeatMethodSolver | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)


class _Shelf:
    """The solvers that this process holds, as long as the memory that they are estimated to take fits."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._places: dict[str, _Place] = {}
        self._highest = 0

    @contextmanager
    def solver(self, mesh: Mesh, fingerprint: str, task: Task) -> Iterator[HeatMethodSolver]:
        key = f"{fingerprint} {task.solver_options}"
        place = self._take(key, solver_memory(mesh), _memory_for_solvers())
        try:
            with place.lock:
                if place.solver is None:
                    place.solver = HeatMethodSolver.from_options(mesh, task.solver_options)
            yield place.solver
        finally:
            with self._changed:
                place.users -= 1
                self._changed.notify_all()

    def _take(self, key: str, needed: int, limit: int) -> _Place:
        """Reserve memory, waiting for other threads to give theirs back; solvers that nobody uses are freed first."""
        if needed > limit:
            raise MemoryError(
                f"it needs about {needed / 2**30:.2g} GiB, and this worker has {limit / 2**30:.2g} GiB to spare: "
                "use fewer workers, or workers with more memory"
            )
        with self._changed:
            if key not in self._places:
                self._drop_idle()
            while key not in self._places and sum(place.bytes for place in self._places.values()) + needed > limit:
                self._changed.wait()
                self._drop_idle(but=key)
            place = self._places.setdefault(key, _Place(needed))
            place.users += 1
            taken = sum(place.bytes for place in self._places.values())
            if taken > self._highest:
                # What smaller solvers left in pieces must not add to a larger one. One that is no larger finds room in
                # what the process holds already, and need not have it mapped again.
                self._highest = taken
                release_free_memory()
            return place

    def drop_idle(self) -> None:
        """Free the solvers that nobody uses."""
        with self._changed:
            self._drop_idle()

    def _drop_idle(self, but: str = "") -> None:
        for key in [key for key, place in self._places.items() if not place.users and key != but]:
            del self._places[key]

    def clear(self) -> None:
        with self._changed:
            self._drop_idle()
            self._highest = 0
            release_free_memory()


def _memory_for_solvers() -> int:
    """Bytes that the solvers of this worker may take together: its limit less what the process takes without them."""
    from distributed import get_worker

    try:
        limit = get_worker().memory_manager.memory_limit
    except ValueError:
        limit = None
    return int(0.9 * (limit or physical_memory())) - PROCESS_MEMORY


_SHELF = _Shelf()
