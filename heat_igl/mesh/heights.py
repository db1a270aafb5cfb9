"""Heights on a raster as a surface, on which distance follows the slopes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, as_array, is_number, names_guessed, shown
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.pixel_domain import ImageDomain, checked_spacing
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray


class Terrain(ImageDomain):
    """The surface of a height raster, made by `terrain`: an `ImageDomain` whose pixels are the cells of the raster.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> slope = np.tile(3.0 * np.arange(5), (4, 1))  # rises by 3 from column to column
    >>> ground = heat_igl.terrain(slope, spacing=4.0)
    >>> phi = heat_igl.geodesic_distance(ground.mesh, ground.index[0, 0])
    >>> ground.image(phi)[0].round(6).tolist()
    [0.0, 5.0, 10.0, 15.0, 20.0]
    """

    def __repr__(self) -> str:
        return f"Terrain({int((self.index >= 0).sum())} of {self.index.size} cells)"

    def per_face(self, image: ArrayLike) -> AnyArray:
        """Values per cell, such as a speed, as values per face of `mesh`, for `speed_operators`.

        Parameters
        ----------
        image : (rows, columns, ...) array_like
            A number, or an array, for each cell.

        Returns
        -------
        (m,) or (m, ...) float64
            The mean over the corners of the face; the middle of four cells has their mean.

        Raises
        ------
        ValueError
            If `image` has another shape.
        """
        cells = self._of_pixels(image).astype(np.float64)
        n_squares = self.mesh.n_vertices - len(cells)
        corners = self.mesh.F[: 4 * n_squares, 0].reshape(n_squares, 4)
        values = np.concatenate([cells, cells[corners].mean(axis=1)])
        return np.asarray(values[self.mesh.F].mean(axis=1))


@names_guessed
def terrain(heights: ArrayLike, spacing: float | Sequence[float] = 1.0, *, nodata: float | None = None) -> Terrain:
    """The surface of a height raster, on which distance goes up and down the slopes.

    Parameters
    ----------
    heights : (rows, columns) array_like of real numbers
        Height at the centre of each cell, in the unit of `spacing`: an array, a masked array, or xarray's DataArray.
        Cells that are NaN or masked have no ground.
    spacing : float or (float, float), optional
        Distance between the centres of neighbouring cells: one number, or from row to row before from column to column.
    nodata : float, optional
        Another number that stands for cells without ground, such as -9999.

    Returns
    -------
    Terrain
        ``.mesh`` for all functions of this package; ``.index`` (rows, columns), the vertex of each cell, -1 without
        ground; ``.vertices(mask)``, cells as sources; ``.image(phi)``, a distance as a raster, and for xarray
        ``heights.copy(data=ground.image(phi))``; ``.per_face(speed)``, least-cost speeds for `speed_operators`.

    Raises
    ------
    MeshError
        If `heights` is no raster of real numbers, a height is infinite, or no three neighbouring cells have ground.
    ValueError
        If `spacing` is neither one positive number nor two, or `nodata` is no number.

    Notes
    -----
    Four neighbouring cells form a square, which is cut into four triangles around the mean of their heights, so that no
    diagonal direction is preferred. Three cells with ground around a fourth without form one triangle. Cells of which
    no triangle is made are reached from nowhere. Distance on this surface differs from that on the ground by the error
    of the interpolation, of second order in the spacing; a graph of eight neighbours is up to 8 % too long at every
    spacing.

    Examples
    --------
    >>> import heat_igl
    >>> ground = heat_igl.terrain([[0.0, 3.0, 6.0], [0.0, 3.0, 6.0]], spacing=4.0)
    >>> phi = heat_igl.geodesic_distance(ground, ground.index[0, 0])
    >>> ground.image(phi)[0].round(6).tolist()
    [0.0, 5.0, 10.0]
    """
    z, has_ground = _checked_heights(heights, nodata)
    down, across = checked_spacing(spacing, 2)
    row, column = np.nonzero(has_ground)
    n = len(row)
    index = np.full(z.shape, -1)
    index[has_ground] = np.arange(n)
    # Around each square, so that triangles are oriented alike.
    squares = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    missing = squares < 0
    whole = squares[~missing.any(axis=1)]
    centre = np.broadcast_to(n + np.arange(len(whole))[:, None], whole.shape)
    fans = np.stack([whole, np.roll(whole, -1, axis=1), centre], axis=2).reshape(-1, 3)
    partial, corner = squares[missing.sum(axis=1) == 1], missing.argmax(axis=1)[missing.sum(axis=1) == 1]
    triangles = np.take_along_axis(partial, (corner[:, None] + [1, 2, 3]) % 4, axis=1)
    if not len(fans) + len(triangles):
        raise MeshError(f"heights has no three neighbouring cells with ground ({n} of {z.size} cells have ground)")
    V = np.stack([column * across, row * down, z[has_ground]], axis=1)
    mesh = Mesh(np.concatenate([V, V[whole].mean(axis=1)]), np.concatenate([fans, triangles]))
    return Terrain(mesh, index)


def _checked_heights(heights: ArrayLike, nodata: float | None) -> tuple[FloatArray, BoolArray]:
    """Heights (rows, columns), and which cells have one."""
    masked: Any = getattr(heights, "mask", None) if isinstance(heights, np.ndarray) else None
    given: AnyArray = as_array("heights", np.asarray(heights), MeshError)
    if given.ndim != 2 or given.dtype.kind not in "iuf":
        raise MeshError(f"heights must be real numbers (rows, columns), not {given.dtype} of shape {given.shape}")
    if nodata is not None and not is_number(nodata):
        raise ValueError(f"nodata must be a number, not {shown(nodata)}")
    z = given.astype(np.float64)
    has_ground = ~np.isnan(z)
    if masked is not None:
        has_ground &= ~masked
    if nodata is not None:
        # Rounded as the heights are: float32 holds another number than was typed.
        has_ground &= z != (float(given.dtype.type(nodata)) if given.dtype.kind == "f" else nodata)
    infinite = has_ground & np.isinf(z)
    if infinite.any():
        first = np.argwhere(infinite)[0].tolist()
        raise MeshError(
            f"heights{first} is {z[tuple(first)]} ({int(infinite.sum())} of {z.size} cells are infinite): "
            "mark cells without ground by NaN or nodata"
        )
    return z, has_ground
