"""Rough and thin surfaces, several components, and the smallest meshes."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.validation.shapes import disk, icosphere, lattice_faces, torus
from heat_igl.validation.zoo.registry import hull, joined, merged, seeded, shape

# Rough and thin surfaces.


@shape("rough")
def _spiky_sphere() -> Mesh:
    mesh = icosphere(3)
    out = np.where(seeded(20).random(mesh.n_vertices) < 0.05, 3.0, 1.0)
    return Mesh(mesh.V * out[:, None], mesh.F)


@shape("rough")
def _noisy_sphere() -> Mesh:
    mesh = icosphere(4)
    return Mesh(mesh.V + 0.05 * seeded(21).standard_normal(mesh.V.shape), mesh.F)


@shape("rough", held_out=True)
def _crumpled() -> Mesh:
    mesh = disk(18)
    return Mesh(mesh.V + 0.04 * seeded(22).standard_normal(mesh.V.shape), mesh.F)


@shape("rough", _40_by_400=(40, 400), _12_by_60=(12, 60))
def _lantern(around: int, along: int) -> Mesh:
    """Schwarz's lantern: rings of a cylinder, every other one turned by half a step."""
    ring, k = np.divmod(np.arange(around * (along + 1)), around)
    angle = 2 * np.pi * (k + 0.5 * (ring % 2)) / around
    V = np.stack([np.cos(angle), np.sin(angle), 3 * ring / along], axis=1)
    faces = []
    for i in range(along):
        a, b = i * around + np.arange(around), (i + 1) * around + np.arange(around)
        ahead = np.roll(np.arange(around), -1)
        if i % 2 == 0:
            faces += [np.stack([a, a[ahead], b], axis=1), np.stack([a[ahead], b[ahead], b], axis=1)]
        else:
            faces += [np.stack([a, b[ahead], b], axis=1), np.stack([a, a[ahead], b[ahead]], axis=1)]
    return Mesh(V, np.concatenate(faces))


@shape("rough")
def _sphere_with_slivers() -> Mesh:
    """A tenth of the faces split close to the middle of a side."""
    mesh = icosphere(3)
    rng = seeded(23)
    chosen = rng.choice(mesh.n_faces, mesh.n_faces // 10, replace=False)
    weights = np.array([0.499, 0.499, 0.002])
    new = (mesh.V[mesh.F[chosen]] * weights[:, None]).sum(axis=1)
    a, b, c = mesh.F[chosen].T
    p = mesh.n_vertices + np.arange(len(chosen))
    split = [np.stack([a, b, p], axis=1), np.stack([b, c, p], axis=1), np.stack([c, a, p], axis=1)]
    return Mesh(np.concatenate([mesh.V, new]), np.concatenate([np.delete(mesh.F, chosen, axis=0), *split]))


@shape("rough", held_out=True)
def _dense_pole() -> Mesh:
    """A sphere whose triangles shrink to a thousandth towards a pole."""
    t = np.concatenate([np.linspace(0, 1, 60) ** 4 * np.pi / 2, np.linspace(np.pi / 2, np.pi, 20)[1:-1]])
    angle = 2 * np.pi * np.arange(40) / 40
    V = np.stack(
        [
            np.sin(t)[:, None] * np.cos(angle),
            np.sin(t)[:, None] * np.sin(angle),
            np.repeat(np.cos(t)[:, None], 40, axis=1),
        ],
        axis=-1,
    )
    return merged(V.reshape(-1, 3), lattice_faces(len(t), 40, wrap_columns=True))


# Several components.


@shape("components", _1_to_1=1.0, _1_to_10=10.0, _1_to_100=100.0)
def _two_spheres(ratio: float) -> Mesh:
    one = icosphere(3)
    return joined(one, Mesh(one.V * ratio + [2 * ratio + 2, 0, 0], one.F))


@shape("components", held_out=True)
def _part_and_plate() -> Mesh:
    """A small torus beside a square of two triangles, a thousand times larger."""
    return joined(
        torus(16, 32), Mesh(np.array([[0, 0, -1], [1e3, 0, -1], [1e3, 1e3, -1], [0, 1e3, -1]]), [[0, 1, 2], [0, 2, 3]])
    )


@shape("components")
def _dust() -> Mesh:
    """Twenty hulls of 60 points beside one another, from 1 to a thousandth in size."""
    parts, at = [], 0.0
    for k, size in enumerate(np.logspace(0, -3, 20)):
        points = seeded(40 + k).standard_normal((60, 3))
        part = hull(points / np.linalg.norm(points, axis=1, keepdims=True))
        parts.append(Mesh(size * part.V + [at, 0, 0], part.F))
        at += 3 * size
    return joined(*parts)


# The smallest meshes.


@shape("small")
def _triangle() -> Mesh:
    return Mesh([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]])


@shape("small", held_out=True)
def _needle() -> Mesh:
    return Mesh(np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-4, 0], [0.5, -1e-4, 0]]), [[0, 1, 2], [1, 0, 3]])


@shape("small")
def _tetrahedron() -> Mesh:
    return Mesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


@shape("small", held_out=True)
def _octahedron() -> Mesh:
    V = np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 3]
    return hull(V)
