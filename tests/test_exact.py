"""Exact distance by windows: closed forms, other people's exact solver, graphs of Steiner points, identities."""

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed, pygeodesic_distance, relative_error, zoo
from scipy.spatial import Delaunay
from surfaces import (
    COORDINATES,
    bumpy,
    graph_distance,
    nearest_vertex,
    on,
    random_disk,
    rough_field,
    rough_star,
    sheared,
    skin,
    two_arms,
)

from heat_igl import AccuracyWarning, GeodesicSolver, Mesh, OffsetSources, SurfacePoints, geodesic_distance, shapes
from heat_igl.intrinsic import HalfEdges, intrinsic_delaunay, intrinsic_triangulation
from heat_igl.sampling import farthest_points
from heat_igl.windows.exact import ExactSurface, exact_distance
from heat_igl.windows.tables import MARGIN, from_mesh


def delaunay(mesh: Mesh) -> ExactSurface:
    return ExactSurface(intrinsic_delaunay(intrinsic_triangulation(mesh)))


def as_given(mesh: Mesh) -> ExactSurface:
    return ExactSurface(intrinsic_triangulation(mesh))


SURFACES = {"given": as_given, "delaunay": delaunay, "from scratch": lambda mesh: ExactSurface(from_mesh(mesh, 0))}


FLAT = {
    "sheared grid": lambda: sheared(shapes.grid(12), 2.3),
    "sheared disk": lambda: sheared(random_disk(500, 3), 3.3),
    "perturbed grid": lambda: flat_perturbed(shapes.grid(15)),
}


