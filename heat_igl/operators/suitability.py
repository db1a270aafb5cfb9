"""Whether heat can be solved well on a triangulation, and the one that is taken where it cannot."""

from __future__ import annotations

import numpy as np

from heat_igl import plan
from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    closed_cover,
    corner_angles,
    delaunay_refinement,
    intrinsic_delaunay,
)
from heat_igl.mesh import connectivity
from heat_igl.operators.matrices import Laplacian, Operators
from heat_igl.typing import BoolArray, FloatArray, IntArray

# Vertices whose angle defects are averaged: the standard error of the mean is then 3 % of their standard deviation.
_MOST_SAMPLES = 1000


def fit_for_heat(
    triangulation: IntrinsicTriangulation, laplacian: Laplacian, component: IntArray
) -> IntrinsicTriangulation:
    """The triangles that heat is solved on, by the option `laplacian` of `operators` other than "cotan".

    Of an intrinsic Delaunay triangulation, no three faces at an edge, with the component (n,) of each vertex: itself,
    its tufted cover, or a refinement of one of them.
    """
    n_components, of_face = int(component.max(initial=-1)) + 1, component[triangulation.F[:, 0]]
    is_uneven = np.ones(n_components, bool)
    if laplacian == "auto":
        # Thin triangles, or ones that are large for the component, cover it, or it has few vertices.
        thin, large = _thin_and_large(triangulation, component)
        few = _counted(triangulation, component, n_components) < plan.FEW_FOR_HEAT
        is_uneven = (thin > plan.THIN_SHARE) | (large > plan.LARGE_SHARE) | few
        is_uneven &= is_uneven[of_face].mean() > plan.UNEVEN_SHARE
    elif laplacian != "intrinsic-delaunay-refined":
        return triangulation
    # Two sheets without a common boundary are as one.
    is_closed = is_uneven | has_negative_boundary(triangulation, component, n_components)
    outer = triangulation.twin < 0
    if outer[np.repeat(is_closed[of_face], 3)].any() or (is_uneven.any() and not triangulation.aligned.all()):
        triangulation = intrinsic_delaunay(closed_cover(triangulation, is_closed[of_face]))
    return refined(triangulation, component, is_uneven) if is_uneven.any() else triangulation


