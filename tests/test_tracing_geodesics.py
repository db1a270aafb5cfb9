"""Straightest geodesics and the exponential map."""

import numpy as np
import pytest

from heat_igl import Mesh, SurfacePoints, exp_map, shapes, tangent_frames, trace_geodesic


def random_starts(mesh: Mesh, k: int, seed: int = 0) -> tuple[SurfacePoints, np.ndarray]:
    """Points in faces, and vectors in the planes of these."""
    rng = np.random.default_rng(seed)
    faces = rng.integers(0, mesh.n_faces, k)
    sides = mesh.V[mesh.F[faces, 1:]] - mesh.V[mesh.F[faces, :1]]
    vectors = np.einsum("ks,ksx->kx", rng.standard_normal((k, 2)), sides)
    return SurfacePoints(faces, rng.dirichlet([1, 1, 1], k)), vectors / np.linalg.norm(vectors, axis=1)[:, None]


@pytest.mark.parametrize("length", [30, 400])
def test_lines_through_vertices_and_along_the_boundary_stay_straight(length):
    mesh = shapes.strip(length, 3)
    for source in (0, length + 3, length // 2):
        ends = exp_map(mesh, source, mesh.V - mesh.V[source]).positions(mesh)
        np.testing.assert_allclose(ends, mesh.V, atol=1e-8)


def test_geodesics_on_a_cylinder_are_those_of_the_unrolled_plane():
    around, along = 24, 20
    mesh = shapes.cylinder(around, along, 4.0)
    side = 2 * np.sin(np.pi / around)
    first, turns, height = 9 * around, 1.5, 1.1
    face = next(f for f in np.flatnonzero((first == mesh.F).any(axis=1)) if {first, first + 1} <= {*mesh.F[f]})
    start = SurfacePoints([face], [mesh.F[face] == first])
    direction = turns * around * (mesh.V[first + 1] - mesh.V[first]) + [0, 0, height]
    curve = trace_geodesic(mesh, start, direction, float(np.hypot(turns * around * side, height)))
    expected = [-1, 0, 9 * 0.2 + height]
    np.testing.assert_allclose(curve.positions(mesh)[-1], expected, atol=1e-12)


def test_curves_are_connected_and_have_the_length_asked_for(sphere):
    start, vectors = random_starts(sphere, 20)
    for i in range(20):
        point = SurfacePoints(start.faces[i : i + 1], start.barycentric[i : i + 1])
        curve = trace_geodesic(sphere, point, vectors[i], 2.5)
        begin, end = (
            np.einsum("sc,scx->sx", ends, sphere.V[sphere.F[curve.faces]]) for ends in (curve.start, curve.end)
        )
        np.testing.assert_allclose(begin[1:], end[:-1], atol=1e-12)
        np.testing.assert_allclose(begin[0], point.positions(sphere)[0], atol=1e-13)
        assert curve.lengths(sphere).sum() == pytest.approx(2.5, abs=1e-11)
        # The angle between segments and each edge crossed is the same on both sides.
        for s in range(len(curve) - 1):
            edge = np.intersect1d(*sphere.F[curve.faces[s : s + 2]])
            assert len(edge) == 2
            along = sphere.V[edge[1]] - sphere.V[edge[0]]
            before, after = ((end - begin)[t] / np.linalg.norm((end - begin)[t]) for t in (s, s + 1))
            assert (before - after) @ along == pytest.approx(0, abs=1e-9)


def test_geodesics_on_spheres_approach_great_circles():
    errors = []
    for level in (3, 5):
        mesh = shapes.icosphere(level)
        frames = tangent_frames(mesh)
        rng = np.random.default_rng(0)
        source = rng.integers(0, mesh.n_vertices, 200)
        x = frames.to_world(frames.from_angles(rng.uniform(0, 2 * np.pi, 200)), source)
        ends = exp_map(mesh, source, 1.2 * x).positions(mesh)
        expected = np.cos(1.2) * mesh.V[source] + np.sin(1.2) * x
        errors.append(np.linalg.norm(ends - expected, axis=1).mean())
    assert errors[1] < 0.3 * errors[0] < 0.02


def test_equal_angles_on_both_sides_of_a_vertex():
    mesh = shapes.cone(10, 4)
    ring = 1 + 2 * 10
    for k in range(10):
        face = int(np.flatnonzero((ring + k == mesh.F).any(axis=1) & (ring + k - 10 == mesh.F).any(axis=1))[0])
        start = SurfacePoints([face], [mesh.F[face] == ring + k])
        curve = trace_geodesic(mesh, start, -mesh.V[ring + k], 1.5)
        np.testing.assert_allclose(curve.positions(mesh)[-1], mesh.V[ring + (k + 5) % 10], atol=1e-9)


def test_geodesics_end_on_the_boundary():
    mesh = shapes.grid(4)
    curve = trace_geodesic(mesh, 12, [1.0, 0.3, 0], 5.0)
    np.testing.assert_allclose(curve.positions(mesh)[-1], [1, 0.65, 0], atol=1e-13)
    off = trace_geodesic(mesh, 2, [0.2, -1, 0], 1.0)
    assert len(off) == 1
    assert off.lengths(mesh).sum() == 0
    corner = trace_geodesic(mesh, 12, [1, 1, 0], 5.0)
    np.testing.assert_allclose(corner.positions(mesh)[-1], [1, 1, 0], atol=1e-13)


@pytest.mark.parametrize("share", [1e-4, 1e-8, 1e-12])
def test_lines_along_the_boundary_end_at_its_vertices(share):
    """From beside a vertex to the next one: what they meet first is the vertex, not the side that they graze."""
    mesh = shapes.grid(6)
    mesh = Mesh(mesh.V * [1, 3, 0], mesh.F)
    for face in np.flatnonzero(mesh.boundary[mesh.F].sum(axis=1) == 2):
        corner = np.argsort(~mesh.boundary[mesh.F[face]], kind="stable")
        first, following, inside = mesh.F[face, corner]
        weights = np.zeros((1, 3))
        weights[0, corner] = 1 - share, 0.3 * share, 0.7 * share
        vector = (1 - 0.3 * share) * (mesh.V[following] - mesh.V[first]) - 0.7 * share * (
            mesh.V[inside] - mesh.V[first]
        )
        end = exp_map(mesh, SurfacePoints([face], weights), [vector]).positions(mesh)[0]
        np.testing.assert_allclose(end, mesh.V[following], atol=1e-12)


def test_lines_pass_a_corner_that_they_touch():
    """A line along one side of an L-shaped domain goes on across the domain."""
    grid = shapes.grid(2)
    mesh = Mesh(grid.V, grid.F[(grid.V[grid.F].mean(axis=1)[:, :2] < 0.5).any(axis=1)])
    curve = trace_geodesic(mesh, 5, [-1, 0, 0], 0.9)
    np.testing.assert_allclose(curve.positions(mesh)[-1], [0.1, 0.5, 0], atol=1e-13)


def test_batches_give_the_bits_of_single_geodesics(sphere, monkeypatch):
    rng = np.random.default_rng(1)
    source, vectors = rng.integers(0, sphere.n_vertices, 1000), rng.standard_normal((1000, 2))
    many = exp_map(sphere, source, vectors)
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", "1")
    again = exp_map(sphere, source, vectors)
    np.testing.assert_array_equal(many.faces, again.faces)
    np.testing.assert_array_equal(many.barycentric, again.barycentric)
    for i in range(5):
        one = trace_geodesic(sphere, int(source[i]), vectors[i], float(np.hypot(*vectors[i])))
        np.testing.assert_allclose(one.positions(sphere)[-1], many.positions(sphere)[i], atol=1e-13)
