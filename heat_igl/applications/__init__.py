"""Applications: activation times, maps on a cortex, errors of matches, search on edges, particles in images.

notebooks/10_applications.ipynb shows them. `heat_igl.applications.torch` and `heat_igl.applications.jax`, distance as a
function that PyTorch and JAX differentiate, are imported by these names alone.
"""

from __future__ import annotations

from heat_igl.applications.activation import activation_times
from heat_igl.applications.edge_search import EdgePath, EdgeSearch
from heat_igl.applications.matches import geodesic_errors
from heat_igl.applications.particles import particle_length, reconstruct, skeleton, zones_of_influence
from heat_igl.applications.surface_maps import Statistic, parcel_distances, smooth

__all__ = [
    "Statistic",
    "EdgePath",
    "EdgeSearch",
    "activation_times",
    "geodesic_errors",
    "parcel_distances",
    "particle_length",
    "reconstruct",
    "skeleton",
    "smooth",
    "zones_of_influence",
]
