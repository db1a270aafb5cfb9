"""Geodesics by class: curves straightened, and paths and loops through waypoints."""

from __future__ import annotations

from functools import cached_property
from threading import RLock
from typing import Any

import numpy as np

from heat_igl.curves.places import CommonFaces, Waypoints, corners, mixed_places
from heat_igl.curves.shortening import FaceSequence, Shortened, as_curve, course_of, shortener
from heat_igl.errors import MeshError, SourceError, names_guessed, truth
from heat_igl.kernels.paths import routes
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, as_simplices
from heat_igl.typing import AnyArray, FloatArray, IntArray


def straighten(mesh: MeshLike, curve: SurfaceCurve) -> SurfaceCurve:
    """The locally shortest curve of the class of a curve.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.
    curve : SurfaceCurve
        Any curve on the mesh: along edges, through faces, over itself. An open one keeps its ends; a closed one is
        straightened as a loop, without a fixed point.

    Returns
    -------
    SurfaceCurve
        Never longer than `curve`, and of the same homotopy class: it can be moved there on the surface. It is straight
        across edges and has angles of at least pi on both sides at each vertex that it touches, where the surface goes
        on there, so no curve nearby is shorter. A loop that contracts to a point is a single segment of length 0.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If the curve is none of this mesh, a segment does not start where the one before it ends, or a closed curve has
        no length.

    Notes
    -----
    The curve gives a strip of faces, in which a funnel finds the shortest path (Lee and Preparata 1984). Where it bends
    at a vertex with an angle below pi on the other side, the strip is led there (Xin and Wang 2007). A loop is
    shortened at the vertex with the smallest angle first (Sharp and Crane 2020), then from one of its points to itself,
    and from another one, until its length stays the same. On a surface with hills one class can have several locally
    shortest curves. A loop that becomes less than half as long is shortened a second time in another order.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(4, 3)
    >>> detour = heat_igl.edge_curve(mesh, [0, 1, 2, 3, 4, 9, 14, 19])
    >>> straight = heat_igl.straighten(mesh, detour)
    >>> float(detour.lengths(mesh).sum()), round(float(straight.lengths(mesh).sum()), 6)
    (7.0, 5.0)
    """
    return GeodesicPathSolver(mesh).straighten(curve)


@names_guessed
def geodesic_path(mesh: MeshLike, waypoints: Waypoints, closed: bool = False) -> SurfaceCurve:
    """The geodesic through waypoints, or the closed geodesic in the class of the loop through them.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.
    waypoints : sequence of int, SurfacePoints, or a sequence of both
        Two or more vertices or points on faces; three or more for a loop.
    closed : bool
        Whether a last part leads back to the first waypoint, and the loop is straightened as a whole: then it leaves
        the waypoints. For a loop that passes them, name the first one at the end again.

    Returns
    -------
    SurfaceCurve
        An open one passes all waypoints in the given order, and is locally shortest from each to the next. A closed one
        is locally shortest everywhere.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there are too few waypoints, one is no vertex or point of the mesh or cannot be reached from the one before
        it, or if the loop contracts to a point.

    Notes
    -----
    The first course is the shortest way along edges, and it is shortened as by `straighten`. Between far points with
    hills in between it may pass a hill on the longer side: for the shortest path of all, call `shortest_paths`.

    Examples
    --------
    >>> import heat_igl
    >>> import numpy as np
    >>> mesh = heat_igl.shapes.cylinder(48, 12)
    >>> loop = heat_igl.geodesic_path(mesh, [0, 16, 32], closed=True)  # once around
    >>> round(float(loop.lengths(mesh).sum() / (2 * np.pi)), 3)
    0.999
    """
    return GeodesicPathSolver(mesh).path(waypoints, closed)


