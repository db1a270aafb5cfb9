"""How many threads to use."""

from __future__ import annotations

import os

__all__ = ["n_threads"]


def n_threads() -> int:
    """Number of threads to use: the processors this process may run on, or fewer by ``HEAT_IGL_NUM_THREADS``.

    Raises
    ------
    ValueError
        If that environment variable is set to anything but a positive number.
    """
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    wanted = os.environ.get("HEAT_IGL_NUM_THREADS")
    if not wanted:
        return available
    if not wanted.isdecimal() or int(wanted) < 1:
        raise ValueError(f"HEAT_IGL_NUM_THREADS must be a positive number, not {wanted!r}")
    return min(available, int(wanted))
