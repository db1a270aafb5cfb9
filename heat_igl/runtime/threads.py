"""Threads that share the processors, and many right-hand sides in blocks on them, with rows of results."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from heat_igl.errors import shown
from heat_igl.kernels.signals import obey
from heat_igl.typing import AnyArray

Item = TypeVar("Item")
First = TypeVar("First")
Second = TypeVar("Second")
Result = TypeVar("Result")

# In a thread of a `Pool`, the number of threads that share the processors with it, itself included.
_divided = threading.local()
# Blocks of rows for each thread, so that the last one ends soon after the others.
_BLOCKS_PER_THREAD = 4

# Largest number of right-hand sides in a block. They share one pass over the factors; larger blocks gain nothing.
BLOCK = 8
# Peak memory of the three steps, in bytes per face and right-hand side: 23 to 27 on a sphere of 328 000 faces.
_BYTES_PER_FACE = 40
# Limit in bytes for all threads together, unless a single right-hand side needs more.
WORKING_MEMORY = 2**31


def n_threads() -> int:
    """Number of threads to use: the available processors, at most ``HEAT_IGL_NUM_THREADS`` if that is set.

    In a thread of a `Pool` this number is divided by the size of the pool; the result is at least 1. A ValueError if
    the environment variable is not a positive number.
    """
    available = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    wanted = os.environ.get("HEAT_IGL_NUM_THREADS")
    if wanted:
        if not wanted.isdecimal() or int(wanted) < 1:
            raise ValueError(f"HEAT_IGL_NUM_THREADS must be a positive number, not {wanted!r}")
        available = min(available, int(wanted))
    return max(1, available // _among())


class Pool(ThreadPoolExecutor):
    """A pool of k threads, which share the processors of the calling thread (see `n_threads`).

    At its end, a ``with`` block waits for the threads. After an exception, for instance of Ctrl-C, it does not wait.
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


def _among() -> int:
    return int(getattr(_divided, "among", 1))


def side_by_side(work: Callable[[Item], Any], items: Sequence[Item]) -> None:
    """Call `work` on every item in parallel: the first on the calling thread, each other on a new thread.

    After an exception, such as that of Ctrl-C, the other threads are told to end, and not waited for.
    """
    if len(items) == 1:
        work(items[0])
        return
    with Pool(len(items)) as workers:
        others = [workers.submit(work, item) for item in items[1:]]
        work(items[0])
        for other in others:
            other.result()


def over_rows(work: Callable[[slice], Result], n: int, most: int) -> list[Result]:
    """The results of `work` on slices of at most `most` rows that make up n rows, in order, on all processors."""
    threads = n_threads()
    size = max(min(most, -(-n // (_BLOCKS_PER_THREAD * threads)) if threads > 1 else n), 1)
    slices = [slice(begin, min(begin + size, n)) for begin in range(0, n, size)]
    if min(threads, len(slices)) < 2:
        return [work(rows) for rows in slices]
    with Pool(min(threads, len(slices))) as workers:
        return list(workers.map(work, slices))


def both(first: Callable[[], First], second: Callable[[], Second]) -> tuple[First, Second]:
    """The results of two calls, the second of them on another thread if there is one."""
    if n_threads() == 1:
        return first(), second()
    with Pool(2) as workers:
        other = workers.submit(second)
        return first(), other.result()


def block_size(n_faces: int, n_sets: int | None, n_threads: int) -> tuple[int, int]:
    """Number of right-hand sides in a block, of `n_sets` if that is known, and number of threads, at most `n_threads`.

    Both are at least 1. Together the blocks stay within `WORKING_MEMORY`. If that memory is not the limit, the block
    size does not depend on the number of threads; neither do the bits of the results.
    """
    fit = int(WORKING_MEMORY // (_BYTES_PER_FACE * n_faces))
    threads = max(1, min(n_threads, fit, n_threads if n_sets is None else n_sets))
    return max(1, min(BLOCK, fit // threads)), threads


def _until_failure(items: Iterable[Item], failures: list[Exception]) -> Iterator[Item]:
    """The items before an exception, which is put into `failures`."""
    try:
        yield from items
    except Exception as error:
        failures.append(error)


def in_blocks(items: Iterable[Item], size: int) -> Iterator[list[Item]]:
    """Yield lists of `size` items; the last list may be shorter. Items before an exception in `items` are yielded."""
    failures: list[Exception] = []
    left = _until_failure(items, failures)
    while block := list(islice(left, size)):
        yield block
    if failures:
        raise failures[0]


def in_order(work: Callable[[Item], Result], items: Iterable[Item], n_threads: int) -> Iterator[Result]:
    """Yield the results of ``map(work, items)``, computed on several threads, in order.

    At most ``n_threads`` items are in progress or finished but not yet yielded. If `items` raises, the results for
    the items before the exception are yielded first.
    """
    if n_threads == 1:
        yield from map(work, items)
        return
    failures: list[Exception] = []
    left = _until_failure(items, failures)
    pending: deque[Future[Result]] = deque()
    workers = Pool(n_threads)
    try:
        while True:
            pending.extend(workers.submit(work, item) for item in islice(left, n_threads - len(pending)))
            if not pending:
                break
            yield pending.popleft().result()
    finally:
        # After Ctrl-C, or when no more results are wanted, what is in progress ends.
        workers.abandon()
    if failures:
        raise failures[0]


def float_type(dtype: npt.DTypeLike | None) -> np.dtype[Any]:
    """The type of returned distances: float64, also for None, or float32; a ValueError for any other."""
    try:
        found = np.dtype(np.float64 if dtype is None else dtype)
    except TypeError:
        raise ValueError(f"dtype must be float64 or float32, not {shown(dtype)}") from None
    if found not in (np.float64, np.float32):
        raise ValueError(f"dtype must be float64 or float32, not {found}")
    return found


def row_writer(out: Any) -> Callable[[AnyArray], None]:
    """A function that writes successive blocks of rows to `out` (k, n), from the first row on.

    If `out` has chunks, as zarr arrays have, rows are collected until they fill a chunk or reach the end of `out`:
    writing a part of a chunk would compress the whole chunk again. Other arrays receive every block at once.
    """
    chunks = getattr(out, "shards", None) or getattr(out, "chunks", None)
    height = int(chunks[0]) if chunks else 1
    waiting: list[AnyArray] = []
    position = 0

    def write(rows: AnyArray) -> None:
        nonlocal position
        waiting.append(rows)
        n_waiting = sum(len(block) for block in waiting)
        is_last = position + n_waiting == out.shape[0]
        n_ready = n_waiting if is_last else n_waiting - n_waiting % height
        if n_ready:
            ready = waiting[0] if len(waiting) == 1 else np.concatenate(waiting)
            out[position : position + n_ready] = ready[:n_ready]
            waiting[:] = [ready[n_ready:].copy()] if n_ready < n_waiting else []
            position += n_ready

    return write
