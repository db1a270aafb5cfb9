"""Sources of every kind: what they are, exact distances around them, and distance from points, curves and offsets."""

import re

import igl
import numpy as np
import pytest
from conftest import flat_perturbed, mean_error, perturbed
from surfaces import nearest_vertex, sheared, to_polyline, with_point

from heat_igl import (
    GeodesicSolver,
    HeatMethodSolver,
    Mesh,
    OffsetSources,
    SourceError,
    SurfaceCurve,
    SurfacePoints,
    closest_points,
    curve_on,
    edge_curve,
    geodesic_distance,
    isolines,
    reference,
    shapes,
    shortest_path,
)
from heat_igl.geodesic import SolverChoice
from heat_igl.heat.source_terms import SourceTerm
from heat_igl.heat.steps import fitted_laplacian
from heat_igl.operators import edge_length_operators
from heat_igl.sources import Sources, source_set, vertex_sources


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


@pytest.mark.parametrize("method", ["exact", "sweep", "heat"])
def test_offsets_from_which_distances_cannot_be_told_are_refused(method):
    mesh = shapes.grid(8)
    for offset in (1e13, 1e16, 1e300):
        for sources in (OffsetSources(0, offset), OffsetSources([0, 80], [0, offset])):
            with pytest.raises(SourceError, match=re.escape(f"an offset of {offset:.4g} is too large for a mesh")):
                geodesic_distance(mesh, sources, method=method)
    late = geodesic_distance(mesh, OffsetSources(0, 1e9), method=method)
    np.testing.assert_allclose(late - 1e9, geodesic_distance(mesh, 0, method=method), atol=2.4e-7)


# --- Exact distances around sources, which heat takes over: all that is near, with its source, and the own corners


def term(mesh: Mesh, sources: Sources) -> tuple[SourceTerm, float]:
    """What is known beside sources, and the radius up to which all is."""
    solver = HeatMethodSolver(mesh, laplacian="intrinsic-delaunay")
    found = solver._parts.assembler.term(source_set(sources, mesh.n_vertices, mesh.F))
    return found, 6 * solver.operators.mean_edge_length


def sheared_grid() -> Mesh:
    """Flat and convex, but far from Delaunay, and with faces that run either way round."""
    mesh = sheared(flat_perturbed(shapes.grid(40), 0.2), 1.7)
    turned = np.random.default_rng(0).random(mesh.n_faces) < 0.5
    return Mesh(mesh.V, np.where(turned[:, None], mesh.F[:, ::-1], mesh.F))


@pytest.mark.parametrize("barycentric", [(0.2, 0.5, 0.3), (0.3, 0.0, 0.7), (1e-9, 0.4, 0.6 - 1e-9)])
def test_all_that_is_near_a_point_in_the_plane(barycentric):
    mesh = sheared_grid()
    for face in (3, 1201, 2340):
        point = SurfacePoints([face], [barycentric])
        truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
        found, radius = term(mesh, point)
        assert np.array_equal(found.near.vertex, np.flatnonzero(truth <= radius))
        np.testing.assert_allclose(found.near.value, truth[found.near.vertex], rtol=1e-11)


def test_all_that_is_near_a_curve_in_the_plane():
    """A polyline with corners on both sides, and one that begins and ends inside faces."""
    mesh = sheared_grid()
    corners = np.array([[0.5, 0.2, 0], [1.1, 0.33, 0], [1.0, 0.52, 0], [1.9, 0.8, 0]])
    truth = to_polyline(mesh.V, corners)
    found, radius = term(mesh, curve_on(mesh, corners))
    assert np.array_equal(found.near.vertex, np.flatnonzero(truth <= radius))
    np.testing.assert_allclose(found.near.value, truth[found.near.vertex], atol=1e-12)


def test_offsets_and_labels_of_several():
    mesh = sheared_grid()
    faces, offset = np.array([800, 1140, 2300]), np.array([10.0, 10.05, 10.02])
    points = SurfacePoints(faces, np.full((3, 3), 1 / 3))
    found, radius = term(mesh, OffsetSources(points, offset))
    each = np.linalg.norm(mesh.V[:, None] - points.positions(mesh), axis=2)
    nearest = (each + offset).argmin(axis=1)
    at = found.near.vertex
    assert np.array_equal(at, np.flatnonzero(each[np.arange(mesh.n_vertices), nearest] <= radius))
    assert np.array_equal(found.near.label, nearest[at])
    assert set(found.near.label) == {0, 1, 2}
    np.testing.assert_allclose(found.near.value, (each + offset).min(axis=1)[at], rtol=1e-12)


