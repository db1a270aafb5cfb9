"""Images and rasters as domains: every pixel there, connected as it should be, distances around obstacles."""

import numpy as np
import pytest
from scipy import ndimage

import heat_igl
from heat_igl import HeatMethodSolver, PointCloud, image_domain, metric_operators, read_point_cloud, terrain
from heat_igl.compat import igl as igl_names
from heat_igl.compat import potpourri3d as potpourri3d_names
from heat_igl.geodesic import SolverChoice
from heat_igl.validation import relative_error


def test_every_pixel_has_its_area_and_its_place():
    mask = np.random.default_rng(0).random((12, 17)) < 0.6
    domain = image_domain(mask, spacing=(0.5, 2.0))
    assert domain.mesh.measures.sum() == pytest.approx(mask.sum(), rel=1e-12)
    assert np.array_equal(domain.index >= 0, mask)
    row, column = np.nonzero(mask)
    expected = np.stack([2.0 * column, 0.5 * row, np.zeros(len(row))], axis=1)
    np.testing.assert_allclose(domain.mesh.V[domain.index[mask]], expected)
    corner = domain.mesh.V[domain.mesh.F]
    assert (np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, 2] > 0).all()


def test_components_are_those_of_diagonally_adjacent_pixels():
    mask = np.random.default_rng(1).random((40, 40)) < 0.35
    domain = image_domain(mask)
    expected = ndimage.label(mask, np.ones((3, 3)))[0][mask]
    found = domain.mesh.components[domain.index[mask]]
    pairs = set(zip(expected.tolist(), found.tolist(), strict=True))
    assert len(pairs) == len(set(expected.tolist())) == len(set(found.tolist()))


@pytest.mark.parametrize("method", ["heat", "sweep", "exact"])
def test_a_stroke_one_pixel_wide_is_as_long_as_it_is(method):
    """Straight, then diagonal from corner to corner of the pixels."""
    mask = np.zeros((20, 40), bool)
    mask[2, :21] = True
    steps = np.arange(1, 16)
    mask[2 + steps, 20 + steps] = True
    domain = image_domain(mask)
    solver = SolverChoice(method).on(domain.mesh)
    distance = domain.image(solver.distance(domain.index[2, 0]))
    straight = np.hypot(20.5, 0.5) + np.sqrt(0.5) + 14 * np.sqrt(2)
    assert np.isinf(distance[~mask]).all()
    assert np.isfinite(distance[mask]).all()
    assert distance[17, 35] == pytest.approx(straight, rel=0.02 if method == "heat" else 1e-9)


def test_no_direction_is_preferred():
    """The image turned over gives the distance turned over: there are no diagonals that run one way."""
    mask = np.ones((31, 31), bool)
    domain = image_domain(mask)
    distance = domain.image(heat_igl.HeatMethodSolver(domain.mesh).distance(domain.index[15, 15]))
    for turned in (distance.T, distance[::-1], distance[:, ::-1]):
        np.testing.assert_allclose(turned, distance, rtol=1e-9, atol=1e-9)
    y, x = np.mgrid[-15:16, -15:16]
    assert np.nanmean(relative_error(distance, np.hypot(x, y))) < 0.02


def test_vertices_images_and_faces():
    mask = np.array([[True, True, False], [False, True, True]])
    domain = image_domain(mask)
    assert domain.vertices(np.array([[False, True, True], [False, False, True]])).tolist() == [1, 3]
    labels = np.arange(domain.mesh.n_vertices)
    assert domain.image(labels, outside=-1).tolist() == [[0, 1, -1], [-1, 2, 3]]
    assert domain.image(labels, outside=-1).dtype.kind == "i"
    assert domain.image([labels, -labels], outside=9)[1].tolist() == [[0, -1, 9], [9, -2, -3]]
    per_face = domain.per_face([[1, 2, 9], [9, 3, 4]])
    assert per_face.tolist() == np.repeat([1, 2, 3, 4], 4).tolist()
    for pixel, faces in enumerate(domain.mesh.F.reshape(-1, 4, 3)):
        assert (faces[:, 0] == pixel).all()


