"""Homotopy classes of strips of faces, as words of letters for the edges that they cross."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.mesh import Mesh
from heat_igl.mesh.connectivity import nonmanifold_vertices
from heat_igl.typing import AnyArray, BoolArray, IntArray

__all__ = ["crossing_letters"]


def crossing_letters(mesh: Mesh) -> AnyArray | None:
    """The letter (3 m,) int32 of each half-edge, for strips that leave the face over it.

    It is empty if all components are spheres or disks, and None if the mesh is not manifold or not oriented alike.

    The letters of its crossings, without 0, are the word of a strip. On the other side of an edge the letter is the
    negative. Strips with the same ends are of one class if the first word and the inverse of the second cancel. The
    converse fails at a few vertices, see Notes.

    Notes
    -----
    The edges that a spanning tree of the faces does not cross form a graph, to which the surface without one disk
    contracts (Erickson and Whittlesey 2005). Once edges with a free end are removed, it consists of chains of edges.
    Strips can be moved over a vertex inside a chain, so all edges of a chain have one letter. At a vertex between
    chains, strips on the two sides have different letters although they are of one class. A closed surface of genus g
    has at most 4 g - 2 such vertices. All holes are joined to one vertex.
    """
    edge = mesh.facets.of_face.ravel()
    begin, end = (mesh.F[:, [(c + turn) % 3 for c in range(3)]].ravel() for turn in (1, 2))
    sign = np.where(begin < end, 1, -1)
    count = mesh.facets.n_faces
    is_inner = count == 2
    turned = np.bincount(edge, sign, len(count))
    if (turned[is_inner] != 0).any() or len(nonmanifold_vertices(mesh.F, mesh.facets, mesh.n_vertices)):
        return None
    if _is_simply_connected(mesh):
        return np.zeros(0, np.int32)
    letter_of_edge = np.zeros(len(count), np.int32)
    for number, chain in enumerate(_chains(mesh, is_inner), start=1):
        for e, is_forward in chain:
            letter_of_edge[e] = number if is_forward else -number
    return (sign * letter_of_edge[edge]).astype(np.int32)


def _is_simply_connected(mesh: Mesh) -> bool:
    """Whether each component is a sphere or a disk: none has a larger Euler characteristic."""
    found = mesh.facets
    referenced = np.flatnonzero(mesh.referenced)
    parts = np.unique(mesh.components[referenced])
    bounded = np.unique(mesh.components[found.vertices[found.n_faces == 1, 0]])
    return len(referenced) - len(found.n_faces) + mesh.n_faces == 2 * len(parts) - len(bounded)


def _chains(mesh: Mesh, is_inner: BoolArray) -> list[list[tuple[int, bool]]]:
    """Edges of each chain, with whether the chain runs from the smaller vertex to the larger; hole: vertex n."""
    found, n = mesh.facets, mesh.n_vertices
    order = np.argsort(found.of_face.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(found.n_faces)])[:-1][is_inner]
    inner = np.flatnonzero(is_inner)
    is_tree = np.zeros(len(is_inner), bool)
    is_tree[inner[_forest(order[first] // 3, order[first + 1] // 3, mesh.n_faces)]] = True
    node = np.arange(n)
    node[found.vertices[found.n_faces == 1]] = n
    free = np.flatnonzero(is_inner & ~is_tree)
    ends = node[found.vertices[free]]
    is_branch = np.zeros(len(free), bool)
    is_branch[_forest(ends[:, 0], ends[:, 1], n + 1)] = True
    kept = _without_loose_ends(ends, is_branch, n)
    return _walked(free[kept], ends[kept], n)


def _forest(one: IntArray, other: IntArray, n: int) -> IntArray:
    """Which of the edges between nodes make a spanning forest."""
    low, high = np.minimum(one, other), np.maximum(one, other)
    order = np.lexsort((high, low))
    is_first = np.ones(len(order), bool)
    is_first[1:] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    single = order[is_first & (low[order] != high[order])]
    graph = sp.coo_array((np.arange(1.0, len(single) + 1), (low[single], high[single])), shape=(n, n))
    return np.asarray(single[csgraph.minimum_spanning_tree(graph.tocsr()).data.astype(int) - 1])


def _without_loose_ends(ends: IntArray, is_branch: BoolArray, n: int) -> IntArray:
    """The edges outside a forest, and those of the paths in it from their ends to one root in each component.

    The root is the hole, vertex n, or else one of these ends.
    """
    chords, branches = np.flatnonzero(~is_branch), np.flatnonzero(is_branch)
    one, other = ends[branches].T
    tree = sp.coo_array((np.ones(len(branches)), (one, other)), shape=(n + 1, n + 1)).tocsr()
    before = np.full(n + 1, n + 1)
    for root in (n, *ends[chords, 0].tolist()):
        if before[root] > n:
            reached, previous = csgraph.breadth_first_order(tree, root, directed=False)
            before[reached] = previous[reached]
    above = np.full(n + 1, -1)
    above[one[before[one] == other]] = branches[before[one] == other]
    above[other[before[other] == one]] = branches[before[other] == one]
    kept = set(chords.tolist())
    for v in ends[chords].ravel().tolist():
        while above[v] >= 0 and above[v] not in kept:
            kept.add(int(above[v]))
            v = int(before[v])
    return np.array(sorted(kept))


def _walked(edges: IntArray, ends: IntArray, n: int) -> list[list[tuple[int, bool]]]:
    """The chains of a graph: edges one after another, from a vertex with other than two edges to the next."""
    around: dict[int, list[int]] = {}
    for i, (a, b) in enumerate(ends.tolist()):
        around.setdefault(a, []).append(i)
        around.setdefault(b, []).append(i)
    stops = {v for v, sides in around.items() if len(sides) != 2 or v == n}
    done: set[int] = set()
    chains = []
    for i in range(len(edges)):
        if i not in done:
            back = [(j, not is_forward) for j, is_forward in _half_chain(i, 1, ends, around, stops)]
            whole = [*back[:0:-1], *_half_chain(i, 0, ends, around, stops)]
            done |= {j for j, _ in whole}
            chains.append([(int(edges[j]), is_forward) for j, is_forward in whole])
    return chains


def _half_chain(
    i: int, way: int, ends: IntArray, around: dict[int, list[int]], stops: set[int]
) -> list[tuple[int, bool]]:
    """The chain from edge i on, in its direction (`way` 0) or against it, to a stop or around to the same edge."""
    chain = [(i, way == 0)]
    v = int(ends[i, 1 - way])
    while v not in stops:
        j = sum(around[v]) - chain[-1][0]
        if j == i:
            break
        is_forward = bool(ends[j, 0] == v)
        chain.append((j, is_forward))
        v = int(ends[j, 1 if is_forward else 0])
    return chain
