"""Geodesic distance on meshes by the heat method, with operators from libigl."""

from heat_igl.lazy import attached as _attached

__version__ = "0.1.0"
__all__, __getattr__, __dir__ = _attached(__name__, __file__)
