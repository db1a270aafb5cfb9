from __future__ import annotations

import re

import numpy as np
import pytest

from heat_igl import (
    GeodesicSolver,
    OffsetSources,
    SourceError,
    SurfaceCurve,
    SurfacePoints,
    geodesic_distance,
    isolines,
    shapes,
)
from heat_igl.sources import source_set, vertex_sources


@pytest.mark.parametrize(
    ("sources", "expected"),
    [
        (3, [3]),
        (np.int32(3), [3]),
        (np.array(3), [3]),
        ([4, 1, 4], [1, 4]),
        (range(2), [0, 1]),
        (np.array([2, 0], np.uint8), [0, 2]),
        ([False, True, False, False, True], [1, 4]),
        (np.array([True, False, False, False, False]), [0]),
    ],
)
def test_accepted_forms(sources, expected):
    found = vertex_sources(sources, 5)
    assert found.dtype == np.int64
    assert found.tolist() == expected


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        (5, r"sources\[0\] = 5 is no vertex: the mesh has 5 vertices.* from 0 to 4"),
        ([0, -1, 9], r"sources\[1\] = -1 is no vertex \(2 of 3"),
        ([], "sources is empty"),
        (np.zeros(5, bool), "selects no vertex"),
        (np.ones(4, bool), "4 entries, but the mesh has 5"),
        (1.0, "floats such as 1.0"),
        ([0, np.nan], "floats"),
        ("0", "sources must be a vertex index"),
        (None, "sources must be a vertex index"),
        ([[0, 1]], r"shape \(1, 2\)"),
        ([[0], [1, 2]], "ragged"),
        ({0}, "sources must be a vertex index"),
    ],
)
def test_sources_that_name_no_vertices_are_refused(sources, message):
    with pytest.raises(SourceError, match=message):
        vertex_sources(sources, 5)
    with pytest.raises(SourceError, match=message):
        source_set(sources, 5, F)


F = np.array([[0, 1, 2], [2, 1, 3], [3, 4, 2]])
CENTRE = np.full((1, 3), 1 / 3)
CURVE = SurfaceCurve([0, 1], [[1, 0, 0], [0, 0.5, 0.5]], [[0.5, 0.5, 0], [0.2, 0.2, 0.6]])


def test_sources_are_counted_as_they_are_given():
    points = SurfacePoints([2, 0], [[0.2, 0.3, 0.5], [0.5, 0.5, 0]])
    found = source_set([4, CURVE, points, [1, 0], np.array([False, True, False, False, True])], 5, F)
    assert found.n_labels == 8
    # Vertex 4 is named first as 0 and again as 7, vertex 1 as 4 and as 6.
    assert found.vertices.tolist() == [0, 1, 4]
    assert found.vertex_label.tolist() == [5, 4, 0]
    assert found.points.label.tolist() == [2, 3]
    assert found.points.faces.tolist() == [2, 0]
    assert found.segments.label.tolist() == [1, 1]
    assert found.segments.faces.tolist() == [0, 1]
    assert not found.offsets.any()


def test_a_point_in_a_vertex_is_that_vertex():
    found = source_set(SurfacePoints([1, 2], [[1e-14, 0, 1 - 1e-14], [0.5, 0.5, 0]]), 5, F)
    assert found.vertices.tolist() == [3]
    assert found.vertex_label.tolist() == [0]
    assert found.points.faces.tolist() == [2]
    assert found.points.label.tolist() == [1]
    assert found.n_labels == 2


