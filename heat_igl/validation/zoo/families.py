"""Kinds of surfaces with random members: each function makes the mesh of a seed, of some hundred to 3000 vertices.

No default may be tuned on single members: a change is measured over many seeds of every kind.
"""

from __future__ import annotations

import igl
import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import BoolArray, FloatArray, IntArray
from heat_igl.validation.shapes import grid, icosphere, lattice_faces
from heat_igl.validation.zoo.registry import (
    boxes,
    caps,
    compact,
    corridors,
    delaunay,
    extruded,
    family,
    hull,
    joined,
    merged,
    raised,
    revolved,
    ring,
    tube,
    walls,
)

Generator = np.random.Generator


def _bounded(points: FloatArray, edges: IntArray, inside: FloatArray) -> BoolArray:
    """Whether points (k, 2) lie inside the polygons with edges (e, 2): crossings of a ray to the right are odd."""
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    x, y = inside[:, :1], inside[:, 1:]
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return np.asarray(np.count_nonzero(crosses & (x < at), axis=1) % 2 == 1)


def _tetrahedra_surface(points: FloatArray, T: IntArray) -> Mesh:
    """The triangles that belong to one tetrahedron of T (k, 4) alone, turned outward."""
    # igl's order of the corners needs positively oriented tetrahedra.
    edges = points[T[:, 1:]] - points[T[:, :1]]
    T = np.where((np.linalg.det(edges) < 0)[:, None], T[:, [0, 2, 1, 3]], T)
    F = np.asarray(igl.boundary_facets(np.ascontiguousarray(T, np.int64))[0], np.int64)
    return compact(points, F)


def _plate(rng: Generator, around: int, n_inside: int) -> tuple[FloatArray, IntArray]:
    """Points (k, 2) and triangles of a rectangle of 10 by 6 with round holes, few vertices between them."""
    holes: list[tuple[float, float, float]] = []
    for _ in range(200):
        r = rng.uniform(0.15, 0.9)
        x, y = rng.uniform([r + 0.1, r + 0.1], [9.9 - r, 5.9 - r])
        if all(np.hypot(x - a, y - b) > r + s + 0.08 for a, b, s in holes) and len(holes) < rng.integers(3, 25):
            holes.append((x, y, r))
    centre, radius = np.array(holes)[:, :2], np.array(holes)[:, 2]
    rims = (centre[:, None] + radius[:, None, None] * ring(around)).reshape(-1, 2)
    inside = rng.uniform([0.2, 0.2], [9.8, 5.8], (n_inside, 2))
    apart = np.linalg.norm(inside[:, None] - centre, axis=2) > radius + 0.05
    points = np.concatenate([rims, [[0, 0], [10, 0], [10, 6], [0, 6]], inside[apart.all(axis=1)]])
    F = delaunay(points)
    middle = points[F].mean(axis=1)
    inner = np.linalg.norm(middle[:, None] - centre, axis=2) < radius * np.cos(np.pi / around)
    return points, F[~inner.any(axis=1)]


def _tube(centre: FloatArray, radius: float, around: int) -> Mesh:
    """An open tube of `around` sides along points (k, 3)."""
    V = tube(centre, np.gradient(centre, axis=0), np.array([0.31, 0.21, 0.93]), radius, around)
    return Mesh(V, lattice_faces(len(centre), around, wrap_columns=True))


def _band(middle: FloatArray, across: FloatArray, rows: int) -> Mesh:
    """A band of `rows` rows of vertices about a curve (k, 3), reaching by `across` (k, 3) to either side."""
    s = np.linspace(-1, 1, rows)
    V = middle[None] + s[:, None, None] * across[None]
    return Mesh(V.reshape(-1, 3), lattice_faces(rows, len(middle)))


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
    edges = np.stack([np.arange(len(rim)), np.roll(np.arange(len(rim)), -1)], axis=1)
    inner = rng.uniform(-0.3, 0.3, (int(rng.integers(0, 200)), 2))
    inner = inner[_bounded(rim, edges, inner)]
    points = np.concatenate([rim, inner])
    F = delaunay(points)
    return compact(raised(points), F[_bounded(points, edges, points[F].mean(axis=1))])


