"""HeatMethodSolver: the three steps together, options, range, parity with libigl, and rates of convergence."""

import dataclasses
from collections.abc import Callable

import igl
import numpy as np
import pytest
from conftest import perturbed, wheel_path, zoo
from surfaces import arcs, nearest_vertex

from heat_igl import AccuracyWarning, HeatMethodSolver, Mesh, SourceError, read_mesh, shapes
from heat_igl.geodesic import SolverChoice
from heat_igl.heat import SolverOptions
from heat_igl.heat.steps import HeatFlow, fitted_laplacian, integrate
from heat_igl.operators import Operators, intrinsic_operators, operators
from heat_igl.validation import closed_forms


def test_the_cell_of_each_source_starts_at_0_by_itself(sphere, solver):
    """A common shift would leave the error of the paths between sources."""
    sources = [3, 4, 5, 6, 7, 800]
    together, h = solver.distance(sources), solver.diagnostics.mean_edge_length
    for source in sources:
        ring = (arcs(sphere.V, source) < 3 * h) & (arcs(sphere.V, source) > 2 * h)
        bias = (together - solver.distance(source))[ring].mean()
        assert abs(bias) < 0.05 * h


@pytest.mark.parametrize("magnitude", ["unit", "damped"])
def test_a_region_as_source(magnitude):
    """Inside a region of sources distance is 0, and outside it is as from its rim."""
    mesh = perturbed(shapes.grid(40), 0.2)
    region = np.linalg.norm(mesh.V - [0.5, 0.5, 0], axis=1) < 0.4
    distance = HeatMethodSolver(mesh, magnitude=magnitude).distance(region)
    assert (distance[region] == 0).all()
    exact = np.linalg.norm(mesh.V[:, None, :2] - mesh.V[region][None, :, :2], axis=2).min(axis=1)
    assert np.abs(distance - exact).mean() < 0.02 * exact.max()


def test_solution_holds_the_three_steps(sphere):
    solver = HeatMethodSolver(sphere, t_coef=0.5)  # asked for, so that the answer is left as it is
    solution = solver.solve(7)
    domain = solver.operators
    u0 = np.zeros(sphere.n_vertices)
    u0[7] = 1
    residual = domain.M @ solution.heat - solution.t * (fitted_laplacian(domain, solution.t) @ solution.heat) - u0
    assert np.abs(residual).max() < 1e-13
    log_heat = np.log(solution.heat)
    descent = -(domain.G @ log_heat).reshape(domain.dimension, -1).T
    descent /= np.linalg.norm(descent, axis=1, keepdims=True)
    np.testing.assert_allclose(solution.direction, descent, rtol=0, atol=1e-12)
    assert solution.direction.shape[0] == sphere.n_faces
    np.testing.assert_allclose(np.linalg.norm(solution.direction, axis=1), 1, rtol=1e-14)
    assert (solution.distance == solver.distance(7)).all()
    phi = integrate(domain, (solution.direction * solution.magnitude[:, None]).T.ravel())
    # Around the source, edges are known to be straight.
    ring = np.unique(sphere.edges[(sphere.edges == 7).any(axis=1)])
    lengths = np.linalg.norm(sphere.V[ring] - sphere.V[7], axis=1)
    np.testing.assert_allclose(solution.distance[ring], lengths, rtol=1e-14, atol=0)
    far = np.setdiff1d(np.arange(sphere.n_vertices), np.unique(sphere.F[np.isin(sphere.F, ring).any(axis=1)]))
    # phi starts at the level that fits the source and its ring best.
    level = (phi[7] + (phi[ring] - lengths)[ring != 7].sum()) / len(ring)
    np.testing.assert_allclose(solution.distance[far], (phi - level)[far], rtol=0, atol=1e-11)
    assert solution.t == solver.t == solution.diagnostics.t


def test_heat_of_a_region_starts_at_its_rim():
    mesh = shapes.grid(12)
    region = (np.abs(mesh.V - [0.5, 0.5, 0]) < 0.3).all(axis=1)
    rim = np.zeros(mesh.n_vertices, bool)
    crossing = mesh.edges[region[mesh.edges[:, 0]] != region[mesh.edges[:, 1]]]
    rim[crossing.ravel()] = True
    solver = HeatMethodSolver(mesh)
    heat = solver.solve(region).heat
    residual = solver.operators.M @ heat - solver.t * (fitted_laplacian(solver.operators, solver.t) @ heat)
    np.testing.assert_allclose(residual, rim & region, rtol=0, atol=1e-12)


