"""Vertices in ascending order of a key, as far as an order of visits needs it."""

import cython
import numpy as np


def ascending(key: cython.double[::1]):
    """Indices (n,) int32 in ascending order of `key`, ties and keys within 1e-6 of each other in order of index.

    A radix sort, several times faster than `numpy.argsort` at the sizes of meshes.
    """
    n = key.shape[0]
    digits, index = np.empty((2, n), np.uint64), np.empty((2, n), np.int32)
    some: cython.ulonglong[:, ::1] = digits
    order: cython.int[:, ::1] = index
    place: cython.longlong[:, ::1] = np.zeros((3, 1 << BITS), np.int64)
    with cython.nogil:
        _sort(key, some, order, place)
    return index[1]


@cython.cfunc
@cython.nogil
def _sort(
    key: cython.double[::1], digits: cython.ulonglong[:, ::1], order: cython.int[:, ::1], place: cython.longlong[:, ::1]
) -> cython.void:
    """Sort by three digits, least significant first; `place` counts the keys of each digit, then holds their places."""
    n: cython.Py_ssize_t = key.shape[0]
    digit: cython.ulonglong
    for i in range(n):
        digits[0, i] = _leading_bits(key[i])
        order[0, i] = i
        for p in range(3):
            place[p, (digits[0, i] >> (p * BITS)) & MASK] += 1
    for p in range(3):
        filled: cython.longlong = 0
        for digit in range(1 << BITS):
            count: cython.longlong = place[p, digit]
            place[p, digit] = filled
            filled += count
        source: cython.int = p % 2
        for i in range(n):
            digit = (digits[source, i] >> (p * BITS)) & MASK
            k: cython.longlong = place[p, digit]
            place[p, digit] += 1
            digits[1 - source, k], order[1 - source, k] = digits[source, i], order[source, i]


@cython.cfunc
@cython.inline
@cython.nogil
def _leading_bits(key: cython.double) -> cython.ulonglong:
    """The first bits of `key` as a number in the same order: doubles are ordered like their bits, signs apart."""
    bits: cython.ulonglong
    memcpy(cython.address(bits), cython.address(key), 8)
    # Those below 0 are inverted, and the others put above them.
    bits = ~bits if bits & TOP else bits | TOP
    return bits >> (64 - 3 * BITS)
