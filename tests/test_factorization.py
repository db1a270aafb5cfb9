from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from heat_igl import FactorizationError, MissingExtraError, factorization, shapes
from heat_igl.factorization import analyse, factorize
from heat_igl.operators import operators


@pytest.fixture(params=["scipy", "multifrontal"])
def backend(request) -> str:
    if request.param == "multifrontal":
        pytest.importorskip("numba")
    return request.param


@pytest.fixture(scope="module")
def heat_matrix() -> sp.csc_matrix:
    domain = operators(shapes.icosphere(4))
    return (domain.M - domain.mean_edge_length**2 * domain.L).tocsc()


def test_solves(heat_matrix, backend):
    factor = factorize(heat_matrix, backend)
    assert factor.backend == backend
    x = np.random.default_rng(0).standard_normal((heat_matrix.shape[0], 37))
    np.testing.assert_allclose(factor.solve(heat_matrix @ x), x, rtol=0, atol=1e-12)
    np.testing.assert_allclose(factor.solve(heat_matrix @ x[:, 0]), x[:, 0], rtol=0, atol=1e-12)


def test_small_values_keep_their_relative_accuracy(backend):
    """On a line the backward Euler step is known in closed form: u falls by lambda per vertex, over 200 decades."""
    n = 500
    off = -np.ones(n - 1)
    A = sp.diags([off, np.full(n, 3.0), off], [-1, 0, 1]).tocsc()
    decay = (3 - np.sqrt(5)) / 2
    b = np.zeros(n)
    b[0] = 1.0
    # u_k = decay^(k + 1) on the half line; the far end changes it by decay^(2 (n - k)) only.
    exact = decay ** np.arange(1, n + 1)
    u = factorize(A, backend).solve(b)
    np.testing.assert_allclose(u[:480], exact[:480], rtol=1e-10)
    assert u[479] < 1e-200


def test_pickled_copy_gives_the_same_bits(heat_matrix, backend):
    factor = factorize(heat_matrix, backend)
    b = np.random.default_rng(1).standard_normal(heat_matrix.shape[0])
    assert (pickle.loads(pickle.dumps(factor)).solve(b) == factor.solve(b)).all()


@pytest.mark.parametrize("kind", ["singular", "indefinite", "not finite"])
def test_bad_matrix(backend, kind):
    matrix = {
        "singular": -operators(shapes.icosphere(1)).L,
        "indefinite": sp.csc_matrix(np.array([[1.0, 2.0], [2.0, 1.0]])),
        "not finite": sp.csc_matrix(np.array([[1.0, 0.0], [0.0, np.nan]])),
    }[kind]
    with pytest.raises(FactorizationError, match=r"singular|not positive definite|not finite|could not be factored"):
        factorize(matrix.tocsc(), backend)


def test_unknown_backend(heat_matrix):
    with pytest.raises(ValueError, match="backend must be one of 'auto', 'scipy'"):
        factorize(heat_matrix, "mumps")


def test_missing_backend_names_the_extra(heat_matrix, monkeypatch):
    monkeypatch.setattr(factorization.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r'pip install "heat-igl\[fast\]"'):
        factorize(heat_matrix, "multifrontal")
    assert factorize(heat_matrix, "auto").backend == "scipy"


def test_principal_submatrix(heat_matrix, backend):
    """What is not free reads 0, and the rest solves the system that is left."""
    n = heat_matrix.shape[0]
    free = np.random.default_rng(2).random(n) < 0.7
    analysis = analyse(heat_matrix, backend)
    b = np.random.default_rng(3).standard_normal((n, 11))
    x = analysis.factorize(heat_matrix, free).solve(b)
    assert (x[~free] == 0).all()
    np.testing.assert_allclose((heat_matrix @ x)[free], b[free], rtol=0, atol=1e-12)
    whole = analysis.factorize(heat_matrix).solve(b)
    np.testing.assert_allclose(heat_matrix @ whole, b, rtol=0, atol=1e-12)


def test_a_column_does_not_depend_on_its_block(heat_matrix, backend):
    """Few columns are solved one by one, more of them in blocks of eight."""
    factor = factorize(heat_matrix, backend)
    b = np.random.default_rng(4).standard_normal((heat_matrix.shape[0], 19))
    x = factor.solve(b)
    for k in (1, 3, 8, 12):
        np.testing.assert_allclose(factor.solve(b[:, :k]), x[:, :k], rtol=0, atol=1e-13 * abs(x).max())


def test_another_pattern_is_refused(heat_matrix):
    pytest.importorskip("numba")
    analysis = analyse(heat_matrix, "multifrontal")
    assert analysis.fits(2 * heat_matrix)
    other = sp.identity(heat_matrix.shape[0], format="csc")
    assert not analysis.fits(other)
    with pytest.raises(ValueError, match="another pattern than the matrix that was analysed"):
        analysis.factorize(other)


def graph(name: str) -> sp.csc_matrix:
    """Patterns that a dissection may stumble over."""
    rng = np.random.default_rng(5)
    if name == "one vertex":
        return sp.csc_matrix((1, 1))
    if name == "no edges":
        return sp.csc_matrix((300, 300))
    if name == "complete":
        return sp.csc_matrix(np.ones((60, 60)))
    if name == "star":
        return sp.csc_matrix((np.ones(4000), (np.zeros(4000, int), np.arange(1, 4001))), shape=(4001, 4001))
    if name == "path":
        return sp.diags([np.ones(29_999)], [1], format="csc")
    if name == "many pieces":
        return sp.block_diag([np.ones((3, 3))] * 8000, format="csc")
    return sp.random(1500, 1500, density=0.003, rng=rng, format="csc")


@pytest.mark.parametrize("name", ["one vertex", "no edges", "complete", "star", "path", "many pieces", "random"])
def test_any_graph(name):
    """Of every graph the Laplacian plus the identity is solved, whatever its separators look like."""
    pytest.importorskip("numba")
    weights = abs(graph(name))
    weights = weights + weights.T
    A = (sp.diags(np.asarray(weights.sum(axis=1)).ravel() + 1) - weights).tocsc()
    x = np.random.default_rng(6).standard_normal(A.shape[0])
    np.testing.assert_allclose(factorize(A, "multifrontal").solve(A @ x), x, rtol=0, atol=1e-10)


def test_dissection_keeps_fill_low():
    """On a grid of 10 thousand vertices minimum degree is still as good."""
    pytest.importorskip("numba")
    domain = operators(shapes.grid(100))
    A = (domain.M - domain.L).tocsc()
    minimum_degree = spl.splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    assert factorize(A, "multifrontal").nonzeros < 1.15 * minimum_degree.L.nnz


def test_the_order_does_not_depend_on_threads():
    pytest.importorskip("numba")
    from heat_igl.dissection import dissect

    L = operators(shapes.icosphere(6)).L
    with ThreadPoolExecutor(3) as workers:
        alone, together = dissect(L.indptr, L.indices), dissect(L.indptr, L.indices, workers)
    assert L.shape[0] > 40_000  # large enough to be cut up among threads
    assert all((a == b).all() for a, b in zip(alone, together, strict=True))
    assert (np.sort(alone.order) == np.arange(L.shape[0])).all()
