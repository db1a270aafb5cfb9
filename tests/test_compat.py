"""The drop-in modules: the calls of libigl, potpourri3d, gdist and pygeodesic, and what they return."""

import inspect
from itertools import pairwise
from typing import Any

import igl
import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed
from surfaces import arcs, bumpy, twice

import heat_igl
from heat_igl import Mesh, MeshError, shapes
from heat_igl.compat import gdist, pygeodesic
from heat_igl.compat import igl as drop_in
from heat_igl.compat import potpourri3d as pp3d


@pytest.fixture(scope="module")
def ball():
    return shapes.icosphere(3)


@pytest.fixture(scope="module")
def torus():
    return shapes.torus(24, 16)


@pytest.fixture
def peer():
    return pytest.importorskip("potpourri3d")


def lengths(points: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


# --- libigl -----------------------------------------------------------------------------------------------------------


def test_every_other_name_is_libigl_s():
    assert drop_in.cotmatrix is igl.cotmatrix
    assert {"grad", "exact_geodesic", "heat_geodesic"} <= set(dir(drop_in))
    with pytest.raises(AttributeError, match="cotmatrx"):
        _ = drop_in.cotmatrx


@pytest.mark.parametrize(
    ("VS", "FS", "VT", "FT"),
    [
        ([0], [], [1, 5, 0], []),
        ([3, 17], [8, 8], [0, 40, 7], [8, 9, 60]),
        ([], [11], [], [11, 12, 100]),
        ([], [5, 90], [2], []),
    ],
)
def test_exact_geodesic_agrees_with_libigl(torus, VS, FS, VT, FT):
    given = {name: np.array(found, np.int64) for name, found in (("VS", VS), ("FS", FS), ("VT", VT), ("FT", FT))}
    found = drop_in.exact_geodesic(torus.V, torus.F, **given)
    assert np.allclose(found, igl.exact_geodesic(torus.V, torus.F, **given), rtol=1e-9, atol=1e-9)
    in_order = drop_in.exact_geodesic(torus.V, torus.F, VS, FS, VT, FT)
    assert np.array_equal(found, in_order)
    older = drop_in.exact_geodesic(torus.V, torus.F, np.array([0]), np.array([5, 1]))
    assert np.array_equal(older, drop_in.exact_geodesic(torus.V, torus.F, VS=[0], VT=[5, 1]))


def test_heat_geodesics_take_data_in_three_ways(ball):
    expected = heat_igl.HeatMethodSolver(ball, t=0.01).distance([4, 9])
    for is_named in (False, True):
        data = drop_in.HeatGeodesicsData()
        data.use_intrinsic_delaunay = True
        arguments, named = ((), {"t": 0.01, "data": data}) if is_named else ((0.01, data), {})
        drop_in.heat_geodesics_precompute(ball.V, ball.F, *arguments, **named)
        assert np.array_equal(drop_in.heat_geodesics_solve(data, np.array([4, 9])), expected)
    assert np.array_equal(drop_in.heat_geodesic(ball.V, ball.F, 0.01, np.array([4, 9])), expected)
    data = drop_in.HeatGeodesicsData()
    drop_in.heat_geodesics_precompute(ball.V, ball.F, data)
    assert np.array_equal(drop_in.heat_geodesics_solve(data, [4, 9]), heat_igl.HeatMethodSolver(ball).distance([4, 9]))


# --- potpourri3d: names and arguments ---------------------------------------------------------------------------------


def public(module: Any) -> dict[str, Any]:
    """Functions and classes of potpourri3d, without its own checks."""
    return {
        name: value
        for name, value in vars(module).items()
        if inspect.isroutine(value) or inspect.isclass(value)
        if not name.startswith(("_", "validate"))
    }


def methods(kind: type) -> set[str]:
    return {name for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))}


def test_every_name_is_there(peer):
    theirs = public(peer)
    assert set(theirs) == set(pp3d.__all__)
    for name in pp3d.__all__:
        if inspect.isclass(theirs[name]):
            assert methods(theirs[name]) == methods(getattr(pp3d, name)), name


