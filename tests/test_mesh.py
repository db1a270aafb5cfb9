"""Meshes, their checks, and points and polylines on them: small shapes whose numbers can be worked out by hand."""

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from surfaces import assert_connected, moebius_strip, quads, twice

import heat_igl
from heat_igl import Mesh, MeshError, SourceError, SurfacePoints, closest_points, curve_on, edge_curve, shapes
from heat_igl.mesh import connectivity
from heat_igl.reference import edge_paths
from heat_igl.validation.construction import tetrahedra

TETRAHEDRON_V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TETRAHEDRON_F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def sheet(n: int, m: int) -> Mesh:
    """An n x m grid of unit squares, each cut in two."""
    i, j = np.divmod(np.arange((n + 1) * (m + 1)), m + 1)
    a = np.flatnonzero((i < n) & (j < m))
    F = np.stack([a, a + m + 1, a + m + 2, a, a + m + 2, a + 1], axis=1).reshape(-1, 3)
    return Mesh(np.stack([i, j, 0.1 * i * j], axis=1), F)


def two_tetrahedra() -> Mesh:
    return Mesh(np.concatenate([TETRAHEDRON_V, [[1, 1, 1]]]), [[0, 1, 2, 3], [1, 2, 3, 4]])


# --- Mesh -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("V_type", [list, np.float32, np.float64, np.int64, np.uint8, ">f8", "fortran"])
@pytest.mark.parametrize("F_type", [list, np.int8, np.int32, np.int64, np.uint64, ">i4", "fortran"])
def test_any_kind_of_array_becomes_the_same_mesh(V_type, F_type):
    def converted(array, kind):
        if kind is list:
            return array.tolist()
        return np.asfortranarray(array) if kind == "fortran" else array.astype(kind)

    mesh = Mesh(converted(TETRAHEDRON_V, V_type), converted(TETRAHEDRON_F, F_type))
    for array, dtype, expected in ((mesh.V, np.float64, TETRAHEDRON_V), (mesh.F, np.int64, TETRAHEDRON_F)):
        assert array.dtype == dtype
        assert array.flags.c_contiguous
        assert np.array_equal(array, expected)


def test_mesh_keeps_a_copy_that_nobody_can_write_to():
    V, F = TETRAHEDRON_V.copy(), TETRAHEDRON_F.copy()
    mesh = Mesh(V, F)
    V[0], F[0] = 7, 1
    assert np.array_equal(mesh.V, TETRAHEDRON_V)
    assert np.array_equal(mesh.F, TETRAHEDRON_F)
    names = ("V", "F", "edges", "edge_lengths", "components", "referenced", "boundary", "measures")
    for array in (*(getattr(mesh, name) for name in names), *mesh.facets):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(AttributeError, match="cannot assign to field 'V'"):
        mesh.V = V


@pytest.mark.parametrize("mesh", [sheet(2, 3), two_tetrahedra()], ids=["surface", "solid"])
def test_a_pickled_mesh_comes_back_with_the_same_bits(mesh):
    _ = mesh.edges
    back = pickle.loads(pickle.dumps(mesh))
    assert back.V.tobytes() == mesh.V.tobytes()
    assert np.array_equal(back.F, mesh.F)
    assert not back.V.flags.writeable


def test_measures_do_not_depend_on_orientation():
    mesh = Mesh(TETRAHEDRON_V, TETRAHEDRON_F)
    assert mesh.measures == pytest.approx([0.5, 0.5, 3**0.5 / 2, 0.5], rel=1e-15)
    assert Mesh(TETRAHEDRON_V, TETRAHEDRON_F[:, ::-1]).measures == pytest.approx(mesh.measures, rel=1e-15)
    assert two_tetrahedra().measures == pytest.approx([1 / 6, 1 / 3], rel=1e-15)
    flipped = Mesh(two_tetrahedra().V, two_tetrahedra().F[:, [1, 0, 2, 3]])
    assert flipped.measures == pytest.approx([1 / 6, 1 / 3], rel=1e-15)


