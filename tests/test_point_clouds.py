"""Point clouds: their triangles, and the distance on them against closed forms."""

import json
import re
from contextlib import nullcontext

import igl
import numpy as np
import pytest
import surfaces
from conftest import mean_error, zoo
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from surfaces import arcs
from surfaces import points_of_sphere as sphere

import heat_igl
from heat_igl import AccuracyWarning, GeodesicSolver, HeatMethodSolver, MeshError, PointCloud, cli, shapes
from heat_igl.drawing.scene import discs
from heat_igl.geodesic import SolverChoice
from heat_igl.io import ply
from heat_igl.kernels.cloud.local_delaunay import delaunay_stars
from heat_igl.kernels.cloud.local_fits import onto_quadrics, tangent_planes
from heat_igl.kernels.cloud.loop_filling import filling_triangles, torn_points
from heat_igl.mesh.cloud_orientation import oriented, two_sided_cover
from heat_igl.mesh.cloud_triangles import with_gaps_filled
from heat_igl.mesh.connectivity import pinched_vertices
from heat_igl.mesh.neighbourhoods import one_sheet, point_tree, without_noise
from heat_igl.validation.shapes import lattice_mesh

HEAT = {"magnitude": "damped"}


def plane(n: int, seed: int = 0) -> np.ndarray:
    return np.append(np.random.default_rng(seed).random((n, 2)), np.zeros((n, 1)), axis=1)


# The triangles.


def test_a_sphere_is_closed_and_a_disc_is_a_disc():
    closed = PointCloud(sphere(2000)).report()
    assert (closed.euler_characteristic, closed.n_boundary_loops, closed.n_components) == (2, 0, 1)
    P = plane(2000)
    disc = PointCloud(P[np.linalg.norm(P[:, :2] - 0.5, axis=1) < 0.5]).report()
    assert (disc.euler_characteristic, disc.n_boundary_loops, disc.n_components) == (1, 1, 1)
    assert len(closed.nonmanifold_edges) == len(disc.nonmanifold_edges) == 0


def test_triangles_of_a_plane_are_its_delaunay_triangles_inside():
    from scipy.spatial import Delaunay

    P = plane(1500)
    middle = (np.abs(P[:, :2] - 0.5) < 0.35).all(axis=1)

    def inside(F):
        return {tuple(sorted(row)) for row in F.tolist() if middle[row].all()}

    assert inside(PointCloud(P).F) == inside(Delaunay(P[:, :2]).simplices)


def test_nothing_depends_on_where_how_large_or_in_which_order():
    P = sphere(500)
    turn = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    order = np.random.default_rng(2).permutation(len(P))

    def triangles(P):
        return {tuple(sorted(row)) for row in PointCloud(P).F.tolist()}

    expected = triangles(P)
    assert triangles(1e-20 * P @ turn.T) == expected
    assert triangles(1e20 * P) == expected
    assert triangles(P @ turn.T + 1000) == expected
    assert {tuple(sorted(order[list(row)])) for row in triangles(P[order])} == expected
    distance = GeodesicSolver(PointCloud(P)).distance(0)
    np.testing.assert_allclose(GeodesicSolver(PointCloud(P + 1e6)).distance(0), distance, atol=1e-8)
    # With noise, which triangles fit together depends on the order in which they are taken.
    P = P + 0.04 * np.random.default_rng(3).standard_normal(P.shape)
    distance, numbered = GeodesicSolver(PointCloud(P)).distance(0), np.argsort(order)
    renumbered = GeodesicSolver(PointCloud(P[order])).distance(int(numbered[0]))
    np.testing.assert_allclose(renumbered[numbered], distance, atol=1e-12)


# Distance.


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
def test_rough_clouds_are_swept_and_their_meshes_are_not():
    """Between points the triangles are an estimate themselves; of few points windows take no longer."""
    rough = zoo("fractal terrain")
    assert GeodesicSolver(rough, method="sweep").plan.engine == "windows"
    assert GeodesicSolver(PointCloud(rough.V)).plan.engine == "sweep"
    assert GeodesicSolver(PointCloud(rough.V[:800])).plan.engine == "windows"


@pytest.mark.parametrize(("options", "most"), [(HEAT, 0.012), ({}, 0.003), ({"method": "exact"}, 0.002)])
def test_distance_on_a_sphere(options, most):
    P = sphere(4000)
    distances = SolverChoice.of(**options).on(PointCloud(P)).distances([0, 1, 2])
    assert mean_error(distances, np.stack([arcs(P, i) for i in range(3)])) < most


def test_heat_on_the_cover_is_better_than_on_slivers_at_the_boundary():
    P = plane(3000)
    cloud = PointCloud(P)
    truth = np.linalg.norm(P - P[0], axis=1)
    of_cloud = HeatMethodSolver(cloud, magnitude="damped").distance(0)
    of_mesh = HeatMethodSolver(cloud.triangles, t_coef=1, laplacian="intrinsic-delaunay").distance(0)
    assert mean_error(of_cloud, truth) < mean_error(of_mesh, truth)


def test_even_points_are_solved_on_as_their_mesh_is():
    """Random points take a larger time step than the vertices of a mesh."""
    mesh = shapes.icosphere(4)
    of_cloud, of_mesh = HeatMethodSolver(PointCloud(mesh.V)), HeatMethodSolver(mesh)
    assert of_cloud.t == pytest.approx(of_mesh.t, rel=1e-6)
    # With a time step that is asked for, neither is moved inside bounds, which are those of other edges.
    of_cloud, of_mesh = (HeatMethodSolver(domain, t=of_mesh.t) for domain in (PointCloud(mesh.V), mesh))
    np.testing.assert_allclose(of_cloud.distance(0), of_mesh.distance(0), rtol=1e-6)
    solver = HeatMethodSolver(PointCloud(sphere(1000)), **HEAT)
    assert solver.t == pytest.approx(solver.operators.mean_edge_length**2, rel=1e-9)


def test_noise_is_taken_away_and_clean_points_stay():
    P = sphere(20_000)
    noisy = P + 0.01 * np.random.default_rng(1).standard_normal(P.shape)
    radius = np.linalg.norm(without_noise(point_tree(noisy)).P, axis=1)
    assert radius.std() < 0.3 * np.linalg.norm(noisy, axis=1).std()
    assert mean_error(GeodesicSolver(PointCloud(noisy)).distance(0), arcs(P, 0)) < 0.03
    clean = point_tree(P)
    assert without_noise(clean) is clean


@pytest.mark.filterwarnings("ignore:the points are in several parts")
def test_one_part_may_be_noisy():
    P, clean = sphere(2000), 5 + sphere(6000)
    cloud = PointCloud(np.concatenate([P + 0.02 * np.random.default_rng(1).standard_normal(P.shape), clean]))
    assert mean_error(GeodesicSolver(cloud).distance(0)[:2000], arcs(P, 0)) < 0.02
    np.testing.assert_array_equal(cloud.triangles.V[2000:], clean)


