"""Geodesics in a homotopy class: straightened curves, paths and loops through waypoints, and geodesic Bezier curves.

A curve is converted to the sequence of faces that it runs through. The kernel of paths shortens such sequences.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from threading import RLock
from typing import Any, NamedTuple

import igl
import numpy as np

from heat_igl.curves.places import CommonFaces, Waypoints, checked_places, corners
from heat_igl.errors import SourceError, names_guessed, shown, truth
from heat_igl.intrinsic import HalfEdges, corner_angles, lengths_to_divide_by
from heat_igl.kernels.paths import face_table, routes, shortening
from heat_igl.mesh import Mesh, MeshLike, SurfaceCurve, as_triangles
from heat_igl.mesh.connectivity import group_by_label
from heat_igl.mesh.surface_points import require_faces, unchecked_curve
from heat_igl.sources.source_sets import on_simplex
from heat_igl.typing import AnyArray, FloatArray, IntArray

# Compiled modules, whose signatures are those of Cython.
_face_table: Any = face_table
_shortening: Any = shortening
# Of each face the edge `length` opposite each corner, the `angle` at each, `vertex` and `edge` numbers. Corner c lies
# `along` of the way from corner c + 2 to c + 1, and `above` this edge, in lengths of the edge.
_FACE = np.dtype(
    [*((name, "f8", 3) for name in ("length", "angle", "along", "above")), ("vertex", "i4", 3)], align=True
)
# Segments are joined if their ends are no farther apart than this, in mean edge lengths. Those of this package are at
# most 4e-14 apart, and 1e-7 where coordinates in the faces are rounded to single precision.
_GAP = 1e-6
_MOST_PIECES = 1_000_000  # of a Bezier curve


class FaceSequence(NamedTuple):
    """The faces (s,) that a curve runs through, one after another; a face may come twice in a row.

    A row of `joins`, s - 1 and of loops s, leads from each face to the next: the half-edges on both sides of the edge
    between them, or else the vertex to turn around, the shorter way; -1 for none. `ends` (2, 3) are barycentric
    coordinates of the start in the first face and of the end in the last; a loop begins and ends in the first.
    """

    faces: AnyArray
    joins: AnyArray
    ends: FloatArray


class Shortened(NamedTuple):
    """A shortened curve: its length, faces (s,), and barycentric coordinates (s, 2, 3) of both ends of each segment."""

    length: float
    faces: IntArray
    points: FloatArray


def course_of(mesh: Mesh, curve: SurfaceCurve) -> FaceSequence:
    """The course of a curve.

    A `SourceError` if its segments do not join, a face is none of the mesh, or a closed curve has no length.
    """
    faces = curve.faces
    require_faces(curve, mesh.F, mesh.V)
    count = len(curve) if curve.is_closed else len(curve) - 1
    corner = mesh.V[mesh.F[faces]]
    begins, ends = (np.einsum("kc,kcx->kx", place, corner) for place in (curve.start, curve.end))
    if curve.is_closed and (begins == ends).all():
        raise SourceError("curve is closed and has no length: a loop needs two different points")
    following = np.append(np.arange(1, len(curve)), 0)[:count]
    apart = ends[:count] - begins[following]
    is_apart = np.einsum("kx,kx->k", apart, apart) > (_GAP * mesh.edge_lengths.mean()) ** 2 if apart.any() else False
    end = on_simplex(curve.end)
    joins, share = _joins(mesh, faces[:count], faces[following], end[:count])
    wrong = np.flatnonzero(is_apart | (share > _GAP))
    if len(wrong):
        i = int(wrong[0])
        raise SourceError(
            f"curve does not hold together: segment {i} ends in face {faces[i]} at {ends[i].tolist()}, and segment "
            f"{following[i]} starts in face {faces[following[i]]} at {begins[following[i]].tolist()}: each segment "
            "must start where the one before it ends"
        )
    first = on_simplex(curve.start[:1])[0]
    return FaceSequence(faces.astype(np.int32), joins, np.stack([first, first if curve.is_closed else end[-1]]))


def _joins(mesh: Mesh, f: IntArray, g: IntArray, at: FloatArray) -> tuple[AnyArray, FloatArray]:
    """Joins (k, 3) from faces f to faces g at points `at` (k, 3) of f, and how far each is from edge or vertex."""
    joins = np.full((len(f), 3), -1, np.int32)
    share = np.zeros(len(f))
    rows = np.flatnonzero(f != g)
    if len(rows) < len(f):
        f, g, at = f[rows], g[rows], at[rows]
    edges = mesh.facets.of_face
    # A point lies on the edge opposite a corner if the coordinate of this corner is 0.
    off_edge = np.where(edges[f][:, :, None] == edges[g][:, None, :], at[:, :, None], np.inf).reshape(len(f), 9)
    nearest, corner, each = off_edge.argmin(axis=1), at.argmax(axis=1), np.arange(len(f))
    by_edge = off_edge[each, nearest] <= _GAP
    vertex = mesh.F[f, corner]
    off_vertex = np.where((mesh.F[g] == vertex[:, None]).any(axis=1), 1 - at[each, corner], np.inf)
    # Column by column is faster: on small meshes these checks take half of the time.
    joins[rows, 0] = np.where(by_edge, 3 * f + nearest // 3, -1)
    joins[rows, 1] = np.where(by_edge, 3 * g + nearest % 3, -1)
    joins[rows, 2] = np.where(by_edge, -1, vertex)
    share[rows] = np.where(by_edge, 0.0, off_vertex)
    return joins, share


def shortener(mesh: Mesh) -> tuple[Any, Any]:
    """The table of the triangles of a mesh, and the kernel that shortens curves on them."""
    face, edge = _faces(mesh), mesh.facets
    edges, _ = HalfEdges.of_mesh(mesh)
    first_corner, corner = (rows.astype(np.int32) for rows in group_by_label(mesh.F.ravel(), mesh.n_vertices))
    table = _face_table.FaceTable(face, edges, first_corner, corner)
    sums = np.bincount(mesh.F.ravel(), face["angle"].ravel(), mesh.n_vertices)
    # At a vertex with angles of 2 pi or more, and on the boundary, at most one side is locally shortest. On edges of
    # more than two faces there are more than two sides.
    sums[edge.vertices[edge.n_faces != 2]] = np.inf
    half_turn = np.cos(np.minimum(sums, 2 * np.pi) / 2)
    return table, _shortening.Shortener(table, half_turn, int(np.diff(first_corner).max()))


def _faces(mesh: Mesh) -> AnyArray:
    """The faces (m,) as the kernels read them, see `_FACE`."""
    lengths = lengths_to_divide_by(mesh)
    face = np.empty(mesh.n_faces, _FACE)
    face["length"], face["angle"] = lengths, corner_angles(lengths)
    # The side from corner c to corner c + 2, and the one to corner c + 1.
    left, right = np.roll(lengths, -1, axis=1), np.roll(lengths, -2, axis=1)
    face["along"] = ((left - right) * (left + right) / lengths + lengths) / (2 * lengths)
    face["above"] = igl.doublearea(lengths, 0.0)[:, None] / lengths**2
    face["vertex"] = mesh.F
    return face


def as_curve(parts: Sequence[Shortened], *, is_closed: bool) -> SurfaceCurve:
    """One curve of parts that follow one another."""
    points = np.concatenate([part.points for part in parts])
    faces = np.concatenate([part.faces for part in parts])
    return unchecked_curve(faces, points[:, 0].copy(), points[:, 1].copy(), is_closed)


def straighten(mesh: MeshLike, curve: SurfaceCurve) -> SurfaceCurve:
    """The locally shortest curve in the homotopy class of a curve.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.
    curve : SurfaceCurve
        Any curve on the mesh: along edges, through faces, crossing itself. The ends of an open curve are fixed; a
        closed one is straightened as a loop, without a fixed point.

    Returns
    -------
    SurfaceCurve
        Never longer than `curve`, and of the same homotopy class: one can be deformed into the other on the surface. It
        is straight across edges, and has angles of at least pi on both sides at each vertex that it touches (on the
        boundary, on the inner side), so no curve nearby is shorter. A contractible loop may end as one segment of
        length 0.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If the curve is none of this mesh, a segment does not start where the one before it ends, or a closed curve has
        no length.

    Notes
    -----
    In the strip of faces that the curve crosses, the funnel algorithm finds the shortest path (Lee and Preparata 1984).
    If this path bends at a vertex whose angle on the other side is below pi, the strip is rerouted there (Xin and Wang
    2007). A loop is shortened at the vertex with the smallest angle first (Sharp and Crane 2020), then as a path from
    one of its points to itself, with changing points, until its length stays the same. One class can have several
    locally shortest curves. A loop that becomes less than half as long is shortened a second time in another order.

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
        self._mesh: Mesh = as_triangles(mesh, "paths need")
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
        faces, barycentric = checked_places("waypoints", self._mesh, waypoints, self._corner_at)
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


