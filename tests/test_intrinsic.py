"""Triangles known by edge lengths: flips, refinement, covers and tangent frames."""

import igl
import numpy as np
import pytest
import scipy.sparse as sp
from conftest import flat_perturbed, mean_error, perturbed, zoo
from surfaces import angle_between, moebius_strip, on_pages, pressed, sheared

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, SurfacePoints, geodesic_distance, shapes, tangent_frames
from heat_igl.errors import AccuracyWarning
from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    Moved,
    apex,
    carried_angles,
    closed_cover,
    corner_angles,
    delaunay_refinement,
    each_face_once,
    has_nonmanifold_edges,
    intrinsic_delaunay,
    intrinsic_triangulation,
    lay_out,
    mollify,
    polar_angles,
    transport_angles,
    tufted_cover,
)
from heat_igl.operators import edge_length_operators, intrinsic_operators, operators, tufted_operators
from heat_igl.operators.matrices import edge_paths
from heat_igl.typing import FloatArray, IntArray
from heat_igl.validation.construction import joined
from heat_igl.windows import exact_distance


def delaunay(mesh: Mesh):
    return intrinsic_delaunay(intrinsic_triangulation(mesh))


def assert_glued(triangulation):
    """Twins point at each other, have one length and, on an oriented surface, run opposite ways."""
    inner = np.flatnonzero(triangulation.twin >= 0)
    twin = triangulation.twin[inner]
    assert (triangulation.twin[twin] == inner).all()
    assert (triangulation.l.ravel()[twin] == triangulation.l.ravel()[inner]).all()
    opposite = triangulation.tail(inner) == triangulation.head(twin)
    same_ends = opposite | (triangulation.tail(inner) == triangulation.tail(twin))
    assert same_ends.all()
    # An edge that joins a vertex with itself may be either.
    aligned, is_loop = triangulation.aligned[inner], triangulation.tail(inner) == triangulation.head(inner)
    assert ((opposite == aligned) | is_loop).all()
    assert (triangulation.aligned[twin] == aligned).all()


@pytest.mark.parametrize("name", ["sheared grid by 10", "crumpled", "noise 100 times"])
def test_agrees_with_libigl(name):
    """The intrinsic Delaunay triangulation is unique but for cocircular corners, and those have weight 0."""
    mesh = zoo(name)
    found = delaunay(mesh)
    assert found.n_flips > 0.1 * mesh.n_vertices
    assert_glued(found)
    L, _, _ = igl.intrinsic_delaunay_cotmatrix(mesh.V, mesh.F)
    assert abs(igl.cotmatrix_intrinsic(found.l, found.F) - L).max() <= 1e-8 * abs(L).max()


def test_lengths_of_flipped_edges_in_the_plane():
    """Inside a convex planar domain every edge is straight, so its length is the distance of its ends."""
    mesh = perturbed(shapes.disk(10), 0.3)
    squashed = Mesh(mesh.V * [1.0, 0.25, 0.0], mesh.F)
    found = delaunay(squashed)
    assert found.n_flips > 100
    half_edge = np.arange(len(found.twin))
    ends = squashed.V[found.tail(half_edge)] - squashed.V[found.head(half_edge)]
    np.testing.assert_allclose(found.l.ravel(), np.linalg.norm(ends, axis=1), rtol=1e-12)
    assert_glued(found)


def test_delaunay_triangulation_is_left_alone():
    start = intrinsic_triangulation(shapes.icosphere(3))
    assert intrinsic_delaunay(start) is start
    far = Mesh(shapes.grid(20).V + np.array([1e6, 1e6, 0]), shapes.grid(20).F)
    assert delaunay(far).n_flips == 0


def test_moebius_strip_keeps_a_seam_and_its_area():
    mesh = perturbed(moebius_strip(40, 3), 0.4)
    found = delaunay(mesh)
    assert found.n_flips > 0
    assert not found.aligned.all()
    assert_glued(found)
    assert found.areas.sum() == pytest.approx(mesh.measures.sum(), rel=1e-13)


def test_mollification():
    """All triangles of a component that has a flat one, and none of another, however small it is."""
    small, flat = 1e-9 * np.array([[3.0, 4.0, 5.0]]), np.array([[1.0, 1.0, 2.0], [2.0, 2.0, 2.0]])
    added = mollify(np.concatenate([small, flat]), np.array([[4, 5, 6], [0, 1, 2], [1, 2, 3]]))
    assert not added[0].any()
    assert (added[1:] > 0).all()
    assert (added[1:] < 1e-7).all()
    lengthened = flat + added[1:]
    assert (lengthened.sum(axis=1) - 2 * lengthened.max(axis=1) > 0).all()


def with_flat_faces(mesh: Mesh, share: float, cap: bool) -> Mesh:
    """The same surface with a new vertex at `share` of many edges; with `cap`, one side keeps its face.

    The gap between that face and the two halves on the other side is filled by a face of no area. At share 0 the new
    vertex lies on the end of its edge, and edges have no length.
    """
    rank = np.random.default_rng(0).permutation(len(mesh.edges))
    least = rank[mesh.facets.of_face].min(axis=1)
    wins = np.bincount(mesh.facets.of_face.ravel(), (rank[mesh.facets.of_face] == least[:, None]).ravel())
    chosen = np.flatnonzero((wins == 2) & (mesh.facets.n_faces == 2))
    V = np.concatenate([mesh.V, (1 - share) * mesh.V[mesh.edges[chosen, 0]] + share * mesh.V[mesh.edges[chosen, 1]]])
    new = np.full(len(mesh.edges), -1)
    new[chosen] = mesh.n_vertices + np.arange(len(chosen))
    at = new[mesh.facets.of_face]
    f, c = np.nonzero(at >= 0)
    middle, apex, tail, head = at[f, c], mesh.F[f, c], mesh.F[f, (c + 1) % 3], mesh.F[f, (c + 2) % 3]
    second = np.ones(len(f), bool)
    second[np.unique(middle, return_index=True)[1]] = False
    whole = second & cap
    halves = [np.stack([apex, tail, middle], axis=1)[~whole], np.stack([apex, middle, head], axis=1)[~whole]]
    caps = np.stack([tail, middle, head], axis=1)[whole]
    kept = np.ones(mesh.n_faces, bool)
    kept[f[~whole]] = False
    return Mesh(V, np.concatenate([mesh.F[kept], *halves, caps]))


