"""Generated test shapes: smooth, CAD, scattered points, terrain, hulls, voxels, mazes, slivers, several components.

Defaults are chosen on some of `SHAPES` and measured on all. A third of them are held out: nothing in the package may be
tuned on them (`Shape.held_out`). `FAMILIES` generate a random mesh for each seed, of some hundred to 3000 vertices; no
default may be tuned on single members, and a change is measured over many seeds of every family.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, wraps
from typing import Any
from zlib import crc32

import igl
import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.validation.shapes import (
    book,
    box,
    cone,
    cylinder,
    disk,
    grid,
    icosphere,
    lattice_faces,
    lattice_mesh,
    strip,
    torus,
)

__all__ = ["FAMILIES", "SHAPES", "Shape"]

Generator = np.random.Generator

# Tetrahedra with less than this, six times the volume, are left out: their corners lie in a plane up to rounding.
_LEAST_VOLUME = 1e-12
# From a cell to its six neighbours.
_STEPS = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])

SHAPES: list[Shape] = []
"""All shapes, family after family."""

FAMILIES: dict[str, Callable[[int], Mesh]] = {}
"""All families of random shapes, by name: seed -> mesh, the same bits at every call."""


@dataclass(frozen=True)
class Shape:
    """A test shape: `make` returns the `Mesh`, the same bits at every call.

    No default may be tuned on shapes that are `held_out`.
    """

    name: str
    family: str
    make: Callable[[], Mesh]
    held_out: bool


def shape(
    family: str, *, held_out: bool = False, **variants: Any
) -> Callable[[Callable[..., Mesh]], Callable[..., Mesh]]:
    """Register a function as a shape, or as one for each of `variants`: name suffix -> arguments."""

    def register(make: Callable[..., Mesh]) -> Callable[..., Mesh]:
        name = make.__name__.strip("_").replace("_", " ")
        for suffix, arguments in (variants or {"": ()}).items():
            full = f"{name} {suffix.strip('_').replace('_', ' ')}".strip()
            given = arguments if isinstance(arguments, tuple) else (arguments,)
            SHAPES.append(Shape(full, family, lambda given=given: make(*given), held_out))  # type: ignore[misc]
        return make

    return register


def family(name: str) -> Callable[[Callable[[Generator], Mesh]], Callable[[int], Mesh]]:
    """Register a function of a random generator as a family, and turn it into a function of a seed."""

    def register(make: Callable[[Generator], Mesh]) -> Callable[[int], Mesh]:
        @wraps(make)
        def member(seed: int) -> Mesh:
            return make(np.random.default_rng([20261123, crc32(name.encode()), seed]))

        FAMILIES[name] = member
        return member

    return register


def seeded(seed: int) -> Generator:
    """A random generator with a fixed seed."""
    return np.random.default_rng([20240815, seed])


def delaunay(points: FloatArray) -> IntArray:
    """The Delaunay triangles of points (k, 2), all counter-clockwise, or the Delaunay tetrahedra of points (k, 3)."""
    from scipy.spatial import Delaunay  # takes as long to import as the rest of the package

    return np.asarray(Delaunay(points).simplices, np.int64)


def ring(around: int, begin: float = 0.0) -> FloatArray:
    """Points (around, 2) of the unit circle, the first of them at `begin` steps from the x axis."""
    angle = 2 * np.pi * (np.arange(around) + begin) / around
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def planar(points: FloatArray, height: AnyArray | float = 0.0) -> Mesh:
    """The Delaunay triangles of points (k, 2) in the plane, at heights (k,)."""
    return Mesh(raised(points, height), delaunay(points))


def revolved(radius: FloatArray, height: FloatArray, around: int) -> Mesh:
    """A surface of revolution without caps: a ring of vertices for each radius (k,) and height (k,)."""
    x, y = ring(around).T
    return lattice_mesh(radius[:, None] * x, radius[:, None] * y, height[:, None], wrap_columns=True)


def tube(centre: FloatArray, along: FloatArray, radius: float, around: int, up: ArrayLike = (0.31, 0.21, 0.93)) -> Mesh:
    """An open tube: rings around points (k, 3), perpendicular to `along` (k, 3), that start perpendicular to `up`."""
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    u = np.cross(along, np.asarray(up))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    x, y = ring(around).T
    rings = centre[:, None] + radius * (u[:, None] * x[:, None] + v[:, None] * y[:, None])
    return lattice_mesh(*np.moveaxis(rings, 2, 0), wrap_columns=True)


def extruded(points: FloatArray, F: IntArray, height: float) -> Mesh:
    """Two sheets of triangles on points (k, 2), at a height and at 0, joined along the boundary."""
    n = len(points)
    return compact(
        np.concatenate([raised(points, height), raised(points)]), np.concatenate([F, F[:, ::-1] + n, walls(F, n)])
    )


def caps(rings: int, around: int) -> IntArray:
    """Triangles that close the first and the last of some rings of vertices, in fans around a vertex of each."""
    k = np.arange(1, around - 1)
    first = np.stack([np.zeros_like(k), k + 1, k], axis=1)
    return np.concatenate([first, (rings - 1) * around + first[:, ::-1]])


def corridors(rng: Generator, n: int) -> BoolArray:
    """The open cells (2 n - 1, 2 n - 1) of a maze: n by n rooms, joined by a random tree."""
    is_open = np.zeros((2 * n - 1, 2 * n - 1), bool)
    stack = [(0, 0)]
    is_open[0, 0] = True
    while stack:
        i, j = stack[-1]
        ways = [(i + a, j + b) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        ways = [(a, b) for a, b in ways if 0 <= a < n and 0 <= b < n and not is_open[2 * a, 2 * b]]
        if not ways:
            stack.pop()
            continue
        a, b = ways[rng.integers(len(ways))]
        is_open[2 * a, 2 * b] = is_open[i + a, j + b] = True
        stack.append((a, b))
    return is_open


def holed_plate(
    centre: FloatArray, radius: FloatArray, rim: FloatArray, corners: ArrayLike, inside: FloatArray, gap: float
) -> tuple[FloatArray, IntArray]:
    """Points (k, 2) and Delaunay triangles of a plate with round holes.

    Centres (h, 2) and radii (h,) of the holes, points (a, 2) of a rim of radius 1, corners of the plate, and further
    points, which are left out if they are nearer to a hole than `gap`.
    """
    apart = np.linalg.norm(inside[:, None] - centre, axis=2) > radius + gap
    rims = (centre[:, None] + radius[:, None, None] * rim).reshape(-1, 2)
    points = np.concatenate([rims, corners, inside[apart.all(axis=1)]])
    F = delaunay(points)
    depth = np.linalg.norm(points[F].mean(axis=1)[:, None] - centre, axis=2)
    return points, F[(depth > radius * np.cos(np.pi / len(rim))).all(axis=1)]


def opened(is_open: BoolArray) -> Mesh:
    """The open cells (n, n) of a grid over the unit square."""
    mesh = grid(len(is_open))
    i, j = (mesh.V[mesh.F].mean(axis=1)[:, :2] * len(is_open)).astype(int).T
    return compact(mesh.V, mesh.F[is_open[i, j]])


def walls(F: IntArray, above: int) -> IntArray:
    """Triangles between the boundary of F and its copy, whose vertices have numbers larger by `above`."""
    sides = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    _, which, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    a, b = sides[count[which.reshape(-1)] == 1].T
    return np.concatenate([np.stack([a, b + above, b], axis=1), np.stack([a, a + above, b + above], axis=1)])


def raised(points: FloatArray, height: AnyArray | float = 0.0) -> FloatArray:
    """Positions (k, 3) of points (k, 2) at heights (k,), or at one height."""
    return np.column_stack([points, np.broadcast_to(height, len(points))])


def compact(V: FloatArray, F: IntArray) -> Mesh:
    """The mesh of triangles or tetrahedra F without unreferenced vertices."""
    used, numbers = np.unique(F, return_inverse=True)
    return Mesh(V[used], numbers.reshape(F.shape))


def tetrahedra(V: FloatArray) -> Mesh:
    """Delaunay tetrahedra of points (n, 3) in the unit cube: slivers are kept, those without volume are not."""
    F = delaunay(V)
    return Mesh(V, F[np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]])) > _LEAST_VOLUME])


def carved(n: int, cut: Callable[[FloatArray], BoolArray]) -> Mesh:
    """The unit cube of n^3 cells without the tetrahedra for whose centroids (m, 3) `cut` is true."""
    cube = box(n)
    return compact(cube.V, cube.F[~cut(cube.V[cube.F].mean(axis=1))])


def joined(*parts: Mesh) -> Mesh:
    """Several meshes as components of one."""
    first = np.cumsum([0, *(part.n_vertices for part in parts)])
    return Mesh(
        np.concatenate([part.V for part in parts]),
        np.concatenate([part.F + begin for part, begin in zip(parts, first, strict=False)]),
    )


def merged(mesh: Mesh) -> Mesh:
    """The mesh with vertices at equal positions merged, and without triangles that become degenerate."""
    scale = 1e-9 * float(np.ptp(mesh.V, axis=0).max())
    _, first, which = np.unique(np.round(mesh.V / scale), axis=0, return_index=True, return_inverse=True)
    F = which.reshape(-1)[mesh.F]
    return Mesh(mesh.V[first], F[(np.roll(F, 1, axis=1) != F).all(axis=1)])


def hull(points: FloatArray) -> Mesh:
    """The convex hull of points (k, 3), its faces turned outward."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    F = np.asarray(hull.simplices, np.int64)
    normal = np.cross(points[F[:, 1]] - points[F[:, 0]], points[F[:, 2]] - points[F[:, 0]])
    inward = np.einsum("kx,kx->k", normal, hull.equations[:, :3]) < 0
    F[inward] = F[inward][:, ::-1]
    return compact(points, F)


