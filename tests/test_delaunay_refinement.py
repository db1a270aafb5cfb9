"""Intrinsic Delaunay refinement: angles, the surface that stays the same, and points that are carried along."""

from __future__ import annotations

import numpy as np
import pytest

from heat_igl import GeodesicSolver, HeatMethodSolver, Mesh, SurfacePoints, geodesic_distance, shapes
from heat_igl.intrinsic import (
    Flipped,
    IntrinsicTriangulation,
    Refined,
    closed_cover,
    corner_angles,
    delaunay_refinement,
    intrinsic_delaunay,
    intrinsic_triangulation,
    lay_out,
    tufted_cover,
)
from heat_igl.operators import operators
from heat_igl.typing import FloatArray, IntArray


def stretched(scale: float = 12.0) -> Mesh:
    """A long ellipsoid with thin triangles."""
    sphere = shapes.icosphere(2)
    return Mesh(sphere.V * [1, 1, scale], sphere.F)


@pytest.fixture(scope="module")
def coarse() -> IntrinsicTriangulation:
    return intrinsic_delaunay(intrinsic_triangulation(stretched()))


@pytest.fixture(scope="module")
def fine(coarse: IntrinsicTriangulation) -> IntrinsicTriangulation:
    return delaunay_refinement(coarse, 5000)


def cone_angles(triangulation: IntrinsicTriangulation) -> FloatArray:
    return np.bincount(triangulation.F.ravel(), corner_angles(triangulation.l).ravel(), triangulation.n)


def test_no_angle_is_small(coarse: IntrinsicTriangulation, fine: IntrinsicTriangulation) -> None:
    assert np.degrees(corner_angles(coarse.l)).min() < 15
    assert np.degrees(corner_angles(fine.l)).min() >= 25 - 1e-9
    assert coarse.n < fine.n < 5000


def test_the_surface_stays_the_same(coarse: IntrinsicTriangulation, fine: IntrinsicTriangulation) -> None:
    assert fine.areas.sum() == pytest.approx(coarse.areas.sum(), rel=1e-11)
    assert np.abs(cone_angles(fine)[: coarse.n] - cone_angles(coarse)).max() < 1e-9
    assert np.abs(cone_angles(fine)[coarse.n :] - 2 * np.pi).max() < 1e-9
    assert fine.n - len(fine.edges) + len(fine.F) == 2


def test_glued_half_edges_share_ends_and_length(fine: IntrinsicTriangulation) -> None:
    half_edge = np.arange(fine.F.size)
    assert (fine.twin[fine.twin] == half_edge).all()
    assert (fine.tail(half_edge) == fine.head(fine.twin)).all()
    assert np.abs(fine.l.ravel() - fine.l.ravel()[fine.twin]).max() < 1e-12 * fine.l.max()


def test_edges_are_delaunay(fine: IntrinsicTriangulation) -> None:
    opposite = corner_angles(fine.l).ravel()
    assert (opposite + opposite[fine.twin]).max() < np.pi + 1e-6
    assert delaunay_refinement(fine, 10**6) is fine


def test_radii_and_units(coarse: IntrinsicTriangulation) -> None:
    def largest(triangulation: IntrinsicTriangulation) -> float:
        return float((triangulation.l.prod(axis=1) / (4 * triangulation.areas)).max())

    bound = 0.2 * largest(coarse)
    small = delaunay_refinement(coarse, 10**5, largest_radius=bound)
    assert 0.5 * bound < largest(small) <= bound
    unit = np.full(len(coarse.F), 4.0)
    again = delaunay_refinement(coarse, 10**5, largest_radius=bound / 4, unit=unit)
    assert np.array_equal(small.F, again.F)


def test_growth_is_bounded(coarse: IntrinsicTriangulation) -> None:
    assert delaunay_refinement(coarse, coarse.n + 7).n == coarse.n + 7
    assert delaunay_refinement(coarse, coarse.n) is coarse


