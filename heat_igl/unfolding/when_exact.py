"""When exact windows are taken although walks or sweeps were asked for."""

from __future__ import annotations

from heat_igl.unfolding.numbered import TOLERANCE, NumberedTriangles
from heat_igl.unfolding.refinement import Refine

__all__ = ["FEW", "costs_little_to_be_exact", "curve_directions_by_windows", "directions_by_windows"]

# In components of up to so many vertices distance is found by exact windows, whatever was asked for.
FEW = 1000
# So it is with so much curvature at each vertex (radians, in the mean). There walks pass vertices on the wrong side:
# 0.7 to 3.4 % of the largest distance on plates, beams, voxels and terrain, most with 0.5 to 3 radians, and up to
# 0.46 % on a coarse cow with 0.14, which is too much for them but not for a sweep. Scanned surfaces have 0.005 to 0.05.
_ROUGH = {"sweep": 0.25, "unfold": 0.1}
# Up to so many vertices directions are found by windows, if the tolerance is smaller than the default. Walks of the
# tolerance 1e-6 take 0.7 to 0.9 times as long there, and at some vertices depart to the other side of a hill.
_FEW_FOR_DIRECTIONS = 50_000
# From open curves windows take 0.9 to 1.2 times as long as walks from points up to so many vertices, and 1.5 times on a
# bunny of 28 088. From closed curves they are as fast as those walks there, and faster on smaller scans.
_FEW_FROM_OPEN_CURVES = 10_000
# With this share of flat vertices, and holes that keep walks from proving flatness, windows are as fast as walks.
_FLAT = 0.5


def costs_little_to_be_exact(triangles: NumberedTriangles, refine: Refine) -> bool:
    """Whether the mesh is small or rough, or flat with holes."""
    return (
        triangles.n <= FEW
        or triangles.curvature > _ROUGH[refine]
        or (triangles.flatness > _FLAT and triangles.has_holes)
    )


def directions_by_windows(n: int, tolerance: float | None) -> bool:
    """Whether directions at n vertices are found by windows, as walks of a small tolerance would take as long."""
    if tolerance is None or tolerance >= TOLERANCE:
        return False
    return tolerance == 0 or n <= _FEW_FOR_DIRECTIONS


def curve_directions_by_windows(n: int, tolerance: float | None, are_closed: bool) -> bool:
    """Whether directions from curves at n vertices are found by windows: they measure from the curves themselves."""
    if tolerance is not None:
        return directions_by_windows(n, tolerance)
    return n <= (_FEW_FOR_DIRECTIONS if are_closed else _FEW_FROM_OPEN_CURVES)
