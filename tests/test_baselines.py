"""The paper's other ways: closed forms, the order at which each converges, and the contract that all of them share."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed
from scipy.spatial.distance import cdist
from scipy.special import ive, logsumexp

from heat_igl import AccuracyWarning, Mesh, MeshError, SourceError, shapes
from heat_igl.operators import intrinsic_operators, operators
from heat_igl.reference import baselines
from heat_igl.reference.baselines.schrodinger import _inverse_log_bessel

MESH_METHODS = {
    "varadhan": baselines.varadhan,
    "heat kernel": lambda mesh, sources: baselines.varadhan(mesh, sources, form="heat-kernel"),
    "boundary problem": baselines.boundary_problem,
    "schrodinger": baselines.schrodinger,
    "schrodinger, exponential": lambda mesh, sources: baselines.schrodinger(mesh, sources, green="exponential"),
    "fast marching": baselines.fast_marching,
    "edges": baselines.graph_distance,
}
GRID_METHODS = {
    "schrodinger": baselines.schrodinger_grid,
    "fast marching": baselines.fast_marching_grid,
    "fast sweeping": baselines.fast_sweeping,
}


def needs(name: str) -> None:
    """Skip where the library behind a method is missing."""
    pytest.importorskip({"mesh": "potpourri3d", "grid": "skfmm"}[name])


def rates(h, error):
    """Observed orders of convergence between successive steps."""
    return np.diff(np.log(error)) / np.diff(np.log(h))


def torus_distance(n: int) -> np.ndarray:
    side = np.minimum(np.arange(n), n - np.arange(n)) / n
    return np.hypot(*np.meshgrid(side, side)).ravel()


@pytest.fixture(scope="module")
def pieces() -> Mesh:
    """Two disks, and a vertex that no face uses."""
    disk = perturbed(shapes.disk(6))
    n = disk.n_vertices
    return Mesh(np.vstack([disk.V, disk.V + 5, [[9, 9, 9]]]), np.vstack([disk.F, disk.F + n]))


# The contract.


@pytest.mark.parametrize("name", MESH_METHODS)
@pytest.mark.parametrize("both", [False, True])
def test_zero_at_sources_and_infinite_where_none_is_reached(name, both, pieces):
    if name == "fast marching":
        needs("mesh")
    n = pieces.n_vertices // 2
    sources = [3, 40, n + 8] if both else [3, 40]
    distance = MESH_METHODS[name](pieces, sources)
    assert distance.shape == (2 * n + 1,)
    assert (distance[sources] == 0).all()
    reached = np.arange(2 * n + 1) < (2 * n if both else n)
    assert np.isfinite(distance[reached]).all()
    others = np.setdiff1d(np.flatnonzero(reached), sources)
    # The heat kernel of several sources may be largest between them.
    assert (distance[others] >= 0).all() if name == "heat kernel" else (distance[others] > 0).all()
    assert np.isposinf(distance[~reached]).all()
    mask = np.zeros(2 * n + 1, bool)
    mask[sources] = True
    assert (MESH_METHODS[name](pieces, mask) == distance).all()


@pytest.mark.parametrize("name", MESH_METHODS)
@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_unit_of_length_does_not_matter(name, scale):
    if name == "fast marching":
        needs("mesh")
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


def test_varadhan_solves_the_boundary_problem_of_one_source():
    """u / u_source satisfies BP, whatever the mesh."""
    domain = operators(perturbed(shapes.disk(12)))
    for source, t in ((0, 0.002), (100, 0.01)):
        expected = baselines.boundary_problem(domain, source, t=t)
        np.testing.assert_allclose(baselines.varadhan(domain, source, t=t), expected, rtol=1e-11, atol=1e-14)


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


@pytest.mark.parametrize("form", ["backward-euler", "heat-kernel"])
def test_each_component_is_measured_from_its_own_sources(form):
    """Heat per area at a source depends on the size of the triangles around it; one part is finer than the other."""
    fine, coarse = shapes.disk(12), shapes.disk(6)
    n = fine.n_vertices
    both = Mesh(np.vstack([fine.V, coarse.V + 5]), np.vstack([fine.F, coarse.F + n]))
    t = 0.03
    together = baselines.varadhan(both, [7, n + 30], t=t, form=form)
    np.testing.assert_allclose(together[:n], baselines.varadhan(fine, 7, t=t, form=form), rtol=1e-9)
    np.testing.assert_allclose(together[n:], baselines.varadhan(coarse, 30, t=t, form=form), rtol=1e-9)


def test_too_small_a_time_step_is_raised():
    domain = operators(shapes.strip(3000, 1))
    for method in (baselines.varadhan, baselines.boundary_problem):
        with pytest.warns(AccuracyWarning, match=r"^t = 0.0001 is too small for heat to cross the mesh"):
            distance = method(domain, 0, t=1e-4)
        assert np.isfinite(distance).all()
    with pytest.warns(AccuracyWarning, match=r"^t = 1 is too small for heat to cross the mesh"):
        assert np.isfinite(baselines.varadhan(domain, 0, t=1, form="heat-kernel")).all()
    with pytest.warns(AccuracyWarning, match=r"^hbar\^2 = 0.0001 is too small for heat to cross the mesh"):
        assert np.isfinite(baselines.schrodinger(domain, 0, hbar=1e-2)).all()
    assert np.isfinite(baselines.varadhan(domain, 0)).all()


def test_heat_that_is_not_positive_is_reported():
    """Off the Delaunay triangulation heat can turn negative, and its logarithm means nothing."""
    V = np.array([[0, 0, 0], [10, 0, 0], [5, 0.5, 0], [5, -0.5, 0], [15, 0.5, 0]])
    domain = operators(Mesh(V, [[0, 1, 2], [0, 3, 1], [1, 4, 2]]), "cotan")
    with pytest.warns(AccuracyWarning, match="no positive heat arrives at"):
        distance = baselines.varadhan(domain, 0, t=1.0)
    with pytest.warns(AccuracyWarning, match="no positive heat arrives at") as caught:
        baselines.log_heat_kernel(domain, 0, 0.01)
    assert caught[0].filename == __file__
    assert np.isfinite(distance).all()
    assert (distance >= 0).all()


# The heat kernel.


def log_torus_kernel(n: int, t: float) -> np.ndarray:
    """Closed form: the product of two discrete heat kernels on a circle, images of exp(-tau) I_m(tau)."""
    tau = 2 * t * n * n
    circle = sum(ive(np.abs(np.arange(n) + n * turn), tau) for turn in range(-3, 4))
    return np.asarray(np.log(np.outer(circle, circle).ravel() * n * n))


@pytest.mark.parametrize("t", [0.02, 0.002, 0.0005])
def test_heat_kernel_keeps_its_relative_accuracy(t):
    """Down to exp(-88) of one; methods with an absolute accuracy of 1e-16 lose everything beyond exp(-37)."""
    expected = log_torus_kernel(40, t)
    domain = intrinsic_operators(shapes.flat_torus(40))
    np.testing.assert_allclose(baselines.log_heat_kernel(domain, 0, t), expected, rtol=0, atol=1e-11)


def test_heat_kernel_conserves_heat_and_is_a_semigroup():
    domain = operators(perturbed(shapes.disk(7)))
    mass = domain.M.diagonal()
    kernel = np.stack([np.exp(baselines.log_heat_kernel(domain, v, 0.01)) for v in range(domain.n)])
    np.testing.assert_allclose(kernel @ mass, 1, rtol=1e-10)
    np.testing.assert_allclose(kernel, kernel.T, rtol=1e-10)
    twice = np.exp(baselines.log_heat_kernel(domain, 3, 0.02))
    np.testing.assert_allclose((kernel @ (mass[:, None] * kernel))[3], twice, rtol=1e-10)
    sum_of_two = np.exp(baselines.log_heat_kernel(domain, [3, 9], 0.01))
    np.testing.assert_allclose(sum_of_two, kernel[3] + kernel[9], rtol=1e-10)


def with_a_short_edge(mesh: Mesh, face: int, fraction: float) -> Mesh:
    """The same surface with a vertex more, inside a face, as near to its first corner as said."""
    a, b, c = mesh.F[face]
    inside = mesh.V[a] + fraction * (mesh.V[b] + mesh.V[c] - 2 * mesh.V[a])
    n = mesh.n_vertices
    F = np.vstack([np.delete(mesh.F, face, axis=0), [[a, b, n], [b, c, n], [c, a, n]]])
    return Mesh(np.vstack([mesh.V, inside]), F)


def test_tiny_cells_do_not_stop_the_heat_kernel(monkeypatch):
    """An edge of 1e-5 h asks for a million products. Steps do it instead, and one vertex more changes little."""
    disk = shapes.disk(12)
    clean = baselines.varadhan(disk, 0, form="heat-kernel", t=0.05)
    monkeypatch.setattr("heat_igl.reference.baselines.linear._poisson_mean", None)
    split = baselines.varadhan(with_a_short_edge(disk, 100, 1e-5), 0, form="heat-kernel", t=0.05)
    np.testing.assert_allclose(split[: disk.n_vertices], clean, rtol=0, atol=1e-4)


def test_extrapolated_steps_agree_with_the_sum(monkeypatch):
    domain = intrinsic_operators(shapes.flat_torus(40))
    exact = baselines.varadhan(domain, 0, form="heat-kernel")
    monkeypatch.setattr("heat_igl.reference.baselines.linear._MOST_PRODUCTS", 0)
    np.testing.assert_allclose(baselines.varadhan(domain, 0, form="heat-kernel"), exact, rtol=1e-3)
    one = baselines.log_heat_kernel(domain, 0, 0.01)
    np.testing.assert_allclose(one, log_torus_kernel(40, 0.01), rtol=0, atol=2e-3 * np.ptp(one))


def test_heat_kernel_form_converges_with_its_default_time():
    """The error is of order (h / t)^2 ~ h^(2/3) in the limit, from which the next term, h^(4/3), takes a little."""
    h, error = [], []
    for n in (32, 64, 128):
        domain = intrinsic_operators(shapes.flat_torus(n))
        distance = baselines.varadhan(domain, 0, form="heat-kernel")
        t = 0.07 * (domain.mean_edge_length * domain.longest_distance**2) ** (2 / 3)
        log_k = log_torus_kernel(n, t)
        np.testing.assert_allclose(distance, np.sqrt(4 * t * (log_k[0] - log_k)), rtol=1e-9, atol=1e-7)
        h.append(1 / n)
        error.append(np.abs(distance - torus_distance(n)).max())
    assert ((rates(h, error) > 0.45) & (rates(h, error) < 0.7)).all()
    assert error[-1] < 0.04 * np.sqrt(0.5)


# The Schrodinger equation.


def test_inverse_of_the_bessel_function():
    from scipy.special import k0e

    x = np.concatenate([np.geomspace(1e-12, 10, 200), np.geomspace(10, 1e5, 50)])
    np.testing.assert_allclose(_inverse_log_bessel(np.log(k0e(x)) - x), x, rtol=1e-12)


def test_schrodinger_is_varadhans_formula_when_read_as_an_exponential():
    domain = operators(perturbed(shapes.disk(10)))
    phase = baselines.schrodinger(domain, 30, hbar=0.08, green="exponential")
    np.testing.assert_allclose(phase, baselines.varadhan(domain, 30, t=0.08**2), rtol=1e-12)
    same = baselines.schrodinger(domain, 30, hbar=1.5 * domain.mean_edge_length)
    np.testing.assert_allclose(baselines.schrodinger(domain, 30), same, rtol=1e-12)


def flat_torus(n):
    return intrinsic_operators(shapes.flat_torus(n)), 0, torus_distance(n)


def corner_of_a_square(n):
    mesh = shapes.grid(n)
    return operators(mesh), 0, np.linalg.norm(mesh.V, axis=1)


def edge_of_a_square(n):
    mesh = shapes.grid(n)
    return operators(mesh), n // 2, np.linalg.norm(mesh.V - mesh.V[n // 2], axis=1)


def tip_of_a_cone(n):
    mesh = shapes.cone(3 * n, n)
    return operators(mesh), 0, np.linalg.norm(mesh.V, axis=1)


@pytest.mark.parametrize("shape", [flat_torus, corner_of_a_square, edge_of_a_square, tip_of_a_cone])
def test_schrodinger_is_of_second_order_at_fixed_hbar(shape):
    """Total angles 2 pi, pi / 2, pi and pi: where phi is K_0 over that angle, only the mesh's own error is left."""
    hbar, h, error = 0.04, [], []
    for n in (32, 64, 128):
        domain, source, exact = shape(n)
        distance = baselines.schrodinger(domain, source, hbar=hbar)
        near = (exact > 0.1) & (exact < 0.3)  # images behind the border or the cut locus count 1e-4 of this
        h.append(1 / n)
        error.append(np.abs(distance - exact)[near].max())
    assert ((rates(h, error) > 1.7) & (rates(h, error) < 2.3)).all()
    assert error[-1] < 0.05 / 128


