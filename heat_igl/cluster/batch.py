"""The client's side of a batch: submit tasks, a few more than threads, until every mesh is done.

Reports of workers go into the log and onto progress bars.
"""

from __future__ import annotations

import contextlib
import logging
import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

from heat_igl.cluster.collection import items, plan_text, source_plan
from heat_igl.cluster.connection import connected, dask_modules
from heat_igl.cluster.report import BatchReport, rows
from heat_igl.cluster.store import Store, locked
from heat_igl.cluster.worker import TOPIC, Outcome, Task, release, work
from heat_igl.errors import BatchError, require_choice
from heat_igl.geodesic import DistanceMethod, SolverChoice
from heat_igl.mesh import MeshLike
from heat_igl.runtime import rich_progress
from heat_igl.sources import Sources

_LOG = logging.getLogger("heat_igl.cluster")

DTYPES = ("float16", "float32", "float64")

_CLUSTER_LOST = "the cluster is lost; what is finished stays in the store: run the same again to go on"

# Tasks submitted beyond the number of threads, so that no thread waits for the client.
_TASKS_AHEAD = 2


def distances(
    meshes: Mapping[str, MeshLike] | Sequence[MeshLike],
    sources: str | Sequence[Sources],
    store: str | os.PathLike[str],
    *,
    client: Any = None,
    method: DistanceMethod | None = None,
    tolerance: float = 1e-5,
    dtype: str = "float32",
    normalize: bool = False,
    points: bool = False,
    progress: bool = False,
    **options: Any,
) -> BatchReport:
    """Distances on many meshes, found by the workers of a Dask cluster and written to a zarr store.

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
        Client of a cluster. By default one on this machine, with a process of one thread for every processor.
    method : {"auto", "windows", "exact", "sweep", "heat"}, optional
        As for `geodesic_distance`; "auto" by default, and "heat" with an option of heat.
    tolerance : float
        Largest error over the distance. Windows are exact, which holds every tolerance.
    dtype : {"float16", "float32", "float64"}
        Type to which the distances are rounded.
    normalize : bool
        Divide the distances on each mesh by the square root of its area, as benchmarks of shape matching do.
    points : bool
        Read all files as point clouds, by `read_point_cloud`. Otherwise .xyz and .npy files hold points, and a file
        of another format without faces fails.
    progress : bool
        Show on standard error how many meshes and blocks are done (extra ``cli``).
    **options
        Options of `HeatMethodSolver`: t_coef, t, laplacian, boundary, magnitude, backend.

    Returns
    -------
    BatchReport
        A row for each mesh; for one that could not be read, validated or factored, with the reason.

    Raises
    ------
    BatchError
        If the store cannot be written, another batch writes to it, or the cluster is lost. Finished blocks stay: the
        same call goes on from there.
    ValueError
        If an argument has no meaning, two meshes have one name, or `store` holds anything else.
    MissingExtraError
        If Dask or zarr is not installed.

    Notes
    -----
    The group of a mesh holds ``distance`` (source, vertex), ``source_vertex`` with ``source_row``, the row that starts
    at each, and as attributes t, versions, a checksum and the mesh's report. With the same versions on the same kind of
    processor, the bits are those of ``solver.distances(...).astype(dtype)``, however often the batch is interrupted.
    """
    require_choice("dtype", dtype, DTYPES)
    plan = source_plan(sources)
    choice = SolverChoice.of(method, tolerance, **options)
    solver = {"method": choice.method, "tolerance": tolerance, **options}
    with locked(Path(store)):
        opened = Store(store, {"sources": plan_text(plan), "dtype": dtype, "normalize": normalize, "solver": solver})
        tasks = [Task(item, opened.path.resolve(), plan, dtype, normalize, choice) for item in items(meshes, points)]
        with ExitStack() as stack:
            client = stack.enter_context(connected()) if client is None else client
            watch = stack.enter_context(watched(client, len(tasks), progress))
            _Run(client, opened, watch).all(tasks)
        return BatchReport(os.fspath(store), rows(opened, [task.item.name for task in tasks]))


