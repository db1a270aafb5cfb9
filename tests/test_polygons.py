"""Polygon meshes: their triangles and virtual vertices, libigl's matrices, and how far off the distances are."""

import pickle

import igl
import numpy as np
import pytest
from surfaces import dual_of_sphere, quads

import heat_igl
from heat_igl.mesh import PolygonFans, PolygonMesh, triangulation
from heat_igl.mesh.polygons import virtual_vertices
from heat_igl.validation import construction, relative_error


def cells(n: int) -> PolygonMesh:
    """The unit square with n by n cells, inner vertices moved in the plane: no symmetry is left."""
    rng = np.random.default_rng(5)
    V, F = quads(n)
    inner = (V[:, :2] % n != 0).all(axis=1)
    V[inner, :2] += rng.uniform(-0.2, 0.2, (inner.sum(), 2))
    return PolygonMesh(V / n, F)


def zigzags(columns: int, rows: int, rise: float) -> PolygonMesh:
    """Octagons of three parallelograms up and down; from a rise of 1 on, no point of one sees every side."""
    x, y = np.meshgrid(np.arange(3 * columns + 1), np.arange(rows + 1))
    V = np.stack([x, y + rise * (x % 2)], axis=2).reshape(-1, 2)
    width = 3 * columns + 1
    first = (np.arange(rows)[:, None] * width + 3 * np.arange(columns)).ravel()
    steps = np.array([0, 1, 2, 3, width + 3, width + 2, width + 1, width])
    return PolygonMesh(V, first[:, None] + steps)


SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
MIXED = PolygonMesh(
    [[0, 0, 0], [1, 0, 0.1], [2, 0, 0], [2, 1, 0.2], [1, 1, 0], [0, 1, 0], [1, 2, 0.3], [0, 2, 0], [3, 3, 3]],
    [[0, 1, 4, 5], [1, 2, 3, 4], [4, 3, 6], [5, 4, 6, 7]],
)


def test_distance_around_a_vertex_is_that_along_sides():
    """Heat alone is a tenth too short there."""
    mesh = dual_of_sphere(3)
    is_source = mesh.corners == 40
    around = np.unique([*mesh.following[is_source], *mesh.corners[mesh.following == 40]])
    exact = np.linalg.norm(mesh.V[around] - mesh.V[40], axis=1)
    assert len(around) == 3
    np.testing.assert_allclose(heat_igl.HeatMethodSolver(mesh).distance(40)[around], exact, rtol=1e-12)
    by_heat = heat_igl.HeatMethodSolver(mesh, magnitude="unit").distance(40)
    assert np.abs(by_heat[around] / exact - 1).mean() > 0.05
    found = heat_igl.HeatMethodSolver(mesh).distance([40, 200])
    exact = np.arccos(np.clip(mesh.V @ mesh.V[[40, 200]].T, -1, 1)).min(axis=1)
    assert np.nanmean(relative_error(found, exact)) < 0.012


def test_virtual_vertices_are_those_of_the_paper():
    """libigl has them as affine combinations of the corners."""
    for mesh in (MIXED, cells(6), dual_of_sphere(1)):
        _, _, P = igl.cotmatrix(mesh.V, mesh.corners, np.concatenate([[0], np.cumsum(mesh.degree)]))
        expected = (P @ mesh.V)[mesh.n_vertices :]
        np.testing.assert_allclose(virtual_vertices(mesh), expected, atol=1e-9)
    # Far from planar: no point has a smaller sum of squared areas.
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(7, 3)) + 5
    (middle,) = virtual_vertices(PolygonMesh(corners, [range(7)]))
    around = middle + 1e-3 * np.concatenate([np.zeros((1, 3)), rng.normal(size=(50, 3))])
    one, other = corners - around[:, None], np.roll(corners, -1, axis=0) - around[:, None]
    assert (np.cross(one, other) ** 2).sum(axis=(1, 2)).argmin() == 0


def test_the_laplacian_of_the_paper_is_that_of_the_fans():
    """L = P^T L' P, with L' that of the solver on the triangles as they are."""
    mesh = dual_of_sphere(1)
    L, _, P = igl.cotmatrix(mesh.V, mesh.corners, np.concatenate([[0], np.cumsum(mesh.degree)]))
    on_fans = heat_igl.HeatMethodSolver(mesh, laplacian="cotan").operators.L
    assert abs(P.T @ on_fans @ P - L).max() < 1e-12 * abs(L).max()


@pytest.mark.parametrize("rise", [0.3, 3.0])
def test_fans_cover_polygons_once(rise):
    """A triangle stays, and so do the triangles of a polygon of which no point sees every side."""
    mesh = zigzags(4, 12, rise)
    fans = PolygonFans.of(mesh)
    assert fans.mesh.measures.sum() == pytest.approx(12 * 12, rel=1e-12)
    assert fans.mesh.n_vertices - mesh.n_vertices == (48 if rise < 1 else 0)
    mixed = PolygonFans.of(MIXED)
    assert np.diff(mixed.first).tolist() == [4, 4, 1, 4]
    assert mixed.mesh.F[8].tolist() == MIXED.polygons[2].tolist()


