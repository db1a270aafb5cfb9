"""Exact shortest paths, followed back through the windows of the exact distance."""

from __future__ import annotations

import numpy as np

from heat_igl.curves.places import places
from heat_igl.errors import MeshError, SourceError, names_guessed
from heat_igl.mesh import Mesh, MeshLike, MeshPart, SurfaceCurve, SurfacePoints, as_simplices
from heat_igl.sources import Sources, SourceSet, named_vertices, source_set
from heat_igl.typing import ArrayLike, FloatArray, IntArray
from heat_igl.windows import exact_paths
from heat_igl.windows.tables import MARGIN

# A path that is lost among faces without area is looked for again on triangles that are mollified by this share of the
# mean edge length. Of 36 000 paths on 300 meshes with coincident vertices and needles, 255 were lost at first and none
# after this.
_WIDER_MARGIN = 1e-6


@names_guessed
def shortest_paths(
    mesh: MeshLike, targets: Sources, sources: Sources, *, region: ArrayLike | None = None
) -> list[SurfaceCurve]:
    """Exact shortest paths from targets to the nearest of some sources.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    targets : int, sequence of int, (n,) mask of bool, or SurfacePoints
        Start of each path: vertices, in the order given and with repetitions, or points on faces.
    sources
        Possible ends of the paths, as ``solver.distance`` takes them.
    region : (n,) or (m,) array_like of bool, optional
        What the paths may enter, as for `GeodesicSolver`.

    Returns
    -------
    list of SurfaceCurve
        For each target a path to the source at which distance plus offset is least, on the faces of `mesh`. Its
        ``length`` is the distance. The path of a target that is a source is a single segment of length 0.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral, or a path is lost among faces without area.
    SourceError
        If targets or sources are no points of the mesh, or no source can be reached from a target.

    Notes
    -----
    Exact distance is found by windows (Mitchell, Mount and Papadimitriou 1987). The windows that reach a target lead
    straight back, from bend to bend, to the source; see `exact_paths`.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> (path,) = heat_igl.shortest_paths(mesh, targets=19, sources=0)  # along the diagonal of 3 by 4
    >>> round(path.length, 6)
    5.0
    """
    mesh = as_simplices(mesh)
    if mesh.is_tetrahedral:
        raise MeshError("paths need triangles, but the mesh is tetrahedral")
    chosen = source_set(sources, mesh.n_vertices, mesh.F, mesh).with_vertices_moved(mesh.originals)
    if region is None:
        face, barycentric = places("targets", mesh, targets)
        return [path.on(mesh) for path in _exact(mesh, chosen, face, barycentric)]
    part = MeshPart.of(mesh, region)
    if isinstance(targets, SurfacePoints):
        face, barycentric = places("targets", mesh, targets)
        face = part.numbers_of(face, "targets")
    else:
        part.require_vertices(named_vertices(targets, mesh.n_vertices, "targets"), "targets")
        face, barycentric = places("targets", part.mesh, targets)
    paths = _exact(part.mesh, chosen.within(part), face, barycentric)
    return [SurfaceCurve(part.faces[path.faces], path.start, path.end).on(mesh) for path in paths]


@names_guessed
def shortest_path(mesh: MeshLike, a: Sources, b: Sources, *, region: ArrayLike | None = None) -> SurfaceCurve:
    """The exact shortest path from one place to another.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    a, b : int or SurfacePoints
        A vertex, or a point in a face. Of several places `b`, the path leads to the nearest.
    region : (n,) or (m,) array_like of bool, optional
        What the path may enter, as for `GeodesicSolver`.

    Returns
    -------
    SurfaceCurve
        From a to b; its ``length`` is their distance.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If `a` or `b` is no place on the mesh, `a` is several, or no path joins them.

    Examples
    --------
    >>> import heat_igl
    >>> path = heat_igl.shortest_path(heat_igl.shapes.strip(4, 3), 0, 19)  # the diagonal of 3 by 4
    >>> round(path.length, 6), path.points[-1].tolist()
    (5.0, [4.0, 3.0, 0.0])
    """
    paths = shortest_paths(mesh, a, b, region=region)
    if len(paths) > 1:
        raise SourceError(f"a must be one place, not {len(paths)}: shortest_paths takes several targets")
    return paths[0]


def _exact(mesh: Mesh, sources: SourceSet, face: IntArray, barycentric: FloatArray) -> list[SurfaceCurve]:
    """The path from each place, on triangles that are mollified more where paths are lost."""
    paths: dict[int, SurfaceCurve] = {}
    left = np.arange(len(face))
    for margin in (MARGIN, _WIDER_MARGIN):
        found = exact_paths(mesh, sources, face[left], barycentric[left], margin)
        for i, begin, end in zip(left, found.first, found.first[1:], strict=False):
            if begin < end:
                points = found.points[begin:end]
                paths[int(i)] = SurfaceCurve(found.faces[begin:end], points[:, 0], points[:, 1])
        left = np.setdiff1d(left, list(paths))
        if not len(left):
            return [paths[i] for i in range(len(face))]
    far = np.isinf(found.distance)
    if far.any():
        raise SourceError(
            f"from targets[{left[np.argmax(far)]}] no source can be reached ({far.sum()} of {len(face)} lie on other "
            "components): leave out targets at infinite distance"
        )
    raise MeshError(f"the path from targets[{left[0]}] is lost among faces without area: repair these faces")
