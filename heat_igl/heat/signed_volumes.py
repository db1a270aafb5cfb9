"""Signed distance in space from a surface with holes, on a regular grid and on tetrahedra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from heat_igl.errors import MeshError, SourceError, is_number, positive, real_numbers, shown
from heat_igl.mesh import Mesh, MeshLike, PointCloud, as_mesh, as_simplices
from heat_igl.operators import Operators, operators
from heat_igl.runtime import LOWEST_HEAT, SOURCE_HEAT
from heat_igl.steps import HeatFlow, PoissonProblem, smallest_time_step
from heat_igl.typing import FloatArray, IntArray

# Each time step of a grid is this times the one before. It gives the directions at points that have less heat than this
# share of the largest, since transforms in double precision leave few digits of it there.
_NEXT_STEP = 4.0
_LOST = 1e-10
# A box with more points is a mistake in the unit: 8e9 bytes for each number that is stored at every point.
_MOST_POINTS = 1e9


@dataclass(frozen=True)
class VoxelBox:
    """A regular grid of points in space.

    Parameters
    ----------
    origin : (3,) sequence of float
        The first point.
    spacing : float
        Distance of neighbours, the same along all axes.
    shape : (3,) sequence of int
        Number of points along x, y and z, at least two.

    Raises
    ------
    ValueError
        If a parameter is none of these.

    Examples
    --------
    >>> import heat_igl
    >>> box = heat_igl.VoxelBox(origin=(0, 0, 0), spacing=0.5, shape=(3, 3, 2))
    >>> box.positions()[2, 2, 1].tolist()
    [1.0, 1.0, 0.5]
    """

    origin: Sequence[float]
    spacing: float
    shape: Sequence[int]

    def __post_init__(self) -> None:
        origin, shape = real_numbers("origin", self.origin), real_numbers("shape", self.shape)
        if origin.shape != (3,) or not np.isfinite(origin).all():
            raise ValueError(f"origin must be three finite numbers, not {shown(self.origin)}")
        if shape.shape != (3,) or not (np.isfinite(shape) & (shape >= 2) & (shape % 1 == 0)).all():
            raise ValueError(f"shape must be three whole numbers of at least 2, not {shown(self.shape)}")
        if shape.prod() > _MOST_POINTS:
            raise ValueError(f"shape = {shown(self.shape)} has over {_MOST_POINTS:.0e} points: make spacing larger")
        object.__setattr__(self, "origin", tuple(origin.tolist()))
        object.__setattr__(self, "spacing", positive("spacing", self.spacing))
        object.__setattr__(self, "shape", tuple(int(number) for number in shape))

    @classmethod
    def around(cls, mesh: MeshLike, points: int, margin: float = 0.2) -> VoxelBox:
        """A box around a mesh: `points` along its longest side, and a share `margin` of that side beyond each end."""
        if not is_number(points) or not 2 <= points < np.inf:
            raise ValueError(f"points must be a whole number of at least 2, not {shown(points)}")
        if not is_number(margin) or not 0 <= margin < np.inf:
            raise ValueError(f"margin must be a number of at least 0, not {shown(margin)}")
        V = as_mesh(mesh).V
        low, size = V.min(axis=0), np.ptp(V, axis=0)
        outside = margin * size.max()
        spacing = float(size.max() + 2 * outside) / (points - 1)
        shape = [int(np.ceil((side + 2 * outside) / spacing)) + 1 for side in size]
        return cls((low - outside).tolist(), spacing, shape)

    def positions(self) -> FloatArray:
        """The points (nx, ny, nz, 3)."""
        return np.asarray(self.origin + self.spacing * np.moveaxis(np.indices(self.shape), 0, -1))


class _Samples(NamedTuple):
    """Points (q, 3) on a surface, their unit normals (q, 3), and the area (q,) that each stands for."""

    points: FloatArray
    normals: FloatArray
    areas: FloatArray


def volume_signed_distance(domain: MeshLike | VoxelBox, surface: MeshLike, *, t_coef: float = 1.0) -> FloatArray:
    """Distance in space from a surface, negative on the side that its normals point away from.

    The signed heat method (Feng and Crane 2024) in a volume: the surface may have holes, and need not be manifold. The
    inside is negative if faces are counter-clockwise seen from outside.

    Parameters
    ----------
    domain : mesh or VoxelBox
        Tetrahedra, or a regular grid. It has to contain the surface.
    surface : mesh
        Triangles, or a `PointCloud` with normals.
    t_coef : float
        Time step, in squared mean edge lengths or spacings. Larger values close wide holes with rounder surfaces.

    Returns
    -------
    (n,) or (nx, ny, nz) float64
        At the vertices of the tetrahedra, or the points of the grid. ``inf`` in components of the tetrahedra without a
        part of the surface.

    Raises
    ------
    MeshError
        If `domain` is neither, or a mesh cannot be used.
    SourceError
        If the surface has no area, leaves the domain, or is a point cloud without normals.
    ValueError
        If `t_coef` is not positive.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> box = heat_igl.VoxelBox(origin=(-1.5, -1.5, -1.5), spacing=0.1, shape=(31, 31, 31))
    >>> phi = heat_igl.volume_signed_distance(box, heat_igl.shapes.icosphere(3))
    >>> inside = (phi < 0).sum() * box.spacing**3
    >>> round(float(inside / (4 / 3 * np.pi)), 1)  # the volume of the unit ball
    1.0
    """
    coefficient = positive("t_coef", t_coef)
    if isinstance(domain, VoxelBox):
        return _on_grid(domain, _sampled(surface, domain.spacing / 2), coefficient)
    tetrahedra = as_simplices(domain)
    if not tetrahedra.is_tetrahedral:
        raise MeshError("domain must be tetrahedra or a VoxelBox, not triangles: on these, take SignedHeatSolver")
    solved_on = operators(tetrahedra)
    samples = _sampled(surface, solved_on.mean_edge_length / 2)
    return _on_tetrahedra(tetrahedra, solved_on, samples, coefficient)


def _sampled(surface: MeshLike, spacing: float) -> _Samples:
    """Points on a surface, at most about `spacing` apart; those of a point cloud as they are."""
    found = as_mesh(surface)
    if isinstance(found, PointCloud):
        if found.normals is None:
            raise SourceError(
                "surface is a point cloud without normals, which has no sides: give PointCloud(P, normals)"
            )
        length = np.linalg.norm(found.normals, axis=1, keepdims=True)
        return _Samples(found.V, found.normals / length, np.ones(len(found.V)))
    mesh = as_simplices(found)
    if mesh.is_tetrahedral:
        raise SourceError("surface must be triangles or points with normals, not tetrahedra")
    corners = mesh.V[mesh.F]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1) / 2
    if not area.any():
        raise SourceError("surface has no area, and so no normals")
    kept = area > 0
    corners, normals, area = corners[kept], normals[kept] / (2 * area[kept])[:, None], area[kept]
    longest = np.max([np.linalg.norm(corners[:, i] - corners[:, i - 1], axis=1) for i in range(3)], axis=0)
    count = np.maximum(np.ceil(longest / spacing), 1)
    if (count**2).sum() > _MOST_POINTS:
        raise SourceError(
            f"surface is too large for the domain: the longest edge is {longest.max():.4g}, and points are "
            f"{spacing:.4g} apart"
        )
    count = count.astype(np.int64)
    parts = []
    for k in np.unique(count):
        chosen = np.flatnonzero(count == k)
        weights = _centroids(int(k))
        points = np.einsum("pc,fcx->fpx", weights, corners[chosen]).reshape(-1, 3)
        each = np.repeat(chosen, k * k)
        parts.append((points, normals[each], area[each] / (k * k)))
    return _Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _centroids(k: int) -> FloatArray:
    """Barycentric coordinates (k^2, 3) of the centroids of the k^2 equal parts of a triangle."""
    i, j = (index.ravel() for index in np.indices((k, k)))
    upright = i + j < k
    inverted = i + j < k - 1
    first = np.concatenate([i[upright] + 1 / 3, i[inverted] + 2 / 3]) / k
    second = np.concatenate([j[upright] + 1 / 3, j[inverted] + 2 / 3]) / k
    return np.stack([first, second, 1 - first - second], axis=1)


def _on_tetrahedra(mesh: Mesh, domain: Operators, samples: _Samples, t_coef: float) -> FloatArray:
    """The distance at the vertices (n,) of tetrahedra; each sample counts at the nearest vertex."""
    from scipy.spatial import cKDTree  # takes as long to import as the rest of the package

    used = np.flatnonzero(mesh.referenced)
    gap, nearest = cKDTree(mesh.V[used]).query(samples.points)
    vertex = used[nearest]
    longest = float(domain.face_sizes.max())
    if gap.max() > longest:
        first = int(gap.argmax())
        raise SourceError(
            f"the surface leaves the tetrahedra: {samples.points[first].tolist()} is {gap[first]:.4g} from the nearest "
            f"vertex, more than the longest edge, {longest:.4g}"
        )
    b = np.zeros((mesh.n_vertices, 3))
    np.add.at(b, vertex, samples.areas[:, None] * samples.normals)
    t = max(t_coef * domain.mean_edge_length**2, smallest_time_step(domain))
    Y = HeatFlow(domain, t).solve(b * (SOURCE_HEAT / np.abs(b).max()))
    of_faces = Y[mesh.F]
    # The largest component is divided out first, which keeps squares in range.
    size = np.abs(of_faces).max(axis=(1, 2), keepdims=True)
    X = np.divide(of_faces, size, out=np.zeros_like(of_faces), where=size > LOWEST_HEAT).sum(axis=1)
    phi = PoissonProblem(domain).solve(domain.D @ _unit(X).T.ravel())
    # From the nearest vertex to the sample, along its normal.
    value = phi[vertex] + np.einsum("qx,qx->q", samples.normals, samples.points - mesh.V[vertex])
    component, n_components = domain.components, domain.n_components
    weight = np.bincount(component[vertex], samples.areas, n_components)
    total = np.bincount(component[vertex], samples.areas * value, n_components)
    mean = np.divide(total, weight, out=np.full(n_components, -np.inf), where=weight > 0)
    return np.asarray(phi - mean[component])


def _on_grid(box: VoxelBox, samples: _Samples, t_coef: float) -> FloatArray:
    """The distance at the points (nx, ny, nz) of a grid, by cosine transforms.

    The grid is insulated. Heat on its faces is then twice that without faces, and has the same direction.
    """
    from scipy.fft import dctn, idctn  # takes as long to import as the rest of the package

    corner, weight = _trilinear(box, samples.points)
    size = int(np.prod(box.shape))
    b = np.stack(
        [
            np.bincount(
                corner.ravel(), (weight * (samples.areas * samples.normals[:, k])[:, None]).ravel(), size
            ).reshape(box.shape)
            for k in range(3)
        ]
    )
    axes = (0, 1, 2)
    along = [2 - 2 * np.cos(np.pi * np.arange(n) / n) for n in box.shape]
    eigenvalues = along[0][:, None, None] + along[1][None, :, None] + along[2][None, None, :]
    spectrum = [dctn(part, axes=axes, norm="ortho") for part in b]
    X = np.zeros_like(b)
    is_left = np.ones(box.shape, bool)
    t = t_coef
    # In units of the spacing: (1 - t Laplace) Y = b, at steps that grow until every point has a direction.
    while is_left.any():
        Y = np.stack([idctn(part / (1 + t * eigenvalues), axes=axes, norm="ortho") for part in spectrum])
        length = np.sqrt((Y**2).sum(axis=0))
        reached = is_left & (length > _LOST * length.max())
        if t > max(box.shape) ** 2:
            reached = is_left
        X[:, reached] = Y[:, reached] / np.maximum(length[reached], np.finfo(float).tiny)
        is_left &= ~reached
        t *= _NEXT_STEP
    divergence = np.zeros(box.shape)
    for k in axes:
        # The mean of both ends flows along each edge, out of the one and into the other.
        component = np.moveaxis(X[k], k, 0)
        flux = (component[1:] + component[:-1]) / 2
        into = np.moveaxis(divergence, k, 0)
        into[:-1] += flux
        into[1:] -= flux
    eigenvalues[0, 0, 0] = 1
    spectrum_of_phi = -dctn(divergence, norm="ortho") / eigenvalues
    spectrum_of_phi[0, 0, 0] = 0
    phi = box.spacing * idctn(spectrum_of_phi, norm="ortho")
    value = np.einsum("qc,qc->q", weight, phi.ravel()[corner])
    return np.asarray(phi - np.average(value, weights=samples.areas))


def _trilinear(box: VoxelBox, points: FloatArray) -> tuple[IntArray, FloatArray]:
    """The eight points of the grid around each point (q, 8), and their weights (q, 8)."""
    at = (points - np.array(box.origin)) / box.spacing
    last = np.array(box.shape) - 1
    outside = ((at < -1e-9) | (at > last + 1e-9)).any(axis=1)
    if outside.any():
        first = int(np.argmax(outside))
        raise SourceError(
            f"the surface leaves the box at {points[first].tolist()}: it reaches from {list(box.origin)} to "
            f"{(np.array(box.origin) + box.spacing * last).tolist()}; VoxelBox.around(surface, n) encloses it"
        )
    cell = np.clip(np.floor(at).astype(np.int64), 0, last - 1)
    share = at - cell
    steps = np.moveaxis(np.indices((2, 2, 2)), 0, -1).reshape(8, 3)
    corner = np.moveaxis(cell[:, None] + steps, -1, 0)
    weight = np.where(steps == 1, share[:, None], 1 - share[:, None]).prod(axis=2)
    return np.ravel_multi_index(tuple(corner), tuple(box.shape)), weight


def _unit(vectors: FloatArray) -> FloatArray:
    """Vectors (m, 3) divided by their lengths; 0 stays."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0))