@pytest.mark.parametrize("name", ["ridges", "folded paper", "sponge", "beams"])
def test_detail_is_no_noise(name):
    """Ridges of a few spacings, which small quadrics fit better, and shapes on which nearest points move alike."""
    x, y = np.random.default_rng(2).random((2, 20_000))
    ridges = np.stack([x, y, 0.02 * np.abs((40 * x + 3 * y) % 2 - 1)], axis=1)
    detailed = point_tree(ridges if name == "ridges" else np.unique(zoo(name).V, axis=0))
    assert without_noise(detailed) is detailed


def test_noise_of_many_spacings_is_taken_away():
    """Where all neighbours lie within the noise, some of the points show the surface."""
    P, noise = plane(10_000), 0.05
    with pytest.warns(AccuracyWarning, match="noise .* is 0.05 across the .* 17 % off in the .* or the mesh"):
        triangles = PointCloud(P + noise * np.random.default_rng(1).standard_normal(P.shape)).triangles
    assert triangles.V[:, 2].std() < 0.2 * noise
    assert np.unique(triangles.components).size == 1


# What scans bring along.


def test_noise_is_smoothed_over_no_more_neighbours_than_are_flat():
    """Thirty of 500 points of a torus bend around its tube; with much noise nothing tells these apart."""
    mesh, rng = shapes.torus(120, 300), np.random.default_rng(1)
    chosen = rng.choice(mesh.n_vertices, 500, replace=False)
    expected, noise = GeodesicSolver(mesh).distance(int(chosen[0]))[chosen], rng.standard_normal((500, 3))
    found = GeodesicSolver(PointCloud(mesh.V[chosen] + 0.014 * noise)).distance(0)
    assert mean_error(found, expected) < 0.04
    with pytest.warns(AccuracyWarning, match="too few to tell noise from detail|noise of the points is") as caught:
        PointCloud(mesh.V[chosen] + 0.07 * noise).report()
    assert len(caught) == 2


@pytest.mark.filterwarnings("ignore:the noise of the points is", "ignore:the points")
@pytest.mark.parametrize("seed", range(3))
def test_noise_that_makes_neighbourhoods_thick_is_told_from_detail(seed, monkeypatch):
    """Noise of a sixth of the tube, on 300 points of a torus, which clean are all detail."""
    mesh, rng = shapes.torus(60, 150), np.random.default_rng(seed)
    chosen = rng.choice(mesh.n_vertices, 300, replace=False)
    clean = point_tree(mesh.V[chosen])
    assert without_noise(clean) is clean
    P = mesh.V[chosen] + 0.07 * rng.standard_normal((300, 3))
    sources = list(range(0, 300, 30))
    expected = GeodesicSolver(mesh).distances(chosen[sources])[:, chosen]
    smoothed = GeodesicSolver(PointCloud(P)).distances(sources)
    monkeypatch.setattr("heat_igl.mesh.neighbourhoods.without_noise", lambda tree: tree)
    as_given = GeodesicSolver(PointCloud(P)).distances(sources)
    assert mean_error(smoothed, expected) < 0.8 * mean_error(as_given, expected)


@pytest.mark.parametrize("n", [500, 3000])
def test_noise_that_makes_distance_wrong_by_more_than_a_twentieth_is_said(n):
    """What the warning says is the mean error, with as much noise along the surface as across it."""
    P, noise = sphere(n), np.random.default_rng(5).standard_normal((n, 3))
    PointCloud(P + 0.03 * noise).report()
    with pytest.warns(AccuracyWarning, match="noise of the points") as caught:
        solver = GeodesicSolver(PointCloud(P + 0.08 * noise))
    said = float(re.search(r"distances are (\d+) % off", str(caught[0].message))[1]) / 100
    sources = [*range(0, n, n // 10)]
    error = mean_error(solver.distances(sources), np.stack([arcs(P, i) for i in sources]))
    assert said == pytest.approx(error, rel=0.3)


def test_one_point_in_a_hundred_is_an_outlier():
    P = sphere(3000)
    cloud = PointCloud(np.concatenate([P, np.random.default_rng(3).uniform(-2, 2, (30, 3))]))
    found = GeodesicSolver(cloud).distance(0)
    left_out = cloud.report().unreferenced_vertices
    assert np.isinf(found[left_out]).all()
    assert len(left_out) > 15
    # As far away as the widest gap that is filled, 1.8 times the radius of a neighbourhood, which is 0.2.
    assert (np.isinf(found[3000:]) | (np.abs(np.linalg.norm(cloud.P[3000:], axis=1) - 1) < 0.36)).all()
    assert mean_error(found[:3000], arcs(P, 0)) < 0.003


@pytest.mark.parametrize("height", [0.05, 1.0])
def test_a_few_points_above_a_surface_belong_to_it_if_they_are_near(height):
    """Six points of a square, at less than two spacings and far above it."""
    P, few = plane(1000), np.array([[0.01 * np.cos(a), 0.01 * np.sin(a), height] for a in np.arange(6)])
    few[:, :2] += 0.5
    found = GeodesicSolver(PointCloud(np.concatenate([P, few]))).distance(0)
    assert np.isfinite(found[:1000]).all()
    assert np.isfinite(found[1000:]).all() if height < 0.1 else np.isinf(found[1000:]).all()


def test_density_that_grows_a_hundredfold():
    x, y = np.random.default_rng(0).random((2, 20_000))
    for across in ((100**x - 1) / 99, np.where(x < 0.5, x / 50, 2 * x - 1)):
        P = np.stack([across, y, np.zeros(len(x))], axis=1)
        assert mean_error(GeodesicSolver(PointCloud(P)).distance(0), np.linalg.norm(P - P[0], axis=1)) < 0.005


def test_rows_ten_times_as_far_apart_as_their_points():
    x, y = np.meshgrid(np.linspace(0, 1, 200), np.linspace(0, 1, 20))
    P = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    P[:, 0] += np.random.default_rng(0).normal(0, 1e-3, len(P))
    assert mean_error(GeodesicSolver(PointCloud(P)).distance(0), np.linalg.norm(P - P[0], axis=1)) < 0.01


@pytest.mark.parametrize("n", [4, 5, 6, 8, 12, 20])
def test_few_points_in_a_plane(n):
    """Distance is no shorter than a straight line, and equal to it if the way stays inside, as from most points."""
    P = plane(n, seed=n)
    cloud = PointCloud(P)
    found = GeodesicSolver(cloud).distance(0)
    excess = found - np.linalg.norm(P - P[0], axis=1)
    assert excess.min() >= -1e-12
    assert np.median(excess) < 1e-9
    vectors = heat_igl.VectorHeatSolver(cloud, method="windows").log_map(0)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), found, atol=1e-9)


