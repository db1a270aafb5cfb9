"""The discrete Laplacian, mass, gradient and divergence of a domain: a function per kind returns `Operators`."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
