import itertools
import pickle
import threading

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import HeatMethodSolver, Mesh, SourceError, shapes
from heat_igl.geodesic import SolverChoice
from heat_igl.runtime import PeakMemory, over_rows, threads


def test_blocks_keep_to_the_memory_and_use_the_threads():
    assert threads.block_size(10_000, 1000, 2) == (8, 2)
    assert threads.block_size(10_000, None, 2) == (8, 2)
    assert threads.block_size(10_000, 6, 2) == (8, 2)
    assert threads.block_size(10_000, 1, 4) == (8, 1)
    size, n = threads.block_size(6_400_000, 64, 2)
    assert n == 2
    assert 1 < size < 8
    assert threads.block_size(20_000_000, 64, 2) == (1, 2)
    assert threads.block_size(60_000_000, 64, 2) == (1, 1)
    # The bits of the results do not depend on the threads.
    assert threads.block_size(10_000, 6, 64)[0] == threads.block_size(10_000, 6, 1)[0]


@pytest.mark.parametrize("threads", ["1", "2"])
def test_rows_are_worked_off_once_each_in_order(threads, monkeypatch):
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", threads)
    for n, most in ((0, 5), (1, 5), (7, 5), (100, 5), (100, 1000)):
        found = over_rows(np.arange(n).__getitem__, n, most)
        assert np.concatenate([np.empty(0), *found]).tolist() == list(range(n))
        assert all(0 < len(rows) <= most for rows in found)


def test_rows_are_worked_off_by_all_processors_and_errors_come_through(monkeypatch):
    monkeypatch.setattr("heat_igl.runtime.threads.n_threads", lambda: 2)
    both_busy = threading.Barrier(2, timeout=10)

    def wait_for_the_other(_):
        both_busy.wait()
        return threading.get_ident()

    assert len(set(over_rows(wait_for_the_other, 8, 1))) == 2

    def refuse_the_last(rows):
        if rows.stop == 8:
            raise ValueError("row 7")

    with pytest.raises(ValueError, match="row 7"):
        over_rows(refuse_the_last, 8, 1)


def test_in_order_works_on_several_threads_and_draws_no_more_than_it_has_room_for():
    drawn = []
    both_busy = threading.Barrier(2, timeout=10)

    def items():
        for i in itertools.count():
            drawn.append(i)
            yield i

    def work(i):
        both_busy.wait()
        return 10 * i

    results = threads.in_order(work, items(), 2)
    assert list(itertools.islice(results, 4)) == [0, 10, 20, 30]
    assert len(drawn) <= 6
    both_busy.abort()
    results.close()


@pytest.mark.parametrize("n_threads", [1, 2])
def test_an_error_in_the_items_comes_after_the_results_before_it(n_threads):
    def items():
        yield from range(5)
        raise KeyError("the sixth")

    results = threads.in_order(sum, threads.in_blocks(items(), 2), n_threads)
    found = []
    with pytest.raises(KeyError, match="the sixth"):
        found.extend(itertools.chain.from_iterable([r] for r in results))
    results = threads.in_order(sum, threads.in_blocks(items(), 2), n_threads)
    assert [next(results) for _ in range(3)] == [1, 5, 4]


class Chunked:
    """What a row writer needs of a zarr array, with a record of what was written."""

    def __init__(self, shape: tuple[int, int], height: int) -> None:
        self.shape, self.dtype, self.chunks = shape, np.dtype(np.float32), (height, shape[1])
        self.values = np.full(shape, np.nan, np.float32)
        self.writes: list[tuple[int, int]] = []

    def __setitem__(self, rows: slice, values: np.ndarray) -> None:
        self.values[rows] = values
        self.writes.append((rows.start, rows.stop))


@pytest.mark.parametrize("height", [3, 10, 100])
def test_chunks_are_written_whole_and_once(solver, height):
    sets = list(range(23))
    out = Chunked((23, solver.n_vertices), height)
    assert solver.distances(sets, out=out) is out
    assert all(start % height == 0 and (stop % height == 0 or stop == 23) for start, stop in out.writes)
    assert [start for start, _ in out.writes[1:]] == [stop for _, stop in out.writes[:-1]]
    np.testing.assert_array_equal(out.values, solver.distances(sets, dtype=np.float32))


