"""What earlier versions answered wrongly, on small shapes. Public functions alone, so that any version can run it."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any

import igl
import numpy as np
import pytest
from scipy.spatial import ConvexHull, Delaunay

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, geodesic_distance, shapes

Array = np.ndarray[Any, Any]


@pytest.fixture(autouse=True)
def _quiet() -> Iterator[None]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", heat_igl.AccuracyWarning)
        yield


def exact(mesh: Mesh, source: int) -> Array:
    """Polyhedral distance by libigl, which knows nothing of this package."""
    sources, everywhere = np.array([source], np.int64), np.arange(mesh.n_vertices)
    nothing = np.empty(0, np.int64)
    return np.asarray(igl.exact_geodesic(V=mesh.V, F=mesh.F, VS=sources, FS=nothing, VT=everywhere, FT=nothing)).ravel()


def straight(mesh: Mesh, sources: Any) -> Array:
    return np.linalg.norm(mesh.V[:, None] - mesh.V[np.atleast_1d(sources)], axis=2).min(axis=1)


def mean_error(distance: Array, truth: Array) -> float:
    there = truth > 0
    return float(np.mean(np.abs(distance - truth)[there] / truth[there]))


def largest_error(distance: Array, truth: Array) -> float:
    return float(np.abs(distance - truth).max() / truth.max())


# Shapes.


def scattered(n: int = 1000, height: float = 0.0) -> Mesh:
    points = np.random.default_rng(3).random((n, 2))
    z = height * np.sin(5 * points[:, 0]) * np.cos(4 * points[:, 1])
    return Mesh(np.column_stack([points, z]), Delaunay(points).simplices)


def sheared() -> Mesh:
    flat = shapes.grid(30)
    return Mesh(flat.V @ [[1, 0, 0], [3, 1, 0], [0, 0, 1]], flat.F)


def capped_cylinder(around: int = 64) -> Mesh:
    side, inner = shapes.cylinder(around, 1, 4.0), np.arange(1, around - 1)
    cap = np.stack([np.zeros_like(inner), inner + 1, inner], axis=1)
    return Mesh(side.V, np.concatenate([side.F, cap, around + cap[:, ::-1]]))


def needle_fan(n: int = 300) -> Mesh:
    angle = 2 * np.pi * np.arange(n) / n
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])
    k = np.arange(n)
    return Mesh(np.vstack([[0, 0, 0], rim]), np.stack([np.zeros_like(k), 1 + k, 1 + (k + 1) % n], axis=1))


def noise(factor: float) -> Mesh:
    flat = shapes.grid(20)
    return Mesh(flat.V + [[0, 0, 1]] * (factor / 20 * np.random.default_rng(1).random((len(flat.V), 1))), flat.F)


def hull(n: int, seed: int) -> Mesh:
    points = np.random.default_rng(seed).standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    F = np.asarray(ConvexHull(points).simplices)
    normal = np.cross(points[F[:, 1]] - points[F[:, 0]], points[F[:, 2]] - points[F[:, 0]])
    inward = np.einsum("kx,kx->k", normal, points[F].mean(axis=1)) < 0
    F[inward] = F[inward][:, ::-1]
    return Mesh(points, F)


def cubes(is_full: Array) -> Mesh:
    """The surface of unit cubes: the squares between a full cell and an empty one, each cut along either diagonal."""
    rng, V, F = np.random.default_rng(0), [], []
    full = np.pad(is_full, 1)
    for cell in np.argwhere(full):
        for axis, side in np.ndindex(3, 2):
            step = (2 * side - 1) * np.eye(3, dtype=int)[axis]
            if not full[tuple(cell + step)]:
                around = np.roll([[side, 0, 0], [side, 1, 0], [side, 1, 1], [side, 0, 1]], axis, axis=1)
                F.append(len(V) + np.array([[0, 1, 2], [0, 2, 3]])[:, :: 2 * side - 1])
                V.extend(cell + np.roll(around, rng.integers(2), axis=0))
    unique, which = np.unique(np.array(V), axis=0, return_inverse=True)
    return Mesh(unique.astype(float), which.reshape(-1)[np.concatenate(F)])


def cube_less_one() -> Mesh:
    return cubes(np.arange(8).reshape(2, 2, 2) < 7)


def sponge() -> Mesh:
    """Menger's sponge of level 2: plates with square holes."""
    i = np.indices((9, 9, 9))
    return cubes(np.all([((i // step % 3) == 1).sum(axis=0) < 2 for step in (1, 3)], axis=0))


def plate() -> Mesh:
    """A square of 12 by 12 cells, without the 4 by 4 in the middle."""
    flat = shapes.grid(12)
    middle = flat.V[flat.F].mean(axis=1)[:, :2]
    used, F = np.unique(flat.F[(np.abs(middle - 0.5) > 1 / 6).any(axis=1)], return_inverse=True)
    return Mesh(flat.V[used], F.reshape(-1, 3))


def beside(one: Mesh, other: Mesh) -> Mesh:
    return Mesh(np.concatenate([one.V, other.V]), np.concatenate([one.F, other.F + one.n_vertices]))


# Heat.


@pytest.mark.parametrize("mesh", [scattered(), sheared(), scattered(height=0.2)], ids=["scattered", "sheared", "field"])
def test_heat_where_triangles_at_the_boundary_are_obtuse(mesh: Mesh) -> None:
    middle = int(straight(mesh, 0).argsort()[mesh.n_vertices // 2])
    error = mean_error(HeatMethodSolver(mesh).distance(middle), exact(mesh, middle))
    assert error < 0.02


@pytest.mark.parametrize("mesh", [capped_cylinder(), needle_fan(), noise(5.0)], ids=["cylinder", "needles", "noise"])
def test_heat_where_triangles_are_uneven(mesh: Mesh) -> None:
    for source in (2, mesh.n_vertices - 3):
        assert mean_error(HeatMethodSolver(mesh).distance(source), exact(mesh, source)) < 0.05


def test_heat_says_so_where_it_is_wrong() -> None:
    """With the triangles as they are, and negative weights on the boundary; by default bounds mend that."""
    solver = HeatMethodSolver(sheared(), laplacian="intrinsic-delaunay", t_coef=0.5)
    with pytest.warns(heat_igl.AccuracyWarning, match=r"heat gave distances .* too short"):
        solver.distance(480)


@pytest.mark.parametrize("ratio", [10.0, 1e3])
def test_heat_on_a_small_component(ratio: float) -> None:
    sphere = shapes.icosphere(3)
    mesh = beside(sphere, Mesh(sphere.V * ratio + [3 * ratio, 0, 0], sphere.F))
    found = HeatMethodSolver(mesh).distance(0)[: sphere.n_vertices]
    assert mean_error(found, exact(sphere, 0)) < 0.01


def test_unfolding_on_a_small_component_beside_a_flat_triangle() -> None:
    sphere = shapes.icosphere(2)
    flat = Mesh(np.array([[0.0, 5, 0], [1, 5, 0], [2, 5, 0]]) * 1e8, [[0, 1, 2]])
    mesh = beside(sphere, flat)
    found = GeodesicSolver(mesh, method="exact").distance(0)[: sphere.n_vertices]
    assert largest_error(found, exact(sphere, 0)) < 0.003


# Unfolding.


def test_unfolding_over_holes_is_not_too_short() -> None:
    mesh = sponge()
    for source in range(0, mesh.n_vertices, 60):
        truth = exact(mesh, source)
        assert ((geodesic_distance(mesh, source) - truth) / truth.max()).min() > -1e-9


def test_a_sweep_around_a_hole() -> None:
    mesh = plate()
    for source in range(0, mesh.n_vertices, 5):
        assert largest_error(GeodesicSolver(mesh, method="sweep").distance(source), exact(mesh, source)) < 0.003


COARSE = {"hull": hull(35, 1), "field": scattered(60, 1.0), "noise": noise(10.0), "cube": cube_less_one()}


@pytest.mark.parametrize("name", COARSE)
def test_unfolding_on_coarse_and_rough_meshes(name: str) -> None:
    mesh = COARSE[name]
    for source in range(0, mesh.n_vertices, max(mesh.n_vertices // 30, 1)):
        found = geodesic_distance(mesh, source)
        assert (found <= heat_igl.reference.baselines.graph_distance(mesh, source) * (1 + 1e-9)).all()
        assert largest_error(found, exact(mesh, source)) < 0.003


def test_a_sweep_from_vertices_that_an_edge_joins() -> None:
    mesh = shapes.grid(40)
    for sources in ([820, 821, 861, 862], np.random.default_rng(3).choice(mesh.n_vertices, 300, replace=False)):
        found, truth = GeodesicSolver(mesh, method="sweep").distance(sources), straight(mesh, sources)
        assert mean_error(found, truth) < 0.01