@pytest.mark.parametrize("shape", ["sphere", "Moebius strip"])
def test_every_answer_at_a_copy_is_that_at_its_original(shape):
    """Places in faces are the same for every solver, and for the cloud without copies: faces hold originals alone."""
    distinct = sphere(300) if shape == "sphere" else surfaces.moebius_strip(40, 8).V
    of = np.concatenate([np.arange(len(distinct)), np.arange(40), np.arange(10)])
    cloud, alone = PointCloud(distinct[of]), PointCloud(distinct)
    np.testing.assert_array_equal(cloud.originals, of)
    np.testing.assert_array_equal(cloud.F, alone.F)
    assert (cloud.cover is None) == (shape == "sphere")
    place, copy, original = heat_igl.SurfacePoints([3], [[0.2, 0.3, 0.5]]), len(distinct) + 5, 5
    for method in ("sweep", "exact", "heat"):
        found, expected = SolverChoice(method).on(cloud), SolverChoice(method).on(alone)
        np.testing.assert_allclose(found.distance(place), expected.distance(place)[of], atol=1e-9)
        np.testing.assert_allclose(found.distance(copy), expected.distance(original)[of], atol=1e-9)
        np.testing.assert_array_equal(found.voronoi([0, copy]).labels, expected.voronoi([0, original]).labels[of])
    for method in ("heat", "windows"):
        found, expected = (heat_igl.VectorHeatSolver(given, method=method) for given in (cloud, alone))
        np.testing.assert_allclose(found.log_map(copy), expected.log_map(original)[of], atol=1e-9)
        np.testing.assert_allclose(
            found.transport(copy, [[1, 0]]), expected.transport(original, [[1, 0]])[of], atol=1e-9
        )
    values = alone.P[:, 0]
    drawn, expected_discs = discs(cloud, values[of])[0].V, discs(alone, values)[0].V
    n, m = len(of), len(distinct)
    rims, expected_rims = drawn[n:].reshape(n, -1, 3), expected_discs[m:].reshape(m, -1, 3)
    np.testing.assert_allclose(rims[:, 0], expected_rims[of, 0], atol=1e-9)
    traced = heat_igl.trace_geodesic(cloud, copy, [1.0, 0.5], 0.3)
    np.testing.assert_allclose(traced.points, heat_igl.trace_geodesic(alone, original, [1.0, 0.5], 0.3).points)


def two_sheets(n: int, gap: float) -> tuple[np.ndarray, np.ndarray]:
    lower, upper = plane(n, 0), plane(n, 1) + np.array([0, 0, gap])
    return np.concatenate([lower, upper]), np.repeat([[0, 0, -1.0], [0, 0, 1.0]], n, axis=0)


def test_normals_keep_sheets_apart_that_nearly_touch():
    P, normals = two_sheets(2000, 0.002)
    cloud = PointCloud(P, normals)
    with pytest.warns(AccuracyWarning, match="in several parts: triangles join 2000 of 4000 points to none") as caught:
        report = cloud.report()
    assert len(caught) == 1
    np.testing.assert_array_equal(report.cut_off_points, np.flatnonzero(cloud.components != cloud.components[0]))
    assert (cloud.components[:2000] == cloud.components[0]).all()
    assert (cloud.components[2000:] != cloud.components[0]).all()
    distance = GeodesicSolver(cloud).distance(0)
    assert np.isinf(distance[2000:]).all()
    assert np.isfinite(distance[:2000]).all()


def test_normals_that_are_none_of_the_surface_are_left_out():
    P, normals = sphere(2000), sphere(2000, seed=1)
    with pytest.warns(AccuracyWarning, match="normals point to both sides .* pass normals=None") as caught:
        F = PointCloud(P, normals).F
    assert caught[0].filename == __file__
    assert len(caught) == 1
    np.testing.assert_array_equal(F, PointCloud(P).F)


@pytest.mark.parametrize("turned", ["one in a hundred", "two in five", "a cap", "more than half"])
def test_normals_that_point_to_the_other_side_are_turned(turned):
    """Single points, as estimates from neighbours are, and whole patches, which would be sheets of their own."""
    P, at_random = sphere(2000), np.random.default_rng(2).random(2000)
    masks = {"one in a hundred": at_random < 0.01, "two in five": at_random < 0.4}
    is_turned = masks.get(turned, P[:, 2] > (0.9 if turned == "a cap" else -0.2))
    cloud = PointCloud(P, np.where(is_turned, -1, 1)[:, None] * P)
    found, expected = (np.unique(np.sort(F, axis=1), axis=0) for F in (cloud.F, PointCloud(P, P).F))
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_allclose(cloud.normals[is_turned], -P[is_turned], atol=1e-14)
    volume = np.linalg.det(cloud.triangles.V[cloud.F]).sum() / 6  # most points keep their normals
    assert volume * (1 if is_turned.mean() < 0.5 else -1) == pytest.approx(4 / 3 * np.pi, rel=0.02)


def test_normals_of_a_surface_with_one_side_do_not_cut_it():
    """Along some line across a Moebius strip its normals change over, whatever they are."""
    u, v = np.random.default_rng(0).random((2, 2000)) * [[2 * np.pi], [0.8]] - [[0], [0.4]]
    along, across = np.array([-np.sin(u), np.cos(u), 0 * u]), np.array([np.cos(u), np.sin(u), 0 * u])
    ruling = np.cos(u / 2) * across + np.sin(u / 2) * np.array([[0], [0], [1]])
    turn = (np.cos(u / 2) * [[0], [0], [1]] - np.sin(u / 2) * across) / 2 + np.cos(u / 2) * along
    P, normals = (across + v * ruling).T, np.cross((along + v * turn).T, ruling.T)
    cloud = PointCloud(P, normals)
    assert cloud.report().n_boundary_loops == 1
    beside = int(np.argmin(u))
    expected = GeodesicSolver(PointCloud(P)).distance(beside)
    np.testing.assert_allclose(GeodesicSolver(cloud).distance(beside), expected, atol=0.01 * expected.max())


@pytest.mark.filterwarnings("ignore:the points are in several parts")
@pytest.mark.parametrize("thickness", [1.0, 1e-3])
def test_normals_of_both_sides_of_a_thin_shell_are_oriented(thickness):
    """Of two neighbours in three, or of every second one, the normals are opposite, and yet they do not contradict."""
    P = sphere(4000)
    outside = np.arange(4000) < 2000
    radius = np.where(outside, 1, 1 - thickness * np.sqrt(4 * np.pi / 2000))[:, None]
    cloud = PointCloud(radius * P, np.where(outside, 1, -1)[:, None] * P)
    assert not np.isin(cloud.components[outside], cloud.components[~outside]).any()


@pytest.mark.filterwarnings("ignore:the points are in several parts")
@pytest.mark.parametrize("gap", [0.5, 1.2])
def test_two_sheets_nearer_than_the_spacing_are_said_to_be_one(gap):
    P, normals = two_sheets(1500, gap / np.sqrt(1500))
    with pytest.warns(AccuracyWarning, match=r"two sheets 0.0\d+ apart, .* pass PointCloud\(P, normals\)"):
        assert PointCloud(P).report().n_components == 1
    assert PointCloud(P, normals).report().n_components == 2
    noisy = PointCloud(plane(1500) + 0.4 / np.sqrt(1500) * np.random.default_rng(0).standard_normal((1500, 3)))
    assert noisy.report().noise == pytest.approx(0.4 / np.sqrt(1500), rel=0.1)


