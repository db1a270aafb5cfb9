"""Whether heat can be solved well on a triangulation, and the one that is taken where it cannot."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import (
    IntrinsicTriangulation,
    closed_cover,
    corner_angles,
    delaunay_refinement,
    intrinsic_delaunay,
)
from heat_igl.operators.matrices import Laplacian
from heat_igl.typing import FloatArray, IntArray

__all__ = ["fit_for_heat", "has_negative_boundary", "is_uneven", "refined"]

# A boundary edge opposite an obtuse angle keeps a negative weight, the cotangent of the angle. A few small ones do no
# harm: on scans their sum is at most 0.0012 of the number of vertices and none is below -1; on the shapes of the zoo
# (those that are not held out) with worse answers than on the cover, one is below -1.5 or the sum above 0.03.
_STEEPEST_WEIGHT = -1.5
_NEGATIVE_SHARE = 0.006
# Thin triangles are those with an angle below 20 degrees; they do harm where they cover the surface. Shares of the area
# are at most 0.27 on scans and models, and at least 0.37 on shapes of the zoo on which heat is wrong because of them.
_THIN_ANGLE = np.radians(20.0)
_THIN_SHARE = 0.3
# With so few vertices a triangle is large beside the distances that are asked for, and a thousand cost nothing.
_FEW_VERTICES = 400
_ENOUGH_VERTICES = 1000
# Circumradius in square roots of the area per vertex: equilateral triangles have 0.62.
_LARGEST_RADIUS = 1.4
# Growth by refinement: at most so many times the vertices, and some thousands more.
_GROWTH, _MORE = 4, 4000


def fit_for_heat(
    triangulation: IntrinsicTriangulation, laplacian: Laplacian, component: IntArray
) -> IntrinsicTriangulation:
    """The triangles that heat is solved on, by the option `laplacian` of `operators`.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        Intrinsic Delaunay, no three faces at an edge.
    laplacian : {"auto", "intrinsic-delaunay", "intrinsic-delaunay-refined"}
        See `operators`.
    component : (n,) int64
        Component of each vertex.

    Returns
    -------
    IntrinsicTriangulation
        `triangulation` itself, its tufted cover, or a refinement of one of them.
    """
    if laplacian == "intrinsic-delaunay-refined" or (laplacian == "auto" and is_uneven(triangulation)):
        return refined(triangulation, component)
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
    return bool(weight.min() < _STEEPEST_WEIGHT or -weight.sum() > _NEGATIVE_SHARE * triangulation.n)


def is_uneven(triangulation: IntrinsicTriangulation) -> bool:
    """Whether thin triangles cover much of the surface, or there are few triangles at all."""
    if triangulation.n < _FEW_VERTICES:
        return True
    area = triangulation.areas
    thin = corner_angles(triangulation.l).min(axis=1) < _THIN_ANGLE
    return bool(area[thin].sum() > _THIN_SHARE * area.sum())


def refined(triangulation: IntrinsicTriangulation, component: IntArray) -> IntrinsicTriangulation:
    """Triangles fit for heat, by `delaunay_refinement`; of the tufted cover where the surface is not closed.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        Intrinsic Delaunay, no three faces at an edge.
    component : (n,) int64
        Component of each vertex.
    """
    if (triangulation.twin < 0).any() or not triangulation.aligned.all():
        triangulation = intrinsic_delaunay(closed_cover(triangulation))
    sheets = 2 if triangulation.is_cover else 1
    unit, is_coarse = _units(triangulation, component, sheets)
    return delaunay_refinement(
        triangulation,
        sheets * (_GROWTH * triangulation.n + _MORE),
        largest_radius=_LARGEST_RADIUS if is_coarse else np.inf,
        unit=unit,
    )


def _units(triangulation: IntrinsicTriangulation, component: IntArray, sheets: int) -> tuple[FloatArray, bool]:
    """A length (m,) for the faces of each component, by the area per vertex, and whether there are few vertices."""
    of_face = component[triangulation.F[:, 0]]
    area = np.bincount(of_face, triangulation.areas) / sheets
    count = np.bincount(component)[: len(area)].astype(float)
    is_coarse = bool(triangulation.n < _ENOUGH_VERTICES)
    if is_coarse:
        count = np.maximum(count, _ENOUGH_VERTICES * count / triangulation.n)
    with np.errstate(invalid="ignore"):
        return np.sqrt(area / count)[of_face], is_coarse
