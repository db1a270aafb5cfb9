"""Sweep and strip unfolding: exact where they must be, bounded elsewhere, and no more than their claims."""

from __future__ import annotations

import pickle
import warnings

import numpy as np
import pytest
from conftest import perturbed, pygeodesic_distance, relative_error, wheel_path
from surfaces import moebius_strip, random_disk

import heat_igl
from heat_igl import HeatMethodSolver, Mesh, Refinement, shapes, unfolded_distance
from heat_igl.errors import MeshError, SourceError
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation
from heat_igl.reference.baselines import graph_distance

METHODS = ("sweep", "unfold")


FLAT = {
    "grid": lambda: shapes.grid(25),
    "disk": lambda: shapes.disk(12),
    "strip": lambda: shapes.strip(80, 3),
    "perturbed grid": lambda: perturbed_in_plane(shapes.grid(20)),
    "random disk": lambda: random_disk(700, 0),
    "another random disk": lambda: random_disk(700, 1),
}


def perturbed_in_plane(mesh: Mesh) -> Mesh:
    V = perturbed(mesh, 0.3, 3).V.copy()
    V[:, 2] = 0
    return Mesh(V, mesh.F)


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("method", METHODS)
def test_flat_convex_domains_are_exact(name, method):
    mesh = FLAT[name]()
    solver = HeatMethodSolver(mesh, refine=method)
    for source in (0, mesh.n_vertices // 2, mesh.n_vertices - 1):
        truth = np.linalg.norm(mesh.V - mesh.V[source], axis=1)
        assert relative_error(solver.distance(source), truth).max() < 1e-9


@pytest.mark.parametrize("method", METHODS)
def test_rolled_out_cylinder(method):
    """A prism is as flat as a strip; its shortest paths go around either side."""
    mesh = shapes.cylinder(24, 20)
    side = 2 * np.sin(np.pi / 24)
    ring, k = np.divmod(np.arange(mesh.n_vertices), 24)
    dk = np.minimum(k, 24 - k) * side
    truth = np.hypot(dk, ring * (2 * np.pi / 20))
    d = HeatMethodSolver(mesh, refine=method).distance(0)
    # From the corner of a quad that is flat in itself, distance is exact; rounding splits no ties at the seam.
    assert relative_error(d, truth).max() < 1e-9


@pytest.fixture(scope="module")
def bumpy() -> Mesh:
    """A sphere with bumps: vertices of both signs of curvature, and no symmetry."""
    mesh = shapes.icosphere(4)
    V = mesh.V * (1 + 0.25 * np.sin(5 * mesh.V[:, :1]) * np.cos(4 * mesh.V[:, 1:2]))
    return perturbed(Mesh(V, mesh.F), 0.2, 1)


@pytest.mark.parametrize("source", [0, 100, 1000])
def test_against_exact_distance_on_a_generated_surface(bumpy, source):
    truth = pygeodesic_distance(bumpy, source)
    unfolded = relative_error(HeatMethodSolver(bumpy, refine="unfold").distance(source), truth)
    swept = relative_error(HeatMethodSolver(bumpy, refine="sweep").distance(source), truth)
    assert unfolded.mean() < 1e-4
    assert np.percentile(unfolded, 99) < 1e-3
    assert swept.mean() < 3e-3


def test_sweep_on_the_sphere_converges():
    """Looking through two triangles: one at a time leaves 0.6, 0.3 and 0.13 %."""
    errors = []
    for subdivisions in (3, 4, 5):
        mesh = shapes.icosphere(subdivisions)
        truth = np.arccos(np.clip(mesh.V @ mesh.V[100], -1, 1))
        d = HeatMethodSolver(mesh, refine="sweep").distance(100)
        errors.append(relative_error(d, truth).mean())
    assert errors[2] < 8e-4
    assert np.log2(errors[0] / errors[2]) > 2


@pytest.mark.parametrize("name", ["bone.ply", "cow.obj"])
def test_against_exact_distance_on_a_sample_mesh(name):
    mesh = heat_igl.read_mesh(wheel_path(name))
    source = int(mesh.F[0, 0])
    truth = pygeodesic_distance(mesh, source)
    error = relative_error(HeatMethodSolver(mesh, refine="unfold").distance(source), truth)
    assert error.mean() < 3e-4
    assert np.percentile(error, 99) < 2e-3


def test_unfolding_is_never_shorter_than_the_exact_distance(bumpy):
    """Every value is the length of a path. The sweep makes no such claim, and would fail this."""
    truth = pygeodesic_distance(bumpy, 7)
    d = HeatMethodSolver(bumpy, refine="unfold").distance(7)
    assert (d - truth).min() > -1e-8 * truth.max()
    assert (HeatMethodSolver(bumpy, refine="sweep").distance(7) - truth).min() < -1e-5 * truth.max()


def test_unfolding_is_never_longer_than_along_edges(bumpy):
    from scipy.sparse import csgraph, csr_array

    graph = csr_array((bumpy.edge_lengths, tuple(bumpy.edges.T)), shape=(bumpy.n_vertices,) * 2)
    along_edges = csgraph.dijkstra(graph, directed=False, indices=7)
    d = HeatMethodSolver(bumpy, refine="unfold", laplacian="cotan").distance(7)
    assert (d <= along_edges * (1 + 1e-12)).all()


def test_smaller_tolerance_is_more_accurate(bumpy):
    truth = pygeodesic_distance(bumpy, 3)
    error = [relative_error(unfolded_distance(bumpy.V, bumpy.F, 3, tolerance=t), truth).mean() for t in (1e-3, 1e-5, 0)]
    assert error[0] > 2 * error[1] > 2 * error[2]
    # Followed to their ends, most paths are the shortest ones.
    d = unfolded_distance(bumpy.V, bumpy.F, 3, tolerance=0)
    assert (relative_error(d, truth) < 1e-9).mean() > 0.9


@pytest.mark.parametrize("method", METHODS)
def test_several_sources_give_the_nearest(bumpy, method):
    solver = HeatMethodSolver(bumpy, refine=method)
    sources = [0, 500, 1700]
    each = solver.distances([[s] for s in sources]).min(axis=0)
    together = solver.distance(sources)
    assert (together[sources] == 0).all()
    assert (np.abs(together - each) < (2e-2 if method == "sweep" else 2e-3) * each.max()).all()
    assert np.abs(together - each).mean() < (2e-3 if method == "sweep" else 1e-4) * each.max()


@pytest.mark.parametrize("method", METHODS)
def test_unreached_components_and_unused_vertices_are_infinite(method):
    grid = shapes.grid(6)
    n = grid.n_vertices
    mesh = Mesh(
        np.concatenate([grid.V, grid.V + np.array([5, 0, 0]), [[9, 9, 9]]]), np.concatenate([grid.F, grid.F + n])
    )
    d = HeatMethodSolver(mesh, refine=method).distance(3)
    assert np.isinf(d[n:]).all()
    np.testing.assert_allclose(d[:n], np.linalg.norm(grid.V - grid.V[3], axis=1), rtol=1e-12)
    both = HeatMethodSolver(mesh, refine=method).distance([3, n + 3])
    np.testing.assert_allclose(both[n : 2 * n], both[:n], rtol=1e-12)
    assert np.isinf(both[-1])


def test_path_bends_at_the_corner_of_a_boundary():
    """In a plane with a slot, the shortest path from one side to the other touches the end of the slot."""
    grid = shapes.grid(20)
    centre = grid.V[grid.F].mean(axis=1)
    mesh = Mesh(grid.V, grid.F[~((np.abs(centre[:, 0] - 0.5) < 0.05) & (centre[:, 1] < 0.5))])
    source = int(np.argmin(np.linalg.norm(mesh.V[:, :2], axis=1)))
    ends = np.array([[0.45, 0.5], [0.55, 0.5]])
    d = HeatMethodSolver(mesh, refine="unfold").distance(source)
    target = int(np.argmin(np.linalg.norm(mesh.V[:, :2] - [1, 0], axis=1)))
    truth = np.linalg.norm(ends[0]) + 0.1 + np.linalg.norm(ends[1] - [1, 0])
    assert d[target] == pytest.approx(truth, rel=1e-9)


@pytest.mark.parametrize("source", [0, 3, 200])
def test_surface_that_cannot_be_oriented(source):
    """The seam must not be felt: without the double cover, paths would run along it."""
    mesh = moebius_strip(60, 6)
    truth = pygeodesic_distance(mesh, source)
    assert relative_error(unfolded_distance(mesh.V, mesh.F, source), truth).max() < 1e-3
    assert relative_error(HeatMethodSolver(mesh, refine="sweep").distance(source), truth).mean() < 2e-2


def test_faces_turned_over_change_nothing(bumpy):
    rng = np.random.default_rng(0)
    F = bumpy.F.copy()
    turned = rng.random(len(F)) < 0.5
    F[turned] = F[turned][:, ::-1]
    np.testing.assert_allclose(
        unfolded_distance(bumpy.V, F, 11), unfolded_distance(bumpy.V, bumpy.F, 11), rtol=0, atol=2e-3
    )


def test_more_than_two_faces_at_an_edge():
    """Five half planes on one line: paths between two of them turn on the line."""
    k = 8
    mesh = shapes.book(5, k)
    source = mesh.n_vertices - 1
    leaf = np.arange(mesh.n_vertices) < k + 1
    d = unfolded_distance(mesh.V, mesh.F, source)
    assert np.isfinite(d).all()
    # On the source's own leaf, and on the line, distance is that of the plane.
    truth = np.linalg.norm(mesh.V - mesh.V[source], axis=1)
    np.testing.assert_allclose(d[leaf], truth[leaf], rtol=1e-9)
    assert (d >= truth * (1 - 1e-9)).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("k", [1, 2, 5])
def test_straight_over_an_edge_of_more_than_two_faces(method, k):
    """Any two of five pages are a plane folded on the line: the path between them is straight when rolled out."""
    mesh = shapes.book(5, k)
    surface = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))
    source = mesh.n_vertices - 1
    page = (np.arange(mesh.n_vertices) - (k + 1)) // (k * (k + 1))
    from_line, height = np.hypot(mesh.V[:, 0], mesh.V[:, 1]), mesh.V[:, 2] - mesh.V[source, 2]
    same = (page == 4) | (from_line < 1e-9)
    truth = np.hypot(np.where(same, from_line - 1, from_line + 1), height)
    d = getattr(surface, method)(truth, np.array([source]))
    # Beyond the first row of a page, straight paths are found where both ends of an edge on the line see the source.
    first_row = same | (from_line < 1.5 / k)
    np.testing.assert_allclose(d[first_row], truth[first_row], rtol=1e-9)


