"""Height rasters: distances in closed form on slopes and surfaces of revolution, cells without ground, and errors."""

from __future__ import annotations

import numpy as np
import pytest

import heat_igl
from heat_igl import MeshError, terrain


def raster(n: int, extent: float = 1.0) -> tuple[np.ndarray, np.ndarray, float]:
    """x and y of the cells of a square raster around the origin, and their spacing."""
    at = np.linspace(-extent, extent, n)
    x, y = np.meshgrid(at, at)
    return x, y, float(at[1] - at[0])


def on_cone(r: np.ndarray, angle: np.ndarray, r0: float, slope: float) -> np.ndarray:
    """Distance on a cone from a point at radius r0 and angle 0: straight in the cone unrolled, or over the tip."""
    stretch = np.hypot(1, slope)
    unrolled = np.minimum(np.abs(angle) / stretch, np.pi)
    return stretch * np.sqrt(r**2 + r0**2 - 2 * r * r0 * np.cos(unrolled))


@pytest.mark.parametrize(("slope", "row", "column"), [(0.3, 12, 33), (1.0, 12, 33), (0.3, 40, 62), (0.3, 40, 40)])
def test_cone(slope, row, column):
    """A raster has no sharp tip: on steeper cones, paths behind the tip are longer, by .6 % at slope 3."""
    x, y, spacing = raster(81)
    ground = terrain(-slope * np.hypot(x, y), spacing)
    phi = ground.image(heat_igl.geodesic_distance(ground.mesh, ground.index[row, column], method="exact"))
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    angle = np.mod(angle - angle[row, column] + np.pi, 2 * np.pi) - np.pi
    exact = on_cone(r, angle, r[row, column], slope)
    assert np.abs(phi - exact).max() <= 1e-3 * exact.max()


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


def test_names_what_is_wrong():
    flat = np.zeros((3, 3))
    with pytest.raises(MeshError, match=r"heights must be real numbers \(rows, columns\), not float64 of shape \(3,\)"):
        terrain(flat[0])
    with pytest.raises(MeshError, match="no three neighbouring cells with ground"):
        terrain(np.where(np.eye(3, dtype=bool), flat, np.nan))
    with pytest.raises(MeshError, match=r"heights\[1, 2\] is inf \(1 of 9"):
        terrain(np.where(np.arange(9).reshape(3, 3) == 5, np.inf, flat))
    with pytest.raises(ValueError, match="nodata must be a number, not 'none'"):
        terrain(flat, nodata="none")
    with pytest.raises(ValueError, match="spacing must be one or two positive numbers"):
        terrain(flat, spacing=-1)
    assert repr(terrain(flat)) == "Terrain(9 of 9 cells)"
