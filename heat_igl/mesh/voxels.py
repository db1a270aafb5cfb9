"""The voxels of a mask as tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["TETRAHEDRA_PER_VOXEL", "voxel_tetrahedra"]

TETRAHEDRA_PER_VOXEL = 12


def _triangles_of_sides() -> IntArray:
    """Corners (2, 12, 3) of the triangles on the sides of an even and an odd voxel.

    Corner 4 i + 2 j + k lies at (i, j, k). Diagonals join the two corners of a side whose coordinates in the image have
    an even sum, so that voxels on both sides of it agree.
    """
    cut = np.empty((2, TETRAHEDRA_PER_VOXEL, 3), np.int64)
    for odd in range(2):
        triangles = []
        for axis in range(3):
            one, other = (4 >> (axis + step) % 3 for step in (1, 2))
            for level in (0, 4 >> axis):
                square = [level, level + one, level + one + other, level + other]
                if (bin(level).count("1") + odd) % 2:
                    square = square[1:] + square[:1]
                triangles += [[square[0], square[1], square[2]], [square[0], square[2], square[3]]]
        cut[odd] = triangles
    return cut


def voxel_tetrahedra(inside: BoolArray, spacing: Sequence[float]) -> tuple[FloatArray, IntArray, IntArray]:
    """Tetrahedra around the centre of each voxel.

    Parameters
    ----------
    inside : (slices, rows, columns) bool
        The voxels, at least one.
    spacing : sequence of three floats
        Distance of neighbouring centres along each axis.

    Returns
    -------
    V : (n, 3) float64
        Centres of the voxels, then their corners; x along the columns, y along the rows, z along the slices.
    F : (m, 4) int64
        Twelve tetrahedra of each voxel, one voxel after the other.
    index : (slices, rows, columns) int64
        Vertex at the centre of each voxel; -1 outside.
    """
    voxels = np.argwhere(inside)
    n = len(voxels)
    index = np.full(inside.shape, -1)
    index[inside] = np.arange(n)
    # Corner (i, j, k) is the first one of voxel (i, j, k).
    shape = np.array(inside.shape) + 1
    steps = np.array(np.unravel_index(np.arange(8), (2, 2, 2))).T
    corners = np.ravel_multi_index(tuple(np.moveaxis(voxels[:, None] + steps, 2, 0)), tuple(shape))
    used, corners = np.unique(corners, return_inverse=True)
    corners = n + corners.reshape(n, 8)
    cut = _triangles_of_sides()[voxels.sum(axis=1) % 2].reshape(n, -1)
    rim = np.take_along_axis(corners, cut, axis=1).reshape(n, TETRAHEDRA_PER_VOXEL, 3)
    centre = np.broadcast_to(np.arange(n)[:, None, None], (n, TETRAHEDRA_PER_VOXEL, 1))
    F = np.concatenate([centre, rim], axis=2).reshape(-1, 4)
    at_corners = np.stack(np.unravel_index(used, tuple(shape)), axis=1) - 0.5
    V = np.concatenate([voxels, at_corners]) * np.asarray(spacing)
    return np.ascontiguousarray(V[:, ::-1]), F, index