def geodesic_bezier(mesh: MeshLike, points: Waypoints, pieces: int = 32) -> SurfaceCurve:
    """The Bezier curve of control points on a surface, with geodesics in place of straight lines.

    Parameters
    ----------
    mesh : mesh
        Triangles, also with edges of more than two faces.
    points : sequence of int, SurfacePoints, or a sequence of both
        The control points, two or more vertices or points on faces: d + 1 for the degree d.
    pieces : int
        The curve is evaluated at the parameters i / pieces, and these places are joined by geodesics.

    Returns
    -------
    SurfaceCurve
        From the first control point to the last. It leaves the first one towards the second, and arrives at the last
        from the one before it.

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there are fewer than two control points, one is no vertex or point of the mesh, or they lie on different
        components.
    ValueError
        If `pieces` is no positive integer.

    Notes
    -----
    De Casteljau's algorithm with the geodesics of `geodesic_path` (Park and Ravani 1995): d (d + 1) / 2 of them for
    each parameter. The curve is continuous as long as these geodesics change continuously with the parameter. It can
    jump where control points lie behind a hill from each other, so that another geodesic becomes the shorter one.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> curve = heat_igl.curves.geodesic_bezier(mesh, [0, 8, 80], pieces=2)  # three corners of the square
    >>> curve.positions(mesh).round(6)[[0, -1]].tolist()
    [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0]]
    """
    if isinstance(pieces, bool) or not isinstance(pieces, int | np.integer) or not 1 <= pieces <= _MOST_PIECES:
        raise ValueError(f"pieces must be an integer from 1 to {_MOST_PIECES}, not {shown(pieces)}")
    triangles = as_triangles(mesh, "paths need")
    solver = GeodesicPathSolver(triangles)
    faces, barycentric = checked_places("points", triangles, points)
    if len(faces) < 2:
        raise SourceError(f"points must be two control points or more, not {len(faces)}")
    first = solver.geodesics(faces, barycentric)
    found = [(faces[0], barycentric[0])]
    for i in range(1, pieces):
        legs = first
        while legs:
            places = [_along(leg, i / pieces, triangles.V[triangles.F[leg.faces]]) for leg in legs]
            at = np.array([face for face, _ in places]), np.array([weights for _, weights in places])
            legs = solver.geodesics(*at)
        found.append(places[0])
    found.append((faces[-1], barycentric[-1]))
    ends: tuple[IntArray, FloatArray] = np.array([face for face, _ in found]), np.array([b for _, b in found])
    return as_curve(solver.geodesics(*ends), is_closed=False).on(triangles)


def _along(leg: Shortened, share: float, corners: FloatArray) -> tuple[int, FloatArray]:
    """The place at this share of the length of a geodesic; `corners` (s, 3, 3) are those of the faces."""
    steps = np.einsum("kc,kcx->kx", leg.points[:, 1] - leg.points[:, 0], corners)
    ends = np.cumsum(np.linalg.norm(steps, axis=1))
    wanted = share * ends[-1]
    i = min(int(np.searchsorted(ends, wanted)), len(ends) - 1)
    before = ends[i - 1] if i else 0.0
    here = (wanted - before) / (ends[i] - before) if ends[i] > before else 0.0
    weights = leg.points[i, 0] + min(max(here, 0.0), 1.0) * (leg.points[i, 1] - leg.points[i, 0])
    return int(leg.faces[i]), on_simplex(weights[None])[0]
