from __future__ import annotations

import pickle

import numpy as np
import pytest
import scipy.sparse as sp

from heat_igl import FactorizationError, MissingExtraError, factorization, shapes
from heat_igl.factorization import factorize
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
