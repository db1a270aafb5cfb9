"""Error estimate of the Hopf-Lax scheme: how far the gradients of distance contradict its values."""

import cython
import numpy as np
from cython.cimports.heat_igl.kernels.sweep.facets import pair
from cython.cimports.heat_igl.kernels.sweep.hopf_lax import HopfLax
from cython.cimports.libc.math import fabs

# Where metrics turn far, dependencies are cyclic, and later visits have changed them: 5 passes find nearly all.
_PASSES = cython.declare(cython.int, 5)


def estimated_errors(h: HopfLax, v):
    """Estimated errors (k,) of the distances of visited vertices v (k,), after `spread`.

    The error of an update is `_interpolation_error`, plus the errors at the corners of its facet, weighted by the
    barycentric coordinates of the minimizer.
    """
    total_array, own_array = np.zeros(h.d.shape[0]), np.zeros(h.d.shape[0])
    total: cython.double[::1] = total_array
    own: cython.double[::1] = own_array
    with cython.nogil:
        h.update.d = cython.address(h.d[0])
        for at in range(h.n_reached):
            own[h.order[at]] = _interpolation_error(h, h.order[at])
        for _pass in range(_PASSES):
            changes: cython.bint = False
            for at in range(h.n_reached):
                w: cython.int = h.order[at]
                so_far: cython.double = own[w]
                for i in range(h.update.p if h.facet[w] >= 0 else 0):
                    so_far += h.share(w, i) * total[h.support(w, i)]
                changes |= so_far != total[w]
                total[w] = so_far
            if not changes:
                break
    return total_array[v]


@cython.cfunc
@cython.nogil
def _interpolation_error(h: HopfLax, v: cython.int) -> cython.double:
    """Estimated error of interpolated T at the minimizer of the last update of v.

    Along an edge of the facet, the values of T^2 and the gradients at its ends give two differences. They agree if T^2
    is quadratic. Otherwise the error of T^2 is their difference, plus the part of the second difference that the weight
    of the second order leaves out, but at most the squared length of the edge; times both barycentric coordinates.
    """
    at: cython.int = h.beyond[v] if h.beyond[v] >= 0 else h.facet[v]
    s: cython.int = at // h.corners.shape[1]
    own: cython.double = 0.0
    if at < 0:
        return 0.0
    T: cython.double = h.above(v, h.low)
    h.update.face(s, at % h.corners.shape[1])
    for i in range(h.update.p):
        a: cython.int = h.support(v, i)
        one: cython.double = h.d[a] - h.low
        for j in range(i):
            b: cython.int = h.support(v, j)
            two: cython.double = h.d[b] - h.low
            at_a: cython.double = 0.0
            at_b: cython.double = 0.0
            for k in range(3):
                e: cython.double = h.update.V[b, k] - h.update.V[a, k]
                at_a += one * h.update.slope[a, k] * e
                at_b += two * h.update.slope[b, k] * e
            gap: cython.double = fabs(two * two - one * one - at_a - at_b)
            gap += (1.0 - h.weight[v]) * fabs(at_b - at_a - (two - one) * (two - one))
            between: cython.double = h.update.mean[s, pair(h.update.side[i], h.update.side[j])]
            own += h.share(v, i) * h.share(v, j) * min(gap, between)
    return -0.5 * own / T if T < 0.0 and own >= 0.0 else 0.0
