"""Shapes that were made after every default had been chosen, all held out."""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray
from heat_igl.validation.shapes import grid, lattice_faces
from heat_igl.validation.zoo.registry import boxes, compact, delaunay, hull, merged, raised, seeded, shape


def _tube(centre: FloatArray, radius: float, around: int) -> Mesh:
    """A closed tube around a closed curve of points (k, 3)."""
    along = np.roll(centre, -1, axis=0) - np.roll(centre, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    # Any frame that is continuous and closes: there is none without a twist, but the triangles do not mind.
    u = np.cross(along, [0.3, 0.2, 1.0])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    angle = 2 * np.pi * np.arange(around) / around
    rings = centre[:, None] + radius * (u[:, None] * np.cos(angle)[:, None] + v[:, None] * np.sin(angle)[:, None])
    V = np.concatenate([rings, rings[:1]]).reshape(-1, 3)
    return merged(V, lattice_faces(len(centre) + 1, around, wrap_columns=True))


@shape("smooth", held_out=True)
def _gyroid() -> Mesh:
    """A piece of the gyroid by marching cubes, with their slivers and a boundary of many loops."""
    n = 22
    z, y, x = np.meshgrid(*(np.linspace(0, 2 * np.pi, n),) * 3, indexing="ij")
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    V, F, _ = igl.marching_cubes(field.ravel(), points, n, n, n, 0.1)
    return merged(np.asarray(V), np.asarray(F, np.int64))


@shape("smooth", held_out=True)
def _trefoil() -> Mesh:
    """A tube around a knot, with rings closer together than the vertices on them."""
    t = 2 * np.pi * np.arange(300) / 300
    centre = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    return _tube(centre, 0.35, 8)


@shape("CAD", held_out=True)
def _elbow() -> Mesh:
    """A pipe: two straight pieces of one ring each, and a bend of 24 rings between them."""
    bend = np.pi / 2 * np.linspace(0, 1, 24)
    x = np.concatenate([[-8.0], 2 * np.sin(bend), [2.0]])
    y = np.concatenate([[0.0], 2 - 2 * np.cos(bend), [12.0]])
    slope = np.concatenate([[0.0], bend, [np.pi / 2]])
    angle = 2 * np.pi * np.arange(32) / 32
    outward = np.stack([-np.sin(slope), np.cos(slope), np.zeros(26)], axis=1)
    rings = np.stack([x, y, np.zeros(26)], axis=1)[:, None] + outward[:, None] * np.cos(angle)[:, None]
    rings += np.array([0, 0, 1.0]) * np.sin(angle)[:, None]
    return Mesh(rings.reshape(-1, 3), lattice_faces(26, 32, wrap_columns=True))


@shape("CAD", held_out=True)
def _drum() -> Mesh:
    """The hull of two circles in tilted planes: long triangles between two polygons that are fans."""
    angle = 2 * np.pi * np.arange(120) / 120
    flat = np.stack([np.cos(angle), np.sin(angle), np.zeros(120)], axis=1)
    tilt = np.array([[np.cos(0.7), 0, np.sin(0.7)], [0, 1, 0], [-np.sin(0.7), 0, np.cos(0.7)]])
    return hull(np.concatenate([flat * 1.5, 0.6 * flat @ tilt + [0.4, 0.1, 3.0]]))


@shape("scattered", held_out=True)
def _sunflower() -> Mesh:
    """Seeds at the golden angle, denser towards the centre by the cube of the radius."""
    k = np.arange(1200) + 0.5
    radius, angle = (k / 1200) ** 1.5, k * np.pi * (3 - np.sqrt(5))
    points = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return Mesh(raised(points), delaunay(points))


@shape("terrain", held_out=True)
def _dunes() -> Mesh:
    """Waves on cells of 1 : 6 whose corners are moved."""
    mesh, rng = grid(36), seeded(31)
    x, y = mesh.V[:, 0] + 0.2 / 36 * rng.uniform(-1, 1, mesh.n_vertices), 6 * mesh.V[:, 1]
    return Mesh(np.stack([x, y, 0.08 * np.sin(25 * x + np.sin(2 * y))], axis=1), mesh.F)


@shape("voxels", held_out=True)
def _wandering_cells() -> Mesh:
    """Cells that a random walk visits."""
    steps = seeded(32).integers(0, 6, 150)
    step = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])[steps]
    return boxes(np.unique(np.cumsum(step, axis=0), axis=0))


@shape("maze", held_out=True)
def _fern() -> Mesh:
    """A stem of cells with leaves on both sides, which are two cells wide and one cell apart."""
    mesh, n = grid(36), 36
    cell = np.floor(mesh.V[mesh.F].mean(axis=1)[:, :2] * n).astype(int)
    is_leaf = (cell[:, 1] % 3 < 2) & (np.abs(cell[:, 0] - 18) < 17 - cell[:, 1] // 3)
    return compact(mesh.V, mesh.F[is_leaf | (np.abs(cell[:, 0] - 17.5) < 1)])


@shape("topology", held_out=True)
def _crossed_sheets() -> Mesh:
    """Two rectangles through one another along a common edge path, each with its own spacing."""
    s, t = np.linspace(0, 1, 25), np.linspace(-1, 1, 21) ** 3
    a, b = np.meshgrid(s, t, indexing="ij")
    one = np.stack([a, b, np.zeros_like(a)], axis=-1).reshape(-1, 3)
    other = np.stack([a, 0.3 * b, b], axis=-1).reshape(-1, 3)
    F = lattice_faces(25, 21)
    return merged(np.concatenate([one, other]), np.concatenate([F, F + len(one)]))


@shape("rough", held_out=True)
def _folded_paper() -> Mesh:
    """Miura's fold: parallelograms of two triangles, mountains and valleys."""
    i, j = np.meshgrid(np.arange(25), np.arange(25), indexing="ij")
    V = np.stack([i + 0.5 * (j % 2), 0.9 * j, 0.7 * (i % 2)], axis=-1).reshape(-1, 3).astype(float)
    return Mesh(V, lattice_faces(25, 25))
