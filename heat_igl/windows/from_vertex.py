"""The exact log map of one vertex, on a mesh that is asked once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.intrinsic import corner_angles, intrinsic_triangulation, polar_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.kernels.windows.surface import SEVERAL_FANS
from heat_igl.mesh import Mesh
from heat_igl.sources import source_set
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.directions import first_parts
from heat_igl.windows.engine import Invariants
from heat_igl.windows.exact import Leaving, Searched, search, starts_at
from heat_igl.windows.tables import Tables, from_mesh

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


def vectors_from(mesh: Mesh, source: int) -> FloatArray | None:
    """Vectors (n, 2) of the exact distance, in the direction in which the path to each vertex leaves the source.

    For this, neither the polar angles of other vertices nor the history of the flips are needed.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    source : int
        A vertex.

    Returns
    -------
    (n, 2) float64 or None
        In the frame of the source; 0 at the source and where it does not reach. None if the faces are no oriented
        manifold, if fewer than two edges of the mesh at the source are left in the Delaunay triangulation, or if the
        distance contradicts itself.
    """
    given = _given_spokes(mesh, source)
    if given is None:
        return None
    spokes, scale, on_boundary = given
    tables = from_mesh(mesh, source)
    if (tables.edges.twin == -2).any() or not tables.edges.aligned.all():
        return None
    around = _around(tables, source)
    first = _first_angle(spokes, around, scale)
    if first is None:
        return None
    done = search(tables, starts_at(tables, np.array([source]), None, None, None, None), directed=True)
    leaving = done.leaving
    if leaving is None or (tables.kind == SEVERAL_FANS).any():
        return None
    begin = np.zeros(len(tables.edges.vertex))
    begin[around.corner] = first + scale * around.angle
    top, straight, seen = _first_parts(done, leaving, int(tables.number[source]))
    angle = begin[leaving.corner[straight]] + scale * seen
    if on_boundary:
        angle = np.clip(angle, 0.0, np.pi)
    unit = np.zeros((len(top), 2))
    unit[straight, 0], unit[straight, 1] = np.cos(angle), np.sin(angle)
    distance = tables.unscaled(done.found.distance)[tables.number]
    chosen = source_set(source, mesh.n_vertices, mesh.F)
    if Invariants(mesh.F, mesh.components, mesh.V).contradiction(distance, chosen) is not None:
        return None
    return np.asarray(np.where(np.isfinite(distance), distance, 0.0)[:, None] * unit[top][tables.number])


def _given_spokes(mesh: Mesh, source: int) -> tuple[_Spokes, float, bool] | None:
    """The edges of the mesh at a vertex with their polar angles, the scale of these, and whether it is on the boundary.

    None if the faces there are not one oriented fan.
    """
    F = mesh.F[np.unique(np.flatnonzero(mesh.F.ravel() == source) // 3)]
    if not len(F):
        return None
    used, numbers = np.unique(F, return_inverse=True)
    star = intrinsic_triangulation(Mesh(mesh.V[used], numbers.reshape(-1, 3)))
    centre = int(np.searchsorted(used, source))
    try:
        polar = polar_angles(star)
    except MeshError:
        return None
    leaves = np.flatnonzero(star.tail(np.arange(F.size)) == centre)
    spokes = _Spokes(used[star.head(leaves)], star.l.ravel()[leaves], polar.outgoing[leaves], next_half_edge(leaves))
    return spokes, float(polar.scale[centre]), bool(polar.on_boundary[centre])


def _around(tables: Tables, source: int) -> _Spokes:
    """The edges at a vertex of the tables, counterclockwise, with the sums of the angles of the faces before them."""
    t = tables.edges
    start = int(tables.corner_of_vertex[tables.number[source]])
    clockwise, is_closed = _fan(t.twin, start, 2)
    found = np.array(_fan(t.twin, start if is_closed else clockwise[-1], 1)[0])
    angles = corner_angles(t.length.reshape(-1, 3)[found // 3])[np.arange(len(found)), found % 3]
    end = tables.old_vertex[t.vertex[next_half_edge(found)]]
    return _Spokes(end, tables.unscaled(t.length[previous_half_edge(found)]), np.cumsum(angles) - angles, found)


def _fan(twin: AnyArray, start: int, step: int) -> tuple[list[int], bool]:
    """The corners of a vertex from one on, counterclockwise for step 1 and clockwise for 2; whether they close up."""
    corners = [start]
    while True:
        corner = corners[-1]
        side = int(twin[corner - corner % 3 + (corner + step) % 3])
        corner = side - side % 3 + (side + step) % 3
        if side < 0 or corner == start:
            return corners, side >= 0
        corners.append(corner)


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


def _first_parts(done: Searched, leaving: Leaving, source: int) -> tuple[IntArray, IntArray, FloatArray]:
    """Of each path, the vertex (n,) that the first straight part leads to; these vertices (k,), and angles (k,) there.

    Angles count from the beginning of the corner out of which a path leaves the source.
    """
    root = done.found.root.astype(np.int64)
    is_first = root == source
    is_first[source] = False
    straight = np.flatnonzero(is_first)
    x, y = leaving.direction[straight].T
    return first_parts(root), straight, np.arctan2(y, x)
