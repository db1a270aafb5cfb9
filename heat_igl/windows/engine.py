"""Engines of distance along triangles: windows, whose answers are checked, and the triangles that they measure on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cached_property, partial
from typing import TYPE_CHECKING

import igl
import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.kernels.mesh import checking
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.mesh.surface_points import unchecked_points
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourceSet, source_set
from heat_igl.typing import AnyArray, BoolArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSolution, ExactSurface
from heat_igl.windows.queries import Query, labels_of, starting_points
from heat_igl.windows.tables import MARGIN, Tables, from_mesh, from_triangulation

if TYPE_CHECKING:
    from heat_igl.intrinsic import IntrinsicTriangulation
    from heat_igl.operators import Operators, Surface
    from heat_igl.windows.directions import CurveDirections, PathAngles, PathDirections
    from heat_igl.windows.path_lengths import PathLengths

#: Violations by less than this share of the largest distance are rounding. Answers that are exact to rounding violate
#: the bounds by up to 1e-9 of it, with coordinates far from the origin.
ROUNDING = 1e-7
# Lines to so many sources are measured at every vertex; with k times as many, at every k-th.
_SOURCES_AT_ALL = 8
_NO_LENGTHS = np.empty((0, 3))
_REPORT = "please report this as a bug, with the mesh and the sources"


class Engine(ABC):
    """Distance from sets of sources, without heat."""

    @abstractmethod
    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) as the user counts them that it is measured from, -1 for none.

        Parameters
        ----------
        sources : SourceSet
            Where distance begins.
        cutoff : float
            A search may end there; what it has not found is ``inf``.
        threads : int
            That it may use.
        """

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """The distance of `labelled` alone."""
        return self.labelled(sources, cutoff, threads)[0]

    def nearer(self, sources: SourceSet, than: FloatArray, threads: int = 1) -> FloatArray:
        """Distance (n,) from vertices where it is smaller than `than` (n,), the distance from others; else ``inf``."""
        found = self.distance(sources, float(than.max()), threads)
        found[found >= than] = np.inf
        return found


class Triangles(ABC):
    """A surface of triangles, with its components."""

    #: Component label (n,) of each vertex.
    components: IntArray

    @property
    @abstractmethod
    def surface(self) -> Surface:
        """The triangles, with their history, which carries points and curves to them."""

    @abstractmethod
    def tables(self) -> Tables:
        """Tables for distance from vertices, which need no history."""

    @property
    def mean_edge_length(self) -> float:
        """Mean length of the edges that paths cross."""
        return self.surface.unfolding.mean_edge_length

    @property
    def given_faces(self) -> IntArray:
        """Vertices (m, 3) of the triangles that points and curves refer to; (0, 3) if they are not known."""
        faces = self.surface.given_faces
        return np.empty((0, 3), np.int64) if faces is None else faces

    @property
    def faces(self) -> IntrinsicTriangulation:
        """The triangles before any flip."""
        return self.surface.unfolding if self.surface.faces is None else self.surface.faces


class MeshTriangles(Triangles):
    """The triangles of a mesh.

    Parameters
    ----------
    mesh : Mesh
        Triangles.
    margin : float, optional
        Thinner ones are mollified, see `mollify`.
    orients : bool
        See `intrinsic_delaunay`.
    """

    def __init__(self, mesh: Mesh, margin: float | None = MARGIN, *, orients: bool = True) -> None:
        self._mesh, self._margin, self._orients = mesh, margin, orients

    @property
    def components(self) -> IntArray:  # type: ignore[override]
        """Component label (n,) of each vertex."""
        return self._mesh.components

    @cached_property
    def surface(self) -> Surface:
        """The triangles with their history."""
        from heat_igl.operators import unfolding_surface

        return unfolding_surface(self._mesh, self._margin, orients=self._orients)

    @property
    def given_faces(self) -> IntArray:
        """The faces (m, 3) of the mesh."""
        return self._mesh.F

    def tables(self) -> Tables:
        """Tables for distance from vertices."""
        return from_mesh(self._mesh, 0)


class OperatorTriangles(Triangles):
    """The triangles of a domain that has operators.

    Parameters
    ----------
    domain : Operators
        With a surface.

    Raises
    ------
    ValueError
        If it has none.
    """

    def __init__(self, domain: Operators) -> None:
        surface = domain.surface
        if surface is None:
            raise ValueError("distance is unfolded along triangles, and this domain has none")
        self.components = domain.components[: surface.unfolding.n]
        self._surface = _as_thin_as_given(surface)

    @property
    def surface(self) -> Surface:
        """The triangles with their history."""
        return self._surface

    def tables(self) -> Tables:
        """Tables for distance from vertices."""
        return from_triangulation(self._surface.unfolding)


