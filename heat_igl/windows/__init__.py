"""Exact polyhedral distance by windows: engines, checks of answers, local queries and directions."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
