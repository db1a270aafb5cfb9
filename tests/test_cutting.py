"""Meshes cut along curves: the surface stays, curves become edges, and the pieces lie on either side."""

import numpy as np
import pytest
from conftest import flat_perturbed

import heat_igl
from heat_igl import Mesh, SurfaceCurve, curve_on, cut, edge_curve, isolines, shapes
from heat_igl.heat.curve_sides import total_length
from heat_igl.mesh import connectivity


def sphere() -> Mesh:
    return shapes.icosphere(2)


def square() -> Mesh:
    return flat_perturbed(shapes.grid(8))


def random_loop(mesh: Mesh, seed: int) -> SurfaceCurve:
    """A closed polyline over a unit square that crosses itself."""
    corners = np.random.default_rng(seed).uniform(0.05, 0.95, (7, 2))
    return curve_on(mesh, np.column_stack([corners, np.zeros(7)]), closed=True)


def wild_segments(mesh: Mesh, count: int, seed: int) -> SurfaceCurve:
    """Unconnected segments, several in a face: in corners, along and across sides, inside, over each other."""
    rng = np.random.default_rng(seed)
    kinds = np.array([[0, 0, 1], [0.5, 0.5, 0], [0.25, 0, 0.75], [0.25, 0.25, 0.5], [0.6, 0.2, 0.2], [1, 0, 0]])
    ends = kinds[rng.integers(len(kinds), size=(2, count))]
    ends = rng.permuted(ends, axis=2)
    return SurfaceCurve(rng.integers(0, mesh.n_faces, count) % 10, *ends)


CURVES = {
    "across faces": lambda: (sphere(), isolines(sphere(), sphere().V @ [0.3, 0.5, 0.8], 0.1)[0]),
    "through vertices": lambda: (sphere(), isolines(sphere(), sphere().V[:, 2], 0.0)[0]),
    "along edges": lambda: (square(), edge_curve(square(), [0, 1, 2, 11, 20])),
    "crosses itself": lambda: (square(), [random_loop(square(), 3)]),
    "crosses another": lambda: (square(), [random_loop(square(), 4), random_loop(square(), 5)]),
    "twice": lambda: (square(), [random_loop(square(), 4)] * 2),
    "from boundary to boundary": lambda: (shapes.grid(6), curve_on(shapes.grid(6), [[0, 0.31, 0], [1, 0.72, 0]])),
    "straight along a row": lambda: (shapes.grid(6), curve_on(shapes.grid(6), [[0, 0.5, 0], [1, 0.5, 0]])),
    "ends in faces": lambda: (square(), curve_on(square(), [[0.2, 0.3, 0], [0.21, 0.32, 0], [0.7, 0.33, 0]])),
    "several in a face": lambda: (square(), wild_segments(square(), 60, 0)),
}


def is_along_edges(found: heat_igl.curves.CutMesh) -> bool:
    n = found.mesh.n_vertices
    return bool(np.isin(np.sort(found.edges, axis=1) @ [n, 1], found.mesh.edges @ [n, 1]).all())


def assert_same_surface(mesh: Mesh, found: heat_igl.curves.CutMesh) -> None:
    new = found.mesh
    np.testing.assert_array_equal(new.V[: mesh.n_vertices], mesh.V)
    np.testing.assert_allclose(found.places.positions(mesh), new.V, atol=1e-14)
    area = np.bincount(found.old_faces, new.measures, mesh.n_faces)
    np.testing.assert_allclose(area, mesh.measures, rtol=1e-12)
    # The same topology, with edges of at most two faces, oriented as before.
    assert connectivity.boundary_loops(new.facets, new.n_vertices) == connectivity.boundary_loops(
        mesh.facets, mesh.n_vertices
    )
    assert new.facets.n_faces.max() == mesh.facets.n_faces.max()
    assert len(new.facets.vertices) - new.n_faces - new.n_vertices == (
        len(mesh.facets.vertices) - mesh.n_faces - mesh.n_vertices
    )
    heat_igl.tangent_frames(new)


@pytest.mark.parametrize("name", CURVES)
def test_the_surface_stays_and_curves_become_edges(name):
    mesh, curves = CURVES[name]()
    found = cut(mesh, curves)
    assert_same_surface(mesh, found)
    assert is_along_edges(found)
    every = curves if isinstance(curves, list) else [curves]
    length = np.linalg.norm(np.diff(found.mesh.V[found.edges], axis=1)[:, 0], axis=1)
    for i, curve in enumerate(every):
        assert length[found.curve == i].sum() == pytest.approx(total_length(mesh, curve), rel=1e-12)


@pytest.mark.parametrize(
    "name", ["across faces", "crosses itself", "from boundary to boundary", "straight along a row"]
)
def test_distances_stay(name):
    mesh, curves = CURVES[name]()
    found = cut(mesh, curves).mesh
    before, after = (heat_igl.geodesic_distance(m, [0, 17], method="exact") for m in (mesh, found))
    np.testing.assert_allclose(after[: mesh.n_vertices], before, rtol=1e-12, atol=1e-12 * before.max())