def test_slivers_do_little_harm(bumpy):
    truth = pygeodesic_distance(bumpy, 5)
    bad = shapes.with_slivers(bumpy, 0)
    assert bad.n_vertices > bumpy.n_vertices + 200
    error = {}
    for name, mesh in (("clean", bumpy), ("slivers", bad)):
        for method in METHODS:
            d = HeatMethodSolver(mesh, refine=method).distance(5)[: bumpy.n_vertices]
            error[name, method] = relative_error(d, truth).mean()
    for method in METHODS:
        assert error["slivers", method] < 1.5 * error["clean", method]


@pytest.mark.parametrize("seed", [0, 1])
def test_slivers_do_little_harm_on_the_cow(cow, seed):
    """Saddles with a twin a hair away: its path may neither keep the direction to its twin nor end in its bend."""
    sources = [901, 2227, 808]
    error = []
    for mesh in (cow, shapes.with_slivers(cow, seed)):
        walks = Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))  # a solver takes windows on the cow
        found = [walks.unfold(graph_distance(mesh, source), np.array([source])) for source in sources]
        each = [
            relative_error(d[: cow.n_vertices], pygeodesic_distance(cow, s))
            for d, s in zip(found, sources, strict=True)
        ]
        error.append(np.mean(each))
    assert 1e-6 < error[1] < 1.5 * error[0]


