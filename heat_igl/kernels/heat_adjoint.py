"""The adjoint of the heat method on the faces: of the normalized field with the Poisson problem, and of the heat flow.

A side c of a face runs between the corners c + 1 and c + 2; differences along it are taken in this direction.
"""

import cython
from cython.cimports.libc.math import fabs, sqrt

__all__ = ["heat_flow", "normalized"]


def normalized(
    F: cython.const[cython.longlong][:, ::1],
    weight: cython.const[cython.double][:, ::1],
    area: cython.const[cython.double][::1],
    v: cython.const[cython.double][::1],
    phi: cython.const[cython.double][::1],
    p: cython.const[cython.double][::1],
    full_rate: cython.const[cython.double][::1],
    by_weight: cython.double[:, ::1],
    by_area: cython.double[::1],
    by_step: cython.double[::1],
    by_v: cython.double[::1],
):
    """Add the derivative of p . (b - L phi), with b the divergence of the normalized field, see `HeatAdjoint`.

    On each face b is s K v with s = 1 / |grad v|, or 1 / full_rate where the gradient is below that (m,), 0 for never.
    Added to `by_weight` (m, 3), `by_area` (m,) and `by_v` (n,); to `by_step` (m,) the derivative by the logarithm of
    the time step.
    """
    f: cython.Py_ssize_t
    c: cython.int
    d: cython.double[3]
    q: cython.double[3]
    with cython.nogil:
        for f in range(F.shape[0]):
            largest: cython.double = 0.0
            for c in range(3):
                d[c] = v[F[f, (c + 1) % 3]] - v[F[f, (c + 2) % 3]]
                q[c] = p[F[f, (c + 1) % 3]] - p[F[f, (c + 2) % 3]]
                by_weight[f, c] += q[c] * (phi[F[f, (c + 1) % 3]] - phi[F[f, (c + 2) % 3]])
                largest = max(largest, fabs(d[c]))
            if largest == 0.0:
                continue
            # Squares of the differences of heat may vanish: the largest is made 1 first.
            scale: cython.double = 1.0 / largest
            energy: cython.double = 0.0
            by_s: cython.double = 0.0
            for c in range(3):
                d[c] = d[c] * scale
                energy += weight[f, c] * d[c] * d[c]
                by_s += weight[f, c] * q[c] * d[c]
            if not energy > 0.0:
                continue
            s: cython.double = sqrt(area[f] / energy)
            by_energy: cython.double = 0.0
            if full_rate[f] * s * scale > 1.0:
                # As d has been scaled, so is s.
                s = largest / full_rate[f]
                by_step[f] += 0.5 * by_s * s
            else:
                by_energy = -0.5 * by_s * s / energy
                by_area[f] += 0.5 * by_s * s / area[f]
            for c in range(3):
                by_weight[f, c] += s * q[c] * d[c] + by_energy * d[c] * d[c]
                pull: cython.double = (s * q[c] + 2.0 * by_energy * d[c]) * weight[f, c] * scale
                by_v[F[f, (c + 1) % 3]] += pull
                by_v[F[f, (c + 2) % 3]] -= pull


def heat_flow(
    F: cython.const[cython.longlong][:, ::1],
    x: cython.const[cython.double][::1],
    u: cython.const[cython.double][::1],
    unit: cython.const[cython.double][::1],
    by_weight: cython.double[:, ::1],
):
    """Subtract products of differences of x and u along each side, in units (n,), from `by_weight` (m, 3)."""
    f: cython.Py_ssize_t
    c: cython.int
    with cython.nogil:
        for f in range(F.shape[0]):
            per_unit: cython.double = 1.0 / unit[F[f, 0]]
            for c in range(3):
                i: cython.longlong = F[f, (c + 1) % 3]
                j: cython.longlong = F[f, (c + 2) % 3]
                by_weight[f, c] -= (x[i] - x[j]) * ((u[i] - u[j]) * per_unit)
