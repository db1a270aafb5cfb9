"""The oriented double cover of a surface that cannot be oriented."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.typing import FloatArray, IntArray

__all__ = ["double_cover"]


def double_cover(triangulation: IntrinsicTriangulation) -> tuple[IntArray, FloatArray, IntArray]:
    """The oriented double cover: each face as it is on one sheet and turned over on the other, glued along equal sides.

    Vertex v becomes v and v + n, one for each orientation of the faces around it. Turning a face over swaps corners
    1 and 2. Fans that meet in v alone are assigned to the two copies arbitrarily: in v, a path may change sheets.
    """
    F, n = triangulation.F, triangulation.n
    size = F.size
    corner = np.arange(size)
    turned = np.where(corner % 3 == 0, corner, corner + np.where(corner % 3 == 1, 1, -1))
    # Half-edges, and corners, of the second sheet are numbered after those of the first.
    sheet_of_first = np.concatenate([corner, size + turned])  # by original half-edge: the position on either sheet
    twin = np.full(2 * size, -1)
    glued = np.flatnonzero(triangulation.twin >= 0)
    mate = triangulation.twin[glued]
    other_sheet = ~triangulation.aligned[glued]
    for sheet in (0, 1):
        there = np.where(other_sheet, 1 - sheet, sheet)
        twin[sheet_of_first[sheet * size + glued]] = sheet_of_first[there * size + mate]
    vertex = np.concatenate([F.ravel(), F[:, [0, 2, 1]].ravel()])
    lengths = np.concatenate([triangulation.l, triangulation.l[:, [0, 2, 1]]])
    # Corners around one vertex of the cover are linked through the sides that they share.
    half_edge = np.flatnonzero(twin >= 0)
    following, preceding = (
        half_edge - half_edge % 3 + (half_edge + 1) % 3,
        half_edge - half_edge % 3 + (half_edge + 2) % 3,
    )
    mate = twin[half_edge]
    mate_following, mate_preceding = mate - mate % 3 + (mate + 1) % 3, mate - mate % 3 + (mate + 2) % 3
    links = sp.coo_array(
        (
            np.ones(2 * len(half_edge), np.int8),
            (np.concatenate([following, preceding]), np.concatenate([mate_preceding, mate_following])),
        ),
        shape=(2 * size, 2 * size),
    )
    fan = csgraph.connected_components(links, directed=False)[1]
    # The copy of a fan with the smaller label keeps the vertex's number.
    first, second = fan[sheet_of_first[:size]], fan[sheet_of_first[size:]]
    is_second = np.empty(2 * size, bool)
    is_second[sheet_of_first[:size]] = first > second
    is_second[sheet_of_first[size:]] = second > first
    return (vertex + n * is_second).reshape(-1, 3), lengths, twin
