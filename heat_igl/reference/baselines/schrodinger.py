"""Distance from the Schrodinger equation of Gurumoorthy and Rangarajan [GR14].

[GR14] is "A fast eikonal equation solver using the Schrodinger wave equation", cited by the paper in section 2.1. For
the static equation ``phi - hbar^2 Lap phi = delta``, ``-hbar log phi`` tends to the distance as Planck's constant hbar,
here a length, tends to 0. With t = hbar^2 the equation is the backward Euler step (4) of the paper.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators
from heat_igl.reference.baselines.decay import domain_of, fallen_from_sources, log_step, reached_from, time_step
from heat_igl.reference.baselines.grids import grid_sources, grid_spacing
from heat_igl.sources import Sources, vertex_sources
from heat_igl.steps import smallest_time_step
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

# Default hbar on meshes, in edge lengths. For smaller hbar the discretization error h^2 / (24 hbar^2) grows, for larger
# hbar the error at the cut locus. Geometric mean of the mean errors over the square, disk, sphere, cylinder, cow and
# bunny: 2.6, 1.8 and 2.0 % for 1, 1.5 and 2.
_HBAR = 1.5


def schrodinger(
    mesh: Mesh | Operators,
    sources: Sources,
    *,
    hbar: float | None = None,
    green: Literal["bessel", "exponential"] = "bessel",
) -> FloatArray:
    """Distance from the static Schrodinger equation on a mesh.

    Parameters
    ----------
    mesh, sources
        As for `varadhan`.
    hbar : float, optional
        Planck's constant as a length; 1.5 h by default. It is raised if phi would underflow.
    green : {"bessel", "exponential"}
        Green's function that is inverted. On a plane the wave function of one source is
        ``K_0(d / hbar) / (2 pi hbar^2)`` with a modified Bessel function; on a cone of total angle Theta it is
        ``K_0(d / hbar) / (Theta hbar^2)``. "bessel" inverts this function. "exponential" is the formula of [GR14],
        ``-hbar log(phi / phi_source)``, which is Varadhan's with t = hbar^2. It neglects the factor ``sqrt(hbar / d)``
        of the Bessel function, which causes an error of ``hbar log(d / hbar) / 2``.

    Returns
    -------
    (n,) float64
        Distance in the unit of the mesh; 0 at the sources, ``inf`` at unreachable vertices. Between K sources it is
        too short by up to ``hbar log K``.

    Raises
    ------
    SourceError
        If the sources are not vertices of the mesh.
    MeshError
        If `green` is "bessel" and the domain is not a triangle mesh.
    ValueError
        If `hbar` is not positive or `green` is unknown.

    Warns
    -----
    AccuracyWarning
        If a given `hbar` is raised, or phi is not positive everywhere.
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
    share[chosen] = domain.surface.triangulation.total_angles[chosen] / (2 * np.pi)
    log_phi = log_step(domain, chosen, t, share)
    distance = np.full(domain.n, np.inf)
    reached = reached_from(domain, chosen)
    distance[reached] = length * _inverse_log_bessel(log_phi[reached] + np.log(2 * np.pi * t))
    distance[chosen] = 0.0
    return distance


def _inverse_log_bessel(y: FloatArray) -> FloatArray:
    """The x with ``log K_0(x) = y``, to rounding.

    As a function of log x, log K_0 is concave and decreasing. Newton's method therefore converges monotonically from
    the right of the solution.
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
    """Euclidean distance on a regular grid from the static Schrodinger equation [GR14], by one convolution.

    For the static equation ``hbar^2 Lap phi = phi`` with point sources, ``-hbar log phi`` tends to the distance d as
    hbar tends to 0. In free space phi is a sum of Green's functions. The factor before ``exp(-r / hbar)`` does not
    matter in the limit and is singular at the source, so it is omitted: ``phi = sum exp(-|x - y_k| / hbar)`` over the
    sources y_k is a discrete convolution, and ``d - hbar log K <= -hbar log phi <= d`` for K sources.

    Parameters
    ----------
    sources, spacing
        As for `fast_marching_grid`.
    hbar : float, optional
        Planck's constant as a length; a quarter of the smallest spacing by default. The cost grows with 1 / hbar.

    Returns
    -------
    (n_0, ..., n_d) float64
        Distance in free space, too short by at most ``hbar log K``. Obstacles are not supported.

    Raises
    ------
    SourceError
        If there is no source, or `sources` is not boolean.
    ValueError
        If `spacing` or `hbar` is not positive.

    Notes
    -----
    [GR14] compute the fast Fourier transform in arbitrary precision: in doubles the rounding error, 1e-16 of the
    *largest* value, limits distances to 36 hbar. Here the kernel is split into digits of about 30 bits. A transform in
    doubles convolves one digit exactly, since the result consists of integers, which rounding restores. The first
    nonzero digits at a point then give phi with full relative accuracy, however small it is.
    """
    mask = grid_sources(sources)
    steps = grid_spacing(spacing, mask.ndim)
    length = float(steps.min()) / 4 if hbar is None else float(hbar)
    if not (np.isfinite(length) and length > 0):
        raise ValueError(f"hbar must be a positive length, not {hbar!r}")
    # At a source, and near many sources, the sum can exceed 1.
    return np.maximum(-length * _log_wave(mask, steps, length), 0.0)


def _log_wave(mask: BoolArray, steps: FloatArray, hbar: float) -> FloatArray:
    """Logarithm of the sum of ``exp(-r / hbar)`` over the points of `mask`, with unlimited range."""
    from scipy import fft

    shape = [fft.next_fast_len(2 * n - 1, real=True) for n in mask.shape]
    offsets = [np.minimum(np.arange(n), n - np.arange(n)) * step for n, step in zip(shape, steps, strict=True)]
    r = np.sqrt(sum(x**2 for x in np.ix_(*offsets)))
    # exp(-r / hbar) = mantissa 2^-shift, with the precision of a double.
    halvings = r / (hbar * np.log(2))
    mantissa = np.rint(np.exp2(53 - halvings % 1)).astype(np.uint64)
    shift = 53 + np.floor(halvings).astype(np.int64)
    # Rounding to the nearest integer is correct if the error of the transform, about eps log2(N) times the 2-norms of
    # both factors, is below 1/2; six bits are a safety margin.
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
    """Digit `digit` after the point of ``mantissa 2^-shift`` to the base ``2^bits``; digit 0 is before the point."""
    right = shift - digit * bits
    down = mantissa >> np.clip(right, 0, 63).astype(np.uint64)
    up = mantissa << np.clip(-right, 0, 63).astype(np.uint64)  # bits that leave at the top belong to earlier digits
    return np.asarray(np.where(right >= 0, down, up) & np.uint64(2**bits - 1), np.float64)
