"""References: the exact solvers against each other, closed forms and independent bounds; the guard around them all."""

import os
import subprocess
import sys
import time
from pathlib import Path

import igl
import numpy as np
import psutil
import pytest
from conftest import flat_perturbed, relative_error, wheel_path, zoo
from scipy.spatial import Delaunay
from surfaces import folded_torus, graph_distance, twice

from heat_igl import Mesh, MeshError, read_mesh, reference, shapes
from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.reference import guarded, solvers
from heat_igl.runtime import PeakMemory
from heat_igl.validation import closed_forms

SOLVERS = ("windows", *reference.EXACT_SOLVERS)


# --- exact -----------------------------------------------------------------------------------------------------------


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.filterwarnings("ignore:.*no face uses 1617")  # of the airplane
@pytest.mark.parametrize("name", ["cow.obj", "airplane.obj", "bone.ply", "cube.obj", "trefoil", "elbow", "dust"])
def test_exact_solvers_agree(name):
    mesh = read_mesh(wheel_path(name)) if "." in name else zoo(name)
    largest = np.bincount(mesh.components[mesh.F[:, 0]]).argmax()
    source = int(np.random.default_rng(0).choice(np.flatnonzero(mesh.components == largest)))
    truth = reference.exact(mesh, source)
    for solver, tolerance in (("pygeodesic", 1e-10), ("gdist", 1e-10), ("igl", 1e-6)):
        other = reference.exact(mesh, source, solver=solver)
        assert np.array_equal(np.isinf(other), np.isinf(truth))
        assert relative_error(other, truth).max() < tolerance


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("solver", SOLVERS)
def test_exact_from_several_sources_is_the_minimum_over_them(cow, solver):
    sources = [5, 1200, 2800]
    alone = np.min([reference.exact(cow, source, solver=solver) for source in sources], axis=0)
    together = reference.exact(cow, [*sources, 5], solver=solver)
    assert relative_error(together, alone).max() < 1e-9
    assert (together[sources] == 0).all()


def test_exact_is_approached_from_above_by_independent_paths():
    # A path that crosses an edge between two of its points is longer than a straight one by a second order in their
    # spacing: twice as many points, a quarter of the excess.
    smooth = shapes.icosphere(2)
    V = smooth.V * [1.0, 0.6, 0.3]
    mesh = Mesh(V + 0.03 * np.random.default_rng(3).normal(size=V.shape), smooth.F)
    truth = reference.exact(mesh, 7)
    excess = []
    for per_edge in (3, 7, 15):
        above = graph_distance(mesh, 7, per_edge)[0]
        assert (above >= truth * (1 - 1e-12)).all()
        excess.append(relative_error(above, truth).mean())
    assert 3 < excess[0] / excess[1] < 6
    assert 3 < excess[1] / excess[2] < 6
    assert excess[2] < 2e-3


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("factor", [1e-9, 1e6])
def test_exact_does_not_depend_on_the_unit(cow, solver, factor):
    truth = reference.exact(cow, 2470, solver=solver) * factor
    assert relative_error(reference.exact(Mesh(cow.V * factor, cow.F), 2470, solver=solver), truth).max() < 1e-9


@pytest.mark.usefixtures("in_this_process")
def test_exact_is_inf_beyond_the_component_and_at_unreferenced_vertices():
    one = shapes.grid(5)
    n = one.n_vertices
    mesh = Mesh(np.vstack([[[9.0, 9, 9]], one.V, one.V + np.array([3, 0, 0])]), np.vstack([one.F + 1, one.F + 1 + n]))
    for solver in SOLVERS:
        distance = reference.exact(mesh, 1, solver=solver)
        assert np.isinf(distance[0])
        assert np.isinf(distance[1 + n :]).all()
        np.testing.assert_allclose(distance[1 : 1 + n], closed_forms.plane(one, 0), atol=1e-9)
        everywhere = reference.exact(mesh, [0, 1, 1 + n], solver=solver)
        assert everywhere[0] == 0
        np.testing.assert_allclose(everywhere[1 : 1 + n], everywhere[1 + n :], atol=1e-9)


def fin() -> Mesh:
    """Three triangles at one edge."""
    return Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])


def bow() -> Mesh:
    """Two triangles that touch in a point."""
    return Mesh([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [0, 3, 4]])


