"""Log maps around many vertices: in the plane, along reversed paths, and against geodesics traced from the source."""

from __future__ import annotations

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, MeshError, SourceError, distances_within, log_maps_within, shapes, tangent_frames


def bumpy() -> Mesh:
    mesh = shapes.icosphere(2)
    return Mesh(mesh.V * np.random.default_rng(3).uniform(0.8, 1.2, (mesh.n_vertices, 1)), mesh.F)


def apart(angles: np.ndarray) -> np.ndarray:
    """How far angles are from a multiple of 2 pi."""
    return np.abs(angles - 2 * np.pi * np.rint(angles / (2 * np.pi)))


@pytest.mark.parametrize("make", [bumpy, lambda: shapes.grid(9)], ids=["bumpy", "grid"])
def test_pattern_and_distances_are_those_of_distances_within(make):
    mesh = make()
    sources = [5, 0, 17, 5]
    maps, expected = log_maps_within(mesh, 0.6, sources), distances_within(mesh, 0.6, sources)
    for found in (maps.distance, maps.departure, maps.arrival, maps.rotation):
        np.testing.assert_array_equal(found.indices, expected.indices)
        np.testing.assert_array_equal(found.indptr, expected.indptr)
    np.testing.assert_allclose(maps.distance.data, expected.data, rtol=1e-13)
    np.testing.assert_array_equal(maps.rows, expected.tocoo().row)
    assert (maps.departure.data >= 0).all()
    assert (maps.departure.data < 2 * np.pi).all()


def test_in_a_plane_vectors_are_differences_and_transport_keeps_them():
    mesh = shapes.grid(9)
    frames = tangent_frames(mesh)
    inside = np.flatnonzero(~mesh.boundary)
    maps = log_maps_within(mesh, 0.5, inside)
    source, vertex = inside[maps.rows], maps.distance.indices
    vectors = frames.to_world(frames.from_angles(maps.departure.data, maps.distance.data), source)
    np.testing.assert_allclose(vectors, mesh.V[vertex] - mesh.V[source], atol=1e-12)
    # Any vector at the source is the same vector in space at the vertex, on the boundary too.
    given = np.random.default_rng(0).uniform(0, 2 * np.pi, len(vertex))
    moved = frames.to_world(frames.from_angles(given + maps.rotation.data), vertex)
    np.testing.assert_allclose(moved, frames.to_world(frames.from_angles(given), source), atol=1e-12)
    off = source != vertex
    arrival = frames.to_world(frames.from_angles(maps.arrival.data), vertex)[off]
    np.testing.assert_allclose(maps.distance.data[off, None] * arrival, vectors[off], atol=1e-12)


def saddle() -> Mesh:
    """A torus without symmetry, at whose inner vertices paths bend."""
    mesh = shapes.torus(24, 16)
    return Mesh(mesh.V + np.random.default_rng(0).normal(scale=0.003, size=mesh.V.shape), mesh.F)


@pytest.mark.parametrize("make", [bumpy, saddle])
def test_the_path_back_is_the_same_path(make):
    mesh = make()
    maps = log_maps_within(mesh, np.inf)
    departure, arrival, rotation = (x.toarray() for x in (maps.departure, maps.arrival, maps.rotation))
    off = ~np.eye(mesh.n_vertices, dtype=bool)
    assert apart(arrival - departure.T - np.pi)[off].max() < 1e-9
    assert apart(rotation + rotation.T).max() < 1e-9


def test_geodesics_traced_from_the_source_arrive():
    mesh = bumpy()
    maps, frames = log_maps_within(mesh, 0.8, [31]), tangent_frames(mesh)
    vectors = frames.from_angles(maps.departure.data, maps.distance.data)
    ends = heat_igl.exp_map(mesh, 31, vectors).positions(mesh)
    off = np.linalg.norm(ends - mesh.V[maps.distance.indices], axis=1)
    # Paths that bend at a vertex are not straight.
    assert np.mean(off < 1e-9) > 0.8
    assert np.median(off) < 1e-12


def test_names_what_is_wrong():
    with pytest.raises(ValueError, match="radius must be a positive number, not 0"):
        log_maps_within(shapes.grid(2), 0)
    with pytest.raises(SourceError, match=r"sources\[0\] = 9 is no vertex"):
        log_maps_within(shapes.grid(2), 1, [9])
    book = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    with pytest.raises(MeshError, match="more than two faces"):
        log_maps_within(book, 1)
