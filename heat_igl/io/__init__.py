"""Files: reading and writing meshes with vertex attributes and point clouds, and writing curves."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
