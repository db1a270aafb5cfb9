"""Walks on a mesh that is asked once: as a solver finds them, and within a bound on the memory for each vertex."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import HeatMethodSolver, Mesh, Refinement, SurfacePoints, geodesic_distance, shapes, unfolded_distance
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.intrinsic.fans import tables
from heat_igl.kernels import bounds
from heat_igl.mesh import connectivity
from heat_igl.operators import operators, unfolding_surface
from heat_igl.unfolding.bounds import Bounds
from heat_igl.unfolding.glued import glued
from heat_igl.unfolding.single_query import single_query

NONE = np.zeros(0, np.int64)
SMOOTH = perturbed(shapes.torus(120, 48), 0.02, 3)
# Triangles so long that a quarter of the sides are flipped.
STRETCHED = Mesh(shapes.torus(120, 48).V * [1, 1, 0.4], shapes.torus(120, 48).F)


def beside(one: Mesh, other: Mesh) -> Mesh:
    """Two meshes as one, with a vertex in front that no face uses."""
    V = np.concatenate([[[9.0, 9.0, 9.0]], one.V, other.V])
    return Mesh(V, np.concatenate([one.F + 1, other.F + 1 + one.n_vertices]))


def at_edge(mesh: Mesh, d: np.ndarray) -> np.ndarray:
    """By how much distances differ along edges, as a share of the lengths of the edges."""
    with np.errstate(invalid="ignore"):
        return np.abs(d[mesh.edges[:, 0]] - d[mesh.edges[:, 1]]) / mesh.edge_lengths


@pytest.mark.parametrize(
    ("mesh", "sources"),
    [
        (SMOOTH, [7]),
        (STRETCHED, [0, 31]),
        (shapes.cone(60, 40), [3]),
        (beside(shapes.icosphere(4), shapes.blob(4)), [5, 2600]),
        (Mesh(SMOOTH.V * 1e-30, SMOOTH.F), [7]),
    ],
    ids=["torus", "stretched", "with a boundary", "two parts and an unused vertex", "tiny"],
)
def test_the_same_distances_as_on_a_triangulation_with_a_history(mesh: Mesh, sources: list[int]) -> None:
    query = single_query(mesh, np.array(sources))
    assert query is not None
    order = connectivity.edge_distance(mesh.edge_graph, np.array(sources))
    surface = unfolding_surface(mesh)
    expected = Refinement(surface.unfolding).unfold(order, np.array(sources))
    Bounds(surface).shorten(expected)
    found = query.distance()
    assert np.array_equal(np.isinf(found), np.isinf(expected))
    reached = np.isfinite(found)
    np.testing.assert_allclose(found[reached], expected[reached], rtol=1e-12)
    assert np.nanmax(at_edge(mesh, found)) < 1 + 1e-9


def test_faces_that_do_not_fit_together_are_left_to_others() -> None:
    assert single_query(shapes.book(3, 8), np.array([0])) is None
    turned = SMOOTH.F.copy()
    turned[5] = turned[5, ::-1]
    assert single_query(Mesh(SMOOTH.V, turned), np.array([0])) is None
    np.testing.assert_allclose(
        unfolded_distance(SMOOTH.V, turned, 0, tolerance=1e-5),
        unfolded_distance(SMOOTH.V, SMOOTH.F, 0, tolerance=1e-5),
        rtol=1e-9,
    )


def test_copies_of_faces_count_once() -> None:
    query = single_query(Mesh(SMOOTH.V, np.concatenate([SMOOTH.F, SMOOTH.F[::3, ::-1]])), np.array([7]))
    once = single_query(SMOOTH, np.array([7]))
    assert query is not None
    assert once is not None
    np.testing.assert_array_equal(query.distance(), once.distance())


@pytest.mark.parametrize(
    ("mesh", "sources"),
    [
        (beside(shapes.icosphere(3), shapes.blob(4)), [5]),
        (beside(shapes.icosphere(3), shapes.icosphere(3)), [5, 700]),
        (perturbed(shapes.icosphere(4), 0.3, 1), [5]),
    ],
    ids=["from a small part", "from two small parts", "on a rough surface"],
)
def test_windows_where_a_solver_takes_them(mesh: Mesh, sources: list[int]) -> None:
    query = single_query(mesh, np.array(sources))
    assert query is not None
    found, exact = query.distance(), geodesic_distance(mesh, sources, method="exact")
    np.testing.assert_allclose(found, exact, rtol=1e-12)


def test_a_query_is_asked_once_with_a_share() -> None:
    query = single_query(SMOOTH, np.array([0]))
    assert query is not None
    with pytest.raises(ValueError, match="tolerance must lie between 0 and 1, not 2"):
        query.distance(2)
    assert query.distance(0)[0] == 0
    with pytest.raises(ValueError, match="asked before"):
        query.distance()


@pytest.mark.parametrize("as_arrays", [True, False])
def test_memory_for_each_vertex(as_arrays: bool) -> None:
    # The tables of the walks are 973 bytes for each vertex, and what they are made from 108.
    V, F = shapes.icosphere(6).V.copy(), shapes.icosphere(6).F.copy()
    arguments = (V, F, 0) if as_arrays else (Mesh(V, F), 0)
    unfolded_distance(shapes.icosphere(3), 0, tolerance=1e-4)  # imports
    tracemalloc.start()
    try:
        unfolded_distance(*arguments)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 1150 * len(V)


def test_too_many_faces_for_indices_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("heat_igl.unfolding.glued.TOO_MANY", 3 * SMOOTH.n_faces + SMOOTH.n_vertices)
    with pytest.raises(Exception, match="11520 faces are too many for 32-bit indices: split the mesh"):
        glued(SMOOTH)


def test_edges_of_the_tables_and_edges_by_vertex() -> None:
    mesh = shapes.blob(3)
    found = glued(mesh)
    t = tables(found.vertex.reshape(-1, 3), found.length.reshape(-1, 3), found.twin, mesh.n_vertices)
    ends, length = bounds.spoke_edges(t.first, t.spoke)
    ascending = np.lexsort(ends.T[::-1])
    np.testing.assert_array_equal(ends[ascending], mesh.edges)
    np.testing.assert_allclose(np.ldexp(length, found.exponent)[ascending], mesh.edge_lengths)
    first, incident = bounds.incident_edges(ends, mesh.n_vertices)
    for v in range(mesh.n_vertices):
        at_v = incident[first[v] : first[v + 1]]
        np.testing.assert_array_equal(at_v, np.flatnonzero((ends == v).any(axis=1)))


def test_a_distance_that_an_edge_shortens_is_noticed() -> None:
    mesh = shapes.icosphere(3)
    d = geodesic_distance(mesh, 0, method="exact")
    edges = mesh.edges.astype(np.int32), mesh.edge_lengths
    assert not bounds.is_longer(*edges, d)
    d[77] += 2 * mesh.edge_lengths.max()
    assert bounds.is_longer(*edges, d)
    d[:] = np.inf
    assert not bounds.is_longer(*edges, d)


def test_edges_of_a_triangulation_each_once() -> None:
    book = intrinsic_triangulation(shapes.book(3, 4))
    ends, length = bounds.glued_edges(book.F, book.l.ravel(), book.twin)
    half_edges = book.edges
    np.testing.assert_array_equal(ends, np.stack([book.tail(half_edges), book.head(half_edges)], axis=1))
    np.testing.assert_array_equal(length, book.l.ravel()[half_edges])


def test_a_solver_of_sweeps_keeps_spokes_and_makes_the_rest_again_for_points() -> None:
    solver = HeatMethodSolver(SMOOTH, refine="sweep")
    point = SurfacePoints([11], [[0.2, 0.3, 0.5]])
    whole = Refinement(unfolding_surface(SMOOTH).unfolding)
    order = connectivity.edge_distance(SMOOTH.edge_graph, SMOOTH.F[11, :1])
    expected = [whole.sweep(order, NONE, points=point), whole.sweep(order, SMOOTH.F[11, :1])]
    slim = Refinement(unfolding_surface(SMOOTH).unfolding)
    slim.keep_for_sweeps()
    found = [slim.sweep(order, NONE, points=point), slim.sweep(order, SMOOTH.F[11, :1])]
    np.testing.assert_array_equal(found, expected)
    tracemalloc.start()
    try:
        large = HeatMethodSolver(shapes.icosphere(5), refine="sweep")
        held = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    # 1205 bytes for each, 384 of them spokes; turns and steps would be 576 more.
    assert held < 1400 * large.n_vertices
    assert np.isfinite(solver.distance(point)).all()


def test_matrices_hold_their_entries_alone() -> None:
    domain = operators(SMOOTH)
    for array in (domain.L.data, domain.L.indices, domain.M.data, domain.M.indices):
        assert array.base is None or array.base.nbytes == array.nbytes
