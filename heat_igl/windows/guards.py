"""Results of windows that violate the invariants of distances are replaced by those of another engine."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from heat_igl.errors import AccuracyWarning
from heat_igl.mesh import Mesh, SurfacePoints
from heat_igl.runtime import warn_caller
from heat_igl.sources import SourceSet, source_set
from heat_igl.typing import FloatArray, IntArray
from heat_igl.windows.engine import Engine, MeshTriangles, Triangles, WindowEngine
from heat_igl.windows.exact import EndlessSearchError
from heat_igl.windows.invariants import Invariants

if TYPE_CHECKING:
    from heat_igl.windows.directions import PathAngles

_REPORT = "please report this as a bug, with the mesh and the sources"


def contradicted(problem: str) -> RuntimeError:
    """The error for a distance that violates the bounds if no other engine can replace it."""
    return RuntimeError(f"the distance contradicts itself ({problem}): {_REPORT}")


class GuardedEngine(Engine):
    """Windows with a check of every result, so that no result that violates the invariants is returned.

    Such a result is replaced by that of the first of the `others` that satisfies them, created on demand, with an
    `AccuracyWarning`; a RuntimeError if none does.
    """

    def __init__(self, windows: WindowEngine, invariants: Invariants, others: tuple[Callable[[], Engine], ...]) -> None:
        self.windows, self._invariants, self._others = windows, invariants, others

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        try:
            found = self.windows.distance(sources, cutoff, threads)
            problem = self._invariants.contradiction(found, sources, cutoff)
        except EndlessSearchError as error:
            problem = str(error)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)[0]

    def nearer(self, sources: SourceSet, than: FloatArray, threads: int = 1) -> FloatArray:
        """Distance (n,) where it is smaller than `than`, see `WindowEngine`."""
        try:
            found = self.windows.nearer(sources, than, threads)
            is_wrong = self._invariants.contradiction(found, sources, np.inf, than) is not None
        except EndlessSearchError:
            is_wrong = True
        if is_wrong:
            found = self.distance(sources, float(than.max()), threads)
            found[found >= than] = np.inf
        return found

    def labelled(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> tuple[FloatArray, IntArray]:
        """Distance (n,) and nearest source (n,)."""
        try:
            found = self.windows.labelled(sources, cutoff, threads)
            problem = self._invariants.contradiction(found[0], sources, cutoff)
        except EndlessSearchError as error:
            problem = str(error)
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
        """Distance and directions, see `WindowEngine.directed`; no other engine computes directions."""
        found = self.windows.directed(sources)
        problem = self._invariants.contradiction(found[0], sources)
        if problem is not None:
            raise contradicted(problem)
        return found

    def _replacement(
        self, problem: str, sources: SourceSet, cutoff: float, threads: int
    ) -> tuple[FloatArray, IntArray]:
        for make in self._others:
            found = make().labelled(sources, cutoff, threads)
            if self._invariants.contradiction(found[0], sources, cutoff) is None:
                warn_caller(
                    f"the distance contradicted itself ({problem}) and was replaced by that of another method, which "
                    f"is less accurate: {_REPORT}",
                    AccuracyWarning,
                )
                return found
        raise contradicted(f"{problem}, whatever method finds it")


def guarded_windows(
    triangles: Triangles, V: FloatArray | None, other: Callable[[Triangles], Engine] | None = None
) -> GuardedEngine:
    """Windows on triangles with positions V (n, 3), if known; an `other` engine answers where they contradict
    themselves.
    """
    components = triangles.components
    if V is None:
        invariants = Invariants(triangles.faces.F, components, lengths=triangles.faces.l)
    else:
        invariants = Invariants(triangles.given_faces, components, V)
    return GuardedEngine(WindowEngine(triangles), invariants, () if other is None else (partial(other, triangles),))


def distances_instead(mesh: Mesh, vertices: IntArray) -> FloatArray:
    """Distances (k, n) from each vertex, to replace results of local searches that violate the invariants."""
    if not len(vertices):
        return np.empty((0, mesh.n_vertices))
    warn_caller(
        f"distances from vertex {vertices[0]} contradicted themselves ({len(vertices)} sources) and were found again "
        f"on the whole mesh: {_REPORT}",
        AccuracyWarning,
    )
    engine = guarded_windows(MeshTriangles(mesh), mesh.V)
    return np.stack([engine.distance(source_set(int(vertex), mesh.n_vertices, None)) for vertex in vertices])
