"""The tufted cover: its gluing, the identities of its operators, and distances against graphs with Steiner points."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import perturbed

from heat_igl import HeatMethodSolver, Mesh, SurfacePoints, shapes
from heat_igl.intrinsic import has_nonmanifold_edges, intrinsic_delaunay, intrinsic_triangulation, tufted_cover
from heat_igl.mesh import split_long_edges
from heat_igl.operators import Operators, cotan_operators, intrinsic_operators, operators, tufted_operators
from heat_igl.reference.steiner import graph_distance, steiner_distance


def fan_of_five(longest: float) -> Mesh:
    """Five equilateral triangles on one edge, subdivided."""
    angle = 2 * np.pi * np.arange(5) / 5
    apex = np.stack([np.cos(angle), np.sin(angle), np.full(5, 1 / np.sqrt(3))], axis=1) * np.sqrt(3) / 2
    V = np.concatenate([[[0, 0, 0], [0, 0, 1]], apex])
    return split_long_edges(Mesh(V, [[0, 1, k] for k in range(2, 7)]), longest)


def uneven_book(pages: int, n: int, stretch: float) -> Mesh:
    """A book whose vertices are moved at random within their pages, then pulled along the spine."""
    book = shapes.book(pages, n)
    rng = np.random.default_rng(0)
    r, page = np.hypot(book.V[:, 0], book.V[:, 1]), page_of(book)
    r_new = np.where((r > 1e-9) & (r < 1 - 1e-9), r + rng.uniform(-0.3, 0.3, len(r)) / n, r)
    inner = (book.V[:, 2] > 0) & (book.V[:, 2] < 1)
    z = np.where(inner, book.V[:, 2] + rng.uniform(-0.3, 0.3, len(r)) / n, book.V[:, 2])
    turned = 2 * np.pi * page / pages
    return Mesh(np.stack([r_new * np.cos(turned), r_new * np.sin(turned), stretch * z], axis=1), book.F)


def page_of(book: Mesh, pages: int | None = None):
    x, y = book.V[:, 0], book.V[:, 1]
    if pages is None:
        pages = int(book.facets.n_faces.max())
    return np.round(np.arctan2(y, x) / (2 * np.pi / pages)).astype(int) % pages


def book_distance(book: Mesh, pages: int, sources):
    """Distance (k, n) on flat pages of which any two unfold to a convex domain."""
    r, z, page = np.hypot(book.V[:, 0], book.V[:, 1]), book.V[:, 2], page_of(book, pages)
    on_spine = r < 1e-12
    rows = []
    for source in sources:
        same = (page == page[source]) | on_spine | on_spine[source]
        rows.append(np.hypot(np.where(same, r - r[source], r + r[source]), z - z[source]))
    return np.array(rows)


def doubled_sphere() -> Mesh:
    """Every face twice, the second time the other way round, on triangles that are far from Delaunay."""
    sphere = perturbed(shapes.icosphere(3), 0.3)
    return Mesh(sphere.V * [1.0, 0.6, 0.2], np.concatenate([sphere.F, sphere.F[:, [2, 1, 0]]]))


def finned_sphere() -> Mesh:
    """A sphere with a triangle standing on every tenth edge."""
    sphere = perturbed(shapes.icosphere(3), 0.3)
    edges = sphere.edges[::10]
    tips = 1.1 * sphere.V[edges].mean(axis=1)
    fins = np.column_stack([edges, sphere.n_vertices + np.arange(len(edges))])
    return Mesh(np.concatenate([sphere.V, tips]) * [1.0, 0.6, 0.3], np.concatenate([sphere.F, fins]))


def sample_sources(mesh: Mesh, k: int = 3):
    return np.random.default_rng(0).choice(np.unique(mesh.F), k, replace=False)


def mean_error(distance, truth) -> float:
    away = np.isfinite(truth) & (truth > 0)
    assert (np.isinf(distance) == np.isinf(truth)).all()
    return float(np.mean(np.abs(distance[away] / truth[away] - 1)))


def heat_error(domain: Mesh | Operators, sources, truth, **options) -> float:
    solver = HeatMethodSolver(domain, **options)
    return mean_error(solver.distances(list(sources))[:, : truth.shape[1]], truth)


NONMANIFOLD = {
    "fan of five": lambda: fan_of_five(0.1),
    "stretched book": lambda: uneven_book(3, 8, 6.0),
    "doubled sphere": doubled_sphere,
    "sphere with fins": finned_sphere,
    "unreferenced vertices": lambda: Mesh(
        np.vstack([[[9, 9, 9]], finned_sphere().V, [[8, 8, 8]]]), finned_sphere().F + 1
    ),
}


@pytest.fixture(params=NONMANIFOLD, ids=str)
def mesh(request) -> Mesh:
    return NONMANIFOLD[request.param]()


def assert_closed_and_oriented(cover):
    half_edge = np.arange(cover.F.size)
    assert (cover.twin >= 0).all()
    assert (cover.twin[cover.twin] == half_edge).all()
    assert (cover.twin != half_edge).all()
    assert (cover.tail(half_edge) == cover.head(cover.twin)).all()
    assert (cover.head(half_edge) == cover.tail(cover.twin)).all()
    assert (cover.l.ravel() == cover.l.ravel()[cover.twin]).all()


def test_cover_is_closed_and_oriented(mesh):
    cover = tufted_cover(mesh)
    assert_closed_and_oriented(cover)
    assert cover.areas.sum() == pytest.approx(2 * mesh.measures.sum(), rel=1e-12)
    flipped = intrinsic_delaunay(cover)
    assert_closed_and_oriented(flipped)
    assert flipped.areas.sum() == pytest.approx(2 * mesh.measures.sum(), rel=1e-12)


def test_tufted_operators_satisfy_the_identities_of_the_laplacian(mesh):
    domain = tufted_operators(mesh)
    scale = abs(domain.L).max()
    assert abs(domain.D @ domain.G - domain.L).max() <= 1e-12 * scale
    assert abs(domain.L - domain.L.T).max() <= 1e-12 * scale
    assert np.abs(domain.L @ np.ones(domain.n)).max() <= 1e-12 * scale
    assert np.linalg.eigvalsh(domain.L.toarray())[-1] <= 1e-10 * scale
    assert domain.M.sum() == pytest.approx(mesh.measures.sum(), rel=1e-12)
    assert domain.weights.sum() == pytest.approx(mesh.measures.sum(), rel=1e-12)
    assert (domain.M.diagonal()[mesh.referenced] > 0).all()
    assert (domain.referenced == mesh.referenced).all()
    assert domain.n == mesh.n_vertices


def test_no_weight_is_negative(mesh):
    """Not at edges of many faces and not on the boundary, where without a cover nothing can be flipped."""
    L = tufted_operators(mesh).L.tocoo()
    assert L.data[L.row != L.col].min() >= -1e-7


@pytest.mark.parametrize("name", ["stretched book", "doubled sphere", "sphere with fins"])
def test_without_a_cover_weights_are_negative(name):
    """So that the test above says something."""
    L = intrinsic_operators(intrinsic_delaunay(intrinsic_triangulation(NONMANIFOLD[name]()))).L.tocoo()
    assert L.data[L.row != L.col].min() < -0.01


def test_boundary_and_components_are_those_of_the_mesh(mesh):
    domain = tufted_operators(mesh)
    assert (domain.boundary == mesh.boundary).all()
    together = mesh.components[:, None] == mesh.components
    assert ((domain.components[:, None] == domain.components) == together).all()


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
    sphere = perturbed(shapes.icosphere(3), 0.3)
    sphere = Mesh(sphere.V * [1.0, 0.6, 0.2], sphere.F)
    cover = tufted_cover(sphere)
    side = np.arange(cover.F.size) // (3 * sphere.n_faces)
    assert (side == side[cover.twin]).all()
    own, unflipped = cotan_operators(sphere), intrinsic_operators(cover)
    assert abs(unflipped.L / 2 - own.L).max() <= 1e-12 * abs(own.L).max()
    assert abs(unflipped.M / 2 - own.M).max() <= 1e-12 * abs(own.M).max()

    plain, tufted = operators(sphere), tufted_operators(sphere)
    assert tufted.surface.triangulation.n_flips == 2 * plain.surface.triangulation.n_flips > 100
    # Lengths of flipped edges are rounded in another order on the back.
    assert abs(tufted.L - plain.L).max() <= 1e-9 * abs(plain.L).max()
    t = plain.mean_edge_length**2 / 2
    distance = HeatMethodSolver(sphere, t=t).distance(5)
    np.testing.assert_allclose(HeatMethodSolver(tufted, t=t).distance(5), distance, atol=1e-8)


def test_boundary_is_glued_front_to_back():
    """The cover of a disk is a sphere, the same as a second disk sewn on, seen from the vertices of the first."""
    disk = perturbed(shapes.disk(8), 0.4)
    disk = Mesh(disk.V * [1.0, 0.4, 1.0], disk.F)
    n = disk.n_vertices
    lower = np.where(disk.boundary, np.arange(n), n + np.arange(n))
    pillow = Mesh(np.concatenate([disk.V, disk.V]), np.concatenate([disk.F, lower[disk.F][:, ::-1]]))
    assert_same_as_skin(disk, pillow, np.tile(np.arange(n), 2))


def test_pages_are_glued_to_their_neighbours():
    """The skin of a book of three pages, made by hand: each page twice, a spine of its own in each gap."""
    book = uneven_book(3, 6, 4.0)
    # Without the corners, no inner edge joins two boundary vertices, and vertices tell the copies of an edge apart.
    book = Mesh(book.V, book.F[~book.boundary[book.F].all(axis=1)])
    n, page = book.n_vertices, page_of(book)
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
    assert_same_as_skin(book, skin, np.tile(np.arange(n), 7))


def assert_same_as_skin(mesh: Mesh, skin: Mesh, vertex):
    """The operators of the cover are half of those of a closed manifold whose vertices lie on those of the mesh."""
    assert (skin.facets.n_faces == 2).all()
    domain, doubled = tufted_operators(mesh), operators(skin)
    assert doubled.surface.triangulation.n_flips > 20
    onto = sp.csr_array((np.ones(len(vertex)), (np.arange(len(vertex)), vertex)))
    for ours, theirs in ((domain.L, doubled.L), (domain.M, doubled.M)):
        assert abs(onto.T @ theirs @ onto / 2 - ours).max() <= 1e-9 * abs(ours).max()


def test_order_and_orientation_of_the_faces_do_not_matter():
    mesh = finned_sphere()
    rng = np.random.default_rng(1)
    F = mesh.F[rng.permutation(mesh.n_faces)]
    F[::2] = F[::2, ::-1]
    F = np.take_along_axis(F, (rng.integers(3, size=len(F))[:, None] + np.arange(3)) % 3, axis=1)
    one, other = operators(mesh), operators(Mesh(mesh.V, F))
    assert abs(one.L - other.L).max() <= 1e-9 * abs(one.L).max()
    assert abs(one.M - other.M).max() <= 1e-9 * abs(one.M).max()


def test_paths_are_to_be_unfolded_on_each_face_once():
    domain = operators(finned_sphere())
    assert domain.surface.unfolding.areas.sum() == pytest.approx(domain.weights.sum(), rel=1e-12)
    assert (domain.surface.unfolding.twin == -2).any()


def test_a_face_that_is_there_twice_counts_once():
    """The second copies make every edge one of four faces; without them it is the sphere, to the last bit."""
    doubled = doubled_sphere()
    sphere = Mesh(doubled.V, doubled.F[: doubled.n_faces // 2])
    assert has_nonmanifold_edges(doubled)
    one, other = operators(sphere), operators(doubled)
    assert (one.L != other.L).nnz == 0
    assert (one.M != other.M).nnz == 0
    assert other.surface.uncovered is None

    fins = finned_sphere()
    F = np.concatenate([fins.F, np.roll(fins.F[-5:], 1, axis=1), fins.F[:9, ::-1]])
    assert (operators(Mesh(fins.V, F)).L != operators(fins).L).nnz == 0
    # Two copies and nothing else are a closed surface, as good as any.
    pillow = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 1]])
    assert operators(pillow).weights.sum() == pytest.approx(1)


def test_degenerate_faces_and_edges_of_no_length():
    fan = fan_of_five(0.3)
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


@pytest.mark.parametrize("name", ["fan", "book"])
def test_steiner_graph_against_known_distances(name):
    fan = fan_of_five(0.2) if name == "fan" else shapes.book(5, 6)
    sources = sample_sources(fan)
    truth = book_distance(fan, 5, sources)
    distance = steiner_distance(fan, sources)
    away = truth > 0
    assert (distance[away] / truth[away]).min() >= 1 - 1e-12
    assert mean_error(distance, truth) < 2e-3
    assert mean_error(graph_distance(fan, sources, 1), truth) > 5e-3

    twice = Mesh(fan.V, np.concatenate([fan.F, fan.F[::3, ::-1]]))
    np.testing.assert_allclose(graph_distance(twice, sources, 4), graph_distance(fan, sources, 4), rtol=1e-12)
    with pytest.raises(MemoryError, match="1000 points on each of"):
        graph_distance(fan, sources, 1000)


def test_fan_of_five_triangles():
    fan = fan_of_five(0.04)
    sources = sample_sources(fan, 5)
    assert heat_error(fan, sources, book_distance(fan, 5, sources)) < 0.03


def test_undivided_fan():
    """From each tip the edge leads straight to every other, though the cover glues a triangle to two of the others."""
    fan = fan_of_five(2.0)
    assert fan.n_vertices == 7
    sources = np.arange(2, 7)
    fan = Mesh(fan.V + [[0, 0, 0.2 * (k - 4) * (k > 1)] for k in range(7)], fan.F)
    for shared in (fan, Mesh(fan.V, np.where(np.arange(5)[:, None] % 2, fan.F[:, ::-1], fan.F))):
        distance = HeatMethodSolver(shared).distances(list(sources))
        np.testing.assert_allclose(distance, book_distance(fan, 5, sources), rtol=1e-12, atol=1e-12)


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
    sources = sample_sources(book, 5)
    assert heat_error(book, sources, book_distance(book, pages, sources)) < 0.04
    assert heat_error(cotan_operators(book), sources, book_distance(book, pages, sources)) > 0.3


def test_every_face_twice(cow):
    """Without a remedy no edge of it could be flipped: 5 % then, and 14 % by the paper's method."""
    twice = Mesh(cow.V, np.concatenate([cow.F, cow.F[:, ::-1]]))
    sources = sample_sources(cow)
    truth = graph_distance(cow, sources, 12)
    plain = intrinsic_operators(intrinsic_delaunay(intrinsic_triangulation(twice)))
    once = heat_error(cow, sources, truth)
    assert once < 0.03
    assert heat_error(twice, sources, truth) == once
    # With a time step that is asked for, heat is not compared with windows, which multiply where all edges branch.
    assert heat_error(plain, sources, truth, t_coef=0.5) > 3 * once
    assert heat_error(plain, sources, truth, magnitude="unit") > 0.1
