import itertools
import os
import pickle
from concurrent.futures import ThreadPoolExecutor
from threading import get_ident

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from conftest import perturbed

from heat_igl import HeatMethodSolver, Mesh, shapes
from heat_igl.errors import FactorizationError
from heat_igl.linear import analyse, backends, factorize
from heat_igl.linear.backends import factor_bytes
from heat_igl.linear.multifrontal import MultifrontalAnalysis, dissect
from heat_igl.operators import operators
from heat_igl.runtime import PeakMemory, threads
from heat_igl.validation.construction import caps, revolved
from heat_igl.validation.zoo import SHAPES


@pytest.fixture(params=["scipy", "multifrontal"])
def backend(request):
    return request.param


@pytest.fixture(scope="module")
def heat_matrix():
    domain = operators(shapes.icosphere(4))
    return (domain.M - domain.mean_edge_length**2 * domain.L).tocsc()


def test_the_solution_of_one_and_of_many_right_hand_sides(heat_matrix, backend):
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
def test_matrices_that_are_not_positive_definite_are_refused(backend, kind):
    matrix = {
        "singular": -operators(shapes.icosphere(1)).L,
        "indefinite": sp.csc_matrix(np.array([[1.0, 2.0], [2.0, 1.0]])),
        "not finite": sp.csc_matrix(np.array([[1.0, 0.0], [0.0, np.nan]])),
    }[kind]
    with pytest.raises(FactorizationError, match=r"singular|not positive definite|not finite|could not be factored"):
        factorize(matrix.tocsc(), backend)


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
    analysis = analyse(heat_matrix, "multifrontal")
    assert analysis.fits(2 * heat_matrix)
    other = sp.identity(heat_matrix.shape[0], format="csc")
    assert not analysis.fits(other)
    with pytest.raises(ValueError, match="another pattern than the matrix that was analysed"):
        analysis.factorize(other)


def graph(name: str) -> sp.csc_matrix:
    """Patterns that a dissection may stumble over."""
    if name == "complete":
        return sp.csc_matrix(np.ones((60, 60)))
    if name == "star":
        return sp.csc_matrix((np.ones(4000), (np.zeros(4000, int), np.arange(1, 4001))), shape=(4001, 4001))
    if name == "one large front":
        return sp.csc_matrix(np.ones((1800, 1800)))
    if name == "path":
        return sp.diags([np.ones(29_999)], [1], format="csc")
    return sp.block_diag([sp.coo_matrix(np.ones((3, 3)))] * 8000, format="csc")


@pytest.mark.parametrize("name", ["complete", "one large front", "star", "path", "many pieces"])
def test_a_system_on_any_graph_is_solved(name):
    """Of every graph the Laplacian plus the identity is solved, whatever its separators look like."""
    weights = abs(graph(name))
    weights = weights + weights.T
    A = (sp.diags(np.asarray(weights.sum(axis=1)).ravel() + 1) - weights).tocsc()
    x = np.random.default_rng(6).standard_normal(A.shape[0])
    np.testing.assert_allclose(factorize(A, "multifrontal").solve(A @ x), x, rtol=0, atol=1e-10)


@pytest.mark.parametrize(("name", "most"), [("grid", 1.15), ("barrel", 1.4)])
def test_dissection_keeps_fill_low(name, most):
    """Against minimum degree, as good still on a grid of 10 thousand vertices; where caps meet in a vertex, as well."""
    wall = revolved(np.ones(7), np.arange(7.0), 600)
    domain = operators(shapes.grid(100) if name == "grid" else Mesh(wall.V, [*wall.F, *caps(7, 600)]))
    A = (domain.M - domain.L).tocsc()
    minimum_degree = spl.splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    assert analyse(A, "multifrontal").nonzeros < most * minimum_degree.L.nnz


def test_the_order_does_not_depend_on_threads():
    L = operators(shapes.icosphere(6)).L
    with ThreadPoolExecutor(3) as workers:
        alone, together = dissect(L.indptr, L.indices), dissect(L.indptr, L.indices, workers)
    assert L.shape[0] > 40_000  # large enough to be cut up among threads
    assert all((a == b).all() for a, b in zip(alone, together, strict=True))
    assert (np.sort(alone.order) == np.arange(L.shape[0])).all()


@pytest.fixture(scope="module")
def many_pieces():
    """A factor that is solved in pieces side by side."""
    domain = operators(shapes.icosphere(6))
    A = (domain.M - domain.mean_edge_length**2 * domain.L).tocsc()
    factor = factorize(A, "multifrontal")
    assert len(factor._fronts.piece_end) > 3
    return A, factor


def test_pieces_side_by_side_solve_the_system(many_pieces, monkeypatch):
    """Noise, and a single source, most of whose way forward is skipped; the bits do not depend on the threads."""
    A, factor = many_pieces
    noise = np.random.default_rng(7).standard_normal((A.shape[0], 11))
    noise[:, 3:] = 0.0
    noise[np.arange(3, 11) * 3000, np.arange(3, 11)] = 1.0
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(3)), raising=False)
    solutions = []
    for n_threads in ("1", "2", "3"):
        monkeypatch.setenv("HEAT_IGL_NUM_THREADS", n_threads)
        x = factor.solve(noise)
        one = np.stack([factor.solve(column) for column in noise.T], axis=1)
        np.testing.assert_allclose(A @ x, noise, rtol=0, atol=1e-13)
        np.testing.assert_allclose(A @ one, noise, rtol=0, atol=1e-13)
        solutions.append((x, one))
    for several in solutions[1:]:
        assert all((a == b).all() for a, b in zip(several, solutions[0], strict=True))


