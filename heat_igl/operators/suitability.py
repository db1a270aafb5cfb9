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
from heat_igl.operators.matrices import Laplacian, Operators
from heat_igl.typing import BoolArray, FloatArray, IntArray

__all__ = ["fit_for_heat", "has_negative_boundary", "is_rough_or_narrow", "refined", "uneven_components"]

# A boundary edge opposite an obtuse angle keeps a negative weight, the cotangent of the angle. A few small ones do no
# harm: on scans their sum is at most 0.0012 of the number of vertices and none is below -1; on the shapes of the zoo
# (those that are not held out) with worse answers than on the cover, one is below -1.5 or the sum above 0.03.
_STEEPEST_WEIGHT = -1.5
_NEGATIVE_SHARE = 0.006
# Thin triangles are those with an angle below 20 degrees; they do harm where they cover the surface. Shares of the area
# are at most 0.27 on scans and models, and at least 0.37 on shapes of the zoo on which heat is wrong because of them.
_THIN_SINE = float(np.sin(np.radians(20.0)))
_THIN_SHARE = 0.3
# Large triangles are those with a circumradius of more than 1.5 square roots of the area per vertex; equilateral ones
# have 0.62. Shares of the area are at most 0.43 on scans and models, and at least 0.67 on such shapes of the zoo.
_LARGE_RADIUS = 1.5
_LARGE_SHARE = 0.55
# Share of triangles in components with many of these kinds, from which on the components are refined: a scan with a few
# stray triangles stays as it is.
_UNEVEN_SHARE = 0.01
# With so few vertices a triangle is large beside the distances that are asked for, and a thousand cost nothing.
_FEW_VERTICES = 64
_ENOUGH_VERTICES = 1000
# What circumradii of coarse meshes are refined to, in square roots of the area per vertex.
_LARGEST_RADIUS = 1.4
# Mean angle by which the angles around a vertex differ from a full turn, from which on a surface is rough: scans and
# models have at most 0.5, voxels and noise at least 1.
_ROUGH = 0.7
_MOST_SAMPLES = 1000
# Share of vertices on the boundary from which on a surface is narrow: at most 0.28 on scans and models, 0.4 in a maze.
_NARROW = 0.33
# Two rows on the boundary and one inside make 2/3. Above that a surface is one cell wide, heat goes along one line, and
# the larger time step follows it better: 1 % too short instead of 5 on a stroke of pixels.
_ONE_CELL_WIDE = 0.7
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
    n_components = int(component.max(initial=-1)) + 1
    if laplacian == "intrinsic-delaunay-refined":
        return refined(triangulation, component, np.ones(n_components, bool))
    if laplacian == "auto":
        is_uneven = uneven_components(triangulation, component)
        if is_uneven[component[triangulation.F[:, 0]]].mean() > _UNEVEN_SHARE:
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
    return bool(weight.min() < _STEEPEST_WEIGHT or -weight.sum() > _NEGATIVE_SHARE * triangulation.n)


def uneven_components(triangulation: IntrinsicTriangulation, component: IntArray) -> BoolArray:
    """Components (k,) of which thin triangles, or ones that are large for the component, cover much.

    All, where there are few triangles at all.
    """
    n_components = int(component.max(initial=-1)) + 1
    if triangulation.n < _FEW_VERTICES:
        return np.ones(n_components, bool)
    area, lengths = triangulation.areas, triangulation.l
    a, b, c = lengths.T
    # Twice the circumradius; the shortest side is this times the sine of the smallest angle.
    with np.errstate(divide="ignore", invalid="ignore"):
        diameter = a * b * c / (2 * area)
        is_thin = ~(np.minimum(np.minimum(a, b), c) >= _THIN_SINE * diameter)
    is_large = diameter > 2 * _LARGE_RADIUS * _area_per_vertex(triangulation, component) ** 0.5
    of_face = component[triangulation.F[:, 0]]
    total, thin, large = (
        np.bincount(of_face, counted, n_components) for counted in (area, area * is_thin, area * is_large)
    )
    return np.asarray((thin > _THIN_SHARE * total) | (large > _LARGE_SHARE * total))


def refined(triangulation: IntrinsicTriangulation, component: IntArray, is_chosen: BoolArray) -> IntrinsicTriangulation:
    """Triangles fit for heat, by `delaunay_refinement`; of the tufted cover where the surface is not closed.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        Intrinsic Delaunay, no three faces at an edge.
    component : (n,) int64
        Component of each vertex.
    is_chosen : (k,) bool
        Components that are refined.
    """
    if (triangulation.twin < 0).any() or not triangulation.aligned.all():
        triangulation = intrinsic_delaunay(closed_cover(triangulation))
    sheets = 2 if triangulation.is_cover else 1
    # In an infinite unit no triangle is large.
    unit = np.where(
        is_chosen[component[triangulation.F[:, 0]]], _area_per_vertex(triangulation, component) ** 0.5, np.inf
    )
    scale = min(1.0, (triangulation.n / _ENOUGH_VERTICES) ** 0.5)
    made = delaunay_refinement(
        triangulation,
        sheets * (_GROWTH * triangulation.n + _MORE),
        largest_radius=_LARGEST_RADIUS * scale if scale < 1 else np.inf,
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
    n = triangulation.n + added
    n_outer = np.count_nonzero(domain.boundary & domain.referenced)
    if _NARROW * n < n_outer < _ONE_CELL_WIDE * n:
        return True
    return _mean_angle_defect(triangulation) * triangulation.n > _ROUGH * n


def _mean_angle_defect(triangulation: IntrinsicTriangulation) -> float:
    """Mean of |2 pi - sum of angles| over inner vertices, or over a thousand of them."""
    F, n = triangulation.F, triangulation.n
    chosen = np.zeros(n, bool)
    chosen[F] = True
    outer = np.flatnonzero(triangulation.twin < 0)
    chosen[triangulation.tail(outer)] = chosen[triangulation.head(outer)] = False
    vertices = np.flatnonzero(chosen)
    vertices = vertices[:: len(vertices) // _MOST_SAMPLES + 1]
    if not len(vertices):
        return 0.0
    chosen[:] = False
    chosen[vertices] = True
    faces = np.flatnonzero(chosen[F[:, 0]] | chosen[F[:, 1]] | chosen[F[:, 2]])
    total = np.bincount(F[faces].ravel(), corner_angles(triangulation.l[faces]).ravel(), n)
    return float(np.abs(2 * np.pi - total[vertices]).mean())
