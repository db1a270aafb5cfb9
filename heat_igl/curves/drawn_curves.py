"""Curves drawn through places on a mesh or along polylines in space, and the signed distance from a curve."""

from __future__ import annotations

import numpy as np

from heat_igl.curves.geodesics import GeodesicPathSolver, as_curve
from heat_igl.curves.places import Waypoints, checked_places
from heat_igl.errors import SourceError, names_guessed, positive, truth
from heat_igl.heat import SignedHeatSolver
from heat_igl.mesh import Mesh, MeshLike, NestedCurves, SurfaceCurve, SurfacePoints, as_triangles
from heat_igl.mesh.connectivity import enumerate_runs
from heat_igl.mesh.surface_points import ClosestPoints, Projector, checked_points, unchecked_curve
from heat_igl.sources.source_sets import on_simplex
from heat_igl.typing import ArrayLike, FloatArray, IntArray

# Twice so many faces are followed between two samples, half a mean edge length apart: 20 do on twelve shapes.
_MOST_FACES = 100
# Shares of a line nearer to one another are the same place: from 1e-11 to 1e-5 no curve changes of 72 on these.
_SAME_PLACE = 1e-9
# A jump is found up to this length, in mean edge lengths. Lengths of these curves are within 0.3 % of those for 0.0001;
# with 0.01, within 1.4 %.
_NEAR_A_JUMP = 0.003


@names_guessed
def curve_through(mesh: MeshLike, points: Waypoints, *, closed: bool = False) -> SurfaceCurve:
    """The curve that passes some places in their order, locally shortest from each to the next.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    points : sequence of int, SurfacePoints, a sequence of both, or (k, 3) array_like of float
        Two or more vertices, points on faces, or positions in space such as clicked ones; for a closed curve three.
    closed : bool
        Whether a last part leads back to the first place. The curve passes all places, unlike the closed geodesic of
        `geodesic_path`.

    Returns
    -------
    SurfaceCurve

    Raises
    ------
    MeshError
        If the mesh is tetrahedral.
    SourceError
        If there are too few places, one is no vertex or point of the mesh or cannot be reached from the one before it,
        or a position is farther from the surface than the mean length of an edge.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> triangle = heat_igl.curve_through(mesh, [[0.1, 0.1, 0.0], [0.4, 0.1, 0.0], [0.4, 0.5, 0.0]], closed=True)
    >>> round(triangle.length, 6)
    1.2
    """
    triangles, closed = as_triangles(mesh, "curves need"), truth("closed", closed)
    faces, barycentric = checked_places("points", triangles, points)
    needed = 3 if closed else 2
    if len(faces) < needed:
        raise SourceError(f"points must be {needed} places or more for {'a closed' if closed else 'a'} curve")
    order = np.arange(len(faces) + closed) % len(faces)
    curve = GeodesicPathSolver(triangles).path(SurfacePoints(faces[order], barycentric[order]))
    return unchecked_curve(curve.faces, curve.start, curve.end, closed, triangles)


def curve_on(
    mesh: MeshLike, positions: ArrayLike, *, closed: bool = False, tolerance: float | None = None
) -> SurfaceCurve:
    """Project a polyline in space onto a triangle mesh.

    Parameters
    ----------
    mesh : mesh
        Triangles.
    positions : (k, 3) array_like
        Corners of the polyline, in the mesh's unit. Each straight line between two corners is sampled at steps of at
        most half a mean edge length, and where it passes from one face to the next. The closest points to the samples
        are joined by straight lines in faces that hold both, else, as over a valley, by geodesics.
    closed : bool
        Whether a last line leads back to the first corner.
    tolerance : float, optional
        Largest distance of polyline and curve from each other, at the corners and between them; a mean edge length if
        not given.

    Returns
    -------
    SurfaceCurve
        With a segment for each piece inside a face.

    Raises
    ------
    SourceError
        If the polyline is farther from the surface than `tolerance`, or the curve from the polyline, as where the
        closest points jump from one part of the surface to another; if there are fewer than two different corners, or a
        position is not finite.
    MeshError
        If the mesh is tetrahedral.
    ValueError
        If `tolerance` is not a positive number, or `closed` is no truth value.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(4)
    >>> curve = heat_igl.curve_on(mesh, [[0.1, 0.2, 0.01], [0.4, 0.6, 0.01]])
    >>> round(float(curve.lengths(mesh).sum()), 6)
    0.5
    """
    mesh, closed = as_triangles(mesh, "curves need"), truth("closed", closed)
    corners = checked_points("positions", positions)
    if len(corners) < 2:
        raise SourceError(f"positions must be two corners of a curve or more, not {len(corners)}")
    solver = GeodesicPathSolver(mesh)
    h = float(mesh.edge_lengths.mean())
    tolerance = h if tolerance is None else positive("tolerance", tolerance)
    ends = np.concatenate([corners, corners[:1]]) if closed else corners
    lengths = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    if not lengths.any():
        raise SourceError("positions are all in one place: a curve needs two different ones")
    line, step = enumerate_runs(np.maximum(np.ceil(lengths / (h / 2)).astype(int), 1))
    share = step / np.bincount(line)[line]
    samples = np.append(ends[line] + share[:, None] * (ends[line + 1] - ends[line]), ends[-1:], axis=0)
    step, places, found = _with_borders(mesh, solver, samples)
    line = line[step]
    far = int(found.gap.argmax())
    if found.gap[far] > tolerance:
        raise SourceError(
            f"the polyline leaves the surface by {found.gap[far]:.6g} on the line from "
            f"positions[{line[min(far, len(line) - 1)]}], at {places[far].tolist()}; tolerance is {tolerance:.6g}"
        )
    faces, barycentric = found.points.faces, on_simplex(found.points.barycentric)
    component = mesh.components[mesh.F[faces, 0]]
    jumps = component[1:] != component[:-1]
    if not jumps.any():
        curve = as_curve(legs := solver.pieces(faces, barycentric), is_closed=closed).on(mesh)
        # Each corner of the curve lies near the straight line of its step.
        leg = np.repeat(np.arange(len(legs)), [len(part.faces) for part in legs])
        begin = samples[step[leg]]
        along = samples[step[leg] + 1] - begin
        place = curve.points[1:] - begin
        squared = np.maximum(np.einsum("kx,kx->k", along, along), np.finfo(float).tiny)
        nearest = np.clip(np.einsum("kx,kx->k", place, along) / squared, 0, 1)[:, None] * along
        jumps[leg[np.linalg.norm(place - nearest, axis=1) > tolerance * (1 + 1e-9)]] = True
    if jumps.any():
        i = int(np.argmax(jumps))
        raise SourceError(
            f"the line from positions[{line[i]}] jumps from face {faces[i]} to face {faces[i + 1]} at "
            f"{places[i].tolist()}, where another part of the surface is closer: draw it closer to the surface"
        )
    moves = (curve.start != curve.end).any(axis=1)
    if not moves.any():
        raise SourceError("all positions are closest to one point of the surface: a curve needs two different ones")
    return unchecked_curve(curve.faces[moves], curve.start[moves], curve.end[moves], closed, mesh)


