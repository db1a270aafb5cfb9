"""Masks as domains: every pixel there, connected as it should be, distances those of the plane around obstacles."""

from __future__ import annotations

import numpy as np
import pytest

import heat_igl
from heat_igl import image_domain
from heat_igl.geodesic import SolverChoice
from heat_igl.validation import relative_error


def test_every_pixel_has_its_area_and_its_place():
    mask = np.random.default_rng(0).random((12, 17)) < 0.6
    domain = image_domain(mask, spacing=(0.5, 2.0))
    assert domain.mesh.measures.sum() == pytest.approx(mask.sum(), rel=1e-12)
    assert np.array_equal(domain.index >= 0, mask)
    row, column = np.nonzero(mask)
    expected = np.stack([2.0 * column, 0.5 * row, np.zeros(len(row))], axis=1)
    np.testing.assert_allclose(domain.mesh.V[domain.index[mask]], expected)
    corner = domain.mesh.V[domain.mesh.F]
    assert (np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2] > 0).all()


def test_components_are_those_of_skimage():
    measure = pytest.importorskip("skimage.measure")
    mask = np.random.default_rng(1).random((40, 40)) < 0.35
    domain = image_domain(mask)
    expected = measure.label(mask, connectivity=2)[mask]
    found = domain.mesh.components[domain.index[mask]]
    pairs = set(zip(expected.tolist(), found.tolist(), strict=True))
    assert len(pairs) == len(set(expected.tolist())) == len(set(found.tolist()))


@pytest.mark.parametrize("method", ["heat", "sweep", "exact"])
def test_a_stroke_one_pixel_wide_is_as_long_as_it_is(method):
    """Straight, then diagonal from corner to corner of the pixels."""
    mask = np.zeros((20, 40), bool)
    mask[2, :21] = True
    steps = np.arange(1, 16)
    mask[2 + steps, 20 + steps] = True
    domain = image_domain(mask)
    solver = SolverChoice(method).on(domain.mesh)
    distance = domain.image(solver.distance(domain.index[2, 0]))
    exact = 15 + np.hypot(5.5, 0.5) + np.sqrt(0.5) + 14 * np.sqrt(2) if method != "heat" else None
    straight = np.hypot(20.5, 0.5) + np.sqrt(0.5) + 14 * np.sqrt(2)
    assert np.isinf(distance[~mask]).all()
    assert np.isfinite(distance[mask]).all()
    assert distance[17, 35] == pytest.approx(straight, rel=0.02 if method == "heat" else 1e-9)
    assert exact is None or exact > straight


def test_no_direction_is_preferred():
    """The image turned over gives the distance turned over: there are no diagonals that run one way."""
    mask = np.ones((31, 31), bool)
    domain = image_domain(mask)
    distance = domain.image(heat_igl.HeatMethodSolver(domain.mesh).distance(domain.index[15, 15]))
    for turned in (distance.T, distance[::-1], distance[:, ::-1]):
        np.testing.assert_allclose(turned, distance, rtol=1e-9, atol=1e-9)
    y, x = np.mgrid[-15:16, -15:16]
    assert np.nanmean(relative_error(distance, np.hypot(x, y))) < 0.02


def test_distance_goes_around_a_wall():
    mask = np.ones((21, 21), bool)
    mask[:16, 10] = False
    domain = image_domain(mask)
    distance = domain.image(heat_igl.GeodesicSolver(domain.mesh, method="exact").distance(domain.index[3, 4]))
    corners = np.array([[9.5, 15.5], [10.5, 15.5]])
    expected = np.linalg.norm(corners[0] - [4, 3]) + 1 + np.linalg.norm(corners[1] - [16, 3])
    assert distance[3, 16] == pytest.approx(expected, rel=1e-4)
    assert distance[3, 16] >= expected * (1 - 1e-9)
    assert distance[3, 9] == pytest.approx(5)
    assert distance[10, 10] == np.inf


def test_vertices_images_and_faces():
    mask = np.array([[True, True, False], [False, True, True]])
    domain = image_domain(mask)
    assert domain.vertices(np.array([[False, True, True], [False, False, True]])).tolist() == [1, 3]
    labels = np.arange(domain.mesh.n_vertices)
    assert domain.image(labels, outside=-1).tolist() == [[0, 1, -1], [-1, 2, 3]]
    assert domain.image(labels, outside=-1).dtype.kind == "i"
    assert domain.image([labels, -labels], outside=9)[1].tolist() == [[0, -1, 9], [9, -2, -3]]
    per_face = domain.per_face([[1, 2, 9], [9, 3, 4]])
    assert per_face.tolist() == np.repeat([1, 2, 3, 4], 4).tolist()
    for pixel, faces in enumerate(domain.mesh.F.reshape(-1, 4, 3)):
        assert (faces[:, 0] == pixel).all()


def test_a_metric_per_pixel_is_a_linear_map():
    """A constant tensor in the axes x and y: the triangles of a pixel have four different first sides."""
    domain = image_domain(np.ones((7, 9), bool))
    g = np.zeros((7, 9, 3, 3))
    g[..., :2, :2] = [[3.0, 1.0], [1.0, 0.5]]
    metric = heat_igl.metric_operators(domain.mesh, domain.per_face(g))
    distance = heat_igl.GeodesicSolver(metric, method="exact").distance(domain.index[0, 0])
    x, y, _ = domain.mesh.V.T
    np.testing.assert_allclose(distance, np.sqrt(3 * x**2 + 2 * x * y + 0.5 * y**2), atol=1e-12)
    with pytest.raises(ValueError, match=r"image must have shape \(7, 9\), with further axes .* not \(9, 7, 3, 3\)"):
        domain.per_face(g.swapaxes(0, 1))


def test_wrong_images_are_refused():
    with pytest.raises(heat_igl.MeshError, match="mask must be a boolean image"):
        image_domain([[0, 1], [1, 1]])
    with pytest.raises(heat_igl.MeshError, match="mask must be a boolean image"):
        image_domain([[True], [True, False]])
    with pytest.raises(heat_igl.MeshError, match="mask holds no pixel"):
        image_domain([[False]])
    for spacing in (0, (1, -1), (1, 2, 3), "x", np.inf):
        with pytest.raises(ValueError, match="spacing must be one or two positive numbers"):
            image_domain([[True]], spacing)
    domain = image_domain([[True, False]])
    with pytest.raises(heat_igl.SourceError, match="pixels selects no pixel"):
        domain.vertices([[False, True]])
    with pytest.raises(heat_igl.SourceError, match=r"pixels must be a boolean image of shape \(1, 2\)"):
        domain.vertices([[0, 1]])
    with pytest.raises(ValueError, match=r"values must have shape \(5,\)"):
        domain.image([1.0, 2.0])
    with pytest.raises(ValueError, match=r"image must have shape \(1, 2\)"):
        domain.per_face([[1.0]])