def test_exact_around_curves_on_a_bumpy_surface():
    mesh = perturbed(shapes.icosphere(4), 0.4, 1)
    curve = isolines(mesh, mesh.V @ [0.2, 0.3, 0.9], [0.1])[0]
    found, _ = term(mesh, curve)
    exact = GeodesicSolver(mesh, method="exact").distance(curve)
    assert len(found.near.vertex) > 500
    np.testing.assert_allclose(found.near.value, exact[found.near.vertex], atol=1e-12)


def test_far_corners_of_the_own_face():
    """A face longer than the radius: its corners are told apart, since heat from another source may be nearer."""
    fine = shapes.grid(40)
    tail, head = np.flatnonzero((fine.V[:, 0] == 1) & (abs(fine.V[:, 1] - 0.5125) < 0.02))
    tip = fine.n_vertices
    mesh = Mesh(np.concatenate([fine.V, [[100, 0.5, 0]]]), np.concatenate([fine.F, [[tail, tip, head]]]))
    point = SurfacePoints([fine.n_faces], [[0.5, 0.001, 0.499]])
    found, _ = term(mesh, point)
    truth = np.linalg.norm(mesh.V - point.positions(mesh), axis=1)
    assert found.far.vertex.tolist() == [tip]
    assert set(found.near.vertex) > {tail, head}
    for seeds in (found.near, found.far):
        own = seeds.at(np.isin(seeds.vertex, [tail, head, tip]))
        np.testing.assert_allclose(own.value, truth[own.vertex], rtol=1e-12)


# --- Distance from points in faces, from curves, from sources that begin later, and the cells of the nearest source


@pytest.fixture(params=["heat", "sweep", "exact"])
def method(request):
    return request.param


@pytest.mark.parametrize("name", ["cow", pytest.param("bunny", marks=pytest.mark.slow)])
def test_a_point_in_a_face_is_as_good_a_source_as_a_vertex(name, method, request):
    """As a vertex in the same place, against the exact distance: the corners straight, the rest no worse."""
    mesh = request.getfixturevalue(name)
    solver = SolverChoice(method).on(mesh)
    rng = np.random.default_rng(2)
    of_points, of_vertices = [], []
    for face in rng.choice(mesh.n_faces, 12, p=mesh.measures / mesh.measures.sum()):
        point = SurfacePoints([face], [0.9 * rng.dirichlet(np.ones(3)) + 0.1 / 3])
        corners, n, inserted = mesh.F[face], mesh.n_vertices, with_point(mesh, face, point.barycentric[0])
        distance, truth = solver.distance(point), reference.exact(inserted, n)[:-1]
        straight = np.linalg.norm(mesh.V[corners] - point.positions(mesh), axis=1)
        np.testing.assert_allclose(distance[corners], straight, rtol=1e-9)
        of_points.append(mean_error(distance, truth))
        of_vertices.append(mean_error(SolverChoice(method).on(inserted).distance(n)[:-1], truth))
    # As good on average; what is below the tolerance of the unfolding is chance.
    assert np.mean(of_points) < max(1.05 * np.mean(of_vertices), 4e-5)


def test_near_field_joins_the_far_field(bunny):
    """Across an edge out of the near field distance changes by no more than the length of the edge."""
    solver = HeatMethodSolver(bunny)
    point = SurfacePoints([1234], [[0.2, 0.5, 0.3]])
    distance = solver.distance(point)
    near = solver._parts.assembler.term(solver._source_set(point)).near.vertex
    edges = bunny.edges[np.isin(bunny.edges, near).any(axis=1)]
    assert len(near) > 50
    change = np.abs(distance[edges[:, 0]] - distance[edges[:, 1]])
    assert (change <= np.linalg.norm(bunny.V[edges[:, 0]] - bunny.V[edges[:, 1]], axis=1) * (1 + 1e-9)).all()


