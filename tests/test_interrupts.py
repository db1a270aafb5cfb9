"""Ctrl-C: long calls end at once, with what the handler raised, and solvers go on as before."""

from __future__ import annotations

import signal
import threading

import numpy as np
import pytest

from heat_igl import GeodesicSolver, distances_within, shapes
from heat_igl.runtime.threads import pool

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer signals on this system")


class StoppedError(Exception):
    """What the handler raises."""


@pytest.fixture
def soon():
    """A signal in a twentieth of a second, whose handler raises."""

    def handler(*_):
        raise StoppedError

    before = signal.signal(signal.SIGALRM, handler)
    yield lambda: signal.setitimer(signal.ITIMER_REAL, 0.05)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_ends_with_the_query_at_hand(threads, soon, monkeypatch):
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", str(threads))
    mesh = shapes.icosphere(5)
    solver = GeodesicSolver(mesh, method="exact")
    truth = solver.distance(3)
    out = np.full((2000, mesh.n_vertices), np.nan)
    soon()
    with pytest.raises(StoppedError):
        solver.distances([[3]] * 2000, out=out)
    assert np.isnan(out[-1]).all()
    np.testing.assert_array_equal(solver.distance(3), truth)


def test_local_queries_end_and_begin_anew(soon):
    mesh = shapes.icosphere(5)
    near = distances_within(mesh, 0.3, [7])
    soon()
    with pytest.raises(StoppedError):
        distances_within(mesh, np.pi, np.tile(np.arange(mesh.n_vertices), 3))
    again = distances_within(mesh, 0.3, [7])
    np.testing.assert_array_equal(again.toarray(), near.toarray())


def test_loops_of_an_abandoned_pool_end():
    """A search on another thread, which no signal reaches, does not find what it would have found."""
    mesh = shapes.icosphere(6)
    solver = GeodesicSolver(mesh, method="exact")
    workers = pool(1)
    begun = threading.Event()

    def search() -> list[np.ndarray]:
        begun.set()
        return [solver.distance(0) for _ in range(200)]

    other = workers.submit(search)
    begun.wait()
    workers.abandon()
    assert isinstance(other.exception(timeout=60), MemoryError)