@pytest.mark.parametrize("name", pp3d.__all__)
def test_arguments_and_defaults_are_theirs(peer, name):
    ours, theirs = getattr(pp3d, name), getattr(peer, name)
    pairs = [(ours, theirs)]
    if inspect.isclass(ours):
        pairs += [(getattr(ours, method), getattr(theirs, method)) for method in methods(ours)]
    for one, other in pairs:
        given, expected = (
            [(p.name, p.default) for p in inspect.signature(function).parameters.values()] for function in (one, other)
        )
        expected = [(argument, () if default == [] else default) for argument, default in expected]
        assert given == expected, one


# --- potpourri3d: results ---------------------------------------------------------------------------------------------


def test_distances_agree_within_the_error_of_heat(peer, ball):
    for sources in ([5], [5, 100, 333]):
        exact = np.arccos(np.clip(ball.V @ ball.V[sources].T, -1, 1)).min(axis=1)
        ours, theirs = (
            np.abs(module.compute_distance_multisource(np.array(ball.V), np.array(ball.F), sources) - exact).mean()
            for module in (pp3d, peer)
        )
        assert ours < theirs < 0.05
    one = pp3d.MeshHeatMethodDistanceSolver(ball.V, ball.F)
    assert np.array_equal(one.compute_distance(5), one.compute_distance_multisource([5]))
    assert np.array_equal(one.compute_distance(5), pp3d.compute_distance(ball.V, ball.F, 5))


def test_a_larger_time_step_is_larger_in_proportion(ball):
    standard = heat_igl.HeatMethodSolver(ball)
    wide = pp3d.MeshHeatMethodDistanceSolver(ball.V, ball.F, t_coef=4.0)
    assert wide._solver.t == pytest.approx(4 * standard.t)
    assert pp3d.MeshHeatMethodDistanceSolver(ball.V, ball.F)._solver.t == standard.t


def test_faces_that_repeat_a_vertex_are_left_out(ball):
    faces = np.concatenate([ball.F, [[3, 3, 8]]])
    assert np.array_equal(pp3d.compute_distance(ball.V, faces, 5), pp3d.compute_distance(ball.V, ball.F, 5))


@pytest.mark.parametrize("strategy", ["VectorHeat", "AffineLocal", "AffineAdaptive"])
def test_log_maps_agree_in_space(peer, ball, strategy):
    """Ours is nearer to the polyhedral map: with all strategies, and in any frame."""
    V, F = np.array(ball.V), np.array(ball.F)
    frames = heat_igl.tangent_frames(ball)
    exact = heat_igl.log_map(ball, 7, method="exact") @ [frames.x[7], frames.y[7]]
    near = np.linalg.norm(exact, axis=1) < 2.5
    errors = []
    for module in (pp3d, peer):
        solver = module.MeshVectorHeatSolver(V, F)
        x, y, _ = solver.get_tangent_frames()
        plane = solver.compute_log_map(7, strategy)
        errors.append(np.linalg.norm(plane @ [x[7], y[7]] - exact, axis=1)[near].mean())
    assert errors[0] < min(errors[1], 0.03)


def test_affine_log_maps_follow_shortest_paths(ball):
    solver = pp3d.MeshVectorHeatSolver(ball.V, ball.F)
    near_exact = heat_igl.log_map(ball, 7)
    for strategy in ("AffineLocal", "AffineAdaptive"):
        assert np.allclose(solver.compute_log_map(7, strategy), near_exact, atol=1e-3)
    assert np.array_equal(solver.compute_log_map(7, "VectorHeat"), heat_igl.log_map(ball, 7, method="vector-heat"))