def test_a_sharp_cone_keeps_its_angle() -> None:
    tetrahedra = np.array([[0, 0, 0], [1, 0, 0], [0.5, 0.9, 0], [0.5, 0.3, 20]])
    mesh = Mesh(tetrahedra, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    assert delaunay_refinement(intrinsic_delaunay(intrinsic_triangulation(mesh)), 10**4).n < 200


def test_a_boundary_is_refused() -> None:
    with pytest.raises(ValueError, match="take the tufted cover"):
        delaunay_refinement(intrinsic_triangulation(shapes.grid(3)), 100)


def test_closed_cover_is_the_tufted_cover() -> None:
    for mesh in (shapes.grid(4), shapes.icosphere(1), shapes.cylinder(5, 7)):
        found, expected = closed_cover(intrinsic_triangulation(mesh)), tufted_cover(mesh)
        assert np.array_equal(found.F, expected.F)
        assert np.array_equal(found.twin, expected.twin)
        assert np.array_equal(found.l, expected.l)


# Points.


def split(refined: Refined, move: int, faces: IntArray, barycentric: FloatArray) -> None:
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


def test_points_are_carried_move_by_move(coarse: IntrinsicTriangulation) -> None:
    rng = np.random.default_rng(0)
    fine = delaunay_refinement(coarse, coarse.n + 60)
    refined = fine.history[-1]
    assert isinstance(refined, Refined)
    faces = rng.integers(len(coarse.F), size=200)
    barycentric = rng.dirichlet([1, 1, 1], 200)
    expected_faces, expected = faces.copy(), barycentric.copy()
    for move in range(len(refined.kind)):
        if refined.kind[move, 0] == 0:
            split(refined, move, expected_faces, expected)
        else:
            flip = Flipped(refined.kind[move, 1:2], refined.kind[move, 2:3], refined.numbers[move, :, None])
            expected_faces, expected = flip.carry(expected_faces, expected)
    found_faces, found = refined.carry(faces, barycentric)
    assert np.array_equal(found_faces, expected_faces)
    assert np.abs(found - expected).max() < 1e-9
    assert (found_faces >= len(coarse.F)).mean() > 0.1


def test_points_keep_their_distance_from_a_vertex(coarse: IntrinsicTriangulation, fine: IntrinsicTriangulation) -> None:
    rng = np.random.default_rng(1)
    faces = rng.integers(len(coarse.F), size=100)
    near = 1e-3
    barycentric = np.array([1.0, 0, 0]) * (1 - near) + near * rng.dirichlet([1, 1, 1], 100)
    before = np.linalg.norm(np.einsum("kc,kcx->kx", barycentric, lay_out(coarse.l[faces])), axis=1)
    vertex = coarse.F[faces, 0]
    history = fine.history[-1:]
    for change in history:
        faces, barycentric = change.carry(faces, barycentric)
    corners = lay_out(fine.l[faces])
    place = np.einsum("kc,kcx->kx", barycentric, corners)
    at = fine.F[faces] == vertex[:, None]
    assert at.any(axis=1).all()
    after = np.linalg.norm(place - corners[np.arange(100), at.argmax(axis=1)], axis=1)
    assert np.abs(after - before).max() < 1e-9 * before.max()


# The solver on refined triangles: answers are those at the vertices of the mesh.


@pytest.fixture(scope="module")
def solver() -> HeatMethodSolver:
    return HeatMethodSolver(stretched())


def mean_error(distance: FloatArray, truth: FloatArray) -> float:
    there = truth > 0
    return float(np.mean(np.abs(distance - truth)[there] / truth[there]))


def test_answers_are_at_the_vertices_of_the_mesh(solver: HeatMethodSolver) -> None:
    mesh = stretched()
    assert solver.operators.n > mesh.n_vertices == solver.n_vertices
    truth = geodesic_distance(mesh, 5)
    distance = solver.distance(5)
    assert distance.shape == (mesh.n_vertices,)
    plain = HeatMethodSolver(mesh, laplacian="intrinsic-delaunay")
    assert plain.operators.n == mesh.n_vertices
    assert 0.002 < mean_error(distance, truth) < 0.02


def test_sources_in_faces(solver: HeatMethodSolver) -> None:
    mesh = stretched()
    corner = SurfacePoints([17], [[1.0, 0, 0]])
    assert np.array_equal(solver.distance(corner), solver.distance(int(mesh.F[17, 0])))
    inside = SurfacePoints([17], [[0.4, 0.35, 0.25]])
    truth = GeodesicSolver(mesh, method="exact").distance(inside)
    assert mean_error(solver.distance(inside), truth) < 0.02


@pytest.mark.parametrize("boundary", ["neumann", "dirichlet", "average"])
def test_a_surface_with_a_boundary(boundary: str) -> None:
    rng = np.random.default_rng(3)
    flat = shapes.grid(6)
    inner = ~flat.boundary
    V = flat.V.copy()
    V[inner, :2] += rng.uniform(-0.03, 0.03, (inner.sum(), 2))
    mesh = Mesh(V * [8, 1, 1], flat.F)
    solver = HeatMethodSolver(mesh, boundary=boundary, laplacian="intrinsic-delaunay-refined")  # type: ignore[arg-type]
    domain = solver.operators
    assert domain.n > mesh.n_vertices
    assert np.array_equal(domain.boundary[: mesh.n_vertices], mesh.boundary)
    assert not domain.boundary[mesh.n_vertices :].any()
    assert domain.M.sum() == pytest.approx(8, rel=1e-12)
    assert abs(domain.L - domain.D @ domain.G).max() < 1e-12
    inside = int(np.flatnonzero(inner)[7])
    for source in (inside, SurfacePoints([20], [[0.2, 0.3, 0.5]])):
        place = mesh.V[source] if isinstance(source, int) else source.barycentric[0] @ mesh.V[mesh.F[20]]
        truth = np.linalg.norm(mesh.V - place, axis=1)
        assert mean_error(solver.distance(source), truth) < 0.06


def test_paths_are_those_on_the_triangles_of_the_mesh() -> None:
    mesh = stretched()
    refined = operators(mesh, "intrinsic-delaunay-refined")
    assert refined.n > mesh.n_vertices
    for method in ("sweep", "exact"):
        found = GeodesicSolver(refined, method=method).distance(0)
        np.testing.assert_allclose(found, GeodesicSolver(mesh, method=method).distance(0), rtol=1e-9, atol=1e-12)


def test_even_meshes_stay_as_they_are() -> None:
    for mesh in (shapes.icosphere(3), shapes.torus(16, 40), shapes.grid(20)):
        default, plain = operators(mesh, "auto"), operators(mesh)
        assert abs(default.L - plain.L).max() == 0
        assert abs(default.M - plain.M).max() == 0
        assert default.surface is not None
        assert default.surface.uncovered is None


def beside(one: Mesh, other: Mesh) -> Mesh:
    aside = other.V + np.array([0, 40, 0])
    return Mesh(np.concatenate([one.V, aside]), np.concatenate([one.F, other.F + one.n_vertices]))


def test_an_uneven_part_is_refined_beside_an_even_one() -> None:
    sphere, part = shapes.icosphere(4), Mesh(stretched().V / 10, stretched().F)
    mesh = beside(sphere, part)
    solver = HeatMethodSolver(mesh)
    assert mesh.n_vertices < solver.operators.n
    alone = HeatMethodSolver(part)
    assert solver.operators.n - mesh.n_vertices < 1.1 * (alone.operators.n - alone.n_vertices)
    truth = geodesic_distance(part, 7)
    error = mean_error(solver.distance(sphere.n_vertices + 7)[sphere.n_vertices :], truth)
    assert error < 1.5 * mean_error(alone.distance(7), truth)
    # The sphere is as it was.
    near = solver.distance(7)[: sphere.n_vertices] - HeatMethodSolver(sphere).distance(7)
    assert np.abs(near).max() < 1e-9


def test_stray_triangles_are_left_alone() -> None:
    needle = Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-3, 0]], [[0, 1, 2]])
    mesh = beside(shapes.icosphere(3), needle)
    assert operators(mesh, "auto").n == mesh.n_vertices


def test_obtuse_triangles_at_the_boundary_take_the_cover() -> None:
    flat = shapes.grid(20)
    mesh = Mesh(flat.V @ [[1, 0, 0], [3, 1, 0], [0, 0, 1]], flat.F)
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


def test_edge_lengths_alone_are_refined_too() -> None:
    import igl

    mesh = stretched()
    by_lengths = HeatMethodSolver.from_edge_lengths(mesh.F, igl.edge_lengths(mesh.V, mesh.F), t_coef=0.5)
    assert by_lengths.n_vertices == mesh.n_vertices < by_lengths.operators.n
    # With a time step that was asked for, heat is not held to bounds, for which positions are needed.
    assert np.abs(by_lengths.distance(5) - HeatMethodSolver(mesh, t_coef=0.5).distance(5)).max() < 1e-9