def boxes(cells: IntArray, size: FloatArray | float = 1.0) -> Mesh:
    """The surface of a union of unit cells (k, 3), scaled by `size`: the squares between a cell and empty space."""
    cells = np.unique(cells, axis=0)
    occupied = np.zeros(np.ptp(cells, axis=0) + 3, bool)
    occupied[tuple((cells - cells.min(axis=0) + 1).T)] = True
    # Of each axis and side, where the next cell lies, and the corners of the square.
    ahead = np.stack([-np.eye(3, dtype=int), np.eye(3, dtype=int)], axis=1)
    square = np.zeros((3, 2, 4, 3), int)
    for axis in range(3):
        square[axis, 1, :, axis] = 1
        square[axis, :, :, (axis + 1) % 3] = [[0, 1, 1, 0], [0, 1, 1, 0]]
        square[axis, :, :, (axis + 2) % 3] = [[1, 1, 0, 0], [0, 0, 1, 1]]
    beyond = cells[:, None, None] - cells.min(axis=0) + 1 + ahead
    cell, across, side = np.nonzero(~occupied[tuple(np.moveaxis(beyond, -1, 0))])
    corners = (cells[cell][:, None] + square[across, side]).reshape(-1, 3)
    unique, which = np.unique(corners, axis=0, return_inverse=True)
    a, b, c, d = which.reshape(-1, 4).T
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(unique * np.asarray(size, float), F)


# Fixed shapes.
# Shapes given by one expression: family -> name -> mesh; a star marks those held out.


def _stretched(mesh: Mesh, factors: ArrayLike) -> Mesh:
    """The mesh with its vertices multiplied by factors (3,), (n, 1) or (n, 3), or by a matrix (3, 3) from the right."""
    by = np.asarray(factors)
    return Mesh(mesh.V @ by if by.shape == (3, 3) else mesh.V * by, mesh.F)


def _noisy(mesh: Mesh, amount: float, seed: int) -> Mesh:
    return Mesh(mesh.V + amount * seeded(seed).standard_normal(mesh.V.shape), mesh.F)


