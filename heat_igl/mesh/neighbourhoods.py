"""Neighbourhoods of the points of a cloud: nearest points, tangent planes, and positions with less noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from heat_igl.runtime import in_order, n_threads
from heat_igl.typing import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.spatial import KDTree

__all__ = ["Neighbourhoods", "neighbourhoods", "without_noise"]

# Nearest points from which the plane of a point and its triangles are found.
_K = 30
# Points at a time: bounds the memory for their neighbours.
_BLOCK = 1 << 12

# Noise in shares of the spacing. Heights that vary by a share e of the spacing lengthen edges by the share e^2, so
# below this one noise costs less than the heat method.
_NOISE = 0.05
# Above this ratio of the two smaller variances, a neighbourhood is no disc: more points are needed to see the surface.
_THICKNESS = 0.05
_LARGEST_K = 120
_MOST_PASSES = 8
# Noise is looked for at this many points.
_SAMPLE = 4000
# Deviations from a quadric of half as many neighbours, in shares of those from the quadric of all: noise deviates from
# both alike, 0.68 to 1 in measurements, detail from the smaller one by less, 0.14 to 0.58.
_NOISE_NOT_DETAIL = 0.63


@dataclass(frozen=True, eq=False)
class Neighbourhoods:
    """The nearest points of each of n points, and the tangent plane.

    Attributes
    ----------
    index : (n, k + 1) int32
        The points themselves and their neighbours, by distance.
    radius : (n,) float64
        Distance of the farthest of them.
    axes : (n, 3, 3) float64
        Two tangents and the normal of each point, in rows, orthonormal.
    """

    index: IntArray
    radius: FloatArray
    axes: FloatArray


def neighbourhoods(P: FloatArray, normals: FloatArray | None = None) -> Neighbourhoods:
    """Neighbours and tangent planes of the points P (n, 3), by principal components unless `normals` (n, 3) are given.

    Points weigh 1 - (d / r)^2, for d the distance and r the radius of the neighbourhood.
    """
    k = min(_K, len(P) - 1)
    found = Neighbourhoods(np.empty((len(P), k + 1), np.int32), np.empty(len(P)), np.empty((len(P), 3, 3)))
    tree = _tree(P)

    def fill(rows: slice) -> None:
        distance, index = tree.query(P[rows], k + 1)
        found.index[rows], found.radius[rows] = index, distance[:, -1]
        if normals is None:
            found.axes[rows] = _principal_axes(P, P[rows], distance, index)[0]

    _in_blocks(fill, len(P))
    if normals is not None:
        found.axes[:] = _completed(normals)
    return found


def without_noise(P: FloatArray) -> FloatArray:
    """The points (n, 3), moved onto quadrics fitted to their neighbours if they are noisy; else `P` itself.

    Points are noisy if neighbours deviate from the quadric by more than 1 / 20 of their spacing at half of the points,
    and this is not detail, from which a quadric of half as many neighbours would deviate by less. Then all points are
    moved along their normals, until the deviation is smaller.
    """
    k = _K
    if len(P) <= 4 * k:
        return P
    most = min(_LARGEST_K, len(P) // 4)
    sample = np.unique(np.linspace(0, len(P) - 1, _SAMPLE).astype(np.int64))
    tree = _tree(P)
    few, all_k = (float(np.median(_onto_quadrics(P, tree, P[sample], size)[1])) for size in (k // 2, k))
    if few < max(_NOISE, _NOISE_NOT_DETAIL * all_k):
        return P
    for _ in range(_MOST_PASSES):
        tree = _tree(P)
        _, noise, thickness = _onto_quadrics(P, tree, P[sample], k)
        while np.median(thickness) > _THICKNESS and k < most:
            k = min(2 * k, most)
            _, noise, thickness = _onto_quadrics(P, tree, P[sample], k)
        if np.median(noise) <= _NOISE:
            break
        P = _onto_quadrics(P, tree, P, k)[0]
    return P


def _onto_quadrics(P: FloatArray, tree: KDTree, at: FloatArray, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points (b, 3) of P moved onto quadrics that are fitted to k neighbours.

    Also returns the noise (b,) in shares of the spacing, and the ratio (b,) of the two smaller variances.
    """
    moved, noise, thickness = np.empty_like(at), np.empty(len(at)), np.empty(len(at))

    def fill(rows: slice) -> None:
        distance, index = tree.query(at[rows], k + 1)
        radius = np.maximum(distance[:, -1:], np.finfo(float).tiny)
        axes, variances = _principal_axes(P, at[rows], distance, index)
        weights = np.sqrt(_weights(distance))
        local = np.matmul(P[index] - at[rows, None], axes.transpose(0, 2, 1)) / radius[:, :, None]
        x, y, z = np.moveaxis(local, 2, 0)
        A = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=2) * weights[:, :, None]
        b = (z * weights)[:, :, None]
        normal_matrix = np.matmul(A.transpose(0, 2, 1), A)
        # Points on a line leave a quadric undetermined; the shift takes the smallest.
        normal_matrix += 1e-9 * weights.shape[1] * np.eye(6)
        c = np.linalg.solve(normal_matrix, np.matmul(A.transpose(0, 2, 1), b))
        residual = (b - np.matmul(A, c))[:, :, 0]
        freedom = np.maximum(1 - 6 / k, 0.5) * (weights**2).sum(axis=1)
        noise[rows] = np.sqrt((residual**2).sum(axis=1) / freedom) * np.sqrt(k / np.pi)
        thickness[rows] = variances[:, 0] / np.maximum(variances[:, 1], np.finfo(float).tiny)
        moved[rows] = at[rows] + (c[:, 0] * radius) * axes[:, 2]

    _in_blocks(fill, len(at))
    return moved, noise, thickness


def _in_blocks(fill: Callable[[slice], None], n: int) -> None:
    """Call `fill` for slices that make up n rows, on all processors."""
    for _ in in_order(fill, [slice(begin, begin + _BLOCK) for begin in range(0, n, _BLOCK)], n_threads()):
        pass


def _weights(distance: FloatArray) -> FloatArray:
    radius = np.maximum(distance[:, -1:], np.finfo(float).tiny)
    return np.asarray(np.maximum(1 - (distance / radius) ** 2, 1e-3))


def _principal_axes(
    P: FloatArray, at: FloatArray, distance: FloatArray, index: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Tangents and normal (b, 3, 3) of some points, and the variances (b, 3) of their neighbours, ascending."""
    weights = _weights(distance)
    # In units of the radius: squares of tiny lengths would underflow.
    radius = np.maximum(distance[:, -1], np.finfo(float).tiny)
    local = (P[index] - at[:, None]) / radius[:, None, None]
    weights /= weights.sum(axis=1, keepdims=True)
    local -= np.matmul(weights[:, None], local)
    variances, vectors = np.linalg.eigh(np.matmul((local * weights[:, :, None]).transpose(0, 2, 1), local))
    return vectors.transpose(0, 2, 1)[:, ::-1], variances


def _completed(normals: FloatArray) -> FloatArray:
    """Orthonormal axes (n, 3, 3) whose last rows are the unit vectors `normals` (n, 3)."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    x = np.cross(normals, least)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(normals, x), normals], axis=1)


def _tree(P: FloatArray) -> KDTree:
    """A k-d tree of the points."""
    from scipy.spatial import KDTree  # takes as long to import as the rest of the package

    return KDTree(P)
