"""Checks on tetrahedra, polygons, and the pixels and voxels of an image."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from heat_igl.mesh import Mesh, PolygonMesh, image_domain
from heat_igl.operators import metric_operators
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.validation import shapes
from heat_igl.validation.domains.case import DomainCase, Problem
from heat_igl.validation.domains.surface_cases import moved_inside, straight

__all__ = ["CASES", "around_the_edge", "delaunay", "without"]

# Volume of a tetrahedron in the unit cube below which it is left out: its corners lie in a plane up to rounding.
_LEAST_VOLUME = 1e-12


def delaunay(V: FloatArray) -> Mesh:
    """Delaunay tetrahedra of points (n, 3) in the unit cube, slivers included."""
    F = Delaunay(V).simplices
    volumes = np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]]))
    return Mesh(V, F[volumes > _LEAST_VOLUME])


def without(n: int, cut: Callable[[FloatArray], BoolArray]) -> Mesh:
    """The unit cube of n^3 cells without the tetrahedra whose centres (m, 3) are `cut`."""
    cube = shapes.box(n)
    used, F = np.unique(cube.F[~cut(cube.V[cube.F].mean(axis=1))], return_inverse=True)
    return Mesh(cube.V[used], F.reshape(-1, 4))


def around_the_edge(V: FloatArray, source: int) -> FloatArray:
    """Distance (n,) in the unit cube without the quarter x, y > 1/2: paths bend at the inner edge.

    The part that is hidden from the source is turned about that edge until the path is straight.
    """
    x, y, z = (V - [0.5, 0.5, V[source, 2]]).T
    # From the wall y > 1/2, through the body, to the other wall.
    angle = np.mod(np.arctan2(y, x) - np.pi / 2, 2 * np.pi)
    bent = np.hypot(np.hypot(x, y) + np.hypot(x[source], y[source]), z)
    return np.where(np.abs(angle - angle[source]) > np.pi, bent, straight(V, source))


def _cube(rng: np.random.Generator) -> Problem:
    mesh = shapes.box(12)
    source = int(rng.integers(mesh.n_vertices))
    return Problem(mesh, source, straight(mesh.V, source))


def _ball(rng: np.random.Generator) -> Problem:
    V = rng.random((5000, 3)) - 0.5
    mesh = delaunay(V[np.linalg.norm(V, axis=1) < 0.5])
    return Problem(mesh, 0, straight(mesh.V, 0))


def _three_quarters(rng: np.random.Generator) -> Problem:
    mesh = without(12, lambda centre: np.asarray((centre[:, :2] > 0.5).all(axis=1)))
    source = int(rng.choice(np.flatnonzero((mesh.V[:, 0] > 0.7) & (mesh.V[:, 1] > 0.2))))
    return Problem(mesh, source, around_the_edge(mesh.V, source))


def _stretched_cube(rng: np.random.Generator) -> Problem:
    mesh = shapes.box(10)
    stretch = np.array([[8.0, 6.0, 0.0], [-0.6, 0.8, 0.0], [0.5, 0.0, 1.0]])
    source = int(rng.integers(mesh.n_vertices))
    domain = metric_operators(mesh, np.tile(stretch.T @ stretch, (mesh.n_faces, 1, 1)))
    return Problem(domain, source, straight(mesh.V @ stretch.T, source))


def _depth(rng: np.random.Generator) -> Problem:
    V = np.concatenate([shapes.box(10).V, rng.uniform(0.05, 0.95, (2000, 3))])
    mesh = delaunay(V)
    return Problem(mesh, mesh.boundary, cKDTree(V[mesh.boundary]).query(V)[0])


def _quadrilaterals(rng: np.random.Generator) -> Problem:
    rows = 32
    square = moved_inside(shapes.grid(rows), rng, 0.2 / rows)
    first = (np.arange(rows)[:, None] * (rows + 1) + np.arange(rows)).ravel()
    quads = PolygonMesh(square.V, np.stack([first, first + 1, first + rows + 2, first + rows + 1], axis=1))
    return Problem(quads, 500, straight(quads.V, 500))


def _concave(rng: np.random.Generator) -> Problem:
    """Squares whose inner sides are bent: two opposite sides inwards, the others outwards."""
    n = 14
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    corner = y * (n + 1) + x
    bend = np.where((x + y) % 2, 0.18, -0.18)
    # Vertices in the middle of the inner sides that start at a corner, towards +x and towards +y.
    lying, standing = corner[(x < n) & (y % n > 0)], corner[(y < n) & (x % n > 0)]
    V = np.concatenate(
        [
            np.stack([x, y], axis=1),
            np.stack([x + 0.5, y + bend], axis=1)[lying],
            np.stack([x - bend, y + 0.5], axis=1)[standing],
        ]
    )
    below, beside = np.full((2, len(corner)), -1)
    below[lying] = len(corner) + np.arange(len(lying))
    beside[standing] = len(corner) + len(lying) + np.arange(len(standing))
    at = corner[(x < n) & (y < n)]
    right, up = at + 1, at + n + 1
    rows = np.stack([at, below[at], right, beside[right], up + 1, below[up], up, beside[at]], axis=1)
    mesh = PolygonMesh(V / n, [row[row >= 0] for row in rows])
    source = int(rng.integers(len(corner)))
    return Problem(mesh, source, straight(mesh.V, source))


def _long_pixels(rng: np.random.Generator) -> Problem:
    image = image_domain(np.ones((16, 40), bool), spacing=(2.5, 1.0))
    source = int(image.index[int(rng.integers(16)), int(rng.integers(40))])
    return Problem(image.mesh, source, straight(image.mesh.V, source))


def _wall_of_pixels(rng: np.random.Generator) -> Problem:
    mask = np.ones((20, 31), bool)
    mask[:15, 15] = False
    image = image_domain(mask, spacing=(2.0, 1.0))
    source = int(image.index[int(rng.integers(10)), int(rng.integers(10))])
    return Problem(image.mesh, source, _around_the_wall(image.mesh.V, source, 14.5, 29.0))


def _wall_of_voxels(rng: np.random.Generator) -> Problem:
    mask = np.ones((6, 12, 15), bool)
    mask[:, :9, 7] = False
    image = image_domain(mask, spacing=(1.5, 2.0, 1.0))
    source = int(image.index[int(rng.integers(6)), int(rng.integers(6)), int(rng.integers(5))])
    return Problem(image.mesh, source, _around_the_wall(image.mesh.V, source, 6.5, 17.0))


def _around_the_wall(V: FloatArray, source: int, wall: float, end: float) -> FloatArray:
    """Distance around a wall at wall < x < wall + 1, y < end, parallel to z; the source has x < wall, y < end."""
    x, y, z = (V - V[source]).T
    wall, end = wall - V[source, 0], end - V[source, 1]
    past_one = np.hypot(wall, end) + np.hypot(x - wall, y - end)
    past_both = np.hypot(wall, end) + 1 + np.hypot(x - wall - 1, y - end)
    is_seen = (x <= wall) | (y * wall >= end * x)
    flat = np.where(is_seen, np.hypot(x, y), np.where(y >= end, past_one, past_both))
    return np.asarray(np.hypot(flat, z))


CASES = (
    DomainCase("tetrahedra", "cube of even tetrahedra", "straight line", {"default": 0.01}, _cube),
    DomainCase("tetrahedra", "Delaunay tetrahedra in a ball", "straight line", {"default": 0.03}, _ball),
    DomainCase(
        "tetrahedra",
        "three quarters of a cube",
        "straight line turned about the edge",
        {"default": 0.01},
        _three_quarters,
    ),
    DomainCase(
        "tetrahedra",
        "one tensor in a cube, 1 : 10",
        "straight line after the linear map",
        {"default": 0.01},
        _stretched_cube,
    ),
    DomainCase(
        "tetrahedra", "depth below the vertices of a cube's sides", "nearest of them", {"default": 0.01}, _depth
    ),
    DomainCase(
        "polygons",
        "quadrilaterals in a square",
        "straight line",
        {"heat": 0.02, "sweep": 0.01, "windows": 0.001, "exact": 1e-9},
        _quadrilaterals,
    ),
    DomainCase(
        "polygons",
        "concave polygons in a square",
        "straight line",
        {"heat": 0.03, "sweep": 0.01, "windows": 0.001, "exact": 1e-9},
        _concave,
    ),
    DomainCase(
        "image",
        "pixels of 1 by 2.5",
        "straight line",
        {"heat": 0.03, "sweep": 0.01, "windows": 0.001, "exact": 1e-9},
        _long_pixels,
    ),
    DomainCase(
        "image",
        "wall of pixels of 1 by 2",
        "lines between the corners of the wall",
        {"heat": 0.04, "sweep": 0.01, "windows": 0.001, "exact": 1e-9},
        _wall_of_pixels,
    ),
    DomainCase(
        "image",
        "wall of voxels of 1 by 2 by 1.5",
        "lines between the edges of the wall, unrolled",
        {"default": 0.01},
        _wall_of_voxels,
    ),
)
