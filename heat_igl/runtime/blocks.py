"""Many right-hand sides in blocks: block size, order, output and progress."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from heat_igl.errors import MissingExtraError, shown
from heat_igl.runtime.threads import pool
from heat_igl.typing import AnyArray

__all__ = ["WORKING_MEMORY", "block_size", "float_type", "in_blocks", "in_order", "progress_bar", "row_writer"]

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
    with pool(n_threads) as workers:
        try:
            while True:
                while failure is None and len(pending) < n_threads:
                    try:
                        pending.append(workers.submit(work, next(iterator)))
                    except StopIteration:
                        break
                    except Exception as error:
                        failure = error
                if not pending:
                    break
                yield pending.popleft().result()
        finally:
            for future in pending:
                future.cancel()
    if failure is not None:
        raise failure


def float_type(dtype: npt.DTypeLike | None) -> np.dtype[Any]:
    """The floating-point type of returned distances; float64 if `dtype` is None.

    Raises
    ------
    ValueError
        If `dtype` is neither float64 nor float32.
    """
    try:
        found = np.dtype(np.float64 if dtype is None else dtype)
    except TypeError:
        raise ValueError(f"dtype must be float64 or float32, not {shown(dtype)}") from None
    if found not in (np.float64, np.float32):
        raise ValueError(f"dtype must be float64 or float32, not {found}")
    return found


@contextmanager
def progress_bar(description: str, total: int, shown: bool = True) -> Iterator[Callable[[int], None]]:
    """A context with a progress bar on standard error; the value is a function that advances the bar by n rows.

    With ``shown=False`` there is no bar, and the function does nothing.

    Raises
    ------
    MissingExtraError
        If rich is not installed.
    """
    if not shown:
        yield lambda _: None
        return
    with rich_progress() as bar:
        task = bar.add_task(description, total=total)
        yield lambda n_rows: bar.advance(task, n_rows)


def rich_progress() -> Any:
    """Progress bars of rich on standard error, without tasks yet; a context manager.

    Raises
    ------
    MissingExtraError
        If rich is not installed.
    """
    with MissingExtraError.guard("progress=True", "rich", "cli"):
        from rich.console import Console
        from rich.progress import MofNCompleteColumn, Progress
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    return Progress(*columns, console=Console(stderr=True))


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
