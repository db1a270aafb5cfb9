"""The paper's other ways: closed forms, the order at which each converges, and the contract that all of them share."""

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed

from heat_igl import AccuracyWarning, Mesh, shapes
from heat_igl.operators import intrinsic_operators, operators
from heat_igl.reference import baselines, edge_paths

MESH_METHODS = {
    "varadhan": baselines.varadhan,
    "boundary problem": baselines.boundary_problem,
    "edges": edge_paths,
}


@pytest.fixture(scope="module")
def pieces():
    """Two disks, and a vertex that no face uses."""
    disk = perturbed(shapes.disk(6))
    n = disk.n_vertices
    return Mesh(np.vstack([disk.V, disk.V + 5, [[9, 9, 9]]]), np.vstack([disk.F, disk.F + n]))


# The contract.


@pytest.mark.parametrize("name", MESH_METHODS)
@pytest.mark.parametrize("both", [False, True])
def test_zero_at_sources_and_infinite_where_none_is_reached(name, both, pieces):
    n = pieces.n_vertices // 2
    sources = [3, 40, n + 8] if both else [3, 40]
    distance = MESH_METHODS[name](pieces, sources)
    assert distance.shape == (2 * n + 1,)
    assert (distance[sources] == 0).all()
    reached = np.arange(2 * n + 1) < (2 * n if both else n)
    assert np.isfinite(distance[reached]).all()
    others = np.setdiff1d(np.flatnonzero(reached), sources)
    assert (distance[others] > 0).all()
    assert np.isposinf(distance[~reached]).all()
    mask = np.zeros(2 * n + 1, bool)
    mask[sources] = True
    assert (MESH_METHODS[name](pieces, mask) == distance).all()


@pytest.mark.parametrize("name", MESH_METHODS)
@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_unit_of_length_does_not_matter(name, scale):
    mesh = perturbed(shapes.disk(8))
    scaled = MESH_METHODS[name](Mesh(mesh.V * scale, mesh.F), 5)
    np.testing.assert_allclose(scaled, MESH_METHODS[name](mesh, 5) * scale, rtol=1e-9)


# Backward Euler: Varadhan's formula and the boundary problem.


@pytest.mark.parametrize("t", [0.3, 1.0, 30.0])
def test_boundary_problem_on_a_strip(t):
    """Across the strip nothing varies, so v = cosh(a (N - x)) / cosh(a N) with a = acosh(1 + h^2 / (2 t))."""
    n = 60
    strip = shapes.strip(n, 2)
    a = np.arccosh(1 + 1 / (2 * t))
    x = strip.V[:, 0]
    log_v = np.logaddexp(a * (n - x), -a * (n - x)) - np.logaddexp(a * n, -a * n)
    distance = baselines.boundary_problem(strip, x == 0, t=t)
    np.testing.assert_allclose(distance, -np.sqrt(t) * log_v, rtol=1e-11, atol=1e-12)


def test_the_papers_factor_one_half_is_wrong():
    """In the continuous limit, h^2 << t << 1, -sqrt(t) log u tends to x in one dimension, and half of that to x / 2.

    The error is known: at most sqrt(t) log 2 near the far end, which reflects, and the fraction h^2 / (24 t).
    """
    for n in (100, 400, 1600):
        strip = shapes.strip(n, 1)
        t = float(n) ** 0.8 * 4  # in cells; as n grows, sqrt(t) falls in units of the strip and grows in cells
        x = strip.V[:, 0]
        distance = baselines.varadhan(strip, x == 0, t=t)
        assert (np.abs(distance - x) <= np.sqrt(t) * np.log(2) + x / (24 * t) + 1e-9 * n).all()
        with_half = distance / 2
        assert np.abs(with_half - x).max() > 0.49 * n
    assert np.abs(distance - x).max() < 0.02 * n


def test_several_sources_in_the_boundary_problem():
    """By the maximum principle max(v_1, v_2) <= v <= v_1 + v_2."""
    domain = operators(perturbed(shapes.disk(12)))
    t = domain.mean_edge_length**2
    one, other, both = (baselines.boundary_problem(domain, s, t=t) for s in (20, 300, [20, 300]))
    nearest = np.minimum(one, other)
    assert (both <= nearest * (1 + 1e-12)).all()
    assert (both >= nearest - np.sqrt(t) * np.log(2) * (1 + 1e-12)).all()
    assert (both < nearest - 0.5 * np.sqrt(t) * np.log(2)).any()  # half-way between them


def test_backward_euler_in_closed_form_on_a_torus():
    """The five-point stencil has plane waves for eigenvectors: u is an inverse Fourier transform."""
    n, t = 32, 0.01
    wave = 2 - 2 * np.cos(2 * np.pi * np.arange(n) / n)
    u = np.fft.ifft2(1 / (1 + t * n**2 * (wave[:, None] + wave))).real.ravel()
    distance = baselines.varadhan(intrinsic_operators(shapes.flat_torus(n)), 0, t=t)
    np.testing.assert_allclose(distance, -np.sqrt(t) * np.log(u / u[0]), rtol=1e-9, atol=1e-12)


def test_each_component_is_measured_from_its_own_sources():
    """Heat per area at a source depends on the size of the triangles around it; one part is finer than the other."""
    fine, coarse = shapes.disk(12), shapes.disk(6)
    n = fine.n_vertices
    both = Mesh(np.vstack([fine.V, coarse.V + 5]), np.vstack([fine.F, coarse.F + n]))
    t = 0.03
    together = baselines.varadhan(both, [7, n + 30], t=t)
    np.testing.assert_allclose(together[:n], baselines.varadhan(fine, 7, t=t), rtol=1e-9)
    np.testing.assert_allclose(together[n:], baselines.varadhan(coarse, 30, t=t), rtol=1e-9)


