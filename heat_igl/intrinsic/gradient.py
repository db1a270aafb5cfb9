"""The gradient of piecewise linear functions on an intrinsic triangulation."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic.layout import apex
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation

__all__ = ["intrinsic_gradient"]


def intrinsic_gradient(triangulation: IntrinsicTriangulation) -> sp.csc_matrix:
    """Gradient of piecewise linear functions, in a frame of each triangle.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices.

    Returns
    -------
    (2 m, n) csc_matrix
        Row f is the component along the edge from corner 0 to corner 1 of triangle f; row m + f is the component
        orthogonal to it, towards corner 2. Unit 1 / length. Equation (5) of the paper, in the plane of each triangle.
    """
    F, lengths = triangulation.F, triangulation.l
    m = len(F)
    base = lengths[:, 2]
    x, y = apex(base, lengths[:, 1], lengths[:, 0])
    # Corners at (0, 0), (base, 0), (x, y): the gradient of the hat function of each corner.
    values = np.empty((2, m, 3))
    along, across = values
    np.divide(1, base, out=along[:, 1])
    np.negative(along[:, 1], out=along[:, 0])
    along[:, 2] = 0
    across[:, 0] = (x - base) / (base * y)
    across[:, 1] = -x / (base * y)
    np.divide(1, y, out=across[:, 2])
    vertices = np.tile(F.astype(np.int32), (2, 1))
    rows = sp.csr_matrix(
        (values.ravel(), vertices.ravel(), np.arange(0, 6 * m + 1, 3, dtype=np.int32)), shape=(2 * m, triangulation.n)
    )
    if (F[:, [1, 2, 0]] == F).any():
        rows.sum_duplicates()  # an edge from a vertex to itself
    return rows.tocsc()
