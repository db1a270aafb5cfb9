"""What people do with a distance, each a short module to read and to start from; notebooks/10_applications.ipynb."""

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