def test_offsets_add_up_through_nested_sources():
    assert source_set(OffsetSources([3, 1], [0.5, 0.25]), 5, F).vertex_offset.tolist() == [0.25, 0.5]
    assert source_set(OffsetSources([3, 1], 2), 5, F).vertex_offset.tolist() == [2, 2]
    nested = [OffsetSources([OffsetSources(0, 1), CURVE, SurfacePoints([1], CENTRE)], [10, 20, 30]), 2]
    found = source_set(nested, 5, F)
    assert found.vertex_offset.tolist() == [11, 0]
    assert found.segments.offset.tolist() == [20, 20]
    assert found.points.offset.tolist() == [30]
    # Of a vertex that is named twice, the smaller offset counts.
    twice = source_set(OffsetSources([2, 2], [0.5, 0.25]), 5, F)
    assert (twice.vertices.tolist(), twice.vertex_offset.tolist(), twice.vertex_label.tolist()) == ([2], [0.25], [1])


@pytest.mark.parametrize(
    ("offsets", "message"),
    [
        ([0.0, -1.0], r"offsets\[1\] = -1.0 must be finite and not negative"),
        ([np.nan, 0.0], r"offsets\[0\] = nan must be finite"),
        (np.inf, "offsets = inf must be finite"),
        ([[0.0, 1.0]], r"one number or one for each source, not of shape \(1, 2\)"),
        ("near", "offsets must be real numbers, not 'near'"),
    ],
)
def test_refused_offsets(offsets, message):
    with pytest.raises(SourceError, match=message):
        OffsetSources([0, 1], offsets)


@pytest.mark.parametrize(
    ("sources", "message"),
    [
        (OffsetSources([0, 1], [0.0, 1.0, 2.0]), "offsets has 3 entries for 2 sources: give one for each"),
        (OffsetSources([CURVE, 0], [1.0]), "offsets has 1 entries for 2 sources"),
        (SurfacePoints([0, 3], np.tile(CENTRE, (2, 1))), r"faces\[1\] = 3 is no face: indices run from 0 to 2"),
        (SurfaceCurve([-1], [[1, 0, 0]], [[0, 1, 0]]), r"faces\[0\] = -1 is no face"),
        ([CURVE, 7], r"sources\[1\]: sources\[0\] = 7 is no vertex"),
        ([3, SurfacePoints([9], CENTRE)], r"sources\[1\]: faces\[0\] = 9 is no face"),
        ([CURVE, None], r"sources\[1\]: sources must be a vertex index"),
        ([CURVE, []], r"sources\[1\]: sources is empty"),
    ],
)
def test_refused_places(sources, message):
    with pytest.raises(SourceError, match=message):
        source_set(sources, 5, F)


def test_only_triangles_hold_points():
    with pytest.raises(SourceError, match="points and curves lie on triangles, and this domain has none: name vert"):
        source_set([0, SurfacePoints([0], CENTRE)], 5, None)
    with pytest.raises(SourceError, match="here, not SurfacePoints"):
        vertex_sources(SurfacePoints([0], CENTRE), 5)


def test_lists_of_curves_may_be_nested():
    """`isolines` returns a list of curves for each level."""
    mesh = shapes.icosphere(2)
    lines = isolines(mesh, mesh.V[:, 2], [-0.3, 0.4])
    flat = [curve for level in lines for curve in level]
    solver = GeodesicSolver(mesh, method="sweep")
    np.testing.assert_array_equal(solver.distance(lines), solver.distance(flat))
    np.testing.assert_array_equal(solver.distance([lines, [3, 4]]), solver.distance([*flat, 3, 4]))


@pytest.mark.parametrize("method", ["exact", "sweep", "heat"])
def test_offsets_from_which_distances_cannot_be_told_are_refused(method):
    mesh = shapes.grid(8)
    for offset in (1e13, 1e16, 1e300):
        for sources in (OffsetSources(0, offset), OffsetSources([0, 80], [0, offset])):
            with pytest.raises(SourceError, match=re.escape(f"an offset of {offset:.4g} is too large for a mesh")):
                geodesic_distance(mesh, sources, method=method)
    late = geodesic_distance(mesh, OffsetSources(0, 1e9), method=method)
    np.testing.assert_allclose(late - 1e9, geodesic_distance(mesh, 0, method=method), atol=2.4e-7)