class Watch:
    """Counts meshes and blocks as the workers report them; `bar` (rich.progress.Progress, or None) shows the counts."""

    def __init__(self, n_meshes: int, bar: Any) -> None:
        self._n_meshes = n_meshes
        self._n_done = 0
        self._n_blocks = 0
        self._n_solved = 0
        self._bar = bar
        self._meshes = bar.add_task("meshes", total=n_meshes) if bar else None
        self._blocks = bar.add_task("blocks", total=None) if bar else None

    def event(self, event: tuple[float, Mapping[str, Any]]) -> None:
        """Note one report of a worker: a time, and the facts of an event."""
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
        """Note that a mesh is done, or has failed for a reason."""
        self._n_done += 1
        if reason is None:
            _LOG.info("%s: done (%d of %d)", label, self._n_done, self._n_meshes)
        else:
            # Errors of files begin with the path, which is the label.
            _LOG.error("%s", reason if reason.startswith(label) else f"{label}: {reason}")
        if self._bar:
            self._bar.update(self._meshes, completed=self._n_done)


@contextmanager
def watched(client: Any, n_meshes: int, progress: bool) -> Iterator[Watch]:
    """A watch that receives the reports of all workers of `client`; bars need rich."""
    with rich_progress() if progress else nullcontext() as bar:
        watch = Watch(n_meshes, bar)
        client.subscribe_topic(TOPIC, watch.event)
        try:
            yield watch
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone, and nothing more is reported
                client.unsubscribe_topic(TOPIC)


class _Run:
    """The tasks that are running, and the number of tasks that each mesh still needs."""

    def __init__(self, client: Any, store: Store, watch: Watch) -> None:
        self._client = client
        self._store = store
        self._watch = watch
        self._tasks_left: dict[str, int] = {}
        self._reason: dict[str, str] = {}

    def all(self, tasks: Sequence[Task]) -> None:
        """Run all tasks, and those that they leave behind; raises `BatchError` if the store or the cluster is lost."""
        _, distributed = dask_modules()
        waiting = deque(tasks)
        running: dict[Any, Task] = {}
        begun = count()
        try:
            while waiting or running:
                most = sum(self._client.nthreads().values()) + _TASKS_AHEAD
                while waiting and len(running) < most:
                    task = waiting.popleft()
                    # Not pure: a task writes to the store, which the arguments do not show.
                    running[self._client.submit(work, task, pure=False, priority=-next(begun))] = task
                with contextlib.suppress(distributed.TimeoutError):
                    distributed.wait(list(running), timeout=1, return_when="FIRST_COMPLETED")
                if self._client.status != "running":
                    raise BatchError(_CLUSTER_LOST)
                for future in [future for future in running if future.done()]:
                    # Blocks of meshes that were begun come first, since a worker has the solver.
                    waiting.extendleft(reversed(self._collect(future, running.pop(future))))
        except (OSError, distributed.CancelledError) as error:
            raise BatchError(f"{_CLUSTER_LOST} ({error or type(error).__name__})") from None
        finally:
            with contextlib.suppress(Exception):  # the cluster may be gone
                self._client.cancel(list(running), force=True)
                self._client.run(release)

    def _collect(self, future: Any, task: Task) -> list[Task]:
        """Record the outcome of a task, and of its mesh if this was the last task; returns the tasks still to do."""
        _, distributed = dask_modules()
        try:
            outcome: Outcome = future.result()
        except distributed.KilledWorker:
            outcome = Outcome(reason="the workers that tried it died: out of memory, or a crash in a library")
        name = task.item.name
        remaining = [replace(task, blocks=blocks) for blocks in outcome.remaining]
        self._tasks_left[name] = self._tasks_left.get(name, 1) - 1 + len(remaining)
        if outcome.reason is not None:
            self._reason.setdefault(name, outcome.reason)
        if not self._tasks_left[name]:
            reason = self._reason.get(name)
            if reason is None:
                self._store.group(name).finish()
            else:
                self._store.fail(name, task.item.label, reason)
            self._watch.mesh_done(task.item.label, reason)
        return remaining