@pytest.mark.parametrize("intrinsic", [False, True])
def test_connection_laplacian_is_theirs(peer, intrinsic):
    """Up to the turns of the frames, and with its sign: positive."""
    mesh = perturbed(shapes.icosphere(3))
    ours, theirs = (module.MeshVectorHeatSolver(mesh.V, mesh.F, 1.0, intrinsic) for module in (pp3d, peer))
    (x, _, _), (theirs_x, theirs_y, _) = ours.get_tangent_frames(), theirs.get_tangent_frames()
    turn = sp.diags_array(np.einsum("vx,vx->v", x, theirs_x) + 1j * np.einsum("vx,vx->v", x, theirs_y))
    L = ours.get_connection_laplacian()
    assert L.format == "csc"
    assert abs(turn @ L @ turn.conj() - theirs.get_connection_laplacian()).max() < 1e-10


def test_paths_are_no_longer_than_theirs(peer, torus):
    V, F = np.array(torus.V), np.array(torus.F)
    ours, theirs = pp3d.EdgeFlipGeodesicSolver(V, F), peer.EdgeFlipGeodesicSolver(V, F)
    for start, end in pairwise([0, 97, 200, 13, 301]):
        path = ours.find_geodesic_path(v_start=start, v_end=end)
        assert np.allclose(path[[0, -1]], V[[start, end]])
        assert lengths(path) <= lengths(theirs.find_geodesic_path(start, end)) * (1 + 1e-9)
    corners = [0, 97, 200, 13]
    one, other = (lengths(solver.find_geodesic_path_poly(corners)) for solver in (ours, theirs))
    assert one <= other * (1 + 1e-9)
    meridian = np.flatnonzero(np.abs(V[:, 2]) < 1e-9)
    outer = meridian[np.linalg.norm(V[meridian], axis=1) > 1][::6].tolist()
    loop = ours.find_geodesic_loop(outer)
    assert np.allclose(loop[0], loop[-1])
    assert lengths(loop) <= lengths(theirs.find_geodesic_loop(outer)) * (1 + 1e-9)
    around = torus.F[0].tolist()
    assert lengths(ours.find_geodesic_loop(around)) == 0  # which contracts to a point


def test_traced_geodesics_end_where_theirs_do(peer, torus):
    V, F = np.array(torus.V), np.array(torus.F)
    ours, theirs = pp3d.GeodesicTracer(V, F), peer.GeodesicTracer(V, F)
    direction = np.array([0.3, 0.5, 0.4])
    for face in (0, 31, 200):
        given = (face, np.array([0.1, 0.4, 0.5]), direction)
        assert np.allclose(ours.trace_geodesic_from_face(*given)[-1], theirs.trace_geodesic_from_face(*given)[-1])
    for vertex in (0, 22, 97):
        one, other = (tracer.trace_geodesic_from_vertex(vertex, direction) for tracer in (ours, theirs))
        assert np.allclose(one[0], other[0])
        assert abs(lengths(one) - lengths(other)) < 0.03 * lengths(other)
        assert np.linalg.norm(one[-1] - other[-1]) < 0.1 * lengths(other)
    assert len(ours.trace_geodesic_from_vertex(22, 9 * direction, max_iterations=2)) == 3


def test_isolines_have_the_length_of_theirs(peer, torus):
    V, F, u = np.array(torus.V), np.array(torus.F), np.array(torus.V[:, 2])
    total = 0.0
    for curve in pp3d.marching_triangles(V, F, u, 0.03):
        points = np.array([np.array(weights) @ V[F[face]] for face, weights in curve])
        assert np.allclose(points[:, 2], 0.03)
        total += lengths(points)
    edges = peer.edges(V, F)
    theirs = 0.0
    for curve in peer.marching_triangles(V, F, u, 0.03):
        at = [V[edges[edge]] for edge, _ in curve]
        theirs += lengths(np.array([(1 - t) * a + t * b for (a, b), (_, (t,)) in zip(at, curve, strict=True)]))
    assert total == pytest.approx(theirs)


def test_matrices_and_areas_are_theirs(peer, torus):
    V, F = np.array(torus.V), np.array(torus.F)
    for epsilon in (0.0, 0.01):
        difference = pp3d.cotan_laplacian(V, F, epsilon) - peer.cotan_laplacian(V, F, epsilon)
        assert abs(difference).max() < 1e-12
    assert np.allclose(pp3d.face_areas(V, F), peer.face_areas(V, F))
    assert np.allclose(pp3d.vertex_areas(V, F), peer.vertex_areas(V, F))
    assert {tuple(edge) for edge in pp3d.edges(V, F)} == {tuple(sorted(edge)) for edge in peer.edges(V, F)}


