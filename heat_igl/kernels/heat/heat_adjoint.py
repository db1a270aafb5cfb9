"""The adjoint of the heat method on the faces: of the normalized field with the Poisson problem, and of the heat flow.

Both lead to weights, areas and masses of the triangles, and these to the lengths of their sides.

A side c of a face runs between the corners c + 1 and c + 2; differences along it are taken in this direction.
"""

import cython
from cython.cimports.heat_igl.kernels.heat.face_fields import FaceField, normalize

__all__ = ["elements", "normalized"]


def normalized(
    F: cython.const[cython.longlong][:, ::1],
    weight: cython.const[cython.double][:, ::1],
    area: cython.const[cython.double][::1],
    of_vertex: cython.const[cython.double][:, ::1],
    full_rate: cython.const[cython.double][::1],
    component: cython.const[cython.longlong][::1],
    by_weight: cython.double[:, ::1],
    by_area: cython.double[::1],
    by_log_t: cython.double[::1],
    by_v: cython.double[::1],
):
    """The derivative of p . (b - L phi), see `heat_igl.heat.field_derivative`.

    `of_vertex` (n, 3) are v, p and phi, beside each other in memory. On each face b is s K v with s = 1 / |grad v|, or
    1 / full_rate where the gradient is below that (m,), 0 for never; faces with a negative full_rate have no part in b.
    Written to `by_weight` (m, 3) and `by_area` (m,); added to `by_v` (n,), and to `by_log_t` the derivative by the
    logarithm of the time step of each component, of which each vertex has the number (n,).
    """
    f: cython.Py_ssize_t
    c: cython.int
    corner: cython.longlong[3]
    d: cython.double[3]
    q: cython.double[3]
    field: FaceField
    with cython.nogil:
        for f in range(F.shape[0]):
            by_area[f] = 0.0
            for c in range(3):
                corner[c] = F[f, c]
            for c in range(3):
                i: cython.longlong = corner[(c + 1) % 3]
                j: cython.longlong = corner[(c + 2) % 3]
                d[c] = of_vertex[i, 0] - of_vertex[j, 0]
                q[c] = of_vertex[i, 1] - of_vertex[j, 1]
                by_weight[f, c] = q[c] * (of_vertex[i, 2] - of_vertex[j, 2])
            if not normalize(d, cython.address(weight[f, 0]), area[f], full_rate[f], cython.address(field)):
                continue
            by_s: cython.double = 0.0
            for c in range(3):
                by_s += weight[f, c] * q[c] * d[c]
            s: cython.double = field.s
            by_energy: cython.double = 0.0
            if field.is_damped:
                by_log_t[component[corner[0]]] += 0.5 * by_s * s
            else:
                by_energy = -0.5 * by_s * s / field.energy
                by_area[f] = 0.5 * by_s * s / area[f]
            for c in range(3):
                by_weight[f, c] += s * q[c] * d[c] + by_energy * d[c] * d[c]
                q[c] = (s * q[c] + 2.0 * by_energy * d[c]) * weight[f, c] * field.scale
            for c in range(3):
                by_v[corner[c]] += q[(c + 2) % 3] - q[(c + 1) % 3]


def elements(
    F: cython.const[cython.longlong][:, ::1],
    length: cython.const[cython.double][:, ::1],
    weight: cython.const[cython.double][:, ::1],
    area: cython.const[cython.double][::1],
    share: cython.double,
    of_vertex: cython.const[cython.double][:, ::1],
    slopes: cython.const[cython.double][:, :, ::1],
    component: cython.const[cython.longlong][::1],
    by_weight: cython.const[cython.double][:, ::1],
    by_area: cython.const[cython.double][::1],
    by_side: cython.double[:, ::1],
    by_t: cython.double[::1],
):
    """Add the derivative by the sides (m, 3), from those by the heat flow and by weights, areas and masses.

    The heat flow gives -x . dA u for adjoints x and solutions u, with A = M - t L, and the diagonal of dA times another
    number at each vertex. `of_vertex` (n, 2 + 2 k) holds that number, the derivative by the mass of the vertex (as part
    of A), and k pairs of x and u. The entry -t L of each side changes by `slopes` (3, m, 3): with the weight, length
    and time step. A face has `share` of its area, see `Elements`.
    """
    f: cython.Py_ssize_t
    c: cython.int
    k: cython.Py_ssize_t
    corner: cython.longlong[3]
    of_weight: cython.double[3]
    mass: cython.double[3]
    with cython.nogil:
        for f in range(F.shape[0]):
            change: cython.double = 0.0
            all_masses: cython.double = 0.0
            is_obtuse: cython.bint = False
            for c in range(3):
                corner[c] = F[f, c]
                mass[c] = of_vertex[corner[c], 1]
                all_masses += mass[c]
                is_obtuse = is_obtuse or weight[f, c] < 0.0
            for c in range(3):
                i: cython.longlong = corner[(c + 1) % 3]
                j: cython.longlong = corner[(c + 2) % 3]
                flow: cython.double = of_vertex[i, 0] + of_vertex[j, 0]
                for k in range(2, of_vertex.shape[1], 2):
                    flow -= (of_vertex[i, k] - of_vertex[j, k]) * (of_vertex[i, k + 1] - of_vertex[j, k + 1])
                of_weight[c] = by_weight[f, c] + flow * slopes[0, f, c]
                by_side[f, c] += flow * slopes[1, f, c]
                change += flow * slopes[2, f, c]
            by_t[component[corner[0]]] += change
            of_area: cython.double = by_area[f]
            for c in range(3):
                if is_obtuse:
                    # The cell of the obtuse corner is half the triangle, those of the others a quarter.
                    of_area += mass[c] * (0.5 if weight[f, c] < 0.0 else 0.25)
                else:
                    # The cell of a corner has a part for both sides there: for all but the opposite one.
                    part: cython.double = (all_masses - mass[c]) * length[f, c]
                    of_weight[c] += part * length[f, c] / 4
                    by_side[f, c] += part * weight[f, c] / 2
            # A weight is inner / (8 area), and the area changes by the length times the weight.
            per_area: cython.double = 1.0 / area[f]
            sum_of_inner: cython.double = 0.0
            for c in range(3):
                of_area -= of_weight[c] * weight[f, c] * per_area
                of_weight[c] *= share * share * per_area / 8
                sum_of_inner += of_weight[c]
            for c in range(3):
                by_side[f, c] += length[f, c] * (2 * (sum_of_inner - 2 * of_weight[c]) + of_area * weight[f, c])
