"""Quadrics through the neighbours of points of a cloud, against least squares."""

import numpy as np
import pytest

from heat_igl.kernels.cloud.local_fits import onto_quadrics, tangent_planes
from heat_igl.mesh.neighbourhoods import point_tree

rng = np.random.default_rng


@pytest.mark.parametrize("k", [16, 31, 34, 61])
def test_a_quadric_is_that_of_weighted_least_squares(k):
    P = rng(7).random((400, 3)) * [1, 1, 0.1]
    tree = point_tree(P)
    index, _ = tree.neighbours_of(slice(None), k - 1)
    square = np.square(tree.P[index] - tree.P[:, None]).sum(axis=2)
    axes, _ = tangent_planes(tree.P, index)
    # The order of the neighbours does not matter.
    moved, deviation = onto_quadrics(tree.P, np.append(index[:, :1], index[:, :0:-1], axis=1))
    for i in range(0, 400, 37):
        reach = np.sqrt(square[i, -1])
        x, y, z = axes[i] @ (tree.P[index[i]] - tree.P[i]).T / reach
        root = np.sqrt(np.maximum(1 - square[i] / square[i, -1], 1e-3))
        terms = np.stack([np.ones(k), x, y, x * x, x * y, y * y], axis=1)
        found = np.linalg.lstsq(root[:, None] * terms, root * z, rcond=None)[0]
        np.testing.assert_allclose(moved[i], tree.P[i] + reach * found[0] * axes[i, 2], atol=1e-6)
        squares = ((root * (z - terms @ found)) ** 2).sum() / (root**2).sum()
        assert deviation[i] == pytest.approx(np.sqrt(squares / max(1 - 6 / (k - 1), 0.5)), rel=1e-6)


def test_a_point_of_a_paraboloid_stays_on_it():
    x, y = rng(8).uniform(-1, 1, (2, 20))
    x, y = np.append(x, -x), np.append(y, -y)
    P = np.stack([x, y, 0.3 * x**2 - 0.2 * x * y + 0.1 * y**2], axis=1)
    P = np.append(np.zeros((1, 3)), P, axis=0) + np.array([0, 0, 5])
    for scale in (1, 1e-50, 1e50):
        moved, deviation = onto_quadrics(scale * P, np.arange(41, dtype=np.int32)[None])
        np.testing.assert_allclose(moved / scale, P[:1], atol=1e-6)
        assert deviation < 1e-6
