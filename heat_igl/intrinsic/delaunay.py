"""Intrinsic Delaunay triangulation by edge flips, and its refinement by more vertices."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.gluing import oriented
from heat_igl.intrinsic.half_edges import HalfEdges
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation, Moved
from heat_igl.kernels.mesh import refinement
from heat_igl.mesh import DELAUNAY_TOLERANCE
from heat_igl.typing import FloatArray


def intrinsic_delaunay(triangulation: IntrinsicTriangulation, *, orients: bool = True) -> IntrinsicTriangulation:
    """Flip edges until the triangulation is intrinsic Delaunay (Fisher, Springborn, Bobenko, Schroeder 2007).

    An edge is flipped when the two cotangents opposite it sum to less than zero. Edges stay on the boundary, at edges
    of more than two faces, and along the seam of a surface that cannot be oriented. `orients` reverses faces first, so
    that the seam is short; it is not needed if neighbours are oriented alike as far as possible.

    Returns the same surface on the same vertices; `triangulation` itself if no edge is flipped.
    """
    given = oriented(triangulation) if orients and not triangulation.aligned.all() else triangulation
    edges = HalfEdges.of(given)
    edges = edges._replace(length=edges.length.copy())
    # An edge of a seam keeps its place as those of more than two faces do, with its other half-edge next in the ring.
    seam = np.flatnonzero(~given.aligned)
    edges.ring[seam] = edges.twin[seam]
    edges.twin[seam], edges.aligned[seam] = -2, True
    kind, lengths = edges.make_delaunay(records=True)
    if not len(kind):
        return triangulation
    if len(seam):
        seam = np.flatnonzero((edges.twin == -2) & (edges.ring[edges.ring] == np.arange(len(edges.ring))))
        edges.twin[seam], edges.aligned[seam] = edges.ring[seam], False
    flips = Moved.of(kind, lengths, len(given.F))
    return edges.replacing(given, n_flips=given.n_flips + len(kind), history=(*given.history, flips))


# Degrees. The algorithm ends for certain below 30 degrees if no cone is sharp; close to that it makes many triangles.
_LEAST_ANGLE = 25.0


def delaunay_refinement(
    triangulation: IntrinsicTriangulation,
    most_vertices: int,
    *,
    largest_radius: float | FloatArray = np.inf,
    unit: FloatArray | None = None,
) -> IntrinsicTriangulation:
    """Add circumcenters as vertices until no angle is below 25 degrees (Sharp, Soliman, Crane 2019, section 4.2).

    Angles at a vertex of the mesh around which they sum to less than 60 degrees are left as they are. The triangle with
    the largest circumcircle among the bad ones is first. Edges are flipped after each new vertex, so that the
    triangulation stays intrinsic Delaunay. The surface stays the same, and so do the given vertices, which come before
    the new ones. No vertex is added when there are `most_vertices`; `triangulation` itself is returned if none is.

    No circumradius is larger than `largest_radius`, one or (m,), times the `unit` (m,) of the face, 1 if not given;
    faces that are made of it inherit both. Components in an infinite unit are not refined. `triangulation` must be
    intrinsic Delaunay and oriented, and closed where it is refined: a ValueError if it is not.
    """
    unit = np.ones(len(triangulation.F)) if unit is None else unit
    if (triangulation.twin[np.repeat(np.isfinite(unit), 3)] < 0).any() or not triangulation.aligned.all():
        raise ValueError("refinement needs a closed and oriented surface: take the tufted cover")
    vertex, twin, length, n, kind, numbers = refinement.refine(
        HalfEdges.of(triangulation),
        triangulation.n,
        unit,
        np.radians(_LEAST_ANGLE),
        largest_radius,
        most_vertices,
        -DELAUNAY_TOLERANCE,
    )
    if n == triangulation.n:
        return triangulation
    edges = HalfEdges(vertex, twin, np.arange(len(twin), dtype=np.int32), np.ones(len(twin), np.uint8), length)
    return edges.replacing(
        triangulation,
        n=n,
        n_flips=triangulation.n_flips + int(kind[:, 0].sum()),
        history=(*triangulation.history, Moved.of(kind, numbers, len(twin) // 3)),
    )
