"""Applications of geodesic distance: landmark-guided search on edges, and analysis of particles in binary images.

notebooks/10_applications.ipynb shows them. `heat_igl.torch` and `heat_igl.jax`, distance as a function that PyTorch and
JAX differentiate, are imported by these names alone.
"""

from __future__ import annotations

from heat_igl.applications.edge_search import EdgePath, EdgeSearch
from heat_igl.applications.particles import particle_length, reconstruct, skeleton, zones_of_influence

__all__ = [
    "EdgePath",
    "EdgeSearch",
    "particle_length",
    "reconstruct",
    "skeleton",
    "zones_of_influence",
]
