"""Distances by a formula: on the plane, sphere, cylinder, cone and flat torus, and in convex solids.

Each function returns the distance (n,) to the nearest source, in the mesh's unit; ``inf`` if no source can be reached.
On curved surfaces this is the distance on the smooth surface. The distance on a mesh inscribed in it is shorter by a
fraction that shrinks with the square of the edge length.

Examples
--------
>>> import heat_igl
>>> import numpy as np
>>> mesh = heat_igl.shapes.icosphere(2)
>>> bool(np.isclose(heat_igl.validation.closed_forms.sphere(mesh, 0).max(), np.pi))  # at the antipode
True
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from heat_igl.errors import ReferenceSolverError
from heat_igl.io.curves import flatness
from heat_igl.mesh import Mesh, MeshLike, as_simplices
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray

__all__ = ["cone", "convex_solid", "cylinder", "flat_torus", "plane", "sphere"]

# Relative to the size of the shape: the rounding of coordinates in text files with seven digits.
_TOLERANCE = 1e-6


def plane(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length of the straight line, the distance in a convex planar domain.

    Parameters
    ----------
    mesh : mesh
        Triangles that fill one convex piece of a plane, in any position.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.

    Returns
    -------
    (n,) float64

    Raises
    ------
    ReferenceSolverError
        If the mesh is not planar or not convex.
    SourceError
        If the sources name no vertex of the mesh.
    """
    mesh = as_simplices(mesh)
    axes, off, extent = flatness(mesh)
    if mesh.is_tetrahedral or off > _TOLERANCE * extent:
        raise ReferenceSolverError("the mesh does not lie in a plane: use reference.exact")
    _require_convex(mesh.V[mesh.referenced] @ axes[:2].T, float(mesh.measures.sum()))
    return _nearest(mesh, sources, partial(straight, mesh.V))


