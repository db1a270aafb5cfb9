"""Gluing: intrinsic triangulations from faces and edge lengths, faces oriented alike, and covers of two sides.

The tufted cover is a manifold double cover of a non-manifold mesh (Sharp and Crane 2020). An edge of more than two
faces cannot be flipped. It may keep a negative weight, and then heat may be negative. The cover has two copies of each
face, a front and a back, on the same vertices. Around an edge, the copy that looks towards the next face is glued to
the copy of that face which looks back; at a boundary edge, the front is glued to the back. The result is a closed
oriented surface of triangles, and all edges can be flipped.
"""

from __future__ import annotations

from dataclasses import replace

import igl
import numpy as np

from heat_igl.errors import MeshError, raise_at_first, real_numbers
from heat_igl.intrinsic.half_edges import HalfEdges, mollify, require_room
from heat_igl.intrinsic.triangulation import (
    BACK_CORNERS,
    Covered,
    IntrinsicTriangulation,
    Merged,
    Turned,
    next_half_edge,
    previous_half_edge,
)
from heat_igl.kernels.mesh import gluing
from heat_igl.mesh import Mesh, connectivity
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# Two lengths of one edge may differ by this share, as after digits are lost in a file: distances change by no more than
# by mollification, which adds up to 1e-8 of the mean length.
_SAME_LENGTH = 1e-9


def from_edge_lengths(l: ArrayLike, F: IntArray, n: int) -> IntrinsicTriangulation:
    """Triangles with given edge lengths, glued along sides with the same two vertices; degenerate ones are mollified.

    ``l[f, c]`` is the length of the edge opposite corner ``c`` of face ``f``. F (m, 3) are faces on n vertices,
    validated like those of a `Mesh`.

    A MeshError if `l` has the wrong shape or an entry that is not a length, or gives an edge two lengths.
    """
    lengths = _checked_lengths(l, F)
    require_room(len(F), n)
    # Of the positions come only lengths, and these are given.
    _, twin, _, aligned, _ = gluing.glue(F, np.zeros((n, 3)), 1.0)
    _require_one_length(lengths, twin)
    return _mollified(lengths, F, n, twin, aligned)


def from_gluing(l: ArrayLike, F: IntArray, n: int, twin: ArrayLike) -> IntrinsicTriangulation:
    """Triangles with given edge lengths that are glued as `twin` says; degenerate ones are mollified.

    Edges may join the same two vertices, or a vertex with itself: F (m, 3) may have a vertex at several corners. ``l[f,
    c]`` is the length of the edge opposite corner ``c`` of face ``f``. ``twin[f, c]`` is the half-edge ``3 g + d``,
    side d of face g, that side c of face f is glued to; -1 on the boundary. An edge that joins a vertex with itself is
    glued such that the faces are oriented alike.

    A MeshError if `l` or `twin` has the wrong shape or a wrong entry, or `l` gives an edge two lengths.
    """
    lengths, half_edge = _checked_lengths(l, F), np.arange(F.size)
    glued = np.asarray(twin)
    if glued.shape != F.shape or glued.dtype.kind not in "iu":
        raise MeshError(
            f"twin must hold one integer per side of F, shape {F.shape}, but it has shape {glued.shape} and holds "
            f"{glued.dtype}"
        )
    mate = glued.astype(np.int64).ravel()
    is_inner = mate != -1
    wrong = is_inner & ((mate < 0) | (mate >= F.size) | (mate == half_edge))
    a, b = half_edge[is_inner & ~wrong], mate[is_inner & ~wrong]
    ends, other = (F.ravel()[[next_half_edge(h), previous_half_edge(h)]] for h in (a, b))
    aligned = np.ones(F.size, bool)
    aligned[a] = (ends[0] == other[1]) & (ends[1] == other[0])
    wrong[a] = (mate[b] != a) | ~(aligned[a] | ((ends[0] == other[0]) & (ends[1] == other[1])))
    if wrong.any():
        h = int(np.flatnonzero(wrong)[0])
        raise MeshError(
            f"twin[{h // 3}, {h % 3}] = {mate[h]} is no half-edge that ends at the same vertices and is glued back to "
            f"{h} ({int(wrong.sum())} entries are not): twin[f, c] = 3 g + d and twin[g, d] = 3 f + c, or -1"
        )
    _require_one_length(lengths, mate)
    return _mollified(lengths, F, n, mate, aligned)


def _checked_lengths(l: ArrayLike, F: IntArray) -> FloatArray:
    lengths = real_numbers("l", l)
    if lengths.shape != F.shape:
        raise MeshError(f"l must have one length per side of F, shape {F.shape}, but it has shape {lengths.shape}")
    raise_at_first(~(np.isfinite(lengths) & (lengths >= 0)), "l", lengths, "is not a length", error=MeshError)
    return lengths


