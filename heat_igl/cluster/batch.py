"""The client's side of a batch: hand out tasks, a few more than there are threads, until every mesh is done."""

from __future__ import annotations

import contextlib
import importlib
import logging
import os
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from typing import Any, NamedTuple

from heat_igl.cluster.collection import MeshLike, SourcePlan, items
from heat_igl.cluster.report import BatchReport, rows
from heat_igl.cluster.store import Store
from heat_igl.cluster.worker import TOPIC, Outcome, Task, begin, carry_on, release
from heat_igl.errors import BatchError, MissingExtraError
from heat_igl.heat_method import SolverOptions
from heat_igl.runtime import n_threads
from heat_igl.sources import Sources
from heat_igl.unfolding import Refine

__all__ = ["connected", "distances"]

_LOG = logging.getLogger("heat_igl.cluster")

_LOST = "the cluster is lost; what is finished stays in the store: run the same again to go on"

# A task carries a whole mesh. And Dask would have malloc give every large array back to the system at once, which makes
# a solver half as slow again. Dask's watch over its own event loop wakes every process 50 times a second, its profiler
# 100 times; a nanny hands these settings on, over what the environment says.
_SETTINGS: dict[str, Any] = {
    "distributed.admin.large-graph-warning-threshold": "16GiB",
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {
        f"{name}_NUM_THREADS": "1" for name in ("HEAT_IGL", "OMP", "MKL", "OPENBLAS", "NUMBA")
    },
}

# Seconds to wait for a scheduler's answer.
_PATIENCE = 10

# Handed out beyond the threads that work, so that none of these waits for the client.
_AHEAD = 2
# Most meshes handed out as one: what Dask takes for each, on small meshes, is about a tenth of what a worker takes.
_TOGETHER = 4


def distances(
    meshes: Mapping[str, MeshLike] | Sequence[MeshLike],
    sources: str | Sequence[Sources],
    store: str | os.PathLike[str],
    *,
    client: Any = None,
    refine: Refine | None = None,
    dtype: str = "float32",
    progress: bool = False,
    **options: Any,
) -> BatchReport:
    """Distances on many meshes, by the workers of a Dask cluster, into a zarr store.

    Parameters
    ----------
    meshes : sequence, or mapping from names
        Paths, `Mesh` objects or pairs (V, F). A worker reads a path itself.
    sources : "all", "farthest:K", or sequence
        Every vertex by itself; K farthest points of each mesh; or source sets, each as for `HeatMethodSolver.distance`
        but vertices only, the same for every mesh.
    store : path-like
        Directory that the client and all workers can write to. If it holds some of these distances already, only the
        others are found.
    client : distributed.Client, optional
        A cluster. By default one on this machine, of a process with one thread for every processor.
    refine : {"sweep", "unfold"}, optional
        See `HeatMethodSolver`.
    dtype : {"float32", "float64"}
        What the distances are rounded to.
    progress : bool
        Show on standard error how many meshes and blocks are done (extra ``cli``).
    **options
        More for `HeatMethodSolver`: t_coef, t, laplacian, boundary, magnitude, backend.

    Returns
    -------
    BatchReport
        A row for each of `meshes`. One that could not be read, validated or factored is a row with the reason.

    Raises
    ------
    BatchError
        If the store cannot be written or the cluster is lost. What is finished stays: the same call goes on from there.
    ValueError
        If an argument has no meaning, two meshes have one name, or `store` holds anything else.
    MissingExtraError
        If Dask or zarr is not installed.

    Notes
    -----
    The group of a mesh holds ``distance`` (source, vertex), ``source_vertex`` with ``source_row``, the row that starts
    at each, and as attributes t, versions, checksums and the mesh's report. The bits are those of
    ``solver.distances(...).astype(dtype)``, in whatever order and however often the batch is interrupted.
    """
    if dtype not in ("float32", "float64"):
        raise ValueError(f"dtype must be 'float32' or 'float64', not {dtype!r}")
    plan = SourcePlan.of(sources)
    solver_options = SolverOptions(refine=refine, **options)
    opened = Store(store, {"sources": str(plan), "dtype": dtype, "solver": {"refine": refine, **options}})
    tasks = [Task(item, opened.path.resolve(), plan, dtype, solver_options) for item in items(meshes)]
    with ExitStack() as stack:
        client = stack.enter_context(connected()) if client is None else client
        watch = stack.enter_context(_watched(client, len(tasks), progress))
        _Run(client, opened, watch).all(tasks)
    return BatchReport(os.fspath(store), rows(opened, [task.item.name for task in tasks]))