@pytest.mark.parametrize("cap", [False, True])
@pytest.mark.parametrize("share", [0.0, 1e-12, 1e-8, 1e-4, 0.5])
def test_flat_faces_leave_distances_as_they_are(share, cap):
    """Needles, caps and edges of no length on the same surface: not only finite, but as good as without them."""
    sphere = perturbed(shapes.icosphere(3), 0.2)
    flat = with_flat_faces(sphere, share, cap)
    assert flat.n_vertices > 1.2 * sphere.n_vertices
    t = sphere.edge_lengths.mean() ** 2
    clean = heat_igl.HeatMethodSolver(sphere, t=t).distance(7)
    distance = heat_igl.HeatMethodSolver(flat, t=t).distance(7)[: len(clean)]
    away = clean > 0
    assert np.mean(np.abs(distance[away] / clean[away] - 1)) < (0.02 if share == 0.5 else 0.01)


@pytest.mark.parametrize("mollification", [1e-8, 1e-11, 1e-12])
def test_flips_come_to_an_end_on_flat_faces(cow, monkeypatch, mollification):
    """Rounding makes some flips of flat triangles undo each other; with hardly any mollification, for ever."""
    monkeypatch.setattr(heat_igl.intrinsic.half_edges, "_MARGIN", mollification)
    mesh = with_flat_faces(cow, 0.0, True)
    found = delaunay(mesh)
    assert_glued(found)
    assert 1000 < found.n_flips < 3 * mesh.n_faces
    assert found.areas.sum() == pytest.approx(cow.measures.sum(), rel=1e-6)


@pytest.mark.parametrize("share", [0.0, 1e-10, 1e-6])
def test_flat_faces_far_larger_and_far_smaller_than_the_mean(share):
    """A coarse sphere with needles beside a tiny fine one: faces from 1e-10 to 60 mean edge lengths."""
    coarse = perturbed(shapes.icosphere(1), 0.2)
    fine = shapes.icosphere(4)
    flat = with_flat_faces(coarse, share, cap=True)
    mesh = Mesh(np.concatenate([flat.V, 1e-4 * fine.V]), np.concatenate([flat.F, fine.F + flat.n_vertices]))
    assert mesh.edge_lengths.max() > 50 * mesh.edge_lengths.mean()
    clean = heat_igl.HeatMethodSolver(coarse, t=0.1, laplacian="intrinsic-delaunay").distance(0)
    distance = heat_igl.HeatMethodSolver(mesh, t=0.1).distance(0)[: len(clean)]
    # A vertex in the middle of an edge is one more that distance is known at: that shows next to the source's
    # neighbours, and beyond them in the level, which is taken from all of these.
    ring = np.isin(coarse.F, coarse.F[(coarse.F == 0).any(axis=1)]).any(axis=1)
    beyond = np.setdiff1d(np.arange(len(clean)), coarse.F[ring])
    assert len(beyond) > len(clean) / 2
    assert np.ptp(distance[beyond] - clean[beyond]) < 1e-4
    assert abs(distance[beyond] - clean[beyond]).max() < 0.01 * clean.max()
    assert (distance < clean + 1e-4).all()


def test_corner_angles_of_needles_and_caps():
    """Isosceles triangles: the angle between the equal sides is 2 arcsin(half the base over a side)."""
    base = np.array([1e-12, 1e-6, 1.0, np.sqrt(2), 2 - 2.0**-20, 2 - 2.0**-40])
    angle = corner_angles(np.stack([base, np.ones(6), np.ones(6)], axis=1))
    np.testing.assert_allclose(angle[:4, 0], 2 * np.arcsin(base[:4] / 2), rtol=0, atol=5e-16)
    at_base = np.arctan(np.sqrt((2 - base) * (2 + base)) / base)
    np.testing.assert_allclose(angle[:, 1], at_base, rtol=1e-14)
    np.testing.assert_allclose(angle.sum(axis=1), np.pi, rtol=1e-15)
    np.testing.assert_allclose(
        corner_angles(np.array([[3.0, 4, 5]])), [[np.arctan(3 / 4), np.arctan(4 / 3), np.pi / 2]]
    )


def test_triangles_laid_out_have_their_lengths(bunny):
    lengths = np.concatenate([igl.edge_lengths(bunny.V, bunny.F), [[1e-9, 1, 1], [1, 1, 2]]])
    corners = lay_out(lengths)
    assert (corners[:, 0] == 0).all()
    assert (corners[:, 1, 1] == 0).all()
    assert (corners[:, 2, 1] >= 0).all()
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    np.testing.assert_allclose(np.linalg.norm(sides, axis=2), lengths, rtol=1e-13)
    x, y = apex(*np.array([[3.0], [4], [5]]))
    assert (x.item(), y.item()) == pytest.approx((0, 4))