def test_a_metric_per_pixel_is_a_linear_map():
    """A constant tensor in the axes x and y: the triangles of a pixel have four different first sides."""
    domain = image_domain(np.ones((7, 9), bool))
    g = np.zeros((7, 9, 3, 3))
    g[..., :2, :2] = [[3.0, 1.0], [1.0, 0.5]]
    metric = heat_igl.metric_operators(domain.mesh, domain.per_face(g))
    distance = heat_igl.GeodesicSolver(metric, method="exact").distance(domain.index[0, 0])
    x, y, _ = domain.mesh.V.T
    np.testing.assert_allclose(distance, np.sqrt(3 * x**2 + 2 * x * y + 0.5 * y**2), atol=1e-12)


# --- Images of three dimensions: voxels as tetrahedra, and distance through them


def test_tetrahedra_fit_together_and_fill_the_voxels():
    mask = np.random.default_rng(0).random((4, 5, 6)) < 0.7
    domain = image_domain(mask, spacing=(3.0, 2.0, 0.5))
    mesh = domain.mesh
    assert mesh.n_faces == 12 * mask.sum()
    np.testing.assert_allclose(mesh.measures, 3.0 / 12)
    # A triangle that only one tetrahedron has lies on a side between a voxel of the mask and one outside.
    outer = mesh.facets.vertices[mesh.facets.n_faces == 1]
    assert mesh.facets.n_faces.max() == 2
    padded = np.pad(mask, 1).astype(int)
    assert len(outer) == 2 * sum(np.abs(np.diff(padded, axis=axis)).sum() for axis in range(3))
    centre = mesh.V[domain.index[mask]]
    np.testing.assert_allclose(centre, np.argwhere(mask)[:, ::-1] * [0.5, 2.0, 3.0])


def test_speeds_of_voxels():
    mask = np.ones((3, 3, 12), bool)
    domain = image_domain(mask)
    speed = np.where(np.arange(12) < 6, 1.0, 4.0) * np.ones(mask.shape)
    operators = heat_igl.speed_operators(domain.mesh, domain.per_face(speed))
    found = domain.image(heat_igl.GeodesicSolver(operators).distance(domain.index[1, 1, 0]))
    np.testing.assert_allclose(found[1, 1, [5, 11]], [5, 5.5 + 5.5 / 4], rtol=1e-3)


def test_planar_points_of_files(tmp_path):
    P = np.random.default_rng(0).random((30, 2))
    np.save(tmp_path / "a.npy", P)
    np.savetxt(tmp_path / "a.xyz", P, fmt="%.17g")
    for name in ("a.npy", "a.xyz"):
        np.testing.assert_array_equal(read_point_cloud(tmp_path / name).P, PointCloud(P).P)
    np.save(tmp_path / "b.npy", np.ones((30, 4)))
    with pytest.raises(heat_igl.MeshError, match=r"or \(n, 2\) in the plane, but its shape is \(30, 4\)"):
        read_point_cloud(tmp_path / "b.npy")


# What each function that takes positions makes of two columns is what it makes of three with z = 0.
FLAT = heat_igl.shapes.disk(6)
TAKE_POSITIONS = {
    "HeatMethodSolver": lambda V: HeatMethodSolver(V, FLAT.F).distance(3),
    "geodesic_distance": lambda V: heat_igl.geodesic_distance((V, FLAT.F), 3),
    "closest_points": lambda V: heat_igl.closest_points(FLAT, V[:5] / 2).points.barycentric,
    "curve_on": lambda V: heat_igl.curve_on(FLAT, V[[0, 4, 9]]).start,
    "PointCloud": lambda V: HeatMethodSolver(PointCloud(V)).distance(3),
    "PolygonMesh": lambda V: HeatMethodSolver(heat_igl.PolygonMesh(V, FLAT.F)).distance(3),
    "tangent_frames": lambda V: heat_igl.tangent_frames((V, FLAT.F)).x,
    "closed_forms.plane": lambda V: heat_igl.validation.closed_forms.plane((V, FLAT.F), 3),
    "with_vertices": lambda V: HeatMethodSolver(FLAT).with_vertices(2 * V).distance(3),
    "metric_operators": lambda V: metric_operators((V, FLAT.F), np.tile(np.eye(3), (FLAT.n_faces, 1, 1))).L.toarray(),
    "libigl": lambda V: igl_names.heat_geodesic(V, FLAT.F, 0.01, np.array([3])),
    "potpourri3d": lambda V: potpourri3d_names.PointCloudHeatSolver(V).compute_distance(3),
}


