"""Directions of shortest paths, and the logarithmic map."""

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed
from surfaces import angle_between, nearest_vertex, on, twice

import heat_igl
from heat_igl import GeodesicSolver, Mesh, SurfacePoints, exp_map, isolines, log_map, shapes, tangent_frames
from heat_igl.mesh import region_boundary
from heat_igl.validation.construction import hull
from heat_igl.windows import ExactSurface, vectors_from


def straight(mesh: Mesh, source: int | SurfacePoints) -> np.ndarray:
    """Mask (n,) of the vertices whose shortest path does not bend."""
    surface = ExactSurface(heat_igl.operators.operators(mesh).surface.unfolding)
    root = surface.solve(on(mesh, source)).origin.root
    return root == (mesh.n_vertices if isinstance(source, SurfacePoints) else source)


@pytest.mark.parametrize("source", [0, 7, 60])
def test_directions_in_the_plane_are_those_of_straight_lines(source):
    mesh = flat_perturbed(shapes.grid(8))
    solver = GeodesicSolver(mesh)
    found, frames = solver.directions(source), tangent_frames(mesh)
    line = mesh.V - mesh.V[source]
    length = np.linalg.norm(line, axis=1)
    others = length > 0
    np.testing.assert_allclose(found.distance, length, atol=1e-12)
    unit = line[others] / length[others, None]
    np.testing.assert_allclose(found.gradient[others], unit, atol=1e-7)
    np.testing.assert_allclose(frames.to_world(frames.from_angles(found.arrival))[others], unit, atol=1e-7)
    np.testing.assert_allclose(found.turning, 0, atol=1e-12)
    np.testing.assert_allclose(exp_map(mesh, source, log_map(solver, source)).positions(mesh), mesh.V, atol=1e-12)
    at_source = [found.departure[source], found.arrival[source], *found.gradient[source]]
    assert at_source == [0] * 5
    assert found.labels[source] == 0


@pytest.mark.parametrize("barycentric", [[0.2, 0.3, 0.5], [0.4, 0.6, 0.0], [0.0, 0.25, 0.75]])
def test_directions_from_a_point_count_from_the_first_side_of_the_face(barycentric):
    mesh = flat_perturbed(shapes.grid(8))
    point = SurfacePoints([61], [barycentric])
    log = log_map(GeodesicSolver(mesh), point)
    a, b, _ = mesh.V[mesh.F[61]]
    x = (b - a) / np.linalg.norm(b - a)
    line = mesh.V - point.positions(mesh)
    np.testing.assert_allclose(log, np.stack([line @ x, line @ np.cross([0, 0, 1], x)], axis=1), atol=1e-12)
    np.testing.assert_allclose(exp_map(mesh, point, log).positions(mesh), mesh.V, atol=1e-12)


def test_a_path_around_a_corner_departs_towards_the_corner_and_turns_there():
    mesh = shapes.grid(8)
    corner = mesh.V[mesh.F].mean(axis=1)[:, :2]
    kept = mesh.F[~(corner > 0.5).all(axis=1)]
    used, F = np.unique(kept, return_inverse=True)
    mesh = Mesh(mesh.V[used], F.reshape(-1, 3))
    tip = nearest_vertex(mesh, [0.5, 0.5, 0])
    source = nearest_vertex(mesh, [1, 0.25, 0])
    behind = (mesh.V[:, 1] > 0.5) & (mesh.V[:, 0] > 0.125)
    solver = GeodesicSolver(mesh)
    found = solver.directions(source)
    line = mesh.V - mesh.V[tip]
    length = np.linalg.norm(line, axis=1)
    np.testing.assert_allclose(found.distance[behind], (length + found.distance[tip])[behind], atol=1e-12)
    np.testing.assert_allclose(found.departure[behind], found.departure[tip], atol=1e-7)
    # From the direction of the source to the corner to that of the corner to the vertex.
    into = mesh.V[tip] - mesh.V[source]
    turn = np.arctan2(line[:, 1], line[:, 0]) - np.arctan2(into[1], into[0])
    np.testing.assert_allclose(angle_between(found.turning, turn)[behind], 0, atol=1e-7)
    assert (found.turning[behind] < -1e-3).sum() > 5
    np.testing.assert_allclose(found.gradient[behind], line[behind] / length[behind, None], atol=1e-7)


