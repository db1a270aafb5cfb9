"""Exact shortest paths, traced back to the sources through the windows that gave the distances."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from heat_igl.intrinsic import intrinsic_triangulation
from heat_igl.kernels.windows import paths
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows.exact import search, starts_at
from heat_igl.windows.tables import MARGIN, from_triangulation


class ExactPaths(NamedTuple):
    """Shortest paths from k places to the nearest source.

    Attributes
    ----------
    faces : (s,) int64
        Face of each segment, path after path.
    points : (s, 2, 3) float64
        Barycentric coordinates of the start and the end of each segment.
    first : (k + 1,) int64
        Segments of path i are ``first[i]`` to ``first[i + 1]``; none if no source is reached, or if the path was lost
        among needles.
    distance : (k,) float64
        Exact distance of each place.
    """

    faces: IntArray
    points: FloatArray
    first: IntArray
    distance: FloatArray


def exact_paths(
    mesh: Mesh, sources: SourceSet, faces: IntArray, barycentric: FloatArray, margin: float = MARGIN
) -> ExactPaths:
    """Shortest paths on the faces of a mesh, by windows on the triangles as they are given.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    sources : SourceSet
        Vertices, points and segments.
    faces, barycentric : (k,) int64, (k, 3) float64
        Where the paths begin. The search ends when the distance of all these places is known.
    margin : float
        By how much triangles are mollified, see `intrinsic_triangulation`.

    Returns
    -------
    ExactPaths
        Their lengths are the distances, to rounding. A path that passes a vertex closer than rounding goes through it.

    Raises
    ------
    MemoryError
        If the windows do not fit into memory.
    """
    tables = from_triangulation(intrinsic_triangulation(mesh, margin))
    is_corner = barycentric.max(axis=1) == 1
    vertex = np.full(len(faces), -1)
    vertex[is_corner] = mesh.F[faces[is_corner], barycentric[is_corner].argmax(axis=1)]
    points, segments = sources.points, sources.segments
    begin = float(sources.offsets.min())
    sources_there = starts_at(
        tables,
        sources.vertices,
        sources.vertex_offset - begin,
        SurfacePoints(points.faces, points.barycentric) if len(points.faces) else None,
        points.offset - begin if len(points.faces) else None,
        replace(segments, offset=segments.offset - begin) if len(segments.faces) else None,
    )
    inside = SurfacePoints(faces[~is_corner], barycentric[~is_corner]) if not is_corner.all() else None
    done = search(tables, sources_there, targets=inside, goals=np.unique(vertex[is_corner]))
    number = np.where(is_corner, tables.number[vertex], -1).astype(np.int32)
    target, ends = np.full(len(faces), -1), np.zeros(len(faces), np.int64)
    target[~is_corner] = done.nearest_copy(int((~is_corner).sum()))
    where, places = paths.trace_back(tables, done.found, done.starts, done.targets, number, target, ends)
    distance = done.found.distance[number]
    distance[~is_corner] = done.targets.found.distance[target[~is_corner]]
    return ExactPaths(
        tables.face[where].astype(np.int64), places, np.append(0, ends), tables.unscaled(distance) + begin
    )