def test_edge_lengths_belong_to_edges():
    mesh = two_tetrahedra()
    assert mesh.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3], [2, 4], [3, 4]]
    root = 2**0.5
    assert mesh.edge_lengths == pytest.approx([1, 1, 1, root, root, root, root, root, root], rel=1e-15)


def test_components_boundary_and_referenced():
    a, b = sheet(3, 1), shapes.torus(4, 4)
    V = np.concatenate([a.V, [[9, 9, 9]], b.V])
    mesh = Mesh(V, np.concatenate([a.F, b.F + a.n_vertices + 1]))
    label = mesh.components
    groups = [label[:8], label[8:9], label[9:]]
    assert [len(np.unique(group)) for group in groups] == [1, 1, 1]
    assert len(np.unique(label)) == 3
    assert np.flatnonzero(~mesh.referenced).tolist() == [8]
    assert mesh.boundary.tolist() == [True] * 8 + [False] * 17
    assert np.flatnonzero(~sheet(3, 2).boundary).tolist() == [4, 7]
    assert two_tetrahedra().boundary.all()


def test_longest_distance():
    strip = Mesh([[i, j, 0] for i in range(101) for j in range(2)], sheet(100, 1).F)
    assert strip.longest_distance == pytest.approx(99 + 2**0.5, rel=1e-14)
    # Also when the search starts in the middle of the strip.
    middle = Mesh(np.roll(strip.V, -101, axis=0), (strip.F - 101) % 202)
    assert middle.longest_distance == pytest.approx(101, rel=1e-14)  # between the corners that no diagonal helps
    # The larger of two components counts, however the vertices are numbered.
    V = np.concatenate([strip.V * 3, strip.V])
    for F in (np.concatenate([strip.F, strip.F + 202]), np.concatenate([strip.F + 202, strip.F])):
        assert Mesh(V, F).longest_distance == pytest.approx(3 * (99 + 2**0.5), rel=1e-14)


# --- MeshReport -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mesh", "euler", "loops"),
    [
        (Mesh(TETRAHEDRON_V, TETRAHEDRON_F), 2, 0),
        (sheet(3, 4), 1, 1),
        (shapes.cylinder(5, 2), 0, 2),
        (moebius_strip(5, 3), 0, 1),
        (shapes.torus(5, 4), 0, 0),
        (Mesh(TETRAHEDRON_V, [[0, 1, 2, 3]]), 1, 1),
        (two_tetrahedra(), 1, 1),
    ],
    ids=["sphere", "disk", "cylinder", "moebius", "torus", "tetrahedron", "two tetrahedra"],
)
def test_report_counts_boundary_loops_and_the_euler_characteristic(mesh, euler, loops):
    report = mesh.report()
    assert (report.euler_characteristic, report.n_boundary_loops, report.n_components) == (euler, loops, 1)
    assert (report.n_vertices, report.n_faces, report.n_edges) == (mesh.n_vertices, mesh.n_faces, len(mesh.edges))
    for name in ("nonmanifold_edges", "nonmanifold_vertices", "duplicate_faces", "unreferenced_vertices"):
        assert len(getattr(report, name)) == 0


def test_report_lists_what_is_wrong():
    flat = sheet(2, 2).V
    V = np.concatenate([flat, [[5, 5, 5], [0.5, 0.0, 0.05], [0, 0, 9]]])
    V[10] = (V[0] + V[3]) / 2  # on the edge between vertices 0 and 3
    F = np.concatenate([sheet(2, 2).F, [[4, 3, 0], [0, 10, 3], [0, 3, 11]]])
    report = Mesh(V, F).report()
    assert report.duplicate_faces.tolist() == [8]
    assert report.degenerate_faces.tolist() == [9]
    assert report.unreferenced_vertices.tolist() == [9]
    assert report.nonmanifold_edges.tolist() == [[0, 3], [0, 4], [3, 4]]
    assert report.nonmanifold_vertices.tolist() == [0, 3, 4]
    assert report.n_components == 1
    assert report.smallest_angle == pytest.approx(0, abs=1e-5)
    assert report.largest_angle == pytest.approx(180, abs=1e-5)
    clean = sheet(2, 2).report()
    assert [len(clean.duplicate_faces), len(clean.degenerate_faces), len(clean.unreferenced_vertices)] == [0, 0, 0]


