"""From heat to the divergence of the normalized gradient, in one pass over the faces."""

import cython
import numpy as np
from cython.cimports.libc.math import fabs, sqrt


def divergence_of_descent(
    corners: cython.const[cython.int][:, ::1],
    numbers: cython.const[cython.double][:, ::1],
    u: cython.const[cython.double][::1],
    log_u: cython.const[cython.double][::1],
    smallest: cython.double,
    of_log: cython.bint,
):
    """Integrated divergence (n,) of -grad u / |grad u|, damped on faces with a low rate |grad log u| of decay.

    `corners` (m, 3) and `numbers` (m, 5) are those of `heat_igl.heat.steps.NormalizedDivergence`, u (n,) and
    the logarithm in their order. The field is 0 on faces on which no component of grad u reaches `smallest`. It follows
    the gradient of log u if `of_log`, on faces with no corner below `smallest`.
    """
    divergence = np.zeros(u.shape[0])
    total: cython.double[::1] = divergence
    with cython.nogil:
        for f in range(corners.shape[0]):
            # The triangle lies with corner a at the origin and corner b on the first axis.
            a: cython.int = corners[f, 0]
            b: cython.int = corners[f, 1]
            c: cython.int = corners[f, 2]
            per_base: cython.double = numbers[f, PER_BASE]
            foot: cython.double = numbers[f, FOOT]
            per_height: cython.double = numbers[f, PER_HEIGHT]
            rise: cython.double = log_u[b] - log_u[a]
            x_of_log: cython.double = per_base * rise
            y_of_log: cython.double = per_height * (log_u[c] - log_u[a] - foot * rise)
            if of_log and min(u[a], u[b], u[c]) >= smallest:
                x, y = x_of_log, y_of_log
                largest = max(fabs(x), fabs(y))
                if largest == 0.0:
                    continue
            else:
                rise = u[b] - u[a]
                x, y = per_base * rise, per_height * (u[c] - u[a] - foot * rise)
                largest = max(fabs(x), fabs(y))
                if not largest >= smallest:
                    continue
            # The field is damped if heat decays slower than in a front.
            share: cython.double = (x_of_log * x_of_log + y_of_log * y_of_log) * numbers[f, PER_RATE]
            if not share < 1.0:
                share = 1.0
            # Squares of entries below 1e-154 would vanish: the largest is made 1 first.
            x, y = x * (1.0 / largest), y * (1.0 / largest)
            scale: cython.double = numbers[f, AREA] * sqrt(share / (x * x + y * y))
            at_c: cython.double = scale * y * per_height
            at_b: cython.double = scale * x * per_base - foot * at_c
            total[a] -= at_b + at_c
            total[b] += at_b
            total[c] += at_c
    return divergence