def test_paths_along_edges_have_each_edge_of_two_triangulations_once(cow):
    given = intrinsic_triangulation(cow)
    flipped = intrinsic_delaunay(given)
    found = list(zip(*edge_paths(flipped, given).around(np.arange(cow.n_vertices)), strict=True))
    triples = [(t.tail(t.edges), t.head(t.edges), t.l.ravel()[t.edges]) for t in (given, flipped)]
    wanted = {triple for a, b, l in triples for triple in [*zip(a, b, l, strict=True), *zip(b, a, l, strict=True)]}
    assert sorted(found) == sorted(wanted)


def steep() -> Mesh:
    """A grid with independent heights, on whose surface flips make edges that join a vertex with itself."""
    flat = shapes.grid(12)
    return Mesh(flat.V + [0, 0, 1] * np.random.default_rng(2).random((flat.n_vertices, 1)) * 5, flat.F)


def test_edge_lengths_and_gluing_of_triangles_that_meet_themselves():
    mesh = steep()
    flipped = intrinsic_delaunay(intrinsic_triangulation(mesh))
    assert (flipped.tail(np.arange(flipped.F.size)) == flipped.head(np.arange(flipped.F.size))).any()
    given = {"F": flipped.F, "lengths": flipped.l, "twin": flipped.twin.reshape(-1, 3)}
    truth = exact_distance(mesh.V, mesh.F, 7)
    for made, bound in ((GeodesicSolver, 1e-10), (HeatMethodSolver, 0.1)):
        found = made(edge_length_operators(**given)).distance(7)
        assert np.abs(found - truth).max() < bound * truth.max()


def test_a_triangle_rolled_up_to_a_cone():
    """Two of its sides are glued, and the third is a loop at one vertex, the boundary."""
    cone = edge_length_operators([[0, 1, 1]], [[1, 3, 3]], twin=[[-1, 2, 1]])
    solver = HeatMethodSolver(cone)
    assert solver.distance(0) == pytest.approx([0, 3])
    assert solver.operators.M.diagonal().sum() == pytest.approx(0.5 * np.sqrt(9 - 0.25))
    assert GeodesicSolver(cone, method="exact").distance(1) == pytest.approx([3, 0])


# --- Intrinsic Delaunay refinement: angles, the surface that stays the same, and points that are carried along


def stretched(scale: float = 12.0) -> Mesh:
    """A long ellipsoid with thin triangles."""
    sphere = shapes.icosphere(2)
    return Mesh(sphere.V * [1, 1, scale], sphere.F)


@pytest.fixture(scope="module")
def coarse():
    return intrinsic_delaunay(intrinsic_triangulation(stretched()))


@pytest.fixture(scope="module")
def fine(coarse):
    return delaunay_refinement(coarse, 5000)


def cone_angles(triangulation: IntrinsicTriangulation) -> FloatArray:
    return np.bincount(triangulation.F.ravel(), corner_angles(triangulation.l).ravel(), triangulation.n)


def test_no_angle_is_small(coarse, fine):
    assert np.degrees(corner_angles(coarse.l)).min() < 15
    assert np.degrees(corner_angles(fine.l)).min() >= 25 - 1e-9
    assert coarse.n < fine.n < 5000


def test_the_surface_stays_the_same(coarse, fine):
    assert fine.areas.sum() == pytest.approx(coarse.areas.sum(), rel=1e-11)
    assert np.abs(cone_angles(fine)[: coarse.n] - cone_angles(coarse)).max() < 1e-9
    assert np.abs(cone_angles(fine)[coarse.n :] - 2 * np.pi).max() < 1e-9
    assert fine.n - len(fine.edges) + len(fine.F) == 2
    assert_closed_and_oriented(fine)


def test_edges_are_delaunay(fine):
    opposite = corner_angles(fine.l).ravel()
    assert (opposite + opposite[fine.twin]).max() < np.pi + 1e-6
    assert delaunay_refinement(fine, 10**6) is fine


def test_radii_and_units(coarse):
    def largest(triangulation):
        return float((triangulation.l.prod(axis=1) / (4 * triangulation.areas)).max())

    bound = 0.2 * largest(coarse)
    small = delaunay_refinement(coarse, 10**5, largest_radius=bound)
    assert 0.5 * bound < largest(small) <= bound
    unit = np.full(len(coarse.F), 4.0)
    again = delaunay_refinement(coarse, 10**5, largest_radius=bound / 4, unit=unit)
    assert np.array_equal(small.F, again.F)


def test_growth_is_bounded(coarse):
    assert delaunay_refinement(coarse, coarse.n + 7).n == coarse.n + 7
    assert delaunay_refinement(coarse, coarse.n) is coarse


def test_a_sharp_cone_keeps_its_angle():
    tetrahedra = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.9, 0], [0.5, 0.3, 20]])
    mesh = Mesh(tetrahedra, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert delaunay_refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)), 10**4).n < 200


def test_closed_cover_is_the_tufted_cover():
    for mesh in (shapes.grid(4), shapes.icosphere(1), shapes.cylinder(5, 7)):
        found, expected = closed_cover(intrinsic_triangulation(mesh)), tufted_cover(mesh)
        assert np.array_equal(found.F, expected.F)
        assert np.array_equal(found.twin, expected.twin)
        assert np.array_equal(found.l, expected.l)


# Points.


