"""Isolines of values on a triangle mesh, the areas that they enclose, and offset curves.

Values are linear in each triangle, so an isoline is a polyline with one segment per triangle. The comparison of the
values with the level decides which triangles it crosses; a vertex exactly on the level counts as above. The rest
follows from the faces, so rounding cannot open a loop or draw a segment twice.
"""

from __future__ import annotations

import numpy as np

from heat_igl.errors import positive, raise_at_first, real_numbers, shown
from heat_igl.geodesic import Solver
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, as_triangles, crossings, joined_segments, level_segments
from heat_igl.sources import Sources
from heat_igl.typing import ArrayLike, FloatArray


def isolines(mesh: MeshLike, values: ArrayLike, levels: ArrayLike) -> list[list[SurfaceCurve]]:
    """The curves of constant value, for values linear in each triangle.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    values : (n,) array_like
        A value per vertex, for instance a distance. Faces with an infinite value are ignored.
    levels : int, float or (k,) array_like
        Levels, in any order, or one float; an int is a number of levels, evenly spaced between the smallest and the
        largest finite value.

    Returns
    -------
    list of k lists of SurfaceCurve
        The curves of each level, in the order of their first faces. A curve is closed, or it ends on the boundary, at
        an edge of more than two faces, or at a face with an infinite value. Lower values lie on the left of a curve,
        seen from outside (the side from which the corners of faces run counter-clockwise), as long as faces are
        oriented alike.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    ValueError
        If a value is NaN or negative infinite, a level is not finite, or an array has the wrong shape.

    Notes
    -----
    The curves of a level bound ``{values < level}``. They follow the lower side of a plateau at the level, cross a
    vertex at the level like any other point, and there is no curve around a minimum or maximum at the level.
    This is the convention of libigl's ``isolines``.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(10)
    >>> (curve,), none = heat_igl.isolines(mesh, mesh.V[:, 0], [0.25, 2.0])  # of the coordinate x
    >>> round(curve.length, 6), none
    (1.0, [])
    >>> [float(curve.points[0, 0].round(6)) for (curve,) in heat_igl.isolines(mesh, mesh.V[:, 0], 3)]
    [0.25, 0.5, 0.75]
    """
    mesh = as_triangles(mesh, "isolines need")
    if isinstance(levels, int | np.integer) and not isinstance(levels, bool):
        checked, _ = _checked(mesh, values, [])
        finite, k = checked[np.isfinite(checked)], int(levels)
        if k < 1 or not len(finite):
            raise ValueError(f"levels must be a positive number of levels between finite values, or a list, not {k}")
        wanted = np.linspace(finite.min(), finite.max(), k + 2)[1:-1]
    else:
        checked, wanted = _checked(mesh, values, levels)
    return [joined_segments(level_segments(mesh, checked, level), mesh) for level in wanted]


def offset_curves(mesh: MeshLike, solver: Solver, sources: Sources, radius: float) -> list[SurfaceCurve]:
    """The curves at distance `radius` from `sources` on the surface.

    Parameters
    ----------
    mesh : mesh
        The triangles that `solver` was made for.
    solver : GeodesicSolver or HeatMethodSolver
        With a `GeodesicSolver` the only error left is that of linear interpolation in each triangle.
    sources
        As ``solver.distance`` takes them.
    radius : float
        Positive, in the mesh's unit. Curves nearer than an edge length are polygons of few corners.

    Returns
    -------
    list of SurfaceCurve
        As `isolines` returns them for one level, with the sources on their left; empty if no vertex is so far away.

    Raises
    ------
    ValueError
        If `radius` is not a positive number, or the solver belongs to another mesh.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.disk(40)
    >>> solver = heat_igl.GeodesicSolver(mesh)
    >>> (curve,) = heat_igl.curves.offset_curves(mesh, solver, 0, radius=0.5)
    >>> round(float(curve.lengths(mesh).sum() / np.pi), 2)  # a circle of radius 1/2
    1.0
    """
    mesh = as_triangles(mesh, "isolines need")
    radius = positive("radius", radius)
    if not isinstance(solver, Solver):
        raise ValueError(f"solver must be a GeodesicSolver or HeatMethodSolver of the mesh, not {shown(solver)}")
    if solver.n_vertices != mesh.n_vertices:
        raise ValueError(
            f"solver was made for {solver.n_vertices} vertices, but mesh has {mesh.n_vertices}: pass the mesh it is for"
        )
    return isolines(mesh, solver.distance(sources), radius)[0]


def sublevel_areas(mesh: MeshLike, values: ArrayLike, levels: ArrayLike) -> FloatArray:
    """Area of ``{values < level}`` for each level, for values linear in each triangle.

    Parameters
    ----------
    mesh, values, levels
        As for `isolines`, with the same errors.

    Returns
    -------
    (k,) float64
        Squared units of the mesh; exact to rounding.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(10)
    >>> heat_igl.curves.sublevel_areas(mesh, mesh.V[:, 0], [0.0, 0.25, 2.0]).round(6).tolist()
    [0.0, 0.25, 1.0]
    """
    mesh = as_triangles(mesh, "isolines need")
    checked, wanted = _checked(mesh, values, levels)
    areas = []
    for level in wanted:
        area = np.where((checked[mesh.F] < level).all(axis=1), mesh.measures, 0.0)
        found = crossings(mesh, checked, level)
        corner = found.toward[:, 0] * found.toward[:, 1]
        area[found.faces] = mesh.measures[found.faces] * np.where(found.is_below, corner, 1 - corner)
        areas.append(area.sum())
    return np.array(areas)


def _checked(mesh: Mesh, values: ArrayLike, levels: ArrayLike) -> tuple[FloatArray, FloatArray]:
    array = real_numbers("values", values)
    if array.shape != (mesh.n_vertices,):
        raise ValueError(f"values must have shape ({mesh.n_vertices},), one per vertex, not {array.shape}")
    raise_at_first(np.isnan(array) | (array == -np.inf), "values", array, "must be a number or inf")
    wanted = np.atleast_1d(real_numbers("levels", levels))
    if wanted.ndim != 1 or not np.isfinite(wanted).all():
        raise ValueError(f"levels must be finite numbers in one dimension, not {shown(levels)}")
    return array, wanted
