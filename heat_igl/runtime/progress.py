"""Progress bars on standard error, by rich."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from heat_igl.errors import MissingExtraError

__all__ = ["progress_bar", "rich_progress"]


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