def _heights(mesh: Mesh, height: AnyArray) -> Mesh:
    return Mesh(raised(mesh.V[:, :2], height), mesh.F)


def _scattered(n: int, seed: int) -> Mesh:
    return planar(seeded(seed).random((n, 2)))


def _on_sphere(n: int, seed: int) -> FloatArray:
    points = seeded(seed).standard_normal((n, 3))
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))


def _bumps(V: FloatArray) -> FloatArray:
    return 1 + 0.15 * np.sin(6 * V[:, :1]) * np.cos(7 * V[:, 1:2]) * np.cos(5 * V[:, 2:])


def _capped(around: int) -> Mesh:
    """Two rings, each capped by a fan around one of its own vertices."""
    side = cylinder(around, 1, 4.0)
    return Mesh(side.V, np.concatenate([side.F, caps(2, around)]))


def _spheres(ratio: float) -> Mesh:
    one = icosphere(3)
    return joined(one, Mesh(one.V * ratio + [2 * ratio + 2, 0, 0], one.F))


def _shear(by: float) -> FloatArray:
    return np.array([[1, 0, 0], [by, 1, 0], [0, 0, 1.0]])


def _cells(n: int, where: Callable[[IntArray], Any]) -> Mesh:
    """Of n^3 cells those that a function of their indices (3, n, n, n) chooses."""
    return boxes(np.argwhere(where(np.indices((n, n, n)))))


_EXPRESSIONS: dict[str, dict[str, Callable[[], Mesh]]] = {
    "smooth": {
        "sphere": lambda: icosphere(4),
        "ellipsoid": lambda: _stretched(icosphere(4), [1, 1, 8]),
        "torus": lambda: torus(30, 60),
        "thin torus *": lambda: torus(12, 240, 0.05),
        "bumpy sphere": lambda: _stretched(icosphere(4), _bumps(icosphere(4).V)),
        "monkey saddle *": lambda: _heights(
            disk(20), disk(20).V[:, 0] ** 3 - 3 * disk(20).V[:, 0] * disk(20).V[:, 1] ** 2
        ),
        "cone": lambda: cone(40, 30),
        "regular grid": lambda: grid(40),
        "long strip": lambda: strip(1500, 3),
    },
    "topology": {"book": lambda: book(5, 12)},
    "CAD": {
        "capped cylinder 128": lambda: _capped(64),
        "capped cylinder 512": lambda: _capped(256),
        "box cube": lambda: boxes(np.zeros((1, 3), int)),
        "box long": lambda: boxes(np.zeros((1, 3), int), np.array([1.0, 1.0, 30.0])),
    },
    "scattered": {
        "scattered square 1000": lambda: _scattered(1000, 3),
        "scattered square 100": lambda: _scattered(100, 4),
        "sheared grid by 3": lambda: _stretched(grid(30), _shear(3.0)),
        "sheared grid by 10": lambda: _stretched(grid(30), _shear(10.0)),
        "stretched grid *": lambda: _stretched(grid(30), [40, 1, 1]),
    },
    "terrain": {
        "noise 10 times": lambda: _heights(grid(30), 10 / 30 * seeded(10).random(31**2)),
        "noise 100 times": lambda: _heights(grid(30), 100 / 30 * seeded(10).random(31**2)),
        "cliff": lambda: _heights(grid(40), 2.0 * (grid(40).V[:, 0] > 0.5)),
    },
    "hull": {
        "hull of 12": lambda: hull(_on_sphere(12, 12)),
        "hull of 35": lambda: hull(_on_sphere(35, 13)),
        "hull of 100": lambda: hull(_on_sphere(100, 14)),
        "hull of 400": lambda: hull(_on_sphere(400, 15)),
        "flat hull *": lambda: hull(_on_sphere(150, 16) * [1, 1, 0.03]),
        "hull of a cloud *": lambda: hull(seeded(17).standard_normal((300, 3))),
    },
    "voxels": {
        "cube less one": lambda: _cells(2, lambda i: (i < 1).any(axis=0)),
        # A lattice of square beams between 4 by 4 by 4 nodes, of genus 81.
        "beams": lambda: _cells(7, lambda i: (i % 2 == 0).sum(axis=0) >= 2),
        "voxel ball": lambda: _cells(15, lambda i: ((i - 7) ** 2).sum(axis=0) <= 42),
    },
    "rough": {
        "spiky sphere": lambda: _stretched(icosphere(3), np.where(seeded(20).random(642) < 0.05, 3.0, 1.0)[:, None]),
        "noisy sphere": lambda: _noisy(icosphere(4), 0.05, 21),
        "crumpled *": lambda: _noisy(disk(18), 0.04, 22),
    },
    "components": {f"two spheres 1 to {ratio}": partial(_spheres, float(ratio)) for ratio in (1, 10, 100)},
    "small": {
        "triangle": lambda: Mesh([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]]),
        "needle *": lambda: Mesh(
            np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-4, 0], [0.5, -1e-4, 0]]), [[0, 1, 2], [1, 0, 3]]
        ),
        "tetrahedron": lambda: Mesh(
            [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
        ),
        "octahedron *": lambda: hull(np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 3]),
    },
}
SHAPES += [
    Shape(name.removesuffix(" *"), family, make, name.endswith("*"))
    for family, members in _EXPRESSIONS.items()
    for name, make in members.items()
]


# Smooth surfaces.


