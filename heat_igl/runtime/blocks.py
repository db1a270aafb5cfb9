"""Many right-hand sides in blocks: how large, on how many threads, where the rows go, and how far it is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from heat_igl.errors import MissingExtraError
from heat_igl.runtime.threads import pool
from heat_igl.typing import AnyArray

__all__ = ["WORKING_MEMORY", "block_size", "float_type", "in_blocks", "in_order", "progress_bar", "row_writer"]

Item = TypeVar("Item")
Result = TypeVar("Result")

# Right-hand sides solved together: reading the factors once for all of them pays up to here.
_MOST = 8
# Bytes per face and right-hand side that the three steps hold at their worst moment.
_BYTES_PER_FACE = 40
# What all threads together may hold, unless a single right-hand side needs more.
WORKING_MEMORY = 2**31


def block_size(n_faces: int, n_sets: int | None, n_threads: int) -> tuple[int, int]:
    """How many right-hand sides to solve at once, and on how many threads.

    Parameters
    ----------
    n_faces : int
        Of the domain.
    n_sets : int or None
        How many there will be; None when nobody knows.
    n_threads : int
        The most threads that may be used.

    Returns
    -------
    (int, int)
        Both at least 1. Together they keep to `WORKING_MEMORY`. Where there is room, the size of a block does not
        depend on the threads, and so the bits of the results do not.
    """
    fit = int(WORKING_MEMORY // (_BYTES_PER_FACE * n_faces))
    threads = max(1, min(n_threads, fit, n_threads if n_sets is None else n_sets))
    return max(1, min(_MOST, fit // threads)), threads


def in_blocks(items: Iterable[Item], size: int) -> Iterator[list[Item]]:
    """Lists of `size` items, the last one shorter. If `items` raises, those before the error still come."""
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
    """``map(work, items)`` on several threads, in order.

    At most ``n_threads`` results are waiting or being worked on; the next item is drawn when one of them is taken. If
    `items` raises, the results before the error still come.
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
    """The type of distances to return: float64 when None.

    Raises
    ------
    ValueError
        If it is neither float64 nor float32.
    """
    found = np.dtype(np.float64 if dtype is None else dtype)
    if found not in (np.float64, np.float32):
        raise ValueError(f"dtype must be float64 or float32, not {found}")
    return found


@contextmanager
def progress_bar(description: str, total: int, shown: bool = True) -> Iterator[Callable[[int], None]]:
    """A progress bar on standard error, and the function that moves it on; nothing where it is not to be shown.

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
    try:
        from rich.console import Console
        from rich.progress import MofNCompleteColumn, Progress
    except ImportError:
        raise MissingExtraError.of("progress=True", "rich", "cli") from None
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    return Progress(*columns, console=Console(stderr=True))


def row_writer(out: Any) -> Callable[[AnyArray], None]:
    """A function that takes blocks of rows and writes them to `out` (k, n) from the top, whole chunks of it at a time.

    An array without chunks gets every block as it comes. A chunked one, as of zarr, would compress a chunk again for
    each block that touches it; so rows wait until the chunk is full or `out` ends.
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