def equator(ball: Mesh) -> list[int]:
    """The vertices of the equator, counter-clockwise seen from the north, the first again at the end."""
    around = np.flatnonzero(np.abs(ball.V[:, 2]) < 1e-9)
    around = around[np.argsort(np.arctan2(ball.V[around, 1], ball.V[around, 0]))]
    return [*around.tolist(), int(around[0])]


def latitude(ball: Mesh) -> np.ndarray:
    return np.arcsin(np.clip(ball.V[:, 2], -1, 1))


@pytest.mark.parametrize("constraint", ["ZeroSet", "None", "Multiple"])
def test_signed_distance_has_their_sign(peer, ball, constraint):
    """The north is on the left of the equator: positive."""
    curve = [(v, []) for v in equator(ball)]
    for module in (pp3d, peer):
        solver = module.MeshSignedHeatSolver(np.array(ball.V), np.array(ball.F))
        found = solver.compute_distance([curve], level_set_constraint=constraint)
        assert np.abs(found - latitude(ball)).max() < 0.03


def test_fast_marching_has_their_sign_and_less_error(peer, ball):
    """The north is on the left of the equator: negative."""
    curve = [(v, []) for v in equator(ball)]
    errors = []
    for module in (pp3d, peer):
        solver = module.MeshFastMarchingDistanceSolver(np.array(ball.V), np.array(ball.F))
        errors.append(np.abs(solver.compute_distance([curve], sign=True) + latitude(ball)).max())
    assert errors[0] < min(errors[1], 0.01)


def test_fast_marching_begins_at_their_values(peer, ball):
    """At points of faces, in the middles of edges, at vertices; also below 0."""
    edge = pp3d.edges(ball.V, ball.F)[40]
    same = int(np.flatnonzero((np.sort(peer.edges(np.array(ball.V), np.array(ball.F)), axis=1) == edge).all(1))[0])
    places = [(9, [0.2, 0.3, 0.5]), (30, [0.1, 0.6]), (100, [])]
    found = []
    for module, number in ((pp3d, 40), (peer, same)):
        solver = module.MeshFastMarchingDistanceSolver(np.array(ball.V), np.array(ball.F))
        found.append(solver.compute_distance([places, [(number, [0.5])]], [[0.1, -0.2], [0.3]]))
    assert np.abs(found[0] - found[1]).max() < 0.1
    assert np.abs(found[0] - found[1]).mean() < 0.04
    assert found[0].min() < 0


def test_signed_distance_of_polygons_and_points_is_negative_on_the_left(peer, ball):
    V, F, curve = np.array(ball.V), ball.F.tolist(), [equator(ball)]
    for module in (pp3d, peer):
        on_polygons = module.PolygonMeshHeatSolver(V, F).compute_signed_distance(curve)
        on_points = module.PointCloudHeatSolver(V).compute_signed_distance(curve, V)
        for found in (on_polygons, on_points):
            assert np.abs(found + latitude(ball)).max() < 0.03, module
    turned = pp3d.PointCloudHeatSolver(V).compute_signed_distance(curve, -V)
    assert np.abs(turned - latitude(ball)).max() < 0.03


def test_curves_through_faces_and_edges_are_one_curve(ball):
    """The isoline of `marching_triangles` at height 0.3, and the same with its points on edges."""
    V, F = ball.V, ball.F
    (isoline,) = pp3d.marching_triangles(V, F, V[:, 2], 0.3)
    number = {tuple(edge): i for i, edge in enumerate(pp3d.edges(V, F).tolist())}
    on_edges = []
    for face, weights in isoline:
        (low, share), (high, other) = sorted((v, w) for v, w in zip(F[face].tolist(), weights, strict=True) if w > 0)
        on_edges.append((number[low, high], [other / (share + other)]))
    solver = pp3d.MeshSignedHeatSolver(V, F)
    found = solver.compute_distance([isoline])
    assert np.allclose(found, solver.compute_distance([on_edges]), atol=1e-9)
    height = latitude(ball) - np.arcsin(0.3)
    assert np.abs(np.abs(found) - np.abs(height)).max() < 0.03
    assert len({float(sign) for sign in np.sign(found * height) if sign}) == 1