def split(refined: Moved, move: int, faces: IntArray, barycentric: FloatArray) -> None:
    """Carry points through one split: solve for coordinates in each of the three faces, take the one that is inside."""
    _, f, g = refined.kind[move]
    new = refined.numbers[move, :3]
    for i in np.flatnonzero(faces == f):
        for c, face in enumerate((f, g, g + 1)):
            corners = np.eye(3)
            corners[c] = new
            found = np.linalg.solve(corners.T, barycentric[i])
            if found.min() >= -1e-12:
                faces[i], barycentric[i] = face, found
                break


def flip(refined: Moved, move: int, faces: IntArray, barycentric: FloatArray) -> None:
    """Carry points through one flip: lay out both triangles beside their edge, and solve in the two new ones."""
    _, ab, ba = refined.kind[move]
    lengths = refined.numbers[move]
    (_, b, p), (_, _, q) = lay_out(lengths[[[2, 1, 0], [4, 3, 0]]])
    place = {"a": np.zeros(2), "b": b, "p": p, "q": q * [1, -1]}
    # The corner opposite the edge comes first.
    before, after = {ab: "pab", ba: "qba"}, {ab: "paq", ba: "qbp"}
    for i in np.flatnonzero((faces == ab // 3) | (faces == ba // 3)):
        old = ab if faces[i] == ab // 3 else ba
        at = np.roll(barycentric[i], -(old % 3)) @ [place[corner] for corner in before[old]]
        for new, corners in after.items():
            found = np.linalg.solve([*np.transpose([place[corner] for corner in corners]), np.ones(3)], [*at, 1])
            if found.min() >= -1e-12:
                faces[i], barycentric[i] = new // 3, np.roll(found, new % 3)
                break


def test_points_are_carried_move_by_move(coarse):
    rng = np.random.default_rng(0)
    refined = delaunay_refinement(coarse, coarse.n + 60).history[-1]
    assert isinstance(refined, Moved)
    (flips,) = coarse.history  # flips alone
    assert len(flips.kind) == coarse.n_flips > 10
    faces = rng.integers(len(coarse.F), size=200)
    barycentric = rng.dirichlet([1, 1, 1], 200)
    for moves in (refined, flips):
        expected_faces, expected = faces.copy(), barycentric.copy()
        for move in range(len(moves.kind)):
            (flip if moves.kind[move, 0] else split)(moves, move, expected_faces, expected)
        found_faces, found = moves.carry(faces, barycentric)
        assert np.array_equal(found_faces, expected_faces)
        assert np.abs(found - expected).max() < 1e-9
    assert (refined.carry(faces, barycentric)[0] >= len(coarse.F)).mean() > 0.1


def test_points_keep_their_distance_from_a_vertex(coarse, fine):
    rng = np.random.default_rng(1)
    faces = rng.integers(len(coarse.F), size=100)
    near = 1e-3
    barycentric = np.array([1.0, 0, 0]) * (1 - near) + near * rng.dirichlet([1, 1, 1], 100)
    before = np.linalg.norm(np.einsum("kc,kcx->kx", barycentric, lay_out(coarse.l[faces])), axis=1)
    vertex = coarse.F[faces, 0]
    faces, barycentric = fine.history[-1].carry(faces, barycentric)
    corners = lay_out(fine.l[faces])
    place = np.einsum("kc,kcx->kx", barycentric, corners)
    at = fine.F[faces] == vertex[:, None]
    assert at.any(axis=1).all()
    after = np.linalg.norm(place - corners[np.arange(100), at.argmax(axis=1)], axis=1)
    assert np.abs(after - before).max() < 1e-9 * before.max()


# The solver on refined triangles: answers are those at the vertices of the mesh.


@pytest.fixture(scope="module")
def refined():
    return HeatMethodSolver(stretched())


def test_answers_are_at_the_vertices_of_the_mesh(refined):
    mesh = stretched()
    assert refined.operators.n > mesh.n_vertices == refined.n_vertices
    truth = geodesic_distance(mesh, 5)
    distance = refined.distance(5)
    assert distance.shape == (mesh.n_vertices,)
    plain = HeatMethodSolver(mesh, laplacian="intrinsic-delaunay")
    assert plain.operators.n == mesh.n_vertices
    assert 0.002 < mean_error(distance, truth) < 0.02


@pytest.mark.parametrize("boundary", ["neumann", "dirichlet", "average"])
def test_a_surface_with_a_boundary(boundary):
    flat = flat_perturbed(shapes.grid(6), 0.18, 3)
    mesh = Mesh(flat.V * [8, 1, 1], flat.F)
    refined = HeatMethodSolver(mesh, boundary=boundary, laplacian="intrinsic-delaunay-refined")
    domain = refined.operators
    assert domain.n > mesh.n_vertices
    assert np.array_equal(domain.boundary[: mesh.n_vertices], mesh.boundary)
    assert not domain.boundary[mesh.n_vertices :].any()
    assert domain.M.sum() == pytest.approx(8, rel=1e-12)
    assert abs(domain.L - domain.D @ domain.G).max() < 1e-12
    inside = int(np.flatnonzero(~mesh.boundary)[7])
    for source in (inside, SurfacePoints([20], [[0.2, 0.3, 0.5]])):
        place = mesh.V[source] if isinstance(source, int) else source.barycentric[0] @ mesh.V[mesh.F[20]]
        truth = np.linalg.norm(mesh.V - place, axis=1)
        assert mean_error(refined.distance(source), truth) < 0.06


def test_paths_are_those_on_the_triangles_of_the_mesh():
    mesh = stretched()
    refined = operators(mesh, "intrinsic-delaunay-refined")
    assert refined.n > mesh.n_vertices
    for method in ("sweep", "exact"):
        found = GeodesicSolver(refined, method=method).distance(0)
        np.testing.assert_allclose(found, GeodesicSolver(mesh, method=method).distance(0), rtol=1e-9, atol=1e-12)


def test_even_meshes_stay_as_they_are():
    for mesh in (shapes.icosphere(3), shapes.torus(16, 40), shapes.grid(20)):
        default, plain = operators(mesh, "auto"), operators(mesh)
        assert abs(default.L - plain.L).max() == 0
        assert abs(default.M - plain.M).max() == 0
        assert default.surface.uncovered is None


def test_an_uneven_part_is_refined_beside_an_even_one():
    sphere, part = shapes.icosphere(4), Mesh(stretched().V / 10, stretched().F)
    mesh = joined(sphere, Mesh(part.V + np.array([0, 40, 0]), part.F))
    refined = HeatMethodSolver(mesh)
    assert mesh.n_vertices < refined.operators.n
    alone = HeatMethodSolver(part)
    assert refined.operators.n - mesh.n_vertices < 1.1 * (alone.operators.n - alone.n_vertices)
    truth = geodesic_distance(part, 7)
    error = mean_error(refined.distance(sphere.n_vertices + 7)[sphere.n_vertices :], truth)
    assert error < 1.5 * mean_error(alone.distance(7), truth)
    # The sphere is as it was.
    near = refined.distance(7)[: sphere.n_vertices] - HeatMethodSolver(sphere).distance(7)
    assert np.abs(near).max() < 1e-9


def test_stray_triangles_are_left_alone():
    needle = Mesh([[0, 40, 0], [1, 40, 0], [0.5, 40 + 1e-3, 0]], [[0, 1, 2]])
    mesh = joined(shapes.icosphere(3), needle)
    assert operators(mesh, "auto").n == mesh.n_vertices


def test_obtuse_triangles_at_the_boundary_take_the_cover():
    mesh = sheared(shapes.grid(20), 3)
    domain = operators(mesh, "auto")
    assert domain.n == mesh.n_vertices
    covered = domain.L.copy()
    covered.setdiag(0)
    assert covered.min() > -1e-9
    plain = operators(mesh).L.copy()
    plain.setdiag(0)
    assert plain.min() < -1
    middle = mesh.n_vertices // 2
    truth = np.linalg.norm(mesh.V - mesh.V[middle], axis=1)
    found = HeatMethodSolver(mesh).distance(middle)
    assert 0.002 < mean_error(found, truth) < 0.03


def test_edge_lengths_alone_are_refined_too():
    mesh = stretched()
    by_lengths = HeatMethodSolver(edge_length_operators(mesh.F, igl.edge_lengths(mesh.V, mesh.F)), t_coef=0.5)
    assert by_lengths.n_vertices == mesh.n_vertices < by_lengths.operators.n
    # With a time step that was asked for, heat is not held to bounds, for which positions are needed.
    assert np.abs(by_lengths.distance(5) - HeatMethodSolver(mesh, t_coef=0.5).distance(5)).max() < 1e-9


# --- The tufted cover: its gluing, the identities of its operators, and distances against graphs with Steiner points


def fan_of_five(halvings: int) -> Mesh:
    """Five equilateral triangles on one edge, each cut into four at the middles of the sides so many times."""
    angle = 2 * np.pi * np.arange(5) / 5
    apex = np.stack([np.cos(angle), np.sin(angle), np.full(5, 1 / np.sqrt(3))], axis=1) * np.sqrt(3) / 2
    mesh = Mesh(np.concatenate([[[0, 0, 0], [0, 0, 1]], apex]), [[0, 1, k] for k in range(2, 7)])
    for _ in range(halvings):
        mesh = mesh.halved()
    return mesh


def uneven_book(pages: int, n: int, stretch: float) -> Mesh:
    """A book whose vertices are moved at random within their pages, then pulled along the spine."""
    book = shapes.book(pages, n)
    rng = np.random.default_rng(0)
    r = np.hypot(book.V[:, 0], book.V[:, 1])
    r_new = np.where((r > 1e-9) & (r < 1 - 1e-9), r + rng.uniform(-0.3, 0.3, len(r)) / n, r)
    inner = (book.V[:, 2] > 0) & (book.V[:, 2] < 1)
    z = np.where(inner, book.V[:, 2] + rng.uniform(-0.3, 0.3, len(r)) / n, book.V[:, 2])
    direction = book.V[:, :2] / np.maximum(r, 1e-9)[:, None]
    return Mesh(np.column_stack([r_new[:, None] * direction, stretch * z]), book.F)


def doubled_sphere() -> Mesh:
    """Every face twice, the second time the other way round."""
    sphere = pressed(0.2)
    return Mesh(sphere.V, np.concatenate([sphere.F, sphere.F[:, [2, 1, 0]]]))


def finned_sphere() -> Mesh:
    """A sphere with a triangle standing on every tenth edge."""
    sphere = pressed(0.3)
    edges = sphere.edges[::10]
    tips = 1.1 * sphere.V[edges].mean(axis=1)
    fins = np.column_stack([edges, sphere.n_vertices + np.arange(len(edges))])
    return Mesh(np.concatenate([sphere.V, tips]), np.concatenate([sphere.F, fins]))


NONMANIFOLD = {
    "fan of five": lambda: fan_of_five(4),
    "stretched book": lambda: uneven_book(3, 8, 6.0),
    "doubled sphere": doubled_sphere,
    "sphere with fins": finned_sphere,
    "unreferenced vertices": lambda: Mesh(np.pad(finned_sphere().V, ((1, 1), (0, 0))), finned_sphere().F + 1),
}


@pytest.fixture(params=NONMANIFOLD, ids=str)
def mesh(request):
    return NONMANIFOLD[request.param]()


def assert_closed_and_oriented(cover):
    assert_glued(cover)
    assert cover.aligned.all()
    assert (cover.twin >= 0).all()
    assert (cover.twin != np.arange(cover.F.size)).all()


def test_cover_is_closed_and_oriented(mesh):
    cover = tufted_cover(mesh)
    assert_closed_and_oriented(cover)
    assert cover.areas.sum() == pytest.approx(2 * mesh.measures.sum(), rel=1e-12)
    flipped = intrinsic_delaunay(cover)
    assert_closed_and_oriented(flipped)
    assert flipped.areas.sum() == pytest.approx(2 * mesh.measures.sum(), rel=1e-12)


def test_tufted_operators_are_those_of_the_mesh_without_negative_weights(mesh):
    """Not at edges of many faces and not on the boundary, where without a cover nothing can be flipped."""
    domain = tufted_operators(mesh)
    assert domain.weights.sum() == pytest.approx(mesh.measures.sum(), rel=1e-12)
    np.testing.assert_array_equal(domain.referenced, mesh.referenced)
    np.testing.assert_array_equal(domain.boundary, mesh.boundary)
    one, other = (components[:, None] == components for components in (domain.components, mesh.components))
    np.testing.assert_array_equal(one, other)
    L = domain.L.tocoo()
    assert L.data[L.row != L.col].min() >= -1e-7


def test_cover_is_used_where_it_is_needed_and_only_there():
    spheres = shapes.icosphere(2)
    shared = int(np.argmin(spheres.V @ spheres.V[0]))
    second = spheres.F + spheres.n_vertices
    second[second == spheres.n_vertices + shared] = 0
    touching = Mesh(np.concatenate([spheres.V, spheres.V + 2 * spheres.V[0]]), np.concatenate([spheres.F, second]))
    assert len(touching.report().nonmanifold_vertices) == 1
    for manifold in (touching, shapes.disk(4), perturbed(shapes.disk(6), 0.4)):
        assert not has_nonmanifold_edges(manifold)
        domain = operators(manifold)
        assert len(domain.surface.triangulation.F) == manifold.n_faces
        assert domain.surface.uncovered is None

    book = shapes.book(3, 4)
    assert has_nonmanifold_edges(book)
    assert len(operators(book).surface.triangulation.F) == 2 * book.n_faces
    assert len(operators(book).surface.unfolding.F) == book.n_faces
    assert len(operators(book, "cotan").surface.triangulation.F) == book.n_faces


def test_closed_manifold_gives_its_own_laplacian():
    """Two copies that meet in the vertices alone: fronts are glued to fronts, and half of both is the mesh."""
    sphere = pressed(0.2)
    cover = tufted_cover(sphere)
    side = np.arange(cover.F.size) // (3 * sphere.n_faces)
    assert (side == side[cover.twin]).all()
    own, unflipped = operators(sphere, "cotan"), intrinsic_operators(cover)
    assert abs(unflipped.L / 2 - own.L).max() <= 1e-12 * abs(own.L).max()
    assert abs(unflipped.M / 2 - own.M).max() <= 1e-12 * abs(own.M).max()

    plain, tufted = operators(sphere), tufted_operators(sphere)
    assert min(tufted.surface.triangulation.n_flips, plain.surface.triangulation.n_flips) > 100
    # Lengths of flipped edges are rounded in another order on the back.
    assert abs(tufted.L - plain.L).max() <= 1e-9 * abs(plain.L).max()
    t = plain.mean_edge_length**2 / 2
    distance = HeatMethodSolver(sphere, t=t).distance(5)
    np.testing.assert_allclose(HeatMethodSolver(tufted, t=t).distance(5), distance, atol=1e-8)


def test_pages_are_glued_to_their_neighbours():
    """The skin of a book of three pages, made by hand: each page twice, a spine of its own in each gap."""
    book = uneven_book(3, 6, 4.0)
    # Without the corners, no inner edge joins two boundary vertices, and vertices tell the copies of an edge apart.
    book = Mesh(book.V, book.F[~book.boundary[book.F].all(axis=1)])
    n, page = book.n_vertices, np.rint(np.arctan2(book.V[:, 1], book.V[:, 0]) * 3 / (2 * np.pi)).astype(int) % 3
    spine = np.hypot(book.V[:, 0], book.V[:, 1]) < 1e-12
    F_page = np.where(spine[book.F], -1, page[book.F]).max(axis=1)
    faces = []
    for gap in range(3):
        # Seen along the spine, gap k is counterclockwise of page k; inner vertices have a copy per side.
        own = np.where(book.boundary, np.arange(n), n * (1 + gap) + np.arange(n))
        own_back = np.where(book.boundary | spine, own, n * (4 + gap) + np.arange(n))
        this, following = book.F[F_page == gap], book.F[F_page == (gap + 1) % 3]
        faces += [own[this], own_back[following][:, ::-1]]
    skin = Mesh(np.tile(book.V, (7, 1)), np.concatenate(faces))
    assert (skin.facets.n_faces == 2).all()
    # The operators of the cover are half of those of a closed manifold whose vertices lie on those of the mesh.
    domain, doubled = tufted_operators(book), operators(skin)
    assert doubled.surface.triangulation.n_flips > 20
    onto = sp.vstack([sp.eye_array(n)] * 7)
    for ours, theirs in ((domain.L, doubled.L), (domain.M, doubled.M)):
        assert abs(onto.T @ theirs @ onto / 2 - ours).max() <= 1e-9 * abs(ours).max()


def test_each_face_once_keeps_the_first_of_each():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [2, 1, 3], [1, 2, 0], [3, 2, 1], [2, 1, 3]])
    once, kept = each_face_once(intrinsic_triangulation(mesh))
    assert kept.tolist() == [0, 1]
    assert once.F.tolist() == [[0, 1, 2], [2, 1, 3]]
    assert_glued(once)
    assert (once.twin >= 0).sum() == 2
    assert each_face_once(once)[0] is once
    # A point stays where it is, by the corners of the face that remains.
    given = np.random.default_rng(0).dirichlet([1, 1, 1], 5)
    faces, places = once.locate(np.arange(5), given)
    np.testing.assert_allclose(
        np.einsum("kc,kcx->kx", places, mesh.V[once.F[faces]]), np.einsum("kc,kcx->kx", given, mesh.V[mesh.F])
    )


