"""The connection Laplacian and the vector heat method."""

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import flat_perturbed, perturbed
from surfaces import box_surface

import heat_igl
from heat_igl import Mesh, VectorHeatSolver, exp_map, shapes, tangent_frames
from heat_igl.compat import potpourri3d
from heat_igl.heat.steps import VectorHeatFlow
from heat_igl.operators import connection_laplacian, edge_rotations, operators
from heat_igl.validation.construction import planar

SHAPES = {
    "sphere": perturbed(shapes.icosphere(3)),
    "torus": perturbed(shapes.torus(20, 40)),
    "slivers": shapes.with_slivers(shapes.icosphere(2), 0),
    "cylinder": perturbed(shapes.cylinder(20, 20)),
    "flipped": perturbed(shapes.torus(12, 40), 0.6),
}


def angle_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(np.angle((a[:, 0] + 1j * a[:, 1]) * (b[:, 0] - 1j * b[:, 1])))


@pytest.mark.parametrize("laplacian", ["intrinsic-delaunay", "cotan"])
@pytest.mark.parametrize("name", SHAPES)
def test_connection_laplacian_is_hermitian_and_negative_semidefinite(name, laplacian):
    mesh = SHAPES[name]
    connection = connection_laplacian(mesh, laplacian)
    assert connection.format == "csc"
    assert abs(connection - connection.conj().T).max() < 1e-12 * abs(connection).max()
    if laplacian == "intrinsic-delaunay":
        assert np.linalg.eigvalsh(connection.toarray())[-1] < 1e-8 * abs(connection).max()
    # On a single edge only the argument differs from L.
    L = operators(mesh, laplacian).L
    np.testing.assert_allclose(abs(connection.diagonal()), abs(L.diagonal()), rtol=1e-10)


def test_flat_connection_is_scalar():
    mesh = flat_perturbed(shapes.grid(8))
    frames = tangent_frames(mesh)
    turn = sp.diags_array(frames.x[:, 0] + 1j * frames.x[:, 1])
    scalar = turn @ connection_laplacian(mesh) @ turn.conj()
    assert abs(scalar - operators(mesh).L).max() < 1e-12


@pytest.mark.parametrize("name", SHAPES)
def test_vector_heat_solves_the_complex_system(name):
    mesh = SHAPES[name]
    domain = operators(mesh)
    rotations = edge_rotations(domain)
    t = domain.mean_edge_length**2
    flow = VectorHeatFlow(domain, rotations, t)
    b = np.random.default_rng(0).standard_normal((domain.n, 2)) * (1 + 2j)
    Y = flow.solve(b)
    matrix = domain.M - t * connection_laplacian(mesh)
    np.testing.assert_allclose(matrix @ Y, domain.mean_mass * b, atol=1e-11 * abs(domain.mean_mass * b).max())
    np.testing.assert_allclose(flow.solve(b[:, 0]), Y[:, 0], rtol=1e-9, atol=1e-12 * abs(Y).max())


@pytest.mark.parametrize(("method", "off"), [("heat", 1e-10), ("windows", 1e-8)])
@pytest.mark.parametrize("mesh", [shapes.strip(1500, 3), flat_perturbed(shapes.grid(15))])
def test_transport_in_the_plane_changes_nothing(mesh, method, off):
    solver = VectorHeatSolver(mesh, method=method)
    frames = solver.frames
    source = mesh.n_vertices // 3
    transported = frames.to_world(solver.transport(source, frames.from_world([[0.6, -0.8, 0]], [source])))
    np.testing.assert_allclose(transported, np.broadcast_to([0.6, -0.8, 0], transported.shape), atol=off)