def test_pieces_have_no_neighbours_but_above(many_pieces):
    A, factor = many_pieces
    fronts = factor._fronts
    assert (np.sort(fronts.pieces) == np.arange(len(fronts.parent))).all()
    last = len(fronts.piece_end) - 2
    piece = np.empty(len(fronts.parent), int)
    piece[fronts.pieces] = np.repeat(np.arange(last + 1), np.diff(fronts.piece_end))
    at = np.repeat(piece, np.diff(fronts.start))[fronts.place]
    entries = A.tocoo()
    one, other = at[entries.row], at[entries.col]
    assert ((one == other) | (one == last) | (other == last)).all()


def test_one_thread_starts_no_other(many_pieces, monkeypatch):
    A, factor = many_pieces
    x = np.random.default_rng(0).random(A.shape[0])
    monkeypatch.setattr("heat_igl.runtime.threads.ThreadPoolExecutor", None)
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", "1")
    np.testing.assert_allclose(factor.solve(A @ x), x, rtol=1e-9)


def test_threads_divide_the_processors(monkeypatch):
    """So that work which is on all processors already does not start more threads."""
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(8)), raising=False)
    monkeypatch.setattr("os.cpu_count", lambda: 8)
    monkeypatch.delenv("HEAT_IGL_NUM_THREADS", raising=False)

    def inside():
        with threads.Pool(3) as workers:
            return threads.n_threads(), workers.submit(threads.n_threads).result()

    with threads.Pool(2) as workers:
        assert workers.submit(inside).result() == (4, 1)
    assert threads.n_threads() == 8


def test_unsorted_indices(heat_matrix, backend):
    """Other matrices may share them: they are not sorted behind their back."""
    rng = np.random.default_rng(8)
    shuffled = np.concatenate(
        [low + rng.permutation(high - low) for low, high in itertools.pairwise(heat_matrix.indptr)]
    )
    indices = heat_matrix.indices[shuffled]
    A = sp.csc_matrix((heat_matrix.data[shuffled], indices, heat_matrix.indptr), shape=heat_matrix.shape)
    kept = indices.copy()
    b = rng.standard_normal(A.shape[0])
    np.testing.assert_allclose(heat_matrix @ factorize(A, backend).solve(b), b, rtol=0, atol=1e-12)
    assert (indices == kept).all()
    assert np.shares_memory(A.indices, indices)


def test_factors_of_a_small_mesh_are_made_on_the_thread_that_drops_them(monkeypatch):
    """scipy never frees a factor that is made on one thread and dropped on another."""
    made = []
    whole = spl.splu
    monkeypatch.setattr(spl, "splu", lambda *given, **options: made.append(get_ident()) or whole(*given, **options))
    monkeypatch.setenv("HEAT_IGL_NUM_THREADS", "2")
    assert HeatMethodSolver(shapes.icosphere(2)).diagnostics.backend == "scipy"
    assert set(made) == {get_ident()}
    assert len(made) == 2


def test_an_order_with_much_fill_is_not_taken():
    """On triangles that grow away from two fine rings nested dissection leaves ten times the entries of SuperLU."""
    graded = next(shape for shape in SHAPES if shape.name == "capped cylinder 512").make()
    assert analyse(operators(graded, "auto").L).backend == "multifrontal"
    ring = 4000
    side = shapes.cylinder(ring, 1, 4.0)
    k = np.arange(1, ring - 1)
    cap = np.stack([np.zeros_like(k), k + 1, k], axis=1)
    L = operators(Mesh(side.V, np.concatenate([side.F, cap, ring + cap[:, ::-1]])), "auto").L
    assert analyse(L).backend == "scipy"
    assert analyse(L, "multifrontal").backend == "multifrontal"
    assert analyse(operators(shapes.icosphere(4)).L).backend == "multifrontal"


def test_estimate_bounds_what_the_factors_hold():
    """One to four times the entries of the multifrontal factor: what is held while it is made comes on top."""
    for mesh in (shapes.torus(200, 200), perturbed(shapes.box(16))):
        A = -operators(mesh).L
        held = analyse(A, "multifrontal").nonzeros * 12
        assert 1 < factor_bytes(A.shape[0], A.nnz) / held < 4


@pytest.mark.skipif("HEAT_IGL_CHECKED" in os.environ, reason="sanitizers take memory of their own")
@pytest.mark.parametrize("n_per_vertex", [1, 2])
def test_the_memory_of_two_factors_is_known_before(n_per_vertex):
    """One row per vertex, as in diffusion of scalars, and two, as in that of tangent vectors; both of 80 000 rows."""
    A = sp.kron(-operators(shapes.torus(400 // n_per_vertex, 200)).L, np.eye(n_per_vertex) + 0.1).tocsc()
    A += sp.identity(A.shape[0], format="csc")
    analysis = analyse(A)
    assert isinstance(analysis, MultifrontalAnalysis)
    with PeakMemory() as peak:
        factors = [analysis.factorize(A) for _ in range(2)]
    assert len(factors) == 2
    assert 0.7 < peak.bytes / analysis.two_factors_bytes < 1.05


def test_factors_that_do_not_fit_are_an_error_before_they_are_made(monkeypatch):
    mesh = shapes.icosphere(4)
    analysis = analyse(operators(mesh).L)
    assert isinstance(analysis, MultifrontalAnalysis)
    needed = analysis.two_factors_bytes
    monkeypatch.setattr(backends, "available_memory", lambda: 0.9 * needed)
    with pytest.raises(MemoryError, match=r"two factors of 2562 rows take about .* take GeodesicSolver"):
        HeatMethodSolver(mesh)
    HeatMethodSolver(mesh, backend="scipy")
    monkeypatch.setattr(backends, "available_memory", lambda: 1.1 * needed)
    HeatMethodSolver(mesh)
