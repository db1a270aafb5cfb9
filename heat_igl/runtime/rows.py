"""Rows of results: their floating-point type, and an array in memory or in a store that takes them block by block."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from heat_igl.errors import shown
from heat_igl.typing import AnyArray


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