@pytest.mark.parametrize(("height", "degenerate"), [(0, [0]), (1e-13, [0]), (1e-9, [])])
@pytest.mark.parametrize("scale", [1e-20, 1, 1e20])
def test_degenerate_means_flat_to_rounding(height, degenerate, scale):
    V = scale * np.array([[0, 0, 0], [1, 0, 0], [0.5, height, 0], [0, 1, 0]])
    assert Mesh(V, [[0, 1, 2], [0, 1, 3]]).report().degenerate_faces.tolist() == degenerate


def test_report_measures_lengths_angles_and_range():
    strip = Mesh([[i, j, 0] for i in range(11) for j in range(2)], sheet(10, 1).F)
    report = strip.report()
    lengths = np.array([1.0] * 20 + [1.0] * 11 + [2**0.5] * 10)
    assert (report.shortest_edge, report.longest_edge) == pytest.approx((1, 2**0.5), rel=1e-15)
    assert report.mean_edge == pytest.approx(lengths.mean(), rel=1e-15)
    assert (report.smallest_angle, report.largest_angle) == pytest.approx((45, 90), rel=1e-12)
    assert report.edges_across == pytest.approx((9 + 2**0.5) / lengths.mean(), rel=1e-14)
    assert report.range_limit == heat_igl.runtime.RANGE_LIMIT
    assert report.is_intrinsic_delaunay is True
    sheared = Mesh(strip.V + strip.V[:, 1:2] * [[-2, 0, 0]], strip.F).report()
    assert sheared.is_intrinsic_delaunay is False
    assert two_tetrahedra().report().is_intrinsic_delaunay is None


# --- connectivity -----------------------------------------------------------------------------------------------------


def nonmanifold_vertices(F: np.ndarray, n: int) -> list[int]:
    return connectivity.nonmanifold_vertices(F, connectivity.facets(F, n), n).tolist()


FACES = st.integers(4, 9).flatmap(
    lambda n: st.tuples(
        st.just(n),
        st.lists(st.permutations(range(n)).map(lambda order: order[:3]), min_size=1, max_size=14),
    )
)


@settings(max_examples=100, deadline=None)
@given(FACES)
def test_edges_facets_and_components_against_sets(given_faces):
    n, faces = given_faces
    F = np.array(faces, np.int64)
    holders = {}
    for face in faces:
        for pair in itertools.combinations(sorted(face), 2):
            holders[pair] = holders.get(pair, 0) + 1
    assert [tuple(row) for row in connectivity.edge_middles(F, n)[0].tolist()] == sorted(holders)
    found = connectivity.facets(F, n)
    assert dict(zip(map(tuple, found.vertices.tolist()), found.n_faces.tolist(), strict=True)) == holders
    for face, row in zip(faces, found.of_face.tolist(), strict=True):
        for corner, facet in enumerate(row):
            assert set(found.vertices[facet].tolist()) == set(face) - {face[corner]}
    label = connectivity.connected_components(F, n)
    for a, b in holders:
        assert label[a] == label[b]
    groups = [{v} for v in range(n)]
    for face in faces:
        joined = set().union(*(group for group in groups if group & set(face)))
        groups = [group for group in groups if not group & set(face)] + [joined]
    assert len(np.unique(label)) == len(groups)
    seen = set()
    repeated = [i for i, face in enumerate(faces) if frozenset(face) in seen or seen.add(frozenset(face))]
    assert connectivity.duplicate_faces(F, n).tolist() == repeated


