"""The state behind an interactive view: a mesh, sources, options and the distance. No window is involved."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from heat_igl import reference
from heat_igl.drawing.html_view import Page, page
from heat_igl.errors import FactorizationError, MeshError, MissingExtraError, ReferenceSolverError
from heat_igl.geodesic import GeodesicSolver, Solver, SolverChoice
from heat_igl.heat_method import Directions, HeatMethodSolver
from heat_igl.mesh import MeshLike, PointCloud, as_mesh, as_simplices
from heat_igl.sources import Sources, vertex_sources
from heat_igl.typing import ArrayLike, FloatArray, IntArray

__all__ = ["Exploration"]

# Number of solvers to keep, since users alternate between a few settings.
_KEPT_SOLVERS = 4


class Exploration:
    """A mesh with sources, options and the distance, which is updated after every change.

    Parameters
    ----------
    mesh : mesh
        Triangles or tetrahedra, as `as_mesh` takes them, or a `PointCloud`.
    sources : int, sequence of int, or (n,) mask of bool
        Initial source vertices.
    options : SolverChoice
        Initial method and options.
    fields : dict of str to (n,) array_like, optional
        More values to show, such as a signed distance; they do not change.

    Attributes
    ----------
    mesh, options
        Triangles or tetrahedra, and the current options (see `change`).
    is_cloud : bool
        Whether the vertices of the mesh are the points of a cloud.
    fields : dict of str to (n,) float64
        As given.
    sources : (k,) int64
        The current source vertices (see `choose`).
    distance : (n,) float64
        Distance from `sources` with `options`.
    plan : Plan
        The engine in use.
    t_coef : float or None
        The time step of heat, in squared mean edge lengths; None with other engines.
    error : (n,) float64 or None
        Error of `distance` in percent of the exact distance, 0 at the sources and ``inf`` at unreachable vertices.
        `compare` computes it; any change resets it to None.
    exact : (n,) float64 or None
        The exact distance that `error` is against.
    message : str
        One line for the user: the result of the last change, or the error.

    Raises
    ------
    MeshError, SourceError, FactorizationError, MissingExtraError, ValueError
        As for `HeatMethodSolver`.
    """

    def __init__(
        self,
        mesh: MeshLike,
        sources: Sources = 0,
        options: SolverChoice | None = None,
        fields: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        given = as_mesh(mesh)
        self.is_cloud = isinstance(given, PointCloud)
        self.mesh = as_simplices(given)
        # A solver knows more about points than about their triangles.
        self._domain = given if self.is_cloud else self.mesh
        self.fields = {name: np.asarray(values, np.float64) for name, values in (fields or {}).items()}
        self._paths: GeodesicSolver | None = None
        self._directions: Directions | None = None
        self.options = options or SolverChoice()
        self.sources: IntArray = vertex_sources(sources, self.mesh.n_vertices)
        self.error: FloatArray | None = None
        self.exact: FloatArray | None = None
        self._solvers: dict[SolverChoice, Solver] = {}
        self._solve(self.sources, self.options)

    def choose(self, vertex: int, add: bool = False) -> None:
        """Make `vertex` the only source. With `add`, add it to the sources, or remove it if it is one of several."""
        chosen = {vertex}
        if add:
            chosen = set(self.sources.tolist()) ^ {vertex} or {vertex}
        self._solve(vertex_sources(sorted(chosen), self.mesh.n_vertices), self.options)

    def change(self, **options: Any) -> None:
        """Change options. If the solver fails, nothing changes, and `message` gives the reason."""
        try:
            self._solve(self.sources, self.options.changed(**options))
        except (ValueError, FactorizationError, MissingExtraError) as error:
            self.message = str(error)

    def compare(self) -> None:
        """Compute `error` against exact distance, which takes seconds; `message` gives the mean or the failure."""
        try:
            exact = reference.exact(self.mesh, self.sources)
        except (ReferenceSolverError, MissingExtraError) as problem:
            self.message = f"no exact distance: {problem}"
            return
        error = np.where(np.isfinite(exact), 0.0, np.inf)
        away = (exact > 0) & np.isfinite(exact)
        error[away] = 100 * (self.distance[away] / exact[away] - 1)
        self.error, self.exact = error, exact
        mean, largest = (float(of(np.abs(error[away]), initial=0.0)) for of in (np.sum, np.max))
        self.message = f"error {mean / max(int(away.sum()), 1):.3g} % in the mean, {largest:.3g} % at most"

    def directions(self) -> Directions | None:
        """Distance and directions of the shortest paths from `sources`; None, with a `message`, if there are none."""
        if self._directions is None:
            try:
                if self._paths is None:
                    self._paths = GeodesicSolver(self.mesh)
                self._directions = self._paths.directions(self.sources)
            except (MeshError, ValueError) as problem:
                self.message = f"no directions: {problem}"
        return self._directions

    def log_map(self) -> FloatArray | None:
        """The logarithmic map (n, 2) of the nearest source, 0 where none is reached; None as for `directions`."""
        found = self.directions()
        if found is None:
            return None
        length = np.where(np.isfinite(found.distance), found.distance, 0.0)
        return np.stack([length * np.cos(found.departure), length * np.sin(found.departure)], axis=1)

    def page(self, title: str, method: str | None = None) -> Page:
        """A page with the distance, the given fields, and the exact distance if it is known.

        Parameters
        ----------
        title : str
            Title of the page.
        method : str, optional
            Description of the distance; `message` by default.
        """
        exact = {} if self.exact is None else {"exact": self.exact}
        shown = self._domain if self.is_cloud else self.mesh
        return page(
            shown, self.distance, sources=self.sources, title=title, method=method or self.message,
            fields={**exact, **self.fields}, beside=next(iter({**exact, **self.fields}), None),
        )  # fmt: skip

    def _solve(self, sources: IntArray, options: SolverChoice) -> None:
        start = time.perf_counter()
        solver = self._solvers.pop(options, None)
        is_new = solver is None
        if solver is None:
            solver = options.on(self._domain)
        self._solvers[options] = solver  # the dictionary is ordered by last use
        while len(self._solvers) > _KEPT_SOLVERS:
            del self._solvers[next(iter(self._solvers))]
        self.distance = solver.distance(sources)
        self.plan = solver.plan
        self.t_coef: float | None = None
        if isinstance(solver, HeatMethodSolver):
            self.t_coef = solver.t / solver.diagnostics.mean_edge_length**2
        self.sources, self.options, self.error, self.exact = sources, options, None, None
        self._directions = None
        finite = np.where(np.isfinite(self.distance), self.distance, -1.0)
        self.message = (
            f"{1000 * (time.perf_counter() - start):.0f} ms{', prepared anew' if is_new else ''}; farthest "
            f"{finite.max():.6g} at vertex {int(finite.argmax())}"
        )
        lost = int((finite < 0).sum())
        if lost:
            self.message += f"; {lost} vertices are out of reach"
