"""The tasks that run on a worker: factor a mesh once, solve blocks of sources, write them to the store.

A task carries the mesh, never its factors. A worker keeps the solver of the current mesh, and several solvers only
while several threads need them.
"""

from __future__ import annotations

import hashlib
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl.cluster.collection import Item, SourcePlan
from heat_igl.cluster.store import MeshGroup, Store, rows_per_block
from heat_igl.errors import BatchError
from heat_igl.geodesic import DistanceMethod, Solver, SolverChoice
from heat_igl.heat import HeatMethodSolver
from heat_igl.io import read_mesh_or_cloud
from heat_igl.linear.backends import factor_bytes
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.runtime import available_memory, held_warnings, release_free_memory
from heat_igl.sampling import farthest_points
from heat_igl.sources import vertex_sources
from heat_igl.typing import IntArray
from heat_igl.validation.report import plain

# A task solves about this many values, and at least this many rows: factoring takes as long as 50 to 100 rows, so that
# spreading a mesh over workers pays from a few hundred rows each.
_VALUES_PER_TASK = 5e7
_ROWS_PER_TASK = 512

# A worker without a solver: Python, numpy, scipy, libigl, zarr and Dask. Measured 108 MiB.
PROCESS_MEMORY = 130 * 2**20
# The mesh, the operators and one block of right-hand sides, measured on spheres of 10k to 164k vertices.
_BYTES_PER_VERTEX = 500
_BYTES_PER_FACE = 500
# Zarr copies a block to append the checksum. In double precision; measured in single precision, 4.
_BYTES_PER_WRITTEN_VALUE = 8

TOPIC = "heat-igl-batch"
_VERSIONS = {"heat_igl": heat_igl.__version__} | {name: version(name) for name in ("libigl", "numpy", "scipy")}


def solver_memory(mesh: Mesh | PointCloud, method: DistanceMethod) -> int:
    """Bytes that a solver on `mesh` and one block of queries take at most, including writing the block."""
    n, m = mesh.n_vertices, mesh.n_faces
    # Only heat factors. Edges by Euler's formula, up to a few for boundaries and handles.
    factors = 2 * factor_bytes(n, n + 2 * (n + m)) if method == "heat" else 0
    block = _BYTES_PER_WRITTEN_VALUE * rows_per_block(n) * n
    return int(factors + _BYTES_PER_VERTEX * n + _BYTES_PER_FACE * m + block)


def memory_for_solvers() -> float:
    """Bytes that the solvers of this worker may take together: the memory limit, less `PROCESS_MEMORY`."""
    from distributed import get_worker

    # A tenth is left for errors of the estimate.
    return 0.9 * (get_worker().memory_manager.memory_limit or available_memory()) - PROCESS_MEMORY


@dataclass(eq=False)
class CacheEntry:
    """A solver, or the memory reserved for it, and how many threads use it."""

    bytes: int
    n_users: int = 0
    solver: Solver | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)