@settings(max_examples=150, deadline=None)
@given(FACES)
def test_nonmanifold_vertices_against_links(given_faces):
    """A vertex is manifold when its faces hang together around it and each edge at it has at most two faces."""
    n, faces = given_faces
    bad = []
    for v in range(n):
        link = [set(face) - {v} for face in faces if v in face]
        crowded = any(sum(w in edge for edge in link) > 2 for w in range(n))
        pieces = []
        for edge in link:
            touching = [piece for piece in pieces if piece & edge]
            pieces = [piece for piece in pieces if not piece & edge] + [edge.union(*touching)]
        # An edge of more than two faces makes its far end bad as well.
        if crowded or len(pieces) > 1:
            bad.append(v)
    assert nonmanifold_vertices(np.array(faces, np.int64), n) == bad


@pytest.mark.parametrize("n", [4, 10**6])
@pytest.mark.parametrize("columns", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 200])
def test_unique_rows_are_those_of_numpy(n, columns, count):
    rows = np.random.default_rng(31).integers(0, 4, (count, columns)) * (n // 4)
    first, inverse, counts = connectivity.unique_rows(rows, n)
    expected, expected_first, expected_counts = np.unique(rows, axis=0, return_index=True, return_counts=True)
    assert np.array_equal(rows[first], expected)
    assert np.array_equal(first, expected_first)
    assert np.array_equal(counts, expected_counts)
    assert np.array_equal(rows[first][inverse], rows)


def test_longest_path_with_loops_and_repeated_edges():
    """A path of three edges and one of two; the repeated edge counts once, with its shorter length."""
    edges = np.array([[1, 0], [1, 2], [2, 1], [3, 2], [2, 2], [4, 5], [6, 5]])
    lengths = np.array([1.0, 9, 2, 3, 50, 2, 3.5])
    graph = connectivity.shortest_edge_graph(edges, lengths, 7)
    assert connectivity.longest_paths(graph, np.array([0, 0, 0, 0, 1, 1, 1])).max() == 6
    alone = connectivity.shortest_edge_graph(edges[5:], lengths[5:], 7)
    assert connectivity.longest_paths(alone, np.array([0, 1, 2, 3, 4, 4, 4])).max() == 5.5


def test_facets_of_tetrahedra_are_opposite_their_corner():
    found = connectivity.facets(two_tetrahedra().F, 5)
    assert found.vertices[found.n_faces == 2].tolist() == [[1, 2, 3]]
    assert found.vertices[found.of_face[0]].tolist() == [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]
    assert len(found.vertices) == 7


def test_distance_along_edges_of_length_zero():
    """Two vertices in one place are at distance 0 from each other, however the edge between them is stored."""
    mesh = Mesh([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], [[0, 1, 2], [1, 0, 3]])
    assert edge_paths(mesh, 0).tolist() == [0, 0, 1, 2, np.inf]
    assert edge_paths(mesh, [2, 3]).tolist() == [1, 1, 0, 0, np.inf]
    assert edge_paths(mesh, 2, count_edges=True).tolist() == [1, 1, 0, 2, np.inf]


@pytest.mark.parametrize("count", [0, 1, 300])
def test_groups_hold_what_has_their_label(count):
    labels = np.random.default_rng(5).integers(0, 40, count) // 2 * 2  # odd labels have no members
    groups = connectivity.group_by_label(labels, 40)
    for v in range(40):
        assert groups.members[groups.first[v] : groups.first[v + 1]].tolist() == np.flatnonzero(labels == v).tolist()
    asked = np.array([7, 6, 6, 38])
    members, which = groups.of(asked)
    assert [members[which == i].tolist() for i in range(4)] == [np.flatnonzero(labels == v).tolist() for v in asked]


def test_places_within_runs_and_the_next_in_each_run():
    counts = np.array([2, 0, 3, 1])
    run, within = connectivity.enumerate_runs(counts)
    assert list(zip(run.tolist(), within.tolist(), strict=True)) == [(0, 0), (0, 1), (2, 0), (2, 1), (2, 2), (3, 0)]
    assert connectivity.next_in_run(np.array([5, 6, 7, 8, 9, 4]), counts[counts > 0]).tolist() == [6, 5, 8, 9, 7, 4]


# --- Arrays (m, 4): quadrilaterals are refused where tetrahedra are expected, and no tetrahedra are


CUBE = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], float)