def test_other_exact_solvers_refuse_small_examples_of_the_same():
    with pytest.raises(ReferenceSolverError, match=r"1 edges .* more than two triangles \(first: \[0, 1\]\)"):
        reference.exact(fin(), 0, solver="igl")
    with pytest.raises(ReferenceSolverError, match=r"at 1 vertices .* touch in a point \(first: 0\)"):
        reference.exact(bow(), 1, solver="igl")
    assert np.isfinite(reference.exact(Mesh(fin().V, fin().F[:2]), 0, solver="igl")[:4]).all()


def test_exact_takes_small_examples_of_the_same():
    # Unfolded, two pages are a square: from the tip of one to that of the other is straight across the edge.
    np.testing.assert_allclose(reference.exact(fin(), 2), [1, np.sqrt(2), 0, 2, 2], rtol=1e-14)
    np.testing.assert_allclose(reference.exact(bow(), 1), np.sqrt(2) * np.array([1, 0, np.sqrt(2), 2, 2]), rtol=1e-14)


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("solver", SOLVERS)
def test_exact_accepts_a_good_component_of_a_bad_mesh(solver):
    good = shapes.grid(4)
    mesh = Mesh(np.concatenate([fin().V + 5, good.V]), np.concatenate([fin().F, good.F + 5]))
    distance = reference.exact(mesh, 5, solver=solver)
    assert np.array_equal(np.isfinite(distance), np.arange(mesh.n_vertices) >= 5)


def test_other_exact_solvers_refuse_edges_without_length():
    mesh = shapes.grid(4)
    V = mesh.V.copy()
    V[mesh.F[0, 0]] = V[mesh.F[0, 1]]
    collapsed = Mesh(V, mesh.F)
    with pytest.raises(ReferenceSolverError, match=r"1 edges .* have length zero"):
        reference.exact(collapsed, 24, solver="igl")


# --- closed forms ----------------------------------------------------------------------------------------------------


def test_plane_is_exact():
    square = flat_perturbed(shapes.grid(10), 0.4)
    mesh = Mesh(square.V * [2, 1, 1], square.F)
    for sources in (0, [3, 50, 77]):
        np.testing.assert_allclose(closed_forms.plane(mesh, sources), reference.exact(mesh, sources), atol=1e-9)
    with pytest.raises(ReferenceSolverError, match=r"fills .*% of its convex hull"):
        closed_forms.plane(Mesh(mesh.V, mesh.F[20:]), 0)


def test_flat_torus_is_exact():
    torus, cells = folded_torus(12), np.stack(np.divmod(np.arange(144), 12), axis=1)
    mesh = Mesh(torus.V * [2, 1, 1], torus.F)
    for sources in (0, [40, 111]):
        closed = closed_forms.flat_torus(cells / [6, 12], sources, periods=(2, 1))
        np.testing.assert_allclose(closed, reference.exact(mesh, sources), atol=1e-9)


@pytest.mark.parametrize(
    ("build", "closed"),
    [
        (lambda level: shapes.cylinder(8 * 2**level, 6 * 2**level), closed_forms.cylinder),
        (lambda level: shapes.cone(8 * 2**level, 4 * 2**level), closed_forms.cone),
        (lambda level: shapes.icosphere(level + 1), closed_forms.sphere),
    ],
    ids=["cylinder", "cone", "sphere"],
)
def test_exact_tends_to_the_smooth_surface_with_the_square_of_the_edge(build, closed):
    errors = []
    for level in range(4):
        mesh = build(level)
        source = mesh.n_vertices - 1 - 2 * 2**level  # on the rim, a quarter of a turn from where angles jump
        errors.append(relative_error(reference.exact(mesh, source), closed(mesh, source)).mean())
    ratios = np.array(errors[:-1]) / errors[1:]
    assert (ratios[1:] > 3.3).all()
    assert (ratios[1:] < 4.8).all()
    assert errors[-1] < 2e-3


def test_convex_solid_is_the_straight_line():
    points = np.random.default_rng(2).uniform(size=(60, 3))
    mesh = Mesh(points, Delaunay(points).simplices)
    truth = np.linalg.norm(points[:, None] - points[[4, 9]], axis=2).min(axis=1)
    np.testing.assert_allclose(closed_forms.convex_solid(mesh, [4, 9]), truth)
    with pytest.raises(ReferenceSolverError, match=r"fills .*% of its convex hull"):
        closed_forms.convex_solid(Mesh(points, mesh.F[:-5]), 0)


