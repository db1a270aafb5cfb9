"""Error norms on cases that can be worked out by hand, and bounds that a true distance keeps and a wrong one breaks."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import Mesh, shapes
from heat_igl.validation import closed_forms, metrics


def test_relative_error_entry_by_entry() -> None:
    error = metrics.relative_error([0, 1, 2, np.inf, 7, np.nan], [0, 2, 2, 3, np.inf, 4])
    np.testing.assert_array_equal(error, [np.nan, 0.5, 0, np.inf, np.nan, np.inf])
    with pytest.raises(ValueError, match=r"one shape, not \(2,\) and \(3,\)"):
        metrics.relative_error([1, 2], [1, 2, 3])


def test_a_distance_too_long_by_one_percent() -> None:
    mesh = shapes.grid(8)
    sources = [0, 40]
    truths = np.stack([closed_forms.plane(mesh, source) for source in sources])
    found = metrics.error_summary(mesh, 1.01 * truths, truths, sources)
    for value in (found.mean, found.median, found.percentile_95, found.maximum, found.near_field, found.l_infinity):
        assert value == pytest.approx(0.01)
    # Over the unit square, the mean distance from a corner is (sqrt 2 + asinh 1) / 3 and from the middle half of
    # that; their mean squares are 2/3 and 1/6. Lumping on 8 by 8 cells is within 2 %.
    corner = (np.sqrt(2) + np.arcsinh(1)) / 3
    assert found.l1 == pytest.approx(0.01 * np.mean([corner / np.sqrt(2), (corner / 2) / np.sqrt(0.5)]), rel=0.02)
    assert found.l2 == pytest.approx(0.01 * np.sqrt(np.mean([1 / 3, 1 / 3])), rel=0.02)
    assert found.n_compared == 2 * (mesh.n_vertices - 1)
    assert found.n_wrong_reach == 0


def test_norms_do_not_depend_on_the_unit() -> None:
    mesh = shapes.grid(6)
    truth = closed_forms.plane(mesh, 3)[None]
    noisy = truth + 0.01 * np.random.default_rng(0).uniform(size=truth.shape)
    one = metrics.error_summary(mesh, noisy, truth, [3])
    thousand = metrics.error_summary(Mesh(mesh.V * 1e3, mesh.F), noisy * 1e3, truth * 1e3, [3])
    for name in ("mean", "median", "percentile_95", "maximum", "l1", "l2", "l_infinity", "near_field"):
        assert getattr(thousand, name) == pytest.approx(getattr(one, name), rel=1e-12)
        assert getattr(one, name) > 0


def test_area_counts_and_the_number_of_vertices_does_not() -> None:
    # A fine and a coarse half: all error on the fine half of the vertices is on half of the area only.
    x = np.concatenate([np.linspace(0, 1, 21), [2.0]])
    V = np.array([[a, b, 0] for a in x for b in (0.0, 1.0)])
    F = [t for i in range(21) for t in ([2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 2, 2 * i + 3, 2 * i + 1])]
    mesh = Mesh(V, F)
    truth = np.ones(mesh.n_vertices)
    distance = np.where(V[:, 0] < 1, 2.0, 1.0)
    found = metrics.error_summary(mesh, distance[None], truth[None], [0])
    assert found.l1 == pytest.approx(0.5, abs=0.03)
    assert found.mean == pytest.approx(40 / 44)


def test_near_field_is_the_one_ring() -> None:
    mesh = shapes.disk(4)
    truth = closed_forms.plane(mesh, 0)
    distance = truth.copy()
    distance[1:7] *= 1.2  # the first ring of the disk
    assert metrics.error_summary(mesh, distance[None], truth[None], [0]).near_field == pytest.approx(0.2)
    distance = truth.copy()
    distance[7:] *= 1.2
    assert metrics.error_summary(mesh, distance[None], truth[None], [0]).near_field == 0


def test_wrong_reach_is_counted() -> None:
    one = shapes.grid(2)
    mesh = Mesh(np.vstack([one.V, one.V + 5]), np.vstack([one.F, one.F + one.n_vertices]))
    truth = closed_forms.plane(one, 0)
    truth = np.concatenate([truth, np.full(9, np.inf)])
    plausible = np.where(np.isinf(truth), 1.0, truth)
    assert metrics.error_summary(mesh, plausible[None], truth[None], [0]).n_wrong_reach == 9
    broken = np.where(np.arange(18) == 5, np.nan, truth)
    found = metrics.error_summary(mesh, broken[None], truth[None], [0])
    assert found.n_wrong_reach == 1
    assert found.mean == found.maximum == found.l1 == found.l_infinity == np.inf
    assert found.median == 0
    with pytest.raises(ValueError, match=r"shape \(1, 18\), one row per set of sources, not \(18,\)"):
        metrics.error_summary(mesh, truth, truth, [0])


def test_eikonal_residual_of_a_linear_function_is_its_slope_less_one() -> None:
    mesh = shapes.grid(5)
    assert metrics.eikonal_residual(mesh, mesh.V[:, 0]).max() < 1e-12
    np.testing.assert_allclose(metrics.eikonal_residual(mesh, 3 * mesh.V[:, 0]), 2)
    box = shapes.box(2)
    np.testing.assert_allclose(metrics.eikonal_residual(box, box.V @ [0.6, 0, 0.8]), 0, atol=1e-12)
    part = mesh.V[:, 0].copy()
    part[0] = np.inf
    assert np.isnan(metrics.eikonal_residual(mesh, part)).sum() == (mesh.F == 0).any(axis=1).sum()


def test_eikonal_residual_of_a_distance_vanishes_with_the_edge() -> None:
    means = []
    for n in (8, 16, 32):
        mesh = shapes.grid(n)
        means.append(metrics.eikonal_residual(mesh, closed_forms.plane(mesh, 0)).mean())
    # 1 / r curvature of the distance gives h / r per face, integrated over the square: order h, with a logarithm.
    ratios = np.array(means[:-1]) / means[1:]
    assert (ratios > 1.5).all()
    assert (ratios < 4.5).all()
    assert means[-1] < 0.02


def test_true_distances_are_symmetric_and_keep_the_triangle_inequality() -> None:
    mesh = shapes.icosphere(2)
    sources = [0, 50, 100]
    distances = np.stack([closed_forms.sphere(mesh, source) for source in sources])
    assert np.abs(metrics.asymmetry(distances, sources)).max() < 1e-12
    assert metrics.triangle_violations(distances, sources).count == 0
    # Squared distances break it: (1 + 1)^2 > 1^2 + 1^2.
    squared = metrics.triangle_violations(distances**2, sources)
    assert squared.count > 0
    assert 0 < squared.fraction <= 1
    assert 0 < squared.largest <= 0.5 + 1e-12
    distances[0] *= 1.1
    found = metrics.asymmetry(distances, sources)
    assert found[0, 1] == pytest.approx(0.1 * distances[1, 0])
    np.testing.assert_array_equal(found, -found.T)


def test_pairs_in_different_components_are_left_out() -> None:
    apart = np.array([[0.0, 1, np.inf], [np.inf, np.inf, 0]])
    assert not metrics.asymmetry(apart, [0, 2]).any()
    assert metrics.triangle_violations(apart, [0, 2]) == metrics.TriangleViolations(0, 0.0, 0.0)
    together = np.array([[0.0, 1, np.inf], [1, 0, np.inf]])
    assert metrics.triangle_violations(together, [0, 1]) == metrics.TriangleViolations(0, 0.0, 0.0)


@pytest.mark.parametrize("mesh", [shapes.icosphere(2), shapes.box(3)], ids=["triangles", "tetrahedra"])
def test_bounds_hold_for_a_true_distance_and_break_for_a_scaled_one(mesh: Mesh) -> None:
    lines = np.linalg.norm(mesh.V - mesh.V[5], axis=1)
    truth = lines if mesh.is_tetrahedral else closed_forms.sphere(mesh, 5)
    held = metrics.bound_violations(mesh, truth, 5)
    assert (held.n_below, held.largest_below) == (0, 0)
    short = metrics.bound_violations(mesh, 0.8 * lines, 5)
    assert short.n_below == mesh.n_vertices - 1
    assert short.largest_below == pytest.approx(0.2)
    long = metrics.bound_violations(mesh, 2 * truth, 5)
    assert long.n_above > mesh.n_vertices / 2
    assert 0.3 < long.largest_above < 1.01  # an arc is longer than the edges below it by h^2 / 24
    assert metrics.bound_violations(mesh, np.full(mesh.n_vertices, np.inf), 5).n_above == 0