def test_a_face_that_is_there_twice_counts_once():
    """The second copies make every edge one of four faces; without them it is the sphere, to the last bit."""
    doubled, sphere = doubled_sphere(), pressed(0.2)
    assert has_nonmanifold_edges(doubled)
    one, other = operators(sphere), operators(doubled)
    assert (one.L != other.L).nnz == 0
    assert (one.M != other.M).nnz == 0
    assert other.surface.uncovered is None
    # A point is as it is given, in the face or in its copy, whose corners run the other way.
    here, there = ([5], [[0.2, 0.3, 0.5]]), ([5 + sphere.n_faces], [[0.5, 0.3, 0.2]])
    expected, solver = HeatMethodSolver(sphere).distance(SurfacePoints(*here)), HeatMethodSolver(doubled)
    for place in (here, there):
        np.testing.assert_allclose(solver.distance(SurfacePoints(*place)), expected, rtol=1e-9)

    fins = finned_sphere()
    F = np.concatenate([fins.F, np.roll(fins.F[-5:], 1, axis=1), fins.F[:9, ::-1]])
    assert (operators(Mesh(fins.V, F)).L != operators(fins).L).nnz == 0
    # Two copies and nothing else are a closed surface, as good as any.
    pillow = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    assert operators(pillow).weights.sum() == pytest.approx(1)


