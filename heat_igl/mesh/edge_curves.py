"""Curves on a mesh along edges."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import SourceError, as_array, truth
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.mesh.surface_points import SurfaceCurve, require_triangles
from heat_igl.typing import ArrayLike


def edge_curve(mesh: MeshLike, vertices: ArrayLike, *, closed: bool = False) -> SurfaceCurve:
    """The curve along edges of a triangle mesh from vertex to vertex.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    vertices : (k,) array_like of int
        Each joined with the next by an edge.
    closed : bool
        Whether an edge leads from the last back to the first.

    Returns
    -------
    SurfaceCurve
        With a segment for each edge.

    Raises
    ------
    SourceError
        If no edge joins a vertex with the next; the message names the first such pair.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(5, 1)
    >>> row = heat_igl.edge_curve(mesh, [0, 1, 2, 3, 4, 5])
    >>> float(row.lengths(mesh).sum())
    5.0
    >>> heat_igl.geodesic_distance(mesh, row)[6:].round(6).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    mesh, closed = as_simplices(mesh), truth("closed", closed)
    require_triangles(mesh)
    path = np.atleast_1d(as_array("vertices", vertices, SourceError))
    if path.ndim != 1 or path.dtype.kind not in "iu" or len(path) < 2:
        raise SourceError(f"vertices must be two vertex indices or more, not {path.dtype} of shape {path.shape}")
    path = np.append(path, path[0]) if closed else path
    edges, n = mesh.facets.vertices, mesh.n_vertices
    pairs = np.sort(np.stack([path[:-1], path[1:]], axis=1).astype(np.int64), axis=1)
    # Rows of `edges` are in lexicographic order.
    at = np.searchsorted(edges[:, 0] * n + edges[:, 1], pairs[:, 0] * n + pairs[:, 1])
    at = np.minimum(at, len(edges) - 1)
    missing = (edges[at] != pairs).any(axis=1)
    if missing.any():
        first = int(np.flatnonzero(missing)[0])
        raise SourceError(
            f"vertices[{first}] = {path[first]} and the next, {path[first + 1]}, are not joined by an edge: "
            "name neighbours, or project the polyline with curve_on"
        )
    face_of = np.empty(len(edges), np.int64)
    face_of[mesh.facets.of_face.ravel()] = np.repeat(np.arange(mesh.n_faces), 3)
    faces = face_of[at]
    start, end = ((mesh.F[faces] == ends[:, None]).astype(float) for ends in (path[:-1], path[1:]))
    return SurfaceCurve(faces, start, end, is_closed=closed, mesh=mesh)
