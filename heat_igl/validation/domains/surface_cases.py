"""Checks on point clouds, and on meshes with a metric or a speed on each face."""

from __future__ import annotations

import numpy as np

from heat_igl.mesh import Mesh, PointCloud
from heat_igl.operators import fibre_metric, metric_operators, speed_operators
from heat_igl.typing import BoolArray, FloatArray
from heat_igl.validation import shapes
from heat_igl.validation.domains.case import DomainCase, Problem

__all__ = ["CASES", "by_fermat", "moved_inside", "straight"]


def straight(V: FloatArray, source: int) -> FloatArray:
    """Length (n,) of the straight line from one of the points (n, d)."""
    return np.asarray(np.linalg.norm(V - V[source], axis=1))


def moved_inside(mesh: Mesh, rng: np.random.Generator, most: float, fixed: BoolArray | None = None) -> Mesh:
    """The mesh with vertices moved by up to `most` in x and y, except on the boundary and where `fixed` is true."""
    V = mesh.V.copy()
    inner = ~mesh.boundary if fixed is None else ~mesh.boundary & ~fixed
    V[inner, :2] += rng.uniform(-most, most, (int(inner.sum()), 2))
    return Mesh(V, mesh.F)


def _sphere(rng: np.random.Generator) -> Problem:
    P = rng.standard_normal((4000, 3))
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    across = np.linalg.norm(np.cross(P, P[0]), axis=1)
    return Problem(PointCloud(P), 0, np.arctan2(across, P @ P[0]))


def _points_in_a_square(rng: np.random.Generator) -> Problem:
    P = rng.random((4000, 2))
    return Problem(PointCloud(P), 0, straight(P, 0))


def _points_on_a_cylinder(rng: np.random.Generator) -> Problem:
    angle, height = rng.uniform(0, 2 * np.pi, 4000), rng.uniform(0, 3, 4000)
    turn = np.abs(np.remainder(angle - angle[0] + np.pi, 2 * np.pi) - np.pi)
    P = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    return Problem(PointCloud(P), 0, np.hypot(turn, height - height[0]))


def _one_tensor(rng: np.random.Generator) -> Problem:
    mesh = moved_inside(shapes.grid(32), rng, 0.25 / 32)
    stretch = np.array([[80.0, 60.0, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])  # singular values 100, 1 and 1
    domain = metric_operators(mesh, np.tile(stretch.T @ stretch, (mesh.n_faces, 1, 1)))
    return Problem(domain, 500, straight(mesh.V @ stretch.T, 500))


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


def _exponential_speed(rng: np.random.Generator) -> Problem:
    strip = shapes.strip(200, 12)
    mesh = moved_inside(strip, rng, 0.25)
    rate = np.log(1e6) / 200
    unrolled = np.exp(-rate * (mesh.V[:, 0] + 1j * (mesh.V[:, 1] - 6))) / rate
    speed = np.exp(rate * mesh.V[mesh.F][:, :, 0].mean(axis=1))
    source = int(rng.integers(strip.n_vertices))
    return Problem(speed_operators(mesh, speed), source, np.abs(unrolled - unrolled[source]))


def by_fermat(V: FloatArray, source: int, left: float, right: float) -> FloatArray:
    """Least time in the unit square with speed `left` at x < 1/2 and `right` beyond.

    The path crosses the border at the best of 8001 places (Snell's law), or runs along the faster side of it (the head
    wave); relative error below 1e-6.

    Parameters
    ----------
    V : (n, 3) float64
        Points of the square.
    source : int
        The point where time begins.
    left, right : float
        Speeds.

    Returns
    -------
    (n,) float64
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


_POINTS = {"heat": 0.02, "default": 0.01, "windows": 0.003}

CASES = (
    DomainCase("point cloud", "random points on a sphere", "arc of the great circle", _POINTS, _sphere),
    DomainCase("point cloud", "random points on a cylinder", "helix", _POINTS, _points_on_a_cylinder),
    DomainCase("point cloud", "random points in a square", "straight line", _POINTS, _points_in_a_square),
    DomainCase(
        "metric",
        "one tensor on a square, 1 : 100",
        "straight line after the linear map",
        {"heat": 0.02, "sweep": 0.001, "windows": 0.001, "exact": 1e-9},
        _one_tensor,
    ),
    DomainCase(
        "metric",
        "helical fibres on a cylinder, 1 : 3",
        "straight line on the unrolled prism",
        {"heat": 0.02, "sweep": 0.001, "windows": 0.001, "exact": 1e-9},
        _helical_fibres,
    ),
    DomainCase(
        "metric",
        "two layers, speeds 1 and 2",
        "Snell's law and head wave",
        {"default": 0.002},
        lambda rng: _two_speeds(1.0, 2.0, rng),
    ),
    DomainCase(
        "metric",
        "two layers, speeds 1e6 and 1",
        "Snell's law",
        {"default": 0.002},
        lambda rng: _two_speeds(1e6, 1.0, rng),
    ),
    DomainCase(
        "metric",
        "speed that grows exponentially, 1 : 1e6",
        "straight line after the map exp(-k z) / k",
        {"default": 0.005, "sweep": 0.005, "windows": 0.005},
        _exponential_speed,
    ),
)
