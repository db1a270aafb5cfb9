"""Particles of a binary image by geodesic distance (Lantuejoul and Beucher 1981).

The distance between two pixels of a particle is the length of the shortest path inside it: it does not see the particle
next to it, however near that is, which is what makes questions of connectivity easy. `image_domain` makes the domain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import ndimage

from heat_igl.errors import MeshError, MissingExtraError, SourceError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import ImageDomain, image_domain
from heat_igl.sampling import diameter
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, IntArray

__all__ = ["particle_length", "reconstruct", "skeleton", "zones_of_influence"]

# Pixels that touch in a corner are connected, as in `image_domain`.
_CONNECTED = np.ones((3, 3), bool)


def reconstruct(mask: ArrayLike, markers: ArrayLike, radius: float = np.inf, **options: Any) -> BoolArray:
    """The particles that hold a marker, or what lies within `radius` of one inside its particle.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    markers : (rows, columns) array_like of bool
        Pixels that mark the wanted ones; those outside `mask` mark nothing.
    radius : float
        Distance inside the particle up to which it is reconstructed, in pixels: a geodesic dilation.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) bool

    Raises
    ------
    MeshError
        If `mask` holds no pixel.
    SourceError
        If no marker lies in `mask`.
    """
    domain, solver = _solver(mask, options)
    distance = domain.image(solver.distance(domain.vertices(markers)))
    return np.asarray(np.isfinite(distance) & (distance <= radius))


def zones_of_influence(mask: ArrayLike, markers: ArrayLike, **options: Any) -> IntArray:
    """Which marker is nearest inside the particle. The borders between zones are the skeleton by zones of influence.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    markers : (rows, columns) array_like of int
        0 where there is no marker, and the number of the marker where there is one.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) int64
        The number of the nearest marker; 0 outside `mask` and in particles without one.

    Raises
    ------
    MeshError
        If `mask` holds no pixel.
    SourceError
        If `markers` are no image of integers, or a marker lies outside `mask`.
    """
    domain, solver = _solver(mask, options)
    labels = np.asarray(markers)
    if labels.shape != domain.index.shape or labels.dtype.kind not in "iu":
        raise SourceError(
            f"markers must be an image of integers of shape {domain.index.shape}, not {labels.dtype} of {labels.shape}"
        )
    numbers = np.setdiff1d(labels, 0)
    if not len(numbers):
        raise SourceError("markers is 0 everywhere: there is nothing to be near to")
    sets = []
    for number in numbers:
        try:
            sets.append(domain.vertices(labels == number))
        except SourceError:
            raise SourceError(f"marker {number} lies outside the mask") from None
    nearest = np.zeros(domain.mesh.n_vertices, np.int64)
    shortest = np.full(domain.mesh.n_vertices, np.inf)
    for number, distance in zip(numbers, solver.distances(sets), strict=True):
        nearer = distance < shortest
        nearest[nearer] = number
        shortest[nearer] = distance[nearer]
    return np.asarray(domain.image(nearest, outside=0))


def particle_length(mask: ArrayLike, **options: Any) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """The longest way between two pixels of a particle, and the two, which are its ends.

    A lower bound as `diameter` finds it, mostly the longest way.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        One particle.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    length : float
        In pixels, from a corner of one to a corner of the other.
    first, second : (row, column)
        The two.

    Raises
    ------
    MeshError
        If `mask` does not hold exactly one particle.
    """
    domain, solver = _solver(mask, options)
    n_particles = ndimage.label(np.asarray(mask), _CONNECTED)[1]
    if n_particles > 1:
        raise MeshError(f"mask holds {n_particles} particles: pass one at a time, such as labels == 1")
    length, first, second = diameter(solver)
    return length, _pixel(domain, first), _pixel(domain, second)


def skeleton(mask: ArrayLike, shortest_branch: float, **options: Any) -> BoolArray:
    """The particles thinned to strokes, without the branches that end before they are `shortest_branch` long.

    Thinning by scikit-image makes a branch of every bump in the outline. How long one is, from where it leaves the
    rest, is a geodesic distance inside the skeleton; leaving the short ones out disconnects nothing.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    shortest_branch : float
        Length in pixels.
    **options
        As for `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) bool
        As many connected pieces, with as many holes, as `mask` has particles.

    Raises
    ------
    MeshError
        If `mask` is not an image of booleans, or holds no pixel.
    MissingExtraError
        If scikit-image is not installed.
    """
    try:
        from skimage import morphology
    except ImportError:
        raise MissingExtraError.of("thinning", "scikit-image", "images") from None
    skeletonize: Any = morphology.skeletonize
    image_domain(mask)  # for its errors
    thin: BoolArray = np.asarray(skeletonize(np.asarray(mask)))
    n_neighbours = ndimage.convolve(thin.astype(int), _CONNECTED.astype(int), mode="constant") - 1
    forks = thin & (n_neighbours > 2)
    if not forks.any():
        return thin
    domain, solver = _solver(thin, options)
    from_fork = domain.image(solver.distance(domain.vertices(forks)))
    branch, n_branches = ndimage.label(thin & ~forks, _CONNECTED)
    tips = thin & (n_neighbours == 1)
    length = ndimage.maximum(np.where(tips, from_fork, -1.0), branch, np.arange(n_branches + 1))
    is_short = (length >= 0) & (length < shortest_branch)
    return np.asarray(thin & ~is_short[branch])


def _solver(mask: ArrayLike, options: dict[str, Any]) -> tuple[ImageDomain, HeatMethodSolver]:
    domain = image_domain(mask)
    return domain, HeatMethodSolver(domain.mesh, **options)


def _pixel(domain: ImageDomain, vertex: int) -> tuple[int, int]:
    """The pixel whose centre or corner `vertex` is."""
    x, y, _ = domain.mesh.V[vertex]
    inside: AnyArray = np.argwhere(domain.index >= 0)
    row, column = inside[np.argmin((inside[:, 0] - y) ** 2 + (inside[:, 1] - x) ** 2)]
    return int(row), int(column)
