"""`HeatMethodSolver`: the steps put together, factored once, asked many times."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