def test_degenerate_faces_and_edges_of_no_length():
    fan = fan_of_five(2)
    a, b = fan.edges[fan.facets.n_faces == 2][0]
    V = np.vstack([fan.V, fan.V[a], fan.V[[a, b]].mean(axis=0)])
    flat = Mesh(V, np.vstack([fan.F, [a, b, len(V) - 2], [a, b, len(V) - 1]]))
    domain = operators(flat)
    assert domain.surface.triangulation.lengthening > 0
    assert np.isfinite(domain.G.data).all()
    assert abs(domain.D @ domain.G - domain.L).max() <= 1e-8 * abs(domain.L).max()
    distance = HeatMethodSolver(flat).distance(0)
    clean = HeatMethodSolver(fan, t=HeatMethodSolver(flat).t).distance(0)
    assert distance[-2] == pytest.approx(distance[a], abs=1e-4)
    assert np.abs(distance[: fan.n_vertices] - clean).max() < 0.02


def test_undivided_fan():
    """From each tip the edge leads straight to every other, though the cover glues a triangle to two of the others."""
    fan = fan_of_five(0)
    sources = np.arange(2, 7)
    fan = Mesh(fan.V + [[0, 0, 0.2 * (k - 4) * (k > 1)] for k in range(7)], fan.F)
    for shared in (fan, Mesh(fan.V, np.where(np.arange(5)[:, None] % 2, fan.F[:, ::-1], fan.F))):
        distance = HeatMethodSolver(shared).distances(list(sources))
        np.testing.assert_allclose(distance, [on_pages(fan.V, s) for s in sources], rtol=1e-12, atol=1e-12)