@family("helix")
def helix(rng: Generator) -> Mesh:
    """A tube along a helix, with rings closer together than the vertices on them or farther apart."""
    turns, n = rng.uniform(2, 8), int(rng.integers(60, 400))
    t = np.linspace(0, 2 * np.pi * turns, n)
    centre = np.stack([np.cos(t), np.sin(t), rng.uniform(0.05, 0.4) * t], axis=1)
    return _tube(centre, rng.uniform(0.05, 0.25), int(rng.integers(3, 10)))


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
    is_open = corridors(rng, size)
    n = fine * len(is_open)
    mesh = grid(n)
    x, y = np.minimum((mesh.V[mesh.F].mean(axis=1)[:, :2] * len(is_open)).astype(int), len(is_open) - 1).T
    return compact(mesh.V, mesh.F[is_open[x, y]])


@family("CAD plate")
def cad_plate(rng: Generator) -> Mesh:
    """A flat plate with round holes, vertices on the rims and few elsewhere."""
    points, F = _plate(rng, int(rng.integers(12, 96)), int(rng.integers(0, 60)))
    return compact(raised(points), F)


@family("thin plate")
def thin_plate(rng: Generator) -> Mesh:
    """The same as a body: two sheets a small thickness apart, joined along the rims."""
    points, F = _plate(rng, int(rng.integers(8, 40)), int(rng.integers(0, 60)))
    return extruded(points, F, 10 ** rng.uniform(-2.5, -0.3))


@family("CAD cylinder")
def cad_cylinder(rng: Generator) -> Mesh:
    """Few rings of many sides, capped by fans around one of their own vertices or left open."""
    around, rings = int(rng.integers(24, 600)), int(rng.integers(2, 5))
    height = np.sort(rng.random(rings)) * rng.uniform(0.2, 8)
    V, F = revolved(np.ones(rings), height, around), lattice_faces(rings, around, wrap_columns=True)
    if rng.random() < 0.4:
        return merged(V, F)
    return Mesh(V, np.concatenate([F, caps(rings, around)]))


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
    points = np.concatenate([r * ring(around) + 0.05 * r * rng.uniform(-1, 1, 2) for r in radius])
    return Mesh(raised(points), delaunay(points))


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
    return _tube(centre, 0.2 + 0.3 * a[3], int(rng.integers(3, 9)))


@family("vase")
def vase(rng: Generator) -> Mesh:
    """A surface of revolution with a random profile of necks and bellies, on long or flat cells."""
    rings, around = int(rng.integers(8, 80)), int(rng.integers(6, 100))
    z = np.linspace(0, rng.uniform(1, 10), rings)
    profile = 1 + sum(rng.uniform(0, 0.4) * np.sin(rng.uniform(0.5, 6) * z + rng.uniform(0, 6)) for _ in range(3))
    radius = np.maximum(profile, 0.08)
    if rng.random() < 0.5:
        radius[0] = 0.0
    return merged(revolved(radius, z, around), lattice_faces(rings, around, wrap_columns=True))


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
    step = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])[rng.integers(0, 6, int(rng.integers(10, 60)))]
    nodes = 2 * np.cumsum(step, axis=0)
    between = (nodes[1:] + nodes[:-1]) // 2
    return boxes(np.unique(np.concatenate([nodes, between]), axis=0))


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
    points = radius[:, None] * ring(n)
    edges = np.stack([np.arange(n), np.roll(np.arange(n), -1)], axis=1)
    F = delaunay(points)
    F = F[_bounded(points, edges, points[F].mean(axis=1))]
    return extruded(points, F, rng.uniform(0.02, 3))


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
