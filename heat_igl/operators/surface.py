"""`Surface`: the triangles of a domain, for layouts in the plane and walks from face to face."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from heat_igl.intrinsic import IntrinsicTriangulation, Merged
from heat_igl.typing import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Surface:
    """The triangles along which distance is measured on a domain.

    Attributes
    ----------
    triangulation : IntrinsicTriangulation
        The triangles that the operators belong to: their edges are straight lines from sources.
    faces : IntrinsicTriangulation or None
        The triangles before any flip, but each once: points and curves are carried to them. None if not known.
    uncovered : IntrinsicTriangulation or None
        The surface itself, each face once and without added vertices, if `triangulation` is the tufted cover, which
        has each face twice, or a refinement.
    V : (n, 3) float64 or None
        Positions of the vertices; None if not known.
    """

    triangulation: IntrinsicTriangulation
    faces: IntrinsicTriangulation | None = None
    uncovered: IntrinsicTriangulation | None = None
    V: FloatArray | None = None

    @property
    def unfolding(self) -> IntrinsicTriangulation:
        """The triangles to unfold paths in: on the cover a path over an edge of five faces goes on in one face only."""
        return self.triangulation if self.uncovered is None else self.uncovered

    @cached_property
    def given_faces(self) -> IntArray | None:
        """Vertices (m, 3) of the triangles that points and curves refer to; None without `faces`."""
        if self.faces is None:
            return None
        F = self.faces.F
        for move in self.faces.history:
            if isinstance(move, Merged):
                F = move.before(F)
        return F