def has_negative_boundary(triangulation: IntrinsicTriangulation, component: IntArray, k: int) -> BoolArray:
    """Whether boundary edges of each component (k,) have negative weights that spoil the heat."""
    outer = np.flatnonzero(triangulation.twin == -1)
    angle = corner_angles(triangulation.l[outer // 3])[np.arange(len(outer)), outer % 3]
    with np.errstate(divide="ignore"):  # of no angle
        weight, where = np.minimum(1 / np.tan(angle), 0.0), component[triangulation.tail(outer)]
    steepest = np.zeros(k)
    np.minimum.at(steepest, where, weight)
    few = plan.NEGATIVE_SHARE * _used(triangulation, component, k)
    return np.asarray((steepest < plan.STEEPEST_WEIGHT) | (-np.bincount(where, weight, k) > few))


def _used(triangulation: IntrinsicTriangulation, component: IntArray, k: int) -> IntArray:
    """Number of vertices of faces (k,) in each component."""
    used = connectivity.mask_of(triangulation.F, triangulation.n)
    return np.bincount(component[: triangulation.n][used], minlength=k)


def _counted(triangulation: IntrinsicTriangulation, component: IntArray, k: int) -> IntArray:
    """`_used`, by which coarse components are refined; that of all where too many are coarse to refine each."""
    used = _used(triangulation, component, k)
    n_coarse = np.count_nonzero((used > 0) & (used < plan.ENOUGH_FOR_HEAT))
    too_many = n_coarse * plan.ENOUGH_FOR_HEAT > plan.GROWTH * triangulation.n + plan.MORE
    return np.where(too_many | (used == 0), used.sum(), used)


def share_on_large_triangles(triangulation: IntrinsicTriangulation, component: IntArray) -> float:
    """Share of the faces that are in components which triangles cover that are large for the component."""
    _, large = _thin_and_large(triangulation, component)
    return float(np.mean(large[component[triangulation.F[:, 0]]] > plan.LARGE_SHARE))


def _thin_and_large(triangulation: IntrinsicTriangulation, component: IntArray) -> tuple[FloatArray, FloatArray]:
    """Share of the area (k,) of each component in thin triangles, and in large ones."""
    n_components = int(component.max(initial=-1)) + 1
    area, lengths = triangulation.areas, triangulation.l
    a, b, c = lengths.T
    # Twice the circumradius; the shortest side is this times the sine of the smallest angle.
    with np.errstate(divide="ignore", invalid="ignore"):
        diameter = a * b * c / (2 * area)
        is_thin = ~(np.minimum(np.minimum(a, b), c) >= plan.THIN_SINE * diameter)
    is_large = diameter > 2 * plan.LARGE_RADIUS * _area_per_vertex(triangulation, component) ** 0.5
    of_face = component[triangulation.F[:, 0]]
    total, thin, large = (
        np.bincount(of_face, counted, n_components) for counted in (area, area * is_thin, area * is_large)
    )
    total[total == 0] = 1
    return thin / total, large / total


def refined(triangulation: IntrinsicTriangulation, component: IntArray, is_chosen: BoolArray) -> IntrinsicTriangulation:
    """Triangles fit for heat in the chosen components (k,), by `delaunay_refinement`.

    Of an intrinsic Delaunay triangulation, oriented and in these components closed, with the component (n,) of each
    vertex.
    """
    of_face = component[triangulation.F[:, 0]]
    scale = (_counted(triangulation, component, len(is_chosen)) / plan.ENOUGH_FOR_HEAT) ** 0.5
    made = delaunay_refinement(
        triangulation,
        (2 if triangulation.is_cover else 1) * (plan.GROWTH * triangulation.n + plan.MORE),
        largest_radius=np.where(scale < 1, plan.LARGEST_RADIUS * scale, np.inf)[of_face],
        # In an infinite unit no triangle is large.
        unit=np.where(is_chosen[of_face], _area_per_vertex(triangulation, component) ** 0.5, np.inf),
    )
    # Beside vertices in the same place, triangles are cut into ones without area.
    return made if (made.areas > 0).all() else triangulation


def _area_per_vertex(triangulation: IntrinsicTriangulation, component: IntArray) -> FloatArray:
    """Area per vertex (m,) of the component of each face; of a cover, that of the surface below."""
    of_face = component[triangulation.F[:, 0]]
    area = np.bincount(of_face, triangulation.areas) / (2 if triangulation.is_cover else 1)
    return np.asarray((area / np.bincount(component)[: len(area)])[of_face])


def is_rough_or_narrow(domain: Operators) -> BoolArray:
    """Components (k,) that turn so much from vertex to vertex, or are so narrow, that fronts of heat cut corners."""
    surface, k = domain.surface, domain.n_components
    if surface is None:
        return np.zeros(k, bool)
    triangulation = surface.unfolding
    component = domain.components[: triangulation.n]
    n_used = _used(triangulation, component, k)
    added = np.bincount(domain.components[triangulation.n :], minlength=k)
    n = n_used + added / (2 if surface.triangulation.is_cover else 1)
    n_outer = np.bincount(domain.components[domain.boundary & domain.referenced], minlength=k)
    inner = np.flatnonzero(connectivity.mask_of(triangulation.F, triangulation.n) & ~_is_outer(triangulation))
    inner = inner[np.argsort(component[inner], kind="stable")]
    n_inner = np.bincount(component[inner], minlength=k)
    of, rank = connectivity.enumerate_runs(n_inner)
    inner = inner[rank % (n_inner[of] // _MOST_SAMPLES + 1) == 0]
    total = np.bincount(component[inner], np.abs(2 * np.pi - _angle_sums(triangulation, inner)), k)
    defect = total / np.maximum(np.bincount(component[inner], minlength=k), 1)
    is_narrow = (plan.NARROW * n < n_outer) & (n_outer < plan.ONE_CELL_WIDE * n)
    return np.asarray(is_narrow | (defect * n_used > plan.ROUGH_FOR_HEAT * n))


def mean_angle_defects(triangulation: IntrinsicTriangulation, component: IntArray) -> FloatArray:
    """Mean of |2 pi - sum of angles| in components (k,); on the boundary the excess over pi, since ways bend there.

    Of the vertices that faces use, by their components (n,).
    """
    vertices, k = np.unique(triangulation.F), component.max() + 1
    total, at_boundary = _angle_sums(triangulation, vertices), _is_outer(triangulation)[vertices]
    defect = np.where(at_boundary, np.maximum(total - np.pi, 0.0), np.abs(2 * np.pi - total))
    of = component[vertices]
    return np.bincount(of, defect, k) / np.maximum(np.bincount(of, minlength=k), 1)


def _is_outer(triangulation: IntrinsicTriangulation) -> BoolArray:
    """Mask (n,) of the vertices on the boundary."""
    outer = np.flatnonzero(triangulation.twin < 0)
    return connectivity.mask_of(np.append(triangulation.tail(outer), triangulation.head(outer)), triangulation.n)


def _angle_sums(triangulation: IntrinsicTriangulation, vertices: IntArray) -> FloatArray:
    """The sum of the angles around each of some vertices (k,)."""
    F, chosen = triangulation.F, np.zeros(triangulation.n, bool)
    chosen[vertices] = True
    faces = np.flatnonzero(chosen[F[:, 0]] | chosen[F[:, 1]] | chosen[F[:, 2]])
    total = np.zeros(triangulation.n)
    for some in np.array_split(faces, len(faces) // 2**16 + 1):  # angles take five times the memory of lengths
        np.add.at(total, F[some], corner_angles(triangulation.l[some]))
    return total[vertices]