def test_a_report_names_border_copies_and_points_where_sheets_may_be_joined():
    P = plane(400)
    found = PointCloud(np.concatenate([P, P[:3], [[0.5, 0.5, 2]]])).report()
    assert (found.n_copies, found.noise, found.doubtful_points.tolist()) == (3, 0, [])
    assert found.unreferenced_vertices.tolist() == [403]
    assert set(found.boundary_points) >= set(P[:, 0].argsort()[[0, -1]])
    # Two sheets at an angle of 20 degrees, with a common edge: nearer than five spacings nearly everywhere.
    P, angle = plane(400, 2) - [0.5, 0, 0], np.deg2rad(20)
    folded = np.stack([np.where(P[:, 0] < 0, 1, -np.cos(angle)) * P[:, 0], P[:, 1], np.sin(angle) * P[:, 0]], axis=1)
    folded[P[:, 0] < 0, 2] = 0
    with pytest.warns(AccuracyWarning, match=r"do not tell their surface: at \d+ of 400, .* or normals"):
        doubtful = PointCloud(folded).report().doubtful_points
    assert len(doubtful) > 5


def test_gaps_at_which_a_sheet_is_torn_are_doubtful():
    """Of a Klein bottle, where it passes through itself: triangles there end or go on in the other sheet."""
    mesh = zoo("klein bottle")
    doubtful = PointCloud(mesh.V).report().doubtful_points
    assert len(doubtful) > 30
    # Among the 30 nearest points there are some to which the way is far.
    straight = np.linalg.norm(mesh.V[doubtful, None] - mesh.V, axis=2)
    is_near = straight <= np.sort(straight, axis=1)[:, 30:31]
    way = GeodesicSolver(mesh).distances(doubtful.tolist())
    assert (is_near & (way > 5 * straight)).any(axis=1).all()


@pytest.mark.parametrize(
    ("slot", "pitch", "said"), [(0.3, 15, ""), (3.5, 15, "bridge a gap"), (9, 15, ""), (0, 3, "tilt by (28|29|3)")]
)
def test_slots_that_are_bridged_and_bends_from_point_to_point_are_said(slot, pitch, said):
    """In spacings: a slot through most of a square, as where points are missing, and right-angled folds."""
    x, y, z = plane(2500).T
    z[:] = np.abs((x + 7) % (pitch / 25) - pitch / 50) if slot < 1 else 0
    kept = (np.abs(x - 0.5) > slot / 100) | (y < 0.2)
    with pytest.warns(AccuracyWarning, match=said) if said else nullcontext():
        report = PointCloud(np.stack([x, y, z], axis=1)[kept]).report()
    assert (report.tilt > 27) == (pitch == 3)
    if slot > 1:
        beside = np.abs(x[kept] - 0.5)[report.doubtful_points] < slot / 100 + 0.03
        assert (np.count_nonzero(beside) > 40) == bool(said)
        assert np.mean(beside) > 0.9 or not said


@pytest.mark.parametrize(("n", "said"), [(800, "bridge a gap"), (2000, "")])
def test_a_triangle_between_the_turns_of_a_roll_is_said(n, said):
    """Where few points are at the border; distances are 8 % off in the mean, of other rolls 46, in silence before."""
    t, y = plane(n, 1)[:, :2].T * [[3 * np.pi], [15]] + [[1.5 * np.pi], [0]]
    with pytest.warns(AccuracyWarning, match=said) if said else nullcontext():
        found = GeodesicSolver(PointCloud(np.stack([t * np.cos(t), y, t * np.sin(t)], axis=1))).distance(0)
    along = (t * np.sqrt(1 + t**2) + np.arcsinh(t)) / 2
    exact = np.hypot(along - along[0], y - y[0])
    assert (np.abs(found - exact).mean() > 0.05 * exact.mean()) == bool(said)


def test_torn_points_are_more_than_four_edges_from_another_of_a_part():
    F, rng = heat_igl.shapes.grid(12).F.astype(np.int32), np.random.default_rng(0)
    nearest, is_part = rng.integers(0, 169, (200, 3), np.int32), rng.random(169) < 0.8
    graph = csr_array((np.ones(F.size), (F.ravel(), np.roll(F, 1, axis=1).ravel())), shape=(169, 169))
    away = dijkstra(graph, directed=False, unweighted=True)[nearest[:, :1], nearest[:, 1:]]
    is_torn = ((away > 4) & is_part[nearest[:, 1:]]).any(axis=1)
    np.testing.assert_array_equal(torn_points(F, nearest, is_part, 4), nearest[is_torn, 0])
    assert 0 < is_torn.sum() < 200


@pytest.mark.filterwarnings("ignore:the points do not tell their surface")
@pytest.mark.parametrize("name", ["cliff", "pill", "elbow", "two spheres 1 to 10", "plate", "gear"])
def test_a_cloud_that_falls_into_parts_says_so(name):
    cloud = PointCloud(zoo(name).V)
    with pytest.warns(AccuracyWarning, match=r"in several parts: triangles join \d+ of \d+ points to none in the"):
        cut_off = cloud.report().cut_off_points
    source = int(np.setdiff1d(np.arange(cloud.n_vertices), cut_off)[0])
    np.testing.assert_array_equal(np.flatnonzero(np.isinf(GeodesicSolver(cloud).distance(source))), cut_off)
    assert len(cut_off) > 0


@pytest.mark.filterwarnings("ignore:the points")
@pytest.mark.parametrize("name", ["cone", "cube less one", "octahedron", "needle fan", "stairs"])
def test_single_points_and_rows_beside_a_surface_belong_to_it(name):
    """The tip of a cone, corners, and points in a row, which no plane joins, but one by one what was joined before."""
    cloud = PointCloud(zoo(name).V)
    assert np.isfinite(GeodesicSolver(cloud).distance(0)).all()
    assert cloud.report().cut_off_points.size == 0


