"""Geodesic distance as a JAX function with a gradient by the positions of the vertices (extra ``jax``)."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from heat_igl.applications.differentiable import check_positions, solver_on
from heat_igl.errors import MissingExtraError
from heat_igl.geodesic import GeodesicSolver

with MissingExtraError.guard("heat_igl.applications.jax", "jax", "jax"):
    import jax
    import jax.numpy as jnp

__all__ = ["geodesic_distance"]


def geodesic_distance(V: Any, F: Any, sources: Any, *, solver: GeodesicSolver | None = None, **options: Any) -> Any:
    """Distance from `sources`, differentiable by `V` in reverse mode, also under ``jax.jit``.

    Parameters
    ----------
    V : (n, 3) array of float32 or float64
        Positions of the vertices; may be traced.
    F, sources, solver, options
        As for `heat_igl.applications.torch.geodesic_distance`; not traced.

    Returns
    -------
    (n,) array of V's type
        ``inf`` at unreachable vertices, whose gradient is 0. Found in float64 on the processor, by a callback. The
        gradient finds the distance once more.

    Raises
    ------
    TypeError
        If V does not hold floating-point numbers, or `solver` is no GeodesicSolver.
    ValueError
        If V has another shape, and as `GeodesicSolver.distance_vjp`; under ``jit`` JAX wraps errors of the callback.
    """
    positions = jnp.asarray(V)
    check_positions(positions.shape, bool(jnp.issubdtype(positions.dtype, jnp.floating)), str(positions.dtype))
    faces = None if F is None else np.asarray(F)

    def on_host(V: Any, g: Any) -> Any:
        """The distance, or with `g` its derivative by the positions: outside of JAX."""
        found = solver_on(V, faces, solver, options)
        if g is None:
            return found.distance(sources).astype(V.dtype)
        _, pull_back = found.distance_vjp(sources)
        return pull_back(np.asarray(g, np.float64)).astype(V.dtype)

    def forward(V: Any) -> Any:
        shape = jax.ShapeDtypeStruct(V.shape[:1], V.dtype)
        return jax.pure_callback(partial(on_host, g=None), shape, V, vmap_method="sequential")

    def backward(V: Any, g: Any) -> tuple[Any]:
        shape = jax.ShapeDtypeStruct(V.shape, V.dtype)
        return (jax.pure_callback(on_host, shape, V, g, vmap_method="sequential"),)

    distance = jax.custom_vjp(forward)
    distance.defvjp(lambda V: (forward(V), V), backward)
    return distance(positions)