def _require_one_length(lengths: FloatArray, twin: AnyArray) -> None:
    """Half-edges that are glued have the same length."""
    a = np.flatnonzero(twin > np.arange(len(twin)))
    b = twin[a]
    differs = np.abs(lengths.ravel()[a] - lengths.ravel()[b]) > _SAME_LENGTH * lengths.ravel()[a]
    if differs.any():
        one, other = int(a[differs][0]), int(b[differs][0])
        raise MeshError(
            f"l gives the edge between faces {one // 3} and {other // 3} two lengths, {lengths.flat[one]} and "
            f"{lengths.flat[other]} ({int(differs.sum())} edges differ): make them equal, to {_SAME_LENGTH:g} of each"
        )


def intrinsic_triangulation(mesh: Mesh, margin: float | None = None) -> IntrinsicTriangulation:
    """The triangles of `mesh` by their edge lengths; degenerate ones are mollified, see `mollify`."""
    edges, exponent = HalfEdges.of_mesh(mesh)
    lengths = np.ldexp(edges.length, exponent, out=edges.length).reshape(-1, 3)
    return _mollified(lengths, mesh.F, mesh.n_vertices, edges.twin, edges.aligned, margin)


def _mollified(
    l: FloatArray, F: IntArray, n: int, twin: AnyArray, aligned: AnyArray, margin: float | None = None
) -> IntrinsicTriangulation:
    added = mollify(l, F, margin)
    l += added
    return IntrinsicTriangulation(F, l, twin.astype(np.int64), aligned.astype(bool), n, lengthening=float(added.max()))


def lengths_to_divide_by(mesh: Mesh) -> FloatArray:
    """The length (m, 3) of the edge opposite each corner, at least 1e-12 mean edge lengths of the component.

    Not mollified: mollification gives a flat triangle some height, and would bend lines across it.
    """
    l = igl.edge_lengths(mesh.V, mesh.F)
    component = mesh.components[mesh.F[:, 0]]
    mean = np.bincount(component, l.mean(axis=1)) / np.maximum(np.bincount(component), 1)
    mean[mean == 0.0] = l.mean()
    return np.asarray(np.maximum(l, 1e-12 * mean[component, None]))


