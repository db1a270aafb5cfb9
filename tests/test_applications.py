"""The applications: searches that must agree with Dijkstra's, particles that must agree with scikit-image's."""

import numpy as np
import pytest
from surfaces import twice

import heat_igl
from heat_igl import shapes
from heat_igl.applications import EdgeSearch, particle_length, reconstruct, skeleton, zones_of_influence
from heat_igl.reference import edge_paths

# A* along edges.


@pytest.fixture(scope="module")
def pairs(bunny):
    return [(int(a), int(b)) for a, b in np.random.default_rng(0).integers(bunny.n_vertices, size=(40, 2))]


@pytest.fixture(scope="module")
def by_dijkstra(bunny, pairs):
    search = EdgeSearch(bunny)
    return [search.path(a, b) for a, b in pairs]


@pytest.fixture(scope="module")
def landmarks(bunny):
    solver = heat_igl.HeatMethodSolver(bunny)
    return solver, heat_igl.farthest_points(solver, 8, start=int(np.argmax(solver.distance(0)))).tolist()


@pytest.mark.parametrize("landmark_distance", ["along edges", "geodesic", "heat"])
def test_search_expands_few_and_finds_the_same_lengths(bunny, pairs, by_dijkstra, landmarks, landmark_distance):
    """The target: at most 0.3 of the vertices that Dijkstra's algorithm expands, with 8 landmarks."""
    solver, vertices = landmarks
    if landmark_distance == "along edges":
        rows = np.stack([edge_paths(bunny, v) for v in vertices])
    elif landmark_distance == "geodesic":
        rows = heat_igl.GeodesicSolver(bunny, method="exact").distances(vertices)
    else:
        rows = solver.distances(vertices)
    search = EdgeSearch(bunny, rows)
    led = [search.path(a, b) for a, b in pairs]
    for found, expected in zip(led, by_dijkstra, strict=True):
        assert found.length == pytest.approx(expected.length, rel=1e-12)
    assert sum(found.n_expanded for found in led) <= 0.3 * sum(found.n_expanded for found in by_dijkstra)


def test_dijkstra_against_scipy(bunny, pairs, by_dijkstra):
    for (a, b), found in list(zip(pairs, by_dijkstra, strict=True))[:3]:
        assert found.length == pytest.approx(edge_paths(bunny, a)[b], rel=1e-12)
        assert found.vertices[[0, -1]].tolist() == [a, b]
        steps = np.sort(np.stack([found.vertices[:-1], found.vertices[1:]], axis=1), axis=1)
        assert {tuple(step) for step in steps.tolist()} <= {tuple(edge) for edge in bunny.edges.tolist()}
        along = np.linalg.norm(np.diff(bunny.V[found.vertices], axis=0), axis=1).sum()
        assert found.length == pytest.approx(along, rel=1e-12)


def test_any_landmark_rows_give_shortest_paths():
    """Rows that are far from a distance still make a true bound, once they are divided by their steepness."""
    mesh = shapes.torus(12, 40)
    rng = np.random.default_rng(1)
    rows = np.stack([edge_paths(mesh, 0) * 3, rng.uniform(0, 5, mesh.n_vertices)])
    led, plain = EdgeSearch(mesh, rows), EdgeSearch(mesh)
    assert led.steepness[0] == pytest.approx(3, rel=1e-6)
    assert led.steepness[1] > 3
    for a, b in rng.integers(mesh.n_vertices, size=(60, 2)).tolist():
        assert led.path(a, b).length == pytest.approx(plain.path(a, b).length, rel=1e-12)


def test_search_between_components():
    sphere = shapes.icosphere(1)
    mesh = twice(sphere)
    rows = np.stack([edge_paths(mesh, 0), edge_paths(mesh, 50)])
    for search in (EdgeSearch(mesh, rows), EdgeSearch(mesh)):
        nowhere = search.path(3, 60)
        assert nowhere.length == np.inf
        assert len(nowhere.vertices) == 0
        assert search.path(44, 60).length == pytest.approx(edge_paths(mesh, 44)[60])
        here = search.path(7, 7)
        assert (here.length, here.vertices.tolist(), here.n_expanded) == (0.0, [7], 0)


# Particles.


def blobs(seed: int, n: int = 80) -> np.ndarray:
    ndimage = pytest.importorskip("scipy.ndimage")
    return ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((n, n)), 2.5) > 0.02


def test_marked_particles_are_reconstructed_as_scikit_image_does():
    morphology = pytest.importorskip("skimage.morphology")
    mask = blobs(0)
    markers = np.zeros_like(mask)
    markers[::13, ::17] = True
    expected = morphology.reconstruction((markers & mask).astype(float), mask.astype(float), footprint=np.ones((3, 3)))
    found = reconstruct(mask, markers)
    assert 0 < found.sum() < mask.sum()
    assert np.array_equal(found, expected > 0)


