"""Analysis of particles in a binary image by geodesic distance (Lantuejoul and Beucher 1981).

The geodesic distance between two pixels of a particle is the length of the shortest path inside the particle. Adjacent
particles, however near, do not affect it. `image_domain` makes the mesh.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import ndimage

from heat_igl.errors import MeshError, MissingExtraError, SourceError
from heat_igl.geodesic import Solver, SolverChoice
from heat_igl.mesh import ImageDomain, image_domain
from heat_igl.sampling import diameter
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, IntArray

# Diagonally adjacent pixels are connected, as in `image_domain`.
_CONNECTED = np.ones((3, 3), bool)


def reconstruct(mask: ArrayLike, markers: ArrayLike, radius: float = np.inf, **options: Any) -> BoolArray:
    """Reconstruct the particles that contain a marker, up to the distance `radius` from the markers.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    markers : (rows, columns) array_like of bool
        The markers; pixels outside `mask` are ignored.
    radius : float
        Largest geodesic distance from a marker, in pixels; a finite radius gives a geodesic dilation.
    **options
        `method` and `tolerance`, as for `geodesic_distance`, or options of `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) bool
        Mask of the reconstructed pixels.

    Raises
    ------
    MeshError
        If `mask` has no pixel.
    SourceError
        If no marker lies in `mask`.
    """
    domain, solver = _solver(mask, options)
    distance = domain.image(solver.distance(domain.vertices(markers)))
    return np.asarray(np.isfinite(distance) & (distance <= radius))


def zones_of_influence(mask: ArrayLike, markers: ArrayLike, **options: Any) -> IntArray:
    """Label each pixel by the nearest marker in the same particle, by geodesic distance.

    The borders between the zones are the skeleton by influence zones.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    markers : (rows, columns) array_like of int
        The number of the marker at each pixel, 0 for no marker.
    **options
        `method` and `tolerance`, as for `geodesic_distance`, or options of `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) int64
        The number of the nearest marker; 0 outside `mask` and in particles without one.

    Raises
    ------
    MeshError
        If `mask` holds no pixel.
    SourceError
        If `markers` is not an image of integers, has no marker, or has a marker outside `mask`.
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
    """The geodesic diameter of a particle, and the two pixels at the ends.

    `diameter` computes it: the result is a lower bound, which is mostly attained.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        One particle.
    **options
        `method` and `tolerance`, as for `geodesic_distance`, or options of `HeatMethodSolver`.

    Returns
    -------
    length : float
        Distance in pixels between corners of the two pixels.
    first, second : (row, column)
        The pixels at the ends.

    Raises
    ------
    MeshError
        If `mask` does not contain exactly one particle.
    """
    domain, solver = _solver(mask, options)
    n_particles = ndimage.label(np.asarray(mask), _CONNECTED)[1]
    if n_particles > 1:
        raise MeshError(f"mask holds {n_particles} particles: pass one at a time, such as labels == 1")
    length, first, second = diameter(solver)
    return length, _pixel(domain, first), _pixel(domain, second)


def skeleton(mask: ArrayLike, shortest_branch: float, **options: Any) -> BoolArray:
    """The skeleton of the particles by thinning, without branches shorter than `shortest_branch`.

    Thinning by scikit-image makes a branch for every bump of the outline. The length of a branch is the geodesic
    distance inside the skeleton from the fork to the tip. Removal of short branches disconnects nothing.

    Parameters
    ----------
    mask : (rows, columns) array_like of bool
        The particles.
    shortest_branch : float
        Smallest length of a branch, in pixels.
    **options
        `method` and `tolerance`, as for `geodesic_distance`, or options of `HeatMethodSolver`.

    Returns
    -------
    (rows, columns) bool
        The skeleton, with the same number of connected components and of holes as `mask`.

    Raises
    ------
    MeshError
        If `mask` is not a boolean image, or has no pixel.
    MissingExtraError
        If scikit-image is not installed.
    """
    with MissingExtraError.guard("thinning", "scikit-image", "images"):
        from skimage import morphology
    skeletonize: Any = morphology.skeletonize
    image_domain(mask)  # raises the errors for an invalid mask
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


def _solver(mask: ArrayLike, options: dict[str, Any]) -> tuple[ImageDomain, Solver]:
    domain = image_domain(mask)
    return domain, SolverChoice.of(**options).on(domain.mesh)


def _pixel(domain: ImageDomain, vertex: int) -> tuple[int, int]:
    """The pixel (row, column) nearest to `vertex`, which is the centre or a corner of a pixel."""
    x, y, _ = domain.mesh.V[vertex]
    inside: AnyArray = np.argwhere(domain.index >= 0)
    row, column = inside[np.argmin((inside[:, 0] - y) ** 2 + (inside[:, 1] - x) ** 2)]
    return int(row), int(column)
