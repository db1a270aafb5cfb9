"""The tasks that run on a worker: factor a mesh once, solve blocks of sources, write them to the store.

A task carries the mesh, never its factors. A worker keeps the solver of the current mesh, and several solvers only
while several threads need them.
"""

from __future__ import annotations

import hashlib
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import heat_igl
from heat_igl.cluster.collection import Item, SourcePlan
from heat_igl.cluster.solver_cache import SolverCache
from heat_igl.cluster.store import MeshGroup, Store
from heat_igl.errors import AccuracyWarning, BatchError
from heat_igl.geodesic import Solver, SolverChoice
from heat_igl.heat import HeatMethodSolver
from heat_igl.io import read_mesh_or_cloud
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.sampling import farthest_points
from heat_igl.sources import vertex_sources
from heat_igl.typing import IntArray

# A task solves about this many values, and at least this many rows: factoring takes as long as 50 to 100 rows, so that
# spreading a mesh over workers pays from a few hundred rows each.
_VALUES_PER_TASK = 5e7
_ROWS_PER_TASK = 512

TOPIC = "heat-igl-batch"

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

    name: str
    remaining: tuple[tuple[int, ...], ...] = ()
    reason: str | None = None


def begin(tasks: Sequence[Task]) -> list[Outcome]:
    """Begin meshes one after the other, and stop after the first that leaves blocks: this worker has the solver."""
    store = _opened(tasks[0].store)
    outcomes = []
    for task in tasks:
        outcomes.append(_guarded(_begin, task, store))
        if outcomes[-1].remaining:
            break
        _SOLVERS.drop_idle()
    return outcomes


def resume(tasks: Sequence[Task]) -> list[Outcome]:
    """Solve the blocks of tasks in groups that `begin` has made."""
    store = _opened(tasks[0].store)
    return [_guarded(_resume, task, store) for task in tasks]


def release() -> None:
    """Free the solver that the worker still holds."""
    _SOLVERS.clear()


def _opened(path: Path) -> Store:
    try:
        return Store(path)
    except Exception as error:
        raise BatchError(
            f"a worker cannot open store {path}: {_reason(error)}. Name a folder that the client and all workers share"
        ) from None


def _guarded(work: Callable[[Task, Store], Outcome], task: Task, store: Store) -> Outcome:
    """The outcome of a task. An error of its mesh becomes the reason; only a lost store ends the batch."""
    try:
        return work(task, store)
    except BatchError:
        raise
    except Exception as error:
        return Outcome(task.item.name, reason=_reason(error))


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    message = " ".join(str(error).split())
    return message if isinstance(error, ValueError | RuntimeError | MemoryError) and message else repr(error)


def _begin(task: Task, store: Store) -> Outcome:
    """Read, validate and factor a mesh, make the group or continue an earlier one, and solve the first blocks."""
    name = task.item.name
    mesh = _loaded(task.item)
    fingerprint = _fingerprint(mesh)
    try:
        known = store.attributes(name)
    except ValueError:  # damaged, and made anew
        known = {}
    is_done = known.get("status") == "done" and known["fingerprint"] == fingerprint
    if is_done and not store.group(name).damaged_chunk():
        return Outcome(name)
    with _SOLVERS.solver(mesh, fingerprint, task.choice) as solver:
        identity = {"fingerprint": fingerprint, **_described(solver)}
        group, source_sets = _continued(name, store, known, identity) or _new(task, store, mesh, solver, identity)
        spans = _spans(group)
        _send("begun", task, blocks=sum(map(len, spans)))
        if spans:
            _solve(task, mesh, group, source_sets, solver, spans[0])
        return Outcome(name, remaining=tuple(spans[1:]))


def _resume(task: Task, store: Store) -> Outcome:
    """Solve the blocks of a task."""
    mesh = _loaded(task.item)
    fingerprint = _fingerprint(mesh)
    if store.attributes(task.item.name)["fingerprint"] != fingerprint:
        raise ValueError("the file changed during the batch: run the same again")
    group = store.group(task.item.name)
    with _SOLVERS.solver(mesh, fingerprint, task.choice) as solver:
        _solve(task, mesh, group, group.source_sets(), solver, task.blocks)
    return Outcome(task.item.name)


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