@shape("smooth", held_out=True)
def _latitudes() -> Mesh:
    """A sphere by meridians and parallels, with fans of thin triangles at the poles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 31), np.linspace(0, 2 * np.pi, 61)[:-1], indexing="ij")
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return merged(lattice_mesh(x, y, np.cos(theta), wrap_columns=True))


# Surfaces without an orientation, or with edges of many faces.


@shape("topology")
def _moebius_band() -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 121), np.linspace(-0.4, 0.4, 9), indexing="ij")
    r = 1 + v * np.cos(u / 2)
    return merged(lattice_mesh(r * np.cos(u), r * np.sin(u), v * np.sin(u / 2)))


@shape("topology", held_out=True)
def _klein_bottle() -> Mesh:
    """The figure of eight turned by half a turn on its way around; it crosses itself without sharing vertices."""
    u, v = np.meshgrid(np.arange(80) * 2 * np.pi / 80, np.arange(40) * 2 * np.pi / 40, indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    tube = lattice_mesh(r * np.cos(u), r * np.sin(u), z, wrap_columns=True)
    # The last row is glued to the first with v turned into -v.
    j = np.arange(40)
    last, following = 79 * 40 + j, 79 * 40 + (j + 1) % 40
    first, after = (-j) % 40, (-j - 1) % 40
    seam = np.concatenate([np.stack([last, following, first], axis=1), np.stack([following, after, first], axis=1)])
    return Mesh(tube.V, np.concatenate([tube.F, seam]))


@shape("topology")
def _pinched() -> Mesh:
    """Two cones that meet in their tips."""
    one = cone(24, 8)
    return merged(joined(one, Mesh(one.V * [1, 1, -1], one.F[:, ::-1])))


# Parts as they leave a CAD program: few vertices, long triangles, fans.


@shape("CAD", held_out=True)
def _pill() -> Mesh:
    """Long triangles along the side of a cylinder between two finely meshed caps of a sphere."""
    theta = np.concatenate([np.linspace(0, np.pi / 2, 13), np.linspace(np.pi / 2, np.pi, 13)])
    shift = np.where(np.arange(26) < 13, 6.0, 0.0)
    return merged(revolved(np.sin(theta), np.cos(theta) + shift, 48))


def _plate_with_holes(holes: FloatArray, around: int, seed: int) -> Mesh:
    """The rectangle 10 by 6 with round holes (k, 3): centres and radii; vertices on the rims and few elsewhere."""
    corners = np.array([[0, 0], [10, 0], [10, 6], [0, 6], [5, 0], [5, 6.0]])
    inside = seeded(seed).uniform([0.3, 0.3], [9.7, 5.7], (30, 2))
    points, F = holed_plate(holes[:, :2], holes[:, 2], ring(around, 0.5), corners, inside, 0.2)
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
    V = np.concatenate([np.zeros((1, 3)), raised(ring(300))])
    k = np.arange(300)
    return Mesh(V, np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % 300], axis=1))


@shape("CAD", held_out=True)
def _gear() -> Mesh:
    """A toothed wheel of 24 teeth with a bore, extruded; its faces are Delaunay triangles between bore and teeth."""
    angle = 2 * np.pi * np.arange(96) / 96
    radius = np.where((np.arange(96) // 2) % 2 == 0, 3.0, 2.6)
    rim = np.concatenate([radius[:, None] * ring(96), ring(48)])
    F = delaunay(rim)
    middle = rim[F].mean(axis=1)
    r, at = np.linalg.norm(middle, axis=1), np.arctan2(middle[:, 1], middle[:, 0]) % (2 * np.pi)
    F = F[(r > 0.998) & (r < np.interp(at, np.append(angle, 2 * np.pi), np.append(radius, radius[0])))]
    return extruded(rim, F, 1.0)


@shape("CAD")
def _stairs() -> Mesh:
    """Twelve steps of two rectangles each, every rectangle two triangles."""
    steps = np.repeat(np.arange(13), 2)
    return lattice_mesh(steps[1:], np.array([[0.0], [5.0]]), steps[:-1] * 0.5)


@shape("CAD", held_out=True)
def _wide_funnel() -> Mesh:
    """A cone whose rings come closer and closer to the tip, with 24 vertices each."""
    radius: FloatArray = 0.6 ** np.arange(20.0)
    return revolved(radius, 2 * radius, 24)


# Scattered points.


@shape("scattered", held_out=True)
def _scattered_disk() -> Mesh:
    r, angle = seeded(5).random((2, 1500))
    return planar(np.sqrt(r)[:, None] * np.stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)], axis=1))


@shape("scattered")
def _clusters() -> Mesh:
    """Points in a square, most of them in five small clusters: edges differ by a factor of a thousand."""
    rng = seeded(6)
    centres = rng.random((5, 2))
    points = np.concatenate(
        [rng.random((300, 2)), *(centre + 0.003 * rng.standard_normal((200, 2)) for centre in centres)]
    )
    return planar(points)


@shape("scattered")
def _slivers_at_the_rim() -> Mesh:
    """A square whose boundary vertices stand on a cubic scale, with few points inside."""
    s = np.linspace(-1, 1, 41) ** 3
    rim = np.concatenate([np.column_stack([s, np.full(41, side)]) for side in (-1.0, 1.0)])
    rim = np.concatenate([rim, rim[:, ::-1]])
    return planar(np.unique(np.concatenate([rim, seeded(7).uniform(-0.9, 0.9, (120, 2))]), axis=0))


@shape("scattered", held_out=True)
def _graded_square() -> Mesh:
    """Edges from 1 to 1 / 1000 towards a corner."""
    steps = np.linspace(0, 1, 41) ** 3
    return lattice_mesh(steps, steps[:, None])


# Height fields and terrain.


@shape("terrain", _5000=(5000, 0.3, 8), coarse=(47, 0.5, 9))
def _height_field(n: int, height: float, seed: int) -> Mesh:
    points = seeded(seed).random((n, 2))
    return planar(points, height * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1]))


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
    return _heights(grid(64), z.ravel())


@shape("terrain", held_out=True)
def _ridges() -> Mesh:
    """A folded sheet: 20 steep folds of a few triangles each."""
    return lattice_mesh(np.linspace(0, 1, 41)[:, None], np.linspace(0, 1, 11), 0.2 * (np.arange(41)[:, None] % 2))


# Voxels and fractals.


@shape("voxels", held_out=True)
def _sponge() -> Mesh:
    """Menger's sponge of level 2."""
    i = np.indices((9, 9, 9))
    level = [((i // step % 3) == 1).sum(axis=0) < 2 for step in (1, 3)]
    return boxes(np.argwhere(level[0] & level[1]))


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
    column, row = np.indices((45, 45))
    return opened((column % 5 != 4) | np.where(column // 5 % 2 == 0, row >= 41, row < 4))


@shape("maze")
def _spiral() -> Mesh:
    """A corridor that winds in, four turns."""
    turn = np.linspace(0, 8 * np.pi, 400)
    radius = 1 + turn / 3 + np.array([[0.0], [0.6], [1.2]])
    return lattice_mesh(radius * np.cos(turn), radius * np.sin(turn))


@shape("maze")
def _labyrinth() -> Mesh:
    """A random spanning tree of rooms, carved out of a grid of cells."""
    rng, n = seeded(19), 12
    fine = np.kron(np.pad(corridors(rng, n), 1), np.ones((2, 2), bool))
    side = len(fine)
    mesh = strip(side, side)
    return compact(mesh.V, mesh.F[np.concatenate([fine.ravel(), fine.ravel()])])


# Rough and thin surfaces.


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
    return merged(revolved(np.sin(t), np.cos(t), 40))


# Several components.


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
        part = hull(_on_sphere(60, 40 + k))
        parts.append(Mesh(size * part.V + [at, 0, 0], part.F))
        at += 3 * size
    return joined(*parts)


# Made after every default had been chosen, all held out.


@shape("smooth", held_out=True)
def _gyroid() -> Mesh:
    """A piece of the gyroid by marching cubes, with their slivers and a boundary of many loops."""
    n = 22
    z, y, x = np.meshgrid(*(np.linspace(0, 2 * np.pi, n),) * 3, indexing="ij")
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    V, F, _ = igl.marching_cubes(field.ravel(), points, n, n, n, 0.1)
    return merged(Mesh(V, F))


@shape("smooth", held_out=True)
def _trefoil() -> Mesh:
    """A tube around a knot, with rings closer together than the vertices on them."""
    t = 2 * np.pi * np.arange(300) / 300
    centre = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    along = np.roll(centre, -1, axis=0) - np.roll(centre, 1, axis=0)
    V = tube(centre, along, 0.35, 8, up=(0.3, 0.2, 1.0)).V
    return merged(Mesh(np.concatenate([V, V[:8]]), lattice_faces(301, 8, wrap_columns=True)))


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
    return lattice_mesh(*np.moveaxis(rings, 2, 0), wrap_columns=True)


@shape("CAD", held_out=True)
def _drum() -> Mesh:
    """The hull of two circles in tilted planes: long triangles between two polygons that are fans."""
    flat = raised(ring(120))
    tilt = np.array([[np.cos(0.7), 0, np.sin(0.7)], [0, 1, 0], [-np.sin(0.7), 0, np.cos(0.7)]])
    return hull(np.concatenate([flat * 1.5, 0.6 * flat @ tilt + [0.4, 0.1, 3.0]]))


@shape("scattered", held_out=True)
def _sunflower() -> Mesh:
    """Seeds at the golden angle, denser towards the centre by the cube of the radius."""
    k = np.arange(1200) + 0.5
    radius, angle = (k / 1200) ** 1.5, k * np.pi * (3 - np.sqrt(5))
    return planar(radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


@shape("terrain", held_out=True)
def _dunes() -> Mesh:
    """Waves on cells of 1 : 6 whose corners are moved."""
    mesh, rng = grid(36), seeded(31)
    x, y = mesh.V[:, 0] + 0.2 / 36 * rng.uniform(-1, 1, mesh.n_vertices), 6 * mesh.V[:, 1]
    return Mesh(np.stack([x, y, 0.08 * np.sin(25 * x + np.sin(2 * y))], axis=1), mesh.F)


@shape("voxels", held_out=True)
def _wandering_cells() -> Mesh:
    """Cells that a random walk visits."""
    return boxes(np.cumsum(_STEPS[seeded(32).integers(0, 6, 150)], axis=0))


@shape("maze", held_out=True)
def _fern() -> Mesh:
    """A stem of cells with leaves on both sides, which are two cells wide and one cell apart."""
    column, row = np.indices((36, 36))
    is_leaf = (row % 3 < 2) & (np.abs(column - 18) < 17 - row // 3)
    return opened(is_leaf | (np.abs(column - 17.5) < 1))


@shape("topology", held_out=True)
def _crossed_sheets() -> Mesh:
    """Two rectangles through one another along a common edge path, each with its own spacing."""
    s, t = np.linspace(0, 1, 25)[:, None], np.linspace(-1, 1, 21) ** 3
    return merged(joined(lattice_mesh(s, t), lattice_mesh(s, 0.3 * t, t)))


@shape("rough", held_out=True)
def _folded_paper() -> Mesh:
    """Miura's fold: parallelograms of two triangles, mountains and valleys."""
    i, j = np.arange(25)[:, None], np.arange(25)
    return lattice_mesh(i + 0.5 * (j % 2), 0.9 * j, 0.7 * (i % 2))


# Random members.


def _bounded(outline: FloatArray, points: FloatArray) -> BoolArray:
    """Whether points (k, 2) lie inside a polygon (e, 2): crossings of a ray to the right are odd."""
    a, b = outline, np.roll(outline, -1, axis=0)
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return np.asarray(np.count_nonzero(crosses & (x < at), axis=1) % 2 == 1)


def _filled(outline: FloatArray, inner: FloatArray) -> tuple[FloatArray, IntArray]:
    """The corners (e, 2) of a polygon with the points that are inside, and the Delaunay triangles inside."""
    points = np.concatenate([outline, inner[_bounded(outline, inner)]])
    F = delaunay(points)
    return points, F[_bounded(outline, points[F].mean(axis=1))]


def _tetrahedra_surface(points: FloatArray, T: IntArray) -> Mesh:
    """The triangles that belong to one tetrahedron of T (k, 4) alone, turned outward."""
    # igl's order of the corners needs positively oriented tetrahedra.
    edges = points[T[:, 1:]] - points[T[:, :1]]
    T = np.where((np.linalg.det(edges) < 0)[:, None], T[:, [0, 2, 1, 3]], T)
    F = np.asarray(igl.boundary_facets(np.ascontiguousarray(T, np.int64))[0], np.int64)
    return compact(points, F)


def _holed_rectangle(rng: Generator, around: int, n_inside: int) -> tuple[FloatArray, IntArray]:
    """Points (k, 2) and triangles of a rectangle of 10 by 6 with round holes, few vertices between them."""
    holes: list[tuple[float, float, float]] = []
    for _ in range(200):
        r = rng.uniform(0.15, 0.9)
        x, y = rng.uniform([r + 0.1, r + 0.1], [9.9 - r, 5.9 - r])
        if all(np.hypot(x - a, y - b) > r + s + 0.08 for a, b, s in holes) and len(holes) < rng.integers(3, 25):
            holes.append((x, y, r))
    inside = rng.uniform([0.2, 0.2], [9.8, 5.8], (n_inside, 2))
    corners = [[0, 0], [10, 0], [10, 6], [0, 6]]
    return holed_plate(np.array(holes)[:, :2], np.array(holes)[:, 2], ring(around), corners, inside, 0.05)


def _band(middle: FloatArray, across: FloatArray, rows: int) -> Mesh:
    """A band of `rows` rows of vertices about a curve (k, 3), reaching by `across` (k, 3) to either side."""
    V = middle[None] + np.linspace(-1, 1, rows)[:, None, None] * across[None]
    return lattice_mesh(*np.moveaxis(V, 2, 0))


@family("random tetrahedra")
def tetrahedra_surface(rng: Generator) -> Mesh:
    """The boundary of the Delaunay tetrahedra between random points: of a half of them that hang together."""
    points = rng.random((int(rng.integers(100, 700)), 3))
    T = delaunay(points)
    middle = points[T].mean(axis=1)
    return _tetrahedra_surface(points, T[np.linalg.norm(middle - 0.5, axis=1) < rng.uniform(0.3, 0.6)])


@family("alpha shape")
def alpha_shape(rng: Generator) -> Mesh:
    """The boundary of the Delaunay tetrahedra with small circumspheres between points on a bent body."""
    n = int(rng.integers(200, 700))
    points = rng.standard_normal((n, 3)) * [1, 1, 0.3]
    points[:, 2] += 0.5 * points[:, 0] ** 2
    T = delaunay(points)
    edges = points[T[:, 1:]] - points[T[:, :1]]
    centre = np.linalg.solve(edges, 0.5 * (edges**2).sum(axis=2)[:, :, None])[:, :, 0]
    radius = np.linalg.norm(centre, axis=1)
    return _tetrahedra_surface(points, T[radius < np.quantile(radius, rng.uniform(0.5, 0.9))])


@family("star polygon")
def star_polygon(rng: Generator) -> Mesh:
    """A flat star with long thin points, its outline alone or with some vertices inside."""
    tips = int(rng.integers(5, 60))
    radius = np.where(np.arange(2 * tips) % 2 == 0, 1.0, rng.uniform(0.1, 0.6)) * rng.uniform(0.8, 1.2, 2 * tips)
    outline = radius[:, None] * ring(2 * tips)
    parts = int(rng.integers(1, 8))
    s = np.arange(parts)[None, :, None] / parts
    rim = (outline[:, None] * (1 - s) + np.roll(outline, -1, axis=0)[:, None] * s).reshape(-1, 2)
    points, F = _filled(rim, rng.uniform(-0.3, 0.3, (int(rng.integers(0, 200)), 2)))
    return compact(raised(points), F)


@family("helix")
def helix(rng: Generator) -> Mesh:
    """A tube along a helix, with rings closer together than the vertices on them or farther apart."""
    turns, n = rng.uniform(2, 8), int(rng.integers(60, 400))
    t = np.linspace(0, 2 * np.pi * turns, n)
    centre = np.stack([np.cos(t), np.sin(t), rng.uniform(0.05, 0.4) * t], axis=1)
    return tube(centre, np.gradient(centre, axis=0), rng.uniform(0.05, 0.25), int(rng.integers(3, 10)))


@family("spiral ramp")
def spiral_ramp(rng: Generator) -> Mesh:
    """A ramp around an axis, flat across: a strip that winds over itself."""
    n, t = int(rng.integers(60, 400)), np.linspace(0, 2 * np.pi * rng.uniform(1, 6), 1000)
    t = np.sort(rng.choice(t, n, replace=False))
    out = np.stack([np.cos(t), np.sin(t), np.zeros(n)], axis=1)
    middle = 2 * out + np.array([0, 0, rng.uniform(0.1, 0.6)]) * t[:, None]
    return _band(middle, rng.uniform(0.2, 1.5) * out, int(rng.integers(2, 10)))


@family("maze")
def maze(rng: Generator) -> Mesh:
    """The corridors of a random tree on cells, each corridor one cell wide, walls one cell wide."""
    size, fine = int(rng.integers(4, 9)), int(rng.integers(1, 4))
    return opened(np.kron(corridors(rng, size), np.ones((fine, fine), bool)))


@family("CAD plate")
def cad_plate(rng: Generator) -> Mesh:
    """A flat plate with round holes, vertices on the rims and few elsewhere."""
    points, F = _holed_rectangle(rng, int(rng.integers(12, 96)), int(rng.integers(0, 60)))
    return compact(raised(points), F)


@family("thin plate")
def thin_plate(rng: Generator) -> Mesh:
    """The same as a body: two sheets a small thickness apart, joined along the rims."""
    points, F = _holed_rectangle(rng, int(rng.integers(8, 40)), int(rng.integers(0, 60)))
    return extruded(points, F, 10 ** rng.uniform(-2.5, -0.3))


@family("CAD cylinder")
def cad_cylinder(rng: Generator) -> Mesh:
    """Few rings of many sides, capped by fans around one of their own vertices or left open."""
    around, rings = int(rng.integers(24, 600)), int(rng.integers(2, 5))
    height = np.sort(rng.random(rings)) * rng.uniform(0.2, 8)
    side = revolved(np.ones(rings), height, around)
    if rng.random() < 0.4:
        return merged(side)
    return Mesh(side.V, np.concatenate([side.F, caps(rings, around)]))


@family("shell")
def shell(rng: Generator) -> Mesh:
    """A cap of a sphere with a thickness: an outer and an inner sheet joined along a rim."""
    n, thickness = int(rng.integers(150, 900)), 10 ** rng.uniform(-2, -0.5)
    k = np.arange(n) + 0.5
    points = np.sqrt(k / n)[:, None] * np.stack([np.cos(2.39996 * k), np.sin(2.39996 * k)], axis=1)
    points += rng.uniform(0, 0.3) / np.sqrt(n) * rng.standard_normal((n, 2))
    F, bend = delaunay(points), rng.uniform(0.3, 1.0)
    height = np.sqrt(np.maximum(1.5 - bend * (points**2).sum(axis=1), 0.01))
    V = np.concatenate([raised(points, height), raised(points * (1 - thickness), height * (1 - thickness))])
    return compact(V, np.concatenate([F, F[:, ::-1] + n, walls(F, n)]))


@family("carved voxels")
def carved_voxels(rng: Generator) -> Mesh:
    """A block of cells out of which random boxes were cut, without cells that touch in edges or corners alone."""
    where = np.ones(tuple(rng.integers(5, 12, 3)), bool)
    for _ in range(int(rng.integers(3, 25))):
        low, size = rng.integers(0, where.shape), rng.integers(1, 5, 3)
        cell = np.indices(where.shape).T - low
        where[((cell >= 0) & (cell < size)).all(axis=-1).T] = False
    return boxes(np.argwhere(where) if where.any() else np.zeros((1, 3), np.int64), rng.uniform(0.3, 1.0, 3))


@family("nested circles")
def nested_circles(rng: Generator) -> Mesh:
    """The Delaunay triangles of circles inside one another, with as many vertices on each, and holes or none."""
    n, around = int(rng.integers(2, 9)), int(rng.integers(16, 160))
    radius = np.sort(rng.uniform(0.1, 1, n))
    return planar(np.concatenate([r * ring(around) + 0.05 * r * rng.uniform(-1, 1, 2) for r in radius]))


@family("spiky sphere")
def spiky_sphere(rng: Generator) -> Mesh:
    """A sphere of which some vertices stand out far."""
    mesh = icosphere(int(rng.integers(2, 5)))
    is_spike = rng.random(mesh.n_vertices) < rng.uniform(0.01, 0.2)
    return Mesh(mesh.V * np.where(is_spike, rng.uniform(1.2, 4), 1.0)[:, None], mesh.F)


@family("ribbon")
def ribbon(rng: Generator) -> Mesh:
    """A twisted band of two to four rows."""
    n = int(rng.integers(50, 700))
    t = np.linspace(0, rng.uniform(3, 30), n)
    a = rng.uniform(0.3, 1.5, 6)
    middle = np.stack([t, a[0] * np.sin(a[1] * t), a[2] * np.cos(a[3] * t)], axis=1)
    twist = a[4] * t
    across = a[5] * 0.3 * np.stack([np.zeros(n), np.cos(twist), np.sin(twist)], axis=1)
    return _band(middle, across, int(rng.integers(2, 5)))


@family("tube of few sides")
def tube_of_few_sides(rng: Generator) -> Mesh:
    """A long tube of three to eight sides along a random smooth curve."""
    n = int(rng.integers(50, 400))
    t = np.linspace(0, rng.uniform(5, 40), n)
    a = rng.uniform(0.1, 0.8, 4)
    centre = np.stack([t, np.sin(a[0] * t) / a[0], a[1] * np.cos(a[2] * t)], axis=1)
    return tube(centre, np.gradient(centre, axis=0), 0.2 + 0.3 * a[3], int(rng.integers(3, 9)))


@family("vase")
def vase(rng: Generator) -> Mesh:
    """A surface of revolution with a random profile of necks and bellies, on long or flat cells."""
    rings, around = int(rng.integers(8, 80)), int(rng.integers(6, 100))
    z = np.linspace(0, rng.uniform(1, 10), rings)
    profile = 1 + sum(rng.uniform(0, 0.4) * np.sin(rng.uniform(0.5, 6) * z + rng.uniform(0, 6)) for _ in range(3))
    radius = np.maximum(profile, 0.08)
    if rng.random() < 0.5:
        radius[0] = 0.0
    return merged(revolved(radius, z, around))


@family("terrain")
def terrain(rng: Generator) -> Mesh:
    """Heights with a spectrum of random steepness over a grid or scattered points."""
    n = int(rng.integers(12, 45))
    spectrum = 1 / (1 + np.hypot(*np.meshgrid(np.fft.fftfreq(n) * n, np.fft.fftfreq(n) * n))) ** rng.uniform(1, 2.5)
    height = np.real(np.fft.ifft2(spectrum * np.fft.fft2(rng.standard_normal((n, n)))))
    height *= 10 ** rng.uniform(-1.5, 0) / (height.std() + 1e-12)
    mesh = grid(n - 1)
    return Mesh(mesh.V + raised(np.zeros((n * n, 2)), height.ravel()), mesh.F)


@family("handles")
def handles(rng: Generator) -> Mesh:
    """The boundary of a random walk through cells, thickened here and there: a surface with many handles."""
    nodes = 2 * np.cumsum(_STEPS[rng.integers(0, 6, int(rng.integers(10, 60)))], axis=0)
    return boxes(np.concatenate([nodes, (nodes[1:] + nodes[:-1]) // 2]))


@family("hull")
def flat_hull(rng: Generator) -> Mesh:
    """The convex hull of points in a flat or long ellipsoid, in it or on it."""
    points = rng.standard_normal((int(rng.integers(20, 800)), 3))
    if rng.random() < 0.7:
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return hull(points * 10 ** rng.uniform(-1, 0, 3))


@family("clusters")
def clusters(rng: Generator) -> Mesh:
    """Points of a plane in clusters of very different size."""
    parts = [rng.random((int(rng.integers(20, 200)), 2))]
    for _ in range(int(rng.integers(1, 6))):
        parts.append(rng.random(2) + 10 ** rng.uniform(-4, -1) * rng.standard_normal((int(rng.integers(30, 200)), 2)))
    points = np.concatenate(parts)
    return compact(raised(points), delaunay(points))


@family("stretched noise")
def stretched_noise(rng: Generator) -> Mesh:
    """A noisy sphere, stretched along the axes."""
    mesh = icosphere(int(rng.integers(2, 5)))
    V = mesh.V + 10 ** rng.uniform(-2.5, -0.8) * rng.standard_normal(mesh.V.shape)
    return Mesh(V * 10 ** rng.uniform(-1, 0.3, 3), mesh.F)


@family("extrusion")
def extrusion(rng: Generator) -> Mesh:
    """A random polygon with a height and nothing but its outline on the two lids, a gear for instance."""
    n = int(rng.integers(12, 200))
    radius = 1 + rng.uniform(0.05, 0.5) * np.sign(np.sin(rng.integers(2, 20) * 2 * np.pi * (np.arange(n) + 0.3) / n))
    return extruded(*_filled(radius[:, None] * ring(n), np.empty((0, 2))), rng.uniform(0.02, 3))


@family("comb")
def comb(rng: Generator) -> Mesh:
    """A beam with teeth: long thin prisms side by side, each of a few triangles."""
    teeth = int(rng.integers(3, 30))
    cells = [(i, 0, 0) for i in range(2 * teeth - 1)]
    cells += [(2 * i, j, 0) for i in range(teeth) for j in range(1, 2 + int(rng.integers(0, 12)))]
    return boxes(np.array(cells), rng.uniform(0.1, 1.0, 3))


@family("folds")
def folds(rng: Generator) -> Mesh:
    """Paper folded along random parallels, with a few vertices across."""
    n, rows = int(rng.integers(10, 150)), int(rng.integers(2, 30))
    x = np.cumsum(rng.uniform(0.2, 1, n))
    z = np.cumsum(rng.uniform(-1, 1, n))
    return _band(np.stack([x, np.zeros(n), z], axis=1), np.tile([0.0, rng.uniform(1, 20), 0.0], (n, 1)), rows)


@family("several spheres")
def several_spheres(rng: Generator) -> Mesh:
    """Spheres of different size and fineness beside one another: several components."""
    parts = [icosphere(int(rng.integers(1, 4))) for _ in range(int(rng.integers(2, 5)))]
    return joined(*(Mesh(part.V * 10 ** rng.uniform(-2, 1) + 30.0 * i, part.F) for i, part in enumerate(parts)))


# Nearly flat random shapes, on which shortest paths pass many vertices whose angles sum to 2 pi up to the rounding of
# coordinates. Some are rotated at random, rounded to single precision, or moved far from the origin.


def _between(rng: Generator, least: float, most: float) -> float:
    """A random number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(least), np.log(most))))


def _stored(rng: Generator, mesh: Mesh) -> Mesh:
    """A mesh as it may be stored in a file: rotated, far from the origin, in single precision."""
    V, size = mesh.V, np.ptp(mesh.V, axis=0).max()
    if rng.random() < 0.7:
        V = V @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if rng.random() < 0.2:
        V = V + 5e6 / 100 * size
    elif rng.random() < 0.6:
        V = V.astype(np.float32).astype(float)
    return Mesh(V, mesh.F)


def _turned_rings(rng: Generator, radius: FloatArray, height: FloatArray, around: int) -> Mesh:
    """Rings of vertices with these radii and heights, each rotated against the one before by the same angle."""
    turn = rng.choice([0.0, np.pi / around, rng.uniform(0, 1)])
    angle = 2 * np.pi * np.arange(around) / around + turn * np.arange(len(radius))[:, None]
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    return _stored(rng, lattice_mesh(x, y, height[:, None], wrap_columns=True))


def _rings(rng: Generator) -> tuple[int, int]:
    """How many rings, and how many vertices on each."""
    return int(_between(rng, 3, 40)), int(_between(rng, 3, 40))


@family("nearly flat cylinder")
def _cylinder(rng: Generator) -> Mesh:
    along, around = _rings(rng)
    return _turned_rings(rng, np.ones(along), np.linspace(0, _between(rng, 0.1, 20), along), around)


@family("nearly flat cone")
def _cone(rng: Generator) -> Mesh:
    along, around = _rings(rng)
    radius, height = np.linspace(rng.uniform(0.05, 0.95), 1, along), np.linspace(0, _between(rng, 0.1, 20), along)
    return _turned_rings(rng, radius, height, around)


@family("pipe reducer")
def _reducer(rng: Generator) -> Mesh:
    along, around = _rings(rng)
    height = np.linspace(-1, 1, along) * rng.uniform(2, 20)
    return _turned_rings(rng, 1 + np.tanh(height) / 2, height, around)


@family("geometrically spaced rings")
def _spaced_rings(rng: Generator) -> Mesh:
    along, around = _rings(rng)
    height = np.cumsum(rng.uniform(1.01, 1.6) ** np.arange(along)) * 2 * np.pi / around
    return _turned_rings(rng, np.ones(along), height, around)


@family("nearly flat grid")
def _grid(rng: Generator) -> Mesh:
    n = int(_between(rng, 4, 40))
    z = rng.normal(size=(n, n)) * 10 ** rng.uniform(-12, 0)
    return _stored(rng, lattice_mesh(np.arange(n)[:, None], np.arange(n), z))


@family("grid of integers")
def _integers(rng: Generator) -> Mesh:
    n = int(_between(rng, 4, 30))
    x, y = (np.arange(n) * rng.integers(1, 4) for _ in range(2))
    return _stored(rng, lattice_mesh(x[:, None], y, rng.integers(0, rng.integers(1, 4), size=(n, n))))