def test_bad_source_set_is_named_before_anything_is_solved(solver):
    out = np.full((2, solver.n_vertices), -1.0)
    with pytest.raises(SourceError, match=r"source_sets\[1\]: sources\[0\] = 9999 is no vertex"):
        solver.distances([0, 9999], out=out)
    assert (out == -1).all()


def test_time_step_is_a_multiple_of_the_squared_mean_edge_length(sphere):
    h = HeatMethodSolver(sphere).diagnostics.mean_edge_length
    assert HeatMethodSolver(sphere).t == pytest.approx(h**2 / 2, rel=1e-14)
    assert HeatMethodSolver(sphere, magnitude="unit").t == pytest.approx(h**2, rel=1e-14)
    assert HeatMethodSolver(shapes.box(3), t_coef=None).diagnostics.t_requested == pytest.approx(
        operators(shapes.box(3)).mean_edge_length ** 2, rel=1e-14
    )
    assert HeatMethodSolver(sphere, t_coef=4).t == pytest.approx(4 * h**2, rel=1e-14)
    assert HeatMethodSolver(sphere, t_coef=4, t=0.03).t == 0.03
    assert not HeatMethodSolver(sphere).diagnostics.t_raised


STRIP = shapes.strip(3000, 1)


def test_time_step_is_raised_when_heat_would_not_cross():
    solver = HeatMethodSolver(STRIP)
    assert solver.diagnostics.t_raised
    assert solver.t > solver.diagnostics.t_requested
    with pytest.warns(AccuracyWarning, match=r"t = 0.5 is too small for heat to cross the mesh.* using"):
        explicit = HeatMethodSolver(STRIP, t=0.5)
    assert explicit.t == solver.t
    solution = solver.solve(0)
    assert (np.linalg.norm(solution.direction, axis=1) > 0).all()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda _: HeatMethodSolver(STRIP, t=0.5), "too small"),
        (lambda _: HeatMethodSolver(operators(STRIP), t=0.5), "too small"),
        (lambda cold: cold.distance(0), "no heat arrives"),
        (lambda cold: cold.voronoi(0), "no heat arrives"),
        (lambda cold: cold.solve(0), "no heat arrives"),
        (lambda cold: cold.distances([[0]] * 20), "no heat arrives"),
        (lambda cold: next(cold.iter_distances([[0]] * 20)), "no heat arrives"),
    ],
)
def test_a_warning_points_at_the_line_that_calls_the_package(call, message):
    # Heat runs out on a domain whose extent is understated.
    solver = HeatMethodSolver(dataclasses.replace(operators(STRIP), longest_distance=1.0), magnitude="unit")
    with pytest.warns(AccuracyWarning, match=message) as caught:
        call(solver)
    lines = {(warning.filename, warning.lineno) for warning in caught}
    assert lines == {(__file__, call.__code__.co_firstlineno)}


def test_the_field_is_damped_by_default_and_of_unit_length_on_demand():
    """By default the field is damped on surfaces; the paper's plain method is there for the asking."""
    mesh = perturbed(shapes.disk(8))
    assert HeatMethodSolver(mesh).solve(20).magnitude.min() < 1
    assert (HeatMethodSolver(mesh, magnitude="unit").solve(20).magnitude == 1).all()
    assert (HeatMethodSolver(mesh, laplacian="cotan").solve(20).magnitude == 1).all()
    assert HeatMethodSolver(mesh, laplacian="cotan", magnitude="damped").solve(20).magnitude.min() < 1
    assert (HeatMethodSolver(shapes.box(8)).solve(0).magnitude == 1).all()


def test_dirichlet_and_average_boundaries():
    mesh = shapes.disk(20)
    exact = np.linalg.norm(mesh.V, axis=1)
    errors = {
        boundary: np.abs(HeatMethodSolver(mesh, boundary=boundary).distance(0) - exact).max()
        for boundary in ("neumann", "dirichlet", "average")
    }
    assert 0.001 < min(errors.values()) <= max(errors.values()) < 0.022
    # A source on the boundary keeps its heat although the boundary is cold.
    edge = int(np.argmax(mesh.V[:, 0]))
    with pytest.warns(AccuracyWarning, match="too short"):
        distance = HeatMethodSolver(mesh, boundary="dirichlet").distance(edge)
    assert 1.5 < distance[np.argmin(mesh.V[:, 0])] < 2.5


