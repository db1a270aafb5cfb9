"""Orientation of the triangles of a cloud, like the normals, and the cover with two sides of those that have none."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.kernels.cloud.joining_groups import turned_groups
from heat_igl.kernels.mesh.incidence import components
from heat_igl.mesh.cloud_triangles import FOLDED_BACK, corner, glued_sides
from heat_igl.mesh.connectivity import pinched_vertices
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Cosine of the angle at an edge, -1 where the two triangles are flat, below which nothing tells a wrong join. With
# -0.99 errors on 25 surfaces are the same in the mean; with -0.5 wrong joins at a narrow part count as flat.
_FLAT = -0.9
# Power of half of 1 - cosine that weighs edges on folds, which join sheets wrongly more often than flat ones. No power
# is best: on the vertices of cheburashka, cow, camelhead, teapot, truck and a gearbox, 100, 100, 100, 87, 72 and 64 %
# of the triangles are oriented as on the mesh with 2, and 88, 100, 100, 88, 76 and 67 % with 4; 6 is within 1 % of both
# in the mean, and 1 and 3 are down to 58 % on the teapot.
_POWER = 2


def oriented(P: FloatArray, F: IntArray, normals: FloatArray | None) -> tuple[IntArray, IntArray]:
    """The triangles F (m, 3) int32, neighbours oriented alike and each part like most of the normals (n, 3).

    Also returns the points (k,) at edges where neighbours still contradict each other and are not flat.

    Where triangles join sheets wrongly, no orientation may suit all neighbours. Then groups are joined, two at a time,
    in the relative orientation that more of the edges between them want, weighted by flatness, the strongest joins for
    their sizes first: a narrow bridge between sheets is among the last, and turns no part of a sheet around. Of each
    pair that still contradicts, one triangle is left out, unless most are flat, as on a surface with one side.
    """
    is_turned, part, pairs, folds = _turned(P, F)
    count, (a, b) = np.bincount(pairs.ravel(), minlength=len(F)), pairs.T
    # Of each pair, the triangle that is in more of them.
    left_out = np.where(count[a] > count[b], a, b)
    # On a surface with one side, neighbours contradict each other where it is flat.
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
    """Which of the triangles F (m, 3) to turn, their parts (m,), and pairs (k, 2) that contradict, with folds."""
    first, second, runs_alike = glued_sides(F, len(P))
    pairs = np.stack([first // 3, second // 3], axis=1)
    part, is_turned = _parts(pairs, runs_alike, len(F))
    contradicts, folds = np.zeros(len(pairs), bool), np.zeros(len(pairs))
    if (part[0] == part[1]).any():
        folds = _folds(P, F, pairs, runs_alike)
        weight = ((1 - folds) / 2) ** _POWER
        # Triangles without a fold join first, but for those around a surface with one side. A wrong join between sheets
        # bends where it begins; along its flat edges alone it would join them once and for all.
        a, b = pairs.T
        is_bent, bent = np.zeros(len(F), bool), folds >= _FLAT
        is_bent[a[bent]] = is_bent[b[bent]] = True
        is_flat = ~(is_bent.take(a) | is_bent.take(b))
        sheet, is_turned = _parts(pairs.compress(is_flat, axis=0), runs_alike[is_flat], len(F))
        group = np.where(sheet[0] == sheet[1], 2 * len(F) + np.arange(len(F)), sheet.min(axis=0))
        group = (np.cumsum(np.bincount(group) > 0) - 1)[group]
        is_turned &= sheet[0] != sheet[1]
        wants_one = runs_alike != (is_turned.take(a) != is_turned.take(b))
        ends = group.astype(np.int32).take(pairs)
        is_turned ^= turned_groups(ends, np.where(wants_one, -weight, weight), np.bincount(group))[group]
        contradicts = (is_turned.take(a) != is_turned.take(b)) != runs_alike
    return is_turned, part.min(axis=0), pairs[contradicts], folds[contradicts]


def _parts(pairs: IntArray, runs_alike: BoolArray, m: int) -> tuple[IntArray, BoolArray]:
    """Parts (2, m) of both sides of m triangles, glued where pairs (k, 2) of these are, and which triangles to turn.

    Row 0 has the sides that triangles show, row 1 the others. A part of the surface that can be oriented has two parts
    of its sides, and the triangles that are on another than the first triangle of the part are turned.
    """
    a, b = pairs.T
    same, other = b + m * runs_alike, b + m * ~runs_alike
    glued = np.stack([np.concatenate([a, a + m]), np.concatenate([same, other])], axis=1)
    part = components(glued, 2 * m).reshape(2, m)
    return part, part[0] > part[1]


def _folds(P: FloatArray, F: IntArray, pairs: IntArray, runs_alike: BoolArray) -> FloatArray:
    """Cosine (k,) of the angle between neighbours around their edge: -1 where they are flat, 1 where they fold back."""
    normal = igl.per_face_normals(P, F, np.zeros(3))
    ends = (normal.take(end, axis=0) for end in pairs.T)
    return np.asarray(np.einsum("kx,kx->k", *ends) * np.where(runs_alike, 1, -1))


def is_oriented_manifold(surface: Mesh) -> bool:
    """Whether neighbours of a surface with at most two faces at an edge run alike, and no point has several fans."""
    F, n = surface.F, surface.n_vertices
    return not (glued_sides(F, n)[2].any() or len(pinched_vertices(F, n)))


def _points_between(F: IntArray, pairs: IntArray) -> IntArray:
    """The points (k,) that both triangles of a pair have."""
    common = (F[pairs[:, 0], :, None] == F[pairs[:, 1], None]).any(axis=2)
    return np.unique(F[pairs[:, 0]][common])


def folded_points(surface: Mesh) -> IntArray:
    """Points (k,) at edges along which triangles fold back by more than 120 degrees."""
    first, second, runs_alike = glued_sides(surface.F, surface.n_vertices)
    pairs = np.stack([first // 3, second // 3], axis=1)
    folds = _folds(surface.V, surface.F, pairs, runs_alike)
    return _points_between(surface.F, pairs[folds > FOLDED_BACK])


def two_sided_cover(surface: Mesh) -> Mesh:
    """Both sides of a surface, glued where its neighbours are: the orientation cover.

    The surface has m triangles on n vertices, at most two at an edge. Neighbours need not be oriented alike, and a
    vertex may have several fans of triangles.

    Returns
    -------
    Mesh
        2 m triangles: face f of the surface, and as m + f the same from the other side. Vertex v is on the largest fan
        around v, and v + n on the other side of it; smaller fans have vertices of their own, from 2 n on, so that
        each vertex has one fan. Where the surface can be oriented, the sides are two parts; where it cannot, a path
        may lead from one to the other.
    """
    F, n = surface.F, surface.n_vertices
    first, second, runs_alike = glued_sides(F, n)
    # Corner h of one side is h, and of the other side h + 3 m. Where both triangles run along their edge, a path goes
    # from one side to the other.
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
    # The largest fan of each vertex, of equal ones that of the first face; then the other side of it.
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
    """Points in the 2 m faces of a cover as points (k,), (k, ..., 3) of the m faces that it covers."""
    is_other, found = faces >= m, barycentric.copy()
    found[is_other] = found[is_other][..., [0, 2, 1]]
    return np.where(is_other, faces - m, faces), found
