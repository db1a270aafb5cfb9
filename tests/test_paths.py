"""Shortest paths: as long as exact distances, on the faces, between all kinds of places and sources."""

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed, zoo
from surfaces import assert_connected, moebius_strip, on, rough_field, rough_star, two_arms

import heat_igl
from heat_igl import Mesh, OffsetSources, SurfacePoints, isolines, shapes, shortest_paths
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.typing import FloatArray
from heat_igl.validation.zoo import FAMILIES
from heat_igl.windows import ExactSurface


def ends(mesh, paths):
    return np.array([path.positions(mesh)[[0, -1]] for path in paths]).transpose(1, 0, 2)


def test_a_path_to_a_curve_ends_on_it():
    mesh = flat_perturbed(shapes.grid(16))
    x = mesh.V[:, 0]
    (curve,) = isolines(mesh, x, 0.43)[0]
    targets = np.flatnonzero(np.abs(x - 0.43) > 0.15)
    paths = shortest_paths(mesh, targets, curve)
    np.testing.assert_allclose(ends(mesh, paths)[1][:, 0], 0.43, rtol=1e-12)
    np.testing.assert_allclose([path.length for path in paths], np.abs(x - 0.43)[targets], rtol=1e-12)


def over_a_line(start, end):
    """Length of the shortest path between two pages on the z axis, by way of a point of it from 0 to 1."""
    r, s = np.hypot(start[..., 0], start[..., 1]), np.hypot(end[..., 0], end[..., 1])
    z = np.clip(start[..., 2] + (end[..., 2] - start[..., 2]) * r / (r + s), 0, 1)
    return np.hypot(r, start[..., 2] - z) + np.hypot(s, end[..., 2] - z)


def test_a_fan_of_triangles_on_one_edge():
    # The first and the last lie lower and higher than their common edge: from there it is passed at its ends.
    angle, height = 2 * np.pi * np.arange(5) / 5, np.array([-0.5, 0.1, 0.5, 0.8, 1.7])
    tips = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    fan = Mesh(np.concatenate([[[0, 0, 0], [0, 0, 1]], tips]), [[0, 1, tip] for tip in range(2, 7)])
    for source in range(2, 7):
        targets = np.setdiff1d(np.arange(2, 7), source)
        expected = over_a_line(fan.V[targets], fan.V[source])
        np.testing.assert_allclose([path.length for path in shortest_paths(fan, targets, source)], expected, rtol=1e-12)


def test_through_a_single_vertex():
    one = shapes.grid(3)
    shifted = one.V + np.array([1, 1, 0])
    pinched = Mesh(np.concatenate([one.V, shifted[1:]]), np.concatenate([one.F, np.where(one.F == 0, 15, one.F + 15)]))
    np.testing.assert_array_equal(pinched.V[15], [1, 1, 0])
    (path,) = shortest_paths(pinched, pinched.n_vertices - 1, 0)
    assert path.length == pytest.approx(np.linalg.norm([2, 2]), rel=1e-12)
    np.testing.assert_array_equal(path.positions(pinched)[-1], [0, 0, 0])
    assert (np.abs(path.positions(pinched) - [1, 1, 0]).sum(axis=1) < 1e-12).any()


def test_a_triangle_without_area_is_crossed():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.4, 0]])
    mesh = Mesh(V, [[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]])
    assert mesh.measures.min() < 1e-15
    rng = np.random.default_rng(0)
    targets = SurfacePoints(np.zeros(50, int), rng.dirichlet([1, 1, 1], 50))
    paths = shortest_paths(mesh, targets, 3)
    expected = np.linalg.norm(targets.positions(mesh) - V[3], axis=1)
    np.testing.assert_allclose([path.length for path in paths], expected, rtol=1e-6)  # it is given a height of 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_paths_lead_through_vertices_in_one_place_and_needles(seed):
    rng = np.random.default_rng(seed)
    mesh = perturbed(shapes.icosphere(2), 0.5, seed)
    V = mesh.V.copy()
    for a, b, _ in mesh.F[rng.integers(mesh.n_faces, size=4)]:
        V[a] = V[b] if seed % 2 else V[b] + rng.normal(size=3) * 10.0 ** -rng.integers(4, 14)
    broken = Mesh(V, mesh.F)
    distance = heat_igl.geodesic_distance(broken, 0, method="exact")
    paths = shortest_paths(broken, np.arange(mesh.n_vertices), 0)
    assert_connected(broken, *paths)
    np.testing.assert_allclose([path.length for path in paths], distance, rtol=1e-5, atol=1e-9)


