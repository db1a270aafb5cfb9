"""Points drawn as discs: a small polygon in the tangent plane of each, in the colours of the values around it."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.mesh import Mesh, PointCloud
from heat_igl.typing import BoolArray, FloatArray

_CORNERS, _FEW_CORNERS = 8, 4
# Above this number of points a disc is a few pixels wide, and is drawn as a square.
_MANY = 20_000


def discs(cloud: PointCloud, values: FloatArray, is_flat: bool = False) -> tuple[Mesh, FloatArray]:
    """A polygon around each of n points, split into triangles, and values at its vertices; the first n are the points.

    A disc has the value of the point (``inf`` for none) everywhere if `is_flat`; else values change linearly, with the
    gradient at the point.
    """
    triangles = cloud.triangles
    n, V = cloud.n_vertices, triangles.V
    k = _CORNERS if n <= _MANY else _FEW_CORNERS
    normals = igl.per_vertex_normals(V, triangles.F)[cloud.originals] if cloud.normals is None else cloud.normals
    normals = np.where(
        np.isfinite(normals).all(axis=1, keepdims=True) & (normals != 0).any(axis=1)[:, None], normals, 1
    )
    x = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normals, x) / np.linalg.norm(normals, axis=1, keepdims=True)
    # Discs around its corners cover a triangle if they reach the centre of its circle; a triangle with an obtuse angle
    # needs no more than an equilateral one with its longest side.
    sides = igl.edge_lengths(V, triangles.F)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.fmin(sides.prod(axis=1) / (4 * triangles.measures), sides.max(axis=1) / np.sqrt(3))
    radius = np.zeros(n)
    np.maximum.at(radius, triangles.F, np.broadcast_to(reach[:, None], triangles.F.shape))
    radius = np.where(radius > 0, radius, reach.mean())[cloud.originals] / np.cos(np.pi / k)
    angle = 2 * np.pi * np.arange(k) / k
    across = np.cos(angle)[:, None] * x[:, None] + np.sin(angle)[:, None] * y[:, None]
    rim = radius[:, None, None] * across
    known: BoolArray = np.asarray(np.isfinite(values)[triangles.F].all(axis=1))
    slope = np.zeros((n, 3)) if is_flat else slopes(triangles, values, known)[cloud.originals]
    finite = values[np.isfinite(values)]
    on_rim = values[:, None] + np.einsum("nkx,nx->nk", rim, slope)
    on_rim = np.where(np.isfinite(values)[:, None], np.clip(on_rim, finite.min(), finite.max()), values[:, None])
    corner = n + np.arange(n * k).reshape(n, k)
    F = np.stack([np.repeat(np.arange(n), k), corner.ravel(), np.roll(corner, -1, axis=1).ravel()], axis=1)
    return Mesh(np.concatenate([V, (V[:, None] + rim).reshape(-1, 3)]), F), np.append(values, on_rim.ravel())


def slopes(triangles: Mesh, values: FloatArray, faces: BoolArray) -> FloatArray:
    """The gradient (n, 3) of values at each vertex, the mean of the chosen faces around it by area; 0 where is none."""
    known = np.where(np.isfinite(values), values, 0.0)
    G = igl.grad(triangles.V, triangles.F)
    per_face = (G @ known).reshape(3, -1).T
    weights = triangles.measures * faces * np.isfinite(per_face).all(axis=1)
    weighted = np.where(weights[:, None] > 0, per_face, 0.0) * weights[:, None]
    of_corner = triangles.F.ravel()
    total = np.bincount(of_corner, np.repeat(weights, 3), len(values))
    sums = [np.bincount(of_corner, np.repeat(column, 3), len(values)) for column in weighted.T]
    return np.stack(sums, axis=1) / np.maximum(total, np.finfo(float).tiny)[:, None]
