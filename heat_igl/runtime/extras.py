"""One error for an optional library that is missing, with the extra that installs it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from heat_igl.errors import MissingExtraError

__all__ = ["compiled_kernels_for"]


@contextmanager
def compiled_kernels_for(purpose: str) -> Iterator[None]:
    """Imports inside this context may need numba, without which `purpose` is not there.

    Raises
    ------
    MissingExtraError
        If numba, or the compiler that it brings, is not installed.
    """
    try:
        yield
    except ImportError as error:
        if error.name is None or not error.name.startswith(("numba", "llvmlite")):
            raise
        raise MissingExtraError.of(purpose, "numba", "fast") from None
