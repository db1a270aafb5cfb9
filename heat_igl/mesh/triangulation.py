"""Polygons in space cut into triangles: fans around the first corner, or ears if a fan does not fit."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.mesh.connectivity import enumerate_runs, next_in_run
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Twice the area of a triangle is rounded by some 1e-16 of the square of the polygon's extent; below this share of it a
# triangle has no orientation.
_ROUNDING = 1e-12
# Distance from a plane, as a share of the extent, up to which a polygon that crosses itself in the plane does so in
# space. A polygon with a vector area below this share of its squared extent is laid into its best plane.
_NEARLY_PLANAR = 1e-2


def triangulated(V: FloatArray, corners: IntArray, degree: IntArray) -> tuple[IntArray, IntArray]:
    """Triangles (sum of (degree - 2), 3) of polygons, one after the other, and the polygons (k,) that cross themselves.

    V, corners and degree are as for `PolygonMesh`. A polygon is the fan around the first corner. If a triangle of the
    fan is turned over, or the fan goes around that corner more than once, the polygon is concave, and ears are clipped
    instead (Meisters 1975), in the plane that its vector area is normal to. A polygon that crosses itself there keeps
    the fan; if it is nearly planar, it has no inside that triangles could fill.
    """
    if (degree == 3).all():
        return corners.reshape(-1, 3), np.empty(0, np.int64)
    F, _ = igl.polygons_to_triangles(corners, np.append(0, np.cumsum(degree)))
    wrong = _without_fan(V, F, corners, degree)
    end, end_of_fan = np.cumsum(degree), np.cumsum(degree - 2)
    crossed = []
    for i in np.flatnonzero(wrong).tolist():
        polygon = corners[end[i] - degree[i] : end[i]]
        flat, height = _flattened(V[polygon])
        found = _ears(flat)
        if found is not None:
            F[end_of_fan[i] - degree[i] + 2 : end_of_fan[i]] = polygon[found]
        elif height <= _NEARLY_PLANAR:  # sides that cross in one projection may not do so in space
            crossed.append(i)
    return F, np.array(crossed, np.int64)


def _without_fan(V: FloatArray, F: IntArray, corners: IntArray, degree: IntArray) -> BoolArray:
    """Mask (m,) of the polygons whose fan, triangles `F`, folds over itself."""
    begin = np.cumsum(degree) - degree
    origin = np.repeat(V[corners[begin]], degree, axis=0)
    one, other = V[corners] - origin, V[next_in_run(corners, degree)] - origin
    # Twice the vector area, and the square of the extent.
    normal = np.add.reduceat(np.cross(one, other), begin)
    squared = np.maximum.reduceat(np.einsum("kx,kx->k", one, one), begin)
    area = np.linalg.norm(normal, axis=1)
    owner, _ = enumerate_runs(degree - 2)
    one, other = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    cross = np.cross(one, other)
    turn = np.einsum("kx,kx->k", cross, normal[owner] / np.where(area > 0, area, 1)[owner, None])
    # Positions far from the origin are rounded more coarsely than the extent of the polygon says.
    room = _ROUNDING * squared + np.sqrt(squared) * np.finfo(float).eps * 4 * np.abs(V).max()
    folded = turn < -room[owner]
    # Without a vector area there is no normal to compare with: the polygon has no area, or crosses itself.
    folded |= (area <= room)[owner] & (np.linalg.norm(cross, axis=1) > room[owner])
    angle = np.arctan2(np.linalg.norm(cross, axis=1), np.einsum("kx,kx->k", one, other))
    around = np.bincount(owner, angle, len(degree)) >= 2 * np.pi
    return np.asarray((np.bincount(owner, folded, len(degree)) > 0) | around)


def _flattened(P: FloatArray) -> tuple[FloatArray, float]:
    """Corners (d, 2) in a plane, counter-clockwise, and the largest distance from it as a share of the extent.

    The plane is normal to the vector area, or, if that is small, the best one.
    """
    following = np.roll(P, -1, axis=0)
    normal = np.cross(P - P[0], following - P[0]).sum(axis=0)
    extent = P - P.mean(axis=0)
    if np.linalg.norm(normal) <= _NEARLY_PLANAR * float((extent**2).sum(axis=1).max()):
        axes = np.linalg.svd(extent)[2]
        axes[1] *= 1 if normal @ np.cross(axes[0], axes[1]) >= 0 else -1
    else:
        normal /= np.linalg.norm(normal)
        across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        across /= np.linalg.norm(across)
        axes = np.stack([across, np.cross(normal, across), normal])
    height = np.abs(extent @ axes[2]).max() / np.linalg.norm(extent, axis=1).max()
    return extent @ axes[:2].T, float(height)


def _area(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Twice the signed area of triangles in the plane."""
    one, other = b - a, c - a
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _ears(p: FloatArray) -> IntArray | None:
    """Triangles (d - 2, 3) of a simple polygon (d, 2), counter-clockwise; None if it is not simple.

    Of the ears at hand, the one with the largest ratio of area to squared lengths is clipped first.
    """
    room = _ROUNDING * float(np.ptp(p, axis=0).max()) ** 2
    ends = p, np.roll(p, -1, axis=0)
    one, other = (_area(ends[0][:, None], ends[1][:, None], q[None]) for q in ends)
    apart = (one > room) & (other < -room) | (one < -room) & (other > room)
    if (apart & apart.T).any():  # sides that cross each other in their inside
        return None
    left = list(range(len(p)))
    triangles = []
    # Which corners are ears, and of which that is asked: clipping one changes it at its two neighbours alone.
    ears, asked = np.zeros(len(p), bool), [*range(len(p))]
    while len(left) > 3:
        q = p[left]
        before, after = np.roll(q, 1, axis=0), np.roll(q, -1, axis=0)
        area = _area(before, q, after)
        ears[asked] = area[asked] > room
        for k in [k for k in asked if ears[k]]:
            corners = before[k], q[k], after[k]
            inside = np.ones(len(q), bool)
            # Other corners in the same place are those of a slit, which an ear may touch.
            for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
                inside &= (_area(a, b, q) >= -room) & (q != a).any(axis=1)
            ears[k] = not inside.any()
        # Without an ear, the rest has no area: corners on a line.
        is_ear = ears if ears.any() else np.abs(area) <= room
        if not is_ear.any():
            return None
        lengths = ((q - before) ** 2 + (after - q) ** 2 + (before - after) ** 2).sum(axis=1)
        k = int(np.argmax(np.where(is_ear, area / np.maximum(lengths, np.finfo(float).tiny), -np.inf)))
        triangles.append([left[k - 1], left[k], left[(k + 1) % len(left)]])
        del left[k]
        ears, asked = np.delete(ears, k), [k - 1, k % len(left)]
    triangles.append(left)
    found = np.array(triangles)
    return found if (_area(*(p[found[:, c]] for c in range(3))) >= -room).all() else None
