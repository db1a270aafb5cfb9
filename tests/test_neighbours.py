"""Nearest neighbours of points of a cloud, against all distances, and quadrics through them, against least squares."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl.kernels.local_planes import principal_axes
from heat_igl.kernels.nearest import nearest_points
from heat_igl.kernels.quadrics import onto_quadrics
from heat_igl.mesh.neighbourhoods import point_tree

rng = np.random.default_rng


def grid() -> np.ndarray:
    """Many equal distances."""
    return np.stack(np.meshgrid(np.arange(40.0), np.arange(30.0), [0.0]), axis=-1).reshape(-1, 3)


CLOUDS = {
    "volume": lambda: rng(0).random((1500, 3)),
    "grid": grid,
    "line": lambda: rng(1).random((1500, 1)) * [[1, 2, 3]],
    "scales": lambda: np.exp(4 * rng(2).standard_normal((1500, 3))),
    "clusters": lambda: (rng(3).random((40, 1, 3)) + 1e-6 * rng(4).standard_normal((40, 40, 3))).reshape(-1, 3),
    "few": lambda: rng(5).random((7, 3)),
}


@pytest.mark.parametrize("name", CLOUDS)
def test_nearest_points_are_those_of_all_distances(name: str) -> None:
    tree = point_tree(CLOUDS[name]())
    square = np.square(tree.P[:, None] - tree.P).sum(axis=2)
    for k in (5, 31, 121):
        k = min(k, len(tree.P))
        # Samples as well: points that are not next to each other.
        for chosen in (np.arange(len(tree.P)), np.arange(3, len(tree.P), 17)):
            index, found = tree.nearest(chosen, k)
            np.testing.assert_array_equal(index[:, 0], chosen)
            np.testing.assert_allclose(found, np.sort(square[chosen], axis=1)[:, :k], rtol=1e-12)
            np.testing.assert_allclose(np.take_along_axis(square[chosen], index, axis=1), found, rtol=1e-12)
            assert all(len(np.unique(row)) == k for row in index)


def test_of_equal_distances_the_lowest_number_comes_first() -> None:
    """So that neighbours do not depend on the leaves, nor on the blocks that threads take."""
    tree = point_tree(grid())
    square = np.square(tree.P[:, None] - tree.P).sum(axis=2)
    expected = np.lexsort((np.broadcast_to(np.arange(len(square)), square.shape), square))[:, :31]
    chosen = np.arange(len(square))
    index, _, found = nearest_points(tree.P, tree.first, tree.boxes, chosen, 31)
    assert found.all()
    np.testing.assert_array_equal(index, expected)
    part = nearest_points(tree.P, tree.first, tree.boxes, chosen[205:417], 31)[0]
    np.testing.assert_array_equal(part, expected[205:417])


def test_the_tree_finds_what_no_radius_of_a_leaf_finds() -> None:
    """Half of the points lie in a clump, a millionth of the spacing of the others across."""
    P = rng(6).random((6000, 3))
    P[::2] = 0.5 + 1e-6 * P[::2]
    tree = point_tree(P)
    chosen = np.arange(len(P))
    found = nearest_points(tree.P, tree.first, tree.boxes, chosen, 31)[2]
    assert 0 < (~found).sum() < 300
    index, square = tree.nearest(chosen, 31)
    distance, _ = tree.tree.query(tree.P, 31)
    np.testing.assert_allclose(square, distance**2, rtol=1e-12)
    np.testing.assert_array_equal(index[:, 0], chosen)


@pytest.mark.parametrize("k", [16, 31, 34, 61])
def test_a_quadric_is_that_of_weighted_least_squares(k: int) -> None:
    P = rng(7).random((400, 3)) * [1, 1, 0.1]
    tree = point_tree(P)
    index, square = tree.nearest(np.arange(400), k)
    axes, variances = principal_axes(tree.P, index, square)
    # The order of the neighbours does not matter.
    moved, deviation, thickness = onto_quadrics(tree.P, np.append(index[:, :1], index[:, :0:-1], axis=1))
    np.testing.assert_allclose(thickness, variances[:, 0] / variances[:, 1], rtol=1e-9)
    for i in range(0, 400, 37):
        reach = np.sqrt(square[i, -1])
        x, y, z = axes[i] @ (tree.P[index[i]] - tree.P[i]).T / reach
        root = np.sqrt(np.maximum(1 - square[i] / square[i, -1], 1e-3))
        terms = np.stack([np.ones(k), x, y, x * x, x * y, y * y], axis=1)
        found = np.linalg.lstsq(root[:, None] * terms, root * z, rcond=None)[0]
        np.testing.assert_allclose(moved[i], tree.P[i] + reach * found[0] * axes[i, 2], atol=1e-6)
        squares = ((root * (z - terms @ found)) ** 2).sum() / (root**2).sum()
        assert deviation[i] == pytest.approx(np.sqrt(squares / max(1 - 6 / (k - 1), 0.5)), rel=1e-6)


def test_a_point_of_a_paraboloid_stays_on_it() -> None:
    x, y = rng(8).uniform(-1, 1, (2, 20))
    x, y = np.append(x, -x), np.append(y, -y)
    P = np.stack([x, y, 0.3 * x**2 - 0.2 * x * y + 0.1 * y**2], axis=1)
    P = np.append(np.zeros((1, 3)), P, axis=0) + np.array([0, 0, 5])
    for scale in (1, 1e-50, 1e50):
        moved, deviation, _ = onto_quadrics(scale * P, np.arange(41, dtype=np.int32)[None])
        np.testing.assert_allclose(moved / scale, P[:1], atol=1e-6)
        assert deviation < 1e-6