@pytest.mark.parametrize("way", ["exact", "solver", "point"])
def test_the_exponential_map_undoes_the_log_map_along_straight_paths(way, cow):
    source = 17
    face = int(np.argmax((source == cow.F).any(axis=1)))
    start = SurfacePoints([face], [[0.2, 0.3, 0.5]]) if way == "point" else source
    log = log_map(GeodesicSolver(cow) if way == "solver" else cow, start)
    is_straight = straight(cow, start)
    assert 0.1 < is_straight.mean() < 0.9
    gap = np.linalg.norm(exp_map(cow, start, log).positions(cow) - cow.V, axis=1)
    diameter = np.hypot(*log.T).max()
    assert (gap[is_straight] < 1e-12 * diameter).all()
    np.testing.assert_allclose(np.hypot(*log.T), heat_igl.geodesic_distance(cow, start, method="exact"), rtol=1e-9)


@pytest.mark.parametrize("seed", [25, 1, 2, 3])
@pytest.mark.parametrize(
    "place",
    [(0, 3e-4, 0.9997), (0, 0.4, 0.6), (1, 0, 0), (0.2, 0.5, 0.3), (0, 1e-11, 1 - 1e-11), (3e-12, 7e-12, 1 - 1e-11)],
)
def test_exp_map_undoes_the_log_map_from_edges_that_were_flipped(seed, place):
    rng = np.random.default_rng(seed)
    P = rng.normal(size=(100, 3))
    # Stretched as much, a hull has thin faces, of which almost all edges are flipped.
    mesh = hull(P / np.linalg.norm(P, axis=1, keepdims=True) * [1, 10, 100])
    start = SurfacePoints([int(rng.integers(mesh.n_faces))], np.array([place]))
    log = log_map(mesh, start, method="exact")
    gap = np.linalg.norm(exp_map(mesh, start, log).positions(mesh) - mesh.V, axis=1)
    assert gap.max() < 1e-9 * np.hypot(*log.T).max()  # on a convex body no path bends


@pytest.mark.parametrize("share", [1e-5, 1e-7, 1e-9])
def test_log_maps_of_the_plane_from_points_beside_a_vertex(share):
    mesh = flat_perturbed(shapes.grid(6))
    for face in np.flatnonzero(~mesh.boundary[mesh.F].any(axis=1))[::5]:
        corners, near = mesh.V[mesh.F[face], :2], face % 3
        weights = np.roll([1 - share, 0.3 * share, 0.7 * share], near)
        offset = np.einsum("c,ncx->nx", weights, mesh.V[:, None, :2] - corners)
        along = corners[1] - corners[0]
        turned = offset @ np.stack([along, [-along[1], along[0]]], axis=1) / np.linalg.norm(along)
        log = log_map(mesh, SurfacePoints([face], [weights]))
        np.testing.assert_allclose(log, turned, atol=1e-12)
        # The direction to the vertex beside the point has as many digits.
        ahead, expected = log[mesh.F[face, near]], turned[mesh.F[face, near]]
        assert abs(ahead[0] * expected[1] - ahead[1] * expected[0]) < 1e-13 * ahead @ expected


@pytest.mark.parametrize("bend", [1e-9, 1e-8, 5e-8])
@pytest.mark.parametrize("vertex", range(1, 21))
def test_a_path_that_hardly_bends_leaves_towards_the_bend(bend, vertex):
    """Around a saddle, from a point in a face: straight on past its vertex, other faces lie there."""
    k, turn = np.arange(20), np.linspace(0, 2 * np.pi, 20, endpoint=False)
    rim = np.stack([np.cos(turn), np.sin(turn), 0.5 * np.sin(2 * turn)], axis=1)
    mesh = Mesh(np.concatenate([np.zeros((1, 3)), rim]), np.stack([0 * k, 1 + k, 1 + (k + 1) % 20], axis=1))
    length = np.linalg.norm(rim, axis=1)
    angle = np.arccos(np.einsum("nx,nx->n", rim, np.roll(rim, -1, axis=0)) / (length * np.roll(length, -1)))
    ends = np.cumsum(angle)
    at = (ends[vertex - 1] - angle[vertex - 1] + np.pi + bend) % ends[-1]
    face = int(np.searchsorted(ends, at))
    before, behind = at - ends[face] + angle[face], ends[face] - at
    weights = 0.5 * np.sin([behind, before]) / np.sin(angle[face]) / length[[face, (face + 1) % 20]]
    log = log_map(mesh, SurfacePoints([face], [[1 - weights.sum(), *weights]]))
    (x, y), (u, v) = log[0], log[vertex]
    assert abs(x * v - y * u) < 1e-14
    np.testing.assert_allclose(np.hypot(u, v), 0.5 + length[vertex - 1], rtol=1e-14)