class GeodesicPathSolver:
    """Geodesics of one mesh: makes the tables once for many calls of `straighten` and `geodesic_path`.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.

    Notes
    -----
    Curves are independent of one another: they may cross, touch and overlap. Several threads may use one solver, but
    wait for one another: for speed, make one for each.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.strip(12, 5)
    >>> solver = heat_igl.curves.GeodesicPathSolver(mesh)
    >>> paths = [solver.path([0, target]) for target in (12, 77)]
    >>> [round(float(path.lengths(mesh).sum()), 6) for path in paths]
    [12.0, 13.0]
    """

    def __init__(self, mesh: MeshLike) -> None:
        self._mesh: Mesh = as_simplices(mesh)
        if self._mesh.is_tetrahedral:
            raise MeshError("paths need triangles, but the mesh is tetrahedral")
        self._faces, self._kernel = shortener(self._mesh)
        self._corner_at = corners(self._mesh)
        # The tables hold what one search leaves behind.
        self._one_at_a_time = RLock()

    def __reduce__(self) -> tuple[type[GeodesicPathSolver], tuple[Mesh]]:
        return GeodesicPathSolver, (self._mesh,)

    def __repr__(self) -> str:
        return f"GeodesicPathSolver({self._mesh.n_vertices} vertices)"

    def straighten(self, curve: SurfaceCurve) -> SurfaceCurve:
        """The locally shortest curve of the class of a curve; argument, result and errors of `heat_igl.straighten`."""
        if not isinstance(curve, SurfaceCurve):
            raise SourceError(f"curve must be a SurfaceCurve, not {type(curve).__name__}: see edge_curve and curve_on")
        course = course_of(self._mesh, curve)
        with self._one_at_a_time:
            found = self._shortest(course, is_closed=curve.is_closed)
        return as_curve([found], is_closed=curve.is_closed).on(self._mesh)

    def path(self, waypoints: Waypoints, closed: bool = False) -> SurfaceCurve:
        """The geodesic through waypoints, or the closed one of their loop.

        Arguments, result and errors are those of `geodesic_path`.
        """
        faces, barycentric = mixed_places("waypoints", self._mesh, waypoints, self._corner_at)
        needed = 3 if truth("closed", closed) else 2
        if len(faces) < needed:
            raise SourceError(
                f"waypoints must be {needed} places or more for a {'loop' if closed else 'path'}, not {len(faces)}"
            )
        if closed:
            around = np.append(np.arange(len(faces)), 0)
            with self._one_at_a_time:
                return self._loop(self._courses(faces[around], barycentric[around]))
        return as_curve(self.geodesics(faces, barycentric), is_closed=False).on(self._mesh)

    def geodesics(self, faces: IntArray, barycentric: FloatArray) -> list[Shortened]:
        """The geodesics between checked places (k,), each from one to the next."""
        with self._one_at_a_time:
            return [self._shortest(leg) for leg in self._courses(faces, barycentric)]

    def pieces(self, faces: IntArray, barycentric: FloatArray) -> list[Shortened]:
        """From each checked place (k,) to the next: straight in a face that holds both, or else the geodesic."""
        found = []
        for i in range(len(faces) - 1):
            two = faces[i : i + 2], barycentric[i : i + 2]
            face, ends = self._common.around(*two)
            length = float(np.linalg.norm((ends[1] - ends[0]) @ self._mesh.V[self._mesh.F[face]]))
            straight = Shortened(length, np.array([face]), ends[None])
            found += [straight] if face >= 0 else self.geodesics(*two)
        return found

    def hold(self, faces: IntArray, barycentric: FloatArray) -> bool:
        """Whether one face holds two places, given as for `pieces`."""
        return self._common.around(faces, barycentric)[0] >= 0

    @cached_property
    def _common(self) -> CommonFaces:
        return CommonFaces(self._mesh)

    @cached_property
    def _ways(self) -> Any:
        return routes.EdgeRoutes(self._faces, self._mesh.V)

    def _courses(self, faces: IntArray, barycentric: FloatArray) -> list[FaceSequence]:
        """The k - 1 shortest ways along edges from each place (k,) to the next; a `SourceError` if there is none."""
        F, V, found = self._mesh.F, self._mesh.V, []
        for i in range(len(faces) - 1):
            ends, places = faces[i : i + 2].astype(np.int32), barycentric[i : i + 2]
            # Within one face there is nothing to find.
            way = np.array([-1], np.int32), ends[:0]
            if ends[0] != ends[1]:
                around: list[AnyArray] = []
                for face, place in zip(ends, places, strict=True):
                    held, point = F[face][place > 0], place @ V[F[face]]
                    around += [held, np.linalg.norm(V[held] - point, axis=1)]
                way = self._ways.route(*around, point)
            if way is None:
                raise SourceError(
                    f"no path leads from waypoints[{i}] to waypoints[{i + 1}]: they lie on different components of the "
                    "mesh"
                )
            vertices, between = way
            joins = np.full((len(vertices), 3), -1, np.int32)
            joins[:, 2] = vertices
            found.append(FaceSequence(np.concatenate([ends[:1], between, ends[1:]]), joins, places))
        return found

    def _shortest(self, course: FaceSequence, *, is_closed: bool = False) -> Shortened:
        """The locally shortest curve of the class of a course: between the ends, or as a loop."""
        faces, joins, ends = course
        stuck, *found = self._kernel.shorten(faces, joins, ends, is_closed)
        if stuck >= 0:
            # Two faces have only this vertex in common: every loop of the class passes it, so the loop is a path from
            # it to itself.
            vertex = joins[stuck, 2]
            faces, joins = np.roll(faces, -stuck - 1), np.roll(joins, -stuck - 1, axis=0)[:-1]
            at = (self._mesh.F[faces[[0, -1]]] == vertex).astype(float)
            _, *found = self._kernel.shorten(faces, np.ascontiguousarray(joins), at, False)
        return Shortened(*found)

    def _loop(self, legs: list[FaceSequence]) -> SurfaceCurve:
        """The closed geodesic of the loop that these legs make."""
        loop = FaceSequence(
            np.concatenate([leg.faces[:-1] for leg in legs]),
            np.concatenate([leg.joins for leg in legs]),
            legs[0].ends[[0, 0]],
        )
        found = self._shortest(loop, is_closed=True)
        if not found.length > 0:
            raise SourceError(
                "the loop through the waypoints contracts to a point, so no closed geodesic belongs to it: lead it "
                "around a handle, or name the first waypoint again at the end for a loop that passes all of them"
            )
        return as_curve([found], is_closed=True).on(self._mesh)