def test_schrodinger_between_two_sources():
    """Superposed waves are too short by hbar log 2 half-way, and by nothing elsewhere."""
    n, hbar = 96, 0.04
    domain = intrinsic_operators(shapes.flat_torus(n))
    row, column = np.divmod(np.arange(n * n), n)
    other = n // 3
    distance = baselines.schrodinger(domain, [0, other], hbar=hbar)
    half_way = distance[other // 2]
    exact = other / 2 / n
    assert exact - half_way == pytest.approx(hbar * np.log(2), rel=0.2)
    behind = (row == 0) & (column > n - n // 5) & (column < n - n // 8)
    np.testing.assert_allclose(distance[behind], (n - column[behind]) / n, rtol=0.01)


def test_schrodinger_on_tetrahedra():
    box = shapes.box(4)
    with pytest.raises(MeshError, match="green='bessel' is for triangles"):
        baselines.schrodinger(box, 0)
    exponential = baselines.schrodinger(box, 0, green="exponential", hbar=0.3)
    np.testing.assert_allclose(exponential, baselines.boundary_problem(box, 0, t=0.09), rtol=1e-10)


@pytest.mark.parametrize(
    ("shape", "n_sources", "hbar"),
    [((60, 70), 5, 0.3), ((40, 40), 700, 0.2), ((30, 30), 300, 2.0), ((12, 13, 14), 6, 0.2), ((90,), 3, 0.5)],
)
def test_schrodinger_grid_is_the_sum_over_sources(shape, n_sources, hbar):
    """The convolution in digits against the sum itself, in logarithms; and the bounds of hbar log K around distance."""
    rng = np.random.default_rng(0)
    mask = np.zeros(shape, bool)
    mask.ravel()[rng.choice(mask.size, n_sources, replace=False)] = True
    spacing = np.linspace(1.0, 0.7, len(shape))
    points = np.argwhere(np.ones(shape, bool)) * spacing
    r = cdist(points, points[mask.ravel()])
    expected = np.maximum(-hbar * logsumexp(-r / hbar, axis=1), 0).reshape(shape)
    expected[mask] = 0
    distance = baselines.schrodinger_grid(mask, spacing, hbar=hbar)
    np.testing.assert_allclose(distance, expected, rtol=0, atol=1e-11)
    exact = r.min(axis=1).reshape(shape)
    assert (distance <= exact + 1e-11).all()
    assert (distance >= exact - hbar * np.log(n_sources) - 1e-11).all()


def test_schrodinger_grid_has_range_enough():
    """exp(-r / hbar) down to exp(-70 000), where doubles end at exp(-745) and their transforms at exp(-36)."""
    mask = np.zeros((50, 50), bool)
    mask[0, 0] = True
    exact = np.hypot(*np.indices(mask.shape))
    np.testing.assert_allclose(baselines.schrodinger_grid(mask, hbar=1e-3), exact, rtol=1e-12)
    np.testing.assert_allclose(baselines.schrodinger_grid(mask), exact, rtol=1e-12)


# Fronts.


@pytest.mark.parametrize("name", GRID_METHODS)
def test_front_from_a_line_is_exact(name):
    if name == "fast marching":
        needs("grid")
    mask = np.zeros((30, 20), bool)
    mask[7] = True
    distance = GRID_METHODS[name](mask, (0.5, 2.0))
    expected = np.broadcast_to(np.abs(np.arange(30) - 7)[:, None] * 0.5, mask.shape)
    # The wave of many sources side by side is hbar log K short; fronts know of no such thing.
    tolerance = 0.125 * np.log(20) if name == "schrodinger" else 1e-12
    np.testing.assert_allclose(distance, expected, rtol=0, atol=tolerance)


def centre_error(method, n: int) -> np.ndarray:
    mask = np.zeros((2 * n + 1, 2 * n + 1), bool)
    mask[n, n] = True
    return method(mask, 1 / n) - np.hypot(*(np.indices(mask.shape) - n)) / n


def test_fast_sweeping_is_of_first_order():
    """Zhao 2005, theorem 4.1: the error is of the order of h log(1 / h), one-sided, and no better than that."""
    n = np.array([16, 32, 64, 128])
    error = np.array([centre_error(baselines.fast_sweeping, k).max() for k in n])
    scaled = error / (np.log(n) / n)
    assert (centre_error(baselines.fast_sweeping, 32) > -1e-12).all()
    assert scaled.max() / scaled.min() < 1.25
    assert scaled.min() > 0.3
    assert scaled.max() < 0.6
    assert ((rates(1 / n, error) > 0.65) & (rates(1 / n, error) < 0.95)).all()


def test_fast_sweeping_solves_the_upwind_equations():
    """At every point the discrete equation holds to rounding: nothing is left for another sweep."""
    rng = np.random.default_rng(1)
    mask = rng.random((25, 30)) < 0.01
    h = np.array([0.3, 0.7])
    d = baselines.fast_sweeping(mask, h)
    padded = np.pad(d, 1, constant_values=np.inf)
    lowest = [np.minimum(padded[:-2, 1:-1], padded[2:, 1:-1]), np.minimum(padded[1:-1, :-2], padded[1:-1, 2:])]
    slope = sum((np.maximum(d - a, 0) / step) ** 2 for a, step in zip(lowest, h, strict=True))
    np.testing.assert_allclose(slope[~mask], 1, rtol=1e-11)


@pytest.mark.parametrize("name", ["fast marching", "fast sweeping"])
def test_paths_lead_around_walls_and_not_into_a_closed_room(name):
    """A wall with one gap, and a closed room: the path goes through the gap, and into the room none does."""
    if name == "fast marching":
        needs("grid")
    n = 81
    domain = np.ones((n, n), bool)
    domain[: n - 1, 40] = False  # open in the last row only
    domain[10:16, 60:66] = False
    domain[12:14, 62:64] = True
    mask = np.zeros((n, n), bool)
    mask[0, 0] = True
    distance = GRID_METHODS[name](mask, domain=domain)
    assert np.isposinf(distance[~domain]).all()
    assert np.isposinf(distance[12:14, 62:64]).all()
    reached = domain.copy()
    reached[12:14, 62:64] = False
    assert np.isfinite(distance[reached]).all()
    around = 2 * np.hypot(40, n - 1)
    assert around < distance[0, n - 1] < around * 1.05


@pytest.mark.parametrize(("shape", "spacing"), [((40, 31), 0.1), ((30, 25), (0.5, 1.0)), ((13, 14, 15), (1, 2, 3))])
def test_fast_sweeping_and_fast_marching_of_first_order_agree(shape, spacing):
    """Two algorithms, two authors, one system of equations."""
    needs("grid")
    rng = np.random.default_rng(0)
    domain = rng.random(shape) < 0.9
    mask = domain & (rng.random(shape) < 0.01)
    swept = baselines.fast_sweeping(mask, spacing, domain=domain)
    marched = baselines.fast_marching_grid(mask, spacing, domain=domain, order=1)
    np.testing.assert_allclose(swept, marched, rtol=1e-9)


def test_fast_marching_of_second_order_is_better():
    needs("grid")
    coarse, fine = (np.abs(centre_error(baselines.fast_marching_grid, n)).mean() for n in (32, 64))
    assert fine < 0.5 * np.abs(centre_error(baselines.fast_sweeping, 64)).mean()
    assert fine < 0.6 * coarse


def test_neighbouring_sources_in_fast_marching():
    """Second-order differences would take both zeros for one smooth front and give 2/3."""
    needs("grid")
    np.testing.assert_allclose(baselines.fast_marching_grid([True, True, False, False, False]), [0, 0, 1, 2, 3])
    two_rows = np.zeros((6, 5), bool)
    two_rows[:2] = True
    np.testing.assert_allclose(baselines.fast_marching_grid(two_rows)[:, 2], [0, 0, 1, 2, 3, 4])


@pytest.mark.parametrize("name", GRID_METHODS)
def test_sources_and_spacings_that_fit_no_grid_are_refused(name):
    method = GRID_METHODS[name]
    mask = np.zeros((3, 4), bool)
    with pytest.raises(SourceError, match="sources marks no point"):
        method(mask)
    with pytest.raises(SourceError, match="sources must be a boolean array"):
        method(np.ones((3, 4)))
    mask[0, 0] = True
    for spacing in (0.0, -1.0, np.nan, (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="spacing must be a positive number, or one for each of 2 axes"):
            method(mask, spacing)
    if name == "schrodinger":
        with pytest.raises(ValueError, match="hbar must be a positive length"):
            method(mask, hbar=-1.0)
        return
    with pytest.raises(ValueError, match="domain must be a boolean array of shape"):
        method(mask, domain=np.ones((4, 3), bool))


def test_fast_marching_on_a_mesh_converges():
    """As on a grid: of order h log(1 / h), and upwind, so never too short."""
    needs("mesh")
    h, error = [], []
    for n in (16, 32, 64, 128):
        mesh = shapes.grid(n)
        difference = baselines.fast_marching(mesh, 0) - np.linalg.norm(mesh.V, axis=1)
        assert (difference > -1e-12).all()
        h.append(1 / n)
        error.append(difference.mean())
    assert ((rates(h, error) > 0.7) & (rates(h, error) < 1)).all()
    assert error[-1] < 0.02


def test_fast_marching_keeps_to_the_part_with_sources():
    """Neither vertices without faces nor another part that is not manifold get in the way."""
    needs("mesh")
    disk = perturbed(shapes.disk(6))
    n = disk.n_vertices
    fan = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    V = np.vstack([[[7, 7, 7]] * 2, np.eye(5, 3) + 9, disk.V])
    distance = baselines.fast_marching(Mesh(V, np.vstack([fan + 2, disk.F + 7])), 7 + 20)
    np.testing.assert_allclose(distance[7:], baselines.fast_marching(disk, 20), rtol=1e-12)
    assert np.isposinf(distance[:7]).all()
    assert distance.shape == (n + 7,)


# Edges, and theorem 3.1.


def test_graph_distance_on_a_square():
    """Diagonals run from (0, 1) to (1, 0): with them k steps do for k by k cells, against them 2 k."""
    n = 9
    mesh = shapes.grid(n)
    column, row = np.rint(mesh.V[:, 0] * n), np.rint(mesh.V[:, 1] * n)
    from_origin = baselines.graph_distance(mesh, 0)
    np.testing.assert_allclose(from_origin, (row + column) / n, rtol=1e-12, atol=1e-15)
    assert (baselines.graph_distance(mesh, 0, count_edges=True) == row + column).all()
    back = n - column
    octile = (np.maximum(back, row) + (np.sqrt(2) - 1) * np.minimum(back, row)) / n
    np.testing.assert_allclose(baselines.graph_distance(mesh, n), octile, rtol=1e-12, atol=1e-15)
    assert (baselines.graph_distance(mesh, n, count_edges=True) == np.maximum(back, row)).all()


def test_graph_distance_over_an_edge_without_length():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2], [1, 2, 3]])
    np.testing.assert_allclose(baselines.graph_distance(mesh, 0), [0, 1, 1, 2])
    assert (baselines.graph_distance(mesh, 0, count_edges=True) == [0, 1, 1, 2]).all()


