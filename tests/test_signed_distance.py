"""Signed distance: sizes against closed forms, signs against the pieces of the cut mesh, broken curves, errors."""

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import flat_perturbed, zoo
from scipy.sparse.linalg import spsolve
from scipy.spatial import Delaunay
from surfaces import nearest_vertex

from heat_igl import (
    AccuracyWarning,
    Mesh,
    OrientedPoints,
    SignedHeatSolver,
    SourceError,
    SurfaceCurve,
    closest_points,
    curve_on,
    cut,
    edge_curve,
    geodesic_distance,
    isolines,
    shapes,
)
from heat_igl.heat import signed_heat
from heat_igl.mesh import region_boundary
from heat_igl.sources import oriented_set


def ring(mesh: Mesh, radius: float = 0.3, start: float = 0.0, end: float = 2 * np.pi) -> SurfaceCurve:
    """A circle on a unit square, or an arc of it, counter-clockwise seen from +z."""
    closed = end - start > 2 * np.pi - 1e-9
    angle = np.linspace(start, end, int(720 * (end - start) / (2 * np.pi)), endpoint=not closed)
    positions = np.stack([0.5 + radius * np.cos(angle), 0.5 + radius * np.sin(angle), 0 * angle], axis=1)
    return curve_on(mesh, positions, closed=closed)


def plane(n: int) -> tuple[Mesh, SurfaceCurve, np.ndarray]:
    mesh = flat_perturbed(shapes.grid(n), 0.2)
    return mesh, ring(mesh), np.linalg.norm(mesh.V - [0.5, 0.5, 0], axis=1) - 0.3


def sphere(n: int) -> tuple[Mesh, SurfaceCurve, np.ndarray]:
    # Around the pole, counter-clockwise seen from outside: the pole is inside.
    mesh = shapes.icosphere({20: 3, 40: 4, 80: 5}[n])
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    circle = 0.6 * np.stack([np.cos(angle), np.sin(angle), np.full(len(angle), 4 / 3)], axis=1)
    latitude = np.arctan2(np.linalg.norm(mesh.V[:, :2], axis=1), mesh.V[:, 2])
    return mesh, curve_on(mesh, circle, closed=True), latitude - np.arctan2(3, 4)


def cylinder(n: int) -> tuple[Mesh, SurfaceCurve, np.ndarray]:
    mesh = shapes.cylinder(2 * n, n, 2.0)
    level = mesh.V[:, 2].min() + 0.77
    # Lower values are on the left.
    return mesh, isolines(mesh, mesh.V[:, 2], level)[0][0], mesh.V[:, 2] - level


def mean_error(distance: np.ndarray, truth: np.ndarray) -> float:
    """As a share of the mean distance."""
    return float(np.abs(distance - truth).mean() / np.abs(truth).mean())


@pytest.mark.parametrize("surface", [plane, sphere, cylinder])
def test_circles_converge_and_are_exact_on_the_polyhedron(surface):
    errors, of_mesh = [], []
    for n in (20, 40, 80):
        mesh, circle, truth = surface(n)
        # The time step in proportion to h: in proportion to h^2, the directions of a grid stay in the normals.
        errors.append(mean_error(SignedHeatSolver(mesh, t_coef=n / 80).distance(circle), truth))
        distance = SignedHeatSolver(mesh).distance(circle)
        polyhedral = np.copysign(geodesic_distance(mesh, circle, method="exact"), truth)
        far = np.abs(truth) > 1e-3
        np.testing.assert_allclose(distance[far], polyhedral[far], atol=1e-12)
        of_mesh.append(mean_error(polyhedral, truth))
    # First order; on the cylinder the field is exact at once.
    assert errors[2] < 0.002
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0] or errors[0] < 1e-9
    # Second order, or the surface is flat and only the circle is a polygon.
    assert of_mesh[2] < 0.3 * of_mesh[1] < 0.09 * of_mesh[0] or max(of_mesh) < 2e-5


