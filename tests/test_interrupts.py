"""Ctrl-C: long calls end at once, with what the handler raised, and solvers go on as before."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from heat_igl import GeodesicSolver, distances_within, shapes, write_distances_within
from heat_igl.kernels import signals
from heat_igl.operators import MetricSimplices
from heat_igl.runtime.threads import Pool
from heat_igl.sweep import HopfLaxEngine, LineEngine

pytestmark = pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer signals on this system")


class StoppedError(BaseException):
    """What the handler raises. `Thread.start` cleans up after an `Exception`, though the thread has begun."""


@pytest.fixture
def soon():
    """Makes a call, in a twentieth of a second of which a signal comes, whose handler raises.

    The clock starts inside the block that expects this: on a busy machine it may run out between two lines.
    """

    def handler(*_):
        raise StoppedError

    def called(call):
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        call()

    before = signal.signal(signal.SIGALRM, handler)
    yield called
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("threads", [1, 2])
def test_a_batch_ends_with_the_query_at_hand(threads, soon, monkeypatch):
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", str(threads))
    mesh = shapes.icosphere(5)
    solver = GeodesicSolver(mesh, method="exact")
    truth = solver.distance(3)
    out = np.full((2000, mesh.n_vertices), np.nan)
    with pytest.raises(StoppedError):
        soon(lambda: solver.distances([[3]] * 2000, out=out))
    assert np.isnan(out[-1]).all()
    np.testing.assert_array_equal(solver.distance(3), truth)


def test_local_queries_end_and_begin_anew(soon):
    mesh = shapes.icosphere(5)
    near = distances_within(mesh, 0.3, [7])
    with pytest.raises(StoppedError):
        soon(lambda: distances_within(mesh, np.pi, np.tile(np.arange(mesh.n_vertices), 3)))
    again = distances_within(mesh, 0.3, [7])
    np.testing.assert_array_equal(again.toarray(), near.toarray())


def test_searches_in_bodies_end():
    """Straight lines are not found, and paths along edges for some vertices only."""
    mesh = shapes.box(20)
    speeds = MetricSimplices.in_metric(mesh, np.eye(3) * np.linspace(1, 2, len(mesh.F))[:, None, None], 1.0)
    lines, along_edges, stop = LineEngine(MetricSimplices.in_space(mesh)), HopfLaxEngine(speeds), threading.Event()
    one, label = np.full((2, mesh.n_vertices), np.inf), np.full((2, mesh.n_vertices), -1, np.int32)
    one[:, 0], label[:, 0] = 0, 0
    stop.set()
    signals.obey(stop)
    try:
        lines._lower(np.zeros(1, np.int32), np.zeros(1), one[0], label[0])
        along_edges._along_edges(one[1], label[1])
    finally:
        signals.obey(None)
    assert (one[0] > 1.01 * np.linalg.norm(mesh.V - mesh.V[0], axis=1)).sum() > mesh.n_vertices / 2
    assert 0 < np.isinf(one[1]).sum() < mesh.n_vertices - 1


def test_loops_of_an_abandoned_pool_end():
    """A search on another thread, which no signal reaches, does not find what it would have found."""
    mesh = shapes.icosphere(6)
    solver = GeodesicSolver(mesh, method="exact")
    workers = Pool(1)
    begun = threading.Event()

    def search():
        begun.set()
        return [solver.distance(0) for _ in range(200)]

    other = workers.submit(search)
    begun.wait()
    workers.abandon()
    assert isinstance(other.exception(timeout=60), MemoryError)


#: Calls that take ten seconds and more, in a process of their own.
CALLS = {
    "the factors of heat": "HeatMethodSolver(large)",
    "a batch by heat": "HeatMethodSolver(mesh).distances(each)",
    "an exact batch": "GeodesicSolver(large).distances(each)",
    "a batch of sweeps": "GeodesicSolver(large, method='sweep').distances(each)",
    "a local query": "distances_within(mesh, 1.0)",
    "pairs": "pair_distances(mesh, [[i, 40000 - i] for i in range(20000)])",
    "farthest points": "farthest_points(large, 3000)",
    "signed distances": "[SignedHeatSolver(large).distance(isolines(large, large.V[:, 2], [0.1])) for _ in each]",
    "vectors": "[VectorHeatSolver(mesh).log_map(i) for i in range(4000)]",
    "tetrahedra": "GeodesicSolver(shapes.box(30)).distances(each)",
    "refinement": "HeatMethodSolver(shapes.cylinder(30000, 1, 1.0))",
    "points": "GeodesicSolver(PointCloud(large.V))",
    "a store": "write_distances_within(folder + '/near.zarr', mesh, 1.0)",
}
CHILD = """
import signal, sys, time, warnings
from heat_igl import *
# A shell that starts the tests in the background lets its processes ignore the signal.
signal.signal(signal.SIGINT, signal.default_int_handler)
warnings.simplefilter("ignore")
folder, large, mesh, each = sys.argv[1], shapes.icosphere(7), shapes.icosphere(6), [[i] for i in range(4000)]
for line in sys.stdin:
    call = eval("lambda: " + line)
    print("begun", flush=True)
    try:
        call()
        print("it returned", flush=True)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


@pytest.mark.slow
def test_ctrl_c_ends_long_calls(tmp_path):
    """Within some seconds, which nothing else here would do: no call is as short, and some take minutes."""
    late = {}
    with subprocess.Popen(
        [sys.executable, "-c", CHILD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        for name, call in CALLS.items():
            child.stdin.write(call + "\n")
            child.stdin.flush()
            assert child.stdout.readline() == "begun\n"
            time.sleep(0.4)
            begin = time.monotonic()
            child.send_signal(signal.SIGINT)
            assert child.stdout.readline() == "interrupted\n", name
            if time.monotonic() - begin > 4:
                late[name] = time.monotonic() - begin
        child.stdin.close()
        child.wait(timeout=10)  # threads of what was left end, too
    assert not late
    # Nothing is half-written: what is there under the name is all there, and it can be written now.
    assert not (tmp_path / "near.zarr").exists()
    write_distances_within(tmp_path / "near.zarr", shapes.icosphere(1), 1.0)
