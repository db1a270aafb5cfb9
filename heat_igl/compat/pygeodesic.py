"""Drop-in replacement for pygeodesic 0.1: the same names and arguments, computed by this package.

``import heat_igl.compat.pygeodesic as geodesic`` replaces ``import pygeodesic.geodesic as geodesic``. Both libraries
compute exact distances and shortest paths on the polyhedral surface.
"""

from __future__ import annotations

from os import PathLike

import numpy as np

from heat_igl.curves import shortest_path
from heat_igl.errors import MeshError, positive
from heat_igl.mesh import Mesh, as_triangles
from heat_igl.sources import Sources, named_vertices, source_set
from heat_igl.typing import AnyArray, ArrayLike, FloatArray, IntArray
from heat_igl.windows import ExactSurface
from heat_igl.windows.tables import from_mesh

__all__ = ["PyGeodesicAlgorithmExact", "read_mesh_from_file"]


class PyGeodesicAlgorithmExact:
    """Exact distances and shortest paths on one surface, for any number of queries.

    Parameters
    ----------
    points : (n, 3) array_like
        Positions.
    faces : (m, 3) array_like of int
        Triangles. There may be vertices that no face uses.

    Raises
    ------
    MeshError
        If the arrays are not a triangle mesh. pygeodesic prints a message instead, and all its queries return None.

    Examples
    --------
    >>> from heat_igl.compat import pygeodesic as geodesic
    >>> algorithm = geodesic.PyGeodesicAlgorithmExact([[0, 0, 0], [3, 0, 0], [3, 4, 0]], [[0, 1, 2]])
    >>> distance, path = algorithm.geodesicDistance(0, 2)
    >>> distance, path.tolist()
    (5.0, [[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])
    """

    def __init__(self, points: ArrayLike, faces: ArrayLike) -> None:
        self._mesh = as_triangles(Mesh(points, faces), "exact distances need")
        self._surface = ExactSurface(from_mesh(self._mesh, 0))

    def geodesicDistance(self, sourceIndex: int, targetIndex: int) -> tuple[float, FloatArray]:
        """The distance between two vertices, and the shortest path from the target to the source.

        Returns
        -------
        path_length : float
        path_points : (k, 3) float64
            The ends of the path, and the points between them where it crosses edges or passes through vertices. One
            point if source and target are the same vertex.

        Raises
        ------
        SourceError
            If an index is not a vertex, or if there is no path. pygeodesic prints a message and returns (None, None).
        """
        source, target = (
            int(named_vertices(index, self._mesh.n_vertices, name)[0])
            for name, index in (("sourceIndex", sourceIndex), ("targetIndex", targetIndex))
        )
        if source == target:
            return 0.0, np.array(self._mesh.V[[source]])
        path = shortest_path(self._mesh, target, source)
        points, lengths = path.positions(self._mesh), path.lengths(self._mesh)
        return float(lengths.sum()), points[np.append(True, lengths > 0)]

    def geodesicDistances(
        self, source_indices: Sources | None = None, target_indices: Sources | None = None, max_distance: float = np.inf
    ) -> tuple[FloatArray, AnyArray]:
        """The distances of target vertices from the nearest source vertex, and which source is the nearest.

        Parameters
        ----------
        source_indices : (k,) array_like of int, optional
            By default, vertex 0.
        target_indices : (t,) array_like of int, optional
            By default, all vertices.
        max_distance : float
            Larger distances are returned as ``inf``. pygeodesic may return larger distances at targets.

        Returns
        -------
        distances : (t,) float64
            ``inf`` at targets that no source reaches.
        best_sources : (t,) int32
            Index into `source_indices`; as in pygeodesic, 0 where the distance is ``inf``.

        Raises
        ------
        SourceError
            If an index is not a vertex. pygeodesic prints a message and returns (None, None).
        ValueError
            If `max_distance` is not a positive number.
        """
        n, limit = self._mesh.n_vertices, positive("max_distance", max_distance, infinite=True)
        sources: IntArray = (
            np.zeros(1, np.int64) if source_indices is None else named_vertices(source_indices, n, "source_indices")
        )
        targets = None if target_indices is None else named_vertices(target_indices, n, "target_indices")
        chosen = source_set(sources, n, None)
        found = self._surface.solve(chosen, cutoff=limit, goals=targets)
        which = slice(None) if targets is None else targets
        return found.distance[which], np.maximum(chosen.labels[found.origin.label[which]], 0).astype(np.int32)


def read_mesh_from_file(filename: str | PathLike[str]) -> tuple[FloatArray, IntArray]:
    """Read a text file: a line with n and m, then n lines of positions and m lines of triangles.

    Returns the positions (n, 3) and the triangles (m, 3).

    Raises
    ------
    MeshError
        If the file has another form. pygeodesic prints a message and returns None.
    """
    with open(filename, encoding="utf-8") as file:
        lines = [line.split() for line in file if line.strip()]
    try:
        n, m = (int(number) for number in lines[0])
        points, faces = np.array(lines[1 : n + 1], np.float64), np.array(lines[n + 1 : n + m + 1], np.int64)
    except (ValueError, IndexError):
        raise MeshError(f"{filename}: expected a line 'n m', n lines of positions and m lines of faces") from None
    if len(points) != n or len(faces) != m:
        raise MeshError(f"{filename}: {n} positions and {m} faces are announced, but the file ends before")
    return points, faces
