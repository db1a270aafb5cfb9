"""Intrinsic Delaunay refinement: more vertices, so that no triangle is thin or large."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.half_edges import HalfEdges
from heat_igl.intrinsic.history import Refined
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.kernels.mesh import carrying, refinement
from heat_igl.mesh import DELAUNAY_TOLERANCE
from heat_igl.typing import FloatArray

# Degrees. The algorithm ends for certain below 30 degrees if no cone is sharp; close to that it makes many triangles.
_LEAST_ANGLE = 25.0


def delaunay_refinement(
    triangulation: IntrinsicTriangulation,
    most_vertices: int,
    *,
    largest_radius: float = np.inf,
    unit: FloatArray | None = None,
) -> IntrinsicTriangulation:
    """Add circumcenters as vertices until no angle is below 25 degrees (Sharp, Soliman, Crane 2019, section 4.2).

    Angles at a vertex of the mesh around which they sum to less than 60 degrees are left as they are.
    The triangle with the largest circumcircle among the bad ones is first. Edges are flipped after each new vertex, so
    that the triangulation stays intrinsic Delaunay. The surface stays the same, and so do the given vertices, which
    come before the new ones.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        Intrinsic Delaunay, closed and oriented: every half-edge has an aligned twin.
    most_vertices : int
        No vertex is added when there are so many.
    largest_radius : float
        Largest circumradius, in the `unit` of the face.
    unit : (m,) float64, optional
        A length for each face, which the faces that are made of it inherit; 1 if not given.

    Returns
    -------
    IntrinsicTriangulation
        `triangulation` itself if no vertex is added.

    Raises
    ------
    ValueError
        If the surface has a boundary or is not oriented.
    """
    if (triangulation.twin < 0).any() or not triangulation.aligned.all():
        raise ValueError("refinement needs a closed and oriented surface: take the tufted cover")
    vertex, twin, length, n, kind, numbers = refinement.refine(
        HalfEdges.of(triangulation),
        triangulation.n,
        np.ones(len(triangulation.F)) if unit is None else unit,
        np.radians(_LEAST_ANGLE),
        largest_radius,
        most_vertices,
        -DELAUNAY_TOLERANCE,
    )
    if n == triangulation.n:
        return triangulation
    edges = HalfEdges(vertex, twin, np.arange(len(twin), dtype=np.int32), np.ones(len(twin), np.uint8), length)
    first, following = carrying.index_moves(kind, len(twin) // 3)
    return edges.replacing(
        triangulation,
        n=n,
        n_flips=triangulation.n_flips + int(kind[:, 0].sum()),
        history=(*triangulation.history, Refined(kind, numbers, first, following)),
    )
