"""Texture seams: what a loader split is measured as one where that is asked for, and nothing else is joined."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import heat_igl
from heat_igl import Mesh, as_mesh, shapes


def split(mesh: Mesh, chart: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """The mesh with separate vertices for each chart of faces, and the vertex that each one was."""
    corners = np.stack([mesh.F, np.repeat(chart[:, None], 3, axis=1)], axis=-1).reshape(-1, 2)
    rows, index = np.unique(corners, axis=0, return_inverse=True)
    return Mesh(mesh.V[rows[:, 0]], index.reshape(-1, 3)), rows[:, 0]


def charts(mesh: Mesh, kind: str, seed: int) -> np.ndarray:
    centre = mesh.V[mesh.F].mean(axis=1)
    generator = np.random.default_rng(seed)
    if kind == "halves":
        return (centre @ generator.normal(size=3) > 0).astype(int)
    if kind == "cells":
        seeds = centre[generator.choice(len(centre), 9, replace=False)]
        return np.linalg.norm(centre[:, None] - seeds, axis=2).argmin(axis=1)
    return np.arange(len(centre))  # every face by itself, as in files without shared vertices


@pytest.fixture(params=["halves", "cells", "faces"])
def torn(request):
    """A surface, the same with seams that are merged, and which of its vertices each of those was."""
    whole = shapes.torus(20, 12)
    parts, was = split(whole, charts(whole, request.param, 3))
    return whole, as_mesh(parts, merge="seams"), was


def test_a_split_model_is_measured_as_one(torn):
    whole, joined, was = torn
    assert joined.report().seam_edges.size == joined.report().unreferenced_vertices.size == 0
    assert joined.with_vertices(2 * joined.V).has_copies
    source = int(np.argmax(joined.originals != np.arange(len(was))))  # a copy
    region, region_of_whole = joined.V[:, 0] > -0.5, whole.V[:, 0] > -0.5

    def of_both(answer):
        found, truth = answer(joined, source, region), answer(whole, was[source], region_of_whole)[was]
        np.testing.assert_allclose(found, truth, rtol=1e-12, atol=1e-12)

    of_both(lambda mesh, at, _: heat_igl.geodesic_distance(mesh, at, method="exact"))
    of_both(lambda mesh, at, _: heat_igl.geodesic_distance(mesh, at, cutoff=0.4))
    of_both(lambda mesh, at, _: heat_igl.GeodesicSolver(mesh, method="sweep").distances([[at]])[0])
    of_both(lambda mesh, at, inside: heat_igl.geodesic_distance(mesh, at, region=inside))
    of_both(lambda mesh, at, _: heat_igl.GeodesicSolver(mesh).directions(at).gradient)
    of_both(lambda mesh, *_: heat_igl.tangent_frames(mesh).normal)
    of_both(lambda mesh, at, _: heat_igl.distances_within(mesh, 0.8, at).toarray()[0])
    np.testing.assert_allclose(
        heat_igl.distances_within(joined, 0.8, region=region).toarray(),
        heat_igl.distances_within(whole, 0.8, region=region_of_whole).toarray()[np.ix_(was, was)],
        atol=1e-12,
    )
    assert heat_igl.pair_distances(joined, [[source, joined.originals[source]]]) == 0
    there = int(np.argmax(joined.originals[::-1] != np.arange(len(was))[::-1]))
    path = heat_igl.shortest_path(joined, source, len(was) - 1 - there)
    truth = heat_igl.geodesic_distance(whole, was[source])[was[len(was) - 1 - there]]
    assert path.length == pytest.approx(truth, rel=1e-12)


def test_copies_are_neighbours_on_edges_and_are_smoothed_cut_and_stored(torn, tmp_path):
    whole, joined, was = torn
    everyone = heat_igl.GeodesicSolver(whole).distances(was)[:, was]
    indices, distances = heat_igl.nearest_vertices(joined, 9)
    np.testing.assert_allclose(distances, np.sort(everyone, axis=1)[:, :9], atol=1e-12)
    np.testing.assert_allclose(np.take_along_axis(everyone, indices, axis=1), distances, atol=1e-12)
    assert indices[:, 0].tolist() == list(range(len(was)))
    assert len(np.unique(np.arange(len(was))[:, None] * len(was) + indices)) == indices.size

    values = np.random.default_rng(0).normal(size=whole.n_vertices)
    smoothed = heat_igl.smooth(whole, values, 0.8)[was]
    np.testing.assert_allclose(heat_igl.smooth(joined, values[was], 0.8), smoothed, atol=1e-9)
    labels = np.arange(whole.n_vertices) % 3
    for statistic in ("mean", "centre"):
        parcels = [
            heat_igl.parcel_distances(m, of, statistic=statistic) for m, of in ((whole, labels), (joined, labels[was]))
        ]
        np.testing.assert_allclose(*parcels, rtol=1e-12)

    pieces = heat_igl.cut(joined, heat_igl.isolines(joined, joined.V[:, 2], [0.05])).mesh
    distance = heat_igl.geodesic_distance(pieces, len(was) - 1)[: len(was)]
    np.testing.assert_allclose(distance, everyone[-1], atol=1e-12)

    edge = [int(np.flatnonzero(was == vertex)[-1]) for vertex in whole.edges[0]]
    assert heat_igl.edge_curve(joined, edge).length == pytest.approx(np.linalg.norm(np.diff(whole.V[whole.edges[0]].T)))

    pytest.importorskip("zarr")
    heat_igl.write_distances_within(tmp_path / "near.zarr", joined, 0.8)
    stored = heat_igl.read_distances_within(tmp_path / "near.zarr")
    np.testing.assert_allclose(stored.toarray(), np.where(everyone <= 0.8, everyone, 0), atol=1e-12)


def test_heat_takes_a_split_model_as_one(torn):
    whole, joined, was = torn
    source = int(np.argmax(joined.originals != np.arange(len(was))))
    for make in (heat_igl.HeatMethodSolver, heat_igl.VectorHeatSolver):
        found, truth = make(joined, t_coef=1.0), make(whole, t_coef=1.0)
        if make is heat_igl.HeatMethodSolver:
            pairs = [(found.distance(source), truth.distance(was[source]))]
            pairs.append((found.solve(source).heat, truth.solve(was[source]).heat))
        else:
            pairs = [(found.extend([source, 0], [1.0, 2.0]), truth.extend(was[[source, 0]], [1.0, 2.0]))]
            pairs.append((found.reaches(0), truth.reaches(was[0])))
        for ours, theirs in pairs:
            np.testing.assert_allclose(ours, theirs[was], rtol=1e-6, atol=1e-9)
    loop = heat_igl.isolines(joined, joined.V[:, 2], [0.05])
    np.testing.assert_allclose(
        heat_igl.signed_distance(joined, loop),
        heat_igl.signed_distance(whole, heat_igl.isolines(whole, whole.V[:, 2], [0.05]))[was],
        atol=1e-9,
    )


@pytest.mark.filterwarnings("ignore:heat is off")
def test_a_metric_takes_a_split_model_as_one(torn):
    whole, joined, was = torn
    source = int(np.argmax(joined.originals != np.arange(len(was))))
    jump = np.where(whole.V[whole.F].mean(axis=1)[:, 2] > 0, 1.0, 2.0)
    for operators in (
        lambda mesh: heat_igl.speed_operators(mesh, np.full(mesh.n_faces, 2.0)),
        lambda mesh: heat_igl.speed_operators(mesh, jump),
        lambda mesh: heat_igl.metric_operators(mesh, np.eye(3) * np.exp(mesh.V[:, :1, None])),
    ):
        for solver in (heat_igl.GeodesicSolver, heat_igl.HeatMethodSolver):
            found, truth = solver(operators(joined)), solver(operators(whole))
            # Beside a jump, which edges are flipped for heat depends on the numbers of vertices.
            np.testing.assert_allclose(found.distance(source), truth.distance(was[source])[was], rtol=0.02, atol=1e-9)
        with pytest.raises(ValueError, match="seams of this mesh were merged"):
            heat_igl.GeodesicSolver(operators(joined)).distance_vjp(source)


def test_copies_in_other_domains_have_the_values_of_the_first():
    bar = shapes.box(2)
    apart = as_mesh((bar.V[bar.F].reshape(-1, 3), np.arange(bar.F.size).reshape(-1, 4)), merge="vertices")
    with pytest.raises(ValueError, match="seams of this mesh were merged"):
        heat_igl.GeodesicSolver(apart).distance_vjp(0)
    cloud = heat_igl.PointCloud(np.concatenate([shapes.grid(9).V, shapes.grid(9).V[:4]]))
    for mesh in (apart, cloud):
        P = mesh.V if mesh is apart else mesh.P
        times = heat_igl.activation_times(mesh, np.diag([4.0, 1, 1]), len(P) - 1)
        assert times == pytest.approx(np.linalg.norm((P - P[-1]) * [0.5, 1, 1], axis=1), rel=1e-3, abs=1e-9)


def test_a_slit_that_leaves_one_piece_is_closed():
    n = 24
    angle, height = np.meshgrid(np.linspace(0, 2 * np.pi, n + 1), np.arange(5.0))
    angle[:, -1] = 0  # the same positions, another column of vertices, as texture coordinates need
    V = np.stack([np.cos(angle), np.sin(angle), height], axis=-1).reshape(-1, 3)
    unrolled = Mesh(V, shapes.strip(n, 4).F)
    assert unrolled.components.max() == 0
    joined = as_mesh(unrolled, merge="seams")
    assert joined.referenced.sum() == 5 * n
    assert joined.report().n_boundary_loops == 2
    phi = heat_igl.geodesic_distance(joined, n)  # a copy of vertex 0
    assert phi[0] == phi[n] == 0
    assert phi[n - 1] == pytest.approx(2 * np.sin(np.pi / n))


def with_copy(mesh: Mesh, V: np.ndarray, flipped: bool) -> Mesh:
    F = mesh.F[:, ::-1] if flipped else mesh.F
    return Mesh(np.concatenate([mesh.V, V]), np.concatenate([mesh.F, F + mesh.n_vertices]))


@pytest.mark.parametrize("flipped", [False, True])
def test_a_sheet_on_another_is_left_alone(flipped):
    sheet = shapes.grid(5)
    double = with_copy(sheet, sheet.V, flipped)
    with pytest.warns(heat_igl.AccuracyWarning, match="places: 20"):
        assert as_mesh(double, merge="seams") is double
    assert double.report().seam_edges.size == 0


@pytest.mark.filterwarnings("ignore:vertices of the boundary")  # rounding gives some of them equal positions
@pytest.mark.parametrize("seed", range(50))
def test_sheets_that_are_only_near_are_left_alone(seed):
    generator = np.random.default_rng(seed)
    ball = shapes.icosphere(2)
    parts, _ = split(ball, charts(ball, "cells", seed))
    gap = 10.0 ** -generator.integers(3, 15)
    moved = Mesh(parts.V * (1 + gap * generator.uniform(1, 2, (parts.n_vertices, 1))), parts.F)
    assert as_mesh(moved, merge="seams") is moved


@pytest.mark.parametrize("seed", range(20))
def test_soups_are_measured_as_the_mesh(seed):
    """Parts of random triangles that share random vertices: any edges may have three faces, any parts may touch."""
    generator = np.random.default_rng(seed)
    F = np.stack([generator.choice(30, 3, replace=False) for _ in range(generator.integers(2, 40))])
    whole = Mesh(generator.normal(size=(30, 3)), F)
    soup, was = Mesh(whole.V[F].reshape(-1, 3), np.arange(F.size).reshape(-1, 3)), F.ravel()
    truth = heat_igl.geodesic_distance(whole, was[0])[was]
    np.testing.assert_array_equal(heat_igl.geodesic_distance(as_mesh(soup, merge="vertices"), 0), truth)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        joined = as_mesh(soup, merge="seams")
    if not any('merge="vertices"' in str(entry.message) for entry in said):
        np.testing.assert_allclose(heat_igl.geodesic_distance(joined, 0), truth, rtol=1e-12)


def test_parts_that_only_touch_are_warned_of():
    """Coinciding corners of parts that no seam joins: turned round, three at an edge, or one point in common."""
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 0, 0], [1, 0, 0], [0, 0, 1.0]])
    turned, three = (V[:6], [[0, 1, 2], [3, 4, 5]]), (V, [[0, 1, 2], [4, 3, 5], [7, 6, 8]])
    point = (V[[0, 1, 2, 3, 5, 8]], [[0, 1, 2], [3, 4, 5]])
    for soup, n in ((turned, 2), (three, 2), (point, 1)):
        with pytest.warns(heat_igl.AccuracyWarning, match=rf"{n} places .* inf: .*merge=\"vertices\"") as said:
            found = as_mesh(soup)
        assert len(said) == 1
        assert np.isinf(heat_igl.geodesic_distance(found, 0)).any()
        assert np.isfinite(heat_igl.geodesic_distance(as_mesh(soup, merge="vertices"), 0)).all()
    # One part that comes back to where it began: a path leads there, and nothing is said.
    ring = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 0], [0, 3, 1], [0, 0, 0]]
    assert as_mesh((ring, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]])).components.max() == 0


def test_merged_vertices_leave_out_collapsed_faces():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]])
    assert as_mesh((V, [[0, 1, 2], [1, 3, 2]]), merge="vertices").n_faces == 1


def test_t_junctions_and_three_sheets_are_left_alone():
    V = np.array([[0, 0, 0], [2, 0, 0], [1, 2, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0], [1, -2, 0]], float)
    tee = Mesh(V, [[0, 1, 2], [4, 3, 6], [5, 4, 6]])
    with pytest.warns(heat_igl.AccuracyWarning, match="places: 2"):
        assert as_mesh(tee, merge="seams") is tee
    three = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 0], [0, -1, 0], [1, 0, 0], [0, 0, 0], [0, 0, 1]],
        [[0, 1, 2], [3, 4, 5], [6, 7, 8]],
    )
    with pytest.warns(heat_igl.AccuracyWarning, match="places: 2"):
        assert as_mesh(three, merge="seams") is three
    assert as_mesh(three, merge="vertices").report().nonmanifold_edges.shape == (1, 2)
    assert as_mesh((three.V[:6], three.F[:2]), merge="seams").referenced.sum() == 4
    for other in (shapes.box(1), heat_igl.PointCloud(three.V)):
        assert as_mesh(other, merge="seams") is other


def test_what_is_none_of_this_package_is_warned_of(tmp_path):
    parts, _ = split(shapes.icosphere(2), charts(shapes.icosphere(2), "halves", 1))
    heat_igl.write_mesh(tmp_path / "parts.ply", parts)
    theirs = SimpleNamespace(vertices=parts.V, faces=parts.F)
    for mesh in (theirs, (parts.V, parts.F), tmp_path / "parts.ply"):
        with pytest.warns(heat_igl.AccuracyWarning, match=r"\d+ boundary edges .*merge=\"seams\"\) joins them") as said:
            heat_igl.geodesic_distance(mesh, 0)
        assert len(said) == 1
        assert as_mesh(mesh, merge="seams").referenced.sum() == 162
    as_mesh(SimpleNamespace(vertices=shapes.grid(3).V, faces=shapes.grid(3).F))
    with pytest.raises(ValueError, match="none of which is a copy"):
        heat_igl.GeodesicSolver(as_mesh(parts, merge="seams")).distance_vjp(0)
