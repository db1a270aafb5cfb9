"""The number of threads, and pools of threads that share the processors."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

from heat_igl.kernels.signals import obey

Item = TypeVar("Item")
First = TypeVar("First")
Second = TypeVar("Second")
Result = TypeVar("Result")

# Per thread: the number of threads, this one included, among which the processors are divided.
_divided = threading.local()
# Blocks of rows for each thread, so that the last one ends soon after the others.
_BLOCKS_PER_THREAD = 4


def n_threads() -> int:
    """Number of threads to use: the available processors, at most ``HEAT_IGL_NUM_THREADS`` if that is set.

    In a thread of a `pool` this number is divided by the size of the pool; the result is at least 1.

    Raises
    ------
    ValueError
        If the environment variable is not a positive number.
    """
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    wanted = os.environ.get("HEAT_IGL_NUM_THREADS")
    if wanted:
        if not wanted.isdecimal() or int(wanted) < 1:
            raise ValueError(f"HEAT_IGL_NUM_THREADS must be a positive number, not {wanted!r}")
        available = min(available, int(wanted))
    return max(1, available // _among())


class _Pool(ThreadPoolExecutor):
    """A pool of k threads, among which the processors of the calling thread are divided (see `n_threads`).

    A ``with`` block waits for them at its end; it abandons them after an exception, such as that of Ctrl-C.
    """

    def __init__(self, k: int) -> None:
        among, stop = k * _among(), threading.Event()

        def begin() -> None:
            _divided.among = among
            obey(stop)

        super().__init__(k, initializer=begin)
        self._stop = stop

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self.shutdown()
        else:
            self.abandon()

    def abandon(self) -> None:
        """End compiled loops, begin nothing new, and do not wait."""
        self._stop.set()
        self.shutdown(wait=False, cancel_futures=True)


def pool(k: int) -> _Pool:
    """A pool of k threads, among which the processors of the calling thread are divided (see `n_threads`)."""
    return _Pool(k)


def _among() -> int:
    return int(getattr(_divided, "among", 1))


def side_by_side(work: Callable[[Item], Any], items: Sequence[Item]) -> None:
    """Call `work` on every item in parallel: the first on the calling thread, each other on a new thread.

    After an exception, such as that of Ctrl-C, the other threads are told to end, and not waited for.
    """
    if len(items) == 1:
        work(items[0])
        return
    with pool(len(items)) as workers:
        others = [workers.submit(work, item) for item in items[1:]]
        work(items[0])
        for other in others:
            other.result()


def over_rows(work: Callable[[slice], Result], n: int, most: int) -> list[Result]:
    """The results of `work` on slices of at most `most` rows that make up n rows, in order, on all processors."""
    threads = n_threads()
    size = max(min(most, -(-n // (_BLOCKS_PER_THREAD * threads))), 1)
    slices = [slice(begin, min(begin + size, n)) for begin in range(0, n, size)]
    waiting = deque(range(len(slices)))
    results: dict[int, Result] = {}

    def work_off(_: int) -> None:
        while True:
            try:
                at = waiting.popleft()
            except IndexError:
                return
            results[at] = work(slices[at])

    try:
        side_by_side(work_off, range(max(min(threads, len(slices)), 1)))
    except BaseException:
        waiting.clear()
        raise
    return [results[at] for at in range(len(slices))]


def both(first: Callable[[], First], second: Callable[[], Second]) -> tuple[First, Second]:
    """The results of two calls, the second of them on another thread if there is one."""
    if n_threads() == 1:
        return first(), second()
    with pool(2) as workers:
        other = workers.submit(second)
        return first(), other.result()