def test_many_random_curves():
    mesh = shapes.grid(3)
    for seed in range(100):
        found = cut(mesh, wild_segments(mesh, 25, seed))
        assert_same_surface(mesh, found)
        assert is_along_edges(found)


def test_a_face_with_two_corners_in_one_place():
    mesh = Mesh([[0, 0, 0], [0, 0, 0], [9, 0, 0], [9, 9, 0]], [[0, 1, 2], [1, 3, 2]])
    found = cut(mesh, SurfaceCurve([0, 1], [[0.5, 0, 0.5], [0.5, 0, 0.5]], [[0, 0.5, 0.5], [0, 0.5, 0.5]]))
    assert found.mesh.measures.sum() == pytest.approx(40.5, rel=1e-14)


def test_pieces_lie_on_either_side():
    mesh = sphere()
    height = mesh.V @ [0.3, 0.5, 0.8]
    found = cut(mesh, isolines(mesh, height, 0.1)[0])
    below, above = found.pieces[found.sides].T
    assert len({*below.tolist()}) == len({*above.tolist()}) == 1
    middle = found.carry(height)[found.mesh.F].mean(axis=1)
    np.testing.assert_array_equal(found.pieces == below[0], middle < 0.1)


def test_split_and_loops():
    mesh = shapes.grid(8)
    ring = isolines(mesh, np.linalg.norm(mesh.V - [0.5, 0.5, 0], axis=1), [0.2, 0.4])
    pieces = cut(mesh, ring).split()
    assert sorted(len(piece.boundary_loops()) for piece in pieces) == [1, 2, 2]
    assert sum(piece.mesh.measures.sum() for piece in pieces) == pytest.approx(1, rel=1e-12)
    disk = min(pieces, key=lambda piece: piece.mesh.n_faces)
    x, y, _ = disk.mesh.V[np.append(disk.boundary_loops()[0], disk.boundary_loops()[0][0])].T
    # Counter-clockwise around the disk, and once around all of it.
    assert (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() / 2 == pytest.approx(disk.mesh.measures.sum(), rel=1e-12)


def test_loops_where_a_piece_touches_itself():
    # Two triangles that share one vertex.
    mesh = shapes.grid(2)
    inside = np.isin(np.arange(mesh.n_faces), np.flatnonzero((mesh.F == 4).any(axis=1))[[0, 3]])
    piece = cut(mesh, heat_igl.mesh.region_boundary(mesh, faces=inside))
    total = sum(len(part.boundary_loops()) for part in piece.split())
    assert total >= len(piece.split())
    for part in piece.split():
        edges = [set(zip(loop, np.roll(loop, -1), strict=True)) for loop in part.boundary_loops()]
        assert sum(map(len, edges)) == (part.mesh.facets.n_faces == 1).sum()


def test_linear_values_stay_linear():
    mesh = square()
    found = cut(mesh, random_loop(mesh, 1))
    values = mesh.V @ [1.0, 2.0, 0.0] + 3
    np.testing.assert_allclose(found.carry(values), found.mesh.V @ [1.0, 2.0, 0.0] + 3, rtol=1e-14)
    np.testing.assert_allclose(found.carry(mesh.V), found.mesh.V, atol=1e-15)
    with pytest.raises(ValueError, match=r"values must have 81 rows, one for each vertex"):
        found.carry(values[:-1])


def test_faces_without_a_curve_stay():
    mesh = square()
    curve = curve_on(mesh, [[0.1, 0.12, 0], [0.2, 0.14, 0]])
    found = cut(mesh, curve)
    count = np.bincount(found.old_faces)
    whole = count[found.old_faces] == 1
    np.testing.assert_array_equal(found.mesh.F[whole], mesh.F[found.old_faces[whole]])
    assert whole.sum() > mesh.n_faces - 10


def test_infinite_values_are_carried_to_the_vertices_that_lie_among_them():
    """A corner without weight may be infinitely far away: the new vertex on an edge keeps the finite mean of two."""
    mesh = square()
    values = mesh.V[:, 0].copy()
    line = curve_on(mesh, [[0.1, 0.55, 0], [0.9, 0.55, 0]])
    found = cut(mesh, line)
    values[mesh.V[:, 1] > 0.9] = np.inf  # a strip that the line does not touch
    values[mesh.V[:, 1] < 0.2] = np.inf
    new = found.carry(values)
    assert not np.isnan(new).any()
    assert np.isfinite(new[mesh.n_vertices :]).all()
    beside = values.copy()
    beside[mesh.F[found.places.faces[-1]]] = np.inf
    assert not np.isnan(found.carry(beside)).any()
