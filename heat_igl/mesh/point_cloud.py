"""Point clouds, validated on construction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from heat_igl.errors import AccuracyWarning, MeshError, as_array, raise_at_first
from heat_igl.mesh.connectivity import first_copies
from heat_igl.mesh.mesh import Mesh, checked_positions
from heat_igl.mesh.report import CloudReport
from heat_igl.runtime import warn_caller
from heat_igl.typing import ArrayLike, BoolArray, FloatArray, IntArray

# Points lie on a line if their root mean square distance from it is at most this fraction of that along it. At a
# million extents from the origin, rounding of coordinates is a tenth of it.
_ON_A_LINE = 1e-9
# Squared mean over mean square of deviations: at most 3 / 4, that of a uniform one, for noise of any distribution with
# one maximum and two like sides (a Gaussian has 2 / pi), and 1 for two sheets; two planes and shells .3 to 1.3 spacings
# apart have .84 to .97.
_NO_NOISE = 0.8
# Noise of standard deviation s along the surface, of both ends, changes a distance by 2 s / sqrt(pi) in the mean, and
# the mean of 1 / distance is 2 sqrt(pi) over the root of the area, as in a disc: the product is the mean error.
_ERROR_OF_NOISE = 4.0
# Clouds with a larger one warn, whose distances are wrong by more than a twentieth: the estimate is right to a third.
_LARGE_ERROR = 0.05
# Share of doubtful points, without those at folds, or of points outside of the largest part, above which clouds warn,
# and degrees between triangles and the planes of their corners. Of 166 random clouds that are wrong by more than 5 %
# .80 are said, and 20 of 305 below 2 %; with .85 of both .82 and 35, with 1.2 times both .69 and 5.
_MOST_DOUBTFUL, _MOST_TILTED = 0.03, 27.0
# Points on both sides of a gap that is bridged, in roots of the number of points, above which clouds warn: a slot of
# .8 of the side of a square has 1, 183 clouds of scans and models that are right within 5 % have up to .27.
_LONG_GAP = 0.35


@dataclass(frozen=True, eq=False, repr=False)
class PointCloud:
    """Points on a surface, without faces.

    Parameters
    ----------
    P : (n, 3) array_like of real numbers
        Positions, in any unit of length; copied to float64. At least four, not all on a line.
    normals : (n, 3) array_like of real numbers, optional
        A normal for each point, of any length but 0, all pointing to the same side of the surface. They define the
        tangent planes, and separate sheets that nearly touch: neighbours with opposite normals are ignored. Normals of
        points and patches that contradict their neighbours are flipped internally (the attribute `normals` is not).
        Planes are fitted to the neighbours if there are no normals, and, with an `AccuracyWarning`, if they cannot be
        made consistent.

    Attributes
    ----------
    P : (n, 3) float64
        Positions.
    normals : (n, 3) float64 or None
        Normals of length 1.

    Raises
    ------
    MeshError
        If an array has the wrong shape or type, an entry is not finite, a normal has length 0, or the points lie on a
        line. The message names the first offender and counts them.

    Notes
    -----
    Copies of a point are kept: they are at distance 0 from each other. A point whose distance from all others is larger
    than the gaps that are filled is an outlier: it belongs to no triangle, and the distance there is ``inf``. If the
    points are noisy, distance is measured on a smooth surface through them, see `triangles`. Arrays are read-only.

    Examples
    --------
    >>> import numpy as np
    >>> from heat_igl import HeatMethodSolver, PointCloud
    >>> P = np.random.default_rng(0).standard_normal((2000, 3))
    >>> P /= np.linalg.norm(P, axis=1, keepdims=True)  # on the unit sphere, on which distance is an angle
    >>> phi = HeatMethodSolver(PointCloud(P)).distance(0)
    >>> bool(abs(phi - np.arccos(np.clip(P @ P[0], -1, 1))).mean() < 0.02 * np.pi)
    True
    """

    P: FloatArray
    normals: FloatArray | None

    def __init__(self, P: ArrayLike, normals: ArrayLike | None = None) -> None:
        try:
            positions = checked_positions(P)
        except MeshError as error:
            raise MeshError(str(error).replace("V", "P", 1).replace("vertices", "points") + _remedy(P)) from None
        _check_extent(positions)
        directions = None if normals is None else _checked_normals(normals, len(positions))
        for array in (positions, directions):
            if array is not None:
                array.setflags(write=False)
        vars(self).update(P=positions, normals=directions)

    def __repr__(self) -> str:
        return f"PointCloud({self.n_vertices} points{'' if self.normals is None else ' with normals'})"

    def __reduce__(self) -> tuple[type[PointCloud], tuple[FloatArray, FloatArray | None]]:
        return PointCloud, (self.P, self.normals)

    @property
    def n_vertices(self) -> int:
        """Number of points n."""
        return len(self.P)

    @property
    def n_faces(self) -> int:
        """Number of `triangles`."""
        return self.triangles.n_faces

    @property
    def V(self) -> FloatArray:
        """The positions (n, 3), under the name that they have in a mesh."""
        return self.P

    @property
    def F(self) -> IntArray:
        """The faces (m, 3) of `triangles`."""
        return self.triangles.F

    @cached_property
    def originals(self) -> IntArray:
        """For each point (n,), the index of the first point with the same coordinates."""
        distinct, original = self._distinct
        return distinct[original]

    @cached_property
    def _distinct(self) -> tuple[IntArray, IntArray]:
        """The first index of each of the k distinct points, and for each point (n,) which of them it equals."""
        P, original = self.P, np.arange(len(self.P))
        # Copies have the same sum, whatever the factors.
        total = P[:, 0] + np.sqrt(2) * P[:, 1] + np.sqrt(3) * P[:, 2]
        if len(np.unique(total)) == len(total):
            return original, original
        return np.unique(first_copies(P), return_inverse=True)

    @property
    def has_copies(self) -> bool:
        """Whether two of the points are equal."""
        return len(self._distinct[0]) < len(self.P)

    @property
    def triangles(self) -> Mesh:
        """The surface on which distance is measured: a mesh whose vertices are the points, with a boundary or without.

        Of points with the same coordinates, the first alone is a corner of triangles; the others get its values, see
        `Mesh.originals`.

        They are Delaunay in the tangent planes of their corners; an edge has at most two of them. The vertices
        are `P`, unless the points of a part are noisy: if at half of them the neighbours deviate from a quadric by
        more than 1 / 20 of their spacing, and that is not detail, all are moved onto such quadrics. Neighbours are
        oriented alike as far as the surface allows it, and like the normals if there are any.

        Raises
        ------
        MeshError
            If no three points are near enough to one another to make a triangle.

        Warns
        -----
        AccuracyWarning
            If normals are left out; if the points do not tell their surface or fall into parts, see `CloudReport`; if
            noise makes distance wrong by more than 5 % in the mean; or if without normals two sheets that are nearer
            than the points in them are taken for one with noise.
        """
        return self._made[0]

    @cached_property
    def _made(self) -> tuple[Mesh, IntArray, float]:
        """The triangles, the points (k,) at which these contradict each other or may be torn, and their tilt."""
        from heat_igl.mesh.cloud_normals import oriented_normals
        from heat_igl.mesh.cloud_orientation import oriented
        from heat_igl.mesh.cloud_triangles import cloud_triangles, tilt, with_gaps_closed
        from heat_igl.mesh.neighbourhoods import neighbourhoods, point_tree, without_noise

        # Copies of a point would compete for the same triangles.
        distinct, original = self._distinct
        # From here to the triangles, points are numbered by the tree, in which neighbours are near in memory.
        tree = point_tree(self.P[distinct])
        number = distinct[tree.order]
        normals, has_side = oriented_normals(tree, None if self.normals is None else self.normals[number])
        given, tree = tree, without_noise(tree)
        near = neighbourhoods(tree, normals)
        triangles = cloud_triangles(tree.P, near, has_side)
        if not len(triangles):
            raise MeshError(
                "no three points of P are neighbours on a surface: the points are too few or too unevenly spaced"
            )
        F, between = oriented(tree.P, triangles, normals)
        F, beside, apart, along_one, is_far = with_gaps_closed(tree, F, near)
        tilted = tilt(tree.P, F, near)
        V = np.empty_like(self.P)
        V[number] = tree.P
        found = Mesh(V[distinct[original]], number[F]).with_originals(distinct[original])
        if tree is not given:
            area = np.bincount(given.parts[F[:, 0]], found.measures, given.parts.max() + 1)
            for part in np.unique(given.parts[(tree.P != given.P).any(axis=1)]):
                way = np.linalg.norm(tree.P - given.P, axis=1)[given.parts == part]
                _warn_of_noise(way, normals is None, float(area[part]))
        doubtful = number[np.union1d(between, beside)]
        is_wrong = is_far or along_one > _LONG_GAP * np.sqrt(len(self.P))
        if is_wrong or len(doubtful) > _MOST_DOUBTFUL * len(self.P) or tilted > _MOST_TILTED:
            warn_caller(
                f"the points do not tell their surface: at {len(doubtful)} of {len(self.P)}, among "
                "PointCloud.report().doubtful_points, triangles contradict each other's sides, lie on each other, "
                "bridge a gap or end beside another sheet, as where a part is thin or walls have points at their edges "
                f"alone, and they tilt by {tilted:.0f} degrees against the planes of their corners, above "
                f"{_MOST_TILTED:.0f} where the surface bends from point to point. Parts may be joined or cut off, and "
                "distance may be far off: give the mesh, more points, or normals",
                AccuracyWarning,
            )
        if len(apart) > _MOST_DOUBTFUL * len(self.P):
            cut_off = int(_outside_largest(found.components)[number].sum())
            warn_caller(
                f"the points are in several parts: triangles join {len(apart)} of {len(self.P)} points to none in the "
                f"largest. From there, distance is inf at {cut_off} of them, see PointCloud.report().cut_off_points, "
                "and the others are put into the nearest triangle. If they belong to one surface, give the mesh or "
                "more points between the parts",
                AccuracyWarning,
            )
        return found, doubtful, tilted

    @cached_property
    def cover(self) -> Mesh | None:
        """Both sides of `triangles` where these are no oriented manifold, see `two_sided_cover`; else None.

        Tangent vectors, and what follows them, live on it.
        """
        from heat_igl.mesh.cloud_orientation import two_sided_cover

        surface, n = self.triangles, len(self.P)
        cover = two_sided_cover(surface)
        if cover is None:
            return None
        originals = np.arange(cover.n_vertices)
        originals[: 2 * n] = np.concatenate([surface.originals, surface.originals + n])
        return cover.with_originals(originals)

    @property
    def components(self) -> IntArray:
        """Component label (n,) of each point; a point in no triangle is a component of its own."""
        return self.triangles.components[self.originals]

    @property
    def boundary(self) -> BoolArray:
        """Which points (n,) lie on the boundary of `triangles`."""
        return self.triangles.boundary[self.originals]

    def with_vertices(self, P: ArrayLike) -> PointCloud:
        """A cloud of as many points at other positions, without normals: they would not be those of the new surface."""
        moved = PointCloud(P)
        if moved.n_vertices != self.n_vertices:
            raise MeshError(f"P has {moved.n_vertices} rows, but the cloud has {self.n_vertices} points")
        return moved

    def report(self) -> CloudReport:
        """What the points tell: components, border, points left out, and where sheets may be joined wrongly."""
        from heat_igl.mesh.cloud_orientation import folded_points

        moved = self.triangles.V - self.P
        return CloudReport(
            **vars(self.triangles.report()),
            boundary_points=np.flatnonzero(self.boundary),
            cut_off_points=np.flatnonzero(_outside_largest(self.triangles.components)[self.originals]),
            doubtful_points=np.union1d(self._made[1], folded_points(self.triangles)),
            n_copies=self.n_vertices - len(self._distinct[0]),
            noise=float(np.sqrt(np.square(moved).sum(axis=1).mean())),
            tilt=self._made[2],
        )


def _outside_largest(component: IntArray) -> BoolArray:
    """Which points (n,) are not in the component that has most of them."""
    return np.asarray(component != np.argmax(np.bincount(component)))


def _remedy(P: object) -> str:
    """The end of an error of positions: how points without coordinates are left out, or what takes other objects."""
    if not isinstance(P, (np.ndarray, list, tuple)):
        return "; as_mesh takes files and clouds of other libraries"
    if isinstance(P, np.ndarray) and P.dtype.kind == "f" and P.ndim == 2 and not np.isfinite(P).all():
        return ": P[numpy.isfinite(P).all(axis=1)] are the others"
    return ""


def _check_extent(P: FloatArray) -> None:
    if len(P) < 4:
        raise MeshError(f"P has {len(P)} points: a surface needs four or more")
    with np.errstate(over="ignore"):
        extent = np.abs(P - P[0]).max()
    if extent == 0:
        raise MeshError(f"all {len(P)} points in P are equal: there is no distance to measure")
    if not 1e-60 < extent < 1e60:
        raise MeshError(f"P spans {extent:.3g} units, outside what areas in double precision allow: rescale P")
    centred = (P - P[0]) / extent
    centred -= centred.mean(axis=0)
    # Variances, squares of the singular values, are found in less time, and decide unless they are nearly rounding.
    squares = np.linalg.eigvalsh(centred.T @ centred)
    if squares[1] <= _ON_A_LINE * squares[2]:
        spread = np.linalg.svd(centred, compute_uv=False)
        if spread[1] <= _ON_A_LINE * spread[0]:
            raise MeshError(f"all {len(P)} points in P lie on a line: a surface needs points beside it")


def _checked_normals(normals: ArrayLike, n: int) -> FloatArray:
    """The normals as a new array of unit vectors."""
    array = as_array("normals", normals, MeshError)
    if array.dtype.kind not in "iuf":
        raise MeshError(f"normals must hold real numbers, not {array.dtype}")
    if array.shape != (n, 3):
        raise MeshError(f"normals must have shape ({n}, 3), a normal for each point, but they have shape {array.shape}")
    directions = np.array(array, dtype=np.float64)
    largest = np.abs(directions).max(axis=1, keepdims=True)
    bad, remedy = ~((largest > 0) & (largest < np.inf))[:, 0], "pass normals=None to have planes fitted to the points"
    raise_at_first(bad, "normals", directions, "must be finite and not 0", remedy, MeshError)
    # Unit vectors stay as they are, so that a copy of the cloud has the same bits.
    rows = np.abs(np.einsum("nx,nx->n", directions, directions) - 1) > 1e-14
    directions[rows] /= largest[rows]
    directions[rows] /= np.linalg.norm(directions[rows], axis=1, keepdims=True)
    return directions


def _warn_of_noise(way: FloatArray, may_be_sheets: bool, area: float) -> None:
    """Warn if points were moved, each by a way (n,), from two sheets to the middle between them, or by much noise."""
    noise = float(np.sqrt(np.square(way).mean()))
    if may_be_sheets and way.mean() ** 2 > _NO_NOISE * noise**2:
        warn_caller(
            f"the points look like two sheets {2 * way.mean():.3g} apart, nearer than the points in them, and are "
            "measured as one sheet with noise: pass PointCloud(P, normals) to keep the sheets apart",
            AccuracyWarning,
        )
    elif _ERROR_OF_NOISE * noise > _LARGE_ERROR * np.sqrt(area):
        warn_caller(
            f"the noise of the points is {noise:.2g} across the surface, and as much along it: distances are "
            f"{100 * _ERROR_OF_NOISE * noise / np.sqrt(area):.0f} % off in the mean, between near points by more. Give "
            "points with less noise, as the means of several scans, or the mesh if this is detail of the surface",
            AccuracyWarning,
        )
