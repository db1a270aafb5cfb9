"""What a user is told: warnings where the call came from, progress on standard error, and the time that is left."""

from __future__ import annotations

import functools
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from heat_igl.errors import MissingExtraError

# Cached properties of the package are called by functools.
_OURS = (str(Path(__file__).parents[1]) + os.sep, functools.__file__)
_held = threading.local()

# Seconds before the first line on a terminal, and between lines.
_PATIENCE = 5.0


def warn_caller(message: str, category: type[Warning]) -> None:
    """Warn with the file and line of the innermost caller outside this package."""
    collected = getattr(_held, "warnings", None)
    if collected is not None:
        collected.append((message, category))
        return
    # `skip_file_prefixes` of `warnings.warn` does this from Python 3.12 on.
    level, frame = 2, sys._getframe(1)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_OURS):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)


@contextmanager
def held_warnings() -> Iterator[list[tuple[str, type[Warning]]]]:
    """Collect the warnings of `warn_caller` on this thread, so that another thread, which has a caller, can warn."""
    before, collected = getattr(_held, "warnings", None), list[tuple[str, type[Warning]]]()
    _held.warnings = collected
    try:
        yield collected
    finally:
        _held.warnings = before


@contextmanager
def progress_bar(description: str, total: int, shown: bool = True) -> Iterator[Callable[[int], None]]:
    """A context with a progress bar on standard error; the value is a function that advances the bar by n rows.

    With ``shown=False`` there is no bar, and the function does nothing. A `MissingExtraError` if rich is not installed.
    """
    if not shown:
        yield lambda _: None
        return
    with rich_progress() as bar:
        task = bar.add_task(description, total=total)
        yield lambda n_rows: bar.advance(task, n_rows)


class TimeLeft:
    """Writes how long the rest of a long call takes, on standard error if that is a terminal.

    Of `total` steps of about the same cost, `what` is done: it ends the beginning "`done` of `total`".
    """

    def __init__(self, what: str, total: int) -> None:
        self._what, self._total, self._done = what, total, 0
        self._start = self._said = time.monotonic()

    def __call__(self, steps: int = 1, note: str = "") -> None:
        """Count `steps` as done; `note` ends the line, if one is due."""
        # Threads may miss what others add: an estimate suffices.
        self._done += steps
        now = time.monotonic()
        if now - self._said > _PATIENCE and sys.stderr.isatty():
            self._said = now
            left = (now - self._start) * (self._total / self._done - 1)
            print(f"{self._done} of {self._total} {self._what}: about {left:.0f} s left{note}", file=sys.stderr)


def rich_progress() -> Any:
    """Progress bars of rich on standard error, without tasks yet; a context manager. Errors of `progress_bar`."""
    with MissingExtraError.guard("progress=True", "rich", "cli"):
        from rich.console import Console
        from rich.progress import MofNCompleteColumn, Progress
    columns = (*Progress.get_default_columns(), MofNCompleteColumn())
    return Progress(*columns, console=Console(stderr=True))
