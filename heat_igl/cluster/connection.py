"""The Dask client of a batch: of a scheduler at an address, or of a cluster on this machine with settings of ours."""

from __future__ import annotations

import importlib
import logging
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from heat_igl.errors import BatchError, MissingExtraError
from heat_igl.runtime import n_threads

# - A task carries a whole mesh, about which Dask would warn.
# - Dask's watch over its event loop wakes every process 50 times a second, and the profiler 100 times.
# - A nanny gives a worker the environment "pre-spawn-environ". Dask's own value of it has malloc return every large
#   array to the system at once, which makes a solver half as slow again.
_SETTINGS: dict[str, Any] = {
    "distributed.admin.large-graph-warning-threshold": "16GiB",
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
    "distributed.nanny.pre-spawn-environ": {
        f"{name}_NUM_THREADS": "1" for name in ("HEAT_IGL", "OMP", "MKL", "OPENBLAS", "NUMBA")
    },
}


@contextmanager
def connected(scheduler: str | None = None, n_workers: int | None = None, dashboard: bool = False) -> Iterator[Any]:
    """A client of the Dask scheduler at an address, or of a cluster on this machine that is closed at the end.

    Parameters
    ----------
    scheduler : str, optional
        Address such as ``tcp://10.0.0.1:8786``.
    n_workers : int, optional
        Processes on this machine, of one thread each; by default one for each processor.
    dashboard : bool
        Whether the cluster on this machine serves Dask's dashboard.

    Raises
    ------
    ValueError
        If both `scheduler` and `n_workers` are given.
    BatchError
        If there is no scheduler at the address.
    MissingExtraError
        If Dask is not installed.
    """
    dask, distributed = dask_modules()
    if scheduler is not None:
        if n_workers is not None:
            raise ValueError("workers are started on this machine only: the scheduler brings its own")
        try:
            client = distributed.Client(scheduler, timeout=10)
        except (OSError, ValueError) as error:
            raise BatchError(f"there is no Dask scheduler at {scheduler}: {error}") from None
        with client:
            yield client
        return
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(_SETTINGS))
        stack.enter_context(_restored_environment())
        with _restored_environment():
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=n_workers or n_threads(),
                    threads_per_worker=1,
                    # Any free port: without an address the scheduler asks for 8787, and warns where it is taken.
                    dashboard_address=":0",
                    scheduler_kwargs={"dashboard": dashboard},
                    silence_logs=logging.CRITICAL,
                    preload=["heat_igl.cluster.worker", "zarr"],  # so that no mesh waits for imports
                )
            )
        yield stack.enter_context(distributed.Client(cluster))


@contextmanager
def _restored_environment() -> Iterator[None]:
    """Undo the changes that a nanny makes to the environment of the process when it starts or restarts a worker.

    With these variables left set, this process would work with one thread from then on.
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


def dask_modules() -> tuple[Any, Any]:
    """The modules `dask` and `distributed`; a MissingExtraError if they are not installed."""
    with MissingExtraError.guard("a batch", "distributed", "cluster"):
        return importlib.import_module("dask"), importlib.import_module("distributed")
