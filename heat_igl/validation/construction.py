"""What generated shapes are made of: rings, tubes, plates with holes, mazes, hulls and voxels, joined and merged."""

from __future__ import annotations

from collections.abc import Callable

import igl
import numpy as np

from heat_igl.mesh import Mesh, PolygonMesh
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray
from heat_igl.validation.shapes import box, grid, lattice_mesh

Generator = np.random.Generator

# Tetrahedra with less than this, six times the volume, are left out: their corners lie in a plane up to rounding.
_LEAST_VOLUME = 1e-12


def delaunay(points: FloatArray) -> IntArray:
    """The Delaunay triangles of points (k, 2), all counter-clockwise, or the Delaunay tetrahedra of points (k, 3)."""
    from scipy.spatial import Delaunay  # takes as long to import as the rest of the package

    return np.asarray(Delaunay(points).simplices, np.int64)


def ring(around: int, begin: float = 0.0) -> FloatArray:
    """Points (around, 2) of the unit circle, the first of them at `begin` steps from the x axis."""
    angle = 2 * np.pi * (np.arange(around) + begin) / around
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def on_sphere(n: int, rng: Generator) -> FloatArray:
    """Random points (n, 3) on the unit sphere."""
    P = rng.standard_normal((n, 3))
    return np.asarray(P / np.linalg.norm(P, axis=1, keepdims=True))


def inside(outline: FloatArray, points: FloatArray) -> BoolArray:
    """Whether points (k, 2) lie inside a polygon (e, 2)."""
    corner = np.arange(len(outline))
    sides = np.stack([corner, np.roll(corner, -1)], axis=1)
    return np.asarray(np.abs(igl.winding_number(outline, sides, points)) > 0.5)


def planar(points: FloatArray, height: AnyArray | float = 0.0) -> Mesh:
    """The Delaunay triangles of points (k, 2) in the plane, at heights (k,)."""
    return Mesh(raised(points, height), delaunay(points))


def revolved(radius: FloatArray, height: FloatArray, around: int, turn: float = 0.0) -> Mesh:
    """A surface of revolution without caps: a ring of vertices for each radius (k,) and height (k,).

    Each ring is turned by an angle against the one before.
    """
    angle = 2 * np.pi * np.arange(around) / around + turn * np.arange(len(radius))[:, None]
    x, y = radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)
    return lattice_mesh(x, y, height[:, None], wrap_columns=True)


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
    return closed(raised(points, height), raised(points), F)


def closed(upper: FloatArray, lower: FloatArray, F: IntArray) -> Mesh:
    """Two sheets of the same triangles, on positions (k, 3) each, joined along the boundary."""
    n = len(upper)
    sides = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    _, which, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    a, b = sides[count[which.reshape(-1)] == 1].T
    walls = np.stack([a, b + n, b], axis=1), np.stack([a, a + n, b + n], axis=1)
    return compact(np.concatenate([upper, lower]), np.concatenate([F, F[:, ::-1] + n, *walls]))


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


def raised(points: FloatArray, height: AnyArray | float = 0.0) -> FloatArray:
    """Positions (k, 3) of points (k, 2) at heights (k,), or at one height."""
    return np.column_stack([points, np.broadcast_to(height, len(points))])


def compact(V: FloatArray, F: IntArray) -> Mesh:
    """The mesh of triangles or tetrahedra F without unreferenced vertices."""
    return Mesh(*igl.remove_unreferenced(V, F)[:2])


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


def dual(mesh: Mesh) -> PolygonMesh:
    """A polygon around each vertex inside of a manifold mesh, with its corners in the middles of the faces."""
    following: dict[tuple[int, int], tuple[int, int]] = {}
    for f, (a, b, c) in enumerate(mesh.F.tolist()):
        following |= {(a, b): (f, c), (b, c): (f, a), (c, a): (f, b)}
    neighbour = dict(following.keys())
    polygons = []
    for v in np.flatnonzero(mesh.referenced & ~mesh.boundary).tolist():
        polygon: list[int] = []
        there = neighbour[v]
        while not polygon or there != neighbour[v]:
            face, there = following[v, there]
            polygon.append(face)
        polygons.append(polygon)
    used, corners = np.unique(np.concatenate(polygons), return_inverse=True)
    return PolygonMesh(mesh.V[mesh.F[used]].mean(axis=1), np.split(corners, np.cumsum([*map(len, polygons)])[:-1]))


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


def walk(rng: Generator, k: int) -> IntArray:
    """The cells (k, 3) of a random walk, each step to one of six neighbours."""
    steps = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    return np.asarray(np.cumsum(steps[rng.integers(0, 6, k)], axis=0))
