"""Nearly flat surfaces: shortest paths through many vertices whose angles sum to 2 pi up to rounding of coordinates.

Each member is turned at random, rounded to single precision or moved far from the origin, or none of these.
"""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.shapes import lattice_faces
from heat_igl.validation.zoo.registry import family


def _between(rng: np.random.Generator, least: float, most: float) -> float:
    """A random number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def _stored(rng: np.random.Generator, V: FloatArray, F: IntArray) -> Mesh:
    """A mesh as a file may have it: turned, far from the origin, in single precision."""
    size = np.ptp(V, axis=0).max()
    if rng.random() < 0.7:
        V = V @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if rng.random() < 0.2:
        V = V + 5e6 / 100 * size
    elif rng.random() < 0.6:
        V = V.astype(np.float32).astype(float)
    return Mesh(V, F)


def _tube(rng: np.random.Generator, radius: FloatArray, height: FloatArray, around: int) -> Mesh:
    """Rings of vertices with these radii and heights, each turned against the ring before by the same angle."""
    turn = rng.choice([0.0, np.pi / around, rng.uniform(0, 1)])
    angle = 2 * np.pi * np.arange(around) / around + turn * np.arange(len(radius))[:, None]
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    V = np.stack([x, y, np.broadcast_to(height[:, None], x.shape)], axis=-1).reshape(-1, 3)
    return _stored(rng, V, lattice_faces(len(radius), around, wrap_columns=True))


def _rings(rng: np.random.Generator) -> tuple[int, int]:
    """How many rings, and how many vertices on each."""
    return int(_between(rng, 3, 40)), int(_between(rng, 3, 40))


@family("nearly flat cylinder")
def _cylinder(rng: np.random.Generator) -> Mesh:
    along, around = _rings(rng)
    return _tube(rng, np.ones(along), np.linspace(0, _between(rng, 0.1, 20), along), around)


@family("nearly flat cone")
def _cone(rng: np.random.Generator) -> Mesh:
    along, around = _rings(rng)
    radius, height = np.linspace(rng.uniform(0.05, 0.95), 1, along), np.linspace(0, _between(rng, 0.1, 20), along)
    return _tube(rng, radius, height, around)


@family("pipe reducer")
def _reducer(rng: np.random.Generator) -> Mesh:
    along, around = _rings(rng)
    height = np.linspace(-1, 1, along) * rng.uniform(2, 20)
    return _tube(rng, 1 + np.tanh(height) / 2, height, around)


@family("geometrically spaced rings")
def _spaced_rings(rng: np.random.Generator) -> Mesh:
    along, around = _rings(rng)
    height = np.cumsum(rng.uniform(1.01, 1.6) ** np.arange(along)) * 2 * np.pi / around
    return _tube(rng, np.ones(along), height, around)


@family("nearly flat grid")
def _grid(rng: np.random.Generator) -> Mesh:
    n = int(_between(rng, 4, 40))
    x, y = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    V = np.stack([x, y, rng.normal(size=(n, n)) * 10 ** rng.uniform(-12, 0)], axis=-1).reshape(-1, 3)
    return _stored(rng, V, lattice_faces(n, n))


@family("grid of integers")
def _integers(rng: np.random.Generator) -> Mesh:
    n = int(_between(rng, 4, 30))
    x, y = np.meshgrid(np.arange(n) * rng.integers(1, 4), np.arange(n) * rng.integers(1, 4), indexing="ij")
    V = np.stack([x, y, rng.integers(0, rng.integers(1, 4), size=(n, n))], axis=-1).reshape(-1, 3)
    return _stored(rng, V.astype(float), lattice_faces(n, n))
