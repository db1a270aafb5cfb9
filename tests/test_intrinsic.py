from __future__ import annotations

import igl
import numpy as np
import pytest
from conftest import perturbed, zoo

import heat_igl
from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, MeshError, shapes
from heat_igl.intrinsic import (
    Adjacency,
    apex,
    corner_angles,
    from_edge_lengths,
    intrinsic_delaunay,
    intrinsic_triangulation,
    lay_out,
    mollify,
)
from heat_igl.unfolding import exact_distance


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
    assert (opposite | ~triangulation.aligned[inner]).all()


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


def test_no_inner_edge_has_a_negative_weight(cow):
    found = delaunay(cow)
    assert found.areas.sum() == pytest.approx(cow.measures.sum(), rel=1e-13)
    L = igl.cotmatrix_intrinsic(found.l, found.F).tocoo()
    assert L.data[L.row != L.col].min() >= -1e-7
    before = igl.cotmatrix(cow.V, cow.F).tocoo()
    assert before.data[before.row != before.col].min() < -1


def test_delaunay_triangulation_is_left_alone():
    start = intrinsic_triangulation(shapes.icosphere(3))
    assert intrinsic_delaunay(start) is start
    far = Mesh(shapes.grid(20).V + np.array([1e6, 1e6, 0]), shapes.grid(20).F)
    assert delaunay(far).n_flips == 0


@pytest.mark.parametrize("height", [1e-3, 1e-6, 1e-9, 1e-12, 0.0])
def test_needles_and_caps_come_to_an_end(height):
    """Rounding must not make two flips undo each other for ever; area and gluing survive."""
    start = shapes.torus(20, 40)
    rng = np.random.default_rng(0)
    # A vertex close to the middle of an edge of every third face: a cap on one side of it, needles on the other.
    chosen = np.arange(0, start.n_faces, 3)
    corner = start.V[start.F[chosen]]
    weight = np.stack(
        [0.5 - height + 0 * chosen, 0.5 + rng.uniform(0, height, len(chosen)), height + 0 * chosen], axis=1
    )
    added = np.einsum("fc,fck->fk", weight / weight.sum(axis=1, keepdims=True), corner)
    new = start.n_vertices + np.arange(len(chosen))
    a, b, c = start.F[chosen].T
    split = np.concatenate([np.stack(face, axis=1) for face in ((a, b, new), (b, c, new), (c, a, new))])
    mesh = Mesh(np.vstack([start.V, added]), np.vstack([np.delete(start.F, chosen, axis=0), split]))
    found = delaunay(mesh)
    assert_glued(found)
    assert found.n_flips < 3 * mesh.n_faces
    # Lengthening by 1e-8 of an edge opens a flat triangle by the square root of that.
    assert found.areas.sum() == pytest.approx(start.measures.sum(), rel=1e-4)


def test_faces_turned_over_give_the_same_surface(cow):
    F = cow.F.copy()
    F[::3] = F[::3, ::-1]
    mixed = delaunay(Mesh(cow.V, F))
    assert_glued(mixed)
    assert mixed.aligned.all()
    L = igl.cotmatrix_intrinsic(mixed.l, mixed.F)
    plain = delaunay(cow)
    assert abs(L - igl.cotmatrix_intrinsic(plain.l, plain.F)).max() < 1e-9 * abs(L).max()


def test_moebius_strip_keeps_a_seam_and_its_area():
    n = 40
    angle = 2 * np.pi * np.arange(n) / n
    V = []
    for width in (-0.3, -0.1, 0.1, 0.3):
        radius = 1 + width * np.cos(angle / 2)
        V.append(np.stack([radius * np.cos(angle), radius * np.sin(angle), width * np.sin(angle / 2)], axis=1))
    row = np.arange(3)[:, None]
    k = np.arange(n)[None, :]
    last = k == n - 1
    index = lambda r, j: np.where(last & (j == 0), (3 - r) * n, r * n + j)  # noqa: E731
    following = (k + 1) % n
    a, b = row * n + k, index(row, following)
    c, d = (row + 1) * n + k, index(row + 1, following)
    F = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    mesh = perturbed(Mesh(np.concatenate(V), F), 0.4)
    found = delaunay(mesh)
    assert found.n_flips > 0
    assert not found.aligned.all()
    assert_glued(found)
    assert found.areas.sum() == pytest.approx(mesh.measures.sum(), rel=1e-13)


def test_flat_torus_has_no_boundary_and_unit_area():
    torus = shapes.flat_torus(5)
    assert not torus.boundary.any()
    assert torus.areas.sum() == pytest.approx(1)
    assert_glued(torus)


def test_mollification():
    good = np.array([[3.0, 4.0, 5.0]])
    assert mollify(good, np.array([[0, 1, 2]])) == 0
    flat = np.array([[1.0, 1.0, 2.0], [2.0, 2.0, 2.0]])
    added = mollify(flat, np.array([[0, 1, 2], [1, 2, 3]]))
    assert (added > 0).all()
    assert (added < 1e-6).all()
    lengthened = flat + added[:, None]
    assert (lengthened.sum(axis=1) - 2 * lengthened.max(axis=1) > 0).all()


