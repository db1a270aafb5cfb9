"""pygeodesic's class (pygeodesic 0.1), with its names and arguments, computed by this package.

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
        Triangles. Vertices that no face uses are allowed.

    Raises
    ------
    MeshError
        If the arrays are no triangle mesh; pygeodesic prints a line, and every query then returns None.

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
        """Distance between two vertices, and the shortest path from the target to the source.

        Returns
        -------
        path_length : float
        path_points : (k, 3) float64
            Where the path crosses edges and passes vertices, with both ends; one point if both are the same vertex.

        Raises
        ------
        SourceError
            If an index is no vertex, where pygeodesic prints a line and returns None twice; or if there is no path.
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
        """Distance of target vertices from the nearest source vertex, and which source that is.

        Parameters
        ----------
        source_indices : (k,) array_like of int, optional
            Vertex 0 if not given.
        target_indices : (t,) array_like of int, optional
            All vertices if not given.
        max_distance : float
            What is farther is ``inf``. In pygeodesic, targets may be farther.

        Returns
        -------
        distances : (t,) float64
            ``inf`` at targets that no source reaches.
        best_sources : (t,) int32
            Position in `source_indices`; as in pygeodesic, 0 where the distance is ``inf``.

        Raises
        ------
        SourceError
            If an index is no vertex, where pygeodesic prints a line and returns None twice.
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
    """Positions (n, 3) and triangles (m, 3) of a text file: a line of n and m, then a line for each of them.

    Raises
    ------
    MeshError
        If the file does not hold them, where pygeodesic prints a line and returns None.
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
