"""Small domains of every kind with known distances: points, metrics, tetrahedra, polygons and images."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from heat_igl.mesh import Mesh, MeshLike, PointCloud, PolygonMesh, image_domain
from heat_igl.operators import Operators, fibre_metric, metric_operators, speed_operators
from heat_igl.sources import Sources
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.validation import shapes

# Volume of a tetrahedron in the unit cube below which it is left out: its corners lie in a plane up to rounding.
_LEAST_VOLUME = 1e-12


class Problem(NamedTuple):
    """A domain, sources on it, and the exact distance (n,) from them."""

    domain: MeshLike | Operators
    sources: Sources
    exact: FloatArray


class DomainCase(NamedTuple):
    """A problem with a known answer.

    Attributes
    ----------
    domain : str
        Kind of domain: "point cloud", "metric", "tetrahedra", "polygons" or "image".
    name : str
        The problem, in a few words.
    against : str
        Where the exact distance comes from.
    bounds : mapping of str to float
        The largest mean relative error that a method of `geodesic_distance` may have.
    problem : callable
        Makes the `Problem` from a random generator.
    """

    domain: str
    name: str
    against: str
    bounds: Mapping[str, float]
    problem: Callable[[np.random.Generator], Problem]


#: All cases, kind after kind.
CASES: list[DomainCase] = []

_Make = Callable[[np.random.Generator], Problem]


def _case(domain: str, name: str, against: str, **bounds: float) -> Callable[[_Make], _Make]:
    """Register a function as the problem of a case."""

    def register(make: _Make) -> _Make:
        CASES.append(DomainCase(domain, name, against, bounds, make))
        return make

    return register


def straight(V: FloatArray, source: int) -> FloatArray:
    """Length (n,) of the straight line from one of the points (n, d)."""
    return np.asarray(np.linalg.norm(V - V[source], axis=1))


def moved_inside(mesh: Mesh, rng: np.random.Generator, most: float, fixed: BoolArray | None = None) -> Mesh:
    """The mesh with vertices moved by up to `most` in x and y, except on the boundary and where `fixed` is true."""
    V = mesh.V.copy()
    inner = ~mesh.boundary if fixed is None else ~mesh.boundary & ~fixed
    V[inner, :2] += rng.uniform(-most, most, (int(inner.sum()), 2))
    return Mesh(V, mesh.F)


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


def by_fermat(V: FloatArray, source: int, left: float, right: float) -> FloatArray:
    """Least time (n,) from a point in the unit square with speed `left` at x < 1/2 and `right` beyond.

    The path crosses the border at the best of 8001 places (Snell's law), or runs along the faster side of it (the head
    wave); relative error below 1e-6.
    """
    start, x, y = V[source], V[:, 0] - 0.5, V[:, 1]
    here, there = (left, right) if start[0] < 0.5 else (right, left)
    beyond = x > 0 if start[0] < 0.5 else x < 0  # a source on the border counts as right of it
    depth = abs(start[0] - 0.5)
    crossing = np.linspace(-0.5, 1.5, 8001)
    to_crossing = np.hypot(depth, start[1] - crossing) / here
    refracted = np.array([(to_crossing + np.hypot(a, b - crossing) / there).min() for a, b in zip(x, y, strict=True)])
    time = straight(V, source) / here
    if there > here:
        critical = np.arcsin(here / there)
        both, along = depth + np.abs(x), np.abs(y - start[1])
        head = both * np.cos(critical) / here + along / there
        time = np.where(along >= both * np.tan(critical), np.minimum(time, head), time)
    return np.where(beyond, refracted, time)


def around_the_edge(V: FloatArray, source: int) -> FloatArray:
    """Distance (n,) in the unit cube without the quarter x, y > 1/2: paths bend at the inner edge.

    The part that is hidden from the source is turned about that edge until the path is straight.
    """
    x, y, z = (V - [0.5, 0.5, V[source, 2]]).T
    # From the wall y > 1/2, through the body, to the other wall.
    angle = np.mod(np.arctan2(y, x) - np.pi / 2, 2 * np.pi)
    bent = np.hypot(np.hypot(x, y) + np.hypot(x[source], y[source]), z)
    return np.where(np.abs(angle - angle[source]) > np.pi, bent, straight(V, source))


def around_the_wall(V: FloatArray, source: int, wall: float, end: float) -> FloatArray:
    """Distance around a wall at wall < x < wall + 1, y < end, parallel to z; the source has x < wall, y < end."""
    x, y, z = (V - V[source]).T
    wall, end = wall - V[source, 0], end - V[source, 1]
    past_one = np.hypot(wall, end) + np.hypot(x - wall, y - end)
    past_both = np.hypot(wall, end) + 1 + np.hypot(x - wall - 1, y - end)
    is_seen = (x <= wall) | (y * wall >= end * x)
    flat = np.where(is_seen, np.hypot(x, y), np.where(y >= end, past_one, past_both))
    return np.asarray(np.hypot(flat, z))


_POINTS = {"heat": 0.012, "auto": 0.003, "windows": 0.001}


@_case("point cloud", "random points on a sphere", "arc of the great circle", **_POINTS)
def _sphere(rng: np.random.Generator) -> Problem:
    P = rng.standard_normal((4000, 3))
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    across = np.linalg.norm(np.cross(P, P[0]), axis=1)
    return Problem(PointCloud(P), 0, np.arctan2(across, P @ P[0]))


@_case("point cloud", "random points on a cylinder", "helix", **_POINTS)
def _points_on_a_cylinder(rng: np.random.Generator) -> Problem:
    angle, height = rng.uniform(0, 2 * np.pi, 4000), rng.uniform(0, 3, 4000)
    turn = np.abs(np.remainder(angle - angle[0] + np.pi, 2 * np.pi) - np.pi)
    P = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    return Problem(PointCloud(P), 0, np.hypot(turn, height - height[0]))


@_case("point cloud", "random points in a square", "straight line", **_POINTS)
def _points_in_a_square(rng: np.random.Generator) -> Problem:
    P = rng.random((4000, 2))
    return Problem(PointCloud(P), 0, straight(P, 0))


@_case(
    "metric",
    "one tensor on a square, 1 : 100",
    "straight line after the linear map",
    heat=0.015,
    sweep=0.001,
    windows=0.001,
    exact=1e-9,
)
def _one_tensor(rng: np.random.Generator) -> Problem:
    mesh = moved_inside(shapes.grid(32), rng, 0.25 / 32)
    stretch = np.array([[80.0, 60.0, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])  # singular values 100, 1 and 1
    domain = metric_operators(mesh, np.tile(stretch.T @ stretch, (mesh.n_faces, 1, 1)))
    return Problem(domain, 500, straight(mesh.V @ stretch.T, 500))


@_case(
    "metric",
    "helical fibres on a cylinder, 1 : 3",
    "straight line on the unrolled prism",
    heat=0.02,
    sweep=0.001,
    windows=0.001,
    exact=1e-9,
)
def _helical_fibres(rng: np.random.Generator) -> Problem:
    around = 48
    tube = shapes.cylinder(around, 24, np.pi)
    corners = tube.V[tube.F]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    outward *= np.sign((outward * corners.mean(axis=1)).sum(axis=1, keepdims=True))
    rise = 0.5 * np.linalg.norm(outward, axis=1)
    domain = metric_operators(tube, fibre_metric(np.stack([-outward[:, 1], outward[:, 0], rise], axis=1), 1.0, 3.0))
    # The sides of the prism, laid side by side; ways around it end at copies of the vertex.
    side = 2 * np.sin(np.pi / around)
    flat = np.stack([np.arange(tube.n_vertices) % around * side, tube.V[:, 2]], axis=1)
    source = int(rng.integers(10, 14)) * around + int(rng.integers(around))
    along = np.array([1.0, 0.5]) / np.hypot(1.0, 0.5)
    copies = flat - flat[source] + np.arange(-2, 3)[:, None, None] * [around * side, 0.0]
    stretched = np.hypot(copies @ along, 3 * (copies @ [-along[1], along[0]]))
    return Problem(domain, source, stretched.min(axis=0))


def _two_speeds(left: float, right: float, rng: np.random.Generator) -> Problem:
    square = shapes.grid(40)
    mesh = moved_inside(square, rng, 0.25 / 40, square.V[:, 0] == 0.5)
    speed = np.where(mesh.V[mesh.F][:, :, 0].mean(axis=1) < 0.5, left, right)
    source = int(rng.choice(np.flatnonzero(mesh.V[:, 0] < 0.4)))
    return Problem(speed_operators(mesh, speed), source, by_fermat(mesh.V, source, left, right))


_case("metric", "two layers, speeds 1 and 2", "Snell's law and head wave", auto=0.0005)(
    lambda rng: _two_speeds(1.0, 2.0, rng)
)
_case("metric", "two layers, speeds 1e6 and 1", "Snell's law", auto=1e-5)(lambda rng: _two_speeds(1e6, 1.0, rng))


@_case(
    "metric",
    "speed that grows exponentially, 1 : 1e6",
    "straight line after the map exp(-k z) / k",
    auto=0.003,
    sweep=0.003,
    windows=0.003,
)
def _exponential_speed(rng: np.random.Generator) -> Problem:
    strip = shapes.strip(200, 12)
    mesh = moved_inside(strip, rng, 0.25)
    rate = np.log(1e6) / 200
    unrolled = np.exp(-rate * (mesh.V[:, 0] + 1j * (mesh.V[:, 1] - 6))) / rate
    speed = np.exp(rate * mesh.V[mesh.F][:, :, 0].mean(axis=1))
    source = int(rng.integers(strip.n_vertices))
    return Problem(speed_operators(mesh, speed), source, np.abs(unrolled - unrolled[source]))


@_case("tetrahedra", "cube of even tetrahedra", "straight line", auto=1e-5)
def _cube(rng: np.random.Generator) -> Problem:
    mesh = shapes.box(12)
    source = int(rng.integers(mesh.n_vertices))
    return Problem(mesh, source, straight(mesh.V, source))


@_case("tetrahedra", "Delaunay tetrahedra in a ball", "straight line", auto=1e-5)
def _ball(rng: np.random.Generator) -> Problem:
    V = rng.random((5000, 3)) - 0.5
    mesh = delaunay(V[np.linalg.norm(V, axis=1) < 0.5])
    return Problem(mesh, 0, straight(mesh.V, 0))


@_case("tetrahedra", "three quarters of a cube", "straight line turned about the edge", auto=1e-5)
def _three_quarters(rng: np.random.Generator) -> Problem:
    mesh = without(12, lambda centre: np.asarray((centre[:, :2] > 0.5).all(axis=1)))
    source = int(rng.choice(np.flatnonzero((mesh.V[:, 0] > 0.7) & (mesh.V[:, 1] > 0.2))))
    return Problem(mesh, source, around_the_edge(mesh.V, source))


@_case("tetrahedra", "one tensor in a cube, 1 : 10", "straight line after the linear map", auto=1e-5)
def _stretched_cube(rng: np.random.Generator) -> Problem:
    mesh = shapes.box(10)
    stretch = np.array([[8.0, 6.0, 0.0], [-0.6, 0.8, 0.0], [0.5, 0.0, 1.0]])
    source = int(rng.integers(mesh.n_vertices))
    domain = metric_operators(mesh, np.tile(stretch.T @ stretch, (mesh.n_faces, 1, 1)))
    return Problem(domain, source, straight(mesh.V @ stretch.T, source))


@_case("tetrahedra", "depth below the vertices of a cube's sides", "nearest of them", auto=1e-5)
def _depth(rng: np.random.Generator) -> Problem:
    V = np.concatenate([shapes.box(10).V, rng.uniform(0.05, 0.95, (2000, 3))])
    mesh = delaunay(V)
    return Problem(mesh, mesh.boundary, cKDTree(V[mesh.boundary]).query(V)[0])


@_case("polygons", "quadrilaterals in a square", "straight line", heat=0.01, sweep=1e-5, windows=1e-5, exact=1e-9)
def _quadrilaterals(rng: np.random.Generator) -> Problem:
    rows = 32
    square = moved_inside(shapes.grid(rows), rng, 0.2 / rows)
    first = (np.arange(rows)[:, None] * (rows + 1) + np.arange(rows)).ravel()
    quads = PolygonMesh(square.V, np.stack([first, first + 1, first + rows + 2, first + rows + 1], axis=1))
    return Problem(quads, 500, straight(quads.V, 500))


@_case("polygons", "concave polygons in a square", "straight line", heat=0.03, sweep=0.01, windows=0.001, exact=1e-9)
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


@_case("image", "pixels of 1 by 2.5", "straight line", heat=0.03, sweep=0.01, windows=0.001, exact=1e-9)
def _long_pixels(rng: np.random.Generator) -> Problem:
    image = image_domain(np.ones((16, 40), bool), spacing=(2.5, 1.0))
    source = int(image.index[int(rng.integers(16)), int(rng.integers(40))])
    return Problem(image.mesh, source, straight(image.mesh.V, source))


@_case(
    "image",
    "wall of pixels of 1 by 2",
    "lines between the corners of the wall",
    heat=0.04,
    sweep=0.01,
    windows=0.001,
    exact=1e-9,
)
def _wall_of_pixels(rng: np.random.Generator) -> Problem:
    mask = np.ones((20, 31), bool)
    mask[:15, 15] = False
    image = image_domain(mask, spacing=(2.0, 1.0))
    source = int(image.index[int(rng.integers(10)), int(rng.integers(10))])
    return Problem(image.mesh, source, around_the_wall(image.mesh.V, source, 14.5, 29.0))


@_case("image", "wall of voxels of 1 by 2 by 1.5", "lines between the edges of the wall, unrolled", auto=0.01)
def _wall_of_voxels(rng: np.random.Generator) -> Problem:
    mask = np.ones((6, 12, 15), bool)
    mask[:, :9, 7] = False
    image = image_domain(mask, spacing=(1.5, 2.0, 1.0))
    source = int(image.index[int(rng.integers(6)), int(rng.integers(6)), int(rng.integers(5))])
    return Problem(image.mesh, source, around_the_wall(image.mesh.V, source, 6.5, 17.0))
