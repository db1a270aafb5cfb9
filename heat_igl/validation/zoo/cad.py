"""Parts as they leave a CAD program: few vertices, long triangles, fans."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray
from heat_igl.validation.shapes import cylinder, lattice_faces
from heat_igl.validation.zoo.registry import boxes, compact, delaunay, merged, raised, seeded, shape, walls


@shape("CAD", _128=64, _512=256)
def _capped_cylinder(around: int) -> Mesh:
    """Two rings, each capped by a fan around one of its own vertices."""
    side = cylinder(around, 1, 4.0)
    inner = np.arange(1, around - 1)
    bottom = np.stack([np.zeros_like(inner), inner + 1, inner], axis=1)
    return Mesh(side.V, np.concatenate([side.F, bottom, around + bottom[:, ::-1]]))


@shape("CAD", held_out=True)
def _pill() -> Mesh:
    """Long triangles along the side of a cylinder between two finely meshed caps of a sphere."""
    theta = np.concatenate([np.linspace(0, np.pi / 2, 13), np.linspace(np.pi / 2, np.pi, 13)])
    shift = np.where(np.arange(26) < 13, 6.0, 0.0)
    angle = 2 * np.pi * np.arange(48) / 48
    radius = np.sin(theta)
    V = np.stack(
        [
            radius[:, None] * np.cos(angle),
            radius[:, None] * np.sin(angle),
            np.broadcast_to((np.cos(theta) + shift)[:, None], (26, 48)),
        ],
        axis=-1,
    )
    return merged(V.reshape(-1, 3), lattice_faces(26, 48, wrap_columns=True))


def _plate_with_holes(holes: FloatArray, around: int, seed: int) -> Mesh:
    """The rectangle 10 by 6 with round holes (k, 3): centres and radii; vertices on the rims and few elsewhere."""
    angle = 2 * np.pi * (np.arange(around) + 0.5) / around
    rims = [np.stack([x + r * np.cos(angle), y + r * np.sin(angle)], axis=1) for x, y, r in holes]
    corners = np.array([[0, 0], [10, 0], [10, 6], [0, 6], [5, 0], [5, 6.0]])
    inside = seeded(seed).uniform([0.3, 0.3], [9.7, 5.7], (30, 2))
    inside = inside[(np.linalg.norm(inside[:, None] - holes[:, :2], axis=2) > holes[:, 2] + 0.2).all(axis=1)]
    points = np.concatenate([*rims, corners, inside])
    F = delaunay(points)
    middle = points[F].mean(axis=1)
    F = F[(np.linalg.norm(middle[:, None] - holes[:, :2], axis=2) > holes[:, 2] * np.cos(np.pi / around)).all(axis=1)]
    return compact(raised(points), F)


@shape("CAD")
def _plate() -> Mesh:
    holes = np.array([[2, 1.6, 0.8], [2, 4.4, 0.8], [5, 3, 1.2], [8, 1.6, 0.8], [8, 4.4, 0.8]])
    return _plate_with_holes(holes, 96, 1)


@shape("CAD", held_out=True)
def _slotted_plate() -> Mesh:
    x, y = np.meshgrid(np.linspace(1, 9, 7), np.linspace(1, 5, 4))
    return _plate_with_holes(np.column_stack([x.ravel(), y.ravel(), np.full(28, 0.42)]), 24, 2)


@shape("CAD")
def _needle_fan() -> Mesh:
    """A disk of 300 needles around its centre."""
    angle = 2 * np.pi * np.arange(300) / 300
    V = np.concatenate([[[0, 0, 0]], np.column_stack([np.cos(angle), np.sin(angle), np.zeros(300)])])
    k = np.arange(300)
    return Mesh(V, np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % 300], axis=1))


@shape("CAD", held_out=True)
def _gear() -> Mesh:
    """A toothed wheel of 24 teeth with a bore, extruded; its faces are Delaunay triangles between bore and teeth."""
    angle = 2 * np.pi * np.arange(96) / 96
    radius = np.where((np.arange(96) // 2) % 2 == 0, 3.0, 2.6)
    bore = 2 * np.pi * np.arange(48) / 48
    rim = np.concatenate(
        [
            radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1),
            np.stack([np.cos(bore), np.sin(bore)], axis=1),
        ]
    )
    F = delaunay(rim)
    middle = rim[F].mean(axis=1)
    r, at = np.linalg.norm(middle, axis=1), np.arctan2(middle[:, 1], middle[:, 0]) % (2 * np.pi)
    F = F[(r > 0.998) & (r < np.interp(at, np.append(angle, 2 * np.pi), np.append(radius, radius[0])))]
    n = len(rim)
    V = np.concatenate([raised(rim, 1.0), raised(rim, 0.0)])
    return compact(V, np.concatenate([F, F[:, ::-1] + n, walls(F, n)]))


@shape("CAD")
def _stairs() -> Mesh:
    """Twelve steps of two rectangles each, every rectangle two triangles."""
    x = np.repeat(np.arange(13), 2)[1:]
    z = np.repeat(np.arange(13), 2)[:-1]
    V = np.stack([np.tile(x, 2), np.repeat([0.0, 5.0], 25), np.tile(z, 2) * 0.5], axis=1)
    return Mesh(V, lattice_faces(2, 25))


@shape("CAD", cube=(1.0, 1.0), long=(1.0, 30.0))
def _box(width: float, length: float) -> Mesh:
    """Eight vertices and twelve triangles."""
    return boxes(np.array([[0, 0, 0]]), np.array([width, width, length]))


@shape("CAD", held_out=True)
def _wide_funnel() -> Mesh:
    """A cone whose rings come closer and closer to the tip, with 24 vertices each."""
    radius, angle = 0.6 ** np.arange(20), 2 * np.pi * np.arange(24) / 24
    V = np.stack(
        [radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle), np.repeat(2 * radius[:, None], 24, axis=1)],
        axis=-1,
    )
    return Mesh(V.reshape(-1, 3), lattice_faces(20, 24, wrap_columns=True))
