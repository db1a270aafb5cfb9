"""Orientation of the triangles of a cloud: neighbours alike, and like the normals; without those that contradict."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.agreeing import orient
from heat_igl.kernels.incidence import components
from heat_igl.mesh.cloud_gaps import pinched_vertices, with_one_fan
from heat_igl.mesh.connectivity import facets
from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["oriented"]

# Share of the triangles that may be left out for the others to be oriented alike. Clouds of scans had up to 0.0008; at
# 0.002 and 0.004, on thin and narrow parts of two coarse meshes, distance became up to four times as wrong.
_MOST_LEFT_OUT = 1e-3


def oriented(P: FloatArray, F: IntArray, normals: FloatArray | None) -> IntArray:
    """The triangles F (m, 3) int32, neighbours oriented alike and each part like most of the normals (n, 3).

    Where triangles join sheets wrongly, no orientation may suit all neighbours. Then it is passed on across the
    flattest edges first, and of each pair that contradicts it nevertheless, one triangle is left out (Hoppe et al. 1992
    orient the normals of points so). Where these are many, leaving them out would tear the surface: all stay.
    """
    F = F.copy()
    part, is_oriented = orient(F, len(P))
    if not is_oriented:
        contradicting = _contradicting(P, F)
        if len(contradicting) <= _MOST_LEFT_OUT * len(F):
            kept = np.delete(F, contradicting, axis=0)
            F = with_one_fan(kept, pinched_vertices(kept, np.zeros(len(P), bool)))
            part, _ = orient(F, len(P))
    if normals is not None:
        area = np.cross(P[F[:, 1]] - P[F[:, 0]], P[F[:, 2]] - P[F[:, 0]])
        along = np.bincount(part, np.einsum("fx,fx->f", area, normals[F].sum(axis=1)))
        turned = along[part] < 0
        F[turned] = F[turned, ::-1]
    return F


def _contradicting(P: FloatArray, F: IntArray) -> IntArray:
    """Triangles without which the others can be oriented alike, of two neighbours the one with more contradictions."""
    first, second = _neighbours(F, len(P))
    faces = np.stack([first // 3, second // 3], axis=1)
    runs_alike = F.ravel()[_next(first)] == F.ravel()[_next(second)]
    is_in_tree = _flattest_tree(faces, _folds(P, F, first, second), len(F))
    # Each triangle and its mirror image: the tree joins each to one of the two of the neighbour.
    a, b = faces[is_in_tree].T
    image = b + len(F) * runs_alike[is_in_tree]
    pairs = np.concatenate(
        [np.stack([a, image], axis=1), np.stack([a + len(F), (image + len(F)) % (2 * len(F))], axis=1)]
    )
    label = components(pairs, 2 * len(F))
    is_turned = label[: len(F)] > label[len(F) :]
    contradicts = (is_turned[faces[:, 0]] != is_turned[faces[:, 1]]) != runs_alike
    count = np.bincount(faces[contradicts].ravel(), minlength=len(F))
    a, b = faces[contradicts].T
    return np.unique(np.where(count[a] > count[b], a, b))


def _neighbours(F: IntArray, n: int) -> tuple[IntArray, IntArray]:
    """Half-edges 3 f + c (k,), opposite corner c of triangle f, and those of the neighbours across the edges."""
    found = facets(F, n)
    sides = group_by_label(found.of_face.ravel(), len(found.vertices))
    inner = sides.first[:-1][found.n_faces == 2]
    return sides.members[inner], sides.members[inner + 1]


def _next(half_edges: IntArray) -> IntArray:
    """The corner at which half-edges begin."""
    return half_edges - half_edges % 3 + (half_edges + 1) % 3


def _folds(P: FloatArray, F: IntArray, first: IntArray, second: IntArray) -> FloatArray:
    """Cosine (k,) of the angle between neighbours around their edge: -1 where they are flat, 1 where they fold back."""
    begin, end = F.ravel()[_next(first)], F.ravel()[_next(_next(first))]
    along = P[end] - P[begin]
    along /= np.maximum(np.linalg.norm(along, axis=1), np.finfo(float).tiny)[:, None]

    def across(half_edges: IntArray) -> FloatArray:
        to_corner = P[F.ravel()[half_edges]] - P[begin]
        to_corner -= along * np.einsum("kx,kx->k", along, to_corner)[:, None]
        length = np.linalg.norm(to_corner, axis=1)
        return np.asarray(to_corner / np.maximum(length, np.finfo(float).tiny)[:, None])

    return np.asarray(np.einsum("kx,kx->k", across(first), across(second)))


def _flattest_tree(faces: IntArray, folds: FloatArray, m: int) -> BoolArray:
    """Which pairs (k, 2) of m triangles make a tree of the flattest edges in each part."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import minimum_spanning_tree  # takes time to import, and few clouds need it

    pairs = np.sort(faces, axis=1)
    # Two triangles may have several edges in common; weights are not 0, which would be no edge.
    order = np.lexsort((folds, pairs[:, 1], pairs[:, 0]))
    is_first = (np.diff(pairs[order], axis=0, prepend=-1) != 0).any(axis=1)
    chosen = order[is_first]
    places = tuple(pairs[chosen].T.astype(np.int32))  # scipy 1.15 builds no tree from others
    weights = sp.coo_array((folds[chosen] + 2, places), (m, m)).tocsr()
    numbers = sp.coo_array((chosen + 1, places), (m, m)).tocsr()
    tree = minimum_spanning_tree(weights)
    tree.data[:] = 1
    is_in_tree = np.zeros(len(faces), bool)
    is_in_tree[tree.multiply(numbers).tocoo().data.astype(np.int64) - 1] = True
    return is_in_tree
