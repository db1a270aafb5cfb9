"""Curves from a distance: isolines and the areas that they enclose, shortest paths."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
