"""`GuardedEngine`: an engine whose answers are checked, and replaced where they contradict themselves."""

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
from heat_igl.windows.engine import Engine, MeshTriangles, Triangles
from heat_igl.windows.invariants import Invariants
from heat_igl.windows.window_engine import WindowEngine

if TYPE_CHECKING:
    from heat_igl.windows.directions import PathAngles

__all__ = ["GuardedEngine", "contradicted", "distances_instead", "guarded_windows"]

_REPORT = "please report this as a bug, with the mesh and the sources"


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
    tolerance : float
        Violations by this share of the largest distance are no contradiction.
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

    def __init__(
        self, windows: WindowEngine, invariants: Invariants, tolerance: float, others: tuple[Callable[[], Engine], ...]
    ) -> None:
        self.windows, self._invariants, self._tolerance, self._others = windows, invariants, tolerance, others

    def distance(self, sources: SourceSet, cutoff: float = np.inf, threads: int = 1) -> FloatArray:
        """Distance (n,)."""
        found = self.windows.distance(sources, cutoff, threads)
        problem = self.problem(found, sources, cutoff)
        return found if problem is None else self._replacement(problem, sources, cutoff, threads)[0]

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
        return self._invariants.contradiction(distance, sources, cutoff, self._tolerance)

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
    triangles: Triangles, V: FloatArray | None, tolerance: float = 0.0, originals: IntArray | None = None
) -> GuardedEngine:
    """Windows on triangles with positions V (n, 3), if known; a sweep answers where they contradict themselves.

    Other arguments as for `WindowEngine`.
    """
    components = triangles.components if originals is None else triangles.components[originals]
    if V is None:
        invariants = Invariants(triangles.faces.F, components, lengths=triangles.faces.l)
    else:
        invariants = Invariants(triangles.given_faces, components, V)
    windows = WindowEngine(triangles, originals)
    return GuardedEngine(windows, invariants, tolerance, (partial(_sweep, triangles, originals),))


def _sweep(triangles: Triangles, originals: IntArray | None) -> Engine:
    from heat_igl.sweep.sweep import SweepEngine

    return SweepEngine(triangles, originals)


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