def test_windows_are_exact_whatever_the_tolerance():
    mesh = bumpy()
    truth = geodesic_distance(mesh, 3, method="exact")
    for tolerance in (0, 1e-5, 1e-3, 0.5):
        assert np.array_equal(geodesic_distance(mesh, 3, tolerance=tolerance), truth)
        assert np.array_equal(GeodesicSolver(mesh, method="windows", tolerance=tolerance).distance(3), truth)


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("surface", SURFACES)
def test_flat_convex_domains(name, surface):
    mesh = FLAT[name]()
    for source in (0, mesh.n_vertices // 2):
        d = SURFACES[surface](mesh).solve(on(mesh, source)).distance
        np.testing.assert_allclose(d, np.linalg.norm(mesh.V - mesh.V[source], axis=1), rtol=1e-12, atol=1e-14)


def test_windows_that_passed_a_flat_vertex_are_joined():
    """A plane needs hardly more windows than edges, however many vertices it has."""
    mesh = flat_perturbed(shapes.grid(60))
    assert delaunay(mesh).solve(on(mesh, 0)).n_windows < 3 * len(mesh.edges)


@pytest.mark.parametrize("stretch", [1, 1e3, 1e5, 1e7, 1e9])
def test_rolled_out_pyramid(stretch):
    """Around an apex of less than 2 pi shortest paths pass on either side, never through it.

    On a needle lines wound around the apex, and far from it between the long sides, as often as it is long in widths.
    """
    cone, rng = shapes.cone(9, 6), np.random.default_rng(0)
    apex = int(np.argmin(np.linalg.norm(cone.V[:, :2], axis=1)))
    mesh = Mesh(cone.V * [1, 1, stretch], cone.F)
    radius = np.linalg.norm(mesh.V - mesh.V[apex], axis=1)
    turn = np.rint(np.arctan2(*mesh.V[:, 1::-1].T) / (2 * np.pi / 9)).astype(int) % 9
    rim = np.flatnonzero(np.isclose(radius, radius.max()))
    a, b = rim[turn[rim] == 0][0], rim[turn[rim] == 1][0]
    angle = 2 * np.arcsin(np.linalg.norm(mesh.V[a] - mesh.V[b]) / 2 / radius[a])
    points = SurfacePoints(rng.integers(mesh.n_faces, size=5), rng.dirichlet([1, 1, 1], 5))
    places = [(source, radius[source], turn[source]) for source in (int(a), apex, int(np.flatnonzero(turn == 3)[0]))]
    for i, corners in enumerate(mesh.F[points.faces]):
        first = turn[corners[np.argmax(radius[corners])]]
        ahead = radius[corners] * np.exp(1j * angle * ((turn[corners] - first + 4) % 9 - 4))
        places.append((SurfacePoints(points.faces[[i]], points.barycentric[[i]]), points.barycentric[i] @ ahead, first))
    given = intrinsic_triangulation(mesh, MARGIN)
    for source, place, first in places:
        between = np.abs((turn - first) % 9 * angle - np.angle(place))
        between = np.minimum(between, 9 * angle - between)
        away = abs(place)
        truth = np.hypot(radius - away, 2 * np.sqrt(radius * away) * np.sin(between / 2))
        for surface in (ExactSurface(given), ExactSurface(intrinsic_delaunay(given))):
            found = surface.solve(on(mesh, source))
            np.testing.assert_allclose(found.distance, truth, rtol=1e-12, atol=2e-14 * radius.max())
            assert found.n_windows < 12 * len(mesh.edges)


@pytest.mark.parametrize("surface", SURFACES)
def test_paths_bend_at_the_boundary(surface):
    mesh = two_arms(8)
    x, y, _ = mesh.V.T
    is_used = np.bincount(mesh.F.ravel(), minlength=mesh.n_vertices) > 0
    source = nearest_vertex(mesh, [-0.1, 0.4, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        over_the_corner = y[source] - (y - y[source]) / (x - x[source]) * x[source]
    beyond = is_used & (x > 0) & (over_the_corner > 1e-12)
    assert beyond.sum() > 20
    straight = np.linalg.norm(mesh.V - mesh.V[source], axis=1)
    truth = np.where(beyond, np.hypot(x[source], y[source]) + np.hypot(x, y), straight)
    found = SURFACES[surface](mesh).solve(on(mesh, source))
    np.testing.assert_allclose(found.distance, np.where(is_used, truth, np.inf), rtol=1e-12, atol=1e-14)
    corner = int(np.argmin(np.hypot(x, y)))
    strictly = beyond & (over_the_corner > 1e-6) & (y < 0)
    np.testing.assert_array_equal(found.origin.root[strictly], corner)


def of_tetrahedra(n: int, share: float, seed: int | np.random.Generator) -> Mesh:
    """The boundary of some of the tetrahedra of a Delaunay triangulation: up to a dozen faces at an edge."""
    rng = np.random.default_rng(seed)
    P = rng.random((n, 3))
    T = Delaunay(P).simplices
    return skin(P, T[rng.random(len(T)) < share])


# Mollification lengthens edges of degenerate faces in the zoo.
@pytest.mark.parametrize(
    ("made", "least"),
    [*((name, -1e-7) for name in ("voxel blob", "wandering cells", "crossed sheets", "pinched"))]
    + [(of_tetrahedra(40, 0.6, seed), -1e-12) for seed in range(3)],
)
def test_nonmanifold_meshes_against_steiner_points(made, least):
    mesh = zoo(made) if isinstance(made, str) else made
    sources = np.random.default_rng(0).choice(np.unique(mesh.F), 2)
    for source, bound in zip(sources, graph_distance(mesh, sources, 9), strict=True):
        d = exact_distance(mesh.V, mesh.F, int(source))
        there = np.isfinite(d) & (d > 0)
        np.testing.assert_array_equal(np.isfinite(d), np.isfinite(bound))
        excess = bound[there] / d[there] - 1
        assert least < excess.min() <= excess.mean() < 5e-3


@pytest.mark.parametrize(
    ("share", "seed", "source"), [(0.7, 2, 468), (0.7, 2, 565), (0.7838, 30002, 103), (0.7838, 30002, 279)]
)
def test_windows_do_not_multiply_at_edges_of_many_faces(share, seed, source):
    rng = np.random.default_rng(seed)
    mesh = of_tetrahedra(800 if seed == 2 else int(rng.integers(100, 800)), share, rng)
    # Each half-edge holds what is shortest there; on a sphere as rough there are 3 to 5.
    assert ExactSurface(from_mesh(mesh, 0)).solve(on(mesh, source)).n_windows < 10 * mesh.F.size


@pytest.mark.parametrize(
    "name",
    ["pill", "dunes", "gear", "sponge", "plate", "hull of 35", "spiky sphere", "fractal terrain"],
)
def test_surfaces_against_pygeodesic(name):
    mesh = zoo(name)
    for source in np.random.default_rng(5).choice(np.unique(mesh.F), 3, replace=False):
        d = exact_distance(mesh.V, mesh.F, int(source))
        assert relative_error(d, pygeodesic_distance(mesh, int(source))).max() < 1e-10


@pytest.mark.parametrize("make", [rough_star, rough_field])
@pytest.mark.parametrize("surface", SURFACES)
def test_coarse_rough_meshes_against_pygeodesic(make, surface):
    for seed in range(60):
        mesh = make(seed)
        if mesh.report().smallest_angle < 0.1:
            continue  # pygeodesic loses digits at needles
        d = SURFACES[surface](mesh).solve(on(mesh, 3)).distance
        assert relative_error(d, pygeodesic_distance(mesh, 3)).max() < 1e-10, seed


def test_scale_of_a_small_component():
    """Fourth powers of the edges of the small one are no doubles in the unit of the mesh."""
    mesh = bumpy()
    n = mesh.n_vertices
    V, F = np.concatenate([mesh.V, 2.0**-60 * mesh.V]), np.concatenate([mesh.F, mesh.F + n])
    d = exact_distance(mesh.V, mesh.F, 0)
    found = exact_distance(V * 2.0**-198, F, n)
    np.testing.assert_array_equal(found[n:], d * 2.0**-258)


def test_each_goal_ends_the_search_with_its_own_bits():
    """On a rough surface the search must not end at the first path that arrives."""
    mesh = perturbed(shapes.icosphere(3), 0.5, 3)
    surface = delaunay(mesh)
    source = on(mesh, 5)
    some = SurfacePoints(np.arange(0, mesh.n_faces, 9), np.tile([0.2, 0.3, 0.5], (mesh.n_faces // 9 + 1, 1)))
    full = surface.solve(source, targets=some)
    for i in range(len(some)):
        one = SurfacePoints(some.faces[i : i + 1], some.barycentric[i : i + 1])
        found = surface.solve(source, targets=one, goals=np.array([], int))
        np.testing.assert_array_equal(found.target_distance, full.target_distance[i])
    for v in range(0, mesh.n_vertices, 9):
        assert surface.solve(source, goals=np.array([v])).distance[v] == full.distance[v]


@pytest.mark.parametrize("name", FLAT)
@pytest.mark.parametrize("where", COORDINATES)
def test_source_points_and_targets_on_flat_domains(name, where):
    mesh = FLAT[name]()
    rng = np.random.default_rng(0)
    points = SurfacePoints(rng.integers(mesh.n_faces, size=4), [COORDINATES[where]] * 4)
    places = np.tile([COORDINATES[one] for one in COORDINATES], (mesh.n_faces // 3, 1))
    targets = SurfacePoints(rng.integers(mesh.n_faces, size=len(places)), places)
    offsets = np.array([0.0, 0.1, 0.0, 0.3])
    sources = on(mesh, OffsetSources(points, offsets))
    for surface in (as_given(mesh), delaunay(mesh)):
        found = surface.solve(sources, targets=targets)
        d = np.append(found.distance, found.target_distance)
        at = np.concatenate([mesh.V, targets.positions(mesh)])
        truth = np.linalg.norm(at[:, None] - points.positions(mesh), axis=2) + offsets
        np.testing.assert_allclose(d, truth.min(axis=1), rtol=1e-12, atol=1e-12)
        nearest = truth[np.arange(mesh.n_vertices), sources.labels[found.origin.label]]
        np.testing.assert_allclose(nearest, found.distance, rtol=1e-12, atol=1e-12)


def test_points_on_an_edge_of_many_faces():
    """A source and a target on the spine of a book, between its vertices, belong to all pages."""
    mesh = shapes.book(3, 4)
    on_spine = np.hypot(*mesh.V[:, :2].T) < 1e-12
    f, c = np.argwhere((on_spine[mesh.F].sum(axis=1) == 2)[:, None] & ~on_spine[mesh.F])[0]
    barycentric = np.full(3, 0.5)
    barycentric[c] = 0
    point = SurfacePoints([f], [barycentric])
    truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
    surface = as_given(mesh)
    np.testing.assert_allclose(surface.solve(on(mesh, point)).distance, truth, rtol=1e-12)
    for source in (0, 20, mesh.n_vertices - 1):
        back = surface.solve(on(mesh, source), targets=point).target_distance
        np.testing.assert_allclose(back, truth[source], rtol=1e-12)


def test_points_at_a_source_are_at_its_distance():
    """Weights that sum to 1 up to rounding put a target beside the source, and there is no larger distance."""
    mesh = shapes.icosphere(2)
    for face in range(0, mesh.n_faces, 8):
        point = SurfacePoints([face], [np.random.default_rng(face).dirichlet([1, 1, 1])])
        assert geodesic_distance(mesh, point, targets=point) == pytest.approx(0, abs=1e-15)


def test_cutoff_and_goals_end_early_with_the_same_bits():
    mesh = bumpy()
    surface = delaunay(mesh)
    source = on(mesh, 5)
    targets = SurfacePoints(np.arange(0, mesh.n_faces, 7), np.tile([0.2, 0.3, 0.5], (mesh.n_faces // 7 + 1, 1)))
    full = surface.solve(source, targets=targets)
    near = surface.solve(source, targets=targets, cutoff=0.5)
    np.testing.assert_array_equal(near.distance, np.where(full.distance <= 0.5, full.distance, np.inf))
    np.testing.assert_array_equal(
        near.target_distance, np.where(full.target_distance <= 0.5, full.target_distance, np.inf)
    )
    assert near.n_windows < full.n_windows / 5
    goals = np.argsort(full.distance)[[3, 40]]
    some = surface.solve(source, goals=goals)
    np.testing.assert_array_equal(some.distance[goals], full.distance[goals])
    assert some.n_windows < full.n_windows / 5


def test_origins_lead_back():
    """The last part of a path is straight: at its crossing, distance is less by what is left of the path."""
    mesh = bumpy()
    triangulation = intrinsic_triangulation(mesh)
    surface = ExactSurface(triangulation)
    found = surface.solve(on(mesh, 5))
    here = np.flatnonzero(found.origin.entered >= 0)
    assert len(here) > mesh.n_vertices - 20
    face, corner = np.divmod(found.origin.entered[here], 3)
    np.testing.assert_array_equal(mesh.F[face, corner], here)
    share = found.origin.crossing[here] / triangulation.l[face, corner]
    barycentric = np.zeros((len(here), 3))
    barycentric[np.arange(len(here)), (corner + 1) % 3] = 1 - share
    barycentric[np.arange(len(here)), (corner + 2) % 3] = share
    crossings = SurfacePoints(face, np.clip(barycentric, 0, 1))
    left = np.linalg.norm(crossings.positions(mesh) - mesh.V[here], axis=1)
    before = surface.solve(on(mesh, 5), targets=crossings).target_distance
    np.testing.assert_allclose(before + left, found.distance[here], rtol=1e-11)


@pytest.mark.parametrize("seed", [5, 9, 10, 14])
def test_faces_whose_corners_coincide(seed):
    """Distances are those of the surface on which such corners are one vertex, to 1e-10 for each edge crossed."""
    mesh = perturbed(shapes.icosphere(2), 0.5, seed)
    V, one = mesh.V.copy(), np.arange(mesh.n_vertices)
    for face in mesh.F[np.random.default_rng(seed).choice(mesh.n_faces, 4, replace=False)]:
        V[face] = V[face].mean(axis=0)
        one[face] = face[0]
    F = one[mesh.F]
    F = F[(np.diff(F[:, [0, 1, 2, 0]]) != 0).all(axis=1)]
    for source in one[:150:11]:
        np.testing.assert_allclose(exact_distance(V, mesh.F, source), exact_distance(V, F, source)[one], atol=1e-9)


def test_paths_across_needles_are_no_longer_than_in_the_plane():
    """A needle is crossed as it is: made longer by 1e-8, it would be a hundred times as high."""
    height = 1e-6
    V = np.array([[0, 0, 0], [1, 0, 0], [0.5, height, 0], [0.5, 2 * height, 0], [0.5, 1, 0], [0.4, -1, 0]])
    F = np.array([[0, 1, 2], [0, 2, 3], [2, 1, 3], [0, 3, 4], [3, 1, 4], [1, 0, 5]])
    solver = GeodesicSolver((V, F), method="exact")
    for source in (4, 5):
        truth = np.linalg.norm(V - V[source], axis=1)
        np.testing.assert_allclose(exact_distance(V, F, source), truth, rtol=1e-10)
        np.testing.assert_allclose(solver.distance(source), truth, rtol=1e-10)
    point = SurfacePoints([3], [[0.2, 0.3, 0.5]])
    truth = np.linalg.norm(V - point.positions(Mesh(V, F)), axis=1)
    for found in (solver.distance(point), geodesic_distance((V, F), point, method="exact")):
        np.testing.assert_allclose(found, truth, rtol=1e-10)


def test_corners_on_the_line_of_others_lengthen_no_path():
    """At a T-junction; beside edges of 1e4, edges of flat faces that were lengthened first made paths 2e-5 longer."""
    x = np.linspace(0, 1, 6)
    V = np.array([*([a, 0, 0] for a in x), [0.5, -1, 0], [0.5, 1, 0], [1e4, -1e4, 0], [0, -1e4, 0]])
    F = [*([i, i + 1, 7] for i in range(5)), *([0, i + 1, i] for i in range(1, 5)), [0, 6, 5], [6, 9, 8]]
    for faces in (F, [face[:: 1 - 2 * (i % 2)] for i, face in enumerate(F)]):
        for targets in ([7], SurfacePoints([0], [[0, 0, 1]])):
            assert geodesic_distance((V, faces), 6, targets=targets) == pytest.approx(2, rel=1e-12)


def test_compiled_flips_are_those_of_the_triangulation():
    """The intrinsic Delaunay triangulation of points in general position is unique."""
    mesh = sheared(random_disk(300, 1), 2.0)
    edges, exponent = HalfEdges.of_mesh(mesh)
    plain = intrinsic_triangulation(mesh)
    assert exponent == 0
    for found, expected in zip(edges, HalfEdges.of(plain), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-15)
    edges.flip(0.0)
    flipped = intrinsic_delaunay(plain)
    assert flipped.n_flips > 100
    np.testing.assert_allclose(np.sort(edges.length), np.sort(flipped.l.ravel()), rtol=1e-12)
    np.testing.assert_array_equal(edges.length[edges.twin[edges.twin >= 0]], edges.length[edges.twin >= 0])


def test_triangulations_in_which_faces_are_there_twice():
    """Windows would go on in both copies and multiply: this would not end."""
    mesh, rng = shapes.torus(9, 14), np.random.default_rng(0)
    twice = Mesh(mesh.V, np.concatenate([mesh.F, mesh.F[:, [1, 2, 0]], mesh.F[::2]]))
    once, often = delaunay(mesh), delaunay(twice)
    faces, places = rng.integers(mesh.n_faces, size=9), rng.dirichlet(np.ones(3), 9)
    first, second = SurfacePoints(faces, places), SurfacePoints(faces + mesh.n_faces, places[:, [1, 2, 0]])
    for given in (7, first):
        expected = once.solve(on(mesh, given), targets=first)
        for targets in (first, second):
            found = often.solve(on(twice, given), targets=targets)
            np.testing.assert_allclose(found.distance, expected.distance, rtol=1e-13)
            np.testing.assert_allclose(found.target_distance, expected.target_distance, atol=1e-13)
            assert found.n_windows <= 2 * expected.n_windows
    np.testing.assert_allclose(often.solve(on(twice, second)).distance, expected.distance, rtol=1e-13)


def test_straight_past_a_flat_vertex_next_to_the_source():
    """The way over that vertex is as long, to the last digit, as the straight line past it."""
    rng = np.random.default_rng(0)
    faces = [[1, 2, 3], [1, 3, 4], [1, 4, 5], [0, 2, 1], [0, 1, 5], [0, 5, 6], [0, 6, 7], [0, 7, 8], [0, 8, 2]]
    for _ in range(300):
        gap, turn = 10 ** rng.uniform(-12, -6), rng.uniform(0, 2 * np.pi)
        source = rng.uniform(0.3, 0.7, 2)
        angle = turn + np.array([0, -1.3, -0.5, 0.4, 1.2, 2.3, 3.3, 4.2])
        apart = np.concatenate([[gap], rng.uniform(0.3, 0.5, 7)])
        V = np.concatenate([[source], source + apart[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])])
        expected = np.linalg.norm(V - source, axis=1)
        np.testing.assert_allclose(exact_distance(V, faces, 0), expected, rtol=0, atol=1e-12)


def test_a_search_that_would_not_end_is_replaced():
    """Lines wind around the tube, equal to rounding: the search took minutes, and no signal ended it."""
    tube = shapes.cylinder(5, 9)
    tube = Mesh(tube.V * [1, 1, 1e10], tube.F)
    along = np.abs(tube.V[:, 2] - tube.V[7, 2])
    with pytest.warns(AccuracyWarning, match="the search did not end"):
        found = GeodesicSolver(tube, method="exact").distance(7)
    assert found[along > 0] == pytest.approx(along[along > 0], rel=1e-9)
    with pytest.warns(AccuracyWarning, match="the search did not end"):
        farthest = farthest_points(GeodesicSolver(tube, method="exact"), 3, start=7)
    assert (farthest // 5).tolist() == [1, 9, 5]  # of ten rings at equal distances
