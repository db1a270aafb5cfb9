"""What engines that measure distance along simplices have in common, and the triangles that they measure on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import igl
import numpy as np

from heat_igl.kernels.mesh import bounds
from heat_igl.mesh import Mesh
from heat_igl.sources import SourceSet
from heat_igl.typing import AnyArray, FloatArray, IntArray
from heat_igl.windows.exact import ExactSurface
from heat_igl.windows.tables import MARGIN, Tables, from_mesh, from_triangulation

if TYPE_CHECKING:
    from heat_igl.intrinsic import IntrinsicTriangulation
    from heat_igl.operators import MetricSimplices, Operators, Surface
    from heat_igl.sweep.simplex_derivative import SimplexDerivative

__all__ = ["ROUNDING", "Engine", "MeshTriangles", "OperatorTriangles", "SimplexEngine", "TriangleEngine", "Triangles"]

#: Share of a distance that is rounding.
ROUNDING = 1e-9
# With more sources that begin at different values, lines are bounded by the nearest one and the first value.
_MANY = 100


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


class SimplexEngine(Engine):
    """Distance from vertices through simplices that need not fit together, held between two bounds.

    Parameters
    ----------
    simplices : MetricSimplices
        The domain.
    """

    def __init__(self, simplices: MetricSimplices) -> None:
        self._simplices = simplices
        self._corners = np.ascontiguousarray(simplices.corners, np.int32)
        used = simplices.corners.ravel()
        self._incident = np.argsort(used, kind="stable").astype(np.int32)
        self._first = np.concatenate([[0], np.cumsum(np.bincount(used, minlength=simplices.n))]).astype(np.int32)

    @abstractmethod
    def _lower(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> None:
        """Lower distance (n,), which begins with the offsets of the vertices and ``inf``; label (n,) counts these."""

    @abstractmethod
    def derivative(self, sources: SourceSet) -> SimplexDerivative:
        """The distance from source vertices with its derivative."""

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:  # noqa: ARG002
        """Distance (n,), and the source (n,) that it is measured from."""
        distance, label = self._begun(sources)
        vertices, offset = sources.vertices.astype(np.int32), sources.vertex_offset
        self._lower(vertices, offset, distance, label)
        self._keep_bounds(vertices, offset, distance, label)
        return distance, np.concatenate([sources.vertex_label, [-1]])[label]

    def _begun(self, sources: SourceSet) -> tuple[FloatArray, AnyArray]:
        """Distance (n,), ``inf`` but at the sources, and the number (n,) of the source there, else -1."""
        distance, label = np.full(self._simplices.n, np.inf), np.full(self._simplices.n, -1, np.int32)
        distance[sources.vertices], label[sources.vertices] = sources.vertex_offset, np.arange(len(sources.vertices))
        return distance, label

    @cached_property
    def _edges(self) -> tuple[AnyArray, FloatArray]:
        pairs, lengths = self._simplices.edges
        return pairs.astype(np.int32), np.ascontiguousarray(lengths)

    def _keep_bounds(self, vertices: AnyArray, offset: FloatArray, distance: FloatArray, label: AnyArray) -> None:
        """Raise distance to what no path is shorter than, the straight line; lower it to paths along edges."""
        place, least = self._simplices.place, self._simplices.least
        if place is not None:
            if np.ptp(offset) == 0 or len(offset) > _MANY:
                from scipy.spatial import cKDTree

                line = least * cKDTree(place[vertices]).query(place)[0] + offset.min()
            else:
                line = np.full(len(place), np.inf)
                for vertex, start in zip(vertices, offset, strict=True):
                    np.minimum(line, start + least * np.linalg.norm(place - place[vertex], axis=1), out=line)
            line[vertices] = offset.min()
            np.maximum(distance, line * (1 - ROUNDING), out=distance)
        if bounds.is_longer(*self._edges, distance):
            labels = label.astype(np.int64)
            first, incident = bounds.incident_edges(self._edges[0], len(distance))
            bounds.shorten(*self._edges, first, incident, distance, labels)
            label[:] = labels


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
    """

    def __init__(self, mesh: Mesh, margin: float | None = MARGIN) -> None:
        self._mesh, self._margin = mesh, margin

    @property
    def components(self) -> IntArray:  # type: ignore[override]
        """Component label (n,) of each vertex."""
        return self._mesh.components

    @cached_property
    def surface(self) -> Surface:
        """The triangles with their history."""
        from heat_igl.operators import unfolding_surface

        return unfolding_surface(self._mesh, self._margin)

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