def test_nodes_without_a_common_face_are_joined(ball):
    whole = equator(ball)
    solver = pp3d.MeshFastMarchingDistanceSolver(ball.V, ball.F)
    found = solver.compute_distance([[(v, []) for v in (*whole[:-1:4], whole[0])]], sign=True)
    # Shortest paths of the polyhedron leave the equator a little.
    assert np.allclose(found, solver.compute_distance([[(v, []) for v in whole]], sign=True), atol=0.01)


def test_curves_and_points_without_a_sign(ball):
    curve, pole = [(v, []) for v in equator(ball)], int(ball.V[:, 2].argmin())
    solver = pp3d.MeshSignedHeatSolver(ball.V, ball.F)
    assert np.abs(solver.compute_distance([curve], [False]) - np.abs(latitude(ball))).mean() < 0.01
    found = solver.compute_distance([curve], points=[(pole, [])])
    assert found[pole] == 0
    north = latitude(ball) > 0.1
    assert np.array_equal(found[north], solver.compute_distance([curve])[north])


def test_the_polygon_solver_measures_a_plane_and_carries_vectors_unturned():
    V, F = igl.quad_grid(6, 6)[:2]
    V = np.hstack([V, np.zeros((len(V), 3 - V.shape[1]))])
    solver = pp3d.PolygonMeshHeatSolver(V, F)
    phi = solver.compute_distance([0])
    assert np.abs(phi - np.linalg.norm(V - V[0], axis=1)).max() < 0.15
    x, y, normal = solver.get_tangent_frames()
    assert np.allclose(np.cross(x, y), normal)
    carried = solver.transport_tangent_vectors([0], [[x[0, 0], y[0, 0]]])  # (1, 0, 0), everywhere the same in a plane
    assert np.allclose(carried[:, :1] * x + carried[:, 1:] * y, [1, 0, 0], atol=1e-9)
    assert np.array_equal(solver.extend_scalar([0, 20], [3.0, 3.0]), np.full(len(V), 3.0))


def test_the_cloud_solver_measures_a_sphere(ball):
    solver = pp3d.PointCloudHeatSolver(ball.V)
    exact = arcs(ball.V, 7)
    assert np.abs(solver.compute_distance(7) - exact).mean() < 0.05
    assert np.array_equal(solver.compute_distance(7), solver.compute_distance_multisource([7]))
    x, y, normal = solver.get_tangent_frames()
    assert np.allclose(np.abs(np.einsum("nx,nx->n", normal, ball.V)), 1, atol=0.01)
    plane = solver.compute_log_map(7)
    assert np.abs(np.linalg.norm(plane, axis=1) - exact).mean() < 0.01
    assert np.abs(plane @ [x[7], y[7]] @ ball.V[7]).max() < 0.1
    carried = solver.transport_tangent_vectors([7], [[2.0, 0.0]])
    assert np.allclose(np.linalg.norm(carried, axis=1).max(), 2)


def test_local_triangulations_are_fans(ball):
    """Each row begins with its point, each triangle is in three rows, and none is lost."""
    table = pp3d.PointCloudLocalTriangulation(ball.V).get_local_triangulation()
    assert table.shape == (ball.n_vertices, 6, 3)
    used = table[..., 0] >= 0
    assert np.array_equal(table[used][:, 0], np.nonzero(used)[0])
    assert (table[~used] == -1).all()
    found, count = np.unique(np.sort(table[used], axis=1), axis=0, return_counts=True)
    assert (count == 3).all()
    assert np.array_equal(found, np.unique(np.sort(ball.F, axis=1), axis=0))