def test_four_points_are_enough_and_arrays_are_read_only():
    cloud = PointCloud([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], 5 * np.ones((4, 3)))
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1)
    for array in (cloud.P, cloud.normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


# Files.


def written(folder, kind: str, P: np.ndarray, N: np.ndarray):
    """A file of points and normals that single precision holds exactly."""
    path = folder / f"cloud.{kind}"
    rows = np.concatenate([P, N], axis=1)
    if kind == "ply":
        header = "ply\nformat ascii 1.0\nelement vertex 40\n"
        header += "".join(f"property float {name}\n" for name in "x y z nx ny nz".split()) + "end_header\n"
        path.write_text(header + "\n".join(" ".join(map(repr, row)) for row in rows.tolist()))
    elif kind == "obj":
        lines = [f"v {' '.join(map(repr, p))}" for p in P.tolist()]
        path.write_text("\n".join([*lines, *(f"vn {' '.join(map(repr, v))}" for v in N.tolist())]))
    elif kind == "xyz":
        path.write_text("# points\n" + "\n".join(", ".join(map(repr, row)) for row in rows.tolist()))
    else:
        np.save(path, rows)
    return path


@pytest.mark.parametrize("kind", ["ply", "obj", "xyz", "npy"])
def test_formats(tmp_path, kind):
    P = sphere(40).astype(np.float32).astype(np.float64)
    cloud = heat_igl.read_point_cloud(written(tmp_path, kind, P, 2 * P))  # normals need not have length 1
    np.testing.assert_array_equal(cloud.P, P)
    np.testing.assert_allclose(cloud.normals, P, atol=1e-6)
    others = 0 * P if kind in ("ply", "obj") else np.rint(255 * P**2) * [0, 1, 1]  # no normals, or colours
    assert heat_igl.read_point_cloud(written(tmp_path, kind, P, others)).normals is None


@pytest.mark.parametrize("kind", ["ply", "xyz", "npy"])
@pytest.mark.parametrize("missing", [0.0, np.nan])
def test_missing_normals_of_a_file_leave_all_out(tmp_path, kind, missing):
    """As programs write them that find no plane at an outlier."""
    P = sphere(40).astype(np.float32).astype(np.float64)
    path = written(tmp_path, kind, P, np.where(np.arange(40)[:, None] == 7, missing, P))
    with pytest.warns(AccuracyWarning, match="1 of 40 normals are 0 or not finite, the first that .* 7") as caught:
        cloud = heat_igl.read_point_cloud(path)
    assert cloud.normals is None
    assert caught[0].filename == __file__
    np.testing.assert_array_equal(cloud.P, P)


@pytest.mark.parametrize("kind", ["xyz", "npy"])
def test_colours_are_no_normals(tmp_path, kind):
    P = sphere(40)
    colours = np.random.default_rng(0).integers(0, 256, (40, 3))
    for columns in (colours, colours / 255, np.full((40, 3), 128)):
        assert heat_igl.read_point_cloud(written(tmp_path, kind, P, columns)).normals is None
    # Normals of a plane lie in the range of colours.
    upwards = np.tile([0, 0, 1], (40, 1))
    np.testing.assert_array_equal(heat_igl.read_point_cloud(written(tmp_path, kind, P, upwards)).normals, upwards)


def test_attributes_of_points_go_to_ply(tmp_path):
    cloud = PointCloud(sphere(40), sphere(40))
    heat_igl.write_point_cloud(tmp_path / "a.ply", cloud, distance=np.append(np.inf, np.arange(39.0)))
    again = heat_igl.read_point_cloud(tmp_path / "a.ply")
    np.testing.assert_array_equal(again.P, cloud.P)
    _, others = ply.read_vertices(tmp_path / "a.ply", (tmp_path / "a.ply").read_bytes())
    assert others["distance"].tolist() == [np.inf, *range(39)]
    for name, values, message in (
        ("a.xyz", {"d": np.zeros(40)}, r"holds no attributes of points \(d\); .ply does"),
        ("a.ply", {"nx": np.zeros(40)}, "nx must be another name"),
        ("a.ply", {"d": np.zeros((40, 2))}, r"d must .* have shape \(n,\)"),
        ("a.ply", {"d": np.zeros(39)}, r"d must have shape \(40,\)"),
    ):
        with pytest.raises(MeshError, match=message):
            heat_igl.write_point_cloud(tmp_path / name, cloud, **values)


@pytest.mark.parametrize("kind", ["ply", "obj", "xyz", "npy"])
def test_the_command_line_takes_clouds(tmp_path, kind, capsys):
    pytest.importorskip("typer")
    P = sphere(40).astype(np.float32).astype(np.float64)
    path, out = written(tmp_path, kind, P, P), tmp_path / "out.npy"
    points = ["--points"] if kind in ("ply", "obj") else []
    assert cli.run(["distance", str(path), "--source=3", f"--output={out}", "--json=-", *points]) == 0
    expected = heat_igl.geodesic_distance(heat_igl.read_point_cloud(path), 3)
    np.testing.assert_array_equal(np.load(out), expected)
    assert json.loads(capsys.readouterr().out)["point_cloud"]["n_vertices"] == 40
    assert cli.run(["info", str(path), *points]) == 0
    capsys.readouterr()
    if points:
        assert cli.run(["info", str(path)]) == 1
        assert "--points" in capsys.readouterr().err


def test_a_file_with_faces_is_a_mesh_unless_points_are_asked_for(tmp_path, capsys):
    pytest.importorskip("typer")
    for name in ("mesh.ply", "mesh.obj"):
        heat_igl.write_mesh(tmp_path / name, shapes.icosphere(1))
        np.testing.assert_array_equal(heat_igl.read_point_cloud(tmp_path / name).P, shapes.icosphere(1).V)
        assert cli.run(["distance", str(tmp_path / name), "--source=3", "--json=-"]) == 0
        assert json.loads(capsys.readouterr().out)["mesh"]["n_triangles"] == 80
    heat_igl.write_point_cloud(tmp_path / "cloud.ply", PointCloud(sphere(40)))
    cloud = [str(tmp_path / "cloud.ply"), "--points"]
    assert cli.run(["distance", *cloud, "--source=3", f"--output={tmp_path / 'a.vtu'}"]) != 0
    assert "points with distances go to .ply, .npy or .csv files" in capsys.readouterr().err


# Pictures.


def test_discs_lie_in_the_tangent_planes_and_continue_the_values():
    P = plane(400)
    cloud = PointCloud(P)
    slope = np.array([3.0, -2.0, 0.0])
    mesh, values = discs(cloud, P @ slope)
    np.testing.assert_array_equal(mesh.V[:400], P)
    assert np.abs(mesh.V[:, 2]).max() < 1e-12
    corners = mesh.F[np.isin(mesh.F[:, 0], np.flatnonzero((np.abs(P[:, :2] - 0.5) < 0.3).all(axis=1)))]
    np.testing.assert_allclose(values[corners], mesh.V[corners] @ slope, atol=1e-9)
    # No gap: every point inside lies on a disc.
    radius = np.linalg.norm(mesh.V[mesh.F[:, 1]] - mesh.V[mesh.F[:, 0]], axis=1)
    at = 0.3 + 0.4 * np.random.default_rng(0).random((2000, 2))
    distance = np.linalg.norm(at[:, None] - P[None, :, :2], axis=2)
    assert (distance < radius.reshape(400, -1).min(axis=1)).any(axis=1).mean() > 0.98
    flat, as_given = discs(cloud, P @ slope, is_flat=True)
    np.testing.assert_array_equal(as_given[flat.F].max(axis=1), as_given[flat.F[:, 0]])


# The triangles fit together.


@pytest.mark.parametrize(("angle", "width", "n_loops"), [(20, 1.1, 1), (180, 1.1, 1), (180, 3.6, 2)])
def test_loops_of_outer_edges_are_filled_in_space(angle, width, n_loops):
    """Holes in a fold, where tangent planes show no gap, and where it is flat: the border and wide holes stay."""
    mesh = heat_igl.shapes.grid(40)
    x, y, _ = (mesh.V - mesh.V.mean(axis=0)).T
    spacing = 2 * x.max() / 40
    # The two halves are so many degrees apart.
    half = np.deg2rad(angle / 2)
    P = np.stack([np.abs(x) * np.cos(half), y, x * np.sin(half)], axis=1)
    F = mesh.F[~(np.hypot(x, y) < width * spacing)[mesh.F].any(axis=1)].astype(np.int32)
    filled = with_gaps_filled(P, F, np.full(len(P), 3.1 * spacing))[0]
    assert heat_igl.Mesh(P, F).report().n_boundary_loops == 2
    assert heat_igl.Mesh(P, filled).report().n_boundary_loops == n_loops
    assert two_sided_cover(heat_igl.Mesh(P, filled)) is None


def test_a_bite_out_of_the_border_stays():
    """Half a circle of radius 3.2; a hole as wide is closed, but at the border no far points are joined."""
    P = np.stack(np.meshgrid(np.arange(-15.0, 16.0), np.arange(16.0), 0.0), axis=-1).reshape(-1, 3)
    rim = 3.2 * np.exp(1j * np.linspace(0, np.pi, 11))
    P = np.concatenate([np.stack([rim.real, rim.imag, 0 * rim.real], axis=1), P[np.linalg.norm(P, axis=1) > 3.7]])
    assert GeodesicSolver(PointCloud(P)).distance(0)[10] == pytest.approx(3.2 * np.pi, rel=0.04)
    # Where the spacing changes, the side of a notch may be as long as at the point that is farther from others.
    P = np.array([[0, 2, 0], [-1, 1, 0], [0, 0, 0], [0.5, 0, 0], [0.25, -0.5, 0]])
    F = np.array([[0, 1, 2], [1, 4, 2], [2, 4, 3]], np.int32)
    filled = [with_gaps_filled(P, F, np.array([reach, 1.7, 1.7, 1.7, 1.7]))[0] for reach in (1.7, 3.3)]
    assert [np.sort(each[3:], axis=1).tolist() for each in filled] == [[], [[0, 2, 3]]]


def test_the_border_of_a_small_piece_is_no_gap():
    ball = heat_igl.shapes.icosphere(2)
    F = ball.F[(ball.V[:, 2] > 0.5)[ball.F].all(axis=1)].astype(np.int32)
    n = ball.n_vertices
    filled = with_gaps_filled(ball.V, F, np.full(n, 10.0))[0]
    np.testing.assert_array_equal(np.unique(filled, axis=0), np.unique(F, axis=0))


def is_a_surface(F: np.ndarray, n: int) -> bool:
    report = heat_igl.Mesh(np.eye(n, 3), F).report()
    return len(report.nonmanifold_edges) + len(report.nonmanifold_vertices) == 0


def each_side_once(F: np.ndarray) -> bool:
    """Whether no two triangles have a side in the same direction: neighbours are oriented alike."""
    sides = F[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    return len(np.unique(sides, axis=0)) == len(sides)


@pytest.mark.parametrize(("around_tube", "around_hole"), [(12, 24), (18, 18), (30, 30), (50, 50), (24, 60)])
def test_points_of_a_regular_torus_make_a_closed_surface(around_tube, around_hole):
    """Four points of each cell lie on a circle, and three points of a meridian on a line in a tangent plane."""
    mesh = shapes.torus(around_tube, around_hole)
    cloud = PointCloud(mesh.V)
    report = cloud.report()
    assert (report.euler_characteristic, report.n_boundary_loops, cloud.n_faces) == (0, 0, mesh.n_faces)
    assert is_a_surface(cloud.F, mesh.n_vertices)
    upper = mesh.V[:, 2] > 0.15
    side = heat_igl.SignedHeatSolver(cloud).distance(upper)
    assert (side[mesh.V[:, 2] > 0.3] < 0).all()
    assert (side[mesh.V[:, 2] < -0.1] > 0).all()
    found = GeodesicSolver(cloud, method="exact").directions(0)
    on_mesh = GeodesicSolver(mesh, method="exact").directions(0)
    np.testing.assert_allclose(found.distance, on_mesh.distance, atol=0.03 * on_mesh.distance.max())
    np.testing.assert_allclose(np.linalg.norm(found.gradient[1:], axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_fans_that_meet_in_a_point_are_joined(seed):
    """Some triangles of two closed surfaces with vertices in common, no neighbours, all of which run alike.

    Joined ones run against their neighbours; no edge gets a third, no vertex several fans, and none goes that fits.
    """
    torus, rng = shapes.torus(12, 16), np.random.default_rng(seed)
    N = torus.n_vertices
    common, of_second = np.arange(N).reshape(-1, 16)[::2, ::2].ravel(), np.arange(N, 2 * N)
    of_second[common] = rng.permutation(common)
    F = np.concatenate([torus.F, of_second[torus.F]])
    # No fan around a common vertex is closed.
    row, at = np.nonzero(np.isin(F, common))
    first = row[np.unique(F[row, at] + 2 * N * (row >= torus.n_faces), return_index=True)[1]]
    F = np.delete(F, np.append(first, rng.choice(len(F), 100)), axis=0).astype(np.int32)
    V = np.concatenate([torus.V, torus.V @ [[0, 1, 0], [0, 0, 1], [1, 0, 0]]])
    pinched = heat_igl.Mesh(V, F).report().nonmanifold_vertices
    np.testing.assert_array_equal(pinched, np.intersect1d(F, np.flatnonzero(~igl.is_vertex_manifold(F))))
    # Nothing else is near enough to be filled.
    joined = with_gaps_filled(V, F, np.zeros(len(V)))[0]
    assert is_a_surface(joined, 2 * N)
    assert each_side_once(joined)
    given, kept = ({tuple(row) for row in np.sort(rows, axis=1).tolist()} for rows in (F, joined))
    assert kept - given
    for row in given - kept:
        assert not is_a_surface(np.append(joined, [row], axis=0), 2 * N)
    assert np.unique(joined).size == np.unique(F).size


# Neighbours.


@pytest.mark.parametrize("stride", [1, 3])
@pytest.mark.parametrize("kind", ["underflow", "grid"])
def test_neighbours_come_after_the_point_by_distance_and_number(kind, stride):
    """Also where squares of distances underflow; at the largest distance, any of the points there are taken."""
    P = np.stack(np.mgrid[:9, :9, :4], axis=-1).reshape(-1, 3).astype(float)
    if kind == "underflow":
        P = np.random.default_rng(0).standard_normal((300, 3))
        P[1:40] = P[0] * (1 + 1e-15 * np.arange(1, 40)[:, None])
        P[40:80] = 1e-170 * np.random.default_rng(1).standard_normal((40, 3))
    tree, points, others = point_tree(P), np.arange(0, 300, 2), np.arange(0, len(P), stride)
    np.testing.assert_array_equal(tree.P, P[tree.order])
    index = tree.neighbours_of(points, 19, stride)
    np.testing.assert_array_equal(index[:, 0], points)
    far = np.square(tree.P[points][:, None] - tree.P[others]).sum(axis=2)
    far[points[:, None] == others] = np.inf
    found = np.square(tree.P[index[:, 1:]] - tree.P[points][:, None]).sum(axis=2)
    np.testing.assert_allclose(found, np.sort(far, axis=1)[:, :19], rtol=1e-12)
    assert np.isin(index[:, 1:], others).all()
    assert (np.diff(np.sort(index, axis=1), axis=1) > 0).all()
    assert (np.diff(index[:, 1:], axis=1)[np.diff(found, axis=1) == 0] > 0).all()


def test_principal_axes():
    """They are numpy's eigenvectors."""
    P = np.random.default_rng(0).uniform(-1, 1, (41, 3)) * [1, 0.8, 0.2]
    index = np.argsort(np.linalg.norm(P - P[0], axis=1)).astype(np.int32)[None]
    way = P[index[0]] - P[0]
    axes, bend = tangent_planes(P, index)
    weights = np.maximum(1 - np.square(way).sum(axis=1) / np.square(way[-1]).sum(), 1e-3)
    expected, vectors = np.linalg.eigh(np.cov(way.T, aweights=weights, ddof=0))
    np.testing.assert_allclose(bend[0], expected[0] / expected[1], rtol=1e-9)
    np.testing.assert_allclose(np.abs(axes[0][::-1] @ vectors), np.eye(3), atol=1e-9)


@pytest.mark.parametrize("k", [16, 31, 34, 61])
def test_a_quadric_is_that_of_weighted_least_squares(k):
    P = np.random.default_rng(7).random((400, 3)) * [1, 1, 0.1]
    tree = point_tree(P)
    index = tree.neighbours_of(np.arange(400), k - 1)
    square = np.square(tree.P[index] - tree.P[:, None]).sum(axis=2)
    axes, _ = tangent_planes(tree.P, index)
    # The order of the neighbours does not matter.
    moved, deviation = onto_quadrics(tree.P, np.append(index[:, :1], index[:, :0:-1], axis=1))
    for i in range(0, 400, 37):
        reach = np.sqrt(square[i, -1])
        x, y, z = axes[i] @ (tree.P[index[i]] - tree.P[i]).T / reach
        root = np.sqrt(np.maximum(1 - square[i] / square[i, -1], 1e-3))
        terms = np.stack([np.ones(k), x, y, x * x, x * y, y * y], axis=1)
        found = np.linalg.lstsq(root[:, None] * terms, root * z, rcond=None)[0]
        np.testing.assert_allclose(moved[i], tree.P[i] + reach * found[0] * axes[i, 2], atol=1e-6)
        squares = ((root * (z - terms @ found)) ** 2).sum() / (root**2).sum()
        assert deviation[i] == pytest.approx(np.sqrt(squares / max(1 - 6 / (k - 1), 0.5)), rel=1e-6)


def test_a_point_of_a_paraboloid_stays_on_it():
    x, y = np.random.default_rng(8).uniform(-1, 1, (2, 20))
    x, y = np.append(x, -x), np.append(y, -y)
    P = np.stack([x, y, 0.3 * x**2 - 0.2 * x * y + 0.1 * y**2], axis=1)
    P = np.append(np.zeros((1, 3)), P, axis=0) + np.array([0, 0, 5])
    for scale in (1, 1e-50, 1e50):
        moved, deviation = onto_quadrics(scale * P, np.arange(41, dtype=np.int32)[None])
        np.testing.assert_allclose(moved / scale, P[:1], atol=1e-6)
        assert deviation < 1e-6


# Sheets, and the orientation of the triangles.


@pytest.mark.filterwarnings("ignore:the points do not tell their surface")  # at the borders of both
@pytest.mark.parametrize("gap", [2.0, 3.0, 5.0])
def test_sheets_without_normals_stay_apart(gap):
    """In spacings; in the neighbourhoods of 30 points there are points of both sheets."""
    P, _ = two_sheets(1500, gap / np.sqrt(1500))
    inner = (np.abs(P[:, :2] - 0.5) < 0.35).all(axis=1)
    upper = P[:, 2] > 0
    F = PointCloud(P).F
    F = F[inner[F].all(axis=1)]
    assert len(F) > 2000
    assert (upper[F].any(axis=1) == upper[F].all(axis=1)).all()


def test_the_two_sides_of_a_thin_disc():
    """Its rim joins them: the distance to the point opposite the centre is that over the rim."""
    rng, n, thickness = np.random.default_rng(3), 3000, 0.12
    radius, angle = np.sqrt(rng.random(n)), 2 * np.pi * rng.random(n)
    radius[:2] = 0
    flat = np.stack([radius * np.cos(angle), radius * np.sin(angle), thickness * (0.5 - np.arange(n) % 2)], axis=1)
    # A round rim, so that there is one surface.
    turn, around = np.pi * (rng.random((2, 400)) - 0.5) * [[1], [2]]
    out = 1 + thickness / 2 * np.cos(turn)
    rim = np.stack([out * np.cos(around), out * np.sin(around), thickness / 2 * np.sin(turn)], axis=1)
    distance = GeodesicSolver(PointCloud(np.concatenate([flat, rim])), method="exact").distance(0)
    assert distance[1] == pytest.approx(2 + np.pi * thickness / 2, rel=0.03)


def test_triangles_that_contradict_are_left_out_if_they_are_few_and_on_a_fold():
    strips = (surfaces.moebius_strip(m, 1, 0.1) for m in (1000, 50))
    (P, F), short = ((strip.V, strip.F.astype(np.int32)) for strip in strips)
    creased = P.copy()
    creased[:2, 2] += 0.1  # across the strip: the two sides of this rung nearly lie on each other
    found, _ = oriented(creased, F, None)
    stay = {tuple(row) for row in np.sort(F, axis=1).tolist()} & {tuple(row) for row in np.sort(found, axis=1).tolist()}
    assert len(F) - 2 <= len(stay) < len(F)
    assert each_side_once(found)
    assert len(np.unique(found)) == len(P)
    for flat in ((P, F), short):
        np.testing.assert_array_equal(np.sort(oriented(*flat, None)[0], axis=1), np.sort(flat[1], axis=1))


def test_a_wrong_join_that_bends_where_it_begins_turns_no_sheet_around():
    """Two triangles between the sides of a flat tube, flat with one side each, and one that bends at the first."""
    across = np.append(np.arange(9.0), np.arange(8.0, -1, -1)), np.arange(7.0)[:, None], np.repeat([0.2, 0.0], 9)
    tube = lattice_mesh(*across, wrap_columns=True)
    F = [row for row in tube.F.tolist() if row not in ([57, 58, 75], [66, 67, 84])]
    joined = np.array([*F, [57, 75, 66], [75, 84, 66], [57, 66, 126]], np.int32)
    joined[::2] = joined[::2, [0, 2, 1]]
    found, _ = oriented(np.append(tube.V, [[4, 3, 3]], axis=0), joined, None)
    rows = {tuple(np.roll(row, -np.argmin(row))) for row in found.tolist()}
    runs_alike = [tuple(np.roll(row, -np.argmin(row))) in rows for row in F]
    assert sum(runs_alike) in (0, len(F))


def test_neighbours_across_a_right_angle_stay():
    P = plane(2000)
    folded = np.where(P[:, :1] < 0.5, P, np.stack([0 * P[:, 0] + 0.5, P[:, 1], P[:, 0] - 0.5], axis=1))
    index, _ = point_tree(folded).neighbours
    kept, _, _ = one_sheet(point_tree(folded).P, index, tangent_planes(point_tree(folded).P, index)[0])
    assert (kept[:, :8] >= 0).mean() > 0.99


def test_the_star_of_a_point_keeps_distances_and_directions():
    """As if each neighbour were turned into the plane about the point: projected ones would come nearer."""
    P = np.random.default_rng(0).uniform(-1, 1, (40, 3))
    P[0] = 0
    P = P[np.argsort(np.linalg.norm(P, axis=1))]
    flat = P * [1, 1, 0]
    turned = flat * (np.linalg.norm(P, axis=1) / np.maximum(np.linalg.norm(flat, axis=1), 1e-9))[:, None]
    axes, index = np.tile(np.eye(3), (40, 1, 1)), np.tile(np.arange(40, dtype=np.int32), (40, 1))

    def star(P):
        corners = delaunay_stars(P, axes, index, np.full(40, 9.0), np.full(40, -2.0), 0, 1)[0]
        return {tuple(row) for row in np.sort(corners, axis=1).tolist()}

    assert star(P) == star(turned) != star(flat)


def test_two_fans_are_joined_where_they_are_nearest():
    """Two squares with a corner in common: its neighbours are 1.33 apart on one side, and 1.56 on the other."""
    P = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1.5, 1.2, 0.3], [2, 2, 0], [1.2, 2, 0]], float)
    F = np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]], np.int32)
    joined = with_gaps_filled(P, F, np.zeros(7))[0]
    np.testing.assert_array_equal(joined[:4], F)
    assert np.sort(joined[4:], axis=1).tolist() == [[1, 2, 4]]