@pytest.mark.parametrize("amount", [0.0, 0.2])
def test_a_line_across_the_square(method, amount):
    """Distance is the coordinate across, on both sides; the error falls with the size of the faces."""
    errors = []
    for n in (15, 30, 60):
        mesh = flat_perturbed(shapes.grid(n), amount)
        line = curve_on(mesh, [[0.37, 0, 0], [0.37, 1, 0]])
        distance = SolverChoice(method).on(mesh).distance(line)
        errors.append(np.abs(distance - np.abs(mesh.V[:, 0] - 0.37)).mean())
    if method != "heat":
        assert max(errors) < 1e-4
    else:
        # On faces that repeat, the direction of the heat is right; on others it scatters, by as much on small ones.
        assert errors[0] < 0.003
        assert amount or np.log2(errors[0] / errors[2]) > 1.5


def test_a_circle_around_the_sphere(method):
    """Distance from a circle of latitude is the difference of latitudes."""
    errors = []
    for subdivisions in (2, 3, 4):
        mesh = shapes.icosphere(subdivisions)
        angle = np.linspace(0, 2 * np.pi, 300, endpoint=False)
        circle = np.stack([0.8 * np.cos(angle), 0.8 * np.sin(angle), np.full(300, 0.6)], axis=1)
        distance = SolverChoice(method).on(mesh).distance(curve_on(mesh, circle, closed=True))
        truth = np.abs(np.arcsin(np.clip(mesh.V[:, 2], -1, 1)) - np.arcsin(0.6))
        errors.append(np.abs(distance - truth).mean())
    assert errors[2] < (4e-3 if method != "heat" else 0.02)
    assert np.log2(errors[0] / errors[2]) > (0.9 if method != "exact" else 3)


def test_edges_as_sources_are_nearer_than_their_ends():
    mesh = flat_perturbed(shapes.grid(16), 0.2)
    path = [nearest_vertex(mesh, [x, 0.5, 0]) for x in np.linspace(0, 1, 17)]
    curve = edge_curve(mesh, path)
    solver = HeatMethodSolver(mesh)
    distance = solver.distance(curve)
    assert (distance[path] == 0).all()
    a, b = mesh.V[path[:-1]], mesh.V[path[1:]]
    share = np.clip(np.einsum("nsx,sx->ns", mesh.V[:, None] - a, b - a) / ((b - a) ** 2).sum(axis=1), 0, 1)
    truth = np.linalg.norm(mesh.V[:, None] - a - share[:, :, None] * (b - a), axis=2).min(axis=1)
    ring = (truth > 0) & (truth < 3 / 16)
    np.testing.assert_allclose(distance[ring], truth[ring], rtol=1e-9)
    to_ends = np.linalg.norm(mesh.V[:, None] - mesh.V[path], axis=2).min(axis=1)
    assert (distance < to_ends)[ring].mean() > 0.5


def test_offsets_move_the_border_of_two_cells(method):
    """The exact additively weighted Voronoi edge of the plane, a hyperbola, within one edge length."""
    for mesh in (shapes.grid(40), flat_perturbed(shapes.grid(40), 0.2)):
        solver = SolverChoice(method).on(mesh)
        sources = [nearest_vertex(mesh, [0.25, 0.4, 0]), nearest_vertex(mesh, [0.75, 0.6, 0])]
        each = np.linalg.norm(mesh.V[:, None] - mesh.V[sources], axis=2) + np.array([0, 0.2])
        found = solver.voronoi(OffsetSources(sources, [0, 0.2]))
        # The border is where both are equal; a step towards it changes the difference by at most twice the step.
        wrong = found.labels != each.argmin(axis=1)
        assert (np.abs(each[:, 0] - each[:, 1])[wrong] < 2 * mesh.edge_lengths.mean()).all()
        assert (found.distance[sources] == [0, 0.2]).all()
        assert mean_error(found.distance, each.min(axis=1)) < (0.03 if method == "heat" else 2e-3)


def test_a_vertex_beside_a_point(method):
    """Straight lines from the point end where the vertex is nearer."""
    mesh = flat_perturbed(shapes.grid(20), 0.2)
    vertex = nearest_vertex(mesh, [0.6, 0.5, 0])
    at = mesh.V[vertex] - [0.17, 0.03, 0]
    distance = SolverChoice(method).on(mesh).distance([closest_points(mesh, at).points, vertex])
    truth = np.minimum(np.linalg.norm(mesh.V - at, axis=1), np.linalg.norm(mesh.V - mesh.V[vertex], axis=1))
    near = truth < 0.25
    # A sweep mixes the distances from both in triangles on the border.
    np.testing.assert_allclose(distance[near], truth[near], rtol=0.06 if method == "sweep" else 1e-9)


