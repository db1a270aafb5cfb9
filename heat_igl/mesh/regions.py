"""The boundary of a region of a triangle mesh as directed curves, with the region on their left."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import SourceError, as_array
from heat_igl.mesh.contours import Segments, joined_segments, level_segments
from heat_igl.mesh.mesh import Mesh
from heat_igl.mesh.objects import MeshLike, as_simplices
from heat_igl.mesh.surface_points import SurfaceCurve, require_triangles
from heat_igl.typing import ArrayLike, BoolArray


def region_boundary(
    mesh: MeshLike, *, faces: ArrayLike | None = None, vertices: ArrayLike | None = None
) -> list[SurfaceCurve]:
    """The curves around a region of a triangle mesh, with the region on their left.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    faces : (m,) array_like of bool, optional
        The faces of the region. The curves run along edges.
    vertices : (n,) array_like of bool, optional
        The vertices of the region. The curves run through the midpoints of the edges that leave it.

    Returns
    -------
    list of SurfaceCurve
        In the order of their first faces. The boundary of the mesh is no part of them: a curve that meets it is open.
        Curves along edges also end at a vertex at which the region touches itself.

    Raises
    ------
    SourceError
        If not exactly one of the two masks is given, a mask has the wrong length or type, or the region has no
        boundary inside the mesh; if the mesh is tetrahedral.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> centre = mesh.V[mesh.F].mean(axis=1)
    >>> region = (abs(centre[:, :2] - 0.5) < 0.25).all(axis=1)  # a square of side 1/2
    >>> (curve,) = heat_igl.mesh.region_boundary(mesh, faces=region)
    >>> curve.is_closed, float(curve.lengths(mesh).sum())
    (True, 2.0)
    """
    triangles = as_simplices(mesh)
    require_triangles(triangles)
    if (faces is None) == (vertices is None):
        raise SourceError("give one mask of the region: faces or vertices")
    if faces is not None:
        segments = _along_edges(triangles, _checked_mask("faces", faces, triangles.n_faces))
    else:
        mask = _checked_mask("vertices", vertices, triangles.n_vertices)
        segments = level_segments(triangles, np.where(mask, 0.0, 1.0), 0.5)
    if not len(segments.faces):
        raise SourceError("the region has no boundary inside the mesh: it is empty, or consists of whole components")
    return joined_segments(segments, triangles)


def _along_edges(mesh: Mesh, is_inside: BoolArray) -> Segments:
    """The sides of faces (m,) of a region at which other faces lie, in the direction around the faces."""
    edges = mesh.facets.of_face
    n_inside = np.bincount(edges[is_inside].ravel(), minlength=len(mesh.facets.vertices))
    leaves = (n_inside > 0) & (n_inside < mesh.facets.n_faces)
    face, corner = np.nonzero(leaves[edges] & is_inside[:, None])
    tail, head = (corner + 1) % 3, (corner + 2) % 3
    ends = np.stack([mesh.F[face, tail], mesh.F[face, head]], axis=1)
    return Segments(face, np.eye(3)[tail], np.eye(3)[head], ends)


def _checked_mask(name: str, mask: ArrayLike | None, size: int) -> BoolArray:
    given = as_array(name, mask, SourceError)
    if given.dtype.kind != "b" or given.shape != (size,):
        raise SourceError(f"{name} must be a mask of bool of shape ({size},), not {given.dtype} of shape {given.shape}")
    return given
