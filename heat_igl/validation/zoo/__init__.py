"""Shapes to try a default on: smooth, CAD, scattered points, terrain, hulls, voxels, mazes, slivers, components.

A default that is chosen on some meshes is measured on others. A third of these shapes is held out: nothing in the
package may be tuned on them (`Shape.held_out`).
"""

from __future__ import annotations

from heat_igl.validation.zoo import cad, carved, latest, rough, scattered, smooth  # noqa: F401 - they register their shapes
from heat_igl.validation.zoo.registry import SHAPES, Shape

__all__ = ["SHAPES", "Shape"]
