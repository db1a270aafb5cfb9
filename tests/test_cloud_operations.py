"""What works on a mesh works on points, or is refused by name: a table of operations and kinds of domains."""

import pickle
from functools import cache

import numpy as np
import pytest
from surfaces import points_of_moebius_strip, points_of_sphere

import heat_igl
from heat_igl import GeodesicSolver, Mesh, MeshError, PointCloud, SurfacePoints
from heat_igl.reference import edge_paths

DOMAINS = ("mesh", "oriented cloud", "cloud with one side", "noisy cloud")
A, B = 3, 40


@cache
def domain(name: str) -> Mesh | PointCloud:
    """A sphere, points of it with normals, of a Moebius strip, and of a sphere with noise of a third of the spacing."""
    if name == "mesh":
        return heat_igl.shapes.icosphere(3)
    rng = np.random.default_rng(0)
    if name == "cloud with one side":
        turn, side = rng.random((2, 1200)) * [[2 * np.pi], [0.8]] - [[0], [0.4]]
        return PointCloud(points_of_moebius_strip(turn, side))
    P = points_of_sphere(800)
    return PointCloud(P, P) if name == "oriented cloud" else PointCloud(P + 0.04 * rng.standard_normal(P.shape))


def surface(name: str) -> Mesh:
    return heat_igl.as_mesh(domain(name)) if name == "mesh" else domain(name).triangles


@cache
def exact(name: str, source: int) -> np.ndarray:
    return GeodesicSolver(domain(name), method="exact").distance(source)


table = pytest.mark.parametrize("name", DOMAINS)


@table
@pytest.mark.parametrize("method", ["auto", "windows", "heat"])
def test_distance_is_between_straight_lines_and_paths_along_edges(name, method):
    made = domain(name)
    solver = heat_igl.HeatMethodSolver(made) if method == "heat" else GeodesicSolver(made, method=method)
    found, V = solver.distance(A), surface(name).V
    slack = 0.05 * found.max() if method == "heat" else 1e-6
    assert (found >= np.linalg.norm(V - V[A], axis=1) - slack).all()
    assert (found <= edge_paths(surface(name), A) + slack).all()
    assert np.abs(found - exact(name, A)).mean() < 0.05 * found.max()


@table
def test_cells_and_neighbours(name):
    made, both = domain(name), np.stack([exact(name, A), exact(name, B)])
    found = GeodesicSolver(made, method="exact").voronoi([A, B])
    np.testing.assert_allclose(found.distance, both.min(axis=0), atol=1e-9)
    np.testing.assert_array_equal(found.labels, both.argmin(axis=0))
    near = heat_igl.distances_within(made, 0.3, A).toarray()[0]
    np.testing.assert_allclose(near, np.where(both[0] <= 0.3, both[0], 0), atol=1e-9)
    np.testing.assert_allclose(heat_igl.nearest_vertices(made, 9, A)[1][0], np.sort(both[0])[:9], atol=1e-9)
    assert heat_igl.pair_distances(made, [[A, B]])[0] == pytest.approx(both[0, B])
    far = heat_igl.farthest_points(GeodesicSolver(made, method="exact"), 2, start=A)
    assert far[1] == both[0].argmax()


@table
def test_frames_are_orthonormal_and_tangent(name):
    frames, mesh = heat_igl.tangent_frames(domain(name)), surface(name)
    axes = np.stack([frames.x, frames.y, frames.normal], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.tile(np.eye(3), (mesh.n_vertices, 1, 1)), atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(axes), 1)
    normal = np.cross(mesh.V[mesh.F[:, 1]] - mesh.V[mesh.F[:, 0]], mesh.V[mesh.F[:, 2]] - mesh.V[mesh.F[:, 0]])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.median(np.abs(np.einsum("fx,fcx->fc", normal, frames.normal[mesh.F]))) > 0.98


