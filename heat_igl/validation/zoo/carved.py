"""Voxels, fractals and mazes."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.validation.shapes import grid, lattice_faces
from heat_igl.validation.zoo.registry import boxes, compact, raised, seeded, shape

# Voxels and fractals.


@shape("voxels")
def _cube_less_one() -> Mesh:
    where = np.ones((2, 2, 2), bool)
    where[1, 1, 1] = False
    return boxes(np.argwhere(where))


@shape("voxels")
def _beams() -> Mesh:
    """A lattice of square beams between 4 by 4 by 4 nodes, of genus 81."""
    i = np.indices((7, 7, 7))
    return boxes(np.argwhere((i % 2 == 0).sum(axis=0) >= 2))


@shape("voxels", held_out=True)
def _sponge() -> Mesh:
    """Menger's sponge of level 2."""
    i = np.indices((9, 9, 9))
    level = [((i // step % 3) == 1).sum(axis=0) < 2 for step in (1, 3)]
    return boxes(np.argwhere(level[0] & level[1]))


@shape("voxels")
def _voxel_ball() -> Mesh:
    i = np.indices((15, 15, 15)) - 7
    return boxes(np.argwhere((i**2).sum(axis=0) <= 42))


@shape("voxels", held_out=True)
def _voxel_blob() -> Mesh:
    """Cells below a random threshold, connected or not, touching along edges and in corners."""
    from scipy.ndimage import gaussian_filter

    field = gaussian_filter(seeded(18).standard_normal((12, 12, 12)), 1.2)
    return boxes(np.argwhere(field > np.quantile(field, 0.6)))


# Mazes and walls.


@shape("maze")
def _maze() -> Mesh:
    """A square with walls one cell wide from alternate sides."""
    mesh, n = grid(45), 45
    cell = mesh.V[mesh.F].mean(axis=1)[:, :2] * n
    column, row = np.floor(cell[:, 0]).astype(int), np.floor(cell[:, 1]).astype(int)
    is_wall = (column % 5 == 4) & np.where(column // 5 % 2 == 0, row < n - 4, row >= 4)
    return compact(mesh.V, mesh.F[~is_wall])


@shape("maze")
def _spiral() -> Mesh:
    """A corridor that winds in, four turns."""
    turn = np.linspace(0, 8 * np.pi, 400)
    radius = 1 + turn / 3
    points = np.concatenate(
        [r[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1) for r in (radius, radius + 0.6, radius + 1.2)]
    )
    return Mesh(raised(points), lattice_faces(3, 400))


@shape("maze")
def _labyrinth() -> Mesh:
    """A random spanning tree of rooms, carved out of a grid of cells."""
    rng, n = seeded(19), 12
    is_open = np.zeros((2 * n + 1, 2 * n + 1), bool)
    stack = [(0, 0)]
    is_open[1, 1] = True
    while stack:
        i, j = stack[-1]
        steps = [(di, dj) for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)) if 0 <= i + di < n and 0 <= j + dj < n]
        steps = [(di, dj) for di, dj in steps if not is_open[2 * (i + di) + 1, 2 * (j + dj) + 1]]
        if not steps:
            stack.pop()
            continue
        di, dj = steps[rng.integers(len(steps))]
        is_open[2 * i + 1 + di, 2 * j + 1 + dj] = is_open[2 * (i + di) + 1, 2 * (j + dj) + 1] = True
        stack.append((i + di, j + dj))
    fine = np.kron(is_open, np.ones((2, 2), bool))
    side = len(fine)
    x, y = np.meshgrid(np.arange(side + 1.0), np.arange(side + 1.0))
    open_cells = np.concatenate([fine.ravel(), fine.ravel()])
    return compact(raised(np.stack([x.ravel(), y.ravel()], axis=1)), lattice_faces(side + 1, side + 1)[open_cells])
