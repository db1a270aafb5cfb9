"""The memory that factors will take, by an estimate made before."""

from __future__ import annotations

import numpy as np

# Bytes per row of each of two factors while they are made, on log2 n and on n^(1/3): the multifrontal ones of spheres
# and tori of 150k vertices took 25 to 37, those of a box of 30k vertices 35. Rather too much than too little.
_BYTES_SURFACE = 45.0
_BYTES_VOLUME = 100.0


def factor_bytes(n: int, n_entries: int) -> float:
    """An estimate of the memory that a factor of an (n, n) matrix takes while it is made, before it is.

    Nested dissection leaves of the order of n log n entries on surfaces and n^(4/3) in volumes. The average row tells
    which: by Euler's formula it has 7 entries on a triangulated surface, and 13 to 15 in a volume. (A lattice of right
    angles, whose diagonals weigh nothing, is taken for a surface.)
    """
    return float(
        n * (_BYTES_VOLUME * n ** (1 / 3) if is_of_volume(n, n_entries) else _BYTES_SURFACE * np.log2(max(n, 2)))
    )


def is_of_volume(n: int, n_entries: int) -> bool:
    """Whether an (n, n) matrix with so many entries is taken for that of a volume."""
    return n_entries > 10 * n
