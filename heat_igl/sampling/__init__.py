"""Sampling: farthest points, geodesic Voronoi cells and their dual, the diameter and distance matrices.

All functions ask a solver for distances from single vertices, so they work on every domain that has `Operators`, and
are as accurate as the solver.

Examples
--------
>>> import heat_igl
>>> heat_igl.sampling.farthest_points(heat_igl.shapes.strip(6, 1), 2).tolist()
[0, 13]
"""

from heat_igl.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
