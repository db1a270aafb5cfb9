"""Shortest paths: traced down a distance, then straightened until they are locally shortest."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.curves import tracing
from heat_igl.curves.places import places, snapped
from heat_igl.errors import MeshError, SourceError
from heat_igl.heat_method import HeatMethodSolver, geodesic_distance
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, as_simplices
from heat_igl.sources import Sources, source_set
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["shortest_paths"]

# A path passes a source vertex whose distance is below the offset of the source by more than this share, the rounding
# of refined distances: the vertex is nearer to another source.
_SAME_DISTANCE = 1e-9


def shortest_paths(
    mesh: MeshLike,
    distance: ArrayLike | HeatMethodSolver | None,
    targets: Sources,
    sources: Sources | None = None,
) -> list[SurfaceCurve]:
    """Locally shortest paths from targets to the sources of a distance.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    distance : (n,) array_like, HeatMethodSolver or None
        Distance from the sources, or a solver to compute it; None for `geodesic_distance`. It decides which way around
        the surface a path takes: the more accurate the distance (``refine="exact"``), the more often this is the
        shortest way. A second path is traced if the first is longer than the distance by a thousandth.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints
        Start of each path: vertices, in the order given and with repetitions, or points on faces.
    sources : optional
        Possible ends of the paths, as ``solver.distance`` takes them; by default the vertices at distance 0. Needed
        with a solver, and for sources inside faces. On a curve, a path ends at the nearest point of the segment in the
        face in which it arrives.

    Returns
    -------
    list of SurfaceCurve
        For each target a path to a source, on the faces of `mesh`, of length ``path.lengths(mesh).sum()``. The path is
        straight across edges, and has an angle of at least pi on both sides of the vertices that it passes, so no path
        nearby is shorter. The path of a target that is a source is a single segment of length 0.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If targets or sources are no points of the mesh, or no source can be reached from a target.
    ValueError
        If the distance has the wrong shape, or is NaN or negative somewhere.

    Notes
    -----
    The steepest descent of the distance, linear in each face, gives a strip of faces. A funnel finds the shortest path
    in the strip. Where this path bends at a vertex with an angle below pi on the other side, the strip is moved to the
    other side, until no such vertex is left (Xin and Wang 2007). At an edge of three faces or more, a strip may go from
    any of them into any other, and around a vertex of this edge there are several ways; the shortest is taken. If the
    descent ends at a vertex that is no source, it goes on along the edges that rise least. A path is not moved past two
    vertices in one place.

    Across large faces distance is far from linear, and the descent may pass a vertex on the wrong side. So if a path is
    longer than the distance, a second path is traced: straight from edge to edge, either towards a vertex or towards
    the source as the distances at the ends of an edge place it in the plane of the face, whichever agrees best with the
    distance left. The shorter of the two paths is returned.
    """
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral:
        raise MeshError("paths need triangles, but the mesh is tetrahedral")
    values = _values(mesh, distance, sources)
    face, barycentric = places("targets", mesh, targets)
    goals = tracing.goals(*_goals(mesh, values, sources))
    lost = (goals.escape < 0) & ~_roots(mesh, goals.is_source, goals.first_inside)
    lost = lost[mesh.F[face, 0]]
    if lost.any():
        first = int(np.argmax(lost))
        raise SourceError(
            f"from targets[{first}] no source can be reached ({int(lost.sum())} of {len(lost)} lie on other "
            "components): leave out targets at infinite distance"
        )
    most_steps = 4 * mesh.n_faces + 100
    faces, points, first_segment = tracing.trace(tracing.surface(mesh), values, goals, face, barycentric, most_steps)
    parts = np.split(np.arange(len(faces)), first_segment[1:-1])
    return [SurfaceCurve(faces[part], points[part, 0], points[part, 1]) for part in parts]


def _values(mesh: Mesh, distance: ArrayLike | HeatMethodSolver | None, sources: Sources | None) -> FloatArray:
    if isinstance(distance, HeatMethodSolver):
        if sources is None:
            raise SourceError("a solver needs sources: name them, or pass a distance in its place")
        distance = distance.distance(sources)
    elif distance is None:
        if sources is None:
            raise SourceError("sources are missing: name them, or pass a distance that is 0 at them")
        distance = geodesic_distance(mesh, sources)
    array: AnyArray = np.asarray(distance)
    if array.dtype.kind not in "iuf" or array.shape != (mesh.n_vertices,):
        raise ValueError(
            f"distance must be real numbers of shape ({mesh.n_vertices},), not {array.dtype} of shape {array.shape}"
        )
    values = array.astype(np.float64)
    bad = np.isnan(values) | (values < 0)
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(
            f"distance[{first}] is {values[first]} ({int(bad.sum())} of {len(values)} are NaN or negative)"
        )
    return values


def _goals(
    mesh: Mesh, values: FloatArray, sources: Sources | None
) -> tuple[BoolArray, IntArray, FloatArray, FloatArray, IntArray]:
    """Where paths may end; the arguments of `tracing.goals`."""
    if sources is None:
        if values.min() > 0:
            raise SourceError("distance is 0 at no vertex: name the sources, where paths may end")
        sources = values == 0
    found = source_set(sources, mesh.n_vertices, mesh.F)
    points, segments = found.points, found.segments
    face = np.concatenate([points.faces, segments.faces])
    start, end = (snapped(np.concatenate([points.barycentric, there])) for there in (segments.start, segments.end))
    inside, offset = np.stack([start, end], axis=1), np.concatenate([points.offset, segments.offset])

    is_source = np.zeros(mesh.n_vertices, bool)
    row, _, corner = np.nonzero(inside == 1)
    vertex, begins = np.append(found.vertices, mesh.F[face[row], corner]), np.append(found.vertex_offset, offset[row])
    is_source[vertex[values[vertex] >= begins * (1 - _SAME_DISTANCE)]] = True

    face, inside, offset = _on_all_sides(mesh, face, inside, offset)
    first_inside = np.concatenate([[0], np.cumsum(np.bincount(face, minlength=mesh.n_faces))])
    escape = _ways_out(mesh, values, _roots(mesh, is_source, first_inside))
    return is_source, first_inside, inside, offset, escape


def _roots(mesh: Mesh, is_source: BoolArray, first_inside: IntArray) -> BoolArray:
    """Mask (n,) of the vertices that are sources, or corners of faces with sources inside."""
    roots = is_source.copy()
    roots[mesh.F[np.diff(first_inside) > 0]] = True
    return roots


def _on_all_sides(
    mesh: Mesh, face: IntArray, inside: FloatArray, offset: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Segments in faces, sorted by face; a segment on a side, or at a corner, once for each face around it."""
    faces, segments, copies = [face], [inside], [np.arange(len(face))]
    weight = inside.max(axis=1)  # (p, 3): 0 at corners opposite a side that holds the segment
    for row in np.flatnonzero((weight == 0).any(axis=1)):
        f, played = int(face[row]), weight[row] > 0
        others = np.flatnonzero(np.isin(mesh.F, mesh.F[f, played]).sum(axis=1) == played.sum())
        others = others[others != f]
        moved = np.zeros((len(others), 2, 3))
        for c in np.flatnonzero(played):
            at = np.argwhere(mesh.F[others] == mesh.F[f, c])
            moved[at[:, 0], :, at[:, 1]] = inside[row, :, c]
        faces.append(others)
        segments.append(moved)
        copies.append(np.full(len(others), row))
    all_faces = np.concatenate(faces)
    order = np.argsort(all_faces, kind="stable")
    return all_faces[order], np.concatenate(segments)[order], offset[np.concatenate(copies)[order]]


def _ways_out(mesh: Mesh, values: FloatArray, roots: BoolArray) -> IntArray:
    """The next vertex (n,) on the path along edges to a root that rises least; -1 at roots and if there is no path.

    These paths lie in a minimum spanning tree of the edges, ordered by the value at the higher end, then by length.
    """
    n, edges = mesh.n_vertices, mesh.edges
    rank = np.empty(len(edges))
    rank[np.lexsort((mesh.edge_lengths, values[edges].max(axis=1)))] = np.arange(2, len(edges) + 2)
    start = np.flatnonzero(roots)
    rows, columns = np.concatenate([edges[:, 0], np.full(len(start), n)]), np.concatenate([edges[:, 1], start])
    graph = sp.coo_array((np.concatenate([rank, np.ones(len(start))]), (rows, columns)), shape=(n + 1, n + 1))
    tree = csgraph.minimum_spanning_tree(graph.tocsr())
    previous = csgraph.breadth_first_order(tree, n, directed=False)[1][:n]
    return np.where((previous < 0) | (previous == n), -1, previous).astype(np.int64)
