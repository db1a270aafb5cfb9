"""The operators of point clouds: Sharp and Crane (2020), on triangles that fit together."""

from __future__ import annotations

from heat_igl.errors import MeshError, shown
from heat_igl.mesh import PointCloud
from heat_igl.operators.matrices import Laplacian, OnLaplacian, Operators, check_laplacian
from heat_igl.operators.triangles import operators, tufted_operators


def point_cloud_operators(
    cloud: PointCloud, laplacian: Laplacian = "intrinsic-delaunay", on_laplacian: OnLaplacian | None = None
) -> Operators:
    """The operators of a point cloud: those of `PointCloud.triangles`, made intrinsic Delaunay.

    If the triangles have a boundary, they are glued to a copy of themselves there, to their tufted cover. At the
    boundary of scattered points, triangles are long and thin; on the cover their outer edges are flipped, too.

    Parameters
    ----------
    cloud : PointCloud
        n points.
    laplacian : {"intrinsic-delaunay", "intrinsic-delaunay-refined", "cotan", "auto"}
        As for `operators`; "cotan" keeps the triangles as they are, and "auto" is "intrinsic-delaunay".
    on_laplacian : callable, optional
        Called with L, or a multiple of it, as soon as it is known.

    Raises
    ------
    MeshError
        If `cloud` is none, or no three points are near enough to one another to make a triangle.
    ValueError
        If `laplacian` is neither.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> domain = heat_igl.operators.point_cloud_operators(heat_igl.PointCloud(heat_igl.shapes.icosphere(4).V))
    >>> round(float(domain.M.sum() / (4 * np.pi)), 2)  # the area of the unit sphere
    1.0
    >>> bool(np.allclose(domain.L @ np.ones(domain.n), 0))
    True
    """
    if not isinstance(cloud, PointCloud):
        raise MeshError(f"cloud must be a PointCloud, not {shown(cloud)}: PointCloud(P) makes one of points")
    check_laplacian(laplacian)
    mesh = cloud.triangles
    # The triangles of scattered points are even enough.
    laplacian = "intrinsic-delaunay" if laplacian == "auto" else laplacian
    if laplacian == "intrinsic-delaunay" and mesh.boundary.any():
        return tufted_operators(mesh, (), on_laplacian, laplacian)
    return operators(mesh, laplacian, on_laplacian)
