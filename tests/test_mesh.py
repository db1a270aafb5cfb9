"""Mesh, MeshReport and connectivity on small shapes whose every number can be worked out by hand."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse as sp
from scipy.sparse.csgraph import connected_components

import heat_igl
from heat_igl import Mesh, MeshError
from heat_igl.mesh import connectivity, grouping

TETRAHEDRON_V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TETRAHEDRON_F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def sheet(n: int, m: int, *, wrap: str = "") -> Mesh:
    """An n x m grid of unit squares, each cut in two; `wrap` may join its ends: "cylinder", "torus" or "moebius"."""
    columns, rows = n + (wrap == ""), m + (wrap != "torus")

    def number(i: int, j: int) -> int:
        if wrap == "moebius" and i == n:
            i, j = 0, m - j
        return (i % columns) * rows + j % rows

    F = []
    for i, j in itertools.product(range(n), range(m)):
        a, b, c, d = number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)
        F += [[a, b, c], [a, c, d]]
    V = [[i, j, 0.1 * i * j] for i in range(columns) for j in range(rows)]
    return Mesh(V, F)


def two_tetrahedra() -> Mesh:
    return Mesh(np.concatenate([TETRAHEDRON_V, [[1, 1, 1]]]), [[0, 1, 2, 3], [1, 2, 3, 4]])


# --- Mesh -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("V_type", [list, np.float32, np.float64, np.int64, np.uint8, ">f8", "fortran"])
@pytest.mark.parametrize("F_type", [list, np.int8, np.int32, np.int64, np.uint64, ">i4", "fortran"])
def test_any_kind_of_array_becomes_the_same_mesh(V_type: object, F_type: object) -> None:
    def converted(array: np.ndarray, kind: object) -> object:
        if kind is list:
            return array.tolist()
        return np.asfortranarray(array) if kind == "fortran" else array.astype(kind)  # type: ignore[call-overload]

    mesh = Mesh(converted(TETRAHEDRON_V, V_type), converted(TETRAHEDRON_F, F_type))
    for array, dtype, expected in ((mesh.V, np.float64, TETRAHEDRON_V), (mesh.F, np.int64, TETRAHEDRON_F)):
        assert array.dtype == dtype
        assert array.flags.c_contiguous
        assert np.array_equal(array, expected)


def test_mesh_keeps_a_copy_that_nobody_can_write_to() -> None:
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
        mesh.V = V  # type: ignore[misc]


def test_error_counts_the_offenders() -> None:
    V = np.where(np.arange(12).reshape(4, 3) % 7 == 5, np.nan, 1.0)
    with pytest.raises(MeshError, match=r"V\[1, 2\] is nan \(1 of 4 vertices are not finite\)"):
        Mesh(V, TETRAHEDRON_F)
    with pytest.raises(
        MeshError, match=r"F\[1, 2\] = 3 is no vertex \(3 of 4 faces are affected\): there are 3 vertices"
    ):
        Mesh(TETRAHEDRON_V[:3], TETRAHEDRON_F)
    with pytest.raises(MeshError, match=r"F\[0, 2\] = 4 is no vertex .* look 1-based, subtract 1"):
        Mesh(TETRAHEDRON_V, [[1, 2, 4], [1, 2, 3]])
    assert Mesh(TETRAHEDRON_V, np.array([[1, 2, 4], [1, 2, 3]]) - 1).n_faces == 2


@pytest.mark.parametrize("mesh", [sheet(2, 3), two_tetrahedra()], ids=["surface", "solid"])
def test_a_pickled_mesh_comes_back_with_the_same_bits(mesh: Mesh) -> None:
    _ = mesh.edges
    back = pickle.loads(pickle.dumps(mesh))
    assert back.V.tobytes() == mesh.V.tobytes()
    assert np.array_equal(back.F, mesh.F)
    assert not back.V.flags.writeable


def test_counts_and_representation() -> None:
    assert (sheet(2, 3).n_vertices, sheet(2, 3).n_faces, sheet(2, 3).is_tetrahedral) == (12, 12, False)
    assert repr(sheet(2, 3)) == "Mesh(12 vertices, 12 triangles)"
    assert (two_tetrahedra().n_faces, two_tetrahedra().is_tetrahedral) == (2, True)
    assert repr(two_tetrahedra()) == "Mesh(5 vertices, 2 tetrahedra)"


def test_measures_do_not_depend_on_orientation() -> None:
    mesh = Mesh(TETRAHEDRON_V, TETRAHEDRON_F)
    assert mesh.measures == pytest.approx([0.5, 0.5, 3**0.5 / 2, 0.5], rel=1e-15)
    assert Mesh(TETRAHEDRON_V, TETRAHEDRON_F[:, ::-1]).measures == pytest.approx(mesh.measures, rel=1e-15)
    assert two_tetrahedra().measures == pytest.approx([1 / 6, 1 / 3], rel=1e-15)
    flipped = Mesh(two_tetrahedra().V, two_tetrahedra().F[:, [1, 0, 2, 3]])
    assert flipped.measures == pytest.approx([1 / 6, 1 / 3], rel=1e-15)


def test_edge_lengths_belong_to_edges() -> None:
    mesh = two_tetrahedra()
    assert mesh.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3], [2, 4], [3, 4]]
    root = 2**0.5
    assert mesh.edge_lengths == pytest.approx([1, 1, 1, root, root, root, root, root, root], rel=1e-15)


def test_components_boundary_and_referenced() -> None:
    a, b = sheet(3, 1), sheet(4, 4, wrap="torus")
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


def test_longest_distance() -> None:
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
        (sheet(5, 2, wrap="cylinder"), 0, 2),
        (sheet(5, 3, wrap="moebius"), 0, 1),
        (sheet(5, 4, wrap="torus"), 0, 0),
        (Mesh(TETRAHEDRON_V, [[0, 1, 2, 3]]), 1, 1),
        (two_tetrahedra(), 1, 1),
    ],
    ids=["sphere", "disk", "cylinder", "moebius", "torus", "tetrahedron", "two tetrahedra"],
)
def test_report_counts_boundary_loops_and_the_euler_characteristic(mesh: Mesh, euler: int, loops: int) -> None:
    report = mesh.report()
    assert (report.euler_characteristic, report.n_boundary_loops, report.n_components) == (euler, loops, 1)
    assert (report.n_vertices, report.n_faces, report.n_edges) == (mesh.n_vertices, mesh.n_faces, len(mesh.edges))
    for name in ("nonmanifold_edges", "nonmanifold_vertices", "duplicate_faces", "unreferenced_vertices"):
        assert len(getattr(report, name)) == 0


def test_report_lists_what_is_wrong() -> None:
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
def test_degenerate_means_flat_to_rounding(height: float, degenerate: list[int], scale: float) -> None:
    V = scale * np.array([[0, 0, 0], [1, 0, 0], [0.5, height, 0], [0, 1, 0]])
    assert Mesh(V, [[0, 1, 2], [0, 1, 3]]).report().degenerate_faces.tolist() == degenerate


def test_report_measures_lengths_angles_and_range() -> None:
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


def test_report_of_a_scaled_mesh_is_scaled() -> None:
    mesh = sheet(4, 3)
    small, large = Mesh(mesh.V * 1e-8, mesh.F).report(), Mesh(mesh.V * 1e8, mesh.F).report()
    assert large.mean_edge == pytest.approx(1e16 * small.mean_edge, rel=1e-12)
    for name in ("smallest_angle", "largest_angle", "edges_across"):
        assert getattr(large, name) == pytest.approx(getattr(small, name), rel=1e-9)
    assert len(small.degenerate_faces) == len(large.degenerate_faces) == 0


def test_report_prints_a_table() -> None:
    V = np.concatenate([sheet(2, 2).V, np.full((9, 3), 5.0)])
    lines = str(Mesh(V, sheet(2, 2).F).report()).splitlines()
    table = {name: value.strip() for name, value in (line.split("  ", 1) for line in lines)}
    assert table["n vertices"] == "18"
    assert table["euler characteristic"] == "1"
    assert table["unreferenced vertices"] == "9: 9, 10, 11, 12, 13, ..."
    assert table["duplicate faces"] == "0"
    assert table["is intrinsic delaunay"] in ("yes", "no")
    assert dict(two_tetrahedra().report().rows())["is intrinsic delaunay"] == "-"


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
def test_edges_facets_and_components_against_sets(given_faces: tuple[int, list[list[int]]]) -> None:
    n, faces = given_faces
    F = np.array(faces, np.int64)
    holders: dict[tuple[int, ...], int] = {}
    for face in faces:
        for pair in itertools.combinations(sorted(face), 2):
            holders[pair] = holders.get(pair, 0) + 1
    assert [tuple(row) for row in connectivity.edges(F, n).tolist()] == sorted(holders)
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
    seen: set[frozenset[int]] = set()
    repeated = [i for i, face in enumerate(faces) if frozenset(face) in seen or seen.add(frozenset(face))]  # type: ignore[func-returns-value]
    assert connectivity.duplicate_faces(F, n).tolist() == repeated


@settings(max_examples=150, deadline=None)
@given(FACES)
def test_nonmanifold_vertices_against_links(given_faces: tuple[int, list[list[int]]]) -> None:
    """A vertex is manifold when its faces hang together around it and each edge at it has at most two faces."""
    n, faces = given_faces
    bad = []
    for v in range(n):
        link = [set(face) - {v} for face in faces if v in face]
        crowded = any(sum(w in edge for edge in link) > 2 for w in range(n))
        pieces: list[set[int]] = []
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
def test_unique_rows_are_those_of_numpy(n: int, columns: int, count: int) -> None:
    rows = np.random.default_rng(31).integers(0, 4, (count, columns)) * (n // 4)
    first, inverse, counts = connectivity.unique_rows(rows, n)
    expected, expected_first, expected_counts = np.unique(rows, axis=0, return_index=True, return_counts=True)
    assert np.array_equal(rows[first], expected)
    assert np.array_equal(first, expected_first)
    assert np.array_equal(counts, expected_counts)
    assert np.array_equal(rows[first][inverse], rows)


def test_longest_path_with_loops_and_repeated_edges() -> None:
    """A path of three edges and one of two; the repeated edge counts once, with its shorter length."""
    edges = np.array([[1, 0], [1, 2], [2, 1], [3, 2], [2, 2], [4, 5], [6, 5]])
    lengths = np.array([1.0, 9, 2, 3, 50, 2, 3.5])
    graph = connectivity.shortest_edge_graph(edges, lengths, 7)
    assert connectivity.longest_path(graph, np.array([0, 0, 0, 0, 1, 1, 1])) == 6
    alone = connectivity.shortest_edge_graph(edges[5:], lengths[5:], 7)
    assert connectivity.longest_path(alone, np.array([0, 1, 2, 3, 4, 4, 4])) == 5.5


def test_facets_of_tetrahedra_are_opposite_their_corner() -> None:
    found = connectivity.facets(two_tetrahedra().F, 5)
    assert found.vertices[found.n_faces == 2].tolist() == [[1, 2, 3]]
    assert found.vertices[found.of_face[0]].tolist() == [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]
    assert len(found.vertices) == 7


def test_two_cones_that_touch_in_a_point() -> None:
    F = np.concatenate([TETRAHEDRON_F, np.array([0, 4, 5, 6])[TETRAHEDRON_F]])
    assert nonmanifold_vertices(F, 7) == [0]
    assert nonmanifold_vertices(TETRAHEDRON_F, 4) == []
    assert connectivity.boundary_loops(connectivity.facets(F, 7), 7) == 0


def test_three_pages_of_a_book() -> None:
    V = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0]])
    report = Mesh(V, [[0, 1, 2], [0, 1, 3], [0, 1, 4]]).report()
    assert report.nonmanifold_edges.tolist() == [[0, 1]]
    assert report.nonmanifold_vertices.tolist() == [0, 1]


def test_distance_along_edges_of_length_zero() -> None:
    """Two vertices in one place are at distance 0 from each other, however the edge between them is stored."""
    mesh = Mesh([[0.0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 5, 5]], [[0, 1, 2], [1, 0, 3]])
    assert connectivity.edge_distance(mesh.edge_graph, np.array([0])).tolist() == [0, 0, 1, 2, np.inf]
    assert connectivity.edge_distance(mesh.edge_graph, np.array([2, 3])).tolist() == [1, 1, 0, 0, np.inf]
    counted = connectivity.edge_distance(mesh.edge_graph, np.array([2]), count_edges=True)
    assert counted.tolist() == [1, 1, 0, 2, np.inf]


@pytest.mark.parametrize("count", [0, 1, 300])
def test_groups_hold_what_has_their_label(count: int) -> None:
    labels = np.random.default_rng(5).integers(0, 40, count) // 2 * 2  # odd labels have no members
    groups = grouping.group_by_label(labels, 40)
    for v in range(40):
        assert groups.members[groups.first[v] : groups.first[v + 1]].tolist() == np.flatnonzero(labels == v).tolist()
    asked = np.array([7, 6, 6, 38])
    members, which = groups.of(asked)
    assert [members[which == i].tolist() for i in range(4)] == [np.flatnonzero(labels == v).tolist() for v in asked]
    renamed = grouping.group_by_label(labels, 40, 100 + np.arange(count))
    assert np.array_equal(renamed.members, 100 + groups.members)


def test_places_within_runs_and_the_next_in_each_run() -> None:
    counts = np.array([2, 0, 3, 1])
    run, within = grouping.enumerate_runs(counts)
    assert list(zip(run.tolist(), within.tolist(), strict=True)) == [(0, 0), (0, 1), (2, 0), (2, 1), (2, 2), (3, 0)]
    assert grouping.next_in_run(np.array([5, 6, 7, 8, 9, 4]), counts[counts > 0]).tolist() == [6, 5, 8, 9, 7, 4]


def test_without_duplicate_faces_keeps_the_first_of_each():
    V = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    mesh = Mesh(V, [[0, 1, 2], [2, 1, 3], [1, 2, 0], [3, 2, 1], [2, 1, 3]])
    reduced, kept = mesh.without_duplicate_faces()
    assert kept.tolist() == [0, 1]
    assert reduced.F.tolist() == [[0, 1, 2], [2, 1, 3]]
    assert reduced.without_duplicate_faces()[0] is reduced


def test_edges_and_components_of_random_triangles():
    rng = np.random.default_rng(3)
    for _ in range(100):
        n = int(rng.integers(3, 40))
        F = np.array([rng.choice(n, 3, replace=False) for _ in range(rng.integers(1, 30))])
        sides = np.sort(F[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        vertices, of_face, counts = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        found = connectivity.facets(F, n)
        assert found.vertices.tolist() == vertices.tolist()
        assert found.of_face.ravel().tolist() == of_face.ravel().tolist()
        assert found.n_faces.tolist() == counts.tolist()
        graph = sp.coo_array((np.ones(len(sides)), tuple(sides.T)), shape=(n, n))
        assert connectivity.connected_components(F, n).tolist() == connected_components(graph)[1].tolist()