def test_point_on_an_edge_of_five_faces():
    """It is seen along straight lines from all of them, whichever of them it was given in."""
    book = shapes.book(5, 4)
    spine = np.flatnonzero(np.hypot(*book.V[:, :2].T) == 0)
    for face in np.flatnonzero(np.isin(book.F, spine).sum(axis=1) == 2):
        barycentric = np.where(np.isin(book.F[face], spine), [0.2, 0.3, 0.4], 0.0)
        point = SurfacePoints([face], [barycentric / barycentric.sum()])
        exact = np.linalg.norm(book.V - point.positions(book)[0], axis=1)
        np.testing.assert_allclose(HeatMethodSolver(book).distance(point), exact, rtol=1e-9)


@pytest.mark.parametrize("pages", [3, 5])
def test_stretched_book(pages):
    """Faces at the spine are far from Delaunay, and without a cover their edges there could not be flipped."""
    book = uneven_book(pages, 16, 10.0)
    sources = np.random.default_rng(0).choice(book.n_vertices, 5, replace=False).tolist()
    truth = np.array([on_pages(book.V, source) for source in sources])
    assert mean_error(HeatMethodSolver(book).distances(sources), truth) < 0.04
    with pytest.warns(AccuracyWarning, match="too short on average"):
        uncovered = HeatMethodSolver(book, laplacian="cotan").distances(sources)
    assert mean_error(uncovered, truth) > 0.3


# --- Tangent frames: axes, polar angles, conversions, and the holonomy of transport


@pytest.mark.parametrize("mesh", [shapes.icosphere(2), shapes.torus(12, 20), shapes.grid(4), shapes.cone(7, 3)])
def test_frames_are_orthonormal_and_right_handed(mesh):
    frames = tangent_frames(mesh)
    axes = np.stack([frames.x, frames.y, frames.normal], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-14)
    assert np.linalg.det(axes).min() > 0.99


