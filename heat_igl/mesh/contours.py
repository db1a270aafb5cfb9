"""Curves on a mesh: where values cross a level, along edges, around regions, and segments joined to curves."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heat_igl.errors import SourceError, as_array, truth
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_triangles
from heat_igl.mesh.surface_points import SurfaceCurve
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray


class Crossings(NamedTuple):
    """Crossings of a level with the faces (s,) that have vertices on both sides of it.

    `apex` (s,) is the corner alone on one side, and `is_below` (s,) says whether that is below the level; `toward`
    (s, 2) is where the level is between the apex, at 0, and the next corner, at 1, and the corner after that.
    """

    faces: IntArray
    apex: IntArray
    toward: FloatArray
    is_below: BoolArray


def crossings(mesh: Mesh, values: FloatArray, level: float) -> Crossings:
    """The faces in which `values` (n,), linear in each, cross `level`; a value equal to it counts as above."""
    # Corner by corner is faster than along an axis of three.
    first, second, third = ((values >= level)[corner] for corner in mesh.F.T)
    faces = np.flatnonzero((first != second) | (first != third))
    faces = faces[np.isfinite(values[mesh.F[faces]]).all(axis=1)]
    above = np.stack([first[faces], second[faces], third[faces]], axis=1)
    is_below = above.sum(axis=1) == 2
    apex = np.argmax(above != is_below[:, None], axis=1)
    corner = mesh.F[faces, apex]
    toward = np.empty((len(faces), 2))
    for i in (0, 1):
        other = mesh.F[faces, (apex + 1 + i) % 3]
        # From the lower end in both faces of an edge, so that both have the same bits; halves cannot overflow.
        low, high = np.where(is_below, corner, other), np.where(is_below, other, corner)
        from_low = (level / 2 - values[low] / 2) / (values[high] / 2 - values[low] / 2)
        toward[:, i] = np.where(is_below, from_low, 1 - from_low)
    return Crossings(faces, apex, toward, is_below)


class Segments(NamedTuple):
    """Directed straight segments in faces (s,), from `start` to `end`, (s, 3) in barycentric coordinates.

    The labels `ends` (s, 2) of two ends are the same if they are in one place.
    """

    faces: IntArray
    start: FloatArray
    end: FloatArray
    ends: IntArray


def level_segments(mesh: Mesh, values: FloatArray, level: float) -> Segments:
    """The segments at which `values` (n,) cross `level`, lower values on the left; ends are labelled by edges."""
    found = crossings(mesh, values, level)
    count = len(found.faces)
    rows = np.arange(count)
    start, end = np.zeros((count, 3)), np.zeros((count, 3))
    for i, point in ((0, start), (1, end)):
        point[rows, found.apex] = 1 - found.toward[:, i]
        point[rows, (found.apex + 1 + i) % 3] = found.toward[:, i]
    # A segment runs from the edge between the apex and the next corner to the edge between the apex and the corner
    # after that, each opposite the third corner: the apex is on the left.
    ends = np.stack([mesh.facets.of_face[found.faces, (found.apex + 2 - i) % 3] for i in (0, 1)], axis=1)
    turned = ~found.is_below
    start[turned], end[turned] = end[turned], start[turned]
    ends[turned] = ends[turned, ::-1]
    return Segments(found.faces, start, end, ends)


def joined_segments(segments: Segments, mesh: Mesh) -> list[SurfaceCurve]:
    """Segments joined to curves on a mesh, in the order of their first segments; those of no length are left out."""
    faces, start, end, ends = segments
    has_length = (start != end).any(axis=1)
    curves = []
    for chain, is_closed in _chains(ends):
        segment, is_reversed = chain // 2, chain % 2 == 1
        kept = has_length[segment]
        segment, is_reversed = segment[kept], is_reversed[kept, None]
        if len(segment):
            first = np.where(is_reversed, end[segment], start[segment])
            last = np.where(is_reversed, start[segment], end[segment])
            curves.append(SurfaceCurve(faces[segment], first, last, is_closed, mesh))
    return curves


def _chains(ends: IntArray) -> list[tuple[IntArray, bool]]:
    """Chains of segments, and whether each is closed, by the labels (s, 2) of their ends.

    Two ends are joined if they, and no other, have the same label. A chain holds ``2 i`` for segment i and ``2 i + 1``
    for segment i reversed. The segment with the smallest i of a chain is not reversed. Chains are sorted by this i, and
    closed ones begin with it.
    """
    order = np.argsort(ends.ravel(), kind="stable")
    label = ends.ravel()[order]
    _, first, count = np.unique(label, return_index=True, return_counts=True)
    pair = first[count == 2]
    joined = np.full(ends.size, -1)
    joined[order[pair]], joined[order[pair + 1]] = order[pair + 1], order[pair]
    partner: list[int] = joined.tolist()

    def follow(oriented: int, stop: int) -> list[int]:
        # Ends 2 i and 2 i + 1 belong to segment i; an oriented segment has the number of the end at which it starts.
        chain = []
        while oriented >= 0:
            chain.append(oriented)
            oriented = partner[oriented ^ 1]
            if oriented == stop:
                break
        return chain

    chains = []
    seen = bytearray(len(ends))
    for i in range(len(ends)):
        if seen[i]:
            continue
        forward = follow(2 * i, 2 * i)
        is_closed = partner[forward[-1] ^ 1] == 2 * i
        before = [] if is_closed else [segment ^ 1 for segment in follow(2 * i + 1, -2)[:0:-1]]
        chain = np.array(before + forward, np.int64)
        for segment in chain.tolist():
            seen[segment // 2] = 1
        chains.append((chain, is_closed))
    return chains


def edge_curve(mesh: MeshLike, vertices: ArrayLike, *, closed: bool = False) -> SurfaceCurve:
    """The curve along edges of a triangle mesh from vertex to vertex.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    vertices : (k,) array_like of int
        Each joined with the next by an edge.
    closed : bool
        Whether an edge leads from the last back to the first.

    Returns
    -------
    SurfaceCurve
        With a segment for each edge.

    Raises
    ------
    SourceError
        If no edge joins a vertex with the next; the message names the first such pair.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(5, 1)
    >>> row = heat_igl.edge_curve(mesh, [0, 1, 2, 3, 4, 5])
    >>> float(row.lengths(mesh).sum())
    5.0
    >>> heat_igl.geodesic_distance(mesh, row)[6:].round(6).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    mesh, closed = as_triangles(mesh, "curves along edges need", SourceError), truth("closed", closed)
    path = np.atleast_1d(as_array("vertices", vertices, SourceError))
    if path.ndim != 1 or path.dtype.kind not in "iu" or len(path) < 2:
        raise SourceError(f"vertices must be two vertex indices or more, not {path.dtype} of shape {path.shape}")
    named = np.append(path, path[0]) if closed else path
    edges, n = mesh.facets.vertices, mesh.n_vertices
    path = named.astype(np.int64)
    known = (path >= 0) & (path < n)
    path[known] = mesh.originals[path[known]]
    pairs = np.sort(np.stack([path[:-1], path[1:]], axis=1), axis=1)
    # Rows of `edges` are in lexicographic order.
    at = np.searchsorted(edges[:, 0] * n + edges[:, 1], pairs[:, 0] * n + pairs[:, 1])
    at = np.minimum(at, len(edges) - 1)
    missing = (edges[at] != pairs).any(axis=1)
    if missing.any():
        first = int(np.flatnonzero(missing)[0])
        raise SourceError(
            f"vertices[{first}] = {named[first]} and the next, {named[first + 1]}, are not joined by an edge: "
            "name neighbours, or project the polyline with curve_on"
        )
    face_of = np.empty(len(edges), np.int64)
    face_of[mesh.facets.of_face.ravel()] = np.repeat(np.arange(mesh.n_faces), 3)
    faces = face_of[at]
    start, end = ((mesh.F[faces] == ends[:, None]).astype(float) for ends in (path[:-1], path[1:]))
    return SurfaceCurve(faces, start, end, is_closed=closed, mesh=mesh)