@pytest.mark.parametrize("share", [1e-5, 1e-8, 1e-9, 1e-10, 3e-11])
@pytest.mark.parametrize("rise", [0.6, -0.6])
def test_log_maps_from_points_beside_the_apex_of_a_cone(share, rise):
    rng, n = np.random.default_rng(1), 40
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False) + rng.uniform(0, 0.1, n)
    # All on one side of the apex, or on both by turns: angles that sum to less than 2 pi, and to more.
    height = rng.uniform(0.3, 1, n) * rise * (1 if rise > 0 else (-1.0) ** np.arange(n))
    rim = np.stack([np.cos(turn), np.sin(turn), height], axis=1)
    k = np.arange(n)
    mesh = Mesh(np.concatenate([np.zeros((1, 3)), rim]), np.stack([0 * k, 1 + k, 1 + (k + 1) % n], axis=1))
    length = np.linalg.norm(rim, axis=1)
    angle = np.arccos(np.einsum("nx,nx->n", rim, np.roll(rim, -1, axis=0)) / (length * np.roll(length, -1)))
    before, whole = np.cumsum(angle) - angle, angle.sum()
    # The point lies on the edge to the first vertex of the rim, around which the cone is laid out.
    before = np.where(before > whole / 2, before - whole, before)
    expected = length * np.exp(1j * before) - share * length[0]
    expected[np.abs(before) > np.pi] = -(length + share * length[0])[np.abs(before) > np.pi]
    log = log_map(mesh, SurfacePoints([0], [[1 - share, share, 0]]))[1:]
    np.testing.assert_allclose(log @ [1, 1j], expected, atol=1e-9)


