"""What distance is measured on: meshes, images and point clouds, and points and curves on them."""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