@pytest.mark.filterwarnings("ignore:heat gave|heat is off|distances differ:heat_igl.AccuracyWarning")
@pytest.mark.parametrize("name", ["voxel blob", "crossed sheets", "pinched", "dust"])
@pytest.mark.parametrize("laplacian", ["intrinsic-delaunay", "cotan"])
@pytest.mark.parametrize("boundary", ["neumann", "average"])
def test_bad_meshes_get_finite_distances(name, laplacian, boundary):
    """Not manifold, in many pieces, or touching in a vertex only: many exact solvers crash on these."""
    mesh = zoo(name)
    solver = HeatMethodSolver(mesh, laplacian=laplacian, boundary=boundary)
    for source in np.random.default_rng(0).choice(mesh.n_vertices, 5):
        distance = solver.distance(source)
        reached = mesh.components == mesh.components[source]
        assert np.isfinite(distance[reached]).all()
        assert (distance[reached] <= 1.5 * mesh.longest_distance).all()
        assert (distance[~reached] == np.inf).all()


def test_cold_boundary_that_cuts_the_mesh_is_reported():
    """Two disks that touch in a vertex of their boundary: no heat passes it when the boundary is held at zero."""
    disk = shapes.disk(6)
    second = disk.V + np.array([2, 0, 0])
    touching = int(np.argmin(second[:, 0]))
    label = np.arange(disk.n_vertices) + disk.n_vertices
    label[touching] = np.argmax(disk.V[:, 0])
    mesh = Mesh(np.vstack([disk.V, second]), np.vstack([disk.F, label[disk.F]]))
    with (
        pytest.warns(AccuracyWarning, match="no heat arrives at .* boundary='average'"),
        pytest.warns(AccuracyWarning, match="too short on average, below straight lines"),
    ):
        HeatMethodSolver(mesh, boundary="dirichlet").distance(0)
    distance = HeatMethodSolver(mesh, boundary="average").distance(0)
    assert distance[label[0]] == pytest.approx(2, abs=0.2)


def test_options_put_together_before_are_those_of_the_keywords():
    mesh = perturbed(shapes.disk(6))
    chosen = {"t_coef": np.float32(3), "laplacian": "cotan", "boundary": "average", "backend": "scipy"}
    options = SolverOptions(**chosen)
    assert type(options.t_coef) is float
    np.testing.assert_array_equal(
        SolverChoice("heat", heat=options).on(mesh).distance(5), HeatMethodSolver(mesh, **chosen).distance(5)
    )


# --- Large and elongated meshes, where heat in double precision runs out of range unless something is done about it


@pytest.mark.parametrize("backend", ["scipy", "multifrontal"])
def test_heat_keeps_its_relative_accuracy_over_500_decades(backend):
    """Four vertices wide, 4000 cells long: the heat per cell falls by the closed form acosh(1 + h^2 / 2 t)."""
    domain = operators(shapes.strip(4000, 3))
    t = 10.0
    b = np.zeros((domain.n, 9))
    b[::4001, 0] = 1e290  # a row of sources across the end: one-dimensional
    b[:, 1:] = b[:, :1]
    u = HeatFlow(domain, t, backend=backend).solve(b)
    rate = -np.diff(np.log(u[:4001]), axis=0)[100:3900]
    assert u[3900].max() < 1e-200
    np.testing.assert_allclose(rate, np.arccosh(1 + 1 / (2 * t)), rtol=1e-9)


@pytest.mark.slow
def test_grid_450_from_a_corner():
    unit = shapes.grid(449)
    mesh = Mesh(unit.V * 449, unit.F)
    exact = np.linalg.norm(mesh.V, axis=1)
    distance = HeatMethodSolver(mesh).distance(0)
    assert (np.abs(distance - exact)[1:] / exact[1:]).mean() < 0.01
    # Along diagonals heat falls faster than along rows, the more so the smaller t is.
    assert distance[-1] == pytest.approx(449 * np.sqrt(2), rel=0.015)
    at_the_papers_time = HeatMethodSolver(mesh, t_coef=1).distance(0)
    assert (np.abs(at_the_papers_time - exact)[1:] / exact[1:]).mean() < 0.006
    assert at_the_papers_time[-1] == pytest.approx(449 * np.sqrt(2), rel=0.01)


# --- The same numbers as libigl's own heat method, where both do the same


