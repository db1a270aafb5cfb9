"""Validation of the arguments of functions on regular grids."""

from __future__ import annotations

import numpy as np

from heat_igl.errors import SourceError
from heat_igl.typing import ArrayLike, BoolArray, FloatArray


def grid_sources(sources: ArrayLike) -> BoolArray:
    """`sources` as a boolean array; raises `SourceError` if it is not boolean or marks no point."""
    mask = np.asarray(sources)
    if mask.dtype.kind != "b" or mask.ndim == 0:
        raise SourceError(f"sources must be a boolean array with the shape of the grid, not {mask.dtype}")
    if not mask.any():
        raise SourceError("sources marks no point of the grid: set at least one entry")
    return mask


def grid_spacing(spacing: ArrayLike, dimension: int) -> FloatArray:
    """The step (d,) along each axis, from one number or one number per axis."""
    steps = np.asarray(spacing, dtype=np.float64)
    if steps.shape not in ((), (dimension,)) or not (np.isfinite(steps) & (steps > 0)).all():
        raise ValueError(f"spacing must be a positive number, or one for each of {dimension} axes, not {spacing!r}")
    return np.array(np.broadcast_to(steps, dimension))


def grid_domain(domain: ArrayLike | None, sources: BoolArray) -> BoolArray:
    """The mask of the points that paths may use, which must include the sources; all points if `domain` is None."""
    if domain is None:
        return np.ones(sources.shape, bool)
    mask = np.asarray(domain)
    if mask.dtype.kind != "b" or mask.shape != sources.shape:
        raise ValueError(
            f"domain must be a boolean array of shape {sources.shape}, not {mask.dtype} of shape {mask.shape}"
        )
    outside = int((sources & ~mask).sum())
    if outside:
        raise SourceError(f"{outside} of {int(sources.sum())} sources lie outside the domain")
    return mask