@pytest.mark.parametrize(("kind", "rows"), [("per-vertex", 4), ("per-face", 2), ("per-corner", 6)])
def test_texture_coordinates_are_written(tmp_path, kind, rows):
    """Every corner names the row of coordinates that is of the vertex, the face or the corner."""
    V, F = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    coordinates = np.arange(2.0 * rows).reshape(-1, 2) / 7
    pp3d.write_mesh(V, F, tmp_path / "a.obj", coordinates, kind)
    assert pp3d.read_mesh(tmp_path / "a.obj")[1].tolist() == F
    lines = (tmp_path / "a.obj").read_text().splitlines()
    written = [line.split()[1:] for line in lines if line.startswith("vt ")]
    assert np.array_equal(np.array(written, float), coordinates)
    corners = [int(corner.split("/")[1]) - 1 for line in lines if line.startswith("f ") for corner in line.split()[1:]]
    expected = {"per-vertex": [0, 1, 2, 0, 2, 3], "per-face": [0, 0, 0, 1, 1, 1], "per-corner": list(range(6))}
    assert corners == expected[kind]
    with pytest.raises(ValueError, match=rf"UV_coords must have shape \({rows}, 2\), {kind}, not \({rows + 1}, 2\)"):
        pp3d.write_mesh(V, F, tmp_path / "a.obj", np.zeros((rows + 1, 2)), kind)
    with pytest.raises(ValueError, match="UV_type must be one of 'per-vertex', 'per-face', 'per-corner', not None"):
        pp3d.write_mesh(V, F, tmp_path / "a.obj", coordinates)
    with pytest.raises(ValueError, match=r"UV_coords are written to \.obj files"):
        pp3d.write_mesh(V, F, tmp_path / "a.ply", coordinates, kind)


def test_files_are_read_back_as_written(tmp_path, torus):
    pp3d.write_mesh(torus.V, torus.F, str(tmp_path / "a.obj"))
    V, F = pp3d.read_mesh(str(tmp_path / "a.obj"))
    assert np.array_equal(V, torus.V)
    assert np.array_equal(F, torus.F)
    V, polygons = pp3d.read_polygon_mesh(str(tmp_path / "a.obj"))
    assert polygons == torus.F.tolist()
    pp3d.write_point_cloud(torus.V, str(tmp_path / "b.ply"))
    assert np.array_equal(pp3d.read_point_cloud(str(tmp_path / "b.ply")), torus.V)


# --- The drop-ins for gdist and pygeodesic: the numbers of these libraries, from their calls


@pytest.fixture(params=[lambda: bumpy(2), lambda: twice(shapes.grid(4), 3), lambda: shapes.torus(14, 9)])
def mesh(request):
    return request.param()


def arrays(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    return np.array(mesh.V), mesh.F.astype(np.int32)


def indices(*values: int) -> np.ndarray:
    return np.array(values, np.int32)


# --- gdist ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        (indices(3),),
        (indices(3, 20),),
        (indices(3, 20), indices(7, 1, 3, 7)),
        (None, indices(9)),
        (indices(2), None),
    ],
)
def test_gdist_distances(mesh, arguments):
    theirs = pytest.importorskip("gdist").compute_gdist(*arrays(mesh), *arguments)
    ours = gdist.compute_gdist(*arrays(mesh), *arguments)
    assert ours.dtype == np.float64
    np.testing.assert_allclose(ours, theirs, atol=1e-12)


def test_gdist_counts_from_one_and_stops_at_the_largest_distance(mesh):
    V, F = arrays(mesh)
    whole = gdist.compute_gdist(V, F, [5])
    np.testing.assert_array_equal(gdist.compute_gdist(V, F + 1, [5], is_one_indexed=True), whole)
    radius = float(np.median(whole))
    near = gdist.compute_gdist(V, F, [5], max_distance=radius)
    np.testing.assert_allclose(near, np.where(whole <= radius, whole, np.inf), rtol=1e-14)
    assert gdist.compute_gdist(V, F, [5], []).shape == (0,)


