"""The three steps of the heat method, each to be tried alone: diffuse, normalize, integrate.

Algorithm 1 of the paper, on any domain that has `Operators`. The two steps that solve a system also exist as a class
that factors once, `HeatFlow` and `PoissonProblem`. Fields are arrays (n,) over vertices, or (n, k) for k right-hand
sides at once; vector fields are stacked by coordinate like the rows of G: (d m,) or (d m, k).
"""

from heat_igl.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