@pytest.mark.parametrize("bend", [0, 0.1, 0.5, 2])
@pytest.mark.parametrize("n", [2, 6, 40])
def test_a_sheet_of_quadrilaterals_is_not_taken_for_tetrahedra(bend, n):
    V, F = quads(n, bend)
    with pytest.raises(MeshError, match=r"F has 4 columns, which stands for tetrahedra, but F\[\d+\] = .* is a quadri"):
        Mesh(V, F)
    assert heat_igl.PolygonMesh(V, F).triangles.n_faces == 2 * n * n


@pytest.mark.parametrize(
    "F", [CUBE, CUBE[:2], CUBE[:1], CUBE[:3], [*CUBE, CUBE[0]]], ids=["closed", "apart", "single", "open", "twice"]
)
def test_a_cube_of_quadrilaterals_is_not_taken_for_tetrahedra(F):
    with pytest.raises(MeshError, match=r"F\[0\] = \[0, 2, 3, 1\] is a quadrilateral: pass PolygonMesh\(V, F\)"):
        Mesh(CORNERS, F)


@pytest.mark.parametrize("seed", range(10))
def test_scattered_tetrahedra(seed):
    rng = np.random.default_rng(seed)
    mesh = tetrahedra(rng.random((8 + 40 * seed, 3)))
    corners = rng.permuted(mesh.F, axis=1)
    flat = mesh.V * [1, 1, 1e-4]
    for V in (mesh.V, flat):
        assert Mesh(V, corners).is_tetrahedral


CORNER = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1], [-1, 0, 0], [1, 1, 1]]


@pytest.mark.parametrize(
    ("F", "thickness"),
    [
        ([[0, 1, 2, 3]], 1e-3),
        ([[0, 1, 2, 3], [0, 1, 4, 5]], 1),  # at an edge; thin ones may be quadrilaterals
        ([[0, 1, 2, 3], [0, 6, 4, 5]], 1e-3),  # at a vertex
        ([[0, 1, 2, 3], [1, 2, 3, 7], [0, 1, 4, 5]], 1e-2),
    ],
)
def test_tetrahedra_with_few_neighbours(F, thickness):
    for V in (np.array(CORNER), CORNER * np.array([1, 1, thickness])):
        assert Mesh(V, F).is_tetrahedral
        apart = np.concatenate([V + 3 * i for i in range(50)])
        assert Mesh(apart, np.concatenate([np.add(F, 8 * i) for i in range(50)])).n_faces == 50 * len(F)


def test_a_flat_tetrahedron_beside_others_is_for_the_report():
    mesh = Mesh([*CORNER[:4], [1, 1, 0]], [[0, 1, 2, 3], [0, 1, 4, 2]])
    assert mesh.report().degenerate_faces.tolist() == [1]


def test_half_a_million_quadrilaterals_are_told_from_tetrahedra():
    """Half a million quadrilaterals and nearly as many tetrahedra: a quadratic check would not end."""
    V, F = quads(700, 0.2)
    with pytest.raises(MeshError, match="is a quadrilateral"):
        Mesh(V, F)
    assert shapes.box(40).n_faces == 384_000


# --- Points and curves on faces: where they are, and which mistakes are refused


MESH = Mesh([[0, 0, 0], [2, 0, 0], [0, 4, 0], [2, 4, 6]], [[0, 1, 2], [1, 3, 2]])


def test_positions_are_weighted_corners():
    points = SurfacePoints([0, 1], [[0.5, 0.25, 0.25], [0, 1, 0]])
    np.testing.assert_allclose(points.positions(MESH), [[0.5, 1, 0], [2, 4, 6]])