class _Parcel(NamedTuple):
    """Tasks that a worker does one after the other."""

    function: Callable[[Sequence[Task]], list[Outcome]]
    tasks: Sequence[Task]


def _parcels(tasks: Sequence[Task], at_once: int) -> Iterator[_Parcel]:
    """All meshes, to be begun in parcels that become smaller towards the end, so that no worker is left waiting."""
    start = 0
    while start < len(tasks):
        k = max(1, min(_TOGETHER, (len(tasks) - start) // (2 * at_once)))
        yield _Parcel(begin, tasks[start : start + k])
        start += k


class _Run:
    """Tasks in flight, and what is still to be done for each mesh."""

    def __init__(self, client: Any, store: Store, watch: Watch) -> None:
        self._client = client
        self._store = store
        self._watch = watch
        self._tasks_left: dict[str, int] = {}
        self._reason: dict[str, str] = {}
        self._priority = 0

    def all(self, tasks: Sequence[Task]) -> None:
        """Run all tasks, and those that they leave behind; raises `BatchError` if the store or the cluster is lost."""
        _, distributed = _dask()
        waiting: deque[_Parcel] = deque()
        running: dict[Any, _Parcel] = {}
        try:
            waiting.extend(_parcels(tasks, self._n_threads() + _AHEAD))
            while waiting or running:
                most = self._n_threads() + _AHEAD
                while waiting and len(running) < most:
                    parcel = waiting.popleft()
                    running[self._submit(parcel)] = parcel
                with contextlib.suppress(distributed.TimeoutError):
                    distributed.wait(list(running), timeout=1, return_when="FIRST_COMPLETED")
                if self._client.status != "running":
                    raise BatchError(_LOST)
                for future in [future for future in running if future.done()]:
                    waiting.extendleft(reversed(self._settled(future, running.pop(future))))
        except (OSError, distributed.CancelledError) as error:
            raise BatchError(f"{_LOST} ({error or type(error).__name__})") from None
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone
                self._client.cancel(list(running), force=True)
                self._client.run(release)

    def _n_threads(self) -> int:
        return sum(self._client.nthreads().values())

    def _submit(self, parcel: _Parcel) -> Any:
        self._priority -= 1
        # Not pure: what a task does is write to the store, which its arguments do not tell.
        return self._client.submit(parcel.function, parcel.tasks, pure=False, priority=self._priority)

    def _settled(self, future: Any, parcel: _Parcel) -> list[_Parcel]:
        """Take in what a parcel came to; returns what it leaves, first that of meshes whose solver is at hand."""
        _, distributed = _dask()
        function, tasks = parcel
        try:
            outcomes: list[Outcome] = future.result()
        except distributed.KilledWorker:
            if len(tasks) > 1:
                # One of them did it; alone, it will do so again.
                return [_Parcel(function, [task]) for task in tasks]
            reason = "the workers that tried it died: out of memory, or a crash in a library"
            outcomes = [Outcome(tasks[0].item.name, reason=reason)]
        left = [
            _Parcel(carry_on, [rest])
            for task, outcome in zip(tasks, outcomes, strict=False)
            for rest in self._taken_in(task, outcome)
        ]
        begun = len(outcomes)
        return left + ([_Parcel(function, tasks[begun:])] if tasks[begun:] else [])

    def _taken_in(self, task: Task, outcome: Outcome) -> list[Task]:
        """Note the outcome of a task; returns the tasks that it leaves."""
        name = task.item.name
        remaining = [replace(task, blocks=blocks) for blocks in outcome.remaining]
        self._tasks_left[name] = self._tasks_left.get(name, 1) - 1 + len(remaining)
        if outcome.reason is not None:
            self._reason.setdefault(name, outcome.reason)
        if not self._tasks_left[name]:
            self._close(task)
        return remaining

    def _close(self, task: Task) -> None:
        name = task.item.name
        reason = self._reason.get(name)
        if reason is None:
            self._store.group(name).finish()
        else:
            self._store.fail(name, task.item.label, reason)
        self._watch.mesh_done(task.item.label, reason)


class Watch:
    """What the workers report: into the log, and onto a progress bar."""

    def __init__(self, n_meshes: int, bar: Any) -> None:
        self._n_meshes = n_meshes
        self._n_done = 0
        self._n_blocks = 0
        self._n_solved = 0
        self._bar = bar
        self._meshes = bar.add_task("meshes", total=n_meshes) if bar else None
        self._blocks = bar.add_task("blocks", total=None) if bar else None

    def event(self, event: tuple[float, Mapping[str, Any]]) -> None:
        """Take in one report of a worker."""
        _, facts = event
        mesh = facts["mesh"]
        if facts["kind"] == "begun":
            _LOG.info("%s: factored, %d blocks to solve", mesh, facts["blocks"])
            self._n_blocks += facts["blocks"]
        else:
            _LOG.info("%s: block %d solved in %.2f s", mesh, facts["block"], facts["seconds"])
            for warning in facts["warnings"]:
                _LOG.warning("%s: block %d: %s", mesh, facts["block"], warning)
            self._n_solved += 1
        if self._bar:
            self._bar.update(self._blocks, completed=self._n_solved, total=self._n_blocks)

    def mesh_done(self, label: str, reason: str | None) -> None:
        """One mesh is done, or has failed for a reason."""
        self._n_done += 1
        if reason is None:
            _LOG.info("%s: done (%d of %d)", label, self._n_done, self._n_meshes)
        else:
            _LOG.error("%s: %s", label, reason)
        if self._bar:
            self._bar.update(self._meshes, completed=self._n_done)


@contextmanager
def _watched(client: Any, n_meshes: int, progress: bool) -> Iterator[Watch]:
    with _bar() if progress else nullcontext() as bar:
        watch = Watch(n_meshes, bar)
        client.subscribe_topic(TOPIC, watch.event)
        try:
            yield watch
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone, and no more is to be heard from it
                client.unsubscribe_topic(TOPIC)


def _bar() -> Any:
    try:
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
    except ImportError:
        raise MissingExtraError.of("progress=True", "rich", "cli") from None
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=Console(stderr=True))


@contextmanager
def connected(scheduler: str | None = None, n_workers: int | None = None, dashboard: bool = False) -> Iterator[Any]:
    """A client of the Dask scheduler at an address, or of a cluster on this machine that is closed at the end.

    Parameters
    ----------
    scheduler : str, optional
        Address such as ``tcp://10.0.0.1:8786``.
    n_workers : int, optional
        Processes on this machine, of one thread each; as many as processors by default.
    dashboard : bool
        Whether the cluster on this machine serves Dask's dashboard.

    Raises
    ------
    ValueError
        If both `scheduler` and `n_workers` are given.
    BatchError
        If there is no scheduler at the address.
    """
    dask, distributed = _dask()
    if scheduler is not None:
        if n_workers is not None:
            raise ValueError("workers are started on this machine only: the scheduler brings its own")
        try:
            client = distributed.Client(scheduler, timeout=_PATIENCE)
        except (OSError, ValueError) as error:
            raise BatchError(f"there is no Dask scheduler at {scheduler}: {error}") from None
        with client:
            yield client
        return
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(_SETTINGS))
        stack.enter_context(_own_environment())
        with _own_environment():
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=n_workers or n_threads(),
                    threads_per_worker=1,
                    dashboard_address=":0" if dashboard else None,
                    silence_logs=logging.CRITICAL,
                )
            )
        yield stack.enter_context(distributed.Client(cluster))


@contextmanager
def _own_environment() -> Iterator[None]:
    """Take back what a nanny puts into the environment of its own process when it starts a worker, or starts it again.

    Left there, it would have this process work with one thread from then on.
    """
    names = [*_SETTINGS["distributed.nanny.pre-spawn-environ"], "PYTHONHASHSEED"]
    before = {name: os.environ.get(name) for name in names}
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _dask() -> tuple[Any, Any]:
    try:
        return importlib.import_module("dask"), importlib.import_module("distributed")
    except ImportError:
        raise MissingExtraError.of("a batch", "Dask (distributed)", "cluster") from None
