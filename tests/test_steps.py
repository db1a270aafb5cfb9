"""Each of the three steps by itself, against what is known about it in closed form."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed
from surfaces import pressed, twice

from heat_igl import HeatMethodSolver, Mesh, shapes
from heat_igl.heat import steps
from heat_igl.heat.steps import (
    HeatFlow,
    NormalizedDivergence,
    PoissonProblem,
    damping,
    diffuse,
    fitted_laplacian,
    integrate,
    normalize,
)
from heat_igl.operators import Operators, operators, speed_operators, tufted_operators


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
    domain = operators(twice(sphere))
    f = np.random.default_rng(0).standard_normal(domain.n)
    difference = integrate(domain, domain.G @ f) - f
    for label in (0, 1):
        on_component = difference[domain.components == label]
        np.testing.assert_allclose(on_component, on_component[0], rtol=0, atol=1e-12)
    assert abs(np.ptp(difference)) > 1e-3


@pytest.mark.parametrize("k", [1, 5])
@pytest.mark.parametrize(("damped", "fitted"), [(False, False), (True, False), (True, True)])
@pytest.mark.parametrize("scale", [1e-280, 1.0, 1e280])
def test_one_kernel_is_the_matrix_form(disk, k, damped, fitted, scale):
    """On all kinds of domains; some of the field vanishes and some of the heat is negative."""
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
        X = normalize(domain, u, fitted)
        if damped:
            X *= np.tile(damping(domain, u, t, fitted=fitted), (domain.dimension, 1))
        expected = domain.D @ X
        for order in (None, np.random.default_rng(k).permutation(domain.n)):
            found = NormalizedDivergence(domain, t if damped else None, order, fitted).divergence(u)
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * abs(expected).max())


def test_a_gradient_exchanged_by_hand_is_used(disk):
    """Of a surface on which the way along the first axis is half as long, which the triangles do not know."""
    shorter = sp.kron(np.diag([2, 1]), sp.eye_array(len(disk.weights)))
    other = replace(disk, gradient=(shorter @ disk.G).tocsc())
    u = diffuse(disk, np.eye(disk.n)[:, [3, 90]], 0.02)
    expected = other.D @ normalize(other, u)
    assert abs(expected - disk.D @ normalize(disk, u)).max() > 0.1 * abs(expected).max()
    found = NormalizedDivergence(other).divergence(u)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * abs(expected).max())


def test_fitted_laplacian_of_equal_edges_is_right_in_the_mean_over_a_circle():
    """Around the middle of a regular hexagon waves exp(x / sqrt(t)) solve (1 - t Laplace) u = 0, on average over x."""
    hexagon = shapes.disk(1)
    domain = operators(hexagon)
    for t in (0.05, 0.3, 1.0, 50.0):
        L = fitted_laplacian(domain, t)
        angles = np.linspace(0, np.pi, 200, endpoint=False)
        waves = [np.exp(hexagon.V @ [np.cos(a), np.sin(a), 0] / np.sqrt(t)) for a in angles]
        area_of_cell = np.sqrt(3) / 2
        assert t * np.mean([(L @ u)[0] for u in waves]) == pytest.approx(area_of_cell, rel=1e-9)


def test_fitted_laplacian_is_a_laplacian():
    """Symmetric, rows sum to 0, no negative weight even on slivers; that of short edges is L."""
    stretched = pressed(0.1)
    for domain in (operators(stretched), operators(stretched, "cotan"), tufted_operators(shapes.book(3, 4))):
        h = domain.mean_edge_length
        for t in (1e-8 * h**2, h**2, 1e3 * h**2):
            L = fitted_laplacian(domain, t)
            assert abs(L - L.T).max() == 0
            assert abs(L.sum(axis=1)).max() <= 1e-12 * abs(L).max()
            assert (L - sp.diags(L.diagonal())).min() >= 0
    domain = operators(perturbed(shapes.icosphere(3)))
    assert abs(fitted_laplacian(domain, 1e12) - domain.L).max() < 1e-9


def edges_by_pair(domain: Operators) -> dict[tuple[int, int], list[tuple[float, float]]]:
    """Cotangent weight and length of each edge of the triangulation, by the two vertices that it joins."""
    triangulation = domain.surface.triangulation
    l2 = triangulation.l**2
    # Half the cotangent opposite each side, by the law of cosines; a face counts by its area in the domain.
    half = (l2.sum(axis=1, keepdims=True) - 2 * l2) * (domain.weights / (8 * triangulation.areas**2))[:, None]
    found: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for h in triangulation.edges:
        twin = triangulation.twin[h]
        a, b = sorted((int(triangulation.tail(h)), int(triangulation.head(h))))
        weight = half.flat[h] + (half.flat[twin] if twin >= 0 else 0)
        found.setdefault((a, b), []).append((weight, triangulation.l.flat[h]))
    return found


def fit_of(length: float, t: float) -> float:
    """I0(x) - 1 is the mean of cosh(x cos) - 1 = 2 sinh(x cos / 2)^2 over a circle."""
    x = length / np.sqrt(t) * np.cos(np.linspace(0, 2 * np.pi, 200, endpoint=False))
    return length**2 / (4 * t) / np.mean(2 * np.sinh(x / 2) ** 2)


class Unseen:
    """Stands for the triangles of a domain, which no step may look at."""

    def __getattribute__(self, name):
        raise AssertionError(f"a step looks at surface.{name}")


@pytest.mark.parametrize("fitted", [False, True])
def test_steps_see_matrices_and_lengths_but_no_surface(fitted):
    seen = operators(pressed(0.1))
    t = 0.5 * seen.mean_edge_length**2
    results = []
    for domain in (seen, replace(seen, surface=Unseen())):
        u = HeatFlow(domain, t, fitted=fitted).solve(dirac(domain.n, 7))
        divergence = NormalizedDivergence(domain, t, fitted=fitted).divergence(u[:, None])
        X = normalize(domain, u, fitted) * np.tile(damping(domain, u, t, fitted=fitted), domain.dimension)
        results.append((u, divergence, PoissonProblem(domain).solve(divergence), integrate(domain, X)))
    for of_seen, of_unseen in zip(*results, strict=True):
        np.testing.assert_array_equal(of_seen, of_unseen)


@pytest.mark.parametrize("t_coef", [0.3, 1.0, 20.0])
def test_fitted_laplacian_takes_each_edge_by_its_own_length(t_coef):
    """Flipped edges, edges of negative weight, and the cover, which has each edge of the sphere twice."""
    for domain, flipped, per_pair in (
        (operators(pressed(0.1)), True, 1),
        (operators(pressed(0.1), "cotan"), False, 1),
        (tufted_operators(perturbed(shapes.icosphere(2))), False, 2),
    ):
        assert (domain.surface.triangulation.n_flips > 20) == flipped
        t = t_coef * domain.mean_edge_length**2
        found = fitted_laplacian(domain, t)
        assert np.array_equal(found.indices, domain.L.indices)  # so that one order of elimination does for both
        of_pair = edges_by_pair(domain)
        pairs = np.array(list(of_pair))
        assert {len(edges) for edges in of_pair.values()} == {per_pair}
        expected = np.array([sum(max(w, 0) * fit_of(length, t) for w, length in edges) for edges in of_pair.values()])
        np.testing.assert_allclose(
            np.asarray(found[pairs[:, 0], pairs[:, 1]])[0], expected, rtol=1e-12, atol=1e-12 * expected.max()
        )


def test_several_edges_between_two_vertices_go_by_the_shortest():
    grid = shapes.grid(6)
    domain = tufted_operators(Mesh(grid.V @ [[1, 0, 0], [1.5, 0.3, 0], [0, 0, 1]], grid.F))
    t = 0.5 * domain.mean_edge_length**2
    found, of_pair = fitted_laplacian(domain, t), edges_by_pair(domain)
    assert sum(a == b for a, b in of_pair) > 0  # edges from a vertex to itself
    uneven = {
        pair: edges for pair, edges in of_pair.items() if np.ptp([length for _, length in edges]) > 0.1 * edges[0][1]
    }
    assert len(uneven) >= 10
    for pair, edges in of_pair.items():
        if pair[0] != pair[1]:
            expected = domain.L[pair] * fit_of(min(length for _, length in edges), t)
            assert found[pair] == pytest.approx(expected, rel=1e-9, abs=1e-12)
            # Edge by edge, the longer ones have less; they do not weigh much.
            one_by_one = sum(w * fit_of(length, t) for w, length in edges)
            assert one_by_one - 1e-12 <= found[pair] <= 1.1 * one_by_one + 1e-12


def test_a_laplacian_that_was_exchanged_is_the_one_that_is_fitted():
    domain = operators(pressed(0.1))
    t = 0.5 * domain.mean_edge_length**2
    fitted = fitted_laplacian(domain, t)
    random = sp.triu(domain.L, 1, format="csc")
    random.data = np.random.default_rng(0).uniform(0.5, 2, random.nnz)
    random = random + random.T
    off_diagonal = domain.L - sp.diags(domain.L.diagonal())
    exchanged = domain.L.multiply(random).tocsc()
    exchanged -= sp.diags(np.asarray(exchanged.sum(axis=0))[0])
    found = fitted_laplacian(replace(domain, L=exchanged.tocsc()), t)
    for i, j in zip(*off_diagonal.nonzero(), strict=True):
        assert found[i, j] == pytest.approx(random[i, j] * fitted[i, j], rel=1e-12)
    assert abs(found.sum(axis=1)).max() <= 1e-12 * abs(found).max()


def test_twice_the_laplacian():
    domain = operators(pressed(0.1))
    t = 0.5 * domain.mean_edge_length**2
    b = dirac(domain.n, 7)
    heat = HeatFlow(domain, t, fitted=True).solve(b)
    both = replace(domain, L=2 * domain.L, M=2 * domain.M)
    np.testing.assert_allclose(HeatFlow(both, t, fitted=True).solve(b), heat, rtol=1e-13)
    # The surface counted twice, as a cover does.
    found = HeatMethodSolver(replace(both, weights=2 * domain.weights)).distance(7)
    np.testing.assert_allclose(found, HeatMethodSolver(domain).distance(7), rtol=1e-12, atol=1e-14)
    # Alone it makes all edges shorter by sqrt(2), and with these lengths it is the flow of 2 t.
    edges = domain.surface.triangulation.edges
    ends = domain.surface.triangulation.tail(edges), domain.surface.triangulation.head(edges)
    lengths = sp.csc_matrix((domain.surface.triangulation.l.ravel()[edges], ends), shape=domain.L.shape)
    shorter = replace(domain, L=2 * domain.L, lengths=lengths.maximum(lengths.T) / np.sqrt(2))
    expected = HeatFlow(domain, 2 * t, fitted=True).solve(b)
    np.testing.assert_allclose(HeatFlow(shorter, t, fitted=True).solve(b), expected, rtol=1e-11)


def test_what_an_exchanged_laplacian_couples_needs_a_length():
    domain = operators(shapes.grid(4))
    t = 0.5 * domain.mean_edge_length**2
    summed = domain.L + domain.L
    assert summed.nnz < domain.L.nnz  # without the zeros of the diagonals
    assert abs(fitted_laplacian(replace(domain, L=summed), t) - 2 * fitted_laplacian(domain, t)).max() == 0
    further = 0.1 * sp.csc_matrix(([1.0, 1.0, -1.0, -1.0], ([3, 20, 3, 20], [20, 3, 3, 20])), shape=domain.L.shape)
    with pytest.raises(ValueError, match=r"L\[20, 3\] couples vertices whose distance is not known \(2 entries do\)"):
        fitted_laplacian(replace(domain, L=domain.L + further), t)
    away = fitted_laplacian(replace(domain, L=domain.L - further), t)  # negative: left out in any case
    assert abs(away - fitted_laplacian(domain, t)).max() == 0


def test_a_fitted_front_falls_by_its_length_whatever_the_edges():
    """Heat that crosses cells of length 1, then of 8, which is 4 sqrt(t)."""
    x = np.concatenate([np.arange(0, 8), np.arange(8, 49, 8.0)])
    fine = shapes.grid(len(x) - 1)
    V = np.stack([x[np.round(fine.V[:, 0] * (len(x) - 1)).astype(int)], 8 * fine.V[:, 1], 0 * fine.V[:, 0]], axis=1)
    domain = operators(Mesh(V, fine.F))
    t = 4.0
    left = (V[:, 0] == 0).astype(float)
    rates = []
    for fitted in (False, True):
        u = HeatFlow(domain, t, fitted=fitted).solve(left)
        column = [np.log(u[V[:, 0] == value].mean()) for value in x]
        rates.append(-np.diff(column) / np.diff(x) * np.sqrt(t))
    plain, fitted_rate = rates
    np.testing.assert_allclose(plain[8:-2], np.arccosh(1 + 64 / (2 * t)) / 4, rtol=1e-3)
    np.testing.assert_allclose(fitted_rate[:3], 1, atol=0.02)
    np.testing.assert_allclose(fitted_rate[8:-1], 1, atol=0.06)


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
