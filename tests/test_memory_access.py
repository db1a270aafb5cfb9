from __future__ import annotations

import sys

import numpy as np
import pytest

pytest.importorskip("numba")

from heat_igl.intrinsic.fans import jit
from heat_igl.runtime.prefetch import prefetch, uncounted
from heat_igl.typing import AnyArray, FloatArray, IntArray


@jit
def _moved(tables: tuple[FloatArray, tuple[IntArray, AnyArray | None]], shift: int) -> float:
    rows, (ids, nothing) = uncounted(tables)
    total = 0.0
    for i in range(len(ids)):
        prefetch(rows, ids[i] + shift)
        total += 10 * total + rows[ids[i], 1]
        rows[ids[i], 0] = -1.0
    return total if nothing is None else np.nan


def test_uncounted_arrays_are_the_same_memory_and_stay_with_their_owner() -> None:
    rows, ids = np.arange(8.0).reshape(4, 2), np.array([2, 0, 3])
    owners = sys.getrefcount(rows), sys.getrefcount(ids)
    for shift in (0, 1, -10, 10**6):  # what is fetched ahead need not be there
        # 5, then 11 * 5 + 1, then 11 * 56 + 7
        assert _moved((rows, (ids, None)), shift) == 623
    assert rows[:, 0].tolist() == [-1, 2, -1, -1]
    assert (sys.getrefcount(rows), sys.getrefcount(ids)) == owners
