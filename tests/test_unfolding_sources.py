"""Refinement from sources inside faces, from sources that begin later, and the cells of the nearest source."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import perturbed, pygeodesic_distance, relative_error
from surfaces import moebius_strip, random_disk, sheared, with_point
from test_unfolding import METHODS

from heat_igl import Mesh, Refinement, SurfacePoints, shapes
from heat_igl.intrinsic import intrinsic_delaunay, intrinsic_triangulation

NONE = np.zeros(0, np.int64)


def refinement(mesh: Mesh) -> Refinement:
    return Refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)))


FLAT = {
    "grid": lambda: shapes.grid(12),
    "sheared grid": lambda: sheared(shapes.grid(12), 2.3),
    "sheared disk": lambda: sheared(random_disk(500, 3), 3.3),
}
COORDINATES = {
    "inside": (0.2, 0.5, 0.3),
    "on a side": (0.3, 0.0, 0.7),
    "nearly on a side": (1e-13, 0.4, 0.6 - 1e-13),
    "at a corner": (0.0, 1.0, 0.0),
}


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("where", COORDINATES)
@pytest.mark.parametrize("method", METHODS)
def test_points_on_flat_convex_domains_are_exact(name, where, method):
    mesh = FLAT[name]()
    surface = refinement(mesh)
    for face in np.random.default_rng(0).integers(mesh.n_faces, size=5):
        point = SurfacePoints([face], [COORDINATES[where]])
        truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
        for offset in (0.0, 2.0):
            d = getattr(surface, method)(truth, NONE, points=point, point_offsets=np.array([offset]))
            np.testing.assert_allclose(d, truth + offset, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("method", METHODS)
def test_point_as_a_vertex_in_its_place(method):
    """On a curved surface, and on one that cannot be oriented, a point gives what a vertex put there gives."""
    bumpy = perturbed(shapes.icosphere(3), 0.3, 1)
    for mesh in (bumpy, moebius_strip(40, 5)):
        for face in (3, 77, 300):
            barycentric = np.array([0.2, 0.5, 0.3])
            refined = with_point(mesh, face, barycentric)
            truth = pygeodesic_distance(refined, mesh.n_vertices)
            d = getattr(refinement(mesh), method)(truth[:-1], NONE, points=SurfacePoints([face], [barycentric]))
            error = relative_error(d, truth[:-1])
            inserted = getattr(refinement(refined), method)(truth, np.array([mesh.n_vertices]))
            assert error.mean() < (2e-2 if method == "sweep" else 2e-4)
            assert error.mean() < 1.2 * relative_error(inserted[:-1], truth[:-1]).mean() + 1e-12


@pytest.mark.parametrize("method", METHODS)
def test_cells_of_the_nearest_source(method):
    """Vertices and points, some of which begin later: each vertex is measured from the one that is nearest in all."""
    mesh = sheared(random_disk(500, 4), 1.5)
    surface = refinement(mesh)
    rng = np.random.default_rng(1)
    sources, faces = np.array([3, 200, 450]), np.array([10, 10, 400, 700])
    points = SurfacePoints(faces, rng.dirichlet([1, 1, 1], size=4))
    offsets, point_offsets = np.array([0.1, 0.0, 0.05]), np.array([0.0, 0.02, 0.1, 0.05])
    places = np.concatenate([mesh.V[sources], points.positions(mesh)])
    from_each = np.linalg.norm(mesh.V - places[:, None], axis=2) + np.concatenate([offsets, point_offsets])[:, None]
    labels = np.empty(mesh.n_vertices, np.int64)
    starts = {"offsets": offsets, "points": points, "point_offsets": point_offsets, "labels": labels}
    d = getattr(surface, method)(from_each.min(axis=0), sources, **starts)
    nearest = from_each.min(axis=0)
    error = np.abs(d - nearest)
    if method == "unfold":
        assert (error < 1e-9).mean() > 0.98
        assert (d > nearest - 1e-12).all()
    # Next to the border of a cell, triangles have corners in two cells, and circles about these meet in no source.
    assert error.max() < (5e-2 if method == "sweep" else 2e-3)
    own = from_each[labels, np.arange(mesh.n_vertices)]
    assert (own - nearest).mean() < (2e-3 if method == "sweep" else 1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_a_source_that_begins_too_late_is_overtaken(method):
    mesh = shapes.grid(10)
    truth = np.linalg.norm(mesh.V - mesh.V[0], axis=1)
    labels = np.empty(mesh.n_vertices, np.int64)
    d = getattr(refinement(mesh), method)(truth, np.array([0, 60]), offsets=np.array([0.0, 5.0]), labels=labels)
    np.testing.assert_allclose(d, truth, rtol=1e-12)
    assert (labels == 0).all()


@pytest.mark.parametrize("slope", [-0.6, 0.0, 0.28])
def test_a_straight_front_goes_on_straight(slope):
    """Sources along the left side of a square that begin as a front comes in at an angle.

    Seen from behind its end, next to which vertices have the distance from the last source, by a hundredth of h.
    """
    mesh = shapes.grid(20)
    x, y, _ = mesh.V.T
    left = np.flatnonzero(x == 0)
    rise = np.sqrt(1 - slope**2)
    truth = rise * x + slope * (y if slope > 0 else y - 1)
    groups = np.zeros(len(left), np.int64)  # points of one curve
    error = np.abs(refinement(mesh).sweep(truth, left, offsets=truth[left], groups=groups) - truth)
    has_come_in = np.abs(y - x * slope / rise - 0.5) <= 0.5
    assert has_come_in.sum() > 250
    assert error[has_come_in].mean() < (0.01 / 20 if slope else 1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_no_label_where_no_source_is_reached(method):
    grid = shapes.grid(4)
    mesh = Mesh(
        np.concatenate([grid.V, grid.V + np.array([5, 0, 0])]), np.concatenate([grid.F, grid.F + grid.n_vertices])
    )
    labels = np.empty(mesh.n_vertices, np.int64)
    d = getattr(refinement(mesh), method)(np.zeros(mesh.n_vertices), np.array([30]), labels=labels)
    assert (labels == np.where(np.isinf(d), -1, 0)).all()
    assert np.isinf(d[: grid.n_vertices]).all()


@pytest.mark.parametrize("method", METHODS)
def test_labels_do_not_change_the_distance(method):
    mesh = perturbed(shapes.icosphere(3), 0.3, 2)
    surface, sources = refinement(mesh), np.array([0, 100, 400])
    key = np.random.default_rng(0).random(mesh.n_vertices)
    plain = getattr(surface, method)(key, sources)
    labelled = getattr(surface, method)(key, sources, offsets=np.zeros(3), labels=np.empty(mesh.n_vertices, np.int64))
    np.testing.assert_array_equal(plain, labelled)


def test_points_are_carried_through_the_flips():
    """Where the triangulation says that a point lies is where it lies, in the plane."""
    mesh = sheared(random_disk(300, 5), 3.0)
    triangulation = intrinsic_delaunay(intrinsic_triangulation(mesh))
    assert triangulation.n_flips > mesh.n_faces / 2
    rng = np.random.default_rng(0)
    faces, barycentric = rng.integers(mesh.n_faces, size=2000), rng.dirichlet([1, 1, 1], size=2000)
    before = np.einsum("kc,kcx->kx", barycentric, mesh.V[mesh.F[faces]])
    faces, barycentric = triangulation.locate(faces, barycentric)
    assert (barycentric >= 0).all()
    np.testing.assert_allclose(np.einsum("kc,kcx->kx", barycentric, mesh.V[triangulation.F[faces]]), before, atol=1e-11)
