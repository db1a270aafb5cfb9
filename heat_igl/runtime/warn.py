"""Warnings that point at the caller's line, however deep in the package they are raised."""

from __future__ import annotations

import functools
import os
import sys
import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# Cached properties of the package are called by functools.
_OURS = (str(Path(__file__).parents[1]) + os.sep, functools.__file__)
_held = threading.local()


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
