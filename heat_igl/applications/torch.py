"""Geodesic distance as a PyTorch function with a gradient by the positions of the vertices (extra ``torch``)."""

from __future__ import annotations

from typing import Any

import numpy as np

from heat_igl.applications.differentiable import check_positions, solver_on
from heat_igl.errors import MissingExtraError
from heat_igl.geodesic import GeodesicSolver

with MissingExtraError.guard("heat_igl.applications.torch", "torch", "torch"):
    import torch
    from torch.autograd.function import once_differentiable

__all__ = ["geodesic_distance"]


def geodesic_distance(
    V: torch.Tensor, F: Any, sources: Any, *, solver: GeodesicSolver | None = None, **options: Any
) -> torch.Tensor:
    """Distance from `sources`, differentiable by `V`.

    Parameters
    ----------
    V : (n, 3) tensor of float32 or float64, on the processor
        Positions of the vertices.
    F : (m, 3) tensor or array_like of int
        Triangles.
    sources : sources
        As for `GeodesicSolver.distance`; a tensor of vertices too.
    solver : GeodesicSolver, optional
        A solver on the same faces, with its own options: what the faces alone say is not found again. `F` is not read
        then.
    **options
        `method` and `tolerance` of `GeodesicSolver`.

    Returns
    -------
    (n,) tensor of V's type
        ``inf`` at unreachable vertices, whose gradient is 0. Found in float64. It can be differentiated once.

    Raises
    ------
    TypeError
        If V is no tensor of floating-point numbers, or `solver` is no GeodesicSolver.
    ValueError
        If V is on another device or has another shape, and as `GeodesicSolver.distance_vjp`.
    """
    if not isinstance(V, torch.Tensor):
        raise TypeError(f"V must be a tensor, not {type(V).__name__}: use GeodesicSolver.distance_vjp for arrays")
    if V.device.type != "cpu":
        raise ValueError(f"V is on the device {V.device}, and distance is found on the processor: pass V.cpu()")
    check_positions(tuple(V.shape), V.is_floating_point(), str(V.dtype))
    result: torch.Tensor = _Distance.apply(V, _as_array(F), _as_array(sources), solver, options)
    return result


def _as_array(value: Any) -> Any:
    """A tensor as an array; anything else as it is."""
    return value.detach().cpu().numpy() if isinstance(value, torch.Tensor) else value


class _Distance(torch.autograd.Function):
    """Keeps the derivative of the answer between the two passes."""

    @staticmethod
    def forward(ctx: Any, V: Any, F: Any, sources: Any, solver: GeodesicSolver | None, options: dict[str, Any]) -> Any:
        on_V = solver_on(V.detach().numpy(), F, solver, options)
        distance, ctx.pull_back = on_V.distance_vjp(sources)
        return torch.from_numpy(distance).to(V.dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, g: Any) -> tuple[Any, None, None, None, None]:
        by_position = ctx.pull_back(g.detach().numpy().astype(np.float64))
        return torch.from_numpy(by_position).to(g.dtype), None, None, None, None
