"""Walks from the exact distances near curves."""

from __future__ import annotations

import numpy as np
import pytest
from test_signed_distance import flat_perturbed
from test_unfolding_sources import sheared

from heat_igl import HeatMethodSolver, Mesh, SignedHeatSolver, SurfaceCurve, isolines, shapes
from heat_igl.unfolding import curve_walks
from heat_igl.unfolding.halves import first_half


def solvers(mesh: Mesh) -> tuple[HeatMethodSolver, HeatMethodSolver]:
    return HeatMethodSolver(mesh, refine="unfold"), HeatMethodSolver(mesh, refine="exact")


@pytest.mark.parametrize("shear", [0.0, 2.3])
def test_distance_from_straight_lines_in_a_plane_is_exact(shear):
    # With a shear nearly all faces are flipped, and angles in the fans of the faces are not those in the triangles'.
    mesh = sheared(flat_perturbed(shapes.grid(40), 0.2), shear)
    (line,) = isolines(mesh, mesh.V[:, 1], 0.43)[0]
    # There and back: a closed curve.
    closed = SurfaceCurve(*(np.concatenate(pair) for pair in zip(forth(line), back(line), strict=True)))
    # Where the perpendicular meets the line, and not near an end, around which the front is round.
    beside = np.abs(mesh.V[:, 0] - shear * 0.43 - 0.5) < 0.4
    solver = solvers(mesh)[0]
    walks = solver._parts.last_steps._walks_of
    assert walks(solver._source_set(line)) is None
    assert walks(solver._source_set(closed)) is not None
    found = solver.distance(closed)
    np.testing.assert_allclose(found[beside], np.abs(mesh.V[:, 1] - 0.43)[beside], rtol=1e-9, atol=1e-12)


def forth(curve: SurfaceCurve) -> tuple[np.ndarray, ...]:
    return curve.faces, curve.start, curve.end


def back(curve: SurfaceCurve) -> tuple[np.ndarray, ...]:
    return curve.faces[::-1], curve.end[::-1], curve.start[::-1]


def test_distance_from_several_curves_is_near_exact_with_the_nearest_one():
    mesh = shapes.blob(5)
    curves = [curve for level in isolines(mesh, mesh.V @ [0.3, 0.5, 0.81], [-0.2, 0.4]) for curve in level]
    assert len(curves) > 1
    found, exact = (solver.voronoi(curves) for solver in solvers(mesh))
    error = found.distance - exact.distance
    assert np.abs(error).mean() < 2e-4 * exact.distance.mean()
    assert np.abs(error).max() < 5e-3 * exact.distance.max()
    assert (found.labels == exact.labels).mean() > 0.999


@pytest.mark.parametrize("make", [lambda mesh: solvers(mesh)[0], SignedHeatSolver], ids=["walks", "fronts"])
def test_the_number_of_threads_does_not_change_the_bits(monkeypatch, make):
    mesh = shapes.blob(4)
    (curve,) = isolines(mesh, mesh.V[:, 2], 0.1)[0]
    solver = make(mesh)
    found = []
    for count in ("1", "2"):
        monkeypatch.setenv("HEAT_IGL_NUM_THREADS", count)
        found.append(solver.distance(curve))
    np.testing.assert_array_equal(*found)


def test_halves_are_made_of_parts_that_known_vertices_separate():
    mesh = shapes.icosphere(4)
    F, z = mesh.F.astype(np.int32), mesh.V[:, 2]
    for height in (0.0, 0.2):
        first = first_half(F, np.abs(z - height) < 0.3)
        south, north = z < height - 0.3, z > height + 0.3
        assert first[south].all() != first[north].all()
        assert first[south].any() != first[north].any()
    # Of three parts two are not taken if that is more than half.
    is_known = np.abs(np.abs(z) - 0.33) < 0.08
    assert 0.3 < first_half(F, is_known)[~is_known].mean() <= 0.5
    # Without known vertices there is one part.
    assert first_half(F, np.zeros(mesh.n_vertices, bool)).all()


def test_surfaces_without_fans_take_points_for_curves():
    mesh = shapes.icosphere(4)
    edge = mesh.F[0, :2]
    fin = Mesh(np.vstack([mesh.V, 1.1 * mesh.V[edge].mean(axis=0)]), np.vstack([mesh.F, [*edge, mesh.n_vertices]]))
    (curve,) = isolines(fin, fin.V[:, 2], 0.1)[0]
    solver, exact = solvers(fin)
    assert solver._parts.last_steps._searches.curve_walks is None
    truth = exact.distance(curve)
    assert np.abs(solver.distance(curve) - truth).mean() < 2e-4 * truth.mean()


def test_segments_of_no_length_are_the_point():
    start = end = np.array([1 + 1j])
    np.testing.assert_array_equal(curve_walks._nearest(start, end, np.array([3 + 4j])), start)
    # Beside the middle, and beyond an end.
    found = curve_walks._nearest(np.array([0j, 0j]), np.array([2 + 0j, 2 + 0j]), np.array([1 + 5j, 7 - 1j]))
    np.testing.assert_allclose(found, [1, 2])
