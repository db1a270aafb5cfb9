"""Shortest paths: exact ones, or traced down a distance and straightened until they are locally shortest."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.curves import tracing
from heat_igl.curves.places import places, snapped
from heat_igl.errors import MeshError, SourceError, as_array
from heat_igl.geodesic import Solver, geodesic_distance
from heat_igl.mesh import Mesh, MeshLike, MeshPart, SurfaceCurve, SurfacePoints, as_simplices
from heat_igl.sources import Sources, SourceSet, named_vertices, source_set
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.unfolding import exact_paths

__all__ = ["shortest_path", "shortest_paths"]

# A path passes a source vertex whose distance is below the offset of the source by more than this share, the rounding
# of refined distances: the vertex is nearer to another source.
_SAME_DISTANCE = 1e-9
# A path that is longer than the distance by this share is replaced by an exact one: more than distances by heat are off
# in the mean.
_EXCESS = 0.01


def shortest_paths(
    mesh: MeshLike,
    targets: Sources,
    sources: Sources | None = None,
    *,
    distance: ArrayLike | Solver | None = None,
    region: ArrayLike | None = None,
) -> list[SurfaceCurve]:
    """Shortest paths from targets to the nearest of some sources: exact ones, or along a distance.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints
        Start of each path: vertices, in the order given and with repetitions, or points on faces.
    sources : optional
        Possible ends of the paths, as ``solver.distance`` takes them; by default the vertices at distance 0. Needed
        with a solver, and for sources inside faces. On a curve, a path ends at the nearest point of the segment in the
        face in which it arrives.
    distance : (n,) array_like, GeodesicSolver, HeatMethodSolver or None
        None, or a `GeodesicSolver` whose engine is windows, for exact shortest paths. Otherwise a distance from
        the sources, or a solver to compute it. It decides which way around the surface a path takes: the more accurate
        the distance, the more often this is the shortest way.
    region : (n,) or (m,) array_like of bool, optional
        What exact paths may enter, as for `GeodesicSolver`.

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
    Exact paths are followed back through the windows of the exact distance, see `exact_paths`. The others are
    straightened. The steepest descent of the distance, linear in each face, gives a strip of faces. A funnel finds the
    shortest path in the strip. Where this path bends at a vertex with an angle below pi on the other side, the strip is
    moved to the other side, until no such vertex is left (Xin and Wang 2007). At an edge of three faces or more, a
    strip may go from any of them into any other, and around a vertex of this edge there are several ways; the shortest
    is taken. If the descent ends at a vertex that is no source, it goes on along the edges that rise least. A path is
    not moved past two vertices in one place.

    Across large faces distance is far from linear, and the descent may pass a vertex on the wrong side. So if a path is
    longer than the distance, a second path is traced: straight from edge to edge, either towards a vertex or towards
    the source as the distances at the ends of an edge place it in the plane of the face, whichever agrees best with the
    distance left. The shorter of the two paths is taken. If it is still longer than the distance by one percent, as on
    rough surfaces, an exact path takes its place.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> (path,) = heat_igl.shortest_paths(mesh, targets=19, sources=0)  # along the diagonal of 3 by 4
    >>> round(float(path.lengths(mesh).sum()), 6)
    5.0
    """
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral:
        raise MeshError("paths need triangles, but the mesh is tetrahedral")
    if region is not None:
        if distance is not None:
            raise ValueError("paths in a region are exact: leave distance away")
        return _in_region(mesh, MeshPart.of(mesh, region), targets, _required(None, sources))
    face, barycentric = places("targets", mesh, targets)
    solver = distance if isinstance(distance, Solver) else None
    if distance is None or (solver is not None and solver.plan.engine == "windows"):
        named = _required(solver, sources)
        paths = _exact(mesh, _source_set(mesh, named), face, barycentric, np.arange(len(face)))
        lost = np.setdiff1d(np.arange(len(face)), list(paths))
        if len(lost):
            paths |= _straightened(mesh, geodesic_distance(mesh, named, tolerance=0), named, face, barycentric, lost)
    else:
        values = _values(mesh, distance, sources)
        paths = _straightened(mesh, values, sources, face, barycentric, np.arange(len(face)))
        _refuse_lost(~np.isin(np.arange(len(face)), list(paths)))
        chosen = _source_set(mesh, values == 0 if sources is None else sources)
        longer = _too_long(mesh, values - chosen.offsets.min(), paths, face, barycentric)
        if len(longer):
            paths |= _exact(mesh, chosen, face, barycentric, longer)
    return [paths[i].on(mesh) for i in range(len(face))]


def shortest_path(mesh: MeshLike, a: Sources, b: Sources, *, region: ArrayLike | None = None) -> SurfaceCurve:
    """The exact shortest path from one place to another.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    a, b : int or SurfacePoints
        A vertex, or a point in a face. Of several places `b`, the path leads to the nearest.
    region : (n,) or (m,) array_like of bool, optional
        What the path may enter, as for `GeodesicSolver`.

    Returns
    -------
    SurfaceCurve
        From a to b; its ``length`` is their distance.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If `a` or `b` is no place on the mesh, `a` is several, or no path joins them.

    Examples
    --------
    >>> import heat_igl
    >>> path = heat_igl.shortest_path(heat_igl.shapes.strip(4, 3), 0, 19)  # the diagonal of 3 by 4
    >>> round(path.length, 6), path.points[-1].tolist()
    (5.0, [4.0, 3.0, 0.0])
    """
    paths = shortest_paths(mesh, a, b, region=region)
    if len(paths) > 1:
        raise SourceError(f"a must be one place, not {len(paths)}: shortest_paths takes several targets")
    return paths[0]


def _in_region(mesh: Mesh, part: MeshPart, targets: Sources, sources: Sources) -> list[SurfaceCurve]:
    """Exact paths on the faces of a part, by the numbers of the whole mesh."""
    if isinstance(targets, SurfacePoints):
        face, barycentric = places("targets", mesh, targets)
        face = part.numbers_of(face, "targets")
    else:
        part.require_vertices(named_vertices(targets, mesh.n_vertices, "targets"), "targets")
        face, barycentric = places("targets", part.mesh, targets)
    found = exact_paths(part.mesh, _source_set(mesh, sources).within(part), face, barycentric)
    _refuse_lost(np.isinf(found.distance))
    paths = _curves(np.arange(len(face)), part.faces[found.faces], found.points, found.first)
    if len(paths) < len(face):
        missing = np.setdiff1d(np.arange(len(face)), list(paths))
        raise MeshError(f"the path from targets[{missing[0]}] is lost among faces without area: repair these faces")
    return [paths[i].on(mesh) for i in range(len(face))]


def _straightened(
    mesh: Mesh, values: FloatArray, sources: Sources | None, face: IntArray, barycentric: FloatArray, which: IntArray
) -> dict[int, SurfaceCurve]:
    """Paths traced down a distance (n,) from `which` of the places, and straightened."""
    goals = tracing.goals(*_goals(mesh, values, sources))
    lost = (goals.escape < 0) & ~_roots(mesh, goals.is_source, goals.first_inside)
    _refuse_lost(lost[mesh.F[face[which], 0]])
    most_steps = 4 * mesh.n_faces + 100
    found = tracing.trace(tracing.surface(mesh), values, goals, face[which], barycentric[which], most_steps)
    return _curves(which, *found)


def _exact(
    mesh: Mesh, sources: SourceSet, face: IntArray, barycentric: FloatArray, which: IntArray
) -> dict[int, SurfaceCurve]:
    """Exact paths from `which` of the places, without those that are lost."""
    found = exact_paths(mesh, sources, face[which], barycentric[which])
    _refuse_lost(np.isinf(found.distance))
    return _curves(which, found.faces, found.points, found.first)


def _curves(which: IntArray, faces: IntArray, points: FloatArray, first: IntArray) -> dict[int, SurfaceCurve]:
    """Paths by the numbers `which`; segments of the i-th path are ``first[i]`` to ``first[i + 1]``."""
    parts = np.split(np.arange(len(faces)), first[1:-1])
    curves = {}
    for number, part in zip(which, parts, strict=True):
        if len(part):
            curves[int(number)] = SurfaceCurve(faces[part], points[part, 0], points[part, 1])
    return curves


def _refuse_lost(lost: BoolArray) -> None:
    if lost.any():
        first = int(np.argmax(lost))
        raise SourceError(
            f"from targets[{first}] no source can be reached ({int(lost.sum())} of {len(lost)} lie on other "
            "components): leave out targets at infinite distance"
        )


def _too_long(
    mesh: Mesh, values: FloatArray, paths: dict[int, SurfaceCurve], face: IntArray, barycentric: FloatArray
) -> IntArray:
    """Which paths are longer than the distance (n,) at their target, linear in its face, by more than `_EXCESS`."""
    length = np.array([paths[i].lengths(mesh).sum() for i in range(len(face))])
    with np.errstate(invalid="ignore"):  # 0 times infinity, beyond a cutoff
        at_target = (values[mesh.F[face]] * barycentric).sum(axis=1)
    return np.flatnonzero(length > (1 + _EXCESS) * at_target)


def _required(solver: Solver | None, sources: Sources | None) -> Sources:
    if sources is not None:
        return sources
    if solver is None:
        raise SourceError("sources are missing: name them, or pass a distance that is 0 at them")
    raise SourceError("a solver needs sources: name them, or pass a distance in its place")


def _source_set(mesh: Mesh, sources: Sources) -> SourceSet:
    return source_set(sources, mesh.n_vertices, mesh.F).with_vertices_moved(mesh.originals)


def _values(mesh: Mesh, distance: ArrayLike | Solver, sources: Sources | None) -> FloatArray:
    if isinstance(distance, Solver):
        distance = distance.distance(_required(distance, sources))
    given = as_array("distance", distance)
    if given.dtype.kind not in "iuf" or given.shape != (mesh.n_vertices,):
        raise ValueError(
            f"distance must be real numbers of shape ({mesh.n_vertices},), not {given.dtype} of shape {given.shape}"
        )
    values = given.astype(np.float64)
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
    found = _source_set(mesh, sources)
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
    rows, columns = rows.astype(np.int32), columns.astype(np.int32)  # scipy 1.15 builds no tree from others
    graph = sp.coo_array((np.concatenate([rank, np.ones(len(start))]), (rows, columns)), shape=(n + 1, n + 1))
    tree = csgraph.minimum_spanning_tree(graph.tocsr())
    previous = csgraph.breadth_first_order(tree, n, directed=False)[1][:n]
    return np.where((previous < 0) | (previous == n), -1, previous).astype(np.int64)