def test_transport_around_the_tip_of_a_cone_is_that_of_the_sector():
    around, along = 60, 30
    mesh = shapes.cone(around, along)
    solver = VectorHeatSolver(mesh)
    k = np.arange(around // 3)
    ring = 1 + 19 * around + k
    slant = np.zeros((1, 3)) + mesh.V[ring[0]]
    slant /= np.linalg.norm(slant)
    # In the sector, the direction away from the tip turns with the angle of the sector.
    sector = 2 * np.arcsin(np.sin(np.pi / 6) * np.sin(np.pi / around)) * k
    transported = solver.frames.to_world(solver.transport(ring[0], solver.frames.from_world(slant, ring[:1])))[ring]
    away = mesh.V[ring] / np.linalg.norm(mesh.V[ring], axis=1)[:, None]
    found = np.arccos(np.clip(np.einsum("kx,kx->k", transported, away), -1, 1))
    np.testing.assert_allclose(found[1:], sector[1:], atol=0.02)


def sphere_transport(p: np.ndarray, q: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Transport of w from p along great circles to q (n, 3)."""
    return w - (q @ w)[:, None] * (p + q) / np.maximum(1 + q @ p, 1e-9)[:, None]


def off_great_circles(solver: VectorHeatSolver, mesh: Mesh, least: float) -> np.ndarray:
    """How far a vector from vertex 0 of a sphere is turned where the cosine of the distance is at least so much."""
    frames, p = solver.frames, mesh.V[0]
    expected = frames.from_world(sphere_transport(p, mesh.V, frames.to_world([[1.0, 0]], [0])[0]))
    found = solver.transport(0, [1, 0])
    assert np.isfinite(found).all()
    return angle_between(found, expected)[(mesh.V @ p > least) & (mesh.V @ p < 1)]


def test_transport_and_log_map_converge_on_the_sphere():
    """With a time step that stays the same: by symmetry, heat of any time step transports along great circles."""
    transports, along_paths, logs = [], [], []
    for level in (2, 3, 4):
        mesh, finer = shapes.icosphere(level), shapes.icosphere(level + 1)
        solver = VectorHeatSolver(mesh, t=0.05)
        transports.append(off_great_circles(solver, mesh, -0.5).mean())
        along_paths.append(off_great_circles(VectorHeatSolver(finer, method="windows"), finer, -0.5).mean())
        frames, p = solver.frames, mesh.V[0]
        near = np.flatnonzero((mesh.V @ p > -0.5) & (mesh.V @ p < 1))
        angle = np.arccos(np.clip(mesh.V @ p, -1, 1))
        flat = frames.from_world(mesh.V - (mesh.V @ p)[:, None] * p, np.zeros(mesh.n_vertices, int))
        true = angle[:, None] * flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
        logs.append(np.linalg.norm(solver.log_map(0) - true, axis=1)[near].mean())
    assert transports[2] < 0.3 * transports[1] < 0.09 * transports[0]
    assert transports[2] < np.radians(0.01)
    assert along_paths[2] < 0.5 * along_paths[1] < 0.25 * along_paths[0]
    assert along_paths[2] < np.radians(0.2)
    assert logs[2] < 0.6 * logs[1]
    assert logs[2] < 0.0015


def test_log_map_is_undone_by_the_exponential_map(sphere):
    solver = VectorHeatSolver(sphere)
    log = solver.log_map(5)
    ends = exp_map(sphere, 5, log).positions(sphere)
    gap = np.linalg.norm(ends - sphere.V, axis=1)
    assert np.median(gap) < 0.05
    assert gap.max() < 0.35
    # The length is that of heat's three steps, before the distance is held to bounds: as with a time step of one's own.
    solver_of_steps = heat_igl.HeatMethodSolver(sphere, t_coef=0.5)
    np.testing.assert_allclose(np.hypot(*log.T), solver_of_steps.distance(5))
    # Neighbours lie in the direction of their edges.
    ring = np.unique(sphere.F[(sphere.F == 5).any(axis=1)])
    assert gap[ring].max() < 1e-6


def test_extension_is_between_the_values_and_near_that_of_the_nearest_source(sphere):
    solver = VectorHeatSolver(sphere)
    sources, values = np.array([0, 500, 1700, 2000]), np.array([3.0, -1.0, 2.0, 7.0])
    extended = solver.extend(sources, values)
    assert values.min() <= extended.min() <= extended.max() <= values.max()
    labels = heat_igl.HeatMethodSolver(sphere).voronoi(sources).labels
    assert (np.abs(extended - values[labels]) < 0.5).mean() > 0.85
    np.testing.assert_allclose(extended[sources], values, atol=1e-3)
    np.testing.assert_allclose(solver.extend([9, 9], [1.0, 3.0]), 2.0)
    np.testing.assert_allclose(solver.extend(9, -4.0), -4.0)
    np.testing.assert_array_equal(solver.extend(9, 0.0), 0)


def test_lengths_and_linearity_of_transport(sphere):
    solver = VectorHeatSolver(sphere)
    one = solver.transport(3, [0.3, 0.4])
    np.testing.assert_allclose(np.hypot(*one.T), 0.5)
    np.testing.assert_allclose(one[3], [0.3, 0.4], atol=1e-12)
    np.testing.assert_allclose(solver.transport(3, [-0.4, 0.3]), one @ [[0, 1], [-1, 0]], atol=1e-9)
    assert np.isfinite(solver.transport([3, 9], np.zeros((2, 2)))).all()


@pytest.mark.filterwarnings("ignore:heat is off")
def test_vertices_that_no_source_reaches_get_zero():
    grid = shapes.grid(4)
    V = np.vstack([grid.V, grid.V + np.array([3, 0, 0]), [[9, 9, 9]]])
    mesh = Mesh(V, np.vstack([grid.F, grid.F + 25]))
    solver = VectorHeatSolver(mesh)
    reached = solver.reaches(3)
    np.testing.assert_array_equal(reached, np.arange(51) < 25)
    for found in (solver.extend(3, 2.0)[:, None], solver.transport(3, [1, 2]), solver.log_map(3)):
        assert np.isfinite(found).all()
        assert not found[~reached].any()
        assert found[reached].any()


def test_a_component_has_vectors_as_alone():
    small, large = shapes.torus(12, 20), shapes.icosphere(3)
    V = np.concatenate([small.V, 100 * large.V + 200])
    both = VectorHeatSolver(Mesh(V, np.concatenate([small.F, large.F + small.n_vertices])))
    alone, n = VectorHeatSolver(small), small.n_vertices
    assert np.abs(both.transport([3, 50], np.eye(2))[:n] - alone.transport([3, 50], np.eye(2))).max() < 1e-9
    assert np.abs(both.log_map(3)[:n] - alone.log_map(3)).max() < 1e-9


@pytest.mark.slow
def test_a_large_sphere_is_finite_and_right():
    mesh = shapes.icosphere(8)
    error = off_great_circles(VectorHeatSolver(mesh), mesh, -0.9)
    # For time steps of h^2 the error grows slowly with the number of vertices (docs/directions_theory.md).
    assert error.mean() < np.radians(0.13)
    assert error.max() < np.radians(1.3)


def test_transport_around_the_corner_of_a_box_turns_by_a_right_angle():
    """The holonomy of a triangle of geodesics is the curvature inside: pi / 2 around a corner, else 0."""
    mesh = box_surface(8)
    low, high = mesh.V.min(axis=0), mesh.V.max(axis=0)
    at = (mesh.V - low) / (high - low)

    def vertex(*place):
        return int(np.argmin(np.linalg.norm(at - place, axis=1)))

    solver = VectorHeatSolver(mesh, method="windows")

    def holonomy(*loop):
        turned = 1.0 + 0j
        for start, end in zip(loop, [*loop[1:], loop[0]], strict=True):
            turned *= complex(*solver.transport(start, [1, 0])[end])
        return turned

    around = holonomy(vertex(0.625, 0.75, 0), vertex(0, 0.75, 0.25), vertex(0.625, 1, 0.375))
    beside = holonomy(vertex(0.625, 0.75, 0), vertex(0.25, 0.5, 0), vertex(0, 0.625, 0.375))
    np.testing.assert_allclose(
        [abs(around), abs(np.angle(around)), abs(np.angle(beside))], [1, np.pi / 2, 0], atol=1e-9
    )


def test_along_paths_the_nearest_source_alone_counts(sphere):
    solver = VectorHeatSolver(sphere, method="windows")
    sources = [40, 7, 40]
    labels = heat_igl.GeodesicSolver(sphere, method="exact").voronoi([40, 7]).labels
    np.testing.assert_allclose(solver.extend(sources, [1.0, 5.0, 2.0]), np.where(labels == 0, 1.5, 5.0))
    length = np.hypot(*solver.transport(sources, [[1, 0], [3, 4], [0, 1]]).T)
    np.testing.assert_allclose(length, np.where(labels == 0, np.sqrt(0.5), 5.0))
    np.testing.assert_allclose(solver.log_map(7), heat_igl.log_map(sphere, 7, method="exact"), atol=1e-12)


@pytest.mark.parametrize("name", [name for name, mesh in SHAPES.items() if not mesh.boundary.any()])
def test_transport_on_closed_surfaces_is_that_of_potpourri3d(name):
    """By its drop-in, with the same time step (2 for 1), weights and masses; at a boundary the connections differ."""
    peer, mesh, frames = pytest.importorskip("potpourri3d"), SHAPES[name], tangent_frames(SHAPES[name])
    vector, carried, extended = frames.to_world([[1.0, 0]], [3])[0], [], []
    for module, t_coef in ((peer, 1.0), (potpourri3d, 2.0)):
        solver = module.MeshVectorHeatSolver(mesh.V, mesh.F, t_coef)
        x, y, normal = solver.get_tangent_frames()
        np.testing.assert_allclose(np.cross(x, y), normal, atol=1e-9)
        found = solver.transport_tangent_vector(3, [x[3] @ vector, y[3] @ vector])
        carried.append(frames.from_world(found[:, :1] * x + found[:, 1:] * y))
        extended.append(solver.extend_scalar([1, mesh.n_vertices // 2], [1.0, 2.0]))
    assert np.median(angle_between(*carried)) < 1e-6
    assert np.median(np.abs(extended[0] - extended[1])) < 0.02


def test_a_source_that_no_face_uses_gets_no_advice_to_raise_t():
    ball = shapes.icosphere(1)
    apart = VectorHeatSolver(Mesh(np.append(ball.V, [[3.0, 0.0, 0.0]], axis=0), ball.F))
    with pytest.warns(heat_igl.AccuracyWarning, match="vertex 42 first: they get 0; no face uses them"):
        assert apart.extend([0, 42], [2.0, 5.0]) == pytest.approx(np.append(np.full(42, 2.0), 0.0))


@pytest.mark.parametrize("sources", [[700], [700, 250, 4]])
def test_parallel_vectors_stay_parallel_on_obtuse_triangles_at_the_boundary(sources):
    """Their negative weights make heat negative behind them, and turned a quarter of the vectors round."""
    mesh = planar(np.random.default_rng(3).random((1000, 2)))
    solver = heat_igl.VectorHeatSolver(mesh)
    vector = np.array([0.8, 0.6, 0.0])
    given = solver.frames.from_world(np.tile(vector, (len(sources), 1)), sources)
    found = solver.frames.to_world(solver.transport(sources, given), np.arange(mesh.n_vertices))
    np.testing.assert_allclose(found, np.broadcast_to(vector, mesh.V.shape), atol=1e-6)
