from __future__ import annotations

import pickle

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed, zoo

from heat_igl import HeatMethodSolver, Mesh, shapes
from heat_igl.errors import FactorizationError
from heat_igl.linear import backends, factor_memory, iterative
from heat_igl.operators import operators

pytest.importorskip("pyamg")


def heat_matrix(mesh: Mesh) -> sp.csc_matrix:
    domain = operators(mesh)
    return ((domain.M - domain.mean_edge_length**2 * domain.L) / domain.M.diagonal().mean()).tocsc()


def test_relaxation_keeps_relative_accuracy_where_a_residual_says_nothing():
    """On a line the backward Euler step is known in closed form: u falls by lambda per vertex, over 200 decades."""
    n = 500
    off = -np.ones(n - 1)
    A = sp.diags([off, np.full(n, 3.0), off], [-1, 0, 1]).tocsc()
    decay = (3 - np.sqrt(5)) / 2
    b = np.zeros((n, 2))
    b[0, 0] = 1.0
    b[-1, 1] = 1.0
    u = iterative.Relaxation(A).solve(b)
    np.testing.assert_allclose(u[:480, 0], decay ** np.arange(1, 481), rtol=1e-9)
    assert u[479, 0] < 1e-200
    np.testing.assert_allclose(u[::-1, 1], u[:, 0], rtol=1e-12)


def test_relaxation_of_both_signs_is_the_difference():
    A = heat_matrix(shapes.icosphere(3))
    x = np.random.default_rng(0).standard_normal(A.shape[0])
    np.testing.assert_allclose(iterative.Relaxation(A).solve(A @ x), x, rtol=0, atol=1e-9)


@pytest.mark.parametrize("n_columns", [1, 3])
def test_relaxation_of_nothing_is_nothing(n_columns):
    """No entry of the right-hand side is positive, so there is no first level of unknowns."""
    A = heat_matrix(shapes.icosphere(1))
    b = np.zeros((42, n_columns))
    b[:, 1:] = 1.0
    x = iterative.Relaxation(A).solve(b)
    assert (x[:, 0] == 0).all()
    np.testing.assert_allclose(A @ x, b, rtol=1e-9)


def test_relaxation_where_nothing_has_a_neighbour():
    A = sp.diags([2.0, 4.0, 8.0]).tocsc()
    assert iterative.Relaxation(A).solve(np.array([0.0, 1.0, 2.0])).tolist() == [0.0, 0.25, 0.25]


def test_a_source_in_the_corner_of_a_grid():
    """Half of the step with the mean of both boundary conditions has the source on a held vertex: nothing to solve."""
    mesh = shapes.grid(100)
    direct, by_iteration = (
        HeatMethodSolver(mesh, backend=backend, boundary="average").distance(0) for backend in ("scipy", "iterative")
    )
    np.testing.assert_allclose(by_iteration, direct, rtol=0, atol=1e-9 * direct.max())


def test_multigrid_solves():
    A = -operators(perturbed(shapes.icosphere(4))).L[1:][:, 1:].tocsc()
    x = np.random.default_rng(0).standard_normal((A.shape[0], 2))
    solver = iterative.IterativeAnalysis().factorize(A)
    assert isinstance(solver, iterative.Multigrid)
    np.testing.assert_allclose(solver.solve(A @ x), x, rtol=0, atol=1e-8)


def test_some_rows_are_held():
    L = operators(perturbed(shapes.icosphere(3))).L
    free = np.ones(642, bool)
    free[[0, 77]] = False
    analysis = iterative.IterativeAnalysis()
    for A, kind in ((heat_matrix(shapes.icosphere(3)), iterative.Relaxation), (-L, iterative.Multigrid)):
        solver = analysis.factorize(A.tocsc(), free)
        assert isinstance(solver, kind)
        x = np.where(free, np.random.default_rng(0).standard_normal(642), 0)
        np.testing.assert_allclose(solver.solve(A @ x), x, rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["cow", "strip", "two spheres", "disk"])
def test_distance_agrees_with_direct_factors(name, request):
    sphere = perturbed(shapes.icosphere(3))
    mesh = {
        "cow": lambda: request.getfixturevalue("cow"),
        "strip": lambda: shapes.strip(4000, 3),
        "two spheres": lambda: Mesh(np.vstack([sphere.V, sphere.V + 5]), np.vstack([sphere.F, sphere.F + 642])),
        "disk": lambda: perturbed(shapes.disk(30), 0.3),
    }[name]()
    direct, by_iteration = (HeatMethodSolver(mesh, backend=backend) for backend in ("scipy", "iterative"))
    for sources in (5, [5, 700]):
        expected, found = direct.distance(sources), by_iteration.distance(sources)
        assert (np.isinf(found) == np.isinf(expected)).all()
        reached = np.isfinite(expected)
        assert np.abs(found[reached] - expected[reached]).max() < 1e-9 * expected[reached].max()
    assert by_iteration.diagnostics.backend == "iterative"


@pytest.mark.parametrize("name", ["noisy sphere", "klein bottle", "labyrinth", "needle fan"])
def test_distance_agrees_on_rough_twisted_and_thin_shapes(name):
    mesh = zoo(name)
    expected = HeatMethodSolver(mesh).distance(100)
    found = HeatMethodSolver(mesh, backend="iterative").distance(100)
    assert np.abs(found - expected).max() < 1e-9 * expected.max()


def test_negative_weights_are_refused(cow):
    """The cow's own triangles are far from Delaunay, and heat turns negative on them."""
    solver = HeatMethodSolver(cow, laplacian="cotan", backend="iterative")
    with pytest.raises(FactorizationError, match=r'negative heat.*use laplacian="intrinsic-delaunay"'):
        solver.distance(0)
    with pytest.raises(FactorizationError, match="singular or not positive definite"):
        iterative.IterativeAnalysis().factorize(sp.diags([1.0, -1.0]).tocsc())


def test_chosen_where_factors_would_not_fit(monkeypatch):
    mesh = shapes.icosphere(3)
    estimate = 2 * factor_memory.factor_bytes(642, heat_matrix(mesh).nnz)
    monkeypatch.setattr(factor_memory, "available_memory", lambda: 1.01 * estimate)
    assert HeatMethodSolver(mesh).diagnostics.backend != "iterative"
    monkeypatch.setattr(factor_memory, "available_memory", lambda: 0.99 * estimate)
    assert HeatMethodSolver(mesh).diagnostics.backend == "iterative"
    monkeypatch.setattr(backends, "has_iterative", lambda: False)
    assert HeatMethodSolver(mesh).diagnostics.backend != "iterative"


def test_estimate_bounds_what_the_factors_hold():
    """One to four times the entries of the multifrontal factor: what is held while it is made comes on top."""
    for mesh in (shapes.torus(200, 200), perturbed(shapes.box(16))):
        A = heat_matrix(mesh)
        held = backends.factorize(A, "multifrontal").n_bytes
        assert 1 < factor_memory.factor_bytes(A.shape[0], A.nnz) / held < 4


def test_memory_is_known_here():
    assert factor_memory.available_memory() > 2**27


def test_pickled_copy_gives_the_same_bits():
    solver = HeatMethodSolver(perturbed(shapes.icosphere(3)), backend="iterative")
    assert (pickle.loads(pickle.dumps(solver)).distance(3) == solver.distance(3)).all()