def region_boundary(
    mesh: MeshLike, *, faces: ArrayLike | None = None, vertices: ArrayLike | None = None
) -> list[SurfaceCurve]:
    """The curves around a region of a triangle mesh, with the region on their left.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    faces : (m,) array_like of bool, optional
        The faces of the region. The curves run along edges.
    vertices : (n,) array_like of bool, optional
        The vertices of the region. The curves run through the midpoints of the edges that leave it.

    Returns
    -------
    list of SurfaceCurve
        In the order of their first faces. The boundary of the mesh is no part of them: a curve that meets it is open.
        Curves along edges also end at a vertex at which the region touches itself.

    Raises
    ------
    SourceError
        If not exactly one of the two masks is given, a mask has the wrong length or type, or the region has no
        boundary inside the mesh; if the mesh is tetrahedral.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> centre = mesh.V[mesh.F].mean(axis=1)
    >>> region = (abs(centre[:, :2] - 0.5) < 0.25).all(axis=1)  # a square of side 1/2
    >>> (curve,) = heat_igl.mesh.region_boundary(mesh, faces=region)
    >>> curve.is_closed, float(curve.lengths(mesh).sum())
    (True, 2.0)
    """
    triangles = as_triangles(mesh, "curves around regions need", SourceError)
    if (faces is None) == (vertices is None):
        raise SourceError("give one mask of the region: faces or vertices")
    if faces is not None:
        segments = _along_edges(triangles, _checked_mask("faces", faces, triangles.n_faces))
    else:
        mask = _checked_mask("vertices", vertices, triangles.n_vertices)
        segments = level_segments(triangles, np.where(mask, 0.0, 1.0), 0.5)
    if not len(segments.faces):
        raise SourceError("the region has no boundary inside the mesh: it is empty, or consists of whole components")
    return joined_segments(segments, triangles)


def _along_edges(mesh: Mesh, is_inside: BoolArray) -> Segments:
    """The sides of faces (m,) of a region at which other faces lie, in the direction around the faces."""
    edges = mesh.facets.of_face
    n_inside = np.bincount(edges[is_inside].ravel(), minlength=len(mesh.facets.vertices))
    leaves = (n_inside > 0) & (n_inside < mesh.facets.n_faces)
    face, corner = np.nonzero(leaves[edges] & is_inside[:, None])
    tail, head = (corner + 1) % 3, (corner + 2) % 3
    ends = np.stack([mesh.F[face, tail], mesh.F[face, head]], axis=1)
    return Segments(face, np.eye(3)[tail], np.eye(3)[head], ends)


def _checked_mask(name: str, mask: ArrayLike | None, size: int) -> BoolArray:
    given = as_array(name, mask, SourceError)
    if given.dtype.kind != "b" or given.shape != (size,):
        raise SourceError(f"{name} must be a mask of bool of shape ({size},), not {given.dtype} of shape {given.shape}")
    return given