# --- All kinds of surfaces, places and sources


def terrain(n: int) -> Mesh:
    """A square of heights that are random from vertex to vertex, most of them steep."""
    mesh = shapes.grid(n)
    heights = np.random.default_rng(2).normal(size=mesh.n_vertices) * 4 / n
    return Mesh(np.column_stack([mesh.V[:, :2], heights]), mesh.F)


MESHES = {
    "terrain": lambda: terrain(18),
    "rough sphere": lambda: perturbed(shapes.icosphere(3), 0.8, 1),
    "rough grid": lambda: perturbed(shapes.grid(20), 0.8, 2),
    "flat grid": lambda: shapes.grid(20),
    "torus": lambda: shapes.torus(30, 20),
    "two arms": lambda: two_arms(8),
    "moebius": lambda: moebius_strip(30, 4),
    "ribbon": lambda: FAMILIES["ribbon"](700024),
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
    # A search for one target alone ends before it knows the distances of vertices that lie farther.
    for i in range(0, len(paths), 17):
        one = (
            int(targets[i])
            if isinstance(targets, np.ndarray)
            else SurfacePoints(targets.faces[[i]], targets.barycentric[[i]])
        )
        paths[i] = shortest_paths(mesh, one, sources)[0]
    np.testing.assert_allclose([path.length for path in paths], distance, rtol=1e-12, atol=1e-14)
    assert_connected(mesh, *paths)
    for path in paths:
        assert min(path.start.min(), path.end.min()) >= 0


@pytest.mark.parametrize("name", MESHES)
def test_paths_are_as_long_as_the_exact_distance(name):
    mesh = MESHES[name]()
    surface = ExactSurface(intrinsic_triangulation(mesh))
    used = np.unique(mesh.F)
    targets = places(mesh, 40)
    for source in np.random.default_rng(0).choice(used, 2, replace=False):
        found = surface.solve(on(mesh, source), targets=targets)
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
    begins, targets = np.array([0.0, 0.05, 0.1, 0.02]), places(mesh, 20)
    surface = ExactSurface(intrinsic_triangulation(mesh))
    positions = np.concatenate([mesh.V[vertices], points.positions(mesh)])
    sources = [OffsetSources(vertices.tolist(), begins[:2]), OffsetSources(points, begins[2:])]
    found = surface.solve(on(mesh, sources), targets=targets)
    for to, distance in ((used, found.distance[used]), (targets, found.target_distance)):
        paths = shortest_paths(mesh, to, sources)
        end = ends(mesh, paths)[1]
        label = np.linalg.norm(end[:, None] - positions, axis=2).argmin(axis=1)
        np.testing.assert_allclose(end, positions[label], atol=1e-12)
        np.testing.assert_allclose([path.length for path in paths], distance - begins[label], rtol=1e-12, atol=1e-13)
        if to is used:
            np.testing.assert_array_equal(label, found.origin.label[used])


@pytest.mark.parametrize("name", ["voxel blob", "book", "slotted plate", "dust"])
def test_edges_of_many_faces_flat_parts_and_pieces(name):
    mesh = zoo(name)
    source = int(mesh.F[0, 0])
    distance = ExactSurface(intrinsic_triangulation(mesh)).solve(on(mesh, source)).distance
    targets = np.flatnonzero(np.isfinite(distance))[::5]
    assert_exact(mesh, targets, source, distance[targets])


def test_a_path_from_a_source_stays_there():
    mesh = flat_perturbed(shapes.grid(6))
    inside = SurfacePoints([20], [[0.2, 0.5, 0.3]])
    for source in (7, inside):
        (path,) = shortest_paths(mesh, source, source)
        assert len(path) == 1
        assert path.lengths(mesh)[0] == 0
