"""Solvers of the eikonal equation: fast marching on meshes and grids, fast sweeping on grids.

They solve ``|grad d| = 1``, equation (3) of the paper, anew for every source set, without precomputation.
"""

from __future__ import annotations

from itertools import product
from typing import Any, Literal

import numpy as np

from heat_igl.errors import MissingExtraError, ReferenceSolverError
from heat_igl.mesh import MeshLike
from heat_igl.reference.baselines.grids import grid_domain, grid_sources, grid_spacing
from heat_igl.reference.measurement import measured
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray


def fast_marching(mesh: MeshLike, sources: Sources) -> FloatArray:
    """Fast marching on a triangle mesh (Kimmel and Sethian 1998), by potpourri3d.

    Parameters
    ----------
    mesh : mesh
        A manifold triangle mesh, with or without boundary.
    sources : int, sequence of int, or (n,) mask of bool
        Source vertices.

    Returns
    -------
    (n,) float64
        Distance as computed by potpourri3d, but 0 at the sources and ``inf`` at unreachable vertices.

    Raises
    ------
    SourceError
        If the sources are not vertices of the mesh.
    ReferenceSolverError
        If the mesh is tetrahedral or not manifold, or if the values that potpourri3d returns cannot be distances.
    MissingExtraError
        If potpourri3d is not installed.
    """
    distance = measured("potpourri3d_marching", mesh, sources).distance
    distance[vertex_sources(sources, len(distance))] = 0.0
    if (distance < 0).any():
        raise ReferenceSolverError("potpourri3d returned what is no distance: look for slivers with mesh.report()")
    return distance


def fast_marching_grid(
    sources: ArrayLike, spacing: ArrayLike = 1.0, *, domain: ArrayLike | None = None, order: Literal[1, 2] = 2
) -> FloatArray:
    """Fast marching on a grid (Sethian 1996; second order: Sethian 1999), by scikit-fmm.

    Parameters
    ----------
    sources : (n_0, ..., n_d) array_like of bool
        Marks the points from which distance is measured.
    spacing : float or (d,) array_like
        Step of the grid along each axis.
    domain : (n_0, ..., n_d) array_like of bool, optional
        The points that paths may use; all points by default.
    order : {2, 1}
        Order of the upwind differences. If two sources are adjacent along an axis, first order is used: second-order
        differences would treat both zeros as values of one smooth front and return 2/3 of a step beside them.

    Returns
    -------
    (n_0, ..., n_d) float64
        Distance; ``inf`` outside the domain and at unreachable points.

    Raises
    ------
    SourceError
        If there is no source, one lies outside the domain, or `sources` is not boolean.
    ValueError
        If `spacing`, `domain` or `order` is invalid.
    MissingExtraError
        If scikit-fmm is not installed.
    """
    mask = grid_sources(sources)
    steps = grid_spacing(spacing, mask.ndim)
    inside = grid_domain(domain, mask)
    if order not in (1, 2):
        raise ValueError(f"order must be 1 or 2, not {order!r}")
    with MissingExtraError.guard("fast marching on grids", "scikit-fmm", "bench"):
        import skfmm
    level: Any = np.ma.masked_array(np.where(mask, 0.0, 1.0), ~inside)  # type: ignore[no-untyped-call,unused-ignore]
    aligned = [np.moveaxis(mask, axis, 0) for axis in range(mask.ndim)]
    touching = any((lines[1:] & lines[:-1]).any() for lines in aligned)
    found = skfmm.distance(level, dx=steps, order=1 if touching else order)
    filled: Any = getattr(found, "filled", None)  # a masked array if something is out of reach, else a plain one
    return np.asarray(found if filled is None else filled(np.inf), np.float64)


def fast_sweeping(sources: ArrayLike, spacing: ArrayLike = 1.0, *, domain: ArrayLike | None = None) -> FloatArray:
    """Fast sweeping on a grid (Zhao 2005): Gauss-Seidel sweeps along all diagonals until no value changes.

    Each update solves Godunov's upwind difference for ``|grad d| = 1`` (Zhao, section 2) with the smaller neighbour
    along each axis. The scheme is of first order; the error near point sources is of the order of h log(1 / h).

    Parameters
    ----------
    sources, spacing, domain
        As for `fast_marching_grid`.

    Returns
    -------
    (n_0, ..., n_d) float64
        Distance, as from `fast_marching_grid`.

    Raises
    ------
    SourceError, ValueError
        As for `fast_marching_grid`.

    Notes
    -----
    Points on a plane i + j + ... = const do not depend on each other. A sweep therefore updates one plane at a time
    (Detrixhe, Gibou, Min 2013), with the same result as one point at a time.
    """
    mask = grid_sources(sources)
    steps = grid_spacing(spacing, mask.ndim)
    inside = grid_domain(domain, mask)
    # With a border of inf no update needs to test for the boundary of the grid.
    d = np.full([n + 2 for n in mask.shape], np.inf)
    d[tuple(slice(1, -1) for _ in mask.shape)][mask] = 0.0
    flat = d.ravel()
    strides = np.array(d.strides) // d.itemsize
    sweeps = list(_sweeps(inside & ~mask, strides))
    changed = True
    while changed:
        changed = False
        for points in (plane for planes in sweeps for plane in planes):
            lowest = np.stack([np.minimum(flat[points - stride], flat[points + stride]) for stride in strides])
            better = np.minimum(_godunov(lowest, steps), flat[points])
            changed |= bool((better < flat[points]).any())
            flat[points] = better
    return np.ascontiguousarray(d[tuple(slice(1, -1) for _ in mask.shape)])


def _sweeps(unknown: BoolArray, strides: IntArray) -> list[list[IntArray]]:
    """For every diagonal direction the planes in order, as flat indices into the grid with a border."""
    place = np.argwhere(unknown)
    index = (place + 1) @ strides
    sweeps = []
    for directions in product((1, -1), repeat=unknown.ndim):
        plane = place @ np.array(directions)
        order = np.argsort(plane, kind="stable")
        sweeps.append(np.split(index[order], np.flatnonzero(np.diff(plane[order])) + 1))
    return sweeps


def _godunov(neighbours: FloatArray, steps: FloatArray) -> FloatArray:
    """The x with ``sum over axes of (max(x - a, 0) / h)^2 = 1``, for neighbours a (d, k) and steps h (d,)."""
    order = np.argsort(neighbours, axis=0, kind="stable")
    a = np.take_along_axis(neighbours, order, 0)
    h = steps[order]
    with np.errstate(invalid="ignore"):
        above = a - a[0]  # relative to the smallest neighbour; otherwise digits cancel far from the source
    x = h[0].copy()
    weight, first, second = h[0] ** -2, np.zeros_like(x), np.full_like(x, -1.0)
    for axis in range(1, len(a)):
        # An axis contributes only if the solution without it exceeds the neighbour; inf and nan never contribute.
        part = x > above[axis]
        w, y = h[axis, part] ** -2, above[axis, part]
        weight[part] += w
        first[part] += w * y
        second[part] += w * y**2
        root = first[part] ** 2 - weight[part] * second[part]
        x[part] = (first[part] + np.sqrt(root)) / weight[part]
    return np.asarray(a[0] + x)