def drawn(kind: str, mesh: Mesh, values: np.ndarray, seed: int) -> list[SurfaceCurve]:
    """Curves around a region of low values, with the region on their left."""
    level = float(np.quantile(values, 0.3 + 0.1 * (seed % 5)))
    if kind == "across faces":
        return isolines(mesh, values, level)[0]
    if kind == "through vertices":
        return isolines(mesh, values, values[np.argsort(values)[len(values) // 2 + seed]])[0]
    if kind == "along edges":
        return region_boundary(mesh, faces=values[mesh.F].mean(axis=1) < level)
    return region_boundary(mesh, vertices=values < level)


@pytest.mark.parametrize("kind", ["across faces", "through vertices", "along edges", "through midpoints"])
@pytest.mark.parametrize("name", ["sphere", "torus", "square"])
def test_signs_are_those_of_the_pieces(name, kind):
    mesh = {
        "sphere": lambda: shapes.icosphere(3),
        "torus": lambda: shapes.torus(30, 16),
        "square": lambda: plane(24)[0],
    }[name]()
    solver = SignedHeatSolver(mesh)
    rng = np.random.default_rng(7)
    for seed in range(3):
        waves = rng.normal(size=(3, 5)) * 2.5
        values = np.sin(mesh.V @ waves + rng.uniform(0, 6, 5)).sum(axis=1)
        curves = drawn(kind, mesh, values, seed)
        pieces = cut(mesh, curves)
        left, right = (set(side.tolist()) for side in pieces.pieces[pieces.sides].T)
        assert not left & right
        is_left = np.zeros(pieces.mesh.n_vertices, bool)
        is_left[pieces.mesh.F[np.isin(pieces.pieces, sorted(left))]] = True
        far = geodesic_distance(mesh, curves) > mesh.edge_lengths.mean() / 2
        distance = solver.distance(curves)
        np.testing.assert_array_equal(distance[far] < 0, is_left[: mesh.n_vertices][far])


def test_size_turn_and_order_of_the_faces_do_not_matter():
    mesh, circle, _ = sphere(20)
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    moved = Mesh(1e3 * mesh.V @ (turn * np.sign(np.linalg.det(turn))) + 5, mesh.F)
    here, there = (SignedHeatSolver(m).distance(circle) for m in (mesh, moved))
    np.testing.assert_allclose(there, 1e3 * here, atol=1e-6)
    order = np.random.default_rng(1).permutation(mesh.n_faces)
    place = np.argsort(order)
    shuffled = SurfaceCurve(place[circle.faces], np.roll(circle.start, 1, 1), np.roll(circle.end, 1, 1))
    other = SignedHeatSolver(Mesh(mesh.V, np.roll(mesh.F, 1, axis=1)[order])).distance(shuffled)
    np.testing.assert_allclose(other, here, atol=1e-9)


def test_masks_are_the_boundaries_of_their_regions_and_reversed_curves_change_the_sign():
    mesh, circle, truth = plane(20)
    solver = SignedHeatSolver(mesh)
    np.testing.assert_allclose(solver.distance(circle.reversed()), -solver.distance(circle), atol=1e-12)
    inside = truth < 0
    of_vertices = solver.distance(inside)
    np.testing.assert_array_equal(of_vertices < 0, inside)
    np.testing.assert_array_equal(of_vertices, solver.distance(region_boundary(mesh, vertices=inside)))
    faces = inside[mesh.F].all(axis=1)
    np.testing.assert_array_equal(solver.distance(faces), solver.distance(region_boundary(mesh, faces=faces)))


@pytest.mark.parametrize("removed", [0.1, 0.3, 0.45])
def test_broken_circles(removed):
    mesh, _, truth = plane(40)
    n_arcs = 5
    width = 2 * np.pi / n_arcs
    arcs = [ring(mesh, start=i * width, end=(i + 1 - removed) * width) for i in range(n_arcs)]
    far = np.abs(truth) > 0.05
    distance = SignedHeatSolver(mesh).distance(arcs)
    assert mean_error(distance, truth) < 0.04
    np.testing.assert_array_equal(distance[far] < 0, truth[far] < 0)


OPEN = {
    "arcs": lambda mesh: [ring(mesh, start=angle, end=angle + 0.9) for angle in (0, 2, 4)],
    "half a level": lambda mesh: curve_on(mesh, [[0.2, 0.31, 0], [0.55, 0.4, 0]]),
    "edges": lambda mesh: edge_curve(mesh, np.arange(205, 215)),
    "in one face": lambda _: SurfaceCurve([300], [[0.3, 0.3, 0.4]], [[0.1, 0.5, 0.4]]),
    "two levels": lambda mesh: isolines(mesh, mesh.V @ [1, 0.3, 0], [0.4, 0.8]),
    "around a handle": lambda mesh: isolines(mesh, np.arctan2(mesh.V[:, 1], mesh.V[:, 0]), 0.3)[0][0],
}


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
@pytest.mark.parametrize("kind", OPEN)
def test_the_sign_changes_only_at_zero(kind):
    """Along no edge does the distance change by more than its length, whatever the curves leave open."""
    mesh = shapes.torus(30, 16) if kind == "around a handle" else plane(24)[0]
    curves = OPEN[kind](mesh)
    distance = SignedHeatSolver(mesh).distance(curves)
    assert (np.ptp(distance[mesh.edges], axis=1) <= mesh.edge_lengths + 1e-9).all()
    assert (np.abs(distance) <= geodesic_distance(mesh, curves) + 1e-12).all()
    assert 0 < (distance < 0).mean() < 1


def test_a_border_that_is_mostly_gaps_warns():
    """Heat closes the circle again; that smaller gaps do not warn is tested above."""
    mesh, _, _ = plane(40)
    arcs = [ring(mesh, start=angle, end=angle + 0.6) for angle in (0, np.pi)]
    with pytest.warns(AccuracyWarning, match="of the border between the two sides runs through gaps") as caught:
        SignedHeatSolver(mesh).distance(arcs)
    told = float(str(caught[0].message).partition("%")[0]) / 100
    assert told == pytest.approx(1 - 0.6 / np.pi, abs=0.05)


def test_where_heat_contradicts_the_sides_these_are_taken_with_a_warning():
    mesh, _, _ = plane(40)
    # Heat does not resolve two curves in opposite directions nearer to each other than an edge, and sees none.
    arcs = [ring(mesh, end=1.5 * np.pi), ring(mesh, 0.31, end=np.pi).reversed()]
    with pytest.warns(AccuracyWarning, match=r"at \d+ of the \d+ vertices beside the curves, first at vertex \d+"):
        distance = SignedHeatSolver(mesh).distance(arcs)
    x, y = (mesh.V - [0.5, 0.5, 0])[:, :2].T
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    off = np.minimum(np.abs(radius - 0.3), np.abs(radius - 0.31))
    # So near that the nearest place is in a face of the vertex, and not within the polygons' error of a curve.
    beside = (off < 0.2 / 40) & (off > 1e-4) & (angle > 0.1) & (angle < np.pi - 0.1)
    assert beside.sum() > 10
    np.testing.assert_array_equal(distance[beside] > 0, (radius[beside] > 0.3) & (radius[beside] < 0.31))


def test_points_with_normals():
    mesh, _, truth = plane(40)
    angle = np.random.default_rng(3).uniform(0, 2 * np.pi, 60)
    normals = np.stack([np.cos(angle), np.sin(angle), 0.5 + 0 * angle], axis=1)
    places = closest_points(mesh, [0.5, 0.5, 0] + 0.3 * normals * [1, 1, 0]).points
    samples = OrientedPoints(places, normals)
    far = np.abs(truth) > 0.05
    distance = SignedHeatSolver(mesh).distance(samples)
    assert mean_error(distance, truth) < 0.06
    np.testing.assert_array_equal(distance[far] < 0, truth[far] < 0)
    in_plane = OrientedPoints(places, normals[:, :2])
    np.testing.assert_array_equal(in_plane.normals, normals * [1, 1, 0])
    mixed = SignedHeatSolver(mesh).distance([samples, ring(mesh)])
    assert mean_error(mixed, truth) < 0.03


@pytest.mark.parametrize("level", [None, "zero", "none"])
@pytest.mark.parametrize("kind", ["points", "curve"])
def test_unsigned_sources_among_signed_curves(kind, level):
    mesh, circle, _ = plane(34)
    # Through both sides of the circle, and in both.
    line = curve_on(mesh, [[0.1, 0.52, 0], [0.9, 0.47, 0]])
    points = [nearest_vertex(mesh, p) for p in ([0.5, 0.45, 0], [0.05, 0.05, 0])]
    unsigned = {"points": points, "curve": line}[kind]
    solver = SignedHeatSolver(mesh)
    alone, both = solver.distance(circle, level=level), solver.distance(circle, unsigned=unsigned, level=level)
    nearest = geodesic_distance(mesh, unsigned, method="exact")
    np.testing.assert_array_equal((both < 0)[both != 0], (alone < 0)[both != 0])
    np.testing.assert_allclose(np.abs(both), np.minimum(np.abs(alone), nearest), atol=1e-12)
    assert 0 < (nearest < np.abs(alone)).sum() < mesh.n_vertices


def on_curves(mesh: Mesh, curves: list[SurfaceCurve], values: np.ndarray) -> float:
    """Root mean square of values along curves, in mean edge lengths."""
    middle = np.concatenate([np.einsum("sc,sc->s", (c.start + c.end) / 2, values[mesh.F[c.faces]]) for c in curves])
    length = np.concatenate([curve.lengths(mesh) for curve in curves])
    return float(np.sqrt(np.average(middle**2, weights=length)) / mesh.edge_lengths.mean())


@pytest.mark.parametrize("seed", range(6))
def test_regions_of_faces_on_unevenly_spread_points(seed):
    """Every vertex off the border has the sign of its faces, and the size is exact between triangles of all sizes."""
    rng = np.random.default_rng(seed)
    P = np.zeros((400, 3))
    P[:, :2] = rng.random((6, 2))[rng.integers(6, size=400)] + rng.normal(size=(400, 2)) * 10 ** rng.uniform(-3, -0.5)
    F = Delaunay(P[:, :2]).simplices
    x, y = P[F][:, :, :2].transpose(2, 0, 1)
    turned = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) < (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    mesh = Mesh(P, np.where(turned[:, None], F[:, ::-1], F))
    region = rng.random(mesh.n_faces) < 0.3
    region |= np.linalg.norm(mesh.V[mesh.F].mean(axis=1) - mesh.V[0], axis=1) < 0.3
    distance = SignedHeatSolver(mesh).distance(region)
    n_inside = np.bincount(mesh.F[region].ravel(), minlength=mesh.n_vertices)
    n_faces = np.bincount(mesh.F.ravel(), minlength=mesh.n_vertices)
    assert (distance[n_inside == n_faces] < 0).all()
    assert (distance[n_inside == 0] > 0).all()
    border = region_boundary(mesh, faces=region)
    np.testing.assert_allclose(np.abs(distance), geodesic_distance(mesh, border, method="exact"), atol=1e-12)


def test_a_time_step_or_a_level_asks_for_the_integrated_distance():
    mesh, circle, _ = plane(34)
    solver = SignedHeatSolver(mesh)
    integrated = SignedHeatSolver(mesh, t=solver.t).distance(circle)
    np.testing.assert_array_equal(integrated, solver.distance(circle, level="zero"))
    np.testing.assert_array_equal(integrated, SignedHeatSolver(mesh, t_coef=0.25).distance(circle))
    assert np.abs(integrated - solver.distance(circle)).max() > 1e-4
    with_points = [circle, OrientedPoints(closest_points(mesh, [[0.82, 0.5, 0]]).points, [[1, 0, 0]])]
    np.testing.assert_array_equal(solver.distance(with_points), solver.distance(with_points, level="zero"))


def test_a_curve_in_triangles_much_larger_than_the_mean():
    fine, coarse = shapes.grid(40), shapes.grid(3)
    V = np.concatenate([0.01 * fine.V, np.add(coarse.V, [1, 0, 0])])
    mesh = Mesh(V, np.concatenate([fine.F, coarse.F + fine.n_vertices]))
    line = isolines(mesh, V[:, 0], 1.5)[0]
    distance = SignedHeatSolver(mesh).distance(line)
    np.testing.assert_allclose(np.abs(distance[fine.n_vertices :]), np.abs(coarse.V[:, 0] - 0.5), atol=1e-12)
    assert np.isinf(distance[: fine.n_vertices]).all()


@pytest.mark.parametrize(
    "mesh", [shapes.icosphere(3), shapes.torus(40, 20), shapes.blob(3)], ids=["sphere", "torus", "blob"]
)
def test_curves_with_bends_are_near_zero(mesh):
    solver, rng = SignedHeatSolver(mesh), np.random.default_rng(0)
    for _ in range(3):
        values = np.sin(mesh.V @ rng.normal(size=(3, 5)) * 2 + rng.uniform(0, 6, 5)).sum(axis=1)
        curves = isolines(mesh, values, float(np.quantile(values, 0.4)))[0]
        near = on_curves(mesh, curves, solver.distance(curves, level="zero"))
        assert near < 0.03
        assert near < on_curves(mesh, curves, solver.distance(curves, level="none")) / 10


@pytest.mark.parametrize("kind", ["faces", "half of a boundary", "cut"])
def test_vertices_on_curves_are_zero(kind):
    mesh = shapes.blob(3)
    (boundary,) = region_boundary(mesh, faces=mesh.V[mesh.F].mean(axis=1) @ [0.3, 0.5, 0.8] < 0.1)
    half = SurfaceCurve(*(column[: len(boundary) // 2] for column in (boundary.faces, boundary.start, boundary.end)))
    curve = boundary if kind == "faces" else half
    if kind == "cut":
        found = cut(*sphere(20)[:2])
        mesh, curve = found.mesh, [edge_curve(found.mesh, edge) for edge in found.edges]
    on_curve = np.unique(cut(mesh, curve).edges)
    solver = SignedHeatSolver(mesh)
    np.testing.assert_array_equal(solver.distance(curve)[on_curve], 0)
    np.testing.assert_array_equal(solver.distance(curve, level="zero")[on_curve], 0)
    assert (solver.distance(curve, level="none")[on_curve] != 0).any()


def test_the_smooth_part_of_the_level_is_the_least_one(monkeypatch):
    """Conjugate gradients against the normal equations, on two components of different size."""
    small, large = shapes.icosphere(2), shapes.torus(16, 10)
    V = np.concatenate([0.3 * small.V, np.add(large.V, [5, 0, 0])])
    mesh = Mesh(V, np.concatenate([small.F, large.F + small.n_vertices]))
    curves = isolines(mesh, V @ [0.2, 0.4, 0.9], 0.1)[0]
    solver = SignedHeatSolver(mesh)
    domain, integration = solver.operators, solver._integration
    pieces = integration._pieces(oriented_set(curves, mesh))
    values = np.sin(5 * pieces.barycentric[:, 0] + pieces.faces)
    h = domain.mean_edge_lengths[pieces.component]
    rows = np.repeat(np.arange(len(values)), 3)
    B = sp.csr_array((pieces.barycentric.ravel(), (rows, mesh.F[pieces.faces].ravel())), shape=(len(values), len(V)))
    weighted = B.T @ sp.diags_array(pieces.weight / h)
    truth = spsolve(sp.csc_array(-domain.L + weighted @ B), weighted @ values)
    off = []
    for steps in (3, 200):
        monkeypatch.setattr(signed_heat, "_SMOOTH_STEPS", steps)
        found = integration._smooth(values, pieces)
        off.append(np.abs(found - truth).max() / np.abs(truth).max())
    assert off[1] < 1e-9
    assert off[0] < 0.2


def test_curves_come_in_lists_of_any_depth():
    mesh, _, _ = plane(20)
    nested = isolines(mesh, np.linalg.norm(mesh.V - [0.5, 0.5, 0], axis=1), [0.2, 9, 0.4])
    flat = [curve for level in nested for curve in level]
    solver = SignedHeatSolver(mesh)
    for level in (None, "zero", "constant"):
        np.testing.assert_array_equal(solver.distance(nested, level=level), solver.distance(flat, level=level))
    is_inside = mesh.V[:, 0] < 0.3
    np.testing.assert_array_equal(solver.distance([[is_inside.tolist()]]), solver.distance(is_inside))
    np.testing.assert_array_equal(cut(mesh, nested).curve, cut(mesh, flat).curve)


def test_levels():
    mesh, _, _ = plane(40)
    solver = SignedHeatSolver(mesh)
    rings = [ring(mesh, 0.2), ring(mesh, 0.4)]
    from_centre = np.linalg.norm(mesh.V - [0.5, 0.5, 0], axis=1)
    means = {}
    for level in ("zero", "constant", "none"):
        phi = solver.distance(rings, level=level)
        means[level] = [
            np.average(np.einsum("sc,sc->s", c.start, phi[mesh.F[c.faces]]), weights=c.lengths(mesh)) for c in rings
        ]
    # Both rings are level lines of the same field, 0.2 apart.
    assert np.diff(means["constant"])[0] == pytest.approx(0.2, rel=0.03)
    np.testing.assert_allclose(means["zero"], 0, atol=0.01)
    np.testing.assert_allclose(np.dot(means["none"], [0.2, 0.4]), 0, atol=1e-3)
    phi = solver.distance(rings, level="constant")
    np.testing.assert_allclose(phi - phi.mean(), from_centre - from_centre.mean(), atol=0.03)


def test_components_without_a_curve_are_not_reached():
    one, circle, _ = plane(12)
    n = one.n_vertices
    both = Mesh(np.vstack([one.V, one.V + np.array([5, 0, 0]), [[9, 9, 9]]]), np.vstack([one.F, one.F + n]))
    for unsigned in (None, 0):
        alone = SignedHeatSolver(one).distance(circle, unsigned=unsigned)
        distance = SignedHeatSolver(both).distance(circle, unsigned=unsigned)
        np.testing.assert_allclose(distance[:n], alone, atol=1e-9)
        np.testing.assert_array_equal(distance[n:], np.inf)
    # A small component keeps the time step of its own.
    small = Mesh(np.vstack([one.V, 1e-3 * one.V + [5, 0, 0]]), np.vstack([one.F, one.F + n]))
    moved = SurfaceCurve(circle.faces + one.n_faces, circle.start, circle.end, is_closed=True)
    found = SignedHeatSolver(small).distance([circle, moved])
    np.testing.assert_allclose(found[n:], 1e-3 * found[:n], atol=1e-9)


def test_curves_that_contradict_each_other():
    mesh, circle, truth = plane(34)
    solver = SignedHeatSolver(mesh)
    backward = circle.reversed()
    with pytest.raises(SourceError, match="the normals of the curves cancel"):
        solver.distance([circle, backward])
    # The majority decides, whatever the order, and so do the longer pieces of a broken curve.
    for curves in ([circle, backward, circle], [backward, circle, circle]):
        far = np.abs(truth) > 0.02
        np.testing.assert_array_equal(solver.distance(curves)[far] < 0, truth[far] < 0)
    arcs = [ring(mesh, end=1.5 * np.pi), ring(mesh, start=1.6 * np.pi, end=1.9 * np.pi).reversed()]
    # Away from the arc that runs backward, and from the ends of the other.
    x, y = (mesh.V - [0.5, 0.5, 0])[:, :2].T
    away = (np.abs(truth) > 0.05) & ((x < 0) | (y > 0.15))
    np.testing.assert_array_equal(solver.distance(arcs)[away] < 0, truth[away] < 0)


def test_an_open_curve_has_a_left_and_a_right_beside_it():
    mesh, _, truth = plane(34)
    arc = ring(mesh, end=1.2 * np.pi)
    # A curve that only claims to be closed is open: the ends decide.
    claims = SurfaceCurve(arc.faces, arc.start, arc.end, is_closed=True)
    solver = SignedHeatSolver(mesh)
    distance = solver.distance(arc)
    np.testing.assert_allclose(solver.distance(claims), distance, atol=1e-12)
    assert np.isfinite(distance).all()
    beside = (mesh.V[:, 1] > 0.55) & (np.abs(truth) > 0.02)
    np.testing.assert_array_equal(distance[beside] < 0, truth[beside] < 0)
    # Cut along it, the surface stays in one piece, since there is no other side.
    assert len(cut(mesh, arc).split()) == 1
    assert len(cut(mesh, ring(mesh)).split()) == 2


def test_sides_come_from_the_cut_on_meshes_with_edges_of_more_than_two_faces():
    mesh = shapes.book(3, 8)
    on_page = mesh.V[mesh.F[0]].mean(axis=0)
    height = np.linalg.norm(mesh.V - on_page, axis=1)
    curves = isolines(mesh, height, 0.3)[0]
    pieces = cut(mesh, curves)
    left = np.unique(pieces.pieces[pieces.sides[:, 0]])
    is_left = np.zeros(pieces.mesh.n_vertices, bool)
    is_left[pieces.mesh.F[np.isin(pieces.pieces, left)]] = True
    np.testing.assert_array_equal(is_left[: mesh.n_vertices], height < 0.3)


def test_regions_with_a_common_border_are_both_inside():
    mesh, rng = shapes.torus(16, 30), np.random.default_rng(0)
    solver, middles = SignedHeatSolver(mesh), mesh.V[mesh.F].mean(axis=1)
    for _ in range(12):
        centres = middles[rng.integers(0, mesh.n_faces, 3)]
        region = np.linalg.norm(middles[:, None] - centres, axis=2).argmin(axis=1)
        phi = solver.distance([region == 0, region == 1])
        inside, outside = np.unique(mesh.F[region < 2]), np.unique(mesh.F[region == 2])
        assert (phi[np.setdiff1d(inside, outside)] <= 0).all()
        assert (phi[np.setdiff1d(outside, inside)] > 0).all()


@pytest.mark.filterwarnings("ignore::heat_igl.AccuracyWarning")
def test_gaps_do_not_change_other_regions():
    spiral, sphere = zoo("spiral"), shapes.icosphere(3)
    distance = geodesic_distance(spiral, 0)
    near, far = (isolines(spiral, distance, [share * distance.max()])[0][0] for share in (0.5, 0.6))
    loop = isolines(sphere, sphere.V[:, 2], 0.1)[0][0]
    part = SurfaceCurve(loop.faces[:40] + spiral.n_faces, loop.start[:40], loop.end[:40])
    both = Mesh(np.vstack([spiral.V, sphere.V + 50]), np.vstack([spiral.F, sphere.F + spiral.n_vertices]))
    phi = SignedHeatSolver(both).distance([SurfaceCurve(near.faces, near.start, near.end), part])
    solver = SignedHeatSolver(spiral)
    assert np.abs(phi[: spiral.n_vertices] - solver.distance(near)).max() < 1e-12
    broken = SurfaceCurve(far.faces[:-3], far.start[:-3], far.end[:-3])
    inside = distance < 0.499 * distance.max()
    assert (solver.distance([near, broken])[inside] < 0).all()
