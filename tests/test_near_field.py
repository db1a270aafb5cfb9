"""Straight lines around sources: all that is near and in sight, exactly, and nothing shorter than the shortest."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from conftest import perturbed
from scipy.spatial import Delaunay

from heat_igl import (
    GeodesicSolver,
    Mesh,
    SurfaceCurve,
    SurfacePoints,
    curve_on,
    isolines,
    reference,
    shapes,
)
from heat_igl.intrinsic import Adjacency, intrinsic_triangulation
from heat_igl.sources import NearField, Seeds, Sources, near_field, source_set, windows
from heat_igl.sources.own_faces import seen_from_points


def seeds(mesh: Mesh, sources: Sources, radius: float) -> Seeds:
    """Those within `radius`."""
    found = source_set(sources, mesh.n_vertices, mesh.F)
    return NearField(intrinsic_triangulation(mesh)).seeds(
        found.points.joined(found.segments.ends()), found.segments, radius
    )[0]


def sheared_grid() -> Mesh:
    """Flat and convex, but far from Delaunay, and with faces that run either way round."""
    mesh = perturbed(shapes.grid(16), 0.2)
    V = mesh.V * [1, 1, 0]
    V[:, 0] += 1.7 * V[:, 1]
    turned = np.random.default_rng(0).random(mesh.n_faces) < 0.5
    return Mesh(V, np.where(turned[:, None], mesh.F[:, ::-1], mesh.F))


def to_polyline(V: np.ndarray, corners: np.ndarray) -> np.ndarray:
    distance = np.full(len(V), np.inf)
    for a, b in itertools.pairwise(corners):
        along = b - a
        share = np.clip((V - a) @ along / (along @ along), 0, 1)
        distance = np.minimum(distance, np.linalg.norm(V - a - share[:, None] * along, axis=1))
    return distance


@pytest.mark.parametrize("barycentric", [(0.2, 0.5, 0.3), (0.3, 0.0, 0.7), (1e-9, 0.4, 0.6 - 1e-9)])
def test_all_that_is_near_a_point_in_the_plane(barycentric):
    mesh = sheared_grid()
    for face in (3, 201, 340):
        point = SurfacePoints([face], [barycentric])
        truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
        found = seeds(mesh, point, 0.4)
        assert np.isin(np.flatnonzero(truth < 0.4), found.vertex).all()
        np.testing.assert_allclose(found.value, truth[found.vertex], rtol=1e-12)


def test_all_that_is_near_a_curve_in_the_plane():
    """A polyline with corners on both sides, and one that begins and ends inside faces."""
    mesh = sheared_grid()
    corners = np.array([[0.5, 0.2, 0], [1.1, 0.33, 0], [1.0, 0.52, 0], [1.9, 0.8, 0]])
    truth = to_polyline(mesh.V, corners)
    found = seeds(mesh, curve_on(mesh, corners), 0.3)
    assert np.isin(np.flatnonzero(truth < 0.3), found.vertex).all()
    np.testing.assert_allclose(found.value, truth[found.vertex], atol=1e-12)


def test_a_single_segment():
    """Beside it distance is that to the line, beyond its ends that to the ends."""
    mesh = shapes.grid(8)
    start, end = np.array([[0.1, 0.2, 0.7]]), np.array([[0.6, 0.3, 0.1]])
    curve = SurfaceCurve([60], start, end)
    found = seeds(mesh, curve, 0.5)
    truth = to_polyline(mesh.V, curve.positions(mesh))
    assert np.isin(np.flatnonzero(truth < 0.5), found.vertex).all()
    np.testing.assert_allclose(found.value, truth[found.vertex], atol=1e-13)


def test_offsets_and_labels_of_several():
    mesh = sheared_grid()
    found = source_set(SurfacePoints([100, 140, 300], np.full((3, 3), 1 / 3)), mesh.n_vertices, mesh.F).points
    offset = np.array([0.0, 0.2, 0.05])
    points = type(found)(found.faces, found.barycentric, np.array([7, 3, 5]), offset)
    none = source_set(0, mesh.n_vertices, mesh.F).segments
    near = NearField(intrinsic_triangulation(mesh)).seeds(points, none, 0.5)[0]
    centres = mesh.V[mesh.F[points.faces]].mean(axis=1)
    each = np.linalg.norm(mesh.V[:, None] - centres, axis=2) + offset
    truth = each.min(axis=1)
    assert (near.value >= truth[near.vertex] * (1 - 1e-12)).all()
    # Beyond the radius of the earliest, a source that is nearer may not have been looked for.
    certain = near.value < 0.5
    assert np.isin(np.flatnonzero(truth < 0.5), near.vertex[certain]).all()
    np.testing.assert_allclose(near.value[certain], truth[near.vertex[certain]], rtol=1e-12)
    assert (near.label == np.array([7, 3, 5])[each.argmin(axis=1)][near.vertex])[certain].all()
    assert set(near.label) == {3, 5, 7}


def test_on_a_curved_surface():
    """Never below the exact distance, nearly everywhere equal to it, and straight to the corners of the face."""
    mesh = perturbed(shapes.icosphere(3), 0.4, 1)
    h = mesh.edge_lengths.mean()
    exact = sampled = 0
    for face in (5, 300, 801):
        point = SurfacePoints([face], [[0.25, 0.35, 0.4]])
        split = np.array([[a, b, mesh.n_vertices] for a, b in mesh.F[face][[[0, 1], [1, 2], [2, 0]]]])
        refined = Mesh(
            np.concatenate([mesh.V, point.positions(mesh)]), np.concatenate([np.delete(mesh.F, face, 0), split])
        )
        truth = reference.exact(refined, mesh.n_vertices)
        found = seeds(mesh, point, 4 * h)
        assert (found.value > truth[found.vertex] * (1 - 1e-12)).all()
        exact += (found.value < truth[found.vertex] * (1 + 1e-9)).sum()
        sampled += len(found.vertex)
        corner = np.isin(found.vertex, mesh.F[face])
        straight = np.linalg.norm(mesh.V[found.vertex[corner]] - point.positions(mesh), axis=1)
        np.testing.assert_allclose(found.value[corner], straight, rtol=1e-13)
        assert corner.sum() == 3
    assert sampled > 100
    assert exact > 0.95 * sampled


def test_far_corners_of_the_own_face():
    """A face longer than the radius: its corners are told apart, since another source may be nearer to them."""
    mesh = Mesh([[0, 0, 0], [10, 0, 0], [0, 0.5, 0], [10, 1, 0]], [[0, 1, 2], [1, 3, 2]])
    point = SurfacePoints([0], [[0.9, 0.05, 0.05]])
    found = source_set(point, 4, mesh.F)
    near, far = NearField(intrinsic_triangulation(mesh)).seeds(found.points, found.segments, 1.0)
    truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
    assert near.vertex.tolist() == [0, 2]
    assert far.vertex.tolist() == [1]
    np.testing.assert_allclose(near.value, truth[near.vertex], rtol=1e-14)
    np.testing.assert_allclose(far.value, truth[far.vertex], rtol=1e-14)


def test_a_way_around_is_not_taken_for_straight():
    """Over the top of a spike it is straight, around its foot it is shorter: such vertices are left out."""
    disk = shapes.disk(6)
    radius = np.linalg.norm(disk.V, axis=1)
    spike = Mesh(disk.V + np.where(radius < 1e-9, 3.0, 0.0)[:, None] * [0, 0, 1], disk.F)
    face = int(np.argmin(np.abs(np.linalg.norm(disk.V[disk.F].mean(axis=1), axis=1) - 0.12)))
    point = SurfacePoints([face], [[0.4, 0.3, 0.3]])
    found = seeds(spike, point, 10.0)
    graph = reference.exact(spike, int(spike.F[face, 0]))
    reach = np.linalg.norm(spike.V[spike.F[face, 0]] - point.positions(spike)[0])
    assert (found.value <= graph[found.vertex] + reach + 1e-12).all()


def test_curves_refuse_nothing_at_the_boundary():
    """A source on the boundary sees inwards only."""
    mesh = shapes.grid(5)
    side = int(np.flatnonzero((mesh.V[mesh.F][:, :, 0] == 0).sum(axis=1) == 2)[0])
    barycentric = np.where(mesh.V[mesh.F[side], 0] == 0, 0.5, 0.0)
    point = SurfacePoints([side], [barycentric])
    found = seeds(mesh, point, 3.0)
    assert len(found.vertex) == mesh.n_vertices
    np.testing.assert_allclose(found.value, np.linalg.norm(mesh.V - point.positions(mesh), axis=1), rtol=1e-12)


def test_dropped_lines_are_no_shortest_ones(monkeypatch):
    mesh = perturbed(shapes.icosphere(3), 0.4, 1)
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    wave = np.stack([np.cos(angle), np.sin(angle), 0.4 * np.sin(3 * angle)], axis=1)
    curve = curve_on(mesh, wave / np.linalg.norm(wave, axis=1)[:, None], closed=True)
    found = seeds(mesh, curve, 1.0)
    monkeypatch.setattr(windows, "_DETOUR", 1e9)
    every = seeds(mesh, curve, 1.0)
    exact = GeodesicSolver(mesh, method="exact").distance(curve)
    shortest = every.at(every.value < exact[every.vertex] * (1 + 1e-9))
    assert len(shortest.vertex) > 400
    value = np.full(mesh.n_vertices, np.nan)
    value[found.vertex] = found.value
    np.testing.assert_allclose(value[shortest.vertex], shortest.value, rtol=1e-12)


def test_joints_of_segments_count_once():
    mesh = shapes.icosphere(2)
    curve = isolines(mesh, mesh.V @ [0.2, 0.3, 0.9], 0.1)[0][0]
    ends = source_set(curve, mesh.n_vertices, mesh.F).segments.ends()
    assert len(ends.faces) == 2 * len(curve)
    corners = seen_from_points(ends, Adjacency(intrinsic_triangulation(mesh)))[1][0].vertex
    # All joints lie on edges: once in each of two faces, though two segments meet there.
    assert len(corners) == 2 * len(curve)


def random_boundary(seed: int, n: int) -> Mesh:
    """The boundary of a random half of the tetrahedra of a Delaunay triangulation: edges of up to a dozen faces."""
    rng = np.random.default_rng(seed)
    P = rng.random((n, 3))
    T = Delaunay(P).simplices
    T = T[rng.random(len(T)) < 0.5]
    sides = np.concatenate([np.delete(T, c, axis=1) for c in range(4)])
    F, count = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    used, F = np.unique(F[count == 1], return_inverse=True)
    return Mesh(P[used], F.reshape(-1, 3))


def test_work_at_edges_of_many_faces_is_bounded_and_what_is_found_is_complete(monkeypatch):
    mesh = random_boundary(0, 60)
    point = SurfacePoints([7], [[0.2, 0.3, 0.5]])
    found = source_set(point, mesh.n_vertices, mesh.F)
    field = NearField(intrinsic_triangulation(mesh))
    crossed = []
    cross = near_field.cross
    monkeypatch.setattr(near_field, "cross", lambda w, adjacency: crossed.append(len(w)) or cross(w, adjacency))
    values = []
    for most in (10**9, 2000):
        monkeypatch.setattr(near_field, "_MOST_WINDOWS", most)
        crossed.clear()
        near = field.seeds(found.points, found.segments, 0.6)[0]
        values.append(np.full(mesh.n_vertices, np.inf))
        values[-1][near.vertex] = near.value
    assert sum(crossed) <= 2000
    everything, bounded = values
    limit = bounded[np.isfinite(bounded)].max()
    assert np.isfinite(bounded).sum() > 3
    # Up to the farthest of what is found, nothing is missing and nothing is longer.
    np.testing.assert_array_equal(bounded[everything <= limit], everything[everything <= limit])
