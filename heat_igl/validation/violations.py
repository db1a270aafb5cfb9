"""Violations of properties that every distance has, measured without the truth."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np

from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.reference import edge_paths, straight_lines
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, FloatArray
from heat_igl.validation.error_norms import finite_or_zero

__all__ = [
    "BoundViolations",
    "TriangleViolations",
    "asymmetry",
    "bound_violations",
    "eikonal_residual",
    "triangle_violations",
]

# Below this fraction a bound counts as held: sums of some thousand lengths round to about 1e-13.
_TOLERANCE = 1e-9


@dataclass(frozen=True)
class TriangleViolations:
    """Violations of the triangle inequality: d(a, v) > d(a, b) + d(b, v), for sources a, b and vertices v.

    Attributes
    ----------
    count : int
        Triples with an excess above rounding.
    fraction : float
        Share of all triples that were tried.
    largest : float
        Largest excess, divided by d(a, v).
    """

    count: int
    fraction: float
    largest: float


@dataclass(frozen=True)
class BoundViolations:
    """Vertices whose distance is outside the bounds that hold on every mesh.

    Attributes
    ----------
    n_below, n_above : int
        Number of vertices nearer than the straight line, and farther than the shortest path along edges, beyond
        rounding.
    largest_below, largest_above : float
        Largest violations, as fractions of the bound.
    """

    n_below: int
    n_above: int
    largest_below: float
    largest_above: float


def eikonal_residual(mesh: MeshLike, distance: ArrayLike) -> FloatArray:
    """Residual of the eikonal equation |grad d| = 1 on each face: | |grad d| - 1 |.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    distance : (n,) array_like
        In the mesh's unit.

    Returns
    -------
    (m,) float64
        NaN on faces that are degenerate or not reached. It does not vanish at the sources and across the cut locus for
        any discrete distance, so its mean tends to 0 with the edge length, and its maximum does not.
    """
    mesh = as_simplices(mesh)
    d = np.asarray(distance, dtype=np.float64)
    reached = np.isfinite(d)[mesh.F].all(axis=1) & (mesh.measures > 0)
    gradient = igl.grad(mesh.V, mesh.F[reached]) @ finite_or_zero(d)
    residual = np.full(mesh.n_faces, np.nan)
    residual[reached] = np.abs(np.linalg.norm(gradient.reshape(3, -1), axis=0) - 1)
    return residual


def asymmetry(distances: ArrayLike, sources: ArrayLike) -> FloatArray:
    """The matrix d(a, b) - d(b, a) over pairs of sources; 0 for an exact distance.

    Parameters
    ----------
    distances : (k, n) array_like
        Row i is the distance from the one vertex ``sources[i]``.
    sources : (k,) array_like of int
        Single vertices.

    Returns
    -------
    (k, k) float64
        Antisymmetric, in the mesh's unit; 0 between components.
    """
    between = np.asarray(distances, dtype=np.float64)[:, np.asarray(sources)]
    difference: FloatArray = np.where(np.isfinite(between) & np.isfinite(between.T), finite_or_zero(between), 0.0)
    return difference - difference.T


def triangle_violations(distances: ArrayLike, sources: ArrayLike) -> TriangleViolations:
    """Count violations of the triangle inequality, arguments as for `asymmetry`."""
    d, vertices = np.asarray(distances, dtype=np.float64), np.asarray(sources)
    count, n_tried, largest = 0, 0, 0.0
    for a in range(len(vertices)):
        for b in range(len(vertices)):
            known = np.isfinite(d[a]) & np.isfinite(d[b]) & (d[a] > 0)
            if a == b or not known.any() or not np.isfinite(d[a, vertices[b]]):
                continue
            excess = (d[a, known] - d[a, vertices[b]] - d[b, known]) / d[a, known]
            count += int((excess > _TOLERANCE).sum())
            n_tried += int(known.sum())
            largest = max(largest, float(excess.max()))
    return TriangleViolations(count, count / max(n_tried, 1), largest)


def bound_violations(
    mesh: MeshLike, distance: ArrayLike, sources: Sources, limits: tuple[FloatArray, FloatArray] | None = None
) -> BoundViolations:
    """Check a distance against the straight line from below and paths along edges from above.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    distance : (n,) array_like
        In the mesh's unit; vertices at which it is not finite are left out.
    sources : int, sequence of int, or (n,) mask of bool
        The sources of the distance.
    limits : pair of (n,) float64, optional
        `straight_lines` and `edge_paths` from these sources, if they are known already.

    Returns
    -------
    BoundViolations
    """
    mesh = as_simplices(mesh)
    d = np.asarray(distance, dtype=np.float64)
    lower, upper = limits or (straight_lines(mesh, sources), edge_paths(mesh, sources))
    inside = np.isfinite(d) & np.isfinite(upper) & (upper > 0)
    d, lower, upper = d[inside], lower[inside], upper[inside]
    # Two vertices in one place: the straight line is 0 and cannot be undercut.
    below = (lower - d) / np.where(lower > 0, lower, np.inf)
    above = (d - upper) / upper
    return BoundViolations(
        int((below > _TOLERANCE).sum()),
        int((above > _TOLERANCE).sum()),
        float(below.max(initial=0.0)),
        float(above.max(initial=0.0)),
    )
