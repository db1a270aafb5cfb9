"""The table of conformance: what every distance keeps, on each kind of domain and by each method.

A cell is an assertion, or a refusal that says what to do instead. Tests of single domains and engines are about what
this table does not hold: their algorithms, options and hard cases.
"""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from conformance import DOMAINS, HARD, METHODS, TURN, distance, domain, solver, subdivided
from conftest import pygeodesic_distance, relative_error

import heat_igl
from heat_igl import MeshError, OffsetSources, SurfacePoints
from heat_igl.operators import Operators

BODIES = ("voxels", "tetrahedra", "metric on tetrahedra")
POINTS = ("points", "points with normals")
SURFACES = ("closed", "handle", "boundary", "one side", "non-manifold", "pixels")
WITHOUT_WINDOWS = (*BODIES, "speeds on triangles")
CELLS = [(d, m) for d in DOMAINS for m in METHODS if m in ("sweep", "heat") or d not in WITHOUT_WINDOWS]
# Heat is moved inside bounds on surfaces in space.
BOUNDED = [(d, m) for d, m in CELLS if m != "heat" or (d not in (*BODIES, *POINTS) and " on " not in d)]
# Heat on 500 vertices in a body is 12 % wrong, and says so.
pytestmark = pytest.mark.filterwarnings("ignore:.*heat (gave|is off):heat_igl.AccuracyWarning")


def table(cells: list[tuple[str, str]] = CELLS) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("name", "method"), cells, ids=[" by ".join(cell) for cell in cells])


def is_exact(name: str, method: str) -> bool:
    """Windows and lines are straight; sweeps, heat and the Hopf-Lax formula are approximations."""
    return solver(name, method).plan.engine in ("windows", "lines")


def largest_mean_error(name: str, method: str) -> float:
    """Relative."""
    if method != "heat":
        return 0.005
    return 0.14 if name in BODIES else 0.06 if name == "speeds on triangles" else 0.03