def test_reconstruction_within_a_radius_stays_inside_the_particle():
    """A hook: its ends are near each other in the plane, and far inside."""
    mask = np.zeros((12, 30), bool)
    mask[2:5], mask[7:10], mask[2:10, 26:] = True, True, True
    marker = np.zeros_like(mask)
    marker[3, 2] = True
    near = reconstruct(mask, marker, radius=20.5, method="sweep")
    assert near[3, 22]
    assert not near[3, 23]
    assert not near[7:10, :20].any()
    assert reconstruct(mask, marker).all() == mask.all()
    assert np.array_equal(reconstruct(mask, marker), mask)
    with pytest.raises(heat_igl.SourceError, match="pixels selects no pixel"):
        reconstruct(mask, ~mask)


def test_zones_of_influence_cut_touching_disks_apart():
    y, x = np.mgrid[:40, :70]
    left, right = np.hypot(x - 20, y - 20) < 15, np.hypot(x - 46, y - 20) < 15
    mask = left | right
    mask[1, 1] = True
    markers = np.zeros(mask.shape, int)
    markers[20, 20], markers[20, 46] = 3, 8
    zones = zones_of_influence(mask, markers)
    assert zones[1, 1] == 0
    assert not zones[~mask].any()
    inside = mask & (x + y > 2)
    assert (zones[inside & (x < 33)] == 3).all()
    assert (zones[inside & (x > 33)] == 8).all()
    with pytest.raises(heat_igl.SourceError, match="marker 5 lies outside the mask"):
        zones_of_influence(mask, np.where(mask, 0, 5))
    with pytest.raises(heat_igl.SourceError, match="markers is 0 everywhere"):
        zones_of_influence(mask, np.zeros(mask.shape, int))
    with pytest.raises(heat_igl.SourceError, match="markers must be an image of integers"):
        zones_of_influence(mask, mask)


def test_length_of_a_hook_and_of_a_bar():
    bar = np.zeros((5, 40), bool)
    bar[2, 3:33] = True
    length, first, second = particle_length(bar, method="sweep")
    assert length == pytest.approx(np.hypot(30, 1))
    assert {first, second} == {(2, 3), (2, 32)}
    hook = np.zeros((12, 30), bool)
    hook[2:4], hook[8:10], hook[2:10, 28:] = True, True, True
    # From a far corner to the next inner corner, down, and back: the band is two wide.
    length, first, second = particle_length(hook, method="exact")
    assert length == pytest.approx(2 * np.hypot(28, 2) + 4, rel=1e-4)
    assert {first, second} == {(2, 0), (9, 0)}
    with pytest.raises(heat_igl.MeshError, match="mask holds 2 particles"):
        particle_length(np.array([[True, False, True]]))


def comb(bump: int) -> np.ndarray:
    """A bar nine wide with a bump `bump` high in its middle, and a long tooth."""
    mask = np.zeros((80, 100), bool)
    mask[50:59, 10:90] = True
    mask[50 - bump : 50, 42:45] = True
    mask[15:50, 60:67] = True
    return mask


def test_skeleton_keeps_long_branches_and_drops_short_ones():
    pytest.importorskip("skimage")
    whole = skeleton(comb(8), 0.0)
    pruned = skeleton(comb(8), 20.0)
    assert (whole[:50, 37:50]).any()
    assert not (pruned[:48, 37:50]).any()
    assert pruned[15:50, 60:67].any(axis=1)[5:].all()  # the tooth
    assert pruned[50:59, 10:90].any(axis=0)[10:-10].all()  # the bar
    assert (pruned <= comb(8)).all()


@pytest.mark.parametrize("seed", range(4))
def test_skeleton_keeps_pieces_and_holes(seed):
    measure = pytest.importorskip("skimage.measure")
    mask = blobs(seed)
    for shortest in (0.0, 4.0, 8.0, 1000.0):
        thin = skeleton(mask, shortest)
        assert measure.label(thin, connectivity=2).max() == measure.label(mask, connectivity=2).max()
        assert measure.euler_number(thin, connectivity=2) == measure.euler_number(mask, connectivity=2)
        assert (thin <= mask).all()


# The offset of a curve drawn on a surface.


def test_offset_of_a_curve_drawn_on_the_plane():
    """Around a segment: two sides and two half circles, by a distance that is off by less than an edge on average."""
    mesh = shapes.grid(60)
    solver = heat_igl.HeatMethodSolver(mesh)
    first, last = 20 * 61 + 20, 30 * 61 + 40
    drawn = heat_igl.shortest_paths(mesh, last, first)[0]
    length = np.linalg.norm(mesh.V[first] - mesh.V[last])
    assert drawn.lengths(mesh).sum() == pytest.approx(length, rel=1e-9)
    (curve,) = heat_igl.curves.offset_curves(mesh, solver, drawn, 0.2)
    assert curve.is_closed
    assert curve.lengths(mesh).sum() == pytest.approx(2 * length + 2 * np.pi * 0.2, abs=2 * np.pi / 60)
    points = curve.positions(mesh)
    along = np.clip((points - mesh.V[first]) @ (mesh.V[last] - mesh.V[first]) / length**2, 0, 1)[:, None]
    nearest = mesh.V[first] + along * (mesh.V[last] - mesh.V[first])
    off = np.abs(np.linalg.norm(points - nearest, axis=1) - 0.2)
    assert off.mean() < 1 / 60
    assert off.max() < 2 / 60
