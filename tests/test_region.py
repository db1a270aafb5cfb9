"""Distances in a region are those on the mesh cut out of the whole, under the numbers of the whole."""

import pickle

import numpy as np
import pytest
from surfaces import bumpy

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, SurfacePoints, cli, shapes


def cut_out(mesh: Mesh, region: np.ndarray) -> tuple[Mesh, np.ndarray, np.ndarray]:
    """The faces of a region as a mesh of their own, its vertices, and its faces."""
    faces = np.flatnonzero(region[mesh.F].all(axis=1) if len(region) == mesh.n_vertices else region)
    used, F = np.unique(mesh.F[faces], return_inverse=True)
    return Mesh(mesh.V[used], F.reshape(-1, 3)), used, faces


@pytest.mark.filterwarnings("ignore:heat is off")
@pytest.mark.parametrize("seed", range(12))
def test_distances_are_those_on_the_mesh_cut_out(seed):
    mesh, rng = bumpy(), np.random.default_rng(seed)
    # Of vertices or of faces, with holes and several parts.
    at = mesh.V if rng.random() < 0.5 else mesh.V[mesh.F].mean(axis=1)
    hills = sum(np.cos(at @ rng.normal(scale=3, size=3) + rng.uniform(0, 6)) for _ in range(3))
    region = hills < np.quantile(hills, rng.uniform(0.3, 0.95))
    part, used, faces = cut_out(mesh, region)
    outside = np.setdiff1d(np.arange(mesh.n_vertices), used)
    sources = rng.integers(len(used), size=2)
    spots = np.sort(rng.integers(len(faces), size=2)), rng.dirichlet([1, 1, 1], 2)
    for there, here in (
        (used[sources], sources),
        (SurfacePoints(faces[spots[0]], spots[1]), SurfacePoints(*spots)),
        ([int(used[sources[0]]), SurfacePoints(faces[spots[0]], spots[1])], [int(sources[0]), SurfacePoints(*spots)]),
    ):
        exact = heat_igl.geodesic_distance(mesh, there, method="exact", region=region)
        np.testing.assert_allclose(
            exact[used], heat_igl.geodesic_distance(part, here, method="exact"), rtol=1e-12, atol=1e-12
        )
        assert np.isinf(exact[outside]).all()
        for make in (GeodesicSolver, lambda m, **options: GeodesicSolver(m, method="sweep", **options)):
            np.testing.assert_allclose(
                make(mesh, region=region).distance(there)[used], make(part).distance(here), rtol=2e-5
            )
    solver = HeatMethodSolver(mesh, region=region)
    heat = solver.distance(used[sources])
    np.testing.assert_allclose(heat[used], HeatMethodSolver(part).distance(sources), rtol=1e-6, atol=1e-9)
    assert np.isinf(heat[outside]).all()
    near, alone = (
        heat_igl.distances_within(m, 0.7, s, **options).toarray()
        for m, s, options in ((mesh, used[sources], {"region": region}), (part, sources, {}))
    )
    np.testing.assert_allclose(near[:, used], alone, rtol=1e-12)
    assert not near[:, outside].any()
    by_lengths, of_part = np.zeros((mesh.n_faces, 3)), GeodesicSolver(part).distance_vjp(sources)[1]
    by_lengths[faces] = of_part.by_lengths(np.ones(len(used)))
    pull_back = GeodesicSolver(mesh, region=region).distance_vjp(used[sources])[1]
    np.testing.assert_allclose(pull_back.by_lengths(np.ones(mesh.n_vertices)), by_lengths, atol=1e-9)


def test_local_queries_in_a_region():
    mesh = bumpy()
    region = mesh.V[:, 2] < 0.4
    part, used, _ = cut_out(mesh, region)
    rows = heat_igl.distances_within(mesh, 0.4, region=region)
    np.testing.assert_allclose(rows.toarray()[np.ix_(used, used)], heat_igl.distances_within(part, 0.4).toarray())
    assert rows.shape == (mesh.n_vertices,) * 2
    assert rows[[int(np.flatnonzero(~region)[0])]].nnz == 0
    vertices, distances = heat_igl.nearest_vertices(mesh, 4, region=region)
    expected = heat_igl.nearest_vertices(part, 4)
    np.testing.assert_array_equal(vertices[used], used[expected[0]])
    np.testing.assert_allclose(distances[used], expected[1], rtol=1e-12)
    assert (vertices[~region] == -1).all()
    pairs = np.random.default_rng(0).integers(len(used), size=(30, 2))
    np.testing.assert_allclose(
        heat_igl.pair_distances(mesh, used[pairs], region=region), heat_igl.pair_distances(part, pairs), rtol=1e-12
    )
    far = int(np.flatnonzero(~region)[0])
    assert np.isinf(heat_igl.pair_distances(mesh, [[used[0], far]], region=region)[0])


