"""An anisotropic metric per face: linear maps of the plane, first fundamental forms, refraction."""

from typing import Any

import igl
import numpy as np
import pytest
from conftest import flat_perturbed, mean_error, perturbed, two_halves

import heat_igl
from heat_igl import fibre_metric, metric_operators, shapes
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators
from heat_igl.reference import edge_paths
from heat_igl.typing import FloatArray
from heat_igl.validation.random_shapes import FAMILIES


def distance(domain: Operators, source: Any = 0, method: str = "heat") -> FloatArray:
    if method != "heat":
        return heat_igl.GeodesicSolver(domain, method=method).distance(source)
    return heat_igl.HeatMethodSolver(domain).distance(source)


def stretch(ratio: float, degrees: float = 30.0) -> FloatArray:
    """A linear map of the plane with singular values `ratio` and 1."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return np.asarray(np.diag([ratio, 1.0, 1.0]) @ turn)


def test_metrics_in_the_plane_of_each_face_and_in_space():
    mesh = perturbed(shapes.torus(9, 20))
    x = mesh.V[mesh.F[:, 1]] - mesh.V[mesh.F[:, 0]]
    y = mesh.V[mesh.F[:, 2]] - mesh.V[mesh.F[:, 0]]
    normal = np.cross(x, y)
    axes = np.stack([x, np.cross(normal, x)], axis=1)
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    rng = np.random.default_rng(0)
    base = rng.normal(size=(3, 3))
    in_space = (base.T @ base + 0.1 * np.eye(3)) * rng.choice([1, 4, 100], mesh.n_faces)[:, None, None]
    in_plane = axes @ in_space @ np.swapaxes(axes, 1, 2)
    one, other = (metric_operators(mesh, metric, laplacian="cotan") for metric in (in_space, in_plane))
    assert abs(one.L - other.L).max() < 1e-9 * abs(one.L).max()
    assert abs(one.D @ one.G - one.L).max() < 1e-9 * abs(one.L).max()
    area = np.sqrt(np.linalg.det(in_plane)) * mesh.measures
    np.testing.assert_allclose(one.weights, area, rtol=1e-9)
    # |dx|^2 in the metric is the trace of its inverse on the coordinates' differentials.
    gradient = (one.G @ mesh.V).reshape(2, mesh.n_faces, 3)
    trace = np.trace(np.linalg.inv(in_plane), axis1=1, axis2=2)
    np.testing.assert_allclose((gradient**2).sum(axis=(0, 2)), trace, rtol=1e-9)
    one, other = fibre_metric([[2, 1], [0, 1]], [1.0, 2.0], 3.0), fibre_metric([[0, 1, 0]], 2.0, 3.0)
    np.testing.assert_array_equal(one, [*fibre_metric([[2, 1, 0]], 1.0, 3.0), *other])


@pytest.mark.parametrize("speed", [1.05, 1.5])
def test_lengths_of_edges_of_three_faces(speed):
    """At the spine of a book, edges have the mean of what the three pages say, or no length if one differs by far."""
    mesh = shapes.book(3, 6)
    is_fast = mesh.V[mesh.F].mean(axis=1)[:, 1] > 1e-9
    assert is_fast.mean() == pytest.approx(1 / 3)
    surface = heat_igl.speed_operators(mesh, np.where(is_fast, speed, 1.0)).surface
    assert (surface is None) == (speed > 1.1)
    if surface is not None:
        at_spine = np.hypot(*mesh.V[mesh.F, :2].T).T < 1e-9
        f, c = np.nonzero((at_spine.sum(axis=1) == 2)[:, None] & ~at_spine)
        assert len(f) == 3 * 6
        given = igl.edge_lengths(mesh.V, mesh.F)[f, c]
        np.testing.assert_allclose(surface.faces.l[f, c], given * (2 + 1 / speed) / 3, rtol=1e-12)


def test_a_piecewise_constant_metric_that_fits_together():
    """Half of a square is stretched across the border, along which both halves agree: a rectangle."""
    mesh = two_halves(24)
    V = mesh.V.copy()
    V[:, 0] += 2 * np.maximum(V[:, 0] - 0.5, 0)
    is_right = mesh.V[mesh.F][:, :, 0].mean(axis=1) > 0.5
    domain = metric_operators(mesh, np.where(is_right[:, None, None], np.diag([9.0, 1, 1]), np.eye(3)))
    assert domain.surface is not None
    exact = np.linalg.norm(V - V[100], axis=1)
    for method in ("sweep", "exact"):
        assert mean_error(distance(domain, 100, method=method), exact) < 1e-6
    assert mean_error(distance(domain, 100), exact) < 0.015


@pytest.mark.parametrize("V", [np.eye(3), np.eye(4, 3)], ids=["triangle", "tetrahedron"])
def test_a_speed_in_a_single_simplex(V):
    domain = heat_igl.speed_operators((V, [range(len(V))]), [2.0])
    np.testing.assert_allclose(distance(domain, 0, "auto"), np.linalg.norm(V - V[0], axis=1) / 2, rtol=1e-14)


def test_points_are_sources_in_a_metric():
    """Of windows, also where distance from vertices is that of the Hopf-Lax formula."""
    mesh, A = flat_perturbed(shapes.grid(12), 0.25), stretch(5.0)
    inside = heat_igl.SurfacePoints([100], [[0.2, 0.3, 0.5]])
    place = inside.barycentric[0] @ mesh.V[mesh.F[100]]
    exact = np.linalg.norm((mesh.V - place) @ A.T, axis=1)
    domain = metric_operators(mesh, np.tile(A.T @ A, (mesh.n_faces, 1, 1)))
    np.testing.assert_allclose(heat_igl.GeodesicSolver(domain).distance(inside), exact, rtol=1e-9)
    domain = metric_operators(mesh, np.eye(3) / (1 + mesh.V[:, 1])[:, None, None] ** 2)
    np.testing.assert_array_equal(distance(domain, inside, "auto"), distance(domain, inside, "exact"))


def test_a_metric_that_varies_by_rounding_is_constant():
    square, rng = shapes.grid(16), np.random.default_rng(0)
    with_corner = square.F[(square.V[square.F].mean(axis=1)[:, :2] < 0.5).any(axis=1)]
    for faces in (square.F, with_corner):
        mesh = Mesh(*igl.remove_unreferenced(square.V, faces)[:2])
        g = np.diag([1.0, 4.0, 1.0]) * (1 + 1e-7 * rng.random(mesh.n_vertices))[:, None, None]
        source = int(np.argmax(mesh.V[:, 0]))
        found = distance(metric_operators(mesh, g), source, "auto")
        assert found == pytest.approx(distance(Mesh(mesh.V * [1, 2, 1], mesh.F), source, "exact"), rel=1e-6)


@pytest.mark.filterwarnings("ignore:the metric changes farther", "ignore:heat is off")
@pytest.mark.parametrize("ratio", [1.05, 3.0])
@pytest.mark.parametrize("mesh", [shapes.icosphere(2), shapes.box(4)], ids=["triangles", "tetrahedra"])
def test_distance_scales_with_the_unit_of_the_metric_and_of_positions(mesh, ratio):
    """By powers of two, as others round, which the formula may raise to 1e-4. On coarse spheres windows are nearer."""
    for x in (mesh.V, mesh.V[mesh.F].mean(axis=1)):
        g = fibre_metric(np.cos(2 * x[:, [1, 2, 0]]), 1.0, ratio)
        is_surface = metric_operators(mesh, g).surface is not None
        assert heat_igl.GeodesicSolver(metric_operators(mesh, g)).plan.engine == (
            "windows" if is_surface else "hopf-lax"
        )
        for method in ["auto", "heat"] + ["exact", "sweep"] * is_surface:
            expected = distance(metric_operators(mesh, g), 5, method)
            for unit in (2.0**-10, 8.0, 2.0**13):
                for domain in (metric_operators(mesh, unit**2 * g), metric_operators(Mesh(unit * mesh.V, mesh.F), g)):
                    assert distance(domain, 5, method) == pytest.approx(unit * expected, rel=1e-9)


def test_what_is_orthogonal_to_a_flat_mesh_plays_no_part():
    metric = np.where((np.arange(18) == 4)[:, None, None], np.diag([1, 1, -1]), np.eye(3))
    assert metric_operators(shapes.grid(3), metric).n_given == 16


def test_flips_that_would_join_a_vertex_with_itself():
    """A triangle between them is none in space: an error named a face that the mesh does not have."""
    mesh = FAMILIES["random tetrahedra"](9)
    domain = heat_igl.speed_operators(mesh, np.where(mesh.V[mesh.F].mean(axis=1)[:, 0] > 0.5, 50.0, 1.0))
    assert (heat_igl.GeodesicSolver(domain).distance(0) <= edge_paths(mesh, 0) * (1 + 1e-9)).all()


@pytest.mark.filterwarnings("ignore:the metric changes farther")
def test_smooth_fibres_on_triangles_that_are_thin_in_the_metric():
    """On the coarse grid lengths along edges make some triangles flat. That raised a TypeError, or added vertices."""

    def fibres(mesh):
        angle = np.pi / 4 + 0.1 * (mesh.V[:, 0] + mesh.V[:, 1] ** 2)
        along = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        return metric_operators(mesh, fibre_metric(along, 1.0, 10.0))

    coarse = fibres(shapes.grid(4))
    fine = distance(fibres(shapes.grid(4).halved().halved().halved()), method="auto")[: coarse.n]
    assert distance(coarse, method="auto") == pytest.approx(fine, rel=0.01)
    assert coarse.M.sum() == pytest.approx(10, rel=0.05)  # the area
