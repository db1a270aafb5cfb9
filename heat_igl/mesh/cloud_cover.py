"""The cover of a surface of points by the two sides of it: an oriented manifold, whatever the surface is."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.cloud_gaps import pinched_vertices
from heat_igl.mesh.cloud_orientation import neighbours_across_edges
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import IntArray

__all__ = ["is_oriented_manifold", "two_sided_cover"]


def is_oriented_manifold(surface: Mesh) -> bool:
    """Whether neighbours of a surface with at most two faces at an edge run alike, and no point has several fans."""
    first, second = neighbours_across_edges(surface.F, surface.n_vertices)
    tail = surface.F.ravel()[_corner(first, 1)]
    runs_alike = tail == surface.F.ravel()[_corner(second, 1)]
    return not (runs_alike.any() or pinched_vertices(surface.F, np.zeros(surface.n_vertices, bool)).any())


def two_sided_cover(surface: Mesh) -> Mesh:
    """Both sides of a surface, glued where its neighbours are: the orientation cover.

    Parameters
    ----------
    surface : Mesh
        m triangles on n vertices, at most two at an edge. Neighbours need not be oriented alike, and a vertex may have
        several fans of triangles.

    Returns
    -------
    Mesh
        2 m triangles: face f of the surface, and as m + f the same from the other side. Vertex v is on the largest fan
        around v, and v + n on the other side of it; smaller fans have vertices of their own, from 2 n on, so that
        each vertex has one fan. Where the surface can be oriented, the sides are two parts; where it cannot, a path
        may lead from one to the other.
    """
    F, n = surface.F, surface.n_vertices
    both = np.concatenate([F, F[:, [0, 2, 1]]])
    first, second = neighbours_across_edges(F, n)
    runs_alike = F.ravel()[_corner(first, 1)] == F.ravel()[_corner(second, 1)]
    pairs = []
    for side in (0, 1):
        # Across an edge along which both run, the neighbour on the same side is the one that is turned over.
        other = np.where(runs_alike, 1 - side, side)
        for end in (1, 2):
            opposite_end = np.where(runs_alike, end, 3 - end)
            of_first = _on_side(_corner(first, end), side, F.size)
            of_second = _on_side(_corner(second, opposite_end), other, F.size)
            pairs.append(np.stack([of_first, of_second], axis=1))
    fan = components(np.concatenate(pairs), both.size)
    return Mesh(*_numbered(surface, both, fan))


def _numbered(surface: Mesh, both: IntArray, fan: IntArray) -> tuple[IntArray, IntArray]:
    """Positions and faces of the cover, from the label of the fan (6 m,) of each corner of its faces (2 m, 3)."""
    n, vertex = surface.n_vertices, both.ravel()
    n_fans = int(fan.max()) + 1
    size, of_fan = np.bincount(fan, minlength=n_fans), np.empty(n_fans, np.int64)
    of_fan[fan] = vertex
    on_other_side = np.empty(n_fans, np.int64)
    half = both.size // 2
    corner = np.arange(half)
    on_other_side[fan[:half]] = fan[_on_side(corner, np.ones(half, np.int64), half)]
    on_other_side[fan[_on_side(corner, np.ones(half, np.int64), half)]] = fan[:half]
    # The largest fan of each vertex, of equal ones that of the first face; then the other side of it.
    first_corner = np.full(n_fans, both.size)
    np.minimum.at(first_corner, fan, np.arange(both.size))
    order = np.lexsort((first_corner, -size, of_fan))
    largest = order[np.diff(of_fan[order], prepend=-1) != 0]
    number = np.full(n_fans, -1)
    number[largest] = of_fan[largest]
    number[on_other_side[largest]] = of_fan[largest] + n
    rest = np.flatnonzero(number < 0)
    number[rest] = 2 * n + np.arange(len(rest))
    V = np.concatenate([surface.V, surface.V, surface.V[of_fan[rest]]])
    return V, number[fan].reshape(-1, 3)


def _corner(half_edges: IntArray, turn: int | IntArray) -> IntArray:
    """The corner 3 f + c at the beginning, for 1, or the end, for 2, of half-edges, which are opposite to corner c."""
    return half_edges - half_edges % 3 + (half_edges + turn) % 3


def _on_side(corners: IntArray, side: IntArray | int, size: int) -> IntArray:
    """Corners of one side as corners of the cover: on the other side, corners 1 and 2 have changed places."""
    turned = corners - corners % 3 + (3 - corners % 3) % 3
    return np.where(np.equal(side, 0), corners, size + turned)
