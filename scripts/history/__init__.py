"""What airspeed velocity measures: methods and meshes of the harness, and the first distance of a new interpreter.

asv run --python=same --quick           # once, of what is installed
asv run v1.0..main && asv publish       # the history; each commit is built anew
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))

from heat_igl import GeodesicSolver

from harness import METHODS, errors, sample

MESHES, SOURCE = ("cow", "bunny"), 1234


class Distance:
    """Seconds to make a solver and to answer a query, and the mean error in percent."""

    params = (["heat", "sweep", "exact"], MESHES)
    param_names = ("method", "mesh")

    def setup(self, method: str, mesh: str) -> None:
        self.mesh, self.prepare = sample(mesh), METHODS[method].prepare
        self.query = self.prepare(self.mesh)
        self.query(SOURCE)

    def time_preparation(self, method: str, mesh: str) -> None:
        self.prepare(self.mesh)

    def time_query(self, method: str, mesh: str) -> None:
        self.query(SOURCE)

    def track_error(self, method: str, mesh: str) -> float:
        return errors(self.query(SOURCE), GeodesicSolver(self.mesh, method="exact").distance(SOURCE))["mean"]

    track_error.unit = "%"


class FirstDistance:
    """Seconds from a new interpreter to a distance."""

    def timeraw_import_and_distance(self) -> str:
        return "import heat_igl; heat_igl.geodesic_distance(heat_igl.shapes.icosphere(3), 0)"