class TriangleEngine(Engine):
    """An engine on triangles, with the exact surfaces that points and curves need.

    Parameters
    ----------
    triangles : Triangles
        The surface.
    originals : (n,) int64, optional
        The vertex whose values each takes: itself, or that of which it is a copy, see `PointCloud.originals`.
    """

    def __init__(self, triangles: Triangles, originals: IntArray | None = None) -> None:
        self._triangles, self._originals = triangles, originals

    @cached_property
    def _on_delaunay(self) -> ExactSurface:
        """The triangles to which points are carried."""
        return ExactSurface(self._triangles.surface.unfolding)

    @cached_property
    def _on_faces(self) -> ExactSurface:
        """The faces before any flip, in which curves lie."""
        return ExactSurface(self._triangles.faces)

    def _with_copies(self, values: AnyArray) -> AnyArray:
        """Values (n,) in which copies of points have those of their originals."""
        return values if self._originals is None else values[self._originals]


class WindowEngine(TriangleEngine):
    """Distance by windows, directions and paths: all exact."""

    def __init__(self, triangles: Triangles, originals: IntArray | None = None) -> None:
        super().__init__(triangles, originals)
        # Made at once, since nearly every query needs it; what points, curves and paths need is made on request.
        self._from_vertices = ExactSurface(triangles.tables())

    @cached_property
    def _directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        from heat_igl.windows.directions import PathDirections

        return PathDirections(self._triangles.surface)

    @cached_property
    def _curve_directions(self) -> CurveDirections:
        from heat_igl.windows.directions import CurveDirections

        return CurveDirections(self._triangles.surface)

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        if not sources.on_vertices_alone or sources.vertex_offset.any():
            return super().distance(sources, cutoff, threads)
        return self._with_copies(self._from_vertices.distance(sources.vertices, None, cutoff, threads))

    def nearer(self, sources: SourceSet, than: FloatArray, threads: int = 1) -> FloatArray:
        """As of all engines; the search ends where others are nearer."""
        found = self._from_vertices.distance(sources.vertices, None, float(than.max()), threads, than=than)
        return self._with_copies(found)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from."""
        query = Query.of(sources, self._triangles)
        found = self.solution(query, query.cutoff(cutoff), threads=threads)
        labels = labels_of(sources)[found.origin.label]
        return self._with_copies(query.with_begin(found.distance)), self._with_copies(labels)

    def solution(
        self,
        query: Query,
        cutoff: float = np.inf,
        *,
        directed: bool = False,
        targets: SurfacePoints | None = None,
        goals: IntArray | None = None,
        threads: int = 1,
    ) -> ExactSolution:
        """Distance and the paths from the sources of a query; see `ExactSurface.solve`."""
        if query.has_curves:
            surface = self._on_faces
        elif query.points is not None or targets is not None or directed:
            surface = self._on_delaunay
        else:
            surface = self._from_vertices
        return query.solve(surface, cutoff=cutoff, directed=directed, targets=targets, goals=goals, threads=threads)

    def to_targets(self, sources: SourceSet, targets: SurfacePoints | IntArray) -> FloatArray:
        """Distance (t,) of points or vertices; the search ends when all are known."""
        query = Query.of(sources, self._triangles)
        places = targets if isinstance(targets, SurfacePoints) else None
        goals = np.empty(0, np.int64) if isinstance(targets, SurfacePoints) else targets
        found = self.solution(query, targets=places, goals=goals)
        if not isinstance(targets, SurfacePoints):
            return query.with_begin(found.distance)[targets]
        if query.begin is None:
            return found.target_distance
        begin = query.begin[self._triangles.given_faces[targets.faces, 0]]
        return found.target_distance + np.where(np.isfinite(found.target_distance), begin, 0.0)

    def directed(self, sources: SourceSet) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """Distance (n,), labels (n,), and of each path the directions and the place at which it starts; all exact.

        Raises
        ------
        MeshError
            If vertices have no tangent plane, see `polar_angles`.
        """
        query = Query.of(sources, self._triangles)
        if query.has_curves:
            of_curves = self._curve_directions
            found = self.solution(query, directed=True)
            angles, starts = of_curves.of_windows(found)
        else:
            of_points = self._directions
            found = self.solution(query, directed=True)
            angles = of_points.of_windows(found, query.points)
            starts = starting_points(self._corner_at[sources.vertices], sources.points, found.origin.label)
        labels = labels_of(sources)[found.origin.label]
        distance = query.with_begin(found.distance)
        distance, labels = self._with_copies(distance), self._with_copies(labels)
        if self._originals is not None:
            starts = unchecked_points(starts.faces[self._originals], starts.barycentric[self._originals])
            angles = type(angles)(*(angle[self._originals] for angle in angles))
        return distance, labels, angles, starts

    @cached_property
    def _corner_at(self) -> IntArray:
        """The first corner (n,) of the given faces at each vertex."""
        F, corner_at = self._triangles.given_faces, np.zeros(self._triangles.components.size, np.int64)
        corner_at[F.ravel()[::-1]] = np.arange(F.size)[::-1]
        return corner_at

    def paths(self, sources: SourceSet) -> PathLengths:
        """The paths whose lengths are the exact distances from vertices and points."""
        from heat_igl.windows.path_lengths import PathLengths

        return PathLengths(self._on_delaunay, self._triangles.surface.unfolding, sources)


class Invariants:
    """Bounds of a distance on triangles or tetrahedra that are known by the positions of their vertices.

    An answer keeps four of them: it is 0 (or the offset) at the sources, finite exactly on their components, differs
    along an edge by no more than the length of the edge, and is nowhere below the straight line to the nearest source.

    Parameters
    ----------
    F : (m, 3) or (m, 4) int64
        Triangles or tetrahedra, to which points and curves refer.
    components : (n,) int64
        Component label of each vertex.
    V : (n, 3) float64, optional
        Positions of the vertices.
    lengths : (m, 3) float64, optional
        Lengths of the sides of triangles, each opposite its corner, in place of positions; there are no straight lines
        then.
    """

    def __init__(
        self, F: IntArray, components: IntArray, V: FloatArray | None = None, lengths: FloatArray | None = None
    ) -> None:
        self._F = np.ascontiguousarray(F, np.int64)
        self._components = components
        self._V = None if V is None else np.ascontiguousarray(V, np.float64)
        self._l = _NO_LENGTHS if lengths is None else np.ascontiguousarray(lengths, np.float64)

    def contradiction(
        self,
        distance: FloatArray,
        sources: SourceSet,
        cutoff: float = np.inf,
        than: FloatArray | None = None,
    ) -> str | None:
        """How an answer contradicts the bounds, and where; None if it does not.

        Parameters
        ----------
        distance : (n,) float64
            The answer.
        sources : SourceSet
            What it is measured from.
        cutoff : float
            Beyond it distances may be ``inf``.
        than : (n,) float64, optional
            Distances from other sources; where these are not farther the answer may be ``inf``.
        """
        distance = np.ascontiguousarray(distance, np.float64)
        nearest = distance if than is None else np.minimum(distance, than)
        slack = ROUNDING * checking.largest_finite(nearest)
        return (
            self._at_sources(distance, sources, cutoff, slack)
            or self._elsewhere(distance, sources)
            or self._along_edges(nearest, cutoff, slack)
            or self._below_lines(distance, sources, slack)
        )

    def _at_sources(self, distance: FloatArray, sources: SourceSet, cutoff: float, slack: float) -> str | None:
        """Above what a source itself, or a straight line in its face, gives the vertices there."""
        vertices, bound = sources.vertices, sources.vertex_offset
        if not sources.on_vertices_alone and self._V is not None:
            places, offsets, faces = self._places(sources)
            corners = self._F[faces]
            line = np.linalg.norm(self._V[corners] - places[:, None], axis=2) + offsets[:, None]
            vertices = np.concatenate([vertices, corners.ravel()])
            bound = np.concatenate([bound, line.ravel()])
        above = ~(distance[vertices] <= bound + slack) & (bound <= cutoff)
        if above.any():
            at = int(np.argmax(above))
            return f"{distance[vertices[at]]:.6g} at vertex {vertices[at]}, where a source gives {bound[at]:.6g}"
        return None

    def contradiction_at(
        self, distance: FloatArray, sources: SourceSet, targets: SurfacePoints | IntArray
    ) -> str | None:
        """How distances (t,) of vertices or points contradict lines and components; None if they do not."""
        vertices = self._F[targets.faces, 0] if isinstance(targets, SurfacePoints) else targets
        if self._n_components == 1:
            stray = ~np.isfinite(distance)
        else:
            stray = np.isfinite(distance) != self._has_source(sources)[self._components[vertices]]
        if stray.any():
            at = int(np.argmax(stray))
            return f"{distance[at]:.6g} at target {at}, where sources and components say otherwise"
        if self._V is None:
            return None
        places = self._V[vertices]
        if isinstance(targets, SurfacePoints):
            places = np.einsum("kc,kcx->kx", targets.barycentric, self._V[self._F[targets.faces]])
        return self._below_lines(distance, sources, ROUNDING * checking.largest_finite(distance), places)

    def _elsewhere(self, distance: FloatArray, sources: SourceSet) -> str | None:
        """Finite where no source is."""
        if self._n_components == 1:
            return None
        stray = np.isfinite(distance) & ~self._has_source(sources)[self._components]
        if stray.any():
            return f"finite at vertex {int(np.argmax(stray))}, whose component holds no source"
        return None

    def _has_source(self, sources: SourceSet) -> BoolArray:
        """Mask of the components that hold a source."""
        has_source = np.zeros(self._n_components, bool)
        has_source[self._components[sources.vertices]] = True
        for faces in (sources.points.faces, sources.segments.faces):
            has_source[self._components[self._F[faces, 0]]] = True
        return has_source

    @cached_property
    def _n_components(self) -> int:
        return int(self._components.max(initial=0)) + 1

    def _along_edges(self, distance: FloatArray, cutoff: float, slack: float) -> str | None:
        V = _NO_LENGTHS if self._V is None else self._V
        far, near = checking.steepest_edge(distance, self._F, V, self._l, cutoff, slack)
        if far < 0:
            return None
        return f"{distance[far]:.6g} at vertex {far} and {distance[near]:.6g} at its neighbour {near}, which is nearer"

    def _below_lines(
        self, distance: FloatArray, sources: SourceSet, slack: float, at: FloatArray | None = None
    ) -> str | None:
        """Below the lines to vertices, or to positions `at` (t, 3)."""
        if self._V is None:
            return None
        places, offsets, faces = self._places(sources)
        places = np.concatenate([self._V[sources.vertices], places])
        offsets = np.concatenate([sources.vertex_offset, offsets - self._half_length(sources, len(faces))])
        step = -(-len(offsets) // _SOURCES_AT_ALL)
        found = checking.below_line(distance, self._V if at is None else at, step, places, offsets, slack)
        if found < 0:
            return None
        what = "vertex" if at is None else "target"
        return f"{distance[found]:.6g} at {what} {found}, which is farther from every source along a straight line"

    def _places(self, sources: SourceSet) -> tuple[FloatArray, FloatArray, IntArray]:
        """Positions (k, 3) of points and of both ends of segments, their offsets, and the faces that they are in."""
        points = sources.points.joined(sources.segments.ends())
        if self._V is None or not len(points.faces):
            return np.empty((0, 3)), points.offset, points.faces
        inside = np.einsum("kc,kcx->kx", points.barycentric, self._V[self._F[points.faces]])
        return inside, points.offset, points.faces

    def _half_length(self, sources: SourceSet, k: int) -> FloatArray:
        """Half the length of the segment that a place (k,) is an end of: no point of it is farther from both ends."""
        segments, half = sources.segments, np.zeros(k)
        if len(segments.faces) and self._V is not None:
            along = np.einsum("kc,kcx->kx", segments.end - segments.start, self._V[self._F[segments.faces]])
            half[k - 2 * len(along) :] = np.tile(0.5 * np.linalg.norm(along, axis=1), 2)
        return half


def contradicted(problem: str) -> RuntimeError:
    """The error for an answer that contradicts itself and that nothing replaces."""
    return RuntimeError(f"the distance contradicts itself ({problem}): {_REPORT}")


class GuardedEngine(Engine):
    """Windows with a check of every answer. A contradiction never leaves it.

    Parameters
    ----------
    windows : WindowEngine
        Asked first.
    invariants : Invariants
        What its answers keep.
    others : sequence of callables
        Engines to ask instead, each made when it is needed.

    Raises
    ------
    RuntimeError
        On a query, if the answers of all engines contradict the invariants.

    Warns
    -----
    AccuracyWarning
        On a query that another engine answered.
    """

    def __init__(self, windows: WindowEngine, invariants: Invariants, others: tuple[Callable[[], Engine], ...]) -> None:
        self.windows, self._invariants, self._others = windows, invariants, others

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        found = self.windows.distance(sources, cutoff, threads)
        problem = self.problem(found, sources, cutoff)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)[0]

    def nearer(self, sources: SourceSet, than: FloatArray, threads: int = 1) -> FloatArray:
        """As of all engines."""
        found = self.windows.nearer(sources, than, threads)
        if self._invariants.contradiction(found, sources, np.inf, than) is None:
            return found
        return super().nearer(sources, than, threads)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,), and the source (n,) that it is measured from."""
        found = self.windows.labelled(sources, cutoff, threads)
        problem = self.problem(found[0], sources, cutoff)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)

    def to_targets(self, sources: SourceSet, targets: SurfacePoints | IntArray) -> FloatArray:
        """Distance (t,) of points or vertices, see `WindowEngine.to_targets`."""
        found = self.windows.to_targets(sources, targets)
        problem = self._invariants.contradiction_at(found, sources, targets)
        if problem is None:
            return found
        if isinstance(targets, SurfacePoints):
            raise contradicted(problem)
        return self._replacement(problem, sources, np.inf, 1)[0][targets]

    def directed(self, sources: SourceSet) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """Distance and directions, see `WindowEngine.directed`: no other engine finds these."""
        found = self.windows.directed(sources)
        problem = self.problem(found[0], sources)
        if problem is not None:
            raise contradicted(problem)
        return found

    def problem(self, distance: FloatArray, sources: SourceSet, cutoff: float = np.inf) -> str | None:
        """How an answer (n,) contradicts the invariants; None if it does not."""
        return self._invariants.contradiction(distance, sources, cutoff)

    def _replacement(
        self, problem: str, sources: SourceSet, cutoff: float, threads: int
    ) -> tuple[FloatArray, IntArray]:
        for make in self._others:
            found = make().labelled(sources, cutoff, threads)
            if self.problem(found[0], sources, cutoff) is None:
                warn_caller(
                    f"the distance contradicted itself ({problem}) and was replaced by that of another method, which "
                    f"is less accurate: {_REPORT}",
                    AccuracyWarning,
                )
                return found
        raise contradicted(f"{problem}, whatever method finds it")


