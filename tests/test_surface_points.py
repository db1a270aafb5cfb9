"""Points and curves on faces: where they are, and which mistakes are refused."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import Mesh, SourceError, SurfaceCurve, SurfacePoints

MESH = Mesh([[0, 0, 0], [2, 0, 0], [0, 4, 0], [2, 4, 6]], [[0, 1, 2], [1, 3, 2]])


def test_positions_are_weighted_corners():
    points = SurfacePoints([0, 1], [[0.5, 0.25, 0.25], [0, 1, 0]])
    np.testing.assert_allclose(points.positions(MESH), [[0.5, 1, 0], [2, 4, 6]])


def test_a_curve_runs_through_its_corners():
    # Down the edge 1-2 in face 0, then to vertex 3 in face 1.
    curve = SurfaceCurve([0, 1], [[0, 1, 0], [0, 0, 1]], [[0, 0, 1], [0, 1, 0]])
    np.testing.assert_allclose(curve.positions(MESH), [[2, 0, 0], [0, 4, 0], [2, 4, 6]])
    np.testing.assert_allclose(curve.lengths(MESH), [np.sqrt(20), np.sqrt(40)])


@pytest.mark.parametrize(
    ("faces", "barycentric", "message"),
    [
        ([0], [[0.5, 0.5, 0.1]], r"barycentric\[0\] .* must sum to 1, not 1.1"),
        ([0, 0], [[1, 0, 0], [0.5, 0.7, -0.2]], r"barycentric\[1\] .* not negative"),
        ([0], [[np.nan, 0.5, 0.5]], r"barycentric\[0\] .* finite"),
        ([0], [[1, 0]], r"shape \(1, 3\)"),
        ([0.5], [[1, 0, 0]], "faces must be one face index or more, not float64"),
        ([], np.zeros((0, 3)), "faces must be one face index"),
        ([0], "x", "real numbers"),
    ],
)
def test_wrong_coordinates_are_refused(faces, barycentric, message):
    with pytest.raises(SourceError, match=message):
        SurfacePoints(faces, barycentric)


def test_a_face_out_of_range_is_refused():
    with pytest.raises(SourceError, match=r"faces\[1\] = 2 is no face: indices run from 0 to 1"):
        SurfacePoints([0, 2], [[1, 0, 0], [1, 0, 0]]).positions(MESH)
