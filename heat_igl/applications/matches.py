"""The error of a correspondence between two surfaces."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.mesh import MeshLike, as_triangles
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import FloatArray
from heat_igl.windows import pair_distances


def geodesic_errors(mesh: MeshLike, matches: Sources, truth: Sources) -> FloatArray:
    """Errors of matches by the Princeton protocol: exact distance from the right vertex, over the root of the area.

    Parameters
    ----------
    mesh : mesh
        The surface that matches lead to: triangles on n vertices, whatever `as_mesh` takes.
    matches : (p,) array_like of int
        The vertex that each of p points was matched with.
    truth : (p,) array_like of int
        The vertex that it should have been matched with.

    Returns
    -------
    (p,) float64
        Without a unit; ``inf`` on another component.

    Raises
    ------
    MeshError
        If the mesh cannot be used, or holds tetrahedra.
    SourceError
        If an entry is no vertex.
    ValueError
        If there are not as many matches as right vertices.

    Notes
    -----
    The protocol is that of Kim, Lipman and Funkhouser (2011). The curve that papers draw is the share of errors up to
    each threshold: ``np.searchsorted(np.sort(errors), thresholds, side="right") / len(errors)``. Distances are found
    for the pairs alone (`pair_distances`); no matrix of all distances is needed.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(4)  # of area 1
    >>> heat_igl.geodesic_errors(mesh, [0, 1, 6], [0, 0, 0]).round(6).tolist()
    [0.0, 0.25, 0.353553]
    """
    triangles = as_triangles(mesh, "errors of matches need")
    n = triangles.n_vertices
    found, right = named_vertices(matches, n, "matches"), named_vertices(truth, n, "truth")
    if len(found) != len(right):
        raise ValueError(f"there are {len(found)} matches and {len(right)} entries of truth: give one for each")
    area = float(triangles.measures.sum())
    if not area > 0:
        raise MeshError("errors of matches are shares of the root of the area, and no face of the mesh has one")
    # From the right vertices: many points are mostly matched with few, and one search serves all of them.
    return np.asarray(pair_distances(triangles, np.stack([right, found], axis=1)) / np.sqrt(area))