@pytest.mark.filterwarnings("ignore:heat gave distances up to")  # on so few points
@pytest.mark.parametrize("name", TAKE_POSITIONS)
def test_two_columns_are_a_plane(name):
    call = TAKE_POSITIONS[name]
    np.testing.assert_array_equal(call(FLAT.V[:, :2]), call(FLAT.V))


# --- Height rasters: distances in closed form on slopes and surfaces of revolution, cells without ground, and errors


def raster(n: int, extent: float = 1.0) -> tuple[np.ndarray, np.ndarray, float]:
    """x and y of the cells of a square raster around the origin, and their spacing."""
    at = np.linspace(-extent, extent, n)
    x, y = np.meshgrid(at, at)
    return x, y, float(at[1] - at[0])


def test_paraboloid_converges_with_second_order():
    error = []
    for n in (21, 41, 81):
        x, y, spacing = raster(n)
        ground = terrain(x**2 + y**2, spacing)
        phi = ground.image(heat_igl.geodesic_distance(ground.mesh, ground.index[n // 2, n // 2], method="exact"))
        r = np.hypot(x, y)
        along_meridian = r * np.sqrt(1 + 4 * r**2) / 2 + np.arcsinh(2 * r) / 4
        error.append(np.abs(phi - along_meridian).max() / along_meridian.max())
    assert error[-1] < 1e-3
    assert 3 < error[0] / error[1] < 5
    assert 3 < error[1] / error[2] < 5


def test_slope_with_two_spacings_is_a_plane():
    rows, columns = np.mgrid[:7, :9]
    ground = terrain(2.0 * rows - 0.5 * columns, (3.0, 1.5))
    cells = np.stack([1.5 * columns, 3.0 * rows, 2.0 * rows - 0.5 * columns], axis=-1)
    phi = ground.image(heat_igl.geodesic_distance(ground.mesh, ground.index[2, 3], method="exact"))
    np.testing.assert_allclose(phi, np.linalg.norm(cells - cells[2, 3], axis=-1), atol=1e-12)
    assert ground.mesh.report().euler_characteristic == 1
    assert repr(ground) == "Terrain(63 of 63 cells)"


@pytest.mark.parametrize("marked", ["nan", "nodata", "mask", "integers"])
def test_cells_without_ground_are_gone_around(marked):
    heights = np.zeros((5, 7), np.int32 if marked == "integers" else np.float32)
    wall = np.zeros(heights.shape, bool)
    wall[:4, 3] = True
    nodata = None
    if marked == "nan":
        heights[wall] = np.nan
    elif marked == "mask":
        heights = np.ma.array(heights, mask=wall)
    else:
        nodata = -9999 if marked == "integers" else -3.4e38
        heights[wall] = nodata
    ground = terrain(heights, nodata=nodata)
    assert ((ground.index < 0) == wall).all()
    phi = ground.image(heat_igl.geodesic_distance(ground.mesh, ground.index[0, 2], method="exact"), outside=np.nan)
    assert np.isnan(phi[wall]).all()
    # Below the wall two triangles meet in the last cell of its column.
    assert phi[0, 4] == pytest.approx(2 * (3 + np.sqrt(2)))
    assert phi[0, 0] == pytest.approx(2)


def test_speed_per_cell():
    ground = terrain(np.zeros((9, 31)))
    speed = np.ones(ground.index.shape)
    speed[:, 16:] = 2.0
    middle = ground.mesh.V[ground.mesh.F].mean(axis=1)[:, 0]
    # Linear in the position, as the values at cells and in the middle of four are.
    between = np.clip(middle - 14, 1, 2)
    np.testing.assert_allclose(ground.per_face(speed), between)
    solver = heat_igl.HeatMethodSolver(heat_igl.speed_operators(ground.mesh, ground.per_face(speed)))
    assert solver.n_vertices == ground.mesh.n_vertices
