"""How many threads to use, and work on them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

__all__ = ["n_threads", "pool", "side_by_side"]

Item = TypeVar("Item")

# Among how many threads the processors are divided that this thread is one of.
_divided = threading.local()


def n_threads() -> int:
    """Number of threads to use: the processors this process may run on, or fewer by ``HEAT_IGL_NUM_THREADS``.

    In a thread of a `pool`, its share of them, at least 1.

    Raises
    ------
    ValueError
        If that environment variable is set to anything but a positive number.
    """
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    wanted = os.environ.get("HEAT_IGL_NUM_THREADS")
    if wanted:
        if not wanted.isdecimal() or int(wanted) < 1:
            raise ValueError(f"HEAT_IGL_NUM_THREADS must be a positive number, not {wanted!r}")
        available = min(available, int(wanted))
    return max(1, available // _among())


def pool(k: int) -> ThreadPoolExecutor:
    """Some threads, k, that divide the processors of this one: `n_threads` tells each of them its share."""
    among = k * _among()
    return ThreadPoolExecutor(k, initializer=lambda: setattr(_divided, "among", among))


def _among() -> int:
    return int(getattr(_divided, "among", 1))


def side_by_side(work: Callable[[Item], Any], items: Sequence[Item]) -> None:
    """Call `work` on every item, each on a thread of its own; the first on this one."""
    if len(items) == 1:
        work(items[0])
        return
    with pool(len(items)) as workers:
        others = [workers.submit(work, item) for item in items[1:]]
        work(items[0])
        for other in others:
            other.result()