def _new(
    task: Task,
    store: Store,
    mesh: Mesh | PointCloud,
    solver: Solver,
    identity: Mapping[str, Any],
) -> tuple[MeshGroup, list[IntArray]]:
    """A new group for a mesh, with the sources."""
    source_sets = _source_sets(task.plan, mesh, solver)
    report = {key: _json_value(value) for key, value in asdict(mesh.report()).items()}
    attributes = {"mesh": task.item.label, **identity, "versions": _versions(), "report": report}
    return store.begin(task.item.name, source_sets, mesh.n_vertices, task.dtype, attributes), source_sets


def _loaded(item: Item) -> Mesh | PointCloud:
    if isinstance(item.mesh, (Mesh, PointCloud)):
        return item.mesh
    return read_mesh_or_cloud(item.mesh, item.points) if isinstance(item.mesh, Path) else Mesh(*item.mesh)


def _fingerprint(mesh: Mesh | PointCloud) -> str:
    digest = hashlib.sha256(f"{mesh.V.shape} {mesh.F.shape}".encode())
    digest.update(mesh.V.data)
    digest.update(mesh.F.data)
    return digest.hexdigest()


@cache
def _versions() -> dict[str, str]:
    return {"heat_igl": heat_igl.__version__} | {name: version(name) for name in ("libigl", "numpy", "scipy")}


def _described(solver: Solver) -> dict[str, Any]:
    """The engine, and of heat the time step and the linear solver."""
    described: dict[str, Any] = {"engine": solver.plan.engine, "tolerance": solver.plan.tolerance}
    if isinstance(solver, HeatMethodSolver):
        described |= {"t": solver.t, "backend": solver.diagnostics.backend}
    return described


def _source_sets(plan: SourcePlan, mesh: Mesh | PointCloud, solver: Solver) -> list[IntArray]:
    n = mesh.n_vertices
    if plan.source_sets is not None:
        # A set is sorted, so the last vertex tells whether the mesh has all of them.
        return [
            vertex_sources(list(vertices), n) if vertices[-1] >= n else np.array(vertices)
            for vertices in plan.source_sets
        ]
    if plan.farthest is None:
        return list(np.arange(n).reshape(-1, 1))
    return list(farthest_points(solver, min(plan.farthest, n)).reshape(-1, 1))


def _json_value(value: Any) -> Any:
    """A value that JSON can carry: Python's numbers and lists for numpy's, the word for an infinity."""
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    return value if not isinstance(value, float) or np.isfinite(value) else str(value)


def _spans(group: MeshGroup) -> list[tuple[int, ...]]:
    """The missing blocks, cut into the shares of single tasks."""
    missing = group.missing()
    rows = group.rows(0).stop
    n = group.n_columns
    per_task = max(1, int(max(_ROWS_PER_TASK, _VALUES_PER_TASK / n) // rows))
    return [tuple(missing[start : start + per_task]) for start in range(0, len(missing), per_task)]


def _solve(
    task: Task,
    mesh: Mesh | PointCloud,
    group: MeshGroup,
    source_sets: Sequence[IntArray],
    solver: Solver,
    blocks: Sequence[int],
) -> None:
    unit = _root_of_area(mesh) if task.normalize else 1.0
    for block in blocks:
        start = time.perf_counter()
        rows = group.rows(block)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", AccuracyWarning)
            distances = solver.distances(source_sets[rows]) / unit
        largest = np.max(distances, where=np.isfinite(distances), initial=0)
        if largest > np.finfo(task.dtype).max:
            raise ValueError(f"distances up to {largest:.4g} are no {task.dtype}: normalize them, or take float32")
        group.write(block, distances.astype(task.dtype, copy=False))
        messages = sorted({str(warning.message) for warning in caught})
        _send("block", task, block=block, seconds=time.perf_counter() - start, warnings=messages)


def _root_of_area(mesh: Mesh | PointCloud) -> float:
    if isinstance(mesh, PointCloud) or mesh.is_tetrahedral:
        raise ValueError("only a surface has an area by which distances are normalized: leave `normalize` away")
    return float(np.sqrt(mesh.measures.sum()))


def _send(kind: str, task: Task, **facts: Any) -> None:
    """Report an event to the client, if one listens."""
    from distributed import get_worker

    try:
        get_worker().log_event(TOPIC, {"kind": kind, "mesh": task.item.name, **facts})
    except ValueError:  # not on a worker
        return
