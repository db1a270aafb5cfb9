"""The memory that a solver will take, estimated before anything is factored, and the memory that a worker has."""

from __future__ import annotations

import os

from heat_igl.cluster.store import rows_per_block
from heat_igl.linear.factor_memory import factor_bytes
from heat_igl.mesh import Mesh, PointCloud

__all__ = ["PROCESS_MEMORY", "memory_for_solvers", "physical_memory", "solver_memory"]

# A worker without a solver: Python, numpy, scipy, libigl, zarr and Dask. Measured 215 MiB.
PROCESS_MEMORY = 230 * 2**20
# The mesh, the operators and one block of right-hand sides, measured on spheres of 10k to 164k vertices.
_BYTES_PER_VERTEX = 500
_BYTES_PER_FACE = 500
# Zarr copies a block to append the checksum. In double precision; measured in single precision, 4.
_BYTES_PER_WRITTEN_VALUE = 8


def solver_memory(mesh: Mesh | PointCloud) -> int:
    """Bytes that a solver on `mesh` and one block of queries take at most, including writing the block."""
    n, m = mesh.n_vertices, mesh.n_faces
    # Edges by Euler's formula, up to a few for boundaries and handles.
    n_edges = n + m
    block = _BYTES_PER_WRITTEN_VALUE * rows_per_block(n) * n
    return int(2 * factor_bytes(n, n + 2 * n_edges) + _BYTES_PER_VERTEX * n + _BYTES_PER_FACE * m + block)


def memory_for_solvers() -> int:
    """Bytes that the solvers of this worker may take together: the memory limit, less `PROCESS_MEMORY`."""
    from distributed import get_worker

    try:
        limit = get_worker().memory_manager.memory_limit
    except ValueError:  # not on a worker
        limit = None
    # A tenth is left for errors of the estimate.
    return int(0.9 * (limit or physical_memory())) - PROCESS_MEMORY


def physical_memory() -> int:
    """Bytes of memory that this machine has."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 8 * 2**30
