"""Grade distances: generated domains, closed forms to compare with, error norms, and reports on several methods."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
