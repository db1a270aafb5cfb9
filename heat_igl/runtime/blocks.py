"""Many right-hand sides in blocks: the size of a block, and blocks on several threads with results in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from typing import TypeVar

from heat_igl.runtime.threads import pool

Item = TypeVar("Item")
Result = TypeVar("Result")

# Largest number of right-hand sides in a block. They share one pass over the factors; larger blocks gain nothing.
_MOST = 8
# Peak memory of the three steps, in bytes per face and right-hand side.
_BYTES_PER_FACE = 40
# Limit in bytes for all threads together, unless a single right-hand side needs more.
WORKING_MEMORY = 2**31


def block_size(n_faces: int, n_sets: int | None, n_threads: int) -> tuple[int, int]:
    """Number of right-hand sides in a block, and number of threads.

    Parameters
    ----------
    n_faces : int
        Number of faces of the domain.
    n_sets : int or None
        Number of right-hand sides; None if unknown.
    n_threads : int
        Largest number of threads.

    Returns
    -------
    (int, int)
        Both at least 1. Together the blocks stay within `WORKING_MEMORY`. If that memory is not the limit, the block
        size does not depend on the number of threads; neither do the bits of the results.
    """
    fit = int(WORKING_MEMORY // (_BYTES_PER_FACE * n_faces))
    threads = max(1, min(n_threads, fit, n_threads if n_sets is None else n_sets))
    return max(1, min(_MOST, fit // threads)), threads


def in_blocks(items: Iterable[Item], size: int) -> Iterator[list[Item]]:
    """Yield lists of `size` items; the last list may be shorter. Items before an exception in `items` are yielded."""
    failure: Exception | None = None
    block: list[Item] = []
    iterator = iter(items)
    while failure is None:
        try:
            block.append(next(iterator))
        except StopIteration:
            break
        except Exception as error:
            failure = error
        if len(block) == size:
            yield block
            block = []
    if block:
        yield block
    if failure is not None:
        raise failure


def in_order(work: Callable[[Item], Result], items: Iterable[Item], n_threads: int) -> Iterator[Result]:
    """Yield the results of ``map(work, items)``, computed on several threads, in order.

    At most ``n_threads`` items are in progress or finished but not yet yielded. If `items` raises, the results for
    the items before the exception are yielded first.
    """
    if n_threads == 1:
        yield from map(work, items)
        return
    failure: Exception | None = None
    pending: deque[Future[Result]] = deque()
    iterator = iter(items)
    workers = pool(n_threads)
    try:
        while True:
            while failure is None and len(pending) < n_threads:
                try:
                    item = next(iterator)
                except StopIteration:
                    break
                except Exception as error:
                    failure = error
                else:  # what a handler of signals raises here ends all at once
                    pending.append(workers.submit(work, item))
            if not pending:
                break
            yield pending.popleft().result()
    finally:
        # After Ctrl-C, or when no more results are wanted, what is in progress ends.
        workers.abandon()
    if failure is not None:
        raise failure