@pytest.mark.parametrize(
    ("l", "message"),
    [
        ([[1.0, 1.0]], r"shape \(1, 2\)"),
        ([[1.0, np.nan, 1.0], [1.0, 1.0, 1.0]], r"l\[0, 1\] = nan"),
        ([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]], r"l\[1, 1\] = -1.0"),
        ([[1.0, 1.0, 1.0], [1.5, 1.0, 1.0]], "edge between faces 0 and 1 two lengths"),
    ],
)
def test_lengths_that_make_no_triangles_are_refused(l, message):
    F = np.array([[0, 1, 2], [3, 2, 1]])
    with pytest.raises(MeshError, match=message):
        from_edge_lengths(l, F, 4)
    assert from_edge_lengths(np.ones((2, 3)), F, 4).areas == pytest.approx([np.sqrt(3) / 4] * 2)


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
    monkeypatch.setattr(heat_igl.intrinsic.mollification, "_MARGIN", mollification)
    rounds = []
    flip = heat_igl.intrinsic.delaunay._Flips.flip

    def counted(self, half_edge):
        rounds.append(len(half_edge))
        if len(rounds) > 1000:
            pytest.fail("flips do not end")
        return flip(self, half_edge)

    monkeypatch.setattr(heat_igl.intrinsic.delaunay._Flips, "flip", counted)
    found = delaunay(with_flat_faces(cow, 0.0, True))
    assert found.n_flips > 1000
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


def test_every_face_behind_the_spine_of_a_book():
    """At the spine each half-edge has those of all other pages behind it, elsewhere its twin or nothing."""
    triangulation = intrinsic_triangulation(shapes.book(4, 3))
    which, other, aligned = Adjacency(triangulation).behind(np.arange(triangulation.F.size))
    tail, head = (
        triangulation.tail(np.arange(triangulation.F.size)),
        triangulation.head(np.arange(triangulation.F.size)),
    )
    pairs = set(zip(which.tolist(), other.tolist(), strict=True))
    ends = np.sort(np.stack([tail, head], axis=1), axis=1).tolist()
    expected = {(a, b) for a in range(len(ends)) for b in range(len(ends)) if a != b and ends[a] == ends[b]}
    assert len(pairs) == len(which)
    assert pairs == expected
    assert (aligned == (tail[which] == head[other])).all()
    assert np.bincount(which).max() == 3


def test_spokes_are_the_edges_at_a_vertex(cow):
    triangulation = intrinsic_triangulation(cow)
    vertices = np.array([11, 5, 700])
    which, ends, lengths = Adjacency(triangulation).spokes(vertices)
    for i, v in enumerate(vertices):
        edges = cow.edges[(cow.edges == v).any(axis=1)]
        assert set(ends[which == i].tolist()) == set(edges[edges != v].tolist())
    np.testing.assert_allclose(lengths, np.linalg.norm(cow.V[vertices[which]] - cow.V[ends], axis=1), rtol=1e-12)


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
        found = made.from_edge_lengths(**given).distance(7)
        assert np.abs(found - truth).max() < bound * truth.max()


def test_a_triangle_rolled_up_to_a_cone():
    """Two of its sides are glued, and the third is a loop at one vertex, the boundary."""
    solver = HeatMethodSolver.from_edge_lengths([[0, 1, 1]], [[1, 3, 3]], twin=[[-1, 2, 1]])
    assert solver.distance(0) == pytest.approx([0, 3])
    assert solver.operators.M.diagonal().sum() == pytest.approx(0.5 * np.sqrt(9 - 0.25))
    exact = GeodesicSolver.from_edge_lengths([[0, 1, 1]], [[1, 3, 3]], twin=[[-1, 2, 1]], method="exact")
    assert exact.distance(1) == pytest.approx([3, 0])


@pytest.mark.parametrize(
    ("twin", "lengths", "message"),
    [
        ([[-1, 2, -1]], [[1, 3, 3]], r"twin\[0, 1\] = 2 is no half-edge .* glued back to 1 \(1 entries"),
        ([[0, 2, 1]], [[1, 3, 3]], r"twin\[0, 0\] = 0 is no half-edge"),
        ([[1, 0, -1]], [[1, 3, 3]], r"twin\[0, 0\] = 1 is no half-edge that ends at the same vertices"),
        ([[-2, 2, 1]], [[1, 3, 3]], r"twin\[0, 0\] = -2 is no half-edge"),
        ([[7, 2, 1]], [[1, 3, 3]], r"twin\[0, 0\] = 7 is no half-edge"),
        ([[-1, 2]], [[1, 3, 3]], r"one integer per side of F, shape \(1, 3\), but it has shape \(1, 2\)"),
        ([[-1.0, 2, 1]], [[1, 3, 3]], "one integer per side of F, .* holds float64"),
        ([[-1, 2, 1]], [[1, 3, 2.5]], "l gives the edge between faces 0 and 0 two lengths"),
    ],
)
def test_refused_gluing(twin, lengths, message):
    with pytest.raises(MeshError, match=message):
        HeatMethodSolver.from_edge_lengths([[0, 1, 1]], lengths, twin=twin)