def test_a_zarr_array_and_a_memmap_hold_the_same(tmp_path, solver):
    zarr = pytest.importorskip("zarr")
    sets = [[i, i + 1] for i in range(11)]
    expected = solver.distances(sets)
    store = zarr.create_array(
        str(tmp_path / "d.zarr"), shape=expected.shape, chunks=(4, 1000), dtype="float32", compressors=None
    )
    assert solver.distances(sets, out=store) is store
    np.testing.assert_array_equal(store[:], expected.astype(np.float32))
    mapped = np.lib.format.open_memmap(tmp_path / "d.npy", mode="w+", dtype=np.float64, shape=expected.shape)
    solver.distances(sets, out=mapped)
    mapped.flush()
    np.testing.assert_array_equal(np.load(tmp_path / "d.npy"), expected)
    with pytest.raises(ValueError, match="out is read-only: open a memmap with mode='r\\+'"):
        solver.distances(sets, out=np.load(tmp_path / "d.npy", mmap_mode="r"))


@pytest.mark.parametrize("method", ["heat", "sweep"])
def test_rows_do_not_depend_on_blocks_or_threads(sphere, method, monkeypatch):
    solver = SolverChoice(method).on(sphere)
    sets = [[int(i)] for i in np.random.default_rng(0).choice(sphere.n_vertices, 19, replace=False)]
    one_by_one = np.stack([solver.distance(sources) for sources in sets])
    for n_threads in ("1", "2"):
        monkeypatch.setenv("HEAT_IGL_NUM_THREADS", n_threads)
        for most in (1, 5, 8):
            monkeypatch.setattr(threads, "BLOCK", most)
            assert np.abs(solver.distances(sets) - one_by_one).max() < 1e-9 * np.pi
    monkeypatch.setattr(threads, "BLOCK", 8)
    monkeypatch.setattr("heat_igl.heat.batches.n_threads", lambda: 3)
    three = solver.distances(sets)
    assert (three == solver.distances(sets)).all()


def test_rows_come_in_order_from_a_generator_without_end(solver):
    expected = solver.distances([7, 8, 9])
    rows = solver.iter_distances((i for i in itertools.count(7)), dtype=np.float32)
    for row, known in zip(itertools.islice(rows, 3), expected, strict=True):
        assert row.dtype == np.float32
        assert row.base is None
        np.testing.assert_allclose(row, known, rtol=1e-6)
    rows.close()


def test_a_bad_set_is_named_when_it_is_reached(solver):
    rows = solver.iter_distances(iter([3, 4, 99999, 5]))
    assert next(rows)[3] == 0
    assert next(rows)[4] == 0
    with pytest.raises(SourceError, match=r"source_sets\[2\]: sources\[0\] = 99999 is no vertex"):
        next(rows)


def test_memory_does_not_grow_with_the_number_of_sets(solver):
    """600 rows of 2562 doubles are 12 MB; from a generator none of them is kept."""
    list(itertools.islice(solver.iter_distances(range(40)), 40))
    grown = []
    for n_sets in (40, 600):
        with PeakMemory() as peak:
            for _ in solver.iter_distances(iter([[i] for i in range(n_sets)])):
                pass
        grown.append(peak.bytes)
    if grown[0] is None:
        pytest.skip("nobody can tell how much memory is in use here")
    assert grown[1] < grown[0] + 4e6  # all rows together: 12 MB


def test_stated_memory_bound(monkeypatch):
    """What a batch needs beside its result is below what the docstring says per face, block and thread."""
    mesh = perturbed(shapes.torus(150, 200))
    solver = HeatMethodSolver(mesh)
    out = np.zeros((32, mesh.n_vertices), np.float32)
    solver.distances(range(32), out=out)
    allowed = 8 * 40 * mesh.n_faces
    monkeypatch.setattr(threads, "WORKING_MEMORY", allowed)
    with PeakMemory() as peak:
        solver.distances(range(32), out=out)
    if peak.bytes is None:
        pytest.skip("nobody can tell how much memory is in use here")
    assert peak.bytes < 1.25 * allowed


# A solver after the vertices moved.


def test_a_mesh_that_moves_shares_what_its_faces_say(cow):
    facets, components = cow.facets, cow.components
    moved = cow.with_vertices(cow.V + 1)
    assert moved.F is cow.F
    assert moved.facets is facets
    assert moved.components is components
    assert "edge_lengths" not in moved.__dict__
    np.testing.assert_allclose(moved.edge_lengths, Mesh(cow.V + 1, cow.F).edge_lengths, rtol=1e-12)
    copy = pickle.loads(pickle.dumps(moved))
    assert (copy.V == moved.V).all()
