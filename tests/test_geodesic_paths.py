"""Geodesics by class: curves straightened, paths and loops through waypoints."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
import pytest
from conftest import flat_perturbed, perturbed
from surfaces import assert_connected

import heat_igl
from heat_igl import Mesh, SurfaceCurve, SurfacePoints, edge_curve, geodesic_path, shapes, straighten
from heat_igl.curves import GeodesicPathSolver


def begins(mesh: Mesh, curve: SurfaceCurve) -> np.ndarray:
    return np.einsum("kc,kcx->kx", curve.start, mesh.V[mesh.F[curve.faces]])


def fan(mesh: Mesh, v: int) -> tuple[dict[int, float], bool]:
    """The angle at which each face at v begins, counted around v, with `inf` the sum; whether it closes."""
    at = {int(f): mesh.F[f].tolist() for f in np.flatnonzero((v == mesh.F).any(axis=1))}
    after = {tri[(tri.index(v) + 1) % 3]: f for f, tri in at.items()}
    before = {tri[(tri.index(v) + 2) % 3] for tri in at.values()}
    open_ends = set(after) - before
    f = after[min(open_ends)] if open_ends else min(at)
    begin, total = {}, 0.0
    while f not in begin:
        begin[f] = total
        tri = at[f]
        i = tri.index(v)
        a, b = mesh.V[tri[(i + 1) % 3]] - mesh.V[v], mesh.V[tri[(i + 2) % 3]] - mesh.V[v]
        total += float(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))
        f = after.get(tri[(i + 2) % 3], f)
    return begin | {-1: total}, not open_ends


def side_angles(mesh: Mesh, curve: SurfaceCurve) -> list[float]:
    """The smaller of the angles on both sides of each vertex that a curve passes, inside the surface."""
    P, starts, smaller = curve.positions(mesh), begins(mesh, curve), []
    last = len(curve) if curve.is_closed else len(curve) - 1
    for i in range(last):
        j = (i + 1) % len(curve)
        corner = int(curve.end[i].argmax())
        if curve.end[i, corner] < 1 - 1e-9:
            continue
        v = int(mesh.F[curve.faces[i], corner])
        begin, closes = fan(mesh, v)
        angles = []
        for f, to in ((int(curve.faces[i]), starts[i]), (int(curve.faces[j]), P[j + 1])):
            tri = mesh.F[f].tolist()
            along = mesh.V[tri[(tri.index(v) + 1) % 3]] - mesh.V[v]
            away = to - mesh.V[v]
            cosine = away @ along / np.linalg.norm(away) / np.linalg.norm(along)
            angles.append(begin[f] + float(np.arccos(np.clip(cosine, -1, 1))))
        between = abs(angles[0] - angles[1])
        smaller.append(min(between, begin[-1] - between) if closes else between)
    return smaller


def assert_locally_shortest(mesh: Mesh, curve: SurfaceCurve) -> None:
    """Straight across edges, angles of at least pi on both sides of vertices."""
    assert_connected(mesh, curve, within=1e-9)
    kept = curve.lengths(mesh) > 1e-10 * np.ptp(mesh.V)
    curve = SurfaceCurve(curve.faces[kept], curve.start[kept], curve.end[kept], curve.is_closed)
    assert min(side_angles(mesh, curve), default=np.pi) >= np.pi - 1e-6
    P, starts = curve.positions(mesh), begins(mesh, curve)
    for i in range(len(curve) if curve.is_closed else len(curve) - 1):
        j = (i + 1) % len(curve)
        f, g = curve.faces[[i, j]]
        shared = np.intersect1d(mesh.F[f], mesh.F[g])
        if f == g or len(shared) != 2 or curve.end[i].max() > 1 - 1e-7:
            continue
        edge = mesh.V[shared[1]] - mesh.V[shared[0]]
        one, other = P[i + 1] - starts[i], P[j + 1] - P[j]
        sizes = np.linalg.norm(one), np.linalg.norm(other)
        if min(sizes) < 1e-6 * np.linalg.norm(edge):
            continue
        turn = (one / sizes[0] - other / sizes[1]) @ edge / np.linalg.norm(edge)
        assert turn == pytest.approx(0, abs=1e-6)


def edge_walk(mesh: Mesh, stops: list[int], closed: bool = False) -> SurfaceCurve:
    """A curve along shortest ways of edges from stop to stop, turned into detours by the stops."""
    from scipy.sparse import csgraph

    stops = [*stops, stops[0]] if closed else stops
    walk = stops[:1]
    for a, b in pairwise(stops):
        before = csgraph.dijkstra(mesh.edge_graph, directed=False, indices=b, return_predecessors=True)[1]
        while a != b:
            a = int(before[a])
            walk.append(a)
    return edge_curve(mesh, walk[:-1] if closed else walk, closed=closed)


def handlebody(holes: int, cut: int = 2) -> Mesh:
    """The surface of a slab of unit cubes, three wide, with square holes through it; square faces cut finer."""
    solid = np.zeros((2 * holes + 3, 5, 3), bool)
    solid[1:-1, 1:-1, 1] = True
    solid[2:-1:2, 2, 1] = False
    quads = []
    for axis in range(3):
        for sign in (0, 1):
            i = np.argwhere(solid & ~np.roll(solid, 1 - 2 * sign, axis))
            u, v = np.eye(3, dtype=int)[(axis + 1) % 3], np.eye(3, dtype=int)[(axis + 2) % 3]
            corner = i + sign * np.eye(3, dtype=int)[axis]
            ring = (corner, corner + u, corner + u + v, corner + v)
            quads.append(np.stack(ring if sign else ring[::-1], axis=1))
    corners = np.concatenate(quads)
    share = np.arange(cut + 1) / cut
    a, b = np.meshgrid(share, share, indexing="ij")
    sides = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    points = corners[:, 0, None] + a.ravel()[:, None] * sides[0][:, None] + b.ravel()[:, None] * sides[1][:, None]
    V, index = np.unique(np.rint(points.reshape(-1, 3) * cut).astype(int), axis=0, return_inverse=True)
    index = index.reshape(len(points), cut + 1, cut + 1)
    p, q, r, s = (part.ravel() for part in (index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]))
    return Mesh(V / cut, np.concatenate([np.stack([p, q, r], 1), np.stack([p, r, s], 1)]))


def winding(positions: np.ndarray, center: np.ndarray) -> float:
    """How often a closed polyline runs around the vertical line through a point."""
    x, y = (positions[:, :2] - center[:2]).T
    return float(np.angle((x[1:] + 1j * y[1:]) / (x[:-1] + 1j * y[:-1])).sum() / (2 * np.pi))


def linking(one: np.ndarray, other: np.ndarray) -> float:
    """The linking number of two closed polylines: the areas on the sphere of the directions from each to the other."""
    total = 0.0
    for a, b in pairwise(one):
        corners = [other[:-1] - a, other[1:] - a, other[1:] - b, other[:-1] - b]
        unit = [c / np.linalg.norm(c, axis=1, keepdims=True) for c in corners]
        for i, j, k in ((0, 1, 2), (0, 2, 3)):
            triple = np.einsum("kx,kx->k", unit[i], np.cross(unit[j], unit[k]))
            dots = [np.einsum("kx,kx->k", unit[m], unit[n]) for m, n in ((i, j), (j, k), (k, i))]
            total += float(np.arctan2(triple, 1 + sum(dots)).sum()) * 2
    return total / (4 * np.pi)


def classes(mesh: Mesh, curve: SurfaceCurve, holes: int) -> np.ndarray:
    """Around which holes (first half), and around which parts of the body beside them, a loop runs."""
    positions = curve.positions(mesh)
    found = []
    for hole in range(holes):
        center = np.array([2.5 + 2 * hole, 2.5, 1.5])
        core = center + np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]])
        found += [winding(positions, center), linking(positions, core)]
    numbers = np.array(found)
    np.testing.assert_allclose(numbers, np.rint(numbers), atol=1e-6)
    return np.rint(numbers)


def test_curves_in_the_plane_become_straight_lines():
    mesh = flat_perturbed(shapes.grid(10))
    rng = np.random.default_rng(0)
    for _ in range(10):
        stops = rng.integers(0, mesh.n_vertices, 4).tolist()
        curve = straighten(mesh, edge_walk(mesh, stops))
        P = curve.positions(mesh)
        np.testing.assert_allclose(P[[0, -1]], mesh.V[[stops[0], stops[-1]]], atol=1e-14)
        assert curve.length == pytest.approx(np.linalg.norm(P[-1] - P[0]), rel=1e-12)


@pytest.mark.parametrize("n_stops", [2, 4])
def test_straightened_curves_are_locally_shortest_and_not_longer(n_stops, cow):
    rng = np.random.default_rng(1)
    meshes = [cow, shapes.icosphere(2), shapes.torus(12, 24), perturbed(shapes.torus(12, 24)), handlebody(2)]
    for mesh in meshes:
        used = np.flatnonzero(mesh.referenced & (mesh.components == mesh.components[mesh.F[0, 0]]))
        for closed in (False, True):
            for _ in range(6):
                walk = edge_walk(mesh, rng.choice(used, n_stops + closed, replace=False).tolist(), closed)
                curve = straighten(mesh, walk)
                assert curve.is_closed == closed
                assert curve.length <= walk.length * (1 + 1e-12)
                if curve.length:
                    assert_locally_shortest(mesh, curve)
                if not closed:
                    ends = walk.positions(mesh)[[0, -1]]
                    np.testing.assert_allclose(curve.positions(mesh)[[0, -1]], ends, atol=1e-12 * np.ptp(mesh.V))


def test_straight_curves_stay():
    mesh = perturbed(shapes.torus(12, 24))
    solver = GeodesicPathSolver(mesh)
    for curve in (solver.path([3, 200]), solver.path([0, 8, 16], closed=True)):
        again = solver.straighten(curve)
        assert again.length == pytest.approx(curve.length, rel=1e-12)


def test_curves_in_faces_keep_their_ends(cow):
    rng = np.random.default_rng(2)
    solver = heat_igl.HeatMethodSolver(cow)
    isoline = max(heat_igl.isolines(cow, solver.distance(0), 0.4 * solver.distance(0).max())[0], key=len)
    half = slice(len(isoline) // 2)
    part = SurfaceCurve(isoline.faces[half], isoline.start[half], isoline.end[half])
    curve = straighten(cow, part)
    np.testing.assert_allclose(curve.positions(cow)[[0, -1]], part.positions(cow)[[0, -1]], atol=1e-12)
    assert curve.length < part.on(cow).length
    assert_locally_shortest(cow, curve)
    loop = straighten(cow, isoline)
    assert loop.length < isoline.length
    assert_locally_shortest(cow, loop)
    points = SurfacePoints(rng.integers(0, cow.n_faces, 2), rng.dirichlet([1, 1, 1], 2))
    np.testing.assert_allclose(geodesic_path(cow, points).positions(cow)[[0, -1]], points.positions(cow), atol=1e-12)


@pytest.mark.parametrize("holes", [1, 2, 3])
def test_straightening_keeps_the_class_of_a_loop(holes):
    mesh = handlebody(holes)
    rng = np.random.default_rng(holes)
    kept = 0
    for _ in range(12):
        walk = edge_walk(mesh, rng.choice(mesh.n_vertices, 5, replace=False).tolist(), True)
        before = classes(mesh, walk, holes)
        straight = straighten(mesh, walk)
        if before.any():
            kept += 1
            np.testing.assert_array_equal(classes(mesh, straight, holes), before)
            assert_locally_shortest(mesh, straight)
    assert kept > 2


def test_loops_of_known_length():
    around = 24
    mesh = shapes.cylinder(around, 10, 3.0)
    expected = 2 * around * np.sin(np.pi / around)
    third = around // 3
    waypoints = [0, 4 * around + third, 9 * around + 2 * third]
    loop = geodesic_path(mesh, waypoints, closed=True)
    assert loop.is_closed
    assert loop.length == pytest.approx(expected, rel=1e-12)
    pinned = geodesic_path(mesh, [*waypoints, waypoints[0]])
    rise = 3.0 / 10
    parts = np.hypot(expected / 3, rise * np.array([4, 5, 9]))
    assert pinned.length == pytest.approx(parts.sum(), rel=1e-12)
    # The outer equator of a torus slides to the inner one.
    along = 32
    torus = shapes.torus(16, along)
    outer = np.flatnonzero(np.abs(np.hypot(torus.V[:, 0], torus.V[:, 1]) - 1.4) < 1e-9)
    outer = outer[np.argsort(np.arctan2(torus.V[outer, 1], torus.V[outer, 0]))]
    slid = straighten(torus, edge_curve(torus, outer, closed=True))
    assert slid.length == pytest.approx(2 * along * 0.6 * np.sin(np.pi / along), rel=1e-12)


def test_loops_slide_down_narrow_cones():
    cone = shapes.cone(12, 20, 0.002)
    mesh = Mesh(cone.V, cone.F[(cone.F != 0).all(axis=1)])
    slant = np.rint(np.linalg.norm(mesh.V, axis=1) * 20).astype(int)
    rings = []
    for ring in (1, 11):
        around = np.flatnonzero(slant == ring)
        around = around[np.argsort(np.arctan2(mesh.V[around, 1], mesh.V[around, 0]))]
        rings.append(edge_curve(mesh, around, closed=True))
    rim, loop = rings
    assert straighten(mesh, loop).length == pytest.approx(rim.length, rel=1e-9)


def test_paths_are_as_short_as_distances_say(sphere):
    pairs = np.random.default_rng(3).integers(0, sphere.n_vertices, (40, 2))
    solver = GeodesicPathSolver(sphere)
    lengths = np.array([solver.path(pair).length for pair in pairs])
    exact = heat_igl.pair_distances(sphere, pairs)
    assert (lengths >= exact * (1 - 1e-12)).all()
    np.testing.assert_allclose(lengths, exact, rtol=1e-2)
    assert np.median(lengths / np.where(exact > 0, exact, 1)) <= 1 + 1e-9


def test_waypoints_of_both_kinds_are_passed(sphere):
    point = SurfacePoints([100], [[0.2, 0.3, 0.5]])
    curve = geodesic_path(sphere, [0, point, 50])
    P = curve.positions(sphere)
    np.testing.assert_allclose(P[[0, -1]], sphere.V[[0, 50]], atol=1e-14)
    assert np.linalg.norm(P - point.positions(sphere), axis=1).min() < 1e-12
    parts = [geodesic_path(sphere, [0, point]), geodesic_path(sphere, [point, 50])]
    assert curve.length == pytest.approx(sum(part.length for part in parts), rel=1e-14)


def test_paths_that_overlap_do_not_disturb_one_another():
    mesh = perturbed(shapes.torus(12, 24))
    ends = [[0, 100], [100, 0], [0, 100], [0, 101], [5, 100], [90, 10]]
    solver = GeodesicPathSolver(mesh)
    together = [solver.path(pair) for pair in ends]
    for pair, curve in zip(ends, together, strict=True):
        alone = geodesic_path(mesh, pair)
        np.testing.assert_array_equal(alone.positions(mesh), curve.positions(mesh))
    assert together[0].length == pytest.approx(together[1].length, rel=1e-12)
    # A curve over itself: there, back, and there again.
    walk = edge_walk(mesh, [0, 100, 0, 100])
    assert straighten(mesh, walk).length <= edge_walk(mesh, [0, 100]).length * (1 + 1e-12)


def test_loops_that_contract_become_points(sphere):
    around = sphere.F[np.flatnonzero((sphere.F == 30).any(axis=1))]
    ring = np.setdiff1d(around, 30).tolist()
    order = [ring.pop()]
    while ring:
        order.append(next(v for v in ring if ((sphere.edges == sorted((v, order[-1]))).all(axis=1)).any()))
        ring.remove(order[-1])
    point = straighten(sphere, edge_curve(sphere, order, closed=True))
    assert point.is_closed
    assert point.length == 0
    with pytest.raises(heat_igl.SourceError, match="contracts to a point"):
        geodesic_path(sphere, order[:3], closed=True)


def test_a_vertex_alone_joins_two_faces():
    V = [[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]
    mesh = Mesh(V, [[0, 2, 1], [0, 3, 4]])
    curve = geodesic_path(mesh, [1, 3])
    assert curve.length == pytest.approx(2 * np.sqrt(2))
    loop = straighten(mesh, edge_curve(mesh, [0, 1, 2, 0, 3, 4], closed=True))
    assert loop.is_closed
    assert loop.length == 0


def test_edges_of_three_faces_are_crossed():
    mesh = shapes.book(3, 6)
    far = np.argmax(mesh.V[:, 0]), np.argmax(mesh.V[:, 1])
    walk = edge_walk(mesh, [int(far[0]), int(far[1])])
    curve = straighten(mesh, walk)
    assert_connected(mesh, curve, within=1e-9)
    exact = heat_igl.pair_distances(mesh, [far])[0]
    assert curve.length == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_loops_that_begin_on_an_edge_are_straightened(axis):
    """Isolines begin on edges, so the last crossing is on the side on which the loop begins."""
    torus = shapes.torus(16, 10)
    for level in (0.0, 0.05, 0.1, 0.3):
        for loop in heat_igl.isolines(torus, torus.V[:, axis], level)[0]:
            shortest = heat_igl.straighten(torus, loop)
            assert shortest.is_closed
            assert shortest.lengths(torus).sum() <= loop.lengths(torus).sum() * (1 + 1e-12)
            again = heat_igl.straighten(torus, shortest) if shortest.lengths(torus).any() else shortest
            assert again.lengths(torus).sum() == pytest.approx(shortest.lengths(torus).sum())


def test_one_solver_serves_several_threads_and_is_pickled():
    """The tables hold what a search leaves behind, so searches that overlap would mix."""
    mesh = perturbed(shapes.icosphere(4))
    solver = GeodesicPathSolver(mesh)
    pairs = np.random.default_rng(1).integers(0, mesh.n_vertices, (60, 2)).tolist()
    want = [float(solver.path(pair).lengths(mesh).sum()) for pair in pairs]
    with ThreadPoolExecutor(4) as workers:
        assert [float(curve.lengths(mesh).sum()) for curve in workers.map(solver.path, pairs)] == want
    copy = pickle.loads(pickle.dumps(solver))
    assert float(copy.path(pairs[0]).lengths(mesh).sum()) == want[0]


@pytest.mark.parametrize("turns", [0, 1, -1, 2])
def test_turns_around_a_narrow_cylinder_are_kept(turns):
    around, rows, tall = 12, 20, 40.0
    mesh = shapes.cylinder(around, rows, tall)
    steps = abs(turns) * around
    down = np.linspace(0, rows, steps + 1).round().astype(int) if steps else np.array([0, rows])
    column = np.arange(len(down)) * np.sign(turns) % around
    walk = edge_walk(mesh, (column + down * around).tolist())
    perimeter = 2 * around * np.sin(np.pi / around)
    assert straighten(mesh, walk).length == pytest.approx(np.hypot(turns * perimeter, tall), rel=1e-12)


@pytest.mark.parametrize("holes", [1, 2, 3])
def test_straightened_paths_stay_in_their_class(holes):
    mesh = handlebody(holes)
    rng = np.random.default_rng(10 + holes)
    for _ in range(25):
        walk = edge_walk(mesh, rng.choice(mesh.n_vertices, 4, replace=False).tolist())
        path = straighten(mesh, walk)
        assert path.length <= walk.length * (1 + 1e-12)
        assert_locally_shortest(mesh, path)
        around = np.concatenate([walk.positions(mesh), path.positions(mesh)[-2::-1]])
        for hole in range(holes):
            # Through the middle of the hole, and of the body around it; both avoid the surface.
            center = np.array([2.5 + 2 * hole, 2.5, 1.5])
            core = center + np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [-1, -1, 0]])
            assert winding(around, center) == pytest.approx(0, abs=1e-6)
            assert linking(around, core) == pytest.approx(0, abs=1e-6)