def test_too_small_a_time_step_is_raised():
    domain = operators(shapes.strip(3000, 1))
    for method in (baselines.varadhan, baselines.boundary_problem):
        with pytest.warns(AccuracyWarning, match=r"^t = 0.0001 is too small for heat to cross the mesh"):
            distance = method(domain, 0, t=1e-4)
        assert np.isfinite(distance).all()
    assert np.isfinite(baselines.varadhan(domain, 0)).all()


def test_heat_that_is_not_positive_is_reported():
    """Off the Delaunay triangulation heat can turn negative, and its logarithm means nothing."""
    V = np.array([[0, 0, 0], [10, 0, 0], [5, 0.5, 0], [5, -0.5, 0], [15, 0.5, 0]])
    domain = operators(Mesh(V, [[0, 1, 2], [0, 3, 1], [1, 4, 2]]), "cotan")
    with pytest.warns(AccuracyWarning, match="no positive heat arrives at") as caught:
        distance = baselines.varadhan(domain, 0, t=1.0)
    assert caught[0].filename == __file__
    assert np.isfinite(distance).all()
    assert (distance >= 0).all()


# Edges, and theorem 3.1.


def test_graph_distance_on_a_square():
    """Diagonals run from (0, 1) to (1, 0): with them k steps do for k by k cells, against them 2 k."""
    n = 9
    mesh = shapes.grid(n)
    column, row = np.rint(mesh.V[:, 0] * n), np.rint(mesh.V[:, 1] * n)
    from_origin = edge_paths(mesh, 0)
    np.testing.assert_allclose(from_origin, (row + column) / n, rtol=1e-12, atol=1e-15)
    assert (edge_paths(mesh, 0, count_edges=True) == row + column).all()
    back = n - column
    octile = (np.maximum(back, row) + (np.sqrt(2) - 1) * np.minimum(back, row)) / n
    np.testing.assert_allclose(edge_paths(mesh, n), octile, rtol=1e-12, atol=1e-15)
    assert (edge_paths(mesh, n, count_edges=True) == np.maximum(back, row)).all()


def test_theorem_3_1_limit_and_rate():
    """log u_t / log t = n + log (A^n delta) / log t: within 3 % at t = exp(-1000), a tenth of that at exp(-10 000)."""
    mesh = perturbed(shapes.icosphere(2))
    A = operators(mesh).L
    n = edge_paths(mesh, 5, count_edges=True)
    far = n > 0
    dense = A.toarray()
    walks = np.array([np.linalg.matrix_power(dense, int(k))[v, 5] for v, k in enumerate(n)])
    assert (walks > 0).all()
    error = []
    for log_t in (-1e3, -1e4, -1e5, -1e6):
        limit = baselines.graph_limit(A, 5, log_t)
        np.testing.assert_allclose((limit - n) * log_t, np.log(walks), rtol=0, atol=2e-16 * -log_t * n.max() + 1e-12)
        error.append(np.abs(limit - n)[far] / n[far])
    assert error[0].max() < 0.03
    assert error[0].max() > 1e-4
    np.testing.assert_allclose(error[1].max(), error[0].max() / 10, rtol=1e-6)


def test_graph_limit_against_rational_arithmetic():
    """A symmetric matrix with entries of both signs and t = 10^-40: Gaussian elimination in fractions."""
    from fractions import Fraction

    rng = np.random.default_rng(3)
    size = 8
    A = np.zeros((size, size), np.int64)
    for i, j in [(0, 1), (1, 2), (2, 3), (0, 4), (4, 5), (5, 3), (3, 6), (6, 7), (1, 4)]:
        A[i, j] = A[j, i] = rng.choice([-3, -2, -1, 1, 2, 3])
    A[range(size), range(size)] = rng.integers(-5, 5, size)
    t = Fraction(1, 10**40)
    rows = [[int(i == j) - t * int(A[i, j]) for j in range(size)] + [Fraction(int(i == 0))] for i in range(size)]
    for pivot in range(size):
        for i in range(size):
            if i != pivot:
                factor = rows[i][pivot] / rows[pivot][pivot]
                rows[i] = [x - factor * y for x, y in zip(rows[i], rows[pivot], strict=True)]
    u = [abs(row[-1] / row[i]) for i, row in enumerate(rows)]
    from math import log

    expected = [(log(x.numerator) - log(x.denominator)) / (-40 * log(10)) for x in u]
    limit = baselines.graph_limit(sp.csc_matrix(A), 0, -40 * np.log(10))
    np.testing.assert_allclose(limit, expected, rtol=0, atol=1e-12)


def test_graph_limit_counts_no_rounding_as_an_edge():
    """The diagonals of a square grid have weight 1e-17 or 0: n is the distance along rows and columns."""
    n = 5
    mesh = shapes.grid(n)
    limit = baselines.graph_limit(operators(mesh).L, n, -1e9)
    steps = np.rint((1 - mesh.V[:, 0] + mesh.V[:, 1]) * n)
    np.testing.assert_allclose(limit, steps, rtol=0, atol=1e-7)


def test_graph_limit_keeps_what_is_near_the_source():
    """Along the side of a square the only shortest path has n edges of weight 1/2; across it there are 1e40 paths."""
    n = 70
    mesh = shapes.grid(n)
    log_t = -1000 * np.log(10)
    limit = baselines.graph_limit(operators(mesh, "cotan").L, 0, log_t)
    along = np.arange(1, n)
    for vertices in (along, along * (n + 1)):
        np.testing.assert_allclose((limit[vertices] - along) * log_t, along * np.log(0.5), rtol=0, atol=1e-9)
