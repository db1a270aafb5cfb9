"""Smooth surfaces, and surfaces without an orientation or with edges of many faces."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.validation.shapes import book, cone, disk, grid, icosphere, lattice_faces, strip, torus
from heat_igl.validation.zoo.registry import joined, merged, raised, shape

# Smooth surfaces.


@shape("smooth")
def _sphere() -> Mesh:
    return icosphere(4)


@shape("smooth", held_out=True)
def _latitudes() -> Mesh:
    """A sphere by meridians and parallels, with fans of thin triangles at the poles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 31), np.linspace(0, 2 * np.pi, 61)[:-1], indexing="ij")
    V = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    return merged(V, lattice_faces(31, 60, wrap_columns=True))


@shape("smooth")
def _ellipsoid() -> Mesh:
    """A sphere stretched to 1 : 1 : 8 with the triangles that it has."""
    mesh = icosphere(4)
    return Mesh(mesh.V * [1, 1, 8], mesh.F)


@shape("smooth")
def _torus() -> Mesh:
    return torus(30, 60)


@shape("smooth", held_out=True)
def _thin_torus() -> Mesh:
    return torus(12, 240, 0.05)


@shape("smooth")
def _bumpy_sphere() -> Mesh:
    V, F = icosphere(4).V, icosphere(4).F
    return Mesh(V * (1 + 0.15 * np.sin(6 * V[:, :1]) * np.cos(7 * V[:, 1:2]) * np.cos(5 * V[:, 2:])), F)


@shape("smooth", held_out=True)
def _monkey_saddle() -> Mesh:
    V = disk(20).V
    x, y = V[:, 0], V[:, 1]
    return Mesh(raised(V[:, :2], x**3 - 3 * x * y**2), disk(20).F)


@shape("smooth")
def _cone() -> Mesh:
    return cone(40, 30)


@shape("smooth")
def _regular_grid() -> Mesh:
    return grid(40)


@shape("smooth")
def _long_strip() -> Mesh:
    return strip(1500, 3)


# Surfaces without an orientation, or with edges of many faces.


@shape("topology")
def _moebius_band() -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 121), np.linspace(-0.4, 0.4, 9), indexing="ij")
    r = 1 + v * np.cos(u / 2)
    V = np.stack([r * np.cos(u), r * np.sin(u), v * np.sin(u / 2)], axis=-1)
    return merged(V.reshape(-1, 3), lattice_faces(121, 9))


@shape("topology", held_out=True)
def _klein_bottle() -> Mesh:
    """The figure of eight turned by half a turn on its way around; it crosses itself without sharing vertices."""
    u, v = np.meshgrid(np.arange(80) * 2 * np.pi / 80, np.arange(40) * 2 * np.pi / 40, indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    V = np.stack([r * np.cos(u), r * np.sin(u), np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)], axis=-1)
    F = lattice_faces(80, 40, wrap_columns=True)
    # The last row is glued to the first with v turned into -v.
    j = np.arange(40)
    last, following = 79 * 40 + j, 79 * 40 + (j + 1) % 40
    first, after = (-j) % 40, (-j - 1) % 40
    seam = np.concatenate([np.stack([last, following, first], axis=1), np.stack([following, after, first], axis=1)])
    return Mesh(V.reshape(-1, 3), np.concatenate([F, seam]))


@shape("topology")
def _book() -> Mesh:
    return book(5, 12)


@shape("topology")
def _pinched() -> Mesh:
    """Two cones that meet in their tips."""
    one = cone(24, 8)
    return merged(*(lambda m: (m.V, m.F))(joined(one, Mesh(one.V * [1, 1, -1], one.F[:, ::-1]))))