def test_a_curve_with_an_offset_where_heat_adds_vertices():
    """The distance near curves is that of the vertices of the mesh, which are the first of those of the operators."""
    mesh = perturbed(shapes.torus(12, 9), 0.1)
    solver = HeatMethodSolver(mesh)
    assert solver.operators.n > mesh.n_vertices
    sources = OffsetSources([SurfaceCurve([3], [[1, 0, 0]], [[0, 0.5, 0.5]]), 5], [0.1, 0.2])
    truth = geodesic_distance(mesh, sources)
    assert mean_error(solver.distance(sources), truth) < 0.03


@pytest.mark.parametrize("slope", [0.0, 0.5])
def test_every_vertex_of_a_side_with_an_offset(method, slope):
    """Sources next to one another, each a little later than the one before, do not overtake one another."""
    mesh = shapes.grid(30)
    side = np.flatnonzero(mesh.V[:, 0] == 0)
    offsets = slope * mesh.V[side, 1] + 0.05 * (mesh.V[side, 1] == 1)
    distance = SolverChoice(method).on(mesh).distance(OffsetSources(side, offsets))
    truth = (np.linalg.norm(mesh.V[:, None] - mesh.V[side], axis=2) + offsets).min(axis=1)
    assert (distance[side] == offsets).mean() > 0.9
    # Each triangle of a sweep knows one source, and here every vertex of the front has another.
    assert mean_error(distance, truth) < (0.1 if method == "sweep" else 0.03)


def test_labels_of_several_kinds(method):
    mesh = flat_perturbed(shapes.grid(30), 0.2)
    line = curve_on(mesh, [[0.9, 0, 0], [0.9, 1, 0]])
    points = closest_points(mesh, [[0.1, 0.2, 0], [0.4, 0.8, 0]]).points
    mask = np.zeros(mesh.n_vertices, bool)
    mask[nearest_vertex(mesh, [0.5, 0.2, 0])] = True
    found = SolverChoice(method).on(mesh).voronoi([line, points, mask], cutoff=0.25)
    distances = [np.abs(mesh.V[:, 0] - 0.9)]
    distances += [np.linalg.norm(mesh.V - [*at, 0], axis=1) for at in ((0.1, 0.2), (0.4, 0.8))]
    distances += [np.linalg.norm(mesh.V - mesh.V[mask], axis=1)]
    each = np.stack(distances, axis=1)
    clear = np.sort(each, axis=1)[:, 1] - each.min(axis=1) > 0.1
    assert (
        found.labels[clear & (each.min(axis=1) < 0.22)] == each.argmin(axis=1)[clear & (each.min(axis=1) < 0.22)]
    ).all()
    assert (found.labels[each.min(axis=1) > 0.28] == -1).all()
    assert (np.isinf(found.distance) == (found.labels == -1)).all()


def test_solution_of_a_point_holds_the_three_steps():
    mesh = flat_perturbed(shapes.grid(16), 0.2)
    solver = HeatMethodSolver(mesh)
    point = SurfacePoints([77], [[0.2, 0.3, 0.5]])
    solution = solver.solve(point)
    domain = solver.operators
    initial = domain.M @ solution.heat - solution.t * (fitted_laplacian(domain, solution.t) @ solution.heat)
    # A Dirac: heat of one, with its centre at the point.
    assert initial.sum() == pytest.approx(1)
    np.testing.assert_allclose(initial @ mesh.V, point.positions(mesh)[0], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(solution.direction, axis=1), 1, rtol=1e-12)


def test_the_dirac_of_a_curve_is_its_length():
    """The integral of hat functions along it: as much heat as length, with the curve's centre of mass."""
    mesh = sheared(flat_perturbed(shapes.grid(16), 0.2), 1.7)
    curve = curve_on(mesh, [[0.6, 0.2, 0], [1.0, 0.25, 0], [1.9, 0.8, 0]])
    solver = HeatMethodSolver(mesh)
    assert solver.diagnostics.n_flips > 100
    heat = solver.solve(curve).heat
    initial = solver.operators.M @ heat - solver.t * (fitted_laplacian(solver.operators, solver.t) @ heat)
    lengths, corners = curve.lengths(mesh), curve.positions(mesh)
    centre = lengths @ (corners[1:] + corners[:-1]) / 2 / lengths.sum()
    assert initial.sum() == pytest.approx(lengths.sum() / (4 * solver.diagnostics.mean_edge_length), rel=1e-9)
    np.testing.assert_allclose(initial @ mesh.V / initial.sum(), centre, atol=1e-9)


