"""Exact shortest paths: as long as the exact distance, on the faces, between all kinds of places and sources."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed, zoo
from surfaces import moebius_strip, rough_field, rough_star, two_arms
from test_paths import assert_on_surface, ends, lengths, turns

from heat_igl import (
    Mesh,
    OffsetSources,
    SurfacePoints,
    shapes,
    shortest_paths,
)
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.typing import FloatArray
from heat_igl.windows import ExactSurface


def terrain(n: int) -> Mesh:
    """A square of heights that are random from vertex to vertex, most of them steep."""
    mesh = shapes.grid(n)
    heights = np.random.default_rng(2).normal(size=mesh.n_vertices) * 4 / n
    return Mesh(np.column_stack([mesh.V[:, :2], heights]), mesh.F)


MESHES = {
    "terrain": lambda: terrain(25),
    "rough sphere": lambda: perturbed(shapes.icosphere(4), 0.8, 1),
    "rough grid": lambda: perturbed(shapes.grid(30), 0.8, 2),
    "flat grid": lambda: shapes.grid(20),
    "torus": lambda: shapes.torus(30, 20),
    "two arms": lambda: two_arms(8),
    "moebius": lambda: moebius_strip(30, 4),
    "book": lambda: shapes.book(4, 6),
    **{f"star {seed}": lambda seed=seed: rough_star(seed) for seed in range(4)},
    **{f"field {seed}": lambda seed=seed: rough_field(seed) for seed in range(4)},
}


def places(mesh: Mesh, k: int) -> SurfacePoints:
    """Points inside faces, on sides and at corners."""
    rng = np.random.default_rng(4)
    weights = rng.dirichlet([1, 1, 1], 3 * k)
    weights[:k, 1] = 0
    weights[k : k + k // 2, :2] = 0
    return SurfacePoints(rng.integers(mesh.n_faces, size=3 * k), weights / weights.sum(axis=1, keepdims=True))


def assert_exact(mesh: Mesh, targets, sources, distance: FloatArray) -> None:
    paths = shortest_paths(mesh, targets, sources)
    np.testing.assert_allclose(lengths(mesh, paths), distance, rtol=1e-12, atol=1e-14)
    assert_on_surface(mesh, paths)
    for path in paths:
        assert min(path.start.min(), path.end.min()) >= 0


@pytest.mark.parametrize("name", MESHES)
def test_paths_are_as_long_as_the_exact_distance(name):
    mesh = MESHES[name]()
    surface = ExactSurface(intrinsic_triangulation(mesh))
    used = np.unique(mesh.F)
    targets = places(mesh, 40)
    for source in np.random.default_rng(0).choice(used, 2, replace=False):
        found = surface.solve(np.array([source]), targets=targets)
        assert_exact(mesh, used, int(source), found.distance[used])
        assert_exact(mesh, targets, int(source), found.target_distance)


@pytest.mark.parametrize("name", ["rough sphere", "two arms", "book", "star 1"])
def test_paths_to_many_sources_end_at_the_nearest(name):
    mesh = MESHES[name]()
    used = np.unique(mesh.F)
    vertices, points = (
        used[[3, len(used) // 2]],
        SurfacePoints([0, mesh.n_faces // 3], [[0.2, 0.5, 0.3], [0.5, 0, 0.5]]),
    )
    begins = np.array([0.0, 0.05, 0.1, 0.02])
    found = ExactSurface(intrinsic_triangulation(mesh)).solve(vertices, begins[:2], points, begins[2:])
    at = np.concatenate([mesh.V[vertices], points.positions(mesh)])[found.origin.label[used]]
    sources = [OffsetSources(vertices.tolist(), begins[:2]), OffsetSources(points, begins[2:])]
    paths = shortest_paths(mesh, used, sources)
    np.testing.assert_allclose(
        lengths(mesh, paths), found.distance[used] - begins[found.origin.label[used]], rtol=1e-12, atol=1e-13
    )
    np.testing.assert_allclose(ends(mesh, paths)[1], at, atol=1e-12)


@pytest.mark.parametrize("name", ["voxel blob", "book", "slotted plate", "dust"])
def test_edges_of_many_faces_flat_parts_and_pieces(name):
    mesh = zoo(name)
    source = int(mesh.F[0, 0])
    distance = ExactSurface(intrinsic_triangulation(mesh)).solve(np.array([source])).distance
    targets = np.flatnonzero(np.isfinite(distance))[::5]
    assert_exact(mesh, targets, source, distance[targets])


def test_paths_are_straight_over_every_edge():
    mesh = MESHES["rough sphere"]()
    paths = shortest_paths(mesh, np.arange(0, mesh.n_vertices, 7), 0)
    assert max(np.abs(turns(mesh, path)).max(initial=0) for path in paths) < 1e-6


def test_a_path_from_a_source_stays_there():
    mesh = flat_perturbed(shapes.grid(6))
    inside = SurfacePoints([20], [[0.2, 0.5, 0.3]])
    for source in (7, inside):
        (path,) = shortest_paths(mesh, source, source)
        assert len(path) == 1
        assert path.lengths(mesh)[0] == 0
