"""A window in which a click moves the source and the distance follows: what it shows, apart from how.

`Exploration` is all that happens, without a window; `Window` draws it with polyscope (extra ``view``).
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from heat_igl import reference
from heat_igl.drawing.raster import isoline_spacing
from heat_igl.errors import FactorizationError, MissingExtraError, ReferenceSolverError
from heat_igl.heat_method import HeatMethodSolver, SolverOptions
from heat_igl.mesh import Mesh
from heat_igl.sources import Sources, vertex_sources
from heat_igl.steps import Boundary
from heat_igl.typing import FloatArray, IntArray
from heat_igl.unfolding import Refine

__all__ = ["Exploration", "Window", "display_problem"]

# Factored solvers to keep, since going back and forth between two settings is what one does.
_KEPT_SOLVERS = 4
_REFINEMENTS = ("none", *get_args(Refine))
_T_COEF = (0.1, 100.0)
# Pixels that the mouse may move during a click.
_STILL = 4.0


class Exploration:
    """A mesh, the sources chosen on it and the distance from them, always in step.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.
    sources : int, sequence of int, or (n,) mask of bool
        To start with.
    options : SolverOptions
        To start with.

    Attributes
    ----------
    mesh, options
        As given; `change` changes the options.
    sources : (k,) int64
        `choose` changes them.
    distance : (n,) float64
        From `sources` with `options`.
    t_coef : float
        The time step in use, in squared mean edge lengths.
    error : (n,) float64 or None
        Of `distance`, in percent of the exact distance, 0 at the sources and ``inf`` out of reach; None until
        `compare`, and again after any change.
    message : str
        One line for the user on what was done last, or what went wrong.

    Raises
    ------
    MeshError, SourceError, FactorizationError, MissingExtraError, ValueError
        As for `HeatMethodSolver`.
    """

    def __init__(self, mesh: Mesh, sources: Sources = 0, options: SolverOptions | None = None) -> None:
        self.mesh = mesh
        self.options = options or SolverOptions()
        self.sources: IntArray = vertex_sources(sources, mesh.n_vertices)
        self.error: FloatArray | None = None
        self._solvers: dict[SolverOptions, HeatMethodSolver] = {}
        self._solve(self.sources, self.options)

    def choose(self, vertex: int, add: bool = False) -> None:
        """Make `vertex` the source; with `add`, one more source, or none any more if it was one and not the last."""
        chosen = {vertex}
        if add:
            chosen = set(self.sources.tolist()) ^ {vertex} or {vertex}
        self._solve(vertex_sources(sorted(chosen), self.mesh.n_vertices), self.options)

    def change(self, **options: Any) -> None:
        """Change some of the options; what cannot be solved leaves all as it was, and `message` says why."""
        try:
            self._solve(self.sources, replace(self.options, **options))
        except (ValueError, FactorizationError, MissingExtraError) as error:
            self.message = str(error)

    def compare(self) -> None:
        """Find the error against exact distance, which takes seconds; `message` has its mean, or why there is none."""
        try:
            exact = reference.exact(self.mesh, self.sources)
        except (ReferenceSolverError, MissingExtraError) as problem:
            self.message = f"no exact distance: {problem}"
            return
        error = np.where(np.isfinite(exact), 0.0, np.inf)
        away = (exact > 0) & np.isfinite(exact)
        error[away] = 100 * (self.distance[away] / exact[away] - 1)
        self.error = error
        mean, largest = (float(of(np.abs(error[away]), initial=0.0)) for of in (np.sum, np.max))
        self.message = f"error {mean / max(int(away.sum()), 1):.3g} % in the mean, {largest:.3g} % at most"

    def _solve(self, sources: IntArray, options: SolverOptions) -> None:
        start = time.perf_counter()
        solver = self._solvers.pop(options, None)
        is_new = solver is None
        if solver is None:
            solver = HeatMethodSolver.from_options(self.mesh, options)
        self._solvers[options] = solver  # the last one used comes last
        while len(self._solvers) > _KEPT_SOLVERS:
            del self._solvers[next(iter(self._solvers))]
        self.distance = solver.distance(sources)
        self.t_coef = solver.t / solver.diagnostics.mean_edge_length**2
        self.sources, self.options, self.error = sources, options, None
        finite = np.where(np.isfinite(self.distance), self.distance, -1.0)
        self.message = (
            f"{1000 * (time.perf_counter() - start):.0f} ms{', factored anew' if is_new else ''}; farthest "
            f"{finite.max():.6g} at vertex {int(finite.argmax())}"
        )
        lost = int((finite < 0).sum())
        if lost:
            self.message += f"; {lost} vertices are out of reach"


def display_problem() -> str | None:
    """Why no window can be opened here; None where nothing speaks against it."""
    from importlib.util import find_spec

    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display"
    if find_spec("polyscope") is None:
        return str(MissingExtraError.of("a window", "polyscope", "view"))
    return None


class Window:
    """A polyscope window on an `Exploration`; there can be one per process.

    Parameters
    ----------
    exploration : Exploration
        Changed by what the user does.
    title : str
        Of the window.

    Raises
    ------
    MissingExtraError
        If polyscope is not installed.
    RuntimeError
        If no window can be opened.
    """

    _MESH, _SOURCES = "mesh", "sources"

    def __init__(self, exploration: Exploration, title: str = "heat-igl") -> None:
        try:
            import polyscope
            import polyscope.imgui
        except ImportError:
            raise MissingExtraError.of("a window", "polyscope", "view") from None
        self._ps: Any = polyscope
        self._gui: Any = polyscope.imgui
        self.exploration = exploration
        self._shows_error = False
        ps, mesh = self._ps, exploration.mesh
        ps.set_program_name(title)
        ps.set_use_prefs_file(False)  # no settings left behind in the current directory
        ps.set_print_prefix("heat-igl: ")
        ps.set_verbosity(0)
        ps.init()
        ps.set_ground_plane_mode("none")
        F = mesh.facets.vertices[mesh.facets.n_faces == 1] if mesh.is_tetrahedral else mesh.F
        self._surface = ps.register_surface_mesh(self._MESH, mesh.V, F, smooth_shade=True)
        self._surface.set_selection_mode("vertices_only")
        ps.set_user_callback(self.frame)
        self._show()

    def run(self) -> None:
        """Show the window until it is closed."""
        self._ps.show()

    def frame(self) -> None:
        """What happens once per frame: the controls, and the vertex that was clicked."""
        gui, now = self._gui, self.exploration
        gui.TextUnformatted("Click: source here. Shift and click: one more, or one less.")
        moved, t_coef = gui.SliderFloat("t / h^2", now.t_coef, *_T_COEF, flags=gui.ImGuiSliderFlags_Logarithmic)
        # Factoring follows when the slider is let go.
        self._t_coef = t_coef if moved else getattr(self, "_t_coef", now.t_coef)
        changes: dict[str, Any] = {}
        if gui.IsItemDeactivatedAfterEdit():
            changes["t_coef"] = float(self._t_coef)
        boundary = self._pick_one("boundary", get_args(Boundary), now.options.boundary)
        if boundary != now.options.boundary:
            changes["boundary"] = boundary
        if not now.mesh.is_tetrahedral:
            refine = self._pick_one("refine", _REFINEMENTS, now.options.refine or "none")
            if refine != (now.options.refine or "none"):
                changes["refine"] = None if refine == "none" else refine
        if changes:
            now.change(**changes)
            self._shows_error = False
            self._show()
        if gui.Button("error against exact (takes seconds)"):
            now.compare()
            self._shows_error = now.error is not None
            self._show()
        gui.TextUnformatted(now.message)
        vertex = self._clicked()
        if vertex is not None:
            now.choose(vertex, add=bool(gui.GetIO().KeyShift))
            self._shows_error = False
            self._show()

    def _pick_one(self, label: str, choices: Sequence[str], current: str) -> str:
        _, index = self._gui.Combo(label, choices.index(current), list(choices))
        return choices[int(index)]

    def _clicked(self) -> int | None:
        """The vertex under a mouse button that was pressed and let go in one place.

        Not polyscope's own selection, which a click with Shift does not change, and which opens a panel.
        """
        gui, ps = self._gui, self._ps
        ps.reset_selection()
        io = gui.GetIO()
        if not gui.IsMouseReleased(gui.ImGuiMouseButton_Left) or io.WantCaptureMouse:
            return None
        if np.hypot(*gui.GetMouseDragDelta(gui.ImGuiMouseButton_Left)) > _STILL:
            return None
        hit = ps.pick(screen_coords=tuple(gui.GetMousePos()))
        if not hit.is_hit:
            return None
        index = int(hit.structure_data["index"])
        # A dot hides the vertex that it marks.
        return int(self.exploration.sources[index]) if hit.structure_name == self._SOURCES else index

    def _show(self) -> None:
        now, ps = self.exploration, self._ps
        finite = np.isfinite(now.distance)
        largest = float(now.distance[finite].max()) or 1.0
        self._surface.remove_all_quantities()
        # What is out of reach takes the colour of the farthest; the message says how many vertices that are.
        self._surface.add_distance_quantity(
            "distance", np.where(finite, now.distance, largest), enabled=not self._shows_error, vminmax=(0.0, largest),
            stripe_size=isoline_spacing(largest), stripe_size_relative=False, cmap="viridis",
        )  # fmt: skip
        if now.error is not None:
            known = np.where(np.isfinite(now.error), now.error, 0.0)
            reach = float(np.quantile(np.abs(known), 0.99)) or 1.0
            self._surface.add_scalar_quantity(
                "error, percent of exact", known, enabled=True, vminmax=(-reach, reach), cmap="coolwarm"
            )
        dots = ps.register_point_cloud(self._SOURCES, now.mesh.V[now.sources], color=(0.91, 0.0, 0.043))
        dots.set_radius(0.008)