@pytest.mark.parametrize("mesh", [shapes.grid(5), perturbed(shapes.icosphere(2)), shapes.cylinder(9, 4)])
def test_angles_sum_to_two_pi_and_to_pi_on_the_boundary(mesh):
    angles = tangent_frames(mesh).angles
    np.testing.assert_array_equal(angles.on_boundary, mesh.boundary)
    scaled = np.bincount(mesh.F.ravel(), (angles.scale[mesh.F] * angles.corners).ravel())
    np.testing.assert_allclose(scaled, np.where(mesh.boundary, np.pi, 2 * np.pi))
    # Every vertex has a reference edge, and on the boundary it is the first.
    smallest = np.full(mesh.n_vertices, np.inf)
    np.minimum.at(smallest, mesh.F[:, [1, 2, 0]].ravel(), angles.outgoing)
    np.testing.assert_array_equal(smallest, 0)


def test_flat_frames_are_those_of_the_plane():
    mesh = shapes.grid(5)
    frames = tangent_frames(mesh)
    np.testing.assert_allclose(frames.normal, np.broadcast_to([0, 0, 1], (36, 3)), atol=1e-15)
    # The polar angle of an edge inside is its angle in the plane, up to that of x.
    along = mesh.V[np.roll(mesh.F, -1, axis=1)] - mesh.V[mesh.F]
    leaving = frames.angles.outgoing.reshape(-1, 3)[:, [2, 0, 1]]
    inside = ~mesh.boundary[mesh.F]
    expected = np.arctan2(along[..., 1], along[..., 0]) - np.arctan2(frames.x[:, 1], frames.x[:, 0])[mesh.F]
    assert angle_between(leaving - expected)[inside].max() < 1e-13


def test_conversions_are_inverse_to_each_other(sphere):
    frames = tangent_frames(sphere)
    vectors = np.random.default_rng(0).standard_normal((sphere.n_vertices, 2))
    np.testing.assert_allclose(frames.from_world(frames.to_world(vectors)), vectors, atol=1e-13)
    angles = frames.to_angles(vectors)
    assert angles.min() >= 0
    assert angles.max() < 2 * np.pi
    np.testing.assert_allclose(frames.from_angles(angles, np.hypot(*vectors.T)), vectors, atol=1e-13)


def test_a_vector_along_an_edge_has_its_angle_from_both_faces(sphere):
    frames = tangent_frames(sphere)
    F, V = sphere.F, sphere.V
    faces = np.arange(len(F))
    for c in range(3):
        next_corner, previous = (c + 1) % 3, (c + 2) % 3
        towards = frames.to_angles(frames.from_faces(faces, np.full(len(F), c), V[F[:, next_corner]] - V[F[:, c]]))
        assert angle_between(towards - frames.angles.outgoing.reshape(-1, 3)[:, previous]).max() < 1e-12
        # The other side of the corner leaves from it in the neighbour.
        other = frames.to_angles(frames.from_faces(faces, np.full(len(F), c), V[F[:, previous]] - V[F[:, c]]))
        twin = frames.triangulation.twin.reshape(-1, 3)[:, next_corner]
        assert angle_between(other - frames.angles.outgoing[twin]).max() < 1e-12


def test_flips_keep_the_directions_of_edges():
    mesh = perturbed(shapes.torus(12, 40), 0.6)
    faces = intrinsic_triangulation(mesh)
    flipped = intrinsic_delaunay(faces)
    assert flipped.n_flips > 10
    angles = carried_angles(polar_angles(faces), flipped)
    rho = transport_angles(flipped, angles)
    assert angle_between(rho + rho[flipped.twin]).max() < 1e-12
    # Around a face, the angles of its corners follow one another.
    half_edge = np.arange(flipped.F.size).reshape(-1, 3)
    for c in range(3):
        vertex, out, back = flipped.F[:, c], half_edge[:, (c + 2) % 3], half_edge[:, (c + 1) % 3]
        wide = angles.outgoing[flipped.twin[back]] - angles.outgoing[out]
        assert angle_between(wide - angles.scale[vertex] * angles.corners[:, c]).max() < 1e-11


@pytest.mark.parametrize(("mesh", "characteristic"), [(shapes.icosphere(2), 2), (shapes.torus(12, 30), 0)])
def test_transport_around_vertices_turns_by_the_curvature_enclosed(mesh, characteristic):
    triangulation = intrinsic_triangulation(mesh)
    angles = polar_angles(triangulation)
    rho = transport_angles(triangulation, angles).reshape(-1, 3)
    # A face has the curvature that its corners are scaled by; all together have 2 pi times Euler's characteristic.
    of_face = (angles.scale[mesh.F] * angles.corners).sum(axis=1) - np.pi
    assert of_face.sum() == pytest.approx(2 * np.pi * characteristic, abs=1e-10)
    for v in range(mesh.n_vertices):
        face, corner = np.nonzero(v == mesh.F)
        # The half-edges opposite v are a loop counterclockwise around it.
        turned = rho[face, corner].sum()
        assert angle_between(np.array([turned - of_face[face].sum()])).max() < 1e-11


def test_unused_vertices_have_the_axes_of_space():
    mesh = Mesh(np.vstack([shapes.grid(1).V, [[5, 5, 5]]]), shapes.grid(1).F)
    frames = tangent_frames(mesh)
    np.testing.assert_array_equal([frames.x[4], frames.y[4], frames.normal[4]], np.eye(3))
