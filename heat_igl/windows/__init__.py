"""Exact polyhedral distance by windows: engines, local queries, directions, paths and their derivatives."""

from heat_igl.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