@pytest.mark.parametrize("mesh", [cells(6), zigzags(4, 12, 0.3), zigzags(4, 12, 3.0)], ids=["quads", "bent", "apart"])
def test_places_are_carried_to_fans(mesh):
    """In planar polygons points stay, and a segment is cut into pieces that follow one another."""
    rng = np.random.default_rng(0)
    fans, triangles = PolygonFans.of(mesh), mesh.triangles
    faces = rng.integers(triangles.n_faces, size=40)
    start, end = rng.dirichlet([1, 1, 1], (2, 40))
    start[:3] = np.eye(3)

    def places(on, faces, barycentric):
        return np.einsum("kc,kcx->kx", barycentric, on.V[on.F[faces]])

    np.testing.assert_allclose(places(fans.mesh, *fans.carry(faces, start)), places(triangles, faces, start), atol=1e-9)
    which, inside, one, other = fans.carry_segments(faces, start, end)
    for i in range(40):
        pieces = np.flatnonzero(which == i)
        begins, ends = (places(fans.mesh, inside[pieces], part[pieces]) for part in (one, other))
        np.testing.assert_allclose(begins[1:], ends[:-1], atol=1e-9)
        np.testing.assert_allclose(begins[:1], places(triangles, faces[i : i + 1], start[i : i + 1]), atol=1e-9)
        np.testing.assert_allclose(ends[-1:], places(triangles, faces[i : i + 1], end[i : i + 1]), atol=1e-9)


def test_places_on_bent_polygons_stay_on_their_sides():
    mesh = dual_of_sphere(1)
    fans = PolygonFans.of(mesh)
    t = np.linspace(0, 1, 5)
    faces, barycentric = fans.carry(np.zeros(5, int), np.stack([1 - t, t, 0 * t], axis=1))
    found = np.einsum("kc,kcx->kx", barycentric, fans.mesh.V[fans.mesh.F[faces]])
    a, b = mesh.triangles.V[mesh.triangles.F[0, :2]]
    np.testing.assert_allclose(found, a + t[:, None] * (b - a), atol=1e-12)


def test_heat_on_bent_polygons_is_as_good_as_on_triangles(cow):
    """Without vertices inside the polygons it was 10 % too short here: they couple vertices with negative weights."""
    mesh = construction.dual(cow)
    solvers = heat_igl.HeatMethodSolver(mesh), heat_igl.HeatMethodSolver(mesh.triangles)
    errors = []
    for source in (0, 2000, 4000):
        exact = heat_igl.geodesic_distance(mesh, source, method="exact")
        errors.append([np.nanmean(relative_error(solver.distance(source), exact)) for solver in solvers])
    ours, theirs = np.mean(errors, axis=0)
    assert ours < 1.1 * theirs
    assert ours < 0.02


def test_points_inside_polygons():
    """They lie on ``mesh.triangles``; the error is that from a vertex."""
    errors, from_vertices = [], []
    rng = np.random.default_rng(0)
    for n in (16, 64):
        mesh = cells(n)
        triangles = mesh.triangles
        solver = heat_igl.HeatMethodSolver(mesh)
        faces, shares = rng.integers(triangles.n_faces, size=4), rng.dirichlet([1, 1, 1], 4)
        places = np.einsum("pc,pcx->px", shares, mesh.V[triangles.F[faces]])
        found = solver.distances([heat_igl.SurfacePoints([f], [share]) for f, share in zip(faces, shares, strict=True)])
        exact = np.linalg.norm(mesh.V - places[:, None], axis=2)
        errors.append(np.abs(found - exact).mean())
        # The corners of the face know their distances exactly.
        corners = triangles.F[faces]
        np.testing.assert_allclose(
            np.take_along_axis(found, corners, 1), np.take_along_axis(exact, corners, 1), rtol=1e-9
        )
        vertices = corners[:, 0]
        exact = np.linalg.norm(mesh.V - mesh.V[vertices][:, None], axis=2)
        from_vertices.append(np.abs(solver.distances([[int(v)] for v in vertices]) - exact).mean())
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 1.3 * from_vertices[1]


