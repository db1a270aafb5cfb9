"""Vertices in ascending order of a key, as far as an order of visits needs it."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.fans import jit
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["ascending"]

# The sign, the exponent and the first 21 bits of the mantissa, in three digits.
_BITS = 11


@jit
def ascending(key: FloatArray) -> AnyArray:
    """Indices (n,) int32 in ascending order of `key`, ties and keys within 1e-6 of each other in order of index.

    A radix sort, several times faster than `numpy.argsort` at the sizes of meshes.
    """
    n = len(key)
    bits = key.view(np.int64)
    digit_of, index = np.empty(n, np.uint64), np.empty(n, np.int32)
    next_digits, next_index = np.empty(n, np.uint64), np.empty(n, np.int32)
    mask, top = np.uint64((1 << _BITS) - 1), np.uint64(1 << 63)
    place = np.zeros((3, 1 << _BITS), np.int64)
    for i in range(n):
        # Doubles are ordered like their bits, once those below 0 are inverted and the others put above them.
        b = np.uint64(bits[i])
        b = (~b if bits[i] < 0 else b | top) >> np.uint64(64 - 3 * _BITS)
        digit_of[i], index[i] = b, i
        for p in range(3):
            place[p, (b >> np.uint64(p * _BITS)) & mask] += 1
    for p in range(3):
        filled = 0
        for digit in range(1 << _BITS):
            count = place[p, digit]
            place[p, digit] = filled
            filled += count
        for i in range(n):
            digit = (digit_of[i] >> np.uint64(p * _BITS)) & mask
            k = place[p, digit]
            place[p, digit] += 1
            next_digits[k], next_index[k] = digit_of[i], index[i]
        digit_of, next_digits = next_digits, digit_of
        index, next_index = next_index, index
    return index