def test_a_curve_runs_through_its_corners():
    # Down the edge 1-2 in face 0, then to vertex 3 in face 1.
    curve = heat_igl.SurfaceCurve([0, 1], [[0, 1, 0], [0, 0, 1]], [[0, 0, 1], [0, 1, 0]])
    np.testing.assert_allclose(curve.positions(MESH), [[2, 0, 0], [0, 4, 0], [2, 4, 6]])
    np.testing.assert_allclose(curve.lengths(MESH), [np.sqrt(20), np.sqrt(40)])


# --- projection


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


def test_more_corners_on_the_lines_of_a_polyline_change_no_curve():
    sphere, rng = shapes.icosphere(3), np.random.default_rng(3)
    mesh = Mesh(sphere.V * np.exp(0.2 * rng.normal(size=(sphere.n_vertices, 1))), sphere.F)
    angle, share = np.linspace(0, 2, 8), np.linspace(0, 1, 100, endpoint=False)[:, None]
    for x, y in np.eye(3)[[[0, 1], [1, 2], [2, 0]]]:
        corners = closest_points(mesh, np.outer(np.cos(angle), x) + np.outer(np.sin(angle), y)).points.positions(mesh)
        dense = np.concatenate([*(a + share * (b - a) for a, b in itertools.pairwise(corners)), corners[-1:]])
        curve = curve_on(mesh, corners, tolerance=1)
        assert_connected(mesh, curve)
        assert curve.length == pytest.approx(curve_on(mesh, dense, tolerance=1).length, rel=0.01)
        # At least as long as the track of the closest points, which jumps over valleys.
        track = closest_points(mesh, dense).points.positions(mesh)
        assert curve.length > 0.995 * np.linalg.norm(np.diff(track, axis=0), axis=1).sum()
        assert np.linalg.norm(curve.points[:, None] - corners, axis=2).min(axis=0).max() < 1e-12


def test_a_curve_along_edges_passes_their_vertices_in_order():
    mesh = shapes.grid(4)
    path = [0, 1, 6, 11]
    curve = edge_curve(mesh, path)
    assert_connected(mesh, curve)
    np.testing.assert_allclose(curve.positions(mesh), mesh.V[path], atol=1e-15)
    around = edge_curve(mesh, [0, 1, 6, 5], closed=True)
    assert_connected(mesh, around)
    np.testing.assert_allclose(around.positions(mesh), mesh.V[[0, 1, 6, 5, 0]], atol=1e-15)


def test_a_jump_between_two_sheets_is_refused():
    """Between two parallel sheets the closest point jumps from one to the other."""
    sheet = shapes.grid(4)
    sheets = twice(sheet, np.array([0, 0, 0.2]))
    with pytest.raises(SourceError, match=r"line from positions\[0\] jumps from face .* draw it closer"):
        curve_on(sheets, [[0.2, 0.2, 0.05], [0.7, 0.2, 0.15]])
    # The same on one sheet that is folded: the way around the fold leaves the polyline.
    flat = shapes.grid(8)
    x, y, _ = flat.V.T
    folded = Mesh(np.stack([np.minimum(x, 1 - x), y, 0.02 * (x > 0.5)], axis=1), flat.F)
    with pytest.raises(SourceError, match=r"jumps from face"):
        curve_on(folded, [[0.1, 0.3, 0], [0.1, 0.7, 0.02]])
    assert curve_on(folded, [[0.1, 0.5, 0], [0.5, 0.5, 0], [0.1, 0.5, 0.02]]).length > 0.75


def test_a_polyline_over_a_valley_is_led_through_it():
    """The closest points jump from wall to wall, and the curve between them keeps within the tolerance."""
    flat = shapes.grid(8)
    valley = Mesh(np.stack([flat.V[:, 0] - 0.5, flat.V[:, 1], abs(flat.V[:, 0] - 0.5)], axis=1), flat.F)
    curve = curve_on(valley, [[-0.4, 0.3, 0.45], [0.0, 0.4, 0.1], [0.4, 0.5, 0.45]], tolerance=0.12)
    assert_connected(valley, curve)
    assert curve.points[:, 2].min() == pytest.approx(0, abs=1e-12)
