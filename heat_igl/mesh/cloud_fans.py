"""Vertices of a cloud's triangles at which several fans meet, joined by triangles between the fans."""

from __future__ import annotations

from itertools import product

import numpy as np

from heat_igl.mesh.cloud_gaps import pinched_vertices
from heat_igl.mesh.grouping import group_by_label
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["with_fans_joined"]


def with_fans_joined(P: FloatArray, F: IntArray, is_settled: BoolArray) -> IntArray:
    """The triangles F (m, 3), and others between the fans of vertices that have several with an end.

    Two parts of a surface that meet in one vertex alone are connected for distance, but not for vectors, which need a
    tangent plane along the way. Between the two fans goes the triangle with the smallest angle at the vertex.
    Around the settled points (n,) there is one fan.
    """
    corners = group_by_label(F.ravel(), len(P))
    added: list[tuple[int, int, int]] = []

    def around(vertex: int) -> list[list[int]]:
        """The other two corners of each triangle at a vertex."""
        found, _ = corners.of(np.array([vertex]))
        triangles = F[found // 3].tolist() + [row for row in added if vertex in row]
        return [[corner for corner in row if corner != vertex] for row in triangles]

    for vertex in np.flatnonzero(pinched_vertices(F, is_settled)).tolist():
        while True:
            joint = _between_fans(P, vertex, around(vertex))
            free = [(a, b) for a, b in joint if sum(b in sides for sides in around(a)) < 2]
            if not free:
                break
            added.append((vertex, *free[0]))
    return np.concatenate([F, np.array(added, F.dtype)]) if added else F


def _between_fans(P: FloatArray, vertex: int, sides: list[list[int]]) -> list[tuple[int, int]]:
    """Ends of different fans, those with the smallest angle at the vertex first; `sides` are opposite to it."""
    fans: list[list[int]] = []
    for side in sides:
        touching = [fan for fan in fans if not set(fan).isdisjoint(side)]
        fans = [fan for fan in fans if fan not in touching] + [sum(touching, list(side))]
    ends = [[corner for corner in fan if fan.count(corner) == 1] for fan in fans]
    pairs = [pair for i in range(len(ends)) for j in range(i) for pair in product(ends[i], ends[j])]
    ways = P[np.array(pairs, np.int64).reshape(-1, 2)] - P[vertex]
    lengths = np.linalg.norm(ways, axis=2).prod(axis=1)
    cosine = np.einsum("kx,kx->k", ways[:, 0], ways[:, 1]) / np.maximum(lengths, np.finfo(float).tiny)
    return [pairs[i] for i in np.argsort(-cosine, kind="stable")]
