"""Applications: activation times, maps on a cortex, errors of matches.

notebooks/10_applications.ipynb shows them. `heat_igl.applications.torch` and `heat_igl.applications.jax`, distance as a
function that PyTorch and JAX differentiate, are imported by these names alone.
"""

from heat_igl.runtime.lazy import attached

__all__, __getattr__, __dir__ = attached(__name__, __file__)
