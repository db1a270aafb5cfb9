"""Each of the three steps by itself, against what is known about it in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed

from heat_igl import Mesh, shapes, steps
from heat_igl.operators import operators, tufted_operators
from heat_igl.speed import speed_operators
from heat_igl.steps import Descent, HeatFlow, PoissonProblem, damping, diffuse, integrate, normalize


@pytest.fixture(scope="module")
def disk():
    return operators(perturbed(shapes.disk(12)))


def dirac(n: int, vertex: int) -> np.ndarray:
    u0 = np.zeros(n)
    u0[vertex] = 1
    return u0


def test_backward_euler_step_is_solved(disk):
    u0 = np.random.default_rng(0).random((disk.n, 3))
    t = 0.02
    u = diffuse(disk, u0, t)
    np.testing.assert_allclose(disk.M @ u - t * (disk.L @ u), u0, rtol=0, atol=1e-12)


def test_insulated_boundary_conserves_heat(disk):
    u = diffuse(disk, dirac(disk.n, 40), 0.05)
    assert disk.M.diagonal() @ u == pytest.approx(1, rel=1e-12)
    assert (u > 0).all()


def test_heat_falls_exponentially_along_a_strip():
    """On a strip the step is one-dimensional: u falls by acosh(1 + h^2 / (2 t)) e-foldings per cell."""
    domain = operators(shapes.strip(120, 1))
    u = diffuse(domain, dirac(domain.n, 0) + dirac(domain.n, 121), t=2.0)
    rate = np.diff(np.log(u[:121]))[5:50]
    np.testing.assert_allclose(rate, -np.arccosh(1 + 1 / (2 * 2.0)), rtol=1e-9)


def test_boundary_conditions(disk):
    u0 = dirac(disk.n, 0)
    neumann, dirichlet, average = (
        diffuse(disk, u0, 0.05, boundary) for boundary in ("neumann", "dirichlet", "average")
    )
    assert (dirichlet[disk.boundary] == 0).all()
    assert (dirichlet[~disk.boundary] > 0).all()
    assert (dirichlet <= neumann).all()
    np.testing.assert_allclose(average, (neumann + dirichlet) / 2, rtol=1e-13)
    held = diffuse(disk, dirac(disk.n, disk.n - 1), 0.05, "dirichlet")
    assert held[disk.n - 1] > 0
    assert (held[~disk.boundary] > 0).all()


def test_boundary_conditions_agree_where_there_is_no_boundary():
    domain = operators(shapes.icosphere(2))
    u0 = dirac(domain.n, 0)
    assert (diffuse(domain, u0, 0.1, "average") == diffuse(domain, u0, 0.1)).all()


def test_normalized_gradient_is_a_unit_field_downhill(disk):
    u = diffuse(disk, dirac(disk.n, 0), 0.01)
    X = normalize(disk, u)
    components = X.reshape(disk.dimension, -1)
    np.testing.assert_allclose(np.linalg.norm(components, axis=0), 1, rtol=1e-14)
    gradient = (disk.G @ u).reshape(disk.dimension, -1)
    cosine = (gradient * components).sum(axis=0) / np.linalg.norm(gradient, axis=0)
    np.testing.assert_allclose(cosine, -1, rtol=1e-14)


@pytest.mark.parametrize("scale", [1e-280, 1e-160, 1e160, 1e280])
def test_direction_survives_any_magnitude(disk, scale):
    """Squaring entries of this size would underflow to 0 or overflow to inf."""
    u = np.random.default_rng(0).random(disk.n) + 1
    np.testing.assert_allclose(normalize(disk, u * scale), normalize(disk, u), rtol=0, atol=1e-11)


def test_no_gradient_no_direction(disk):
    assert (normalize(disk, np.zeros((disk.n, 2))) == 0).all()
    u = diffuse(disk, dirac(disk.n, 0), 0.01)
    assert (normalize(disk, u * 1e-305) == 0).all()


def test_a_single_front_is_not_damped_and_a_meeting_of_two_is():
    """Heat from both ends of a strip: a cosh in between, whose rate is tanh(distance from the middle / sqrt(t))."""
    mesh = shapes.strip(400, 3)
    domain = operators(Mesh(mesh.V / 400, mesh.F))
    t = (20 / 400) ** 2
    left, right = (mesh.V[:, 0] == 0).astype(float), (mesh.V[:, 0] == 400).astype(float)
    one, both = diffuse(domain, left, t), diffuse(domain, left + right, t)
    middle = mesh.V[mesh.F, 0].mean(axis=1) / 400
    inner = np.abs(middle - 0.5) < 0.3  # off the ends, which mirror the front as well
    inner[domain.boundary_faces] = False
    assert inner.sum() == 480
    assert (damping(domain, both, t)[domain.boundary_faces] == 1).all()
    np.testing.assert_allclose(damping(domain, one, t)[inner], 1, rtol=1e-12)
    expected = np.minimum(1, np.tanh(np.abs(middle - 0.5) / np.sqrt(t)) / 0.9)
    np.testing.assert_allclose(damping(domain, both, t)[inner], expected[inner], rtol=0, atol=0.03)


def test_damping_where_heat_is_not_positive(disk):
    u = diffuse(disk, dirac(disk.n, 0), 0.05, "dirichlet")
    factor = damping(disk, u, 0.05)
    assert ((factor > 0) & (factor <= 1)).all()
    assert (damping(disk, np.zeros(disk.n), 0.05) == 1).all()


def test_integration_inverts_the_gradient():
    """L phi = D G f has the solution f up to a constant per component."""
    sphere = perturbed(shapes.icosphere(2))
    domain = operators(Mesh(np.vstack([sphere.V, sphere.V + 5]), np.vstack([sphere.F, sphere.F + len(sphere.V)])))
    f = np.random.default_rng(0).standard_normal(domain.n)
    difference = integrate(domain, domain.G @ f) - f
    for label in (0, 1):
        on_component = difference[domain.components == label]
        np.testing.assert_allclose(on_component, on_component[0], rtol=0, atol=1e-12)
    assert abs(np.ptp(difference)) > 1e-3


def test_columns_are_solved_as_one_by_one(disk):
    flow, poisson = HeatFlow(disk, 0.01), PoissonProblem(disk)
    b = np.random.default_rng(0).random((disk.n, 5))
    np.testing.assert_allclose(flow.solve(b)[:, 3], flow.solve(b[:, 3]), rtol=1e-12)
    rhs = disk.D @ normalize(disk, b)
    np.testing.assert_allclose(poisson.solve(rhs)[:, 3], poisson.solve(rhs[:, 3]), rtol=0, atol=1e-12)


@pytest.mark.parametrize("t", [0.0, -1.0, np.inf, np.nan])
def test_time_step_must_be_positive(disk, t):
    with pytest.raises(ValueError, match="t must be a positive number"):
        HeatFlow(disk, t)


def test_unknown_boundary(disk):
    with pytest.raises(ValueError, match="boundary must be 'neumann', 'dirichlet' or 'average'"):
        HeatFlow(disk, 1.0, "robin")


@pytest.mark.parametrize("k", [1, 5])
@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("scale", [1e-280, 1.0, 1e280])
def test_one_kernel_is_the_matrix_form(disk, k, damped, scale):
    """On all kinds of domains; some of the field vanishes and some of the heat is negative."""
    pytest.importorskip("numba")
    t = 0.02
    box = operators(shapes.box(4))
    icosphere, cover = operators(perturbed(shapes.icosphere(3))), tufted_operators(shapes.disk(6))
    grid = shapes.grid(12)
    striped = speed_operators(grid, 1 + np.arange(grid.n_faces) % 2)
    for domain in (disk, icosphere, box, cover, striped):
        initial = np.zeros((domain.n, k))
        initial[7 * np.arange(k), np.arange(k)] = 1
        u = diffuse(domain, initial, t) * scale
        u[: domain.n // 8] = 0.0
        u[domain.n // 2] *= -1
        X = normalize(domain, u)
        if damped:
            X *= np.tile(damping(domain, u, t), (domain.dimension, 1))
        expected = domain.D @ X
        for order in (None, np.random.default_rng(k).permutation(domain.n)):
            found = Descent(domain, t if damped else None, order).divergence(u)
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * abs(expected).max())


def test_without_numba_there_is_the_matrix_form(disk, monkeypatch):
    u = diffuse(disk, np.eye(disk.n)[:, [3, 90]], 0.02)
    expected = disk.D @ (normalize(disk, u) * np.tile(damping(disk, u, 0.02), (2, 1)))
    monkeypatch.setattr(steps.importlib.util, "find_spec", lambda _: None)
    assert (Descent(disk, 0.02).divergence(u) == expected).all()


def test_an_analysis_is_shared_where_it_fits(disk):
    shared = steps.analysis(disk.L, "multifrontal")
    b = np.random.default_rng(1).random(disk.n)
    for make in (lambda a: HeatFlow(disk, 0.02, analysis=a), lambda a: PoissonProblem(disk, analysis=a)):
        assert make(shared).backend == "multifrontal"
        np.testing.assert_allclose(make(shared).solve(b - b.mean()), make(None).solve(b - b.mean()), rtol=0, atol=1e-11)
    other = operators(shapes.icosphere(2))
    flow = HeatFlow(other, 0.02, analysis=shared)  # does not fit
    u0 = np.random.default_rng(1).random(other.n)
    np.testing.assert_allclose(flow.solve(u0), HeatFlow(other, 0.02).solve(u0), rtol=1e-12)
