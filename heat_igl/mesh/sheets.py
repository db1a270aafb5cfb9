"""Neighbours on other sheets of a surface, told apart by empty balls, and tangent planes without them."""

from __future__ import annotations

import numpy as np

from heat_igl.kernels.cloud.empty_balls import on_one_side, roomiest_normals
from heat_igl.kernels.cloud.local_planes import principal_axes, tangent_planes
from heat_igl.runtime import over_rows
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["axes_along", "one_sheet"]

# Directions in which balls are tried: every 25 degrees.
_DIRECTIONS = 80
# Radii of balls on the two sides whose ratio is at most this are those of a thin part or a narrow gap.
_THIN = 0.7
# Cosine of the angle between the normal of the roomier side and the fitted plane's, below which the plane is wrong.
_ASTRAY = 0.95
_BLOCK = 1 << 11


def one_sheet(
    P: FloatArray, index: IntArray, square: FloatArray, shrinks: bool
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Neighbours on the same sheet of the surface as each of b points, and the tangent planes through them.

    The sheets of a thin part, or on the two sides of a narrow gap, nearly touch: the neighbours of a point are on
    both. The empty balls that touch a point are small between the sheets, and neighbours on the other sheet share no
    ball with it on the same side of both (Amenta and Bern 1999 estimate normals by such balls).

    Parameters
    ----------
    P : (n, 3) float64
        All points.
    index, square : (b, k) int32, (b, k) float64
        Neighbours, by distance and each point first, and the squared distances. Only neighbours that are among the b
        points themselves are left out.
    shrinks : bool
        Whether neighbourhoods are made smaller where that makes them flatter.

    Returns
    -------
    index : (b, k) int32
        The neighbours that stay, by distance; -1 after the last.
    radius : (b,) float64
        Distance of the farthest of them.
    axes : (b, 3, 3) float64
        Two tangents and the normal, in rows, orthonormal.
    """
    directions = np.ascontiguousarray(_directions(_DIRECTIONS).T)
    number = np.full(len(P), -1, np.int32)
    number[index[:, 0]] = np.arange(len(index))

    def balls(rows: slice) -> tuple[FloatArray, FloatArray, FloatArray]:
        normals, radii, room = roomiest_normals(P, index[rows], square[rows], directions)
        return normals, radii, room

    normals, radii, room = map(np.concatenate, zip(*over_rows(balls, len(index), _BLOCK), strict=True))

    def seen(rows: slice) -> BoolArray:
        kept: BoolArray = on_one_side(P, index[rows], number, normals, radii)
        return kept

    keeps = np.concatenate(over_rows(seen, len(index), _BLOCK))
    found, radius, axes = _planes(P, index, square, keeps, shrinks)
    is_thin = room[:, 1] < _THIN * room[:, 0]
    axes[is_thin] = axes_along(_blend(axes[is_thin, 2], normals[is_thin]))
    return found, radius, axes


def axes_along(normals: FloatArray) -> FloatArray:
    """Orthonormal axes (n, 3, 3) whose last rows are the unit vectors `normals` (n, 3)."""
    least = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    x = np.cross(normals, least)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(normals, x), normals], axis=1)


def _directions(m: int) -> FloatArray:
    """Unit vectors (m, 3) that are spread evenly: on a spiral, whose turns are the golden angle apart."""
    height = 1 - (2 * np.arange(m) + 1) / m
    angle = np.pi * (1 + np.sqrt(5)) * np.arange(m)
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)


def _planes(
    P: FloatArray, index: IntArray, square: FloatArray, keeps: BoolArray, shrinks: bool
) -> tuple[IntArray, FloatArray, FloatArray]:
    """The neighbours that are kept, the distance of the farthest, and the principal axes; as `one_sheet` returns them.

    Where fewer than three neighbours are kept, all are.
    """
    sizes = keeps.sum(axis=1)
    keeps[sizes < 4] = True
    sizes[sizes < 4] = keeps.shape[1]
    found, radius, axes = np.full_like(index, -1), np.empty(len(index)), np.empty((len(index), 3, 3))
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        of_rows = keeps[rows]
        near, squares = (np.ascontiguousarray(a[rows][of_rows].reshape(-1, size)) for a in (index, square))
        if shrinks:
            axes[rows], radius[rows], _ = tangent_planes(P, near, squares)
        else:
            axes[rows], radius[rows] = principal_axes(P, near, squares)[0], np.sqrt(squares[:, -1])
        found[rows, :size] = near
    return found, radius, axes


def _blend(of_planes: FloatArray, of_balls: FloatArray) -> FloatArray:
    """Normals (k, 3) between those of fitted planes and of balls where both agree, and those of balls elsewhere."""
    alike = np.einsum("rx,rx->r", of_planes, of_balls)[:, None]
    mean = of_balls + np.where(np.abs(alike) >= _ASTRAY, np.sign(alike) * of_planes, 0)
    return np.asarray(mean / np.linalg.norm(mean, axis=1, keepdims=True))