def guarded_windows(
    triangles: Triangles,
    V: FloatArray | None,
    originals: IntArray | None = None,
    other: Callable[[Triangles, IntArray | None], Engine] | None = None,
) -> GuardedEngine:
    """Windows on triangles with positions V (n, 3), if known; an `other` engine answers where they contradict
    themselves.

    Triangles and originals as for `WindowEngine`, and for the other engine.
    """
    components = triangles.components if originals is None else triangles.components[originals]
    if V is None:
        invariants = Invariants(triangles.faces.F, components, lengths=triangles.faces.l)
    else:
        invariants = Invariants(triangles.given_faces, components, V)
    windows = WindowEngine(triangles, originals)
    return GuardedEngine(windows, invariants, () if other is None else (partial(other, triangles, originals),))


def distances_instead(mesh: Mesh, vertices: IntArray) -> FloatArray:
    """Distances (k, n) from each of some vertices, in place of local answers that contradict themselves."""
    if not len(vertices):
        return np.empty((0, mesh.n_vertices))
    warn_caller(
        f"distances from vertex {vertices[0]} contradicted themselves ({len(vertices)} sources) and were found again "
        f"on the whole mesh: {_REPORT}",
        AccuracyWarning,
    )
    engine = guarded_windows(MeshTriangles(mesh), mesh.V)
    return np.stack([engine.distance(source_set(int(vertex), mesh.n_vertices, None)) for vertex in vertices])


def _as_thin_as_given(surface: Surface) -> Surface:
    """The surface without the lengthening that mollified edges got for the heat; it would lengthen paths as well.

    Mollified as little as windows need. A surface whose lengths are those of another metric is returned as it is.
    """
    given, faces = surface.given_faces, surface.faces
    if given is None or faces is None or surface.V is None or faces.lengthening == 0:
        return surface
    from heat_igl.operators import unfolding_surface

    added = faces.l - igl.edge_lengths(surface.V, faces.F)
    if np.abs(added - 0.5 * faces.lengthening).max() > 0.51 * faces.lengthening:
        return surface  # lengths of another metric
    return unfolding_surface(Mesh(surface.V, given), MARGIN)
