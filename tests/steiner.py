"""Distances on any triangle mesh, manifold or not, from a graph with extra points on the edges.

Exact solvers crash if more than two faces share an edge. A graph needs no manifold: every two points on the border
of a face are joined by the straight line between them, so a shortest path in it is a path on the surface, never
shorter than the true distance, and as close to it as the points on the edges are dense.
"""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.mesh import Mesh
from heat_igl.typing import ArrayLike, FloatArray


def graph_distance(mesh: Mesh, sources: ArrayLike, points: int, speed: FloatArray | None = None) -> FloatArray:
    """Lengths (k, n) of shortest paths in the graph whose edges hold `points` points each, evenly spaced.

    With a speed on each face, travel times; an edge has the larger speed of its faces.
    """
    # Of faces with the same vertices one will do; of an arc that is listed twice, the lengths would be summed.
    once = np.delete(np.arange(mesh.n_faces), mesh.report().duplicate_faces)
    tail, head = mesh.edges.T
    share = np.arange(1, points + 1)[:, None] / (points + 1)
    inside = (1 - share) * mesh.V[tail, None] + share * mesh.V[head, None]
    nodes = np.concatenate([mesh.V, inside.reshape(-1, 3)])
    # Node numbers: vertices, then the points of edge 0 from the lower to the higher vertex, of edge 1, and so on.
    on_edge = mesh.n_vertices + np.arange(len(tail) * points).reshape(-1, points)

    along = np.column_stack([tail, on_edge, head])
    ends = [along[:, :-1].ravel()], [along[:, 1:].ravel()]
    speed = np.ones(mesh.n_faces) if speed is None else speed
    of_edge = np.zeros(len(tail))
    np.maximum.at(of_edge, mesh.facets.of_face, speed[:, None])
    speeds = [np.repeat(of_edge, points + 1)]
    for corner in range(3):
        opposite, following = (on_edge[mesh.facets.of_face[once, (corner + k) % 3]] for k in (0, 1))
        across = np.column_stack([mesh.F[once, corner], following])
        ends[0].append(np.repeat(across, points, axis=1).ravel())
        ends[1].append(np.tile(opposite, points + 1).ravel())
        speeds.append(np.repeat(speed[once], points * (points + 1)))
    i, j = (np.concatenate(end) for end in ends)
    # Vertices in one place are joined all the same; an arc of length 0 would be none.
    lengths = np.maximum(np.linalg.norm(nodes[i] - nodes[j], axis=1), 1e-300) / np.concatenate(speeds)
    graph = sp.csr_array((lengths, (i, j)), shape=(len(nodes), len(nodes)))
    distance: FloatArray = csgraph.dijkstra(graph, directed=False, indices=np.atleast_1d(sources))
    return distance[:, : mesh.n_vertices]
