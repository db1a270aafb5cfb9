"""The list of the shapes in the zoo, and functions that several of them share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any
from zlib import crc32

import numpy as np

from heat_igl.mesh import Mesh
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.validation.shapes import box

# Times six: a tetrahedron is left out below it, since its corners lie in a plane up to rounding.
_LEAST_VOLUME = 1e-12


@dataclass(frozen=True)
class Shape:
    """A shape of the zoo: `make` returns the `Mesh`, the same bits at every call.

    No default may be tuned on those that are `held_out`.
    """

    name: str
    family: str
    make: Callable[[], Mesh]
    held_out: bool


SHAPES: list[Shape] = []
"""All shapes, family after family."""


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


FAMILIES: dict[str, Callable[[int], Mesh]] = {}
"""All kinds with random members, by name: seed -> mesh, the same bits at every call."""


def family(name: str) -> Callable[[Callable[[np.random.Generator], Mesh]], Callable[[int], Mesh]]:
    """Register a function of a random generator as a kind of shapes, and make it one of a seed."""

    def register(make: Callable[[np.random.Generator], Mesh]) -> Callable[[int], Mesh]:
        @wraps(make)
        def member(seed: int) -> Mesh:
            return make(np.random.default_rng([20261123, crc32(name.encode()), seed]))

        FAMILIES[name] = member
        return member

    return register


def seeded(seed: int) -> np.random.Generator:
    """A random generator with a fixed seed."""
    return np.random.default_rng([20240815, seed])


def delaunay(points: FloatArray) -> IntArray:
    """The Delaunay triangles of points (k, 2), all counter-clockwise, or the Delaunay tetrahedra of points (k, 3)."""
    from scipy.spatial import Delaunay  # takes as long to import as the rest of the package

    return np.asarray(Delaunay(points).simplices, np.int64)


def ring(around: int) -> FloatArray:
    """Points (around, 2) of the unit circle."""
    angle = 2 * np.pi * np.arange(around) / around
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def revolved(radius: FloatArray, height: FloatArray, around: int) -> FloatArray:
    """Vertices of a surface of revolution, a ring for each radius (k,) and height (k,), ring after ring."""
    circle = ring(around)
    return np.concatenate([raised(r * circle, z) for r, z in zip(radius, height, strict=True)])


def tube(centre: FloatArray, along: FloatArray, up: FloatArray, radius: float, around: int) -> FloatArray:
    """Vertices of a tube: rings about points (k, 3) across the directions `along`, in frames that `up` turns."""
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    u = np.cross(along, up)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    x, y = ring(around).T
    rings = centre[:, None] + radius * (u[:, None] * x[:, None] + v[:, None] * y[:, None])
    return np.asarray(rings.reshape(-1, 3))


def extruded(points: FloatArray, F: IntArray, height: float) -> Mesh:
    """Two sheets of triangles on points (k, 2), at a height and at 0, joined along the boundary."""
    n = len(points)
    return compact(
        np.concatenate([raised(points, height), raised(points)]), np.concatenate([F, F[:, ::-1] + n, walls(F, n)])
    )


def caps(rings: int, around: int) -> IntArray:
    """Triangles that close the first and the last of some rings of vertices, in fans around one of their own."""
    k = np.arange(1, around - 1)
    first = np.stack([np.zeros_like(k), k + 1, k], axis=1)
    return np.concatenate([first, (rings - 1) * around + first[:, ::-1]])


def corridors(rng: np.random.Generator, n: int) -> BoolArray:
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


def walls(F: IntArray, above: int) -> IntArray:
    """Triangles between the boundary of F and the same boundary with `above` added to its vertices."""
    sides = np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]])
    _, which, count = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    a, b = sides[count[which.reshape(-1)] == 1].T
    return np.concatenate([np.stack([a, b + above, b], axis=1), np.stack([a, a + above, b + above], axis=1)])


def raised(points: FloatArray, height: AnyArray | float = 0.0) -> FloatArray:
    """Positions (k, 3) of points (k, 2) at heights (k,), or at one height."""
    return np.column_stack([points, np.broadcast_to(height, len(points))])


def compact(V: FloatArray, F: IntArray) -> Mesh:
    """The triangles or tetrahedra without the vertices that none uses."""
    used, numbers = np.unique(F, return_inverse=True)
    return Mesh(V[used], numbers.reshape(F.shape))


def tetrahedra(V: FloatArray) -> Mesh:
    """Delaunay tetrahedra of points (n, 3) in the unit cube, slivers included, but for those without a volume."""
    F = delaunay(V)
    return Mesh(V, F[np.abs(np.linalg.det(V[F[:, 1:]] - V[F[:, :1]])) > _LEAST_VOLUME])


def carved(n: int, cut: Callable[[FloatArray], BoolArray]) -> Mesh:
    """The unit cube of n^3 cells without the tetrahedra whose centres (m, 3) are `cut`."""
    cube = box(n)
    return compact(cube.V, cube.F[~cut(cube.V[cube.F].mean(axis=1))])


def joined(*parts: Mesh) -> Mesh:
    """Several meshes as components of one."""
    first = np.cumsum([0, *(part.n_vertices for part in parts)])
    return Mesh(
        np.concatenate([part.V for part in parts]),
        np.concatenate([part.F + begin for part, begin in zip(parts, first, strict=False)]),
    )


def merged(V: FloatArray, F: IntArray) -> Mesh:
    """The mesh with equal positions made one vertex, and without the triangles that this collapses."""
    scale = 1e-9 * float(np.ptp(V, axis=0).max())
    _, first, which = np.unique(np.round(V / scale), axis=0, return_index=True, return_inverse=True)
    F = which.reshape(-1)[F]
    kept = (F[:, 0] != F[:, 1]) & (F[:, 1] != F[:, 2]) & (F[:, 2] != F[:, 0])
    return Mesh(V[first], F[kept])


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
