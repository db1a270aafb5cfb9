"""Scattered points, terrain and convex hulls."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.validation.shapes import grid, lattice_faces
from heat_igl.validation.zoo.registry import delaunay, hull, raised, seeded, shape

# Scattered points.


@shape("scattered", _1000=(1000, 3), _100=(100, 4))
def _scattered_square(n: int, seed: int) -> Mesh:
    points = seeded(seed).random((n, 2))
    return Mesh(raised(points), delaunay(points))


@shape("scattered", held_out=True)
def _scattered_disk() -> Mesh:
    r, angle = seeded(5).random((2, 1500))
    points = np.sqrt(r)[:, None] * np.stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)], axis=1)
    return Mesh(raised(points), delaunay(points))


@shape("scattered")
def _clusters() -> Mesh:
    """Points in a square, most of them in five small clusters: edges differ by a factor of a thousand."""
    rng = seeded(6)
    centres = rng.random((5, 2))
    points = np.concatenate(
        [rng.random((300, 2)), *(centre + 0.003 * rng.standard_normal((200, 2)) for centre in centres)]
    )
    return Mesh(raised(points), delaunay(points))


@shape("scattered")
def _slivers_at_the_rim() -> Mesh:
    """A square whose boundary vertices stand on a cubic scale, with few points inside."""
    s = np.linspace(-1, 1, 41) ** 3
    rim = np.concatenate([np.column_stack([s, np.full(41, side)]) for side in (-1.0, 1.0)])
    rim = np.concatenate([rim, rim[:, ::-1]])
    points = np.unique(np.concatenate([rim, seeded(7).uniform(-0.9, 0.9, (120, 2))]), axis=0)
    return Mesh(raised(points), delaunay(points))


@shape("scattered", by_3=3.0, by_10=10.0)
def _sheared_grid(shear: float) -> Mesh:
    mesh = grid(30)
    return Mesh(mesh.V @ np.array([[1, 0, 0], [shear, 1, 0], [0, 0, 1.0]]), mesh.F)


@shape("scattered", held_out=True)
def _stretched_grid() -> Mesh:
    """Cells of 1 : 40."""
    mesh = grid(30)
    return Mesh(mesh.V * [40, 1, 1], mesh.F)


@shape("scattered", held_out=True)
def _graded_square() -> Mesh:
    """Edges from 1 to 1 / 1000 towards a corner."""
    x, y = np.meshgrid(np.linspace(0, 1, 41) ** 3, np.linspace(0, 1, 41) ** 3)
    return Mesh(raised(np.stack([x.ravel(), y.ravel()], axis=1)), lattice_faces(41, 41))


# Height fields and terrain.


@shape("terrain", _5000=(5000, 0.3, 8), coarse=(47, 0.5, 9))
def _height_field(n: int, height: float, seed: int) -> Mesh:
    points = seeded(seed).random((n, 2))
    z = height * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1])
    return Mesh(raised(points, z), delaunay(points))


@shape("terrain", _10_times=10.0, _100_times=100.0)
def _noise(factor: float) -> Mesh:
    """A grid with independent heights of a multiple of the spacing."""
    mesh = grid(30)
    return Mesh(raised(mesh.V[:, :2], factor / 30 * seeded(10).random(mesh.n_vertices)), mesh.F)


@shape("terrain", held_out=True)
def _fractal_terrain() -> Mesh:
    """Midpoint displacement on 65 by 65 vertices, each level with 0.6 of the height of the one before."""
    rng, z, amplitude = seeded(11), np.zeros((2, 2)), 0.5
    while len(z) < 65:
        finer = np.zeros((2 * len(z) - 1,) * 2)
        finer[::2, ::2] = z
        finer[1::2, ::2] = (z[1:] + z[:-1]) / 2
        finer[:, 1::2] = (finer[:, 2::2] + finer[:, :-2:2]) / 2
        new = np.ones(finer.shape, bool)
        new[::2, ::2] = False
        z = finer + amplitude * np.where(new, rng.standard_normal(finer.shape), 0)
        amplitude *= 0.6
    mesh = grid(64)
    return Mesh(raised(mesh.V[:, :2], z.ravel()), mesh.F)


@shape("terrain", held_out=True)
def _ridges() -> Mesh:
    """A folded sheet: 20 steep folds of a few triangles each."""
    x = np.repeat(np.linspace(0, 1, 41)[:, None], 11, axis=1)
    y = np.repeat(np.linspace(0, 1, 11)[None], 41, axis=0)
    z = np.where(np.arange(41)[:, None] % 2 == 0, 0.0, 0.2) * np.ones((1, 11))
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), lattice_faces(41, 11))


@shape("terrain")
def _cliff() -> Mesh:
    mesh = grid(40)
    return Mesh(raised(mesh.V[:, :2], 2.0 * (mesh.V[:, 0] > 0.5)), mesh.F)


# Convex hulls.


@shape("hull", _12=(12, 12), _35=(35, 13), _100=(100, 14), _400=(400, 15))
def _hull_of(n: int, seed: int) -> Mesh:
    points = seeded(seed).standard_normal((n, 3))
    return hull(points / np.linalg.norm(points, axis=1, keepdims=True))


@shape("hull", held_out=True)
def _flat_hull() -> Mesh:
    points = seeded(16).standard_normal((150, 3))
    return hull(points / np.linalg.norm(points, axis=1, keepdims=True) * [1, 1, 0.03])


@shape("hull", held_out=True)
def _hull_of_a_cloud() -> Mesh:
    return hull(seeded(17).standard_normal((300, 3)))