def test_any_order_will_do(bumpy):
    """The order costs time, not accuracy: even a random one is repaired."""
    truth = pygeodesic_distance(bumpy, 9)
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(bumpy)))
    key = np.random.default_rng(0).random(bumpy.n_vertices)
    assert relative_error(refinement.unfold(key, np.array([9])), truth).mean() < 2e-3
    assert relative_error(refinement.sweep(key, np.array([9])), truth).mean() < 1e-2


@pytest.mark.parametrize("method", METHODS)
def test_same_bits_alone_in_threads_and_pickled(bumpy, method):
    solver = HeatMethodSolver(bumpy, refine=method, backend="scipy")
    sources = list(range(0, 1600, 100))
    block = solver.distances(sources)
    again = pickle.loads(pickle.dumps(solver)).distances(sources)
    np.testing.assert_array_equal(block, again)
    # The order comes from the heat, whose bits may depend on how many right-hand sides are solved together.
    refinement = Refinement(intrinsic_delaunay(intrinsic_triangulation(bumpy)))
    key = block[0]
    first = getattr(refinement, method)(key, np.array([0]))
    for _ in range(3):
        np.testing.assert_array_equal(getattr(refinement, method)(key, np.array([0])), first)


def test_no_poisson_problem_is_factored(bumpy, monkeypatch):
    def forbidden(*_: object) -> None:
        raise AssertionError("a Poisson problem was set up")

    monkeypatch.setattr("heat_igl.heat_method.parts.PoissonProblem", forbidden)
    assert HeatMethodSolver(bumpy, refine="unfold").distance(0).max() > 1
    with pytest.raises(AssertionError, match="Poisson"):
        HeatMethodSolver(bumpy)


