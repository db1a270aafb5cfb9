"""potpourri3d's classes and functions, with its names and arguments, computed by this package.

``import heat_igl.compat.potpourri3d as pp3d`` takes the place of ``import potpourri3d as pp3d``. Arguments, shapes and
meanings are those of potpourri3d 1.4; docs/compat.md lists what differs and what is not here.
"""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
