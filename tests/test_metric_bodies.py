"""A metric that changes from tetrahedron to tetrahedron: maps of space whose image is convex, and bounds."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from heat_igl import HeatMethodSolver, Mesh, OffsetSources, metric_operators, shapes
from heat_igl.typing import FloatArray
from heat_igl.validation.domains.body_cases import delaunay, straight


def solver(mesh: Mesh, metric: FloatArray) -> HeatMethodSolver:
    return HeatMethodSolver.from_operators(metric_operators(mesh, metric))


def sheared(x: FloatArray, a: float) -> tuple[FloatArray, FloatArray]:
    """The map (x, y + a sin 2x, z) of points (..., 3), and the metric that it pulls back."""
    image = x.copy()
    image[..., 1] += a * np.sin(2 * x[..., 0])
    J = np.zeros((*x.shape, 3))
    J[..., [0, 1, 2], [0, 1, 2]] = 1
    J[..., 1, 0] = 2 * a * np.cos(2 * x[..., 0])
    return image, np.swapaxes(J, -1, -2) @ J


def bent_bar(n: int, a: float) -> tuple[Mesh, FloatArray]:
    """A bar that `sheared` maps to a straight one, and its image: distance there is that along straight lines."""
    bar = shapes.box(n)
    image = bar.V
    V = image.copy()
    V[:, 1] -= a * np.sin(2 * V[:, 0])
    return Mesh(V, bar.F), image


@pytest.mark.parametrize("a", [0.5, 1.0])
def test_metrics_of_bent_bars_converge(a):
    """The largest ratio of lengths in one place is 1:2.6 and 1:5.8."""
    errors = []
    for n in (5, 10):
        mesh, image = bent_bar(n, a)
        g = sheared(mesh.V[mesh.F].mean(axis=1), a)[1]
        exact = straight(image, 0)
        distance = solver(mesh, g).distance(0)
        errors.append(np.abs(distance - exact).mean() / exact.mean())
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 0.01


def random_metric(m: int, rng: np.random.Generator, most: float) -> FloatArray:
    turn = np.linalg.qr(rng.standard_normal((m, 3, 3)))[0]
    return np.asarray(turn @ (np.exp(rng.uniform(-most, most, (m, 3)))[:, :, None] * np.swapaxes(turn, 1, 2)))


@pytest.mark.parametrize("most", [0.1, 1.0, 3.0, 6.0])
def test_no_distance_contradicts_lines_or_edges(most):
    rng = np.random.default_rng(int(10 * most))
    mesh = delaunay(rng.random((300, 3)))
    g = random_metric(mesh.n_faces, rng, most)
    least = np.sqrt(np.linalg.eigvalsh(g)[:, 0].min())
    sources, start = [5, 77, 200], np.array([0.0, 0.01, 0.02])
    distance = solver(mesh, g).distance(OffsetSources(sources, start))
    lines = np.min(
        [o + least * np.linalg.norm(mesh.V - mesh.V[v], axis=1) for v, o in zip(sources, start, strict=True)], axis=0
    )
    assert (distance >= lines * (1 - 1e-9)).all()
    corners = mesh.V[mesh.F]
    e = corners[:, :, None] - corners[:, None]
    lengths = np.sqrt(np.einsum("mijx,mxy,mijy->mij", e, g, e))
    d = distance[mesh.F]
    assert (d[:, :, None] - d[:, None] <= lengths + 1e-12).all()


def test_one_metric_everywhere_is_a_linear_map():
    """Also where lines bend: the body is mapped, and distance there is exact."""
    box = shapes.box(6)
    mesh = Mesh(box.V, box.F[~(box.V[box.F].mean(axis=1)[:, :2] > 0.5).all(axis=1)])
    A = np.array([[2.0, 0.3, 0], [0, 0.5, 0.1], [0.2, 0, 1]])
    mapped = HeatMethodSolver(Mesh(mesh.V @ A.T, mesh.F)).distance(0)
    assert solver(mesh, np.tile(A.T @ A, (mesh.n_faces, 1, 1))).distance(0) == pytest.approx(mapped, rel=1e-9)


def test_the_same_after_scaling_renumbering_and_copies():
    rng = np.random.default_rng(3)
    mesh = delaunay(rng.random((400, 3)))
    g = sheared(mesh.V[mesh.F].mean(axis=1), 0.7)[1]
    one = solver(mesh, g)
    distance = one.distance(0)
    assert solver(Mesh(1e-6 * mesh.V, mesh.F), g).distance(0) == pytest.approx(1e-6 * distance, rel=1e-9)
    order = rng.permutation(mesh.n_vertices)
    shuffled = Mesh(mesh.V[order], np.argsort(order)[mesh.F])
    # Ties are broken by the numbers of vertices, and passes end before the last digit.
    assert solver(shuffled, g).distance(int(np.argsort(order)[0])) == pytest.approx(
        distance[order], rel=5e-3, abs=1e-12
    )
    assert (pickle.loads(pickle.dumps(one)).distance(0) == distance).all()
    with ThreadPoolExecutor(4) as pool:
        assert all((other == one.distance(v)).all() for v, other in enumerate(pool.map(one.distance, range(8))))