def test_solve_returns_the_refined_distance(bumpy):
    solver = HeatMethodSolver(bumpy, refine="unfold")
    solution = solver.solve(4)
    np.testing.assert_array_equal(solution.distance, solver.distance(4))
    assert solution.direction.shape[0] == len(solver.operators.weights)


def test_underflowed_heat_still_gives_an_order():
    """Beyond the range of heat the order is arbitrary, and the distance all the same exact."""
    mesh = shapes.strip(300, 2)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        solver = HeatMethodSolver(mesh, refine="unfold", t_coef=1e-4)
    truth = np.linalg.norm(mesh.V - mesh.V[0], axis=1)
    assert relative_error(solver.distance(0), truth).max() < 1e-9


def test_without_factorization_as_with(bumpy):
    np.testing.assert_allclose(
        unfolded_distance(bumpy.V, bumpy.F, [2, 900]),
        HeatMethodSolver(bumpy, refine="unfold").distance([2, 900]),
        atol=5e-3,
    )


def test_bad_arguments():
    grid = shapes.grid(3)
    assert HeatMethodSolver(grid, refine="sweep").distance(0)[-1] == pytest.approx(np.sqrt(2))
    with pytest.raises(ValueError, match="refine must be one of None, 'sweep', 'unfold', 'exact', not 'fold'"):
        HeatMethodSolver(grid, refine="fold")
    with pytest.raises(ValueError, match="this domain has none"):
        HeatMethodSolver(shapes.box(1), refine="unfold")
    box = shapes.box(1)
    with pytest.raises(MeshError, match="needs triangles"):
        unfolded_distance(box.V, box.F, 0)
    with pytest.raises(SourceError, match="99 is no vertex"):
        unfolded_distance(grid.V, grid.F, 99)
    with pytest.raises(ValueError, match="tolerance must lie between 0 and 1, not -1"):
        unfolded_distance(grid.V, grid.F, 0, tolerance=-1)


@pytest.mark.parametrize("method", ["unfold", "sweep"])
def test_an_order_of_another_length_is_refused(method):
    surface = Refinement(intrinsic_delaunay(intrinsic_triangulation(shapes.grid(3))))
    with pytest.raises(ValueError, match=r"key must have a number for each of 16 vertices, but its shape is \(3,\)"):
        getattr(surface, method)(np.zeros(3), np.array([0]))