def _with_borders(
    mesh: Mesh, solver: GeodesicPathSolver, samples: FloatArray
) -> tuple[IntArray, FloatArray, ClosestPoints]:
    """The step (j - 1,) between two samples that each leg is in, and places (j, 3) with their closest points.

    Places are the samples (k, 3), and more between those that no face holds: where the line, projected onto the plane
    of the face at either end, leaves that face. If that is not between them, closest points jump, as over a valley, and
    the pair is halved.
    """
    projector = Projector(mesh)
    found = projector.project(samples)
    step = apart = np.arange(len(samples) - 1)
    for _ in range(_MOST_FACES):
        faces, barycentric = found.points.faces, found.points.barycentric
        apart = apart[[not solver.hold(faces[i : i + 2], barycentric[i : i + 2]) for i in apart]]
        begin, end = samples[apart], samples[apart + 1]
        shares = np.stack([_leaving(mesh, faces[apart], begin, end), 1 - _leaving(mesh, faces[apart + 1], end, begin)])
        shares.sort(axis=0)
        shares[1, shares[1] < shares[0] + _SAME_PLACE] = 1
        is_new = (shares > _SAME_PLACE) & (shares < 1 - _SAME_PLACE)
        jumps = ~is_new.any(axis=0) & (np.linalg.norm(end - begin, axis=1) > _NEAR_A_JUMP * mesh.edge_lengths.mean())
        shares[0, jumps], is_new[0, jumps] = 0.5, True
        pair, which = np.nonzero(is_new.T)
        if not len(pair):
            break
        between = begin[pair] + shares[which, pair, None] * (end - begin)[pair]
        more, at = projector.project(between), apart[pair] + 1
        faces = np.insert(faces, at, more.points.faces)
        barycentric = np.insert(barycentric, at, more.points.barycentric, axis=0)
        found = ClosestPoints(SurfacePoints(faces, barycentric), np.insert(found.gap, at, more.gap))
        step, samples = np.insert(step, at, step[at - 1]), np.insert(samples, at, between, axis=0)
        new = at + np.arange(len(at))
        apart = np.union1d(new - 1, new)
    return step, samples, found


def _leaving(mesh: Mesh, faces: IntArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    """The share (k,) of each line at which, projected onto the plane of a face, it leaves the face; else 1."""
    corners = mesh.V[mesh.F[faces]]
    inverse = np.linalg.pinv(corners[:, 1:] - corners[:, :1])
    before, after = (np.einsum("kx,kxc->kc", x - corners[:, 0], inverse) for x in (begin, end))
    before, after = (np.column_stack([1 - x.sum(axis=1), x]) for x in (before, after))
    leaves = (after < 0) & (before > 0)
    return np.asarray(np.where(leaves, before / np.where(leaves, before - after, 1), 1.0).min(axis=1))


def signed_distance(mesh: MeshLike, curve: NestedCurves) -> FloatArray:
    """Signed distance from curves on a mesh, in one call; to ask more than once, keep a `SignedHeatSolver`.

    Errors are those of `SignedHeatSolver`.

    Parameters
    ----------
    mesh : mesh
        Triangles, oriented alike.
    curve : SurfaceCurve or list of such
        The curves; they may be broken.

    Returns
    -------
    (n,) float64
        In the mesh's unit: negative on the left of the curves, which ``curve.reversed()`` turns round.

    Examples
    --------
    >>> import heat_igl
    >>> mesh = heat_igl.shapes.grid(8)
    >>> middle = heat_igl.curve_through(mesh, [[0.0, 0.5, 0.0], [1.0, 0.5, 0.0]])  # above is on the left
    >>> heat_igl.signed_distance(mesh, middle)[[0, 80]].round(6).tolist()
    [0.5, -0.5]
    """
    return SignedHeatSolver(mesh).distance(curve)
