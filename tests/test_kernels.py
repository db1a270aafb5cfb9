"""Compiled kernels on their own: against numpy and scipy, on random input, in every build that this processor runs."""

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import source_hash
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from heat_igl import kernels, shapes
from heat_igl.linear import factorize, multifrontal
from heat_igl.linear.multifrontal import dissect
from heat_igl.operators import operators


def random_m_matrix(n: int, n_edges: int, seed: int) -> sp.csc_matrix:
    """A graph with multiple components as a rule, and an excess on the diagonal of every row."""
    rng = np.random.default_rng(seed)
    ends = rng.integers(n, size=(2, n_edges))
    W = sp.coo_matrix((rng.random(n_edges) + 0.1, ends), shape=(n, n)).tocsc()
    W = W + W.T
    W.setdiag(0)
    return (sp.diags(np.asarray(W.sum(axis=0)).ravel() + 0.5) - W).tocsc()


@settings(deadline=None, max_examples=60)
@given(n=st.integers(1, 400), density=st.floats(0, 4), seed=st.integers(0, 2**32 - 1))
def test_any_graph_is_dissected_factored_and_solved(n, density, seed):
    A = random_m_matrix(n, int(density * n), seed)
    tree = dissect(A.indptr, A.indices)
    assert (np.sort(tree.order) == np.arange(n)).all()
    assert ((tree.parent == -1) | (tree.parent > np.arange(len(tree.parent)))).all()
    free = np.random.default_rng(seed).random(n) < 0.8
    x = np.where(free[:, None], np.random.default_rng(seed).standard_normal((n, 11)), 0)
    found = multifrontal.MultifrontalAnalysis(A).factorize(A, free).solve(A @ x)
    np.testing.assert_allclose(found, x, rtol=0, atol=1e-9)


def test_every_build_solves_alike(monkeypatch):
    """Wider vectors round sums in another order; each build gives the same bits again and again."""
    domain = operators(shapes.icosphere(4))
    A = (domain.M - domain.mean_edge_length**2 * domain.L).tocsc()
    b = np.random.default_rng(0).standard_normal((A.shape[0], 9))
    solutions = []
    pairs = zip(kernels.builds("linear.multifrontal"), kernels.builds("linear.substitution"), strict=True)
    for of_factor, of_solve in pairs:
        monkeypatch.setattr(multifrontal, "_elimination", import_module(of_factor))
        monkeypatch.setattr(multifrontal, "_solves", import_module(of_solve))
        one, again = (factorize(A, "multifrontal").solve(b) for _ in range(2))
        assert (one == again).all()
        np.testing.assert_allclose(A @ one, b, rtol=0, atol=1e-13)
        solutions.append(one)
    assert kernels.builds("linear.multifrontal")[-1] == "heat_igl.kernels.linear.multifrontal"
    for other in solutions[1:]:
        np.testing.assert_allclose(other, solutions[0], rtol=0, atol=1e-12 * np.abs(solutions[0]).max())


def imported(folder: Path) -> str:
    """What an interpreter says to an import of the kernels in this folder."""
    code = "import heat_igl.kernels"
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False).stderr


def test_kernels_that_are_not_those_of_the_sources_are_refused(tmp_path):
    """None compiled: Python would run the sources, which are valid Python. Or compiled from earlier sources."""
    folder = tmp_path / "heat_igl" / "kernels"
    folder.mkdir(parents=True)
    (folder.parent / "__init__.py").touch()
    shutil.copy(kernels.__file__, folder)
    source = folder / "doubled.py"
    source.write_text("def doubled(x): return 2 * x")
    assert f"run `pip install -e .` in {tmp_path}" in imported(tmp_path)
    source.with_suffix(EXTENSION_SUFFIXES[0]).touch()
    (folder / "compiled.json").write_text(json.dumps({source.name: source_hash(source.read_bytes()).hex()}))
    assert imported(tmp_path) == ""
    source.write_text("def doubled(x): return 3 * x")
    assert "1 sources of kernels" in imported(tmp_path)
    source.unlink()
    assert "have changed since they were compiled (doubled.py)" in imported(tmp_path)


@pytest.mark.skipif(os.environ.get("HEAT_IGL_CHECKED") != "1", reason="the usual build does not check indices")
def test_the_checked_build_raises():
    """A neighbour that there is not, met in a function that is declared to raise nothing."""
    A = random_m_matrix(20, 40, 0)
    A.indices[3] = 1000
    with pytest.raises(IndexError, match="Out of bounds"):
        dissect(A.indptr, A.indices)