def test_the_rest_of_a_solver_in_a_region():
    mesh = bumpy()
    region = mesh.V[:, 2] < 0.4
    part, used, faces = cut_out(mesh, region)
    solver, alone = GeodesicSolver(mesh, tolerance=0, region=region), GeodesicSolver(part, tolerance=0)
    cells, expected = solver.voronoi(used[[3, 40, 90]]), alone.voronoi([3, 40, 90])
    np.testing.assert_array_equal(cells.labels[used], expected.labels)
    assert (cells.labels[~region] == -1).all()
    np.testing.assert_allclose(solver.distances([[int(used[3])], used[:2]])[:, used], alone.distances([[3], [0, 1]]))
    found, wanted = solver.directions(int(used[3])), alone.directions(3)
    np.testing.assert_allclose(found.departure[used], wanted.departure, atol=1e-12)
    np.testing.assert_array_equal(found.start.faces[used], faces[wanted.start.faces])
    (phi, pull_back), (other, back) = solver.distance_vjp(int(used[3])), alone.distance_vjp(3)
    np.testing.assert_allclose(phi[used], other, rtol=1e-12)
    g = np.random.default_rng(0).normal(size=len(used))
    whole = np.zeros(mesh.n_vertices)
    whole[used] = g
    np.testing.assert_allclose(pull_back(whole)[used], back(g), atol=1e-10)
    moved = solver.with_vertices(2 * mesh.V)
    np.testing.assert_allclose(moved.distance(int(used[3]))[used], 2 * other, rtol=1e-12)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(solver)).distance(int(used[3])), phi)
    heat = HeatMethodSolver(mesh, region=region)
    np.testing.assert_allclose(
        heat.with_vertices(2 * mesh.V).distance(int(used[3]))[used], 2 * heat.distance(int(used[3]))[used], rtol=1e-6
    )
    sites = heat_igl.farthest_points(solver, 6, start=int(used[0]))
    assert region[sites].all()
    spot = SurfacePoints(faces[[5]], [[0.2, 0.3, 0.5]])
    there = heat_igl.geodesic_distance(mesh, int(used[3]), method="exact", targets=spot, region=region)
    here = heat_igl.geodesic_distance(part, 3, method="exact", targets=SurfacePoints([5], [[0.2, 0.3, 0.5]]))
    np.testing.assert_allclose(there, here, rtol=1e-12)


def test_a_ring_is_gone_around_and_tetrahedra_too():
    mesh = shapes.grid(8)
    x, y, _ = mesh.V[mesh.F].mean(axis=1).T
    wall = (np.abs(x - 0.5) < 0.125) & (y < 0.875)
    phi = heat_igl.geodesic_distance(mesh, 0, method="exact", region=~wall)
    assert phi[8] == pytest.approx(2 * np.hypot(0.375, 0.875) + 0.25)
    assert np.flatnonzero(np.isinf(phi)).tolist() == [4 + 9 * row for row in range(7)]
    body = heat_igl.image_domain(np.ones((3, 3, 3), bool)).mesh
    inside = body.V[body.F].mean(axis=1)[:, 0] < 1.5
    used = np.unique(body.F[inside])
    phi = heat_igl.geodesic_distance(body, int(used[0]), region=inside)
    assert np.isfinite(phi[used]).all()
    assert np.isinf(np.delete(phi, used)).all()


def test_paths_in_a_region():
    mesh = bumpy()
    region = mesh.V[:, 2] < 0.4
    part, used, faces = cut_out(mesh, region)
    path, alone = heat_igl.shortest_path(mesh, used[7], used[90], region=region), heat_igl.shortest_path(part, 7, 90)
    np.testing.assert_allclose(path.points, alone.points, atol=1e-12)
    np.testing.assert_array_equal(path.faces, faces[alone.faces])
    assert path.length == pytest.approx(heat_igl.pair_distances(mesh, [used[[7, 90]]], region=region)[0], rel=1e-12)
    np.testing.assert_allclose(path.points[[0, -1]], mesh.V[used[[7, 90]]], atol=1e-12)
    spots = SurfacePoints(faces[[5, 60]], [[0.2, 0.3, 0.5], [0.1, 0.6, 0.3]])
    found = heat_igl.shortest_paths(mesh, spots, used[[3, 4]], region=region)
    wanted = heat_igl.shortest_paths(part, SurfacePoints([5, 60], spots.barycentric), [3, 4])
    assert [curve.length for curve in found] == pytest.approx([curve.length for curve in wanted], rel=1e-12)


def test_what_takes_no_region_takes_its_faces_with_all_vertices():
    mesh = bumpy()
    region = mesh.V[:, 2] < 0.4
    whole, (part, used, _) = Mesh(mesh.V, mesh.F[region[mesh.F].all(axis=1)]), cut_out(mesh, region)
    source = int(used[50])
    for call in (
        lambda m, at: heat_igl.log_map(m, at),
        lambda m, at: heat_igl.VectorHeatSolver(m).transport([at], [[1.0, 0.0]]),
        lambda m, _: heat_igl.SignedHeatSolver(m).distance(heat_igl.isolines(m, m.V[:, 2], [-0.3])),
    ):
        np.testing.assert_allclose(call(whole, source)[used], call(part, 50), rtol=1e-12, atol=1e-12)


def test_the_command_takes_a_region(tmp_path):
    mesh = shapes.grid(6)
    region = mesh.V[:, 0] < 0.6
    heat_igl.write_mesh(tmp_path / "grid.ply", mesh, cortex=region.astype(np.float32))
    np.save(tmp_path / "faces.npy", region[mesh.F].all(axis=1))
    expected = heat_igl.geodesic_distance(mesh, 0, region=region)
    for name in (str(tmp_path / "faces.npy"), "cortex"):
        arguments = [str(tmp_path / "grid.ply"), "--source", "0", "--region", name, "--output", str(tmp_path / "d.npy")]
        assert cli.run(["distance", *arguments]) == 0
        np.testing.assert_array_equal(np.load(tmp_path / "d.npy"), expected)