def from_edge_lengths(F, lengths, method):
    domain = edge_length_operators(F, lengths)
    return HeatMethodSolver(domain, t_coef=0.5) if method == "heat" else GeodesicSolver(domain, method=method)


@pytest.mark.parametrize("name", ["cow", pytest.param("bunny", marks=pytest.mark.slow)])
def test_edge_lengths_alone(name, method, request):
    mesh = request.getfixturevalue(name)
    # With a time step that is asked for, heat is not held to straight lines, for which positions are needed.
    solver = HeatMethodSolver(mesh, t_coef=0.5) if method == "heat" else SolverChoice(method).on(mesh)
    by_lengths = from_edge_lengths(mesh.F, igl.edge_lengths(mesh.V, mesh.F), method)
    if method == "heat":
        assert by_lengths.t == pytest.approx(solver.t, rel=1e-12)
    for sources in (5, [5, 90], SurfacePoints([300], [[0.2, 0.3, 0.5]]), edge_curve(mesh, mesh.edges[700])):
        np.testing.assert_allclose(by_lengths.distance(sources), solver.distance(sources), rtol=1e-9, atol=1e-9)


def test_edge_lengths_of_no_embedding(method):
    """The flat torus fits into no space of three dimensions."""
    torus = shapes.flat_torus(24)
    solver = from_edge_lengths(torus.F, torus.l, method)
    row, column = np.divmod(np.arange(24 * 24), 24)
    truth = np.hypot(*(np.minimum(k, 24 - k) / 24 for k in (row, column)))
    assert mean_error(solver.distance(0), truth) < (0.03 if method == "heat" else 1e-3)


def test_depth_in_a_ball():
    """The surface of a ball as source: distance is the depth below it. Bounds halve the error of a default answer."""
    errors = []
    for n in (5, 10, 20):
        cube = shapes.box(n)
        V = 2 * cube.V - 1
        largest, norm = np.abs(V).max(axis=1), np.linalg.norm(V, axis=1)
        ball = Mesh(V * (largest / np.maximum(norm, 1e-300))[:, None], cube.F)
        depth = 1 - np.linalg.norm(ball.V, axis=1)
        solvers = HeatMethodSolver(ball, magnitude="unit"), HeatMethodSolver(ball)
        errors.append([np.abs(solver.distance(ball.boundary) - depth).mean() for solver in solvers])
    of_the_paper, held = np.transpose(errors)
    assert of_the_paper[2] < 0.005
    assert np.log2(of_the_paper[0] / of_the_paper[2]) > 1
    assert (held < 0.6 * of_the_paper).all()


def test_positions_beside_the_surface_are_its_closest_points(sphere: Mesh) -> None:
    rng = np.random.default_rng(3)
    points = SurfacePoints(rng.integers(sphere.n_faces, size=4), rng.dirichlet(np.ones(3), 4))
    beside = points.positions(sphere) * 1.0001  # along the normals of the sphere, nearly those of the faces
    expected = geodesic_distance(sphere, points)
    assert abs(geodesic_distance(sphere, beside) - expected).max() < 1e-4
    for solver in (GeodesicSolver(sphere, tolerance=0), HeatMethodSolver(sphere)):
        found = solver.distance([OffsetSources(points.positions(sphere)[:2], [0.1, 0.2]), 7])
        places = SurfacePoints(points.faces[:2], points.barycentric[:2])
        np.testing.assert_allclose(found, solver.distance([OffsetSources(places, [0.1, 0.2]), 7]), rtol=1e-9, atol=1e-9)
    one, other = (SurfacePoints(points.faces[[k]], points.barycentric[[k]]) for k in (0, 1))
    path = shortest_path(sphere, *points.positions(sphere)[:2])
    assert path.length == pytest.approx(shortest_path(sphere, one, other).length, rel=1e-9)
