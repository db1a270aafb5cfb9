"""Intrinsic Delaunay triangulation by edge flips."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic.gluing import oriented
from heat_igl.intrinsic.half_edges import HalfEdges
from heat_igl.intrinsic.history import Flipped
from heat_igl.intrinsic.triangulation import IntrinsicTriangulation
from heat_igl.kernels.mesh.flipping import rounds


def intrinsic_delaunay(triangulation: IntrinsicTriangulation, *, orients: bool = True) -> IntrinsicTriangulation:
    """Flip edges until the triangulation is intrinsic Delaunay (Fisher, Springborn, Bobenko, Schroeder 2007).

    An edge is flipped when the two cotangents opposite it sum to less than zero. Edges stay on the boundary, at edges
    of more than two faces, and along the seam of a surface that cannot be oriented.

    Parameters
    ----------
    triangulation : IntrinsicTriangulation
        As `intrinsic_triangulation` makes it; left untouched.
    orients : bool
        Whether to reverse faces first, so that the seam is short; not if neighbours are oriented alike as far as
        possible.

    Returns
    -------
    IntrinsicTriangulation
        The same surface on the same vertices; `triangulation` itself if no edge is flipped.
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
    of_flip = rounds(kind, len(given.F))
    in_order = np.argsort(of_flip, kind="stable")
    parts = np.split(in_order, np.flatnonzero(np.diff(of_flip[in_order])) + 1)
    flipped = (Flipped(kind[part, 1], kind[part, 2], lengths[part].T) for part in parts)
    return edges.replacing(given, n_flips=given.n_flips + len(kind), history=(*given.history, *flipped))
