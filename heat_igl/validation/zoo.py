"""Shapes to try a default on: smooth, CAD, scattered points, terrain, hulls, voxels, mazes, slivers, components.

A default that is chosen on some meshes is measured on others. A third of these shapes is held out: nothing in the
package may be tuned on them (`Shape.held_out`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.shapes import book, cone, cylinder, disk, grid, icosphere, lattice_faces, strip, torus
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["SHAPES", "Shape"]


@dataclass(frozen=True)
class Shape:
    """A shape of the zoo.

    Attributes
    ----------
    name, family : str
        Its name, and the kind of shapes that it belongs to.
    make : callable
        Returns the `Mesh`; the same bits at every call.
    held_out : bool
        Whether it is one of those that no default may be tuned on.
    """

    name: str
    family: str
    make: Callable[[], Mesh]
    held_out: bool


SHAPES: list[Shape] = []
"""All shapes, family after family."""


def _shape(
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


def _seeded(seed: int) -> np.random.Generator:
    return np.random.default_rng([20240815, seed])


def _delaunay(points: FloatArray) -> IntArray:
    """The Delaunay triangles of points (k, 2) in the plane, all counter-clockwise."""
    from scipy.spatial import Delaunay  # takes as long to import as the rest of the package

    return np.asarray(Delaunay(points).simplices, np.int64)


def _raised(points: FloatArray, height: AnyArray | float = 0.0) -> FloatArray:
    return np.column_stack([points, np.broadcast_to(height, len(points))])


def _compact(V: FloatArray, F: IntArray) -> Mesh:
    """The mesh without the vertices that no face uses."""
    used, F = np.unique(F, return_inverse=True)
    return Mesh(V[used], F.reshape(-1, 3))


def _joined(*parts: Mesh) -> Mesh:
    first = np.cumsum([0, *(part.n_vertices for part in parts)])
    return Mesh(
        np.concatenate([part.V for part in parts]),
        np.concatenate([part.F + begin for part, begin in zip(parts, first, strict=False)]),
    )


def _merged(V: FloatArray, F: IntArray) -> Mesh:
    """The mesh with equal positions made one vertex, and without the triangles that this collapses."""
    scale = 1e-9 * float(np.ptp(V, axis=0).max())
    _, first, which = np.unique(np.round(V / scale), axis=0, return_index=True, return_inverse=True)
    F = which.reshape(-1)[F]
    kept = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    return Mesh(V[first], F[kept])


# Smooth surfaces.


@_shape("smooth")
def _sphere() -> Mesh:
    return icosphere(4)


@_shape("smooth", held_out=True)
def _latitudes() -> Mesh:
    """A sphere by meridians and parallels, with fans of thin triangles at the poles."""
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 31), np.linspace(0, 2 * np.pi, 61)[:-1], indexing="ij")
    V = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)
    return _merged(V, lattice_faces(31, 60, wrap_columns=True))


@_shape("smooth")
def _ellipsoid() -> Mesh:
    """A sphere stretched to 1 : 1 : 8 with the triangles that it has."""
    mesh = icosphere(4)
    return Mesh(mesh.V * [1, 1, 8], mesh.F)


@_shape("smooth")
def _torus() -> Mesh:
    return torus(30, 60)


@_shape("smooth", held_out=True)
def _thin_torus() -> Mesh:
    return torus(12, 240, 0.05)


@_shape("smooth")
def _bumpy_sphere() -> Mesh:
    V, F = icosphere(4).V, icosphere(4).F
    return Mesh(V * (1 + 0.15 * np.sin(6 * V[:, :1]) * np.cos(7 * V[:, 1:2]) * np.cos(5 * V[:, 2:])), F)


@_shape("smooth", held_out=True)
def _monkey_saddle() -> Mesh:
    V = disk(20).V
    x, y = V[:, 0], V[:, 1]
    return Mesh(_raised(V[:, :2], x**3 - 3 * x * y**2), disk(20).F)


@_shape("smooth")
def _cone() -> Mesh:
    return cone(40, 30)


@_shape("smooth")
def _regular_grid() -> Mesh:
    return grid(40)


@_shape("smooth")
def _long_strip() -> Mesh:
    return strip(1500, 3)


# Parts as they leave a CAD program: few vertices, long triangles, fans.


@_shape("CAD", _128=64, _512=256)
def _capped_cylinder(around: int) -> Mesh:
    """Two rings, each capped by a fan around one of its own vertices."""
    side = cylinder(around, 1, 4.0)
    inner = np.arange(1, around - 1)
    bottom = np.stack([np.zeros_like(inner), inner + 1, inner], axis=1)
    return Mesh(side.V, np.concatenate([side.F, bottom, around + bottom[:, ::-1]]))


@_shape("CAD", held_out=True)
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
    return _merged(V.reshape(-1, 3), lattice_faces(26, 48, wrap_columns=True))


def _plate_with_holes(holes: FloatArray, around: int, seed: int) -> Mesh:
    """The rectangle 10 by 6 with round holes (k, 3): centres and radii; vertices on the rims and few elsewhere."""
    angle = 2 * np.pi * (np.arange(around) + 0.5) / around
    rims = [np.stack([x + r * np.cos(angle), y + r * np.sin(angle)], axis=1) for x, y, r in holes]
    corners = np.array([[0, 0], [10, 0], [10, 6], [0, 6], [5, 0], [5, 6.0]])
    inside = _seeded(seed).uniform([0.3, 0.3], [9.7, 5.7], (30, 2))
    inside = inside[(np.linalg.norm(inside[:, None] - holes[:, :2], axis=2) > holes[:, 2] + 0.2).all(axis=1)]
    points = np.concatenate([*rims, corners, inside])
    F = _delaunay(points)
    middle = points[F].mean(axis=1)
    F = F[(np.linalg.norm(middle[:, None] - holes[:, :2], axis=2) > holes[:, 2] * np.cos(np.pi / around)).all(axis=1)]
    return _compact(_raised(points), F)


@_shape("CAD")
def _plate() -> Mesh:
    holes = np.array([[2, 1.6, 0.8], [2, 4.4, 0.8], [5, 3, 1.2], [8, 1.6, 0.8], [8, 4.4, 0.8]])
    return _plate_with_holes(holes, 96, 1)


@_shape("CAD", held_out=True)
def _slotted_plate() -> Mesh:
    x, y = np.meshgrid(np.linspace(1, 9, 7), np.linspace(1, 5, 4))
    return _plate_with_holes(np.column_stack([x.ravel(), y.ravel(), np.full(28, 0.42)]), 24, 2)


@_shape("CAD")
def _needle_fan() -> Mesh:
    """A disk of 300 needles around its centre."""
    angle = 2 * np.pi * np.arange(300) / 300
    V = np.concatenate([[[0, 0, 0]], np.column_stack([np.cos(angle), np.sin(angle), np.zeros(300)])])
    k = np.arange(300)
    return Mesh(V, np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % 300], axis=1))


@_shape("CAD", held_out=True)
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
    F = _delaunay(rim)
    middle = rim[F].mean(axis=1)
    r, at = np.linalg.norm(middle, axis=1), np.arctan2(middle[:, 1], middle[:, 0]) % (2 * np.pi)
    F = F[(r > 0.998) & (r < np.interp(at, np.append(angle, 2 * np.pi), np.append(radius, radius[0])))]
    n = len(rim)
    # Walls along the edges that only one triangle has.
    sides = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    _, which, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    a, b = sides[count[which.reshape(-1)] == 1].T
    walls = np.concatenate([np.stack([a, b + n, b], axis=1), np.stack([a, a + n, b + n], axis=1)])
    V = np.concatenate([_raised(rim, 1.0), _raised(rim, 0.0)])
    return _compact(V, np.concatenate([F, F[:, ::-1] + n, walls]))


@_shape("CAD")
def _stairs() -> Mesh:
    """Twelve steps of two rectangles each, every rectangle two triangles."""
    x = np.repeat(np.arange(13), 2)[1:]
    z = np.repeat(np.arange(13), 2)[:-1]
    V = np.stack([np.tile(x, 2), np.repeat([0.0, 5.0], 25), np.tile(z, 2) * 0.5], axis=1)
    return Mesh(V, lattice_faces(2, 25))


@_shape("CAD", cube=(1.0, 1.0), long=(1.0, 30.0))
def _box(width: float, length: float) -> Mesh:
    """Eight vertices and twelve triangles."""
    return _boxes(np.array([[0, 0, 0]]), np.array([width, width, length]))


@_shape("CAD", held_out=True)
def _wide_funnel() -> Mesh:
    """A cone whose rings come closer and closer to the tip, with 24 vertices each."""
    radius, angle = 0.6 ** np.arange(20), 2 * np.pi * np.arange(24) / 24
    V = np.stack(
        [radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle), np.repeat(2 * radius[:, None], 24, axis=1)],
        axis=-1,
    )
    return Mesh(V.reshape(-1, 3), lattice_faces(20, 24, wrap_columns=True))


# Scattered points.


@_shape("scattered", _1000=(1000, 3), _100=(100, 4))
def _scattered_square(n: int, seed: int) -> Mesh:
    points = _seeded(seed).random((n, 2))
    return Mesh(_raised(points), _delaunay(points))


@_shape("scattered", held_out=True)
def _scattered_disk() -> Mesh:
    r, angle = _seeded(5).random((2, 1500))
    points = np.sqrt(r)[:, None] * np.stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)], axis=1)
    return Mesh(_raised(points), _delaunay(points))


@_shape("scattered")
def _clusters() -> Mesh:
    """Points in a square, most of them in five small clusters: edges differ by a factor of a thousand."""
    rng = _seeded(6)
    centres = rng.random((5, 2))
    points = np.concatenate(
        [rng.random((300, 2)), *(centre + 0.003 * rng.standard_normal((200, 2)) for centre in centres)]
    )
    return Mesh(_raised(points), _delaunay(points))


@_shape("scattered")
def _slivers_at_the_rim() -> Mesh:
    """A square whose boundary vertices stand on a cubic scale, with few points inside."""
    s = np.linspace(-1, 1, 41) ** 3
    rim = np.concatenate([np.column_stack([s, np.full(41, side)]) for side in (-1.0, 1.0)])
    rim = np.concatenate([rim, rim[:, ::-1]])
    points = np.unique(np.concatenate([rim, _seeded(7).uniform(-0.9, 0.9, (120, 2))]), axis=0)
    return Mesh(_raised(points), _delaunay(points))


@_shape("scattered", by_3=3.0, by_10=10.0)
def _sheared_grid(shear: float) -> Mesh:
    mesh = grid(30)
    return Mesh(mesh.V @ np.array([[1, 0, 0], [shear, 1, 0], [0, 0, 1.0]]), mesh.F)


@_shape("scattered", held_out=True)
def _stretched_grid() -> Mesh:
    """Cells of 1 : 40."""
    mesh = grid(30)
    return Mesh(mesh.V * [40, 1, 1], mesh.F)


@_shape("scattered", held_out=True)
def _graded_square() -> Mesh:
    """Edges from 1 to 1 / 1000 towards a corner."""
    x, y = np.meshgrid(np.linspace(0, 1, 41) ** 3, np.linspace(0, 1, 41) ** 3)
    return Mesh(_raised(np.stack([x.ravel(), y.ravel()], axis=1)), lattice_faces(41, 41))


# Height fields and terrain.


@_shape("terrain", _5000=(5000, 0.3, 8), coarse=(47, 0.5, 9))
def _height_field(n: int, height: float, seed: int) -> Mesh:
    points = _seeded(seed).random((n, 2))
    z = height * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1])
    return Mesh(_raised(points, z), _delaunay(points))


@_shape("terrain", _10_times=10.0, _100_times=100.0)
def _noise(factor: float) -> Mesh:
    """A grid with independent heights of a multiple of the spacing."""
    mesh = grid(30)
    return Mesh(_raised(mesh.V[:, :2], factor / 30 * _seeded(10).random(mesh.n_vertices)), mesh.F)


@_shape("terrain", held_out=True)
def _fractal_terrain() -> Mesh:
    """Midpoint displacement on 65 by 65 vertices, each level with 0.6 of the height of the one before."""
    rng, z, amplitude = _seeded(11), np.zeros((2, 2)), 0.5
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
    return Mesh(_raised(mesh.V[:, :2], z.ravel()), mesh.F)


@_shape("terrain", held_out=True)
def _ridges() -> Mesh:
    """A folded sheet: 20 steep folds of a few triangles each."""
    x = np.repeat(np.linspace(0, 1, 41)[:, None], 11, axis=1)
    y = np.repeat(np.linspace(0, 1, 11)[None], 41, axis=0)
    z = np.where(np.arange(41)[:, None] % 2 == 0, 0.0, 0.2) * np.ones((1, 11))
    return Mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), lattice_faces(41, 11))


@_shape("terrain")
def _cliff() -> Mesh:
    mesh = grid(40)
    return Mesh(_raised(mesh.V[:, :2], 2.0 * (mesh.V[:, 0] > 0.5)), mesh.F)


# Convex hulls.


def _hull(points: FloatArray) -> Mesh:
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    F = np.asarray(hull.simplices, np.int64)
    normal = np.cross(points[F[:, 1]] - points[F[:, 0]], points[F[:, 2]] - points[F[:, 0]])
    inward = np.einsum("kx,kx->k", normal, hull.equations[:, :3]) < 0
    F[inward] = F[inward][:, ::-1]
    return _compact(points, F)


@_shape("hull", _12=(12, 12), _35=(35, 13), _100=(100, 14), _400=(400, 15))
def _hull_of(n: int, seed: int) -> Mesh:
    points = _seeded(seed).standard_normal((n, 3))
    return _hull(points / np.linalg.norm(points, axis=1, keepdims=True))


@_shape("hull", held_out=True)
def _flat_hull() -> Mesh:
    points = _seeded(16).standard_normal((150, 3))
    return _hull(points / np.linalg.norm(points, axis=1, keepdims=True) * [1, 1, 0.03])


@_shape("hull", held_out=True)
def _hull_of_a_cloud() -> Mesh:
    return _hull(_seeded(17).standard_normal((300, 3)))


# Voxels and fractals.


def _boxes(cells: IntArray, size: FloatArray | float = 1.0) -> Mesh:
    """The surface of a union of unit cells (k, 3), scaled by `size`: squares between a cell and what is none."""
    occupied = {tuple(cell) for cell in cells.tolist()}
    corners: list[list[int]] = []
    for cell in sorted(occupied):
        for axis in range(3):
            for side in (0, 1):
                beyond = list(cell)
                beyond[axis] += 2 * side - 1
                if tuple(beyond) in occupied:
                    continue
                u, v = (axis + 1) % 3, (axis + 2) % 3
                square = []
                for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
                    corner = list(cell)
                    corner[axis] += side
                    corner[u] += du
                    corner[v] += dv
                    square.append(corner)
                corners.extend(square if side else square[::-1])
    unique, which = np.unique(np.array(corners), axis=0, return_inverse=True)
    a, b, c, d = which.reshape(-1, 4).T
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Mesh(unique * np.asarray(size, float), F)


def _cells(where: AnyArray) -> IntArray:
    return np.argwhere(where)


@_shape("voxels")
def _cube_less_one() -> Mesh:
    where = np.ones((2, 2, 2), bool)
    where[1, 1, 1] = False
    return _boxes(_cells(where))


@_shape("voxels")
def _beams() -> Mesh:
    """A lattice of square beams between 4 by 4 by 4 nodes, of genus 81."""
    i = np.indices((7, 7, 7))
    return _boxes(_cells((i % 2 == 0).sum(axis=0) >= 2))


@_shape("voxels", held_out=True)
def _sponge() -> Mesh:
    """Menger's sponge of level 2."""
    i = np.indices((9, 9, 9))
    level = [((i // step % 3) == 1).sum(axis=0) < 2 for step in (1, 3)]
    return _boxes(_cells(level[0] & level[1]))


@_shape("voxels")
def _voxel_ball() -> Mesh:
    i = np.indices((15, 15, 15)) - 7
    return _boxes(_cells((i**2).sum(axis=0) <= 42))


@_shape("voxels", held_out=True)
def _voxel_blob() -> Mesh:
    """Cells below a random threshold, connected or not, touching along edges and in corners."""
    from scipy.ndimage import gaussian_filter

    field = gaussian_filter(_seeded(18).standard_normal((12, 12, 12)), 1.2)
    return _boxes(_cells(field > np.quantile(field, 0.6)))


# Mazes and walls.


@_shape("maze")
def _maze() -> Mesh:
    """A square with walls one cell wide from alternate sides."""
    mesh, n = grid(45), 45
    cell = mesh.V[mesh.F].mean(axis=1)[:, :2] * n
    column, row = np.floor(cell[:, 0]).astype(int), np.floor(cell[:, 1]).astype(int)
    is_wall = (column % 5 == 4) & np.where(column // 5 % 2 == 0, row < n - 4, row >= 4)
    return _compact(mesh.V, mesh.F[~is_wall])


@_shape("maze", held_out=True)
def _spiral() -> Mesh:
    """A corridor that winds in, four turns."""
    turn = np.linspace(0, 8 * np.pi, 400)
    radius = 1 + turn / 3
    points = np.concatenate(
        [r[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1) for r in (radius, radius + 0.6, radius + 1.2)]
    )
    return Mesh(_raised(points), lattice_faces(3, 400))


@_shape("maze", held_out=True)
def _labyrinth() -> Mesh:
    """A random spanning tree of rooms, carved out of a grid of cells."""
    rng, n = _seeded(19), 12
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
    return _compact(_raised(np.stack([x.ravel(), y.ravel()], axis=1)), lattice_faces(side + 1, side + 1)[open_cells])


# Surfaces without an orientation, or with edges of many faces.


@_shape("topology")
def _moebius_band() -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 121), np.linspace(-0.4, 0.4, 9), indexing="ij")
    r = 1 + v * np.cos(u / 2)
    V = np.stack([r * np.cos(u), r * np.sin(u), v * np.sin(u / 2)], axis=-1)
    return _merged(V.reshape(-1, 3), lattice_faces(121, 9))


@_shape("topology", held_out=True)
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


@_shape("topology")
def _book() -> Mesh:
    return book(5, 12)


@_shape("topology")
def _pinched() -> Mesh:
    """Two cones that meet in their tips."""
    one = cone(24, 8)
    return _merged(*(lambda m: (m.V, m.F))(_joined(one, Mesh(one.V * [1, 1, -1], one.F[:, ::-1]))))


# Rough and thin surfaces.


@_shape("rough")
def _spiky_sphere() -> Mesh:
    mesh = icosphere(3)
    out = np.where(_seeded(20).random(mesh.n_vertices) < 0.05, 3.0, 1.0)
    return Mesh(mesh.V * out[:, None], mesh.F)


@_shape("rough")
def _noisy_sphere() -> Mesh:
    mesh = icosphere(4)
    return Mesh(mesh.V + 0.05 * _seeded(21).standard_normal(mesh.V.shape), mesh.F)


@_shape("rough", held_out=True)
def _crumpled() -> Mesh:
    mesh = disk(18)
    return Mesh(mesh.V + 0.04 * _seeded(22).standard_normal(mesh.V.shape), mesh.F)


@_shape("rough", _40_by_400=(40, 400), _12_by_60=(12, 60))
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


@_shape("rough")
def _sphere_with_slivers() -> Mesh:
    """A tenth of the faces split close to the middle of a side."""
    mesh = icosphere(3)
    rng = _seeded(23)
    chosen = rng.choice(mesh.n_faces, mesh.n_faces // 10, replace=False)
    weights = np.array([0.499, 0.499, 0.002])
    new = (mesh.V[mesh.F[chosen]] * weights[:, None]).sum(axis=1)
    a, b, c = mesh.F[chosen].T
    p = mesh.n_vertices + np.arange(len(chosen))
    split = [np.stack([a, b, p], axis=1), np.stack([b, c, p], axis=1), np.stack([c, a, p], axis=1)]
    return Mesh(np.concatenate([mesh.V, new]), np.concatenate([np.delete(mesh.F, chosen, axis=0), *split]))


@_shape("rough", held_out=True)
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
    return _merged(V.reshape(-1, 3), lattice_faces(len(t), 40, wrap_columns=True))


# Several components.


@_shape("components", _1_to_1=1.0, _1_to_10=10.0, _1_to_100=100.0)
def _two_spheres(ratio: float) -> Mesh:
    one = icosphere(3)
    return _joined(one, Mesh(one.V * ratio + [2 * ratio + 2, 0, 0], one.F))


@_shape("components", held_out=True)
def _part_and_plate() -> Mesh:
    """A small torus beside a square of two triangles, a thousand times larger."""
    return _joined(
        torus(16, 32), Mesh(np.array([[0, 0, -1], [1e3, 0, -1], [1e3, 1e3, -1], [0, 1e3, -1]]), [[0, 1, 2], [0, 2, 3]])
    )


# The smallest meshes.


@_shape("small")
def _triangle() -> Mesh:
    return Mesh([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]])


@_shape("small", held_out=True)
def _needle() -> Mesh:
    return Mesh(np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-4, 0], [0.5, -1e-4, 0]]), [[0, 1, 2], [1, 0, 3]])


@_shape("small")
def _tetrahedron() -> Mesh:
    return Mesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


@_shape("small", held_out=True)
def _octahedron() -> Mesh:
    V = np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 3]
    return _hull(V)