def test_a_curve_across_polygons():
    mesh = cells(32)
    ends = np.array([[0.13, 0.21, 0], [0.77, 0.64, 0]])
    curve = heat_igl.geodesic_path(mesh.triangles, heat_igl.closest_points(mesh.triangles, ends).points)
    along = ends[1] - ends[0]
    share = np.clip((mesh.V - ends[0]) @ along / (along @ along), 0, 1)
    exact = np.linalg.norm(mesh.V - ends[0] - share[:, None] * along, axis=1)
    found = heat_igl.HeatMethodSolver(mesh).distance(curve)
    assert np.abs(found - exact).mean() < 0.02 * exact.mean()
    labels = heat_igl.HeatMethodSolver(mesh).voronoi([curve, heat_igl.SurfacePoints([0], [[1 / 3] * 3])]).labels
    assert set(labels) == {0, 1}


def test_fans_and_pickles():
    assert MIXED.triangles.F.tolist() == [
        [0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [4, 3, 6], [5, 4, 6], [5, 6, 7],
    ]  # fmt: skip
    again = pickle.loads(pickle.dumps(MIXED))
    assert [p.tolist() for p in again.polygons] == [p.tolist() for p in MIXED.polygons]
    assert np.array_equal(again.V, MIXED.V)
    assert repr(again) == "PolygonMesh(9 vertices, 4 polygons)"


def test_vertices_in_one_place_do_not_stop_the_heat():
    """Refinement would make triangles without area there."""
    mesh = PolygonMesh([[-1, -1, 0], [0, 0, 0], [0, 0, 0], [-2, 0, -1], [-2, 1, -1], [0, -1, -1]],
                       [[1, 0, 4], [0, 3, 4, 2], [1, 3, 2], [1, 5, 2, 4, 3, 0]])  # fmt: skip
    distance = heat_igl.HeatMethodSolver(mesh).distance(0)
    assert distance[1] == pytest.approx(np.sqrt(2), rel=1e-6)
    assert distance[1] == pytest.approx(distance[2], rel=1e-6)


def test_a_corner_on_a_straight_side_is_fine():
    """Where two small neighbours meet a large polygon."""
    mesh = PolygonMesh([*SQUARE, [0.5, 0, 0], [0.5, -0.5, 0], [0, -0.5, 0], [1, -0.5, 0]],
                       [[0, 4, 1, 2, 3], [0, 6, 5, 4], [4, 5, 7, 1]])  # fmt: skip
    fans = PolygonFans.of(mesh).mesh
    assert fans.measures.sum() == pytest.approx(1.5, rel=1e-12)
    assert np.flatnonzero(~fans.boundary[:8]).tolist() == [4]


@pytest.mark.filterwarnings("ignore:.*no face uses 1 of the 9 vertices")
def test_polygons_are_read_from_files(tmp_path):
    off, obj, ply = tmp_path / "a.off", tmp_path / "a.obj", tmp_path / "a.ply"
    rows = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in MIXED.V.tolist())
    counted = "".join(f"{len(p)} {' '.join(map(str, p.tolist()))}\n" for p in MIXED.polygons)
    off.write_text(f"OFF\n9 4 0\n{rows}{counted}")
    obj.write_text(
        "".join(f"v {row}\n" for row in rows.splitlines())
        + "".join(f"f {' '.join(str(v + 1) for v in p)}\n" for p in MIXED.polygons)
    )
    ply.write_text(
        "ply\nformat ascii 1.0\nelement vertex 9\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face 4\nproperty list uchar int vertex_indices\nend_header\n{rows}{counted}"
    )
    for path in (off, obj, ply):
        found = heat_igl.read_polygon_mesh(path)
        assert np.array_equal(found.V, MIXED.V)
        assert [p.tolist() for p in found.polygons] == [p.tolist() for p in MIXED.polygons]
        assert np.array_equal(heat_igl.read_mesh(path).F, found.triangles.F)


L_SHAPE = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0.0]])
_TEETH = [(x + step, y) for x in (6, 4, 2) for step, y in ((1, 3), (0, 3), (0, 1), (-1, 1))]
COMB = np.array([(x, y, 0.0) for x, y in [(0, 0), (7, 0), *_TEETH, (1, 3), (0, 3)]])
STAR = np.array([[(1 + i % 2) * np.cos(i * np.pi / 5), (1 + i % 2) * np.sin(i * np.pi / 5), 0] for i in range(10)])
SLIT = np.array([[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 4, 0], [2, 1, 0], [2, 4, 0], [0, 4, 0.0]])


# A strip that goes around more than once, over itself.
_AROUND = np.linspace(0, 2.55 * np.pi, 21)
RAMP = np.array(
    [
        ((r + 0.02 * a) * np.cos(a), (r + 0.02 * a) * np.sin(a), 0)
        for r in (2, 1)
        for a in _AROUND[:: 1 if r > 1 else -1]
    ]
)


def turned(V: np.ndarray) -> np.ndarray:
    """In another plane, far from the origin, in another unit."""
    axes = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    return 1e-3 * (V @ axes) + [5, -7, 2]


