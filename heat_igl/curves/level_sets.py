"""Isolines of values on a triangle mesh, and the areas that they enclose; offset curves.

Inside a triangle values are linear, so an isoline is a polyline with one segment per triangle. Which triangles it
crosses is decided by comparing values with the level, once per vertex: a vertex on the level counts as above it. All
else follows from the faces, so no rounding can open a loop or draw a segment twice.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from heat_igl.errors import MeshError
from heat_igl.heat_method import HeatMethodSolver
from heat_igl.mesh import Mesh, SurfaceCurve
from heat_igl.sources import Sources
from heat_igl.typing import AnyArray, ArrayLike, BoolArray, FloatArray, IntArray

__all__ = ["enclosed_areas", "isolines", "offset_curves", "sublevel_areas"]


def isolines(mesh: Mesh, values: ArrayLike, levels: ArrayLike) -> list[list[SurfaceCurve]]:
    """The curves on which values, linear in each triangle, equal given levels.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    values : (n,) array_like
        A value per vertex, for instance a distance. Faces with an infinite value are left out, as if they were not
        there.
    levels : float or (k,) array_like
        Levels, in any order.

    Returns
    -------
    list of k lists of SurfaceCurve
        For each level its curves, in the order of their first face. A curve is closed, or it ends on the boundary, at
        an edge of more than two faces, or at a face with an infinite value. Seen from outside (the side from which the
        faces run counter-clockwise), lower values lie on its left; so it does where neighbouring faces agree about
        the outside.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    ValueError
        If a value is NaN or negative infinite, a level is not finite, or an array has the wrong shape.

    Notes
    -----
    The curves of a level are the rim of ``{values < level}``: on a plateau at the level they run along its lower side,
    through a vertex at the level they pass like any other, and around a minimum or maximum at the level there is none.
    This is the convention of libigl's ``isolines``. Lengths are ``curve.lengths(mesh)``.
    """
    checked, wanted = _checked(mesh, values, levels)
    return [_curves(mesh, checked, level) for level in wanted]


def offset_curves(mesh: Mesh, solver: HeatMethodSolver, sources: Sources, radius: float) -> list[SurfaceCurve]:
    """The curves at distance `radius` from `sources` on the surface.

    Parameters
    ----------
    mesh : Mesh
        The triangles that `solver` was made for.
    solver : HeatMethodSolver
        With ``refine="unfold"`` the curves are exact to what a function that is linear in each triangle can follow.
    sources
        Whatever ``solver.distance`` takes.
    radius : float
        Positive, in the mesh's unit. Curves nearer than an edge length are only as round as triangles allow.

    Returns
    -------
    list of SurfaceCurve
        As `isolines` returns them for one level, with the sources on their left; empty where nothing is so far away.

    Raises
    ------
    ValueError
        If `radius` is not a positive number, or the solver belongs to another mesh.
    """
    if not (np.isfinite(radius) and radius > 0):
        raise ValueError(f"radius must be a positive number, not {radius!r}")
    if solver.n_vertices != mesh.n_vertices:
        raise ValueError(
            f"solver was made for {solver.n_vertices} vertices, but mesh has {mesh.n_vertices}: pass the mesh it is for"
        )
    return isolines(mesh, solver.distance(sources), radius)[0]


def sublevel_areas(mesh: Mesh, values: ArrayLike, levels: ArrayLike) -> FloatArray:
    """Area of the part of the surface where values, linear in each triangle, are below each level.

    Parameters
    ----------
    mesh, values, levels
        As for `isolines`, with its errors.

    Returns
    -------
    (k,) float64
        Squared units of the mesh; exact to rounding.
    """
    checked, wanted = _checked(mesh, values, levels)
    return np.array([_areas_below(mesh, checked, level).sum() for level in wanted])


def enclosed_areas(mesh: Mesh, values: ArrayLike, level: float) -> FloatArray:
    """Area of the region below the level that each of its curves borders.

    Parameters
    ----------
    mesh, values, level
        As for `isolines`, with its errors; one level.

    Returns
    -------
    (c,) float64
        For each curve of ``isolines(mesh, values, level)[0]``, the area of that connected part of ``{values < level}``
        which lies on its left. Curves that border the same part, as the two rims of an annulus do, share one value.
    """
    checked, wanted = _checked(mesh, values, level)
    if len(wanted) != 1:
        raise ValueError(f"level must be one number, not {len(wanted)}")
    curves = _curves(mesh, checked, wanted[0])
    below = checked < wanted[0]
    inner = mesh.edges[below[mesh.edges].all(axis=1)]
    graph = sp.coo_array((np.ones(len(inner), np.int8), (inner[:, 0], inner[:, 1])), shape=2 * (mesh.n_vertices,))
    part = csgraph.connected_components(graph, directed=False)[1]
    # The vertices of a face that are below the level are joined by its edges.
    one_below = mesh.F[np.arange(mesh.n_faces), np.argmax(below[mesh.F], axis=1)]
    area = np.bincount(part[one_below], weights=_areas_below(mesh, checked, wanted[0]), minlength=mesh.n_vertices)
    first = np.array([curve.faces[0] for curve in curves], np.int64)
    return np.asarray(area[part[one_below[first]]])


def _checked(mesh: Mesh, values: ArrayLike, levels: ArrayLike) -> tuple[FloatArray, FloatArray]:
    if mesh.is_tetrahedral:
        raise MeshError("isolines need triangles, but the mesh is tetrahedral")
    array = _real("values", values)
    if array.shape != (mesh.n_vertices,):
        raise ValueError(f"values must have shape ({mesh.n_vertices},), one per vertex, not {array.shape}")
    bad = np.isnan(array) | (array == -np.inf)
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(f"values[{first}] is {array[first]} ({int(bad.sum())} of {len(array)} are NaN or -inf)")
    wanted = np.atleast_1d(_real("levels", levels))
    if wanted.ndim != 1 or not np.isfinite(wanted).all():
        raise ValueError(f"levels must be finite numbers in one dimension, not {levels!r}")
    return array, wanted


def _real(name: str, array: ArrayLike) -> FloatArray:
    found: AnyArray = np.asarray(array)
    if found.dtype.kind not in "iuf":
        raise ValueError(f"{name} must be real numbers, not {found.dtype}")
    return found.astype(np.float64)


class _Crossings(NamedTuple):
    """Where a level crosses faces, and edges.

    Attributes
    ----------
    faces : (s,)
        The faces with vertices on both sides.
    apex : (s,)
        The corner that is alone on its side.
    toward : (s, 2)
        How far from the apex to the next corner, and to the one after that, the level lies: 0 to 1.
    is_below : (s,)
        Whether the apex is below the level.
    """

    faces: IntArray
    apex: IntArray
    toward: FloatArray
    is_below: BoolArray


def _crossings(mesh: Mesh, values: FloatArray, level: float) -> _Crossings:
    above = (values >= level)[mesh.F]
    n_above = above.sum(axis=1)
    faces = np.flatnonzero((n_above % 3 != 0) & np.isfinite(values[mesh.F]).all(axis=1))
    is_below = n_above[faces] == 2
    apex = np.argmax(above[faces] != is_below[:, None], axis=1)
    corner = mesh.F[faces, apex]
    toward = np.empty((len(faces), 2))
    for i in (0, 1):
        other = mesh.F[faces, (apex + 1 + i) % 3]
        # The same numbers in both faces of an edge give the same point; halves cannot overflow.
        low, high = np.where(is_below, corner, other), np.where(is_below, other, corner)
        from_low = (level / 2 - values[low] / 2) / (values[high] / 2 - values[low] / 2)
        toward[:, i] = np.where(is_below, from_low, 1 - from_low)
    return _Crossings(faces, apex, toward, is_below)


def _areas_below(mesh: Mesh, values: FloatArray, level: float) -> FloatArray:
    """Area (m,) of the part of each face where values are below the level."""
    area = np.where((values[mesh.F] < level).all(axis=1), mesh.measures, 0.0)
    found = _crossings(mesh, values, level)
    corner = found.toward[:, 0] * found.toward[:, 1]
    area[found.faces] = mesh.measures[found.faces] * np.where(found.is_below, corner, 1 - corner)
    return area


def _curves(mesh: Mesh, values: FloatArray, level: float) -> list[SurfaceCurve]:
    found = _crossings(mesh, values, level)
    count = len(found.faces)
    rows = np.arange(count)
    start, end = np.zeros((count, 3)), np.zeros((count, 3))
    for i, point in ((0, start), (1, end)):
        point[rows, found.apex] = 1 - found.toward[:, i]
        point[rows, (found.apex + 1 + i) % 3] = found.toward[:, i]
    # The edge from the apex to the next corner lies opposite the corner after that, and the other way round. From the
    # first to the second of these the apex is on the left.
    ends = np.stack([mesh.facets.of_face[found.faces, (found.apex + 2 - i) % 3] for i in (0, 1)], axis=1)
    turned = ~found.is_below
    start[turned], end[turned] = end[turned], start[turned]
    ends[turned] = ends[turned, ::-1]
    has_length = (start != end).any(axis=1)

    curves = []
    for chain, is_closed in _chains(ends):
        segment, is_reversed = chain // 2, chain % 2 == 1
        kept = has_length[segment]
        segment, is_reversed = segment[kept], is_reversed[kept, None]
        if len(segment):
            first = np.where(is_reversed, end[segment], start[segment])
            last = np.where(is_reversed, start[segment], end[segment])
            curves.append(SurfaceCurve(found.faces[segment], first, last, is_closed))
    return curves


def _chains(ends: IntArray) -> list[tuple[IntArray, bool]]:
    """Put segments one after the other.

    Parameters
    ----------
    ends : (s, 2) int64
        A label for where each segment begins and ends. Segments are joined where exactly two ends have one label.

    Returns
    -------
    list of (chain, is_closed)
        A chain holds ``2 i`` for segment i, ``2 i + 1`` for segment i from its end to its beginning; the one of them
        with the smallest i runs forward. Chains are sorted by it, and closed ones begin with it.
    """
    order = np.argsort(ends.ravel(), kind="stable")
    label = ends.ravel()[order]
    _, first, count = np.unique(label, return_index=True, return_counts=True)
    pair = first[count == 2]
    joined = np.full(ends.size, -1)
    joined[order[pair]], joined[order[pair + 1]] = order[pair + 1], order[pair]
    partner: list[int] = joined.tolist()

    def follow(oriented: int, stop: int) -> list[int]:
        # An oriented segment begins at the end of that number and ends at the other one of the pair.
        chain = []
        while oriented >= 0:
            chain.append(oriented)
            oriented = partner[oriented ^ 1]
            if oriented == stop:
                break
        return chain

    chains = []
    seen = bytearray(len(ends))
    for i in range(len(ends)):
        if seen[i]:
            continue
        forward = follow(2 * i, 2 * i)
        is_closed = partner[forward[-1] ^ 1] == 2 * i
        before = [] if is_closed else [segment ^ 1 for segment in follow(2 * i + 1, -2)[:0:-1]]
        chain = np.array(before + forward, np.int64)
        for segment in chain.tolist():
            seen[segment // 2] = 1
        chains.append((chain, is_closed))
    return chains
