"""Families of random shapes: a mesh of some hundred to 3000 vertices for each seed.

No default may be tuned on single members, and a change is measured over many seeds of every family.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from zlib import crc32

import igl
import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation import construction as build
from heat_igl.validation.construction import Generator
from heat_igl.validation.shapes import grid, icosphere, lattice_mesh


def _filled(outline: FloatArray, inner: FloatArray) -> tuple[FloatArray, IntArray]:
    """The corners (e, 2) of a polygon with the points that are inside, and the Delaunay triangles inside."""
    points = np.concatenate([outline, inner[build.inside(outline, inner)]])
    F = build.delaunay(points)
    return points, F[build.inside(outline, points[F].mean(axis=1))]


def _tetrahedra_surface(points: FloatArray, T: IntArray) -> Mesh:
    """The triangles that belong to one tetrahedron of T (k, 4) alone, turned outward."""
    # igl's order of the corners needs positively oriented tetrahedra.
    edges = points[T[:, 1:]] - points[T[:, :1]]
    T = np.where((np.linalg.det(edges) < 0)[:, None], T[:, [0, 2, 1, 3]], T)
    F = np.asarray(igl.boundary_facets(np.ascontiguousarray(T, np.int64))[0], np.int64)
    return build.compact(points, F)


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
    return build.holed_plate(np.array(holes)[:, :2], np.array(holes)[:, 2], build.ring(around), corners, inside, 0.05)


def _band(middle: FloatArray, across: FloatArray, rows: int) -> Mesh:
    """A band of `rows` rows of vertices about a curve (k, 3), reaching by `across` (k, 3) to either side."""
    V = middle[None] + np.linspace(-1, 1, rows)[:, None, None] * across[None]
    return lattice_mesh(*np.moveaxis(V, 2, 0))


def tetrahedra_surface(rng: Generator) -> Mesh:
    """The boundary of the Delaunay tetrahedra between random points: of a half of them that hang together."""
    points = rng.random((int(rng.integers(100, 700)), 3))
    T = build.delaunay(points)
    middle = points[T].mean(axis=1)
    return _tetrahedra_surface(points, T[np.linalg.norm(middle - 0.5, axis=1) < rng.uniform(0.3, 0.6)])


def alpha_shape(rng: Generator) -> Mesh:
    """The boundary of the Delaunay tetrahedra with small circumspheres between points on a bent body."""
    n = int(rng.integers(200, 700))
    points = rng.standard_normal((n, 3)) * [1, 1, 0.3]
    points[:, 2] += 0.5 * points[:, 0] ** 2
    T = build.delaunay(points)
    edges = points[T[:, 1:]] - points[T[:, :1]]
    centre = np.linalg.solve(edges, 0.5 * (edges**2).sum(axis=2)[:, :, None])[:, :, 0]
    radius = np.linalg.norm(centre, axis=1)
    return _tetrahedra_surface(points, T[radius < np.quantile(radius, rng.uniform(0.5, 0.9))])


def star_polygon(rng: Generator) -> Mesh:
    """A flat star with long thin points, its outline alone or with some vertices inside."""
    tips = int(rng.integers(5, 60))
    radius = np.where(np.arange(2 * tips) % 2 == 0, 1.0, rng.uniform(0.1, 0.6)) * rng.uniform(0.8, 1.2, 2 * tips)
    outline = radius[:, None] * build.ring(2 * tips)
    parts = int(rng.integers(1, 8))
    s = np.arange(parts)[None, :, None] / parts
    rim = (outline[:, None] * (1 - s) + np.roll(outline, -1, axis=0)[:, None] * s).reshape(-1, 2)
    points, F = _filled(rim, rng.uniform(-0.3, 0.3, (int(rng.integers(0, 200)), 2)))
    return build.compact(build.raised(points), F)


def helix(rng: Generator) -> Mesh:
    """A tube along a helix, with rings closer together than the vertices on them or farther apart."""
    turns, n = rng.uniform(2, 8), int(rng.integers(60, 400))
    t = np.linspace(0, 2 * np.pi * turns, n)
    centre = np.stack([np.cos(t), np.sin(t), rng.uniform(0.05, 0.4) * t], axis=1)
    return build.tube(centre, np.gradient(centre, axis=0), rng.uniform(0.05, 0.25), int(rng.integers(3, 10)))


def spiral_ramp(rng: Generator) -> Mesh:
    """A ramp around an axis, flat across: a strip that winds over itself."""
    n, t = int(rng.integers(60, 400)), np.linspace(0, 2 * np.pi * rng.uniform(1, 6), 1000)
    t = np.sort(rng.choice(t, n, replace=False))
    out = np.stack([np.cos(t), np.sin(t), np.zeros(n)], axis=1)
    middle = 2 * out + np.array([0, 0, rng.uniform(0.1, 0.6)]) * t[:, None]
    return _band(middle, rng.uniform(0.2, 1.5) * out, int(rng.integers(2, 10)))


def maze(rng: Generator) -> Mesh:
    """The corridors of a random tree on cells, each corridor one cell wide, walls one cell wide."""
    size, fine = int(rng.integers(4, 9)), int(rng.integers(1, 4))
    return build.opened(np.kron(build.corridors(rng, size), np.ones((fine, fine), bool)))


def cad_plate(rng: Generator) -> Mesh:
    """A flat plate with round holes, vertices on the rims and few elsewhere."""
    points, F = _holed_rectangle(rng, int(rng.integers(12, 96)), int(rng.integers(0, 60)))
    return build.compact(build.raised(points), F)


def thin_plate(rng: Generator) -> Mesh:
    """The same as a body: two sheets a small thickness apart, joined along the rims."""
    points, F = _holed_rectangle(rng, int(rng.integers(8, 40)), int(rng.integers(0, 60)))
    return build.extruded(points, F, 10 ** rng.uniform(-2.5, -0.3))


def cad_cylinder(rng: Generator) -> Mesh:
    """Few rings of many sides, capped by fans around one of their own vertices or left open."""
    around, rings = int(rng.integers(24, 600)), int(rng.integers(2, 5))
    height = np.sort(rng.random(rings)) * rng.uniform(0.2, 8)
    side = build.revolved(np.ones(rings), height, around)
    if rng.random() < 0.4:
        return build.merged(side)
    return Mesh(side.V, np.concatenate([side.F, build.caps(rings, around)]))


def shell(rng: Generator) -> Mesh:
    """A cap of a sphere with a thickness: an outer and an inner sheet joined along a rim."""
    n, thickness = int(rng.integers(150, 900)), 10 ** rng.uniform(-2, -0.5)
    k = np.arange(n) + 0.5
    points = np.sqrt(k / n)[:, None] * np.stack([np.cos(2.39996 * k), np.sin(2.39996 * k)], axis=1)
    points += rng.uniform(0, 0.3) / np.sqrt(n) * rng.standard_normal((n, 2))
    F, bend = build.delaunay(points), rng.uniform(0.3, 1.0)
    height = np.sqrt(np.maximum(1.5 - bend * (points**2).sum(axis=1), 0.01))
    outer = build.raised(points, height)
    return build.closed(outer, outer * (1 - thickness), F)


def carved_voxels(rng: Generator) -> Mesh:
    """A block of cells out of which random boxes were cut, without cells that touch in edges or corners alone."""
    where = np.ones(tuple(rng.integers(5, 12, 3)), bool)
    for _ in range(int(rng.integers(3, 25))):
        low, size = rng.integers(0, where.shape), rng.integers(1, 5, 3)
        cell = np.indices(where.shape).T - low
        where[((cell >= 0) & (cell < size)).all(axis=-1).T] = False
    return build.boxes(np.argwhere(where) if where.any() else np.zeros((1, 3), np.int64), rng.uniform(0.3, 1.0, 3))


def nested_circles(rng: Generator) -> Mesh:
    """The Delaunay triangles of circles inside one another, with as many vertices on each, and holes or none."""
    n, around = int(rng.integers(2, 9)), int(rng.integers(16, 160))
    radius = np.sort(rng.uniform(0.1, 1, n))
    return build.planar(np.concatenate([r * build.ring(around) + 0.05 * r * rng.uniform(-1, 1, 2) for r in radius]))


def spiky_sphere(rng: Generator) -> Mesh:
    """A sphere of which some vertices stand out far."""
    mesh = icosphere(int(rng.integers(2, 5)))
    is_spike = rng.random(mesh.n_vertices) < rng.uniform(0.01, 0.2)
    return Mesh(mesh.V * np.where(is_spike, rng.uniform(1.2, 4), 1.0)[:, None], mesh.F)


def ribbon(rng: Generator) -> Mesh:
    """A twisted band of two to four rows."""
    n = int(rng.integers(50, 700))
    t = np.linspace(0, rng.uniform(3, 30), n)
    a = rng.uniform(0.3, 1.5, 6)
    middle = np.stack([t, a[0] * np.sin(a[1] * t), a[2] * np.cos(a[3] * t)], axis=1)
    twist = a[4] * t
    across = a[5] * 0.3 * np.stack([np.zeros(n), np.cos(twist), np.sin(twist)], axis=1)
    return _band(middle, across, int(rng.integers(2, 5)))


def tube_of_few_sides(rng: Generator) -> Mesh:
    """A long tube of three to eight sides along a random smooth curve."""
    n = int(rng.integers(50, 400))
    t = np.linspace(0, rng.uniform(5, 40), n)
    a = rng.uniform(0.1, 0.8, 4)
    centre = np.stack([t, np.sin(a[0] * t) / a[0], a[1] * np.cos(a[2] * t)], axis=1)
    return build.tube(centre, np.gradient(centre, axis=0), 0.2 + 0.3 * a[3], int(rng.integers(3, 9)))


def vase(rng: Generator) -> Mesh:
    """A surface of revolution with a random profile of necks and bellies, on long or flat cells."""
    rings, around = int(rng.integers(8, 80)), int(rng.integers(6, 100))
    z = np.linspace(0, rng.uniform(1, 10), rings)
    profile = 1 + sum(rng.uniform(0, 0.4) * np.sin(rng.uniform(0.5, 6) * z + rng.uniform(0, 6)) for _ in range(3))
    radius = np.maximum(profile, 0.08)
    if rng.random() < 0.5:
        radius[0] = 0.0
    return build.merged(build.revolved(radius, z, around))


def terrain(rng: Generator) -> Mesh:
    """Heights with a spectrum of random steepness over a grid or scattered points."""
    n = int(rng.integers(12, 45))
    spectrum = 1 / (1 + np.hypot(*np.meshgrid(np.fft.fftfreq(n) * n, np.fft.fftfreq(n) * n))) ** rng.uniform(1, 2.5)
    height = np.real(np.fft.ifft2(spectrum * np.fft.fft2(rng.standard_normal((n, n)))))
    height *= 10 ** rng.uniform(-1.5, 0) / (height.std() + 1e-12)
    mesh = grid(n - 1)
    return Mesh(mesh.V + build.raised(np.zeros((n * n, 2)), height.ravel()), mesh.F)


def handles(rng: Generator) -> Mesh:
    """The boundary of a random walk through cells, thickened here and there: a surface with many handles."""
    nodes = 2 * build.walk(rng, int(rng.integers(10, 60)))
    return build.boxes(np.concatenate([nodes, (nodes[1:] + nodes[:-1]) // 2]))


def flat_hull(rng: Generator) -> Mesh:
    """The convex hull of points in a flat or long ellipsoid, in it or on it."""
    points = rng.standard_normal((int(rng.integers(20, 800)), 3))
    if rng.random() < 0.7:
        points /= np.linalg.norm(points, axis=1, keepdims=True)
    return build.hull(points * 10 ** rng.uniform(-1, 0, 3))


def clusters(rng: Generator) -> Mesh:
    """Points of a plane in clusters of very different size."""
    parts = [rng.random((int(rng.integers(20, 200)), 2))]
    for _ in range(int(rng.integers(1, 6))):
        parts.append(rng.random(2) + 10 ** rng.uniform(-4, -1) * rng.standard_normal((int(rng.integers(30, 200)), 2)))
    points = np.concatenate(parts)
    return build.compact(build.raised(points), build.delaunay(points))


def stretched_noise(rng: Generator) -> Mesh:
    """A noisy sphere, stretched along the axes."""
    mesh = icosphere(int(rng.integers(2, 5)))
    V = mesh.V + 10 ** rng.uniform(-2.5, -0.8) * rng.standard_normal(mesh.V.shape)
    return Mesh(V * 10 ** rng.uniform(-1, 0.3, 3), mesh.F)


def extrusion(rng: Generator) -> Mesh:
    """A random polygon with a height and nothing but its outline on the two lids, a gear for instance."""
    n = int(rng.integers(12, 200))
    radius = 1 + rng.uniform(0.05, 0.5) * np.sign(np.sin(rng.integers(2, 20) * 2 * np.pi * (np.arange(n) + 0.3) / n))
    return build.extruded(*_filled(radius[:, None] * build.ring(n), np.empty((0, 2))), rng.uniform(0.02, 3))


def comb(rng: Generator) -> Mesh:
    """A beam with teeth: long thin prisms side by side, each of a few triangles."""
    teeth = int(rng.integers(3, 30))
    cells = [(i, 0, 0) for i in range(2 * teeth - 1)]
    cells += [(2 * i, j, 0) for i in range(teeth) for j in range(1, 2 + int(rng.integers(0, 12)))]
    return build.boxes(np.array(cells), rng.uniform(0.1, 1.0, 3))


def folds(rng: Generator) -> Mesh:
    """Paper folded along random parallels, with a few vertices across."""
    n, rows = int(rng.integers(10, 150)), int(rng.integers(2, 30))
    x = np.cumsum(rng.uniform(0.2, 1, n))
    z = np.cumsum(rng.uniform(-1, 1, n))
    return _band(np.stack([x, np.zeros(n), z], axis=1), np.tile([0.0, rng.uniform(1, 20), 0.0], (n, 1)), rows)


def several_spheres(rng: Generator) -> Mesh:
    """Spheres of different size and fineness beside one another: several components."""
    parts = [icosphere(int(rng.integers(1, 4))) for _ in range(int(rng.integers(2, 5)))]
    return build.joined(*(Mesh(part.V * 10 ** rng.uniform(-2, 1) + 30.0 * i, part.F) for i, part in enumerate(parts)))


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


def _turned_rings(profile: Callable[[Generator, int, int], tuple[FloatArray, FloatArray]], rng: Generator) -> Mesh:
    """Rings of vertices, each rotated against the one before by the same angle.

    Their radii and heights are those of a profile for so many rings with so many vertices on each.
    """
    along, around = int(_between(rng, 3, 40)), int(_between(rng, 3, 40))
    radius, height = profile(rng, along, around)
    turn = rng.choice([0.0, np.pi / around, rng.uniform(0, 1)])
    return _stored(rng, build.revolved(radius, height, around, turn))


def _cylinder(rng: Generator, along: int, _: int) -> tuple[FloatArray, FloatArray]:
    return np.ones(along), np.linspace(0, _between(rng, 0.1, 20), along)


def _cone(rng: Generator, along: int, _: int) -> tuple[FloatArray, FloatArray]:
    return np.linspace(rng.uniform(0.05, 0.95), 1, along), np.linspace(0, _between(rng, 0.1, 20), along)


def _reducer(rng: Generator, along: int, _: int) -> tuple[FloatArray, FloatArray]:
    height = np.linspace(-1, 1, along) * rng.uniform(2, 20)
    return 1 + np.tanh(height) / 2, height


def _spaced_rings(rng: Generator, along: int, around: int) -> tuple[FloatArray, FloatArray]:
    return np.ones(along), np.cumsum(rng.uniform(1.01, 1.6) ** np.arange(along)) * 2 * np.pi / around


def _grid(rng: Generator) -> Mesh:
    n = int(_between(rng, 4, 40))
    z = rng.normal(size=(n, n)) * 10 ** rng.uniform(-12, 0)
    return _stored(rng, lattice_mesh(np.arange(n)[:, None], np.arange(n), z))


def _integers(rng: Generator) -> Mesh:
    n = int(_between(rng, 4, 30))
    x, y = (np.arange(n) * rng.integers(1, 4) for _ in range(2))
    return _stored(rng, lattice_mesh(x[:, None], y, rng.integers(0, rng.integers(1, 4), size=(n, n))))


def _member(name: str, make: Callable[[Generator], Mesh], seed: int) -> Mesh:
    return make(np.random.default_rng([20261123, crc32(name.encode()), seed]))


_FAMILIES: dict[str, Callable[[Generator], Mesh]] = {
    "random tetrahedra": tetrahedra_surface,
    "alpha shape": alpha_shape,
    "star polygon": star_polygon,
    "helix": helix,
    "spiral ramp": spiral_ramp,
    "maze": maze,
    "CAD plate": cad_plate,
    "thin plate": thin_plate,
    "CAD cylinder": cad_cylinder,
    "shell": shell,
    "carved voxels": carved_voxels,
    "nested circles": nested_circles,
    "spiky sphere": spiky_sphere,
    "ribbon": ribbon,
    "tube of few sides": tube_of_few_sides,
    "vase": vase,
    "terrain": terrain,
    "handles": handles,
    "hull": flat_hull,
    "clusters": clusters,
    "stretched noise": stretched_noise,
    "extrusion": extrusion,
    "comb": comb,
    "folds": folds,
    "several spheres": several_spheres,
    "nearly flat cylinder": partial(_turned_rings, _cylinder),
    "nearly flat cone": partial(_turned_rings, _cone),
    "pipe reducer": partial(_turned_rings, _reducer),
    "geometrically spaced rings": partial(_turned_rings, _spaced_rings),
    "nearly flat grid": _grid,
    "grid of integers": _integers,
}
FAMILIES = {name: partial(_member, name, make) for name, make in _FAMILIES.items()}
"""All families by name: seed -> mesh, the same bits at every call."""
