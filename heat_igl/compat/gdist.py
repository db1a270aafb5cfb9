"""gdist's functions (tvb-gdist 2.9), with its names and arguments, computed by this package.

``import heat_igl.compat.gdist as gdist`` replaces ``import gdist``. Both libraries compute exact distances on the
polyhedral surface.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from heat_igl.errors import as_array, positive, truth
from heat_igl.geodesic import geodesic_distance
from heat_igl.mesh import Mesh
from heat_igl.sources import Sources, named_vertices
from heat_igl.typing import ArrayLike, FloatArray
from heat_igl.windows import distances_within, pair_distances

__all__ = ["compute_gdist", "distance_matrix_of_selected_points", "local_gdist_matrix"]


def compute_gdist(
    vertices: ArrayLike,
    triangles: ArrayLike,
    source_indices: Sources | None = None,
    target_indices: ArrayLike | None = None,
    max_distance: float = np.inf,
    is_one_indexed: bool = False,
) -> FloatArray:
    """Exact distance of target vertices from the nearest source vertex.

    Parameters
    ----------
    vertices, triangles : array_like
        Positions (n, 3) and triangles (m, 3).
    source_indices : (k,) array_like of int, optional
        Vertex 0 if not given.
    target_indices : (t,) array_like of int, optional
        All vertices if not given.
    max_distance : float
        Without targets, what is farther is ``inf`` (in gdist 1e100); with targets not read, as in gdist.
    is_one_indexed : bool
        Whether `triangles` count vertices from 1. Sources and targets count from 0.

    Returns
    -------
    (t,) float64
        ``inf`` at targets that no source reaches.

    Raises
    ------
    MeshError, SourceError, ValueError
        If an argument is wrong; gdist may end the process.

    Examples
    --------
    >>> from heat_igl.compat import gdist
    >>> gdist.compute_gdist([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[1, 2, 3]], [0], is_one_indexed=True).tolist()
    [0.0, 3.0, 5.0]
    """
    mesh, limit = _mesh(vertices, triangles, is_one_indexed), positive("max_distance", max_distance, infinite=True)
    n = mesh.n_vertices
    sources = [0] if source_indices is None else named_vertices(source_indices, n, "source_indices")
    if target_indices is None:
        return geodesic_distance(mesh, sources, method="exact", cutoff=limit if limit < np.inf else None)
    targets = np.asarray(target_indices)
    if not targets.size:
        return np.empty(0)
    targets = named_vertices(targets, n, "target_indices")
    return geodesic_distance(mesh, sources, method="exact", targets=targets)


def local_gdist_matrix(
    vertices: ArrayLike, triangles: ArrayLike, max_distance: float = np.inf, is_one_indexed: bool = False
) -> sp.csc_matrix:
    """Exact distances from every vertex to all vertices up to `max_distance`.

    Returns
    -------
    scipy.sparse.csc_matrix
        Shape (n, n). As in gdist, a distance of 0 is not stored; here, one to another component is not stored either.

    Raises
    ------
    MeshError, ValueError
        If an argument is wrong.
    MemoryError
        If the distances will not fit into memory.
    """
    mesh, limit = _mesh(vertices, triangles, is_one_indexed), positive("max_distance", max_distance, infinite=True)
    within = sp.csc_matrix(distances_within(mesh, limit))
    within.eliminate_zeros()
    return within


def distance_matrix_of_selected_points(
    vertices: ArrayLike,
    triangles: ArrayLike,
    points: Sources,
    max_distance: float = np.inf,
    is_one_indexed: bool = False,
) -> sp.csc_matrix:
    """Exact distances between some vertices.

    Parameters
    ----------
    vertices, triangles, is_one_indexed
        As for `compute_gdist`.
    points : (k,) array_like of int
        Distinct vertices.
    max_distance : float
        Larger distances are not stored; gdist does not read this argument.

    Returns
    -------
    scipy.sparse.csc_matrix
        Shape (n, n), symmetric, with entries between different points alone. Without `max_distance`, ``inf`` is stored
        between components.

    Raises
    ------
    MeshError, SourceError, ValueError
        If an argument is wrong.
    """
    mesh, limit = _mesh(vertices, triangles, is_one_indexed), positive("max_distance", max_distance, infinite=True)
    n = mesh.n_vertices
    chosen = named_vertices(points, n, "points")
    i, j = np.triu_indices(len(chosen), 1)
    pairs = np.stack([chosen[i], chosen[j]], axis=1)
    distance = pair_distances(mesh, pairs)
    (a, b), distance = pairs[distance <= limit].T, distance[distance <= limit]
    both = np.concatenate([a, b]), np.concatenate([b, a])
    return sp.csc_matrix((np.tile(distance, 2), both), shape=(n, n))


def _mesh(vertices: ArrayLike, triangles: ArrayLike, is_one_indexed: bool) -> Mesh:
    faces = as_array("triangles", triangles)
    return Mesh(vertices, faces - 1 if truth("is_one_indexed", is_one_indexed) else faces)
