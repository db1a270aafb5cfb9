"""Distance engines on triangles, the surfaces on which they measure, and their queries."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSurface
from heat_igl.windows.tables import MARGIN, Tables, from_mesh, from_triangulation

if TYPE_CHECKING:
    from heat_igl.intrinsic import IntrinsicTriangulation
    from heat_igl.operators import Operators, Surface
    from heat_igl.windows.directions import PathAngles, PathDirections

# Distance (n,), nearest source (n,), and a complaint about them.
Answer = tuple[FloatArray, IntArray, str | None]


class Engine(ABC):
    """Distance from sets of sources, without heat."""

    @abstractmethod
    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,) and nearest source (n,), counted as by the user, -1 for none.

        A search may end at the cutoff; vertices that it has not reached are ``inf``. It may use `threads` threads.
        """

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """The distance of `labelled` alone."""
        return self.labelled(sources, cutoff, threads)[0]

    def answer(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> Answer:
        """What `labelled` returns, and the text of a warning about the distance, if one is due."""
        return *self.labelled(sources, cutoff, threads), None


class ComponentEngine(Engine):
    """Engines that measure on components of their own: that of each vertex by its number in `which` (n,)."""

    def __init__(self, engines: list[Engine], which: AnyArray) -> None:
        self._engines, self._which = engines, which.astype(np.int64)

    def of(self, sources: SourceSet) -> Engine:
        """The engine on the components of source vertices; this one if there are several."""
        numbers = np.unique(self._which[sources.vertices])
        engine = self._engines[numbers[0]] if len(numbers) == 1 else self
        return engine.of(sources) if isinstance(engine, ComponentEngine) and engine is not self else engine

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,) and nearest source (n,)."""
        return self.answer(sources, cutoff, threads)[:2]

    def answer(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> Answer:
        """Those of each engine on its components, and what they complain of."""
        distance, labels = np.full(len(self._which), np.inf), np.full(len(self._which), -1)
        complaints: list[str] = []
        for number, engine in enumerate(self._engines):
            own = sources.among(self._which == number)
            if len(own.vertices):
                found, nearest, complaint = engine.answer(own, cutoff, threads)
                is_there = self._which == number
                distance[is_there], labels[is_there] = found[is_there], nearest[is_there]
                complaints += [complaint] if complaint else []
        return distance, labels, "; ".join(complaints) or None


class Triangles(ABC):
    """A surface of triangles, with its components."""

    #: Component label (n,) of each vertex.
    components: IntArray

    @property
    @abstractmethod
    def surface(self) -> Surface:
        """The triangles with their history of flips, which maps points and curves to them."""

    @abstractmethod
    def tables(self) -> Tables:
        """Tables for distance from vertices, which needs no history."""

    @property
    def mean_edge_length(self) -> float:
        """Mean length of the edges that paths cross."""
        return self.surface.unfolding.mean_edge_length

    @property
    def given_faces(self) -> IntArray:
        """Vertices (m, 3) of the triangles that points and curves refer to."""
        return self.surface.given_faces

    @property
    def faces(self) -> IntrinsicTriangulation:
        """The triangles before any flip."""
        return self.surface.faces


class MeshTriangles(Triangles):
    """The triangles of a mesh, thin ones mollified by `margin`, see `mollify`. `orients`: see `intrinsic_delaunay`."""

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
    """The triangles of a domain that has operators, or another `surface` of it; a ValueError if they have none."""

    def __init__(self, domain: Operators, surface: Surface | None = None) -> None:
        if not domain.has_surface:
            raise ValueError("distance is unfolded along triangles, and this domain has none")
        self._domain, self._surface = domain, surface

    @cached_property
    def components(self) -> IntArray:  # type: ignore[override]
        """Component label (n,) of each vertex."""
        return self._domain.components[: self.surface.unfolding.n]

    @cached_property
    def surface(self) -> Surface:
        """The triangles with their history."""
        surface = cast("Surface", self._surface or self._domain.surface)
        # The margin of the heat method would lengthen paths. Lengths without positions are those of another metric.
        if surface.V is not None and surface.faces.lengthening != 0:
            from heat_igl.operators import unfolding_surface

            return unfolding_surface(Mesh(surface.V, surface.given_faces), MARGIN)
        return surface

    @property
    def given_faces(self) -> IntArray:
        """As for `Triangles`; those of a mesh are known before its operators."""
        mesh = getattr(self._domain, "mesh", None)
        return super().given_faces if mesh is None else mesh.F

    def tables(self) -> Tables:
        """Tables for distance from vertices."""
        return from_triangulation(self.surface.unfolding)


@dataclass(frozen=True, eq=False)
class Query:
    """Sources with offsets relative to the smallest offset of their component, since tolerances are relative.

    `begin` (n,) is this smallest offset in the component of each vertex; None if all offsets are 0.
    """

    sources: SourceSet
    begin: FloatArray | None

    @classmethod
    def of(cls, sources: SourceSet, triangles: Triangles) -> Query:
        """The query for a set of sources."""
        if not sources.offsets.any():
            return cls(sources, None)
        components, F = triangles.components, triangles.given_faces
        at = np.concatenate([sources.vertices, F[sources.points.faces, 0], F[sources.segments.faces, 0]])
        # The value on components without sources is arbitrary.
        earliest = np.full(int(components.max()) + 1, np.inf)
        np.minimum.at(earliest, components[at], sources.offsets)
        return cls(sources.with_offsets(sources.offsets - earliest[components[at]]), earliest[components])

    def cutoff(self, cutoff: float) -> float:
        """The cutoff of the search, relative to the smallest offset."""
        return cutoff if self.begin is None else cutoff - float(self.begin[np.isfinite(self.begin)].min())

    def with_begin(self, distance: FloatArray, at: IntArray | None = None) -> FloatArray:
        """Distances of vertices `at` (k,), or of the first k, from the sources with their given offsets."""
        if self.begin is None:
            return distance
        begin = self.begin[: len(distance)] if at is None else self.begin[at]
        return distance + np.where(np.isfinite(distance), begin, 0.0)


class TriangleEngine(Engine):
    """An engine on triangles, with the exact surfaces for points and curves."""

    def __init__(self, triangles: Triangles) -> None:
        self._triangles = triangles

    @cached_property
    def on_delaunay(self) -> ExactSurface:
        """The Delaunay triangles, to which points are mapped."""
        return ExactSurface(self._triangles.surface.unfolding)

    @cached_property
    def on_faces(self) -> ExactSurface:
        """The faces before any flip, in which curves lie."""
        return ExactSurface(self._triangles.faces)


class WindowEngine(TriangleEngine):
    """Distance by windows, directions and paths: all exact."""

    def __init__(self, triangles: Triangles) -> None:
        super().__init__(triangles)
        # Created here, since nearly every query needs it; surfaces for points, curves and paths are created on demand.
        self._from_vertices = ExactSurface(triangles.tables())

    @cached_property
    def _directions(self) -> PathDirections:
        """Polar angles of the paths; a `MeshError` where vertices have no tangent plane."""
        from heat_igl.windows.directions import PathDirections

        return PathDirections(self._triangles.surface)

    @cached_property
    def _curve_directions(self) -> PathDirections:
        """Polar angles of the paths on the faces before any flip."""
        from heat_igl.windows.directions import PathDirections

        return PathDirections(replace(self._triangles.surface, triangulation=self._triangles.faces, uncovered=None))

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        query = Query.of(sources, self._triangles)
        return query.with_begin(self._surface(query.sources).distance(query.sources, query.cutoff(cutoff), threads))

    def nearer(self, sources: SourceSet, than: FloatArray, threads: int = 1) -> FloatArray:
        """Distance (n,) where it is smaller than `than` (n,), the distance from others, else ``inf``: it ends there."""
        return self._surface(sources).distance(sources, float(than.max()), threads, than)

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,) and nearest source (n,)."""
        query = Query.of(sources, self._triangles)
        found = self._surface(query.sources).solve(query.sources, cutoff=query.cutoff(cutoff), threads=threads)
        return query.with_begin(found.distance), sources.labels[found.origin.label]

    def _surface(self, sources: SourceSet, *, locates: bool = False) -> ExactSurface:
        """The surface to search on; with `locates`, one that can locate points of the mesh."""
        if len(sources.segments.faces):
            return self.on_faces
        return self.on_delaunay if locates or not sources.on_vertices_alone else self._from_vertices

    def to_targets(self, sources: SourceSet, targets: SurfacePoints | IntArray) -> FloatArray:
        """Distance (t,) of points or vertices; the search ends when all of them are known."""
        query = Query.of(sources, self._triangles)
        if not isinstance(targets, SurfacePoints):
            found = self._surface(query.sources).solve(query.sources, goals=targets)
            return query.with_begin(found.distance)[targets]
        surface = self._surface(query.sources, locates=True)
        found = surface.solve(query.sources, targets=targets, goals=np.empty(0, np.int64))
        return query.with_begin(found.target_distance, self._triangles.given_faces[targets.faces, 0])

    def directed(self, sources: SourceSet) -> tuple[FloatArray, IntArray, PathAngles, SurfacePoints]:
        """Distance (n,), labels (n,), and the directions and start points of the shortest paths, all exact.

        A MeshError if vertices have no tangent plane, see `polar_angles`.
        """
        query = Query.of(sources, self._triangles)
        directions = self._curve_directions if len(sources.segments.faces) else self._directions
        found = self._surface(query.sources, locates=True).solve(query.sources, directed=True)
        distance, labels = query.with_begin(found.distance), sources.labels[found.origin.label]
        return distance, labels, *directions.of_windows(found, sources)
