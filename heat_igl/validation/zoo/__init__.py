"""Shapes to try a default on: smooth, CAD, scattered points, terrain, hulls, voxels, mazes, slivers, components.

A default that is chosen on some meshes is measured on others. A third of these shapes is held out: nothing in the
package may be tuned on them (`Shape.held_out`). `FAMILIES` are kinds of shapes with a random member for each seed.
"""

from __future__ import annotations

from heat_igl.validation.zoo import families, fixed, nearly_flat  # noqa: F401 - they register their shapes
from heat_igl.validation.zoo.registry import FAMILIES, SHAPES, Shape

__all__ = ["FAMILIES", "SHAPES", "Shape"]