def convex_solid(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length of the straight line, the distance in a convex solid of tetrahedra.

    Parameters, result and errors are those of `plane`, for tetrahedra.
    """
    mesh = as_simplices(mesh)
    if not mesh.is_tetrahedral:
        raise ReferenceSolverError("the mesh holds no tetrahedra: use reference.exact on a surface")
    _require_convex(mesh.V[mesh.referenced], float(mesh.measures.sum()))
    return _nearest(mesh, sources, partial(straight, mesh.V))


def sphere(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length of the great circle arc on the sphere around the origin whose radius is that of the vertices.

    Sources, result and errors are those of `plane`, with a ReferenceSolverError if the vertices lie on no such sphere.
    """
    mesh = as_simplices(mesh)
    P = mesh.V
    radius = _common("distance from the origin", np.linalg.norm(P[mesh.referenced], axis=1))

    def arcs(source: int) -> FloatArray:
        # The arc cosine alone loses half of the digits of small angles.
        across = np.linalg.norm(np.cross(P, P[source]), axis=1)
        return np.asarray(radius * np.arctan2(across, P @ P[source]))

    return _nearest(mesh, sources, arcs)


def cylinder(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Length of the shortest helix on the side of a cylinder around the z axis, without caps.

    The radius is that of the vertices. Parameters, result and errors are those of `sphere`.
    """
    mesh = as_simplices(mesh)
    radius = _common("distance from the z axis", np.linalg.norm(mesh.V[mesh.referenced, :2], axis=1))
    angle = np.arctan2(mesh.V[:, 1], mesh.V[:, 0])
    return _nearest(
        mesh, sources, lambda source: np.hypot(radius * _turn(angle - angle[source]), mesh.V[:, 2] - mesh.V[source, 2])
    )


def cone(mesh: MeshLike, sources: Sources, *, apex: ArrayLike = (0.0, 0.0, 0.0)) -> FloatArray:
    """Length of the straight line on the unrolled side of a circular cone around an axis parallel to z, without base.

    Sources, result and errors are those of `plane`, with a ReferenceSolverError if the vertices lie on no such cone.

    Parameters
    ----------
    mesh : mesh
        Vertices on a cone, up to and including the apex: around a hole at the tip, paths would be longer.
    apex : (3,) array_like
        Tip of the cone.
    """
    mesh = as_simplices(mesh)
    P = mesh.V - np.asarray(apex, dtype=np.float64)
    slant = np.linalg.norm(P, axis=1)
    away = mesh.referenced & (slant > _TOLERANCE * slant.max())
    # Unrolled, a full turn is narrowed to a sector by the sine of the half angle at the apex.
    narrowing = _common("angle to the axis", np.linalg.norm(P[away, :2], axis=1) / slant[away])
    angle = np.arctan2(P[:, 1], P[:, 0])

    def lines(source: int) -> FloatArray:
        half = narrowing * _turn(angle - angle[source]) / 2
        # The law of cosines, written so that nearby points do not cancel.
        return np.asarray(np.sqrt((slant - slant[source]) ** 2 + 4 * slant * slant[source] * np.sin(half) ** 2))

    return _nearest(mesh, sources, lines)


def flat_torus(coordinates: ArrayLike, sources: Sources, *, periods: ArrayLike = (1.0, 1.0)) -> FloatArray:
    """Length of the shortest straight line on a flat torus, the plane modulo two perpendicular periods.

    `coordinates` (n, 2) are those of each vertex in the plane, since a flat torus fits into space only when folded, and
    `periods` (2,) the lengths after which they repeat; a ReferenceSolverError if one has another shape. Sources, result
    and other errors are those of `plane`.
    """
    points, lengths = np.asarray(coordinates, dtype=np.float64), np.asarray(periods, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or lengths.shape != (2,) or not (lengths > 0).all():
        raise ReferenceSolverError(
            f"a flat torus needs coordinates of shape (n, 2) and two positive periods, not {points.shape} and "
            f"{lengths.tolist()}"
        )
    distance = np.full(len(points), np.inf)
    for source in vertex_sources(sources, len(points)):
        step = points - points[source]
        distance = np.minimum(distance, np.linalg.norm(step - lengths * np.round(step / lengths), axis=1))
    return distance


# Distances between points, of which nothing is checked.


def straight(V: FloatArray, source: int) -> FloatArray:
    """Length (n,) of the straight line from one of the points (n, d)."""
    return np.asarray(np.linalg.norm(V - V[source], axis=1))


def by_fermat(V: FloatArray, source: int, left: float, right: float) -> FloatArray:
    """Least time (n,) from a point in the unit square with speed `left` at x < 1/2 and `right` beyond.

    The path crosses the border at the best of 8001 places (Snell's law), or runs along the faster side of it (the head
    wave); relative error below 1e-6.
    """
    start, x, y = V[source], V[:, 0] - 0.5, V[:, 1]
    here, there = (left, right) if start[0] < 0.5 else (right, left)
    beyond = x > 0 if start[0] < 0.5 else x < 0  # a source on the border counts as right of it
    depth = abs(start[0] - 0.5)
    crossing = np.linspace(-0.5, 1.5, 8001)
    to_crossing = np.hypot(depth, start[1] - crossing) / here
    refracted = np.array([(to_crossing + np.hypot(a, b - crossing) / there).min() for a, b in zip(x, y, strict=True)])
    time = straight(V, source) / here
    if there > here:
        critical = np.arcsin(here / there)
        both, along = depth + np.abs(x), np.abs(y - start[1])
        head = both * np.cos(critical) / here + along / there
        time = np.where(along >= both * np.tan(critical), np.minimum(time, head), time)
    return np.where(beyond, refracted, time)


def around_the_edge(V: FloatArray, source: int) -> FloatArray:
    """Distance (n,) in the unit cube without the quarter x, y > 1/2: paths bend at the inner edge.

    The part that is hidden from the source is turned about that edge until the path is straight.
    """
    x, y, z = (V - [0.5, 0.5, V[source, 2]]).T
    # From the wall y > 1/2, through the body, to the other wall.
    angle = np.mod(np.arctan2(y, x) - np.pi / 2, 2 * np.pi)
    bent = np.hypot(np.hypot(x, y) + np.hypot(x[source], y[source]), z)
    return np.where(np.abs(angle - angle[source]) > np.pi, bent, straight(V, source))


def _nearest(mesh: Mesh, sources: Sources, distance_from: Callable[[int], FloatArray]) -> FloatArray:
    """The minimum over all sources of the distance from one source, within the component of each."""
    distance = np.full(mesh.n_vertices, np.inf)
    for source in vertex_sources(sources, mesh.n_vertices):
        reached = mesh.components == mesh.components[source]
        distance[reached] = np.minimum(distance, distance_from(int(source)))[reached]
        distance[source] = 0.0
    return distance


def _turn(angle: FloatArray) -> FloatArray:
    """The absolute value of an angle that is reduced to at most half a turn."""
    return np.abs(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


def _common(name: str, values: FloatArray) -> float:
    """The value that all entries share up to rounding; refuses values that differ."""
    middle = float(np.median(values))
    spread = float(np.abs(values - middle).max())
    if spread > _TOLERANCE * middle:
        raise ReferenceSolverError(
            f"the {name} varies from {values.min():.6g} to {values.max():.6g} over the vertices, so this closed form "
            "does not hold for the mesh: use reference.exact"
        )
    return middle


def _require_convex(points: FloatArray, content: float) -> None:
    """Refuse a mesh that does not fill the convex hull of the vertices: straight lines would leave it."""
    from scipy.spatial import ConvexHull, QhullError  # takes as long to import as the rest of the package

    try:
        hull = float(ConvexHull(points).volume)
    except QhullError:
        hull = np.inf
    if abs(content - hull) > _TOLERANCE * hull:
        raise ReferenceSolverError(
            f"the mesh fills {content / hull:.4%} of its convex hull, so straight lines are no geodesics: "
            "use reference.exact"
        )