def test_beside_a_closed_fan_triangles_stay_only_where_they_are_the_connection():
    """A triangle at the middle of a hexagon, whose other side is joined to the rim or not."""
    hexagon, flap, link = [[0, i, i % 6 + 1] for i in range(1, 7)], [[0, 7, 8]], [[2, 1, 7], [1, 8, 7]]
    P = np.random.default_rng(0).random((9, 3))
    for F, expected in ((hexagon + flap + link, hexagon + link), (hexagon + flap, hexagon + flap)):
        given = np.array(F, np.int32)
        np.testing.assert_array_equal(pinched_vertices(given, 9), [0])
        np.testing.assert_array_equal(with_gaps_filled(P, given, np.zeros(9))[0], expected)


def test_edges_of_triangles_that_are_given_up_are_free_again():
    """Of two loops at one point: in the first a single ear may be cut, which folds back and closes nothing."""
    P = np.zeros((13, 3))
    P[:9, :2] = [[0, 0], [1, -1], [2, 0], [2, 5], [0, 5], [-1, -1], [-2, 0], [-2, 5], [-1, 5]]
    P[9:] = [[2, 0, 1.5], [0, 0, 1.5], [-1, -5, 0], [0, 9, 0]]
    loops = np.array([[0, 1, 2, 3, 4], [0, 5, 6, 7, 8]])
    F = np.stack([[9, 10, 12, 12, 12, 11, 11, 12, 12, 12], np.roll(loops, -1, axis=1).ravel(), loops.ravel()], axis=1)
    # Two triangles on each other have the edges of the ears at the common point, which cannot be cut then.
    F = np.concatenate([F, [[9, 1, 4], [9, 1, 4], [9, 5, 8], [9, 5, 8]]]).astype(np.int32)
    twin, of_next = np.full(F.size, -1, np.int32), 3 * np.roll(np.arange(10), -1) + 1
    twin[2:30:3], twin[of_next], twin[30:] = of_next, range(2, 30, 3), [33, 34, 35, 30, 31, 32, 39, 40, 41, 36, 37, 38]
    largest = np.where(np.isin(np.arange(13), [3, 4, 7, 8]), 0.0, 10.0)
    filled, is_whole = filling_triangles(P, F, twin, np.arange(13) < 9, largest, -0.1, 0.99)
    assert (filled.tolist(), is_whole.tolist()) == ([[0, 5, 6]], [False])


