"""The vector instructions of this processor."""

import cython  # noqa: F401 - makes this a module of Cython's pure Python mode


def vectors():
    """Names of the sets of wide vectors that kernels may use here, widest first, then "" for none."""
    return ["avx512", "avx2", ""][2 - wide_vectors() :]
