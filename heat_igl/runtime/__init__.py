"""Execution: lazy loading, threads, blocks of right-hand sides, progress, memory, the range of doubles, warnings."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