def test_paths_along_edges_on_a_square():
    """Diagonals run from (0, 1) to (1, 0): with them k steps do for k by k cells, against them 2 k."""
    n = 9
    mesh = shapes.grid(n)
    column, row = np.rint(mesh.V[:, 0] * n), np.rint(mesh.V[:, 1] * n)
    from_origin = reference.edge_paths(mesh, 0)
    np.testing.assert_allclose(from_origin, (row + column) / n, rtol=1e-12, atol=1e-15)
    assert (reference.edge_paths(mesh, 0, count_edges=True) == row + column).all()
    back = n - column
    octile = (np.maximum(back, row) + (np.sqrt(2) - 1) * np.minimum(back, row)) / n
    np.testing.assert_allclose(reference.edge_paths(mesh, n), octile, rtol=1e-12, atol=1e-15)
    assert (reference.edge_paths(mesh, n, count_edges=True) == np.maximum(back, row)).all()
    assert (reference.edge_paths(twice(mesh), n)[mesh.n_vertices :] == np.inf).all()


# --- MeshLab and the other heat methods ------------------------------------------------------------------------------


@pytest.mark.usefixtures("in_this_process")
def test_heat_filter_of_meshlab_survives_an_offset(cow):
    near = reference.meshlab_heat(cow, 5)
    assert 0 < relative_error(near, reference.exact(cow, 5)).mean() < 0.1
    # At 1e6 the coordinates keep ten digits, of which single precision leaves none.
    far = Mesh(cow.V + 1e6, cow.F)
    assert relative_error(reference.meshlab_heat(far, 5), near).max() < 1e-2


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("name", ["meshlab", "meshlab_heat", "igl_heat", "potpourri3d_heat"])
def test_unreachable_is_inf_in_all(cow, name):
    n = cow.n_vertices
    pair = Mesh(np.vstack([twice(cow).V, [[0, 0, 0]]]), twice(cow).F)
    distance = reference.measured(name, pair, [3, 900]).distance
    assert np.isinf(distance[n:]).all()
    assert relative_error(distance[:n], reference.exact(cow, [3, 900])).mean() < 0.1
    both = reference.measured(name, pair, [3, n + 900]).distance
    assert np.isfinite(both[: 2 * n]).all()
    assert np.isinf(both[2 * n])


@pytest.mark.usefixtures("in_this_process")
def test_igl_heat_is_what_libigl_computes(cow):
    for intrinsic in (False, True):
        data = igl.HeatGeodesicsData()
        data.use_intrinsic_delaunay = intrinsic
        igl.heat_geodesics_precompute(cow.V, cow.F, 1e-3, data)
        direct = igl.heat_geodesics_solve(data, np.array([7]))
        found = reference.measured("igl_heat", cow, 7, t=1e-3, intrinsic_delaunay=intrinsic).distance
        np.testing.assert_allclose(found, direct, atol=1e-12)


# --- the guard -------------------------------------------------------------------------------------------------------


def test_a_crash_is_an_error_and_the_next_call_works():
    mesh = shapes.grid(4)
    before = reference.exact(mesh, 0, solver="igl")
    with pytest.raises(ReferenceSolverError, match=r"os:abort died with (SIGABRT|exit status).*mesh\.report\(\)"):
        guarded.call("os:abort", {})
    assert np.array_equal(reference.exact(mesh, 0, solver="igl"), before)


@pytest.mark.parametrize("function", ["pygeodesic_exact", "igl_exact", "meshlab_front", "igl_heat"])
def test_an_index_out_of_range_takes_nothing_down(function):
    mesh = shapes.grid(3)
    F = mesh.F.copy()
    F[3, 1] = 10**6
    with pytest.raises(MeshError, match=r"F\[3, 1\] = 1000000 is no vertex"):
        Mesh(mesh.V, F)
    # And if it got past that, it would take the child only.
    arguments = {"V": mesh.V, "F": F, "sources": np.array([0])}
    with pytest.raises(ReferenceSolverError, match=f"native:{function} (died with|failed with)"):
        guarded.call(f"heat_igl.reference.native:{function}", arguments)


