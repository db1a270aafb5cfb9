"""The unit vectors that point away from a vertex, integrated over the triangles around it."""

from __future__ import annotations

import numpy as np

from heat_igl.intrinsic import Adjacency, carried_angles, polar_angles, transport_angles
from heat_igl.intrinsic.triangulation import next_half_edge, previous_half_edge
from heat_igl.operators import Surface
from heat_igl.typing import AnyArray, FloatArray, IntArray

__all__ = ["outward_field", "ring"]

# Points of Gauss's rule over the angle of a corner.
_POINTS = 16


def ring(surface: Surface, vertex: int) -> tuple[IntArray, FloatArray]:
    """The neighbours (k,) of a vertex along edges of the triangulation, and the directions of these edges (k,)."""
    raise NotImplementedError


def outward_field(surface: Surface, vertex: int) -> tuple[IntArray, AnyArray]:
    raise NotImplementedError