@pytest.mark.filterwarnings("ignore:heat is off")
@table
def test_a_geodesic_along_the_log_map_ends_at_the_vertex_and_one_back_at_the_source(name):
    """Paths that bend at a vertex of negative curvature do not: these are few."""
    made, V = domain(name), surface(name).V
    vectors = heat_igl.log_map(made, A)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), exact(name, A), atol=1e-9)
    near = np.flatnonzero((exact(name, A) < 1) & (exact(name, A) > 0))
    ends = heat_igl.exp_map(made, A, vectors[near]).positions(surface(name))
    off = np.linalg.norm(ends - V[near], axis=1)
    assert np.mean(off < 1e-6) > 0.5
    assert np.mean(off < 0.1) > 0.9
    found = GeodesicSolver(made, method="exact").directions(A)
    frames = heat_igl.tangent_frames(made)
    arrivals = frames.to_world(frames.from_angles(found.arrival))
    np.testing.assert_allclose(arrivals[near], found.gradient[near], atol=1e-9)
    backs = [
        heat_igl.trace_geodesic(made, int(i), -found.gradient[i], found.distance[i]).positions(surface(name))[-1]
        for i in near[::10]
    ]
    assert np.mean(np.linalg.norm(backs - V[A], axis=1) < 1e-6) > 0.5
    by_heat = heat_igl.log_map(made, A, method="vector-heat")
    turn = np.angle((by_heat @ [1, 1j])[near] * (vectors @ [1, -1j])[near])
    assert np.median(np.abs(turn)) < 0.15


@table
def test_vectors_keep_their_length(name):
    solver = heat_igl.VectorHeatSolver(domain(name))
    length = np.linalg.norm(solver.transport(A, [[3, 4]]), axis=1)
    np.testing.assert_allclose(length[length > 0], 5)
    assert (length > 0).mean() > 0.99  # 0 at the antipode
    np.testing.assert_array_equal(solver.reaches(A)[length > 0], True)


@table
def test_paths_have_the_length_of_the_distance(name):
    made, mesh = domain(name), surface(name)
    path = heat_igl.shortest_path(made, A, B)
    assert path.lengths(mesh).sum() == pytest.approx(exact(name, A)[B], rel=1e-6)
    both = heat_igl.curve_through(made, [A, B])
    assert both.length >= exact(name, A)[B] * (1 - 1e-9)
    assert heat_igl.straighten(made, both).length == pytest.approx(exact(name, A)[B], rel=0.05)


@table
def test_a_mean_of_two_points_is_halfway(name):
    mean = heat_igl.karcher_mean(domain(name), [A, B])
    ways = heat_igl.geodesic_distance(domain(name), mean, method="exact")[[A, B]]
    np.testing.assert_allclose(ways, exact(name, A)[B] / 2, rtol=1e-3)
    found = heat_igl.centroidal_voronoi(domain(name), [A, B], rounds=3)
    assert (np.diff(found.energies) < 0).all()


@table
def test_isolines_are_where_the_distance_is_and_cut_the_surface(name):
    mesh, level = surface(name), 0.5 * exact(name, A).max()
    (lines,) = heat_igl.isolines(domain(name), exact(name, A), [level])
    for line in lines:
        values = np.einsum("kc,kc->k", exact(name, A)[mesh.F[line.faces]], line.start)
        np.testing.assert_allclose(values, level)
    found = heat_igl.cut(domain(name), lines)
    assert found.mesh.measures.sum() == pytest.approx(mesh.measures.sum())
    values = found.carry(exact(name, A))
    sides = [np.sign((values[found.mesh.F[found.pieces == piece]] - level).sum()) for piece in np.unique(found.pieces)]
    assert {-1, 1} == set(sides)


@table
def test_signed_distance(name):
    """Of a line around the source: negative on its left, where the source is."""
    if name == "cloud with one side":
        with pytest.raises(MeshError, match="no oriented manifold: the left and the right of a curve need one"):
            heat_igl.SignedHeatSolver(domain(name))
        return
    (lines,) = heat_igl.isolines(domain(name), exact(name, A), [1.0])
    found = heat_igl.signed_distance(domain(name), lines)
    inside = exact(name, A) < 1
    sign = np.sign(found[A])
    clear = np.abs(exact(name, A) - 1) > 0.1
    assert (np.sign(found)[clear] == np.where(inside, sign, -sign)[clear]).all()


@table
def test_transport_along_each_path_and_derivatives(name):
    if name == "cloud with one side":
        with pytest.raises(MeshError, match="no oriented manifold: parallel transport along paths needs one"):
            heat_igl.log_maps_within(domain(name), 0.3, A)
    else:
        maps, found = heat_igl.log_maps_within(domain(name), 0.3, A), GeodesicSolver(domain(name), method="exact")
        np.testing.assert_allclose(maps.departure.data, found.directions(A).departure[maps.distance.indices], atol=1e-6)
    solver = GeodesicSolver(domain(name), method="exact")
    if name == "mesh":
        assert solver.distance_vjp(A)[1](np.ones(solver.n_vertices)).shape == (solver.n_vertices, 3)
        return
    with pytest.raises(ValueError, match=r"a point cloud: take its triangles"):
        solver.distance_vjp(A)
    with pytest.raises(MeshError, match=r"not of PointCloud: pass .*triangles"):
        GeodesicSolver(domain(name), region=np.ones(solver.n_vertices, bool))


