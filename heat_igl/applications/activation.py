"""Activation times of excitable tissue: distance in the metric of conductivity or of squared velocity."""

from __future__ import annotations

from typing import cast

import numpy as np

from heat_igl.errors import raise_at_first, real_numbers
from heat_igl.geodesic import GeodesicSolver
from heat_igl.mesh import MeshLike, as_simplices
from heat_igl.mesh.surface_points import points_beside
from heat_igl.operators import metric_operators
from heat_igl.operators.metric import check_eigenvalues, symmetric_tensors
from heat_igl.operators.metric_simplices import inverse_root
from heat_igl.sources import OffsetSources, Sources, are_positions, source_set
from heat_igl.typing import ArrayLike, FloatArray


def activation_times(mesh: MeshLike, D: ArrayLike, sites: Sources, times: ArrayLike = 0) -> FloatArray:
    """When a wave that starts at the sites arrives at each vertex: sqrt(grad T . D grad T) = 1.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra.
    D : (3, 3), (m, 3, 3) or (n, 3, 3) array_like
        Symmetric and positive definite: everywhere, on each face, or at each vertex. Its eigenvectors are the axes of
        the tissue, and its eigenvalues the squared velocities along them. With velocities v, fibres f and sheets s, it
        is the inverse of ``fibre_metric(f, 1 / v[0], 1 / v[1], sheets=s, normal=1 / v[2])``.
    sites : sources
        Where the wave starts, as for `geodesic_distance`; on tetrahedra, vertices.
    times : float or (k,) array_like
        When it starts: everywhere, or at each site. May be negative.

    Returns
    -------
    (n,) float64
        ``inf`` at vertices that no wave reaches. A site that another wave reaches before its time has that time.

    Raises
    ------
    ValueError
        If `D` or `times` has another shape or is not finite, or `D` is not symmetric and positive definite.
    SourceError
        If `sites` does not describe places on the mesh.
    MeshError
        If a face has no area or volume.

    Notes
    -----
    Distance with the metric of the inverse of D, see `metric_operators`. D at the vertices is that of a smooth field,
    and times are then of second order.

    Examples
    --------
    A bar in which velocity is 2 along x, and 1 across:

    >>> import numpy as np
    >>> import heat_igl
    >>> bar = heat_igl.shapes.box(4)
    >>> T = heat_igl.activation_times(bar, np.diag([4.0, 1.0, 1.0]), [0], times=-0.25)
    >>> bool(np.allclose(T, np.linalg.norm(bar.V * [0.5, 1, 1], axis=1) - 0.25))
    True
    """
    simplices = as_simplices(mesh)
    D = real_numbers("D", D, refused="bcmMSU")
    m, n = simplices.n_faces, simplices.n_vertices
    each = D[None] if D.shape == (3, 3) else D
    if D.shape not in ((3, 3), (m, 3, 3), (n, 3, 3)):
        raise ValueError(f"D must have shape (3, 3), {(m, 3, 3)} per face or {(n, 3, 3)} per vertex, not {D.shape}")
    check_eigenvalues("D", inverse_root(symmetric_tensors("D", each))[2][:, 0], each)
    start = real_numbers("times", times)
    first_time = start.min(initial=np.inf, where=np.isfinite(start))
    with np.errstate(over="ignore", invalid="ignore"):
        after = start - first_time
    wrong = ~np.isfinite(after.ravel())
    raise_at_first(wrong, "times", start.ravel(), "must be finite, also after the first", "leave out its site")
    if are_positions(sites) and not simplices.is_tetrahedral:
        sites = points_beside(simplices, cast(ArrayLike, sites), "sites")
    # Wrong sites are named before anything is prepared.
    k = source_set(sites, n, None if simplices.is_tetrahedral else simplices.F, name="sites").n_labels
    if start.shape not in ((), (k,)):
        raise ValueError(f"times must be one number, or {k}, one for each of the sites, not of shape {start.shape}")
    inverse = np.linalg.inv(each)
    inverse = np.broadcast_to((inverse + np.swapaxes(inverse, 1, 2)) / 2, (m if D.ndim == 2 else len(D), 3, 3))
    solver = GeodesicSolver(metric_operators(simplices, inverse))
    return np.asarray(solver.distance(OffsetSources(sites, after)) + first_time)
