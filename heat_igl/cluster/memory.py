"""How much memory a solver will take, estimated before anything is factored."""

from __future__ import annotations

import os

__all__ = ["PROCESS_MEMORY", "physical_memory", "solver_memory"]

# A worker without a solver: Python, numpy, scipy, libigl, numba, zarr and Dask.
PROCESS_MEMORY = 320 * 2**20


def solver_memory(n_vertices: int, n_faces: int) -> int:
    """Bytes that a solver and one block of queries take at their worst moment."""
    return 3000 * n_vertices + 500 * n_faces


def physical_memory() -> int:
    """Bytes of memory that this machine has."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 8 * 2**30
