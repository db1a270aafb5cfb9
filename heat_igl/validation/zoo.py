"""Generated test shapes: smooth, CAD, scattered points, terrain, hulls, voxels, mazes, slivers, several components.

Defaults are chosen on some of `SHAPES` and measured on all. A third of them are held out: nothing in the package may be
tuned on them (`Shape.held_out`). `heat_igl.validation.random_shapes` has families of random shapes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import igl
import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray
from heat_igl.validation import construction as build
from heat_igl.validation import shapes
from heat_igl.validation.random_shapes import FAMILIES

__all__ = ["FAMILIES", "SHAPES", "Shape"]


@dataclass(frozen=True)
class Shape:
    """A test shape: `make` returns the `Mesh`, the same bits at every call.

    No default may be tuned on shapes that are `held_out`.
    """

    name: str
    family: str
    make: Callable[[], Mesh]
    held_out: bool


def seeded(seed: int) -> np.random.Generator:
    """A random generator with a fixed seed."""
    return np.random.default_rng([20240815, seed])


def _stretched(mesh: Mesh, factors: ArrayLike) -> Mesh:
    """The mesh with its vertices multiplied by factors (3,), (n, 1) or (n, 3), or by a matrix (3, 3) from the right."""
    by = np.asarray(factors)
    return Mesh(mesh.V @ by if by.shape == (3, 3) else mesh.V * by, mesh.F)


def _noisy(mesh: Mesh, amount: float, seed: int) -> Mesh:
    return Mesh(mesh.V + amount * seeded(seed).standard_normal(mesh.V.shape), mesh.F)


def _heights(mesh: Mesh, height: AnyArray) -> Mesh:
    return Mesh(build.raised(mesh.V[:, :2], height), mesh.F)


def _scattered(n: int, seed: int) -> Mesh:
    return build.planar(seeded(seed).random((n, 2)))


def _on_sphere(n: int, seed: int) -> FloatArray:
    return build.on_sphere(n, seeded(seed))


def _bumps(V: FloatArray) -> FloatArray:
    return 1 + 0.15 * np.sin(6 * V[:, :1]) * np.cos(7 * V[:, 1:2]) * np.cos(5 * V[:, 2:])


def _capped(around: int) -> Mesh:
    """Two rings, each capped by a fan around one of its own vertices."""
    side = shapes.cylinder(around, 1, 4.0)
    return Mesh(side.V, np.concatenate([side.F, build.caps(2, around)]))


def _spheres(ratio: float) -> Mesh:
    one = shapes.icosphere(3)
    return build.joined(one, Mesh(one.V * ratio + [2 * ratio + 2, 0, 0], one.F))


def _shear(by: float) -> FloatArray:
    return np.array([[1, 0, 0], [by, 1, 0], [0, 0, 1.0]])


def _cells(n: int, where: Callable[[IntArray], Any]) -> Mesh:
    """Of n^3 cells those that a function of their indices (3, n, n, n) chooses."""
    return build.boxes(np.argwhere(where(np.indices((n, n, n)))))


def _latitudes() -> Mesh:
    """A sphere by meridians and parallels, with fans of thin triangles at the poles."""
    theta = np.linspace(0, np.pi, 31)
    return build.merged(build.revolved(np.sin(theta), np.cos(theta), 60))


def _moebius_band() -> Mesh:
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 121), np.linspace(-0.4, 0.4, 9), indexing="ij")
    r = 1 + v * np.cos(u / 2)
    return build.merged(shapes.lattice_mesh(r * np.cos(u), r * np.sin(u), v * np.sin(u / 2)))


def _klein_bottle() -> Mesh:
    """The figure of eight turned by half a turn on its way around; it crosses itself without sharing vertices."""
    u, v = np.meshgrid(np.arange(80) * 2 * np.pi / 80, np.arange(40) * 2 * np.pi / 40, indexing="ij")
    r = 2 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    tube = shapes.lattice_mesh(r * np.cos(u), r * np.sin(u), z, wrap_columns=True)
    # The last row is glued to the first with v turned into -v.
    j = np.arange(40)
    last, following = 79 * 40 + j, 79 * 40 + (j + 1) % 40
    first, after = (-j) % 40, (-j - 1) % 40
    seam = np.concatenate([np.stack([last, following, first], axis=1), np.stack([following, after, first], axis=1)])
    return Mesh(tube.V, np.concatenate([tube.F, seam]))


def _pinched() -> Mesh:
    """Two cones that meet in their tips."""
    one = shapes.cone(24, 8)
    return build.merged(build.joined(one, Mesh(one.V * [1, 1, -1], one.F[:, ::-1])))


def _pill() -> Mesh:
    """Long triangles along the side of a cylinder between two finely meshed caps of a sphere."""
    theta = np.concatenate([np.linspace(0, np.pi / 2, 13), np.linspace(np.pi / 2, np.pi, 13)])
    shift = np.where(np.arange(26) < 13, 6.0, 0.0)
    return build.merged(build.revolved(np.sin(theta), np.cos(theta) + shift, 48))


def _plate_with_holes(holes: FloatArray, around: int, seed: int) -> Mesh:
    """The rectangle 10 by 6 with round holes (k, 3): centres and radii; vertices on the rims and few elsewhere."""
    corners = np.array([[0, 0], [10, 0], [10, 6], [0, 6], [5, 0], [5, 6.0]])
    inside = seeded(seed).uniform([0.3, 0.3], [9.7, 5.7], (30, 2))
    points, F = build.holed_plate(holes[:, :2], holes[:, 2], build.ring(around, 0.5), corners, inside, 0.2)
    return build.compact(build.raised(points), F)


def _slotted_plate() -> Mesh:
    x, y = np.meshgrid(np.linspace(1, 9, 7), np.linspace(1, 5, 4))
    return _plate_with_holes(np.column_stack([x.ravel(), y.ravel(), np.full(28, 0.42)]), 24, 2)


def _needle_fan() -> Mesh:
    """A disk of 300 needles around its centre."""
    V = np.concatenate([np.zeros((1, 3)), build.raised(build.ring(300))])
    k = np.arange(300)
    return Mesh(V, np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % 300], axis=1))


def _gear() -> Mesh:
    """A toothed wheel of 24 teeth with a bore, extruded; its faces are Delaunay triangles between bore and teeth."""
    teeth, bore = np.where((np.arange(96) // 2) % 2 == 0, 3.0, 2.6)[:, None] * build.ring(96), build.ring(48)
    rim = np.concatenate([teeth, bore])
    F = build.delaunay(rim)
    middle = rim[F].mean(axis=1)
    return build.extruded(rim, F[build.inside(teeth, middle) & ~build.inside(bore, middle)], 1.0)


def _stairs() -> Mesh:
    """Twelve steps of two rectangles each, every rectangle two triangles."""
    steps = np.repeat(np.arange(13), 2)
    return shapes.lattice_mesh(steps[1:], np.array([[0.0], [5.0]]), steps[:-1] * 0.5)


def _scattered_disk() -> Mesh:
    r, angle = seeded(5).random((2, 1500))
    return build.planar(np.sqrt(r)[:, None] * np.stack([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)], axis=1))


def _clusters() -> Mesh:
    """Points in a square, most of them in five small clusters: edges differ by a factor of a thousand."""
    rng = seeded(6)
    centres = rng.random((5, 2))
    points = np.concatenate(
        [rng.random((300, 2)), *(centre + 0.003 * rng.standard_normal((200, 2)) for centre in centres)]
    )
    return build.planar(points)


def _slivers_at_the_rim() -> Mesh:
    """A square whose boundary vertices stand on a cubic scale, with few points inside."""
    s = np.linspace(-1, 1, 41) ** 3
    rim = np.concatenate([np.column_stack([s, np.full(41, side)]) for side in (-1.0, 1.0)])
    rim = np.concatenate([rim, rim[:, ::-1]])
    return build.planar(np.unique(np.concatenate([rim, seeded(7).uniform(-0.9, 0.9, (120, 2))]), axis=0))


def _height_field(n: int, height: float, seed: int) -> Mesh:
    points = seeded(seed).random((n, 2))
    return build.planar(points, height * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1]))


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
    return _heights(shapes.grid(64), z.ravel())


def _voxel_blob() -> Mesh:
    """Cells below a random threshold, connected or not, touching along edges and in corners."""
    from scipy.ndimage import gaussian_filter

    field = gaussian_filter(seeded(18).standard_normal((12, 12, 12)), 1.2)
    return build.boxes(np.argwhere(field > np.quantile(field, 0.6)))


def _maze() -> Mesh:
    """A square with walls one cell wide from alternate sides."""
    column, row = np.indices((45, 45))
    return build.opened((column % 5 != 4) | np.where(column // 5 % 2 == 0, row >= 41, row < 4))


def _spiral() -> Mesh:
    """A corridor that winds in, four turns."""
    turn = np.linspace(0, 8 * np.pi, 400)
    radius = 1 + turn / 3 + np.array([[0.0], [0.6], [1.2]])
    return shapes.lattice_mesh(radius * np.cos(turn), radius * np.sin(turn))


def _labyrinth() -> Mesh:
    """A random spanning tree of rooms, carved out of a grid of cells."""
    rng, n = seeded(19), 12
    fine = np.kron(np.pad(build.corridors(rng, n), 1), np.ones((2, 2), bool))
    side = len(fine)
    mesh = shapes.strip(side, side)
    return build.compact(mesh.V, mesh.F[np.concatenate([fine.ravel(), fine.ravel()])])


def _lantern(around: int, along: int) -> Mesh:
    """Schwarz's lantern: rings of a cylinder, each turned by half a step against the one before."""
    return build.revolved(np.ones(along + 1), 3 * np.arange(along + 1) / along, around, np.pi / around)