def sources(name: str) -> list[int]:
    """Three vertices: one of the first, one of the last, one between."""
    n = domain(name).n
    return [3, n // 2, n - 5]


def assert_close(found: np.ndarray, expected: np.ndarray, name: str, method: str) -> None:
    """Equal to rounding; by heat as far as linear systems are solved, and the time step of a speed is that of a mean.

    A sweep takes vertices at equal distances in the order of their numbers, which single values show.
    """
    heat = 2e-4 if name == "speeds on triangles" else 1e-6
    most = 1e-10 if is_exact(name, method) else heat if method == "heat" else 1e-2
    np.testing.assert_array_equal(np.isfinite(found), np.isfinite(expected))
    there = np.isfinite(expected)
    assert np.abs(found[there] - expected[there]).max() <= most * expected[there].max()


@pytest.mark.parametrize("method", ["windows", "exact"])
@pytest.mark.parametrize("name", WITHOUT_WINDOWS)
def test_a_refusal_names_the_method_the_reason_and_the_remedy(name, method):
    with pytest.raises(MeshError, match=rf"method='{method}' needs triangles that fit together, .*method='auto'"):
        domain(name).solver(method)


@table()
def test_zero_at_sources_and_positive_elsewhere(name, method):
    for source in sources(name):
        d = distance(name, method, source)
        assert d.dtype == np.float64
        assert d[source] == 0
        assert (np.delete(d, source) >= 0).all()
        assert (np.delete(d, source) > 0).mean() > 0.99  # heat in a body may be 0 beside a source
        assert np.isfinite(d).all()


@pytest.mark.filterwarnings("ignore:the points are in several parts")
@table()
def test_infinity_in_other_components_and_at_vertices_of_no_cell(name, method):
    one, both = domain(name), domain(name).doubled()
    solver, n = both.solver(method), one.n
    d = solver.distance(3)
    assert np.isinf(d[n:]).all()
    assert_close(d[:n], distance(name, method, 3), name, method)
    assert_close(solver.distance([3, n + 3])[n : 2 * n], distance(name, method, 3), name, method)
    for vertex in range(2 * n, both.n):
        np.testing.assert_array_equal(solver.distance(vertex), np.where(np.arange(both.n) == vertex, 0, np.inf))
        late = solver.distance(OffsetSources([vertex, 3], [1, 2]))
        assert_close(late[:n] - 2, distance(name, method, 3), name, method)
        assert late[vertex] == 1


@table()
def test_near_the_truth(name, method):
    """Closed forms, and pygeodesic where there is none."""
    at = domain(name)
    is_of_sphere = name in ("polygons", *POINTS)  # which differ from it themselves
    for source in sources(name):
        truth = at.truth(source) if at.truth else pygeodesic_distance(at.made(), source)
        error = np.abs(np.delete(distance(name, method, source) - truth, source)) / np.delete(truth, source)
        if is_exact(name, method) and not is_of_sphere:
            assert error.max() < 1e-9
        else:
            assert error.mean() < largest_mean_error(name, method)


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
@pytest.mark.parametrize(("name", "method"), [(name, method) for name in HARD for method in HARD[name][2]])
def test_harder_domains_stay_within_their_bounds(name, method):
    make, source, bounds = HARD[name]
    at = make()
    error = relative_error(at.solver(method).distance(source), at.truth(source))
    assert error.mean() <= bounds[method]


@table([*BOUNDED, *((name, "heat") for name in BODIES if " on " not in name)])
def test_not_shorter_than_a_straight_line(name, method):
    for source in sources(name):
        straight = domain(name).straight(source)
        assert (distance(name, method, source) >= straight - 1e-9 * straight.max()).all()


@table([(name, method) for name, method in BOUNDED if name not in POINTS])
def test_not_longer_than_a_path_along_edges(name, method):
    """Heat is moved inside this bound in a few passes, which leave at most half a percent of the largest distance."""
    most = 5e-3 if method == "heat" else 1e-9
    for source in sources(name):
        along = domain(name).along_edges(source)
        assert (distance(name, method, source) <= along + most * along.max()).all()


@table()
def test_distance_does_not_depend_on_the_order_of_vertices_and_cells(name, method):
    other, label = domain(name).renumbered(np.random.default_rng(1))
    assert_close(other.solver(method).distance(int(label[3]))[label], distance(name, method, 3), name, method)


@table()
def test_distance_does_not_depend_on_the_place(name, method):
    at = domain(name)
    found = at.moved(TURN, shift=[1e6, -2e6, 5e5]).solver(method).distance(3)  # leaves nine digits of the coordinates
    before = distance(name, method, 3)
    most = 1e-2 if method == "sweep" else 1e-6
    assert np.abs(found - before).max() <= most * before.max()


@table()
@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_distance_has_the_unit_of_the_mesh(name, method, scale):
    scaled = domain(name).moved(np.eye(3), scale=scale)
    assert_close(scaled.solver(method).distance(3) / scale, distance(name, method, 3), name, method)


@table([(name, method) for name, method in CELLS if name not in ("polygons", *POINTS)])
def test_a_vertex_in_each_flat_simplex_changes_nothing(name, method):
    """Exact distance stays, the others are as near to it as before."""
    before, found = distance(name, method, 3), subdivided(name, method).distance(3)[: domain(name).n]
    if is_exact(name, method):
        assert_close(found, before, name, method)
    else:
        assert np.abs(found - before).mean() < 2 * largest_mean_error(name, method) * before.mean()


@table([(name, method) for name, method in CELLS if name in SURFACES])
def test_points_in_faces_and_curves_are_sources(name, method):
    """A point is what a vertex in its place is, one in a corner is that corner; batches hold what single sets do."""
    at, prepared = domain(name), solver(name, method)
    curve = heat_igl.edge_curve(at.made(), at.cells[7][:2])
    tail, head, tip = at.V[at.cells[7]]
    share = np.clip((tip - tail) @ (head - tail) / ((head - tail) ** 2).sum(), 0, 1)
    straight = np.linalg.norm(tip - tail - share * (head - tail))
    np.testing.assert_allclose(prepared.distance(curve)[at.cells[7]], [0, 0, straight], rtol=1e-9)
    point, corners = SurfacePoints([7], [[1 / 3] * 3]), at.cells[7]
    found, expected = prepared.distance(point), subdivided(name, method).distance(at.n + 7)[: at.n]
    if is_exact(name, method):
        assert_close(found, expected, name, method)
        back = heat_igl.geodesic_distance(at.made(), 3, method=method, targets=point)
        np.testing.assert_allclose(back, found[3], rtol=1e-11)
    assert np.abs(found - expected).mean() < 2 * largest_mean_error(name, method) * expected.mean()
    straight = np.linalg.norm(at.V[corners] - at.V[corners].mean(axis=0), axis=1)
    np.testing.assert_allclose(found[corners], straight, rtol=1e-9)
    np.testing.assert_array_equal(prepared.distance(SurfacePoints([7], [[0, 1, 0]])), prepared.distance(corners[1]))
    sets = [point, [curve, 3], OffsetSources([point, curve], [0.1, 0.0]), 5]
    for row, each in zip(prepared.distances(sets), sets, strict=True):
        assert_close(row, prepared.distance(each), name, method)
    np.testing.assert_array_equal(prepared.distance([[curve, [point]], 5]), prepared.distance([curve, point, 5]))
    assert_close(prepared.distance(OffsetSources(point, 7.0)) - 7, found, name, method)
    late = 0.3 * found.max()
    first, nearest = prepared.distance(3), prepared.distance(OffsetSources([point, 3], [late, 0]))
    assert np.abs(nearest - np.minimum(found + late, first)).mean() < 2 * largest_mean_error(name, method) * late


@table()
def test_distance_is_symmetric_and_keeps_the_triangle_inequality(name, method):
    at = sources(name)
    each = np.array([distance(name, method, source) for source in at])
    between = each[:, at]
    most = 1e-10 if is_exact(name, method) and name != "polygons" else 2 * largest_mean_error(name, method)
    np.testing.assert_allclose(between, between.T, rtol=most)
    ways = between[:, :, None] + each[None]
    assert (each[:, None] <= ways * (1 + 2 * most) + 1e-12).all()


@table()
def test_the_same_bits_in_batches_in_threads_and_pickled(name, method):
    """Heat solves a batch in other blocks, and agrees to rounding."""
    prepared, at = solver(name, method), sources(name)
    alone = np.array([distance(name, method, source) for source in at])
    for many in (prepared.distances(at), np.array(list(prepared.iter_distances(at)))):
        np.testing.assert_allclose(many, alone, rtol=1e-9 if method == "heat" else 0, atol=1e-12 * alone.max())
    again = pickle.loads(pickle.dumps(prepared))
    np.testing.assert_array_equal(again.distance(at[0]), alone[0])
    with ThreadPoolExecutor(3) as threads:
        np.testing.assert_array_equal(list(threads.map(prepared.distance, at)), alone)


@table()
def test_several_sources_are_the_nearest_of_each(name, method):
    prepared, at = solver(name, method), sources(name)
    alone = np.array([distance(name, method, source) for source in at])
    offsets = 0.1 * np.arange(3) * alone.max()
    exact = is_exact(name, method)
    for given, each in ((at, alone), (OffsetSources(at, offsets), alone + offsets[:, None])):
        found, nearest = prepared.voronoi(given), each.min(axis=0)
        np.testing.assert_array_equal(found.distance, prepared.distance(given))
        difference = np.abs(found.distance - nearest)
        if exact:
            assert difference.max() < 1e-9 * alone.max()
        assert difference.mean() < 2 * largest_mean_error(name, method) * nearest.mean()
        clear = np.diff(np.sort(each, axis=0)[:2], axis=0)[0] > (1e-9 if exact else 0.2) * alone.max()
        assert (found.labels == each.argmin(axis=0))[clear].mean() >= (1 if exact else 0.99)
    overtaken = prepared.voronoi(OffsetSources(at[:2], [0, 2 * alone.max()]))
    assert not overtaken.labels.any()
    if method == "sweep":  # another order
        assert np.abs(overtaken.distance - alone[0]).mean() < 0.005 * alone[0].mean()
    else:
        assert_close(overtaken.distance, alone[0], name, method)
    assert_close(prepared.distance(OffsetSources(at, 7.0)) - 7, prepared.distance(at), name, method)
    mask = np.zeros(domain(name).n, bool)
    mask[at] = True
    np.testing.assert_array_equal(prepared.distance(mask), prepared.distance(sorted(at)))
    assert not prepared.distance(np.ones(domain(name).n, bool)).any()


@table()
def test_a_cutoff_and_targets_leave_the_values(name, method):
    prepared, whole = solver(name, method), distance(name, method, 3)
    cutoff = float(np.median(whole))
    near = np.where(whole <= cutoff, whole, np.inf)
    assert_close(prepared.distance(3, cutoff=cutoff), near, name, method)
    assert_close(prepared.distances([3], cutoff=cutoff)[0], near, name, method)
    cells = prepared.voronoi([3], cutoff=cutoff)
    np.testing.assert_array_equal(cells.labels == -1, np.isinf(cells.distance))
    made = domain(name).made()
    if isinstance(made, Operators):  # the front door takes meshes
        return
    assert_close(heat_igl.geodesic_distance(made, 3, method=method, cutoff=cutoff), near, name, method)
    targets = [*sources(name)[::-1], 3]
    assert_close(heat_igl.geodesic_distance(made, 3, method=method, targets=targets), whole[targets], name, method)
    assert np.isinf(heat_igl.geodesic_distance(made, 3, method=method, targets=targets[:2], cutoff=1e-3)).all()


@table()
def test_vertices_move(name, method):
    at, prepared = domain(name), solver(name, method)
    moved = at.moved(np.diag([1.0, 1.3, 0.8]))
    if at.field is not None and at.kind == "simplices":
        with pytest.raises(ValueError, match="made from operators and has no vertices to move"):
            prepared.with_vertices(moved.V)
        return
    found = prepared.with_vertices(moved.V).distance(3)
    if at.kind == "points":  # the triangles between them stay
        assert np.abs(found - moved.solver(method).distance(3)).mean() < 0.05 * found.mean()
    else:
        assert_close(found, moved.solver(method).distance(3), name, method)
    np.testing.assert_array_equal(prepared.distance(3), distance(name, method, 3))


@table()
def test_a_solver_keeps_its_own(name, method):
    """What a caller does to an answer, or to the arrays that a solver was made of, changes no later answer."""
    at = domain(name)
    given = replace(at, V=at.V.copy(), field=None if at.field is None else at.field.copy())
    prepared = given.solver(method)
    prepared.distance(3)[:] = 7
    given.V[:] *= 2
    if given.field is not None:
        given.field[:] *= 3
    assert_close(prepared.distance(3), distance(name, method, 3), name, method)
    with pytest.raises(AttributeError):
        prepared.plan = None