@pytest.mark.parametrize("V", [L_SHAPE, COMB, STAR, SLIT], ids=["L", "comb", "star", "slit"])
@pytest.mark.parametrize("place", [lambda V: V, turned])
@pytest.mark.parametrize("reverse", [False, True])
def test_triangles_of_concave_polygons_cover_them_once(V, place, reverse):
    flat, d = V[:, :2], len(V)
    following = np.roll(flat, -1, axis=0)
    area = abs((flat[:, 0] * following[:, 1] - flat[:, 1] * following[:, 0]).sum()) / 2
    for first in range(d):
        order = np.roll(np.arange(d), first)[:: -1 if reverse else 1]
        triangles = PolygonMesh(place(V), [order]).triangles
        assert triangles.n_faces == d - 2
        unit = 1 if place(V) is V else 1e-6
        assert triangles.measures.sum() == pytest.approx(unit * area, rel=1e-9)
        # Each side of the polygon is that of one triangle, each diagonal of two, in opposite directions.
        directed = triangles.F[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).tolist()
        assert len({tuple(edge) for edge in directed}) == len(directed)
        rim = {(int(a), int(b)) for a, b in zip(order, np.roll(order, -1), strict=True)}
        assert rim <= {tuple(edge) for edge in directed}


def test_polygons_that_a_fan_fits_keep_it():
    V, polygons = np.concatenate([L_SHAPE, L_SHAPE + np.array([5, 0, 0])]), [range(6), [9, 10, 11, 6, 7, 8]]
    mesh = PolygonMesh(V, polygons)
    # The fan around the first corner of the L fits, and so does that around its inner corner.
    assert mesh.triangles.F[:, 0].tolist() == [0, 0, 0, 0, 9, 9, 9, 9]
    box = PolygonMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]], [[0, 1, 2, 3], [1, 4, 2]])
    assert box.triangles.F.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]


def test_clipping_an_ear_asks_again_at_its_neighbours_alone(monkeypatch):
    angle, asked = np.linspace(0, 2 * np.pi, 300, endpoint=False), []
    area = triangulation._area
    monkeypatch.setattr(triangulation, "_area", lambda *corners: asked.append(0) or area(*corners))
    gear = (1 + 0.5 * np.cos(30 * angle)) * [np.cos(angle), np.sin(angle), 0 * angle]
    assert PolygonMesh(gear.T, [range(300)]).triangles.n_faces == 298
    assert len(asked) < 12 * 300


def test_concave_polygons_of_files(tmp_path):
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in L_SHAPE.tolist())
    (tmp_path / "l.obj").write_text(text + "f 2 3 4 5 6 1\n")
    mesh = heat_igl.read_mesh(tmp_path / "l.obj")
    assert mesh.measures.sum() == pytest.approx(3)
    assert heat_igl.read_polygon_mesh(tmp_path / "l.obj").degree.tolist() == [6]
    (tmp_path / "crossed.obj").write_text(text + "f 1 2 3\nf 1 3 2 6 4 5\n")
    with pytest.warns(
        heat_igl.AccuracyWarning, match=r"crossed.obj, face 1 .*: sides of this polygon cross each other"
    ):
        mesh = heat_igl.read_mesh(tmp_path / "crossed.obj")
    assert mesh.F.tolist() == [[0, 1, 2], [0, 2, 1], [0, 1, 5], [0, 5, 3], [0, 3, 4]]
    assert mesh.report().crossed_polygons.tolist() == [1]
    assert pickle.loads(pickle.dumps(mesh)).report().crossed_polygons.tolist() == [1]


@pytest.mark.parametrize(
    ("V", "order"),
    [
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [0, 2, 1, 3]),
        ([[0, 0, 0], [3, 0, 0], [1, 1, 0], [0, 1, 0]], [0, 2, 1, 3]),
        (STAR[1::2], [0, 2, 4, 1, 3]),
        (L_SHAPE, [0, 2, 1, 5, 3, 4]),
        (RAMP, range(len(RAMP))),
    ],
)
def test_polygons_that_cross_themselves_are_named_and_measured(V, order):
    V = np.concatenate([V, np.asarray(V) + np.array([9, 0, 0])])
    polygons = [[0, 1, 2], order] if len(order) > 3 else [order]
    said = r"polygons\[1\] = \[\d.*\]: sides of this polygon cross each other \(1 of 2 polygons"
    for positions in (V, turned(V)):
        with pytest.warns(heat_igl.AccuracyWarning, match=said):
            mesh = PolygonMesh(positions, polygons)
        assert mesh.triangles.report().crossed_polygons.tolist() == [1]
        # The corners of the polygon are reached within it, no nearer than straight through space.
        distance = heat_igl.geodesic_distance(mesh, order[0])
        straight = np.linalg.norm(positions[list(order)] - positions[order[0]], axis=1)
        assert np.isfinite(distance[list(order)]).all()
        assert (distance[list(order)] >= straight * (1 - 1e-9)).all()