def each_face_once(triangulation: IntrinsicTriangulation) -> tuple[IntrinsicTriangulation, IntArray]:
    """The triangulation with the first of the faces that have all edges in common, and which (k,) remain, ascending.

    No shortest path crosses from one of them to another. It is `triangulation` itself if no face is there twice; its
    history carries points.
    """
    F, m = triangulation.F, len(triangulation.F)
    order = np.argsort(F, axis=1)
    first, which, _ = connectivity.unique_rows(np.take_along_axis(F, order, axis=1), triangulation.n)
    first = first[which]
    # Edges of more than two faces were never flipped: among them, though not beside others, vertices tell one apart.
    twin = np.take_along_axis(triangulation.twin.reshape(m, 3), order, axis=1)
    is_many = twin == -2
    has_edge_in_common = (is_many & is_many[first]) | (twin // 3 == first[:, None])
    is_copy = has_edge_in_common.all(axis=1) & (first < np.arange(m))
    kept = np.flatnonzero(~is_copy)
    if len(kept) == m:
        return triangulation, kept
    stands = np.where(is_copy, first, np.arange(m))
    corner = np.empty((m, 3), np.int64)
    np.put_along_axis(corner, order, order[stands], axis=1)
    half_edge = (3 * kept[:, None] + np.arange(3)).ravel()
    new = np.full(3 * m + 2, -1)
    new[half_edge], new[-2] = np.arange(len(half_edge)), -2
    once = replace(
        triangulation,
        F=F[kept],
        l=triangulation.l[kept],
        twin=new[triangulation.twin[half_edge]],
        aligned=triangulation.aligned[half_edge],
        history=(*triangulation.history, Merged(np.searchsorted(kept, stands), corner)),
    )
    # Edges that have one or two faces now.
    many = np.flatnonzero(once.twin == -2)
    ends = np.sort(np.stack([once.tail(many), once.head(many)], axis=1), axis=1)
    _, edge, count = connectivity.unique_rows(ends, once.n)
    once.twin[many[count[edge] == 1]] = -1
    many = many[np.argsort(edge, kind="stable")]
    a, b = many[np.repeat(count, count) == 2].reshape(-1, 2).T
    once.twin[a], once.twin[b] = b, a
    once.aligned[a] = once.aligned[b] = once.tail(a) == once.head(b)
    return once, kept


def oriented(triangulation: IntrinsicTriangulation) -> IntrinsicTriangulation:
    """The same surface, with faces reversed until neighbours are oriented alike; a Moebius strip keeps a seam."""
    F = triangulation.F
    turned = (igl.bfs_orient(F)[0] != F).any(axis=1)
    # libigl reverses the row of a face, so corner c becomes 2 - c.
    corner = np.where(turned[:, None], np.arange(3)[::-1], np.arange(3))
    new_of = (3 * np.arange(len(F))[:, None] + corner).ravel()  # new half-edge of old; the map is an involution
    twin = triangulation.twin[new_of]
    twin[twin >= 0] = new_of[twin[twin >= 0]]
    F, lengths = np.take_along_axis(F, corner, 1), np.take_along_axis(triangulation.l, corner, 1)
    aligned = np.ones(F.size, bool)
    inner = np.flatnonzero(twin >= 0)
    aligned[inner] = F.ravel()[next_half_edge(inner)] == F.ravel()[previous_half_edge(twin[inner])]
    history = (*triangulation.history, Turned(turned))
    return replace(triangulation, F=F, l=lengths, twin=twin, aligned=aligned, history=history)


def has_nonmanifold_edges(mesh: Mesh) -> bool:
    """Whether a triangle mesh has an edge of more than two faces."""
    return bool((mesh.facets.n_faces > 2).any())


def tufted_cover(mesh: Mesh) -> IntrinsicTriangulation:
    """The tufted cover of `mesh`: two copies of each triangle, glued to a closed oriented surface on the same vertices.

    It has 2 m triangles, with twice the area and no boundary: row f is the front of face f, row m + f the back.
    Degenerate triangles are mollified. It is not yet Delaunay, see `intrinsic_delaunay`.

    The cover of a closed, manifold, oriented mesh is two copies that meet only in the vertices; one half of their
    Laplacian is the Laplacian of the mesh. Around an edge, faces are joined in the order of their angles, like the
    boundary of a thin solid around the faces; Sharp and Crane show that any order gives a manifold.
    """
    triangulation = intrinsic_triangulation(mesh)
    edge = mesh.facets.of_face.ravel()
    along = triangulation.tail(np.arange(mesh.F.size)) == mesh.facets.vertices[edge, 0]
    return _cover(triangulation, np.lexsort((_angles(mesh), edge)), mesh.facets.n_faces, along)


def closed_cover(triangulation: IntrinsicTriangulation, closed: BoolArray | None = None) -> IntrinsicTriangulation:
    """The tufted cover of triangles that meet two by two at their edges, without positions; see `tufted_cover`.

    Inner edges are glued front to front and back to back, or front to back if the two faces are not aligned, and
    boundary edges front to back, only those of some faces if a mask (m,) is given: elsewhere L of the cover is twice L.
    """
    # One half-edge of each edge is first; the other runs against it, unless the two faces are not aligned.
    twin, half_edge = triangulation.twin, np.arange(triangulation.F.size)
    first = np.where(twin < 0, half_edge, np.minimum(half_edge, twin))
    order = np.lexsort((half_edge, first))
    count = np.bincount(first, minlength=len(first))
    cover = _cover(triangulation, order, count[count > 0], (first == half_edge) | ~triangulation.aligned)
    if closed is not None:
        apart = np.flatnonzero((twin < 0) & ~np.repeat(closed, 3))
        cover.twin[cover.twin[apart]] = -1
        cover.twin[apart] = -1
    return cover


def _cover(
    triangulation: IntrinsicTriangulation, order: IntArray, counts: IntArray, along: BoolArray
) -> IntrinsicTriangulation:
    """Two copies of each triangle, each glued to the next around its edge.

    `order` (3 m,) are the half-edges, edge after edge and counterclockwise around each; `counts` (k,) how many each
    edge has; `along` (3 m,) marks those that run along the edge, where the others run against it.
    """
    F, m = triangulation.F, len(triangulation.F)
    front = np.arange(F.size)
    back = 3 * (m + front // 3) + BACK_CORNERS[front % 3]
    # Seen along the edge: the copy of the face that faces counterclockwise.
    counterclockwise, clockwise = np.where(along, front, back), np.where(along, back, front)
    a, b = counterclockwise[order], clockwise[connectivity.next_in_run(order, counts)]
    twin = np.empty(2 * F.size, np.int64)
    twin[a], twin[b] = b, a
    return replace(
        triangulation,
        F=np.concatenate([F, F[:, BACK_CORNERS]]),
        l=np.concatenate([triangulation.l, triangulation.l[:, BACK_CORNERS]]),
        twin=twin,
        aligned=np.ones(2 * F.size, bool),
        history=(*triangulation.history, Covered(m)),
    )


def _angles(mesh: Mesh) -> FloatArray:
    """Angle (3 m,) of the face of each half-edge around the edge, from a direction that the faces of the edge share."""
    ends = mesh.V[mesh.facets.vertices]
    edge = ends[:, 1] - ends[:, 0]
    edge /= np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), np.finfo(float).tiny)
    least = np.eye(3)[np.argmin(np.abs(edge), axis=1)]
    x = np.cross(edge, least)
    x /= np.maximum(np.linalg.norm(x, axis=1, keepdims=True), np.finfo(float).tiny)
    y = np.cross(edge, x)
    of_half_edge = mesh.facets.of_face.ravel()
    opposite = mesh.V[mesh.F].reshape(-1, 3) - ends[of_half_edge, 0]
    along_x, along_y = (np.einsum("hk,hk->h", opposite, axis[of_half_edge]) for axis in (x, y))
    return np.asarray(np.arctan2(along_y, along_x))