class SolverCache:
    """Solvers by mesh and options, shared by the threads of a worker.

    A solver is freed when no thread uses it and another one needs the memory, or with `drop_idle` or `clear`.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._entries: dict[str, CacheEntry] = {}
        self._highest = 0

    @contextmanager
    def solver(self, mesh: Mesh | PointCloud, fingerprint: str, choice: SolverChoice) -> Iterator[Solver]:
        """The solver of `mesh`, whose arrays have this fingerprint; made if it is not there.

        Waits until the memory that it is estimated to take is free. A MemoryError if that is more than the worker has.
        """
        key = f"{fingerprint} {choice}"
        entry = self._reserve(key, solver_memory(mesh, choice.method), memory_for_solvers())
        try:
            with entry.lock:
                if entry.solver is None:
                    entry.solver = choice.on(mesh)
            yield entry.solver
        finally:
            with self._changed:
                entry.n_users -= 1
                self._changed.notify_all()

    def drop_idle(self, but: str = "") -> None:
        """Free the solvers that no thread uses, other than that of a key."""
        with self._changed:
            for key in [key for key, entry in self._entries.items() if not entry.n_users and key != but]:
                del self._entries[key]

    def clear(self) -> None:
        """Free the solvers that no thread uses, and give their memory back to the system."""
        with self._changed:
            self.drop_idle()
            self._highest = 0
            release_free_memory()

    def _reserve(self, key: str, needed: int, limit: float) -> CacheEntry:
        """Reserve memory: free idle solvers first, then wait for other threads to finish with theirs."""
        if needed > limit:
            raise MemoryError(
                f"it needs about {needed / 2**30:.2g} GiB, and this worker has {limit / 2**30:.2g} GiB to spare: "
                "use fewer workers, or workers with more memory"
            )
        with self._changed:
            if key not in self._entries:
                self.drop_idle()
            while key not in self._entries and self._reserved() + needed > limit:
                self._changed.wait()
                self.drop_idle(but=key)
            entry = self._entries.setdefault(key, CacheEntry(needed))
            entry.n_users += 1
            if self._reserved() > self._highest:
                # The free pieces that smaller solvers left must not add to the memory of a larger one. One that is no
                # larger fits into memory that the process holds already, which then need not be mapped again.
                self._highest = self._reserved()
                release_free_memory()
            return entry

    def _reserved(self) -> int:
        return sum(entry.bytes for entry in self._entries.values())


_SOLVERS = SolverCache()


@dataclass(frozen=True, eq=False)
class Task:
    """Distances of one mesh to be found: all of them, or some blocks."""

    item: Item
    store: Path
    plan: SourcePlan
    dtype: str
    normalize: bool
    choice: SolverChoice
    blocks: tuple[int, ...] = ()


@dataclass(frozen=True)
class Outcome:
    """The result of a task: the blocks that are left for other tasks, or the reason why there are no distances."""

    remaining: tuple[tuple[int, ...], ...] = ()
    reason: str | None = None


def work(task: Task) -> Outcome:
    """Begin a mesh, or solve blocks of one that was begun."""
    try:
        store = Store(task.store)
    except Exception as error:
        raise BatchError(
            f"a worker cannot open store {task.store}: {_reason(error)}. Name a folder that the client and all workers "
            "share"
        ) from None
    try:
        mesh = _loaded(task.item)
        outcome = (_resume if task.blocks else _begin)(task, store, mesh, _fingerprint(mesh))
    except BatchError:  # the store is lost
        raise
    except Exception as error:  # of this mesh alone
        outcome = Outcome(reason=_reason(error))
    if not task.blocks and not outcome.remaining:
        _SOLVERS.drop_idle()
    return outcome


def release() -> None:
    """Free the solver that the worker still holds."""
    _SOLVERS.clear()


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    message = " ".join(str(error).split())
    return message if isinstance(error, ValueError | RuntimeError | MemoryError) and message else repr(error)


def _begin(task: Task, store: Store, mesh: Mesh | PointCloud, fingerprint: str) -> Outcome:
    """Factor a mesh, make the group or continue an earlier one, and solve the first blocks."""
    name = task.item.name
    try:
        known = store.attributes(name)
    except ValueError:  # damaged, and made anew
        known = {}
    is_done = known.get("status") == "done" and known["fingerprint"] == fingerprint
    if is_done and not store.group(name).damaged_chunk():
        return Outcome()
    with _SOLVERS.solver(mesh, fingerprint, task.choice) as solver:
        identity = {"fingerprint": fingerprint, **_described(solver)}
        found = _continued(name, store, known, identity)
        if found is None:
            sets, facts = _source_sets(task.plan, mesh, solver), {"mesh": task.item.label, "versions": _VERSIONS}
            facts |= {**identity, "report": plain(asdict(mesh.report()))}
            found = store.begin(name, sets, mesh.n_vertices, task.dtype, facts), sets
        group, source_sets = found
        # The missing blocks, cut into the shares of single tasks.
        missing, rows = group.missing(), group.rows(0).stop
        per_task = max(1, int(max(_ROWS_PER_TASK, _VALUES_PER_TASK / group.n_columns) // rows))
        spans = [tuple(missing[start : start + per_task]) for start in range(0, len(missing), per_task)]
        _send("begun", task, blocks=sum(map(len, spans)))
        if spans:
            _solve(task, mesh, group, source_sets, solver, spans[0])
        return Outcome(tuple(spans[1:]))


def _resume(task: Task, store: Store, mesh: Mesh | PointCloud, fingerprint: str) -> Outcome:
    """Solve the blocks of a task, in a group that `_begin` has made."""
    if store.attributes(task.item.name)["fingerprint"] != fingerprint:
        raise ValueError("the file changed during the batch: run the same again")
    group = store.group(task.item.name)
    with _SOLVERS.solver(mesh, fingerprint, task.choice) as solver:
        _solve(task, mesh, group, group.source_sets(), solver, task.blocks)
    return Outcome()


def _continued(
    name: str, store: Store, known: Mapping[str, Any], identity: Mapping[str, Any]
) -> tuple[MeshGroup, list[IntArray]] | None:
    """The group that an earlier batch made of the same mesh by the same solver, with the sources; None without one."""
    if any(known.get(key) != value for key, value in identity.items()):
        return None
    try:
        group = store.group(name)
        source_sets = group.source_sets()
    except (KeyError, ValueError):  # an array or the sources are missing or damaged
        return None
    store.update(name, {"status": "running", "reason": ""})
    return group, source_sets


def _loaded(item: Item) -> Mesh | PointCloud:
    if isinstance(item.mesh, (Mesh, PointCloud)):
        return item.mesh
    return read_mesh_or_cloud(item.mesh, item.points) if isinstance(item.mesh, Path) else Mesh(*item.mesh)


def _fingerprint(mesh: Mesh | PointCloud) -> str:
    digest = hashlib.sha256(f"{mesh.V.shape} {mesh.F.shape}".encode())
    digest.update(mesh.V.data)
    digest.update(mesh.F.data)
    return digest.hexdigest()


def _described(solver: Solver) -> dict[str, Any]:
    """The engine, and of heat the time step and the linear solver."""
    described: dict[str, Any] = {"engine": solver.plan.engine, "tolerance": solver.plan.tolerance}
    if isinstance(solver, HeatMethodSolver):
        described |= {"t": solver.t, "backend": solver.diagnostics.backend}
    return described


def _source_sets(plan: SourcePlan, mesh: Mesh | PointCloud, solver: Solver) -> list[IntArray]:
    n = mesh.n_vertices
    if isinstance(plan, tuple):
        # A set is sorted, so the last vertex tells whether the mesh has all of them.
        return [vertex_sources(list(vertices), n) if vertices[-1] >= n else np.array(vertices) for vertices in plan]
    chosen = np.arange(n) if plan is None else farthest_points(solver, min(plan, n))
    return list(chosen.reshape(-1, 1))


def _solve(
    task: Task,
    mesh: Mesh | PointCloud,
    group: MeshGroup,
    source_sets: Sequence[IntArray],
    solver: Solver,
    blocks: Sequence[int],
) -> None:
    unit = 1.0
    if task.normalize:
        if isinstance(mesh, PointCloud) or mesh.is_tetrahedral:
            raise ValueError("only a surface has an area by which distances are normalized: leave `normalize` away")
        unit = float(np.sqrt(mesh.measures.sum()))
    for block in blocks:
        start = time.perf_counter()
        rows = group.rows(block)
        with held_warnings() as held:
            distances = solver.distances(source_sets[rows]) / unit
        largest = np.max(distances, where=np.isfinite(distances), initial=0)
        if largest > np.finfo(task.dtype).max:
            raise ValueError(f"distances up to {largest:.4g} are no {task.dtype}: normalize them, or take float32")
        group.write(block, distances.astype(task.dtype, copy=False))
        messages = sorted({message for message, _ in held})
        _send("block", task, block=block, seconds=time.perf_counter() - start, warnings=messages)


def _send(kind: str, task: Task, **facts: Any) -> None:
    """Report an event to the client, if one listens."""
    from distributed import get_worker

    get_worker().log_event(TOPIC, {"kind": kind, "mesh": task.item.name, **facts})
