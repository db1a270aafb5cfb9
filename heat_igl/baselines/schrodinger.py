"""Distance as the phase of a wave function: the Schrodinger equation of Gurumoorthy and Rangarajan [GR14].

"A fast eikonal equation solver using the Schrodinger wave equation", cited by the paper in section 2.1. The static
equation ``phi - hbar^2 Lap phi = delta`` has ``d = -hbar log phi`` as Planck's constant, here a length, tends to 0.
With t = hbar^2 it is the paper's backward Euler step (4).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from heat_igl.baselines.grids import grid_sources, grid_spacing
from heat_igl.baselines.linear import domain_of, fallen_from_sources, log_step, reached_from, time_step
from heat_igl.errors import MeshError
from heat_igl.heat_method import smallest_time_step
from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["schrodinger", "schrodinger_grid"]

# Default hbar on meshes, in edge lengths. Below, the mesh's error h^2 / (24 hbar^2) grows; above, that of the cut
# locus. Geometric mean of the mean errors over the square, disk, sphere, cylinder, cow and bunny: 2.6, 1.8 and 2.0 %
# for 1, 1.5 and 2.
_HBAR = 1.5


def schrodinger(
    mesh: Mesh | Operators,
    sources: Sources,
    *,
    hbar: float | None = None,
    green: Literal["bessel", "exponential"] = "bessel",
) -> FloatArray:
    """Distance from a wave function on a mesh, with the Laplacian of the mesh in place of that of the plane.

    Parameters
    ----------
    mesh : Mesh or Operators
        The domain.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.
    hbar : float, optional
        Planck's constant as a length; 1.5 h by default, raised where a double could not hold phi.
    green : {"bessel", "exponential"}
        How distance is read from phi. On a plane the wave function of one source is not an exponential but
        ``K_0(d / hbar) / (2 pi hbar^2)``, a modified Bessel function, and on a cone of total angle Theta the same over
        ``Theta hbar^2``. "bessel" inverts that; without it the factor ``sqrt(hbar / d)`` before the exponential stays
        as an error of ``hbar log(d / hbar) / 2``. "exponential" is the formula of [GR14] as it stands,
        ``-hbar log(phi / phi_source)``, Varadhan's with t = hbar^2.

    Returns
    -------
    (n,) float64
        In the mesh's unit; 0 at the sources, ``inf`` where none is reached. Between K sources by up to ``hbar log K``
        too short.

    Raises
    ------
    SourceError
        If the sources name no vertex of the mesh.
    MeshError
        If "bessel" is asked for on tetrahedra.
    ValueError
        If `hbar` is not positive or `green` is unknown.

    Warns
    -----
    AccuracyWarning
        If an explicit `hbar` had to be raised, or phi is not positive everywhere.
    """
    domain = domain_of(mesh)
    chosen = vertex_sources(sources, domain.n)
    if green not in ("bessel", "exponential"):
        raise ValueError(f"green must be 'bessel' or 'exponential', not {green!r}")
    if hbar is not None and not (np.isfinite(hbar) and hbar > 0):
        raise ValueError(f"hbar must be a positive length, not {hbar!r}")
    default = (_HBAR * domain.mean_edge_length) ** 2
    t = time_step(None if hbar is None else hbar**2, default, smallest_time_step(domain), name="hbar^2")
    length = float(np.sqrt(t))
    if green == "exponential":
        return np.asarray(length * fallen_from_sources(log_step(domain, chosen, t), domain, chosen))
    if domain.surface is None:
        raise MeshError("green='bessel' is for triangles, and the domain has none: pass green='exponential'")
    share = np.zeros(domain.n)
    share[chosen] = _total_angles(domain.surface.triangulation)[chosen] / (2 * np.pi)
    log_phi = log_step(domain, chosen, t, share)
    distance = np.full(domain.n, np.inf)
    reached = reached_from(domain, chosen)
    distance[reached] = length * _inverse_log_bessel(log_phi[reached] + np.log(2 * np.pi * t))
    distance[chosen] = 0.0
    return distance


def _total_angles(triangulation: IntrinsicTriangulation) -> FloatArray:
    """The sum (n,) of the angles around each vertex: 2 pi inside a plane, pi on a straight boundary."""
    square = triangulation.l**2
    product = triangulation.l[:, [1, 2, 0]] * triangulation.l[:, [2, 0, 1]]
    angle = np.arccos(np.clip((square.sum(axis=1, keepdims=True) - 2 * square) / (2 * product), -1, 1))
    return np.asarray(
        np.bincount(triangulation.F.ravel(), weights=angle.ravel(), minlength=triangulation.n), np.float64
    )


def _inverse_log_bessel(y: FloatArray) -> FloatArray:
    """The x with ``log K_0(x) = y``, to rounding.

    As a function of log x, log K_0 is concave and falls, so that Newton's method from the right of the solution comes
    down to it without overshooting.
    """
    from scipy.special import k0e, k1e  # K_0 and K_1 times exp(x), which do not underflow

    # K_0(1) = exp(-0.866), and K_0(x) < sqrt(pi / 2) exp(-x) beyond.
    log_x = np.log(np.where(y > -0.86, 1.0, 0.25 - y))
    for _ in range(100):
        x = np.exp(log_x)
        step = (np.log(k0e(x)) - x - y) * k0e(x) / (x * k1e(x))
        log_x += step
        if np.abs(step).max(initial=0.0) < 1e-14:
            break
    return np.asarray(np.exp(log_x))


def schrodinger_grid(sources: ArrayLike, spacing: ArrayLike = 1.0, *, hbar: float | None = None) -> FloatArray:
    """Euclidean distance as the phase of a wave function, by one convolution.

    The static Schrodinger equation ``hbar^2 Lap phi = phi`` with point sources has ``d = -hbar log phi`` as hbar tends
    to 0. On all of space phi is a sum of Green's functions, whose factor before ``exp(-r / hbar)`` does not matter
    in that limit and is singular at the source; left out, ``phi = sum exp(-|x - y_k| / hbar)`` over the sources y_k
    is a discrete convolution, and ``d - hbar log K <= -hbar log phi <= d`` for K sources (Gurumoorthy and Rangarajan,
    "A fast eikonal equation solver using the Schrodinger wave equation", cited as [GR14] by the paper, section 2.1).

    Parameters
    ----------
    sources : (n_0, ..., n_d) array_like of bool
        Marks the points from which distance is measured.
    spacing : float or (d,) array_like
        Step of the grid along each axis.
    hbar : float, optional
        Planck's constant as a length; a quarter of the smallest spacing by default. Time grows with 1 / hbar.

    Returns
    -------
    (n_0, ..., n_d) float64
        Distance in all of space, by no more than ``hbar log K`` too short. Obstacles cannot be had this way.

    Raises
    ------
    SourceError
        If there is no source, or `sources` is not boolean.
    ValueError
        If `spacing` or `hbar` is not positive.

    Notes
    -----
    [GR14] run the fast Fourier transform in arbitrary precision: in doubles its rounding, 1e-16 of the *largest* value,
    ends every distance at 36 hbar. Here the kernel is cut into digits of some 30 bits instead. Transforms in doubles
    convolve one digit exactly, because the result is made of integers and rounding restores them, so that the first
    digits that do not vanish at a point give its phi to full relative accuracy, however small.
    """
    mask = grid_sources(sources)
    steps = grid_spacing(spacing, mask.ndim)
    length = float(steps.min()) / 4 if hbar is None else float(hbar)
    if not (np.isfinite(length) and length > 0):
        raise ValueError(f"hbar must be a positive length, not {hbar!r}")
    # At a source the sum is at least 1, and near many of them it may be.
    return np.maximum(-length * _log_wave(mask, steps, length), 0.0)


def _log_wave(mask: BoolArray, steps: FloatArray, hbar: float) -> FloatArray:
    """The logarithm of the sum of ``exp(-r / hbar)`` over the points of `mask`, without a limit to its range."""
    from scipy import fft

    shape = [fft.next_fast_len(2 * n - 1, real=True) for n in mask.shape]
    offsets = [np.minimum(np.arange(n), n - np.arange(n)) * step for n, step in zip(shape, steps, strict=True)]
    r = np.sqrt(sum(x**2 for x in np.ix_(*offsets)))
    # exp(-r / hbar) = mantissa 2^-shift, to the last bit of a double mantissa.
    halvings = r / (hbar * np.log(2))
    mantissa = np.rint(np.exp2(53 - halvings % 1)).astype(np.uint64)
    shift = 53 + np.floor(halvings).astype(np.int64)
    # Rounding to the nearest integer is safe while the transform's error, about eps log2(N) times the 2-norms of both
    # factors, stays below 1/2; six bits are kept in reserve.
    size = float(r.size)
    bits = int(53 - 6 - np.log2(np.sqrt(mask.sum() * size) * np.log2(size + 1)))
    spectrum = fft.rfftn(mask.astype(np.float64), shape)
    inside = tuple(slice(n) for n in mask.shape)
    value, first = np.zeros(mask.shape), np.full(mask.shape, -1)
    digit = 0
    while ((first < 0) | (digit - first < 3)).any():
        kernel = _digit(mantissa, shift, digit, bits)
        sums = np.rint(fft.irfftn(spectrum * fft.rfftn(kernel), shape)[inside])
        first[(first < 0) & (sums > 0)] = digit
        weight = np.exp2(-bits * np.minimum(digit - first, 4.0))
        value += np.where(first < 0, 0.0, sums * weight)
        digit += 1
    return np.asarray(np.log(value) - first * (bits * np.log(2)))


def _digit(mantissa: AnyArray, shift: IntArray, digit: int, bits: int) -> FloatArray:
    """Digit number `digit` after the point, to the base ``2^bits``, of ``mantissa 2^-shift``; number 0 is before it."""
    right = shift - digit * bits
    down = mantissa >> np.clip(right, 0, 63).astype(np.uint64)
    up = mantissa << np.clip(-right, 0, 63).astype(np.uint64)  # bits that leave at the top belong to earlier digits
    return np.asarray(np.where(right >= 0, down, up) & np.uint64(2**bits - 1), np.float64)