@pytest.mark.parametrize("seed", range(3))
def test_several_fans_of_a_point_are_joined_in_one_round(seed):
    """Triangles that touch in a point alone, in a plane: those between them go around it but for one gap."""
    angle = np.sort(np.random.default_rng(seed).random(10)) * 2 * np.pi
    rim = np.stack([np.cos(angle), np.sin(angle), np.zeros(10)], axis=1)
    P, F = np.concatenate([[[0, 0, 0]], rim]), np.array([[0, i, i + 1] for i in range(1, 10, 2)], np.int32)
    joined = with_gaps_filled(P, F, np.zeros(11))[0]
    assert len(joined) == 9
    assert is_a_surface(joined, 11)
    assert two_sided_cover(heat_igl.Mesh(P, joined)) is None


def test_vectors_on_both_sides_are_those_on_one(monkeypatch):
    """On a surface that can be oriented, the sides are two parts, and the second must change nothing."""
    cloud = PointCloud(sphere(800))
    given = [[1.0, 0.3], [-0.2, 0.5]]
    for method in ("heat", "windows"):
        with monkeypatch.context() as patch:
            one = heat_igl.VectorHeatSolver(cloud, method=method)
            patch.setattr("heat_igl.mesh.cloud_orientation.pinched_vertices", lambda *_: [0])
            both = heat_igl.VectorHeatSolver(PointCloud(cloud.P), method=method)
        assert both.operators.n == 2 * one.operators.n
        for name in ("x", "y", "normal"):
            np.testing.assert_allclose(getattr(both.frames, name), getattr(one.frames, name), atol=1e-12)
        np.testing.assert_allclose(both.transport([3, 500], given), one.transport([3, 500], given), atol=1e-6)
        np.testing.assert_allclose(both.extend([3, 500], [1, 2]), one.extend([3, 500], [1, 2]), atol=1e-6)
        np.testing.assert_allclose(both.log_map(3), one.log_map(3), atol=1e-6)
        np.testing.assert_array_equal(both.reaches(3), np.ones(800, bool))


