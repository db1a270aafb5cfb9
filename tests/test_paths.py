"""Shortest paths: as long as exact distances, on the faces, and from anywhere to a source."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed, wheel_path

import heat_igl
from heat_igl import (
    Mesh,
    MeshError,
    OffsetSources,
    SourceError,
    SurfaceCurve,
    SurfacePoints,
    isolines,
    reference,
    shapes,
    shortest_paths,
)


def lengths(mesh, paths):
    return np.array([path.lengths(mesh).sum() for path in paths])


def ends(mesh, paths):
    return np.array([path.positions(mesh)[[0, -1]] for path in paths]).transpose(1, 0, 2)


def assert_on_surface(mesh, paths):
    """Each segment begins where the one before it ends."""
    for path in paths:
        starts = np.einsum("kc,kcx->kx", path.start, mesh.V[mesh.F[path.faces]])
        np.testing.assert_allclose(starts, path.positions(mesh)[:-1], atol=1e-12 * np.ptp(mesh.V))


def turns(mesh, path):
    """By how much the path turns where it crosses an edge, both faces laid out in one plane; none in vertices."""
    P = path.positions(mesh)
    found = []
    for i in range(1, len(path)):
        f, g = path.faces[i - 1], path.faces[i]
        shared = np.intersect1d(mesh.F[f], mesh.F[g])
        if len(shared) != 2 or path.end[i - 1].max() > 1 - 1e-6:
            continue
        axis = mesh.V[shared[1]] - mesh.V[shared[0]]
        axis /= np.linalg.norm(axis)
        angle = []
        for a, b in ((P[i - 1], P[i]), (P[i], P[i + 1])):
            along = (b - a) @ axis
            angle.append(np.arctan2(np.linalg.norm(b - a - along * axis), along))
        found.append(angle[1] - angle[0])
    return np.array(found)


@lru_cache
def sample(name):
    """A mesh of the pymeshlab wheel, a source, its exact distances, and targets."""
    pytest.importorskip("pygeodesic")
    mesh = heat_igl.read_mesh(wheel_path(name))
    rng = np.random.default_rng(0)
    usable = np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[mesh.F[0, 0]]))
    source, *targets = rng.choice(usable, 201, replace=False)
    return mesh, int(source), reference.exact(mesh, int(source)), np.array(targets)


@pytest.mark.parametrize("name", ["cow.obj", "bunny.obj"])
def test_lengths_agree_with_exact(name):
    mesh, source, exact, targets = sample(name)
    paths = shortest_paths(mesh, targets, source)
    np.testing.assert_allclose(lengths(mesh, paths), exact[targets], rtol=1e-9)
    first, last = ends(mesh, paths)
    np.testing.assert_array_equal(first, mesh.V[targets])
    np.testing.assert_array_equal(last, np.broadcast_to(mesh.V[source], last.shape))
    assert_on_surface(mesh, paths)
    # Straight over every edge.
    assert max(np.abs(turns(mesh, path)).max(initial=0) for path in paths) < 1e-5


def test_paths_on_a_plane_are_straight_lines():
    mesh = flat_perturbed(shapes.disk(12))
    distance = np.linalg.norm(mesh.V - mesh.V[7], axis=1)
    paths = shortest_paths(mesh, np.arange(mesh.n_vertices), 7)
    np.testing.assert_allclose(lengths(mesh, paths), distance, rtol=1e-12)


@pytest.mark.parametrize("place", ["inside", "on a side", "at a corner"])
def test_points_in_faces_at_both_ends(place):
    mesh = flat_perturbed(shapes.disk(8))
    rng = np.random.default_rng(1)
    weights = rng.dirichlet([1, 1, 1], 60)
    weights[0::3, 1] = 0
    weights[1::6, :2] = 0
    targets = SurfacePoints(rng.integers(mesh.n_faces, size=60), weights / weights.sum(axis=1, keepdims=True))
    for seed in range(5):
        weight = {"inside": [0.2, 0.5, 0.3], "on a side": [0.6, 0, 0.4], "at a corner": [0, 1, 0]}[place]
        source = SurfacePoints([17 * seed], [weight])
        at = source.positions(mesh)[0]
        paths = shortest_paths(mesh, targets, source)
        expected = np.linalg.norm(targets.positions(mesh) - at, axis=1)
        np.testing.assert_allclose(lengths(mesh, paths), expected, atol=1e-12)
        first, last = ends(mesh, paths)
        np.testing.assert_allclose(first, targets.positions(mesh), atol=1e-12)
        np.testing.assert_allclose(last, np.broadcast_to(at, last.shape), atol=1e-12)


def test_of_two_points_in_faces_the_nearer_is_reached():
    mesh = flat_perturbed(shapes.grid(10))
    sources = SurfacePoints([20, 150], [[0.3, 0.3, 0.4], [0.3, 0.3, 0.4]])
    apart = np.linalg.norm(mesh.V[:, None] - sources.positions(mesh), axis=2)
    paths = shortest_paths(mesh, np.arange(mesh.n_vertices), sources)
    found = lengths(mesh, paths)
    away = np.abs(apart[:, 0] - apart[:, 1]) > 0.1
    np.testing.assert_allclose(found[away], apart.min(axis=1)[away], rtol=1e-12)
    last = ends(mesh, paths)[1]
    assert (np.linalg.norm(last[:, None] - sources.positions(mesh), axis=2).min(axis=1) < 1e-12).all()


@pytest.mark.parametrize(("offset", "n_reached"), [(0.1, 2), (0.4, 1)])
def test_an_offset_decides_which_source_is_reached(offset, n_reached):
    mesh = flat_perturbed(shapes.grid(10))
    points = SurfacePoints([90, 93], [[0.3, 0.3, 0.4], [0.3, 0.3, 0.4]])
    begins = np.array([0.0, offset])  # 0.3 apart: with 0.4, the second is nowhere the nearest
    distance = np.linalg.norm(mesh.V[:, None] - points.positions(mesh), axis=2) + begins
    targets = np.flatnonzero(np.abs(distance[:, 0] - distance[:, 1]) > 0.05)
    paths = shortest_paths(mesh, targets, OffsetSources(points, begins))
    reached = points.positions(mesh)[distance[targets].argmin(axis=1)]
    assert len(np.unique(reached[:, 0])) == n_reached
    np.testing.assert_allclose(ends(mesh, paths)[1], reached, atol=1e-12)


def test_a_path_to_a_curve_ends_on_it():
    mesh = flat_perturbed(shapes.grid(16))
    x = mesh.V[:, 0]
    (curve,) = isolines(mesh, x, 0.43)[0]
    targets = np.flatnonzero(np.abs(x - 0.43) > 0.15)
    paths = shortest_paths(mesh, targets, curve)
    np.testing.assert_allclose(ends(mesh, paths)[1][:, 0], 0.43, rtol=1e-12)
    np.testing.assert_allclose(lengths(mesh, paths), np.abs(x - 0.43)[targets], rtol=1e-12)


def test_paths_along_edges_and_through_vertices():
    mesh = shapes.grid(6)
    distance = np.hypot(mesh.V[:, 0], mesh.V[:, 1])
    corners = [6, 42, 48]  # at the end of two sides of the square, and of its diagonal
    assert set(np.round(distance[corners], 12)) <= {1.0, np.round(np.sqrt(2), 12)}
    paths = shortest_paths(mesh, corners, 0)
    np.testing.assert_allclose(lengths(mesh, paths), distance[corners], rtol=1e-14)


def test_around_a_reentrant_corner():
    square = shapes.grid(8)
    centre = square.V[square.F].mean(axis=1)
    L = Mesh(square.V, square.F[(centre[:, 0] < 0.5) | (centre[:, 1] < 0.5)])
    source, target = (int(np.argmin(np.linalg.norm(L.V - p, axis=1))) for p in ([1, 0.25, 0], [0.25, 1, 0]))
    expected = 2 * np.hypot(0.5, 0.25)
    (path,) = shortest_paths(L, target, source)
    assert path.lengths(L).sum() == pytest.approx(expected, rel=1e-12)
    assert np.abs(path.positions(L) - [0.5, 0.5, 0]).sum(axis=1).min() < 1e-12


def test_faces_need_not_agree_about_the_outside():
    mesh, source, exact, targets = sample("cow.obj")
    turned = np.random.default_rng(0).random(mesh.n_faces) < 0.5
    mixed = Mesh(mesh.V, np.where(turned[:, None], mesh.F[:, ::-1], mesh.F))
    found = lengths(mixed, shortest_paths(mixed, targets, source))
    np.testing.assert_allclose(found, exact[targets], rtol=1e-9)


def over_a_line(start, end):
    """Length of the shortest path between two pages on the z axis, by way of a point of it from 0 to 1."""
    r, s = np.hypot(start[..., 0], start[..., 1]), np.hypot(end[..., 0], end[..., 1])
    z = np.clip(start[..., 2] + (end[..., 2] - start[..., 2]) * r / (r + s), 0, 1)
    return np.hypot(r, start[..., 2] - z) + np.hypot(s, end[..., 2] - z)


def test_pages_unfold_two_by_two():
    # Any two are a flat convex domain.
    regular = shapes.book(5, 6)
    rng = np.random.default_rng(0)
    r = np.hypot(*regular.V[:, :2].T)
    inner = ~regular.boundary
    page = np.where(r > 0, np.round(np.arctan2(regular.V[:, 1], regular.V[:, 0]) / (0.4 * np.pi)) % 5, -1)
    V = regular.V * np.where(inner, rng.uniform(0.98, 1.02, len(r)), 1)[:, None] ** [1, 1, 0]
    V[inner, 2] += rng.uniform(-0.05, 0.05, inner.sum())
    book = Mesh(V, regular.F)
    r, z = np.hypot(*V[:, :2].T), V[:, 2]
    for source in (3, 10, 20, 100, 200):
        paths = shortest_paths(book, np.arange(len(V)), source)
        same = (page == page[source]) | (page < 0) | (page[source] < 0)
        expected = np.where(same, np.hypot(r - r[source], z - z[source]), np.hypot(r + r[source], z - z[source]))
        np.testing.assert_allclose(lengths(book, paths), expected, rtol=1e-12, atol=1e-15)
        assert max(np.abs(turns(book, path)).max(initial=0) for path in paths) < 1e-6


def test_a_fan_of_triangles_on_one_edge():
    # The first and the last lie lower and higher than their common edge: from there it is passed at its ends.
    angle, height = 2 * np.pi * np.arange(5) / 5, np.array([-0.5, 0.1, 0.5, 0.8, 1.7])
    tips = np.stack([np.cos(angle), np.sin(angle), height], axis=1)
    fan = Mesh(np.concatenate([[[0, 0, 0], [0, 0, 1]], tips]), [[0, 1, tip] for tip in range(2, 7)])
    for source in range(2, 7):
        targets = np.setdiff1d(np.arange(2, 7), source)
        expected = over_a_line(fan.V[targets], fan.V[source])
        np.testing.assert_allclose(lengths(fan, shortest_paths(fan, targets, source)), expected, rtol=1e-12)


def test_through_a_single_vertex():
    one = shapes.grid(3)
    shifted = one.V + np.array([1, 1, 0])
    pinched = Mesh(np.concatenate([one.V, shifted[1:]]), np.concatenate([one.F, np.where(one.F == 0, 15, one.F + 15)]))
    np.testing.assert_array_equal(pinched.V[15], [1, 1, 0])
    (path,) = shortest_paths(pinched, pinched.n_vertices - 1, 0)
    assert path.lengths(pinched).sum() == pytest.approx(np.linalg.norm([2, 2]), rel=1e-12)
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
    np.testing.assert_allclose(lengths(mesh, paths), expected, rtol=1e-6)  # it is given a height of 1e-6


def test_vertices_in_one_place_are_passed():
    mesh = shapes.grid(8)
    V = mesh.V.copy()
    V[40] = V[41]  # an edge of no length
    collapsed = Mesh(V, mesh.F)
    straight = np.hypot(V[:, 0], V[:, 1])
    paths = shortest_paths(collapsed, np.arange(mesh.n_vertices), 0)
    # Which side of both to pass, their angles do not tell, so the path may keep a bend there.
    excess = lengths(collapsed, paths) - straight
    assert excess.min() > -1e-12
    assert excess.max() < mesh.edge_lengths.mean()
    np.testing.assert_array_equal(ends(collapsed, paths)[1], 0)


def test_the_path_of_a_source_has_length_zero():
    mesh = shapes.icosphere(2)
    paths = shortest_paths(mesh, [40, 3, 40], [3, 40])
    assert [len(path) for path in paths] == [1, 1, 1]
    np.testing.assert_array_equal(lengths(mesh, paths), 0)
    np.testing.assert_array_equal(ends(mesh, paths)[0], mesh.V[[40, 3, 40]])


def two_spheres():
    one = shapes.icosphere(1)
    return Mesh(np.concatenate([one.V, one.V + 5]), np.concatenate([one.F, one.F + one.n_vertices]))


@pytest.mark.parametrize(
    ("targets", "sources", "message"),
    [
        ([1, 50], 0, r"from targets\[1\] no source can be reached \(1 of 2"),
        (99, 0, "is no vertex"),
        (1, 99, "is no vertex"),
        (SurfacePoints([500], [[1, 0, 0]]), 0, r"faces\[0\] = 500 is no face"),
        (1, SurfacePoints([500], [[1, 0, 0]]), r"faces\[0\] = 500 is no face"),
        (1, SurfaceCurve([500], [[1, 0, 0]], [[0, 1, 0]]), r"faces\[0\] = 500 is no face"),
    ],
)
def test_wrong_ends_are_refused(targets, sources, message):
    mesh = two_spheres()
    with pytest.raises(SourceError, match=message):
        shortest_paths(mesh, targets, sources)


def test_what_has_no_paths_is_refused():
    mesh = shapes.grid(2)
    loose = Mesh(np.concatenate([mesh.V, [[5, 5, 5]]]), mesh.F)
    with pytest.raises(SourceError, match=r"targets\[0\] = 9 is a vertex that no face uses"):
        shortest_paths(loose, 9, 0)
    with pytest.raises(MeshError, match="paths need triangles"):
        shortest_paths(shapes.box(1), 1, 0)


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
    assert_on_surface(broken, paths)
    np.testing.assert_allclose(lengths(broken, paths), distance, rtol=1e-5, atol=1e-9)


def test_the_command_line_writes_a_path(tmp_path):
    pytest.importorskip("typer")
    mesh = shapes.grid(6)
    heat_igl.write_mesh(tmp_path / "square.off", mesh)
    command = [sys.executable, "-m", "heat_igl", "path", "square.off"]
    environment = {**os.environ, "PYTHONPATH": str(Path(heat_igl.__file__).parents[1])}
    run = {"cwd": tmp_path, "env": environment, "capture_output": True, "text": True, "check": False}
    done = subprocess.run([*command, "--from", "0", "--to", "40", "--output", "path.obj"], **run)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(f"length +{np.linalg.norm(mesh.V[40] - mesh.V[0]):.6g}", done.stdout)
    lines = (tmp_path / "path.obj").read_text().splitlines()
    V = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
    np.testing.assert_allclose(V[[0, -1]], mesh.V[[0, 40]])
    done = subprocess.run([*command, "--from", "0", "--to", "49", "--output", "other.obj"], **run)
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1
    assert "49" in done.stderr
    assert not (tmp_path / "other.obj").exists()
