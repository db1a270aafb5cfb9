"""An interactive window by polyscope (extra ``view``): a click moves the source, and the distance is updated."""

from __future__ import annotations

import os
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
from heat_igl.heat_method import Boundary, Refine

__all__ = ["Exploration", "Window", "display_problem"]

_REFINEMENTS = ("none", *get_args(Refine))

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

    Raises
    ------
    MissingExtraError
        If polyscope is not installed.
    RuntimeError
        If no window can be opened.
    """

    _MESH, _SOURCES, _COLOURS = "mesh", "sources", "distance"

    def __init__(self, exploration: Exploration, title: str = "heat-igl") -> None:
        with MissingExtraError.guard("a window", "polyscope", "view"):
            import polyscope
            import polyscope.imgui
        self._ps: Any = polyscope
        self._gui: Any = polyscope.imgui
        self.exploration = exploration
        self._shows_error = False
        ps, mesh = self._ps, exploration.mesh
        ps.set_program_name(title)
        ps.set_use_prefs_file(False)  # otherwise polyscope writes settings into the current directory
        ps.set_print_prefix("heat-igl: ")
        ps.set_verbosity(0)
        ps.init()
        ps.set_ground_plane_mode("none")
        self._load_colours()
        F = mesh.facets.vertices[mesh.facets.n_faces == 1] if mesh.is_tetrahedral else mesh.F
        self._surface = ps.register_surface_mesh(self._MESH, mesh.V, F, smooth_shade=True)
        self._surface.set_selection_mode("vertices_only")
        ps.set_user_callback(self.frame)
        self._show()

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
        moved, t_coef = gui.SliderFloat("t / h^2", now.t_coef, *_T_COEF, flags=gui.ImGuiSliderFlags_Logarithmic)
        # The new time step is applied when the slider is released.
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
        # Unreachable vertices take the colour of the farthest; the message counts them.
        self._surface.add_distance_quantity(
            "distance", np.where(finite, now.distance, largest), enabled=not self._shows_error, vminmax=(0.0, largest),
            stripe_size=isoline_spacing(largest), stripe_size_relative=False, cmap=self._COLOURS,
        )  # fmt: skip
        if now.error is not None:
            known = np.where(np.isfinite(now.error), now.error, 0.0)
            reach = float(np.quantile(np.abs(known), 0.99)) or 1.0
            self._surface.add_scalar_quantity(
                "error, percent of exact", known, enabled=True, vminmax=(-reach, reach), cmap="coolwarm"
            )
        dots = ps.register_point_cloud(self._SOURCES, now.mesh.V[now.sources], color=(0.91, 0.0, 0.043))
        dots.set_radius(0.008)