@pytest.mark.filterwarnings("ignore:heat is off")
def test_vectors_pass_the_line_along_which_a_surface_with_one_side_changes_orientation():
    """From a point on the line where the triangles of a Moebius strip contradict, as on a piece with two sides."""
    turn, side = np.random.default_rng(0).random((2, 3000)) * [[2 * np.pi], [0.8]] - [[0], [0.4]]
    strip = PointCloud(surfaces.points_of_moebius_strip(turn, side))
    F = strip.triangles.F
    sides, counts = np.unique(F[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=0, return_counts=True)
    source = int(sides[np.argmax(counts), 0])
    assert counts.max() == 2
    away = np.abs((turn - turn[source] + np.pi) % (2 * np.pi) - np.pi)
    of_piece = np.flatnonzero(away < 2.4)
    piece = PointCloud(strip.P[of_piece])
    start = int(np.flatnonzero(of_piece == source)[0])
    compared = away[of_piece] < 1
    for method, most in (("windows", 1e-3), ("heat", 0.02)):
        found = []
        for cloud, at in ((strip, source), (piece, start)):
            solver = heat_igl.VectorHeatSolver(cloud, method=method)
            assert solver.reaches(at).all()
            frames = solver.frames
            vectors = frames.to_world(solver.transport(at, frames.from_world([[1, 2, 3]], [at])))
            logarithms = solver.log_map(at) @ [frames.x[at], frames.y[at]]
            found.append([a if cloud is piece else a[of_piece] for a in (vectors, logarithms)])
        for on_strip, on_piece in zip(*found, strict=True):
            assert np.linalg.norm(on_strip - on_piece, axis=1)[compared].mean() < most
    distance = GeodesicSolver(strip, method="exact").distance(source)
    np.testing.assert_allclose(np.linalg.norm(heat_igl.log_map(strip, source), axis=1), distance, rtol=1e-6)