@table
def test_values_places_and_the_page(name):
    made, mesh = domain(name), surface(name)
    np.testing.assert_allclose(heat_igl.smooth(made, np.ones(mesh.n_vertices), 0.3), 1)
    middle = SurfacePoints([5], [[1 / 3, 1 / 3, 1 / 3]]).positions(mesh)
    np.testing.assert_allclose(heat_igl.closest_points(made, middle).points.positions(mesh), middle, atol=1e-9)
    pytest.importorskip("matplotlib")
    assert "<script" in heat_igl.plots.page(made, exact(name, A)).html


@table
def test_sources_of_all_kinds(name):
    made, mesh, solver = domain(name), surface(name), GeodesicSolver(domain(name), method="exact")
    both = exact(name, A), exact(name, B)
    along = solver.distance(heat_igl.shortest_path(made, A, B))
    assert (along <= np.minimum(*both) + 1e-9).all()
    np.testing.assert_allclose(along[[A, B]], 0, atol=1e-9)
    later = solver.distance(heat_igl.OffsetSources([A, B], [0, 0.2]))
    np.testing.assert_allclose(later, np.minimum(both[0], both[1] + 0.2), atol=1e-9)
    face, at = np.argwhere(mesh.F == A)[0]
    np.testing.assert_allclose(solver.distance(SurfacePoints([face], [np.eye(3)[at]])), both[0], atol=1e-9)
    near, few = both[0] <= 0.4, [B, A, 7]
    np.testing.assert_allclose(solver.distance(A, cutoff=0.4)[near], both[0][near], atol=1e-9)
    found = heat_igl.geodesic_distance(made, A, method="exact", targets=few)
    np.testing.assert_allclose(found, both[0][few], atol=1e-9)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(solver)).distance(A), both[0])


@table
def test_other_positions_metrics_and_matrices(name):
    """Twice the positions, or four times the metric, are twice the distance; normals are not those of other points."""
    made, solver = domain(name), GeodesicSolver(domain(name), method="exact")
    twice = solver.with_vertices(2 * made.V).distance(A)
    np.testing.assert_allclose(twice, 2 * exact(name, A), rtol=0.02 if name == "oriented cloud" else 1e-9)
    scaled = heat_igl.metric_operators(made, np.tile(4 * np.eye(3), (made.n_vertices, 1, 1)))
    np.testing.assert_allclose(GeodesicSolver(scaled, method="exact").distance(A), 2 * exact(name, A), rtol=1e-6)
    matrix = heat_igl.distance_matrix(solver, [A, B])
    np.testing.assert_allclose(matrix, [[0, exact(name, A)[B]], [exact(name, A)[B], 0]], atol=1e-9)
    labels = np.full(made.n_vertices, -1)
    labels[[A, B]] = 0, 1
    between = heat_igl.parcel_distances(made, labels)
    np.testing.assert_allclose(between, [[0, exact(name, A)[B]], [exact(name, A)[B], 0]], rtol=1e-4)


@table
def test_curves_along_edges_the_farthest_pair_times_and_errors(name):
    made, mesh, truth = domain(name), surface(name), exact(name, A)
    for path in (heat_igl.shortest_paths(made, [B], A)[0], heat_igl.geodesic_path(made, [A, B])):
        assert path.lengths(mesh).sum() == pytest.approx(truth[B])
    edge = mesh.F[5, :2]
    straight = np.linalg.norm(np.diff(mesh.V[edge], axis=0))
    assert heat_igl.edge_curve(made, edge).lengths(mesh).sum() == pytest.approx(straight)
    assert heat_igl.curve_on(made, mesh.V[edge]).length >= straight * (1 - 1e-9)
    farthest, a, b = heat_igl.diameter(GeodesicSolver(made, method="exact"))
    assert farthest == pytest.approx(exact(name, a)[b])
    assert farthest == pytest.approx(exact(name, b).max())
    metric = np.tile(np.eye(3), (made.n_vertices, 1, 1))
    np.testing.assert_allclose(heat_igl.activation_times(made, metric, [A]), truth, atol=1e-9)
    faster = GeodesicSolver(heat_igl.speed_operators(made, np.full(mesh.n_faces, 2.0)), method="exact")
    np.testing.assert_allclose(faster.distance(A), truth / 2, atol=1e-9)
    errors = heat_igl.geodesic_errors(made, [A, A], [A, B])
    np.testing.assert_allclose(errors * np.sqrt(mesh.measures.sum()), [0, truth[B]], atol=1e-9)
