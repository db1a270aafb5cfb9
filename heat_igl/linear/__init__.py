"""Factor a symmetric positive definite matrix once, solve with it many times; knows matrices, never meshes."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