@pytest.mark.parametrize("radius", [0.7, None])
def test_gdist_matrices(mesh, radius):
    peer = pytest.importorskip("gdist")
    limit = () if radius is None else (radius,)
    ours, theirs = (module.local_gdist_matrix(*arrays(mesh), *limit) for module in (gdist, peer))
    assert isinstance(ours, sp.csc_matrix)
    if radius is None:  # gdist stores 1e100 between components
        theirs.data[theirs.data > 1e99] = 0
        theirs.eliminate_zeros()
    assert ours.nnz == theirs.nnz
    np.testing.assert_allclose(ours.toarray(), theirs.toarray(), atol=1e-12)
    chosen = indices(4, 0, 17, 30)
    ours, theirs = (module.distance_matrix_of_selected_points(*arrays(mesh), chosen) for module in (gdist, peer))
    np.testing.assert_allclose(ours.toarray(), theirs.toarray(), atol=1e-12)
    within = gdist.distance_matrix_of_selected_points(*arrays(mesh), chosen, 1.0)
    assert within.nnz == (ours.data <= 1.0).sum()
    assert abs(within - within.T).max() == 0


# --- pygeodesic -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [(), ([3],), ([20, 3, 20],), ([3, 20], [7, 1, 3, 7]), (None, [9])])
def test_pygeodesic_distances(mesh, arguments):
    peer = pytest.importorskip("pygeodesic.geodesic")
    theirs, their_best = peer.PyGeodesicAlgorithmExact(*arrays(mesh)).geodesicDistances(*arguments)
    ours, best = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh)).geodesicDistances(*arguments)
    np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert best.dtype == their_best.dtype
    assert len(best) == len(their_best)
    # Of equally near sources, either is right: the distance from the named one alone is the distance.
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh))
    sources = [0] if not arguments or arguments[0] is None else arguments[0]
    each = np.stack([algorithm.geodesicDistances([s], *arguments[1:])[0] for s in sources])
    np.testing.assert_allclose(each[best, np.arange(len(best))], ours, atol=1e-12)


def test_pygeodesic_stops_at_the_largest_distance():
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(shapes.strip(5, 1)))
    distance, _ = algorithm.geodesicDistances([0], None, 2.5)
    np.testing.assert_allclose(distance, [0, 1, 2, np.inf, np.inf, np.inf, 1, 2**0.5, 5**0.5, np.inf, np.inf, np.inf])
    assert algorithm.geodesicDistances([0], [5, 1], 2.5)[0].tolist() == [np.inf, 1.0]


def test_pygeodesic_path(mesh):
    peer = pytest.importorskip("pygeodesic.geodesic").PyGeodesicAlgorithmExact(*arrays(mesh))
    algorithm = pygeodesic.PyGeodesicAlgorithmExact(*arrays(mesh))
    for source, target in pairwise([0, 7, 22, 13, 2]):
        length, path = algorithm.geodesicDistance(source, target)
        their_length, their_path = peer.geodesicDistance(source, target)
        assert length == pytest.approx(their_length, rel=1e-12)
        assert lengths(path) == pytest.approx(length, rel=1e-12)
        np.testing.assert_allclose(path[[0, -1]], their_path[[0, -1]], atol=1e-12)
    assert algorithm.geodesicDistance(3, 3)[1].tolist() == mesh.V[[3]].tolist()


def test_pygeodesic_reads_its_files(tmp_path):
    V, F = arrays(shapes.grid(2))
    path = tmp_path / "mesh.txt"
    lines = [f"{len(V)} {len(F)}", *(" ".join(map(repr, row)) for row in [*V.tolist(), *F.tolist()])]
    path.write_text("\n".join(lines))
    points, faces = pygeodesic.read_mesh_from_file(path)
    np.testing.assert_array_equal(points, V)
    np.testing.assert_array_equal(faces, F)
    path.write_text("\n".join(lines[:-1]))
    with pytest.raises(MeshError, match="ends before"):
        pygeodesic.read_mesh_from_file(path)
    path.write_text("solid")
    with pytest.raises(MeshError, match="expected a line"):
        pygeodesic.read_mesh_from_file(path)