def _sphere_with_slivers() -> Mesh:
    """A tenth of the faces split close to the middle of a side."""
    mesh = shapes.icosphere(3)
    rng = seeded(23)
    chosen = rng.choice(mesh.n_faces, mesh.n_faces // 10, replace=False)
    weights = np.array([0.499, 0.499, 0.002])
    new = (mesh.V[mesh.F[chosen]] * weights[:, None]).sum(axis=1)
    a, b, c = mesh.F[chosen].T
    p = mesh.n_vertices + np.arange(len(chosen))
    split = [np.stack([a, b, p], axis=1), np.stack([b, c, p], axis=1), np.stack([c, a, p], axis=1)]
    return Mesh(np.concatenate([mesh.V, new]), np.concatenate([np.delete(mesh.F, chosen, axis=0), *split]))


def _dense_pole() -> Mesh:
    """A sphere whose triangles shrink to a thousandth towards a pole."""
    t = np.concatenate([np.linspace(0, 1, 60) ** 4 * np.pi / 2, np.linspace(np.pi / 2, np.pi, 20)[1:-1]])
    return build.merged(build.revolved(np.sin(t), np.cos(t), 40))


def _dust() -> Mesh:
    """Twenty hulls of 60 points beside one another, from 1 to a thousandth in size."""
    parts, at = [], 0.0
    for k, size in enumerate(np.logspace(0, -3, 20)):
        part = build.hull(_on_sphere(60, 40 + k))
        parts.append(Mesh(size * part.V + [at, 0, 0], part.F))
        at += 3 * size
    return build.joined(*parts)


# Made after every default had been chosen, all held out.


def _gyroid() -> Mesh:
    """A piece of the gyroid by marching cubes, with their slivers and a boundary of many loops."""
    n = 22
    z, y, x = np.meshgrid(*(np.linspace(0, 2 * np.pi, n),) * 3, indexing="ij")
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    V, F, _ = igl.marching_cubes(field.ravel(), points, n, n, n, 0.1)
    return build.merged(Mesh(V, F))


def _trefoil() -> Mesh:
    """A tube around a knot, with rings closer together than the vertices on them."""
    t = 2 * np.pi * np.arange(300) / 300
    centre = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    along = np.roll(centre, -1, axis=0) - np.roll(centre, 1, axis=0)
    ring = np.arange(301) % 300
    return build.merged(build.tube(centre[ring], along[ring], 0.35, 8, up=(0.3, 0.2, 1.0)))


def _elbow() -> Mesh:
    """A pipe: two straight pieces of one ring each, and a bend of 24 rings between them."""
    bend = np.pi / 2 * np.linspace(0, 1, 24)
    x = np.concatenate([[-8.0], 2 * np.sin(bend), [2.0]])
    y = np.concatenate([[0.0], 2 - 2 * np.cos(bend), [12.0]])
    slope = np.concatenate([[0.0], bend, [np.pi / 2]])
    centre, along = np.stack([x, y], axis=1), np.stack([np.cos(slope), np.sin(slope)], axis=1)
    return build.tube(build.raised(centre), build.raised(along), 1.0, 32, up=(0, 0, -1))


def _drum() -> Mesh:
    """The hull of two circles in tilted planes: long triangles between two polygons that are fans."""
    flat = build.raised(build.ring(120))
    tilt = np.array([[np.cos(0.7), 0, np.sin(0.7)], [0, 1, 0], [-np.sin(0.7), 0, np.cos(0.7)]])
    return build.hull(np.concatenate([flat * 1.5, 0.6 * flat @ tilt + [0.4, 0.1, 3.0]]))


def _sunflower() -> Mesh:
    """Seeds at the golden angle, denser towards the centre by the cube of the radius."""
    k = np.arange(1200) + 0.5
    radius, angle = (k / 1200) ** 1.5, k * np.pi * (3 - np.sqrt(5))
    return build.planar(radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _dunes() -> Mesh:
    """Waves on cells of 1 : 6 whose corners are moved."""
    mesh, rng = shapes.grid(36), seeded(31)
    x, y = mesh.V[:, 0] + 0.2 / 36 * rng.uniform(-1, 1, mesh.n_vertices), 6 * mesh.V[:, 1]
    return Mesh(np.stack([x, y, 0.08 * np.sin(25 * x + np.sin(2 * y))], axis=1), mesh.F)


def _fern() -> Mesh:
    """A stem of cells with leaves on both sides, which are two cells wide and one cell apart."""
    column, row = np.indices((36, 36))
    is_leaf = (row % 3 < 2) & (np.abs(column - 18) < 17 - row // 3)
    return build.opened(is_leaf | (np.abs(column - 17.5) < 1))


def _crossed_sheets() -> Mesh:
    """Two rectangles through one another along a common edge path, each with its own spacing."""
    s, t = np.linspace(0, 1, 25)[:, None], np.linspace(-1, 1, 21) ** 3
    return build.merged(build.joined(shapes.lattice_mesh(s, t), shapes.lattice_mesh(s, 0.3 * t, t)))


# Family -> name -> mesh; a star marks those held out.
_FAMILIES: dict[str, dict[str, Callable[[], Mesh]]] = {
    "smooth": {
        "sphere": lambda: shapes.icosphere(4),
        "ellipsoid": lambda: _stretched(shapes.icosphere(4), [1, 1, 8]),
        "torus": lambda: shapes.torus(30, 60),
        "thin torus *": lambda: shapes.torus(12, 240, 0.05),
        "bumpy sphere": lambda: _stretched(shapes.icosphere(4), _bumps(shapes.icosphere(4).V)),
        "monkey saddle *": lambda: _heights(
            shapes.disk(20), shapes.disk(20).V[:, 0] ** 3 - 3 * shapes.disk(20).V[:, 0] * shapes.disk(20).V[:, 1] ** 2
        ),
        "cone": lambda: shapes.cone(40, 30),
        "regular grid": lambda: shapes.grid(40),
        "long strip": lambda: shapes.strip(1500, 3),
        "latitudes *": _latitudes,
        "gyroid *": _gyroid,
        "trefoil *": _trefoil,
    },
    # Surfaces without an orientation, or with edges of many faces.
    "topology": {
        "book": lambda: shapes.book(5, 12),
        "moebius band": _moebius_band,
        "klein bottle *": _klein_bottle,
        "pinched": _pinched,
        "crossed sheets *": _crossed_sheets,
    },
    # Parts as they leave a CAD program: few vertices, long triangles, fans.
    "CAD": {
        "capped cylinder 128": lambda: _capped(64),
        "capped cylinder 512": lambda: _capped(256),
        "box cube": lambda: build.boxes(np.zeros((1, 3), int)),
        "box long": lambda: build.boxes(np.zeros((1, 3), int), np.array([1.0, 1.0, 30.0])),
        "pill *": _pill,
        "plate": lambda: _plate_with_holes(
            np.array([[2, 1.6, 0.8], [2, 4.4, 0.8], [5, 3, 1.2], [8, 1.6, 0.8], [8, 4.4, 0.8]]), 96, 1
        ),
        "slotted plate *": _slotted_plate,
        "needle fan": _needle_fan,
        "gear *": _gear,
        "stairs": _stairs,
        # A cone whose rings come closer and closer to the tip, with 24 vertices each.
        "wide funnel *": lambda: build.revolved(0.6 ** np.arange(20.0), 2 * 0.6 ** np.arange(20.0), 24),
        "elbow *": _elbow,
        "drum *": _drum,
    },
    "scattered": {
        "scattered square 1000": lambda: _scattered(1000, 3),
        "scattered square 100": lambda: _scattered(100, 4),
        "sheared grid by 3": lambda: _stretched(shapes.grid(30), _shear(3.0)),
        "sheared grid by 10": lambda: _stretched(shapes.grid(30), _shear(10.0)),
        "stretched grid *": lambda: _stretched(shapes.grid(30), [40, 1, 1]),
        "scattered disk *": _scattered_disk,
        "clusters": _clusters,
        "slivers at the rim": _slivers_at_the_rim,
        # Edges from 1 to 1 / 1000 towards a corner.
        "graded square *": lambda: shapes.lattice_mesh(np.linspace(0, 1, 41) ** 3, np.linspace(0, 1, 41)[:, None] ** 3),
        "sunflower *": _sunflower,
    },
    "terrain": {
        "noise 10 times": lambda: _heights(shapes.grid(30), 10 / 30 * seeded(10).random(31**2)),
        "noise 100 times": lambda: _heights(shapes.grid(30), 100 / 30 * seeded(10).random(31**2)),
        "height field 5000": lambda: _height_field(5000, 0.3, 8),
        "height field coarse": lambda: _height_field(47, 0.5, 9),
        "cliff": lambda: _heights(shapes.grid(40), 2.0 * (shapes.grid(40).V[:, 0] > 0.5)),
        "fractal terrain *": _fractal_terrain,
        # A folded sheet: 20 steep folds of a few triangles each.
        "ridges *": lambda: shapes.lattice_mesh(
            np.linspace(0, 1, 41)[:, None], np.linspace(0, 1, 11), 0.2 * (np.arange(41)[:, None] % 2)
        ),
        "dunes *": _dunes,
    },
    "hull": {
        "hull of 12": lambda: build.hull(_on_sphere(12, 12)),
        "hull of 35": lambda: build.hull(_on_sphere(35, 13)),
        "hull of 100": lambda: build.hull(_on_sphere(100, 14)),
        "hull of 400": lambda: build.hull(_on_sphere(400, 15)),
        "flat hull *": lambda: build.hull(_on_sphere(150, 16) * [1, 1, 0.03]),
        "hull of a cloud *": lambda: build.hull(seeded(17).standard_normal((300, 3))),
    },
    "voxels": {
        "cube less one": lambda: _cells(2, lambda i: (i < 1).any(axis=0)),
        # A lattice of square beams between 4 by 4 by 4 nodes, of genus 81.
        "beams": lambda: _cells(7, lambda i: (i % 2 == 0).sum(axis=0) >= 2),
        "voxel ball": lambda: _cells(15, lambda i: ((i - 7) ** 2).sum(axis=0) <= 42),
        # Menger's sponge of level 2.
        "sponge *": lambda: _cells(9, lambda i: np.all([(i // k % 3 == 1).sum(axis=0) < 2 for k in (1, 3)], axis=0)),
        "voxel blob *": _voxel_blob,
        # Cells that a random walk visits.
        "wandering cells *": lambda: build.boxes(build.walk(seeded(32), 150)),
    },
    "rough": {
        "spiky sphere": lambda: _stretched(
            shapes.icosphere(3), np.where(seeded(20).random(642) < 0.05, 3.0, 1.0)[:, None]
        ),
        "noisy sphere": lambda: _noisy(shapes.icosphere(4), 0.05, 21),
        "crumpled *": lambda: _noisy(shapes.disk(18), 0.04, 22),
        "lantern 40 by 400": lambda: _lantern(40, 400),
        "lantern 12 by 60": lambda: _lantern(12, 60),
        "sphere with slivers": _sphere_with_slivers,
        "dense pole *": _dense_pole,
        # Miura's fold: parallelograms of two triangles, mountains and valleys.
        "folded paper *": lambda: shapes.lattice_mesh(
            np.arange(25)[:, None] + 0.5 * (np.arange(25) % 2), 0.9 * np.arange(25), 0.7 * (np.arange(25)[:, None] % 2)
        ),
    },
    "components": {
        **{f"two spheres 1 to {ratio}": partial(_spheres, float(ratio)) for ratio in (1, 10, 100)},
        # A small torus beside a square of two triangles, a thousand times larger.
        "part and plate *": lambda: build.joined(
            shapes.torus(16, 32),
            Mesh(np.array([[0, 0, -1], [1e3, 0, -1], [1e3, 1e3, -1], [0, 1e3, -1]]), [[0, 1, 2], [0, 2, 3]]),
        ),
        "dust": _dust,
    },
    "small": {
        "triangle": lambda: Mesh([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]]),
        "needle *": lambda: Mesh(
            np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-4, 0], [0.5, -1e-4, 0]]), [[0, 1, 2], [1, 0, 3]]
        ),
        "tetrahedron": lambda: Mesh(
            [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
        ),
        "octahedron *": lambda: build.hull(np.concatenate([np.eye(3), -np.eye(3)]) * [1, 2, 3]),
    },
    "maze": {"maze": _maze, "spiral": _spiral, "labyrinth": _labyrinth, "fern *": _fern},
}

SHAPES = [
    Shape(name.removesuffix(" *"), family, make, name.endswith("*"))
    for family, members in _FAMILIES.items()
    for name, make in members.items()
]
"""All shapes, family after family."""
