"""Geodesic Bezier curves."""

from __future__ import annotations

import numpy as np

from heat_igl.curves.geodesics import GeodesicPathSolver, Shortened, as_curve
from heat_igl.curves.places import Waypoints, mixed_places
from heat_igl.errors import SourceError, shown
from heat_igl.mesh import MeshLike, SurfaceCurve, as_simplices
from heat_igl.sources.source_sets import on_simplex
from heat_igl.typing import FloatArray, IntArray

_MOST_PIECES = 1_000_000


def geodesic_bezier(mesh: MeshLike, points: Waypoints, pieces: int = 32) -> SurfaceCurve:
    """The Bezier curve of control points on a surface, with geodesics in place of straight lines.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.
    points : sequence of int, SurfacePoints, or a sequence of both
        The control points, two or more vertices or points on faces: d + 1 for the degree d.
    pieces : int
        The curve is evaluated at the parameters i / pieces, and these places are joined by geodesics.

    Returns
    -------
    SurfaceCurve
        From the first control point to the last. It leaves the first one towards the second, and arrives at the last
        from the one before it.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there are fewer than two control points, one is no vertex or point of the mesh, or they lie on different
        components.
    ValueError
        If `pieces` is no positive integer.

    Notes
    -----
    De Casteljau's algorithm with the geodesics of `geodesic_path` (Park and Ravani 1995): d (d + 1) / 2 of them for
    each parameter. The curve is continuous as long as these geodesics change continuously with the parameter. It can
    jump where control points lie behind a hill from each other, so that another geodesic becomes the shorter one.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> curve = heat_igl.curves.geodesic_bezier(mesh, [0, 8, 80], pieces=2)  # three corners of the square
    >>> curve.positions(mesh).round(6)[[0, -1]].tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """
    if isinstance(pieces, bool) or not isinstance(pieces, int | np.integer) or not 1 <= pieces <= _MOST_PIECES:
        raise ValueError(f"pieces must be an integer from 1 to {_MOST_PIECES}, not {shown(pieces)}")
    triangles = as_simplices(mesh)
    solver = GeodesicPathSolver(triangles)
    faces, barycentric = mixed_places("points", triangles, points)
    if len(faces) < 2:
        raise SourceError(f"points must be two control points or more, not {len(faces)}")
    first = solver.geodesics(faces, barycentric)
    found = [(faces[0], barycentric[0])]
    for i in range(1, pieces):
        legs = first
        while legs:
            places = [_along(leg, i / pieces, triangles.V[triangles.F[leg.faces]]) for leg in legs]
            at = np.array([face for face, _ in places]), np.array([weights for _, weights in places])
            legs = solver.geodesics(*at)
        found.append(places[0])
    found.append((faces[-1], barycentric[-1]))
    ends: tuple[IntArray, FloatArray] = np.array([face for face, _ in found]), np.array([b for _, b in found])
    return as_curve(solver.geodesics(*ends), is_closed=False).on(triangles)


def _along(leg: Shortened, share: float, corners: FloatArray) -> tuple[int, FloatArray]:
    """The place at this share of the length of a geodesic; `corners` (s, 3, 3) are those of the faces."""
    steps = np.einsum("kc,kcx->kx", leg.points[:, 1] - leg.points[:, 0], corners)
    ends = np.cumsum(np.linalg.norm(steps, axis=1))
    wanted = share * ends[-1]
    i = min(int(np.searchsorted(ends, wanted)), len(ends) - 1)
    before = ends[i - 1] if i else 0.0
    here = (wanted - before) / (ends[i] - before) if ends[i] > before else 0.0
    weights = leg.points[i, 0] + min(max(here, 0.0), 1.0) * (leg.points[i, 1] - leg.points[i, 0])
    return int(leg.faces[i]), on_simplex(weights[None])[0]
