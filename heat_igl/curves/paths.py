"""Shortest paths on a surface: traced down a distance, then straightened until they are locally shortest."""

from __future__ import annotations

import igl
import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.curves import tracing
from heat_igl.errors import MeshError, SourceError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh, SurfaceCurve, SurfacePoints
from heat_igl.sources import Sources, source_set, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["shortest_paths"]

# Barycentric coordinates below this put a point on the side of its face.
_ON_SIDE = 1e-12
# An edge of no length has this one, in mean edge lengths: the kernel divides by it.
_SHORTEST = 1e-12


def shortest_paths(
    mesh: Mesh,
    distance: ArrayLike | HeatMethodSolver,
    targets: Sources,
    sources: Sources | None = None,
) -> list[SurfaceCurve]:
    """Locally shortest paths from targets to the sources of a distance.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    distance : (n,) array_like or HeatMethodSolver
        Distance from the sources, or a solver to compute it. It decides which way around the surface a path takes, so
        the better it is (``refine="unfold"``), the more often that is the shortest one. A path longer than it says by
        a thousandth is looked for once more.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints
        Where the paths begin: vertices, as often and in the order given, or points on faces.
    sources : optional
        Where paths may end: whatever ``solver.distance`` takes; by default the vertices where the distance is 0. Needed
        with a solver, and where sources lie inside faces. On a curve, a path ends at the nearest point of the segment
        in the face where it arrives.

    Returns
    -------
    list of SurfaceCurve
        For each target a path to a source, on the faces of `mesh`; ``path.lengths(mesh).sum()`` is its length. It is
        straight where it crosses edges, and passes vertices with an angle of pi or more whichever way around them, so
        that no path nearby is shorter. The path of a target that is a source is a single segment of length 0.

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
    The steepest descent of the distance, linear in each face, gives a strip of faces. The shortest path in the
    strip is found by a funnel, and where it bends at a vertex that it could pass another way with an angle below
    pi, the strip is led there, until no such vertex is left (Xin and Wang 2007). Where three faces or more meet at
    an edge, a strip goes over it from any of them into any other, and the ways around a vertex of it branch; the
    shortest is taken. Where the descent ends at a vertex that is no source, it goes on along the edges that rise
    least. A path is not moved past two vertices in one place.

    Across large faces distance is far from linear, and the descent may pass a vertex on the wrong side. So where a
    path is longer than the distance says, a second one goes straight from edge to edge towards vertices, or where
    the distances at the ends of an edge place the source in the plane of the face, whichever agrees best with the
    distance that is left; the shorter of the two is kept.
    """
    if mesh.is_tetrahedral:
        raise MeshError("paths need triangles, but the mesh is tetrahedral")
    values = _values(mesh, distance, sources)
    face, barycentric = _points("targets", mesh, targets)
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
    faces, points, first_segment = tracing.trace(_surface(mesh), values, goals, face, barycentric, most_steps)
    parts = np.split(np.arange(len(faces)), first_segment[1:-1])
    return [SurfaceCurve(faces[part], points[part, 0], points[part, 1]) for part in parts]


def _values(mesh: Mesh, distance: ArrayLike | HeatMethodSolver, sources: Sources | None) -> FloatArray:
    if isinstance(distance, HeatMethodSolver):
        if sources is None:
            raise SourceError("a solver needs sources: name them, or pass a distance in its place")
        distance = distance.distance(sources)
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


def _points(name: str, mesh: Mesh, points: Sources) -> tuple[IntArray, FloatArray]:
    """Faces and barycentric coordinates of points, or of vertices in the order given."""
    if isinstance(points, SurfacePoints):
        points.positions(mesh)  # which checks the faces
        return points.faces, _snapped(points.barycentric)
    vertex_sources(points, mesh.n_vertices)  # which checks the vertices
    vertex: AnyArray = np.atleast_1d(np.asarray(points))
    vertex = np.flatnonzero(vertex) if vertex.dtype.kind == "b" else vertex.astype(np.int64)
    corner_at = np.full(mesh.n_vertices, -1)
    corner_at[mesh.F.ravel()] = np.arange(mesh.F.size)
    corner = corner_at[vertex]
    if (corner < 0).any():
        first = int(np.argmax(corner < 0))
        raise SourceError(f"{name}[{first}] = {vertex[first]} is a vertex that no face uses: no path starts there")
    return corner // 3, np.eye(3)[corner % 3]