@pytest.mark.skipif(os.name != "posix", reason="signal.pause")
def test_a_hang_is_stopped():
    start = time.perf_counter()
    with pytest.raises(ReferenceSolverError, match=r"signal:pause was stopped after 0\.5 s: raise timeout"):
        guarded.call("signal:pause", {}, timeout=0.5)
    assert time.perf_counter() - start < 10


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the bound needs Linux")
def test_memory_is_bounded():
    with pytest.raises(ReferenceSolverError, match=r"numpy:ones needs more than 0\.25 GiB: raise memory"):
        guarded.call("numpy:ones", {"shape": 2**27}, memory=2**28)
    assert (guarded.call("numpy:ones", {"shape": 2**27}, memory=2**31).peak_memory or 2**30) > 2**29
    mesh = shapes.icosphere(5)
    with pytest.raises(ReferenceSolverError, match=r"(died with|needs more than).* GiB"):
        reference.exact(mesh, 0, solver="pygeodesic", memory=2**24)
    assert np.isfinite(reference.exact(mesh, 0, solver="igl")).all()


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d[:0], r"array of shape \(0,\) for 25 vertices"),
        (lambda d: np.full_like(d, np.nan), "25 of 25 distances that are not finite"),
        (lambda d: d * 0.9, "[1-9][0-9]* vertices are nearer than a straight line"),
        (lambda d: d * 1.5, "[1-9][0-9]* farther than a path along edges"),
    ],
    ids=["empty", "nan", "short", "long"],
)
def test_what_is_no_distance_is_an_error(change, message, monkeypatch):
    mesh, original = shapes.grid(4), guarded.call

    def changed(*args, **options):
        reply = original(*args, **options)
        reply.values["distance"] = change(reply.values["distance"])
        return reply

    assert np.isfinite(reference.exact(mesh, 0, solver="igl")).all()
    monkeypatch.setattr(guarded, "call", changed)
    with pytest.raises(ReferenceSolverError, match=message):
        reference.exact(mesh, 0, solver="igl")


def test_a_missing_package_names_its_extra(monkeypatch):
    monkeypatch.setattr(solvers, "find_spec", lambda name: object() if name == "igl" else None)
    mesh = shapes.grid(2)
    with pytest.raises(MissingExtraError, match="needs pymeshlab: pip install pymeshlab"):
        reference.meshlab(mesh, 0)
    with pytest.raises(MissingExtraError, match="needs potpourri3d: pip install potpourri3d"):
        reference.measured("potpourri3d_heat", mesh, 0)
    for solver in ("windows", "igl"):  # these are always there
        np.testing.assert_allclose(reference.exact(mesh, 0, solver=solver), closed_forms.plane(mesh, 0))


def test_a_library_that_does_not_load_is_one_line():
    with pytest.raises(ReferenceSolverError, match="no_such_module:run cannot be loaded: No module named") as caught:
        guarded.call("no_such_module:run", {})
    assert "\n" not in str(caught.value)


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs a high-water mark")
def test_arrays_cross_without_a_copy():
    big = np.ones(2**24)
    guarded.call("numpy:sum", {"a": big[:10]})
    with PeakMemory() as peak:
        reply = guarded.call("numpy:sum", {"a": big})
    assert peak.bytes < big.nbytes / 8
    # The child holds it once.
    assert reply.peak_memory < 1.125 * big.nbytes


ABANDON = """
import os, threading, time
import psutil
from heat_igl.reference import guarded
threading.Thread(target=lambda: guarded.call("signal:pause", {}, timeout=0.5), daemon=True).start()
while not psutil.Process().children():
    time.sleep(0.01)
time.sleep(0.2)
print(psutil.Process().children()[0].pid, flush=True)
os._exit(0)  # nobody waits for the child any more
"""


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signal.pause")
def test_a_hanging_child_does_not_outlive_a_killed_caller_for_long():
    found = subprocess.run([sys.executable, "-c", ABANDON], capture_output=True, text=True, check=True)
    child = psutil.Process(int(found.stdout))
    assert child.is_running()
    assert psutil.wait_procs([child], timeout=20)[0]


def test_memory_of_a_solver_is_without_that_of_its_library():
    pytest.importorskip("pymeshlab")  # which takes 50 MB
    assert (reference.measured("meshlab", shapes.grid(4), 0).peak_memory or 0) < 2e7