def test_theorem_3_1_limit_and_rate():
    """log u_t / log t = n + log (A^n delta) / log t: within 3 % at t = exp(-1000), a tenth of that at exp(-10 000)."""
    mesh = perturbed(shapes.icosphere(2))
    A = operators(mesh).L
    n = baselines.graph_distance(mesh, 5, count_edges=True)
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


def test_theorem_3_1_needs_more_range_than_a_double():
    """At the smallest t for which u does not underflow across the sphere, the ratio is still far from the count."""
    domain = operators(perturbed(shapes.icosphere(3)))
    n = baselines.graph_limit(domain.L, 0, -1e9)
    assert np.abs(n - np.rint(n)).max() < 1e-7
    log_t = np.log(1e-308) / n.max()
    in_doubles = baselines.graph_limit(domain.L, 0, log_t)
    assert np.abs(in_doubles - n).max() > 0.1


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


def test_graph_limit_at_an_ordinary_time():
    """At t = 0.01, several sources, no asymptotics: the plain linear system."""
    domain = operators(perturbed(shapes.disk(4)))
    t, sources = 0.01, [3, 20]
    delta = np.zeros(domain.n)
    delta[sources] = 1
    u = np.linalg.solve(np.eye(domain.n) - t * domain.L.toarray(), delta)
    np.testing.assert_allclose(baselines.graph_limit(domain.L, sources, np.log(t)), np.log(u) / np.log(t), atol=1e-10)


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
