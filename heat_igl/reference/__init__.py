"""Other people's geodesic solvers, each called the one way that is right, and bounds that need no solver."""

from heat_igl.reference.bounds import edge_paths, straight_lines
from heat_igl.reference.solvers import (
    EXACT_SOLVERS,
    Measured,
    close,
    exact,
    exact_solver,
    igl_heat,
    measured,
    meshlab,
    meshlab_border,
    meshlab_heat,
    potpourri3d_heat,
)

__all__ = [
    "EXACT_SOLVERS",
    "Measured",
    "close",
    "edge_paths",
    "exact",
    "exact_solver",
    "igl_heat",
    "measured",
    "meshlab",
    "meshlab_border",
    "meshlab_heat",
    "potpourri3d_heat",
    "straight_lines",
]
