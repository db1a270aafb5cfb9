"""Exact distance from curves, every point of which is a source: closed forms, dense points, and paths to curves."""

import numpy as np
import pytest
from conftest import flat_perturbed
from surfaces import assert_connected, box_surface, to_polyline
from test_exact import delaunay
from test_exact_threads import counted
from test_paths import MESHES

from heat_igl import (
    GeodesicSolver,
    Mesh,
    OffsetSources,
    SurfaceCurve,
    SurfacePoints,
    closest_points,
    geodesic_distance,
    isolines,
    shapes,
    shortest_paths,
)
from heat_igl.geodesic import SolverChoice
from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.sources import source_set
from heat_igl.windows import ExactSurface
from heat_igl.windows.tables import MARGIN


@pytest.mark.parametrize("mesh", [shapes.grid(12), flat_perturbed(shapes.grid(40))], ids=["grid", "perturbed"])
def test_curves_in_the_plane(mesh):
    from_point = np.linalg.norm(mesh.V - [0.4, 0.45, 0], axis=1)
    for curve in (
        isolines(mesh, mesh.V[:, 0] + 0.2 * mesh.V[:, 1], 0.43)[0][0],
        isolines(mesh, from_point, 0.2)[0][0],
        shortest_paths(mesh, 5, mesh.n_vertices // 2 + 3)[0],
    ):
        truth = to_polyline(mesh.V, curve.positions(mesh))
        np.testing.assert_allclose(geodesic_distance(mesh, curve, method="exact"), truth, rtol=1e-12, atol=1e-14)


def test_curves_on_a_prism():
    """A ring around it, and a screw line, which is straight on the prism rolled out."""
    mesh = shapes.cylinder(24, 20)
    ring, k = np.divmod(np.arange(mesh.n_vertices), 24)
    around = 48 * np.sin(np.pi / 24)
    rolled_out = np.column_stack([k * around / 24, ring * (2 * np.pi / 20)])
    z = rolled_out[:, 1]
    (level,) = isolines(mesh, z, 0.43 * z.max())[0]
    np.testing.assert_allclose(
        geodesic_distance(mesh, level, method="exact"), np.abs(z - 0.43 * z.max()), rtol=1e-12, atol=1e-14
    )
    start, end = 3 + 24 * 2, 10 + 24 * 9
    (screw,) = shortest_paths(mesh, start, end)
    truth = np.min(
        [to_polyline(rolled_out + np.array([shift * around, 0]), rolled_out[[start, end]]) for shift in (-1, 0, 1)],
        axis=0,
    )
    np.testing.assert_allclose(geodesic_distance(mesh, screw, method="exact"), truth, rtol=1e-12, atol=1e-14)


def test_curves_on_a_cube():
    mesh = box_surface(1)
    x, _, z = mesh.V.T
    (level,) = isolines(mesh, z, 0.3)[0]
    np.testing.assert_allclose(geodesic_distance(mesh, level, method="exact"), np.abs(z - 0.3), rtol=1e-14)
    # A segment at the bottom, from (0.2, 0.5) to (0.5, 0.5): to the top over the walls at x = 0, x = 1 and y = 0 or 1.
    f = int(np.flatnonzero((z[mesh.F] == 0).all(axis=1) & (mesh.V[mesh.F].mean(axis=1)[:, 0] < 0.5))[0])
    corners = np.vstack([mesh.V[mesh.F[f], :2].T, np.ones(3)])
    start, end = np.linalg.solve(corners, [[0.2, 0.5], [0.5, 0.5], [1, 1]]).T
    distance = geodesic_distance(mesh, SurfaceCurve([f], [start], [end]), method="exact")
    at_bottom = np.hypot(np.where(x == 0, 0.2, 0.5), 0.5)
    at_top = np.where(x == 0, np.hypot(1.2, 0.5), np.hypot(1.5, 0.5))
    np.testing.assert_allclose(distance, np.where(z == 0, at_bottom, at_top), rtol=1e-12)


@pytest.mark.parametrize(
    "name", ["terrain", "rough sphere", "moebius", "book", "torus", "two arms", "needle x", "needle z"]
)
def test_curves_are_nearer_than_points_on_them_by_no_more_than_the_gaps(name):
    """From curves along needles, lines wound around them as often as they are long in widths."""
    scale = [1 if axis == name[-1] else 1e-6 for axis in "xyz"]
    mesh = MESHES[name]() if name in MESHES else Mesh(shapes.icosphere(2).V * scale, shapes.icosphere(2).F)
    used = np.unique(mesh.F)
    (along,) = shortest_paths(mesh, int(used[0]), int(used[len(used) // 2]))
    height = np.linalg.norm(mesh.V - mesh.V[used[3]], axis=1)
    level = isolines(mesh, height, 0.37 * height.max())[0][0]
    surface = ExactSurface(intrinsic_triangulation(mesh, MARGIN))
    for sources in (along, level, [OffsetSources(along, 0.1), level, 7]):
        chosen = source_set(sources, mesh.n_vertices, mesh.F)
        segments = chosen.segments
        solution = surface.solve(chosen)
        assert solution.n_windows < 20 * len(mesh.edges)
        found = solution.distance[used]
        share = np.linspace(0, 1, 40)[:, None, None]
        points = (segments.start * (1 - share) + segments.end * share).reshape(-1, 3)
        dense = OffsetSources(SurfacePoints(np.tile(segments.faces, 40), points), np.tile(segments.offset, 40))
        vertices = OffsetSources(chosen.vertices, chosen.vertex_offset)
        every = [dense, vertices] if len(chosen.vertices) else dense
        excess = surface.solve(source_set(every, mesh.n_vertices, mesh.F)).distance[used] - found
        gap = max(curve.lengths(mesh).max() for curve in (along, level)) / 39
        assert excess.min() > -1e-13
        assert excess.max() <= gap / 2
        assert np.median(excess) <= gap**2


@pytest.mark.parametrize("n", [64, 512])
def test_windows_over_a_fan_are_compared_with_few_others(n, monkeypatch):
    """Windows from all n triangles cross each spoke, and most of them are the shortest somewhere."""
    cone, counts = shapes.cone(n, 1), counted(monkeypatch)
    level = isolines(cone, cone.V @ [1, 0.3, 0.1], 0.1)[0]
    ExactSurface(intrinsic_triangulation(cone, MARGIN)).solve(source_set(level, cone.n_vertices, cone.F))
    ((compared, found, _),) = counts
    assert n**2 / 4 < found
    assert 0 < compared < 2 * found


@pytest.mark.parametrize("name", ["terrain", "moebius", "book"])
def test_exact_paths_end_on_curves(name):
    mesh = MESHES[name]()
    used = np.unique(mesh.F)
    height = np.linalg.norm(mesh.V - mesh.V[used[3]], axis=1)
    level = isolines(mesh, height, 0.37 * height.max())[0][0]
    paths = shortest_paths(mesh, used, level)
    distance = geodesic_distance(mesh, level, method="exact")[used]
    np.testing.assert_allclose([path.length for path in paths], distance, rtol=1e-12, atol=1e-14)
    assert_connected(mesh, *paths)


def test_labels_offsets_and_targets():
    mesh = flat_perturbed(shapes.grid(16))
    curve = isolines(mesh, mesh.V[:, 0], 0.43)[0][0]
    solver = GeodesicSolver(mesh, method="exact")
    cells = solver.voronoi([curve, OffsetSources([0], 0.05)])
    each = np.array([np.abs(mesh.V[:, 0] - 0.43), np.linalg.norm(mesh.V - mesh.V[0], axis=1) + 0.05])
    np.testing.assert_allclose(cells.distance, each.min(axis=0), rtol=1e-12, atol=1e-14)
    np.testing.assert_array_equal(cells.labels, each.argmin(axis=0))
    targets = SurfacePoints(np.arange(mesh.n_faces), np.tile([0.2, 0.5, 0.3], (mesh.n_faces, 1)))
    surface = ExactSurface(intrinsic_triangulation(mesh))
    found = surface.solve(source_set(curve, mesh.n_vertices, mesh.F), targets=targets)
    truth = np.abs(targets.positions(mesh)[:, 0] - 0.43)
    np.testing.assert_allclose(found.target_distance, truth, rtol=1e-12, atol=1e-14)


def test_segments_need_the_faces_of_the_mesh():
    stretched = Mesh(shapes.grid(6).V * [4, 1, 1], shapes.grid(6).F)
    sheared = Mesh(stretched.V + np.outer(stretched.V[:, 0], [0, 0.9, 0]), stretched.F)
    curve = source_set(isolines(sheared, sheared.V[:, 0], 0.43)[0][0], sheared.n_vertices, sheared.F)
    with pytest.raises(ValueError, match="were not flipped"):
        delaunay(sheared).solve(curve)


@pytest.mark.parametrize("source", ["curve", "points", "both, later"])
def test_sweep_is_exact_near_points_and_curves(source):
    mesh = shapes.blob(4)
    curve = isolines(mesh, mesh.V @ [0.3, 0.5, 0.8], 0.4)[0][0]
    points = closest_points(mesh, mesh.V[[40, 900]] + 0.02).points
    h = mesh.edge_lengths.mean()
    # A later source begins within the reach of the earlier one.
    later = [OffsetSources(curve, 3 + 2 * h), OffsetSources(points, 3)]
    given = {"curve": curve, "points": points, "both, later": later}
    sources = given[source]
    exact = GeodesicSolver(mesh, method="exact").voronoi(sources)
    found = SolverChoice("sweep").on(mesh).voronoi(sources)
    near = exact.distance - exact.distance.min() < 5 * h
    assert 50 < near.sum() < mesh.n_vertices / 2
    np.testing.assert_allclose(found.distance[near], exact.distance[near], rtol=1e-12)
    np.testing.assert_array_equal(found.labels[near], exact.labels[near])


def test_curves_are_exact_in_small_components():
    large, small = shapes.blob(4), shapes.icosphere(2)
    curve = isolines(small, small.V @ [0.3, 0.5, 0.8], 0.2)[0][0]
    both = Mesh(np.concatenate([small.V, large.V + 9]), np.concatenate([small.F, large.F + small.n_vertices]))
    found = GeodesicSolver(both, method="exact").distance(curve)
    exact = GeodesicSolver(small, method="exact").distance(curve)
    np.testing.assert_allclose(found[: small.n_vertices], exact, rtol=1e-12)
    assert np.isinf(found[small.n_vertices :]).all()
