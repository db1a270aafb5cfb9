"""An interactive window by polyscope (extra ``view``): a click moves the source, and the distance is updated."""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from heat_igl.drawing.exploration import Exploration
from heat_igl.drawing.scene import DISTANCE_COLOURS, colours
from heat_igl.drawing.shading import isoline_spacing
from heat_igl.errors import MissingExtraError
from heat_igl.geodesic import DistanceMethod
from heat_igl.heat_method import Boundary
from heat_igl.typing import FloatArray

__all__ = ["Exploration", "Window", "display_problem"]

_METHODS = get_args(DistanceMethod)

_T_COEF = (0.1, 100.0)

# Largest movement of the mouse during a click, in pixels.
_STILL = 4.0


def display_problem() -> str | None:
    """The reason why no window can be opened, or None."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "there is no display"
    try:
        MissingExtraError.check("a window", "polyscope", "view")
    except MissingExtraError as error:
        return str(error)
    return None


class Window:
    """A polyscope window that shows an `Exploration`. A process can have one window.

    Parameters
    ----------
    exploration : Exploration
        The state that the window shows and changes.
    title : str
        Title of the window.
    exact : bool
        Whether the exact distance is shown beside it at first.

    Raises
    ------
    MissingExtraError
        If polyscope is not installed.
    RuntimeError
        If no window can be opened.
    """

    _MESH, _SOURCES, _EXACT, _COLOURS = "mesh", "sources", "exact", "distance"
    _DISTANCE, _LOG_MAP = "distance", "log map"

    def __init__(self, exploration: Exploration, title: str = "heat-igl", exact: bool = False) -> None:
        with MissingExtraError.guard("a window", "polyscope", "view"):
            import polyscope
            import polyscope.imgui
        self._ps: Any = polyscope
        self._gui: Any = polyscope.imgui
        self.exploration = exploration
        self._title = title
        self._shows_error = self._shows_directions = False
        self._shows_exact = exact
        self._field = self._DISTANCE
        ps, mesh = self._ps, exploration.mesh
        ps.set_program_name(title)
        ps.set_use_prefs_file(False)  # otherwise polyscope writes settings into the current directory
        ps.set_print_prefix("heat-igl: ")
        ps.set_verbosity(0)
        ps.init()
        ps.set_ground_plane_mode("none")
        self._load_colours()
        self._surface = self._registered(self._MESH, mesh.V)
        ps.set_user_callback(self.frame)
        self._show()

    def _registered(self, name: str, V: FloatArray) -> Any:
        """The surface, or the points of a cloud, at other positions."""
        mesh = self.exploration.mesh
        if self.exploration.is_cloud:
            points = self._ps.register_point_cloud(name, V)
            points.set_radius(0.4 * float(mesh.edge_lengths.mean()), relative=False)
            return points
        F = mesh.facets.vertices[mesh.facets.n_faces == 1] if mesh.is_tetrahedral else mesh.F
        surface = self._ps.register_surface_mesh(name, V, F, smooth_shade=True)
        surface.set_selection_mode("vertices_only")
        return surface

    def _load_colours(self) -> None:
        """Give polyscope the colours of pictures and pages, near and far alike: it reads them from an image."""
        from matplotlib.image import imsave

        table = colours(DISTANCE_COLOURS)(np.linspace(0, 1, 256))
        with tempfile.TemporaryDirectory() as folder:
            image = Path(folder) / "colours.png"
            imsave(image, table[None])
            self._ps.load_color_map(self._COLOURS, str(image))

    def run(self) -> None:
        """Show the window until it is closed."""
        self._ps.show()

    def frame(self) -> None:
        """Draw the controls and handle clicks; polyscope calls this once per frame."""
        gui, now = self._gui, self.exploration
        gui.TextUnformatted("Click: source here. Shift and click: one more, or one less.")
        changes: dict[str, Any] = {}
        method = self._pick_one("method", _METHODS, now.options.method)
        if method != now.options.method:
            changes["method"] = method
        if now.t_coef is not None:
            moved, t_coef = gui.SliderFloat("t / h^2", now.t_coef, *_T_COEF, flags=gui.ImGuiSliderFlags_Logarithmic)
            # The new time step is applied when the slider is released.
            self._t_coef = t_coef if moved else getattr(self, "_t_coef", now.t_coef)
            if gui.IsItemDeactivatedAfterEdit():
                changes["t_coef"] = float(self._t_coef)
            boundary = self._pick_one("boundary", get_args(Boundary), now.options.heat.boundary)
            if boundary != now.options.heat.boundary:
                changes["boundary"] = boundary
        if changes:
            now.change(**changes)
            self._shows_error = False
            self._show()
        if gui.Button("error against exact (takes seconds)"):
            now.compare()
            self._shows_error = now.error is not None
            self._show()
        # Folded at first, so that the surface in the middle of the window stays free.
        if gui.TreeNode("fields and scenes"):
            self._choose_fields()
            if gui.Button("save the scene as a page"):
                self._save()
            gui.TreePop()
        gui.TextUnformatted(now.message)
        vertex = self._clicked()
        if vertex is not None:
            now.choose(vertex, add=bool(gui.GetIO().KeyShift))
            self._shows_error = False
            self._show()

    def _choose_fields(self) -> None:
        """What is drawn: another field, directions, the exact distance beside."""
        gui, now = self._gui, self.exploration
        before = self._field, self._shows_directions, self._shows_exact
        maps = () if now.mesh.is_tetrahedral else (self._LOG_MAP,)
        self._field = self._pick_one("show", (self._DISTANCE, *maps, *now.fields), self._field)
        if maps:
            _, self._shows_directions = gui.Checkbox("directions", self._shows_directions)
        _, self._shows_exact = gui.Checkbox("exact beside it (takes seconds)", self._shows_exact)
        if (self._field, self._shows_directions, self._shows_exact) != before:
            self._shows_error = False
            self._show()

    def _save(self) -> None:
        target = Path(re.sub(r"[^\w.-]+", "-", self._title) + "-scene.html")
        try:
            self.exploration.page(self._title).save(target)
        except (OSError, ValueError) as problem:
            self.exploration.message = f"not saved: {problem}"
        else:
            self.exploration.message = f"saved {target.absolute()}"

    def _pick_one(self, label: str, choices: Sequence[str], current: str) -> str:
        _, index = self._gui.Combo(label, choices.index(current), list(choices))
        return choices[int(index)]

    def _clicked(self) -> int | None:
        """The vertex that was clicked in this frame, or None.

        The selection of polyscope is not used: a click with Shift does not change it, and it opens a panel.
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
        # A dot covers the vertex of the source.
        return int(self.exploration.sources[index]) if hit.structure_name == self._SOURCES else index

    def _show(self) -> None:
        now, ps = self.exploration, self._ps
        finite = np.isfinite(now.distance)
        largest = float(now.distance[finite].max()) or 1.0
        self._surface.remove_all_quantities()
        self._draw_distance(self._surface, now.distance, largest, self._field == "distance" and not self._shows_error)
        if now.error is not None:
            known = np.where(np.isfinite(now.error), now.error, 0.0)
            self._draw_signed(
                "error, percent of exact", known, float(np.quantile(np.abs(known), 0.99)), self._shows_error
            )
        if self._field in now.fields:
            known = np.where(np.isfinite(now.fields[self._field]), now.fields[self._field], 0.0)
            self._draw_signed(self._field, known, float(np.abs(known).max()), not self._shows_error)
        self._draw_paths(isoline_spacing(largest))
        self._draw_exact(largest)
        dots = ps.register_point_cloud(self._SOURCES, now.mesh.V[now.sources], color=(0.91, 0.0, 0.043))
        dots.set_radius(0.008)

    def _draw_distance(self, structure: Any, distance: FloatArray, largest: float, is_shown: bool) -> None:
        """A distance, with isolines on surfaces."""
        # Unreachable vertices take the colour of the farthest; the message counts them.
        known = np.where(np.isfinite(distance), distance, largest)
        options = {"enabled": is_shown, "vminmax": (0.0, largest), "cmap": self._COLOURS}
        if self.exploration.is_cloud:
            structure.add_scalar_quantity("distance", known, **options)
        else:
            structure.add_distance_quantity(
                "distance", known, stripe_size=isoline_spacing(largest), stripe_size_relative=False, **options
            )

    def _draw_signed(self, name: str, known: FloatArray, reach: float, is_shown: bool) -> None:
        """Values with white for 0."""
        limits = (-(reach or 1.0), reach or 1.0)
        self._surface.add_scalar_quantity(name, known, enabled=is_shown, vminmax=limits, cmap="coolwarm")

    def _draw_paths(self, spacing: float) -> None:
        """The log map of the sources as a checkerboard, and the directions of shortest paths, as far as asked for."""
        now = self.exploration
        if self._field == self._LOG_MAP and (vectors := now.log_map()) is not None:
            self._surface.add_parameterization_quantity(
                self._LOG_MAP, vectors, enabled=True, viz_style="checker", checker_size=spacing, coords_type="world"
            )  # fmt: skip
        if self._shows_directions and (found := now.directions()) is not None:
            self._surface.add_vector_quantity("directions", found.gradient, enabled=True, length=0.015, radius=0.001)

    def _draw_exact(self, largest: float) -> None:
        """The exact distance on a second surface beside the first."""
        now, ps = self.exploration, self._ps
        if not self._shows_exact:
            ps.remove_surface_mesh(self._EXACT, error_if_absent=False)
            ps.remove_point_cloud(self._EXACT, error_if_absent=False)
            return
        if now.exact is None:
            now.compare()
        if now.exact is not None:
            aside = np.array([1.15 * float(np.ptp(now.mesh.V[:, 0])), 0.0, 0.0])
            self._draw_distance(self._registered(self._EXACT, now.mesh.V + aside), now.exact, largest, True)
