"""The triangulation dual to geodesic Voronoi cells."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import MeshError, shown
from heat_igl.mesh import Mesh, MeshLike, as_simplices, connectivity
from heat_igl.sampling.voronoi import VoronoiCells
from heat_igl.typing import IntArray


def dual_triangulation(mesh: MeshLike, cells: VoronoiCells) -> Mesh:
    """The triangulation dual to Voronoi cells: a vertex for each cell, a triangle for each point of three cells.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    cells : VoronoiCells
        Voronoi cells of the same mesh.

    Returns
    -------
    Mesh
        A manifold mesh oriented like `mesh`, with the positions of ``cells.sites`` in that order. The Euler
        characteristic is that of `mesh` if every cell is a disk, any two cells meet along at most one line, and any
        three in at most one point; holes and handles inside one cell are lost.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral or `cells` belong to another mesh. If the triangles do not form a manifold with a
        vertex for each cell: there are too few sites.

    Notes
    -----
    Replacing each vertex by the site of the cell maps every face of the mesh to a triangle, an edge or a vertex. The
    result has the triangles that an odd number of faces are mapped to. So a zigzag border between cells, or an island
    in a cell, changes nothing, and the boundary of the mesh is mapped to the boundary of the result.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.torus(48, 32)
    >>> coarse = heat_igl.sampling.dual_triangulation(mesh, heat_igl.farthest_cells(mesh, 60))
    >>> coarse.n_vertices, coarse.report().euler_characteristic
    (60, 0)
    """
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral:
        raise MeshError("a dual triangulation needs triangles, but F has 4 columns")
    if not isinstance(cells, VoronoiCells):
        raise MeshError(f"cells must be VoronoiCells, as farthest_cells returns them, not {shown(cells)}")
    if len(cells.labels) != mesh.n_vertices:
        raise MeshError(f"the cells have {len(cells.labels)} vertices and the mesh {mesh.n_vertices}: pass its own")
    k = len(cells.sites)
    met = cells.labels[mesh.F]
    a, b, c = met.T
    met = met[(a != b) & (b != c) & (c != a) & (met >= 0).all(axis=1)]
    # Rotating the smallest label to the front keeps the orientation; the other two labels then have two orders.
    met = np.take_along_axis(met, (met.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    turned = met[:, 1] > met[:, 2]
    first, of_face, covered = connectivity.unique_rows(np.sort(met, axis=1), k)
    balance = np.bincount(of_face, weights=np.where(turned, -1, 1), minlength=len(first))
    F = np.sort(met, axis=1)[first]
    F[balance < 0] = F[balance < 0][:, [0, 2, 1]]
    F = F[covered % 2 == 1]
    _check_dual(F, k)
    return Mesh(mesh.V[cells.sites], F)


def _check_dual(F: IntArray, k: int) -> None:
    remedy = f"the cells of {k} sites do not meet like the triangles of a surface; sample more densely"
    if not len(F):
        raise MeshError(f"no three cells meet in a point: {remedy}")
    lonely = np.setdiff1d(np.arange(k), F)
    if len(lonely):
        raise MeshError(f"cell {lonely[0]} has no triangle ({len(lonely)} of {k} cells have none): {remedy}")
    found = connectivity.facets(F, k)
    crowded = found.vertices[found.n_faces > 2]
    if len(crowded):
        raise MeshError(
            f"the edge between cells {crowded[0][0]} and {crowded[0][1]} has more than two triangles "
            f"({len(crowded)} edges have): {remedy}"
        )
    pinched = connectivity.nonmanifold_vertices(F, found, k)
    if len(pinched):
        raise MeshError(f"the triangles at cell {pinched[0]} are not one fan ({len(pinched)} cells' are not): {remedy}")
