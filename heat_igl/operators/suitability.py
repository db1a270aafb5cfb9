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
    n_components = int(component.max(initial=-1)) + 1
    if laplacian == "intrinsic-delaunay-refined":
        return refined(triangulation, component, np.ones(n_components, bool))
    if laplacian == "auto":
        is_uneven = uneven_components(triangulation, component)
        if is_uneven[component[triangulation.F[:, 0]]].mean() > plan.UNEVEN_SHARE:
            return refined(triangulation, component, is_uneven)
    if laplacian == "auto" and has_negative_boundary(triangulation):
        return intrinsic_delaunay(closed_cover(triangulation))
    return triangulation


def has_negative_boundary(triangulation: IntrinsicTriangulation) -> bool:
    """Whether boundary edges have negative weights that spoil the heat."""
    outer = np.flatnonzero(triangulation.twin == -1)
    if not len(outer):
        return False
    angle = corner_angles(triangulation.l[outer // 3])[np.arange(len(outer)), outer % 3]
    weight = np.minimum(1 / np.tan(angle), 0.0)
    return bool(weight.min() < plan.STEEPEST_WEIGHT or -weight.sum() > plan.NEGATIVE_SHARE * triangulation.n_used)


def uneven_components(triangulation: IntrinsicTriangulation, component: IntArray) -> BoolArray:
    """Components (k,) of which thin triangles, or ones that are large for the component, cover much.

    All, where there are few triangles at all.
    """
    if triangulation.n_used < plan.FEW_FOR_HEAT:
        return np.ones(int(component.max(initial=-1)) + 1, bool)
    thin, large = _thin_and_large(triangulation, component)
    return np.asarray((thin > plan.THIN_SHARE) | (large > plan.LARGE_SHARE))


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

    Of an intrinsic Delaunay triangulation, no three faces at an edge, with the component (n,) of each vertex; of its
    tufted cover where the surface is not closed.
    """
    if (triangulation.twin < 0).any() or not triangulation.aligned.all():
        triangulation = intrinsic_delaunay(closed_cover(triangulation))
    sheets = 2 if triangulation.is_cover else 1
    # In an infinite unit no triangle is large.
    unit = np.where(
        is_chosen[component[triangulation.F[:, 0]]], _area_per_vertex(triangulation, component) ** 0.5, np.inf
    )
    scale = min(1.0, (triangulation.n_used / plan.ENOUGH_FOR_HEAT) ** 0.5)
    made = delaunay_refinement(
        triangulation,
        sheets * (plan.GROWTH * triangulation.n + plan.MORE),
        largest_radius=plan.LARGEST_RADIUS * scale if scale < 1 else np.inf,
        unit=unit,
    )
    # Beside vertices in the same place, triangles are cut into ones without area.
    return made if (made.areas > 0).all() else triangulation


def _area_per_vertex(triangulation: IntrinsicTriangulation, component: IntArray) -> FloatArray:
    """Area per vertex (m,) of the component of each face; of a cover, that of the surface below."""
    of_face = component[triangulation.F[:, 0]]
    area = np.bincount(of_face, triangulation.areas) / (2 if triangulation.is_cover else 1)
    return np.asarray((area / np.bincount(component)[: len(area)])[of_face])


def is_rough_or_narrow(domain: Operators) -> bool:
    """Whether a surface turns so much from vertex to vertex, or is so narrow, that fronts of heat cut corners."""
    surface = domain.surface
    if surface is None:
        return False
    triangulation = surface.unfolding
    added = (domain.n - triangulation.n) / (2 if surface.triangulation.is_cover else 1)
    n = triangulation.n_used + added
    n_outer = np.count_nonzero(domain.boundary & domain.referenced)
    if plan.NARROW * n < n_outer < plan.ONE_CELL_WIDE * n:
        return True
    return mean_angle_defect(triangulation) * triangulation.n_used > plan.ROUGH_FOR_HEAT * n


def mean_angle_defect(triangulation: IntrinsicTriangulation, at_boundary: bool = False) -> float:
    """Mean of |2 pi - sum of angles| over inner vertices, or over a thousand of them.

    `at_boundary`: over all vertices; on the boundary, that by which the sum exceeds pi, since ways bend there.
    """
    F, n = triangulation.F, triangulation.n
    chosen, is_outer = np.zeros(n, bool), np.zeros(n, bool)
    chosen[F] = True
    outer = np.flatnonzero(triangulation.twin < 0)
    is_outer[triangulation.tail(outer)] = is_outer[triangulation.head(outer)] = True
    vertices = np.flatnonzero(chosen if at_boundary else chosen & ~is_outer)
    if not at_boundary:
        vertices = vertices[:: len(vertices) // _MOST_SAMPLES + 1]
    if not len(vertices):
        return 0.0
    chosen[:] = False
    chosen[vertices] = True
    faces = np.flatnonzero(chosen[F[:, 0]] | chosen[F[:, 1]] | chosen[F[:, 2]])
    total = np.zeros(n)
    for some in np.array_split(faces, len(faces) // 2**16 + 1):  # angles take five times the memory of lengths
        np.add.at(total, F[some], corner_angles(triangulation.l[some]))
    total = total[vertices]
    defect = np.where(is_outer[vertices], np.maximum(total - np.pi, 0.0), np.abs(2 * np.pi - total))
    return float(defect.mean())
