"""Distance from vertex to vertex: sweeps over triangles, straight lines in bodies, the Hopf-Lax formula."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
