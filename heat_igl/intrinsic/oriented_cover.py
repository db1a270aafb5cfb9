"""The oriented double cover of a surface that cannot be oriented."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.intrinsic.half_edges import HalfEdges
from heat_igl.intrinsic.history import BACK_CORNERS
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, next_half_edge, previous_half_edge


def double_cover(triangulation: IntrinsicTriangulation) -> HalfEdges:
    """The oriented double cover: each face as it is on one sheet and turned over on the other, glued along equal sides.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        m triangles on n vertices, of a surface that cannot be oriented.

    Returns
    -------
    HalfEdges
        Of 2 m faces; face f is f on the first sheet and m + f on the second. Turning a face over swaps corners 1 and 2.
        Vertex v becomes v and v + n, one for each orientation of the faces around it. Fans that meet in v alone are
        assigned to the two copies arbitrarily: in v, a path may change sheets. Edges of more than two faces become
        boundaries.
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
    vertex = np.concatenate([F.ravel(), F[:, BACK_CORNERS].ravel()])
    lengths = np.concatenate([triangulation.l, triangulation.l[:, BACK_CORNERS]])
    # Corners around one vertex of the cover are linked through the sides that they share.
    half_edge = np.flatnonzero(twin >= 0)
    following, preceding = next_half_edge(half_edge), previous_half_edge(half_edge)
    mate_following, mate_preceding = next_half_edge(twin[half_edge]), previous_half_edge(twin[half_edge])
    links = sp.coo_array(
        (
            np.ones(2 * len(half_edge), np.int8),
            (np.concatenate([following, preceding]), np.concatenate([mate_preceding, mate_following])),
        ),
        shape=(2 * size, 2 * size),
    )
    from scipy.sparse import csgraph

    fan = csgraph.connected_components(links, directed=False)[1]
    # The copy of a fan with the smaller label keeps the vertex's number.
    first, second = fan[sheet_of_first[:size]], fan[sheet_of_first[size:]]
    is_second = np.empty(2 * size, bool)
    is_second[sheet_of_first[:size]] = first > second
    is_second[sheet_of_first[size:]] = second > first
    vertex = (vertex + n * is_second).astype(np.int32)
    itself, aligned = np.arange(2 * size, dtype=np.int32), np.ones(2 * size, np.uint8)
    return HalfEdges(vertex, twin.astype(np.int32), itself, aligned, lengths.ravel())
