"""Images of two or three dimensions as meshes: the pixels or voxels of a mask, and heights as a surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heat_igl.errors import MeshError, SourceError, as_array, is_number, names_guessed, real_numbers, shown
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# Triangles around the centre of a pixel, tetrahedra around that of a voxel.
_FACES_PER_CELL = {2: 4, 3: 12}


@dataclass(frozen=True, eq=False)
class ImageDomain:
    """The pixels of a mask as a flat triangle mesh, or the voxels as tetrahedra, made by `image_domain`.

    Attributes
    ----------
    mesh : Mesh
        Triangles in the plane z = 0, or tetrahedra: x runs along the columns, y down the rows, z along the slices.
    index : (rows, columns) or (slices, rows, columns) int64
        Vertex at the centre of each pixel; -1 outside the mask. They count up from 0 row by row, and the corners of the
        pixels follow.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mask = np.ones((3, 4), bool)
    >>> mask[1, 1:] = False
    >>> domain = heat_igl.image_domain(mask)
    >>> float(domain.mesh.measures.sum())  # nine pixels of area 1
    9.0
    >>> phi = heat_igl.geodesic_distance(domain.mesh, domain.index[0, 0])
    >>> domain.image(phi)[:, 0].round(6).tolist()
    [0.0, 1.0, 2.0]
    """

    mesh: Mesh
    index: IntArray

    def __repr__(self) -> str:
        return f"ImageDomain({int((self.index >= 0).sum())} of {self.index.size} pixels)"

    def vertices(self, pixels: ArrayLike) -> IntArray:
        """The vertices at the centres of some pixels, to be used as sources.

        Parameters
        ----------
        pixels : array_like of bool
            Of the shape of `index`. Pixels outside the domain are ignored.

        Returns
        -------
        (k,) int64
            A vertex for each pixel that is set, in the order of the image.

        Raises
        ------
        SourceError
            If `pixels` is no mask of the image's shape, or selects no pixel of the domain.
        """
        chosen = as_array("pixels", pixels, SourceError)
        if chosen.shape != self.index.shape or chosen.dtype.kind != "b":
            raise SourceError(
                f"pixels must be a boolean image of shape {self.index.shape}, not {chosen.dtype} of {chosen.shape}"
            )
        found = self.index[chosen & (self.index >= 0)]
        if not len(found):
            raise SourceError("pixels selects no pixel of the domain")
        return found

    def image(self, values: ArrayLike, outside: float = np.inf) -> AnyArray:
        """Values per vertex, such as a distance, as an image; `outside` off the domain.

        Parameters
        ----------
        values : (..., n) array_like
            Also several distances, (k, n), which become (k, rows, columns).
        outside : number
            For pixels that are not in the mask.

        Returns
        -------
        (..., rows, columns) or (..., slices, rows, columns) array

        Raises
        ------
        ValueError
            If `values` has another length.
        """
        given = as_array("values", values)
        if given.shape[-1:] != (self.mesh.n_vertices,):
            raise ValueError(f"values must have shape ({self.mesh.n_vertices},), one per vertex, not {given.shape}")
        if np.ndim(outside):
            raise ValueError(f"outside must be a number, not {shown(outside)}")
        inside = self.index >= 0
        shape = given.shape[:-1] + self.index.shape
        image = np.full(shape, outside, dtype=np.result_type(given.dtype, np.min_scalar_type(outside)))
        image[..., inside] = given[..., self.index[inside]]
        return image

    def per_face(self, image: ArrayLike) -> AnyArray:
        """Values per pixel, such as a speed or a metric, as values per face of `mesh`.

        Parameters
        ----------
        image : (rows, columns, ...) or (slices, rows, columns, ...) array_like
            A number for each pixel, or an array such as a metric (3, 3) in the axes x, y, z of `mesh`: x runs along
            the columns, the last axis of the image, and y along the rows. `metric_operators` takes a metric (2, 2) in
            the axes of each triangle, not in these: give (3, 3).

        Returns
        -------
        (m,) or (m, ...) array

        Raises
        ------
        ValueError
            If `image` has another shape.
        """
        return np.repeat(self._of_pixels(image), _FACES_PER_CELL[self.index.ndim], axis=0)

    def _of_pixels(self, image: ArrayLike) -> AnyArray:
        """Values of the pixels of the domain, in the order of their vertices."""
        given = as_array("image", image)
        if given.shape[: self.index.ndim] != self.index.shape:
            raise ValueError(
                f"image must have shape {self.index.shape}, with further axes for arrays per pixel, not {given.shape}"
            )
        return np.asarray(given[self.index >= 0])


def image_domain(mask: ArrayLike, spacing: float | Sequence[float] = 1.0) -> ImageDomain:
    """A flat mesh of the pixels of `mask`, or tetrahedra of its voxels.

    Every pixel is a rectangle, cut into four triangles around the centre: no diagonal direction is preferred, no pixel
    is lost, and the area of the mesh is that of the pixels. Pixels that touch only in a corner are connected through
    this point, as with skimage's ``connectivity=2``, and a stroke one pixel wide becomes a strip one pixel wide.

    Parameters
    ----------
    mask : (rows, columns) or (slices, rows, columns) array_like of bool
        The pixels or voxels of the domain.
    spacing : float or sequence of float, optional
        Distance between the centres of neighbouring pixels; one for each axis of the image where they differ, from row
        to row before from column to column, like skimage's.

    Returns
    -------
    ImageDomain
        The mesh has a vertex for each pixel and one for each corner of pixels. A voxel is cut into twelve tetrahedra
        around the centre.

    Raises
    ------
    MeshError
        If `mask` is not an image of booleans, or holds no pixel.
    ValueError
        If `spacing` is neither one positive number nor one for each axis.

    Examples
    --------
    >>> from heat_igl import HeatMethodSolver, image_domain
    >>> domain = image_domain([[True, True, False], [False, False, True]])
    >>> distance = HeatMethodSolver(domain.mesh).distance(domain.index[0, 0])
    >>> domain.image(distance).shape
    (2, 3)
    """
    inside = as_array("mask", mask, MeshError)
    if inside.ndim not in (2, 3) or inside.dtype.kind != "b":
        raise MeshError(
            "mask must be a boolean image (rows, columns) or (slices, rows, columns), not "
            f"{inside.dtype} of shape {inside.shape}: compare with a threshold first"
        )
    if not inside.any():
        raise MeshError("mask holds no pixel: a domain needs at least one")
    steps, dimension = checked_spacing(spacing, inside.ndim), inside.ndim
    cells = np.argwhere(inside)
    n = len(cells)
    index = np.full(inside.shape, -1)
    index[inside] = np.arange(n)
    # Corner (i, j, ...) is the first one of cell (i, j, ...).
    used = np.zeros([size + 1 for size in inside.shape], bool)
    offsets = np.ndindex((2,) * dimension)
    places = [tuple(slice(k, k + size) for k, size in zip(o, inside.shape, strict=True)) for o in offsets]
    for place in places:
        used[place] |= inside
    number = n - 1 + np.cumsum(used).reshape(used.shape)
    corners = [number[place][inside] for place in places]
    even, odd = _sides(dimension)
    is_odd = cells.sum(axis=1) % 2 == 1
    F = np.empty((n, len(even), dimension + 1), np.int64)
    F[:, :, 0] = np.arange(n)[:, None]
    # A corner at a time: a million voxels have twelve million tetrahedra.
    for side, k in np.ndindex(even.shape):
        F[:, side, k + 1] = np.where(is_odd, corners[odd[side, k]], corners[even[side, k]])
    V = np.concatenate([cells, np.argwhere(used) - 0.5]) * np.asarray(steps)
    return ImageDomain(Mesh(V[:, ::-1], F.reshape(-1, dimension + 1)), index)


def _sides(dimension: int) -> IntArray:
    """Corners (2, k, dimension) of the sides of an even and an odd cell; those of a voxel are cut into triangles.

    Corner 4 i + 2 j + k lies at (i, j, k). Diagonals join the two corners of a side whose coordinates in the image have
    an even sum, so that voxels on both sides of it agree.
    """
    if dimension == 2:
        return np.tile([[0, 1], [1, 3], [3, 2], [2, 0]], (2, 1, 1))
    cut: list[IntArray] = []
    for odd, axis, level in np.ndindex(2, 3, 2):
        one, other = (4 >> (axis + step) % 3 for step in (1, 2))
        square = level * (4 >> axis) + np.array([0, one, one + other, other])
        square = square if level == odd else np.roll(square, -1)
        cut += [square[[0, 1, 2]], square[[0, 2, 3]]]
    return np.reshape(cut, (2, -1, 3))


def checked_spacing(spacing: float | Sequence[float], dimension: int) -> list[float]:
    """The distance between pixels along each axis; a ValueError as for `image_domain`."""
    try:
        steps: list[float] = np.broadcast_to(real_numbers("spacing", spacing), (dimension,)).tolist()
    except ValueError:
        steps = [np.nan]
    if not all(0 < step < np.inf for step in steps):
        count = "two" if dimension == 2 else "three"
        raise ValueError(f"spacing must be one or {count} positive numbers, not {shown(spacing)}")
    return steps


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
    given: AnyArray = as_array("heights", heights if masked is None else np.asarray(heights), MeshError)
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
