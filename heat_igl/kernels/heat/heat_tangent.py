"""The heat method on the faces in the direction of the method: how matrices and the normalized field change.

Sides are those of `heat_igl.kernels.heat.heat_adjoint`: c runs between the corners c + 1 and c + 2.
"""

import cython
from cython.cimports.heat_igl.kernels.heat.face_fields import FaceField, normalize

__all__ = ["elements", "multiply", "normalized"]


def elements(
    F: cython.const[cython.longlong][:, ::1],
    length: cython.const[cython.double][:, ::1],
    by_side: cython.const[cython.double][:, ::1],
    weight: cython.const[cython.double][:, ::1],
    area: cython.const[cython.double][::1],
    share: cython.double,
    of_weight: cython.double[:, ::1],
    of_area: cython.double[::1],
    of_mass: cython.double[::1],
):
    """How weights (m, 3) and areas (m,) change with the sides (m, 3); changes of masses are added to `of_mass` (n,).

    A face has `share` of its area, see `heat_igl.operators.Elements`.
    """
    f: cython.Py_ssize_t
    c: cython.int
    of_square: cython.double[3]
    part: cython.double[3]
    with cython.nogil:
        for f in range(F.shape[0]):
            change: cython.double = 0.0
            total: cython.double = 0.0
            is_obtuse: cython.bint = False
            for c in range(3):
                of_square[c] = length[f, c] * by_side[f, c]
                # The area changes by the length times the weight.
                change += of_square[c] * weight[f, c]
                total += of_square[c]
                is_obtuse = is_obtuse or weight[f, c] < 0.0
            of_area[f] = change
            all_parts: cython.double = 0.0
            for c in range(3):
                # A weight is inner / (8 area).
                inner: cython.double = 2.0 * (total - 2.0 * of_square[c])
                of_weight[f, c] = (share * share / 8 * inner - weight[f, c] * change) / area[f]
                # The cell of a corner has a part for both sides there.
                part[c] = length[f, c] * length[f, c] * of_weight[f, c] / 4 + of_square[c] * weight[f, c] / 2
                all_parts += part[c]
            for c in range(3):
                if is_obtuse:
                    # The cell of the obtuse corner is half the triangle, those of the others a quarter.
                    of_mass[F[f, c]] += change * (0.5 if weight[f, c] < 0.0 else 0.25)
                else:
                    of_mass[F[f, c]] += all_parts - part[c]


def multiply(
    F: cython.const[cython.longlong][:, ::1],
    entry: cython.const[cython.double][:, ::1],
    v: cython.const[cython.double][::1],
    result: cython.double[::1],
):
    """Add to `result` (n,) the product with v (n,) of the matrix with -entry (m, 3) at the ends of each side.

    Its rows sum to 0.
    """
    f: cython.Py_ssize_t
    c: cython.int
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                i: cython.longlong = F[f, (c + 1) % 3]
                j: cython.longlong = F[f, (c + 2) % 3]
                flux: cython.double = entry[f, c] * (v[i] - v[j])
                result[i] += flux
                result[j] -= flux


def normalized(
    F: cython.const[cython.longlong][:, ::1],
    weight: cython.const[cython.double][:, ::1],
    area: cython.const[cython.double][::1],
    v: cython.const[cython.double][::1],
    of_v: cython.const[cython.double][::1],
    full_rate: cython.const[cython.double][::1],
    component: cython.const[cython.longlong][::1],
    of_log_t: cython.const[cython.double][::1],
    of_weight: cython.const[cython.double][:, ::1],
    of_area: cython.const[cython.double][::1],
    change: cython.double[::1],
):
    """Add to `change` (n,) how the divergence of the normalized field changes, see `heat_adjoint.normalized`.

    `of_weight` (m, 3), `of_area` (m,), `of_v` (n,) and, for each component, `of_log_t` are changes of the weights, the
    areas, v and the logarithm of the time step.
    """
    f: cython.Py_ssize_t
    c: cython.int
    corner: cython.longlong[3]
    d: cython.double[3]
    of_d: cython.double[3]
    field: FaceField
    with cython.nogil:
        for f in range(F.shape[0]):
            for c in range(3):
                corner[c] = F[f, c]
            for c in range(3):
                i: cython.longlong = corner[(c + 1) % 3]
                j: cython.longlong = corner[(c + 2) % 3]
                d[c], of_d[c] = v[i] - v[j], of_v[i] - of_v[j]
            if not normalize(d, cython.address(weight[f, 0]), area[f], full_rate[f], cython.address(field)):
                continue
            of_energy: cython.double = 0.0
            for c in range(3):
                of_d[c] = of_d[c] * field.scale
                of_energy += of_weight[f, c] * d[c] * d[c] + 2.0 * weight[f, c] * d[c] * of_d[c]
            s: cython.double = field.s
            of_s: cython.double
            if field.is_damped:
                of_s = 0.5 * s * of_log_t[component[corner[0]]]
            else:
                of_s = 0.5 * s * (of_area[f] / area[f] - of_energy / field.energy)
            for c in range(3):
                flux: cython.double = of_s * weight[f, c] * d[c]
                flux += s * (of_weight[f, c] * d[c] + weight[f, c] * of_d[c])
                change[corner[(c + 1) % 3]] += flux
                change[corner[(c + 2) % 3]] -= flux
