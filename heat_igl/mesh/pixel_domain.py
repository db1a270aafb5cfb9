"""Planar images: the pixels of a mask as a flat mesh, and values per vertex as an image again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heat_igl.errors import MeshError, SourceError
from heat_igl.mesh.mesh import Mesh
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, IntArray

__all__ = ["ImageDomain", "image_domain"]

_FACES_PER_PIXEL = 4


@dataclass(frozen=True, eq=False)
class ImageDomain:
    """The pixels of a mask as a flat triangle mesh, made by `image_domain`.

    Attributes
    ----------
    mesh : Mesh
        In the plane z = 0: x runs along the columns, y down the rows.
    index : (rows, columns) int64
        Vertex at the centre of each pixel; -1 outside the mask. They count up from 0 row by row, and the corners of the
        pixels follow.
    """

    mesh: Mesh
    index: IntArray

    def vertices(self, pixels: ArrayLike) -> IntArray:
        """The vertices at the centres of some pixels, to be used as sources.

        Parameters
        ----------
        pixels : (rows, columns) array_like of bool
            Pixels outside the domain are ignored.

        Raises
        ------
        SourceError
            If `pixels` is no mask of the image's shape, or selects no pixel of the domain.
        """
        chosen = np.asarray(pixels)
        if chosen.shape != self.index.shape or chosen.dtype.kind != "b":
            raise SourceError(
                f"pixels must be a boolean image of shape {self.index.shape}, not {chosen.dtype} of {chosen.shape}"
            )
        found = self.index[chosen & (self.index >= 0)]
        if not len(found):
            raise SourceError("pixels selects no pixel of the domain")
        return found

    def image(self, values: ArrayLike, outside: float = np.inf) -> AnyArray:
        """Values per vertex (n,), such as a distance, as an image (rows, columns); `outside` off the domain.

        Raises
        ------
        ValueError
            If `values` has another length.
        """
        array = np.asarray(values)
        if array.shape != (self.mesh.n_vertices,):
            raise ValueError(f"values must have shape ({self.mesh.n_vertices},), one per vertex, not {array.shape}")
        inside = self.index >= 0
        image = np.full(self.index.shape, outside, dtype=np.result_type(array.dtype, np.min_scalar_type(outside)))
        image[inside] = array[self.index[inside]]
        return image

    def per_face(self, image: ArrayLike) -> AnyArray:
        """Values per pixel (rows, columns), such as a speed, as values per face of `mesh` (m,).

        Raises
        ------
        ValueError
            If `image` has another shape.
        """
        array = np.asarray(image)
        if array.shape != self.index.shape:
            raise ValueError(f"image must have shape {self.index.shape}, not {array.shape}")
        return np.repeat(array[self.index >= 0], _FACES_PER_PIXEL)


def image_domain(mask: ArrayLike, spacing: float | Sequence[float] = 1.0) -> ImageDomain:
    """A flat mesh of the pixels of `mask`.

    Every pixel is a rectangle, cut into four triangles around the centre: no diagonal direction is preferred, no pixel
    is lost, and the area of the mesh is that of the pixels. Pixels that touch only in a corner are connected through
    this point, as with skimage's ``connectivity=2``, and a stroke one pixel wide becomes a strip one pixel wide.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The pixels of the domain.
    spacing : float or (float, float), optional
        Distance between the centres of neighbouring pixels; for rectangular ones first from row to row, then from
        column to column, like skimage's.

    Returns
    -------
    ImageDomain
        The mesh has a vertex for each pixel and one for each corner of pixels.

    Raises
    ------
    MeshError
        If `mask` is not an image of booleans, or holds no pixel.
    ValueError
        If `spacing` is not one or two positive numbers.

    Examples
    --------
    >>> from heat_igl import HeatMethodSolver, image_domain
    >>> domain = image_domain([[True, True, False], [False, False, True]])
    >>> distance = HeatMethodSolver(domain.mesh).distance(domain.index[0, 0])
    >>> domain.image(distance).shape
    (2, 3)
    """
    inside = _mask(mask)
    down, across = _spacing(spacing)
    row, column = np.nonzero(inside)
    n = len(row)
    index = np.full(inside.shape, -1)
    index[inside] = np.arange(n)
    # Corner (r, c) is the upper left one of pixel (r, c).
    wide = inside.shape[1] + 1
    upper_left = row * wide + column
    rim = np.stack([upper_left, upper_left + 1, upper_left + wide + 1, upper_left + wide], axis=1)
    used, corner = np.unique(rim, return_inverse=True)
    corner = n + corner.reshape(n, 4)
    centre = np.broadcast_to(np.arange(n)[:, None], (n, 4))
    F = np.stack([centre, corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 3)
    corner_row, corner_column = np.divmod(used, wide)
    y = np.concatenate([row, corner_row - 0.5]) * down
    x = np.concatenate([column, corner_column - 0.5]) * across
    return ImageDomain(Mesh(np.stack([x, y, np.zeros(len(x))], axis=1), F), index)


def _mask(mask: ArrayLike) -> BoolArray:
    try:
        array: AnyArray = np.asarray(mask)
    except ValueError:
        raise MeshError("mask must be a boolean image (rows, columns), not a ragged sequence") from None
    if array.ndim != 2 or array.dtype.kind != "b":
        raise MeshError(
            f"mask must be a boolean image (rows, columns), not {array.dtype} of shape {array.shape}: compare with a "
            "threshold first"
        )
    if not array.any():
        raise MeshError("mask holds no pixel: a domain needs at least one")
    return array


def _spacing(spacing: float | Sequence[float]) -> tuple[float, float]:
    try:
        down, across = np.broadcast_to(np.asarray(spacing, dtype=np.float64), (2,)).tolist()
    except (TypeError, ValueError):
        down, across = np.nan, np.nan
    if not (0 < down < np.inf and 0 < across < np.inf):
        raise ValueError(f"spacing must be one or two positive numbers, not {spacing!r}")
    return down, across
