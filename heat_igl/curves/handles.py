"""Loops around the handles of a surface, by a tree of shortest ways and a tree of faces."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.curves.geodesics import GeodesicPathSolver
from heat_igl.errors import MeshError
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, as_simplices, edge_curve
from heat_igl.mesh.connectivity import group_by_label, nonmanifold_vertices
from heat_igl.typing import BoolArray, FloatArray, IntArray


def handle_loops(mesh: MeshLike) -> list[SurfaceCurve]:
    """Closed geodesics that generate all loops of a surface up to its boundary.

    Parameters
    ----------
    mesh : mesh
        Triangles, manifold, with or without a boundary.

    Returns
    -------
    list of SurfaceCurve
        Two loops for each handle of an oriented surface, the shortest first, on all components; none on a sphere
        or a disk. Every closed curve is homologous to a sum of these loops, of their reverses, and of boundary curves.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral, or has an edge of more than two faces or a vertex whose faces are not one fan.

    Notes
    -----
    The greedy system of loops of Erickson and Whittlesey (2005): of all generating sets of loops along edges through
    one vertex of a component, that of the least total length. Each edge outside the tree of shortest ways from this
    vertex closes one loop; a spanning tree of the faces crosses the edges with the longest loops, and those that are
    left generate all. Each of their loops is then straightened, which frees it from the vertex.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.torus(48, 96, tube=0.4)
    >>> loops = heat_igl.curves.handle_loops(mesh)
    >>> len(loops), round(float(loops[0].lengths(mesh).sum() / (2 * np.pi)), 2)  # around the tube
    (2, 0.4)
    """
    triangles = as_simplices(mesh)
    if triangles.is_tetrahedral:
        raise MeshError("loops need triangles, but the mesh is tetrahedral")
    bad = nonmanifold_vertices(triangles.F, triangles.facets, triangles.n_vertices)
    if len(bad):
        raise MeshError(
            f"the faces at vertex {bad[0]} are not one fan ({len(bad)} of {triangles.n_vertices} are like this):"
            " loops around handles need a manifold mesh, so separate the faces there"
        )
    distance, before = _shortest_ways(triangles)
    ends = triangles.facets.vertices
    lengths = np.linalg.norm(triangles.V[ends[:, 0]] - triangles.V[ends[:, 1]], axis=1)
    around = distance[ends].sum(axis=1) + lengths
    is_branch = (before[ends[:, 0]] == ends[:, 1]) | (before[ends[:, 1]] == ends[:, 0])
    left = np.flatnonzero(~is_branch & ~_crossed(triangles, around, is_branch))
    solver = GeodesicPathSolver(triangles)
    loops = []
    for edge in left[np.argsort(around[left], kind="stable")]:
        loops.append(solver.straighten(edge_curve(triangles, _around(before, *ends[edge].tolist()), closed=True)))
    return sorted(loops, key=lambda loop: float(loop.lengths(triangles).sum()))


def _shortest_ways(mesh: Mesh) -> tuple[FloatArray, IntArray]:
    """Distance along edges (n,) from the first vertex of each component, and the vertex before (n,) on that way."""
    used = np.flatnonzero(mesh.referenced)
    start = used[np.unique(mesh.components[used], return_index=True)[1]]
    distance, before, _ = csgraph.dijkstra(
        mesh.edge_graph, directed=False, indices=start, min_only=True, return_predecessors=True
    )
    return distance, before


def _crossed(mesh: Mesh, around: FloatArray, is_branch: BoolArray) -> BoolArray:
    """Mask of the edges that a spanning tree of the faces crosses, those with the longest loops first.

    A face in this sense is also each hole, which its boundary edges join with the faces there.
    """
    found = mesh.facets
    rim = np.flatnonzero(found.n_faces == 1)
    graph = sp.coo_array((np.ones(len(rim)), found.vertices[rim].T), shape=2 * (mesh.n_vertices,))
    hole = csgraph.connected_components(graph, directed=False)[1]
    sides = group_by_label(found.of_face.ravel(), len(around))
    one, other = sides.members[sides.first[:-1]] // 3, sides.members[sides.first[1:] - 1] // 3
    other[rim] = mesh.n_faces + hole[found.vertices[rim, 0]]
    # Of the edges between the same two, only the one with the longest loop can be in the tree.
    free = np.flatnonzero(~is_branch)
    low, high = np.minimum(one, other)[free], np.maximum(one, other)[free]
    order = np.lexsort((-around[free], high, low))
    is_first = np.ones(len(order), bool)
    is_first[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    chosen = free[order[is_first]]
    rank = np.empty(len(chosen))
    rank[np.argsort(-around[chosen], kind="stable")] = np.arange(1, len(chosen) + 1)
    size = mesh.n_faces + mesh.n_vertices
    pairs = np.minimum(one, other)[chosen], np.maximum(one, other)[chosen]
    tree = csgraph.minimum_spanning_tree(sp.coo_array((rank, pairs), shape=(size, size)).tocsr())
    edge_of_rank = np.empty(len(chosen) + 1, np.int64)
    edge_of_rank[rank.astype(int)] = chosen
    crossed = np.zeros(len(around), bool)
    crossed[edge_of_rank[tree.data.astype(int)]] = True
    return crossed


def _around(before: IntArray, u: int, v: int) -> list[int]:
    """The vertices of the loop over edge uv and the ways from both ends to where these meet."""
    ways = []
    for end in (u, v):
        way = [end]
        while before[way[-1]] >= 0:
            way.append(int(before[way[-1]]))
        ways.append(way)
    one, other = ways
    while len(one) > 1 and len(other) > 1 and one[-2] == other[-2]:
        one.pop()
        other.pop()
    return one + other[-2::-1]