@pytest.mark.parametrize(
    "mesh",
    [
        perturbed(shapes.torus(12, 40), 0.6),
        perturbed(shapes.cylinder(12, 12), 0.3),
        flat_perturbed(shapes.grid(8)),
        shapes.with_slivers(perturbed(shapes.icosphere(2)), 0),
    ],
)
def test_the_log_map_of_a_mesh_is_that_of_a_solver(mesh):
    """One knows the polar angles of the source alone, and those of its edges that are Delaunay; the other all."""
    solver = GeodesicSolver(mesh, method="exact")
    sources = np.arange(0, mesh.n_vertices, mesh.n_vertices // 12)
    known = [vectors_from(mesh, int(source)) for source in sources]
    assert sum(vectors is not None for vectors in known) > 6
    for source, vectors in zip(sources, known, strict=True):
        expected = log_map(solver, source)
        off = np.linalg.norm(log_map(mesh, source) - expected, axis=1)
        # At the cut locus rounding decides between paths.
        assert (off < 1e-9 * np.hypot(*expected.T).max()).mean() > 0.99
        if vectors is not None:
            np.testing.assert_array_equal(log_map(mesh, source), vectors)


def test_the_log_map_of_a_vertex_needs_its_faces_and_edges():
    grid = shapes.grid(4)
    mesh = Mesh(np.concatenate([grid.V, [[9.0, 9, 9]]]), grid.F)
    assert vectors_from(mesh, 25) is None
    np.testing.assert_array_equal(log_map(mesh, 25), 0)
    np.testing.assert_array_equal(log_map(mesh, 3)[25], 0)
    twice = Mesh(grid.V, np.concatenate([grid.F, grid.F[:1]]))
    np.testing.assert_allclose(log_map(twice, 3), log_map(grid, 3), atol=1e-12)
    pinched = Mesh(np.concatenate([grid.V, grid.V[1:] - 2]), np.concatenate([grid.F, np.where(grid.F, grid.F + 24, 0)]))
    with pytest.raises(heat_igl.MeshError, match="the faces at vertex 0 are not one fan"):
        log_map(pinched, 7)
    turned = Mesh(grid.V, np.concatenate([grid.F[:1, ::-1], grid.F[1:]]))
    with pytest.raises(heat_igl.MeshError, match="has faces that are oriented differently"):
        log_map(turned, 24)


def test_a_point_on_a_side_of_a_triangle_that_is_glued_to_itself():
    """Around the tip of a spike one triangle is left after flips, and two copies of the point lie in it."""
    sphere = shapes.icosphere(2)
    rng = np.random.default_rng(335)
    mesh = Mesh(sphere.V * np.exp(rng.normal(size=(sphere.n_vertices, 1)) * 0.3) * [1, 4, 20], sphere.F)
    unfolding = heat_igl.operators.operators(mesh).surface.unfolding
    side = np.flatnonzero(unfolding.twin // 3 == np.arange(unfolding.twin.size) // 3)
    tips = unfolding.tail(side)
    tips = tips[np.bincount(unfolding.F.ravel())[tips] == 1]
    assert len(tips)
    for tip in tips[:3]:
        for face in np.flatnonzero((tip == mesh.F).any(axis=1)):
            at_tip = 1.0 * (tip == mesh.F[face])
            start = SurfacePoints([face], [0.4 * at_tip + 0.6 * np.roll(at_tip, 1)])
            log = log_map(mesh, start, method="exact")
            gap = np.linalg.norm(exp_map(mesh, start, log).positions(mesh) - mesh.V, axis=1)
            assert gap[straight(mesh, start)].max() < 1e-12 * np.hypot(*log.T).max()


def test_departures_are_those_of_shortest_paths(bunny):
    source, targets = 900, np.arange(0, bunny.n_vertices, 400)
    frames, log = tangent_frames(bunny), log_map(bunny, source, method="exact")
    paths = heat_igl.shortest_paths(bunny, targets, source)
    length = np.array([path.lengths(bunny).sum() for path in paths])
    faces = np.array([path.faces[-1] for path in paths])
    corners = bunny.V[bunny.F[faces]]
    away = np.einsum("pc,pcx->px", [path.start[-1] - path.end[-1] for path in paths], corners)
    corner = (bunny.F[faces] == source).argmax(axis=1)
    found = frames.from_faces(faces, corner, away) @ [1, 1j]
    np.testing.assert_allclose(np.hypot(*log[targets].T), length, rtol=1e-9)
    reached = length > 0
    assert np.abs(np.angle(found[reached] / (log[targets] @ [1, 1j])[reached])).max() < 1e-6


@pytest.mark.slow
def test_directions_and_transport_on_a_large_sphere_are_finite_and_right():
    mesh = shapes.icosphere(8)
    p = mesh.V[0]
    solver = heat_igl.VectorHeatSolver(mesh, method="windows")
    frames = solver.frames
    near = np.flatnonzero((mesh.V @ p > -0.9) & (mesh.V @ p < 1))
    w = frames.to_world([[1.0, 0]], [0])[0]
    carried = solver.transport(0, [1, 0])
    found = GeodesicSolver(mesh, method="exact").directions(0)
    for values in (carried, found.departure, found.arrival, found.gradient, found.distance):
        assert np.isfinite(values).all()
    # Along great circles.
    q = mesh.V[near]
    expected = frames.from_world(w - (q @ w)[:, None] * (p + q) / (1 + q @ p)[:, None], near)
    assert angle_between(*(np.arctan2(*v.T[::-1]) for v in (carried[near], expected))).mean() < np.radians(0.05)
    away = q - (q @ p)[:, None] * p
    departure = np.arctan2(*frames.from_world(away, np.zeros(len(near), int)).T[::-1])
    assert angle_between(found.departure[near], departure).mean() < np.radians(0.1)
    gradient = (q @ p)[:, None] * q - p
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    assert np.einsum("kx,kx->k", found.gradient[near], gradient).min() > 1 - 1e-3


@pytest.mark.parametrize("mesh", [perturbed(shapes.icosphere(3), 0.1), perturbed(shapes.torus(20, 40), 0.2)])
def test_transport_around_a_triangle_of_paths_turns_by_the_excess_of_its_angles(mesh):
    """The theorem of Gauss and Bonnet, for paths that do not bend."""
    solver = heat_igl.VectorHeatSolver(mesh, method="windows")
    rng, found = np.random.default_rng(0), 0
    while found < 4:
        corners = rng.choice(mesh.n_vertices, 3, replace=False)
        following, before = np.roll(corners, -1), np.roll(corners, 1)
        logs = [log_map(mesh, int(corner)) @ [1, 1j] for corner in corners]
        if max(abs(log[to]) for log, to in zip(logs, following, strict=True)) > 1.2 or not all(
            straight(mesh, int(start))[end] for start, end in zip(corners, following, strict=True)
        ):
            continue
        carried = [solver.transport(int(start), [1, 0])[end] for start, end in zip(corners, following, strict=True)]
        turned = np.angle(np.prod([vector @ [1, 1j] for vector in carried]))
        angles = [np.angle(log[b] / log[a]) for log, a, b in zip(logs, following, before, strict=True)]
        # Counterclockwise, all angles at the corners are positive, and clockwise negative.
        assert abs(np.sum(np.sign(angles))) == 3
        excess = np.sum(angles) - np.sign(angles[0]) * np.pi
        assert angle_between(np.array(turned), excess) < 1e-9
        found += 1


def test_labels_and_departures_of_several_sources(sphere):
    sources = [3, 900, 2000]
    solver = GeodesicSolver(sphere)
    together, alone = solver.directions(sources), [solver.directions(source) for source in sources]
    np.testing.assert_array_equal(together.labels, solver.voronoi(sources).labels)
    departure = np.choose(together.labels, [found.departure for found in alone])
    assert np.quantile(angle_between(together.departure, departure), 0.9) < 1e-3


def test_paths_from_a_curve_start_at_the_nearest_place_on_it():
    mesh = flat_perturbed(shapes.grid(8))
    curve = heat_igl.curve_on(mesh, [[0.2, 0.33, 0], [0.8, 0.33, 0]])
    found = GeodesicSolver(mesh).directions([curve, 0])
    assert set(found.labels) == {0, 1}
    place = found.start.positions(mesh)
    of_curve = found.labels == 0
    nearest = np.stack([np.clip(mesh.V[:, 0], 0.2, 0.8), np.full(mesh.n_vertices, 0.33), mesh.V[:, 2]], axis=1)
    np.testing.assert_allclose(place[of_curve], nearest[of_curve], atol=1e-12)
    np.testing.assert_array_equal(place[~of_curve], np.broadcast_to(mesh.V[0], place[~of_curve].shape))
    # The departure counts from the first side of the face of the start.
    a, b = (mesh.V[mesh.F[found.start.faces, k]] for k in (0, 1))
    side = np.arctan2(*(b - a).T[1::-1])
    line = mesh.V - place
    off = angle_between(found.departure + side, np.arctan2(line[:, 1], line[:, 0]))
    assert off[of_curve].max() < 1e-6


@pytest.mark.slow
def test_exact_paths_from_curves_lead_back_to_the_vertices(sphere):
    level, through_vertices = isolines(sphere, sphere.V[:, 2], 0.3)[0], heat_igl.geodesic_path(sphere, [5, 900])
    for sources in (level, through_vertices, [level, SurfacePoints([7], [[0.2, 0.3, 0.5]]), 100]):
        solver = GeodesicSolver(sphere, method="exact")
        found = solver.directions(sources)
        np.testing.assert_array_equal(found.distance, solver.distance(sources))
        np.testing.assert_array_equal(found.labels, solver.voronoi(sources).labels)
        ends = np.array([followed(sphere, found, v) for v in range(0, sphere.n_vertices, 9)])
        off = np.linalg.norm(ends - sphere.V[::9], axis=1)
        # The others bend at vertices.
        assert (off < 1e-12).mean() > 0.5


def test_exact_paths_from_curves_along_edges_lead_back_to_the_vertices():
    mesh = shapes.cylinder(12, 30)
    ring = region_boundary(mesh, faces=mesh.V[mesh.F].mean(axis=1)[:, 2] < np.median(mesh.V[:, 2]))
    found = GeodesicSolver(mesh, method="exact").directions(ring)
    # Paths that start at an end of a segment count their departure around the vertex there.
    ends = np.array([followed(mesh, found, v) for v in np.flatnonzero(found.distance > 0)])
    np.testing.assert_allclose(ends, mesh.V[found.distance > 0], atol=1e-12)


def followed(mesh: Mesh, found: heat_igl.heat.Directions, v: int) -> np.ndarray:
    """Where the geodesic ends that leaves the start of the path to vertex v in the direction of the departure."""
    face, place = int(found.start.faces[v]), found.start.barycentric[v]
    start = int(mesh.F[face, place.argmax()]) if place.max() == 1 else SurfacePoints([face], [place])
    way = found.distance[v] * np.array([np.cos(found.departure[v]), np.sin(found.departure[v])])
    return exp_map(mesh, start, [way]).positions(mesh)[0]


def test_unreachable_vertices_have_no_direction():
    one = shapes.icosphere(1)
    mesh = twice(one)
    found = GeodesicSolver(mesh, method="exact").directions(2)
    far = slice(one.n_vertices, None)
    assert np.isinf(found.distance[far]).all()
    assert (found.labels[far] == -1).all()
    for nothing in (found.gradient, found.departure, log_map(mesh, 2)):
        assert not nothing[far].any()
