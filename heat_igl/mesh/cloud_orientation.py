"""Consistent orientation of the triangles of a point cloud, and the orientation double cover of a surface."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.cloud_triangles import corner, glued_sides
from heat_igl.mesh.connectivity import pinched_vertices, unique_rows
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import BoolArray, FloatArray, IntArray

# An edge is flat if the cosine of its dihedral angle, -1 for coplanar triangles, is below this; wrong joins between
# sheets show at other edges. With -0.99 mean errors on 25 surfaces are equal; with -0.5 wrong joins at a narrow part
# count as flat.
_FLAT = -0.9
# An edge has the weight ((1 - cosine of the dihedral angle) / 2) ** _POWER: folds join sheets wrongly more often than
# flat edges do. No power is best: on the vertices of cheburashka, cow, camelhead, teapot, truck and a gearbox, 100,
# 100, 100, 87, 72 and 64 % of the triangles are oriented as on the mesh with 2, and 88, 100, 100, 88, 76 and 67 % with
# 4; 6 is within 1 % of both in the mean, and 1 and 3 are down to 58 % on the teapot.
_POWER = 2
# Cosine of the angle to the next triangle above which the two fold back and may join sheets wrongly: 60 degrees. On
# vertices of eleven models 1.2 and .8 times as many points are said with 0.3 and 0.7; on four smooth shapes none.
_FOLDED_BACK = 0.5


def oriented(P: FloatArray, F: IntArray, normals: FloatArray | None) -> tuple[IntArray, IntArray]:
    """Orient the triangles F (m, 3) int32 consistently, and each component like the majority of the normals (n, 3).

    Returns the oriented triangles, and the points (k,) of edges that are not flat and whose two triangles are still
    oriented inconsistently.

    Where triangles join two sheets wrongly, there may be no consistent orientation. Then groups of triangles are
    merged, two at a time, in the relative orientation for which the edges between them have the larger weight. The
    merge with the largest weight for its size comes first, so that a narrow bridge between two sheets comes late and
    turns no part of a sheet. One triangle of each pair that remains inconsistent is removed, unless most of these
    pairs are flat, as they are on a surface with one side.
    """
    is_turned, part, pairs, folds = _turned(P, F)
    # Of each inconsistent pair, the triangle that is in more of these pairs.
    count, (a, b) = np.bincount(pairs.ravel(), minlength=len(F)), pairs.T
    left_out = np.where(count[a] > count[b], a, b)
    if len(left_out) and np.median(folds) > _FLAT:
        F, is_turned, part = np.delete(F, left_out, 0), np.delete(is_turned, left_out), np.delete(part, left_out)
        pairs, folds = pairs[:0], folds[:0]
    F = np.where(is_turned[:, None], F[:, [0, 2, 1]], F)
    if normals is not None:
        area = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
        along = np.bincount(part, np.einsum("fx,fx->f", area, normals[F].sum(axis=1)))
        turned = along[part] < 0
        F[turned] = F[turned, ::-1]
    return F, _points_between(F, pairs[folds > _FLAT])


def _turned(P: FloatArray, F: IntArray) -> tuple[BoolArray, IntArray, IntArray, FloatArray]:
    """Which triangles (m,) to turn, their components (m,), the pairs (k, 2) still inconsistent, and their `_folds`."""
    first, second, runs_alike = glued_sides(F, len(P))
    pairs = np.stack([first // 3, second // 3], axis=1)
    part, is_turned = _parts(pairs, runs_alike, len(F))
    contradicts, folds = np.zeros(len(pairs), bool), np.zeros(len(pairs))
    if (part[0] == part[1]).any():
        folds = _folds(P, F, pairs, runs_alike)
        weight = ((1 - folds) / 2) ** _POWER
        # Triangles without a bent edge are merged first, except around a surface with one side. A wrong join between
        # sheets has a bent edge where it begins; if its flat edges counted here, one sheet would be oriented by the
        # other.
        a, b = pairs.T
        is_bent, bent = np.zeros(len(F), bool), folds >= _FLAT
        is_bent[a[bent]] = is_bent[b[bent]] = True
        is_flat = ~(is_bent.take(a) | is_bent.take(b))
        sheet, is_turned = _parts(pairs.compress(is_flat, axis=0), runs_alike[is_flat], len(F))
        group = np.where(sheet[0] == sheet[1], 2 * len(F) + np.arange(len(F)), sheet.min(axis=0))
        group = (np.cumsum(np.bincount(group) > 0) - 1)[group]
        is_turned &= sheet[0] != sheet[1]
        wants_one = runs_alike != (is_turned.take(a) != is_turned.take(b))
        is_turned ^= turned_groups(group.take(pairs), np.where(wants_one, -weight, weight), np.bincount(group))[group]
        contradicts = (is_turned.take(a) != is_turned.take(b)) != runs_alike
    return is_turned, part.min(axis=0), pairs[contradicts], folds[contradicts]


def turned_groups(pairs: IntArray, weights: FloatArray, sizes: IntArray) -> BoolArray:
    """Which (n,) of n groups to turn, for pairs with weights that are negative if just one of both groups should be.

    The weights (k,) of all pairs (k, 2) between two groups add up. In a round each group is joined to the one to which
    its join is strongest for the sizes (n,) of both, if that one is larger, or of the same size and a lower number,
    until nothing is joined.
    """
    n, size, groups = len(sizes), sizes, np.arange(len(sizes))
    # The group to which each was joined, itself at first, and whether one of the two is turned.
    root, turned = groups, np.zeros(n, bool)
    while True:
        between = np.sort(root[pairs], axis=1)
        signed = np.where(turned[pairs[:, 0]] == turned[pairs[:, 1]], weights, -weights)
        first, which, _ = unique_rows(between, n)
        pairs, weights = between[first], np.asarray(np.bincount(which, signed, len(first)), np.float64)
        a, b = pairs.T
        # Of equal joins an arbitrary one: with the lowest, groups would be joined one after the other.
        share = (1 + 1e-6 * ((a + b) * 7919 % 1009)) / (size[a] + size[b]) * np.abs(weights) * (a != b)
        to, wants, strongest = groups.copy(), np.zeros(n, bool), np.zeros(n)
        for group in (a, b):
            np.maximum.at(strongest, group, share)
        for group, other in ((a, b), (b, a)):
            chosen = (share == strongest[group]) & (share > 0)
            to[group[chosen]], wants[group[chosen]] = other[chosen], weights[chosen] < 0
        joins = (size[to] > size) | ((size[to] == size) & (to < groups))
        if not joins.any():
            return turned
        root, turned = np.where(joins, to, root), np.where(joins, wants, turned)
        while (root[root] != root).any():
            turned, root = turned ^ turned[root], root[root]
        size = np.bincount(root, sizes, n)


def _parts(pairs: IntArray, runs_alike: BoolArray, m: int) -> tuple[IntArray, BoolArray]:
    """Components (2, m) of the double cover of m triangles, fronts in row 0 and backs in row 1, and which to turn.

    `pairs` (k, 2) are the neighbours, and `runs_alike` (k,) are those with the same direction along their common edge,
    which makes them inconsistent. An orientable component of the surface has two components in the cover; a triangle is
    turned if its front is in another one than that of the first triangle.
    """
    a, b = pairs.T
    same, other = b + m * runs_alike, b + m * ~runs_alike
    glued = np.stack([np.concatenate([a, a + m]), np.concatenate([same, other])], axis=1)
    part = components(glued, 2 * m).reshape(2, m)
    return part, part[0] > part[1]


def _folds(P: FloatArray, F: IntArray, pairs: IntArray, runs_alike: BoolArray) -> FloatArray:
    """Cosine (k,) of the dihedral angle between neighbours: -1 if they are coplanar, 1 if one lies on the other."""
    normal = igl.per_face_normals(P, F, np.zeros(3))
    ends = (normal.take(end, axis=0) for end in pairs.T)
    return np.asarray(np.einsum("kx,kx->k", *ends) * np.where(runs_alike, 1, -1))


def _points_between(F: IntArray, pairs: IntArray) -> IntArray:
    """The common points (k,) of the two triangles of each pair."""
    common = (F[pairs[:, 0], :, None] == F[pairs[:, 1], None]).any(axis=2)
    return np.unique(F[pairs[:, 0]][common])


def folded_points(surface: Mesh) -> IntArray:
    """Points (k,) at edges along which triangles fold back by more than 120 degrees."""
    first, second, runs_alike = glued_sides(surface.F, surface.n_vertices)
    pairs = np.stack([first // 3, second // 3], axis=1)
    folds = _folds(surface.V, surface.F, pairs, runs_alike)
    return _points_between(surface.F, pairs[folds > _FOLDED_BACK])


def two_sided_cover(surface: Mesh) -> Mesh | None:
    """The orientation double cover of a surface with m triangles, n vertices and at most two triangles per edge.

    None if the surface needs none: neighbours are oriented alike, and there is one fan of triangles at each vertex.
    Neighbours may be oriented inconsistently, and a vertex may have several fans of triangles. The cover has 2 m
    triangles: f is the front of triangle f, and m + f its back. Vertex v is in the largest fan around v, and n + v in
    the back of this fan. Smaller fans get vertices of their own, from 2 n on, so that each vertex has one fan. The
    cover of an orientable component has two components; the cover of a component with one side is connected.
    """
    F, n = surface.F, surface.n_vertices
    first, second, runs_alike = glued_sides(F, n)
    if not (runs_alike.any() or len(pinched_vertices(F, n))):
        return None
    # Corner h is h in front, and h + 3 m on the back. If two neighbours are inconsistent, the front of one is glued to
    # the back of the other.
    pairs = []
    for end in (1, 2):
        a, b = corner(first, end), corner(second, np.where(runs_alike, end, 3 - end))
        pairs += [
            np.stack([a, b + F.size * runs_alike], axis=1),
            np.stack([a + F.size, b + F.size * ~runs_alike], axis=1),
        ]
    fan = components(np.concatenate(pairs), 2 * F.size)
    first_corner, size = np.unique(fan, return_index=True, return_counts=True)[1:]
    of_fan, on_other_side = F.ravel()[first_corner % F.size], np.roll(fan, F.size)[first_corner]
    # The largest fan of each vertex (of equally large ones, that of the first face) and its back keep the vertex.
    order = np.lexsort((first_corner, -size, of_fan))
    largest = order[np.diff(of_fan[order], prepend=-1) != 0]
    number = np.full(len(size), -1)
    number[largest] = of_fan[largest]
    number[on_other_side[largest]] = of_fan[largest] + n
    rest = np.flatnonzero(number < 0)
    number[rest] = 2 * n + np.arange(len(rest))
    front, back = number[fan].reshape(2, -1, 3)
    return Mesh(
        np.concatenate([surface.V, surface.V, surface.V[of_fan[rest]]]), np.concatenate([front, back[:, [0, 2, 1]]])
    )


def on_one_side(faces: IntArray, barycentric: FloatArray, m: int) -> tuple[IntArray, FloatArray]:
    """Points (k,), (k, ..., 3) in the 2 m faces of the cover -> the same points in the m faces of the surface."""
    is_other, found = faces >= m, barycentric.copy()
    found[is_other] = found[is_other][..., [0, 2, 1]]
    return np.where(is_other, faces - m, faces), found
