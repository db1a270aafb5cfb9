"""Curves drawn through places on a mesh, and the signed distance from a curve, each in one call."""

from __future__ import annotations

import numpy as np

from heat_igl.curves.geodesics import GeodesicPathSolver
from heat_igl.curves.places import Waypoints, mixed_places
from heat_igl.errors import SourceError, names_guessed, truth
from heat_igl.heat import SignedHeatSolver
from heat_igl.mesh import Mesh, MeshLike, NestedCurves, SurfaceCurve, SurfacePoints, as_simplices, closest_points
from heat_igl.mesh.surface_points import unchecked_curve
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["curve_through", "signed_distance"]


@names_guessed
def curve_through(mesh: MeshLike, points: Waypoints | ArrayLike, *, closed: bool = False) -> SurfaceCurve:
    """The curve that passes some places in their order, locally shortest from each to the next.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    points : sequence of int, SurfacePoints, a sequence of both, or (k, 3) array_like of float
        Two or more vertices, points on faces, or positions in space such as clicked ones; for a closed curve three.
    closed : bool
        Whether a last part leads back to the first place. The curve passes all places, unlike the closed geodesic of
        `geodesic_path`.

    Returns
    -------
    SurfaceCurve

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there are too few places, one is no vertex or point of the mesh or cannot be reached from the one before it,
        or a position is farther from the surface than the mean length of an edge.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> triangle = heat_igl.curve_through(mesh, [[0.1, 0.1, 0.0], [0.4, 0.1, 0.0], [0.4, 0.5, 0.0]], closed=True)
    >>> round(triangle.length, 6)
    1.2
    """
    triangles, closed = as_simplices(mesh), truth("closed", closed)
    faces, barycentric = mixed_places("points", triangles, _placed(triangles, points))
    needed = 3 if closed else 2
    if len(faces) < needed:
        raise SourceError(f"points must be {needed} places or more for {'a closed' if closed else 'a'} curve")
    order = np.arange(len(faces) + closed) % len(faces)
    curve = GeodesicPathSolver(triangles).path(SurfacePoints(faces[order], barycentric[order]))
    return unchecked_curve(curve.faces, curve.start, curve.end, closed, triangles)


def _placed(mesh: Mesh, points: Waypoints | ArrayLike) -> Waypoints:
    """Positions in space as the nearest points of a mesh; other places as they are."""
    first = points[0] if isinstance(points, np.ndarray | list | tuple) and len(points) else None
    if not isinstance(first, np.ndarray | list | tuple):
        return points  # type: ignore[return-value]
    found, nearness = closest_points(mesh, points), float(mesh.edge_lengths.mean())  # type: ignore[arg-type]
    far = np.flatnonzero(found.gap > nearness)
    if len(far):
        raise SourceError(
            f"points[{far[0]}] is {found.gap[far[0]]:.3g} away from the surface ({len(far)} of {len(found.gap)} are "
            f"farther than {nearness:.3g}, the mean length of an edge): pass closest_points(mesh, points).points"
        )
    return found.points


def signed_distance(mesh: MeshLike, curve: NestedCurves) -> FloatArray:
    """Signed distance from curves on a mesh, in one call; to ask more than once, keep a `SignedHeatSolver`.

    Parameters
    ----------
    mesh : mesh
        Triangles, oriented alike.
    curve : SurfaceCurve or list of such
        The curves; they may be broken.

    Returns
    -------
    (n,) float64
        In the mesh's unit: negative on the left of the curves, which ``curve.reversed()`` turns round.

    Raises
    ------
    MeshError, SourceError
        As for `SignedHeatSolver`.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> middle = heat_igl.curve_through(mesh, [[0.0, 0.5, 0.0], [1.0, 0.5, 0.0]])  # above is on the left
    >>> heat_igl.signed_distance(mesh, middle)[[0, 80]].round(6).tolist()
    [0.5, -0.5]
    """
    return SignedHeatSolver(mesh).distance(curve)
