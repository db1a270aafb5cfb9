"""Local queries and log maps: equal to the full search, ended where asked, cleared after each."""

import re
import time
from itertools import pairwise

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed
from surfaces import angle_between, bent_pages, bumpy, on, two_arms

import heat_igl
from heat_igl import Mesh, distances_within, log_maps_within, nearest_vertices, pair_distances, shapes, tangent_frames
from heat_igl.typing import FloatArray
from heat_igl.windows import blocks_within, local, read_distances_within, within_store, write_distances_within
from heat_igl.windows.exact import ExactSurface, Found, exact_distance
from heat_igl.windows.tables import from_mesh

MESHES = {
    "bumpy": bumpy,
    "bends at a corner": lambda: two_arms(8),
    "edges of three faces": bent_pages,
    "rough": lambda: perturbed(shapes.grid(12), 0.8, 2),
}


def full(mesh: Mesh) -> FloatArray:
    """All distances (n, n), one full search after the other on one surface."""
    surface = ExactSurface(from_mesh(mesh, 0))
    return np.array([surface.solve(on(mesh, v)).distance for v in range(mesh.n_vertices)])


@pytest.mark.parametrize("name", MESHES)
def test_local_queries_are_the_full_search_to_the_bit(name):
    mesh = MESHES[name]()
    n, every = mesh.n_vertices, full(mesh)
    reached = np.isfinite(every)
    radius = float(np.quantile(every[reached], 0.1))
    within = distances_within(mesh, radius)
    np.testing.assert_array_equal(within.toarray(), np.where(every <= radius, every, 0.0))
    assert within.nnz == (every <= radius).sum()
    assert within.has_sorted_indices
    indices, distances = nearest_vertices(mesh, 9)
    for v in range(n):
        order = np.lexsort((np.arange(n), every[v]))[:9]
        np.testing.assert_array_equal(indices[v], np.where(reached[v, order], order, -1))
        np.testing.assert_array_equal(distances[v], every[v, order])
    pairs = np.random.default_rng(3).permutation(n * n)[:300]
    shared = np.column_stack([pairs % 5, pairs // n])  # several second vertices for each first one
    np.testing.assert_array_equal(pair_distances(mesh, shared), every[shared[:, 0], shared[:, 1]])


@pytest.mark.parametrize("name", MESHES)
def test_single_pairs_are_the_full_search(name):
    """With one second vertex less is looked at: of paths that are equally long, another may be measured."""
    mesh = MESHES[name]()
    rng, n, every = np.random.default_rng(3), mesh.n_vertices, full(mesh)
    for _ in range(3):
        first, second = rng.permutation(n), rng.permutation(n)
        found = pair_distances(mesh, np.column_stack([first, second]))
        np.testing.assert_allclose(found, every[first, second], rtol=4e-15)


def test_rows_are_those_of_the_sources_in_their_order():
    mesh = bumpy()
    sources = [40, 7, 7, 300]
    within = distances_within(mesh, 0.4, sources)
    indices, distances = nearest_vertices(mesh, 5, sources)
    assert within.shape == (4, mesh.n_vertices)
    for i, v in enumerate(sources):
        exact = exact_distance(mesh.V, mesh.F, v)
        np.testing.assert_array_equal(within[[i]].indices, np.flatnonzero(exact <= 0.4))
        np.testing.assert_allclose(within[[i]].data, exact[exact <= 0.4], rtol=1e-14)
        np.testing.assert_allclose(distances[i], np.sort(exact)[:5], rtol=1e-14)
        assert indices[i, 0] == v
    mask = np.zeros(mesh.n_vertices, bool)
    mask[[7, 40]] = True
    np.testing.assert_array_equal(distances_within(mesh, 0.4, mask).toarray(), within.toarray()[[1, 0]])


@pytest.mark.parametrize("name", MESHES)
def test_blocks_are_the_rows_of_the_matrix(name):
    mesh = MESHES[name]()
    sources = np.arange(mesh.n_vertices)[::-1]
    whole = distances_within(mesh, 0.3, sources)
    blocks = list(blocks_within(mesh, 0.3, sources, most_entries=2 * whole.nnz // 3))
    assert len(blocks) > 1
    together = sp.vstack(blocks).tocsr()
    for part in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(together, part), getattr(whole, part))


def test_a_store_holds_the_matrix(tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    mesh = bumpy()
    whole, path = distances_within(mesh, 0.5), tmp_path / "near"
    monkeypatch.setattr(within_store, "_CHUNK", 1000)
    write_distances_within(path, mesh, 0.5)
    for rows in (None, slice(100, 200), slice(640, None), slice(5, 5)):
        some, truth = read_distances_within(path, rows), whole[rows or slice(None)]
        assert some.shape == truth.shape
        for part in ("indptr", "indices", "data"):
            np.testing.assert_array_equal(getattr(some, part), getattr(truth, part))
    with pytest.raises(FileExistsError, match="near exists: name a new directory"):
        write_distances_within(path, mesh, 0.5)
    with pytest.raises(ValueError, match="rows must be a slice of consecutive rows"):
        read_distances_within(path, slice(0, 10, 2))
    with pytest.raises(ValueError, match="holds no distances"):
        read_distances_within(tmp_path)


def test_what_fails_leaves_no_store(tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    with pytest.raises(ValueError, match="radius must be a positive number"):
        write_distances_within(tmp_path / "near", bumpy(), -1)

    def two_blocks(*_):
        yield distances_within(bumpy(), 0.1)
        raise MemoryError("the second block")

    monkeypatch.setattr(within_store, "blocks_within", two_blocks)
    with pytest.raises(MemoryError, match="second block"):
        write_distances_within(tmp_path / "near", bumpy(), 0.1)
    assert list(tmp_path.iterdir()) == []


def test_threads_and_room_change_nothing(monkeypatch):
    mesh = bumpy()
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", "1")
    alone = distances_within(mesh, 0.7), *nearest_vertices(mesh, 20)
    monkeypatch.setattr("heat_igl.runtime.threads.n_threads", lambda: 4)
    monkeypatch.setattr(local, "CHUNK", 5)
    monkeypatch.setattr(local, "_ROOM", 3)  # less than one source needs
    together = distances_within(mesh, 0.7), *nearest_vertices(mesh, 20)
    np.testing.assert_array_equal(alone[0].toarray(), together[0].toarray())
    for one, other in zip(alone[1:], together[1:], strict=True):
        np.testing.assert_array_equal(one, other)


def test_what_is_not_reached_is_padded():
    one = shapes.icosphere(0)
    n = one.n_vertices
    mesh = Mesh(np.vstack([one.V, one.V + 5, [[9, 9, 9]]]), np.vstack([one.F, one.F + n]))
    indices, distances = nearest_vertices(mesh, n + 2, [0, 2 * n])
    assert sorted(indices[0, :n]) == list(range(n))
    assert np.isfinite(distances[0, :n]).all()
    assert (indices[0, n:] == -1).all()
    assert np.isinf(distances[0, n:]).all()
    assert indices[1].tolist() == [2 * n] + [-1] * (n + 1)
    assert nearest_vertices(mesh, 100, [3])[0].shape == (1, 100)
    assert pair_distances(mesh, [[0, n], [n, n], [2 * n, 2 * n], [2 * n, 0]]).tolist() == [np.inf, 0.0, 0.0, np.inf]
    assert np.diff(distances_within(mesh, np.inf, [0, 2 * n]).indptr).tolist() == [n, 1]
    assert pair_distances(mesh, np.empty((0, 2), int)).shape == (0,)


def test_a_search_clears_what_it_wrote(monkeypatch):
    """Otherwise the next search on the same arrays would go wrong, or cost more than what it touches."""
    mesh, kept = bumpy(), []
    original = local.Workspace

    class Kept(original):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            kept.append(self)

    monkeypatch.setattr(local, "Workspace", Kept)
    distances_within(mesh, 0.5)
    nearest_vertices(mesh, 7)
    pair_distances(mesh, [[0, 300], [5, 9]])
    blank = Found.of(mesh.n_vertices, mesh.n_vertices)
    for work in kept:
        for name in ("distance", "root", "label", "entered"):
            np.testing.assert_array_equal(getattr(work._found, name), getattr(blank, name))
    work, (found, value) = kept[0], np.empty((2, 2, mesh.n_vertices))
    for row in range(2):
        work.search(np.array([3], np.int32), found[row].view(np.int32)[: mesh.n_vertices], value[row], n_nearest=99)
    np.testing.assert_array_equal(value[0, :99], value[1, :99])


def test_a_cutoff_ends_the_search():
    mesh = bumpy()
    surface = ExactSurface(from_mesh(mesh, 0))
    windows = [surface.solve(on(mesh, 0), cutoff=cutoff).n_windows for cutoff in (0.1, 0.2, 0.4, 0.8, np.inf)]
    assert all(less < more for less, more in pairwise(windows))
    # On a sphere of radius 1 a cap of radius 0.2 is a hundredth of the area.
    assert windows[1] < 0.03 * windows[-1]


def test_distances_that_will_not_fit_into_memory_are_refused_early(monkeypatch):
    mesh = shapes.torus(12, 24)
    whole = mesh.n_vertices**2 * local._BYTES
    monkeypatch.setattr(local, "available_memory", lambda: 1.01 * whole)
    assert distances_within(mesh, np.inf).nnz == mesh.n_vertices**2
    monkeypatch.setattr(local, "available_memory", lambda: 0.5 * whole)
    with pytest.raises(MemoryError, match=r"about 8\.3e\+04 distances lie within the radius, 288 from each"):
        distances_within(mesh, 1e12)
    # Rows that are written some at a time need less.
    assert sum(block.nnz for block in blocks_within(mesh, np.inf, most_entries=1)) == mesh.n_vertices**2


def test_a_terminal_is_told_how_long_a_search_takes(monkeypatch, capsys):
    monkeypatch.setattr("heat_igl.runtime.notices._PATIENCE", -1.0)
    mesh = shapes.icosphere(2)
    distances_within(mesh, 0.3)
    assert not capsys.readouterr().err  # no terminal
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    distances_within(mesh, 0.3)
    lines = capsys.readouterr().err.splitlines()
    assert re.fullmatch(r"\d+ of 162 sources are done: about \d+ s left for .* distances, .*", lines[0])
    assert lines[-1].startswith("162 of 162 sources")
    solver = heat_igl.GeodesicSolver(mesh)
    for ask, last in (
        (lambda: heat_igl.farthest_points(solver, 3), "3 of 3 points are found"),
        (lambda: heat_igl.distance_matrix(solver, [0, 5]), "2 of 2 queries are done"),
        (lambda: heat_igl.diameter(solver, rounds=1), "1 of 1 queries at most are done"),
    ):
        ask()
        assert capsys.readouterr().err.splitlines()[-1] == f"{last}: about 0 s left"


def test_an_interrupt_ends_all_threads(monkeypatch):
    """What waits is not begun any more, neither by the thread that was interrupted nor by others."""
    mesh, within, begun = shapes.icosphere(2), local.Workspace.within, []

    def interrupted_once(work, sources, radius):
        begun.append(sources)
        if len(begun) == 1:
            raise KeyboardInterrupt
        time.sleep(0.01)
        return within(work, sources, radius)

    monkeypatch.setattr(local.Workspace, "within", interrupted_once)
    monkeypatch.setattr(local, "CHUNK", 1)
    monkeypatch.setattr("heat_igl.runtime.threads.n_threads", lambda: 2)
    with pytest.raises(KeyboardInterrupt):
        distances_within(mesh, 0.5)
    assert len(begun) < 10


# --- Log maps around many vertices: in the plane, along reversed paths, and against geodesics traced from the source


@pytest.mark.parametrize("make", [lambda: bumpy(2), lambda: shapes.grid(9)], ids=["blob", "grid"])
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


@pytest.mark.parametrize("make", [lambda: bumpy(2), saddle])
def test_the_path_back_is_the_same_path(make):
    mesh = make()
    maps = log_maps_within(mesh, np.inf)
    departure, arrival, rotation = (x.toarray() for x in (maps.departure, maps.arrival, maps.rotation))
    off = ~np.eye(mesh.n_vertices, dtype=bool)
    assert angle_between(arrival - departure.T - np.pi)[off].max() < 1e-9
    assert angle_between(rotation + rotation.T).max() < 1e-9


def test_the_bound_of_a_search_holds_for_each():
    """A tetrahedron has 12 half-edges: 400 000 searches together take more windows than one may."""
    mesh = Mesh([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
    tables, k = from_mesh(mesh, 0), 400_000
    value = np.empty(4 * k)
    ends = local.Workspace(tables, mesh.V[tables.old_vertex]).search(
        np.zeros(k, np.int32), np.empty(4 * k, np.int32), value
    )
    assert ends[-1] == 4 * k
    assert tables.unscaled(value[-4:]).max() == pytest.approx(np.sqrt(8))
    tube = shapes.cylinder(5, 9)
    with pytest.raises(RuntimeError, match="the search did not end"):
        distances_within(Mesh(tube.V * [1, 1, 1e10], tube.F), 1e12, [7])