def _snapped(barycentric: FloatArray) -> FloatArray:
    """Next to nothing off a side or a corner is on it."""
    weights = np.where(barycentric < _ON_SIDE, 0.0, barycentric)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _goals(
    mesh: Mesh, values: FloatArray, sources: Sources | None
) -> tuple[BoolArray, IntArray, FloatArray, FloatArray, IntArray]:
    """Where paths may end; what `tracing.goals` takes."""
    if sources is None:
        if values.min() > 0:
            raise SourceError("distance is 0 at no vertex: name the sources, where paths may end")
        sources = values == 0
    found = source_set(sources, mesh.n_vertices, mesh.F)
    points, segments = found.points, found.segments
    face = np.concatenate([points.faces, segments.faces])
    start, end = (_snapped(np.concatenate([points.barycentric, there])) for there in (segments.start, segments.end))
    inside, offset = np.stack([start, end], axis=1), np.concatenate([points.offset, segments.offset])

    # A vertex that is nearer to another source than its own offset is passed.
    is_source = np.zeros(mesh.n_vertices, bool)
    row, _, corner = np.nonzero(inside == 1)
    vertex, begins = np.append(found.vertices, mesh.F[face[row], corner]), np.append(found.vertex_offset, offset[row])
    is_source[vertex[values[vertex] >= begins * (1 - 1e-9)]] = True

    face, inside, offset = _on_all_sides(mesh, face, inside, offset)
    first_inside = np.concatenate([[0], np.cumsum(np.bincount(face, minlength=mesh.n_faces))])
    escape = _ways_out(mesh, values, _roots(mesh, is_source, first_inside))
    return is_source, first_inside, inside, offset, escape


def _roots(mesh: Mesh, is_source: BoolArray, first_inside: IntArray) -> BoolArray:
    """The vertices that are sources, or corners of faces with sources inside."""
    roots = is_source.copy()
    roots[mesh.F[np.diff(first_inside) > 0]] = True
    return roots


def _on_all_sides(
    mesh: Mesh, face: IntArray, inside: FloatArray, offset: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Segments in faces, sorted by face; one that lies on a side, or at a corner, once in each face that has it."""
    faces, segments, copies = [face], [inside], [np.arange(len(face))]
    weight = inside.max(axis=1)  # (p, 3): 0 for corners that play no part
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
    """For each vertex the next on the way along edges to a root that rises least; -1 at roots, and if there is none.

    The ways are those in a minimum spanning tree whose edges weigh as much as their higher end, and among equals as
    much as they are long.
    """
    n, edges = mesh.n_vertices, mesh.edges
    rank = np.empty(len(edges))
    rank[np.lexsort((mesh.edge_lengths, values[edges].max(axis=1)))] = np.arange(2, len(edges) + 2)
    start = np.flatnonzero(roots)
    rows, columns = np.concatenate([edges[:, 0], np.full(len(start), n)]), np.concatenate([edges[:, 1], start])
    graph = sp.coo_array((np.concatenate([rank, np.ones(len(start))]), (rows, columns)), shape=(n + 1, n + 1))
    tree = csgraph.minimum_spanning_tree(graph.tocsr())
    before = csgraph.breadth_first_order(tree, n, directed=False)[1][:n]
    return np.where((before < 0) | (before == n), -1, before).astype(np.int64)


def _surface(mesh: Mesh) -> tracing.Surface:
    """The tables of the kernel."""
    # Not mollified: the height that this gives a flat triangle would bend the paths across.
    lengths = np.maximum(igl.edge_lengths(mesh.V, mesh.F), _SHORTEST * mesh.edge_lengths.mean())
    return tracing.surface(
        mesh.F, lengths, _angles(lengths), mesh.facets.of_face, mesh.n_vertices, len(mesh.facets.n_faces)
    )


def _angles(l: FloatArray) -> FloatArray:  # noqa: E741
    """Angle at each corner from lengths opposite to it, accurate for needles and caps."""
    beside = np.roll(l, -1, axis=1), np.roll(l, 1, axis=1)
    half = l.sum(axis=1, keepdims=True) / 2
    opposite = np.maximum((half - beside[0]) * (half - beside[1]), 0.0)
    return np.asarray(2 * np.arctan2(np.sqrt(opposite), np.sqrt(np.maximum(half * (half - l), 0.0))))
