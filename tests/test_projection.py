from __future__ import annotations

import numpy as np
import pytest

from heat_igl import Mesh, SourceError, closest_points, curve_on, edge_curve, shapes


def ends(mesh, curve):
    """Where segments begin and end, in space."""
    return tuple(np.einsum("sc,scx->sx", at, mesh.V[mesh.F[curve.faces]]) for at in (curve.start, curve.end))


def assert_connected(mesh, curve):
    start, end = ends(mesh, curve)
    np.testing.assert_allclose(start[1:], end[:-1], atol=1e-12)
    if curve.is_closed:
        np.testing.assert_allclose(end[-1], start[0], atol=1e-12)


def test_closest_points_and_their_gap():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    positions = [[0.2, 0.3, 0.5], [0.5, -2, 0], [1, 1, 1], [0.25, 0.25, 0]]
    points, gap = closest_points(mesh, positions)
    expected = [[0.2, 0.3, 0], [0.5, 0, 0], [0.5, 0.5, 0], [0.25, 0.25, 0]]
    np.testing.assert_allclose(points.positions(mesh), expected, atol=1e-15)
    np.testing.assert_allclose(gap, [0.5, 2, np.sqrt(1.5), 0], atol=1e-15)
    assert (points.barycentric[1] == [0.5, 0.5, 0]).all()


def test_closest_points_on_a_face_without_area():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [3, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 1, 3]])
    points, gap = closest_points(mesh, [2.5, -0.5, 0])
    assert points.faces.tolist() == [0]
    np.testing.assert_allclose(points.positions(mesh), [[2.5, 0, 0]], atol=1e-15)
    assert gap[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    "corners",
    [
        [[0.03, 0.1, 0], [0.777, 0.943, 0]],
        [[0, 0, 0], [1, 1, 0]],  # along diagonals, through vertices
        [[0, 0.5, 0], [1, 0.5, 0]],  # along edges
        [[0, 0, 0], [1, 0.5, 0]],  # through every other vertex
        [[0.31, 0.2, 0], [0.82, 0.41, 0], [0.4, 0.9, 0], [0.4, 0.9, 0], [0.41, 0.1, 0]],
    ],
)
def test_a_polyline_in_the_plane_keeps_its_shape(corners):
    mesh = shapes.grid(20)
    curve = curve_on(mesh, corners)
    assert_connected(mesh, curve)
    corners = np.array(corners, float)
    positions = curve.positions(mesh)
    np.testing.assert_allclose(positions[[0, -1]], corners[[0, -1]], atol=1e-15)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    assert curve.lengths(mesh).sum() == pytest.approx(length, rel=1e-9)
    # As long as the polyline, and through its corners: it is the polyline.
    assert np.linalg.norm(positions[:, None] - corners, axis=2).min(axis=0).max() < 1e-12


def test_a_circle_around_the_sphere():
    mesh = shapes.icosphere(4)
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    for height in (0.0, 0.3):
        radius = np.sqrt(1 - height**2)
        circle = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(200, height)], axis=1)
        curve = curve_on(mesh, circle, closed=True)
        assert_connected(mesh, curve)
        assert curve.is_closed
        assert curve.lengths(mesh).sum() == pytest.approx(2 * np.pi * radius, rel=2e-3)
        np.testing.assert_allclose(curve.positions(mesh)[:, 2], height, atol=5e-3)


def test_a_polyline_over_a_real_mesh(bunny):
    """Through vertices in space that are not neighbours, a mean edge length off the surface."""
    rng = np.random.default_rng(0)
    h = bunny.edge_lengths.mean()
    path = [100]
    for _ in range(8):
        away = np.linalg.norm(bunny.V - bunny.V[path[-1]], axis=1)
        path.append(int(rng.choice(np.flatnonzero((away > 2 * h) & (away < 4 * h)))))
    corners = bunny.V[path] + rng.uniform(-0.5, 0.5, (9, 3)) * h
    curve = curve_on(bunny, corners, tolerance=3 * h)
    assert_connected(bunny, curve)
    straight = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    assert straight * 0.7 < curve.lengths(bunny).sum() < straight * 1.5


def test_a_curve_along_edges_passes_their_vertices_in_order():
    mesh = shapes.grid(4)
    path = [0, 1, 6, 11]
    curve = edge_curve(mesh, path)
    assert_connected(mesh, curve)
    np.testing.assert_allclose(curve.positions(mesh), mesh.V[path], atol=1e-15)
    around = edge_curve(mesh, [0, 1, 6, 5], closed=True)
    assert_connected(mesh, around)
    np.testing.assert_allclose(around.positions(mesh), mesh.V[[0, 1, 6, 5, 0]], atol=1e-15)


def test_positions_in_the_plane():
    mesh, at = shapes.grid(4), [[0.2, 0.3], [0.8, 0.1]]
    found, expected = (closest_points(mesh, np.pad(at, ((0, 0), (0, k)))) for k in (0, 1))
    np.testing.assert_array_equal(found.points.barycentric, expected.points.barycentric)
    np.testing.assert_allclose(curve_on(mesh, at).positions(mesh)[[0, -1]], np.pad(at, ((0, 0), (0, 1))), atol=1e-12)


@pytest.mark.parametrize(
    ("positions", "options", "message"),
    [
        ([[0, 0, 0]], {}, "two corners of a curve or more, not 1"),
        ([[0] * 4, [1] * 4], {}, r"positions must have shape \(k, 3\), a row for each, or .*, not \(2, 4\)"),
        ([[0, 0, 0], [1, np.nan, 0]], {}, r"positions\[1\] = \[1.0, nan, 0.0\] is not finite"),
        ([["a", 0, 0], [1, 0, 0]], {}, "positions must be real numbers"),
        ([[0.5, 0.5, 0], [0.5, 0.5, 0]], {}, "all in one place"),
        ([[0.5, 0.5, 0], [0.5, 0.5, 2]], {}, r"leaves the surface by .* on the line from positions\[0\].*tolerance is"),
        ([[0, 0, 0], [1, 0, 0], [1.2, 0.4, 0]], {"tolerance": 0.1}, r"line from positions\[1\]"),
    ],
)
def test_refused_polylines(positions, options, message):
    with pytest.raises(SourceError, match=message):
        curve_on(shapes.grid(4), positions, **options)


def test_a_jump_between_two_sheets_is_refused():
    """Between two parallel sheets the closest point jumps from one to the other."""
    sheet = shapes.grid(4)
    sheets = Mesh(np.concatenate([sheet.V, sheet.V + np.array([0, 0, 0.2])]), np.concatenate([sheet.F, sheet.F + 25]))
    with pytest.raises(SourceError, match=r"line from positions\[0\] jumps from face .* draw it closer"):
        curve_on(sheets, [[0.2, 0.2, 0.05], [0.7, 0.2, 0.15]])


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ([0, 1, 3], r"vertices\[1\] = 1 and the next, 3, are not joined by an edge"),
        ([0], "vertices must be two vertex indices or more"),
        ([0, 99], r"vertices\[0\] = 0 and the next, 99, are not"),
        ([0.0, 1.0], "vertices must be two vertex indices or more, not float64"),
    ],
)
def test_refused_edges(vertices, message):
    with pytest.raises(SourceError, match=message):
        edge_curve(shapes.grid(4), vertices)


def test_tetrahedra_have_no_faces_for_points():
    with pytest.raises(SourceError, match="need triangles, but the mesh is tetrahedral"):
        closest_points(shapes.box(2), [0, 0, 0])
    with pytest.raises(SourceError, match="need triangles, but the mesh is tetrahedral"):
        edge_curve(shapes.box(2), [0, 1])
