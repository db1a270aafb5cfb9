"""The solvers that a worker keeps within its memory: what a solver takes is estimated before anything is factored."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from heat_igl.cluster.store import rows_per_block
from heat_igl.geodesic import DistanceMethod, Solver, SolverChoice
from heat_igl.linear.backends import factor_bytes
from heat_igl.mesh import Mesh, PointCloud
from heat_igl.runtime import release_free_memory

# A worker without a solver: Python, numpy, scipy, libigl, zarr and Dask. Measured 108 MiB.
PROCESS_MEMORY = 130 * 2**20
# The mesh, the operators and one block of right-hand sides, measured on spheres of 10k to 164k vertices.
_BYTES_PER_VERTEX = 500
_BYTES_PER_FACE = 500
# Zarr copies a block to append the checksum. In double precision; measured in single precision, 4.
_BYTES_PER_WRITTEN_VALUE = 8


def solver_memory(mesh: Mesh | PointCloud, method: DistanceMethod) -> int:
    """Bytes that a solver on `mesh` and one block of queries take at most, including writing the block."""
    n, m = mesh.n_vertices, mesh.n_faces
    # Only heat factors. Edges by Euler's formula, up to a few for boundaries and handles.
    factors = 2 * factor_bytes(n, n + 2 * (n + m)) if method == "heat" else 0
    block = _BYTES_PER_WRITTEN_VALUE * rows_per_block(n) * n
    return int(factors + _BYTES_PER_VERTEX * n + _BYTES_PER_FACE * m + block)


def memory_for_solvers() -> int:
    """Bytes that the solvers of this worker may take together: the memory limit, less `PROCESS_MEMORY`."""
    from distributed import get_worker

    try:
        limit = get_worker().memory_manager.memory_limit
    except ValueError:  # not on a worker
        limit = None
    # A tenth is left for errors of the estimate.
    return int(0.9 * (limit or _physical_memory())) - PROCESS_MEMORY


def _physical_memory() -> int:
    """Bytes of memory that this machine has."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 8 * 2**30


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

    def drop_idle(self) -> None:
        """Free the solvers that no thread uses."""
        with self._changed:
            self._drop_idle()

    def clear(self) -> None:
        """Free the solvers that no thread uses, and give their memory back to the system."""
        with self._changed:
            self._drop_idle()
            self._highest = 0
            release_free_memory()

    def _reserve(self, key: str, needed: int, limit: int) -> CacheEntry:
        """Reserve memory: free idle solvers first, then wait for other threads to finish with theirs."""
        if needed > limit:
            raise MemoryError(
                f"it needs about {needed / 2**30:.2g} GiB, and this worker has {limit / 2**30:.2g} GiB to spare: "
                "use fewer workers, or workers with more memory"
            )
        with self._changed:
            if key not in self._entries:
                self._drop_idle()
            while key not in self._entries and self._reserved() + needed > limit:
                self._changed.wait()
                self._drop_idle(but=key)
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

    def _drop_idle(self, but: str = "") -> None:
        for key in [key for key, entry in self._entries.items() if not entry.n_users and key != but]:
            del self._entries[key]