@pytest.mark.parametrize("name", ["cow.obj", "bunny.obj"])
@pytest.mark.parametrize("seed", [0, 1])
def test_cotan_agrees_with_libigl(name, seed):
    """To 1e-6 of the diameter; libigl averages both boundary conditions, and leaves the source at the mean, 0."""
    mesh = read_mesh(wheel_path(name))
    inner = np.flatnonzero(mesh.referenced & ~mesh.boundary)
    source = int(np.random.default_rng(seed).choice(inner))
    solver = HeatMethodSolver(mesh, laplacian="cotan", boundary="average")
    data = igl.HeatGeodesicsData()
    igl.heat_geodesics_precompute(mesh.V, mesh.F, solver.t, data)
    expected = igl.heat_geodesics_solve(data, np.array([source]))
    expected = np.maximum(expected - expected[source], 0)
    difference = np.abs(solver.distance(source) - expected)
    assert difference.max() <= 1e-6 * mesh.longest_distance


# --- Distance converges to the known one, at the rate the theory gives and no faster, on every kind of domain


def on(
    mesh: Mesh, place: int | list[float], closed: Callable[[Mesh, int], np.ndarray]
) -> tuple[Operators, int, np.ndarray]:
    source = place if isinstance(place, int) else nearest_vertex(mesh, place)
    return operators(mesh), source, closed(mesh, source)


def flat_torus(n: int) -> tuple[Operators, int, np.ndarray]:
    coordinates = np.stack(np.divmod(np.arange(n * n), n), axis=1) / n
    return intrinsic_operators(shapes.flat_torus(n)), 0, closed_forms.flat_torus(coordinates, 0)


def mean_error(domain: Operators, source: int, exact: np.ndarray, t: float, **options) -> float:
    distance = HeatMethodSolver(domain, t=t, **options).distance(source)
    return float(np.abs(distance - exact).mean())


def test_the_order_of_sources_does_not_matter():
    solver = HeatMethodSolver(shapes.grid(20))
    for sources in ([225, 247], [0, 2, 42, 44]):  # vertices between them are equally near to two
        assert np.array_equal(solver.distance(sources), solver.distance(sources[::-1]))


@pytest.mark.parametrize(("magnitude", "fastest"), [("unit", 1.0), ("auto", 1.6)])
@pytest.mark.parametrize(
    ("shape", "sizes"),
    [
        (lambda n: on(shapes.disk(n), [0.5, 0, 0], closed_forms.plane), (16, 32, 64)),
        (lambda n: on(shapes.icosphere(int(np.log2(n))), 0, closed_forms.sphere), (8, 16, 32)),
        (lambda n: on(shapes.cylinder(n, n), n // 2 * n, closed_forms.cylinder), (32, 64, 128)),
        (lambda n: on(shapes.cone(3 * n, n, np.pi / 6), 1 + n // 2 * 3 * n, closed_forms.cone), (16, 32, 64)),
        (flat_torus, (32, 64, 128)),
        (lambda n: on(shapes.box(n), [0.5] * 3, closed_forms.convex_solid), (6, 12, 24)),
    ],
    ids=["disk", "sphere", "cylinder", "cone", "flat torus", "box"],
)
def test_order_and_bound(shape, sizes, magnitude, fastest):
    h, error, bound = [], [], []
    for n in sizes:
        domain, source, exact = shape(n)
        t = 0.3 * domain.mean_edge_length**1.5
        h.append(domain.mean_edge_length)
        error.append(mean_error(domain, source, exact, t, magnitude=magnitude))
        bound.append(np.sqrt(t) / 2)
    assert (np.array(error) < bound).all()
    order = np.polyfit(np.log(h), np.log(error), 1)[0]
    assert 0.5 < order < fastest


def test_where_the_source_is_the_centre_of_symmetry():
    """No cut locus and no preferred direction: order 1 from the centre of a disk, 2 from the apex of a cone."""
    for make, expected in ((shapes.disk, 1), (lambda k: shapes.cone(3 * k, k), 2)):
        errors = []
        for size in (32, 64):
            mesh = make(size)
            domain = operators(mesh)
            exact = np.linalg.norm(mesh.V, axis=1)
            errors.append(mean_error(domain, 0, exact, domain.mean_edge_length**2, magnitude="unit"))
        assert np.log2(errors[0] / errors[1]) == pytest.approx(expected, abs=0.1)
        assert errors[1] < 0.01
