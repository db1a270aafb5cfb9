"""What engines that measure distance along simplices have in common, and the triangles that they measure on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import igl
import numpy as np

from heat_igl.intrinsic import IntrinsicTriangulation
from heat_igl.mesh import Mesh
from heat_igl.operators import Operators, Surface, unfolding_surface
from heat_igl.sources import SourceSet
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding.half_edges import MARGIN, HalfEdges, from_mesh, from_triangulation

__all__ = ["Engine", "MeshTriangles", "OperatorTriangles", "Triangles"]


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


class Triangles(ABC):
    """A surface of triangles, with its components."""

    #: Component label (n,) of each vertex.
    components: IntArray

    @property
    @abstractmethod
    def surface(self) -> Surface:
        """The triangles, with their history, which carries points and curves to them."""

    @abstractmethod
    def half_edges(self) -> HalfEdges:
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
        return unfolding_surface(self._mesh, self._margin)

    @property
    def given_faces(self) -> IntArray:
        """The faces (m, 3) of the mesh."""
        return self._mesh.F

    def half_edges(self) -> HalfEdges:
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

    def half_edges(self) -> HalfEdges:
        """Tables for distance from vertices."""
        return from_triangulation(self._surface.unfolding)


def _as_thin_as_given(surface: Surface) -> Surface:
    """The surface without the lengthening that mollified edges got for the heat; it would lengthen paths as well.

    Mollified as little as windows need. A surface whose lengths are those of another metric is returned as it is.
    """
    given, faces = surface.given_faces, surface.faces
    if given is None or faces is None or surface.V is None or faces.lengthening == 0:
        return surface
    added = faces.l - igl.edge_lengths(surface.V, faces.F)
    if np.abs(added - 0.5 * faces.lengthening).max() > 0.51 * faces.lengthening:
        return surface  # lengths of another metric
    return unfolding_surface(Mesh(surface.V, given), MARGIN)
