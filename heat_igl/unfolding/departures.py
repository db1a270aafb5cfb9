"""In which directions the exact paths from one vertex leave it, on a mesh that is asked once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import corner_angles, intrinsic_triangulation, polar_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.kernels.window_surface import SEVERAL_FANS
from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding.half_edges import HalfEdges, from_mesh
from heat_igl.unfolding.window_search import Searched, search, starts_at

__all__ = ["departures_from"]

# By how much the lengths of an edge before and after mollification may differ, relatively, and two angles.
_SAME_LENGTH, _SAME_ANGLE = 1e-7, 1e-5
# So many edges have to tell how the angles around the source count.
_FEWEST_EDGES = 2


class _Spokes(NamedTuple):
    """The edges from a vertex: other ends, lengths and angles (k,), and the corners between each and the next."""

    end: IntArray
    length: FloatArray
    angle: FloatArray
    corner: IntArray


def departures_from(mesh: Mesh, source: int) -> tuple[FloatArray, FloatArray] | None:
    """Exact distance (n,), and the polar angle (n,) at which the path to each vertex leaves the source.

    For this, neither the polar angles of other vertices nor the history of the flips are needed.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    source : int
        A vertex.

    Returns
    -------
    tuple or None
        The angle is 0 at the source and where it does not reach. None if the faces are no oriented manifold, or if
        fewer than two edges of the mesh at the source are left in the Delaunay triangulation.
    """
    given = _given_spokes(mesh, source)
    if given is None:
        return None
    spokes, scale, on_boundary = given
    edges = from_mesh(mesh, source)
    if (edges.tables.twin == -2).any() or not edges.tables.aligned.all():
        return None
    around = _around(edges, source)
    first = _first_angle(spokes, around, scale)
    if first is None:
        return None
    done = search(edges, starts_at(edges, np.array([source]), None, None, None, None), directed=True)
    if (edges.tables.kind == SEVERAL_FANS).any():
        return None
    begin = np.zeros(len(edges.tables.vertex))
    begin[around.corner] = first + scale * around.angle
    departure = _departures(done, begin, scale, int(edges.number[source]))
    if on_boundary:
        departure = np.clip(departure, 0.0, np.pi)
    return edges.unscaled(done.found.distance[edges.number]), departure[edges.number]


def _given_spokes(mesh: Mesh, source: int) -> tuple[_Spokes, float, bool] | None:
    """The edges of the mesh at a vertex with their polar angles, the scale of these, and whether it is on the boundary.

    None if the faces there are not one oriented fan.
    """
    F = mesh.F[np.unique(np.flatnonzero(mesh.F.ravel() == source) // 3)]
    used, numbers = np.unique(F, return_inverse=True)
    star = intrinsic_triangulation(Mesh(mesh.V[used], numbers.reshape(-1, 3)))
    centre = int(np.searchsorted(used, source))
    try:
        polar = polar_angles(star)
    except MeshError:
        return None
    leaves = np.flatnonzero(star.tail(np.arange(F.size)) == centre)
    spokes = _Spokes(used[star.head(leaves)], star.l.ravel()[leaves], polar.leaving[leaves], next_half_edge(leaves))
    return spokes, float(polar.scale[centre]), bool(polar.on_boundary[centre])


def _around(edges: HalfEdges, source: int) -> _Spokes:
    """The edges at a vertex of the tables, counterclockwise, with the sums of the angles of the faces before them."""
    t = edges.tables
    start = corner = int(t.corner_of_vertex[edges.number[source]])
    # Clockwise to the boundary, if there is one.
    while (side := t.twin[previous_half_edge(corner)]) >= 0 and (before := int(previous_half_edge(side))) != start:
        corner = before
    if side < 0:
        start = corner
    corners, corner = [start], start
    while (side := t.twin[next_half_edge(corner)]) >= 0 and (corner := int(next_half_edge(side))) != start:
        corners.append(corner)
    found = np.array(corners)
    angles = corner_angles(t.length.reshape(-1, 3)[found // 3])[np.arange(len(found)), found % 3]
    end = edges.old_vertex[t.vertex[next_half_edge(found)]]
    return _Spokes(end, edges.unscaled(t.length[previous_half_edge(found)]), np.cumsum(angles) - angles, found)


def _first_angle(given: _Spokes, around: _Spokes, scale: float) -> float | None:
    """The polar angle of the first edge in the tables, from the edges of the mesh that are still there."""
    i, j = np.nonzero(
        (given.end[:, None] == around.end)
        & (np.abs(given.length[:, None] - around.length) <= _SAME_LENGTH * around.length)
    )
    if len(i) < _FEWEST_EDGES:
        return None
    ahead = given.angle[i] - scale * around.angle[j]
    off = ahead - ahead[0]
    return None if np.abs(off - 2 * np.pi * np.rint(off / (2 * np.pi))).max() > _SAME_ANGLE else float(ahead[0])


def _departures(done: Searched, begin: FloatArray, scale: float, source: int) -> FloatArray:
    """Polar angle (n,) of the paths by the numbers of the tables; corners at the source begin at `begin` (3 m,)."""
    root = done.found.root.astype(np.int64)
    corner, direction = done.leaving
    top = np.arange(len(root))
    bent = (root >= 0) & (root != source)
    top[bent] = root[bent]
    while not ((further := top[top]) == top).all():
        top = further
    angle = begin[corner] + scale * np.arctan2(direction[:, 1], direction[:, 0])
    found = np.where((root >= 0) & (np.arange(len(root)) != source), angle[top], 0.0)
    return np.asarray(found)
